//! `serve`: robots and guides in, maps and answers out, over Zenoh.
//!
//! ```text
//! zenoh callbacks ─ Door (bounded, never blocks) ─► Intake thread: decode, order
//!                                                      │ bounded queue per map
//!                                                      ▼
//!                          Scribe thread per map: journal, sync ─► acknowledged
//!                                                      │ bounded queue per map
//!                                                      ▼
//!                          Mapping thread per map: Fold, Mapper::step ─► Outbox thread ─► zenoh
//!                                                      │ ArcSwap<Snapshot>        └─► Saver: checkpoints
//!                                                      ▼
//! zenoh queries ─► blocking tasks: answers from the Board, never from the filter
//! ```

mod answered;
pub mod args;
mod arguments;
pub mod aside;
pub mod board;
mod commands;
pub mod door;
mod intake;
mod log;
mod mapping;
mod maps;
mod mcap;
pub mod network;
mod outbox;
pub mod queries;
mod recording;
mod robot;
mod saver;
pub mod scribe;
pub mod watch;
mod written;

pub use args::{ServeArgs, run};
pub use log::{LogFormat, init_logging};
pub use network::NetworkError;

use crate::access::trial::{Op, TrialError, try_rules};
use crate::access::{Policy, PolicyError, Role};
use crate::config::{ConfigError, ServerConfig};
use crate::store::{Store, StoreError};
use crate::web;
use board::Board;
use door::Door;
use intake::Intake;
use maps::Maps;
use outbox::Outbox;
use recording::Recordings;
use std::net::SocketAddr;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::mpsc::sync_channel;
use std::thread::JoinHandle;
use std::time::Duration;
use toponym_proto::answer::{ErrorCode, ErrorReply, Problem};
use toponym_proto::codec::ENCODING_JSON;
use toponym_proto::limits::REFUSED_QUERIES_MAX;
use toponym_proto::{Keys, Limits};
use tracing::{info, warn};
use zenoh::query::Query;
use zenoh::{Session, Wait};
use zenoh_ext::{AdvancedSubscriberBuilderExt, HistoryConfig, RecoveryConfig};

/// How long a robot's cache may take to answer.
const HISTORY_WAIT: Duration = Duration::from_secs(2);

/// The server can't start or stop.
#[derive(Debug, thiserror::Error)]
pub enum ServeError {
    /// Settings.
    #[error(transparent)]
    Config(#[from] ConfigError),
    /// Data folder.
    #[error(transparent)]
    Store(#[from] StoreError),
    /// Users and roles.
    #[error(transparent)]
    Policy(#[from] PolicyError),
    /// Rules that do not hold.
    #[error(transparent)]
    Trial(#[from] TrialError),
    /// Zenoh.
    #[error(transparent)]
    Network(#[from] NetworkError),
    /// Maps that are not as they were when the server stopped.
    #[error("{}", .0.join("; "))]
    NotSaved(Vec<String>),
    /// Threads, files.
    #[error(transparent)]
    Io(#[from] std::io::Error),
}

impl From<zenoh::Error> for ServeError {
    fn from(e: zenoh::Error) -> Self {
        Self::Network(NetworkError::Zenoh(e))
    }
}

/// A running server.
pub struct Server {
    session: Session,
    board: Arc<Board>,
    door: Door,
    intake: JoinHandle<Vec<String>>,
    outbox: Outbox,
    publisher: JoinHandle<()>,
    _token: zenoh::liveliness::LivelinessToken,
    watchers: Vec<tokio::task::JoinHandle<()>>,
    mcap: Option<mcap::Mcap>,
    endpoints: Vec<String>,
    pages: Option<SocketAddr>,
}

/// Serves until `shutdown` is ready; then takes in what has arrived, saves all maps and returns.
/// `record`: file for what enters the map; one that is there goes on.
pub async fn serve(
    config: ServerConfig,
    record: Option<PathBuf>,
    shutdown: impl Future<Output = ()>,
) -> Result<(), ServeError> {
    let server = Server::start(config, record).await?;
    shutdown.await;
    info!("stopping");
    server.stop().await
}

impl Server {
    /// Loads the saved maps and opens the network; when this returns, clients can connect. A map that was not saved
    /// before the last stop takes in the rest of its journal meanwhile.
    pub async fn start(config: ServerConfig, record: Option<PathBuf>) -> Result<Self, ServeError> {
        config.check()?;
        let keys = Keys::new(&config.site).map_err(ConfigError::Invalid)?;
        let store = Arc::new(Store::open(&config.data)?);
        let policy = Policy::read(&config.policy_path())?;
        tell_access(&config, &policy);
        try_rules(&config, &policy).await?;
        let session = network::open(&config, &policy).await?;
        let endpoints = session.info().locators().await.iter().map(ToString::to_string).collect();
        let board = Arc::new(Board::new(keys.clone(), &config.site, &config.data, config.words()?));
        let records = record.map(Recordings::new).transpose()?;
        let (mut watchers, mut pages) = (Vec::new(), None);
        let (outbox, publisher) = Outbox::start(board.clone(), session.clone())?;
        let mut maps = Maps::new(config.clone(), board.clone(), outbox.clone(), store, records);
        maps.start_saved()?;
        let (door, arrivals) = Door::new(board.clone(), &config);
        if let Some(address) = &config.http {
            let (served, at) = web::serve(board.clone(), door.clone(), &config, &policy, address).await?;
            watchers.push(served);
            pages = at;
        }
        let (limits, robots, mcap) = (config.limits.clone(), config.ros.clone(), config.mcap.clone());
        let intake = Intake::new(config, board.clone(), outbox.clone(), maps);
        let intake =
            std::thread::Builder::new().name("intake".into()).spawn(move || intake.run(&arrivals))?;
        subscribe(&session, &keys, &door).await?;
        answer_queries(&session, &board, &limits).await?;
        let token = session.liveliness().declare_token(keys.alive(&session.zid().to_string())).await?;
        watchers.push(watch::tell_systemd(board.clone()));
        for robot in robots {
            let site = board.site.clone();
            watchers.push(tokio::spawn(toponym_ros::live::run(robot, site, session.clone())));
        }
        let mcap = match mcap {
            Some(file) => Some(mcap::Mcap::begin(&file, &session, board.clone()).await?),
            None => None,
        };
        let server = Self {
            session,
            board,
            door,
            intake,
            outbox,
            publisher,
            _token: token,
            watchers,
            mcap,
            endpoints,
            pages,
        };
        info!(site = server.board.site, endpoints = server.endpoints.join(" "), "listening");
        Ok(server)
    }

    /// What the outside may see.
    pub fn board(&self) -> Arc<Board> {
        self.board.clone()
    }

    /// Where clients can connect.
    pub fn endpoints(&self) -> &[String] {
        &self.endpoints
    }

    /// Where the pages are.
    pub fn pages(&self) -> Option<SocketAddr> {
        self.pages
    }

    /// Takes in what has arrived, saves all maps, closes the network. A map that could not be saved
    /// is an error, told when all is closed.
    pub async fn stop(self) -> Result<(), ServeError> {
        let Self { session, board, door, intake, outbox, publisher, watchers, mcap, .. } = self;
        board.leave();
        for watcher in &watchers {
            watcher.abort();
        }
        let done = tokio::task::spawn_blocking(move || {
            door.close();
            let intake = intake.join();
            outbox.stop();
            let publisher = publisher.join();
            intake.and_then(|failed| publisher.map(|()| failed))
        });
        let joined = done.await.map_err(std::io::Error::other)?;
        if let Some(mcap) = mcap {
            mcap.end().await;
        }
        session.close().await?;
        let failed =
            joined.map_err(|_| std::io::Error::other("a thread of the server failed: see the log"))?;
        if failed.is_empty() { Ok(()) } else { Err(ServeError::NotSaved(failed)) }
    }
}

/// Tells who may do what.
fn tell_access(config: &ServerConfig, policy: &Policy) {
    for role in Role::ALL {
        let users: Vec<&str> = policy
            .users
            .iter()
            .filter(|(_, user)| user.role == role)
            .map(|(name, _)| name.as_str())
            .collect();
        if !users.is_empty() {
            let may: Vec<&str> = Op::ALL.iter().filter(|op| op.is_for(role)).map(|op| op.told()).collect();
            info!(users = users.join(" "), "{role:?}s may {}", may.join(", "));
        }
    }
    let path = config.policy_path();
    if policy.local && !config.is_local() {
        warn!(
            policy = %path.display(),
            "there are no users: only this machine can use the server; `toponym-server user add` makes some"
        );
    }
    if policy.by_password() && !config.is_local() && config.access.tls.is_none() {
        warn!("passwords are checked, but all else goes over the network in the clear: see [access.tls]");
    }
}

async fn subscribe(session: &Session, keys: &Keys, door: &Door) -> Result<(), zenoh::Error> {
    let streams = door.clone();
    session
        .declare_subscriber(keys.all_inputs())
        .callback(move |sample| streams.sample(&sample))
        .history(HistoryConfig::default().detect_late_publishers())
        .recovery(RecoveryConfig::default().heartbeat())
        .query_timeout(HISTORY_WAIT)
        .background()
        .await?;
    let sentences = door.clone();
    session
        .declare_subscriber(keys.say(Some("*")))
        .callback(move |sample| sentences.sample(&sample))
        .background()
        .await
}

async fn answer_queries(session: &Session, board: &Arc<Board>, limits: &Limits) -> Result<(), ServeError> {
    let board = board.clone();
    let permits = queries::Permits::new(limits);
    let runtime = tokio::runtime::Handle::current();
    // Not by the callback: a reply waits for who reads slowly, and with it all who are read by the same thread.
    let (refuse, refused) = sync_channel::<Query>(REFUSED_QUERIES_MAX);
    std::thread::Builder::new().name("refuse".into()).spawn(move || {
        while let Ok(query) = refused.recv() {
            reply_problem(&query, Problem::new(ErrorCode::Busy, "too many queries: try again"));
        }
    })?;
    session
        .declare_queryable(board.keys.everything())
        .callback(move |query| {
            if let Some(permit) = permits.take(query.key_expr().as_str()) {
                let board = board.clone();
                runtime.spawn_blocking(move || {
                    aside::give_way();
                    reply_to(&board, &query);
                    drop(permit);
                });
            } else {
                board.reach("queries");
                // One that finds no room is not answered, and asked again.
                drop(refuse.try_send(query));
            }
        })
        .background()
        .await?;
    Ok(())
}

/// Replies to a query on each key it selects.
fn reply_to(board: &Board, query: &Query) {
    let selected = query.key_expr();
    let payload = query.payload().map(|p| p.to_bytes()).unwrap_or_default();
    let parameters = query.parameters().as_str();
    // Whether "$*a$*a$*a…" fits takes a time that grows with each "$*".
    if selected.as_str().contains("$*") {
        let problem = Problem::new(ErrorCode::BadArgument, "a key may have * and **, but not $*");
        return reply_problem(query, problem.field("key"));
    }
    let keys = if selected.is_wild() {
        let matching = |key: &String| {
            zenoh::key_expr::KeyExpr::try_from(key.as_str()).is_ok_and(|key| selected.intersects(&key))
        };
        queries::askable(board).into_iter().filter(matching).collect()
    } else {
        vec![selected.to_string()]
    };
    if keys.is_empty() {
        let problem = Problem::new(ErrorCode::NoSuchQuery, format!("nothing to ask matches {selected}"));
        return reply_problem(query, problem.field("key"));
    }
    for key in keys {
        match queries::answer(board, &key, parameters, &payload) {
            Ok(queries::Reply { payload, encoding }) => {
                if let Err(e) = query.reply(&key, payload).encoding(encoding).express(true).wait() {
                    warn!(key, "could not reply: {e}");
                }
            }
            Err(problem) => reply_problem(query, problem),
        }
    }
}

fn reply_problem(query: &Query, problem: Problem) {
    let json = serde_json::to_vec(&ErrorReply { error: problem }).unwrap_or_default();
    if let Err(e) = query.reply_err(json).encoding(ENCODING_JSON).wait() {
        warn!(key = query.key_expr().as_str(), "could not reply: {e}");
    }
}
