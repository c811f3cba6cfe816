//! One robot's way into its map: decode → order by (boot, seq) → hold back for sentences → hand to
//! the map's queue, and keep account of all of it.

use std::collections::VecDeque;
use std::sync::Arc;
use std::sync::mpsc::TrySendError;
use std::time::Duration;
use toponym_proto::answer::{ANSWER_VERSION, Ack, Counts, ErrorCode, Problem, RobotState};
use toponym_proto::merge::HoldBack;
use toponym_proto::sequence::{Patience, Sequencer, Step};
use toponym_proto::{Message, Say, Setup};
use tracing::{error, info};

use super::board::{MapView, lock};
use super::mapping::Work;
use crate::config::ServerConfig;

/// Finds the map that a setup names, or says why the robot can't have it.
pub type FindMap<'a> = dyn FnMut(&Setup) -> Result<Arc<MapView>, Problem> + 'a;

/// State of one robot's streams.
pub struct Robot {
    id: String,
    sequencer: Sequencer,
    hold: HoldBack,
    /// A step that waits until all before it is handed over: a setup that changes maps.
    parked: Option<Step>,
    /// Handed over next, once the map's queue has room.
    outgoing: VecDeque<Message>,
    /// The map its streams go to.
    map: Option<Arc<MapView>>,
    /// Newest boot.
    boot: Option<u64>,
    /// (boot, seq) of the last message handed to the map, or given up.
    watermark: Option<(u64, u64)>,
    counts: Counts,
    /// Why it has no map.
    no_map: Option<Problem>,
    /// Why the last refused message was refused.
    refusal: Option<Problem>,
    queue_messages: usize,
}

impl Robot {
    /// `saved`: its map of an earlier run, and (boot, seq) of the last message in it; the robot need
    /// not present itself again.
    pub fn new(id: &str, config: &ServerConfig, saved: Option<(Arc<MapView>, (u64, u64))>) -> Self {
        let (map, watermark) = saved.unzip();
        // A boot that is not the saved one has a clock of its own.
        let newest = map.as_ref().zip(watermark).map(|(map, (boot, _))| (boot, map.stamp()));
        let patience = Patience {
            join_wait: Duration::from_secs_f64(config.join_wait_s),
            gap_wait: Duration::from_secs_f64(config.gap_wait_s),
            window: config.gap_window,
        };
        Self {
            id: id.into(),
            sequencer: Sequencer::new(patience, watermark),
            hold: HoldBack::new(Duration::from_secs_f64(config.hold_back_s), newest),
            parked: None,
            outgoing: VecDeque::new(),
            map,
            boot: watermark.map(|w| w.0),
            watermark,
            counts: Counts::default(),
            no_map: None,
            refusal: None,
            queue_messages: config.queue_messages,
        }
    }

    /// Whether no more of its streams fits in: the map can't keep up.
    pub fn is_full(&self) -> bool {
        self.sequencer.len() + self.hold.len() + self.outgoing.len() >= self.queue_messages
    }

    /// Whether no more sentences fit in: not even those that are one too many have gone to the map.
    pub fn is_deaf(&self) -> bool {
        self.is_full() || self.hold.sentences() >= 2 * HoldBack::SENTENCES_MAX
    }

    /// Whether its streams go to a map.
    pub fn map(&self) -> Option<&Arc<MapView>> {
        self.map.as_ref()
    }

    /// Takes in a message of the robot's streams.
    pub fn push(&mut self, now: Duration, message: Message) {
        let boot = message.header().map(|h| h.boot);
        if boot > self.boot {
            // What was wrong with an earlier start says nothing of this one.
            (self.boot, self.no_map, self.refusal) = (boot, None, None);
        }
        self.sequencer.push(now, message);
    }

    /// Takes in a sentence said to the robot.
    pub fn push_say(&mut self, now: Duration, say: Say) {
        self.hold.push_say(now, self.boot.unwrap_or_default(), say);
    }

    /// Counts a refusal; the newest is told in the robot's state.
    pub fn refuse(&mut self, problem: Problem) {
        self.counts.refused += 1;
        self.refusal = Some(problem);
    }

    /// Moves on what is due at `now`. If the stream is to `finish`: all that is in order; what lies
    /// behind a gap is not acknowledged, so that the robot can send it again after a restart.
    pub fn advance(&mut self, now: Duration, finish: bool, find_map: &mut FindMap<'_>) {
        // At the beginning of time no gap has been waited for long enough.
        let (in_order, due) = if finish { (Duration::ZERO, Duration::MAX) } else { (now, now) };
        while let Some(step) = self.parked.take().or_else(|| self.sequencer.pop(in_order)) {
            if !self.take_step(now, step, find_map) {
                break;
            }
        }
        self.hand_over(due);
    }

    /// One step of the ordered stream; false if it has to wait.
    fn take_step(&mut self, now: Duration, step: Step, find_map: &mut FindMap<'_>) -> bool {
        let message = match step {
            Step::Message(message) => message,
            Step::Lost { boot, from, to } => {
                self.counts.lost += to - from;
                error!(robot = self.id, boot, from, to, "DATA LOSS: messages from..to never came");
                return true;
            }
        };
        if let Message::Setup(setup) = &message
            && self.map.as_ref().is_none_or(|map| map.id != setup.map)
        {
            if !self.is_drained() {
                // What came before belongs to the map before.
                self.parked = Some(Step::Message(message));
                return false;
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
        if self.map.is_some() {
            self.hold.push(now, message);
            return true;
        }
        self.counts.refused += 1;
        self.no_map.get_or_insert_with(|| {
            Problem::new(ErrorCode::BadArgument, "a message came before the robot's setup")
                .field("setup")
                .hint("publish in/setup first, with seq 0, and keep it in the publisher's cache")
        });
        true
    }

    /// Whether nothing is on the way to the map.
    fn is_drained(&self) -> bool {
        self.hold.is_empty() && self.outgoing.is_empty()
    }

    /// Whether all that is in order was handed over.
    pub fn is_settled(&self) -> bool {
        self.is_drained() && self.parked.is_none()
    }

    /// Whether nothing waits at all.
    pub fn is_idle(&self) -> bool {
        self.is_settled() && self.sequencer.is_empty()
    }

    /// Hands what is due to the map's queue, as far as there is room.
    fn hand_over(&mut self, due: Duration) {
        let Some(map) = &self.map else {
            return;
        };
        while let Some(message) = self.outgoing.pop_front().or_else(|| self.hold.pop(due)) {
            let stamp = message.header().map(|h| (h.boot, h.seq));
            match map.work.try_send(Work::Take(message)) {
                Ok(()) => {
                    self.counts.taken += 1;
                    self.watermark = stamp.or(self.watermark);
                }
                Err(TrySendError::Full(Work::Take(message))) => {
                    self.outgoing.push_front(message);
                    return;
                }
                Err(_) => {
                    self.fail();
                    return;
                }
            }
        }
    }

    fn fail(&mut self) {
        let Some(map) = self.map.take() else {
            return;
        };
        let message = format!("map {:?} has stopped: see the server's log", map.id);
        let dropped = 1 + self.hold.len() + self.outgoing.len();
        error!(robot = self.id, dropped, "DATA LOSS: {message}");
        self.counts.refused += dropped as u64;
        // Nothing can take it any more; a setup of another map must not wait for it.
        self.hold.clear();
        self.outgoing.clear();
        self.no_map = Some(Problem::new(ErrorCode::Internal, message));
    }

    /// What is told on `out/ack`; nothing before the first message.
    pub fn ack(&self) -> Option<Ack> {
        let (boot, seq) = self.watermark?;
        let recorded = self.map.as_ref().and_then(|map| *lock(&map.recorded));
        Some(Ack {
            v: ANSWER_VERSION,
            robot: self.id.clone(),
            boot,
            seq,
            durable: recorded >= Some((boot, seq)),
            lost: self.counts.lost,
        })
    }

    /// What is told on `out/state`.
    pub fn state(&self) -> RobotState {
        let dropped = self.sequencer.dropped();
        RobotState {
            v: ANSWER_VERSION,
            robot: self.id.clone(),
            map: self.map.as_ref().map(|map| map.id.clone()),
            boot: self.boot,
            counts: Counts { repeated: dropped.repeated, stale: dropped.stale, ..self.counts },
            error: self.no_map.clone().or_else(|| self.refusal.clone()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::serve::mapping::Work;
    use std::sync::Mutex;
    use std::sync::atomic::AtomicI64;
    use std::sync::mpsc::{Receiver, sync_channel};
    use toponym_core::Mapper;
    use toponym_proto::{Header, Odom, Pose};

    const START: Duration = Duration::from_secs(100);

    fn map(id: &str) -> (Arc<MapView>, Receiver<Work>) {
        let (work, queue) = sync_channel(100);
        let mapper = Mapper::new(ServerConfig::default().mapper);
        let view = MapView {
            id: id.into(),
            uuid: "u".into(),
            robot: "r1".into(),
            snapshot: arc_swap::ArcSwap::new(mapper.snapshot()),
            stamp_ns: AtomicI64::new(0),
            recorded: Mutex::default(),
            work,
        };
        (Arc::new(view), queue)
    }

    fn header(seq: u64) -> Header {
        Header { robot: "r1".into(), boot: 1, seq, ..Header::default() }
    }

    fn setup(seq: u64, map: &str) -> Message {
        Message::Setup(Setup { header: header(seq), map: map.into(), lasers: vec![] })
    }

    fn odom(seq: u64) -> Message {
        Message::Odom(Odom { header: header(seq), odom_from_body: Pose::default() })
    }

    fn robot() -> Robot {
        Robot::new("r1", &ServerConfig::default(), None)
    }

    #[test]
    fn a_stop_leaves_what_is_behind_a_gap_to_be_sent_again() {
        let (view, queue) = map("main");
        let mut robot = robot();
        for message in [setup(0, "main"), odom(1), odom(3)] {
            robot.push(START, message);
        }
        robot.advance(START, true, &mut |_| Ok(view.clone()));
        let ack = robot.ack().unwrap();
        assert_eq!((ack.seq, ack.lost, queue.try_iter().count()), (1, 0, 2));
        assert!(robot.is_settled());
    }

    #[test]
    fn a_robot_whose_map_has_stopped_gets_another() {
        let ((broken, queue), (healthy, taken)) = (map("broken"), map("main"));
        drop(queue);
        let mut robot = robot();
        for message in [setup(0, "broken"), odom(1), odom(2)] {
            robot.push(START, message);
        }
        let mut find = |setup: &Setup| Ok(if setup.map == "main" { healthy.clone() } else { broken.clone() });
        robot.advance(START, false, &mut find);
        let later = START * 2;
        robot.advance(later, false, &mut find);
        assert_eq!((robot.map().is_none(), robot.state().counts.refused), (true, 3));
        robot.push(later, setup(3, "main"));
        robot.advance(later, false, &mut find);
        robot.advance(later * 2, false, &mut find);
        assert_eq!((robot.ack().map(|ack| ack.seq), taken.try_iter().count()), (Some(3), 1));
    }
}
