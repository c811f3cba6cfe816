//! Sentences that the grammar has no rule for.

use super::*;
use crate::language::grammar::parse::parse as exactly;

/// What nobody wrote into a grammar, nor into what the judge learned from.
#[test]
fn sentences_that_nobody_foresaw_are_read() {
    for (text, parse_of) in [
        ("and that was the vestry we just went through", "label(prev_place,vestry)"),
        ("whoops not the pantry i meant the scullery", "cor(any,label(here,scullery))"),
        ("is this the orangery do you think", "ask(whether,label(here,orangery))"),
        ("which way would i go for the bursary", "ask(route,bursary)"),
        ("there isn't any canteen on this floor", "neg(loc(canteen,on_level,floor{this}))"),
    ] {
        assert!(exactly(text).best().is_none(), "the grammar reads: {text}");
        assert_eq!(parse(text).notation(), parse_of, "{text}");
    }
}

#[test]
fn what_will_be_is_not_here() {
    for text in
        ["this will be the gym", "in a minute this is going to be the gym", "we will be in the kitchen soon"]
    {
        let acts = parse(text);
        let names_here = |c: &Content| matches!(c, Content::Label { .. });
        assert!(!acts.acts().iter().any(|a| names_here(&a.content)), "{text}: {}", acts.notation());
    }
}
