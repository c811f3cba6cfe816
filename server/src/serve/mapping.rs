//! A map's own thread: messages in, one [`Mapper::step`] each, effects out. The only place where
//! the filter runs.

use std::fs::File;
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender};
use std::time::{Duration, Instant};
use toponym_core::edge::EdgeKind;
use toponym_core::effects::TrackState;
use toponym_core::{Effect, Mapper};
use toponym_proto::answer::{ANSWER_VERSION, Jump, MapIdentity, PoseOut};
use toponym_proto::record::{RecordError, RecordWriter};
use toponym_proto::{Mend, Message, Stamp};
use tracing::{debug, error, info, warn};

use super::board::{Board, MapView, lock};
use super::outbox::Outbox;
use crate::convert;
use crate::store::{Card, Store, StoreError};

/// How long recorded messages may wait to be made durable.
const RECORD_SYNC: Duration = Duration::from_millis(200);
/// Shortest time between two snapshots for queries: each copies what changes.
const SNAPSHOT_PERIOD: Duration = Duration::from_millis(100);

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

/// What a map's thread is asked to do.
pub enum Work {
    /// Take in the next message of the map's stream.
    Take(Message),
    /// Mend what was said and tell what was done, or why not; and whether that is on disk.
    Mend(Mend, SyncSender<Result<(String, bool), String>>),
    /// Save the map and tell whether it went well.
    Save(SyncSender<Result<(), String>>),
    /// Save the map and end.
    Stop,
}

/// A map with all that its thread needs.
pub struct Mapping {
    pub(super) view: Arc<MapView>,
    pub(super) mapper: Mapper,
    pub(super) card: Card,
    pub(super) board: Arc<Board>,
    pub(super) outbox: Outbox,
    pub(super) store: Arc<Store>,
    pub(super) record: Option<RecordWriter<File>>,
    pub(super) graph_period: Duration,
    pub(super) record_due: Due,
    pub(super) snapshot_due: Due,
    pub(super) graph_due: Due,
}

impl Mapping {
    /// Works until it is told to stop, then saves the map; tells whether it could.
    pub fn run(mut self, work: &Receiver<Work>) -> Result<(), StoreError> {
        loop {
            let idle = match work.recv_timeout(SNAPSHOT_PERIOD) {
                Ok(Work::Take(message)) => {
                    self.take(message);
                    false
                }
                Ok(Work::Mend(mend, reply)) => {
                    let done = self.mend(mend);
                    let _ = reply.send(done);
                    false
                }
                Ok(Work::Save(reply)) => {
                    let _ = reply.send(self.save().map_err(|e| e.to_string()));
                    false
                }
                Err(RecvTimeoutError::Timeout) => true,
                Ok(Work::Stop) | Err(RecvTimeoutError::Disconnected) => break,
            };
            if self.record_due.is_due(RECORD_SYNC, idle) {
                self.sync_record();
            }
            if self.snapshot_due.is_due(SNAPSHOT_PERIOD, idle) {
                self.show();
            }
            if self.graph_due.is_due(self.graph_period, false) && !self.outbox.graph(&self.view) {
                self.graph_due.mark();
            }
        }
        self.sync_record();
        self.show();
        self.save()?;
        info!(map = self.view.id, "saved");
        Ok(())
    }

    /// Shows the posterior to those who ask.
    fn show(&mut self) {
        self.view.snapshot.store(self.mapper.snapshot());
        self.graph_due.mark();
    }

    /// An operator's command goes the way of all messages, so that a replay meets it too.
    fn mend(&mut self, mend: Mend) -> Result<(String, bool), String> {
        let effects = self.step(Message::Mend(mend));
        self.show();
        let durable = self.sync_record();
        let done = effects.into_iter().find_map(|e| match e {
            Effect::Mended(done) => Some(done),
            _ => None,
        });
        done.unwrap_or_else(|| Err("nothing came of it".to_owned())).map(|words| (words, durable))
    }

    /// One message: into the record, through the filter.
    fn step(&mut self, message: Message) -> Vec<Effect> {
        if let Some(record) = &mut self.record {
            match record.write(&message) {
                Ok(()) => self.record_due.mark(),
                Err(e) => self.end_record(&e),
            }
        }
        if let Some(header) = message.header() {
            self.card.watermark = Some((header.boot, header.seq));
            self.card.stamp_ns = header.stamp.ns;
            self.view.stamp_ns.store(header.stamp.ns, Ordering::Relaxed);
        }
        self.mapper.step(convert::event(message))
    }

    /// One message of the map's stream, and its effects out.
    fn take(&mut self, message: Message) {
        let effects = self.step(message);
        let told =
            |e: &Effect| matches!(e, Effect::Heard(_) | Effect::Jumped { .. } | Effect::StateChanged { .. });
        if effects.iter().any(told) {
            // Who is told of it may ask at once.
            self.show();
        } else if !effects.is_empty() {
            self.snapshot_due.mark();
        }
        for effect in effects {
            self.publish(effect);
        }
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
                self.outbox.stream(keys.pose(robot), &pose);
            }
            Effect::Heard(heard) => {
                info!(map, id = heard.id, status = ?heard.status, "heard {:?}: {}", heard.text, heard.words);
                let key = keys.heard(robot);
                // Feedback promises what is on disk: make it so first.
                let durable = self.sync_record();
                self.outbox.send(key, &convert::heard(heard, durable));
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
            Effect::ScanDropped { stamp_ns, reason } => warn!(map, stamp_ns, "scan dropped: {reason}"),
            // Walking round a block brings hundreds of these; what words bring is rare.
            Effect::EdgeAccepted { kind: EdgeKind::Distance, reason, .. } => debug!(map, "{reason}"),
            Effect::EdgeAccepted { weight, reason, .. } => info!(map, weight, "{reason}"),
            Effect::SegmentBegan { stamp_ns, reason } => warn!(map, stamp_ns, "new segment: {reason}"),
            Effect::EdgeRefused { reason, .. } => debug!(map, "{reason}"),
            Effect::Mended(done) => info!(map, "mended: {done:?}"),
            Effect::PlaceBegan { .. } | Effect::ScanPlaced { .. } | Effect::Weighed { .. } => {}
        }
    }

    /// Makes the record durable; false if there is none.
    fn sync_record(&mut self) -> bool {
        let Some(record) = &mut self.record else {
            return false;
        };
        if let Err(e) = record.flush().and_then(|()| Ok(record.get_ref().sync_data()?)) {
            self.end_record(&e);
            return false;
        }
        *lock(&self.view.recorded) = self.card.watermark;
        true
    }

    /// A record with a gap would replay another map: better none from here on.
    fn end_record(&mut self, error: &RecordError) {
        error!(map = self.view.id, "DATA LOSS: recording ends here: {error}");
        self.record = None;
    }

    fn save(&mut self) -> Result<(), StoreError> {
        let bytes = self
            .mapper
            .save()
            .map_err(|e| StoreError::Broken { path: (&self.view.id).into(), reason: e.to_string() })?;
        self.store.save(&self.view.id, &bytes, &self.card)
    }
}
