//! A bag as a log.

use crate::bag::{Bag, is_bag};
use crate::plan::Survey;
use crate::stream::{Stream, Taken};
use std::path::Path;
use toponym::log::{self, LogError, LogRecord, Notes, Options, Records, seconds_text};
use toponym_proto::{Message, Stamp};

/// A bag is looked through so far before it is read, if all is known by then.
const LOOK_NS: i64 = 10_000_000_000;

/// Opens a log of any known kind: a bag, or what [`toponym::log::open`] knows. `topics`: of a bag, those alone.
///
/// # Errors
/// If the file can't be read, is of no known kind, or has no usable scan.
pub fn open(path: &Path, options: &Options, topics: &[String]) -> Result<Box<dyn Records>, LogError> {
    if is_bag(path) {
        return Ok(Box::new(BagLog::new(path, options, topics)?));
    }
    if path.is_dir() {
        let why = "a folder without a bag in it: no .mcap, no .db3".to_owned();
        return Err(LogError::Bag { file: path.into(), why });
    }
    log::open(path, options)
}

/// Reader of bags.
pub struct BagLog {
    bag: Bag,
    stream: Stream,
    read: usize,
    finished: bool,
    notes: Notes,
}

impl BagLog {
    /// Looks through the bag for what the setup has to say, and stands before the first message.
    ///
    /// # Errors
    /// If it can't be read or has no usable scan.
    pub fn new(path: &Path, options: &Options, topics: &[String]) -> Result<Self, LogError> {
        let wrong = |why: String| LogError::Bag { file: path.into(), why };
        let (mut look, mut survey) = (Bag::open(path).map_err(wrong)?, Survey::new(topics));
        let (mut first_ns, mut problem) = (None, None);
        while let Some(raw) = look.next() {
            let topic = &look.topics()[raw.topic];
            problem =
                problem.or(survey.take(topic, &raw.data).err().map(|why| format!("{}: {why}", topic.name)));
            let first_ns = *first_ns.get_or_insert(raw.received_ns);
            if raw.received_ns.saturating_sub(first_ns) > LOOK_NS && survey.is_complete() {
                break;
            }
        }
        let plan = survey.plan().map_err(|why| {
            let whys: Vec<String> =
                [why].into_iter().chain(look.broken().iter().cloned()).chain(problem).collect();
            wrong(whys.join("; "))
        })?;
        let mut notes = Notes { file: path.into(), ..Notes::default() };
        notes.remarks.clone_from(&plan.remarks);
        let bag = Bag::open(path).map_err(wrong)?;
        Ok(Self { bag, stream: Stream::new(plan, options.clone()), read: 0, finished: false, notes })
    }
}

impl Iterator for BagLog {
    type Item = LogRecord;

    fn next(&mut self) -> Option<LogRecord> {
        loop {
            if let Some(message) = self.stream.pop() {
                self.notes.count(&message);
                return Some(record(message, self.read));
            }
            if self.finished {
                return None;
            }
            let Some(raw) = self.bag.next() else {
                self.finished = true;
                self.stream.finish();
                self.notes.remarks.extend(self.bag.broken().iter().cloned());
                continue;
            };
            self.read += 1;
            let topic = &self.bag.topics()[raw.topic];
            match self.stream.take(topic, raw.received_ns, &raw.data) {
                Ok(Taken::Used) => {}
                Ok(Taken::Unused) => *self.notes.ignored.entry(topic.name.clone()).or_default() += 1,
                Err(why) => self.notes.bad(self.read, format!("{}: {why}", topic.name)),
            }
        }
    }
}

fn record(message: Message, line: usize) -> LogRecord {
    let stamp: Stamp = match &message {
        Message::Say(say) => say.began.unwrap_or_default(),
        other => other.header().map(|h| h.stamp).unwrap_or_default(),
    };
    let odom_row = matches!(message, Message::Odom(_));
    LogRecord { message, line, odom_row, stamp_text: seconds_text(stamp) }
}

impl Records for BagLog {
    fn notes(&self) -> &Notes {
        &self.notes
    }

    fn progress(&self) -> (u64, u64) {
        self.bag.progress()
    }
}
