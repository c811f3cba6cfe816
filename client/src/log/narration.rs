//! A guide's narration of a log, a sentence a line:
//!
//! ```json
//! {"t": 976052860.5, "text": "this is the lobby"}
//! {"t_rel": 12.25, "text": "the gym is down the hallway", "speaker": "anna"}
//! ```
//!
//! `t` is the log's own stamp, `t_rel` counts seconds from the log's first; `id`, `speaker`,
//! `lang` and `alternatives` (as in [`Say`]) may be given, other fields are left alone.

use super::recorded::seconds_text;
use super::{LogRecord, Notes, Records};
use serde::Deserialize;
use std::path::{Path, PathBuf};
use thiserror::Error;
use toponym_proto::limits::SAID_OUTSIDE_S;
use toponym_proto::merge::{Sentences, order_stamp};
use toponym_proto::stream::Hearing;
use toponym_proto::{Limits, Message, Say, Stamp};

/// Why a narration can't be used. Unlike a log's a bad line is an error: a person wrote it and
/// can mend it, and the map would silently lack a name.
#[derive(Debug, Error)]
pub enum NarrationError {
    /// The file can't be read.
    #[error("{file}: {source}")]
    Io {
        /// The file.
        file: PathBuf,
        /// What the system says.
        source: std::io::Error,
    },
    /// A line is no sentence.
    #[error("{file}:{line}: {why}")]
    Line {
        /// The file.
        file: PathBuf,
        /// Its line, from 1.
        line: usize,
        /// What is wrong.
        why: String,
    },
}

/// When a sentence began.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Began {
    /// By the log's clock.
    At(Stamp),
    /// Nanoseconds since the log's first stamp.
    After(i64),
}

/// One sentence of a narration.
#[derive(Clone, Debug, PartialEq)]
pub struct Sentence {
    began: Began,
    say: Say,
}

/// Sentences in the order of the file.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Narration {
    sentences: Vec<Sentence>,
}

#[derive(Deserialize)]
struct Fields {
    t: Option<f64>,
    t_rel: Option<f64>,
    text: String,
    id: Option<String>,
    speaker: Option<String>,
    lang: Option<String>,
    #[serde(default)]
    alternatives: Vec<Hearing>,
    retracts: Option<String>,
    answers: Option<String>,
}

impl Narration {
    /// Reads a file.
    ///
    /// # Errors
    /// If it can't be read; for the first line that is no sentence.
    pub fn read(file: &Path) -> Result<Self, NarrationError> {
        let text = std::fs::read_to_string(file)
            .map_err(|source| NarrationError::Io { file: file.into(), source })?;
        Self::parse(&text).map_err(|(line, why)| NarrationError::Line { file: file.into(), line, why })
    }

    /// Parses the text of a file; the error is the line's number and what is wrong with it.
    pub fn parse(text: &str) -> Result<Self, (usize, String)> {
        // Some editors begin a file with a mark of byte order.
        let lines = text
            .trim_start_matches('\u{feff}')
            .lines()
            .enumerate()
            .filter(|(_, line)| !line.trim().is_empty());
        let sentences = lines.map(|(i, line)| sentence(i + 1, line).map_err(|why| (i + 1, why)));
        Ok(Self { sentences: sentences.collect::<Result<_, _>>()? })
    }

    /// Number of sentences.
    pub fn len(&self) -> usize {
        self.sentences.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.sentences.is_empty()
    }

    /// The sentences as said to `robot` in a log that begins at `first`, in the order of the file.
    pub fn says(&self, robot: &str, first: Stamp) -> Vec<Say> {
        let say = |s: &Sentence| {
            let began = match s.began {
                Began::At(stamp) => stamp,
                Began::After(ns) => Stamp { ns: first.ns.saturating_add(ns) },
            };
            Say { robot: Some(robot.into()), began: Some(began), ended: Some(began), ..s.say.clone() }
        };
        self.sentences.iter().map(say).collect()
    }
}

fn sentence(line: usize, text: &str) -> Result<Sentence, String> {
    // serde counts lines within the text given, which is this one.
    let fields: Fields =
        serde_json::from_str(text).map_err(|e| e.to_string().replace("at line 1 column", "at column"))?;
    // Microseconds: what a double still holds of a stamp of this century.
    let ns = |s: f64| (s * 1e6).round() as i64 * 1000;
    let began = match (fields.t, fields.t_rel) {
        (Some(t), None) if t.abs() < 9e9 => Began::At(Stamp { ns: ns(t) }),
        (None, Some(t)) if t.abs() < 9e9 => Began::After(ns(t)),
        (None, None) => return Err("says neither t nor t_rel".into()),
        (Some(_), Some(_)) => return Err("says both t and t_rel".into()),
        _ => return Err("its time is out of range: t and t_rel are in seconds".into()),
    };
    let say = Say {
        id: fields.id.unwrap_or_else(|| line_id(line, text)),
        robot: None,
        text: fields.text,
        alternatives: fields.alternatives,
        lang: fields.lang,
        speaker: fields.speaker,
        began: None,
        ended: None,
        ago_s: None,
        retracts: fields.retracts,
        answers: fields.answers,
    };
    // What a server would refuse is not read either.
    let stamp = match began {
        Began::At(stamp) => stamp,
        Began::After(ns) => Stamp { ns },
    };
    Message::Say(Say { began: Some(stamp), ..say.clone() })
        .validate(&Limits::default())
        .map_err(|invalid| invalid.to_string())?;
    Ok(Sentence { began, say })
}

/// An id that is the same each time the file is read: FNV-1a of the line and its number. Two like
/// lines are two sentences.
fn line_id(line: usize, text: &str) -> String {
    const OFFSET: u128 = 0x6c62_272e_07bb_0142_62b8_2175_6295_c58d;
    const PRIME: u128 = 0x0000_0000_0100_0000_0000_0000_0000_013b;
    let bytes = (line as u64).to_le_bytes().into_iter().chain(text.trim().bytes());
    let hash = bytes.fold(OFFSET, |h, b| (h ^ u128::from(b)).wrapping_mul(PRIME));
    ulid::Ulid::from(hash).to_string()
}

/// A log with a narration put in by the ordering rule of [`toponym_proto::merge`].
pub fn merged(mut log: Box<dyn Records>, narration: &Narration) -> Box<dyn Records> {
    let next = log.next();
    let header = next.as_ref().and_then(|r| r.message.header());
    let (robot, first) = header.map_or((String::new(), Stamp::default()), |h| (h.robot.clone(), h.stamp));
    let mut says = Sentences::default();
    let (before, rest): (Vec<Say>, Vec<Say>) = narration
        .says(&robot, first)
        .into_iter()
        .partition(|say| began_s(say) < first.seconds() - SAID_OUTSIDE_S);
    for say in rest {
        says.push(say, first);
    }
    let notes = log.notes().clone();
    Box::new(Merged { log, next, says, said: 0, newest: first, outside: before, notes })
}

fn began_s(say: &Say) -> f64 {
    say.began.unwrap_or_default().seconds()
}

struct Merged {
    log: Box<dyn Records>,
    next: Option<LogRecord>,
    says: Sentences,
    said: u64,
    /// Newest stamp of the log so far.
    newest: Stamp,
    /// Sentences left out.
    outside: Vec<Say>,
    notes: Notes,
}

impl Merged {
    /// The next sentence that nothing of the log is later than. One far behind its end is of another clock.
    fn left(&mut self) -> Option<Say> {
        loop {
            let say = self.says.pop()?;
            if began_s(&say) <= self.newest.seconds() + SAID_OUTSIDE_S {
                return Some(say);
            }
            self.outside.push(say);
        }
    }

    /// The log's own notes are one message ahead, so these are counted when it is handed out.
    fn note(&mut self) {
        self.notes.clone_from(self.log.notes());
        self.notes.sentences += self.said;
        self.notes.outside = self.outside.len() as u64;
        if let Some(say) = self.outside.first() {
            let n = self.outside.len();
            self.notes.remark(format!(
                "{n} sentences left out, such as {:?}: they began far outside the log, on another clock",
                say.text
            ));
        }
    }
}

impl Iterator for Merged {
    type Item = LogRecord;

    fn next(&mut self) -> Option<LogRecord> {
        let say = match &self.next {
            Some(record) => {
                self.newest = self.newest.max(record.message.header().map_or(self.newest, |h| h.stamp));
                self.says.pop_before(order_stamp(&record.message))
            }
            None => self.left(),
        };
        let record = if let Some(say) = say {
            self.said += 1;
            let stamp_text = seconds_text(say.began.unwrap_or_default());
            Some(LogRecord { message: Message::Say(say), line: 0, odom_row: false, stamp_text })
        } else {
            std::mem::replace(&mut self.next, self.log.next())
        };
        self.note();
        record
    }
}

impl Records for Merged {
    fn notes(&self) -> &Notes {
        &self.notes
    }

    fn progress(&self) -> (u64, u64) {
        self.log.progress()
    }
}

#[cfg(test)]
mod tests {
    use super::super::{CarmenLog, Options};
    use super::*;
    use proptest::prelude::*;

    fn log() -> Box<dyn Records> {
        let text =
            "FLASER 1 1 0 0 0 0 0 0 10 h 1\nFLASER 1 1 0 0 0 0 0 0 11 h 1\nFLASER 1 1 0 0 0 0 0 0 10.5 h 1\n";
        Box::new(CarmenLog::new(text.into(), &Options::default(), Notes::default()).unwrap())
    }

    fn order(narration: &str) -> String {
        merged(log(), &Narration::parse(narration).unwrap())
            .map(|r| match r.message {
                Message::Setup(_) => "S".to_owned(),
                Message::Odom(_) => "o".to_owned(),
                Message::Scan(_) => "L".to_owned(),
                Message::Say(say) => say.text,
                Message::End(_) => "E".to_owned(),
                Message::Mend(_) => "M".to_owned(),
            })
            .collect()
    }

    #[test]
    fn a_sentence_enters_before_the_first_later_message() {
        assert_eq!(order(r#"{"t": 10, "text": "A"}"#), "SoLAoLoL");
        assert_eq!(order(r#"{"t": 10.7, "text": "A"}"#), "SoLAoLoL");
        // The step back to 10.5 doesn't count: 11 had come before.
        assert_eq!(order(r#"{"t": 11, "text": "A"}"#), "SoLoLoLA");
        assert_eq!(order("{\"t_rel\": 99, \"text\": \"B\"}\n{\"t_rel\": 0.5, \"text\": \"A\"}"), "SoLAoLoLB");
    }

    #[test]
    fn what_was_said_far_outside_the_log_is_left_out_and_told() {
        let told = |narration: &str| {
            let mut log = merged(log(), &Narration::parse(narration).unwrap());
            let said = log.by_ref().filter(|r| matches!(r.message, Message::Say(_))).count();
            (said, log.notes().clone())
        };
        let (said, notes) = told("{\"t\": 1790000000, \"text\": \"A\"}\n{\"t\": 10.5, \"text\": \"B\"}");
        assert_eq!((said, notes.outside), (1, 1));
        assert!(notes.warnings()[0].contains("1 sentences left out, such as \"A\""), "{notes:?}");
        assert!(notes.check().is_ok());
        let (said, notes) = told("{\"t_rel\": 10500, \"text\": \"A\"}\n{\"t\": -5000, \"text\": \"B\"}");
        assert_eq!((said, notes.outside), (0, 2));
        assert!(notes.check().unwrap_err().to_string().contains("all 2 sentences"));
        assert!(
            Narration::parse("{\"t\": 976052857337, \"text\": \"a\"}").unwrap_err().1.contains("in seconds")
        );
    }

    #[test]
    fn t_rel_counts_from_the_logs_first_stamp_and_both_are_exact() {
        let text = "{\"t\": 976052857.337546, \"text\": \"a\"}\n\n{\"t_rel\": 2.5, \"text\": \"b\"}";
        let says = Narration::parse(text).unwrap().says("r", Stamp { ns: 976_052_860_000_000_001 });
        let began: Vec<i64> = says.iter().filter_map(|s| s.began).map(|b| b.ns).collect();
        assert_eq!(began, [976_052_857_337_546_000, 976_052_862_500_000_001]);
        assert_eq!(says[0].robot.as_deref(), Some("r"));
    }

    #[test]
    fn ids_are_given_or_made_from_the_line() {
        let line = r#"{"t": 1, "text": "a"}"#;
        let ids = |text: &str| -> Vec<String> {
            Narration::parse(text).unwrap().sentences.into_iter().map(|s| s.say.id).collect()
        };
        let made = ids(&format!("{line}\n{line}"));
        assert_eq!(made, ids(&format!("{line}\n{line}")));
        assert_ne!(made[0], made[1]);
        assert!(made[0].parse::<ulid::Ulid>().is_ok());
        assert_eq!(ids(r#"{"t": 1, "text": "a", "id": "X", "region": ["R2"]}"#), ["X"]);
    }

    #[test]
    fn a_bad_line_is_named() {
        for (line, says) in [
            ("{\"text\": \"a\"}", "neither t nor t_rel"),
            ("{\"t\": 1, \"t_rel\": 1, \"text\": \"a\"}", "both"),
            ("{\"t\": 1, \"text\": \" \"}", "empty"),
            ("{\"t\": 1}", "missing field `text` at column 8"),
            ("{\"t\": 1e300, \"text\": \"a\"}", "out of range"),
            ("this is the gym", "expected"),
        ] {
            let (n, why) = Narration::parse(&format!("{{\"t\": 1, \"text\": \"a\"}}\n{line}")).unwrap_err();
            assert_eq!(n, 2);
            assert!(why.contains(says), "{line}: {why}");
        }
    }

    proptest! {
        #[test]
        fn nothing_is_lost_and_the_log_keeps_its_order(times in prop::collection::vec(8.0_f64..13.0, 0..6)) {
            let lines: Vec<String> =
                times.iter().map(|t| format!("{{\"t\": {t}, \"text\": \"x\"}}")).collect();
            let order = order(&lines.join("\n"));
            prop_assert_eq!(order.replace('x', ""), "SoLoLoL");
            prop_assert_eq!(order.matches('x').count(), times.len());
        }
    }
}
