//! A robot that speaks ROS 2 as rmw_zenoh does, without ROS: its router, a node that publishes, and a listener of transforms.

use std::collections::{BTreeMap, VecDeque};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Instant;
use toponym_ros::cdr;
use toponym_ros::frames::{isometry, moving, name};
use toponym_ros::live::{Speaker, Writer};
use toponym_ros::msg::TFMessage;
use toponym_ros::plan::kind;
use toponym_ros::wire::{Hashes, Qos, key};
use zenoh::Session;

/// As tf2 has it.
const BUFFER_NS: i64 = 10_000_000_000;

/// A zenoh session with these settings beside what both router and node have.
async fn session(settings: &[(&str, String)]) -> Result<Session, zenoh::Error> {
    let mut config = zenoh::Config::default();
    let both =
        [("scouting/multicast/enabled", "false".to_owned()), ("timestamping/enabled", "true".to_owned())];
    for (key, value) in both.iter().chain(settings) {
        config.insert_json5(key, value)?;
    }
    zenoh::open(config).await
}

/// A robot: its `rmw_zenohd`, and a node.
pub struct RosRobot {
    router: Session,
    /// The node's session, a peer.
    pub node: Session,
    speaker: Speaker,
    hashes: Hashes,
    domain: u32,
    writers: BTreeMap<(String, String), Writer>,
    /// Each message of it has a publisher of its own, as there are as many nodes.
    latched: Vec<Writer>,
    endpoint: String,
}

impl RosRobot {
    /// Starts both; `listen` may have port 0.
    ///
    /// # Errors
    /// Zenoh's.
    pub async fn start(
        listen: &str,
        domain: u32,
        namespace: &str,
        hashes: Hashes,
    ) -> Result<Self, zenoh::Error> {
        let router = session(&[
            ("mode", "\"router\"".into()),
            ("listen/endpoints", format!("[{listen:?}]")),
            ("scouting/delay", "0".into()),
        ])
        .await?;
        let endpoint = router.info().locators().await.first().map(ToString::to_string).unwrap_or_default();
        let node = session(&[
            ("mode", "\"peer\"".into()),
            ("connect/endpoints", format!("[{endpoint:?}]")),
            ("listen/endpoints", "[\"tcp/localhost:0\"]".into()),
        ])
        .await?;
        let speaker = Speaker::new(&node, domain, namespace, hashes).await?;
        Ok(Self {
            router,
            node,
            speaker,
            hashes,
            domain,
            writers: BTreeMap::new(),
            latched: Vec::new(),
            endpoint,
        })
    }

    /// Where the router listens.
    pub fn endpoint(&self) -> &str {
        &self.endpoint
    }

    /// Waits until toponym is seen, and with it its subscriptions; and until it tells types as this robot does.
    ///
    /// # Errors
    /// Zenoh's.
    pub async fn wait_for_toponym(&mut self) -> Result<(), zenoh::Error> {
        let (tokens, own) = (format!("@ros2_lv/{}/**", self.domain), self.node.zid().to_string());
        let seen = self.node.liveliness().declare_subscriber(tokens).history(true).await?;
        loop {
            let token = seen.recv_async().await?.key_expr().to_string();
            // Its services come last.
            if token.contains("/SS/") && token.contains("where_is") && !token.contains(&own) {
                if Hashes::in_key(&token) == self.hashes {
                    return Ok(());
                }
                // It hears how this one speaks.
                self.write("/tf", kind::TF, &TFMessage::default()).await?;
            }
        }
    }

    /// Publishes a message that is CDR already; `…/tf_static` is latched.
    ///
    /// # Errors
    /// In words.
    pub async fn publish(&mut self, topic: &str, kind: &str, data: Vec<u8>) -> Result<(), String> {
        let why = |e: zenoh::Error| e.to_string();
        if topic.ends_with("tf_static") {
            let writer = self.speaker.topic(topic, kind, Qos::Latched).await.map_err(why)?;
            writer.put(data).await?;
            self.latched.push(writer);
            return Ok(());
        }
        let id = (topic.to_owned(), kind.to_owned());
        if !self.writers.contains_key(&id) {
            let qos = if kind == kind::SCAN { Qos::BestEffort(5) } else { Qos::Reliable(100) };
            self.writers.insert(id.clone(), self.speaker.topic(topic, kind, qos).await.map_err(why)?);
        }
        match self.writers.get(&id) {
            Some(writer) => writer.put(data).await,
            None => Ok(()),
        }
    }

    /// As if a message had got lost on its way.
    pub fn lose(&self, topic: &str, kind: &str) {
        if let Some(writer) = self.writers.get(&(topic.to_owned(), kind.to_owned())) {
            writer.skip();
        }
    }

    /// Publishes a message.
    ///
    /// # Errors
    /// In words.
    pub async fn write<T: serde::Serialize>(
        &mut self,
        topic: &str,
        kind: &str,
        message: &T,
    ) -> Result<(), String> {
        self.publish(topic, kind, cdr::write(message)?).await
    }

    /// Listens to transforms on a topic as tf2 does.
    ///
    /// # Errors
    /// Zenoh's.
    pub async fn transforms(&self, topic: &str) -> Result<Transforms, zenoh::Error> {
        let known = Arc::new(Mutex::new(Buffer::default()));
        let buffer = known.clone();
        self.node
            .declare_subscriber(key(self.domain, topic, kind::TF, "*"))
            .callback(move |sample| {
                if let Ok(message) = cdr::read(&sample.payload().to_bytes()) {
                    buffer.lock().unwrap_or_else(PoisonError::into_inner).take(&message);
                }
            })
            .background()
            .await?;
        Ok(Transforms { known })
    }

    /// Ends node and router.
    ///
    /// # Errors
    /// Zenoh's.
    pub async fn stop(self) -> Result<(), zenoh::Error> {
        self.node.close().await?;
        self.router.close().await
    }
}

/// What was heard of a transform: stamps, and x, y and yaw.
type Track = VecDeque<(i64, [f64; 3])>;

/// What tf2 keeps.
#[derive(Default)]
struct Buffer {
    /// By parent and child.
    tracks: BTreeMap<(String, String), Track>,
    /// Times between arrivals of transforms from `map`, seconds.
    periods_s: Vec<f64>,
    last: Option<Instant>,
}

impl Buffer {
    fn take(&mut self, message: &TFMessage) {
        for t in &message.transforms {
            let (frames, pose) = (moving(t), isometry(&t.transform));
            if frames.parent == "map" {
                let now = Instant::now();
                self.periods_s.extend(self.last.map(|last| (now - last).as_secs_f64()));
                self.last = Some(now);
            }
            let yaw_rad = pose.rotation.euler_angles().2;
            let track = self.tracks.entry((frames.parent, frames.child)).or_default();
            let stamp_ns = t.header.stamp.ns();
            let at = track.partition_point(|(known, _)| *known <= stamp_ns);
            track.insert(at, (stamp_ns, [pose.translation.x, pose.translation.y, yaw_rad]));
            while track.back().is_some_and(|newest| track.front().is_some_and(|o| newest.0 - o.0 > BUFFER_NS))
            {
                track.pop_front();
            }
        }
    }
}

/// Transforms as they are known now.
pub struct Transforms {
    known: Arc<Mutex<Buffer>>,
}

impl Transforms {
    /// x, y and yaw of a child in its parent at a stamp: between two that are known, or not at all.
    pub fn look_up(&self, parent: &str, child: &str, stamp_ns: i64) -> Option<[f64; 3]> {
        let known = self.known.lock().unwrap_or_else(PoisonError::into_inner);
        let track = known.tracks.get(&(name(parent), name(child)))?;
        let after = track.partition_point(|(known, _)| *known < stamp_ns);
        let (b_ns, b) = *track.get(after)?;
        if b_ns == stamp_ns {
            return Some(b);
        }
        let (a_ns, a) = *track.get(after.checked_sub(1)?)?;
        let share = (stamp_ns - a_ns) as f64 / (b_ns - a_ns) as f64;
        let turn =
            (b[2] - a[2] + std::f64::consts::PI).rem_euclid(std::f64::consts::TAU) - std::f64::consts::PI;
        Some([a[0] + share * (b[0] - a[0]), a[1] + share * (b[1] - a[1]), a[2] + share * turn])
    }

    /// x, y and yaw of a child in its parent as told last.
    pub fn newest(&self, parent: &str, child: &str) -> Option<[f64; 3]> {
        let known = self.known.lock().unwrap_or_else(PoisonError::into_inner);
        known.tracks.get(&(name(parent), name(child)))?.back().map(|(_, pose)| *pose)
    }

    /// Times between arrivals of transforms from `map`, seconds.
    pub fn periods_s(&self) -> Vec<f64> {
        self.known.lock().unwrap_or_else(PoisonError::into_inner).periods_s.clone()
    }
}
