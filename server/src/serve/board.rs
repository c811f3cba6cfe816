//! What the outside may see of a running server: read by queries, written by the threads that own
//! it. Nobody waits here for the filter.

use arc_swap::ArcSwap;
use axum::body::Bytes;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, AtomicI64, AtomicU64, AtomicUsize, Ordering};
use std::sync::mpsc::SyncSender;
use std::sync::{Arc, Mutex, MutexGuard, OnceLock, PoisonError};
use std::time::{Duration, Instant};
use tokio::sync::broadcast;
use toponym_core::Snapshot;
use toponym_journal::Event;
use toponym_proto::answer::{MapIdentity, Problem, RobotState};
use toponym_proto::{Keys, Stamp};

use super::answered::Answered;
use super::door::Arrival;
use super::scribe::Work;
use super::written::Written;
use crate::fold::Card;
use crate::web::{LAST_EVENT, Published};

/// Events kept for a page that is slow.
const EVENTS: usize = 1024;

/// Locks; a thread that died while it held the lock left a whole value all the same.
pub fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// One map as seen from outside.
pub struct MapView {
    /// Given id.
    pub id: String,
    /// Born once with the map.
    pub uuid: String,
    /// The robot that maps it.
    pub robot: String,
    /// Newest posterior.
    pub snapshot: ArcSwap<Snapshot>,
    /// What was answered from it.
    pub answered: Answered,
    /// Long answers.
    pub written: Written,
    /// Whether its graph is about to be published.
    pub graph_waits: AtomicBool,
    /// Newest stamp in it, ns.
    pub stamp_ns: AtomicI64,
    /// (boot, seq) of the last of its robot's messages that is on disk, or given up.
    pub durable: Mutex<Option<(u64, u64)>>,
    /// Bytes of messages on their way to the filter.
    pub backlog_bytes: AtomicUsize,
    /// Number of the last entry that the filter has taken in.
    pub taken: AtomicU64,
    /// Time of that entry, and of the newest on disk, on the journal's clock, ns.
    pub taken_at_ns: AtomicU64,
    /// See `taken_at_ns`.
    pub written_at_ns: AtomicU64,
    /// How long the journal's last write to disk took, ns.
    pub sync_ns: AtomicU64,
    /// Messages that are held back until time passes.
    pub held: AtomicUsize,
    /// Scans that were of no use, and why the newest was not.
    pub unused: Mutex<(u64, Option<String>)>,
    /// What seems wrong with its robot's senses.
    pub suspected: Mutex<Vec<String>>,
    /// Why the journal can't be written, as long as it can't.
    pub trouble: Mutex<Option<String>>,
    /// Whether its filter has ended: nothing more becomes durable.
    pub ended: AtomicBool,
    /// When its robot last brought it something.
    pub heard_at: Mutex<Instant>,
    /// By when the filter is to stop, once the server does.
    pub stops_at: Mutex<Option<Instant>>,
    /// Way to the map's journal, and from there to its filter.
    pub work: SyncSender<Work>,
}

impl MapView {
    /// Identity, and the version of a snapshot.
    pub fn identity(&self, snapshot: &Snapshot) -> MapIdentity {
        let (epoch, rev) = (snapshot.epoch(), snapshot.rev());
        MapIdentity { id: self.id.clone(), uuid: self.uuid.clone(), epoch, rev, level: None }
    }

    /// A view of a map that was loaded or born.
    pub fn new(
        id: &str,
        card: &Card,
        durable: Option<(u64, u64)>,
        snapshot: Arc<Snapshot>,
        work: SyncSender<Work>,
    ) -> Self {
        Self {
            id: id.into(),
            uuid: card.uuid.clone(),
            robot: card.robot.clone(),
            snapshot: ArcSwap::new(snapshot),
            answered: Answered::default(),
            written: Written::default(),
            graph_waits: AtomicBool::new(false),
            stamp_ns: AtomicI64::new(card.stamp_ns),
            durable: Mutex::new(durable),
            backlog_bytes: AtomicUsize::new(0),
            taken: AtomicU64::new(0),
            taken_at_ns: AtomicU64::new(0),
            written_at_ns: AtomicU64::new(0),
            sync_ns: AtomicU64::new(0),
            held: AtomicUsize::new(0),
            unused: Mutex::default(),
            suspected: Mutex::default(),
            trouble: Mutex::default(),
            ended: AtomicBool::new(false),
            heard_at: Mutex::new(Instant::now()),
            stops_at: Mutex::default(),
            work,
        }
    }

    /// How long nothing has come for it.
    pub fn idle(&self) -> Duration {
        lock(&self.heard_at).elapsed()
    }

    /// Whether the server stops.
    pub fn is_stopping(&self) -> bool {
        lock(&self.stops_at).is_some()
    }

    /// Whether the filter has had the time that it is given when the server stops.
    pub fn is_late(&self) -> bool {
        lock(&self.stops_at).is_some_and(|at| Instant::now() >= at)
    }

    /// Newest stamp.
    pub fn stamp(&self) -> Stamp {
        Stamp { ns: self.stamp_ns.load(Ordering::Relaxed) }
    }
}

/// All of it.
pub struct Board {
    /// Keys of the site.
    pub keys: Keys,
    /// Site id.
    pub site: String,
    /// Words of the site's own, see [`toponym_core::language::Glossary`].
    pub words: ArcSwap<String>,
    /// The maps.
    pub maps: ArcSwap<BTreeMap<String, Arc<MapView>>>,
    /// Maps that could not be loaded, or made room for others, and why.
    pub broken: Mutex<BTreeMap<String, Problem>>,
    /// The robots that were heard.
    pub robots: Mutex<BTreeMap<String, RobotState>>,
    /// What was last published on a key, for those who come later.
    pub latest: Mutex<BTreeMap<String, Bytes>>,
    /// How often each limit was reached.
    pub reached: Mutex<BTreeMap<&'static str, u64>>,
    /// Messages dropped at the door because the server could not keep up.
    pub overrun: AtomicU64,
    /// Bytes of messages that wait to be looked at.
    pub queued_bytes: AtomicUsize,
    /// Folder of the maps.
    pub data: PathBuf,
    /// When the intake last went round, ms since the server began.
    pub beat_ms: AtomicU64,
    /// When the server began.
    pub began: Instant,
    /// Whether the server stops: pages connect to the next.
    pub stopped: AtomicBool,
    /// What is published, for pages; who does not follow misses some.
    pub events: broadcast::Sender<Arc<Published>>,
    /// Way to the intake, for commands that it carries out; none before it runs.
    pub control: OnceLock<SyncSender<Arrival>>,
}

impl Board {
    /// An empty one.
    pub fn new(keys: Keys, site: &str, data: &Path, words: String) -> Self {
        Self {
            keys,
            site: site.into(),
            words: ArcSwap::from_pointee(words),
            maps: ArcSwap::default(),
            broken: Mutex::default(),
            robots: Mutex::default(),
            latest: Mutex::default(),
            reached: Mutex::default(),
            overrun: AtomicU64::new(0),
            queued_bytes: AtomicUsize::new(0),
            data: data.into(),
            beat_ms: AtomicU64::new(0),
            began: Instant::now(),
            stopped: AtomicBool::new(false),
            events: broadcast::Sender::new(EVENTS),
            control: OnceLock::new(),
        }
    }

    /// Tells pages that this server answers no more.
    pub fn leave(&self) {
        self.stopped.store(true, Ordering::Release);
        let _ =
            self.events.send(Arc::new(Published { name: LAST_EVENT, json: Bytes::new(), of: String::new() }));
    }

    /// Counts that a limit was reached.
    pub fn reach(&self, limit: &'static str) {
        *lock(&self.reached).entry(limit).or_default() += 1;
    }

    /// From now on the site's own words are these; every map takes them in as something that it hears.
    /// Waits for room on the ways to them.
    pub fn learn(&self, words: String) {
        let words = Arc::new(words);
        // First, for a map that begins meanwhile.
        if self.words.swap(words.clone()) == words {
            return;
        }
        for map in self.maps.load().values() {
            // One whose journal has ended learns them at its next start.
            let _ = map.work.send(Work::Take(Event::Glossary(words.to_string())));
        }
    }

    /// Shows a map no more.
    pub fn remove_map(&self, id: &str) {
        let mut maps = BTreeMap::clone(&self.maps.load());
        maps.remove(id);
        self.maps.store(Arc::new(maps));
        let mut latest = lock(&self.latest);
        latest.remove(&self.keys.graph(id));
        latest.remove(&self.keys.jump(id));
    }

    /// Shows one more map.
    pub fn add_map(&self, view: Arc<MapView>) {
        let mut maps = BTreeMap::clone(&self.maps.load());
        maps.insert(view.id.clone(), view);
        self.maps.store(Arc::new(maps));
    }
}
