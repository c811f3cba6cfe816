//! A server in this process, on a port of its own, and a client of it.

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU32, Ordering};
use std::time::Duration;
use toponym_proto::answer::{Ack, ErrorReply, Heard, HeardStatus, Problem, RobotState};
use toponym_proto::codec::{ENCODING_BINCODE, ENCODING_JSON};
use toponym_proto::record::RecordReader;
use toponym_proto::{Clock, End, Header, Keys, Message, Say, Stamp};
use toponym_server::config::ServerConfig;
use toponym_server::serve::Server;
use toponym_sim::hall;
use zenoh::Session;
use zenoh::handlers::FifoChannelHandler;
use zenoh::pubsub::Subscriber;
use zenoh::qos::CongestionControl;
use zenoh::sample::Sample;

/// Nothing in these tests takes that long unless it has failed.
pub const PATIENCE: Duration = Duration::from_secs(60);

/// A folder that is gone with its owner.
pub struct Folder(pub PathBuf);

impl Folder {
    pub fn new() -> Self {
        static COUNT: AtomicU32 = AtomicU32::new(0);
        let name = format!("toponym-test-{}-{}", std::process::id(), COUNT.fetch_add(1, Ordering::Relaxed));
        let path = std::env::temp_dir().join(name);
        std::fs::create_dir_all(&path).unwrap();
        Self(path)
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

/// Settings for a small, quick map in this folder.
pub fn settings(folder: &Folder) -> ServerConfig {
    let mut config = ServerConfig {
        listen: vec!["tcp/127.0.0.1:0".into()],
        http: None,
        data: folder.0.join("data"),
        hold_back_s: 0.05,
        gap_wait_s: 0.3,
        ..ServerConfig::default()
    };
    config.mapper.particles = 2;
    config
}

/// A server and a client's session.
pub struct Site {
    pub server: Server,
    pub session: Session,
    pub keys: Keys,
}

impl Site {
    pub async fn start(config: ServerConfig) -> Self {
        Self::start_recording(config, None).await
    }

    pub async fn start_recording(config: ServerConfig, record: Option<&Path>) -> Self {
        let server = Server::start(config, record.map(Into::into)).await.unwrap();
        let session = connect(&server).await;
        Self { server, session, keys: Keys::new("default").unwrap() }
    }

    /// All that was acknowledged is in the maps.
    pub async fn settle(&self) {
        self.ask(&self.keys.command("save"), "").await.unwrap();
    }

    pub async fn stop(self) {
        self.settle().await;
        self.server.stop().await.unwrap();
    }

    /// Publishes bytes.
    pub async fn put(&self, key: &str, encoding: &str, bytes: Vec<u8>) {
        let put = self.session.put(key, bytes).encoding(encoding);
        put.congestion_control(CongestionControl::Block).await.unwrap();
    }

    /// Publishes a message where it belongs, in bincode.
    pub async fn send(&self, message: &Message) {
        self.put(&self.key(message), ENCODING_BINCODE, message.to_bincode().unwrap()).await;
    }

    /// The same in JSON.
    pub async fn send_json(&self, message: &Message) {
        self.put(&self.key(message), ENCODING_JSON, message.to_json().unwrap()).await;
    }

    pub fn key(&self, message: &Message) -> String {
        match message {
            Message::Setup(m) => self.keys.setup(&m.header.robot),
            Message::Odom(m) => self.keys.odom(&m.header.robot),
            Message::Scan(m) => self.keys.scan(&m.header.robot, &m.laser),
            Message::End(m) => self.keys.end(&m.header.robot),
            Message::Say(m) => self.keys.say(m.robot.as_deref()),
            Message::Mend(_) => self.keys.command("undo"),
        }
    }

    pub async fn listen(&self, key: String) -> Listener {
        Listener(self.session.declare_subscriber(key).await.unwrap())
    }

    pub async fn acks(&self, robot: &str) -> Listener {
        self.listen(self.keys.ack(robot)).await
    }

    pub async fn states(&self, robot: &str) -> Listener {
        self.listen(self.keys.state(robot)).await
    }

    /// The one reply to a query: JSON, or the error.
    pub async fn ask(&self, selector: &str, payload: &str) -> Result<serde_json::Value, Problem> {
        let replies = self.session.get(selector).payload(payload).timeout(PATIENCE).await.unwrap();
        let reply = replies.recv_async().await.expect("a reply");
        match reply.result() {
            Ok(sample) => Ok(serde_json::from_slice(&sample.payload().to_bytes()).unwrap()),
            Err(e) => {
                let reply: ErrorReply = serde_json::from_slice(&e.payload().to_bytes()).unwrap();
                Err(reply.error)
            }
        }
    }
}

/// A client's session with the server.
pub async fn connect(server: &Server) -> Session {
    let mut config = zenoh::Config::default();
    for (key, value) in [
        ("mode", "\"client\"".into()),
        ("connect/endpoints", format!("[\"{}\"]", server.endpoints()[0])),
        ("scouting/multicast/enabled", "false".into()),
    ] {
        config.insert_json5(key, &value).unwrap();
    }
    zenoh::open(config).await.unwrap()
}

/// What is published on a key.
pub struct Listener(Subscriber<FifoChannelHandler<Sample>>);

impl Listener {
    /// The first that fits.
    pub async fn until<T: serde::de::DeserializeOwned>(&self, fits: impl Fn(&T) -> bool) -> T {
        let wait = async {
            loop {
                let sample = self.0.recv_async().await.unwrap();
                let value: T = serde_json::from_slice(&sample.payload().to_bytes()).unwrap();
                if fits(&value) {
                    return value;
                }
            }
        };
        tokio::time::timeout(PATIENCE, wait).await.expect("nothing that fits was published")
    }

    pub async fn ack_of(&self, seq: u64) -> Ack {
        self.until(|ack: &Ack| ack.seq == seq).await
    }

    pub async fn state(&self, fits: impl Fn(&RobotState) -> bool) -> RobotState {
        self.until(fits).await
    }

    pub async fn heard(&self, id: &str) -> Heard {
        self.until(|heard: &Heard| heard.id == id && heard.status != HeardStatus::Read).await
    }
}

/// A saved map: as [`toponym_core::Mapper::save`] wrote it.
pub fn saved_map(folder: &Folder, map: &str) -> Vec<u8> {
    let folder = folder.0.join("data").join(map);
    let names = std::fs::read_dir(&folder).unwrap().map(|e| e.unwrap().file_name().into_string().unwrap());
    let newest =
        names.filter(|name| name.ends_with(".checkpoint") && !name.starts_with("new")).max().unwrap();
    let bytes = std::fs::read(folder.join(&newest)).unwrap();
    let checkpoint = toponym_journal::Checkpoint::read(&newest, &bytes).unwrap();
    toponym_server::fold::saved_map(&checkpoint.map).unwrap().to_vec()
}

/// The messages of a record file.
pub fn recorded(path: &Path) -> Vec<Message> {
    let reader = RecordReader::new(std::fs::File::open(path).unwrap()).unwrap();
    reader.map(|m| m.unwrap().1).collect()
}

/// The streams of a robot that drives through a hall of 12 m by 6 m, from its setup to its end.
pub fn drive(robot: &str, map: &str) -> Vec<Message> {
    let mut stream = vec![setup(robot, map)];
    for step in 0..40_u64 {
        let x_m = 1.5 + 0.2 * step as f64;
        stream.push(odom(robot, 2 * step + 1, x_m));
        stream.push(scan(robot, 2 * step + 2, x_m));
    }
    stream.push(Message::End(End { header: header(robot, 81) }));
    stream
}

pub fn header(robot: &str, seq: u64) -> Header {
    let stamp = Stamp { ns: 1_000_000_000 + seq as i64 * 50_000_000 };
    Header { robot: robot.into(), boot: 1, seq, stamp, clock: Clock::Log }
}

pub fn setup(robot: &str, map: &str) -> Message {
    hall::setup(header(robot, 0), map)
}

pub fn odom(robot: &str, seq: u64, x_m: f64) -> Message {
    hall::odom(header(robot, seq), x_m)
}

fn scan(robot: &str, seq: u64, x_m: f64) -> Message {
    hall::scan(header(robot, seq), x_m, 81)
}

pub fn say(robot: Option<&str>, id: &str, text: &str, began: Option<Stamp>) -> Say {
    Say { id: id.into(), robot: robot.map(Into::into), text: text.into(), began, ..Say::default() }
}
