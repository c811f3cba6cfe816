//! Noun phrases: "the second double door", "Nick's office", "the Stata cafeteria", "the nearest restroom".

use crate::language::act::{Features, Head, Ordinal, Owner, Phrase, Sameness};
use crate::language::grammar::cursor::Cursor;
use crate::language::lexicon::names::{Kind, MAX_NAME_WORDS, Name, is_plural};
use crate::language::lexicon::normalise::{COMMA, Word};
use crate::language::lexicon::numbers::counted;
use crate::language::lexicon::{concept, is_compound, is_function_word, is_place, is_quality};

/// How a noun phrase begins.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Determiner {
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

/// A noun phrase without what follows it.
#[derive(Clone, Debug)]
pub(crate) struct NounPhrase {
    pub(crate) determiner: Determiner,
    pub(crate) sameness: Sameness,
    pub(crate) phrase: Phrase,
    pub(crate) kind: Kind,
}

impl NounPhrase {
    /// Its label or, for a mere description, the name of its kind.
    pub(crate) fn name(&self) -> Option<Name> {
        self.phrase.full_name()
    }

    pub(crate) fn is_plural(&self) -> bool {
        self.phrase.features.plural
    }

    /// Is it told from others by its place in a row, its owner or its surroundings?
    pub(crate) fn is_told(&self) -> bool {
        let f = &self.phrase.features;
        f.ordinal.is_some() || f.owner.is_some() || f.count.is_some() || !self.phrase.within.is_empty()
    }
}

/// What comes before the name.
struct Start {
    determiner: Determiner,
    sameness: Sameness,
    features: Features,
}

/// Group nouns whose possessive is part of a name: "women's bathroom".
const GROUPS: [&str; 7] = ["men's", "women's", "children's", "people's", "janitor's", "nurse's", "driver's"];
/// Says how many of what follows; the head comes after it.
const MEASURES: &str =
    "set of|sets of|pair of|pairs of|flight of|flights of|bank of|row of|couple of|group of";
const PLURAL_MEASURES: &str = "sets of|pairs of|flights of";

impl Cursor<'_> {
    /// Reads a noun phrase; none, and the position unchanged, if none stands here.
    pub(crate) fn noun_phrase(&mut self) -> Option<NounPhrase> {
        let mut next = *self;
        let Start { determiner, sameness, mut features } = next.start();
        if let Some(one) = next.one(determiner, &features) {
            *self = next;
            return Some(one);
        }
        let mut words: Vec<(&Word, bool)> = Vec::new();
        while next.continues_name(&words) {
            if words.len() > MAX_NAME_WORDS {
                return None;
            }
            words.push((next.word()?, next.at_start()));
            next.step();
        }
        let texts: Vec<&str> = words.iter().map(|(w, _)| w.text.as_str()).collect();
        features.plural = is_plural(&texts);
        let rest = owner(&words, &mut features);
        let rest = qualities(rest, &mut features);
        let rest = proper(rest, &mut features);
        let head: Vec<&str> = rest.iter().map(|(w, _)| w.text.as_str()).collect();
        let phrase = Phrase { head: Head::Named(Name::from_words(&head)?), features, within: Vec::new() };
        let kind = phrase.full_name()?.kind();
        *self = next;
        Some(NounPhrase { determiner, sameness, phrase, kind })
    }

    /// "The one" of "the one after the kitchen", the noun left out of "the second on the left".
    fn one(&mut self, determiner: Determiner, features: &Features) -> Option<NounPhrase> {
        let told = determiner == Determiner::Definite;
        let left_out = features.ordinal.is_some() && self.sees("on|to|past|after|down|before|from");
        if !(told && (left_out || self.eat_any("one|ones").is_some())) {
            return None;
        }
        let phrase = Phrase { head: Head::Place, features: features.clone(), within: Vec::new() };
        Some(NounPhrase { determiner, sameness: Sameness::Open, phrase, kind: Kind::Vague })
    }

    /// "Nick's", "mine", "yours": an owner without a noun.
    pub(crate) fn owner_alone(&mut self) -> Option<Owner> {
        if self.eat_any("mine|my own|ours").is_some() {
            return Some(Owner::Speaker);
        }
        let mut next = *self;
        let mut said = Vec::new();
        next.eat("the");
        while said.len() < 3 {
            let word = next.word()?;
            next.step();
            said.push(word);
            if word.text.ends_with("'s") {
                let ends = next.at_break() || next.sees("and|but|now|too|though|then");
                let owner = ends.then(|| Owner::Named(owned_by(&said)));
                *self = if ends { next } else { *self };
                return owner;
            }
            if is_function_word(&word.text) {
                return None;
            }
        }
        None
    }

    /// Does a list of noun phrases go on here: "…, the lounge and the gym"?
    pub(crate) fn lists(&self) -> bool {
        let mut next = *self;
        next.noun_phrase().is_some() && (next.sees("and") || (next.eat(",") && next.sees("the|and")))
    }

    /// A person's name of up to three words.
    pub(crate) fn person(&mut self) -> Option<String> {
        let mut said = Vec::new();
        while said.len() < 3
            && let Some(word) = self.word().filter(|w| w.text != COMMA && !is_function_word(&w.text))
        {
            said.push(word);
            self.step();
        }
        (!said.is_empty()).then(|| owned_by(&said))
    }

    fn start(&mut self) -> Start {
        use Determiner::{Definite, Demonstrative, Indefinite, None, Possessive};
        let begins = [
            ("yet another|another|a different|one more", Indefinite, Sameness::Other),
            ("the other|that other", Definite, Sameness::Other),
            ("the exact same|the very same|the same|that same|our same", Definite, Sameness::Same),
            ("both the|both|either|the", Definite, Sameness::Open),
            ("a|an|some", Indefinite, Sameness::Open),
            ("this|that|these|those", Demonstrative, Sameness::Open),
            ("our|my|your|his|her|their", Possessive, Sameness::Open),
        ];
        let this = self.sees("this|these");
        let mine = self.sees("my");
        let counted_other = self.sees("a second|a third");
        let found = begins.into_iter().find(|(phrases, ..)| self.eat_any(phrases).is_some());
        let (determiner, sameness) = found.map_or((None, Sameness::Open), |(_, d, s)| (d, s));
        let mut features = Features { this, other: sameness == Sameness::Other, ..Features::default() };
        if mine {
            features.owner = Some(Owner::Speaker);
        }
        self.skip("very|own|first available");
        if counted_other && self.eat_any("second|third").is_some() {
            return Start { determiner, sameness: Sameness::Other, features };
        }
        loop {
            let next = self.peek(1);
            let more = !next.is_empty() && next != COMMA;
            if self.eat_any("nearest|closest").is_some() {
                features.nearest = true;
            } else if let Some(n) = self.ordinal().filter(|_| {
                more && !(next == "floor"
                    && !is_function_word(self.peek(2))
                    && !matches!(self.peek(2), "" | COMMA))
            }) {
                self.step();
                features.ordinal = Some(n);
            } else if let Some(n) = counted(self.peek(0))
                .filter(|_| {
                    features.count.is_none() && more && counted(next).is_none() && determiner != Indefinite
                })
                .filter(|_| !is_function_word(next) || self.counts_measure())
            {
                self.step();
                features.count = Some(n);
            } else {
                break;
            }
        }
        if let Some(measure) = self.eat_any(MEASURES) {
            features.plural = PLURAL_MEASURES.contains(measure);
        }
        Start { determiner, sameness, features }
    }

    fn counts_measure(&self) -> bool {
        let mut next = *self;
        next.step();
        next.sees(MEASURES)
    }

    /// The ordinal that the word here is, before a noun ("second floor lobby" is a name).
    fn ordinal(&self) -> Option<Ordinal> {
        let nth = match self.peek(0) {
            "next" if self.peek(1) == "door" && self.before() != "the" => return None,
            "next" if self.peek(1) != "to" => return Some(Ordinal::Next),
            "last" | "final" => return Some(Ordinal::Last),
            "first" | "1st" => 1,
            "second" | "2nd" => 2,
            "third" | "3rd" => 3,
            "fourth" | "4th" => 4,
            "fifth" | "5th" => 5,
            "sixth" | "6th" => 6,
            "seventh" | "7th" => 7,
            "eighth" | "8th" => 8,
            "ninth" | "9th" => 9,
            "tenth" | "10th" => 10,
            _ => return None,
        };
        // "The first on the left" has no noun; "first aid room" is a name.
        let noun_follows = !is_function_word(self.peek(1)) || self.peek(1) == "one";
        let side_follows =
            matches!(self.peek(1), "on" | "to" | "past" | "after" | "down" | "before" | "from");
        (self.peek(1) != "aid" && (noun_follows || side_follows)).then_some(Ordinal::Nth(nth))
    }

    /// Does the word here belong to the name begun by `words`?
    fn continues_name(&self, words: &[(&Word, bool)]) -> bool {
        let (word, next) = (self.peek(0), self.peek(1));
        let last = words.last().map_or("", |(w, _)| w.text.as_str());
        match word {
            "" | COMMA | "and" => false,
            // "back", "next", "close" are adjectives but in these.
            "next" | "close" | "closest" | "adjacent" | "nearest" | "parallel" if next == "to" => false,
            "next" if next == "door" => false,
            "left" | "right"
                if matches!(next, "of" | "before" | "after" | "past" | "behind" | "at" | "in") =>
            {
                false
            }
            "right"
                if matches!(
                    next,
                    "here"
                        | "now"
                        | "there"
                        | "next"
                        | "by"
                        | "down"
                        | "through"
                        | "near"
                        | "across"
                        | "around"
                        | "outside"
                        | "beside"
                        | "up"
                        | "over"
                        | "inside"
                        | "off"
                ) =>
            {
                false
            }
            "back" | "left" | "right" | "north" | "south" | "east" | "west" if !words.is_empty() => false,
            "north" | "south" | "east" | "west" if next == "of" => false,
            "once" if matches!(next, "more" | "again") => false,
            // "Another lounge two floors up".
            _ if !words.is_empty()
                && counted(word).is_some()
                && matches!(
                    next,
                    "floor"
                        | "floors"
                        | "level"
                        | "levels"
                        | "flights"
                        | "flight"
                        | "story"
                        | "stories"
                        | "door"
                        | "doors"
                        | "rooms"
                        | "offices"
                        | "meters"
                        | "metres"
                        | "feet"
                        | "yards"
                        | "steps"
                ) =>
            {
                false
            }
            "smells" | "looks" | "lies" | "sits" | "one" | "ones" if is_place(last) && next.is_empty() => {
                word == "one"
            }
            // "gate a"
            "a" => !words.is_empty() && matches!(next, "" | COMMA),
            // "hall of fame"
            "of" => !words.is_empty() && !next.is_empty() && (next == "the" || !is_function_word(next)),
            "the" => last == "of",
            _ => !is_function_word(word),
        }
    }
}

/// Takes "Nick's" off the front of a name.
fn owner<'w, 'a>(words: &'w [(&'a Word, bool)], features: &mut Features) -> &'w [(&'a Word, bool)] {
    let at = words.iter().position(|(w, _)| w.text.ends_with("'s"));
    match at {
        Some(at) if at + 1 < words.len() && !GROUPS.contains(&words[at].0.text.as_str()) => {
            let said: Vec<&Word> = words[..=at].iter().map(|(w, _)| *w).collect();
            features.owner = Some(Owner::Named(owned_by(&said)));
            &words[at + 1..]
        }
        _ => words,
    }
}

/// "Doctor Smith" of "doctor smith's".
fn owned_by(words: &[&Word]) -> String {
    let names: Vec<String> = words.iter().map(|w| titled(w.text.trim_end_matches("'s"))).collect();
    names.join(" ")
}

fn titled(word: &str) -> String {
    let mut chars = word.chars();
    chars.next().map_or_else(String::new, |c| c.to_uppercase().chain(chars).collect())
}

/// Takes adjectives off the front, unless the lexicon knows the whole.
fn qualities<'w, 'a>(words: &'w [(&'a Word, bool)], features: &mut Features) -> &'w [(&'a Word, bool)] {
    let mut rest = words;
    while let [(first, _), second, ..] = rest
        && is_quality(&first.text)
        && !is_compound(&first.text, &second.0.text)
    {
        features.qualities.push(first.text.clone());
        rest = &rest[1..];
    }
    rest
}

/// Takes a proper name off the front: "Stata" of "the Stata cafeteria", not "Mail" of "the Mail Room".
fn proper<'w, 'a>(words: &'w [(&'a Word, bool)], features: &mut Features) -> &'w [(&'a Word, bool)] {
    let known = |from: usize| {
        let texts: Vec<&str> = words[from..].iter().map(|(w, _)| w.text.as_str()).collect();
        Name::from_words(&texts).is_some_and(|n| concept(n.as_str()).is_some() || is_place(n.as_str()))
    };
    let Some(head) = (0..words.len()).find(|&from| known(from)) else { return words };
    let named = words[..head].iter().all(|(w, first)| w.capital && (!first || !is_function_word(&w.text)));
    if head == 0 || !named {
        return words;
    }
    let name: Vec<String> = words[..head].iter().map(|(w, _)| titled(&w.text)).collect();
    features.name = Some(name.join(" "));
    &words[head..]
}
