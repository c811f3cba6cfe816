//! Where sentences enter a robot's stream: the ordering rule that makes a networked run equal the
//! offline one.
//!
//! > A sentence enters just before the first message of the robot's stream whose stamp is later
//! > than the sentence's `began`; sentences that enter at one place do so in the order of `began`,
//! > then `id`; those that nothing is later than enter at the end, before [`crate::End`].
//!
//! Stamps of a log may repeat or step back; the rule does not mind. Offline, [`Sentences`] is all
//! that is needed; online, [`HoldBack`] keeps the stream back for a while, so that a sentence that
//! arrives over another connection still finds its place.

use crate::codec::Refused;
use crate::limits::Limits;
use crate::stream::{Message, Say, Stamp};
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, VecDeque};
use std::time::Duration;

/// Stamp by which the rule places sentences round a message; the end of a stream comes after all.
pub fn order_stamp(message: &Message) -> Stamp {
    match message {
        Message::End(_) => Stamp { ns: i64::MAX },
        Message::Say(say) => say.began.unwrap_or_default(),
        // Enters when it comes.
        Message::Mend(_) => Stamp::default(),
        Message::Setup(m) => m.header.stamp,
        Message::Odom(m) => m.header.stamp,
        Message::Scan(m) => m.header.stamp,
    }
}

/// Sentences that have not entered the stream yet, in the order of the rule.
#[derive(Debug, Default)]
pub struct Sentences {
    waiting: BTreeMap<(Stamp, String), Say>,
}

impl Sentences {
    /// Adds one; without `began` it counts as said at `now`.
    pub fn push(&mut self, mut say: Say, now: Stamp) {
        let began = *say.began.get_or_insert(now);
        self.waiting.insert((began, say.id.clone()), say);
    }

    /// Takes the next that enters before a message with this stamp ([`order_stamp`]); call it
    /// until there is none, then let the message enter.
    pub fn pop_before(&mut self, stamp: Stamp) -> Option<Say> {
        let first = self.waiting.first_entry()?;
        (first.key().0 < stamp).then(|| first.remove())
    }

    /// Takes the next at the end of the stream.
    pub fn pop(&mut self) -> Option<Say> {
        self.waiting.pop_first().map(|(_, say)| say)
    }

    /// How many wait.
    pub fn len(&self) -> usize {
        self.waiting.len()
    }

    /// Whether none waits.
    pub fn is_empty(&self) -> bool {
        self.waiting.is_empty()
    }
}

/// A time of a robot's stream: boot, and stamp on the clock of that boot. Each boot is later than
/// the one before, whatever its clock says.
type At = (u64, Stamp);

/// All that a [`HoldBack`] holds; messages in their bincode form, with when they arrived.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Held {
    hold: Duration,
    stream: Vec<(Duration, Vec<u8>)>,
    /// Each with the robot's boot.
    sentences: Vec<(Duration, u64, Vec<u8>)>,
    newest: Option<(u64, i64)>,
    passed: Option<(u64, i64)>,
}

/// Keeps a robot's stream back by a fixed time after arrival and lets sentences in where the rule
/// wants them. A sentence whose place has passed enters at once.
///
/// Time is passed in: seconds on any clock that never steps back.
#[derive(Clone, Debug)]
pub struct HoldBack {
    /// How long a message waits for sentences.
    hold: Duration,
    /// The stream, each message with its time of arrival.
    held: VecDeque<(Duration, Message)>,
    /// Sentences in the order of the rule, each with its time of arrival.
    waiting: BTreeMap<(At, String), (Duration, Say)>,
    /// Newest that arrived.
    newest: Option<At>,
    /// Newest that went out.
    passed: Option<At>,
}

impl HoldBack {
    /// Holds that a sentence ahead of its stream waits for the stream to catch up.
    pub const PATIENCE: u32 = 10;
    /// Sentences that wait; when there are more, the one that came first enters.
    pub const SENTENCES_MAX: usize = 1000;

    /// With nothing in it. `newest`: boot and newest stamp of a stream that goes on, if it does.
    pub fn new(hold: Duration, newest: Option<(u64, Stamp)>) -> Self {
        Self { hold, held: VecDeque::new(), waiting: BTreeMap::new(), newest, passed: newest }
    }

    /// Takes in the stream's next message, in the order of `boot`, then `seq`.
    pub fn push(&mut self, now: Duration, message: Message) {
        if let Some(header) = message.header() {
            self.newest = self.newest.max(Some((header.boot, header.stamp)));
        }
        self.held.push_back((now, message));
    }

    /// Takes in a sentence, said on the clock of this boot of the robot.
    pub fn push_say(&mut self, now: Duration, boot: u64, mut say: Say) {
        let newest = self.newest.filter(|newest| newest.0 == boot).unwrap_or_default();
        let began = *say.began.get_or_insert(newest.1);
        self.waiting.insert(((boot, began), say.id.clone()), (now, say));
    }

    /// How many messages of the stream are held.
    pub fn len(&self) -> usize {
        self.held.len()
    }

    /// How many sentences wait.
    pub fn sentences(&self) -> usize {
        self.waiting.len()
    }

    /// Whether nothing is held.
    pub fn is_empty(&self) -> bool {
        self.held.is_empty() && self.waiting.is_empty()
    }

    /// How long messages are held.
    pub fn hold(&self) -> Duration {
        self.hold
    }

    /// How long messages are held, from now on.
    pub fn set_hold(&mut self, hold: Duration) {
        self.hold = hold;
    }

    /// All that is held, to be written down.
    ///
    /// # Errors
    /// If a message can't be encoded.
    pub fn held(&self) -> Result<Held, Refused> {
        let at = |at: Option<At>| at.map(|(boot, stamp)| (boot, stamp.ns));
        Ok(Held {
            hold: self.hold,
            stream: self
                .held
                .iter()
                .map(|(t, m)| Ok((*t, m.to_bincode()?)))
                .collect::<Result<_, Refused>>()?,
            sentences: self
                .waiting
                .iter()
                .map(|(((boot, _), _), (t, say))| Ok((*t, *boot, Message::Say(say.clone()).to_bincode()?)))
                .collect::<Result<_, Refused>>()?,
            newest: at(self.newest),
            passed: at(self.passed),
        })
    }

    /// What [`HoldBack::held`] told.
    ///
    /// # Errors
    /// If a message can't be read.
    pub fn of(held: &Held) -> Result<Self, Refused> {
        let at = |at: Option<(u64, i64)>| at.map(|(boot, ns)| (boot, Stamp { ns }));
        let read = |bytes: &[u8]| Message::from_bincode(bytes, &Limits::NONE);
        let mut back = Self::new(held.hold, at(held.newest));
        back.passed = at(held.passed);
        for (arrived, bytes) in &held.stream {
            back.held.push_back((*arrived, read(bytes)?));
        }
        for (arrived, boot, bytes) in &held.sentences {
            if let Message::Say(say) = read(bytes)? {
                let began = say.began.unwrap_or_default();
                back.waiting.insert(((*boot, began), say.id.clone()), (*arrived, say));
            }
        }
        Ok(back)
    }

    /// Takes the next message that is due at `now`; [`Duration::MAX`] takes all.
    pub fn pop(&mut self, now: Duration) -> Option<Message> {
        // A sentence whose place has passed gains nothing by waiting.
        let passed = self.passed.and_then(|passed| self.pop_before(passed));
        if let Some(say) = passed.or_else(|| self.pop_overdue(now)) {
            return Some(Message::Say(say));
        }
        let (arrived, message) = self.held.front()?;
        if now.saturating_sub(*arrived) < self.hold {
            return None;
        }
        let at = (message.header().map_or(0, |h| h.boot), order_stamp(message));
        if let Some(say) = self.pop_before(at) {
            return Some(Message::Say(say));
        }
        let (_, message) = self.held.pop_front()?;
        // The end of a stream is no time: what is said later still waits for the stream to go on.
        if !matches!(message, Message::End(_)) {
            self.passed = self.passed.max(Some(at));
        }
        Some(message)
    }

    /// Takes the next sentence that enters before a message with this time.
    fn pop_before(&mut self, at: At) -> Option<Say> {
        let first = self.waiting.first_entry()?;
        (first.key().0 < at).then(|| first.remove().1)
    }

    /// Takes a sentence that has waited too long for something later, or is one too many.
    fn pop_overdue(&mut self, now: Duration) -> Option<Say> {
        if self.waiting.len() > Self::SENTENCES_MAX {
            let (key, _) = self.waiting.iter().min_by_key(|(_, (arrived, _))| *arrived)?;
            let key = key.clone();
            return self.waiting.remove(&key).map(|(_, say)| say);
        }
        let next = self.held.front().map(|(arrived, _)| *arrived);
        // Those before the newest have their place in what is held, however long that takes.
        let from = next.and(self.newest).unwrap_or((0, Stamp { ns: i64::MIN }));
        let mut ahead = self.waiting.range((from, String::new())..);
        let (key, _) = ahead.find(|((at, _), (arrived, _))| {
            // Only one that is ahead of its stream need wait for more than what is on its way.
            let holds = if Some(*at) > self.newest || next.is_some() { Self::PATIENCE } else { 1 };
            let due = arrived.saturating_add(self.hold.saturating_mul(holds));
            // What came while it waited still goes first.
            due <= now && next.is_none_or(|next| due <= next)
        })?;
        let key = key.clone();
        self.waiting.remove(&key).map(|(_, say)| say)
    }
}

#[cfg(test)]
mod tests;
