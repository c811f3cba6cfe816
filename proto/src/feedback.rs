//! What the server publishes of its own accord, and its answers about itself.

use crate::answer::{MapIdentity, Problem};
use crate::stream::{Pose, Stamp};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

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
    /// What the guide is asked, to be answered by a sentence that `answers` this one: yes or no.
    #[serde(default)]
    pub question: Option<String>,
    /// Why it was refused.
    pub error: Option<Problem>,
}

impl Heard {
    /// What became of a sentence, without more: not durable, no reading, no words.
    pub fn new(id: &str, status: HeardStatus) -> Self {
        Self {
            id: id.into(),
            status,
            durable: false,
            parse: String::new(),
            grounded: Vec::new(),
            words: String::new(),
            question: None,
            error: None,
        }
    }
}

/// What became of a sentence.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum HeardStatus {
    /// It is on disk, and was read; what becomes of it is told next.
    Read,
    /// The map knows it.
    Understood,
    /// The guide is asked something first.
    Asked,
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
    /// [`crate::answer::ANSWER_VERSION`].
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
    /// The pose may be wrong: less than 95 % of the posterior is within 1 m and 10° of it.
    Doubtful,
    /// It more likely is: less than half of the posterior is.
    Lost,
    /// A state of a later server: not to be relied on.
    #[serde(other)]
    Unknown,
}

/// On `out/ack`: everything of this boot up to and with `seq` is on disk and will be in the map, whatever happens;
/// or it was given up.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Ack {
    /// [`crate::answer::ANSWER_VERSION`].
    pub v: u32,
    /// Whose stream.
    pub robot: String,
    /// Which boot.
    pub boot: u64,
    /// The watermark; nothing at or below it need be sent again.
    pub seq: u64,
    /// Messages given up since the server started.
    pub lost: u64,
}

/// On `out/state`: how the server gets along with a robot.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct RobotState {
    /// [`crate::answer::ANSWER_VERSION`].
    pub v: u32,
    /// Which robot.
    pub robot: String,
    /// The map its streams go to; none before an accepted setup.
    pub map: Option<String>,
    /// Boot of the newest message.
    pub boot: Option<u64>,
    /// Newest stamp of that boot that has arrived.
    #[serde(default)]
    pub newest: Option<Stamp>,
    /// Since the server started.
    pub counts: Counts,
    /// The newest refusal.
    pub error: Option<Problem>,
    /// Why the newest of the acknowledged messages that could not be used was not.
    #[serde(default)]
    pub unused: Option<String>,
    /// What seems wrong with the robot's senses, each kind once, in words.
    #[serde(default)]
    pub senses: Vec<String>,
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
    /// Acknowledged, but of no use to the map: see `unused`.
    #[serde(default)]
    pub unused: u64,
}

/// On `map/{map}/out/jump`: coordinates of the map changed, by more than 5 cm or 1° at the robot.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Jump {
    /// [`crate::answer::ANSWER_VERSION`].
    pub v: u32,
    /// The map, with the epoch after the jump.
    pub map: MapIdentity,
    /// New map frame from old, through the robot's current pose.
    pub new_from_old: Pose,
}

/// Answer of `info`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Info {
    /// [`crate::answer::ANSWER_VERSION`].
    pub v: u32,
    /// Program and version.
    pub server: String,
    /// Site.
    pub site: String,
    /// The maps there are.
    pub maps: Vec<MapIdentity>,
    /// The robots that were heard.
    pub robots: Vec<RobotState>,
    /// Messages dropped because the server could not keep up; robots and guides of the library send them again.
    pub overrun: u64,
    /// How the maps' journals and filters do.
    #[serde(default)]
    pub work: Vec<MapWork>,
    /// Maps that are not served, and why.
    #[serde(default)]
    pub broken: Vec<Problem>,
    /// How the machine does.
    #[serde(default)]
    pub machine: Machine,
    /// How often each limit was reached, by its name in `[limits]`; those that never were are left out.
    #[serde(default)]
    pub reached: BTreeMap<String, u64>,
}

impl Info {
    /// What is not as it should be, in words; nothing: all is well.
    pub fn troubles(&self) -> Vec<String> {
        let broken = self.broken.iter().map(|problem| problem.message.clone());
        let journal = |map: &MapWork| Some(format!("map {}: {}", map.map, map.trouble.as_ref()?));
        let robot = |robot: &RobotState| {
            let counts = &robot.counts;
            let mut why: Vec<String> =
                [(counts.lost, "lost"), (counts.refused, "refused"), (counts.unused, "of no use")]
                    .into_iter()
                    .filter(|(count, _)| *count > 0)
                    .map(|(count, what)| format!("{count} messages {what}"))
                    .collect();
            why.extend(robot.error.as_ref().map(|e| e.message.clone()));
            why.extend(robot.unused.clone());
            (!why.is_empty()).then(|| format!("robot {}: {}", robot.robot, why.join("; ")))
        };
        broken
            .chain(self.work.iter().filter_map(journal))
            .chain(self.robots.iter().filter_map(robot))
            .collect()
    }
}

/// How the machine does on which a server runs; none where it can't be told.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Machine {
    /// Bytes that may still be written where the maps are.
    pub disk_left_bytes: Option<u64>,
    /// Bytes of memory that the server uses.
    pub memory_bytes: Option<u64>,
    /// Bytes of memory that are left to everybody.
    pub memory_left_bytes: Option<u64>,
}

/// How a map's journal and filter do.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct MapWork {
    /// The map.
    pub map: String,
    /// Its robot.
    pub robot: String,
    /// Messages that are held back until time passes.
    pub held: u64,
    /// Bytes that are on their way to the filter.
    pub backlog_bytes: u64,
    /// How far the filter is behind the journal, s.
    #[serde(default)]
    pub lag_s: f64,
    /// How long the journal's last write to disk took, s.
    #[serde(default)]
    pub sync_s: f64,
    /// Why the journal can't be written, as long as it can't.
    pub trouble: Option<String>,
}

/// Answer of `time`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Clocks {
    /// [`crate::answer::ANSWER_VERSION`].
    pub v: u32,
    /// The server's clock, since 1970.
    pub now: Stamp,
    /// Newest stamp that has arrived of each robot, on the robot's own clock: a sentence said now began then.
    pub robots: std::collections::BTreeMap<String, Stamp>,
}

/// Answer of a command that succeeded.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Done {
    /// [`crate::answer::ANSWER_VERSION`].
    pub v: u32,
    /// The command.
    pub query: String,
    /// The maps it concerned.
    pub maps: Vec<String>,
}

/// Answer of `do/undo`, `do/rename`, `do/forget`.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Mended {
    /// [`crate::answer::ANSWER_VERSION`].
    pub v: u32,
    /// The command.
    pub query: String,
    /// The map.
    pub map: String,
    /// What was done.
    pub words: String,
    /// Whether it is on disk, and will outlive the server.
    pub durable: bool,
}
