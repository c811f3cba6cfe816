//! A robot that drives and a guide that talks, whatever happens to their server; and the server.

use std::collections::BTreeMap;
use std::net::TcpListener;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::atomic::{AtomicU32, Ordering};
use std::time::{Duration, Instant};
use tokio::sync::broadcast::error::TryRecvError;
use toponym::guide::is_final;
use toponym::{Connection, Guide, Planner, Robot, RobotConfig};
use toponym_proto::answer::{Heard, HeardStatus};
use toponym_proto::record::RecordReader;
use toponym_proto::{Clock, Message, Stamp};
use toponym_sim::hall::{PERIOD_NS, message};

/// Nothing here takes that long unless it has failed.
pub const PATIENCE: Duration = Duration::from_secs(120);
/// From message to message: more than ten times as fast as robots are.
const PERIOD: Duration = Duration::from_millis(2);
/// A sentence after so many messages.
const SENTENCE_EACH: u64 = 40;

/// A server in a process and a folder of its own, both gone when dropped.
pub struct Server {
    child: Child,
    pub began: Instant,
    pub folder: PathBuf,
    pub endpoint: String,
}

impl Server {
    pub fn new() -> Self {
        static COUNT: AtomicU32 = AtomicU32::new(0);
        let name = format!("toponym-outage-{}-{}", std::process::id(), COUNT.fetch_add(1, Ordering::Relaxed));
        let folder = std::env::temp_dir().join(name);
        std::fs::create_dir_all(&folder).unwrap();
        let port = TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap().port();
        let endpoint = format!("tcp/127.0.0.1:{port}");
        Self { child: Self::start(&folder, &endpoint), began: Instant::now(), folder, endpoint }
    }

    fn start(folder: &Path, endpoint: &str) -> Child {
        Command::new(env!("CARGO_BIN_EXE_toponym-server"))
            .args(["serve", "--no-http", "--listen", endpoint, "--data"])
            .arg(folder.join("data"))
            .arg("--record")
            .arg(folder.join("run.rec"))
            .stdout(Stdio::null())
            .stderr(std::fs::OpenOptions::new().create(true).append(true).open(folder.join("log")).unwrap())
            .spawn()
            .unwrap()
    }

    /// Lines that it has logged.
    pub fn logged(&self) -> usize {
        std::fs::read_to_string(self.folder.join("log")).unwrap_or_default().lines().count()
    }

    /// `user …`: says who may do what.
    pub fn user(&self, arguments: &[&str]) {
        let done = Command::new(env!("CARGO_BIN_EXE_toponym-server"))
            .args(["user", "--data"])
            .arg(self.folder.join("data"))
            .args(arguments)
            .output()
            .unwrap();
        assert!(done.status.success(), "{arguments:?}: {}", String::from_utf8_lossy(&done.stderr));
    }

    /// Memory that it uses.
    pub fn memory_bytes(&self) -> u64 {
        let status = std::fs::read_to_string(format!("/proc/{}/status", self.child.id())).unwrap_or_default();
        let line = status.lines().find_map(|line| line.strip_prefix("VmRSS:"));
        line.and_then(|line| line.split_whitespace().next()?.parse::<u64>().ok()).unwrap_or(0) << 10
    }

    /// kill -9.
    pub fn end(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }

    /// kill -9, and another start.
    pub fn restart(&mut self) {
        self.end();
        (self.child, self.began) = (Self::start(&self.folder, &self.endpoint), Instant::now());
    }

    /// Sends a signal, such as "TERM".
    #[cfg(unix)]
    pub fn signal(&self, name: &str) {
        let signalled = Command::new("kill").args(["-s", name, &self.child.id().to_string()]).status();
        assert!(signalled.unwrap().success());
    }

    /// Waits until it has ended by itself; tells whether it says that all went well.
    pub fn ended(&mut self) -> bool {
        self.child.wait().unwrap().success()
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        self.end();
        let _ = std::fs::remove_dir_all(&self.folder);
    }
}

/// How often, and when.
pub fn setting(name: &str, default: u64) -> u64 {
    std::env::var(name).ok().map_or(default, |text| text.parse().unwrap())
}

/// The robot and its guide.
pub struct Drive {
    session: zenoh::Session,
    pub robot: Robot,
    guide: Guide,
    feedback: tokio::sync::broadcast::Receiver<Heard>,
    /// What became of sentences, by id.
    heard: BTreeMap<String, Heard>,
    pub sent: u64,
    pub said: u64,
    /// From message to message.
    pub period: Duration,
    /// The highest watermark that was ever told.
    pub acked: u64,
}

impl Drive {
    /// Connects to a server, once it listens there.
    pub async fn begin(endpoint: &str) -> Self {
        Self::begin_as(&Connection::to(endpoint)).await
    }

    /// The same as somebody.
    pub async fn begin_as(connection: &Connection) -> Self {
        let session = connected(connection).await;
        let config = RobotConfig { clock: Clock::Log, boot: 1, ..RobotConfig::new("r1") };
        let guide = Guide::connect(&session, "default", Some("r1")).await.unwrap();
        Self {
            robot: Robot::connect(&session, config).await.unwrap(),
            feedback: guide.feedback(),
            heard: BTreeMap::new(),
            guide,
            session,
            sent: 0,
            said: 0,
            period: PERIOD,
            acked: 0,
        }
    }

    /// Nothing is lost and nothing counts twice, in the map nor in the server's record.
    pub async fn check(mut self, server: &Server) {
        self.settle().await;
        let planner = Planner::new(&self.session, "default", "main", PATIENCE).unwrap();
        planner.save().await.unwrap();
        let told: u64 = planner.labels().await.unwrap().labels.iter().map(|l| l.utterances).sum();
        let others: Vec<&Heard> =
            self.heard.values().filter(|h| h.status != HeardStatus::Understood).collect();
        assert!(
            others.is_empty(),
            "{} sentences came to something else, such as {:?}",
            others.len(),
            others[0]
        );
        assert_eq!(told, self.said, "sentences in the map, and said");
        check_record(&server.folder.join("run.rec"), &self);
    }

    /// Until something more is acknowledged.
    pub async fn until_taken(&mut self, what: &str) {
        let (before, deadline) = (self.acked, Instant::now() + PATIENCE);
        while self.acked == before {
            assert!(Instant::now() < deadline, "the robot is not taken again after {what}");
            self.go().await;
        }
    }

    /// For some time.
    pub async fn go_for(&mut self, time: Duration) {
        let began = Instant::now();
        while began.elapsed() < time {
            self.go().await;
        }
    }

    /// Sends the next message, and a sentence now and then.
    pub async fn go(&mut self) {
        self.robot.send(message(self.sent, "main", 81)).await.unwrap();
        self.sent += 1;
        if self.sent.is_multiple_of(SENTENCE_EACH) {
            let began = Some(Stamp { ns: self.sent as i64 * PERIOD_NS });
            let say = toponym_proto::Say { began, ..self.guide.sentence("this is the workshop") };
            self.guide.publish(&say).await.unwrap();
            self.said += 1;
        }
        self.hear();
        if let Some(ack) = self.robot.acked() {
            assert!(ack.seq >= self.acked, "the watermark fell from {} to {}", self.acked, ack.seq);
            assert_eq!(ack.lost, 0);
            self.acked = ack.seq;
        }
        tokio::time::sleep(self.period).await;
    }

    /// Notes what became of sentences.
    fn hear(&mut self) {
        loop {
            match self.feedback.try_recv() {
                Ok(heard) if is_final(&heard) => drop(self.heard.insert(heard.id.clone(), heard)),
                Ok(_) | Err(TryRecvError::Lagged(_)) => {}
                Err(_) => return,
            }
        }
    }

    /// All is acknowledged, and heard.
    async fn settle(&mut self) {
        self.robot.settle().await.unwrap();
        let mut feedback = self.guide.feedback();
        while self.guide.unheard() > 0 {
            let heard = tokio::time::timeout(PATIENCE, feedback.recv()).await;
            assert!(heard.is_ok(), "{} sentences are not heard", self.guide.unheard());
        }
        self.hear();
    }
}

/// A session, once the server listens.
pub async fn connected(connection: &Connection) -> zenoh::Session {
    let deadline = Instant::now() + PATIENCE;
    loop {
        match connection.open().await {
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
