//! Reading a sentence from left to right: fixed phrases and noun phrases. Every read is bounded, so
//! a sentence is read in linear time.

use super::Sameness;
use super::lexicon::is_function_word;
use super::names::{Kind, MAX_NAME_WORDS, Name, is_plural};
use super::normalise::COMMA;

/// How a noun phrase begins.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Determiner {
    /// "kitchen", "Nick's office".
    None,
    /// "the kitchen".
    Definite,
    /// "a kitchen".
    Indefinite,
    /// "this kitchen".
    Demonstrative,
    /// "my office", "our kitchen".
    Possessive,
}

/// "Another elevator lobby".
#[derive(Clone, Debug)]
pub(super) struct NounPhrase {
    pub(super) determiner: Determiner,
    pub(super) again: Sameness,
    pub(super) name: Name,
    pub(super) kind: Kind,
    pub(super) plural: bool,
}

/// A position in a sentence.
#[derive(Clone, Copy)]
pub(super) struct Cursor<'a> {
    words: &'a [String],
    at: usize,
}

impl<'a> Cursor<'a> {
    pub(super) fn new(words: &'a [String]) -> Self {
        Self { words, at: 0 }
    }

    /// The word `ahead` words from here; empty past the end.
    pub(super) fn peek(&self, ahead: usize) -> &'a str {
        self.words.get(self.at + ahead).map_or("", String::as_str)
    }

    pub(super) fn at_end(&self) -> bool {
        self.at >= self.words.len()
    }

    /// Steps over a phrase ("we are") if it stands here.
    pub(super) fn eat(&mut self, phrase: &str) -> bool {
        let mut ahead = 0;
        for word in phrase.split(' ') {
            if self.peek(ahead) != word {
                return false;
            }
            ahead += 1;
        }
        self.at += ahead;
        true
    }

    /// Steps over the first of these phrases, separated by `|`, that stands here.
    pub(super) fn eat_any(&mut self, phrases: &'static str) -> Option<&'static str> {
        phrases.split('|').find(|phrase| self.eat(phrase))
    }

    /// Steps over any number of these phrases.
    pub(super) fn skip(&mut self, phrases: &'static str) {
        while self.eat_any(phrases).is_some() {}
    }

    pub(super) fn skip_to_end(&mut self) {
        self.at = self.words.len();
    }

    /// Reads a noun phrase; none, and the position unchanged, if none stands here.
    pub(super) fn noun_phrase(&mut self) -> Option<NounPhrase> {
        let mut next = *self;
        let (determiner, again) = next.determiner();
        let mut words: Vec<&str> = Vec::new();
        while next.continues_name(&words) {
            if words.len() > MAX_NAME_WORDS {
                return None;
            }
            words.push(next.peek(0));
            next.at += 1;
        }
        let name = Name::from_words(&words)?;
        let (kind, plural) = (name.kind(), is_plural(&words));
        *self = next;
        Some(NounPhrase { determiner, again, name, kind, plural })
    }

    fn determiner(&mut self) -> (Determiner, Sameness) {
        use Determiner::{Definite, Demonstrative, Indefinite, None, Possessive};
        let begins = [
            ("yet another|another|a different|a second|a third|one more", Indefinite, Sameness::Other),
            ("the other", Definite, Sameness::Other),
            ("the same|that same|our same", Definite, Sameness::Same),
            ("the", Definite, Sameness::Open),
            ("a|an|some", Indefinite, Sameness::Open),
            ("this|that|these|those", Demonstrative, Sameness::Open),
            ("our|my|your|his|her|their", Possessive, Sameness::Open),
        ];
        let found = begins.into_iter().find(|(phrases, ..)| self.eat_any(phrases).is_some());
        found.map_or((None, Sameness::Open), |(_, determiner, again)| (determiner, again))
    }

    /// Does the word here belong to the name begun by `words`?
    fn continues_name(&self, words: &[&str]) -> bool {
        let (word, next) = (self.peek(0), self.peek(1));
        match word {
            "" | COMMA | "and" => false,
            // "back", "next" and "close" are adjectives but in these.
            "next" | "close" | "adjacent" if next == "to" => false,
            "next" if next == "door" => false,
            "right"
                if matches!(next, "here" | "now" | "there" | "next" | "by" | "down" | "through" | "near") =>
            {
                false
            }
            "once" if matches!(next, "more" | "again") => false,
            // "gate a"
            "a" => !words.is_empty() && matches!(next, "" | COMMA),
            // "hall of fame"
            "of" => !words.is_empty() && !next.is_empty() && (next == "the" || !is_function_word(next)),
            "the" => words.last() == Some(&"of"),
            _ => !is_function_word(word),
        }
    }
}
