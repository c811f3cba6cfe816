//! The guide's role: says what places are called and hears what became of it.
//!
//! A sentence is said again, under its id, until the server has told what became of it: it survives cuts of the
//! network and restarts of the server, and with [`Guide::keep_in`] ends of the guide's program. It counts once, and where
//! the robot was when it was said first.

use crate::said::Said;
use crate::session::ClientError;
use std::collections::VecDeque;
use std::path::Path;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;
use tokio::sync::broadcast::{Receiver, Sender, channel, error::RecvError};
use tokio::task::JoinHandle;
use tokio::time::{Instant, interval, timeout_at};
use toponym_proto::answer::{ErrorCode, Heard, HeardStatus};
use toponym_proto::codec::ENCODING_JSON;
use toponym_proto::{Keys, Limits, Message, Refused, Say};
use tracing::warn;
use zenoh::Session;
use zenoh::pubsub::Subscriber;
use zenoh::qos::CongestionControl;

/// Feedback kept for a slow listener; the oldest goes first.
const FEEDBACK: usize = 1024;
/// Sentences kept until it is known what became of them; the oldest goes first.
const UNHEARD_MAX: usize = 10_000;
/// A sentence of which nothing is heard is said again after this, the next time after twice as long …
const AGAIN: Duration = Duration::from_secs(1);
/// … but no longer than this.
const AGAIN_MAX: Duration = Duration::from_secs(8);
/// How often it is looked what is to be said again.
const LOOK: Duration = Duration::from_millis(200);

/// Talks to one robot, or to the only one there is.
#[derive(Debug)]
pub struct Guide {
    session: Session,
    keys: Keys,
    robot: Option<String>,
    /// Who says it, told with every sentence.
    pub speaker: Option<String>,
    feedback: Sender<Heard>,
    unheard: Arc<Mutex<Unheard>>,
    repeater: JoinHandle<()>,
    _subscriber: Subscriber<()>,
}

impl Drop for Guide {
    fn drop(&mut self) {
        self.repeater.abort();
    }
}

/// Sentences of which it is not known yet what became of them, in the order in which they were said.
#[derive(Debug, Default)]
struct Unheard {
    sentences: VecDeque<Sentence>,
    /// The same on disk.
    said: Option<Said>,
}

#[derive(Debug)]
struct Sentence {
    key: String,
    say: Say,
    said_at: Instant,
    /// How long ago it was said by then.
    ago: Duration,
    again_at: Instant,
    wait: Duration,
}

impl Sentence {
    /// As it is said at `now`: one that began at no known time began so long ago.
    fn json(&self, now: Instant) -> Option<Vec<u8>> {
        let ago_s = (self.ago + (now - self.said_at)).as_secs_f64();
        let ago_s = self.say.ago_s.unwrap_or_default() + ago_s;
        let is_told = self.say.began.is_none() && ago_s > 0.0;
        Message::Say(Say { ago_s: is_told.then_some(ago_s), ..self.say.clone() }).to_json().ok()
    }
}

impl Unheard {
    /// A sentence said so long ago.
    fn add(&mut self, key: String, say: Say, ago: Duration) {
        if self.sentences.len() >= UNHEARD_MAX
            && let Some(oldest) = self.sentences.pop_front()
        {
            warn!(id = oldest.say.id, "given up: the server tells nothing of too many sentences");
            self.forget(&oldest.say.id);
        }
        let said_at = Instant::now();
        let sentence = Sentence { key, say, said_at, ago, again_at: said_at + AGAIN, wait: AGAIN };
        self.sentences.push_back(sentence);
    }

    fn forget(&mut self, id: &str) {
        if let Some(said) = &mut self.said {
            said.forget(id);
        }
    }

    /// What became of a sentence is known, unless it only waits for its turn.
    fn hear(&mut self, heard: &Heard) {
        if is_final(heard) {
            self.sentences.retain(|s| s.say.id != heard.id);
            self.forget(&heard.id);
        }
    }

    /// What is to be said again at `now`: all that is waited for, so that the order is kept, once the oldest is due.
    fn due(&mut self, now: Instant) -> Vec<(String, Vec<u8>)> {
        if self.sentences.front().is_none_or(|oldest| oldest.again_at > now) {
            return Vec::new();
        }
        let again = |sentence: &mut Sentence| {
            sentence.wait = (2 * sentence.wait).min(AGAIN_MAX);
            sentence.again_at = now + sentence.wait;
            Some((sentence.key.clone(), sentence.json(now)?))
        };
        self.sentences.iter_mut().filter_map(again).collect()
    }
}

/// Whether nothing more becomes of a sentence: it is in the map, or can't be.
pub fn is_final(heard: &Heard) -> bool {
    match (&heard.status, &heard.error) {
        (HeardStatus::Read, _) => false,
        (HeardStatus::Refused, Some(problem)) => {
            !matches!(problem.code, ErrorCode::Busy | ErrorCode::Internal)
        }
        _ => true,
    }
}

fn lock(unheard: &Mutex<Unheard>) -> MutexGuard<'_, Unheard> {
    unheard.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Guide {
    /// Listens for feedback. `robot` may be left out where there is exactly one.
    ///
    /// # Errors
    /// If the site is no id; Zenoh's own.
    pub async fn connect(session: &Session, site: &str, robot: Option<&str>) -> Result<Self, ClientError> {
        let keys = Keys::new(site)?;
        let (feedback, _) = channel(FEEDBACK);
        let unheard = Arc::new(Mutex::new(Unheard::default()));
        let (sender, known) = (feedback.clone(), unheard.clone());
        let subscriber = session
            .declare_subscriber(keys.heard(robot.unwrap_or("*")))
            .callback(move |sample| match serde_json::from_slice(&sample.payload().to_bytes()) {
                Ok(heard) => {
                    lock(&known).hear(&heard);
                    // Nobody listening is no error.
                    let _ = sender.send(heard);
                }
                Err(e) => warn!(key = sample.key_expr().as_str(), "unreadable feedback: {e}"),
            })
            .await?;
        Ok(Self {
            session: session.clone(),
            keys,
            robot: robot.map(Into::into),
            speaker: None,
            feedback,
            repeater: tokio::spawn(repeat(session.clone(), unheard.clone())),
            unheard,
            _subscriber: subscriber,
        })
    }

    /// Keeps sentences in a folder until it is known what became of them, and says again what an earlier guide left
    /// there; how many those are.
    ///
    /// # Errors
    /// [`ClientError::Spool`]: the medium's.
    pub async fn keep_in(&self, folder: &Path) -> Result<usize, ClientError> {
        let (said, left) = Said::open(folder).map_err(ClientError::Spool)?;
        let again = {
            let mut unheard = lock(&self.unheard);
            unheard.said = Some(said);
            for (say, ago) in left {
                unheard.add(self.key(&say), say, ago);
            }
            unheard.due(Instant::now() + AGAIN)
        };
        for (key, json) in &again {
            put(&self.session, key, json.clone()).await;
        }
        Ok(again.len())
    }

    fn key(&self, say: &Say) -> String {
        self.keys.say(say.robot.as_deref().or(self.robot.as_deref()))
    }

    /// A sentence said now, with a new id.
    pub fn sentence(&self, text: &str) -> Say {
        Say { robot: self.robot.clone(), speaker: self.speaker.clone(), ..sentence(text) }
    }

    /// Says something and waits for what became of it: understood or not, it is an answer.
    ///
    /// # Errors
    /// [`ClientError::Refused`] if it can't be used, [`ClientError::Timeout`] without feedback.
    pub async fn say(&self, text: &str, timeout: Duration) -> Result<Heard, ClientError> {
        self.send(&self.sentence(text), timeout).await
    }

    /// Says yes or no to what was asked about a sentence.
    ///
    /// # Errors
    /// As [`Guide::say`].
    pub async fn answer(&self, id: &str, text: &str, timeout: Duration) -> Result<Heard, ClientError> {
        let say = Say { answers: Some(id.into()), ..self.sentence(text) };
        self.send(&say, timeout).await
    }

    /// Publishes a sentence and waits for what became of it.
    ///
    /// # Errors
    /// As [`Guide::say`].
    pub async fn send(&self, say: &Say, timeout: Duration) -> Result<Heard, ClientError> {
        let (mut feedback, deadline) = (self.feedback(), Instant::now() + timeout);
        self.publish(say).await?;
        let mut last: Option<Heard> = None;
        loop {
            match timeout_at(deadline, feedback.recv()).await {
                Ok(Ok(heard)) if heard.id == say.id && is_final(&heard) => {
                    return match heard {
                        Heard { status: HeardStatus::Refused, error: Some(error), .. } => {
                            Err(ClientError::Refused(error))
                        }
                        heard => Ok(heard),
                    };
                }
                Ok(Ok(heard)) if heard.id == say.id => last = Some(heard),
                Ok(Ok(_) | Err(RecvError::Lagged(_))) => {}
                // The sender lives as long as this guide, so it can only be late.
                Ok(Err(RecvError::Closed)) | Err(_) => return Err(not_yet(&say.text, timeout, last)),
            }
        }
    }

    /// Publishes a sentence without waiting; its feedback comes by [`Guide::feedback`], and until then it is said
    /// again.
    ///
    /// # Errors
    /// If the protocol refuses it; if it can't be kept.
    pub async fn publish(&self, say: &Say) -> Result<(), ClientError> {
        let message = Message::Say(say.clone());
        message.validate(&Limits::default())?;
        let json = message
            .to_json()
            .map_err(|e: Refused| ClientError::Unreadable { key: "say".into(), why: e.to_string() })?;
        let key = self.key(say);
        {
            let mut unheard = lock(&self.unheard);
            if let Some(said) = &mut unheard.said {
                said.keep(say).map_err(ClientError::Spool)?;
            }
            unheard.add(key.clone(), say.clone(), Duration::ZERO);
        }
        put(&self.session, &key, json).await;
        Ok(())
    }

    /// Sentences of which it is not known yet what became of them.
    pub fn unheard(&self) -> usize {
        lock(&self.unheard).sentences.len()
    }

    /// All feedback from now on, to this guide's sentences and to others'.
    pub fn feedback(&self) -> Receiver<Heard> {
        self.feedback.subscribe()
    }
}

/// A sentence with a new id.
pub fn sentence(text: &str) -> Say {
    Say { id: ulid::Ulid::generate().to_string(), text: text.into(), ..Say::default() }
}

/// Why there is no answer yet, with what is known.
fn not_yet(text: &str, after: Duration, last: Option<Heard>) -> ClientError {
    let what = match last {
        None => format!("feedback to {text:?}: it is not known whether it arrived"),
        Some(Heard { status: HeardStatus::Read, .. }) => {
            format!(
                "what becomes of {text:?}: the server has it on disk, and takes it in when its turn comes"
            )
        }
        Some(Heard { error: Some(error), .. }) => return ClientError::Refused(error),
        Some(heard) => format!("what becomes of {text:?}: {}", heard.words),
    };
    ClientError::Timeout { what, after }
}

/// Says again what nothing is heard of.
async fn repeat(session: Session, unheard: Arc<Mutex<Unheard>>) {
    let mut look = interval(LOOK);
    loop {
        look.tick().await;
        let due = lock(&unheard).due(Instant::now());
        for (key, json) in due {
            put(&session, &key, json).await;
        }
    }
}

async fn put(session: &Session, key: &str, json: Vec<u8>) {
    let put = session.put(key, json).encoding(ENCODING_JSON);
    if let Err(e) = put.congestion_control(CongestionControl::Block).express(true).await {
        // It is said again.
        warn!(key, "could not be sent now: {e}");
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_not_heard_is_said_again_in_order() {
        let (mut unheard, now) = (Unheard::default(), Instant::now());
        for id in ["a", "b", "c"] {
            unheard.add(id.into(), Say { id: id.into(), ..Say::default() }, Duration::ZERO);
        }
        let keys = |due: Vec<(String, Vec<u8>)>| due.into_iter().map(|(key, _)| key).collect::<String>();
        assert_eq!(keys(unheard.due(now)), "");
        unheard.hear(&Heard::new("b", HeardStatus::NotUnderstood));
        unheard.hear(&Heard::new("a", HeardStatus::Read));
        assert_eq!(keys(unheard.due(now + 2 * AGAIN)), "ac");
        assert_eq!(keys(unheard.due(now + 3 * AGAIN)), "", "twice as long after that");
        assert_eq!(keys(unheard.due(now + 100 * AGAIN)), "ac");
        unheard.hear(&Heard::new("a", HeardStatus::Asked));
        unheard.hear(&Heard::new("c", HeardStatus::Understood));
        assert!(unheard.sentences.is_empty());
    }

    #[test]
    fn what_is_said_again_was_said_a_while_ago() {
        let (mut unheard, now) = (Unheard::default(), Instant::now());
        let began = Some(toponym_proto::Stamp { ns: 5 });
        unheard.add("a".into(), Say { id: "a".into(), ..Say::default() }, Duration::from_secs(100));
        unheard.add("b".into(), Say { id: "b".into(), began, ..Say::default() }, Duration::ZERO);
        let due = unheard.due(now + Duration::from_secs(30));
        let said: Vec<Say> = due.iter().map(|(_, json)| serde_json::from_slice(json).unwrap()).collect();
        assert!((said[0].ago_s.unwrap() - 130.0).abs() < 1.0, "{said:?}");
        assert_eq!((said[1].ago_s, said[1].began), (None, began));
    }

    #[test]
    fn what_is_refused_for_now_is_said_again() {
        let refused = |code| {
            let error = Some(toponym_proto::answer::Problem::new(code, "no"));
            Heard { error, ..Heard::new("a", HeardStatus::Refused) }
        };
        assert!(!is_final(&refused(ErrorCode::Busy)));
        assert!(is_final(&refused(ErrorCode::NoSuchRobot)));
    }
}
