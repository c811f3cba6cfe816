//! A map's own thread: entries of its journal in, effects out. The only place where the filter runs.

use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::sync::mpsc::{Receiver, RecvTimeoutError};
use std::time::{Duration, Instant};
use toponym_core::Effect;
use toponym_core::edge::EdgeKind;
use toponym_core::effects::TrackState;
use toponym_journal::{Entry, Event};
use toponym_proto::answer::{ANSWER_VERSION, Heard, Jump, MapIdentity, PoseOut};
use toponym_proto::{Message, Stamp};
use tracing::{debug, error, info, warn};

use super::board::{Board, MapView, lock};
use super::outbox::Outbox;
use super::recording::Recording;
use super::saver::Saver;
use super::scribe::{Reply, Step};
use crate::convert;
use crate::fold::{Fold, Outcome};

/// How long recorded messages may wait to be made durable.
const RECORD_SYNC: Duration = Duration::from_millis(200);
/// Shortest time between two snapshots for queries: each copies what changes.
const SNAPSHOT_PERIOD: Duration = Duration::from_millis(100);
/// A checkpoint is due after so much of the filter's work: a restart does it again …
const SAVE_WORK: Duration = Duration::from_secs(2);
/// … of so much while it recovers …
const RECOVER_WORK: Duration = Duration::from_millis(300);
/// … and after so long in any case, if anything came.
const SAVE_PERIOD: Duration = Duration::from_secs(60);

/// Something to be done before long, but not too often.
#[derive(Debug, Default)]
pub struct Due {
    marked: bool,
    done: Option<Instant>,
}

impl Due {
    /// From now on it is to be done.
    fn mark(&mut self) {
        self.marked = true;
    }

    /// Whether it is to be done and either its period is over or there is time; then it counts as
    /// done.
    fn is_due(&mut self, period: Duration, idle: bool) -> bool {
        let due = self.marked && (idle || self.done.is_none_or(|done| done.elapsed() >= period));
        if due {
            *self = Self { marked: false, done: Some(Instant::now()) };
        }
        due
    }
}

/// A map with all that its thread needs.
pub struct Mapping {
    pub(super) view: Arc<MapView>,
    pub(super) fold: Fold,
    /// Number of the last entry in it.
    pub(super) index: u64,
    pub(super) board: Arc<Board>,
    pub(super) outbox: Outbox,
    pub(super) saver: Saver,
    pub(super) record: Option<Recording>,
    pub(super) graph_period: Duration,
    pub(super) log_speech: bool,
    /// Who waits for the map to be saved, and at which time of its journal it can be.
    pub(super) saves: Vec<(Duration, Reply<()>)>,
    pub(super) record_due: Due,
    pub(super) snapshot_due: Due,
    pub(super) graph_due: Due,
}

impl Mapping {
    /// Takes in what was on disk already, then works until it is told to stop or its time is over,
    /// and saves the map; tells whether it could.
    pub fn run(mut self, tail: Vec<(u64, Entry)>, steps: &Receiver<Step>) -> Result<(), String> {
        self.recover(tail);
        loop {
            let idle = match steps.recv_timeout(SNAPSHOT_PERIOD) {
                Ok(Step::Take(index, entry)) => {
                    self.take(index, entry);
                    false
                }
                Ok(Step::Mend(index, entry, reply)) => {
                    let done = self.take(index, entry);
                    let _ = reply.send(done.unwrap_or_else(|| Err("nothing came of it".to_owned())));
                    false
                }
                Ok(Step::Save(reply)) => {
                    // What had arrived by then is to be in it.
                    self.saves.push((self.fold.settles_at(), reply));
                    false
                }
                Err(RecvTimeoutError::Timeout) => true,
                Ok(Step::Stop) | Err(RecvTimeoutError::Disconnected) => break,
            };
            if self.view.is_late() {
                info!(map = self.view.id, "stops with work to do: it is in the journal, for the next start");
                break;
            }
            self.do_what_is_due(idle);
        }
        self.show();
        self.save()?;
        info!(map = self.view.id, "saved");
        Ok(())
    }

    /// Folds what the map took in after its last checkpoint. Who asked then asks again; only sentences are told, for
    /// their guides wait.
    fn recover(&mut self, tail: Vec<(u64, Entry)>) {
        let (began, entries) = (Instant::now(), tail.len());
        let mut last = began;
        for (index, entry) in tail {
            let Self { fold, record, outbox, view, board, .. } = &mut *self;
            fold.take(entry, &mut |outcome| match outcome {
                Outcome::Enters(message) => record.iter_mut().for_each(|r| r.write(message)),
                Outcome::Heard(heard) => outbox.send(board.keys.heard(&view.robot), &heard),
                Outcome::Effect(_) => {}
            });
            self.index = index;
            if self.view.is_late() {
                return;
            }
            // One that is killed before it has done so much would never get further.
            self.saver.worked(last.elapsed());
            last = Instant::now();
            if self.saver.is_due(index, RECOVER_WORK, SAVE_PERIOD)
                && let Err(e) = self.begin_save()
            {
                error!(map = self.view.id, "no checkpoint: {e}");
            }
        }
        if entries > 0 {
            info!(map = self.view.id, entries, took_s = began.elapsed().as_secs_f64(), "recovered");
            self.view.stamp_ns.store(self.fold.card.stamp_ns, Ordering::Relaxed);
            // A server that is killed again and again must not pile up segments.
            if let Err(e) = self.begin_save() {
                error!(map = self.view.id, "no checkpoint: {e}");
            }
        }
        self.tell_progress();
        self.show();
    }

    /// The journal's thread passes the time while something is held.
    fn tell_progress(&self) {
        self.view.held.store(self.fold.held(), Ordering::Relaxed);
        self.view.taken_at_ns.store(self.fold.now().as_nanos() as u64, Ordering::Relaxed);
        self.view.taken.store(self.index, Ordering::Release);
    }

    fn do_what_is_due(&mut self, idle: bool) {
        let (held, now) = (self.fold.held(), self.fold.now());
        let due = |(settles_at, _): &mut (Duration, Reply<()>)| held == 0 || now >= *settles_at;
        let saves: Vec<_> = self.saves.extract_if(.., due).collect();
        if !saves.is_empty() {
            self.show();
            let done = self.save();
            for (_, reply) in saves {
                let _ = reply.send(done.clone());
            }
        }
        if self.record_due.is_due(RECORD_SYNC, idle) {
            self.record.iter_mut().for_each(Recording::sync);
        }
        if self.snapshot_due.is_due(SNAPSHOT_PERIOD, idle) {
            self.show();
        }
        if self.graph_due.is_due(self.graph_period, false) && !self.outbox.graph(&self.view) {
            self.graph_due.mark();
        }
        if self.saver.is_due(self.index, SAVE_WORK, SAVE_PERIOD)
            && let Err(e) = self.begin_save()
        {
            error!(map = self.view.id, "no checkpoint: {e}");
        }
    }

    /// Shows the posterior to those who ask.
    fn show(&mut self) {
        self.view.snapshot.store(self.fold.mapper.snapshot());
        self.graph_due.mark();
    }

    /// One entry, and its effects out. Tells what an operator's command did, if it is one.
    fn take(&mut self, index: u64, entry: Entry) -> Option<Result<String, String>> {
        let began = Instant::now();
        let bytes = bytes_of(&entry.event);
        let (mut effects, mut heards) = (Vec::new(), Vec::new());
        let record = &mut self.record;
        self.fold.take(entry, &mut |outcome| match outcome {
            Outcome::Enters(message) => record.iter_mut().for_each(|r| r.write(message)),
            Outcome::Effect(effect) => effects.push(effect),
            Outcome::Heard(heard) => heards.push(heard),
        });
        self.index = index;
        self.record_due.mark();
        self.view.stamp_ns.store(self.fold.card.stamp_ns, Ordering::Relaxed);
        self.tell_progress();
        self.view.backlog_bytes.fetch_sub(bytes, Ordering::Relaxed);
        self.saver.worked(began.elapsed());
        let told =
            |e: &Effect| matches!(e, Effect::Jumped { .. } | Effect::StateChanged { .. } | Effect::Mended(_));
        if !heards.is_empty() || effects.iter().any(told) {
            // Who is told of it may ask at once.
            self.show();
        } else if !effects.is_empty() {
            self.snapshot_due.mark();
        }
        let mended = effects.iter().find_map(|e| match e {
            Effect::Mended(done) => Some(done.clone()),
            _ => None,
        });
        for effect in effects {
            self.publish(effect);
        }
        for heard in &heards {
            self.tell(heard);
        }
        mended
    }

    fn tell(&self, heard: &Heard) {
        let map = &self.view.id;
        if self.log_speech {
            info!(map, id = heard.id, status = ?heard.status, parse = heard.parse, "heard: {}", heard.words);
        } else {
            info!(map, id = heard.id, status = ?heard.status, "heard");
        }
        self.outbox.send(self.board.keys.heard(&self.view.robot), heard);
    }

    fn publish(&mut self, effect: Effect) {
        let (map, robot, keys) = (&self.view.id, &self.view.robot, &self.board.keys);
        match effect {
            Effect::Tracked { stamp_ns, map_from_body, map_from_odom, covariance, state } => {
                let pose = PoseOut {
                    v: ANSWER_VERSION,
                    robot: robot.clone(),
                    map: self.view.identity(&self.view.snapshot.load()),
                    stamp: Stamp { ns: stamp_ns },
                    map_from_odom: convert::pose(&map_from_odom),
                    map_from_body: convert::pose(&map_from_body),
                    covariance: convert::covariance(&covariance),
                    state: convert::pose_state(state),
                };
                self.outbox.pose(&pose);
            }
            Effect::Jumped { epoch, new_from_old } => {
                info!(map, epoch, "coordinates jumped");
                let identity = self.view.identity(&self.view.snapshot.load());
                let map_identity = MapIdentity { epoch, ..identity };
                let new_from_old = convert::pose(&new_from_old);
                let jump = Jump { v: ANSWER_VERSION, map: map_identity, new_from_old };
                self.outbox.send(keys.jump(map), &jump);
            }
            Effect::StateChanged {
                stamp_ns,
                state: state @ (TrackState::Doubtful | TrackState::Lost),
                why,
            } => {
                warn!(map, stamp_ns, ?state, "{why}");
            }
            Effect::StateChanged { stamp_ns, state, why } => info!(map, stamp_ns, ?state, "{why}"),
            Effect::ScanDropped { stamp_ns, reason } => {
                let unused = &mut *lock(&self.view.unused);
                // Once each time it is another reason, and each doubling.
                if unused.1.as_deref() != Some(reason.as_str()) || (unused.0 + 1).is_power_of_two() {
                    warn!(map, stamp_ns, unused = unused.0 + 1, "scan not used: {reason}");
                }
                *unused = (unused.0 + 1, Some(reason));
            }
            // Walking round a block brings hundreds of these; what words bring is rare.
            Effect::EdgeAccepted { kind: EdgeKind::Distance, reason, .. } => debug!(map, "{reason}"),
            Effect::EdgeAccepted { weight, reason, .. } => info!(map, weight, "{reason}"),
            Effect::Suspected { stamp_ns, why, .. } => {
                warn!(map, stamp_ns, "{why}");
                *lock(&self.view.suspected) = suspicions(&self.fold);
            }
            Effect::SegmentBegan { stamp_ns, reason } => warn!(map, stamp_ns, "new segment: {reason}"),
            Effect::EdgeRefused { reason, .. } => debug!(map, "{reason}"),
            Effect::Mended(done) => info!(map, "mended: {done:?}"),
            // What was heard is told by the fold.
            Effect::Heard(_)
            | Effect::PlaceBegan { .. }
            | Effect::ScanPlaced { .. }
            | Effect::Weighed { .. } => {}
        }
    }

    /// A checkpoint, written by another thread; the record is there before it.
    fn begin_save(&mut self) -> Result<(), String> {
        self.record.iter_mut().for_each(Recording::sync);
        self.saver.begin(&self.fold, self.index)
    }

    /// A checkpoint; when this returns it is durable.
    fn save(&mut self) -> Result<(), String> {
        self.begin_save()?;
        self.saver.finish()
    }
}

/// What seems wrong with the senses of a map's robot.
pub fn suspicions(fold: &Fold) -> Vec<String> {
    fold.mapper.suspicions().map(str::to_owned).collect()
}

/// Bytes that something of a robot's or a guide's takes on its way to the filter.
pub fn bytes_of(event: &Event) -> usize {
    match event {
        // An operator's comes another way; the others are small, or the journal's own.
        Event::Message(Message::Mend(_))
        | Event::Gap { .. }
        | Event::Tick
        | Event::Hold(_)
        | Event::Glossary(_) => 0,
        Event::Message(message) => message.weight_bytes(),
        Event::Say { say, .. } => say.weight_bytes(),
    }
}
