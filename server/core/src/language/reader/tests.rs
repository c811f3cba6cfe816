use crate::language::reader::groups::{Made, groups};
use crate::language::reader::judge::{Judge, Weights};
use crate::language::reader::kind::{KINDS, Kind};
use crate::language::reader::lexicon::lexicon;
use crate::language::reader::propose::{PROPOSALS_MAX, propose};
use crate::language::reader::read::analyses;
use crate::language::reader::tokens::{MAX_TOKENS, tokens};
use crate::language::relation::Relation;
use proptest::prelude::*;

#[test]
fn each_relation_of_the_lexicon_is_one() {
    let lines = include_str!("../../../lexicon/english/relations.txt").lines();
    for line in lines.filter(|l| !l.starts_with('#')) {
        let (words, said) = line.split_once('=').expect(line);
        let name = said.split_whitespace().next().expect(line);
        assert!(Relation::ALL.iter().any(|r| r.notation() == name), "{line}");
        assert!(!words.trim().is_empty(), "{line}");
    }
    assert!(lexicon().all_relations().len() > 300, "choices are taken apart");
}

#[test]
fn contractions_and_owners_are_taken_apart() {
    let words = |text: &str| tokens(text).into_iter().map(|t| t.text).collect::<Vec<_>>().join(" ");
    assert_eq!(words("It's Nick's office, isn't it?"), "it is nick 's office , is not it ?");
    assert_eq!(words("the R&D lab's um upstairs"), "the r_and_d lab 's upstairs");
    assert_eq!(words("the students' lounge"), "the students 's lounge");
}

#[test]
fn what_was_misheard_is_what_was_said() {
    let words = |text: &str| tokens(text).into_iter().map(|t| t.text).collect::<Vec<_>>().join(" ");
    assert_eq!(words("their is a print her in hear"), "there is a printer in here");
    assert_eq!(
        words("the sever room is a cross from the work shop"),
        "the server room is across from the workshop"
    );
    for plain in ["this is a long hallway", "we passed the gym", "the students were in the lab"] {
        assert_eq!(words(plain), plain);
    }
    assert_eq!(words("there is a write of way"), "there is a write of way", "what may be meant stays");
}

#[test]
fn every_kind_is_proposed() {
    let all = tokens("no the gym on the second floor is next to the bar where we eat");
    let kinds: Vec<Kind> = propose(&all, &groups(&all)).iter().map(|p| p.kind).collect();
    for kind in Kind::ALL.into_iter().skip(1) {
        assert!(kinds.contains(&kind), "{kind:?} is never proposed");
    }
}

#[test]
fn a_text_that_may_say_too_much_is_not_read() {
    let text = "the big old gym bar near ".repeat(26);
    let all = tokens(&text);
    assert!(propose(&all, &groups(&all)).len() > PROPOSALS_MAX);
    assert!(analyses(&text, Judge::learned()).is_empty());
}

#[test]
fn each_of_several_acts_is_read_once() {
    let read = |text: &str| analyses(text, Judge::learned()).remove(0).notation;
    for (text, acts) in [
        ("this is the kitchen and the pantry is behind it", "label(here,kitchen)&loc(pantry,behind,it)"),
        (
            "the bakery is on your left and the bookshop is on your right",
            "loc(bakery,left_of,agent)&loc(bookshop,right_of,agent)",
        ),
        ("the gym is upstairs. the sauna is next to it.", "loc(gym,level_up,here)&loc(sauna,next_to,it)"),
    ] {
        assert_eq!(read(text), acts, "{text}");
    }
}

proptest! {
    #[test]
    fn a_judge_is_what_was_written(
        kinds in proptest::collection::btree_map(0_u32..1 << 26, -100_i8..100, 0..50),
        groups in proptest::collection::btree_map(0_u32..1 << 26, -100_i8..100, 0..50),
    ) {
        let weight = |w: i8| f32::from(w) / 32.0;
        let row = |w: i8| { let mut row = [0.0; KINDS]; row[3] = weight(w); row };
        let judge = Judge::read(&Judge::written(&Weights {
            kinds: kinds.iter().map(|(f, w)| (*f, row(*w))).collect(),
            groups: groups.iter().map(|(f, w)| (*f, weight(*w))).collect(),
        }));
        let kept = |w: i8, least: i8| if w.abs() < least { 0.0 } else { weight(w) };
        for (f, w) in &groups {
            prop_assert!((judge.weight(*f) - kept(*w, 2)).abs() < 1e-6);
        }
        for (f, w) in &kinds {
            let mut sums = [0.0; KINDS];
            judge.add(*f, &mut sums);
            prop_assert!((sums[3] - kept(*w, 3)).abs() < 1e-6);
        }
    }

    #[test]
    fn any_text_has_bounded_proposals(text in "\\PC{0,400}") {
        let all = tokens(&text);
        prop_assert!(all.len() <= MAX_TOKENS + 2);
        let proposals = propose(&all, &groups(&all));
        prop_assert!(proposals.len() < 2 * PROPOSALS_MAX + 2000, "{}", proposals.len());
        for p in proposals {
            prop_assert!(p.takes.iter().all(|s| s.from < s.to.max(1) && s.to <= all.len().max(1)));
        }
    }
}

#[test]
fn what_sounds_like_a_place_may_be_one() {
    let heard = |text: &str| {
        let all = tokens(text);
        let nouns = groups(&all).nouns;
        let heard = nouns.iter().filter(|n| n.made == Made::Heard).filter_map(|n| n.phrase.label());
        heard.map(|n| n.as_str().to_owned()).collect::<Vec<_>>()
    };
    for (text, name) in [
        ("wear is the jim", "gym"),
        ("the key osk is here", "kiosk"),
        ("how do I get to the fury", "ferry"),
        ("this is the wee ting room", "waiting room"),
        ("the chap all is upstairs", "chapel"),
        ("the food caught is up there", "food court"),
    ] {
        assert!(heard(text).contains(&name.to_owned()), "{text}: {:?}", heard(text));
    }
    assert_eq!(heard("the kitchen is next to the gym"), Vec::<String>::new());
}
