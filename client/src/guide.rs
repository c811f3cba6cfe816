//! The guide's role: says what places are called and hears what became of it.

use crate::session::ClientError;
use std::time::Duration;
use tokio::sync::broadcast::{Receiver, Sender, channel, error::RecvError};
use tokio::time::{Instant, timeout_at};
use toponym_proto::answer::{Heard, HeardStatus};
use toponym_proto::codec::ENCODING_JSON;
use toponym_proto::{Keys, Limits, Message, Refused, Say};
use tracing::warn;
use zenoh::Session;
use zenoh::pubsub::Subscriber;
use zenoh::qos::CongestionControl;

/// Feedback kept for a slow listener; the oldest goes first.
const FEEDBACK: usize = 1024;

/// Talks to one robot, or to the only one there is.
#[derive(Debug)]
pub struct Guide {
    session: Session,
    keys: Keys,
    robot: Option<String>,
    /// Who says it, told with every sentence.
    pub speaker: Option<String>,
    feedback: Sender<Heard>,
    _subscriber: Subscriber<()>,
}

impl Guide {
    /// Listens for feedback. `robot` may be left out where there is exactly one.
    ///
    /// # Errors
    /// If the site is no id; Zenoh's own.
    pub async fn connect(session: &Session, site: &str, robot: Option<&str>) -> Result<Self, ClientError> {
        let keys = Keys::new(site)?;
        let (feedback, _) = channel(FEEDBACK);
        let sender = feedback.clone();
        let subscriber = session
            .declare_subscriber(keys.heard(robot.unwrap_or("*")))
            .callback(move |sample| match serde_json::from_slice(&sample.payload().to_bytes()) {
                // Nobody listening is no error.
                Ok(heard) => drop(sender.send(heard)),
                Err(e) => warn!(key = sample.key_expr().as_str(), "unreadable feedback: {e}"),
            })
            .await?;
        Ok(Self {
            session: session.clone(),
            keys,
            robot: robot.map(Into::into),
            speaker: None,
            feedback,
            _subscriber: subscriber,
        })
    }

    /// A sentence said now, with a new id.
    pub fn sentence(&self, text: &str) -> Say {
        Say {
            id: ulid::Ulid::generate().to_string(),
            robot: self.robot.clone(),
            text: text.into(),
            speaker: self.speaker.clone(),
            ..Say::default()
        }
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
        loop {
            match timeout_at(deadline, feedback.recv()).await {
                Ok(Ok(Heard { id, error: Some(error), status: HeardStatus::Refused, .. }))
                    if id == say.id =>
                {
                    return Err(ClientError::Refused(error));
                }
                Ok(Ok(heard)) if heard.id == say.id => return Ok(heard),
                Ok(Ok(_) | Err(RecvError::Lagged(_))) => {}
                // The sender lives as long as this guide, so it can only be late.
                Ok(Err(RecvError::Closed)) | Err(_) => {
                    return Err(ClientError::Timeout {
                        what: format!("feedback to {:?}", say.text),
                        after: timeout,
                    });
                }
            }
        }
    }

    /// Publishes a sentence without waiting; its feedback comes by [`Guide::feedback`].
    ///
    /// # Errors
    /// If the protocol refuses it; Zenoh's own.
    pub async fn publish(&self, say: &Say) -> Result<(), ClientError> {
        let message = Message::Say(say.clone());
        message.validate(&Limits::default())?;
        let json = message
            .to_json()
            .map_err(|e: Refused| ClientError::Unreadable { key: "say".into(), why: e.to_string() })?;
        self.session
            .put(self.keys.say(say.robot.as_deref().or(self.robot.as_deref())), json)
            .encoding(ENCODING_JSON)
            .congestion_control(CongestionControl::Block)
            .express(true)
            .await?;
        Ok(())
    }

    /// All feedback from now on, to this guide's sentences and to others'.
    pub fn feedback(&self) -> Receiver<Heard> {
        self.feedback.subscribe()
    }
}
