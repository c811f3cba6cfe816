//! What grounding is asked: a clause as plain numbers, its words already looked up.

use crate::language::act::Frame;
use crate::language::relation::Relation;

/// What narrows a relation.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Narrowing {
    /// "Just", "right": close by.
    pub just: bool,
    /// "Twenty meters".
    pub distance_m: Option<f64>,
    /// "The second door", "two doors down": so many doors on.
    pub doors: Option<u32>,
}

/// The places that a landmark may be.
#[derive(Clone, Copy, Debug)]
pub struct LandmarkBelief<'a> {
    /// (index, probability); what they lack to one is "an unknown place".
    pub places: &'a [(usize, f64)],
    /// It is long, and one goes along it: a hallway, a ramp, the way itself. Its floor is then the
    /// straight stretch that was driven there.
    pub way: bool,
}

/// One reading of a clause; a clause is some of them, whose weights sum to at most one.
#[derive(Clone, Copy, Debug)]
pub struct Reading<'a> {
    /// Its probability.
    pub weight: f64,
    /// How the figure lies.
    pub relation: Relation,
    /// Whose left is meant; none: not said.
    pub frame: Option<Frame>,
    /// "Just", "twenty meters".
    pub narrowing: Narrowing,
    /// One; two for [`Relation::Between`].
    pub landmarks: &'a [LandmarkBelief<'a>],
}
