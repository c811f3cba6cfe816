//! Maps a tour in process and keeps what is scored.

use crate::graph::{Answer, Graphs};
use crate::score::{Mapped, Moment};
use crate::truth::Truth;
use anyhow::{Context, Result};
use cpu_time::ThreadTime;
use std::time::Duration;
use toponym_core::edge::PlaceId;
use toponym_core::{Config, Effect, Event, Mapper, Pose2, Query};
use toponym_proto::Message;
use toponym_proto::merge::order_stamp;
use toponym_server::convert;
use toponym_server::map::Preset;

/// A tour of one seed in one language, ready to be mapped.
#[derive(Clone, Debug)]
pub struct Case {
    /// Its seed, which is the filter's, too.
    pub seed: u64,
    /// All that robot and guide send.
    pub messages: Vec<Message>,
    /// What it is scored against.
    pub truth: Truth,
    /// What a reference gives each hypothesis at each checkpoint.
    pub reference: Option<Vec<Vec<f64>>>,
}

/// How it is mapped.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Settings {
    /// Particles.
    pub particles: u32,
    /// How sentences are taken in.
    pub preset: Preset,
}

/// Maps on one thread, so that processor time means the same for whoever else is busy.
pub fn map(case: &Case, settings: Settings) -> Result<Mapped> {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().context("no thread can be started")?;
    Ok(pool.install(|| Run::new(case, settings).play(case)))
}

/// A tour being mapped.
struct Run {
    mapper: Mapper,
    spent: Duration,
    /// Stamp, place and pose in it of each scan.
    scans: Vec<(i64, PlaceId, Pose2)>,
    checkpoints: Vec<Option<Graphs>>,
    moments: Vec<Moment>,
}

impl Run {
    fn new(case: &Case, settings: Settings) -> Self {
        let Settings { particles, preset } = settings;
        let config = preset.config(Config { particles, seed: case.seed, ..Config::default() });
        Self {
            mapper: Mapper::new(config),
            spent: Duration::ZERO,
            scans: Vec::new(),
            checkpoints: Vec::new(),
            moments: Vec::new(),
        }
    }

    fn play(mut self, case: &Case) -> Mapped {
        let checkpoints_s = &case.truth.checkpoints_s;
        for message in &case.messages {
            let next_s = checkpoints_s.get(self.checkpoints.len()..checkpoints_s.len() - 1);
            let t_s = order_stamp(message).seconds();
            let passed = next_s.unwrap_or_default().iter().filter(|c| t_s > **c).count();
            for _ in 0..passed {
                self.checkpoints.push(Some(self.graphs()));
            }
            self.step(convert::event(message.clone()), &case.truth);
        }
        self.step(Event::Flush, &case.truth);
        self.checkpoints.resize(checkpoints_s.len() - 1, None);
        self.end(&case.truth)
    }

    fn step(&mut self, event: Event, truth: &Truth) {
        let began = ThreadTime::now();
        let effects = self.mapper.step(event);
        self.spent += began.elapsed();
        let mut grew = false;
        for effect in effects {
            match effect {
                Effect::ScanPlaced { stamp_ns, place, place_from_body, .. } => {
                    self.scans.push((stamp_ns, place, place_from_body));
                }
                Effect::PlaceBegan { .. } => grew = true,
                _ => {}
            }
        }
        if grew {
            self.moments.extend(Moment::of(&self.graphs(), truth));
        }
    }

    fn graphs(&self) -> Graphs {
        Graphs::of(self.mapper.snapshot().graph())
    }

    fn end(mut self, truth: &Truth) -> Mapped {
        let graph = self.mapper.snapshot().graph();
        let pose = |id: PlaceId| graph.places.iter().find(|p| p.id == id).map(|p| p.pose);
        let row = |(stamp_ns, place, place_from_body): &(i64, PlaceId, Pose2)| {
            Some((*stamp_ns as f64 * 1e-9, pose(*place)?.compose(place_from_body)))
        };
        let trajectory = self.scans.iter().filter_map(row).collect();
        let answers = truth.questions.iter().filter_map(|q| self.ask(&q.text)).collect();
        let unresolved = Some(graph.unresolved);
        self.checkpoints.push(Some(Graphs::of(graph)));
        let (from_s, to_s) = truth.path.span_s();
        Mapped {
            checkpoints: self.checkpoints,
            moments: self.moments,
            trajectory,
            answers,
            unresolved,
            cpu_ms_per_s: (to_s > from_s).then(|| self.spent.as_secs_f64() * 1e3 / (to_s - from_s)),
        }
    }

    fn ask(&self, question: &str) -> Option<Answer> {
        match self.mapper.answer(&Query::Where { text: question.into(), lang: None }) {
            toponym_core::Answer::Where(answer) => Some(Answer::of(&answer)),
            _ => None,
        }
    }
}
