//! Robots that speak ROS 2 by rmw_zenoh, live: `serve --ros`.
//!
//! ```text
//! robot's router ─ session (Ear) ─► feed ─► toponym's messages ─► the server, as any robot's
//!                ◄─ mouth (Speaker) ─ broadcast: map → odom; pictures: map, markers; asked: services, questions
//! ```
//!
//! One client session for each robot, so that robots do not hear one another. Nothing is installed on the robot.

mod asked;
mod broadcast;
mod clock;
pub mod feed;
mod found;
mod mouth;
mod pictures;
mod session;
mod take_in;

pub use mouth::{Speaker, Writer};
pub use session::now_ns;

use crate::plan::Plan;
use crate::wire::Hashes;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use std::str::FromStr;
use std::sync::atomic::AtomicI64;
use std::sync::{Arc, Mutex};
use std::time::Duration;
use tokio::sync::watch;
use tokio::task::JoinSet;
use toponym_proto::answer::{Goal, PoseOut, Sent};
use toponym_proto::keys::{check_id, check_link};
use toponym_proto::{Invalid, Keys};
use tracing::{error, info, warn};
use zenoh::Session;
use zenoh::pubsub::Subscriber;

/// Where a robot's router listens by default.
pub const DEFAULT_ENDPOINT: &str = "tcp/localhost:7447";
/// Pause before a router is tried again.
const AGAIN: Duration = Duration::from_secs(2);

/// A robot that speaks ROS 2.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct RosRobot {
    /// What it is called here.
    pub robot: String,
    /// Where its `rmw_zenohd` listens.
    pub endpoint: String,
    /// Its `ROS_DOMAIN_ID`.
    pub domain: u32,
    /// Its namespace, such as `/r1`; empty where it has none.
    pub namespace: String,
    /// The map that it makes.
    pub map: String,
    /// Topics of scans, odometry and speech; empty: found by content.
    pub topics: Vec<String>,
    /// Frame of the map, for its navigation.
    pub map_frame: String,
    /// Edge of a cell of `/map`, metres.
    pub resolution_m: f64,
    /// Shortest time between two maps, seconds.
    pub map_update_interval_s: f64,
    /// So far ahead `map` → `odom` is dated, seconds.
    pub transform_timeout_s: f64,
    /// Time between two transforms, seconds.
    pub transform_publish_period_s: f64,
}

impl Default for RosRobot {
    fn default() -> Self {
        Self {
            robot: "robot".into(),
            endpoint: DEFAULT_ENDPOINT.into(),
            domain: 0,
            namespace: String::new(),
            map: "main".into(),
            topics: Vec::new(),
            map_frame: "map".into(),
            resolution_m: 0.05,
            map_update_interval_s: 5.0,
            transform_timeout_s: 0.2,
            transform_publish_period_s: 0.03,
        }
    }
}

impl RosRobot {
    /// Checks the values.
    ///
    /// # Errors
    /// Which is wrong, and why.
    pub fn check(&self) -> Result<(), Invalid> {
        check_id("ros.robot", &self.robot)?;
        check_id("ros.map", &self.map)?;
        check_link("ros.endpoint", &self.endpoint)?;
        if !self.endpoint.split_once('/').is_some_and(|(kind, at)| !kind.is_empty() && at.contains(':')) {
            let message = format!("is {:?}, must be such as {DEFAULT_ENDPOINT}", self.endpoint);
            return Err(Invalid::new("ros.endpoint", message));
        }
        let is_name = |c: char| c.is_ascii_alphanumeric() || "_/".contains(c);
        let is_space =
            |name: &str| name.starts_with('/') && !name.ends_with('/') && name.chars().all(is_name);
        if !self.namespace.is_empty() && !is_space(&self.namespace) {
            let message = format!("is {:?}, must be such as /r1", self.namespace);
            return Err(Invalid::new("ros.namespace", message));
        }
        if let Some(topic) = self.topics.iter().find(|topic| !is_space(topic)) {
            return Err(Invalid::new("ros.topics", format!("has {topic:?}, must be such as /scan")));
        }
        for (field, value, range) in [
            ("ros.resolution_m", self.resolution_m, 0.01..=1.0),
            ("ros.map_update_interval_s", self.map_update_interval_s, 0.1..=3600.0),
            ("ros.transform_timeout_s", self.transform_timeout_s, 0.0..=10.0),
            ("ros.transform_publish_period_s", self.transform_publish_period_s, 0.005..=1.0),
        ] {
            if !range.contains(&value) {
                let message = format!("is {value}, must be from {} to {}", range.start(), range.end());
                return Err(Invalid::new(field, message));
            }
        }
        Ok(())
    }
}

impl FromStr for RosRobot {
    type Err = Invalid;

    /// `NAME=ENDPOINT,domain=N,namespace=/r1,map=ID,topic=/scan`; nothing of it need be there.
    fn from_str(text: &str) -> Result<Self, Invalid> {
        let mut robot = Self::default();
        for (k, part) in text.split(',').map(str::trim).filter(|part| !part.is_empty()).enumerate() {
            match part.split_once('=') {
                Some(("domain", n)) => {
                    let wrong = |_| Invalid::new("ros.domain", format!("is {n:?}, must be a number"));
                    robot.domain = n.parse().map_err(wrong)?;
                }
                Some(("namespace", space)) => robot.namespace = space.trim_end_matches('/').into(),
                Some(("map", map)) => robot.map = map.into(),
                Some(("topic", topic)) => robot.topics.push(topic.into()),
                Some((name, endpoint)) if k == 0 => {
                    (robot.robot, robot.endpoint) = (name.into(), endpoint.into());
                }
                None if k == 0 && part.contains('/') => robot.endpoint = part.into(),
                None if k == 0 => robot.robot = part.into(),
                _ => {
                    let known = "NAME=ENDPOINT,domain=N,namespace=/r1,map=ID,topic=/scan";
                    return Err(Invalid::new("ros", format!("has {part:?}, must be such as {known}")));
                }
            }
        }
        robot.check()?;
        Ok(robot)
    }
}

/// Why a bridge ends.
type Failure = Box<dyn std::error::Error + Send + Sync>;

/// What the parts of one robot's bridge know of one another.
struct Shared {
    robot: RosRobot,
    site: String,
    /// The server's session.
    own: Session,
    /// What is taken of what the robot sends, since it is known.
    plan: watch::Sender<Option<Plan>>,
    /// Where its transforms go.
    tf_topic: watch::Sender<String>,
    /// How its keys tell types.
    hashes: watch::Sender<Hashes>,
    /// Its clock.
    clock: watch::Sender<clock::RobotClock>,
    /// Where it is.
    pose: watch::Sender<Option<PoseOut>>,
    /// Where it was sent last.
    goal: watch::Sender<Option<Goal>>,
    /// When somebody else last told where odometry lies in a map, Unix nanoseconds.
    others_ns: AtomicI64,
    /// What was asked for last.
    asked_for: Mutex<Option<String>>,
    found: Mutex<found::Found>,
}

/// Connects a robot to the server for good: to its router, again whenever that goes; `own` is the server's session.
pub async fn run(robot: RosRobot, site: String, own: Session) {
    let (mut told, mut hashes) = (false, Hashes::OfTypes);
    loop {
        match session::open(&robot).await {
            Ok(ros) => {
                info!(robot = robot.robot, "connected to {}", robot.endpoint);
                let ended = bridge(&robot, &site, &own, &ros, hashes).await;
                let _ = ros.close().await;
                (told, hashes) = (false, Hashes::OfTypes);
                match ended {
                    Ok(spoken) => {
                        info!(robot = robot.robot, "it speaks as ROS 2 Humble does: it is answered so");
                        hashes = spoken;
                        continue;
                    }
                    Err(e) => error!(robot = robot.robot, "{e}"),
                }
            }
            Err(_) if !told => {
                told = true;
                warn!(
                    robot = robot.robot,
                    "nobody answers at {}: start `ros2 run rmw_zenoh_cpp rmw_zenohd` there, or name another with --ros \
                     NAME=ENDPOINT; it is tried again",
                    robot.endpoint
                );
            }
            Err(_) => {}
        }
        tokio::time::sleep(AGAIN).await;
    }
}

/// One connection, until one of its parts fails, or until the robot is heard to tell types otherwise than `hashes`: then how.
async fn bridge(
    robot: &RosRobot,
    site: &str,
    own: &Session,
    ros: &Session,
    hashes: Hashes,
) -> Result<Hashes, Failure> {
    let ear = session::Ear::new(ros, robot).await?;
    let speaker = Arc::new(Speaker::new(ros, robot.domain, &robot.namespace, hashes).await?);
    let shared = Arc::new(Shared {
        robot: robot.clone(),
        site: site.to_owned(),
        own: own.clone(),
        plan: watch::Sender::new(None),
        tf_topic: watch::Sender::new("/tf".into()),
        hashes: watch::Sender::new(hashes),
        clock: watch::Sender::new(clock::RobotClock::default()),
        pose: watch::Sender::new(None),
        goal: watch::Sender::new(None),
        others_ns: AtomicI64::new(0),
        asked_for: Mutex::default(),
        found: Mutex::default(),
    });
    let keys = Keys::new(site)?;
    let (poses, goals) = (shared.clone(), shared.clone());
    let posed = move |pose| {
        poses.pose.send_replace(Some(pose));
    };
    let _poses = watch(own, keys.pose(&robot.robot), posed).await?;
    let sent = move |sent: Sent| {
        goals.goal.send_replace(sent.goal);
    };
    let _goals = watch(own, keys.goal(&robot.robot), sent).await?;
    asked::answer_all(&shared, ros, &speaker).await?;
    // They end with this function, however it ends.
    let mut parts = JoinSet::new();
    parts.spawn(take_in::take_in(shared.clone(), ear));
    parts.spawn(broadcast::broadcast(shared.clone(), speaker.clone()));
    parts.spawn(pictures::publish(shared.clone(), speaker.clone()));
    parts.spawn(found::tell(shared.clone(), ros.clone()));
    let mut spoken = shared.hashes.subscribe();
    tokio::select! {
        // A robot's nodes are all of one kind: what was taken for later than Humble is found out once.
        heard = spoken.wait_for(|spoken| (hashes, *spoken) == (Hashes::OfTypes, Hashes::None)) => Ok(*heard?),
        ended = parts.join_next() => match ended {
            Some(Ok(Err(why))) => Err(why.into()),
            Some(Err(e)) => Err(e.into()),
            Some(Ok(Ok(()))) | None => Err("a part of the bridge has ended".into()),
        },
    }
}

/// Hands over what the server publishes on a key.
async fn watch<T: DeserializeOwned>(
    own: &Session,
    key: String,
    told: impl Fn(T) + Send + Sync + 'static,
) -> Result<Subscriber<()>, zenoh::Error> {
    let subscriber = own.declare_subscriber(key).callback(move |sample| {
        if let Ok(value) = serde_json::from_slice(&sample.payload().to_bytes()) {
            told(value);
        }
    });
    subscriber.await
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_robot_is_named_in_one_word() {
        let of = |text: &str| text.parse::<RosRobot>().map_err(|e| e.to_string());
        assert_eq!(of(""), Ok(RosRobot::default()));
        let full = of("tim=tcp/10.0.0.5:7447,domain=7,namespace=/r1,map=lab,topic=/r1/scan").unwrap();
        assert_eq!((full.robot.as_str(), full.endpoint.as_str()), ("tim", "tcp/10.0.0.5:7447"));
        assert_eq!((full.domain, full.namespace.as_str(), full.map.as_str()), (7, "/r1", "lab"));
        assert_eq!(of("tcp/10.0.0.5:7447").unwrap().robot, "robot");
        assert_eq!(of("tim").unwrap().robot, "tim");
        assert_eq!(of("domain=3").unwrap().domain, 3);
        for wrong in ["Tim", "tim=10.0.0.5", "tim,speed=3", "domain=x", "namespace=r1", "topic=scan"] {
            assert!(of(wrong).is_err(), "{wrong}");
        }
    }
}
