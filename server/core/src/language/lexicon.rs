//! What words are: a name is plausible as a place if its head noun is known, or if it is definite
//! ("the mural") and nothing speaks against it: the vocabulary stays open.

use super::word_lists::{
    COMPOUNDS, FUNCTION_WORDS, GENERIC, KEEP_S, LY_NOUNS, NOT_PLACES, PLACES, PRAISE, WEAK,
};

/// Spellings and words that mean the same wherever they stand in a name.
const SAME_WORD: &[(&str, &str)] = &[
    ("lift", "elevator"),
    ("restroom", "bathroom"),
    ("washroom", "bathroom"),
    ("toilet", "bathroom"),
    ("lavatory", "bathroom"),
    ("loo", "bathroom"),
    ("wc", "bathroom"),
    ("corridor", "hallway"),
    ("passageway", "hallway"),
    ("hallways", "hallway"),
    ("stair", "stairs"),
    ("staircase", "stairs"),
    ("stairway", "stairs"),
    ("stairwell", "stairs"),
    ("theatre", "theater"),
    ("centre", "center"),
    ("gymnasium", "gym"),
    ("laboratory", "lab"),
    ("canteen", "cafeteria"),
    ("photocopier", "copier"),
    ("info", "information"),
    ("entryway", "entrance"),
    ("bike", "bicycle"),
    ("tv", "television"),
    ("rec", "recreation"),
    ("mens", "men's"),
    ("womens", "women's"),
    ("childrens", "children's"),
    ("parlour", "parlor"),
];

/// Pairs of words that mean or spell the same as others.
const SAME_PAIR: &[(&str, &str, &[&str])] = &[
    ("water", "fountain", &["drinking", "fountain"]),
    ("bath", "room", &["bathroom"]),
    ("bed", "room", &["bedroom"]),
    ("class", "room", &["classroom"]),
    ("wash", "room", &["bathroom"]),
    ("rest", "room", &["bathroom"]),
    ("hall", "way", &["hallway"]),
    ("stair", "case", &["stairs"]),
    ("stair", "well", &["stairs"]),
    ("car", "park", &["parking", "lot"]),
    ("door", "way", &["doorway"]),
    ("copy", "machine", &["copier"]),
];

/// Words written together by some and apart by others: apart it is.
const APART: &[(&str, [&str; 2])] = &[
    ("mailroom", ["mail", "room"]),
    ("lunchroom", ["lunch", "room"]),
    ("storeroom", ["storage", "room"]),
    ("boardroom", ["board", "room"]),
    ("workroom", ["work", "room"]),
    ("playroom", ["play", "room"]),
    ("carpark", ["parking", "lot"]),
    ("darkroom", ["dark", "room"]),
];

fn listed(list: &[&str], word: &str) -> bool {
    list.binary_search(&word).is_ok()
}

/// Does this noun name a place by itself ("lobby")?
pub(super) fn is_place(word: &str) -> bool {
    listed(PLACES, word)
}

/// Do these two words name a spot together ("information desk")?
pub(super) fn is_compound(first: &str, second: &str) -> bool {
    let pair = format!("{first} {second}");
    listed(COMPOUNDS, &pair)
}

/// Does this noun need a telling modifier ("mail area")?
pub(super) fn is_generic(word: &str) -> bool {
    listed(GENERIC, word)
}

/// Does this modifier not tell one place from another ("large")?
pub(super) fn is_weak(word: &str) -> bool {
    listed(WEAK, word)
}

/// Does this word say that the name is not this place's ("the wrong kitchen")?
pub(super) fn is_disqualified(word: &str) -> bool {
    matches!(
        word,
        "wrong" | "fake" | "former" | "future" | "next" | "previous" | "possible" | "potential" | "imaginary"
    )
}

/// Is this modifier no part of a name ("beautiful")?
pub(super) fn is_praise(word: &str) -> bool {
    listed(PRAISE, word)
}

/// Does this noun speak against a place: a person, a time, an abstraction, a movable?
pub(super) fn is_not_a_place(word: &str) -> bool {
    // Abstract nouns and superlatives, recognised by their endings.
    const ABSTRACT: [&str; 13] =
        ["tion", "sion", "ment", "ness", "ity", "ism", "ance", "ence", "ship", "hood", "dom", "ology", "est"];
    listed(NOT_PLACES, word)
        || is_adverb(word)
        || (word.len() > 5 && ABSTRACT.iter().any(|end| word.ends_with(end)))
}

/// Can this word not be part of a name at all?
pub(super) fn is_function_word(word: &str) -> bool {
    listed(FUNCTION_WORDS, word) || is_adverb(word)
}

fn is_adverb(word: &str) -> bool {
    word.len() > 4 && word.ends_with("ly") && !listed(LY_NOUNS, word)
}

/// The one word used for all that mean the same as `word`.
pub(super) fn same_word(word: &str) -> &str {
    SAME_WORD.iter().find(|(from, _)| *from == word).map_or(word, |(_, to)| to)
}

/// What two neighbouring words become, if they are spelled or said otherwise too.
pub(super) fn same_pair(first: &str, second: &str) -> Option<&'static [&'static str]> {
    SAME_PAIR.iter().find(|(a, b, _)| *a == first && *b == second).map(|(_, _, to)| *to)
}

/// A compound written together, taken apart.
pub(super) fn apart(word: &str) -> Option<&'static [&'static str]> {
    APART.iter().find(|(from, _)| *from == word).map(|(_, to)| to.as_slice())
}

/// The singular of a head noun. Taught and asked names both pass here, so that they meet.
pub(super) fn singular(word: &str) -> String {
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
        for list in [PLACES, COMPOUNDS, GENERIC, WEAK, PRAISE, NOT_PLACES, FUNCTION_WORDS, KEEP_S, LY_NOUNS] {
            for pair in list.windows(2) {
                assert!(pair[0] < pair[1], "{pair:?}");
            }
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
