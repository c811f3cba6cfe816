//! Feeds an input to the parser that it is for, as the server and its tools do, and tells what came of it.

use std::fs;
use std::path::PathBuf;
use std::sync::atomic::{AtomicU32, Ordering};
use toponym::log::{self, CarmenLog, LogError, Narration, Notes, Options, Records};
use toponym_core::language::Speech;
use toponym_journal::entry::EntryError;
use toponym_journal::{Checkpoint, Entry, Journal, JournalError, segment};
use toponym_proto::keys::check_key;
use toponym_proto::record::{RecordError, RecordReader};
use toponym_proto::{Invalid, Limits, Message, Refused, selector};
use toponym_server::access::{Policy, PolicyError};
use toponym_server::config::{ConfigError, ServerConfig};

use crate::medium::Medium;
use crate::seeds::keys;

/// What is fed, and so to which parser.
pub enum Fed {
    /// A payload on a key, with its encoding.
    Wire(String, &'static str, Vec<u8>),
    /// A message without a key, as it stands in records.
    Message(Vec<u8>),
    /// A key that robots and guides publish on.
    Key(String),
    /// What follows `?` in a selector, and a payload.
    Selector(String, Vec<u8>),
    /// The file of a server's settings.
    Settings(Vec<u8>),
    /// The file of its users.
    Users(Vec<u8>),
    /// A record.
    Record(Vec<u8>),
    /// A log of CARMEN text.
    Carmen(Vec<u8>),
    /// A file to be opened as a log.
    Log(Vec<u8>),
    /// The file of a narration.
    Narration(Vec<u8>),
    /// What somebody said.
    Sentence(String),
    /// An entry of a journal.
    Entry(Vec<u8>),
    /// A segment of a journal: name and content.
    Segment(String, Vec<u8>),
    /// A checkpoint: name and content.
    Checkpoint(String, Vec<u8>),
    /// All files of a journal.
    Journal(Vec<(String, Vec<u8>)>),
}

/// What came of it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Came {
    /// It is good, or harmless.
    Taken,
    /// A value is out of its range: which field's is told.
    Invalid,
    /// It is not what it claims to be.
    Malformed,
    /// It is longer than the limit.
    TooLarge,
    /// The file can't be read as text, or at all.
    NoFile,
    /// It is no TOML, or says something that does not exist.
    NoToml,
    /// It does not begin as a record.
    NotARecord,
    /// Something stands there that nobody wrote.
    Damaged,
    /// A message in it is refused.
    BrokenMessage,
    /// Of a format that this build does not know.
    Format,
    /// It is no log.
    NotALog,
    /// It has no scan that could be used.
    NoScan,
    /// It asks for a setup that servers refuse.
    RefusedSetup,
    /// A line of it is no sentence.
    BadLine,
    /// An entry of unknown kind.
    UnknownKind,
    /// An entry that breaks off.
    Short,
    /// Nothing in it was understood.
    NotUnderstood,
}

/// What came of it, with what is told of it: the field that was refused, or whatever else.
#[derive(Debug)]
pub struct Outcome {
    pub came: Came,
    pub told: String,
}

// Errors of many kinds are handed over where they arise.
#[allow(clippy::needless_pass_by_value)]
fn came(came: Came, told: impl ToString) -> Outcome {
    Outcome { came, told: told.to_string() }
}

/// Feeds an input.
pub fn feed(fed: &Fed) -> Outcome {
    let fed = match fed {
        Fed::Wire(key, encoding, bytes) => wire(key, encoding, bytes),
        Fed::Message(bytes) => message(Message::from_bincode(bytes, &Limits::default())),
        Fed::Key(key) => {
            keys().input(key).map_err(invalid).map(|(robot, input)| format!("{robot}, {input:?}"))
        }
        Fed::Selector(text, payload) => {
            selector::decode(text, payload).map_err(invalid).map(|arguments| format!("{arguments:?}"))
        }
        Fed::Settings(bytes) => settings(bytes),
        Fed::Users(bytes) => users(bytes),
        Fed::Record(bytes) => record(bytes),
        Fed::Carmen(bytes) => CarmenLog::new(bytes.clone(), &Options::default(), Notes::default())
            .map_err(log_error)
            .map(|mut log| drained(&mut log)),
        Fed::Log(bytes) => with_file(bytes, |path| {
            toponym_ros::log::open(path, &Options::default(), &[])
                .map_err(log_error)
                .map(|mut log| drained(log.as_mut()))
        }),
        Fed::Narration(bytes) => narration(bytes),
        Fed::Sentence(text) => sentence(text),
        Fed::Entry(bytes) => Entry::from_bytes(bytes).map_err(entry_error).map(|entry| format!("{entry:?}")),
        Fed::Segment(name, bytes) => segment::read(name, bytes)
            .map_err(journal_error)
            .map(|s| format!("{} entries, {:?}, {} slots lost", s.entries.len(), s.broken, s.slots_lost)),
        Fed::Checkpoint(name, bytes) => {
            Checkpoint::read(name, bytes).map_err(journal_error).map(|c| format!("{} bytes", c.map.len()))
        }
        Fed::Journal(files) => Journal::open(Medium::with(files.clone()))
            .map_err(journal_error)
            .map(|o| format!("{} and {}; {}", o.checkpoint.index, o.tail.len(), o.mended.join("; "))),
    };
    fed.map_or_else(|refused| refused, |taken| came(Came::Taken, taken))
}

type Result<T = String> = std::result::Result<T, Outcome>;

fn invalid(e: Invalid) -> Outcome {
    came(Came::Invalid, e.field)
}

fn refused(e: Refused) -> Outcome {
    match e {
        Refused::TooLarge { .. } => came(Came::TooLarge, e),
        Refused::Malformed(why) => came(Came::Malformed, why),
        Refused::Invalid(e) => invalid(e),
    }
}

fn message(read: std::result::Result<Message, Refused>) -> Result {
    read.map_err(refused).map(|message| format!("{message:?}"))
}

/// As the server's intake does it.
fn wire(key: &str, encoding: &str, bytes: &[u8]) -> Result {
    let (robot, input) = keys().input(key).map_err(invalid)?;
    let message = Message::decode(&input, encoding, bytes, &Limits::default()).map_err(refused)?;
    check_key(&robot, &input, &message).map_err(invalid)?;
    Ok(format!("{message:?}"))
}

/// Does something with a file of this content.
pub fn with_file<T>(bytes: &[u8], with: impl FnOnce(&PathBuf) -> T) -> T {
    static COUNT: AtomicU32 = AtomicU32::new(0);
    let number = COUNT.fetch_add(1, Ordering::Relaxed);
    let path = PathBuf::from(env!("CARGO_TARGET_TMPDIR"));
    let path = path.join(format!("malformed-{}-{number}", std::process::id()));
    fs::write(&path, bytes).unwrap();
    let done = with(&path);
    fs::remove_file(&path).unwrap();
    done
}

fn settings(bytes: &[u8]) -> Result {
    match with_file(bytes, |path| ServerConfig::read(path)) {
        Ok(config) => Ok(format!("{config:?}")),
        Err(e @ ConfigError::Read { .. }) => Err(came(Came::NoFile, e)),
        Err(e @ ConfigError::Parse { .. }) => Err(came(Came::NoToml, e)),
        Err(e @ ConfigError::Lexicon { .. }) => Err(came(Came::Malformed, e)),
        Err(ConfigError::Invalid(e)) => Err(invalid(e)),
    }
}

fn users(bytes: &[u8]) -> Result {
    match with_file(bytes, |path| Policy::read(path)) {
        Ok(policy) => Ok(format!("{policy:?}")),
        Err(e @ PolicyError::File { .. }) => Err(came(Came::NoFile, e)),
        Err(e @ PolicyError::Parse { .. }) => Err(came(Came::NoToml, e)),
        Err(PolicyError::Invalid { invalid: e, .. }) => Err(invalid(e)),
    }
}

fn record(bytes: &[u8]) -> Result {
    let error = |e| match e {
        RecordError::Io(_) => came(Came::NoFile, e),
        RecordError::NotARecord => came(Came::NotARecord, ""),
        RecordError::Damaged { .. } => came(Came::Damaged, e),
        RecordError::Message { .. } => came(Came::BrokenMessage, e),
    };
    let mut reader = RecordReader::new(bytes).map_err(error)?;
    let read = reader.by_ref().collect::<std::result::Result<Vec<_>, _>>().map_err(error)?;
    Ok(format!("{} messages{}", read.len(), if reader.torn() { ", torn" } else { "" }))
}

fn log_error(e: LogError) -> Outcome {
    match e {
        LogError::Io { .. } => came(Came::NoFile, e),
        LogError::Bag { why, .. } => came(Came::NotALog, why),
        LogError::NotALog { .. } => came(Came::NotALog, e),
        LogError::Setup { why, .. } => came(Came::RefusedSetup, why),
        LogError::NoScan { .. } => came(Came::NoScan, e),
    }
}

fn drained(log: &mut dyn Records) -> String {
    let mut read = 0;
    while log.next().is_some() {
        read += 1;
    }
    let notes = log.notes();
    format!("{read} messages, {} scans; {}", notes.scans, notes.warnings().join("; "))
}

fn narration(bytes: &[u8]) -> Result {
    let error = |e: log::NarrationError| match e {
        log::NarrationError::Io { .. } => came(Came::NoFile, e),
        log::NarrationError::Line { line, why, .. } => came(Came::BadLine, format!("{line}: {why}")),
    };
    let says = with_file(bytes, |path| Narration::read(path)).map_err(error)?.says("r07", header_stamp());
    Ok(format!("{says:?}"))
}

fn header_stamp() -> toponym_proto::Stamp {
    crate::seeds::header().stamp
}

fn sentence(text: &str) -> Result {
    let parse = Speech::default().parse_hearings(text, &[]);
    if parse.acts().is_empty() { Err(came(Came::NotUnderstood, "")) } else { Ok(parse.notation().into()) }
}

fn entry_error(e: EntryError) -> Outcome {
    match e {
        EntryError::Kind(kind) => came(Came::UnknownKind, kind),
        EntryError::Short(bytes) => came(Came::Short, bytes),
        EntryError::Long(_) | EntryError::Text => came(Came::Malformed, e),
        EntryError::Message(e) => refused(e),
    }
}

fn journal_error(e: JournalError) -> Outcome {
    match e {
        JournalError::Io { .. } => came(Came::NoFile, e),
        JournalError::Damaged { .. } => came(Came::Damaged, e),
        JournalError::Format { .. } => came(Came::Format, e),
    }
}
