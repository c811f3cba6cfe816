//! The connection to a robot's router, and what comes over it.

use crate::bag::Topic;
use crate::plan::{is_speech, kind};
use crate::wire::{self, Hashes};
use serde_json::{Value, json};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, SystemTime, UNIX_EPOCH};
use tokio::sync::mpsc::{Receiver, Sender, channel};
use zenoh::Session;
use zenoh::sample::{Locality, Sample};
use zenoh_ext::{AdvancedSubscriberBuilderExt, HistoryConfig, RecoveryConfig};

use super::RosRobot;

/// Messages on their way; of a robot with 200 transforms and 40 scans a second, some seconds.
const QUEUE: usize = 4096;
/// No message that is read is longer: a scan of 100 000 rays, with intensities.
const MESSAGE_MAX_BYTES: usize = 1 << 20;
/// How long who latches a topic may take to answer.
const HISTORY_WAIT: Duration = Duration::from_secs(5);

/// A message as it came.
#[derive(Clone, Debug)]
pub struct Arrived {
    /// Its topic.
    pub topic: Topic,
    /// When, Unix nanoseconds.
    pub received_ns: i64,
    /// How its key tells its type.
    pub hashes: Hashes,
    /// Its number, and who sent it.
    pub numbered: Option<(i64, [u8; 16])>,
    /// CDR.
    pub data: Vec<u8>,
}

/// Opens a session as a client of the robot's router.
///
/// # Errors
/// If nobody listens there.
pub async fn open(robot: &RosRobot) -> Result<Session, zenoh::Error> {
    let settings: [(&str, Value); 6] = [
        ("mode", json!("client")),
        ("connect/endpoints", json!([robot.endpoint])),
        (
            "connect/retry",
            json!({"period_init_ms": 200, "period_max_ms": 2000, "period_increase_factor": 1.5}),
        ),
        ("scouting/multicast/enabled", json!(false)),
        ("scouting/gossip/enabled", json!(false)),
        // Topics that are latched need it.
        ("timestamping/enabled", json!(true)),
    ];
    let mut config = zenoh::Config::default();
    for (key, value) in settings {
        config.insert_json5(key, &value.to_string())?;
    }
    zenoh::open(config).await
}

/// Now, Unix nanoseconds.
pub fn now_ns() -> i64 {
    SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |since| since.as_nanos() as i64)
}

/// What comes from a robot.
pub struct Ear {
    /// The messages.
    pub arrivals: Receiver<Arrived>,
    /// How many found no room.
    pub dropped: Arc<AtomicU64>,
}

impl Ear {
    /// Listens to all that may be a part of the robot; until the session closes.
    ///
    /// # Errors
    /// Zenoh's.
    pub async fn new(session: &Session, robot: &RosRobot) -> Result<Self, zenoh::Error> {
        let (sender, arrivals) = channel(QUEUE);
        let dropped = Arc::new(AtomicU64::new(0));
        let space = robot.namespace.trim_matches('/');
        let inside = if space.is_empty() { "**".to_owned() } else { format!("{space}/**") };
        let names = |kind: &'static str| {
            let own: Vec<String> = if robot.topics.is_empty() || kind == kind::CLOCK {
                vec![inside.clone()]
            } else {
                robot.topics.clone()
            };
            own.into_iter().map(move |name| (name, kind))
        };
        let mut wanted: Vec<(String, &str)> =
            [kind::SCAN, kind::ODOMETRY, kind::TEXT].into_iter().flat_map(names).collect();
        wanted.extend(topics_of("tf", &inside).map(|name| (name, kind::TF)));
        wanted.extend(topics_of("clock", &inside).map(|name| (name, kind::CLOCK)));
        for (name, kind) in wanted {
            let (sender, dropped) = (sender.clone(), dropped.clone());
            let wanted = robot.topics.clone();
            // Of all the texts of a robot only what people say.
            let is_wanted = move |name: &str| kind != kind::TEXT || is_speech(name, &wanted);
            session
                .declare_subscriber(wire::key(robot.domain, &name, kind, "*"))
                .allowed_origin(Locality::Remote)
                .callback(move |sample| hand_over(&sender, &dropped, &sample, &is_wanted))
                .background()
                .await?;
        }
        for name in topics_of("tf_static", &inside) {
            let (sender, dropped) = (sender.clone(), dropped.clone());
            session
                .declare_subscriber(wire::key(robot.domain, &name, kind::TF, "*"))
                .allowed_origin(Locality::Remote)
                .callback(move |sample| hand_over(&sender, &dropped, &sample, &|_| true))
                .history(HistoryConfig::default().detect_late_publishers().max_samples(1))
                .recovery(RecoveryConfig::default().heartbeat())
                .query_timeout(HISTORY_WAIT)
                .subscriber_detection()
                .background()
                .await?;
        }
        Ok(Self { arrivals, dropped })
    }
}

/// A topic of a namespace, and that of all.
fn topics_of(name: &str, inside: &str) -> impl Iterator<Item = String> {
    let own = format!("{inside}/{name}");
    // `**` is no chunk at all, too.
    let of_all = (inside != "**").then(|| name.to_owned());
    [own].into_iter().chain(of_all)
}

fn hand_over(
    sender: &Sender<Arrived>,
    dropped: &AtomicU64,
    sample: &Sample,
    is_wanted: &dyn Fn(&str) -> bool,
) {
    let topic = wire::topic_of(sample.key_expr().as_str()).filter(|(name, _)| is_wanted(name));
    let Some((name, kind)) = topic else { return };
    if sample.payload().len() > MESSAGE_MAX_BYTES {
        dropped.fetch_add(1, Ordering::Relaxed);
        return;
    }
    let data = sample.payload().to_bytes().into_owned();
    let numbered = sample.attachment().and_then(|bytes| wire::attached(&bytes.to_bytes()));
    let topic = Topic { name, kind, is_cdr: true };
    let hashes = Hashes::in_key(sample.key_expr().as_str());
    let arrived = Arrived { topic, received_ns: now_ns(), hashes, numbered, data };
    if sender.try_send(arrived).is_err() {
        dropped.fetch_add(1, Ordering::Relaxed);
    }
}
