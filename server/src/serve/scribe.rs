//! A map's journal thread: what the map is to take in goes to disk first, and then to the filter. All that the
//! filter ever saw is on disk; all that is acknowledged is.

use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender};
use std::time::{Duration, Instant};
use toponym_journal::{Entry, Event, Folder, Journal};
use toponym_proto::{Mend, Message};
use tracing::{error, info};

use super::board::{MapView, lock};

/// How often time is told to a map that holds something back while nothing arrives.
const TICK: Duration = Duration::from_millis(50);
/// Pause before a medium that failed is tried again.
const AGAIN: Duration = Duration::from_millis(500);
/// Entries made durable together: what has arrived by then, but no more than these …
const BATCH: usize = 256;
/// … or than these bytes.
const BATCH_BYTES: usize = 1 << 20;

/// Tells what became of a command.
pub type Reply<T> = SyncSender<Result<T, String>>;

/// What a map is asked to do.
pub enum Work {
    /// Take this in.
    Take(Event),
    /// Mend what was said and tell what was done, or why not.
    Mend(Mend, Reply<String>),
    /// Save the map and tell whether it went well.
    Save(Reply<()>),
    /// Save the map and end.
    Stop,
}

/// The same for the filter: on disk, with numbers.
pub enum Step {
    /// Take this in.
    Take(u64, Entry),
    /// A command that stands in this entry.
    Mend(u64, Entry, Reply<String>),
    /// Save the map.
    Save(Reply<()>),
    /// Save the map and end.
    Stop,
}

/// A map's journal with what its thread needs.
pub struct Scribe {
    view: Arc<MapView>,
    journal: Journal<Folder>,
    steps: SyncSender<Step>,
    /// Time of the newest entry when this thread began.
    base: Duration,
    began: Instant,
}

impl Scribe {
    /// `base`: time of the newest entry so far.
    pub fn new(
        view: Arc<MapView>,
        journal: Journal<Folder>,
        steps: SyncSender<Step>,
        base: Duration,
    ) -> Self {
        Self { view, journal, steps, base, began: Instant::now() }
    }

    /// Works until it is told to stop, or the filter is gone.
    pub fn run(mut self, work: &Receiver<Work>) {
        loop {
            let mut next = match work.recv_timeout(TICK) {
                Ok(first) => Some(first),
                Err(RecvTimeoutError::Timeout) if self.waits_for_time() => Some(Work::Take(Event::Tick)),
                Err(RecvTimeoutError::Timeout) => continue,
                Err(RecvTimeoutError::Disconnected) => Some(Work::Stop),
            };
            let (mut stops, mut steps) = (false, Vec::new());
            while let Some(work_now) = next {
                stops = matches!(work_now, Work::Stop);
                steps.extend(self.append(work_now));
                let is_full = steps.len() >= BATCH || self.journal.uncommitted() >= BATCH_BYTES;
                next = if stops || is_full { None } else { work.try_recv().ok() };
            }
            let began = Instant::now();
            if self.commit() {
                if !steps.is_empty() {
                    self.view.sync_ns.store(began.elapsed().as_nanos() as u64, Ordering::Relaxed);
                }
                self.acknowledge(&steps);
            } else {
                // What could not be written was acknowledged to nobody: it comes again.
                steps.retain(|step| matches!(step, Step::Stop));
            }
            for step in steps {
                if self.steps.send(step).is_err() {
                    self.view.ended.store(true, Ordering::Release);
                    return;
                }
            }
            if stops {
                return;
            }
        }
    }

    /// Whether the filter has taken all there is, and holds something back until time passes.
    fn waits_for_time(&self) -> bool {
        self.view.taken.load(Ordering::Acquire) >= self.journal.durable()
            && self.view.held.load(Ordering::Relaxed) > 0
    }

    fn append(&mut self, work: Work) -> Option<Step> {
        match work {
            Work::Take(event) => self.write(event).map(|(index, entry)| Step::Take(index, entry)),
            Work::Mend(mend, reply) => {
                let written = self.write(Event::Message(Message::Mend(mend)));
                written.map(|(index, entry)| Step::Mend(index, entry, reply))
            }
            Work::Save(reply) => Some(Step::Save(reply)),
            Work::Stop => Some(Step::Stop),
        }
    }

    /// Puts an entry into the journal; it is durable after the next commit.
    fn write(&mut self, event: Event) -> Option<(u64, Entry)> {
        let entry = Entry { at_ns: (self.base + self.began.elapsed()).as_nanos() as u64, event };
        match entry.to_bytes() {
            Ok(bytes) => Some((self.journal.append(&bytes), entry)),
            Err(e) => {
                error!(map = self.view.id, "DATA LOSS: can't be written down: {e}");
                None
            }
        }
    }

    /// Tells how far the robot's stream is on disk.
    fn acknowledge(&self, steps: &[Step]) {
        let last = steps.iter().rev().find_map(|step| match step {
            Step::Take(_, entry) | Step::Mend(_, entry, _) => Some(entry.at_ns),
            Step::Save(_) | Step::Stop => None,
        });
        if let Some(at_ns) = last {
            self.view.written_at_ns.store(at_ns, Ordering::Relaxed);
        }
        let newest = steps.iter().filter_map(|step| match step {
            Step::Take(_, entry) => entry.watermark(),
            _ => None,
        });
        if let Some(newest) = newest.max() {
            let mut durable = lock(&self.view.durable);
            *durable = (*durable).max(Some(newest));
        }
    }

    /// Makes what was appended durable; tries again while the medium fails, unless the server stops.
    fn commit(&mut self) -> bool {
        loop {
            match self.journal.commit() {
                Ok(_) => {
                    if lock(&self.view.trouble).take().is_some() {
                        info!(map = self.view.id, "the journal can be written again");
                    }
                    return true;
                }
                Err(e) => {
                    let known = lock(&self.view.trouble).replace(e.to_string());
                    if known.as_ref() != Some(&e.to_string()) {
                        error!(map = self.view.id, "the journal can't be written, nothing is taken in: {e}");
                    }
                    if self.view.is_stopping() {
                        return false;
                    }
                    std::thread::sleep(AGAIN);
                }
            }
        }
    }
}
