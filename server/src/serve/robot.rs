//! One robot's way into its map: decode → order by (boot, seq) → hand to the map's journal, and keep account of
//! all of it.

use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::sync::mpsc::TrySendError;
use std::time::{Duration, Instant};
use toponym_journal::Event;
use toponym_proto::answer::{ANSWER_VERSION, Ack, Counts, ErrorCode, Problem, RobotState};
use toponym_proto::sequence::{Patience, Sequencer, Step};
use toponym_proto::{Message, Say, Setup};
use tracing::{error, info};

use super::board::{MapView, lock};
use super::mapping::bytes_of;
use super::maps::Saved;
use super::scribe::Work;
use crate::config::ServerConfig;
use clock::RobotClock;

/// Finds the map that a setup names, or says why the robot can't have it.
pub type FindMap<'a> = dyn FnMut(&Setup) -> Result<Arc<MapView>, Problem> + 'a;

/// State of one robot's streams.
pub struct Robot {
    id: String,
    sequencer: Sequencer,
    /// A step that waits until the map has room, or until all before it is on disk: a setup that changes maps.
    parked: Option<Step>,
    /// The map its streams go to.
    map: Option<Arc<MapView>>,
    /// When something of it arrived last.
    heard_at: Duration,
    /// Newest boot.
    boot: Option<u64>,
    /// Stamps of that boot that have arrived.
    clock: RobotClock,
    /// (boot, seq) of the last message handed to the map, or given up.
    handed: Option<(u64, u64)>,
    /// The same of those on disk.
    acked: Option<(u64, u64)>,
    counts: Counts,
    /// Why it has no map.
    no_map: Option<Problem>,
    /// Why the last refused message was refused.
    refusal: Option<Problem>,
    queue_messages: usize,
    backlog_max_bytes: usize,
}

impl Robot {
    /// `saved`: of an earlier run; the robot need
    /// not present itself again.
    pub fn new(id: &str, config: &ServerConfig, saved: Option<Saved>) -> Self {
        let watermark = saved.as_ref().map(|saved| saved.watermark);
        let patience = Patience {
            join_wait: Duration::from_secs_f64(config.join_wait_s),
            gap_wait: Duration::from_secs_f64(config.gap_wait_s),
            window: config.gap_window,
        };
        Self {
            id: id.into(),
            sequencer: Sequencer::new(patience, watermark),
            parked: None,
            heard_at: Duration::ZERO,
            clock: RobotClock::since(saved.as_ref().map(|saved| saved.newest)),
            map: saved.and_then(|saved| saved.map),
            boot: watermark.map(|w| w.0),
            handed: watermark,
            acked: watermark,
            counts: Counts::default(),
            no_map: None,
            refusal: None,
            queue_messages: config.limits.queue_messages,
            backlog_max_bytes: config.limits.backlog_bytes,
        }
    }

    /// Whether no more of its streams fits in, of which so many bytes may wait: the map can't keep up.
    pub fn is_full(&self, share_bytes: usize) -> bool {
        self.sequencer.len() >= self.queue_messages || self.sequencer.bytes() >= share_bytes
    }

    /// When something of it arrived last.
    pub fn heard_at(&self) -> Duration {
        self.heard_at
    }

    /// Whether its streams go to a map.
    pub fn map(&self) -> Option<&Arc<MapView>> {
        self.map.as_ref()
    }

    /// Takes in a message of the robot's streams.
    pub fn push(&mut self, now: Duration, message: Message) {
        self.heard_at = now;
        if let Some(header) = message.header() {
            if Some(header.boot) > self.boot {
                // What was wrong with an earlier start says nothing of this one.
                (self.boot, self.no_map, self.refusal) = (Some(header.boot), None, None);
                self.clock.begin(header.stamp);
            }
            self.notice_restart(&message);
            if Some(header.boot) == self.boot {
                self.clock.note(now, header.stamp);
            }
        }
        self.sequencer.push(now, message);
    }

    /// A setup with a number that was used before, but later than all that came, is no repetition: the robot has started
    /// again under the same boot, and all that it sends looks old.
    fn notice_restart(&mut self, message: &Message) {
        let Message::Setup(Setup { header, .. }) = message else { return };
        let is_used = self.handed.is_some_and(|(boot, seq)| boot == header.boot && header.seq <= seq);
        if is_used && Some(header.stamp) > self.clock.newest() {
            let message = format!("boot {} was used before: what has a used seq is dropped", header.boot);
            error!(robot = self.id, "{message}");
            let hint = "each start of a robot needs a larger boot, such as the Unix time in seconds";
            self.refusal = Some(Problem::new(ErrorCode::BadArgument, message).field("boot").hint(hint));
        }
    }

    /// Hands a sentence to the map. One without `began` counts as said at the newest stamp that has arrived, or where the
    /// robot's clock stood `ago_s` before `now`.
    ///
    /// # Errors
    /// If it can't be told when it was said; if the map can't keep up, or has stopped.
    pub fn push_say(&mut self, now: Duration, mut say: Say) -> Result<(), Problem> {
        match say.began {
            Some(began) => self.clock.check(began)?,
            None => say.began = Some(self.clock.before(now, say.ago_s.unwrap_or_default())?),
        }
        let boot = self.boot.unwrap_or_default();
        let stopped = || Problem::new(ErrorCode::Internal, "the map has stopped: see the server's log");
        let busy = || Problem::new(ErrorCode::Busy, "the map can't keep up: say it again later");
        let map = self.map.as_ref().ok_or_else(stopped)?;
        match hand(map, Event::Say { boot, say }, self.backlog_max_bytes) {
            Ok(()) => Ok(()),
            Err(TrySendError::Full(_)) => Err(busy()),
            Err(TrySendError::Disconnected(_)) => Err(stopped()),
        }
    }

    /// Counts a refusal; the newest is told in the robot's state. `place`: (boot, seq), if that could be read.
    pub fn refuse(&mut self, now: Duration, place: Option<(u64, u64)>, problem: Problem) {
        self.heard_at = now;
        self.counts.refused += 1;
        self.refusal = Some(problem);
        if let Some(place) = place {
            self.sequencer.refuse(now, place);
        }
    }

    /// Moves on what is due at `now`. If the stream is to `finish`: all that is in order; what lies
    /// behind a gap is not acknowledged, so that the robot can send it again after a restart.
    pub fn advance(&mut self, now: Duration, finish: bool, find_map: &mut FindMap<'_>) {
        // At the beginning of time no gap has been waited for long enough.
        let in_order = if finish { Duration::ZERO } else { now };
        while let Some(step) = self.parked.take().or_else(|| self.sequencer.pop(in_order)) {
            if let Some(step) = self.take_step(step, find_map) {
                self.parked = Some(step);
                break;
            }
        }
        if let Some(map) = &self.map {
            let durable = *lock(&map.durable);
            // Of a map that it left and came back to, what was known before still holds.
            self.acked = self.acked.max(durable.filter(|d| Some(*d) <= self.handed));
        }
    }

    /// One step of the ordered stream; gives it back if it has to wait.
    fn take_step(&mut self, step: Step, find_map: &mut FindMap<'_>) -> Option<Step> {
        if let Step::Message(Message::Setup(setup)) = &step
            && self.map.as_ref().is_none_or(|map| map.id != setup.map)
        {
            if !self.is_drained() {
                // What came before belongs to the map before.
                return Some(step);
            }
            match find_map(setup) {
                Ok(map) => {
                    info!(robot = self.id, map = map.id, "maps");
                    (self.map, self.no_map) = (Some(map), None);
                }
                Err(problem) => {
                    error!(robot = self.id, map = setup.map, "refused: {problem}");
                    (self.map, self.no_map) = (None, Some(problem));
                }
            }
        }
        let (event, last) = match step {
            Step::Message(message) => {
                let at = message.header().map(|h| (h.boot, h.seq));
                (Event::Message(message), at)
            }
            Step::Lost { boot, from, to } => {
                self.counts.lost += to - from;
                error!(robot = self.id, boot, from, to, "DATA LOSS: messages from..to never came");
                (Event::Gap { boot, to }, to.checked_sub(1).map(|seq| (boot, seq)))
            }
            Step::Refused { boot, seq } => (Event::Gap { boot, to: seq + 1 }, Some((boot, seq))),
        };
        self.hand_over(event, last)
    }

    /// Hands something to the map, if there is one; gives it back if there is no room.
    fn hand_over(&mut self, event: Event, last: Option<(u64, u64)>) -> Option<Step> {
        let is_message = matches!(event, Event::Message(_));
        let Some(map) = &self.map else {
            if is_message {
                self.counts.refused += 1;
                self.no_map.get_or_insert_with(|| {
                    Problem::new(ErrorCode::BadArgument, "a message came before the robot's setup")
                        .field("setup")
                        .hint("publish in/setup first, with seq 0, and keep it in the publisher's cache")
                });
            }
            return None;
        };
        match hand(map, event, self.backlog_max_bytes) {
            Ok(()) => {
                self.counts.taken += u64::from(is_message);
                self.handed = self.handed.max(last);
                None
            }
            Err(TrySendError::Full(Event::Message(message))) => Some(Step::Message(message)),
            Err(TrySendError::Full(Event::Gap { boot, to })) => Some(Step::Refused { boot, seq: to - 1 }),
            Err(_) => {
                self.fail(is_message);
                None
            }
        }
    }

    /// Whether all that was handed to the map is on disk, or never will be.
    fn is_drained(&self) -> bool {
        self.map.as_ref().is_none_or(|map| {
            self.handed.is_none() || *lock(&map.durable) >= self.handed || map.ended.load(Ordering::Acquire)
        })
    }

    /// Messages handed to the map that are not acknowledged yet.
    pub fn in_flight(&self) -> u64 {
        match (self.handed, self.acked) {
            (Some((boot, seq)), Some((acked_boot, acked))) if boot == acked_boot => seq.saturating_sub(acked),
            (Some((_, seq)), _) => seq + 1,
            (None, _) => 0,
        }
    }

    /// Whether all that is in order was handed over and is on disk, or can't be for now.
    pub fn is_settled(&self) -> bool {
        self.parked.is_none() && self.is_drained()
    }

    /// Its map is gone, if it was this one: it has to present itself again.
    pub fn lose_map(&mut self, id: &str, why: &Problem) {
        if self.map.as_ref().is_some_and(|map| map.id == id) {
            (self.map, self.no_map) = (None, Some(why.clone()));
        }
    }

    fn fail(&mut self, loses: bool) {
        if let Some(map) = self.map.take() {
            let message = format!("map {:?} has stopped: see the server's log", map.id);
            error!(robot = self.id, "nothing more is taken: {message}");
            self.counts.refused += u64::from(loses);
            self.no_map = Some(Problem::new(ErrorCode::Internal, message));
        }
    }

    /// What is told on `out/ack`; nothing before the first message.
    pub fn ack(&self) -> Option<Ack> {
        let (boot, seq) = self.acked?;
        Some(Ack { v: ANSWER_VERSION, robot: self.id.clone(), boot, seq, lost: self.counts.lost })
    }

    /// What is told on `out/state`.
    pub fn state(&self) -> RobotState {
        let dropped = self.sequencer.dropped();
        let unused = self.map.as_ref().map(|map| lock(&map.unused).clone()).unwrap_or_default();
        let trouble = self.map.as_ref().and_then(|map| lock(&map.trouble).clone()).map(|why| {
            Problem::new(ErrorCode::Internal, format!("the journal can't be written: {why}"))
                .hint("nothing is taken in until it can; free some space, or mend the disk")
        });
        RobotState {
            v: ANSWER_VERSION,
            robot: self.id.clone(),
            map: self.map.as_ref().map(|map| map.id.clone()),
            boot: self.boot,
            newest: self.clock.newest(),
            unused: unused.1,
            senses: self.map.as_ref().map(|map| lock(&map.suspected).clone()).unwrap_or_default(),
            counts: Counts {
                repeated: dropped.repeated,
                stale: dropped.stale,
                refused: self.counts.refused + dropped.absurd,
                unused: unused.0,
                ..self.counts
            },
            error: trouble.or_else(|| self.no_map.clone()).or_else(|| self.refusal.clone()),
        }
    }
}

/// Hands something to a map's journal, if there is room.
// What can't be handed over comes back, as it does from a channel.
#[allow(clippy::result_large_err)]
fn hand(map: &MapView, event: Event, backlog_max_bytes: usize) -> Result<(), TrySendError<Event>> {
    let bytes = bytes_of(&event);
    if map.backlog_bytes.load(Ordering::Relaxed) + bytes > backlog_max_bytes {
        return Err(TrySendError::Full(event));
    }
    map.backlog_bytes.fetch_add(bytes, Ordering::Relaxed);
    *lock(&map.heard_at) = Instant::now();
    let given_back = |work: Work| {
        map.backlog_bytes.fetch_sub(bytes, Ordering::Relaxed);
        match work {
            Work::Take(event) => event,
            Work::Mend(..) | Work::Save(_) | Work::Stop => Event::Tick,
        }
    };
    map.work.try_send(Work::Take(event)).map_err(|e| match e {
        TrySendError::Full(work) => TrySendError::Full(given_back(work)),
        TrySendError::Disconnected(work) => TrySendError::Disconnected(given_back(work)),
    })
}

mod clock;
#[cfg(test)]
mod tests;
