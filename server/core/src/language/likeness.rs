//! Names that are like others: misheard ones by their sound, synonyms by how often people mean one place by both,
//! kinds by their heads.

use crate::language::lexicon::edits::edits;
use crate::language::lexicon::names::Name;
use crate::language::lexicon::numbers::is_number;
use crate::language::lexicon::{concept, hypernym};
use crate::language::reader::lexicon::{Class, lexicon};
use crate::language::reader::sound::sound;
use std::sync::LazyLock;

/// P(a name was misheard) that sounds just like another, …
const SOUNDS_ALIKE: f64 = 0.8;
/// … and nearly.
const SOUNDS_NEARLY: f64 = 0.5;
/// Shorter words sound nearly like too many.
const NEARLY_MIN: usize = 4;

/// P(another name was meant) by its sound; 0 if they are not alike. Words that everybody knows are not misheard,
/// nor are numbers: "gate two" is not "gate too".
pub fn misheard(said: &str, other: &str) -> f64 {
    let (a, b): (Vec<&str>, Vec<&str>) = (said.split(' ').collect(), other.split(' ').collect());
    let before = a.iter().zip(&b).take_while(|(x, y)| x == y).count();
    let backwards = a[before..].iter().rev().zip(b[before..].iter().rev());
    let behind = backwards.take_while(|(x, y)| x == y).count();
    let (a, b) = (&a[before..a.len() - behind], &b[before..b.len() - behind]);
    let numbers = a.iter().chain(b).any(|w| is_number(w) || w.len() == 1);
    if a.is_empty() || b.is_empty() || numbers || a.iter().all(|w| is_known(w)) {
        return 0.0;
    }
    let (a, b) = (sound(&a.concat()), sound(&b.concat()));
    match edits(&a, &b) {
        0 if !a.is_empty() => SOUNDS_ALIKE,
        1 if a.len().min(b.len()) >= NEARLY_MIN => SOUNDS_NEARLY,
        _ => 0.0,
    }
}

/// Whether a word is one that everybody knows.
fn is_known(word: &str) -> bool {
    lexicon().class(word) != Class::Open
        || lexicon().is_of_places(word)
        || lexicon().sense(word).is_some()
        || concept(word).is_some()
}

static SYNONYMS: LazyLock<Vec<(String, String, f64)>> = LazyLock::new(|| {
    let lines = include_str!("../../lexicon/english/synonyms.txt").lines().filter(|l| !l.starts_with('#'));
    let canonical = |name: &str| Name::new(name).map(|name| name.as_str().to_owned());
    let pair = |line: &str| {
        let (p, names) = line.split_once(':')?;
        let (a, b) = names.split_once('=')?;
        Some((canonical(a)?, canonical(b)?, p.trim().parse().ok()?))
    };
    lines.filter_map(pair).collect()
});

/// P(both names are one place's), where one of them is known near by; 0 if they are no synonyms.
pub fn synonyms(a: &str, b: &str) -> f64 {
    let are = |(x, y, _): &&(String, String, f64)| x == a && y == b || x == b && y == a;
    SYNONYMS.iter().find(are).map_or(0.0, |(.., p)| *p)
}

/// Whether who asks for a kind may mean a name of it: "the archive", "old archive"; "lecture hall", "lecture
/// hall three"; "meeting room", "board room".
pub fn is_of_kind(name: &str, kind: &str) -> bool {
    if name == kind {
        return false;
    }
    let numbered = name.strip_prefix(kind).and_then(|rest| rest.strip_prefix(' '));
    let numbered = numbered.is_some_and(|rest| rest.split(' ').all(|w| is_number(w) || w.len() == 1));
    let modified = name.strip_suffix(kind).is_some_and(|rest| rest.ends_with(' '));
    // "Room", "office": what everything is tells nothing apart, but a modifier of it does.
    numbered || modified || hypernym(name) == Some(kind) && hypernym(kind) != Some("place")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn misheard_names_sound_like_others() {
        for (said, meant) in [
            ("male room", "mail room"),
            ("sever room", "server room"),
            ("lap", "lab"),
            ("key osk", "kiosk"),
            ("jim", "gym"),
        ] {
            assert!(misheard(said, meant) > 0.4, "{said} {meant} {} {}", sound(said), sound(meant));
        }
        for (said, other) in [
            ("gate two", "gate too"),
            ("east office", "west office"),
            ("men's room", "women's room"),
            ("lecture hall one", "lecture hall two"),
            ("gym", "gym"),
            ("print room", "printer room"),
            ("fishbowl", "kitchen"),
            ("room a", "room b"),
            ("lobby", "hobby room"),
        ] {
            assert!(misheard(said, other) == 0.0, "{said} {other}");
        }
    }

    #[test]
    fn synonyms_go_both_ways_and_kinds_do_not() {
        assert!(synonyms("foyer", "lobby") > 0.3 && synonyms("lobby", "foyer") > 0.3);
        assert!(synonyms("foyer", "gym") == 0.0);
        for (name, kind, is) in [
            ("old archive", "archive", true),
            ("archive", "old archive", false),
            ("lecture hall three", "lecture hall", true),
            ("board room", "meeting room", true),
            ("gym", "room", false),
            ("nick's office", "office", true),
            ("kitchen", "kitchen", false),
        ] {
            assert_eq!(is_of_kind(name, kind), is, "{name} {kind}");
        }
    }
}
