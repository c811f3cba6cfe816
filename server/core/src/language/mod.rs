//! Language: what a guide's sentence says, and where it puts it (paper III-E).
//!
//! [`parse`] turns a text into weighed analyses ([`act`]): names given to places, places located, other
//! names, denials, corrections, questions; directions and general statements are recognised and set
//! aside. [`ground_clause`] turns a relation into a probability for every place, eqs. (14–16). What is not
//! understood yields no act, and [`words`] says so.
//!
//! ```text
//! text ─ normalise ─▶ words ─ parse (label, locate, ask, correct, generic, route) ─▶ readings of clauses
//!                               │ cursor, noun_phrase, pointer, relate, level, copula
//!                               └ attach: readings of "the office near the lounge by the stairs"
//! readings ─ build, parse ─▶ analyses ─ notation, words ─▶ writing
//! ```
//!
//! That is the grammar, which reads a sentence whole or not at all; [`reader`] reads others, `understand` weighs both.
//!
//! Examples of this crate measure it: `parse --score FILE` (sentences read exactly), `clauses FILE`
//! (spatial clauses of route texts, [`clauses`]), `vocabulary FILE` (place words that the lexicon covers).

pub mod act;
mod agreement;
pub(crate) mod clauses;
mod ellipsis;
pub mod glossary;
pub(crate) mod grammar;
pub(crate) mod grounding;
pub(crate) mod lexicon;
mod likeness;
mod measure;
mod notation;
mod phrases;
pub mod reader;
mod reference;
mod relation;
mod reply;
pub mod speech;
mod spelling;
#[cfg(test)]
mod tests;
mod understand;
mod words;

pub use act::{Act, Analysis, Content, Frame, Parse, Phrase, Sameness};
pub use clauses::{Clause, clauses};
pub use glossary::Glossary;
pub use grammar::ask::asked_name;
pub use grammar::parse::READ;
pub use grounding::clause::{LandmarkBelief, Narrowing, Reading};
pub use grounding::footprint::Footprint;
pub use grounding::ground::{Grounding, densities, ground_clause, ground_with};
pub use grounding::paper::ground_by_paper;
pub use grounding::path_features::{FEATURES, path_features};
pub use grounding::place::GroundPlace;
pub use grounding::scales::Scales;
pub use lexicon::COMMON;
pub use lexicon::edits::edits;
pub use lexicon::names::Name;
pub use lexicon::normalise::MAX_TEXT_BYTES;
pub use lexicon::numbers::is_number;
pub use lexicon::place_names;
pub use likeness::{is_of_kind, misheard, synonyms};
pub use phrases::{names_in, renamed};
pub use reference::{pointed_to, resolve_it, seen_from_here, topic};
pub use relation::Relation;
pub use reply::Reply;
pub use speech::Speech;
pub use understand::{parse, parse_by};
pub use words::{NOT_UNDERSTOOD, statement, words};

/// An act in writing.
pub fn written(content: &Content) -> String {
    notation::content_notation(content)
}
