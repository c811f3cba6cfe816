//! A server's `--record` file as a log: the messages in the order in which the map took them in.

use super::{LogError, LogRecord, Notes, Records};
use std::io::Cursor;
use toponym_proto::record::{RecordError, RecordReader};
use toponym_proto::{Message, Stamp};

/// Reader of record files.
pub struct RecordedLog {
    reader: RecordReader<Cursor<Vec<u8>>>,
    read: usize,
    at: u64,
    bytes: u64,
    ended: bool,
    notes: Notes,
}

impl RecordedLog {
    /// Checks that there is something to map and stands before the first message.
    ///
    /// # Errors
    /// If it is no record file or has no scan.
    pub fn new(bytes: Vec<u8>, notes: Notes) -> Result<Self, LogError> {
        let refused = |e: RecordError| LogError::NotALog { file: notes.file.clone(), why: e.to_string() };
        let mut looked_at = 0;
        let looked = RecordReader::new(bytes.as_slice()).map_err(refused)?;
        let mut detail = String::new();
        let usable = looked.inspect(|_| looked_at += 1).any(|m| match m {
            Ok((_, message)) => matches!(message, Message::Scan(_)),
            Err(e) => {
                detail = format!("; {e}");
                false
            }
        });
        if !usable {
            return Err(LogError::NoScan { file: notes.file, lines: looked_at, detail });
        }
        let size = bytes.len() as u64;
        let reader = RecordReader::new(Cursor::new(bytes)).map_err(refused)?;
        Ok(Self { reader, read: 0, at: 0, bytes: size, ended: false, notes })
    }
}

impl Iterator for RecordedLog {
    type Item = LogRecord;

    fn next(&mut self) -> Option<LogRecord> {
        if self.ended {
            return None;
        }
        match self.reader.next() {
            Some(Ok((offset, message))) => {
                self.read += 1;
                self.at = offset;
                self.notes.count(&message);
                let stamp = match &message {
                    Message::Say(say) => say.began.unwrap_or_default(),
                    other => other.header().map(|h| h.stamp).unwrap_or_default(),
                };
                let odom_row = matches!(message, Message::Odom(_));
                Some(LogRecord { message, line: self.read, odom_row, stamp_text: seconds_text(stamp) })
            }
            Some(Err(e)) => {
                self.ended = true;
                self.notes.remark(format!("read up to a broken message: {e}"));
                None
            }
            None => {
                self.ended = true;
                self.at = self.bytes;
                if self.reader.torn() {
                    self.notes.remark("breaks off inside its last message");
                }
                None
            }
        }
    }
}

impl Records for RecordedLog {
    fn notes(&self) -> &Notes {
        &self.notes
    }

    fn progress(&self) -> (u64, u64) {
        (self.at, self.bytes)
    }
}

/// Seconds, exactly: six decimals, nine where they are needed.
pub fn seconds_text(stamp: Stamp) -> String {
    let (sign, ns) = (if stamp.ns < 0 { "-" } else { "" }, stamp.ns.unsigned_abs());
    let (s, ns) = (ns / 1_000_000_000, ns % 1_000_000_000);
    if ns.is_multiple_of(1000) { format!("{sign}{s}.{:06}", ns / 1000) } else { format!("{sign}{s}.{ns:09}") }
}

#[cfg(test)]
mod tests {
    use super::super::{CarmenLog, Narration, Options, merged};
    use super::*;
    use toponym_proto::record::{Origin, RecordWriter};

    fn carmen(text: &str) -> Box<dyn Records> {
        Box::new(CarmenLog::new(text.into(), &Options::default(), Notes::default()).unwrap())
    }

    fn recorded(log: Box<dyn Records>) -> Vec<u8> {
        let mut bytes = Vec::new();
        let mut writer = RecordWriter::new(&mut bytes, &Origin::default()).unwrap();
        log.for_each(|r| writer.write(&r.message).unwrap());
        writer.flush().unwrap();
        drop(writer);
        bytes
    }

    const SCANS: &str = "FLASER 1 1 0 0 0 0 0 0 10.25 h 1\nFLASER 1 1 0 0 0 1 0 0 11.000001 h 1\n";

    #[test]
    fn a_recorded_log_reads_as_the_log() {
        let narration = Narration::parse(r#"{"t": 10.5, "text": "this is the gym"}"#).unwrap();
        let bytes = recorded(merged(carmen(SCANS), &narration));
        let mut log = RecordedLog::new(bytes, Notes::default()).unwrap();
        let again: Vec<LogRecord> = log.by_ref().collect();
        let first: Vec<LogRecord> = merged(carmen(SCANS), &narration).collect();
        for (a, b) in again.iter().zip(&first) {
            assert_eq!((&a.message, a.odom_row), (&b.message, b.odom_row));
        }
        assert_eq!(again.len(), first.len());
        assert_eq!(again[1].stamp_text, "10.250000");
        assert_eq!((log.notes().scans, log.notes().sentences), (2, 1));
    }

    #[test]
    fn a_torn_record_is_read_up_to_there_with_a_remark() {
        let mut bytes = recorded(carmen(SCANS));
        bytes.truncate(bytes.len() - 3);
        let mut log = RecordedLog::new(bytes, Notes::default()).unwrap();
        assert_eq!(log.by_ref().count(), 4);
        assert!(log.notes().warnings()[0].contains("breaks off"));
    }

    #[test]
    fn a_record_without_scans_is_an_error() {
        let mut bytes = Vec::new();
        RecordWriter::new(&mut bytes, &Origin::default()).unwrap().flush().unwrap();
        let error = RecordedLog::new(bytes, Notes::default()).err().unwrap();
        assert!(matches!(error, LogError::NoScan { lines: 0, .. }), "{error}");
    }

    #[test]
    fn stamps_are_written_exactly() {
        for (ns, text) in
            [(1_500_000_000, "1.500000"), (-1, "-0.000000001"), (976_052_857_337_546_000, "976052857.337546")]
        {
            assert_eq!(seconds_text(Stamp { ns }), text);
        }
    }
}
