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
            let mut batch = Vec::new();
            match work.recv_timeout(TICK) {
                Ok(first) => batch.push(first),
                Err(RecvTimeoutError::Timeout) if self.waits_for_time() => {
                    batch.push(Work::Take(Event::Tick));
                }
                Err(RecvTimeoutError::Timeout) => continue,
                Err(RecvTimeoutError::Disconnected) => batch.push(Work::Stop),
            }
            let mut stops = false;
            let mut steps = Vec::new();
            let mut bytes = 0;
            loop {
                for work in batch.drain(..) {
                    stops |= matches!(work, Work::Stop);
                    steps.extend(self.append(work));
                }
                bytes = self.journal.uncommitted().max(bytes);
                if stops || steps.len() >= BATCH || bytes >= BATCH_BYTES {
                    break;
                }
                match work.try_recv() {
                    Ok(next) => batch.push(next),
                    Err(_) => break,
                }
            }
            if self.commit() {
                self.acknowledge(&steps);
            } else {
                // What could not be written was acknowledged to nobody: it comes again.
                steps.retain(|step| matches!(step, Step::Stop));
            }
            for step in steps {
                if self.steps.send(step).is_err() {
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
        let event = match &work {
            Work::Take(event) => event.clone(),
            Work::Mend(mend, _) => Event::Message(Message::Mend(mend.clone())),
            Work::Save(_) | Work::Stop => Event::Tick,
        };
        let entry = Entry { at_ns: (self.base + self.began.elapsed()).as_nanos() as u64, event };
        let mut written = || match entry.to_bytes() {
            Ok(bytes) => Some(self.journal.append(&bytes)),
            Err(e) => {
                error!(map = self.view.id, "DATA LOSS: can't be written down: {e}");
                None
            }
        };
        match work {
            Work::Take(_) => Some(Step::Take(written()?, entry)),
            Work::Mend(_, reply) => Some(Step::Mend(written()?, entry, reply)),
            Work::Save(reply) => Some(Step::Save(reply)),
            Work::Stop => Some(Step::Stop),
        }
    }

    /// Tells how far the robot's stream is on disk.
    fn acknowledge(&self, steps: &[Step]) {
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
