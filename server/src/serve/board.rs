//! What the outside may see of a running server: read by queries, written by the threads that own
//! it. Nobody waits here for the filter.

use arc_swap::ArcSwap;
use std::collections::BTreeMap;
use std::sync::atomic::{AtomicI64, AtomicU64, Ordering};
use std::sync::mpsc::SyncSender;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use toponym_core::Snapshot;
use toponym_proto::answer::{MapIdentity, RobotState};
use toponym_proto::{Keys, Stamp};

use super::mapping::Work;

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
    /// Newest stamp in it, ns.
    pub stamp_ns: AtomicI64,
    /// (boot, seq) up to which the stream is in a record on disk.
    pub recorded: Mutex<Option<(u64, u64)>>,
    /// Way to the map's own thread.
    pub work: SyncSender<Work>,
}

impl MapView {
    /// Identity, and the version of a snapshot.
    pub fn identity(&self, snapshot: &Snapshot) -> MapIdentity {
        let (epoch, rev) = (snapshot.epoch(), snapshot.rev());
        MapIdentity { id: self.id.clone(), uuid: self.uuid.clone(), epoch, rev, level: None }
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
    /// The maps.
    pub maps: ArcSwap<BTreeMap<String, Arc<MapView>>>,
    /// The robots that were heard.
    pub robots: Mutex<BTreeMap<String, RobotState>>,
    /// What was last published on a key, for those who come later.
    pub latest: Mutex<BTreeMap<String, Vec<u8>>>,
    /// Messages dropped at the door because the server could not keep up.
    pub overrun: AtomicU64,
}

impl Board {
    /// An empty one.
    pub fn new(keys: Keys, site: &str) -> Self {
        Self {
            keys,
            site: site.into(),
            maps: ArcSwap::default(),
            robots: Mutex::default(),
            latest: Mutex::default(),
            overrun: AtomicU64::new(0),
        }
    }

    /// Shows one more map.
    pub fn add_map(&self, view: Arc<MapView>) {
        let mut maps = BTreeMap::clone(&self.maps.load());
        maps.insert(view.id.clone(), view);
        self.maps.store(Arc::new(maps));
    }
}
