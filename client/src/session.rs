//! A connection to the server, and questions over it.

use serde::de::DeserializeOwned;
use serde_json::{Value, json};
use std::path::PathBuf;
use std::time::Duration;
use thiserror::Error;
use tokio::time::{Instant, sleep_until, timeout_at};
use toponym_proto::Invalid;
use toponym_proto::answer::{ErrorCode, ErrorReply, Problem};
use toponym_proto::keys::{DEFAULT_ENDPOINT, check_link};
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
    /// What is kept on disk can't be written or read.
    #[error("spool: {0}")]
    Spool(#[source] std::io::Error),
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
    given.map(str::to_owned).or_else(|| environment(CONNECT_ENV)).unwrap_or_else(|| DEFAULT_ENDPOINT.into())
}

fn environment(name: &str) -> Option<String> {
    std::env::var(name).ok().filter(|value| !value.trim().is_empty())
}

/// Where to connect, and as whom.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Connection {
    /// Such as `tcp/127.0.0.1:7457` or, encrypted, `quic/maps.example.org:7457`.
    pub endpoint: String,
    /// User's name, for a server that knows users by passwords.
    pub user: Option<String>,
    /// User's password.
    pub password: Option<String>,
    /// Certificate of the authority that signed the server's, for `quic`.
    pub ca: Option<PathBuf>,
    /// One's own certificate and key, for a server that knows users by these.
    pub certificate: Option<(PathBuf, PathBuf)>,
}

impl Connection {
    /// To an endpoint, as nobody in particular.
    pub fn to(endpoint: &str) -> Self {
        Self { endpoint: endpoint.into(), ..Self::default() }
    }

    /// To an endpoint, as whom the environment says: `TOPONYM_USER` and `TOPONYM_PASSWORD`, `TOPONYM_CA`, `TOPONYM_CERT`
    /// and `TOPONYM_KEY` (files).
    pub fn of_environment(endpoint: &str) -> Self {
        let file = |name| environment(name).map(PathBuf::from);
        Self {
            endpoint: endpoint.into(),
            user: environment("TOPONYM_USER"),
            password: environment("TOPONYM_PASSWORD"),
            ca: file("TOPONYM_CA"),
            certificate: file("TOPONYM_CERT").zip(file("TOPONYM_KEY")),
        }
    }

    /// Connects. The session reconnects by itself later on.
    ///
    /// # Errors
    /// [`ClientError::NoServer`] if nobody listens there, or does not let this user in.
    pub async fn open(&self) -> Result<Session, ClientError> {
        // Zenoh's text says no more than this, and where in its source it says it.
        zenoh::open(self.config()?).await.map_err(|_| ClientError::NoServer {
            endpoint: self.endpoint.clone(),
            why: match (&self.user, &self.certificate) {
                (None, None) => {
                    "nobody answers, or not without a user: start a server with `toponym-server serve`, \
                                 name another with --connect, or say who you are with --user"
                        .into()
                }
                (Some(user), _) => format!("nobody answers, or {user:?} with this password is not let in"),
                (None, Some(_)) => "nobody answers, or does not know this certificate".into(),
            },
        })
    }

    fn config(&self) -> Result<zenoh::Config, ClientError> {
        let endpoints: Vec<&str> = self.endpoint.split(',').collect();
        endpoints.iter().try_for_each(|endpoint| check_link("connect", endpoint))?;
        let mut settings: Vec<(&str, Value)> = vec![
            ("mode", json!("client")),
            // A server that was restarted is there again within a second.
            (
                "connect/retry",
                json!({"period_init_ms": 200, "period_max_ms": 2000, "period_increase_factor": 1.5}),
            ),
            ("connect/endpoints", json!(endpoints)),
            ("scouting/multicast/enabled", json!(false)),
            ("scouting/gossip/enabled", json!(false)),
        ];
        match (&self.user, &self.password) {
            (Some(user), Some(password)) => settings.extend([
                ("transport/auth/usrpwd/user", json!(user)),
                ("transport/auth/usrpwd/password", json!(password)),
            ]),
            (None, None) => {}
            _ => return Err(Invalid::new("user", "a name needs a password, and a password a name").into()),
        }
        if let Some(ca) = &self.ca {
            settings.push(("transport/link/tls/root_ca_certificate", json!(ca)));
        }
        if let Some((certificate, key)) = &self.certificate {
            settings.extend([
                ("transport/link/tls/enable_mtls", json!(true)),
                ("transport/link/tls/connect_certificate", json!(certificate)),
                ("transport/link/tls/connect_private_key", json!(key)),
            ]);
        }
        for file in
            self.ca.iter().chain(self.certificate.iter().flat_map(|(certificate, key)| [certificate, key]))
        {
            std::fs::File::open(file).map_err(|e| Invalid::new("tls", format!("{}: {e}", file.display())))?;
        }
        let mut config = zenoh::Config::default();
        for (key, value) in settings {
            config.insert_json5(key, &value.to_string()).map_err(|_| {
                let endpoint = &self.endpoint;
                Invalid::new("connect", format!("{endpoint:?} is no endpoint such as {DEFAULT_ENDPOINT}"))
            })?;
        }
        Ok(config)
    }
}

/// Connects to a server such as `tcp/127.0.0.1:7457`, as whom the [environment says](Connection::of_environment).
///
/// # Errors
/// As [`Connection::open`].
pub async fn open(endpoint: &str) -> Result<Session, ClientError> {
    Connection::of_environment(endpoint).open().await
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
        why: "connected, but nobody answers there; is --site right, and may this user ask it?".into(),
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
