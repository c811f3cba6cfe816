//! Names of places: one spelling for all that people say and write for the same.

use crate::language::lexicon::concepts::Type;
use crate::language::lexicon::normalise::{COMMA, name_words};
use crate::language::lexicon::numbers::{is_number, numbers_as_spoken};
use crate::language::lexicon::{
    COMMON, concept, hypernym, is_compound, is_disqualified, is_generic, is_not_a_place, is_place, is_praise,
    is_thing, is_way, is_weak, singular, unified,
};
use serde::{Deserialize, Serialize};
use std::fmt;

/// A name of at most this many words is taken in.
pub(crate) const MAX_NAME_WORDS: usize = 8;
/// And of at most this many characters: it stands on maps, and in every answer.
const MAX_NAME_CHARS: usize = 100;

/// A place name in its canonical spelling, the one used as a label: lower case, words joined by
/// single spaces, no determiner, singular head, synonyms unified ("the restrooms" is `bathroom`),
/// numbers as spoken ("Lecture Hall 123" is `lecture hall one twenty three`).
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(transparent)]
pub struct Name(String);

/// What speaks for a name being a place's.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
    /// Its head noun names places.
    Place,
    /// Unknown, and nothing speaks against it.
    Open,
    /// Its head noun names a thing that places are told by: a table, a corner.
    Thing,
    /// A place that nothing tells from others: "the room", "the area".
    Vague,
    /// It names something else.
    No,
}

impl Name {
    /// From what a person wrote; none if no word is left ("the").
    pub fn new(text: &str) -> Option<Self> {
        let plain = name_words(text);
        let words: Vec<&str> = plain.iter().map(|w| w.text.as_str()).filter(|w| *w != COMMA).collect();
        Self::from_words(&words)
    }

    /// From plain words; none if there is none beside determiners, or too many.
    pub(crate) fn from_words(words: &[&str]) -> Option<Self> {
        let mut canonical = canonical(words);
        canonical.retain(|word| !word.is_empty());
        // Spelling may add words ("2b4", "two b four"): the result must be a name, too.
        let fits = words.len().max(canonical.len()) <= 2 * MAX_NAME_WORDS;
        let name = canonical.join(" ");
        (!name.is_empty() && fits && name.chars().count() <= MAX_NAME_CHARS).then_some(Self(name))
    }

    /// The canonical spelling.
    pub fn as_str(&self) -> &str {
        &self.0
    }

    /// The kind of its concept, if the lexicon has one: "lobby" for an elevator lobby, "lab" for a robotics
    /// lab.
    pub fn hypernym(&self) -> Option<&str> {
        hypernym(&self.0).or_else(|| self.0.split_once(' ').and_then(|(_, last)| concept(last).map(|_| last)))
    }

    /// Whether it names what one goes along: a hallway, a ramp.
    pub fn is_way(&self) -> bool {
        let words: Vec<&str> = self.0.split(' ').collect();
        head(&words).is_some_and(|at| is_way(words[at]))
    }

    /// Whether several rooms of a building bear it more often than not.
    pub fn is_common(&self) -> bool {
        COMMON.contains(&self.0.as_str())
    }

    /// What speaks for it being a place's name.
    pub(crate) fn kind(&self) -> Kind {
        let words: Vec<&str> = self.0.split(' ').collect();
        let Some(at) = head(&words) else { return Kind::No };
        let (noun, modifiers) = (words[at], &words[..at]);
        if words.iter().any(|w| is_disqualified(w)) || is_number(words[0]) {
            return Kind::No;
        }
        if is_place(noun) || (at > 0 && is_compound(words[at - 1], noun)) {
            return Kind::Place;
        }
        if is_generic(noun) {
            let numbered = at + 1 < words.len() && words[at + 1] != "of";
            let told = modifiers.iter().any(|w| !is_weak(w) && !w.ends_with("est"));
            return if numbered || told { Kind::Place } else { Kind::Vague };
        }
        // A desk is a place where it is somebody's.
        if noun == "desk" && words[0].ends_with("'s") {
            return Kind::Place;
        }
        if is_thing(noun) || (at > 0 && is_thing(&words[at - 1..=at].join(" "))) {
            return Kind::Thing;
        }
        let late_gerund = words.iter().skip(1).any(|w| w.ends_with("ing"));
        // "The only parameter" is no place, nor is "the stock market's end".
        let unlikely = words.iter().any(|w| is_weak(w) || is_not_a_place(w.trim_end_matches("'s")));
        let odd = unlikely || late_gerund || words.len() > 4 || noun.len() < 3 || is_praise(noun);
        if odd { Kind::No } else { Kind::Open }
    }

    /// Whether nothing tells what it names from others, or that it is none: "large room", "the wrong room".
    pub(crate) fn is_vague(&self) -> bool {
        self.0.split(' ').any(is_disqualified) || self.kind() == Kind::Vague
    }

    /// Its head noun.
    pub(crate) fn head(&self) -> Option<&str> {
        let words: Vec<&str> = self.0.split(' ').collect();
        head(&words).map(|at| words[at])
    }

    /// The name with its article, as one says it: "the gym", "lecture hall five", "nick's office".
    pub fn with_article(&self) -> String {
        let first = self.0.split(' ').next().unwrap_or_default();
        let last = self.0.split(' ').next_back().unwrap_or_default();
        // "children's center" takes an article, "nick's office" does not: only the group nouns do.
        let owner =
            first.ends_with("'s") && !matches!(first, "children's" | "men's" | "women's" | "people's");
        if owner || is_number(last) { self.0.clone() } else { format!("the {}", self.0) }
    }
}

impl fmt::Display for Name {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

/// Index of the head noun: the word before "of", else the last before numbers and single letters.
fn head(words: &[&str]) -> Option<usize> {
    let end = words.iter().position(|w| *w == "of").unwrap_or(words.len());
    words[..end].iter().rposition(|w| w.len() > 1 && !is_number(w))
}

/// Is the head noun a plural ("the drinking fountains")?
pub(crate) fn is_plural(words: &[&str]) -> bool {
    head(words).is_some_and(|at| singular(words[at]) != words[at])
}

/// The canonical words; applied to its own result it changes nothing.
fn canonical(words: &[&str]) -> Vec<String> {
    let mut kept: Vec<String> = Vec::new();
    for (at, word) in words.iter().enumerate() {
        let last = at + 1 == words.len();
        let article = matches!(*word, "the" | "an") || (*word == "a" && (!last || kept.is_empty()));
        let possessive = kept.is_empty() && matches!(*word, "our" | "my" | "your" | "his" | "her" | "their");
        if !(article || possessive || (is_praise(word) && !last)) {
            kept.push(ordinal(word).to_owned());
        }
    }
    let view: Vec<&str> = kept.iter().map(String::as_str).collect();
    if let Some(at) = head(&view) {
        let one = singular(view[at]);
        kept[at] = one;
    }
    let mut words: Vec<String> = Vec::with_capacity(kept.len() + 1);
    let mut at = 0;
    while at < kept.len() {
        let pair = kept.get(at + 1).and_then(|next| unified(&format!("{} {next}", kept[at])));
        let said = pair.or_else(|| unified(&kept[at])).unwrap_or(&kept[at]);
        words.extend(said.split(' ').map(str::to_owned));
        at += 1 + usize::from(pair.is_some());
    }
    plain_hall_is_hallway(&mut words);
    if let [only] = &words[..]
        && matches!(only.as_str(), "men's" | "women's" | "gent")
    {
        let whose = if only == "women's" { "women's" } else { "men's" };
        words = vec![whose.to_owned(), "room".to_owned()];
    }
    numbers_as_spoken(&of_last(words))
}

/// "Lab of biology" is the biology lab, "room of number three" room three.
fn of_last(mut words: Vec<String>) -> Vec<String> {
    let Some(at) = words.iter().position(|w| w == "of") else { return words };
    let is_room = at > 0 && words[at - 1] != "hall" && concept(&words[at - 1]) == Some(Type::Room);
    let once = words.iter().filter(|w| *w == "of").count() == 1 && at + 1 < words.len();
    if !is_room || !once {
        return words;
    }
    let mut told = words.split_off(at);
    told.remove(0);
    told.retain(|w| w != "number");
    if told.iter().all(|w| is_number(w)) {
        words.extend(told);
        return words;
    }
    told.extend(words);
    told
}

/// "Hall" by itself is a hallway; in "lecture hall" it is not.
fn plain_hall_is_hallway(words: &mut [String]) {
    const ANY_HALL: [&str; 12] = [
        "long", "short", "narrow", "wide", "front", "back", "side", "upper", "lower", "dark", "whole",
        "other",
    ];
    if let Some((last, before)) = words.split_last_mut()
        && last == "hall"
        && before.iter().all(|w| ANY_HALL.contains(&w.as_str()))
    {
        "hallway".clone_into(last);
    }
}

fn ordinal(word: &str) -> &str {
    match word {
        "1st" => "first",
        "2nd" => "second",
        "3rd" => "third",
        "4th" => "fourth",
        "5th" => "fifth",
        "6th" => "sixth",
        "7th" => "seventh",
        "8th" => "eighth",
        "9th" => "ninth",
        "10th" => "tenth",
        _ => word,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn name(text: &str) -> String {
        Name::new(text).map(|n| n.to_string()).unwrap_or_default()
    }

    #[test]
    fn what_people_call_the_same_meets() {
        for (a, b) in [
            ("the drinking fountains", "Drinking Fountain"),
            ("the water fountain", "drinking fountains"),
            ("Lecture Hall 123", "lecture hall one twenty three"),
            ("lecture hall one two three", "lecture hall one hundred and twenty three"),
            ("room 105", "room one oh five"),
            ("the restrooms", "the bathroom"),
            ("rest room", "washroom"),
            ("the hall", "hallway"),
            ("a corridor", "the hallways"),
            ("lift lobby", "the elevator lobby"),
            ("mens room", "the men’s room"),
            ("the staircase", "stairs"),
            ("the Café", "our cafe"),
            ("the Z-center", "Z center"),
            ("mailroom", "the mail room"),
            ("the beautiful lobby", "lobby"),
            ("gate A", "the gate a"),
            ("laboratory of biology", "the biology lab"),
            ("meeting room of number three", "meeting room 3"),
            ("the gents", "the men's room"),
        ] {
            assert_eq!(name(a), name(b));
            assert!(!name(a).is_empty());
        }
    }

    #[test]
    fn different_names_stay_apart() {
        for (a, b) in [
            ("lecture hall", "hallway"),
            ("lecture hall 123", "lecture hall 155"),
            ("back entrance", "main entrance"),
            ("cafe", "cafeteria"),
            ("mail area", "mail room"),
            ("room 12", "room 102"),
        ] {
            assert_ne!(name(a), name(b));
        }
        assert_eq!(name("lecture halls"), "lecture hall");
        assert_eq!(Name::new("the"), None);
        assert_eq!(Name::new("?!"), None);
    }

    #[test]
    fn names_are_judged_by_their_heads() {
        for (text, kind) in [
            ("elevator lobby", Kind::Place),
            ("lecture hall 123", Kind::Place),
            ("mail area", Kind::Place),
            ("room 5", Kind::Place),
            ("information desk", Kind::Place),
            ("Z-center", Kind::Place),
            ("department of linguistics", Kind::Place),
            ("fishbowl", Kind::Open),
            ("vending machines", Kind::Place),
            ("large room", Kind::Vague),
            ("next room", Kind::No),
            ("end of the hall", Kind::Thing),
            ("plan", Kind::No),
            ("best", Kind::No),
            ("greatest", Kind::No),
            ("situation", Kind::No),
            ("kitchen table", Kind::Thing),
            ("one", Kind::No),
            ("five", Kind::No),
        ] {
            assert_eq!(Name::new(text).unwrap().kind(), kind, "{text}");
        }
    }

    #[test]
    fn articles_are_put_where_one_says_them() {
        for (text, said) in [
            ("gym", "the gym"),
            ("lecture hall 123", "lecture hall one twenty three"),
            ("Nick's office", "nick's office"),
            ("childrens center", "the children's center"),
        ] {
            assert_eq!(Name::new(text).unwrap().with_article(), said);
        }
    }

    proptest! {
        #[test]
        fn canonical_spelling_is_a_fixed_point(text in "(the )?([a-z0-9']{1,7} |rooms? |hall |lifts |stairs? |water |[0-9]{1,5} |of |hundred |oh |one |twenty ){1,6}") {
            if let Some(once) = Name::new(&text) {
                prop_assert_eq!(Name::new(once.as_str()), Some(once.clone()));
            }
        }
    }
}
