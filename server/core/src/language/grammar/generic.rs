//! "Kitchens are usually near lounges": said of kinds; heard and set aside.

use crate::language::act::{Content, Phrase, Quantity};
use crate::language::grammar::build::{Readings, one};
use crate::language::grammar::cursor::Cursor;
use crate::language::grammar::noun_phrase::{Determiner, NounPhrase};
use crate::language::lexicon::names::Kind;
use crate::language::relation::Relation as R;

/// Reads a statement on kinds.
pub(crate) fn generic_clause(at: &mut Cursor) -> Option<Readings> {
    let start = *at;
    for form in [sign, never_there, kinds] {
        if let Some(said) = form(at) {
            return Some(one(said));
        }
        *at = start;
    }
    None
}

/// "If you see vending machines you're close to the gym".
fn sign(at: &mut Cursor) -> Option<Content> {
    at.eat_any("if|when|whenever|once|where|wherever")?;
    let how = at.eat_any(
        "you see|you hear|you smell|you find|you reach|you come to|you pass|you notice|there is|there are|we see",
    )?;
    // What one hears or smells is no place, and rarely a thing.
    let sensed = matches!(how, "you hear" | "you smell");
    let figure = at.noun_phrase().filter(|p| sensed || p.kind != Kind::No)?;
    at.skip(",|then|that means");
    at.eat_any("you are|you will be|we are|you know you are|you must be")?;
    at.skip("usually|probably|very|quite|pretty|always");
    let relation = near(at)?;
    let landmark = at.noun_phrase().filter(|p| matches!(p.kind, Kind::Place | Kind::Open))?;
    Some(general(&figure, relation, &landmark, Quantity::All))
}

fn near(at: &mut Cursor) -> Option<R> {
    let words = at.eat_any("close to|near to|near|not far from|next to|in|at|by")?;
    Some(match words {
        "next to" => R::NextTo,
        "in" => R::In,
        "at" => R::At,
        _ => R::Near,
    })
}

/// "There's never a bathroom next to the server room", "you usually find a copier near the mail room".
fn never_there(at: &mut Cursor) -> Option<Content> {
    let there = at.eat_any("there is|there are|you will|you can|you|we|one").is_some();
    let quantity = at.quantity_adverb().filter(|_| there)?;
    at.skip("be|is|are");
    at.eat_any("find|finds|see|have|will find");
    let figure = at.noun_phrase().filter(|p| matches!(p.kind, Kind::Place | Kind::Thing))?;
    let related = at.related()?;
    let landmark = related.landmarks.into_iter().next()?;
    Some(Content::Generic {
        figure: kind(figure.phrase),
        relation: related.relation,
        landmark: kind(landmark),
        quantity,
    })
}

/// "Offices have computers", "most kitchens are near lounges".
fn kinds(at: &mut Cursor) -> Option<Content> {
    let mut quantity = match at.eat_any("almost all|nearly all|all of the|all the|all|every|each|any|most of the|most|many|some|no|usually|often|sometimes") {
        Some("almost all" | "nearly all" | "most" | "most of the" | "many" | "usually" | "often") => Some(Quantity::Usually),
        Some("some" | "sometimes") => Some(Quantity::Sometimes),
        Some("no") => Some(Quantity::Never),
        Some(_) => Some(Quantity::All),
        None => None,
    };
    let figure = at
        .noun_phrase()
        .filter(|p| p.kind == Kind::Place || (p.kind == Kind::Vague && quantity.is_some()))?;
    let bare = figure.determiner == Determiner::None && figure.is_plural();
    quantity = quantity.or_else(|| at.quantity_adverb());
    if matches!(figure.determiner, Determiner::Demonstrative | Determiner::Possessive) {
        return None;
    }
    let relation =
        if at.eat_any("always have|usually have|have|has|contain|contains|come with|comes with").is_some() {
            R::Contains
        } else {
            at.eat_any("tend to be|are|is|will be|lie|should be")?;
            at.skip("all|both|located|found|situated");
            quantity = quantity.or_else(|| at.quantity_adverb());
            // "A kitchen is next to the lab" is one kitchen.
            if !bare && quantity.is_none() {
                return None;
            }
            at.skip("located|found|situated");
            let related = at.related()?;
            let landmark = related.landmarks.into_iter().next()?;
            let quantity = quantity.unwrap_or(Quantity::All);
            let relation = related.relation;
            return Some(Content::Generic {
                figure: kind(figure.phrase),
                relation,
                landmark: kind(landmark),
                quantity,
            });
        };
    if !bare && quantity.is_none() {
        return None;
    }
    at.skip("their own|its own|some|at least");
    let landmark = at.noun_phrase()?;
    if matches!(landmark.determiner, Determiner::Definite | Determiner::Demonstrative)
        || figure.determiner == Determiner::Definite
    {
        return None;
    }
    Some(general(&figure, relation, &landmark, quantity.unwrap_or(Quantity::All)))
}

fn general(figure: &NounPhrase, relation: R, landmark: &NounPhrase, quantity: Quantity) -> Content {
    Content::Generic {
        figure: kind(figure.phrase.clone()),
        relation,
        landmark: kind(landmark.phrase.clone()),
        quantity,
    }
}

/// A kind has no number.
fn kind(mut phrase: Phrase) -> Phrase {
    phrase.features.plural = false;
    phrase
}
