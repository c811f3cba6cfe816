//! The planner's role: asks where things are. Questions change nothing.

use crate::session::{ClientError, ask};
use std::time::Duration;
use toponym_proto::answer::{Done, GraphReply, GridReply, Info, LabelsReply, WhereReply};
use toponym_proto::keys::{Ask, Keys, check_id};
use toponym_proto::selector;
use zenoh::Session;

/// Asks one map of one site.
#[derive(Clone, Debug)]
pub struct Planner {
    session: Session,
    keys: Keys,
    map: String,
    timeout: Duration,
}

impl Planner {
    /// For a map of a site; each question waits up to `timeout`.
    ///
    /// # Errors
    /// If site or map are no ids.
    pub fn new(session: &Session, site: &str, map: &str, timeout: Duration) -> Result<Self, ClientError> {
        check_id("map", map)?;
        Ok(Self { session: session.clone(), keys: Keys::new(site)?, map: map.into(), timeout })
    }

    /// Where is what people call so? A bare name ("gym") or a whole question ("where is the
    /// gym"). An unknown name is an answer without candidates, no error.
    pub async fn where_is(&self, name: &str) -> Result<WhereReply, ClientError> {
        let arguments = selector::encode([("name", name)]);
        ask(&self.session, &self.keys.ask(&self.map, Ask::Where), &arguments, self.timeout).await
    }

    /// All names taught so far.
    pub async fn labels(&self) -> Result<LabelsReply, ClientError> {
        ask(&self.session, &self.keys.ask(&self.map, Ask::Labels), "", self.timeout).await
    }

    /// Places and edges of the posterior's graphs.
    pub async fn graph(&self) -> Result<GraphReply, ClientError> {
        ask(&self.session, &self.keys.ask(&self.map, Ask::Graph), "", self.timeout).await
    }

    /// Occupancy of the best graph, in cells of `resolution_m`.
    pub async fn grid(&self, resolution_m: f64) -> Result<GridReply, ClientError> {
        let resolution_m = resolution_m.to_string();
        let arguments = selector::encode([("resolution_m", resolution_m.as_str())]);
        ask(&self.session, &self.keys.ask(&self.map, Ask::Grid), &arguments, self.timeout).await
    }

    /// Saves the map. The answer comes after everything that was acknowledged before has gone
    /// through the filter.
    pub async fn save(&self) -> Result<Done, ClientError> {
        let arguments = selector::encode([("map", self.map.as_str())]);
        ask(&self.session, &self.keys.command("save"), &arguments, self.timeout).await
    }

    /// The server's maps and robots.
    pub async fn info(&self) -> Result<Info, ClientError> {
        ask(&self.session, &self.keys.info(), "", self.timeout).await
    }
}
