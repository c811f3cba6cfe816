//! What a clause may locate: "the kitchen and the lounge".

use crate::language::act::{Head, Phrase};
use crate::language::grammar::cursor::Cursor;
use crate::language::grammar::noun_phrase::{Determiner, NounPhrase};
use crate::language::lexicon::names::Kind;

/// Figures of one clause ("the kitchen and the lounge are …").
pub(crate) const MAX_FIGURES: usize = 4;

pub(crate) fn is_door(phrase: &Phrase) -> bool {
    let Head::Named(name) = &phrase.head else { return phrase.head == Head::Place };
    ["door", "doorway", "opening"].iter().any(|d| name.as_str().ends_with(d))
}

/// The figures of a clause, without what follows them.
pub(crate) fn figures(at: &mut Cursor, presented: bool) -> Option<Vec<NounPhrase>> {
    let mut all = vec![at.noun_phrase()?];
    while all.len() < MAX_FIGURES {
        let start = *at;
        let more = at.eat_any("and also|and|, and").and_then(|_| at.noun_phrase());
        match more.filter(|m| fits(m, presented)) {
            Some(more) if !at.sees("is|are") => all.push(more),
            _ => {
                *at = start;
                break;
            }
        }
    }
    all.iter().all(|f| fits(f, presented)).then_some(all)
}

/// What a clause may locate: no door unless it is told from others, and an indefinite one only where the
/// sentence presents it ("there is a lab …").
pub(crate) fn fits(phrase: &NounPhrase, presented: bool) -> bool {
    let known = phrase.kind == Kind::Place;
    let fits = match phrase.determiner {
        Determiner::Definite => {
            known || phrase.kind == Kind::Open || (phrase.kind == Kind::Vague && phrase.is_told())
        }
        Determiner::None | Determiner::Indefinite | Determiner::Possessive | Determiner::Demonstrative => {
            known
        }
    };
    let told = phrase.is_told() && !presented;
    fits && (told || !is_door(&phrase.phrase))
}
