//! What a map takes in, entry by entry: all that its state depends on.

use toponym_proto::{Limits, Message, Refused, Say};

/// One entry.
#[derive(Clone, Debug, PartialEq)]
pub struct Entry {
    /// When it arrived, ns on the map's own clock: it goes on where an earlier run left it, and never
    /// steps back.
    pub at_ns: u64,
    /// What arrived.
    pub event: Event,
}

/// What arrived.
#[derive(Clone, Debug, PartialEq)]
pub enum Event {
    /// The next message of the robot's stream, in the order of (boot, seq); or an operator's
    /// [`toponym_proto::Mend`].
    Message(Message),
    /// A sentence, said on the clock of this boot of the robot.
    Say {
        /// The robot's boot.
        boot: u64,
        /// What was said; `began` is filled in.
        say: Say,
    },
    /// The robot's messages before this seq that did not come are given up, or could not be used.
    Gap {
        /// The robot's boot.
        boot: u64,
        /// First seq that may come again.
        to: u64,
    },
    /// Nothing: time has passed.
    Tick,
    /// From now on the stream waits so long for sentences, ns.
    Hold(u64),
    /// From now on the site's own words are these lines.
    Glossary(String),
}

/// These bytes are no entry.
#[derive(Debug, thiserror::Error)]
pub enum EntryError {
    /// Of no kind that this build knows.
    #[error("an entry of unknown kind {0}")]
    Kind(u8),
    /// Too short.
    #[error("an entry of {0} bytes")]
    Short(usize),
    /// Too long.
    #[error("{0} bytes too many")]
    Long(usize),
    /// Words that are no UTF-8.
    #[error("words that are no UTF-8")]
    Text,
    /// The message in it can't be read.
    #[error(transparent)]
    Message(#[from] Refused),
}

impl Entry {
    /// (boot, seq) up to which nothing more of the robot's stream is waited for after it; none if it says nothing of that.
    pub fn watermark(&self) -> Option<(u64, u64)> {
        match &self.event {
            Event::Message(message) => message.header().map(|h| (h.boot, h.seq)),
            Event::Gap { boot, to } => to.checked_sub(1).map(|seq| (*boot, seq)),
            Event::Say { .. } | Event::Tick | Event::Hold(_) | Event::Glossary(_) => None,
        }
    }

    /// `at u64 │ kind u8 │ …`: 1 message (bincode form), 2 sentence (`boot u64`, bincode form), 3 gap
    /// (`boot u64`, `to u64`), 4 tick, 5 hold (`ns u64`), 6 glossary (`length u32`, UTF-8).
    /// Little-endian.
    pub fn to_bytes(&self) -> Result<Vec<u8>, Refused> {
        let mut bytes = self.at_ns.to_le_bytes().to_vec();
        match &self.event {
            Event::Message(message) => {
                bytes.push(1);
                bytes.extend(message.to_bincode()?);
            }
            Event::Say { boot, say } => {
                bytes.push(2);
                bytes.extend(boot.to_le_bytes());
                bytes.extend(Message::Say(say.clone()).to_bincode()?);
            }
            Event::Gap { boot, to } => {
                bytes.push(3);
                bytes.extend(boot.to_le_bytes());
                bytes.extend(to.to_le_bytes());
            }
            Event::Tick => bytes.push(4),
            Event::Hold(ns) => {
                bytes.push(5);
                bytes.extend(ns.to_le_bytes());
            }
            Event::Glossary(lines) => {
                bytes.push(6);
                bytes.extend((lines.len() as u32).to_le_bytes());
                bytes.extend(lines.as_bytes());
            }
        }
        Ok(bytes)
    }

    /// What [`Entry::to_bytes`] wrote.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, EntryError> {
        let short = || EntryError::Short(bytes.len());
        let u64_at = |at| toponym_proto::frame::u64_at(bytes, at).ok_or_else(short);
        let body = |at| bytes.get(at..).ok_or_else(short);
        // What a message does not read of its own is told by its form.
        let ends =
            |at: usize| if bytes.len() > at { Err(EntryError::Long(bytes.len() - at)) } else { Ok(()) };
        let event = match bytes.get(8).ok_or_else(short)? {
            1 => Event::Message(Message::from_bincode(body(9)?, &Limits::NONE)?),
            2 => match Message::from_bincode(body(17)?, &Limits::NONE)? {
                Message::Say(say) => Event::Say { boot: u64_at(9)?, say },
                _ => return Err(EntryError::Kind(2)),
            },
            3 => ends(25).and(Ok(Event::Gap { boot: u64_at(9)?, to: u64_at(17)? }))?,
            4 => ends(9).and(Ok(Event::Tick))?,
            5 => ends(17).and(Ok(Event::Hold(u64_at(9)?)))?,
            6 => {
                let length = toponym_proto::frame::u32_at(bytes, 9).ok_or_else(short)? as usize;
                let lines = bytes.get(13..13 + length).ok_or_else(short)?;
                ends(13 + length)?;
                Event::Glossary(String::from_utf8(lines.to_vec()).map_err(|_| EntryError::Text)?)
            }
            kind => return Err(EntryError::Kind(*kind)),
        };
        Ok(Self { at_ns: u64_at(0)?, event })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use toponym_proto::{Header, Mend, Odom, Pose};

    #[test]
    fn every_kind_is_read_as_it_was_written() {
        let header = Header { robot: "r1".into(), boot: 3, seq: 9, ..Header::default() };
        let say = Say { id: "s".into(), text: "this is the gym".into(), ..Say::default() };
        let events = [
            Event::Message(Message::Odom(Odom { header, odom_from_body: Pose::default() })),
            Event::Message(Message::Mend(Mend::Undo { id: None })),
            Event::Say { boot: 3, say },
            Event::Gap { boot: 3, to: 12 },
            Event::Tick,
            Event::Hold(500),
            Event::Glossary("mensa = canteen\n".into()),
        ];
        for (at_ns, event) in (5..).zip(events) {
            let entry = Entry { at_ns, event };
            let bytes = entry.to_bytes().unwrap();
            assert_eq!(Entry::from_bytes(&bytes).unwrap(), entry);
            for cut in 0..bytes.len() {
                assert!(Entry::from_bytes(&bytes[..cut]).is_err(), "{entry:?} cut to {cut}");
            }
        }
    }
}
