//! What the server says: answers, feedback, states, errors. All JSON. Readers ignore fields they
//! don't know, so that later servers can add some.

use crate::stream::{Pose, Stamp};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

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

/// Answer of `ask/where`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct WhereReply {
    /// [`ANSWER_VERSION`].
    pub v: u32,
    /// `where`.
    pub query: String,
    /// The name or question as asked.
    pub name: String,
    /// How it was understood.
    pub resolved: Resolved,
    /// Of which map.
    pub map: MapIdentity,
    /// Stamp of the newest message in the answer's map.
    pub stamp: Stamp,
    /// Probability that it is nowhere in the map; sums to one with the candidates'.
    pub p_none: f64,
    /// Best first.
    pub candidates: Vec<Candidate>,
}

/// How a name was understood.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Resolved {
    /// The name as the map spells it; none if the question names nothing.
    pub label: Option<String>,
    /// `exact`, `unknown`, or another way of finding it.
    pub via: String,
}

/// A place that may be meant.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Candidate {
    /// Region id, never reused.
    pub region: u64,
    /// What it is called.
    pub label: String,
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
    /// From the robot to it.
    pub from_robot: Option<FromRobot>,
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

/// Answer of `ask/labels`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct LabelsReply {
    /// [`ANSWER_VERSION`].
    pub v: u32,
    /// `labels`.
    pub query: String,
    /// Of which map.
    pub map: MapIdentity,
    /// All names taught.
    pub labels: Vec<LabelEntry>,
}

/// A name.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct LabelEntry {
    /// The name.
    pub label: String,
    /// Utterances that spoke of it.
    pub utterances: u64,
    /// Region that most likely bears it.
    pub region: u64,
}

/// Answer of `ask/graph`, and what is published on `out/graph`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct GraphReply {
    /// [`ANSWER_VERSION`].
    pub v: u32,
    /// `graph`.
    pub query: String,
    /// Of which map.
    pub map: MapIdentity,
    /// Places of the best graph, in order of their ids.
    pub places: Vec<Place>,
    /// Distinct graphs, best first; weights sum to one.
    pub particles: Vec<Particle>,
    /// 1 / Σ w².
    pub effective_sample_size: f64,
}

/// A vertex of the best graph.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
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
    /// Particles that hold it.
    pub count: u32,
    /// Their weight together.
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

/// Answer of `ask/grid`: occupancy of the best graph, row 0 lowest y.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct GridReply {
    /// [`ANSWER_VERSION`].
    pub v: u32,
    /// `grid`.
    pub query: String,
    /// Of which map.
    pub map: MapIdentity,
    /// Edge of a cell.
    pub resolution_m: f64,
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Pose of the lower left corner in the map.
    pub map_from_grid: Pose,
    /// −1 unknown, 0 free … 100 occupied; row-major, `width · height` of them.
    pub cells: Vec<i8>,
}

/// On `out/heard`: what became of a sentence.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Heard {
    /// The sentence's id.
    pub id: String,
    /// What became of it.
    pub status: HeardStatus,
    /// Whether it is on disk, and will outlive the server.
    pub durable: bool,
    /// The analysis; empty if there is none.
    pub parse: String,
    /// Where it was put, best first.
    pub grounded: Vec<Grounded>,
    /// In words, for the guide.
    pub words: String,
    /// Why it was refused.
    pub error: Option<Problem>,
}

/// What became of a sentence.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum HeardStatus {
    /// The map knows it.
    Understood,
    /// Nothing changed.
    NotUnderstood,
    /// It could not be used.
    Refused,
}

/// A place a sentence may speak of.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Grounded {
    /// Its id.
    pub place: u64,
    /// With which probability.
    pub p: f64,
}

/// On `out/pose`, after every scan.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PoseOut {
    /// [`ANSWER_VERSION`].
    pub v: u32,
    /// Whose.
    pub robot: String,
    /// In which map; `rev` is that of the newest published graph.
    pub map: MapIdentity,
    /// Of the scan.
    pub stamp: Stamp,
    /// Correction of odometry (REP-105).
    pub map_from_odom: Pose,
    /// The body in the map.
    pub map_from_body: Pose,
    /// Covariance of `map_from_body`, row-major x y yaw, m² and rad²; the perturbation is on the
    /// body's side.
    pub covariance: [f64; 9],
    /// Whether to believe it.
    pub state: PoseState,
}

/// How well a robot knows where it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum PoseState {
    /// The map grows.
    Mapping,
    /// The robot is found in a map that is kept.
    Localised,
    /// It isn't known.
    Lost,
}

/// On `out/ack`: everything of this boot up to and with `seq` was handed to the map, or given up.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Ack {
    /// [`ANSWER_VERSION`].
    pub v: u32,
    /// Whose stream.
    pub robot: String,
    /// Which boot.
    pub boot: u64,
    /// The watermark; nothing at or below it need be sent again.
    pub seq: u64,
    /// Whether all of it is in a record on disk.
    pub durable: bool,
    /// Messages given up since the server started.
    pub lost: u64,
}

/// On `out/state`: how the server gets along with a robot.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct RobotState {
    /// [`ANSWER_VERSION`].
    pub v: u32,
    /// Which robot.
    pub robot: String,
    /// The map its streams go to; none before an accepted setup.
    pub map: Option<String>,
    /// Boot of the newest message.
    pub boot: Option<u64>,
    /// Since the server started.
    pub counts: Counts,
    /// The newest refusal.
    pub error: Option<Problem>,
}

/// Messages of a robot since the server started.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Counts {
    /// Handed to the map.
    pub taken: u64,
    /// Refused: undecodable, invalid, or for a map that is another robot's.
    pub refused: u64,
    /// Came again and were dropped.
    pub repeated: u64,
    /// Of an earlier boot than the newest, dropped.
    pub stale: u64,
    /// Never came, or came too late: data loss.
    pub lost: u64,
}

/// On `map/{map}/out/jump`: coordinates of the map changed.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Jump {
    /// [`ANSWER_VERSION`].
    pub v: u32,
    /// The map, with the epoch after the jump.
    pub map: MapIdentity,
    /// New map frame from old, through the robot's current pose.
    pub new_from_old: Pose,
}

/// Answer of `info`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Info {
    /// [`ANSWER_VERSION`].
    pub v: u32,
    /// Program and version.
    pub server: String,
    /// Site.
    pub site: String,
    /// The maps there are.
    pub maps: Vec<MapIdentity>,
    /// The robots that were heard.
    pub robots: Vec<RobotState>,
    /// Messages dropped because the server could not keep up: data loss.
    pub overrun: u64,
}

/// Answer of a command that succeeded.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Done {
    /// [`ANSWER_VERSION`].
    pub v: u32,
    /// The command.
    pub query: String,
    /// The maps it concerned.
    pub maps: Vec<String>,
}

/// Payload of an error reply.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct ErrorReply {
    /// What went wrong.
    pub error: Problem,
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
    /// The robot doesn't know where it is.
    NotLocalised,
    /// The map is another robot's.
    MapTaken,
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
            resolved: Resolved { label: Some("kitchen".into()), via: "exact".into() },
            map: MapIdentity { id: "h1".into(), ..Default::default() },
            stamp: Stamp { ns: 1_000_000_005 },
            p_none: 0.25,
            candidates: vec![Candidate {
                region: 12,
                label: "kitchen".into(),
                probability: 0.75,
                p_is: 0.97,
                x_m: 4.0,
                y_m: -2.0,
                yaw_rad: 0.0,
                cov: [0.0; 9],
                polygon_m: vec![],
                goal: Some(Goal { x_m: 4.0, y_m: -2.0, yaw_rad: 0.0, reachable: Reachable::Unknown }),
                from_robot: None,
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
    }
}
