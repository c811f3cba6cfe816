//! What a guide says to a question, or to take back what was said last: "yes", "no, sorry", "scratch that".

use crate::language::lexicon::normalise::{COMMA, sentences};
use std::collections::BTreeMap;
use std::sync::LazyLock;

/// What a reply says.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reply {
    /// "Yes, that's right."
    Yes,
    /// "No."
    No,
    /// "Scratch that."
    Undo,
}

/// What a phrase of a reply is; none: it says nothing by itself.
type Phrases = BTreeMap<Vec<String>, Option<Reply>>;

/// A reply has no more words.
const WORDS_MAX: usize = 12;

static PHRASES: LazyLock<Phrases> = LazyLock::new(|| read(include_str!("../../lexicon/english/replies.txt")));

fn read(text: &str) -> Phrases {
    let mut phrases = Phrases::new();
    for (says, all) in text.lines().filter(|l| !l.starts_with('#')).filter_map(|l| l.split_once(':')) {
        let says = match says {
            "yes" => Some(Reply::Yes),
            "no" => Some(Reply::No),
            "undo" => Some(Reply::Undo),
            _ => None,
        };
        for phrase in all.split(';') {
            phrases.insert(words(phrase), says);
        }
    }
    phrases
}

/// Its words, as all texts are made plain.
fn words(text: &str) -> Vec<String> {
    let all = sentences(text).into_iter().flat_map(|s| s.words);
    all.map(|w| w.text).filter(|w| w != COMMA).collect()
}

/// What a text replies, if it says nothing else. "No, scratch that" takes back.
pub fn reply(text: &str) -> Option<Reply> {
    let words = words(text);
    if words.is_empty() || words.len() > WORDS_MAX {
        return None;
    }
    let mut says = None;
    let mut at = 0;
    while at < words.len() {
        let longest = (at + 1..=words.len()).rev().find(|&to| PHRASES.contains_key(&words[at..to]))?;
        match (says, PHRASES[&words[at..longest]]) {
            (_, None) => {}
            (Some(Reply::No), Some(Reply::Undo)) | (None, _) => says = PHRASES[&words[at..longest]],
            (Some(known), Some(new)) if known == new => {}
            (Some(Reply::Undo), Some(Reply::No)) => {}
            _ => return None,
        }
        at = longest;
    }
    says
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn replies_are_told_from_sentences() {
        for (text, says) in [
            ("Yes.", Some(Reply::Yes)),
            ("yeah, that's right", Some(Reply::Yes)),
            ("um no", Some(Reply::No)),
            ("no no, sorry", Some(Reply::No)),
            ("no wait, scratch that", Some(Reply::Undo)),
            ("forget what I just said please", Some(Reply::Undo)),
            ("undo", Some(Reply::Undo)),
            ("yes no", None),
            ("please", None),
            ("yes the gym", None),
            ("no, the lounge", None),
            ("this is the gym", None),
            ("", None),
        ] {
            assert_eq!(reply(text), says, "{text}");
        }
    }
}
