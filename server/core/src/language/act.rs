//! What a text says, typed: analyses of acts, acts of phrases. `notation.rs` has the written form.

use crate::language::lexicon::names::{Kind, Name};
pub use crate::language::measure::{Distance, Unit};
use crate::language::relation::Relation;
use serde::{Deserialize, Serialize};

/// What a text says: all readings that are kept, likeliest first.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Parse {
    /// Weights sum to at most one; what they lack is "said something else, or nothing of the kind".
    pub analyses: Vec<Analysis>,
}

/// One reading of a text.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Analysis {
    /// Its probability.
    pub weight: f64,
    /// In the order said.
    pub acts: Vec<Act>,
    /// The acts in writing.
    pub notation: String,
    /// Which hearing it reads: 0 the text itself, k the k-th of its alternatives.
    pub hearing: usize,
}

/// One thing said.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Act {
    /// What is said.
    pub content: Content,
    /// Probability that the speaker gives it: 1 for a plain statement, less for "I think".
    pub certainty: f64,
}

/// What an act says.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Content {
    /// "This is the gym": `at` is called `what`.
    Label {
        /// [`Head::Here`], [`Head::Previous`], [`Head::There`] or [`Head::Any`] ("what I called the lobby").
        at: Phrase,
        /// Its [`Phrase::label`] is the name; a description without one teaches no name.
        what: Phrase,
        /// "Back in the gym", "another gym": said of the places of that name.
        sameness: Sameness,
    },
    /// "The kitchen is down the hall".
    Locate(Locate),
    /// "The last office on the left is Nick's": `what` is also called `also`.
    Alias {
        /// The place as described or called so far.
        what: Phrase,
        /// Its other name.
        also: Phrase,
    },
    /// "The office near the lounge is empty".
    Attribute {
        /// What is described.
        what: Phrase,
        /// As said: "empty".
        value: String,
    },
    /// "This isn't the kitchen".
    Negate(Box<Content>),
    /// "No, this is the gym, not the kitchen".
    Correct {
        /// What is taken back; none: whatever was said of it.
        was: Option<Box<Content>>,
        /// What holds.
        is: Box<Content>,
    },
    /// "We are back where we started": two descriptions of one place, or of two.
    Same {
        /// Mostly [`Head::Here`].
        what: Phrase,
        /// The other description.
        like: Phrase,
        /// One place (true), or two places (false).
        same: bool,
    },
    /// A question; it asserts nothing.
    Ask {
        /// What is wanted.
        kind: Question,
        /// What of.
        about: About,
    },
    /// "Kitchens are usually near lounges": said of kinds, not of places.
    Generic {
        /// The kind.
        figure: Phrase,
        /// How they lie.
        relation: Relation,
        /// The other kind.
        landmark: Phrase,
        /// How often.
        quantity: Quantity,
    },
    /// "Go down the hall until you reach the elevators": not followed, but its end may locate.
    Route {
        /// Steps in writing: `down hallway until at elevator{plural}`, `turn left`.
        steps: Vec<String>,
        /// What is found at its end.
        then: Option<Box<Content>>,
    },
    /// Heard as something that says nothing of places.
    Ignored(Reason),
}

/// How a figure lies to one landmark, or between two.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Locate {
    /// What is located.
    pub figure: Phrase,
    /// How it lies.
    pub relation: Relation,
    /// "Just", "about twenty meters", "two floors".
    pub modifiers: Modifiers,
    /// One; two for [`Relation::Between`].
    pub landmarks: Vec<Phrase>,
    /// Whose left, front or way is meant; none if the words leave it open or need none.
    pub frame: Option<Frame>,
    /// The figure's name was mended ("kitten" for "kitchen"), as recognisers mishear.
    pub repaired: bool,
}

/// A noun phrase: a place, a thing or a pointer.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Phrase {
    /// What it is.
    pub head: Head,
    /// What tells it from others of its kind.
    pub features: Features,
    /// Where it is: "the office *near the lounge*".
    pub within: Vec<Restriction>,
}

/// What a phrase speaks of.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Head {
    /// A kind of place or thing, compounds and numbers whole: `elevator lobby`, `room one oh five`.
    Named(Name),
    /// Some place, described alone: "where we keep the printers".
    Place,
    /// "It": what was last spoken of.
    It,
    /// The place held.
    Here,
    /// Where the speaker points.
    There,
    /// Who is spoken to.
    Agent,
    /// Who speaks.
    Speaker,
    /// The way that one is going.
    Path,
    /// The place left last.
    Previous,
    /// Where the tour began.
    Start,
    /// What is asked for: "what is next to the gym?"
    Unknown,
    /// Any place: "the thing I called the lobby".
    Any,
    /// Some place seen before: "we have been here before".
    Visited,
}

/// What tells a place from others of its kind.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
// Each is one word that may or may not stand there.
#[allow(clippy::struct_excessive_bools)]
pub struct Features {
    /// "Stata" of "the Stata cafeteria", as written.
    pub name: Option<String>,
    /// "Nick's".
    pub owner: Option<Owner>,
    /// "double", "big", as said.
    pub qualities: Vec<String>,
    /// "The second door".
    pub ordinal: Option<Ordinal>,
    /// "Two doors".
    pub count: Option<u32>,
    /// "The nearest".
    pub nearest: bool,
    /// "The doors".
    pub plural: bool,
    /// "This hallway".
    pub this: bool,
    /// Said with "another" or "other".
    pub other: bool,
    /// "The floor below" is −1.
    pub level: Option<i32>,
    /// "Where we eat": what is done there.
    pub purpose: Option<String>,
}

/// Whose a place is.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Owner {
    /// "Nick's", as written with a capital.
    Named(String),
    /// "Mine".
    Speaker,
}

/// A place in a row.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Ordinal {
    /// Counted from one.
    Nth(u32),
    /// The last.
    Last,
    /// The one after.
    Next,
}

/// Where a phrase's thing lies.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Restriction {
    /// How it lies.
    pub relation: Relation,
    /// "Just".
    pub modifiers: Modifiers,
    /// One, or two for [`Relation::Between`].
    pub landmarks: Vec<Phrase>,
}

/// What narrows a relation.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Modifiers {
    /// "Just", "right", "directly": close by.
    pub just: bool,
    /// "About twenty meters".
    pub distance: Option<Distance>,
    /// "Two floors up".
    pub count: Option<u32>,
}

/// Whose left, front or way is meant.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Frame {
    /// Who is spoken to: "on your left".
    Hearer,
    /// Who speaks: "on my left".
    Speaker,
    /// The landmark's own front.
    Intrinsic,
    /// The way that one is going: "the second door on the right".
    Path,
    /// The compass.
    Absolute,
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

/// What a question wants.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Question {
    /// A place.
    Where,
    /// A name.
    What,
    /// A reason.
    Why,
    /// A way.
    Route,
    /// A length.
    HowFar,
    /// Yes or no.
    Whether,
}

/// What a question is about.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum About {
    /// A place.
    Phrase(Phrase),
    /// A statement.
    Content(Box<Content>),
}

/// How often a general statement holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Quantity {
    /// "Offices have computers".
    All,
    /// "Usually".
    Usually,
    /// "Sometimes".
    Sometimes,
    /// "Never".
    Never,
}

/// Why something heard is set aside.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Reason {
    /// "Turn the lights off".
    Command,
    /// "He is down in the dumps".
    Idiom,
    /// Anything else.
    Chatter,
}

impl Parse {
    /// The likeliest reading; none if nothing was understood.
    pub fn best(&self) -> Option<&Analysis> {
        self.analyses.first()
    }

    /// The acts of the likeliest reading.
    pub fn acts(&self) -> &[Act] {
        self.best().map_or(&[], |a| &a.acts)
    }

    /// The likeliest reading in writing; `none` if there is none.
    pub fn notation(&self) -> &str {
        self.best().map_or("none", |a| &a.notation)
    }
}

impl Phrase {
    /// A bare head.
    pub fn new(head: Head) -> Self {
        Self { head, features: Features::default(), within: Vec::new() }
    }

    /// The canonical full name, which is the map's label: "stata cafeteria", "lecture hall one twenty
    /// three", "nick's office"; none for pointers and mere descriptions.
    pub fn label(&self) -> Option<Name> {
        self.full_name().filter(|name| name.kind() != Kind::Vague)
    }

    /// The name as [`label`](Self::label) has it, "the room" included.
    pub(super) fn full_name(&self) -> Option<Name> {
        let Head::Named(head) = &self.head else { return None };
        let f = &self.features;
        let mut words = Vec::new();
        if let Some(Owner::Named(owner)) = &f.owner {
            words.push(format!("{owner}'s"));
        }
        words.extend(f.name.clone());
        words.extend(f.qualities.iter().cloned());
        words.push(head.as_str().to_owned());
        Name::new(&words.join(" "))
    }
}

impl Content {
    /// Does it state something of the map's places?
    pub fn asserts(&self) -> bool {
        !matches!(
            self,
            Self::Ask { .. } | Self::Generic { .. } | Self::Ignored(_) | Self::Route { then: None, .. }
        )
    }
}
