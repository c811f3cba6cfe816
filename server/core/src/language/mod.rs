//! Language, first cut: what a guide's sentence says, and where it puts it (paper III-E).
//!
//! [`parse`] turns a text into acts: names given to the place held, one of the four relations
//! between a figure and a landmark, questions. What is not understood yields no act, and [`words`]
//! says so.
//!
//! [`ground_clause`] turns the readings of a clause into a probability for every place, eqs. (14–16):
//! `clause` is what it is asked, `scene` and `ways` what the speaker sees and walks, `factor` the
//! density of a figure (an `envelope` round a `footprint`, times a template or a learned factor:
//! `path_features`, `path_factors`, `path_weights`), `ground` the sums.
//!
//! Deliberately absent here: negation, correction, hedges, routes, generic statements, other
//! relations. A sentence that holds any of them is not understood rather than half understood.

mod clause;
mod envelope;
mod factor;
mod footprint;
mod ground;
mod label;
mod lexicon;
mod locate;
mod names;
mod normalise;
mod noun_phrase;
mod numbers;
mod parse;
mod path_factors;
mod path_features;
mod path_weights;
mod relation;
mod scene;
mod ways;
mod word_lists;
mod words;

pub use clause::{Frame, LandmarkBelief, Narrowing, Reading};
pub use footprint::Footprint;
pub use ground::{GroundPlace, Grounding, ground, ground_clause};
pub use names::Name;
pub use normalise::MAX_TEXT_BYTES;
pub use parse::{parse, parse_query};
pub use path_features::{FEATURES, path_features};
pub use relation::Relation;
pub use words::{NOT_UNDERSTOOD, words};

use serde::{Deserialize, Serialize};

/// What a text says.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Parse {
    /// In the order said; empty if nothing was understood.
    pub acts: Vec<Act>,
    /// The acts in writing: `label(here,kitchen)`, `loc(kitchen,down,hallway)`, `ask(where,gym)`,
    /// joined by `&`; `none` if there is none. The grammar stands in `language/words.rs`.
    pub notation: String,
}

/// One thing said.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Act {
    /// "This is the gym": the place held is called so.
    Label {
        /// The name.
        name: Name,
        /// Whether the guide says it is a place seen before.
        again: Sameness,
    },
    /// "The kitchen is down the hall".
    Locate {
        /// What is located.
        figure: Name,
        /// How it lies to the landmark.
        relation: Relation,
        /// What it is located by.
        landmark: Landmark,
    },
    /// "Where is the gym?"
    AskWhere {
        /// What is asked for.
        name: Name,
    },
}

/// What a guide says about having been here before.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Sameness {
    /// "back at the lobby", "the lobby again": the one named so before.
    Same,
    /// "another lobby", "a different lobby": not the one named so before.
    Other,
    /// Nothing said.
    Open,
}

/// What a figure is located by.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Landmark {
    /// A named place.
    Name(Name),
    /// The place held: "near here".
    Here,
}
