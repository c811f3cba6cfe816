//! A map as a fold of its journal: entries in, one [`Mapper::step`] per message of the merged stream.
//!
//! All that a map's state depends on is in its entries, the time included, so that a journal makes the
//! same map wherever and whenever it is read. Pure: no clock, no files, no network.

use serde::{Deserialize, Serialize};
use std::collections::VecDeque;
use std::time::Duration;
use toponym_core::{Effect, Mapper};
use toponym_journal::{Entry, Event};
use toponym_proto::answer::{ErrorCode, Heard, HeardStatus, Problem};
use toponym_proto::limits::KNOWN_SENTENCES_MAX;
use toponym_proto::merge::{Held, HoldBack};
use toponym_proto::{Message, Say, Stamp};

use crate::convert;

const FORMAT: bincode::config::Configuration = bincode::config::standard();

/// What is known of a map beside the map.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Card {
    /// Born once with the map.
    pub uuid: String,
    /// The robot that maps it.
    pub robot: String,
    /// (boot, seq) of the last of its messages that was taken in, or given up.
    pub watermark: Option<(u64, u64)>,
    /// Newest stamp in the map, ns.
    pub stamp_ns: i64,
}

/// A sentence that was said, and what became of it.
#[derive(Clone, Debug, Serialize, Deserialize)]
struct Known {
    id: String,
    text: String,
    /// Of `heard`, as JSON; none as long as it waits.
    heard: Option<String>,
}

/// A map, what waits to enter it, and what it was told.
#[derive(Clone, Debug)]
pub struct Fold {
    /// The map.
    pub mapper: Mapper,
    /// What is known of it beside.
    pub card: Card,
    hold: HoldBack,
    known: VecDeque<Known>,
    /// Time of the newest entry.
    now: Duration,
    /// Messages that entered the map since it was born.
    steps: u64,
}

/// What comes of an entry.
pub enum Outcome<'a> {
    /// A message enters the map: before the step.
    Enters(&'a Message),
    /// What the step did.
    Effect(Effect),
    /// A sentence was dealt with.
    Heard(Box<Heard>),
}

/// A saved fold can't be read or written.
#[derive(Debug, thiserror::Error)]
pub enum FoldError {
    /// The map in it.
    #[error(transparent)]
    Map(#[from] toponym_core::mapper::SaveError),
    /// What is held.
    #[error("what waits to enter the map: {0}")]
    Held(#[from] toponym_proto::Refused),
    /// All else.
    #[error("what is known beside the map: {0}")]
    Encode(#[from] bincode::error::EncodeError),
    /// All else.
    #[error("what is known beside the map: {0}")]
    Decode(#[from] bincode::error::DecodeError),
    /// Shorter than it says.
    #[error("it breaks off")]
    Short,
}

/// What is saved in front of the map.
#[derive(Serialize, Deserialize)]
struct Beside {
    card: Card,
    held: Held,
    known: VecDeque<Known>,
    now: Duration,
    steps: u64,
}

impl Fold {
    /// A map that has taken in nothing yet. `hold`: how long the stream waits for sentences.
    pub fn new(mapper: Mapper, card: Card, hold: Duration) -> Self {
        let newest = card.watermark.map(|(boot, _)| (boot, Stamp { ns: card.stamp_ns }));
        let hold = HoldBack::new(hold, newest);
        Self { mapper, card, hold, known: VecDeque::new(), now: Duration::ZERO, steps: 0 }
    }

    /// Takes an entry in; tells what comes of it, in order.
    pub fn take(&mut self, entry: Entry, tell: &mut dyn FnMut(Outcome<'_>)) {
        self.now = self.now.max(Duration::from_nanos(entry.at_ns));
        self.card.watermark = self.card.watermark.max(entry.watermark());
        match entry.event {
            // An operator's command enters when it comes.
            Event::Message(mend @ Message::Mend(_)) => self.step(mend, tell),
            Event::Message(message) => self.hold.push(self.now, message),
            Event::Say { boot, say } => self.hear(boot, say, tell),
            Event::Gap { .. } | Event::Tick => {}
            Event::Hold(ns) => self.hold.set_hold(Duration::from_nanos(ns)),
            Event::Glossary(lines) => drop(self.mapper.step(toponym_core::Event::Glossary(lines))),
        }
        while let Some(message) = self.hold.pop(self.now) {
            self.step(message, tell);
        }
    }

    /// Time of the newest entry.
    pub fn now(&self) -> Duration {
        self.now
    }

    /// How long the stream waits for sentences.
    pub fn hold(&self) -> Duration {
        self.hold.hold()
    }

    /// By this time of its entries all of the stream that has arrived by now has entered the map.
    pub fn settles_at(&self) -> Duration {
        self.now + self.hold.hold()
    }

    /// Messages and sentences that wait to enter the map.
    pub fn held(&self) -> usize {
        self.hold.len() + self.hold.sentences()
    }

    /// Messages that entered the map since it was born.
    pub fn steps(&self) -> u64 {
        self.steps
    }

    /// A sentence that came before is answered as before; its id means no other.
    fn hear(&mut self, boot: u64, say: Say, tell: &mut dyn FnMut(Outcome<'_>)) {
        match self.known.iter().rev().find(|known| known.id == say.id) {
            Some(known) if known.text != say.text => {
                let problem = Problem::new(ErrorCode::BadArgument, "another sentence has this id")
                    .field("id")
                    .hint("give each sentence an id of its own, such as a ULID");
                tell(Outcome::Heard(Box::new(refused(&say.id, problem))));
            }
            Some(Known { heard: Some(heard), .. }) => {
                if let Ok(heard) = serde_json::from_str(heard) {
                    tell(Outcome::Heard(heard));
                }
            }
            Some(_) => tell(Outcome::Heard(Box::new(read(&say.id)))),
            None => {
                tell(Outcome::Heard(Box::new(read(&say.id))));
                if self.known.len() >= KNOWN_SENTENCES_MAX {
                    self.known.pop_front();
                }
                let (id, text) = (say.id.clone(), say.text.clone());
                self.known.push_back(Known { id, text, heard: None });
                self.hold.push_say(self.now, boot, say);
            }
        }
    }

    fn step(&mut self, message: Message, tell: &mut dyn FnMut(Outcome<'_>)) {
        if let Some(header) = message.header() {
            self.card.stamp_ns = header.stamp.ns;
        }
        self.steps += 1;
        tell(Outcome::Enters(&message));
        for effect in self.mapper.step(convert::event(message)) {
            match effect {
                Effect::Heard(heard) => {
                    let heard = convert::heard(heard);
                    if let Some(known) = self.known.iter_mut().rev().find(|known| known.id == heard.id) {
                        known.heard = serde_json::to_string(&heard).ok();
                    }
                    tell(Outcome::Heard(Box::new(heard)));
                }
                effect => tell(Outcome::Effect(effect)),
            }
        }
    }

    /// As bytes: length of what is beside the map (u64, little-endian), that in bincode, the map.
    pub fn save(&self) -> Result<Vec<u8>, FoldError> {
        let beside = Beside {
            card: self.card.clone(),
            held: self.hold.held()?,
            known: self.known.clone(),
            now: self.now,
            steps: self.steps,
        };
        let beside = bincode::serde::encode_to_vec(&beside, FORMAT)?;
        let mut bytes = (beside.len() as u64).to_le_bytes().to_vec();
        bytes.extend(beside);
        self.mapper.save_to(&mut bytes)?;
        Ok(bytes)
    }

    /// What [`Fold::save`] wrote.
    pub fn load(bytes: &[u8]) -> Result<Self, FoldError> {
        let (beside, map) = split(bytes).ok_or(FoldError::Short)?;
        let (Beside { card, held, known, now, steps }, _) =
            bincode::serde::decode_from_slice(beside, FORMAT)?;
        Ok(Self { mapper: Mapper::load(map)?, card, hold: HoldBack::of(&held)?, known, now, steps })
    }
}

/// The map in a saved fold, as [`Mapper::save`] wrote it.
pub fn saved_map(bytes: &[u8]) -> Option<&[u8]> {
    Some(split(bytes)?.1)
}

fn split(bytes: &[u8]) -> Option<(&[u8], &[u8])> {
    let (length, rest) = bytes.split_at_checked(8)?;
    rest.split_at_checked(u64::from_le_bytes(length.try_into().ok()?).try_into().ok()?)
}

/// Feedback on a sentence that can't be used.
pub fn refused(id: &str, problem: Problem) -> Heard {
    let words = format!("I can't use that: {}.", problem.message);
    Heard { error: Some(problem), words, ..Heard::new(id, HeardStatus::Refused) }
}

/// Feedback on a sentence that is on disk, and was not put anywhere yet.
fn read(id: &str) -> Heard {
    Heard { durable: true, ..Heard::new(id, HeardStatus::Read) }
}

#[cfg(test)]
mod tests;
