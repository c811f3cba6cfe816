//! A connection to the server, and questions over it.

use serde::de::DeserializeOwned;
use serde_json::{Value, json};
use std::time::Duration;
use thiserror::Error;
use tokio::time::{Instant, sleep_until, timeout_at};
use toponym_proto::Invalid;
use toponym_proto::answer::{ErrorCode, ErrorReply, Problem};
use toponym_proto::keys::DEFAULT_ENDPOINT;
use zenoh::Session;
use zenoh::query::ConsolidationMode;

/// Environment variable with the endpoint to connect to.
pub const CONNECT_ENV: &str = "TOPONYM_CONNECT";
/// How long a question without any reply is asked again: a server that just came back is found
/// by its clients before its queryables are.
const NOBODY_WAIT: Duration = Duration::from_secs(2);
/// Pause before asking again.
const AGAIN: Duration = Duration::from_millis(100);

/// What can go wrong between a client and its server.
#[derive(Debug, Error)]
pub enum ClientError {
    /// Nobody is there.
    #[error("no server at {endpoint}: {why}")]
    NoServer {
        /// The endpoint or the key that was tried.
        endpoint: String,
        /// What happened.
        why: String,
    },
    /// The server said no.
    #[error("refused: {}", told(.0))]
    Refused(Problem),
    /// The server did not answer in time.
    #[error("no answer within {:.1} s: {what}", .after.as_secs_f64())]
    Timeout {
        /// What was waited for.
        what: String,
        /// How long.
        after: Duration,
    },
    /// What was to be sent is refused by the protocol already.
    #[error(transparent)]
    Invalid(#[from] Invalid),
    /// An answer that can't be read: server and client are of different versions.
    #[error("{key}: unreadable answer: {why}")]
    Unreadable {
        /// Where it came from.
        key: String,
        /// What is wrong with it.
        why: String,
    },
    /// Zenoh's own.
    #[error("zenoh: {0}")]
    Zenoh(#[source] zenoh::Error),
}

fn told(problem: &Problem) -> String {
    match &problem.hint {
        Some(hint) => format!("{} ({hint})", problem.message),
        None => problem.message.clone(),
    }
}

impl From<zenoh::Error> for ClientError {
    fn from(e: zenoh::Error) -> Self {
        Self::Zenoh(e)
    }
}

/// Where to connect: what was given, else the environment's, else the default endpoint.
pub fn endpoint(given: Option<&str>) -> String {
    let environment = std::env::var(CONNECT_ENV).ok().filter(|e| !e.trim().is_empty());
    given.map(str::to_owned).or(environment).unwrap_or_else(|| DEFAULT_ENDPOINT.into())
}

/// Connects to a server such as `tcp/127.0.0.1:7457`. The session reconnects by itself later on.
///
/// # Errors
/// [`ClientError::NoServer`] if nobody listens there.
pub async fn open(endpoint: &str) -> Result<Session, ClientError> {
    let settings: [(&str, Value); 5] = [
        ("mode", json!("client")),
        // A server that was restarted is there again within a second.
        (
            "connect/retry",
            json!({"period_init_ms": 200, "period_max_ms": 2000, "period_increase_factor": 1.5}),
        ),
        ("connect/endpoints", json!([endpoint])),
        ("scouting/multicast/enabled", json!(false)),
        ("scouting/gossip/enabled", json!(false)),
    ];
    let mut config = zenoh::Config::default();
    for (key, value) in settings {
        config.insert_json5(key, &value.to_string()).map_err(|_| {
            Invalid::new("connect", format!("{endpoint:?} is no endpoint such as {DEFAULT_ENDPOINT}"))
        })?;
    }
    // Zenoh's text says no more than this, and where in its source it says it.
    zenoh::open(config).await.map_err(|_| ClientError::NoServer {
        endpoint: endpoint.into(),
        why: "nobody answers; start one with `toponym-server serve`, or name another with --connect".into(),
    })
}

/// Asks on a key until there is an answer. A server that is busy is asked again.
pub(crate) async fn ask<T: DeserializeOwned>(
    session: &Session,
    key: &str,
    arguments: &str,
    timeout: Duration,
) -> Result<T, ClientError> {
    let late = || ClientError::Timeout { what: key.into(), after: timeout };
    let nobody = || ClientError::NoServer {
        endpoint: key.into(),
        why: "connected, but nobody answers there; is --site right?".into(),
    };
    let (start, mut silent) = (Instant::now(), false);
    let deadline = start + timeout;
    let selector = if arguments.is_empty() { key.to_owned() } else { format!("{key}?{arguments}") };
    loop {
        let left = deadline.saturating_duration_since(Instant::now());
        let replies = session
            .get(&selector)
            .timeout(left)
            .consolidation(ConsolidationMode::None)
            // A question is not worth waiting for company on its way.
            .express(true)
            .await?;
        let Ok(reply) = timeout_at(deadline, replies.recv_async()).await else {
            return Err(if silent { nobody() } else { late() });
        };
        silent = reply.is_err();
        let again_until = match reply.ok().map(zenoh::query::Reply::into_result) {
            Some(Ok(sample)) => return read(key, &sample.payload().to_bytes()),
            Some(Err(error)) => match serde_json::from_slice::<ErrorReply>(&error.payload().to_bytes()) {
                Ok(ErrorReply { error }) if error.code == ErrorCode::Busy => deadline,
                Ok(ErrorReply { error }) => return Err(ClientError::Refused(error)),
                // Zenoh's own error, of which there is one: the query's time is over.
                Err(_) => return Err(late()),
            },
            None if start.elapsed() >= NOBODY_WAIT.min(timeout) => return Err(nobody()),
            None => start + NOBODY_WAIT.min(timeout),
        };
        sleep_until(again_until.min(Instant::now() + AGAIN)).await;
    }
}

/// Reads a JSON payload.
pub(crate) fn read<T: DeserializeOwned>(key: &str, bytes: &[u8]) -> Result<T, ClientError> {
    serde_json::from_slice(bytes).map_err(|e| ClientError::Unreadable { key: key.into(), why: e.to_string() })
}
