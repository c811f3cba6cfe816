//! One robot's streams put into one order, by (boot, seq).

use crate::limits::AHEAD_MAX;
use crate::stream::{Header, Message};
use std::collections::{BTreeMap, VecDeque};
use std::time::Duration;

/// What comes next.
#[allow(clippy::large_enum_variant, reason = "nearly all are messages: a box would cost each an allocation")]
#[derive(Clone, Debug, PartialEq)]
pub enum Step {
    /// The next message.
    Message(Message),
    /// Messages that did not come in time; they are given up.
    Lost {
        /// Of this boot.
        boot: u64,
        /// First missing seq.
        from: u64,
        /// First seq that is there again.
        to: u64,
    },
    /// A message came that could not be used; it was told why.
    Refused {
        /// Of this boot.
        boot: u64,
        /// Its seq.
        seq: u64,
    },
}

impl Step {
    fn weight_bytes(&self) -> usize {
        match self {
            Self::Message(message) => message.weight_bytes(),
            Self::Lost { .. } | Self::Refused { .. } => 0,
        }
    }
}

/// What was dropped, and why.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Dropped {
    /// Messages whose seq had come already, or was given up.
    pub repeated: u64,
    /// Messages of a boot before the newest.
    pub stale: u64,
    /// Messages whose seq is absurdly far ahead.
    pub absurd: u64,
}

/// How long a missing message is waited for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Patience {
    /// Before the first message: who comes in the middle of a stream waits for the robot to send
    /// again what is missing.
    pub join_wait: Duration,
    /// After that.
    pub gap_wait: Duration,
    /// In any case over no more later messages than these.
    pub window: usize,
}

/// Orders the messages of one robot. A gap is waited for, with [`Patience`]. Time is passed in, as
/// in [`crate::merge::HoldBack`].
#[derive(Debug)]
pub struct Sequencer {
    patience: Patience,
    /// Whether a message has come out.
    joined: bool,
    boot: Option<u64>,
    /// Seq that comes next.
    next: u64,
    /// Came too early, each with its time of arrival.
    early: BTreeMap<u64, (Duration, Step)>,
    /// In order, not yet taken.
    ready: VecDeque<Step>,
    /// Bytes of what is held.
    bytes: usize,
    dropped: Dropped,
}

impl Sequencer {
    /// `watermark`: (boot, seq) of the last message of an earlier run; all up to it are known.
    pub fn new(patience: Patience, watermark: Option<(u64, u64)>) -> Self {
        Self {
            patience,
            joined: false,
            boot: watermark.map(|(boot, _)| boot),
            next: watermark.map_or(0, |(_, seq)| seq + 1),
            early: BTreeMap::new(),
            ready: VecDeque::new(),
            bytes: 0,
            dropped: Dropped::default(),
        }
    }

    /// Takes in a message; one without a header is none of a robot's.
    pub fn push(&mut self, now: Duration, message: Message) {
        if let Some(&Header { boot, seq, .. }) = message.header() {
            self.put(now, (boot, seq), Step::Message(message));
        }
    }

    /// Takes note of a message that can't be used, but whose place is known: it is not waited for.
    pub fn refuse(&mut self, now: Duration, (boot, seq): (u64, u64)) {
        // It may be forged in part: only what continues the stream is believed.
        if self.boot == Some(boot) && seq >= self.next && seq - self.next <= self.patience.window as u64 {
            self.put(now, (boot, seq), Step::Refused { boot, seq });
        }
    }

    fn put(&mut self, now: Duration, (boot, seq): (u64, u64), step: Step) {
        match self.boot {
            Some(current) if boot < current => {
                self.dropped.stale += 1;
                return;
            }
            Some(current) if boot == current => {}
            _ => {
                // Nothing more comes of the boot before.
                self.give_up(Duration::MAX);
                (self.boot, self.next) = (Some(boot), 0);
            }
        }
        if seq < self.next || self.early.contains_key(&seq) {
            self.dropped.repeated += 1;
            return;
        }
        if self.joined && seq - self.next > AHEAD_MAX {
            self.dropped.absurd += 1;
            return;
        }
        self.bytes += step.weight_bytes();
        self.early.insert(seq, (now, step));
        self.take_ready();
    }

    /// The next step that is due at `now`; [`Duration::MAX`] gives up all gaps.
    pub fn pop(&mut self, now: Duration) -> Option<Step> {
        if self.ready.is_empty() {
            self.give_up(now);
        }
        let step = self.ready.pop_front();
        self.bytes -= step.as_ref().map_or(0, Step::weight_bytes);
        step
    }

    /// What was dropped so far.
    pub fn dropped(&self) -> Dropped {
        self.dropped
    }

    /// Messages that are held.
    pub fn len(&self) -> usize {
        self.early.len() + self.ready.len()
    }

    /// Bytes of them.
    pub fn bytes(&self) -> usize {
        self.bytes
    }

    /// Whether nothing is held.
    pub fn is_empty(&self) -> bool {
        self.early.is_empty() && self.ready.is_empty()
    }

    fn take_ready(&mut self) {
        while let Some((_, step)) = self.early.remove(&self.next) {
            self.ready.push_back(step);
            (self.joined, self.next) = (true, self.next + 1);
        }
    }

    /// Gives up gaps that were waited for long enough, the earliest first.
    fn give_up(&mut self, now: Duration) {
        let Patience { join_wait, gap_wait, window } = self.patience;
        while let Some((&first, _)) = self.early.first_key_value() {
            // The oldest of those behind the gap has waited longest, wherever it stands.
            let oldest = self.early.values().map(|(arrived, _)| *arrived).min().unwrap_or(now);
            let wait = if self.joined { gap_wait } else { join_wait };
            if self.early.len() <= window && now.saturating_sub(oldest) < wait {
                return;
            }
            let boot = self.boot.unwrap_or_default();
            self.ready.push_back(Step::Lost { boot, from: self.next, to: first });
            self.next = first;
            self.take_ready();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stream::{Odom, Pose};
    use proptest::prelude::*;

    const WAIT: Duration = Duration::from_secs(1);
    const JOIN: Duration = Duration::from_secs(5);

    fn patience(window: usize) -> Patience {
        Patience { join_wait: JOIN, gap_wait: WAIT, window }
    }

    fn odom(boot: u64, seq: u64) -> Message {
        let header = Header { robot: "r1".into(), boot, seq, ..Default::default() };
        Message::Odom(Odom { header, odom_from_body: Pose::default() })
    }

    fn drain(s: &mut Sequencer, now: Duration) -> Vec<Step> {
        std::iter::from_fn(|| s.pop(now)).collect()
    }

    fn messages(boot: u64, seqs: impl IntoIterator<Item = u64>) -> Vec<Step> {
        seqs.into_iter().map(|seq| Step::Message(odom(boot, seq))).collect()
    }

    proptest! {
        #[test]
        fn any_order_with_repetitions_comes_out_in_order(
            order in Just((0..40_u64).collect::<Vec<_>>()).prop_shuffle(),
            again in prop::collection::vec(0..40_usize, 0..20),
        ) {
            let mut s = Sequencer::new(patience(100), None);
            let mut got = Vec::new();
            for &seq in order.iter().chain(again.iter().map(|i| &order[*i])) {
                s.push(Duration::ZERO, odom(0, seq));
                got.extend(drain(&mut s, Duration::ZERO));
            }
            prop_assert_eq!(got, messages(0, 0..40));
            prop_assert_eq!(s.dropped().repeated, again.len() as u64);
        }

        #[test]
        fn what_is_missing_is_told_once(present in prop::collection::btree_set(0..60_u64, 1..40)) {
            let mut s = Sequencer::new(patience(100), None);
            for seq in &present {
                s.push(Duration::ZERO, odom(0, *seq));
            }
            let (mut seen, mut lost) = (Vec::new(), Vec::new());
            for step in drain(&mut s, JOIN) {
                match step {
                    Step::Message(m) => seen.extend(m.header().map(|h| h.seq)),
                    Step::Lost { from, to, .. } => lost.extend(from..to),
                    Step::Refused { .. } => unreachable!(),
                }
            }
            let last = *present.last().unwrap();
            prop_assert_eq!(seen, present.iter().copied().collect::<Vec<_>>());
            prop_assert_eq!(lost, (0..last).filter(|i| !present.contains(i)).collect::<Vec<_>>());
        }
    }

    #[test]
    fn a_seq_far_ahead_shuts_nobody_out() {
        let mut s = Sequencer::new(patience(100), None);
        s.push(Duration::ZERO, odom(0, 0));
        s.push(Duration::ZERO, odom(0, (1 << 46) - 1));
        s.push(Duration::ZERO, odom(0, 1));
        assert_eq!((drain(&mut s, JOIN), s.dropped().absurd), (messages(0, [0, 1]), 1));
    }

    #[test]
    fn what_was_refused_is_not_waited_for() {
        let mut s = Sequencer::new(patience(100), None);
        s.push(Duration::ZERO, odom(3, 0));
        s.push(Duration::ZERO, odom(3, 2));
        s.refuse(Duration::ZERO, (3, 1));
        let refused = Step::Refused { boot: 3, seq: 1 };
        assert_eq!(
            drain(&mut s, Duration::ZERO),
            [messages(3, [0]), vec![refused], messages(3, [2])].concat()
        );
        for forged in [(4, 0), (3, 1), (3, (1 << 53) - 1)] {
            s.refuse(Duration::ZERO, forged);
        }
        s.push(Duration::ZERO, odom(3, 3));
        assert_eq!(drain(&mut s, Duration::ZERO), messages(3, [3]));
    }

    #[test]
    fn a_gap_is_waited_for_but_not_for_ever() {
        let mut s = Sequencer::new(patience(100), None);
        s.push(Duration::ZERO, odom(0, 0));
        s.push(Duration::ZERO, odom(0, 2));
        assert_eq!(drain(&mut s, Duration::from_millis(999)), messages(0, [0]));
        let lost = Step::Lost { boot: 0, from: 1, to: 2 };
        assert_eq!(drain(&mut s, WAIT), [vec![lost], messages(0, [2])].concat());
        // It comes after all: too late.
        s.push(WAIT, odom(0, 1));
        assert_eq!((s.pop(WAIT), s.dropped().repeated), (None, 1));
    }

    #[test]
    fn who_joins_in_the_middle_is_more_patient() {
        let mut s = Sequencer::new(patience(100), Some((0, 7)));
        s.push(Duration::ZERO, odom(0, 9));
        assert_eq!(s.pop(Duration::from_millis(4999)), None);
        s.push(JOIN, odom(0, 8));
        assert_eq!(drain(&mut s, JOIN), messages(0, [8, 9]));
        s.push(JOIN, odom(0, 11));
        assert_eq!(s.pop(JOIN + WAIT), Some(Step::Lost { boot: 0, from: 10, to: 11 }));
    }

    #[test]
    fn a_full_window_ends_the_wait() {
        let mut s = Sequencer::new(patience(3), None);
        for seq in 1..=4 {
            s.push(Duration::ZERO, odom(0, seq));
        }
        assert_eq!(s.pop(Duration::ZERO), Some(Step::Lost { boot: 0, from: 0, to: 1 }));
        assert_eq!(drain(&mut s, Duration::ZERO), messages(0, 1..=4));
    }

    #[test]
    fn a_new_boot_ends_the_old_one() {
        let mut s = Sequencer::new(patience(100), None);
        s.push(Duration::ZERO, odom(5, 0));
        s.push(Duration::ZERO, odom(5, 2));
        s.push(Duration::ZERO, odom(6, 0));
        s.push(Duration::ZERO, odom(5, 3));
        let lost = vec![Step::Lost { boot: 5, from: 1, to: 2 }];
        let want = [messages(5, [0]), lost, messages(5, [2]), messages(6, [0])].concat();
        assert_eq!(drain(&mut s, Duration::ZERO), want);
        assert_eq!(s.dropped().stale, 1);
    }

    #[test]
    fn an_earlier_run_is_gone_on_with() {
        let mut s = Sequencer::new(patience(100), Some((5, 7)));
        for seq in 6..10 {
            s.push(Duration::ZERO, odom(5, seq));
        }
        assert_eq!(drain(&mut s, Duration::ZERO), messages(5, [8, 9]));
        assert_eq!(s.dropped().repeated, 2);
    }
}
