//! Plays a log through a mapper and keeps what the report and the trajectory need of it.

use super::history::History;
use super::timing::{Stage, Stopwatch};
use crate::convert;
use std::collections::{BTreeMap, VecDeque};
use std::time::Instant;
use toponym::log::LogRecord;
use toponym_core::answers::query::GraphAnswer;
use toponym_core::answers::trajectory::{Keyframe, carry};
use toponym_core::effects::{Heard, Suspicion, TrackState};
use toponym_core::{Effect, Effects, Event, Mapper, Pose2};
use toponym_proto::{Message, Refused};

/// What playing a log left behind, beside the map.
#[derive(Debug)]
pub struct Played {
    /// The map.
    pub mapper: Mapper,
    /// Stamp of each trajectory row, as the log wrote it.
    pub row_stamps: Vec<String>,
    /// Odometry of each trajectory row.
    rows: Vec<Pose2>,
    keyframes: Vec<Keyframe>,
    /// Scans fed but not placed or dropped yet: stamp and rows before.
    waiting: VecDeque<(i64, usize)>,
    /// What became of each sentence, in order.
    pub heard: Vec<Heard>,
    /// Scans that found a pose.
    pub scans_placed: u64,
    /// Why scans were dropped, and how many for each reason.
    pub scans_dropped: BTreeMap<String, u64>,
    /// Why odometry segments began, and when.
    pub segments: Vec<(i64, String)>,
    /// What seemed wrong with the robot's senses, and when that showed.
    pub suspicions: Vec<(i64, Suspicion, String)>,
    /// How well the robot knew where it was, from when on and why: each change.
    pub states: Vec<(i64, TrackState, String)>,
    /// Where the history goes, if it is asked for.
    pub history: Option<History>,
    /// How long things took.
    pub stopwatch: Stopwatch,
    /// Smallest and largest stamp, nanoseconds.
    stamps_ns: Option<(i64, i64)>,
    hash: Fnv,
}

impl Played {
    /// Nothing yet.
    pub fn new(mapper: Mapper) -> Self {
        Self {
            mapper,
            row_stamps: Vec::new(),
            rows: Vec::new(),
            keyframes: Vec::new(),
            waiting: VecDeque::new(),
            heard: Vec::new(),
            scans_placed: 0,
            scans_dropped: BTreeMap::new(),
            segments: Vec::new(),
            suspicions: Vec::new(),
            states: Vec::new(),
            history: None,
            stopwatch: Stopwatch::default(),
            stamps_ns: None,
            hash: Fnv::default(),
        }
    }

    /// Takes the log's next message.
    pub fn feed(&mut self, record: LogRecord) -> Result<(), Refused> {
        self.hash.add(&record.message.to_bincode()?);
        if let Some(header) = record.message.header() {
            let ns = header.stamp.ns;
            self.stamps_ns = Some(self.stamps_ns.map_or((ns, ns), |(a, b)| (a.min(ns), b.max(ns))));
        }
        if let Message::Scan(scan) = &record.message {
            self.waiting.push_back((scan.header.stamp.ns, self.rows.len()));
        }
        let event = convert::event(record.message);
        if record.odom_row
            && let Event::Odom(odom) = &event
        {
            self.row_stamps.push(record.stamp_text);
            self.rows.push(odom.odom_from_body);
        }
        self.step(event);
        Ok(())
    }

    /// Ends the log: all places freeze.
    pub fn flush(&mut self) {
        self.step(Event::Flush);
    }

    fn step(&mut self, event: Event) {
        let utterance = matches!(event, Event::Utterance(_));
        // A flush settles many places at once: it is no step that a robot would wait for.
        let timed = !matches!(event, Event::Flush);
        let began = Instant::now();
        let effects = self.mapper.step(event);
        let took = began.elapsed();
        let stage = if utterance { Some(Stage::Utterance) } else { stage(&effects) };
        if let Some(stage) = stage.filter(|_| timed) {
            self.stopwatch.add(stage, took);
        }
        for effect in effects {
            self.keep(effect);
        }
    }

    fn keep(&mut self, effect: Effect) {
        if let Some(history) = &mut self.history {
            history.note(&effect);
        }
        match effect {
            Effect::ScanPlaced { stamp_ns, place, place_from_body, odom_from_body, .. } => {
                self.scans_placed += 1;
                if let Some(rows_before) = self.settled(stamp_ns) {
                    self.keyframes.push(Keyframe { rows_before, place, place_from_body, odom_from_body });
                }
            }
            Effect::ScanDropped { stamp_ns, reason } => {
                self.settled(stamp_ns);
                *self.scans_dropped.entry(reason).or_default() += 1;
            }
            Effect::SegmentBegan { stamp_ns, reason } => self.segments.push((stamp_ns, reason)),
            Effect::Suspected { stamp_ns, what, why } => {
                self.suspicions.push((stamp_ns, what, why));
            }
            Effect::StateChanged { stamp_ns, state, why } => self.states.push((stamp_ns, state, why)),
            Effect::Heard(heard) => self.heard.push(heard),
            _ => {}
        }
    }

    /// Rows before the oldest waiting scan of that stamp, which waits no more. Scans come back in
    /// the order they went in, but stamps may repeat and some scans are dropped at once.
    fn settled(&mut self, stamp_ns: i64) -> Option<usize> {
        let index = self.waiting.iter().position(|w| w.0 == stamp_ns)?;
        self.waiting.remove(index).map(|w| w.1)
    }

    /// The robot's pose at each row, map frame, by the places of `graph`.
    pub fn trajectory(&self, graph: &GraphAnswer) -> Vec<Pose2> {
        let places = graph.places.iter().map(|p| (p.id, p.pose)).collect();
        carry(&self.rows, &self.keyframes, &places)
    }

    /// Between the smallest and the largest stamp so far, seconds.
    pub fn log_s(&self) -> f64 {
        self.stamps_ns.map_or(0.0, |(a, b)| b.saturating_sub(a) as f64 * 1e-9)
    }

    /// Fingerprint of all messages so far.
    pub fn input_hash(&self) -> String {
        format!("fnv1a64:{:016x}", self.hash.0)
    }
}

/// What to account a step to; none for one that only took something in.
fn stage(effects: &Effects) -> Option<Stage> {
    let judged = |e: &Effect| {
        matches!(e, Effect::PlaceBegan { .. } | Effect::EdgeAccepted { .. } | Effect::EdgeRefused { .. })
    };
    if effects.iter().any(judged) {
        return Some(Stage::Place);
    }
    effects.iter().any(|e| matches!(e, Effect::ScanPlaced { .. })).then_some(Stage::Scan)
}

/// FNV-1a, 64 bits: tells inputs apart, proves nothing.
#[derive(Clone, Copy, Debug)]
struct Fnv(u64);

impl Default for Fnv {
    fn default() -> Self {
        Self(0xcbf2_9ce4_8422_2325)
    }
}

impl Fnv {
    fn add(&mut self, bytes: &[u8]) {
        for &byte in bytes {
            self.0 = (self.0 ^ u64::from(byte)).wrapping_mul(0x0000_0100_0000_01b3);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use toponym_core::Config;
    use toponym_proto::{Header, Odom, Pose, Scan, Stamp};

    fn record(message: Message, odom_row: bool) -> LogRecord {
        LogRecord { message, line: 0, odom_row, stamp_text: "7.50".into() }
    }

    fn odom(ns: i64, x_m: f64) -> Message {
        let header = Header { robot: "r".into(), stamp: Stamp { ns }, ..Header::default() };
        Message::Odom(Odom { header, odom_from_body: Pose { x_m, ..Pose::default() } })
    }

    fn scan(ns: i64) -> Message {
        Message::Scan(Scan {
            header: Header { robot: "r".into(), stamp: Stamp { ns }, ..Header::default() },
            laser: "front".into(),
            angle_min_rad: 0.0,
            angle_increment_rad: 0.1,
            time_increment_s: 0.0,
            ranges_m: vec![1.0],
        })
    }

    fn placed(stamp_ns: i64) -> Effect {
        let (place_from_body, odom_from_body) = (Pose2::default(), Pose2::default());
        Effect::ScanPlaced { scan: 0, stamp_ns, place: 0, place_from_body, odom_from_body }
    }

    #[test]
    fn only_the_logs_odometry_lines_are_rows() {
        let mut played = Played::new(Mapper::new(Config::default()));
        played.feed(record(odom(1, 1.0), true)).unwrap();
        played.feed(record(odom(2, 2.0), false)).unwrap();
        played.feed(record(odom(4, 3.0), true)).unwrap();
        assert_eq!(played.row_stamps, ["7.50", "7.50"]);
        assert_eq!(played.rows, [Pose2::new(1.0, 0.0, 0.0), Pose2::new(3.0, 0.0, 0.0)]);
        assert!((played.log_s() - 3e-9).abs() < 1e-15);
    }

    #[test]
    fn a_scan_placed_late_counts_the_rows_that_came_before_it() {
        let mut played = Played::new(Mapper::new(Config::default()));
        // Two scans of one stamp, a row between them, one more after: whatever the mapper says of
        // them now is set aside, and what it may say later is played by hand.
        for message in [odom(1, 0.0), scan(5), odom(2, 0.0), scan(5), odom(3, 0.0)] {
            played.feed(record(message, true)).unwrap();
        }
        played.waiting = VecDeque::from([(5, 1), (5, 2), (9, 3)]);
        played.keyframes.clear();
        played.keep(placed(5));
        played.keep(Effect::ScanDropped { stamp_ns: 9, reason: "why".into() });
        played.keep(placed(5));
        assert_eq!(played.keyframes.iter().map(|k| k.rows_before).collect::<Vec<_>>(), [1, 2]);
        assert_eq!(played.scans_dropped.get("why"), Some(&1));
    }

    #[test]
    fn the_fingerprint_depends_on_every_message_and_their_order() {
        let hash = |messages: &[Message]| {
            let mut played = Played::new(Mapper::new(Config::default()));
            for m in messages {
                played.feed(record(m.clone(), true)).unwrap();
            }
            played.input_hash()
        };
        let (a, b) = (odom(1, 1.0), odom(2, 2.0));
        assert_eq!(hash(&[a.clone(), b.clone()]), hash(&[a.clone(), b.clone()]));
        assert_ne!(hash(&[a.clone(), b.clone()]), hash(&[b, a.clone()]));
        assert_ne!(hash(std::slice::from_ref(&a)), hash(&[odom(1, 1.0 + 1e-12)]));
    }

    #[test]
    fn a_step_with_edges_is_a_place_step() {
        let began = Effect::PlaceBegan { place: 0, stamp_ns: 0 };
        assert_eq!(stage(&vec![placed(1)]), Some(Stage::Scan));
        assert_eq!(stage(&vec![placed(1), began]), Some(Stage::Place));
        assert_eq!(stage(&vec![]), None);
    }
}
