//! What a stream of messages has to offer, by its content, and what of it is one robot.

use crate::bag::Topic;
use crate::cdr;
use crate::frames::{Frames, Moving, mounting};
use crate::msg::{LaserScan, Odometry, TFMessage};
use std::collections::{BTreeMap, BTreeSet};
use toponym_proto::{Laser, Pose};

/// Farthest that a laser is believed to see that tells nothing of it, metres.
const RANGE_MAX_M: f64 = 30.0;
/// No laser sees so far: a driver that says so says nothing, metres.
const RANGE_LIMIT_M: f64 = 1000.0;
/// Closer returns are dust on the window, metres.
const RANGE_MIN_M: f64 = 0.02;
/// Parts of names of topics on which texts are what people say.
const SPEECH: [&str; 7] = ["speech", "say", "said", "utterance", "narration", "voice", "transcript"];

/// Types of messages that are read or written.
pub mod kind {
    #![allow(missing_docs, reason = "names")]
    pub const SCAN: &str = "sensor_msgs/msg/LaserScan";
    pub const ODOMETRY: &str = "nav_msgs/msg/Odometry";
    pub const TF: &str = "tf2_msgs/msg/TFMessage";
    pub const TEXT: &str = "std_msgs/msg/String";
    pub const CLOCK: &str = "rosgraph_msgs/msg/Clock";
    pub const GRID: &str = "nav_msgs/msg/OccupancyGrid";
    pub const GRID_METADATA: &str = "nav_msgs/msg/MapMetaData";
    pub const POSE: &str = "geometry_msgs/msg/PoseStamped";
    pub const POSE_WITH_COVARIANCE: &str = "geometry_msgs/msg/PoseWithCovarianceStamped";
    pub const PATH: &str = "nav_msgs/msg/Path";
    pub const POINTS: &str = "sensor_msgs/msg/PointCloud2";
    pub const MARKERS: &str = "visualization_msgs/msg/MarkerArray";
    pub const TRIGGER: &str = "std_srvs/srv/Trigger";
    pub const WHERE: &str = "toponym_msgs/srv/Where";
}

/// What was seen of a stream so far.
#[derive(Clone, Debug, Default)]
pub struct Survey {
    /// By namespace of their topics: two robots may have frames of the same names.
    frames: BTreeMap<String, Frames>,
    scans: BTreeMap<String, Seen>,
    /// Frames of the pose and of the body, by topic.
    odometry: BTreeMap<String, Moving>,
    texts: BTreeSet<String>,
    /// Messages by topic.
    count: BTreeMap<(String, String), u64>,
    /// Topics that are looked at; none: all.
    wanted: Vec<String>,
}

/// What was seen of a laser.
#[derive(Clone, Debug, Default)]
struct Seen {
    frame: String,
    range_min_m: f64,
    range_max_m: f64,
    first_ns: i64,
    last_ns: Option<i64>,
    /// Stamps do not move.
    stands: bool,
}

/// Which messages are the robot.
#[derive(Clone, Debug, PartialEq)]
pub struct Plan {
    /// Where its odometry is from.
    pub odometry: Source,
    /// Its lasers, by topic.
    pub lasers: BTreeMap<String, Laser>,
    /// Topics on which people have spoken.
    pub speech: BTreeSet<String>,
    /// Topics that are looked at; none: all.
    pub wanted: Vec<String>,
    /// Stamps mean nothing: the time of reception is taken.
    pub by_reception: bool,
    /// What was supposed, for people.
    pub remarks: Vec<String>,
}

impl Plan {
    /// Whether it takes the same in the same way.
    pub fn is_as(&self, other: &Self) -> bool {
        (&self.odometry, &self.lasers) == (&other.odometry, &other.lasers)
    }

    /// Whether texts on a topic are what people say, be it that nobody has said anything yet.
    pub fn is_speech(&self, topic: &str) -> bool {
        is_speech(topic, &self.wanted)
    }

    /// The transform that is its odometry.
    pub fn moving(&self) -> Option<&Moving> {
        match &self.odometry {
            Source::Tf { moving, .. } | Source::Topic { moving, .. } => Some(moving),
            Source::None => None,
        }
    }
}

/// Where odometry is from.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Source {
    /// A transform on a topic.
    Tf {
        /// `/tf`
        topic: String,
        /// Which.
        moving: Moving,
    },
    /// A topic of odometry.
    Topic {
        /// `/odom`
        topic: String,
        /// Its frames.
        moving: Moving,
    },
    /// There is none: scans alone tell the way.
    None,
}

/// What lies in front of `/tf` and `/tf_static`; none of other topics.
fn namespace(topic: &str) -> Option<&str> {
    topic.strip_suffix("/tf").or_else(|| topic.strip_suffix("/tf_static"))
}

impl Survey {
    /// Of nothing yet; of these topics and all of transforms, or of all.
    pub fn new(wanted: &[String]) -> Self {
        Self { wanted: wanted.to_vec(), ..Self::default() }
    }

    /// Takes a message in.
    ///
    /// # Errors
    /// What is wrong with it.
    pub fn take(&mut self, topic: &Topic, data: &[u8]) -> Result<(), String> {
        *self.count.entry((topic.name.clone(), topic.kind.clone())).or_default() += 1;
        if !topic.is_cdr {
            return Ok(());
        }
        let is_wanted = self.wanted.is_empty() || self.wanted.contains(&topic.name);
        match topic.kind.as_str() {
            kind::TF => {
                let Some(namespace) = namespace(&topic.name) else { return Ok(()) };
                let (message, frames) =
                    (cdr::read::<TFMessage>(data)?, self.frames.entry(namespace.to_owned()).or_default());
                if topic.name.ends_with("_static") { frames.fix(&message) } else { frames.see(&message) }
            }
            kind::SCAN if is_wanted => self.see(&topic.name, &cdr::read(data)?),
            kind::ODOMETRY if is_wanted => {
                let message: Odometry = cdr::read(data)?;
                let moving = Moving {
                    parent: crate::frames::name(&message.header.frame_id),
                    child: crate::frames::name(&message.child_frame_id),
                };
                self.odometry.insert(topic.name.clone(), moving);
            }
            kind::TEXT if is_speech(&topic.name, &self.wanted) => {
                self.texts.insert(topic.name.clone());
            }
            _ => {}
        }
        Ok(())
    }

    fn see(&mut self, topic: &str, scan: &LaserScan) {
        let seen = self.scans.entry(topic.to_owned()).or_default();
        let stamp_ns = scan.header.stamp.ns();
        if seen.last_ns.is_none() {
            seen.first_ns = stamp_ns;
        }
        seen.stands = seen.last_ns == Some(stamp_ns);
        seen.last_ns = Some(stamp_ns);
        seen.frame.clone_from(&scan.header.frame_id);
        (seen.range_min_m, seen.range_max_m) = (scan.range_min.into(), scan.range_max.into());
    }

    /// The frames that a topic is in: those of the nearest namespace around it.
    fn around(&self, topic: &str) -> Option<(&String, &Frames)> {
        let inside = |space: &str| topic.strip_prefix(space).is_some_and(|rest| rest.starts_with('/'));
        self.frames.iter().filter(|(space, _)| inside(space)).max_by_key(|(space, _)| space.len())
    }

    /// What carries the laser of a topic, and where it is on that.
    fn carrier(&self, topic: &str, frame: &str) -> Option<(&String, Moving, nalgebra::Isometry3<f64>)> {
        let (space, frames) = self.around(topic)?;
        let (moving, pose) = frames.odometry_of(frame)?;
        Some((space, moving, pose))
    }

    /// Where transforms of a namespace are: its own topic, or that of all.
    pub fn tf_topic(&self, namespace: &str) -> String {
        let around = self.around(&format!("{namespace}/tf")).map_or("", |(space, _)| space);
        format!("{around}/tf")
    }

    /// Over how long scans were seen, by their stamps.
    pub fn scanned_ns(&self) -> i64 {
        let of = |seen: &Seen| seen.last_ns.map_or(0, |last_ns| last_ns.saturating_sub(seen.first_ns));
        self.scans.values().map(of).max().unwrap_or(0)
    }

    /// Whether all lasers seen are known to be carried by something that moves.
    pub fn is_complete(&self) -> bool {
        !self.scans.is_empty() && self.scans.iter().all(|(topic, s)| self.carrier(topic, &s.frame).is_some())
    }

    /// What of it is one robot.
    ///
    /// # Errors
    /// Why there is none, and what to do.
    pub fn plan(&self) -> Result<Plan, String> {
        if self.scans.is_empty() {
            return Err(self.without_scans());
        }
        let carriers: BTreeMap<&String, Option<(&String, Moving)>> = self
            .scans
            .iter()
            .map(|(topic, seen)| (topic, self.carrier(topic, &seen.frame).map(|(space, m, _)| (space, m))))
            .collect();
        let robots: BTreeSet<&(&String, Moving)> = carriers.values().flatten().collect();
        if robots.len() > 1 {
            let told = |(topic, on): (&&String, &Option<(&String, Moving)>)| {
                Some(format!("{topic} on {}", on.as_ref()?.1.child))
            };
            let all: Vec<String> = carriers.iter().filter_map(told).collect();
            return Err(format!(
                "{} robots are in it ({}): choose one by its laser, as --topics {}",
                robots.len(),
                all.join(", "),
                self.scans.keys().next().map_or("", String::as_str)
            ));
        }
        let mut remarks = Vec::new();
        let odometry = match robots.first() {
            Some((space, moving)) => Source::Tf { topic: format!("{space}/tf"), moving: moving.clone() },
            None => self.odometry_topic(&mut remarks),
        };
        let mut lasers = BTreeMap::new();
        for (topic, seen) in &self.scans {
            lasers.insert(topic.clone(), self.laser(topic, seen, &odometry, &mut remarks)?);
        }
        let by_reception = self.scans.values().all(|seen| seen.stands);
        if by_reception {
            remarks.push("the stamps of its scans do not move: the time of their reception is taken".into());
        }
        Ok(Plan {
            odometry,
            lasers,
            speech: self.texts.clone(),
            wanted: self.wanted.clone(),
            by_reception,
            remarks,
        })
    }

    /// Where no transform tells where the robot is.
    fn odometry_topic(&self, remarks: &mut Vec<String>) -> Source {
        let fused = self.odometry.iter().find(|(topic, _)| topic.contains("filtered"));
        let Some((topic, moving)) = fused.or_else(|| self.odometry.iter().next()) else {
            remarks.push("neither a transform nor odometry tells how the robot moves: scans alone do".into());
            return Source::None;
        };
        remarks.push(format!("no transform tells how the robot moves: odometry is taken from {topic}"));
        Source::Topic { topic: topic.clone(), moving: moving.clone() }
    }

    fn laser(
        &self,
        topic: &str,
        seen: &Seen,
        odometry: &Source,
        remarks: &mut Vec<String>,
    ) -> Result<Laser, String> {
        let pose = match odometry {
            Source::Tf { .. } => self.carrier(topic, &seen.frame).map(|(_, _, pose)| pose),
            Source::Topic { moving, .. } => {
                self.around(topic).and_then(|(_, frames)| frames.fixed_in(&seen.frame, &moving.child))
            }
            Source::None => None,
        };
        if pose.is_none() {
            remarks.push(format!(
                "nothing tells how the laser {:?} of {topic} is mounted (no /tf_static with it): it is taken to be in the \
                 robot's middle, looking ahead",
                seen.frame
            ));
        }
        let mounting =
            pose.map(|pose| mounting(&pose)).transpose().map_err(|why| format!("{topic}: {why}"))?;
        let body_from_laser = mounting.map_or(Pose::default(), |m| m.body_from_laser);
        let range_min_m = if seen.range_min_m > 0.0 { seen.range_min_m } else { RANGE_MIN_M };
        let tells_range = seen.range_max_m <= RANGE_LIMIT_M && seen.range_max_m > range_min_m;
        if !tells_range {
            remarks.push(format!(
                "{topic} has a range_max of {}: {RANGE_MAX_M} m is taken; set it in the laser's driver",
                seen.range_max_m
            ));
        }
        Ok(Laser {
            id: id(topic),
            x_m: body_from_laser.x_m,
            y_m: body_from_laser.y_m,
            yaw_rad: body_from_laser.yaw_rad,
            upside_down: mounting.is_some_and(|m| m.upside_down),
            range_min_m,
            range_max_m: if tells_range { seen.range_max_m } else { RANGE_MAX_M },
            ignored_rad: Vec::new(),
        })
    }

    fn without_scans(&self) -> String {
        const SHOWN: usize = 8;
        let told = |((topic, kind), n): (&(String, String), &u64)| format!("{topic} ({n} {kind})");
        let mut topics: Vec<String> = self.count.iter().take(SHOWN).map(told).collect();
        if self.count.len() > SHOWN {
            topics.push(format!("{} more", self.count.len() - SHOWN));
        }
        let looked =
            if self.wanted.is_empty() { String::new() } else { format!(" on {}", self.wanted.join(", ")) };
        let has = if topics.is_empty() { "nothing".to_owned() } else { topics.join(", ") };
        format!("no {} in CDR{looked}, which is what maps are made of; it has {has}", kind::SCAN)
    }
}

/// Whether texts on a topic are what people say.
pub fn is_speech(topic: &str, wanted: &[String]) -> bool {
    let last = topic.rsplit('/').next().unwrap_or_default().to_lowercase();
    if wanted.is_empty() {
        SPEECH.iter().any(|word| last.contains(word))
    } else {
        wanted.iter().any(|w| w == topic)
    }
}

/// A topic as an id: `/r1/front_scan` is `r1_front_scan`.
fn id(topic: &str) -> String {
    let is_allowed = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '_' || c == '-';
    let words = topic.to_lowercase().replace(|c: char| !is_allowed(c), "_");
    words.trim_start_matches(['_', '-']).chars().take(62).collect()
}
