//! What the server answers, and its errors. All JSON. Readers ignore fields they don't know, so
//! that later servers can add some.

use crate::stream::Stamp;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

pub use crate::grid::GridReply;
pub use crate::regions::{Called, LabelEntry, LabelsReply, WhatReply};

pub use crate::feedback::{
    Ack, Clocks, Counts, Done, Grounded, Heard, HeardStatus, Info, Jump, Machine, MapWork, Mended, PoseOut,
    PoseState, RobotState,
};

/// `v` of every answer.
pub const ANSWER_VERSION: u32 = 1;

/// Which map, and which state of it.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct MapIdentity {
    /// Given id.
    pub id: String,
    /// Born once with the map.
    pub uuid: String,
    /// +1 when coordinates jump.
    pub epoch: u64,
    /// +1 per change.
    pub rev: u64,
    /// Floor, where it was told.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub level: Option<String>,
}

/// Answer of `ask/where`, and of `ask/nearest`: there `probability` is that it is the nearest that is so, by the way
/// there.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct WhereReply {
    /// [`ANSWER_VERSION`].
    pub v: u32,
    /// `where` or `nearest`.
    pub query: String,
    /// The name or question as asked.
    pub name: String,
    /// How it was understood.
    pub resolved: Resolved,
    /// Of which map.
    pub map: MapIdentity,
    /// Stamp of the newest message in the answer's map.
    pub stamp: Stamp,
    /// Probability that it is nowhere in the map, or that the map is none of those kept; sums to one with
    /// the candidates'.
    pub p_none: f64,
    /// Posterior mass of graphs that were dropped; part of `p_none`.
    #[serde(default)]
    pub unresolved: f64,
    /// Best first.
    pub candidates: Vec<Candidate>,
}

/// How a name was understood.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Resolved {
    /// The name as the map spells it; none if the question names nothing.
    pub label: Option<String>,
    /// `exact`, `kind`, `synonym`, `sound`, `here`, `unknown`, or another way of finding it.
    pub via: String,
    /// Names that may have been meant where this one is unknown.
    #[serde(default)]
    pub suggestions: Vec<String>,
}

/// A place that may be meant.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Candidate {
    /// Region id, never reused.
    pub region: u64,
    /// What it is called.
    pub label: String,
    /// The same as a guide spells it.
    #[serde(default)]
    pub shown: String,
    /// Probability that this one is meant.
    pub probability: f64,
    /// Probability that it is called so.
    pub p_is: f64,
    /// Metres, map frame.
    pub x_m: f64,
    /// Metres, map frame.
    pub y_m: f64,
    /// Radians, map frame.
    pub yaw_rad: f64,
    /// Covariance, row-major x y yaw, map axes, m² and rad².
    pub cov: [f64; 9],
    /// Outline in the map frame, metres; empty where it isn't known.
    #[serde(default)]
    pub polygon_m: Vec<[f64; 2]>,
    /// Where to send a robot.
    pub goal: Option<Goal>,
    /// From the robot to it; none while the robot is lost.
    pub from_robot: Option<FromRobot>,
    /// Length of the way there from the robot, metres; `ask/nearest` alone tells it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub walk_m: Option<f64>,
    /// Ids of the utterances behind it.
    pub because: Vec<String>,
}

/// A pose to send a robot to.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Goal {
    /// Metres, map frame.
    pub x_m: f64,
    /// Metres, map frame.
    pub y_m: f64,
    /// Radians, map frame.
    pub yaw_rad: f64,
    /// Whether there is a way.
    pub reachable: Reachable,
}

/// Answer of `do/go`; with a goal it is published on the robot's `out/goal`, for whatever drives it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Sent {
    /// [`ANSWER_VERSION`].
    pub v: u32,
    /// `go`.
    pub query: String,
    /// Which robot.
    pub robot: String,
    /// In which map the goal stands.
    pub map: MapIdentity,
    /// Stamp of the newest message in that map.
    pub stamp: Stamp,
    /// What it was sent to, as a guide spells it.
    pub name: String,
    /// Where that is; none where it is rather nowhere, or nobody can get there: then nothing is published.
    pub goal: Option<Goal>,
    /// Probability that this is the one meant.
    pub probability: f64,
    /// For people.
    pub words: String,
}

/// Whether there is a way.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Reachable {
    /// There is.
    Yes,
    /// There is none.
    No,
    /// Nobody looked.
    Unknown,
}

/// The straight line from a robot.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FromRobot {
    /// Which robot.
    pub robot: String,
    /// Metres.
    pub distance_m: f64,
    /// Radians from straight ahead, counter-clockwise, (−π, π].
    pub bearing_rad: f64,
}

/// Answer of `ask/graph`, and what is published on `out/graph`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct GraphReply {
    /// [`ANSWER_VERSION`].
    pub v: u32,
    /// `graph`.
    pub query: String,
    /// Of which map.
    pub map: MapIdentity,
    /// Places of the best graph, in order of their ids.
    pub places: Vec<Place>,
    /// Distinct graphs, best first; weights sum to one with `unresolved`.
    pub particles: Vec<Particle>,
    /// Posterior mass of graphs that were dropped.
    #[serde(default)]
    pub unresolved: f64,
    /// What the best graphs disagree about; empty where one is all there is.
    #[serde(default)]
    pub differences: Vec<Difference>,
    /// 1 / Σ w² among those kept.
    pub effective_sample_size: f64,
}

/// One way that the map can be, in what it differs from the others told.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Difference {
    /// Weight of the graph.
    pub weight: f64,
    /// For people: "place 41 is place 7 again".
    pub words: String,
}

/// A vertex of the best graph.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Place {
    /// Its id.
    pub id: u64,
    /// Stamp of its first scan.
    pub stamp: Stamp,
    /// Metres, map frame.
    pub x_m: f64,
    /// Metres, map frame.
    pub y_m: f64,
    /// Radians, map frame.
    pub yaw_rad: f64,
    /// Probability that each name applies.
    pub labels: BTreeMap<String, f64>,
}

/// A distinct graph of the posterior.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Particle {
    /// Its posterior mass; all sum to one with what is unresolved.
    pub weight: f64,
    /// Its loop edges; the chain of successive places is implied.
    pub edges: Vec<Edge>,
}

/// A loop edge: the pose of j in i.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Edge {
    /// Older place.
    pub i: u64,
    /// Newer place.
    pub j: u64,
    /// `distance`, `semantic` or `relocalisation`.
    pub kind: String,
    /// Metres.
    pub dx_m: f64,
    /// Metres.
    pub dy_m: f64,
    /// Radians.
    pub dyaw_rad: f64,
}

/// Payload of an error reply.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct ErrorReply {
    /// What went wrong.
    pub error: Problem,
}

impl WhereReply {
    /// Whether it is rather somewhere than nowhere.
    pub fn is_found(&self) -> bool {
        let likeliest = self.candidates.iter().map(|c| c.probability).fold(0.0, f64::max);
        likeliest > 0.0 && likeliest >= self.p_none
    }
}

/// What went wrong, and what to do.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, thiserror::Error)]
#[error("{message}")]
pub struct Problem {
    /// For programs.
    pub code: ErrorCode,
    /// For people.
    pub message: String,
    /// The field or argument or key at fault.
    pub field: Option<String>,
    /// What to do.
    pub hint: Option<String>,
}

impl Problem {
    /// Without field and hint.
    pub fn new(code: ErrorCode, message: impl Into<String>) -> Self {
        Self { code, message: message.into(), field: None, hint: None }
    }

    /// Names the field at fault.
    #[must_use]
    pub fn field(mut self, field: impl Into<String>) -> Self {
        self.field = Some(field.into());
        self
    }

    /// Says what to do.
    #[must_use]
    pub fn hint(mut self, hint: impl Into<String>) -> Self {
        self.hint = Some(hint.into());
        self
    }
}

impl From<crate::Invalid> for Problem {
    fn from(invalid: crate::Invalid) -> Self {
        Self::new(ErrorCode::BadArgument, invalid.to_string()).field(invalid.field)
    }
}

/// What went wrong, for programs.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ErrorCode {
    /// The map asked doesn't exist.
    NoSuchMap,
    /// The robot addressed doesn't exist.
    NoSuchRobot,
    /// The key asked doesn't exist.
    NoSuchQuery,
    /// There are several robots: say which.
    RobotAmbiguous,
    /// A message, field or argument is wrong.
    BadArgument,
    /// The server can't keep up, or starts, or stops: try again.
    Busy,
    /// Longer or larger than the limits.
    TooLarge,
    /// The robot doesn't know where it is, and what was asked counts from there.
    NotLocalised,
    /// The map is another robot's.
    MapTaken,
    /// No such sentence or name.
    NothingToMend,
    /// This server can't do it yet.
    Unsupported,
    /// The server's fault.
    Internal,
    /// A code of a later server.
    #[serde(other)]
    Unknown,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_answer_looks_as_documented() {
        let reply = WhereReply {
            v: ANSWER_VERSION,
            query: "where".into(),
            name: "kitchen".into(),
            resolved: Resolved {
                label: Some("kitchen".into()),
                via: "exact".into(),
                suggestions: Vec::new(),
            },
            map: MapIdentity { id: "h1".into(), ..Default::default() },
            stamp: Stamp { ns: 1_000_000_005 },
            p_none: 0.25,
            unresolved: 0.1,
            candidates: vec![Candidate {
                region: 12,
                label: "kitchen".into(),
                shown: "kitchen".into(),
                probability: 0.75,
                p_is: 0.97,
                x_m: 4.0,
                y_m: -2.0,
                yaw_rad: 0.0,
                cov: [0.0; 9],
                polygon_m: vec![],
                goal: Some(Goal { x_m: 4.0, y_m: -2.0, yaw_rad: 0.0, reachable: Reachable::Unknown }),
                from_robot: None,
                walk_m: None,
                because: vec!["01J".into()],
            }],
        };
        let json = serde_json::to_value(&reply).unwrap();
        assert_eq!(json["stamp"], serde_json::json!({"sec": 1, "nanosec": 5}));
        assert_eq!(json["candidates"][0]["goal"]["reachable"], "unknown");
        assert_eq!(serde_json::from_value::<WhereReply>(json).unwrap(), reply);
    }

    #[test]
    fn readers_pass_over_what_later_servers_add() {
        let text =
            r#"{"error": {"code": "on_fire", "message": "m", "field": null, "hint": null, "more": 1}}"#;
        let reply: ErrorReply = serde_json::from_str(text).unwrap();
        assert_eq!(reply.error.code, ErrorCode::Unknown);
        let states = ["mapping", "localised", "doubtful", "lost", "asleep"].map(serde_json::Value::from);
        let states = states.map(|s| serde_json::from_value::<PoseState>(s).unwrap());
        assert_eq!(states[2..], [PoseState::Doubtful, PoseState::Lost, PoseState::Unknown]);
        // An earlier server tells neither what is unresolved nor what graphs differ in.
        let old = r#"{"v": 1, "query": "graph", "map": {"id": "m", "uuid": "u", "epoch": 0, "rev": 0},
                      "places": [], "particles": [], "effective_sample_size": 1.0}"#;
        let old: GraphReply = serde_json::from_str(old).unwrap();
        assert!(old.unresolved.abs() < f64::EPSILON && old.differences.is_empty());
    }
}
