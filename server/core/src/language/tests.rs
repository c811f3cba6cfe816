//! What sentences say, as a whole. `golden.jsonl` is a table of our own sentences; the example `parse`
//! scores such tables.

mod german;
mod reference;
mod site;
mod spoken;
mod words;

use super::*;
use crate::language::act::{Content, Head, Locate};
use crate::language::understand::{parse_hearings, parse_query};
use proptest::prelude::*;

fn read(text: &str) -> String {
    parse(text).notation().to_owned()
}

fn asserted(text: &str) -> Vec<Content> {
    parse(text).acts().iter().map(|a| a.content.clone()).filter(Content::asserts).collect()
}

#[test]
fn the_golden_sentences_are_read_exactly() {
    for line in include_str!("golden.jsonl").lines() {
        let gold: serde_json::Value = serde_json::from_str(line).expect("a line of JSON");
        let text = gold["text"].as_str().expect("a text");
        assert_eq!(read(text), gold["parse"].as_str().expect("a parse"), "{text}");
    }
}

#[test]
fn what_is_plain_gives_the_label_that_a_map_uses() {
    for (text, label) in [
        ("They call this place the Gates cafeteria.", "gates cafeteria"),
        ("This is lecture hall 123", "lecture hall one twenty three"),
        ("this is Nick's office", "nick's office"),
        ("this is the men’s bathroom", "men's bathroom"),
        ("this is our beautiful library", "library"),
        ("welcome to the Z-center", "z center"),
        ("this is the big lobby", "big lobby"),
        ("here are the drinking fountains", "drinking fountain"),
    ] {
        let parse = parse(text);
        let [Act { content: Content::Label { at, what, .. }, certainty }] = parse.acts() else {
            panic!("{text}: {}", parse.notation())
        };
        assert_eq!((at.head.clone(), what.label()), (Head::Here, Name::new(label)), "{text}");
        assert!(*certainty >= 1.0);
    }
    for text in ["This is where they keep the copiers.", "This is the room with the printers."] {
        let parse = parse(text);
        let Some(Content::Label { what, .. }) = parse.acts().first().map(|a| &a.content) else {
            panic!("{text}: {}", parse.notation())
        };
        assert_eq!(what.label(), None, "a description teaches no name: {text}");
    }
}

#[test]
fn what_names_no_place_asserts_nothing() {
    for text in [
        "this is great",
        "this is my friend John",
        "this is John",
        "this is the famous Mister Jones",
        "this is Anna's sister",
        "we are in trouble",
        "we're in luck",
        "we are at war",
        "I'm in the mood for coffee",
        "I'm in bed",
        "you are in charge",
        "here is the plan",
        "here's the thing",
        "here we go",
        "here we are",
        "here are some cookies",
        "this is the best",
        "this is the first time",
        "this is the end of the tour",
        "this is the weather forecast",
        "this is the kitchen table",
        "this is a test",
        "this is the wrong room",
        "this is a large room",
        "this is the next room",
        "this is the second floor",
        "this is the robot",
        "this is what I wanted",
        "welcome to the team",
        "welcome to the jungle",
        "they call me Bob",
        "we call this progress",
        "we're on the same page",
        "this was the gym",
        "this will be the gym",
    ] {
        assert_eq!(asserted(text), vec![], "{text}");
    }
}

#[test]
fn what_lies_nowhere_on_a_map_asserts_nothing() {
    for text in [
        "he is near the kitchen",
        "the end is near",
        "the end is near here",
        "the kitchen is down",
        "the sun is down",
        "the man is next to the elevator",
        "sales are through the roof",
        "the truth is far from here",
        "the party is next door",
        "the sandwich is cold",
        "the zorb is my favourite",
        "the gym is near the gym",
        "when you are in the gym turn left",
        "Switch the lights off in the gym.",
    ] {
        assert_eq!(asserted(text), vec![], "{text}");
    }
}

#[test]
fn questions_assert_nothing_and_ask_for_a_name() {
    for (text, name) in [
        ("Where is the gym?", "gym"),
        ("where’s the nearest restroom please", "bathroom"),
        ("where are the lifts", "elevator"),
        ("How do I get to the library from here?", "library"),
        ("take me to Lecture Hall 123", "lecture hall one twenty three"),
        ("which way is it to the exit?", "exit"),
        ("excuse me, do you know where the kitchen is?", "kitchen"),
        ("I'm looking for the mail room", "mail room"),
        ("where can I find a zorbing parlor", "zorbing parlor"),
    ] {
        assert_eq!(parse_query(text), Name::new(name), "{text}");
        assert_eq!(asserted(text), vec![], "{text}");
    }
    for text in
        ["where are you", "where is he?", "where", "which way", "what room is this?", "this is the gym?"]
    {
        assert_eq!(parse_query(text), None, "{text}");
        assert_eq!(asserted(text), vec![], "{text}");
    }
}

#[test]
fn a_bare_name_may_ask() {
    for text in ["Kitchen", "the kitchen", "kitchens", "ok, the kitchen please"] {
        assert_eq!(parse_query(text), Name::new("kitchen"), "{text}");
    }
    assert_eq!(asserted("ok, the kitchen please"), []);
    assert_eq!(parse_query("the kitchen, the gym"), None);
    assert_eq!(parse_query("this is the kitchen"), None);
    assert_eq!(parse_query(""), None);
}

#[test]
fn sentences_of_one_text_belong_together() {
    for (text, notation) in [
        ("Ok. This is the gym! It smells.", "label(here,gym)"),
        ("This isn't the kitchen. It's the gym.", "cor(label(here,kitchen),label(here,gym))"),
        ("No. This is the gym.", "cor(any,label(here,gym))"),
        ("Again we are in the hallway, everyone", "label(here,hallway)&same(here,hallway)"),
        (
            "The cafe is near the library, and the gym is down the hall",
            "loc(cafe,near,library)&loc(gym,down,hallway)",
        ),
    ] {
        assert_eq!(read(text), notation, "{text}");
    }
}

#[test]
fn attachments_stay_open() {
    let parse = parse("The lab near the kitchen by the lobby is locked.");
    let read: Vec<&str> = parse.analyses.iter().map(|a| a.notation.as_str()).collect();
    let low = "attr(lab[near kitchen[near lobby]],locked)";
    assert_eq!(read, [low, "attr(lab[near kitchen][near lobby],locked)"]);
    let sum: f64 = parse.analyses.iter().map(|a| a.weight).sum();
    assert!(parse.analyses[0].weight > parse.analyses[1].weight && sum < 1.0);
}

#[test]
fn doubt_weighs_less() {
    let sure = |text: &str| parse(text).acts().first().map_or(0.0, |a| a.certainty);
    let order = [
        "this is the gym",
        "I think this is the gym",
        "maybe this is the gym",
        "maybe this is the gym, I think",
    ];
    for pair in order.windows(2) {
        assert!(sure(pair[0]) > sure(pair[1]), "{pair:?}");
    }
    assert!(sure("this might be the gym") < 1.0);
}

#[test]
fn hearings_are_weighed() {
    let other = |text: &str, p: f64| (text.to_owned(), p);
    // What makes no sense yields to what does.
    let heard = parse_hearings("this is the gin", &[other("this is the gym", 0.3)]);
    assert_eq!(heard.notation(), "label(here,gin)");
    let heard = parse_hearings("this is a gin", &[other("this is the gym", 0.3)]);
    let best = heard.best().expect("a reading");
    assert_eq!((best.notation.as_str(), best.hearing), ("label(here,gym)", 1));
    assert!(best.weight < 0.3);
    // Hearings that agree add up.
    let alone = parse_hearings("the gym is down the hall", &[]);
    let agree = parse_hearings("the gym is down the hall", &[other("the gym's down the hall", 0.4)]);
    let both = parse_hearings("the gym is down the hall", &[other("the gin is down the hall", 0.4)]);
    let weight = |p: &Parse| p.best().map_or(0.0, |a| a.weight);
    assert!((weight(&alone) - weight(&agree)).abs() < 1e-12);
    assert!(weight(&both) < weight(&alone));
    for p in [f64::NAN, f64::INFINITY, -1.0, 7.0] {
        let sum: f64 = parse_hearings("this is the gym", &[other("this is the lab", p)])
            .analyses
            .iter()
            .map(|a| a.weight)
            .sum();
        assert!(sum <= 1.0 && sum > 0.0);
    }
}

#[test]
fn a_guess_at_a_misheard_name_is_marked() {
    let guess = parse("the kitten is past the stairs");
    let [Act { content: Content::Locate(Locate { repaired: true, .. }), .. }] = guess.acts() else {
        panic!("{}", guess.notation())
    };
    assert!(guess.analyses[0].weight < 0.5);
    assert_eq!(read("the kitten is next to the lobby"), "none");
}

#[test]
fn a_long_text_is_read_to_its_end() {
    let text = "this is the gym and ".repeat(MAX_TEXT_BYTES / 20);
    assert_eq!(parse(&text).acts().len(), MAX_TEXT_BYTES / 20);
    assert!(parse(&"this is the gym. ".repeat(MAX_TEXT_BYTES / 17 + 1)).analyses.is_empty());
}

/// All phrases of a content are in its notation's grammar if their labels are canonical.
fn labels(acts: &[Act]) -> Vec<Name> {
    acts.iter()
        .filter_map(|a| match &a.content {
            Content::Label { what, .. } => what.label(),
            Content::Locate(locate) => locate.figure.label(),
            _ => None,
        })
        .collect()
}

const VOCABULARY: &[&str] = &[
    "this",
    "is",
    "the",
    "gym",
    "we",
    "are",
    "in",
    "at",
    ",",
    ".",
    "?",
    "and",
    "down",
    "near",
    "hall",
    "of",
    "another",
    "a",
    "here",
    "there",
    "where",
    "back",
    "again",
    "call",
    "next",
    "to",
    "one",
    "hundred",
    "oh",
    "23",
    "ß",
    "'s",
    "n't",
    "through",
    "not",
    "you",
    "find",
    "is called",
    "é",
    "🙂",
    "it's",
    "between",
    "second",
    "door",
    "on",
    "your",
    "left",
    "right",
    "from",
    "two",
    "doors",
    "feet",
    "floor",
    "up",
    "no",
    "sorry",
    "I mean",
    "Nick's",
    "lobby",
    "stairs",
    "past",
    "I think",
    "was",
    "just",
    "if",
    "turn",
    "go",
    "until",
    "reach",
    "same",
    "started",
    "office",
    "empty",
    "mine",
    "what",
    "why",
    "usually",
    "kitchens",
    "have",
    "but",
    "which",
    "along",
    "north",
    "kitten",
    "end",
    "an",
    "forks",
    "last",
    "that",
];

proptest! {
    #[test]
    fn any_text_is_taken(text in "\\PC{0,200}", other in "\\PC{0,40}", p in 0.0..1.0_f64) {
        let parse = parse_hearings(&text, &[(other, p)]);
        prop_assert!(parse.analyses.iter().map(|a| a.weight).sum::<f64>() <= 1.0 + 1e-9);
        let _ = (parse_query(&text), words(parse.acts(), |_| false));
    }

    #[test]
    fn any_words_in_any_order_are_taken(
        words in prop::collection::vec(prop::sample::select(VOCABULARY), 0..60),
    ) {
        let parse = parse(&words.join(" "));
        for name in labels(parse.acts()) {
            prop_assert_eq!(Name::new(name.as_str()), Some(name.clone()), "labels are canonical");
        }
        for pair in parse.analyses.windows(2) {
            prop_assert!(pair[0].weight >= pair[1].weight);
        }
        prop_assert!(parse.analyses.iter().map(|a| a.weight).sum::<f64>() <= 1.0 + 1e-9);
    }

    #[test]
    fn case_punctuation_and_fillers_do_not_matter(
        filler in prop::sample::select(vec!["", "and ", "So, ", "OK... ", "um, well, ", "now "]),
        end in prop::sample::select(vec!["", ".", "!", " now.", ", everyone", " …"]),
        upper: bool,
    ) {
        let text = format!("{filler}we’re in the elevator lobby{end}");
        let text = if upper { text.to_uppercase() } else { text };
        prop_assert_eq!(read(&text), "label(here,elevator_lobby)");
    }
}
