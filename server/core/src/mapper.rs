//! The core's public face.
use crate::query::{GraphAnswer, WhereAnswer};
use crate::{Answer, Config, Effects, Event, Query};
use std::sync::Arc;

/// One map and the robot on it.
pub struct Mapper {
    config: Config,
}

/// The posterior at one moment: answers questions, never changes.
pub struct Snapshot {}

/// A saved map could not be written or read.
#[derive(Debug, thiserror::Error)]
pub enum SaveError {
    /// The encoder refused.
    #[error("the map could not be encoded: {0}")]
    Encode(String),
    /// These bytes are not a saved map of this build.
    #[error("not a saved map that this build can read: {0}")]
    Decode(String),
}

impl Mapper {
    /// An empty map.
    pub fn new(config: Config) -> Self {
        Self { config }
    }
    /// Takes one event.
    pub fn step(&mut self, _event: Event) -> Effects {
        Vec::new()
    }
    /// Answers from the newest snapshot.
    pub fn answer(&self, query: &Query) -> Answer {
        self.snapshot().answer(query)
    }
    /// The posterior now.
    pub fn snapshot(&self) -> Arc<Snapshot> {
        Arc::new(Snapshot {})
    }
    /// The whole mapper as bytes.
    pub fn save(&self) -> Result<Vec<u8>, SaveError> {
        Ok(Vec::new())
    }
    /// What [`Mapper::save`] wrote.
    pub fn load(_bytes: &[u8]) -> Result<Self, SaveError> {
        Ok(Self { config: Config::default() })
    }
    /// Its settings.
    pub fn config(&self) -> &Config {
        &self.config
    }
}

impl Snapshot {
    /// Answers a question; never fails: not knowing is an answer.
    pub fn answer(&self, query: &Query) -> Answer {
        match query {
            Query::Where { text } => Answer::Where(WhereAnswer {
                text: text.clone(),
                label: None,
                via: "unknown".into(),
                p_none: 1.0,
                candidates: vec![],
                robot: None,
            }),
            Query::Labels => Answer::Labels(vec![]),
            Query::Graph | Query::Grid { .. } => Answer::Graph(self.graph()),
        }
    }
    /// All graphs.
    pub fn graph(&self) -> GraphAnswer {
        GraphAnswer { epoch: 0, rev: 0, places: vec![], particles: vec![], effective_sample_size: 0.0 }
    }
}
