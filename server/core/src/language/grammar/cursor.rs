//! Reading a sentence from left to right. Every read is bounded, so a sentence is read in linear time.

use crate::language::lexicon::normalise::{COMMA, Word};

/// A position in a sentence.
#[derive(Clone, Copy)]
pub(crate) struct Cursor<'a> {
    words: &'a [Word],
    at: usize,
}

impl<'a> Cursor<'a> {
    pub(crate) fn new(words: &'a [Word]) -> Self {
        Self { words, at: 0 }
    }

    /// The word `ahead` words from here; empty past the end.
    pub(crate) fn peek(&self, ahead: usize) -> &'a str {
        self.words.get(self.at + ahead).map_or("", |w| w.text.as_str())
    }

    /// The word here as it was written; none past the end.
    pub(crate) fn word(&self) -> Option<&'a Word> {
        self.words.get(self.at)
    }

    /// The word before; empty at the start.
    pub(crate) fn before(&self) -> &'a str {
        self.at.checked_sub(1).map_or("", |i| self.words[i].text.as_str())
    }

    pub(crate) fn step(&mut self) {
        self.at = (self.at + 1).min(self.words.len());
    }

    pub(crate) fn at_start(&self) -> bool {
        self.at == 0
    }

    pub(crate) fn at_end(&self) -> bool {
        self.at >= self.words.len()
    }

    /// At the end of the sentence or before a comma.
    pub(crate) fn at_break(&self) -> bool {
        self.at_end() || self.peek(0) == COMMA
    }

    /// Steps over a phrase ("we are") if it stands here.
    pub(crate) fn eat(&mut self, phrase: &str) -> bool {
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

    /// Steps over the first of these phrases, separated by `|`, that stands here. A phrase that begins
    /// another comes after it.
    pub(crate) fn eat_any(&mut self, phrases: &'static str) -> Option<&'static str> {
        phrases.split('|').find(|phrase| self.eat(phrase))
    }

    /// Steps over one phrase of each slot, in order ("we", "have just|just", "passed"); a slot that ends in
    /// `|` may be left out. The position is unchanged if a slot finds none.
    pub(crate) fn eat_each(&mut self, slots: &[&'static str]) -> bool {
        let start = *self;
        let all =
            slots.iter().all(|slot| slot.split('|').any(|phrase| phrase.is_empty() || self.eat(phrase)));
        if !all {
            *self = start;
        }
        all
    }

    /// Does one of these phrases stand here?
    pub(crate) fn sees(&self, phrases: &'static str) -> bool {
        let mut ahead = *self;
        ahead.eat_any(phrases).is_some()
    }

    /// Steps over any number of these phrases.
    pub(crate) fn skip(&mut self, phrases: &'static str) {
        while self.eat_any(phrases).is_some() {}
    }

    /// Steps to the next comma or the end and returns the words passed.
    pub(crate) fn take_to_break(&mut self) -> Vec<&'a str> {
        let mut passed = Vec::new();
        while !self.at_break() {
            passed.push(self.peek(0));
            self.at += 1;
        }
        passed
    }
}
