//! What happens to a map: the core's only input. Events come validated (`toponym-proto` is the
//! only place that rejects), merged into one order by the shell.

use crate::geometry::Pose2;
use serde::{Deserialize, Serialize};

/// Nanoseconds on the sender's clock. Stamps may repeat or step back: order is that of arrival.
pub type StampNs = i64;

/// One input of [`crate::Mapper::step`].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Event {
    /// The robot's lasers; comes before its first scan and may come again.
    Setup(Setup),
    /// Wheel odometry.
    Odom(Odom),
    /// One sweep of a laser.
    Scan(Scan),
    /// A guide's sentence.
    Utterance(Utterance),
    /// What an operator mends.
    Command(Command),
    /// Words of the site's own, from now on: lines of a [`crate::language::Glossary`]. Others are ignored.
    Glossary(String),
    /// The stream ended: nothing is waited for any more, all places freeze.
    Flush,
}

/// What the core must know of a robot before its scans mean anything.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Setup {
    /// Robot id.
    pub robot: String,
    /// The robot's lasers.
    pub lasers: Vec<Laser>,
}

/// A laser and how it is mounted.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Laser {
    /// Laser id, as in the scan's.
    pub id: String,
    /// Mounting: laser frame in the body frame.
    pub body_from_laser: Pose2,
    /// Mounted upside down: angles run clockwise seen from above.
    pub upside_down: bool,
    /// Ranges below mean nothing.
    pub range_min_m: f64,
    /// Ranges at or above mean "nothing seen".
    pub range_max_m: f64,
    /// Bearing intervals `[from, to]` in the laser frame that see the robot itself.
    pub ignored_rad: Vec<(f64, f64)>,
}

/// Wheel odometry: pose of the body in the odometry frame.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Odom {
    /// Robot id.
    pub robot: String,
    /// Counts the robot's restarts: a new one starts a new odometry segment.
    pub boot: u64,
    /// Stamp of the pose.
    pub stamp_ns: StampNs,
    /// Pose of the body in the odometry frame.
    pub odom_from_body: Pose2,
}

/// One sweep. Ranges: `+inf` nothing seen (which does not clear: glass and black walls return
/// nothing either), NaN or below the laser's minimum: no information. The number of beams may differ from sweep to sweep.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Scan {
    /// Robot id.
    pub robot: String,
    /// Laser id, one of the setup's.
    pub laser: String,
    /// Stamp of the first ray.
    pub stamp_ns: StampNs,
    /// Bearing of the first ray in the laser frame.
    pub angle_min_rad: f64,
    /// Bearing step from ray to ray; may be negative.
    pub angle_increment_rad: f64,
    /// Time from ray to ray; 0 for a sweep taken at once.
    pub time_increment_s: f64,
    /// Ranges in metres.
    pub ranges_m: Vec<f32>,
}

impl Scan {
    /// Time from the first ray to the last, seconds.
    pub fn takes_s(&self) -> f64 {
        self.time_increment_s.max(0.0) * self.ranges_m.len().saturating_sub(1) as f64
    }
}

/// A sentence said to the robot.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Utterance {
    /// Unique id; a second one with the same id changes nothing.
    pub id: String,
    /// What was said.
    pub text: String,
    /// Its language (BCP 47); none is English.
    pub lang: Option<String>,
    /// Other hearings of the speech recogniser, each with its probability.
    pub alternatives: Vec<(String, f64)>,
    /// Who said it.
    pub speaker: Option<String>,
    /// When the sentence began: it speaks of the place held then.
    pub began_ns: StampNs,
    /// When it ended.
    pub ended_ns: StampNs,
    /// Id of a sentence that this one takes back.
    pub retracts: Option<String>,
    /// Id of a sentence of which the robot asked something: this is the answer.
    pub answers: Option<String>,
}

/// Where the robot is, as somebody sees it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Told {
    /// Unique id; a second one with the same id changes nothing.
    pub id: String,
    /// Pose of the body in the map.
    pub map_from_body: Pose2,
    /// Standard deviation in each direction, metres.
    pub sigma_m: f64,
    /// Standard deviation of the heading, radians.
    pub sigma_rad: f64,
}

/// An area of the map, as somebody draws it at a desk.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Area {
    /// Unique id; a second one with the same id changes nothing.
    pub id: String,
    /// Its corners in the map, metres, in their order either way round.
    pub polygon_m: Vec<(f64, f64)>,
    /// What it is called.
    pub name: Option<String>,
    /// Whether what was said to be there so far is not so.
    pub instead: bool,
    /// Whether robots are to keep out.
    pub forbidden: bool,
}

/// What an operator mends at a desk.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Command {
    /// Takes a sentence back.
    Undo {
        /// Its id; the newest that stands if none is given.
        utterance: Option<String>,
    },
    /// A name was misheard or misspelt: from now on it means another one.
    Rename {
        /// The wrong name.
        from: String,
        /// The right one.
        to: String,
    },
    /// Nothing said so far speaks of this name any more.
    Forget {
        /// The name.
        name: String,
    },
    /// Tells where the robot is: evidence, that can be taken back as a sentence can.
    Pose(Told),
    /// Tells what an area is called, or that robots keep out of it; can be taken back, too.
    Area(Area),
}
