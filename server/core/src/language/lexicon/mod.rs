//! What words are: a name is plausible as a place if its head noun is known, or if it is definite
//! ("the mural") and nothing speaks against it: the vocabulary stays open.

pub(crate) mod concepts;
pub(crate) mod edits;
pub(crate) mod names;
pub(crate) mod normalise;
pub(crate) mod numbers;
pub(crate) mod word_lists;

use crate::language::lexicon::concepts::{CONCEPTS, SPOKEN, Type};
use crate::language::lexicon::word_lists::{
    COMPOUNDS, FUNCTION_WORDS, GENERIC, KEEP_S, LY_NOUNS, NOT_PLACES, PLACES, PRAISE, QUALITIES, WEAK,
};

fn listed(list: &[&str], word: &str) -> bool {
    list.binary_search(&word).is_ok()
}

/// What a concept is, if it is one of the lexicon's.
pub(crate) fn concept(name: &str) -> Option<Type> {
    CONCEPTS.binary_search_by(|(lemma, ..)| (*lemma).cmp(name)).ok().map(|i| CONCEPTS[i].1)
}

/// The kind of a concept: an elevator lobby is a lobby.
pub(crate) fn hypernym(name: &str) -> Option<&'static str> {
    CONCEPTS.binary_search_by(|(lemma, ..)| (*lemma).cmp(name)).ok().map(|i| CONCEPTS[i].2)
}

fn names_place(name: &str) -> bool {
    concept(name).is_some_and(|t| !matches!(t, Type::Thing | Type::Region))
}

/// All known places of one word.
pub(crate) fn places() -> impl Iterator<Item = &'static str> {
    let concepts = CONCEPTS.iter().map(|(lemma, ..)| *lemma).filter(|l| names_place(l) && !l.contains(' '));
    concepts.chain(PLACES.iter().copied())
}

/// All names of places that everybody knows, in their canonical spelling.
pub fn place_names() -> impl Iterator<Item = &'static str> {
    let concepts = CONCEPTS.iter().map(|(lemma, ..)| *lemma).filter(|l| names_place(l));
    concepts.chain(PLACES.iter().copied())
}

/// Does this noun name a place by itself ("lobby")?
pub(crate) fn is_place(word: &str) -> bool {
    listed(PLACES, word) || (names_place(word) && !is_generic(word))
}

/// Do these two words name a spot together ("information desk")?
pub(crate) fn is_compound(first: &str, second: &str) -> bool {
    let pair = format!("{first} {second}");
    listed(COMPOUNDS, &pair) || names_place(&pair)
}

/// Is it a thing that tells where a place is ("the whiteboard") but no place itself?
pub(crate) fn is_thing(word: &str) -> bool {
    concept(word) == Some(Type::Thing)
}

/// Is it an adjective that describes rather than names ("double", "big")?
pub(crate) fn is_quality(word: &str) -> bool {
    listed(QUALITIES, word)
}

/// Is it something one goes along?
pub(crate) fn is_way(word: &str) -> bool {
    matches!(
        word,
        "hallway" | "passage" | "aisle" | "walkway" | "tunnel" | "bridge" | "ramp" | "stairs" | "street"
    )
}

/// Names that several rooms of a building bear more often than not, as they are entered.
pub const COMMON: [&str; 26] = [
    "office",
    "bathroom",
    "elevator",
    "elevator lobby",
    "lobby",
    "lounge",
    "entrance",
    "exit",
    "door",
    "stairwell",
    "meeting room",
    "conference room",
    "classroom",
    "lab",
    "storage room",
    "closet",
    "copy room",
    "printer",
    "kitchenette",
    "seating area",
    "waiting area",
    "bedroom",
    "ward",
    "room",
    "stairway",
    "desk",
];

/// Does this noun need a telling modifier ("mail area")?
pub(crate) fn is_generic(word: &str) -> bool {
    listed(GENERIC, word)
}

/// Does this modifier not tell one place from another ("large")?
pub(crate) fn is_weak(word: &str) -> bool {
    listed(WEAK, word)
}

/// Does this word say that the name is not this place's ("the wrong kitchen")?
pub(crate) fn is_disqualified(word: &str) -> bool {
    matches!(
        word,
        "wrong" | "fake" | "former" | "future" | "next" | "previous" | "possible" | "potential" | "imaginary"
    )
}

/// Is this modifier no part of a name ("beautiful")?
pub(crate) fn is_praise(word: &str) -> bool {
    listed(PRAISE, word)
}

/// Does this noun speak against a place: a person, a time, an abstraction, a movable?
pub(crate) fn is_not_a_place(word: &str) -> bool {
    // Abstract nouns and superlatives, recognised by their endings.
    const ABSTRACT: [&str; 13] =
        ["tion", "sion", "ment", "ness", "ity", "ism", "ance", "ence", "ship", "hood", "dom", "ology", "est"];
    listed(NOT_PLACES, word)
        || is_adverb(word)
        || (word.len() > 5 && ABSTRACT.iter().any(|end| word.ends_with(end)))
}

/// Can this word not be part of a name at all?
pub(crate) fn is_function_word(word: &str) -> bool {
    listed(FUNCTION_WORDS, word) || is_adverb(word)
}

/// Does this word look like an adverb in -ly?
pub(crate) fn is_adverb(word: &str) -> bool {
    word.len() > 4 && word.ends_with("ly") && !listed(LY_NOUNS, word)
}

/// What a word, or two with a space between, is called in names, if it is said otherwise too.
pub(crate) fn unified(said: &str) -> Option<&'static str> {
    SPOKEN.binary_search_by(|(form, _)| (*form).cmp(said)).ok().map(|i| SPOKEN[i].1)
}

/// The singular of a head noun. Taught and asked names both pass here, so that they meet.
pub(crate) fn singular(word: &str) -> String {
    let keeps = word.len() < 4
        || listed(KEEP_S, word)
        || ["ss", "us", "is", "'s"].iter().any(|end| word.ends_with(end));
    if keeps || !word.ends_with('s') {
        return word.to_owned();
    }
    if let Some(stem) = word.strip_suffix("ies").filter(|stem| stem.len() > 1) {
        return format!("{stem}y");
    }
    let es = ["ches", "shes", "xes", "sses", "zes"].iter().any(|end| word.ends_with(end));
    word[..word.len() - if es { 2 } else { 1 }].to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lists_are_sorted_and_without_doubles() {
        for list in [
            PLACES,
            COMPOUNDS,
            GENERIC,
            WEAK,
            PRAISE,
            NOT_PLACES,
            FUNCTION_WORDS,
            KEEP_S,
            LY_NOUNS,
            QUALITIES,
        ] {
            for pair in list.windows(2) {
                assert!(pair[0] < pair[1], "{pair:?}");
            }
        }
        for pair in CONCEPTS.windows(2) {
            assert!(pair[0].0 < pair[1].0, "{pair:?}");
        }
        for pair in SPOKEN.windows(2) {
            assert!(pair[0].0 < pair[1].0, "{pair:?}");
        }
    }

    #[test]
    fn heads_become_singular_where_that_is_safe() {
        for (many, one) in [
            ("fountains", "fountain"),
            ("lobbies", "lobby"),
            ("boxes", "box"),
            ("benches", "bench"),
            ("stairs", "stairs"),
            ("glass", "glass"),
            ("campus", "campus"),
            ("mural", "mural"),
            ("men's", "men's"),
        ] {
            assert_eq!(singular(many), one);
            assert_eq!(singular(one), one);
        }
    }
}
