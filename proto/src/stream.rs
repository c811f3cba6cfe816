//! What robots and guides send.

use crate::wire::{self, with_header};
use serde::{Deserialize, Serialize};

pub use crate::wire::Stamp;

/// Which clock stamped a message.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Clock {
    /// Since 1970.
    #[default]
    Unix,
    /// A simulator's.
    Sim,
    /// A recorded log's.
    Log,
}

/// What every message of a robot's streams begins with; on the wire its fields stand beside the
/// message's own.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Header {
    /// Robot id, `[a-z0-9][a-z0-9_-]{0,62}`.
    pub robot: String,
    /// Grows with the robot's restarts: a counter, or the Unix time of the start in seconds.
    pub boot: u64,
    /// One counter per robot and boot over all its streams, from 0.
    pub seq: u64,
    /// When it was measured.
    pub stamp: Stamp,
    /// By which clock.
    pub clock: Clock,
}

/// A pose in the plane, REP-103.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Pose {
    /// Metres.
    pub x_m: f64,
    /// Metres.
    pub y_m: f64,
    /// Radians.
    pub yaw_rad: f64,
}

/// A laser and how it is mounted on the body.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Laser {
    /// Laser id.
    pub id: String,
    /// Metres, body frame.
    #[serde(default)]
    pub x_m: f64,
    /// Metres, body frame.
    #[serde(default)]
    pub y_m: f64,
    /// Radians, body frame.
    #[serde(default)]
    pub yaw_rad: f64,
    /// Bearings run clockwise seen from above.
    #[serde(default)]
    pub upside_down: bool,
    /// Below: no information.
    pub range_min_m: f64,
    /// From here on: nothing seen.
    pub range_max_m: f64,
    /// Bearing intervals `[from, to]` that see the robot itself, laser frame, radians.
    #[serde(default)]
    pub ignored_rad: Vec<(f64, f64)>,
}

with_header! {
    /// A robot presents itself.
    Setup {
        /// The map its streams belong to.
        map: String,
        /// Its lasers.
        lasers: Vec<Laser>,
    }
}

with_header! {
    /// Wheel odometry.
    Odom {
        /// Pose of the body in the odometry frame.
        odom_from_body: Pose,
    }
}

with_header! {
    /// One sweep of a laser; ranges: JSON `null` or NaN no information, `+inf` (JSON: any number
    /// at or above the laser's maximum) nothing seen. The header's stamp is the first ray's.
    Scan {
        /// Which of the setup's lasers.
        laser: String,
        /// Bearing of the first ray.
        angle_min_rad: f64,
        /// From ray to ray; may be negative.
        angle_increment_rad: f64,
        /// From ray to ray; 0: all at once.
        time_increment_s: f64 [serde(default)],
        /// Metres.
        ranges_m: Vec<f32> [serde(with = "wire::ranges")],
    }
}

with_header! {
    /// The robot's stream ends here: nothing is waited for any more, the map settles. The stream
    /// may go on afterwards.
    End {}
}

/// A guide's sentence.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Say {
    /// ULID; makes a resend harmless.
    pub id: String,
    /// To which robot; may be left out where there is exactly one.
    #[serde(default)]
    pub robot: Option<String>,
    /// What was said.
    pub text: String,
    /// Other hearings of the recogniser.
    #[serde(default)]
    pub alternatives: Vec<Hearing>,
    /// BCP 47.
    #[serde(default)]
    pub lang: Option<String>,
    /// Who said it.
    #[serde(default)]
    pub speaker: Option<String>,
    /// When it began, on the clock of the robot's stream; left out: the newest stamp of that
    /// stream when the sentence arrives, or had arrived `ago_s` before.
    #[serde(default)]
    pub began: Option<Stamp>,
    /// How long ago it began, seconds: of who says it again and does not know the robot's clock. Told in JSON alone: what
    /// is kept has `began`.
    #[serde(default, with = "in_json")]
    pub ago_s: Option<f64>,
    /// When it ended.
    #[serde(default)]
    pub ended: Option<Stamp>,
    /// Id of an utterance taken back.
    #[serde(default)]
    pub retracts: Option<String>,
    /// Id of an utterance that something was asked of: this is the answer, "yes" or "no".
    #[serde(default)]
    pub answers: Option<String>,
}

/// A number that the bincode form leaves out.
mod in_json {
    use serde::{Deserialize, Deserializer, Serialize, Serializer};

    #[allow(clippy::ref_option, reason = "serde passes it so")]
    pub fn serialize<S: Serializer>(value: &Option<f64>, to: S) -> Result<S::Ok, S::Error> {
        if to.is_human_readable() { value.serialize(to) } else { ().serialize(to) }
    }

    pub fn deserialize<'de, D: Deserializer<'de>>(from: D) -> Result<Option<f64>, D::Error> {
        if from.is_human_readable() {
            Option::deserialize(from)
        } else {
            <()>::deserialize(from).map(|()| None)
        }
    }
}

impl Say {
    /// Bytes that it takes in memory, near enough to bound queues by.
    pub fn weight_bytes(&self) -> usize {
        256 + self.text.len() + self.alternatives.iter().map(|a| 64 + a.text.len()).sum::<usize>()
    }
}

/// A recogniser's other guess.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Hearing {
    /// What it may have been.
    pub text: String,
    /// With which probability.
    pub p: f64,
}

/// Who points at where a robot is, in a picture of the map, errs by so much, …
pub const TOLD_SIGMA_M: f64 = 0.5;
/// … and by so much of its heading: as RViz has it.
pub const TOLD_SIGMA_RAD: f64 = 0.26;

/// What an operator mends at a desk, by the queries `do/undo`, `do/rename`, `do/forget`, `do/initial_pose` and
/// `do/area`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Mend {
    /// Takes a sentence back.
    Undo {
        /// Its id; the newest that stands if none is given.
        id: Option<String>,
    },
    /// From now on a name means another one.
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
    /// The robot is there, as somebody sees it.
    Pose {
        /// ULID; makes a resend harmless, and lets it be taken back.
        id: String,
        /// Of the body.
        map_from_body: Pose,
        /// Standard deviation in each direction.
        sigma_m: f64,
        /// Standard deviation of the heading.
        sigma_rad: f64,
    },
    /// An area is called so, or robots keep out of it.
    Area {
        /// ULID; makes a resend harmless, and lets it be taken back.
        id: String,
        /// Its corners in the map, in their order either way round.
        polygon_m: Vec<[f64; 2]>,
        /// What it is called.
        name: Option<String>,
        /// Whether what was said to be there so far is not so.
        instead: bool,
        /// Whether robots keep out.
        forbidden: bool,
    },
}

/// Anything a mapper listens to; also the record of `serve --record` files.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "type", rename_all = "lowercase")]
pub enum Message {
    /// A robot presents itself.
    Setup(Setup),
    /// Wheel odometry.
    Odom(Odom),
    /// A sweep.
    Scan(Scan),
    /// A sentence.
    Say(Say),
    /// The robot's stream ends.
    End(End),
    /// An operator mends what was said.
    Mend(Mend),
}

impl Message {
    /// Bytes that it takes in memory, near enough to bound queues by.
    pub fn weight_bytes(&self) -> usize {
        const HEAD: usize = 256;
        match self {
            Self::Scan(scan) => HEAD + 4 * scan.ranges_m.len(),
            Self::Setup(setup) => HEAD * (1 + setup.lasers.len()),
            Self::Say(say) => say.weight_bytes(),
            Self::Odom(_) | Self::End(_) | Self::Mend(_) => HEAD,
        }
    }

    /// The header of a robot's message; what people say and mend has none.
    pub fn header(&self) -> Option<&Header> {
        match self {
            Self::Setup(m) => Some(&m.header),
            Self::Odom(m) => Some(&m.header),
            Self::Scan(m) => Some(&m.header),
            Self::End(m) => Some(&m.header),
            Self::Say(_) | Self::Mend(_) => None,
        }
    }
}
