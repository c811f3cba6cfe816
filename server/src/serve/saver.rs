//! Checkpoints, written by a thread of their own: the filter does not wait for the medium.

use std::thread::JoinHandle;
use std::time::{Duration, Instant};
use toponym_journal::{Folder, prune};

use super::aside::give_way;
use crate::fold::Fold;
use crate::store::checkpoint;

/// Writes a map's checkpoints, one at a time.
pub struct Saver {
    disk: Folder,
    running: Option<JoinHandle<Result<(), String>>>,
    /// Last entry in the newest checkpoint, begun or written.
    saved: u64,
    begun: Instant,
    /// Work of the filter since.
    work: Duration,
}

impl Saver {
    /// `saved`: last entry in the newest checkpoint there is.
    pub fn new(disk: Folder, saved: u64) -> Self {
        Self { disk, running: None, saved, begun: Instant::now(), work: Duration::ZERO }
    }

    /// The filter has worked so long.
    pub fn worked(&mut self, took: Duration) {
        self.work += took;
    }

    /// Whether it is time for a checkpoint.
    pub fn is_due(&self, index: u64, work: Duration, period: Duration) -> bool {
        let is_idle = self.running.as_ref().is_none_or(JoinHandle::is_finished);
        is_idle && index > self.saved && (self.work >= work || self.begun.elapsed() >= period)
    }

    /// Begins a checkpoint, once the one before is written.
    pub fn begin(&mut self, fold: &Fold, index: u64) -> Result<(), String> {
        let before = self.finish();
        // All structure is shared: a copy is a few reference counts and lists.
        let (fold, disk) = (fold.clone(), self.disk.clone());
        let write = move || {
            give_way();
            let checkpoint = checkpoint(&fold, index).map_err(|e| e.to_string())?;
            drop(fold);
            checkpoint.write(&disk).and_then(|()| prune(&disk)).map_err(|e| e.to_string())
        };
        let thread = std::thread::Builder::new().name("checkpoint".into());
        self.running = Some(thread.spawn(write).map_err(|e| e.to_string())?);
        (self.saved, self.begun, self.work) = (index, Instant::now(), Duration::ZERO);
        before
    }

    /// Waits for the checkpoint that is being written.
    pub fn finish(&mut self) -> Result<(), String> {
        match self.running.take().map(JoinHandle::join) {
            None => Ok(()),
            Some(Ok(done)) => done,
            Some(Err(_)) => Err("the thread that writes checkpoints failed".to_owned()),
        }
    }
}
