//! What was said as evidence about graphs, without a graph: claims, by reading and utterance.

use crate::edge::Vertex;
use crate::filter::labels::LabelId;
use crate::filter::particle::Particle;
use crate::geometry::Pose2;
use crate::graph::stretches;
use crate::language::act::Sameness;
use crate::talk::Here;
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, BTreeSet};

/// One thing that an utterance claims and that is likelier in some graphs than in others.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum Claim {
    /// "This is the gym": a name as said of a place.
    Called {
        /// Where.
        place: Vertex,
        /// The name as said.
        said: LabelId,
        /// "The gym again", "another gym".
        again: Sameness,
    },
    /// "This is not the gym".
    Denied {
        /// Where.
        place: Vertex,
        /// The name as said.
        said: LabelId,
    },
    /// "This is where we started", or is not.
    One {
        /// One place.
        a: Vertex,
        /// The other.
        b: Vertex,
        /// Whether they are said to be one.
        same: bool,
    },
    /// "We have been here before", or have not.
    Visited {
        /// Where.
        place: Vertex,
        /// Whether it is said to have been seen before.
        before: bool,
    },
    /// "The robot is here", pointed out in the map.
    At {
        /// Where the robot was then.
        place: Vertex,
        /// Where that place is said to lie.
        map_from_place: Pose2,
        /// Standard deviations: metres in each direction, radians.
        sigma: [f64; 2],
    },
    /// "The gym is down the hall": where that puts it is the particle's own, see
    /// [`Labels::described`](crate::filter::labels::Labels::described).
    Located {
        /// The figure's name as said.
        said: LabelId,
    },
}

impl Claim {
    /// The places that it speaks of by their number.
    pub fn places(&self) -> impl Iterator<Item = Vertex> {
        let (a, b) = match *self {
            Self::Called { place, .. }
            | Self::Denied { place, .. }
            | Self::Visited { place, .. }
            | Self::At { place, .. } => (Some(place), None),
            Self::One { a, b, .. } => (Some(a), Some(b)),
            Self::Located { .. } => (None, None),
        };
        a.into_iter().chain(b)
    }

    /// The name that it speaks of, as said.
    pub fn name(&self) -> Option<LabelId> {
        match *self {
            Self::Called { said, .. } | Self::Denied { said, .. } | Self::Located { said } => Some(said),
            Self::One { .. } | Self::Visited { .. } | Self::At { .. } => None,
        }
    }
}

/// One reading of an utterance.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Claims {
    /// Its probability; those of an utterance sum to at most one, and what they lack is "said something
    /// else".
    pub weight: f64,
    /// Each claim with the probability that the speaker gives it.
    pub claims: Vec<(f64, Claim)>,
}

/// What an utterance claims.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Testimony {
    /// Its number in the ledger.
    pub utterance: u32,
    /// All ways to read it that claim anything.
    pub readings: Vec<Claims>,
}

impl Testimony {
    /// Whether it points out where the robot is, and is no talk.
    pub fn is_pose(&self) -> bool {
        self.readings.iter().flat_map(|r| &r.claims).any(|(_, claim)| matches!(claim, Claim::At { .. }))
    }
}

/// Where a place lies that was not in the graph when it was spoken of.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
struct Ahead {
    /// The newest place of the graph by then; none: the first to come.
    of: Option<Vertex>,
    /// From there, by the front end, that all particles share.
    of_from_place: Pose2,
    /// The part of the map that it is in.
    part: usize,
}

/// Every claim in the order said.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct Testimonies {
    said: Vec<Testimony>,
    ahead: BTreeMap<Vertex, Ahead>,
    /// Places spoken of where nothing was seen.
    dark: BTreeSet<Vertex>,
}

impl Testimonies {
    /// In the order said.
    pub fn iter(&self) -> impl Iterator<Item = &Testimony> {
        self.said.iter()
    }

    /// Adds the newest.
    pub(crate) fn add(&mut self, testimony: Testimony, best: &Particle, here: &Here) {
        let claims = || testimony.readings.iter().flat_map(|r| &r.claims);
        let known = best.belief.len() as Vertex;
        let poses = (here.poses)(best);
        for v in claims().flat_map(|(_, claim)| claim.places()).filter(|&v| v >= known) {
            let of = known.checked_sub(1);
            if let (Some(from), Some(to)) = (poses.get(of.unwrap_or(0) as usize), poses.get(v as usize)) {
                let part = here.part.get(v as usize).copied().unwrap_or(0);
                self.ahead.entry(v).or_insert(Ahead { of, of_from_place: from.between(to), part });
            }
        }
        let is_dark = |v: &Vertex| here.dark.get(*v as usize) == Some(&true);
        self.dark.extend(claims().flat_map(|(_, claim)| claim.places()).filter(is_dark));
        if claims().next().is_some() {
            self.said.push(testimony);
        }
    }

    /// Whether nothing was seen where a place was spoken of.
    pub fn is_dark(&self, v: Vertex) -> bool {
        self.dark.contains(&v)
    }

    /// In which part of the map a place is, be it in a particle's graph by now or not; `ends` part it, see
    /// [`Stretches::ends`](crate::graph::stretches::Stretches::ends).
    pub fn part(&self, particle: &Particle, ends: &[Vertex], v: Vertex) -> usize {
        match self.ahead.get(&v) {
            Some(ahead) if (v as usize) >= particle.belief.len() => ahead.part,
            _ => stretches::part(ends, v),
        }
    }

    /// Where a place lies in a particle's map, be it in its graph by now or not.
    pub fn pose(&self, particle: &Particle, v: Vertex) -> Option<Pose2> {
        let belief = &particle.belief;
        if (v as usize) < belief.len() {
            return Some(belief.pose(v));
        }
        let Ahead { of, of_from_place, .. } = self.ahead.get(&v)?;
        let of = of.unwrap_or(0);
        if (of as usize) < belief.len() {
            return Some(belief.pose(of).compose(of_from_place));
        }
        belief.is_empty().then_some(*of_from_place)
    }
}
