//! Record files: a stream of messages in exactly the order in which a map took them in.
//!
//! Layout: the line [`MAGIC`], then per message its length as a little-endian u32 and its bincode
//! form ([`Message::to_bincode`]). A file that breaks off inside a message lacks just that one.

use crate::codec::Refused;
use crate::stream::Message;
use crate::validate::Limits;
use std::io::{self, BufReader, BufWriter, Read, Write};

/// A record file begins with this line.
pub const MAGIC: &[u8] = b"toponym-record 1\n";

/// What is in a record was validated on its way in, maybe against a server's raised limits: only a
/// damaged length is to be told from a large message.
const LIMITS: Limits = Limits {
    payload_bytes: 64 << 20,
    beams: usize::MAX,
    lasers: usize::MAX,
    ignored_sectors: usize::MAX,
    text_chars: usize::MAX,
    alternatives: usize::MAX,
};

/// A record file can't be read or written.
#[derive(Debug, thiserror::Error)]
pub enum RecordError {
    /// The medium failed.
    #[error(transparent)]
    Io(#[from] io::Error),
    /// The first line is another.
    #[error("not a record file: it does not begin with \"toponym-record 1\"")]
    NotARecord,
    /// A message in it is broken.
    #[error("message {index} at byte {offset}: {source}")]
    Message {
        /// Its number in the file, from 0.
        index: u64,
        /// Where its length stands.
        offset: u64,
        /// Why.
        source: Refused,
    },
}

/// Writes a record.
pub struct RecordWriter<W: Write> {
    out: BufWriter<W>,
}

impl<W: Write> RecordWriter<W> {
    /// Writes the first line.
    pub fn new(out: W) -> Result<Self, RecordError> {
        let mut out = BufWriter::new(out);
        out.write_all(MAGIC)?;
        Ok(Self { out })
    }

    /// Adds a message; it may stay in the buffer until [`RecordWriter::flush`].
    pub fn write(&mut self, message: &Message) -> Result<(), RecordError> {
        let bytes =
            message.to_bincode().map_err(|source| RecordError::Message { index: 0, offset: 0, source })?;
        let length = u32::try_from(bytes.len()).map_err(io::Error::other)?;
        self.out.write_all(&length.to_le_bytes())?;
        self.out.write_all(&bytes)?;
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
    offset: u64,
    index: u64,
    torn: bool,
    failed: bool,
}

impl<R: Read> RecordReader<R> {
    /// Checks the first line.
    pub fn new(input: R) -> Result<Self, RecordError> {
        let mut input = BufReader::new(input);
        let mut line = [0; MAGIC.len()];
        match input.read_exact(&mut line) {
            Ok(()) if line == MAGIC => {}
            Ok(()) => return Err(RecordError::NotARecord),
            Err(e) if e.kind() == io::ErrorKind::UnexpectedEof => return Err(RecordError::NotARecord),
            Err(e) => return Err(e.into()),
        }
        let offset = MAGIC.len() as u64;
        Ok(Self { input, offset, index: 0, torn: false, failed: false })
    }

    /// Whether the file broke off inside its last message; known once the iterator has ended.
    pub fn torn(&self) -> bool {
        self.torn
    }

    /// Reads as much as there is, up to the buffer's length.
    fn fill(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let mut filled = 0;
        while let Some(rest @ [_, ..]) = buffer.get_mut(filled..) {
            match self.input.read(rest) {
                Ok(0) => break,
                Ok(n) => filled += n,
                Err(e) if e.kind() == io::ErrorKind::Interrupted => {}
                Err(e) => return Err(e),
            }
        }
        Ok(filled)
    }

    fn read(&mut self) -> Result<Option<(u64, Message)>, RecordError> {
        let (index, offset) = (self.index, self.offset);
        let broken = |source| RecordError::Message { index, offset, source };
        let mut length = [0; 4];
        let filled = self.fill(&mut length)?;
        if filled < length.len() {
            self.torn = filled > 0;
            return Ok(None);
        }
        let length = u32::from_le_bytes(length) as usize;
        if length > LIMITS.payload_bytes {
            return Err(broken(Refused::TooLarge { bytes: length, max: LIMITS.payload_bytes }));
        }
        let mut bytes = vec![0; length];
        if self.fill(&mut bytes)? < length {
            self.torn = true;
            return Ok(None);
        }
        let message = Message::from_bincode(&bytes, &LIMITS).map_err(broken)?;
        self.index += 1;
        self.offset += 4 + length as u64;
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

    fn written() -> Vec<u8> {
        let mut bytes = Vec::new();
        let mut writer = RecordWriter::new(&mut bytes).unwrap();
        for m in &says() {
            writer.write(m).unwrap();
        }
        writer.flush().unwrap();
        drop(writer);
        bytes
    }

    #[test]
    fn what_was_written_is_read() {
        let bytes = written();
        let mut reader = RecordReader::new(bytes.as_slice()).unwrap();
        let read: Vec<_> = reader.by_ref().map(|m| m.unwrap().1).collect();
        assert_eq!(read, says());
        assert!(!reader.torn());
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
        let mut bytes = Vec::new();
        let mut writer = RecordWriter::new(&mut bytes).unwrap();
        for message in &messages {
            writer.write(message).unwrap();
        }
        writer.flush().unwrap();
        drop(writer);
        let read: Vec<_> = RecordReader::new(bytes.as_slice()).unwrap().map(|m| m.unwrap().1).collect();
        assert_eq!(read, messages);
    }

    #[test]
    fn a_damaged_length_is_an_error() {
        let mut bytes = MAGIC.to_vec();
        bytes.extend(u32::MAX.to_le_bytes());
        let error = RecordReader::new(bytes.as_slice()).unwrap().next().unwrap().unwrap_err();
        assert!(matches!(error, RecordError::Message { source: Refused::TooLarge { .. }, .. }), "{error}");
    }

    #[test]
    fn a_torn_tail_costs_one_message() {
        let bytes = written();
        let last = (bytes.len() - MAGIC.len()) / 3;
        for cut in 1..last {
            let mut reader = RecordReader::new(&bytes[..bytes.len() - cut]).unwrap();
            assert_eq!(reader.by_ref().map(|m| m.unwrap().1).collect::<Vec<_>>(), says()[..2]);
            assert!(reader.torn(), "cut by {cut}");
        }
    }

    #[test]
    fn a_broken_message_is_located_and_ends_the_reading() {
        let mut bytes = written();
        bytes[MAGIC.len() + 4] = 99;
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
