//! The robot's role: streams setup, odometry and scans, and knows what the server has.
//!
//! A publication that went well proves nothing. What counts is the server's watermark on
//! `out/ack`; whatever is above it is kept here and sent again when the watermark stands still.

mod config;

pub use config::{Form, RobotConfig};

use crate::session::{ClientError, ask};
use crate::spool::Spool;
use std::collections::{BTreeMap, VecDeque};
use std::path::PathBuf;
use std::time::Duration;
use tokio::sync::watch;
use tokio::time::{Instant, timeout_at};
use toponym_proto::answer::{Ack, Problem, RobotState};
use toponym_proto::codec::{ENCODING_BINCODE, ENCODING_JSON};
use toponym_proto::keys::check_id;
use toponym_proto::{End, Header, Invalid, Keys, Limits, Message, Odom, Pose, Scan, Setup, Stamp};
use tracing::warn;
use zenoh::Session;
use zenoh::bytes::ZBytes;
use zenoh::pubsub::Subscriber;
use zenoh::qos::CongestionControl;
use zenoh_ext::{AdvancedPublisher, AdvancedPublisherBuilderExt, CacheConfig, MissDetectionConfig};

/// Lets a server notice that the last message is missing.
const HEARTBEAT: Duration = Duration::from_millis(500);
/// Longest time between two rounds of sending again: a server that comes back waits for them, but
/// not much longer.
const RESEND_MAX: Duration = Duration::from_secs(8);
/// How long the server may take to tell its watermark when asked.
const ASK_WAIT: Duration = Duration::from_secs(1);

/// A message that isn't acknowledged yet.
struct Unacked {
    seq: u64,
    key: String,
    bytes: ZBytes,
}

/// One robot's streams, from one start of the robot to its end.
pub struct Robot {
    session: Session,
    config: RobotConfig,
    keys: Keys,
    /// Seq of the next message.
    next: u64,
    publishers: BTreeMap<String, AdvancedPublisher<'static>>,
    unacked: VecDeque<Unacked>,
    spool: Option<Spool>,
    /// When the watermark last moved, or the first message after it was sent.
    moved: Instant,
    /// When all above it was last sent again.
    resent: Instant,
    resend_after: Duration,
    acks: watch::Receiver<Option<Ack>>,
    states: watch::Receiver<Option<RobotState>>,
    _subscribers: [Subscriber<()>; 2],
}

impl Robot {
    /// Gets ready to send; the first message should be a [`Setup`]. What an earlier start left in the spool is sent before.
    ///
    /// # Errors
    /// If site or robot are no ids; if what was left can't be read, or sent; Zenoh's own.
    pub async fn connect(session: &Session, config: RobotConfig) -> Result<Self, ClientError> {
        check_id("robot", &config.robot)?;
        let keys = Keys::new(&config.site)?;
        let (acks, on_ack) = latest(session, keys.ack(&config.robot)).await?;
        let (states, on_state) = latest(session, keys.state(&config.robot)).await?;
        let resend_after = config.resend_after;
        let open = |folder: &PathBuf| Spool::open(folder, &config.robot, config.spool_max_bytes);
        let spool = config.spool.as_ref().map(open).transpose().map_err(ClientError::Spool)?;
        let mut robot = Self {
            session: session.clone(),
            config,
            keys,
            next: 0,
            publishers: BTreeMap::new(),
            unacked: VecDeque::new(),
            spool,
            moved: Instant::now(),
            resent: Instant::now(),
            resend_after,
            acks,
            states,
            _subscribers: [on_ack, on_state],
        };
        robot.send_what_was_left().await?;
        Ok(robot)
    }

    /// Sends what earlier starts left in the spool, each with its own boot.
    async fn send_what_was_left(&mut self) -> Result<(), ClientError> {
        let own = self.config.boot;
        while let Some(boot) = self.spool.as_ref().and_then(Spool::boot) {
            self.config.boot = boot;
            let settled = self.settle().await;
            self.config.boot = own;
            settled?;
        }
        Ok(())
    }

    /// Presents the robot: its header needs no more than a stamp.
    pub async fn setup(&mut self, setup: Setup) -> Result<u64, ClientError> {
        self.send(Message::Setup(setup)).await
    }

    /// Sends wheel odometry.
    pub async fn odom(&mut self, stamp: Stamp, odom_from_body: Pose) -> Result<u64, ClientError> {
        let header = Header { stamp, ..Header::default() };
        self.send(Message::Odom(Odom { header, odom_from_body })).await
    }

    /// Sends a sweep: its header needs no more than a stamp.
    pub async fn scan(&mut self, scan: Scan) -> Result<u64, ClientError> {
        self.send(Message::Scan(scan)).await
    }

    /// Tells that the stream ends: nothing is waited for any more.
    pub async fn end(&mut self, stamp: Stamp) -> Result<u64, ClientError> {
        self.send(Message::End(End { header: Header { stamp, ..Header::default() } })).await
    }

    /// Sends a message of the robot's; all of its header but the stamp is filled in here. Returns
    /// its seq. Waits while too much is unacknowledged.
    ///
    /// # Errors
    /// If the protocol refuses the message (nothing is sent then), the server refuses the robot,
    /// or acknowledges nothing for longer than the patience set.
    pub async fn send(&mut self, mut message: Message) -> Result<u64, ClientError> {
        let seq = self.next;
        let (robot, boot, clock) = (self.config.robot.clone(), self.config.boot, self.config.clock);
        let Some(header) = header_mut(&mut message) else {
            return Err(Invalid::new("message", "is a sentence: these are a guide's").into());
        };
        *header = Header { robot, boot, seq, clock, stamp: header.stamp };
        message.validate(&Limits::default())?;
        self.drop_acked();
        while self.spool.as_ref().is_some_and(Spool::is_full) {
            self.progress().await?;
            self.refill().await?;
        }
        if !self.keep(seq, &message)? {
            while self.unacked.len() >= self.config.in_flight_max {
                self.progress().await?;
            }
            self.launch(seq, &message).await?;
        }
        self.next += 1;
        self.refill().await?;
        if Instant::now() >= self.resend_at() {
            // Somewhere behind, something is missing: the server waits for it, but not for long.
            self.resend().await?;
        }
        self.check_refused()?;
        Ok(seq)
    }

    /// Puts a message into the spool; true if it waits there for its turn.
    fn keep(&mut self, seq: u64, message: &Message) -> Result<bool, ClientError> {
        let Some(spool) = &mut self.spool else { return Ok(false) };
        let waits = spool.waits() || self.unacked.len() >= self.config.in_flight_max;
        let bincode = message
            .to_bincode()
            .map_err(|e| ClientError::Unreadable { key: "spool".into(), why: e.to_string() })?;
        spool.keep((self.config.boot, seq), &bincode, waits).map_err(ClientError::Spool)?;
        Ok(waits)
    }

    /// Sends a message whose turn it is.
    async fn launch(&mut self, seq: u64, message: &Message) -> Result<(), ClientError> {
        let (key, bytes) = self.encoded(message)?;
        if self.unacked.is_empty() {
            self.moved = Instant::now();
        }
        self.unacked.push_back(Unacked { seq, key: key.clone(), bytes: bytes.clone() });
        self.put(&key, bytes).await
    }

    /// Sends what waits in the spool, as far as there is room in flight.
    async fn refill(&mut self) -> Result<(), ClientError> {
        while self.unacked.len() < self.config.in_flight_max
            && let Some(spool) = &mut self.spool
            && let Some(message) = spool.next(self.config.boot).map_err(ClientError::Spool)?
        {
            let seq = message.header().map_or(0, |header| header.seq);
            self.launch(seq, &message).await?;
        }
        Ok(())
    }

    /// Waits until everything sent is acknowledged.
    ///
    /// # Errors
    /// As [`Robot::send`].
    pub async fn settle(&mut self) -> Result<(), ClientError> {
        self.drop_acked();
        self.refill().await?;
        while !self.unacked.is_empty() {
            self.progress().await?;
            self.refill().await?;
        }
        self.check_refused()
    }

    /// Messages sent that are not acknowledged yet.
    pub fn in_flight(&self) -> usize {
        self.unacked.len()
    }

    /// The newest watermark of this boot.
    pub fn acked(&self) -> Option<Ack> {
        self.acks.borrow().clone().filter(|ack| ack.boot == self.config.boot)
    }

    /// How the server gets along with this boot, as told last.
    pub fn state(&self) -> Option<RobotState> {
        self.states.borrow().clone().filter(|state| state.boot == Some(self.config.boot))
    }

    fn encoded(&self, message: &Message) -> Result<(String, ZBytes), ClientError> {
        let robot = &self.config.robot;
        let key = match message {
            Message::Scan(scan) => self.keys.scan(robot, &scan.laser),
            Message::Odom(_) => self.keys.odom(robot),
            Message::End(_) => self.keys.end(robot),
            Message::Setup(_) | Message::Say(_) | Message::Mend(_) => self.keys.setup(robot),
        };
        let bytes = match self.config.form {
            Form::Bincode => message.to_bincode(),
            Form::Json => message.to_json(),
        };
        match bytes {
            Ok(bytes) => Ok((key, bytes.into())),
            Err(e) => Err(ClientError::Unreadable { key, why: e.to_string() }),
        }
    }

    async fn put(&mut self, key: &str, bytes: ZBytes) -> Result<(), ClientError> {
        if !self.publishers.contains_key(key) {
            let publisher = self.publisher(key).await?;
            self.publishers.insert(key.into(), publisher);
        }
        if let Some(publisher) = self.publishers.get(key)
            && let Err(e) = publisher.put(bytes).await
        {
            // It stays in flight and is sent again.
            warn!(key, "could not be sent now: {e}");
        }
        Ok(())
    }

    async fn publisher(&self, key: &str) -> Result<AdvancedPublisher<'static>, ClientError> {
        let encoding = match self.config.form {
            Form::Bincode => ENCODING_BINCODE,
            Form::Json => ENCODING_JSON,
        };
        Ok(self
            .session
            .declare_publisher(key.to_owned())
            .encoding(encoding)
            .congestion_control(CongestionControl::Block)
            .cache(CacheConfig::default().max_samples(self.config.in_flight_max))
            .sample_miss_detection(MissDetectionConfig::default().heartbeat(HEARTBEAT))
            .publisher_detection()
            .await?)
    }

    fn drop_acked(&mut self) {
        if let Some(ack) = self.acked() {
            self.drop_until(ack.seq);
        }
    }

    fn drop_until(&mut self, seq: u64) {
        while self.unacked.front().is_some_and(|m| m.seq <= seq) {
            self.unacked.pop_front();
            (self.moved, self.resend_after) = (Instant::now(), self.config.resend_after);
        }
        if let Some(spool) = &mut self.spool
            && let Err(e) = spool.acknowledged((self.config.boot, seq))
        {
            warn!("what is acknowledged stays in the spool: {e}");
        }
    }

    fn check_refused(&self) -> Result<(), ClientError> {
        match self.state() {
            Some(RobotState { map: None, error: Some(problem), .. }) => Err(ClientError::Refused(problem)),
            _ => Ok(()),
        }
    }

    /// Waits for the watermark to move; when it stands still, asks for it and sends again what is
    /// above it.
    async fn progress(&mut self) -> Result<(), ClientError> {
        let deadline = self.resend_at().min(self.moved + self.config.patience);
        let told = timeout_at(deadline, async {
            tokio::select! {
                told = self.acks.changed() => told,
                told = self.states.changed() => told,
            }
        });
        if told.await.is_ok() {
            self.check_refused()?;
            self.drop_acked();
            return Ok(());
        }
        if self.moved.elapsed() >= self.config.patience {
            let what = format!("acknowledgement of {} messages", self.unacked.len());
            // Who tries again after all gets the same patience again.
            (self.moved, self.resend_after) = (Instant::now(), self.config.resend_after);
            return Err(ClientError::Timeout { what, after: self.config.patience });
        }
        self.resend().await
    }

    fn resend_at(&self) -> Instant {
        self.moved.max(self.resent) + self.resend_after
    }

    /// Asks for the watermark and sends again what is above it.
    async fn resend(&mut self) -> Result<(), ClientError> {
        self.resent = Instant::now();
        self.resend_after = (self.resend_after * 2).min(self.config.resend_after.max(RESEND_MAX));
        let asked: Result<Ack, _> =
            ask(&self.session, &self.keys.ack(&self.config.robot), "", ASK_WAIT).await;
        match asked {
            Ok(ack) if ack.boot == self.config.boot => self.drop_until(ack.seq),
            Ok(ack) if ack.boot > self.config.boot => {
                // A later start is known there: nothing of this one is taken any more.
                warn!(boot = self.config.boot, later = ack.boot, "all that is left of this start is dropped");
                self.drop_until(u64::MAX);
            }
            Ok(_) => {}
            Err(e) => warn!("the watermark is not known: {e}"),
        }
        let again: Vec<(String, ZBytes)> =
            self.unacked.iter().map(|m| (m.key.clone(), m.bytes.clone())).collect();
        for (key, bytes) in again {
            self.put(&key, bytes).await?;
        }
        Ok(())
    }

    /// What the server last complained of in this boot's messages, if anything.
    pub fn complaint(&self) -> Option<Problem> {
        self.state().and_then(|state| state.error)
    }
}

/// The newest value published on a key.
async fn latest<T>(
    session: &Session,
    key: String,
) -> Result<(watch::Receiver<Option<T>>, Subscriber<()>), ClientError>
where
    T: serde::de::DeserializeOwned + Send + Sync + 'static,
{
    let (sender, receiver) = watch::channel(None);
    let subscriber = session
        .declare_subscriber(key)
        .callback(move |sample| match serde_json::from_slice(&sample.payload().to_bytes()) {
            Ok(value) => drop(sender.send_replace(Some(value))),
            Err(e) => warn!(key = sample.key_expr().as_str(), "unreadable: {e}"),
        })
        .await?;
    Ok((receiver, subscriber))
}

fn header_mut(message: &mut Message) -> Option<&mut Header> {
    match message {
        Message::Setup(m) => Some(&mut m.header),
        Message::Odom(m) => Some(&mut m.header),
        Message::Scan(m) => Some(&mut m.header),
        Message::End(m) => Some(&mut m.header),
        Message::Say(_) | Message::Mend(_) => None,
    }
}
