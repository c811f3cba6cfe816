//! Record files: a stream of messages in exactly the order in which a map took them in.
//!
//! Layout: the line [`MAGIC`], then [`frame`]s without salt: number 0 is the [`Origin`] as JSON, the others
//! are the bincode forms ([`Message::to_bincode`]) of the messages that entered the map, with their numbers
//! since it was born. A file that breaks off inside a message lacks just that one.
//!
//! Files of format 1 are read, too: the line [`MAGIC_1`], then per message its length (u32, little-endian) and
//! its bincode form, without checksums.

use crate::codec::Refused;
use crate::frame::{self, HEAD};
use crate::limits::Limits;
use crate::stream::Message;
use serde::{Deserialize, Serialize};
use std::io::{self, BufReader, BufWriter, Read, Write};

/// A record file begins with this line.
pub const MAGIC: &[u8] = b"toponym-record 2\n";
/// Or with this one.
pub const MAGIC_1: &[u8] = b"toponym-record 1\n";

/// Of what a record is.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Origin {
    /// Uuid of the map; empty if it is of no server's map.
    #[serde(default)]
    pub map: String,
    /// Number of its first message, from 1: what came before is not in it.
    pub first: u64,
}

impl Default for Origin {
    fn default() -> Self {
        Self { map: String::new(), first: 1 }
    }
}

/// A record file can't be read or written.
#[derive(Debug, thiserror::Error)]
pub enum RecordError {
    /// The medium failed.
    #[error(transparent)]
    Io(#[from] io::Error),
    /// The first line is another.
    #[error("not a record file: it does not begin with \"toponym-record 2\"")]
    NotARecord,
    /// What stands there is not what was written.
    #[error("damaged at byte {offset}: {why}")]
    Damaged {
        /// Where.
        offset: u64,
        /// What is wrong.
        why: String,
    },
    /// A message in it is broken.
    #[error("message {index} at byte {offset}: {source}")]
    Message {
        /// Its number.
        index: u64,
        /// Where it stands.
        offset: u64,
        /// Why.
        source: Refused,
    },
}

/// Writes a record.
pub struct RecordWriter<W: Write> {
    out: BufWriter<W>,
    next: u64,
}

impl<W: Write> RecordWriter<W> {
    /// Writes what stands before the first message.
    pub fn new(out: W, origin: &Origin) -> Result<Self, RecordError> {
        let mut out = BufWriter::new(out);
        let mut head = MAGIC.to_vec();
        frame::append(&mut head, 0, 0, &serde_json::to_vec(origin).map_err(io::Error::other)?);
        out.write_all(&head)?;
        Ok(Self { out, next: origin.first })
    }

    /// Goes on at the end of a record, whose last message has the number before `next`.
    pub fn at_end(out: W, next: u64) -> Self {
        Self { out: BufWriter::new(out), next }
    }

    /// Number of the next message.
    pub fn next(&self) -> u64 {
        self.next
    }

    /// Adds a message; it may stay in the buffer until [`RecordWriter::flush`].
    pub fn write(&mut self, message: &Message) -> Result<(), RecordError> {
        let (index, offset) = (self.next, 0);
        let payload =
            message.to_bincode().map_err(|source| RecordError::Message { index, offset, source })?;
        let mut bytes = Vec::with_capacity(HEAD + payload.len());
        frame::append(&mut bytes, 0, index, &payload);
        self.out.write_all(&bytes)?;
        self.next += 1;
        Ok(())
    }

    /// Hands everything written so far to the medium below.
    pub fn flush(&mut self) -> Result<(), RecordError> {
        Ok(self.out.flush()?)
    }

    /// The medium below, for instance to make it durable.
    pub fn get_ref(&self) -> &W {
        self.out.get_ref()
    }
}

/// Reads a record: an iterator of its messages, each with the byte where it begins.
pub struct RecordReader<R: Read> {
    input: BufReader<R>,
    /// None: format 1.
    origin: Option<Origin>,
    offset: u64,
    /// Number of the next message.
    index: u64,
    torn: bool,
    failed: bool,
}

impl<R: Read> RecordReader<R> {
    /// Checks what stands before the first message.
    pub fn new(input: R) -> Result<Self, RecordError> {
        let mut input = BufReader::new(input);
        let mut line = [0; MAGIC.len()];
        match input.read_exact(&mut line) {
            Ok(()) if line == MAGIC || line == MAGIC_1 => {}
            Ok(()) => return Err(RecordError::NotARecord),
            Err(e) if e.kind() == io::ErrorKind::UnexpectedEof => return Err(RecordError::NotARecord),
            Err(e) => return Err(e.into()),
        }
        let offset = MAGIC.len() as u64;
        let mut reader = Self { input, origin: None, offset, index: 0, torn: false, failed: false };
        if line == MAGIC {
            let Some((_, json)) = reader.frame()? else { return Err(RecordError::NotARecord) };
            let origin: Origin = serde_json::from_slice(&json)
                .map_err(|e| RecordError::Damaged { offset, why: format!("its origin: {e}") })?;
            (reader.index, reader.origin) = (origin.first, Some(origin));
        }
        Ok(reader)
    }

    /// Of what it is; none if its format does not tell.
    pub fn origin(&self) -> Option<&Origin> {
        self.origin.as_ref()
    }

    /// Number of the next message, and the byte where it begins.
    pub fn at(&self) -> (u64, u64) {
        (self.index, self.offset)
    }

    /// Whether the file broke off inside its last message; known once the iterator has ended.
    pub fn torn(&self) -> bool {
        self.torn
    }

    /// Reads so many bytes; none if there are fewer.
    fn bytes(&mut self, count: usize) -> Result<Option<Vec<u8>>, RecordError> {
        let mut bytes = Vec::new();
        self.input.by_ref().take(count as u64).read_to_end(&mut bytes)?;
        self.torn = !bytes.is_empty() && bytes.len() < count;
        Ok((bytes.len() == count).then_some(bytes))
    }

    /// The next frame; none where the file ends.
    fn frame(&mut self) -> Result<Option<(u64, Vec<u8>)>, RecordError> {
        let offset = self.offset;
        let damaged = |why: &str| RecordError::Damaged { offset, why: why.into() };
        let Some(mut bytes) = self.bytes(HEAD)? else { return Ok(None) };
        let length = frame::u32_at(&bytes, 0).unwrap_or_default() as usize;
        if length > Limits::NONE.payload_bytes {
            return Err(damaged("a length that no message has"));
        }
        let Some(payload) = self.bytes(length)? else {
            self.torn = true;
            return Ok(None);
        };
        bytes.extend(payload);
        match frame::read(&bytes, 0, 0) {
            frame::Found::Frame { index, payload, .. } => {
                self.offset += bytes.len() as u64;
                Ok(Some((index, payload.to_vec())))
            }
            frame::Found::Blank => Err(damaged("nothing stands here")),
            frame::Found::Broken(why) => Err(damaged(why)),
        }
    }

    /// The next message's bytes in a file of format 1.
    fn unframed(&mut self) -> Result<Option<(u64, Vec<u8>)>, RecordError> {
        let offset = self.offset;
        let Some(length) = self.bytes(4)? else { return Ok(None) };
        let length = frame::u32_at(&length, 0).unwrap_or_default() as usize;
        if length > Limits::NONE.payload_bytes {
            return Err(RecordError::Damaged { offset, why: "a length that no message has".into() });
        }
        let payload = self.bytes(length)?;
        self.torn |= payload.is_none();
        self.offset += 4 + length as u64;
        Ok(payload.map(|payload| (self.index, payload)))
    }

    fn read(&mut self) -> Result<Option<(u64, Message)>, RecordError> {
        let (index, offset) = (self.index, self.offset);
        let next = if self.origin.is_some() { self.frame()? } else { self.unframed()? };
        let Some((found, payload)) = next else { return Ok(None) };
        if found != index {
            let why = format!("message {found} where {index} is expected");
            return Err(RecordError::Damaged { offset, why });
        }
        let message = Message::from_bincode(&payload, &Limits::NONE)
            .map_err(|source| RecordError::Message { index, offset, source })?;
        let none_left = || RecordError::Damaged { offset, why: "no number is left for the next".into() };
        self.index = index.checked_add(1).ok_or_else(none_left)?;
        Ok(Some((offset, message)))
    }
}

impl<R: Read> Iterator for RecordReader<R> {
    type Item = Result<(u64, Message), RecordError>;

    fn next(&mut self) -> Option<Self::Item> {
        if self.failed {
            return None;
        }
        let item = self.read().transpose();
        self.failed = !matches!(item, Some(Ok(_)));
        item
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stream::{Header, Say, Scan, Stamp};

    fn says() -> Vec<Message> {
        (0..3)
            .map(|i| {
                Message::Say(Say {
                    id: format!("s{i}"),
                    text: "this is the gym".into(),
                    began: Some(Stamp { ns: i }),
                    ..Default::default()
                })
            })
            .collect()
    }

    fn written(messages: &[Message]) -> Vec<u8> {
        let mut bytes = Vec::new();
        let mut writer = RecordWriter::new(&mut bytes, &Origin::default()).unwrap();
        for message in messages {
            writer.write(message).unwrap();
        }
        writer.flush().unwrap();
        drop(writer);
        bytes
    }

    /// The same in format 1.
    fn written_1(messages: &[Message]) -> Vec<u8> {
        let mut bytes = MAGIC_1.to_vec();
        for message in messages {
            let payload = message.to_bincode().unwrap();
            bytes.extend((payload.len() as u32).to_le_bytes());
            bytes.extend(payload);
        }
        bytes
    }

    fn read(bytes: &[u8]) -> Vec<Message> {
        RecordReader::new(bytes).unwrap().map(|m| m.unwrap().1).collect()
    }

    #[test]
    fn what_was_written_is_read_in_both_formats() {
        for bytes in [written(&says()), written_1(&says())] {
            let mut reader = RecordReader::new(bytes.as_slice()).unwrap();
            assert_eq!(reader.by_ref().map(|m| m.unwrap().1).collect::<Vec<_>>(), says());
            assert!(!reader.torn());
        }
    }

    #[test]
    fn what_raised_limits_let_in_is_read() {
        let scan = Message::Scan(Scan {
            header: Header { robot: "r1".into(), ..Header::default() },
            laser: "front".into(),
            angle_min_rad: 0.0,
            angle_increment_rad: 1e-5,
            time_increment_s: 0.0,
            ranges_m: vec![1.0; 300_000],
        });
        let say = Message::Say(Say { id: "s".into(), text: "a".repeat(2000), ..Say::default() });
        let messages = [scan, say];
        assert_eq!(read(&written(&messages)), messages);
    }

    #[test]
    fn what_goes_on_at_the_end_is_read() {
        let mut bytes = written(&says());
        let mut reader = RecordReader::new(bytes.as_slice()).unwrap();
        reader.by_ref().for_each(drop);
        let next = reader.at().0;
        let mut writer = RecordWriter::at_end(&mut bytes, next);
        writer.write(&says()[0]).unwrap();
        writer.flush().unwrap();
        drop(writer);
        assert_eq!(read(&bytes).len(), 4);
    }

    #[test]
    fn a_damaged_length_is_an_error() {
        for good in [written(&says()), written_1(&says())] {
            let begin = RecordReader::new(good.as_slice()).unwrap().at().1 as usize;
            let mut bytes = good.clone();
            bytes[begin..begin + 4].fill(255);
            let error = RecordReader::new(bytes.as_slice()).unwrap().next().unwrap().unwrap_err();
            assert!(
                matches!(error, RecordError::Damaged { offset, .. } if offset == begin as u64),
                "{error}"
            );
        }
    }

    #[test]
    fn no_turned_bit_is_read_as_another_message() {
        let bytes = written(&says());
        for bit in 8 * MAGIC.len()..8 * bytes.len() {
            let mut turned = bytes.clone();
            turned[bit / 8] ^= 1 << (bit % 8);
            if let Ok(reader) = RecordReader::new(turned.as_slice()) {
                let read: Vec<Message> = reader.map_while(|m| Some(m.ok()?.1)).collect();
                assert!(read.len() < 3 && says().starts_with(&read), "bit {bit}");
            }
        }
    }

    #[test]
    fn a_torn_tail_costs_one_message() {
        for bytes in [written(&says()), written_1(&says())] {
            let begin = RecordReader::new(bytes.as_slice()).unwrap().at().1 as usize;
            let last = (bytes.len() - begin) / 3;
            for cut in 1..last {
                let mut reader = RecordReader::new(&bytes[..bytes.len() - cut]).unwrap();
                assert_eq!(reader.by_ref().map(|m| m.unwrap().1).collect::<Vec<_>>(), says()[..2]);
                assert!(reader.torn(), "cut by {cut}");
            }
        }
    }

    #[test]
    fn a_broken_message_is_located_and_ends_the_reading() {
        let mut bytes = written_1(&says());
        bytes[MAGIC_1.len() + 4] = 99;
        let mut reader = RecordReader::new(bytes.as_slice()).unwrap();
        let error = reader.next().unwrap().unwrap_err().to_string();
        assert!(error.contains("message 0 at byte 17") && error.contains("version 99"), "{error}");
        assert!(reader.next().is_none());
    }

    #[test]
    fn another_file_is_refused() {
        for text in ["", "toponym", "# a carmen log, long enough"] {
            assert!(matches!(RecordReader::new(text.as_bytes()), Err(RecordError::NotARecord)));
        }
    }
}
