//! A site's own words and names.

use crate::language::glossary::Glossary;
use crate::language::lexicon::names::Name;
use crate::language::speech::Speech;
use std::sync::Arc;

const SITE: &str = "refectory|mensa = canteen\nfish thank = fish tank\n\
    name: Room to Grow; Bertha; Fish Tank; Anna's Office; Monday; The Way Out; Twenty Three; Stop & Go";

fn speech(tag: Option<&str>) -> Speech {
    Speech::new(tag, Arc::new(Glossary::read(SITE).unwrap())).unwrap()
}

#[test]
fn names_of_the_site_are_read_whatever_their_words_mean() {
    let speech = speech(None);
    for (text, says) in [
        ("this is Bertha", "label(here,bertha)"),
        ("this is room to grow", "label(here,room_to_grow)"),
        ("we're in Room to Grow now", "label(here,room_to_grow)"),
        ("this is Anna's office", "label(here,office{poss=Anna})"),
        ("this is monday", "label(here,monday)"),
        ("Stop & Go is next to Bertha", "loc(stop_and_go,next_to,bertha)"),
        ("the fish thank is down the hall", "loc(fish_tank,down,hallway)"),
        ("Bertha is across from the refectory", "loc(bertha,across_from,canteen)"),
        ("the kitchen is behind Twenty Three", "loc(kitchen,behind,23)"),
        ("where is Bertha?", "ask(where,bertha)"),
        ("this is not Bertha", "neg(label(here,bertha))"),
        ("no, this is Room to Grow", "cor(any,label(here,room_to_grow))"),
        ("go past Bertha and turn left", "route(past bertha;turn left)"),
    ] {
        assert_eq!(speech.parse(text).notation(), says, "{text}");
    }
}

#[test]
fn they_are_asked_for_and_spelled_as_the_site_has_them() {
    let speech = speech(Some("de"));
    for name in ["Room to Grow", "bertha", "monday", "Stop & Go", "fish tank", "where is room to grow"] {
        let asked = name.trim_start_matches("where is ");
        assert_eq!(speech.parse_query(name), Name::new(asked), "{name}");
    }
    assert_eq!(speech.parse("Das ist Bertha").notation(), "label(here,bertha)");
    let spelled = |text: &str, name: &str| speech.spelling(text, &Name::new(name).unwrap());
    assert_eq!(spelled("das ist bertha", "bertha").as_deref(), Some("Bertha"));
    assert_eq!(spelled("Das ist die Küche.", "kitchen").as_deref(), Some("Küche"));
    assert_eq!(spelled("Küche!", "kitchen").as_deref(), Some("Küche"));
}
