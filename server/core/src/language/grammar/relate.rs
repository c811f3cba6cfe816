//! Prepositional phrases: how something lies to what.

use crate::language::act::{Head, Modifiers, Phrase, Restriction};
use crate::language::grammar::cursor::Cursor;
use crate::language::grammar::noun_phrase::Determiner;
use crate::language::lexicon::names::Kind;
use crate::language::relation::{Relation, Relation as R};

/// "Just past the entrance".
#[derive(Clone, Debug)]
pub(crate) struct Related {
    pub(crate) relation: Relation,
    pub(crate) modifiers: Modifiers,
    pub(crate) landmarks: Vec<Phrase>,
    /// A landmark surely is a place.
    pub(crate) sure: bool,
    /// The landmark is one that the listener knows: "the lobby", "here".
    pub(crate) definite: bool,
}

impl Related {
    pub(crate) fn to(relation: Relation, landmark: Phrase) -> Self {
        Self {
            relation,
            modifiers: Modifiers::default(),
            landmarks: vec![landmark],
            sure: false,
            definite: true,
        }
    }

    pub(crate) fn restriction(&self) -> Restriction {
        Restriction { relation: self.relation, modifiers: self.modifiers, landmarks: self.landmarks.clone() }
    }
}

/// Prepositions and their relations; what begins another comes after it.
const PREPOSITIONS: [(&str, R); 34] = [
    ("in front of|before|outside the front of", R::InFrontOf),
    ("on the other side of|on the far side of|on the opposite side of|over on the other side of", R::Across),
    (
        "across the hall from|across the hallway from|across the corridor from|across from|opposite from|opposite to|\
      opposite of|opposite|kitty corner from|kitty corner to|catty corner from|catty corner to|facing|face to face with",
        R::AcrossFrom,
    ),
    ("across", R::Across),
    ("through to|through|in through|via|by way of", R::Through),
    (
        "at the very end of|at the far end of|at the other end of|at the opposite end of|at either end of|at both ends of|at the back end of|at the end of|\
      to the end of|near the end of|by the end of|in the end of|down at the end of|towards the end of|toward the end of",
        R::AtEndOf,
    ),
    (
        "next door to|next to|beside|alongside|adjacent to|adjoining|right up against|side by side with|attached to|connected to|joined to|to the side of|at the side of|by the side of|bordering|off of|off",
        R::NextTo,
    ),
    ("away from|far away from|far from|a long way from|well away from", R::AwayFrom),
    (
        "close to|near to|near|close by|in the vicinity of|not far from|not too far from|a short walk from|\
      a few steps from|within sight of|a stone's throw from|a short distance from|steps away from|steps from|just steps from|around the corner from|by",
        R::Near,
    ),
    ("along", R::Along),
    (
        "down the hall from|down the hallway from|down the corridor from|up the hall from|down from|down|up",
        R::Down,
    ),
    ("past|passed|beyond|after|on past|once you pass|just after you pass", R::Past),
    ("around|round", R::Around),
    ("out of|outside of|outside|out", R::OutOf),
    ("in back of|behind|around the back of|round the back of", R::Behind),
    ("in between|between", R::Between),
    ("on the way to|en route to|towards|toward|in the direction of", R::Towards),
    ("on top of|above|over", R::Above),
    ("underneath|below|beneath|under", R::Below),
    ("to the north of|on the north side of|at the north end of|north of", R::NorthOf),
    ("to the south of|on the south side of|at the south end of|south of", R::SouthOf),
    ("to the east of|on the east side of|at the east end of|east of", R::EastOf),
    ("to the west of|on the west side of|at the west end of|west of", R::WestOf),
    ("upstairs from", R::LevelUp),
    ("downstairs from", R::LevelDown),
    (
        "at the top of|at the bottom of|at the foot of|at the head of|at the corner of|at the base of|at the start of|at the beginning of|at the front of|at the mouth of",
        R::At,
    ),
    (
        "in the middle of|in the center of|in the centre of|at the center of|at the back of|in the back of|in the corner of|in the far corner of|in the back corner of|\
      at the far corner of",
        R::In,
    ),
    ("inside of|inside|within|into|in", R::In),
    ("at", R::At),
    ("on", R::On),
    ("that lead to|that leads to|which leads to|leading to|leading into|that goes to|going to|to", R::To),
    (
        "where we keep|where they keep|where you keep|where i keep|with|that has|that have|which has|containing|holding",
        R::Contains,
    ),
    ("left of", R::LeftOf),
    ("right of", R::RightOf),
];
/// Says nothing that we use.
const ADVERBS: &str = "located|situated|found|placed|halfway|partway|midway|all the way|way|back|out|over|up|further|farther|a bit|a little|\
    somewhere|still|also|both|all|tucked away|somewhere over|hidden|immediately adjacent|very|really|pretty|quite|\
    straight|not far|standing|due|diagonally|kind of|sort of|basically|more or less|set|sitting|positioned|housed";

impl Cursor<'_> {
    /// Reads how something lies; none, and the position unchanged, if nothing says so here.
    pub(crate) fn related(&mut self) -> Option<Related> {
        let start = *self;
        let found = self.special().or_else(|| {
            *self = start;
            self.modified()
        });
        if found.is_none() {
            *self = start;
        }
        found
    }

    /// Phrases with a landmark of their own, most of them without a noun.
    fn special(&mut self) -> Option<Related> {
        let start = *self;
        for read in [
            Self::same_spot,
            Self::side,
            Self::ahead,
            Self::level,
            Self::doors,
            Self::elsewhere,
            Self::far_side,
        ] {
            if let Some(found) = read(self) {
                return Some(found);
            }
            *self = start;
        }
        None
    }

    /// Adverbs and a distance, then a preposition or a special phrase.
    fn modified(&mut self) -> Option<Related> {
        let mut modifiers = Modifiers::default();
        loop {
            let down_in = self.peek(0) != "out"
                && matches!(self.peek(0), "down" | "up" | "over" | "back" | "out")
                && matches!(self.peek(1), "in" | "on" | "at" | "by" | "near" | "behind" | "under" | "next");
            if down_in {
                self.step();
                continue;
            }
            if self.sees("right of|up the|over the|out of|out the|out those|out these|up here") {
                break;
            }
            if self.eat_any("just|right|directly|immediately|straight").is_some() {
                modifiers.just |= matches!(self.before(), "just" | "right" | "directly" | "immediately");
            } else if let Some(distance) = self.distance() {
                modifiers.distance = Some(distance);
                self.skip("further|farther|or so");
                let here = self.at_break() || self.sees("on the|on your|to the left|to the right");
                if self.eat("from") {
                    return self.with_landmark(R::AwayFrom, modifiers);
                }
                if self.eat_any("away|off").is_some() || here {
                    let from = if self.eat("from") { self.landmark()?.0 } else { Phrase::new(Head::Here) };
                    return Some(Related { modifiers, ..Related::to(R::AwayFrom, from) });
                }
            } else if self.eat_any(ADVERBS).is_none() {
                break;
            }
        }
        if let Some(found) = self.special() {
            return Some(Related { modifiers: merged(modifiers, found.modifiers), ..found });
        }
        let relation =
            PREPOSITIONS.iter().find(|(words, _)| self.eat_any(words).is_some()).map(|(_, r)| *r)?;
        self.with_landmark(relation, modifiers)
    }

    fn with_landmark(&mut self, relation: Relation, modifiers: Modifiers) -> Option<Related> {
        if relation == R::Contains {
            let thing =
                self.noun_phrase().filter(|t| t.kind != Kind::No || t.determiner != Determiner::Definite)?;
            return Some(Related { modifiers, ..Related::to(relation, thing.phrase) });
        }
        let indefinite =
            self.sees("a|an|some|another") || (self.peek(0).ends_with('s') && self.peek(0) != "this");
        let (first, mut sure) = self.landmark()?;
        if relation == R::On && !sure && matches!(first.head, Head::Named(_)) {
            // "On the table" is where things are, not places.
            return None;
        }
        let here = matches!(first.head, Head::Here | Head::There);
        // One is near or away from here; "down here" says nothing of the kind.
        let pointless = here
            && !matches!(
                relation,
                R::Near
                    | R::AwayFrom
                    | R::NextTo
                    | R::Past
                    | R::Across
                    | R::At
                    | R::Above
                    | R::Below
                    | R::NorthOf
                    | R::SouthOf
                    | R::EastOf
                    | R::WestOf
            );
        let upward = matches!(first.head, Head::Agent | Head::Speaker)
            && !matches!(
                relation,
                R::Behind | R::InFrontOf | R::AcrossFrom | R::Above | R::Below | R::Near | R::NextTo
            );
        if pointless || upward {
            return None;
        }
        // "The lounge is below us" is below here.
        let first = match (relation, &first.head) {
            (R::Above | R::Below, Head::Agent | Head::Speaker) => Phrase::new(Head::Here),
            _ => first,
        };
        let mut landmarks = vec![first];
        if relation == R::Between {
            if self.eat("and") {
                let (second, also) = self.landmark()?;
                sure |= also;
                landmarks.push(second);
            } else if !landmarks[0].features.plural {
                return None;
            }
        }
        Some(Related { relation, modifiers, landmarks, sure, definite: !indefinite })
    }

    /// What something can be located by, and whether it surely is a place.
    pub(crate) fn landmark(&mut self) -> Option<(Phrase, bool)> {
        if let Some(phrase) = self.pointer() {
            return Some((phrase, false));
        }
        let read = self.noun_phrase()?;
        let definite = matches!(read.determiner, Determiner::Definite | Determiner::Demonstrative);
        let fits = match read.kind {
            Kind::Place => true,
            Kind::Thing => read.determiner != Determiner::None,
            Kind::Open => definite,
            Kind::Vague if read.name().is_some_and(|n| n.as_str() == "building") => definite,
            Kind::Vague => definite && (read.is_told() || read.determiner == Determiner::Demonstrative),
            Kind::No => false,
        };
        fits.then_some((read.phrase, read.kind == Kind::Place))
    }
}

fn merged(outer: Modifiers, inner: Modifiers) -> Modifiers {
    Modifiers {
        just: outer.just || inner.just,
        distance: inner.distance.or(outer.distance),
        count: inner.count.or(outer.count),
    }
}
