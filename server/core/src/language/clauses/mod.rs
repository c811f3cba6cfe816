//! Spatial description clauses of route texts: figure, verb, relation and landmark, as spans of the text
//! (Kollar et al., "Toward Understanding Natural Language Directions", 2010). A chunker from left to
//! right: it extracts what it finds, unlike `parse`, which must understand all of a sentence.
//!
//! ```text
//! sentence = {[connective] (figure verb | verb | ) {relation landmark {("and" | "or") landmark}}}
//! ```
//! A clause without a verb of its own repeats the last one of its sentence.

mod chunks;
mod extents;

use crate::language::clauses::chunks::{
    CONNECTIVES, COPULAS, MOTION, RELATIONS, SEEING, Token, eats, is_one_of, relation_alone, tokens,
};
use crate::language::clauses::extents::{clause_starts, ends_landmark, verb_end};
use std::ops::Range;

/// One clause. Spans count characters of the text.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Clause {
    /// What lies or goes.
    pub figure: Option<Range<usize>>,
    /// What it does.
    pub verb: Option<Range<usize>>,
    /// How, to the landmark.
    pub relation: Option<Range<usize>>,
    /// What it is told by, with all that tells it.
    pub landmark: Option<Range<usize>>,
}

/// The clauses of a text, in order. Linear in the text.
pub fn clauses(text: &str) -> Vec<Clause> {
    let tokens = tokens(text);
    let mut out = Vec::new();
    for sentence in tokens.split(Token::ends_sentence) {
        Reader { tokens: sentence, at: 0, verb: None, pending: Vec::new(), out: &mut out }.sentence();
    }
    out
}

struct Reader<'a> {
    tokens: &'a [Token],
    at: usize,
    /// The last verb of the sentence.
    verb: Option<Range<usize>>,
    /// Clauses that wait for the verb that comes after them: "when you reach the wall, turn left".
    pending: Vec<Clause>,
    out: &'a mut Vec<Clause>,
}

impl Reader<'_> {
    fn sentence(&mut self) {
        while self.at < self.tokens.len() {
            let before = self.at;
            self.skip_connectives();
            let read = self.figure_clause() || self.verb_clause() || self.relation_clause();
            if !read && self.at == before {
                self.at += 1;
            } else if !read {
                // A word that begins no clause.
                self.at += usize::from(self.at < self.tokens.len());
            }
        }
        self.out.append(&mut self.pending);
    }

    fn word(&self, ahead: usize) -> &str {
        self.tokens.get(self.at + ahead).map_or("", |t| t.text.as_str())
    }

    fn span(&self, from: usize, to: usize) -> Option<Range<usize>> {
        let (first, last) = (self.tokens.get(from)?, self.tokens.get(to.checked_sub(1)?)?);
        (from < to).then_some(first.span.start..last.span.end)
    }

    fn skip_connectives(&mut self) {
        while self.at < self.tokens.len() && is_one_of(self.word(0), CONNECTIVES) {
            self.at += 1;
        }
    }

    /// "The room is the second door on the left", "you will see the elevators".
    fn figure_clause(&mut self) -> bool {
        let start = self.at;
        let with = self.word(0) == "with";
        let mut end = start + usize::from(with);
        let figure_start = end;
        while end < self.tokens.len()
            && end - figure_start < 9
            && !is_one_of(&self.tokens[end].text, COPULAS)
            && !self.tokens[end].is_break()
            && !is_one_of(
                &self.tokens[end].text,
                "and|or|then|until|when|walk|go|turn|take|continue|on|to|at|in|through|into",
            )
        {
            end += 1;
        }
        if with {
            return self.with_figure(figure_start);
        }
        let subject = end > figure_start && !is_one_of(&self.tokens[figure_start].text, MOTION);
        let copula = self.tokens.get(end).is_some_and(|t| is_one_of(&t.text, COPULAS));
        if !(subject && copula) {
            return self.you(start);
        }
        let figure = self.span(figure_start, end);
        self.at = end;
        self.finish_figure(figure);
        true
    }

    /// "You reach the end", "you get to the hall".
    fn you(&mut self, start: usize) -> bool {
        if !(self.word(0) == "you" && is_one_of(self.word(1), SEEING)) {
            return false;
        }
        let figure = self.span(start, start + 1);
        self.at = start + 1;
        self.finish_figure(figure);
        true
    }

    fn finish_figure(&mut self, figure: Option<Range<usize>>) {
        let start = self.at;
        while is_one_of(self.word(0), COPULAS)
            || (self.at > start && is_one_of(self.word(0), SEEING))
            || self.at == start
        {
            self.at += 1;
            while self.at > start
                && is_one_of(self.word(0), "now|currently|also|able|to|standing|located")
                && is_one_of(self.word(1), "be|see|in|at|on|facing|located|standing|pass")
            {
                self.at += 1;
            }
        }
        let verb = self.span(start, self.at);
        let relation = self.relation();
        let landmark = self.landmark();
        self.out.push(Clause { figure, verb, relation, landmark });
    }

    /// "With the elevators on your left": the elevators are on your left.
    fn with_figure(&mut self, figure_start: usize) -> bool {
        if is_one_of(self.word(1), "your|back") {
            return false;
        }
        let mut end = figure_start;
        while end < self.tokens.len()
            && !self.tokens[end].is_break()
            && !is_one_of(&self.tokens[end].text, "on|to|at|behind|in")
        {
            end += 1;
        }
        let figure = self.span(figure_start, end);
        self.at = end;
        let relation = self.relation();
        let landmark = if relation.is_some() { self.landmark() } else { None };
        self.out.push(Clause { figure, relation, landmark, ..Clause::default() });
        true
    }

    /// "Turn left at the lobby", "walk straight down the hall and through the door".
    fn verb_clause(&mut self) -> bool {
        let start = self.at;
        let mut end = verb_end(self.tokens, start);
        if end == start {
            return false;
        }
        // "Immediately turn left".
        if end < self.tokens.len()
            && is_one_of(&self.tokens[end].text, "immediately")
            && self.turns(start, end)
        {
            end += 1;
        }
        self.at = end;
        let verb = self.span(start, end);
        self.verb.clone_from(&verb);
        let waited = !self.pending.is_empty();
        for mut waiting in std::mem::take(&mut self.pending) {
            waiting.verb.clone_from(&verb);
            self.out.push(waiting);
        }
        if !self.relation_clause() {
            let landmark = self.landmark();
            let found = landmark.is_some();
            if found || !waited {
                self.out.push(Clause { verb, landmark, ..Clause::default() });
            }
            if found {
                self.more_landmarks(None);
            }
        }
        true
    }

    fn turns(&self, start: usize, end: usize) -> bool {
        self.tokens[start..end].iter().any(|t| matches!(t.text.as_str(), "left" | "right"))
    }

    /// A relation and its landmarks, with the sentence's last verb.
    fn relation_clause(&mut self) -> bool {
        let start = self.at;
        let Some(relation) = self.relation() else { return false };
        let word = self.tokens[start].text.clone();
        let landmark = self.landmark_of(&word);
        if landmark.is_none() && !relation_alone(&word) {
            self.at = start;
            return false;
        }
        let clause =
            Clause { verb: self.verb.clone(), relation: Some(relation.clone()), landmark, figure: None };
        let waits = self.verb.is_none() && is_one_of(&word, "when|once|after|before|right|just|past|at");
        let from = self.at;
        if waits {
            self.pending.push(clause);
        } else {
            self.out.push(clause);
        }
        self.inner(&word, start, from);
        if self.at == from {
            self.more_landmarks(Some(&relation));
        }
        true
    }

    /// "Until you see the wall" holds the clause "you see the wall", too.
    fn inner(&mut self, word: &str, start: usize, end: usize) {
        if !is_one_of(word, "until|till|when|once") {
            return;
        }
        let Some(you) = (start + 1..end.min(start + 3)).find(|&i| self.tokens[i].text == "you") else {
            return;
        };
        if is_one_of(word, "when|once") {
            return;
        }
        let after = self.at;
        self.at = you;
        if !self.figure_clause() {
            self.at = after;
        }
        self.at = self.at.max(after);
    }

    /// "… and the couches": the same relation to another landmark.
    fn more_landmarks(&mut self, relation: Option<&Range<usize>>) {
        loop {
            let start = self.at;
            if !is_one_of(self.word(0), "and|or|,") {
                return;
            }
            self.at += 1 + usize::from(self.word(0) == "," && is_one_of(self.word(1), "and|or"));
            let begins = is_one_of(
                self.word(0),
                "the|a|an|another|one|two|three|several|that|those|double|some|glass|couches",
            ) && verb_end(self.tokens, self.at) == self.at;
            let alone = !self.copula_follows();
            let landmark = if begins && alone { self.landmark() } else { None };
            let Some(landmark) = landmark else {
                self.at = start;
                return;
            };
            let verb = self.verb.clone();
            self.out.push(Clause {
                verb,
                relation: relation.cloned(),
                landmark: Some(landmark),
                figure: None,
            });
        }
    }

    fn copula_follows(&self) -> bool {
        (0..8)
            .map(|i| self.word(i))
            .take_while(|w| !matches!(*w, "" | "," | "."))
            .any(|w| is_one_of(w, COPULAS))
    }

    /// Reads a relation with its adverbs.
    fn relation(&mut self) -> Option<Range<usize>> {
        let start = self.at;
        let mut at = start;
        while at < start + 2
            && self.tokens.get(at).is_some_and(|t| {
                is_one_of(&t.text, "right|just|immediately|directly|straight|diagonally|back")
            })
        {
            at += 1;
        }
        let words = eats(&self.tokens[at.min(self.tokens.len())..], RELATIONS)?;
        self.at = at + words;
        self.span(start, self.at)
    }

    fn landmark_of(&mut self, word: &str) -> Option<Range<usize>> {
        if is_one_of(word, "until|till") {
            let start = self.at;
            let mut end = start;
            let mut depth = 0_i32;
            while let Some(token) = self.tokens.get(end) {
                depth += token.depth();
                if depth == 0
                    && (token.is_break()
                        || (end > start + 2
                            && is_one_of(&token.text, "and|then")
                            && clause_starts(self.tokens, end + 1)))
                {
                    break;
                }
                end += 1;
            }
            self.at = end;
            return self.span(start, end);
        }
        self.landmark()
    }

    /// A noun phrase with all that tells it, to where another clause begins.
    fn landmark(&mut self) -> Option<Range<usize>> {
        let start = self.at;
        let mut end = start;
        let mut depth = 0_i32;
        while let Some(token) = self.tokens.get(end) {
            depth += token.depth();
            if depth < 0 || (depth == 0 && ends_landmark(self.tokens, start, end)) {
                break;
            }
            end += 1;
        }
        self.at = end;
        self.span(start, end)
    }
}

#[cfg(test)]
mod tests;
