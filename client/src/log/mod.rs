//! Recorded logs as streams of messages: CARMEN text (`.clf`, `.log`), tables of numbers, and the server's
//! `--record` files, all of them gzipped or not. What a file is, its content says, not its name.
//!
//! [`open`] is the seam: a new format is one more implementation of [`Records`] and one more arm
//! there, or, with libraries that a robot does not need, a crate of its own in front of it (`toponym-ros` for
//! bags). [`merged`] adds a guide's narration.

pub mod carmen;
mod carmen_log;
mod csv;
mod narration;
mod recorded;

pub use carmen_log::CarmenLog;
pub use csv::CsvLog;
pub use narration::{Narration, NarrationError, Sentence, merged};
pub use recorded::{RecordedLog, seconds_text};

use flate2::read::MultiGzDecoder;
use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::io::Read;
use std::path::{Path, PathBuf};
use thiserror::Error;
use toponym_proto::{Limits, Message, record};

/// A message of a log.
#[derive(Clone, Debug, PartialEq)]
pub struct LogRecord {
    /// The message, clock `log`, numbered from 0 in log order.
    pub message: Message,
    /// Line of the file, from 1; in a record file the number of the record. 0: not in the file
    /// (the setup of a CARMEN log; a sentence of a narration).
    pub line: usize,
    /// This is one of the log's odometry lines (or, where it has none, the odometry of a scan
    /// line): the trajectory has a row for it.
    pub odom_row: bool,
    /// The line's stamp in seconds as written there.
    pub stamp_text: String,
}

/// A log being read: messages in log order.
pub trait Records: Iterator<Item = LogRecord> + Send {
    /// What was read and what was skipped so far.
    fn notes(&self) -> &Notes;

    /// Bytes read and bytes in all, after decompression.
    fn progress(&self) -> (u64, u64);
}

/// Whom a log speaks for. A record file says so itself.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Options {
    /// Robot id in all headers.
    pub robot: String,
    /// The map in the setup.
    pub map: String,
    /// Boot number in all headers.
    pub boot: u64,
}

impl Default for Options {
    fn default() -> Self {
        Self { robot: "log".into(), map: "main".into(), boot: 0 }
    }
}

/// What was read from a log and what was not. A damaged line costs that line only.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Notes {
    /// The file.
    pub file: PathBuf,
    /// Scans read.
    pub scans: u64,
    /// Odometry messages read or taken from scans.
    pub odoms: u64,
    /// Sentences read.
    pub sentences: u64,
    /// Lines that could not be read.
    pub bad_lines: u64,
    /// The first few of them, each with its number.
    pub first_bad: Vec<(usize, String)>,
    /// Lines of other types: type and number.
    pub ignored: BTreeMap<String, u64>,
    /// Sentences left out, for they began far outside the log.
    pub outside: u64,
    /// Whatever else the reader of a report should know ("truncated").
    pub remarks: Vec<String>,
}

impl Notes {
    const BAD_SHOWN: usize = 5;

    /// A line could not be read.
    pub fn bad(&mut self, line: usize, why: String) {
        self.bad_lines += 1;
        if self.first_bad.len() < Self::BAD_SHOWN {
            self.first_bad.push((line, why));
        }
    }

    fn remark(&mut self, what: impl Into<String>) {
        self.remarks.push(what.into());
    }

    /// A message was read.
    pub fn count(&mut self, message: &Message) {
        match message {
            Message::Setup(_) | Message::End(_) | Message::Mend(_) => {}
            Message::Odom(_) => self.odoms += 1,
            Message::Scan(_) => self.scans += 1,
            Message::Say(_) => self.sentences += 1,
        }
    }

    /// Why a log that was read to its end is not what it was taken for.
    ///
    /// # Errors
    /// If more of it was skipped than read; if no sentence was said during the log.
    pub fn check(&self) -> Result<(), Misread> {
        let file = self.file.clone();
        let read = self.scans + self.odoms;
        if self.bad_lines > read {
            return Err(Misread::Skipped { file, skipped: self.bad_lines, read });
        }
        if self.outside > 0 && self.sentences == 0 {
            return Err(Misread::Outside { file, sentences: self.outside });
        }
        Ok(())
    }

    /// Warnings for people, one a line; each begins with the file's name.
    pub fn warnings(&self) -> Vec<String> {
        let file = self.file.display();
        let mut out: Vec<String> = self.remarks.iter().map(|r| format!("{file}: {r}")).collect();
        out.extend(self.first_bad.iter().map(|(n, why)| format!("{file}:{n}: skipped: {why}")));
        let more = self.bad_lines - self.first_bad.len() as u64;
        if more > 0 {
            out.push(format!("{file}: {more} more lines skipped"));
        }
        if !self.ignored.is_empty() {
            let mut line = format!("{file}: ignored");
            for (kind, n) in &self.ignored {
                let _ = write!(line, " {n} {kind}");
            }
            out.push(line);
        }
        out
    }
}

/// Why a log that was read is not what it was taken for.
#[derive(Debug, Error)]
pub enum Misread {
    /// Most of it is something else.
    #[error("{file}: {skipped} lines were skipped and {read} read: this is not the log it was taken for")]
    Skipped {
        /// The file.
        file: PathBuf,
        /// Lines skipped.
        skipped: u64,
        /// Scans and odometry read.
        read: u64,
    },
    /// The narration is of another log.
    #[error(
        "{file}: all {sentences} sentences of the narration began far outside the log: t is the log's own stamp, t_rel \
         counts from its first, both in seconds"
    )]
    Outside {
        /// The file.
        file: PathBuf,
        /// Sentences.
        sentences: u64,
    },
}

/// Why a log can't be read at all.
#[derive(Debug, Error)]
pub enum LogError {
    /// The file can't be opened or read.
    #[error("{file}: {source}")]
    Io {
        /// The file.
        file: PathBuf,
        /// What the system says.
        source: std::io::Error,
    },
    /// Its content is of no known kind.
    #[error(
        "{file}: not a log: {why} (known: CARMEN text, tables of t, x, y, yaw and ranges, record files, all of them gzipped or not; rosbag2, MCAP or SQLite)"
    )]
    NotALog {
        /// The file.
        file: PathBuf,
        /// What it looks like.
        why: String,
    },
    /// Its robot or laser is none that a server takes.
    #[error("{file}: its setup is refused: {why}")]
    Setup {
        /// The file.
        file: PathBuf,
        /// The field and what is wrong with it.
        why: String,
    },
    /// It is a bag, but none that can be mapped.
    #[error("{file}: {why}")]
    Bag {
        /// The file or folder.
        file: PathBuf,
        /// What is wrong with it, and what to do.
        why: String,
    },
    /// Nothing in it can be mapped.
    #[error("{file}: no usable scan in {lines} lines{detail}")]
    NoScan {
        /// The file.
        file: PathBuf,
        /// Lines looked at.
        lines: usize,
        /// The first thing that is wrong, if any.
        detail: String,
    },
}

/// Opens a log of any known kind.
///
/// # Errors
/// If the file can't be read, is of no known kind, or has no usable scan. Damage further on is
/// skipped and told by [`Records::notes`].
pub fn open(path: &Path, options: &Options) -> Result<Box<dyn Records>, LogError> {
    let mut notes = Notes { file: path.into(), ..Notes::default() };
    let bytes = read(path, &mut notes)?;
    if [record::MAGIC, record::MAGIC_1].iter().any(|magic| bytes.starts_with(magic)) {
        return Ok(Box::new(RecordedLog::new(bytes, notes)?));
    }
    if bytes.contains(&0) {
        return Err(LogError::NotALog { file: path.into(), why: not_text(path, &notes) });
    }
    if csv::is_table(&bytes) {
        return Ok(Box::new(CsvLog::new(bytes, options, notes)?));
    }
    Ok(Box::new(CarmenLog::new(bytes, options, notes)?))
}

/// Opens a trajectory (`t, x, y, yaw`, or TUM's lines) with a table of scans (`t` and ranges) beside it.
///
/// # Errors
/// If a file can't be read, there is no pose or no usable scan.
pub fn with_scans(trajectory: &Path, scans: &Path, options: &Options) -> Result<Box<dyn Records>, LogError> {
    let mut notes = Notes { file: trajectory.into(), ..Notes::default() };
    let poses = read(trajectory, &mut notes)?;
    notes.file = scans.into();
    let scans = read(scans, &mut notes)?;
    Ok(Box::new(CsvLog::with_scans(&poses, scans, options, notes)?))
}

/// What a server would refuse is not read either: a log makes the same map offline and online.
fn check(message: &Message) -> Result<(), String> {
    message.validate(&Limits::default()).map_err(|invalid| invalid.to_string())
}

fn not_text(path: &Path, notes: &Notes) -> String {
    if notes.remarks.is_empty() {
        format!("{} is binary", path.extension().map_or("it".into(), |e| format!(".{}", e.display())))
    } else {
        notes.remarks.join("; ")
    }
}

/// The file's bytes, decompressed if they are gzip.
fn read(path: &Path, notes: &mut Notes) -> Result<Vec<u8>, LogError> {
    let raw = std::fs::read(path).map_err(|source| LogError::Io { file: path.into(), source })?;
    if !raw.starts_with(&[0x1f, 0x8b]) {
        if path.extension().is_some_and(|e| e == "gz") {
            notes.remark("named .gz but not gzip");
        }
        return Ok(raw);
    }
    let mut bytes = Vec::with_capacity(raw.len().saturating_mul(6));
    // What came out before the damage is as good as ever.
    if let Err(e) = MultiGzDecoder::new(raw.as_slice()).read_to_end(&mut bytes) {
        if bytes.is_empty() {
            return Err(LogError::NotALog { file: path.into(), why: format!("damaged gzip: {e}") });
        }
        notes.remark(format!("truncated or damaged gzip, read up to there: {e}"));
    }
    Ok(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;
    use flate2::{Compression, write::GzEncoder};
    use std::io::Write as _;

    const SCAN: &str = "FLASER 1 1 0 0 0 0 0 0 1 h 1\n";

    /// Writes a file into a folder of this test's own and opens it as a log.
    fn opened(name: &str, content: &[u8]) -> Result<(usize, Notes), LogError> {
        let folder = std::env::temp_dir().join(format!("toponym-log-{}-{name}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        let file = folder.join(name);
        std::fs::write(&file, content).unwrap();
        let read =
            open(&file, &Options::default()).map(|mut log| (log.by_ref().count(), log.notes().clone()));
        std::fs::remove_dir_all(&folder).unwrap();
        read
    }

    fn gzip(content: &[u8]) -> Vec<u8> {
        let mut out = GzEncoder::new(Vec::new(), Compression::default());
        out.write_all(content).unwrap();
        out.finish().unwrap()
    }

    #[test]
    fn content_decides_and_not_the_name() {
        for (name, content) in [("a.clf", SCAN.into()), ("b.txt", gzip(SCAN.as_bytes()))] {
            let (records, notes) = opened(name, &content).unwrap();
            assert_eq!(records, 3);
            assert!(notes.warnings().is_empty(), "{notes:?}");
        }
        let (records, notes) = opened("c.gz", SCAN.as_bytes()).unwrap();
        assert_eq!(records, 3);
        assert!(notes.warnings()[0].contains("c.gz: named .gz but not gzip"));
    }

    #[test]
    fn a_gz_that_is_none_is_an_error_that_says_so() {
        for (name, content) in [("d.gz", "not a log\n".as_bytes()), ("e.gz", b"\0\x01\x02"), ("f.gz", b"")] {
            let error = opened(name, content).unwrap_err().to_string();
            assert!(error.contains(name) && error.contains("named .gz but not gzip"), "{error}");
        }
        let error = opened("g.gz", &[0x1f, 0x8b, 8, 0, 0]).unwrap_err().to_string();
        assert!(error.contains("damaged gzip"), "{error}");
    }

    #[test]
    fn a_truncated_gz_is_read_up_to_there() {
        let text: String =
            (0..2000).map(|i| SCAN.replace("FLASER 1 1", &format!("FLASER 1 0.{}", i * 7919))).collect();
        let whole = gzip(text.as_bytes());
        let (records, notes) = opened("h.gz", &whole[..whole.len() / 2]).unwrap();
        assert!(records > 500 && records < 2002, "{records}");
        assert!(notes.warnings()[0].contains("truncated or damaged gzip"), "{notes:?}");
    }

    #[test]
    fn a_missing_file_is_named() {
        let error = open(Path::new("no/such.clf"), &Options::default()).err().unwrap().to_string();
        assert!(error.starts_with("no/such.clf: "), "{error}");
    }
}
