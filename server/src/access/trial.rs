//! Tries the rules: each role, on a router of its own that has the same, does what it may and what it may not.
//! What Zenoh checks, and how, is not for us to say: it is looked at.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::{Arc, Mutex};
use std::time::Duration;
use tokio::time::{Instant, sleep};
use toponym::Connection;
use toponym_proto::Keys;
use toponym_proto::keys::Ask;
use zenoh::qos::CongestionControl;
use zenoh::query::{ConsolidationMode, Query, QueryTarget};
use zenoh::sample::Sample;
use zenoh::{Session, Wait};

use super::policy::{Policy, Role, User};
use crate::config::{AccessConfig, ServerConfig};
use crate::serve::board::lock;
use crate::serve::network::{self, NetworkError};

/// The user's own robot, and another.
const OWN: &str = "own";
const OTHER: &str = "other";
const MAP: &str = "map";
/// How long what is allowed may take.
const PATIENCE: Duration = Duration::from_secs(10);
/// Pause before asking again what nobody answered.
const AGAIN: Duration = Duration::from_millis(20);
/// What nobody but the server answers.
const FORGED: &[u8] = b"forged";

/// What a client may try.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Op {
    /// Send scans as one's own robot.
    Stream,
    /// Send scans as another robot.
    StreamAsAnother,
    /// Say a sentence to a robot.
    Say,
    /// Ask where something is.
    Ask,
    /// Take a sentence back.
    Mend,
    /// Save or delete maps.
    Command,
    /// Follow a robot.
    WatchRobot,
    /// Hear what people said, and became of it.
    HearTalk,
    /// Follow a map.
    WatchMap,
    /// Hear what robots send.
    ListenIn,
    /// Publish what only the server says.
    ForgeFeedback,
    /// Answer questions in the server's stead.
    ForgeAnswer,
}

impl Op {
    /// All there are.
    pub const ALL: [Self; 12] = [
        Self::Stream,
        Self::StreamAsAnother,
        Self::Say,
        Self::Ask,
        Self::Mend,
        Self::Command,
        Self::WatchRobot,
        Self::HearTalk,
        Self::WatchMap,
        Self::ListenIn,
        Self::ForgeFeedback,
        Self::ForgeAnswer,
    ];

    /// Who may.
    pub fn is_for(self, role: Role) -> bool {
        use Role::{Guide, Operator, Planner, Robot, Viewer};
        let roles: &[Role] = match self {
            Self::Stream => &[Robot],
            Self::Say => &[Guide],
            Self::Ask | Self::WatchMap => &[Guide, Planner, Viewer, Operator],
            Self::Mend => &[Guide, Operator],
            Self::Command => &[Operator],
            Self::WatchRobot => &Role::ALL,
            Self::HearTalk => &[Robot, Guide, Operator],
            Self::StreamAsAnother => &[],
            Self::ListenIn | Self::ForgeFeedback | Self::ForgeAnswer => return false,
        };
        role == Role::Trusted || roles.contains(&role)
    }

    /// In words.
    pub fn told(self) -> &'static str {
        match self {
            Self::Stream => "stream as its robot",
            Self::StreamAsAnother => "stream as any robot",
            Self::Say => "talk",
            Self::Ask => "ask",
            Self::Mend => "mend what was said",
            Self::Command => "save and delete",
            Self::WatchRobot => "follow robots",
            Self::HearTalk => "hear what was said",
            Self::WatchMap => "follow maps",
            Self::ListenIn => "listen in on robots",
            Self::ForgeFeedback => "forge feedback",
            Self::ForgeAnswer => "forge answers",
        }
    }
}

/// The rules do not what they should, or can't be tried.
#[derive(Debug, thiserror::Error)]
pub enum TrialError {
    /// Somebody may what they should not, or may not what they should.
    #[error("the rules do not hold: a {role:?} {} {}", if *.may { "could" } else { "could not" }, .op.told())]
    Broken {
        /// Who.
        role: Role,
        /// What.
        op: Op,
        /// Whether they could.
        may: bool,
    },
    /// The router for the trial does not open.
    #[error(transparent)]
    Network(#[from] NetworkError),
    /// A user can't connect to it.
    #[error(transparent)]
    Client(#[from] toponym::ClientError),
    /// Zenoh's own.
    #[error("zenoh: {0}")]
    Zenoh(#[from] zenoh::Error),
}

/// What of all that was tried had any effect, and whether all of it: a question that was let in but not answered has half.
pub type Effects = BTreeMap<Op, bool>;

/// Whether effects are those that a role should have; the first that is not.
pub fn judge(role: Role, effects: &Effects) -> Result<(), TrialError> {
    let wrong = |op: &&Op| effects.get(op).copied() != op.is_for(role).then_some(true);
    match Op::ALL.iter().find(wrong) {
        Some(op) => Err(TrialError::Broken { role, op: *op, may: effects.contains_key(op) }),
        None => Ok(()),
    }
}

/// Tries the rules of a policy on a router of their own: a user of each role that there is.
pub async fn try_rules(config: &ServerConfig, policy: &Policy) -> Result<(), TrialError> {
    let keys = Keys::new(&config.site).map_err(|e| TrialError::Zenoh(e.into()))?;
    let roles: BTreeSet<Role> = policy.users.values().map(|user| user.role).collect();
    let name = |role: Role| format!("{role:?}").to_lowercase();
    let user = |role: Role| {
        let robots = if role == Role::Robot { vec![OWN.into()] } else { Vec::new() };
        // Anybody who guesses it reaches a router without a map, for as long as the trial takes.
        User { role, robots, password: Some(ulid::Ulid::generate().to_string()) }
    };
    let users = roles.into_iter().map(|role| (name(role), user(role))).collect();
    let policy = Policy { local: false, users };
    let access = AccessConfig { tls: None, ..config.access.clone() };
    let trial = ServerConfig { listen: vec!["tcp/127.0.0.1:0".into()], access, ..config.clone() };
    let ground = Ground::open(network::open(&trial, &policy).await?, &keys).await?;
    for (name, user) in &policy.users {
        let mut connection = Connection::to(&ground.endpoints().await.join(","));
        (connection.user, connection.password) = (Some(name.clone()), user.password.clone());
        let client = connection.open().await?;
        let effects = ground.effects(&client, PATIENCE).await;
        client.close().await?;
        judge(user.role, &effects?)?;
    }
    Ok(ground.session.close().await?)
}

/// A router that listens as the server does, and notes what reaches it.
pub struct Ground {
    session: Session,
    keys: Keys,
    reached: Arc<Mutex<BTreeSet<String>>>,
}

impl Ground {
    /// On a router that has the rules to be tried.
    pub async fn open(session: Session, keys: &Keys) -> Result<Self, zenoh::Error> {
        let reached = Arc::new(Mutex::new(BTreeSet::new()));
        for listens in [keys.all_inputs(), keys.say(Some("*")), keys.outputs("*")] {
            let reached = reached.clone();
            let note = move |sample: Sample| {
                lock(&reached).insert(sample.key_expr().to_string());
            };
            session.declare_subscriber(listens).callback(note).background().await?;
        }
        let noted = reached.clone();
        let answer = move |query: Query| {
            let key = query.key_expr().clone();
            lock(&noted).insert(key.to_string());
            let _ = query.reply(key, "answer").wait();
        };
        session.declare_queryable(keys.everything()).callback(answer).background().await?;
        Ok(Self { session, keys: keys.clone(), reached })
    }

    /// Where clients connect.
    pub async fn endpoints(&self) -> Vec<String> {
        self.session.info().locators().await.iter().map(ToString::to_string).collect()
    }

    /// What a client can do; nothing, if it is not even told the time within so long.
    ///
    /// It is asked first, and after each part: when that answer is there, all that it sent before was let in or dropped,
    /// and all that was sent to it has come.
    pub async fn effects(&self, client: &Session, patience: Duration) -> Result<Effects, zenoh::Error> {
        let keys = &self.keys;
        let puts = [
            (Op::Stream, keys.odom(OWN)),
            (Op::StreamAsAnother, keys.odom(OTHER)),
            (Op::Say, keys.say(Some(OWN))),
            (Op::ForgeFeedback, keys.heard(OWN)),
        ];
        let questions = [
            (Op::Ask, keys.ask(MAP, Ask::Where)),
            (Op::Mend, keys.command("undo")),
            (Op::Command, keys.command("save")),
        ];
        let watched = [
            (Op::WatchRobot, keys.pose(OWN), keys.pose(OWN)),
            (Op::HearTalk, keys.heard(OWN), keys.heard(OWN)),
            (Op::WatchMap, keys.graph(MAP), keys.graph(MAP)),
            (Op::ListenIn, keys.all_inputs(), keys.odom(OTHER)),
            (Op::ListenIn, "another/**".into(), "another/application".into()),
        ];
        lock(&self.reached).clear();
        let came = Arc::new(Mutex::new(BTreeSet::<Op>::new()));
        let note = |op| {
            let came = came.clone();
            move || {
                lock(&came).insert(op);
            }
        };
        if !self.told_the_time(client, patience).await? {
            return Ok(Effects::new());
        }
        for (_, key) in &puts {
            client.put(key, "anything").congestion_control(CongestionControl::Block).await?;
        }
        let mut asked = Vec::new();
        for (op, key) in questions {
            asked.push((op, key.clone(), client.get(key).timeout(patience).await?));
        }
        if !self.told_the_time(client, patience).await? {
            return Ok(Effects::new());
        }
        let reached = std::mem::take(&mut *lock(&self.reached));
        let mut effects: Effects =
            puts.iter().filter(|(_, key)| reached.contains(key)).map(|(op, _)| (*op, true)).collect();
        for (op, key, replies) in asked {
            if reached.contains(&key) {
                // These may go another way than the time does, and later.
                let answer = replies.recv_async().await;
                effects.insert(op, answer.is_ok_and(|reply| reply.result().is_ok()));
            }
        }
        // Only now: a session hears itself.
        for (op, key, _) in &watched {
            let note = note(*op);
            client.declare_subscriber(key).callback(move |_| note()).background().await?;
        }
        let forged = keys.ask(MAP, Ask::Where);
        let forge = |query: Query| drop(query.reply(query.key_expr().clone(), FORGED).wait());
        client.declare_queryable(&forged).callback(forge).background().await?;
        if !self.told_the_time(client, patience).await? {
            return Ok(Effects::new());
        }
        for (_, _, key) in &watched {
            self.session.put(key, "anything").congestion_control(CongestionControl::Block).await?;
        }
        let answers =
            self.session.get(&forged).target(QueryTarget::All).consolidation(ConsolidationMode::None);
        let answers = answers.timeout(patience).await?;
        while let Ok(answer) = answers.recv_async().await {
            if answer.result().is_ok_and(|sample| *sample.payload().to_bytes() == *FORGED) {
                lock(&came).insert(Op::ForgeAnswer);
            }
        }
        if !self.told_the_time(client, patience).await? {
            return Ok(Effects::new());
        }
        effects.extend(lock(&came).iter().map(|op| (*op, true)));
        Ok(effects)
    }

    /// Asks until there is an answer: a session is open before it knows what the router answers.
    async fn told_the_time(&self, client: &Session, patience: Duration) -> Result<bool, zenoh::Error> {
        let deadline = Instant::now() + patience;
        while Instant::now() < deadline {
            let replies = client.get(self.keys.time()).timeout(deadline - Instant::now()).await?;
            match replies.recv_async().await {
                Ok(reply) => return Ok(reply.result().is_ok()),
                Err(_) => sleep(AGAIN).await,
            }
        }
        Ok(false)
    }
}
