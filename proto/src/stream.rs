//! What robots and guides send.

use serde::{Deserialize, Deserializer, Serialize, Serializer};

/// A time: nanoseconds, on the wire `{"sec", "nanosec"}` in JSON and a bare i64 in bincode.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Stamp {
    /// Nanoseconds since the clock's own zero.
    pub ns: i64,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct RosTime {
    sec: i64,
    nanosec: u32,
}

impl Stamp {
    /// From seconds; rounds to nanoseconds.
    pub fn from_seconds(s: f64) -> Self {
        let whole = s.floor();
        Self { ns: whole as i64 * 1_000_000_000 + ((s - whole) * 1e9).round() as i64 }
    }

    /// Seconds.
    pub fn seconds(self) -> f64 {
        self.ns.div_euclid(1_000_000_000) as f64 + self.ns.rem_euclid(1_000_000_000) as f64 * 1e-9
    }
}

impl Serialize for Stamp {
    fn serialize<S: Serializer>(&self, s: S) -> Result<S::Ok, S::Error> {
        if s.is_human_readable() {
            RosTime {
                sec: self.ns.div_euclid(1_000_000_000),
                nanosec: self.ns.rem_euclid(1_000_000_000) as u32,
            }
            .serialize(s)
        } else {
            self.ns.serialize(s)
        }
    }
}

impl<'de> Deserialize<'de> for Stamp {
    fn deserialize<D: Deserializer<'de>>(d: D) -> Result<Self, D::Error> {
        if !d.is_human_readable() {
            return Ok(Self { ns: i64::deserialize(d)? });
        }
        let t = RosTime::deserialize(d)?;
        t.sec
            .checked_mul(1_000_000_000)
            .and_then(|s| s.checked_add(i64::from(t.nanosec)))
            .map(|ns| Self { ns })
            .ok_or_else(|| serde::de::Error::custom(format!("sec {} is out of range", t.sec)))
    }
}

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

/// What every message of a robot's streams begins with.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Header {
    /// Robot id, `[a-z0-9][a-z0-9_-]{0,62}`.
    pub robot: String,
    /// Counts the robot's restarts.
    pub boot: u64,
    /// One counter per robot and boot over all its streams, from 0.
    pub seq: u64,
    /// When it was measured.
    pub stamp: Stamp,
    /// By which clock.
    #[serde(default)]
    pub clock: Clock,
}

/// A pose in the plane, REP-103.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
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
    /// From here on: nothing seen, clears up to here.
    pub range_max_m: f64,
    /// Bearing intervals `[from, to]` that see the robot itself, laser frame, radians.
    #[serde(default)]
    pub ignored_rad: Vec<(f64, f64)>,
}

/// A robot presents itself.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Setup {
    /// Who, when, in which order.
    #[serde(flatten)]
    pub header: Header,
    /// The map its streams belong to.
    pub map: String,
    /// Its lasers.
    pub lasers: Vec<Laser>,
}

/// Wheel odometry.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Odom {
    /// Who, when, in which order.
    #[serde(flatten)]
    pub header: Header,
    /// Pose of the body in the odometry frame.
    pub odom_from_body: Pose,
}

/// One sweep of a laser; ranges: JSON `null` or NaN no information, `+inf` (JSON: any number at
/// or above the laser's maximum) nothing seen.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Scan {
    /// Who, when (the first ray), in which order.
    #[serde(flatten)]
    pub header: Header,
    /// Which of the setup's lasers.
    pub laser: String,
    /// Bearing of the first ray.
    pub angle_min_rad: f64,
    /// From ray to ray; may be negative.
    pub angle_increment_rad: f64,
    /// From ray to ray; 0: all at once.
    #[serde(default)]
    pub time_increment_s: f64,
    /// Metres.
    pub ranges_m: Vec<f32>,
}

/// A guide's sentence.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
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
    /// When it began; the time of arrival if left out.
    #[serde(default)]
    pub began: Option<Stamp>,
    /// When it ended.
    #[serde(default)]
    pub ended: Option<Stamp>,
    /// Id of an utterance taken back.
    #[serde(default)]
    pub retracts: Option<String>,
}

/// A recogniser's other guess.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Hearing {
    /// What it may have been.
    pub text: String,
    /// With which probability.
    pub p: f64,
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
}
