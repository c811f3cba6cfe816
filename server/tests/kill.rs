//! `kill -9` of the real server, again and again, while a robot drives and a guide talks: nothing that was acknowledged
//! is lost, nothing counts twice, and robot and guide go on by themselves.
//!
//! `TOPONYM_KILLS` sets how often (3), `TOPONYM_SEED` when.

#![allow(clippy::unwrap_used)]

use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;
use std::net::TcpListener;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};
use toponym::{Guide, Planner, Robot, RobotConfig};
use toponym_proto::record::RecordReader;
use toponym_proto::{Clock, Header, Laser, Message, Odom, Pose, Scan, Setup, Stamp};

/// Nothing here takes that long unless it has failed.
const PATIENCE: Duration = Duration::from_secs(120);
/// From message to message.
const PERIOD: Duration = Duration::from_millis(2);
/// A sentence after so many messages.
const SENTENCE_EACH: u64 = 40;

/// A server of its own, killed when dropped.
struct Server {
    child: Child,
    began: Instant,
}

impl Server {
    fn start(folder: &Path, endpoint: &str) -> Self {
        let child = Command::new(env!("CARGO_BIN_EXE_toponym-server"))
            .args(["serve", "--listen", endpoint, "--data"])
            .arg(folder.join("data"))
            .arg("--record")
            .arg(folder.join("run.rec"))
            .env("RUST_LOG", "error")
            .stdout(Stdio::null())
            .spawn()
            .unwrap();
        Self { child, began: Instant::now() }
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// How often, and when.
fn setting(name: &str, default: u64) -> u64 {
    std::env::var(name).ok().map_or(default, |text| text.parse().unwrap())
}

fn setup() -> Message {
    let laser = Laser {
        id: "front".into(),
        x_m: 0.0,
        y_m: 0.0,
        yaw_rad: 0.0,
        upside_down: false,
        range_min_m: 0.05,
        range_max_m: 30.0,
        ignored_rad: vec![],
    };
    Message::Setup(Setup { header: Header::default(), map: "main".into(), lasers: vec![laser] })
}

/// The message of this number of a robot that goes up and down a hall of 12 m by 6 m.
fn message(n: u64) -> Message {
    let header = Header { stamp: Stamp { ns: n as i64 * 25_000_000 }, ..Header::default() };
    let along = (n as f64 * 0.01) % 16.0;
    let x_m = 2.0 + if along < 8.0 { along } else { 16.0 - along };
    if n % 2 == 1 {
        return Message::Odom(Odom { header, odom_from_body: Pose { x_m, y_m: 3.0, yaw_rad: 0.0 } });
    }
    let range = |k: i32| {
        let (sin, cos) = (-2.0_f64 + 0.05 * f64::from(k)).sin_cos();
        let along = if cos > 0.0 { (12.0 - x_m) / cos } else { -x_m / cos };
        let across = if sin > 0.0 { 3.0 / sin } else { -3.0 / sin };
        along.min(across) as f32
    };
    Message::Scan(Scan {
        header,
        laser: "front".into(),
        angle_min_rad: -2.0,
        angle_increment_rad: 0.05,
        time_increment_s: 0.0,
        ranges_m: (0..81).map(range).collect(),
    })
}

struct Drive {
    robot: Robot,
    guide: Guide,
    sent: u64,
    said: u64,
    /// The highest watermark that was ever told.
    acked: u64,
}

impl Drive {
    /// Sends the next message, and a sentence now and then.
    async fn go(&mut self) {
        let next = if self.sent == 0 { setup() } else { message(self.sent) };
        self.robot.send(next).await.unwrap();
        self.sent += 1;
        if self.sent.is_multiple_of(SENTENCE_EACH) {
            let began = Some(Stamp { ns: self.sent as i64 * 25_000_000 });
            let say = toponym_proto::Say { began, ..self.guide.sentence("this is the workshop") };
            self.guide.publish(&say).await.unwrap();
            self.said += 1;
        }
        if let Some(ack) = self.robot.acked() {
            assert!(ack.seq >= self.acked, "the watermark fell from {} to {}", self.acked, ack.seq);
            assert_eq!(ack.lost, 0);
            self.acked = ack.seq;
        }
        tokio::time::sleep(PERIOD).await;
    }

    async fn settle(&mut self) {
        self.robot.settle().await.unwrap();
        let deadline = Instant::now() + PATIENCE;
        while self.guide.unheard() > 0 {
            assert!(Instant::now() < deadline, "{} sentences are not heard", self.guide.unheard());
            tokio::time::sleep(PERIOD).await;
        }
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn what_was_acknowledged_survives_kill_9() {
    let (kills, seed) = (setting("TOPONYM_KILLS", 3), setting("TOPONYM_SEED", 1));
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let folder = std::env::temp_dir().join(format!("toponym-kill-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let port = TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap().port();
    let endpoint = format!("tcp/127.0.0.1:{port}");
    let mut server = Server::start(&folder, &endpoint);
    let session = connected(&endpoint).await;
    let config = RobotConfig { clock: Clock::Log, boot: 1, ..RobotConfig::new("r1") };
    let mut drive = Drive {
        robot: Robot::connect(&session, config).await.unwrap(),
        guide: Guide::connect(&session, "default", Some("r1")).await.unwrap(),
        sent: 0,
        said: 0,
        acked: 0,
    };
    let mut progressed = 0;
    for kill in 0..kills {
        let after = Duration::from_millis(random.random_range(0..1500));
        let before = drive.acked;
        while server.began.elapsed() < after {
            drive.go().await;
        }
        drop(server);
        server = Server::start(&folder, &endpoint);
        progressed += u64::from(drive.acked > before);
        // Every other time the robot has to be taken again before the next kill.
        if kill % 2 == 1 {
            let before = drive.acked;
            let deadline = Instant::now() + PATIENCE;
            while drive.acked == before {
                assert!(
                    Instant::now() < deadline,
                    "the robot is not taken again after kill {kill}, seed {seed}"
                );
                drive.go().await;
            }
        }
    }
    drive.settle().await;
    let planner = Planner::new(&session, "default", "main", PATIENCE).unwrap();
    planner.save().await.unwrap();
    let told: u64 = planner.labels().await.unwrap().labels.iter().map(|l| l.utterances).sum();
    assert_eq!(told, drive.said, "sentences in the map, and said");
    drop(server);
    check_record(&folder.join("run.rec"), &drive);
    println!("{kills} kills, {progressed} with progress: {} messages, {} sentences", drive.sent, drive.said);
    std::fs::remove_dir_all(folder).unwrap();
}

/// A session, once the server listens.
async fn connected(endpoint: &str) -> zenoh::Session {
    let deadline = Instant::now() + PATIENCE;
    loop {
        match toponym::open(endpoint).await {
            Ok(session) => return session,
            Err(e) => assert!(Instant::now() < deadline, "{e}"),
        }
    }
}

/// All messages entered the map, each once, in their order; and each sentence once.
fn check_record(path: &Path, drive: &Drive) {
    let reader = RecordReader::new(std::fs::File::open(path).unwrap()).unwrap();
    let messages: Vec<Message> = reader.map(|m| m.unwrap().1).collect();
    let seqs: Vec<u64> = messages.iter().filter_map(|m| Some(m.header()?.seq)).collect();
    assert!(seqs.iter().copied().eq(0..drive.sent), "{} of {} messages", seqs.len(), drive.sent);
    let id = |m: &Message| if let Message::Say(say) = m { Some(say.id.clone()) } else { None };
    let mut ids: Vec<String> = messages.iter().filter_map(id).collect();
    assert_eq!(ids.len() as u64, drive.said);
    ids.sort_unstable();
    ids.dedup();
    assert_eq!(ids.len() as u64, drive.said, "each once");
}
