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
//! Examples of this crate measure it: `parse --score FILE` (sentences read exactly), `clauses FILE`
//! (spatial clauses of route texts, [`clauses`]), `vocabulary FILE` (place words that the lexicon covers).

pub mod act;
mod aside;
mod ask;
mod attach;
mod build;
mod chunks;
mod clause;
mod clauses;
mod concepts;
mod copula;
mod correct;
mod cursor;
mod deictic;
mod describe;
mod doors;
mod envelope;
mod extents;
mod factor;
mod footprint;
mod generic;
mod ground;
mod label;
mod leads;
mod level;
mod lexicon;
mod locate;
mod measure;
mod names;
mod normalise;
mod notation;
mod noun_phrase;
mod numbers;
mod paper;
mod parse;
mod path_factors;
mod path_features;
mod path_weights;
mod pointed;
mod pointer;
mod presents;
mod reference;
mod relate;
mod relation;
mod repair;
mod route;
mod scales;
mod scene;
mod sentence;
#[cfg(test)]
mod tests;
mod ways;
mod word_lists;
mod words;

pub use act::{Act, Analysis, Content, Frame, Parse, Phrase, Sameness};
pub use clause::{LandmarkBelief, Narrowing, Reading};
pub use clauses::{Clause, clauses};
pub use footprint::Footprint;
pub use ground::{GroundPlace, Grounding, ground_clause, ground_with};
pub use names::Name;
pub use normalise::MAX_TEXT_BYTES;
pub use paper::ground_by_paper;
pub use parse::{parse, parse_hearings, parse_query};
pub use path_features::{FEATURES, path_features};
pub use reference::{pointed_to, resolve_it, seen_from_here, topic};
pub use relation::Relation;
pub use scales::Scales;
pub use words::{NOT_UNDERSTOOD, words};
