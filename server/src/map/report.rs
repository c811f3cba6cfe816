//! The report of `map`: JSON, byte-identical for the same log, options and build, but for
//! `timing`. Stamps are the log's, seconds; metres and radians in the trajectory's frame.

use super::play::Played;
use super::timing::Timing;
use crate::convert;
use serde::Serialize;
use std::collections::BTreeMap;
use toponym::log::Notes;
use toponym_core::Config;
use toponym_core::answers::query::{GraphAnswer, WhereAnswer};
use toponym_core::edge::{EdgeKind, PlaceId};
use toponym_core::effects::{Heard, HeardStatus, Suspicion, TrackState};
use toponym_proto::answer::{Candidate, Difference, MapIdentity};
use toponym_proto::stream::Stamp;

/// The whole report.
#[derive(Debug, Serialize)]
pub struct Report {
    /// Places of the best graph.
    pub places: Vec<Place>,
    /// One row per distinct graph, best first; weights sum to one with `unresolved`.
    pub particles: Vec<Particle>,
    /// Posterior mass of graphs that were dropped.
    pub unresolved: f64,
    /// What the best graphs disagree about.
    pub differences: Vec<Difference>,
    /// What seemed wrong with the robot's senses: an entry of each kind.
    pub health: Vec<Suspected>,
    /// How well the robot knew where it was: an entry at each change.
    pub states: Vec<Standing>,
    /// Answers to the questions asked.
    pub answers: Vec<Answer>,
    /// What became of the sentences.
    pub utterances: Vec<Utterance>,
    /// What was run.
    pub run: Run,
    /// How long it took.
    pub timing: Timing,
}

/// A place.
#[derive(Debug, Serialize)]
pub struct Place {
    /// Its id.
    pub id: PlaceId,
    /// Stamp of its first scan.
    pub stamp_s: f64,
    /// Metres.
    pub x_m: f64,
    /// Metres.
    pub y_m: f64,
    /// Radians.
    pub yaw_rad: f64,
    /// Names with the probability that each applies.
    pub labels: BTreeMap<String, f64>,
}

/// A distinct graph.
#[derive(Debug, Serialize)]
pub struct Particle {
    /// Its posterior mass.
    pub weight: f64,
    /// Its loop edges.
    pub edges: Vec<Edge>,
    /// `[x, y, yaw]` of each place in this graph's own map, in the order of `places`.
    pub poses: Vec<[f64; 3]>,
}

/// A loop edge: place j in the frame of place i.
#[derive(Debug, Serialize)]
pub struct Edge {
    /// Older place.
    pub i: PlaceId,
    /// Newer place.
    pub j: PlaceId,
    /// How it was proposed.
    pub kind: EdgeKind,
    /// Metres.
    pub dx_m: f64,
    /// Metres.
    pub dy_m: f64,
    /// Radians.
    pub dyaw_rad: f64,
}

/// An answered question.
#[derive(Debug, Serialize)]
pub struct Answer {
    /// As asked.
    pub question: String,
    /// The name it was taken to ask for.
    pub label: Option<String>,
    /// Probability that it is nowhere in the map.
    pub p_none: f64,
    /// Posterior mass of graphs that were dropped; part of `p_none`.
    pub unresolved: f64,
    /// Best first.
    pub candidates: Vec<Candidate>,
}

/// A sentence.
#[derive(Debug, Serialize)]
pub struct Utterance {
    /// When it began.
    pub stamp_s: f64,
    /// What was said.
    pub text: String,
    /// The analysis.
    pub parse: String,
    /// What became of it.
    pub status: HeardStatus,
    /// Where it was put in the best particle of that time, best first.
    pub grounded: Vec<Grounded>,
}

/// A place that a sentence was put to.
#[derive(Debug, Serialize)]
pub struct Grounded {
    /// The place.
    pub place: PlaceId,
    /// With which probability.
    pub p: f64,
}

/// What was run.
#[derive(Debug, Serialize)]
pub struct Run {
    /// The mapper's settings.
    pub config: Config,
    /// Seed of every draw.
    pub seed: u64,
    /// Version and, where the build knew it, commit.
    pub build: String,
    /// Fingerprint of all messages, in order.
    pub input_hash: String,
    /// Scans that found a pose.
    pub scans_placed: u64,
    /// Scans dropped, by reason.
    pub scans_dropped: BTreeMap<String, u64>,
    /// Odometry segments after the first.
    pub segments: Vec<Segment>,
    /// Lines of the log that could not be read.
    pub bad_lines: u64,
    /// Particles, after weights.
    pub effective_sample_size: f64,
}

/// Odometry began anew.
#[derive(Debug, Serialize)]
pub struct Segment {
    /// When.
    pub stamp_s: f64,
    /// Why.
    pub reason: String,
}

/// Something seemed wrong with the robot's senses.
#[derive(Debug, Serialize)]
pub struct Suspected {
    /// When it showed.
    pub stamp_s: f64,
    /// `clocks`, `frozen`, `blind`, `still` or `contradiction`.
    pub what: Suspicion,
    /// In words.
    pub why: String,
}

/// How well the robot knew where it was.
#[derive(Debug, Serialize)]
pub struct Standing {
    /// From when on.
    pub stamp_s: f64,
    /// `mapping`, `localised`, `doubtful` or `lost`.
    pub state: TrackState,
    /// In words.
    pub why: String,
}

fn seconds(ns: i64) -> f64 {
    Stamp { ns }.seconds()
}

/// Puts a report together.
pub fn report(
    played: &Played,
    graph: &GraphAnswer,
    answers: Vec<WhereAnswer>,
    notes: &Notes,
    robot: &str,
    timing: Timing,
) -> Report {
    let config = played.mapper.config().clone();
    let segments = played.segments.iter();
    Report {
        places: graph.places.iter().map(place).collect(),
        particles: graph.particles.iter().map(particle).collect(),
        unresolved: graph.unresolved,
        differences: graph.differences.iter().cloned().map(convert::difference).collect(),
        health: played.suspicions.iter().map(suspected).collect(),
        states: played.states.iter().map(state).collect(),
        answers: answers.into_iter().map(|a| answer(a, robot)).collect(),
        utterances: played.heard.iter().map(utterance).collect(),
        run: Run {
            seed: config.seed,
            config,
            build: build(),
            input_hash: played.input_hash(),
            scans_placed: played.scans_placed,
            scans_dropped: played.scans_dropped.clone(),
            segments: segments
                .map(|(ns, reason)| Segment { stamp_s: seconds(*ns), reason: reason.clone() })
                .collect(),
            bad_lines: notes.bad_lines,
            effective_sample_size: graph.effective_sample_size,
        },
        timing,
    }
}

/// Version and, where the build was told it (`TOPONYM_COMMIT`), commit.
pub fn build() -> String {
    let version = env!("CARGO_PKG_VERSION");
    option_env!("TOPONYM_COMMIT").map_or_else(|| version.into(), |commit| format!("{version}+{commit}"))
}

fn place(p: &toponym_core::answers::query::PlaceView) -> Place {
    Place {
        id: p.id,
        stamp_s: seconds(p.stamp_ns),
        x_m: p.pose.x_m,
        y_m: p.pose.y_m,
        yaw_rad: p.pose.yaw_rad,
        labels: p.labels.iter().cloned().collect(),
    }
}

fn particle(p: &toponym_core::answers::query::ParticleView) -> Particle {
    let edges = p.edges.iter().map(|e| Edge {
        i: e.i,
        j: e.j,
        kind: e.kind,
        dx_m: e.i_from_j.x_m,
        dy_m: e.i_from_j.y_m,
        dyaw_rad: e.i_from_j.yaw_rad,
    });
    let poses = p.poses.iter().map(|p| [p.x_m, p.y_m, p.yaw_rad]);
    Particle { weight: p.weight, edges: edges.collect(), poses: poses.collect() }
}

pub fn answer(a: WhereAnswer, robot: &str) -> Answer {
    // As on the wire, without what says of which map it is.
    let reply = convert::where_reply(a, MapIdentity::default(), Stamp::default(), robot);
    Answer {
        question: reply.name,
        label: reply.resolved.label,
        p_none: reply.p_none,
        unresolved: reply.unresolved,
        candidates: reply.candidates,
    }
}

fn suspected((stamp_ns, what, why): &(i64, Suspicion, String)) -> Suspected {
    Suspected { stamp_s: seconds(*stamp_ns), what: *what, why: why.clone() }
}

fn state((ns, state, why): &(i64, TrackState, String)) -> Standing {
    Standing { stamp_s: seconds(*ns), state: *state, why: why.clone() }
}

fn utterance(h: &Heard) -> Utterance {
    Utterance {
        stamp_s: seconds(h.stamp_ns),
        text: h.text.clone(),
        parse: h.parse.clone(),
        status: h.status,
        grounded: h.grounded.iter().map(|&(place, p)| Grounded { place, p }).collect(),
    }
}
