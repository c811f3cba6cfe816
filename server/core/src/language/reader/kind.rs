//! What kinds of acts there are.

/// Kinds of acts, each with weights of its own.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Kind {
    /// "Well then."
    Nothing,
    /// "This is the gym."
    Label,
    /// "That was the gym."
    Before,
    /// "This isn't the gym."
    NotLabel,
    /// "No, this is the gym."
    MendLabel,
    /// "No, that was the gym."
    MendBefore,
    /// "Back in the gym."
    Same,
    /// "Back where we started."
    Start,
    /// "This is where we eat."
    Use,
    /// "Another gym."
    Other,
    /// "Not the same gym."
    NotSame,
    /// "The gym is called the pit."
    Alias,
    /// "The gym is closed."
    Attribute,
    /// "The gym is next to the bar."
    Locate,
    /// "The gym isn't next to the bar."
    NotLocate,
    /// "No, the gym is next to the bar."
    MendLocate,
    /// "Where is the gym?"
    Where,
    /// "What is next to the bar?"
    What,
    /// "What is this?"
    WhatHere,
    /// "How do I get to the gym?"
    Route,
    /// "How far is the gym?"
    HowFar,
    /// "Is this the gym?"
    IsLabel,
    /// "Is the gym next to the bar?"
    IsLocated,
    /// "Gyms are near bars."
    Generic,
    /// "Turn left."
    Way,
    /// "Turn left and the gym is ahead."
    WayTo,
}

/// How many there are.
pub const KINDS: usize = 26;

impl Kind {
    /// All of them, nothing first.
    pub const ALL: [Self; KINDS] = [
        Self::Nothing,
        Self::Label,
        Self::Before,
        Self::NotLabel,
        Self::MendLabel,
        Self::MendBefore,
        Self::Same,
        Self::Start,
        Self::Use,
        Self::Other,
        Self::NotSame,
        Self::Alias,
        Self::Attribute,
        Self::Locate,
        Self::NotLocate,
        Self::MendLocate,
        Self::Where,
        Self::What,
        Self::WhatHere,
        Self::Route,
        Self::HowFar,
        Self::IsLabel,
        Self::IsLocated,
        Self::Generic,
        Self::Way,
        Self::WayTo,
    ];

    /// Kinds whose groups are found alike have one: names, places located, two names.
    #[must_use]
    pub fn group(self) -> Self {
        match self {
            Self::Alias => Self::Alias,
            Self::Locate
            | Self::NotLocate
            | Self::MendLocate
            | Self::IsLocated
            | Self::Generic
            | Self::WayTo => Self::Locate,
            _ => Self::Label,
        }
    }
}
