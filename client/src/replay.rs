//! Plays a recorded log to a server: the robot's streams and the guide's sentences, in the log's
//! order and at a multiple of its pace.

use crate::guide::is_final;
use crate::log::{LogRecord, Records};
use crate::{ClientError, Guide, Planner, Robot, RobotConfig};
use std::collections::BTreeMap;
use std::time::Duration;
use tokio::sync::broadcast::{Receiver, error::TryRecvError};
use tokio::time::{Instant, sleep_until, timeout};
use toponym_proto::answer::{Ack, Heard};
use toponym_proto::{Message, Say, Stamp};
use tracing::warn;
use zenoh::Session;

/// How long the filter may take for what it was handed before the end.
const FILTER_WAIT: Duration = Duration::from_secs(300);
/// Feedback comes right behind the filter, and what is not heard is said again; this long after the last nothing more
/// will come.
const FEEDBACK_QUIET: Duration = Duration::from_secs(30);

/// How a log is played.
#[derive(Clone, Debug)]
pub struct Replay {
    /// Site, robot, boot, clock.
    pub robot: RobotConfig,
    /// The map to put it into; none: the one that the log's setup names.
    pub map: Option<String>,
    /// Seconds of the log per second; none: as fast as the server takes it.
    pub speed: Option<f64>,
}

/// What happens meanwhile.
#[derive(Debug)]
pub enum Progress<'a> {
    /// A message went out.
    Sent {
        /// Bytes of the log read, and in all.
        bytes: (u64, u64),
        /// Seconds of the log played.
        log_s: f64,
        /// Messages not acknowledged yet.
        in_flight: usize,
    },
    /// A sentence was dealt with: what was said, what became of it.
    Heard(&'a str, &'a Heard),
    /// All is sent; the server's watermark is waited for.
    Settling,
    /// All is acknowledged; the filter is waited for.
    Filtering,
}

/// What was played.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Replayed {
    /// Messages of the robot.
    pub messages: u64,
    /// Seq of the last of them.
    pub last_seq: u64,
    /// Sentences of the guide.
    pub sentences: u64,
    /// Sentences whose feedback came.
    pub heard: u64,
    /// The server's last watermark.
    pub ack: Option<Ack>,
    /// The map it went into.
    pub map: String,
}

struct Player<'a> {
    robot: Robot,
    guide: Guide,
    feedback: Receiver<Heard>,
    /// Sentences without feedback: id and text.
    waiting: BTreeMap<String, String>,
    tell: &'a mut dyn FnMut(Progress<'_>),
    done: Replayed,
    last: Stamp,
}

impl Replay {
    /// Plays the log to its end and waits until the server has taken all of it into the map.
    ///
    /// # Errors
    /// As [`Robot::send`].
    pub async fn run(
        &self,
        session: &Session,
        log: &mut dyn Records,
        tell: &mut dyn FnMut(Progress<'_>),
    ) -> Result<Replayed, ClientError> {
        let guide = Guide::connect(session, &self.robot.site, Some(&self.robot.robot)).await?;
        let robot = Robot::connect(session, self.robot.clone()).await?;
        let feedback = guide.feedback();
        let done = Replayed::default();
        let waiting = BTreeMap::new();
        let mut player = Player { robot, guide, feedback, waiting, tell, done, last: Stamp::default() };
        let (begin, mut first, mut ended) = (Instant::now(), None, false);
        while let Some(record) = log.next() {
            if let Some(header) = record.message.header() {
                player.last = header.stamp;
            }
            let first = *first.get_or_insert(player.last);
            let log_s = (player.last.ns.saturating_sub(first.ns)) as f64 * 1e-9;
            if let Some(speed) = self.speed {
                sleep_until(begin + Duration::try_from_secs_f64(log_s / speed).unwrap_or_default()).await;
            }
            ended = matches!(record.message, Message::End(_));
            player.play(record, self.map.as_deref(), session, &self.robot.site).await?;
            player.hear();
            let in_flight = player.robot.in_flight();
            (player.tell)(Progress::Sent { bytes: log.progress(), log_s, in_flight });
        }
        if !ended {
            player.done.last_seq = player.robot.end(player.last).await?;
            player.done.messages += 1;
        }
        player.finish(session, &self.robot.site).await
    }
}

impl Player<'_> {
    async fn play(
        &mut self,
        record: LogRecord,
        map: Option<&str>,
        session: &Session,
        site: &str,
    ) -> Result<(), ClientError> {
        match record.message {
            Message::Say(say) => {
                // The log's robot may play under another name.
                let say = Say { robot: None, ..say };
                self.guide.publish(&say).await?;
                self.done.sentences += 1;
                self.waiting.insert(say.id, say.text);
            }
            Message::Mend(mend) => {
                let planner = Planner::new(session, site, &self.done.map, FILTER_WAIT)?;
                if let Err(e) = planner.mend(&mend).await {
                    warn!("{mend:?} was not done: {e}");
                }
            }
            mut message => {
                if let Message::Setup(setup) = &mut message {
                    if let Some(map) = map {
                        map.clone_into(&mut setup.map);
                    }
                    self.done.map.clone_from(&setup.map);
                }
                self.done.last_seq = self.robot.send(message).await?;
                self.done.messages += 1;
            }
        }
        Ok(())
    }

    /// Takes what feedback there is.
    fn hear(&mut self) {
        loop {
            match self.feedback.try_recv() {
                Ok(heard) => self.take(&heard),
                Err(TryRecvError::Lagged(_)) => {}
                Err(TryRecvError::Empty | TryRecvError::Closed) => return,
            }
        }
    }

    fn take(&mut self, heard: &Heard) {
        if !is_final(heard) {
            return;
        }
        if let Some(text) = self.waiting.remove(&heard.id) {
            self.done.heard += 1;
            (self.tell)(Progress::Heard(&text, heard));
        }
    }

    async fn finish(mut self, session: &Session, site: &str) -> Result<Replayed, ClientError> {
        (self.tell)(Progress::Settling);
        self.robot.settle().await?;
        (self.tell)(Progress::Filtering);
        // Saving goes through the filter's own queue: when it is done, so is all before it.
        let planner = Planner::new(session, site, &self.done.map, FILTER_WAIT)?;
        if let Err(e) = planner.save().await {
            warn!("the map was not saved: {e}");
        }
        self.hear();
        while !self.waiting.is_empty() {
            match timeout(FEEDBACK_QUIET, self.feedback.recv()).await {
                Ok(Ok(heard)) => self.take(&heard),
                Ok(Err(_)) => {}
                Err(_) => break,
            }
        }
        self.done.ack = self.robot.acked();
        Ok(self.done)
    }
}
