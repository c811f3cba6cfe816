//! The intake: one thread that takes what the network delivers, decodes and validates it, and
//! moves each robot's stream along. It alone owns the robots, so it needs no locks.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::sync::mpsc::{Receiver, RecvTimeoutError};
use std::time::{Duration, Instant};
use toponym_proto::answer::{Ack, Counts, ErrorCode, Problem, RobotState};
use toponym_proto::codec::place_of;
use toponym_proto::keys::{ANY_ROBOT, Input, check_key};
use toponym_proto::limits::WAITING_SENTENCES_MAX;
use toponym_proto::{Keys, Message, Refused, Say};
use tracing::{error, warn};

use super::board::{Board, lock};
use super::door::Arrival;
use super::maps::Maps;
use super::outbox::Outbox;
use super::robot::Robot;
use crate::config::ServerConfig;
use crate::fold::refused;

/// How often streams are looked after when nothing arrives.
const TICK: Duration = Duration::from_millis(2);
/// Shortest time between two acks of a robot, and between two of its states.
const REPORT_PERIOD: Duration = Duration::from_millis(50);
/// The same of an ack as long as no more messages wait for one: a robot that is not in a hurry is not kept waiting.
const ACK_PERIOD: Duration = Duration::from_millis(5);
/// How long what has arrived may take into the journals when the server stops.
const STOP_WAIT: Duration = Duration::from_secs(1);
/// Messages taken before the streams are moved on.
const BATCH: usize = 256;
/// A robot that lives has no more messages on their way to disk.
const FEW: u64 = 16;
/// How long a sentence waits for a robot that was never heard: its guide may be faster.
const ROBOT_WAIT: Duration = Duration::from_secs(2);
/// A robot has no larger share of what may wait than as if there were so many.
const ROBOTS_LEAST: usize = 8;

/// A sentence whose robot was never heard.
struct WaitingSay {
    arrived: Duration,
    robot: String,
    say: Say,
}

/// What was last published about a robot.
#[derive(Default)]
struct Reported {
    at: Duration,
    state_at: Duration,
    ack: Option<Ack>,
    state: Option<RobotState>,
}

/// The intake's state.
pub struct Intake {
    config: ServerConfig,
    keys: Keys,
    board: Arc<Board>,
    outbox: Outbox,
    maps: Maps,
    robots: BTreeMap<String, Robot>,
    reported: BTreeMap<String, Reported>,
    waiting: Vec<WaitingSay>,
    /// Messages on keys that mean nothing.
    strange: u64,
    started: Instant,
}

impl Intake {
    /// With the robots of the saved maps.
    pub fn new(config: ServerConfig, board: Arc<Board>, outbox: Outbox, maps: Maps) -> Self {
        // A robot of an earlier run need not present itself again, and can be talked to before it comes.
        let known = maps.saved_robots().map(|id| (id.to_owned(), Robot::new(id, &config, maps.saved(id))));
        let robots = known.collect();
        Self {
            keys: board.keys.clone(),
            config,
            board,
            outbox,
            maps,
            robots,
            reported: BTreeMap::new(),
            waiting: Vec::new(),
            strange: 0,
            started: Instant::now(),
        }
    }

    /// Works until it is told to stop; then hands over all that is in order and stops the maps.
    /// Returns what became of those that could not be saved.
    pub fn run(mut self, arrivals: &Receiver<Arrival>) -> Vec<String> {
        let mut open = true;
        while open {
            self.board.beat_ms.store(self.board.began.elapsed().as_millis() as u64, Ordering::Relaxed);
            let mut next = arrivals.recv_timeout(TICK);
            for taken in 1..=BATCH {
                match next {
                    Ok(Arrival::Stop) | Err(RecvTimeoutError::Disconnected) => open = false,
                    Ok(arrival) => self.take(arrival),
                    Err(RecvTimeoutError::Timeout) => break,
                }
                // What is received must be taken: after the last round nothing may be fetched.
                if !open || taken == BATCH {
                    break;
                }
                next = arrivals.try_recv().map_err(|_| RecvTimeoutError::Timeout);
            }
            self.advance(false);
        }
        // The maps' queues are bounded: each round hands over what has room. What is left then was not acknowledged.
        let stops_at = Instant::now() + STOP_WAIT;
        while self.robots.values().any(|robot| !robot.is_settled() && robot.map().is_some())
            && Instant::now() < stops_at
        {
            self.advance(true);
            std::thread::sleep(TICK);
        }
        self.advance(true);
        self.report(true);
        self.maps.stop()
    }

    fn now(&self) -> Duration {
        self.started.elapsed()
    }

    fn take(&mut self, arrival: Arrival) {
        let (key, result, place) = match arrival {
            Arrival::Payload { key, encoding, bytes } => {
                self.board.queued_bytes.fetch_sub(bytes.len(), Ordering::Relaxed);
                let message = self.read(&key, &encoding, &bytes);
                let place = if message.is_err() { place_of(&encoding, &bytes) } else { None };
                (key, message, place)
            }
            Arrival::TooLarge { key, bytes } => {
                self.board.queued_bytes.fetch_sub(bytes, Ordering::Relaxed);
                let max = self.config.limits.payload_bytes;
                (key, Err(Refused::TooLarge { bytes, max }), None)
            }
            Arrival::Delete { map, reply } => {
                let _ = reply.send(self.delete(&map));
                return;
            }
            Arrival::Goal(sent) => {
                self.outbox.send(self.keys.goal(&sent.robot), &*sent);
                return;
            }
            Arrival::Stop => return,
        };
        let robot = match self.keys.input(&key) {
            Ok((robot, _)) => robot,
            Err(invalid) => {
                self.strange += 1;
                if self.strange.is_power_of_two() {
                    warn!(
                        key = shown(&key),
                        strange = self.strange,
                        "refused: {}",
                        shown(&invalid.to_string())
                    );
                }
                return;
            }
        };
        match result {
            Ok(Message::Say(say)) => self.take_say(self.now(), robot, say),
            Ok(message) => self.take_message(&robot, &key, message),
            Err(refused) => self.refuse(&robot, &key, place, &refused),
        }
    }

    fn delete(&mut self, map: &str) -> Result<(), Problem> {
        self.maps.delete(map)?;
        let problem = Problem::new(ErrorCode::NoSuchMap, format!("map {map:?} was deleted"));
        self.lose(map, &problem.field("map").hint("send a setup again: it makes a new map"));
        Ok(())
    }

    fn lose(&mut self, map: &str, why: &Problem) {
        self.robots.values_mut().for_each(|robot| robot.lose_map(map, why));
    }

    fn read(&self, key: &str, encoding: &str, bytes: &[u8]) -> Result<Message, Refused> {
        let (robot, input) = self.keys.input(key)?;
        let message = Message::decode(&input, encoding, bytes, &self.config.limits)?;
        check_key(&robot, &input, &message)?;
        Ok(message)
    }

    /// The robot's state, made at need; none if there are too many robots already.
    fn robot(&mut self, id: &str) -> Option<&mut Robot> {
        if !self.robots.contains_key(id) {
            if self.robots.len() >= self.config.limits.robots && !self.forget_a_stranger() {
                error!(robot = id, robots = self.config.limits.robots, "refused: too many robots");
                self.board.reach("robots");
                return None;
            }
            let robot = Robot::new(id, &self.config, self.maps.saved(id));
            self.robots.insert(id.into(), robot);
        }
        self.robots.get_mut(id)
    }

    /// Makes room by forgetting the robot on no map of which nothing has come for longest; nothing of it was acknowledged.
    /// False if there is none.
    fn forget_a_stranger(&mut self) -> bool {
        let strangers = self.robots.iter().filter(|(_, robot)| robot.map().is_none());
        let Some(id) = strangers.min_by_key(|(_, robot)| robot.heard_at()).map(|(id, _)| id.clone()) else {
            return false;
        };
        self.robots.remove(&id);
        self.reported.remove(&id);
        lock(&self.board.robots).remove(&id);
        let mut latest = lock(&self.board.latest);
        latest.remove(&self.keys.state(&id));
        latest.remove(&self.keys.ack(&id));
        true
    }

    fn take_message(&mut self, id: &str, key: &str, message: Message) {
        let robots = self.robots.len();
        let now = self.now();
        // Robots that leave gaps may fill what is theirs, and no more.
        let share_bytes = self.config.limits.waiting_bytes / robots.max(ROBOTS_LEAST);
        let Some(robot) = self.robot(id) else {
            return;
        };
        if robot.is_full(share_bytes) {
            self.board.reach("waiting_bytes");
            let overrun = self.board.overrun.fetch_add(1, Ordering::Relaxed) + 1;
            if overrun.is_power_of_two() {
                error!(key, overrun, "the map can't keep up: messages are dropped, to be sent again");
            }
            return;
        }
        robot.push(now, message);
    }

    fn refuse(&mut self, robot: &str, key: &str, place: Option<(u64, u64)>, refused: &Refused) {
        let now = self.now();
        let refusals = self.robots.get(robot).map_or(1, |r| r.state().counts.refused + 1);
        // The first, and then each doubling.
        if refusals.is_power_of_two() {
            warn!(key = shown(key), refusals, "refused: {}", shown(&refused.to_string()));
        }
        let problem = match refused {
            Refused::TooLarge { .. } => Problem::new(ErrorCode::TooLarge, refused.to_string()),
            Refused::Malformed(_) => Problem::new(ErrorCode::BadArgument, refused.to_string()),
            Refused::Invalid(invalid) => Problem::from(invalid.clone()),
        };
        let problem = Problem { message: format!("{key}: {}", problem.message), ..problem };
        // A sentence's sender listens for what became of it; without an id there is no better way.
        if key.ends_with("/say") && matches!(self.keys.input(key), Ok((_, Input::Say))) {
            self.answer_say(robot, "", problem.clone());
        }
        if robot != ANY_ROBOT
            && let Some(robot) = self.robot(robot)
        {
            robot.refuse(now, place, problem);
        }
    }

    fn take_say(&mut self, arrived: Duration, robot: String, mut say: Say) {
        let id = say.robot.clone().unwrap_or_else(|| robot.clone());
        let mapping: Vec<&String> =
            self.robots.iter().filter(|(_, r)| r.map().is_some()).map(|(id, _)| id).collect();
        let target = match mapping.as_slice() {
            [only] if id == ANY_ROBOT => (*only).clone(),
            several if several.contains(&&id) => id,
            [_, _, ..] if id == ANY_ROBOT => {
                let names: Vec<&str> = mapping.iter().map(|id| id.as_str()).collect();
                let problem = Problem::new(ErrorCode::RobotAmbiguous, "there are several robots")
                    .field("robot")
                    .hint(format!("say which: {}", names.join(", ")));
                return self.answer_say(&robot, &say.id, problem);
            }
            _ => {
                if self.now().saturating_sub(arrived) < ROBOT_WAIT
                    && self.waiting.len() < WAITING_SENTENCES_MAX
                {
                    self.waiting.push(WaitingSay { arrived, robot, say });
                    return;
                }
                let problem = match self.robots.get(&id).and_then(|r| r.state().error) {
                    Some(problem) => problem,
                    None => Problem::new(ErrorCode::NoSuchRobot, format!("no robot {id:?} is mapping"))
                        .field("robot")
                        .hint("its setup has not been accepted; see robot/{robot}/out/state and info"),
                };
                return self.answer_say(&robot, &say.id, problem);
            }
        };
        say.robot = Some(target.clone());
        let now = self.now();
        say.ago_s = say.ago_s.map(|ago_s| ago_s + now.saturating_sub(arrived).as_secs_f64());
        let said = self.robots.get_mut(&target).map_or(Ok(()), |mapping| mapping.push_say(now, say.clone()));
        if let Err(problem) = said {
            self.answer_say(&robot, &say.id, problem);
        }
    }

    /// Tells a guide that a sentence can't be used.
    fn answer_say(&self, robot: &str, id: &str, problem: Problem) {
        warn!(robot, id = shown(id), "sentence refused: {}", shown(&problem.to_string()));
        let heard = refused(id, problem);
        self.outbox.tell(self.keys.heard(robot), &heard);
    }

    fn advance(&mut self, finish: bool) {
        for waiting in std::mem::take(&mut self.waiting) {
            self.take_say(waiting.arrived, waiting.robot, waiting.say);
        }
        let now = self.now();
        let maps = &mut self.maps;
        for robot in self.robots.values_mut() {
            robot.advance(now, finish, &mut |setup| maps.find(setup));
        }
        for (map, why) in self.maps.take_retired() {
            self.lose(&map, &why);
        }
        self.report(finish);
    }

    /// Publishes acks and states that changed, not too often.
    fn report(&mut self, at_once: bool) {
        let now = self.now();
        for (id, robot) in &self.robots {
            let reported = self.reported.entry(id.clone()).or_default();
            let since = now.saturating_sub(reported.at);
            if !at_once && since < ACK_PERIOD {
                continue;
            }
            let ack = robot.ack();
            let period = if robot.in_flight() > FEW { REPORT_PERIOD } else { ACK_PERIOD };
            if ack != reported.ack && (at_once || since >= period) {
                if let Some(ack) = &ack {
                    self.outbox.send(self.keys.ack(id), ack);
                }
                (reported.ack, reported.at) = (ack, now);
            }
            if !at_once && now.saturating_sub(reported.state_at) < REPORT_PERIOD {
                continue;
            }
            reported.state_at = now;
            let state = robot.state();
            let known = reported.state.as_ref();
            // What is merely taken is told by the ack.
            let news = known.is_none_or(|known| {
                let counts = Counts { taken: known.counts.taken, ..state.counts };
                (&known.map, known.boot, &known.error) != (&state.map, state.boot, &state.error)
                    || known.counts != counts
            });
            if news {
                self.outbox.send(self.keys.state(id), &state);
                reported.state = Some(state.clone());
            }
            lock(&self.board.robots).insert(id.clone(), state);
        }
    }
}

/// A text from outside, for the log: not too long, and without control characters.
fn shown(text: &str) -> String {
    text.chars().take(200).map(|c| if c.is_control() { '\u{fffd}' } else { c }).collect()
}
