//! Questions and answers over the whole posterior.

use crate::edge::PlaceId;
use crate::geometry::Pose2;
pub use crate::regions::occupancy::Grid;
pub use crate::regions::{Goal, Shape};
use nalgebra::Matrix3;
use serde::{Deserialize, Serialize};

/// A question that changes nothing.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Query {
    /// Where is what people call so? A bare name ("kitchen") or a whole question ("where is the
    /// kitchen").
    Where {
        /// Name or question.
        text: String,
        /// Its language (BCP 47); none is English.
        lang: Option<String>,
    },
    /// All names taught so far.
    Labels,
    /// Places and edges of the best particle.
    Graph,
    /// Occupancy grid of the best particle.
    Grid {
        /// Edge of a cell.
        resolution_m: f64,
    },
}

/// The answer to a [`Query`]; an unknown name is an answer too.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Answer {
    /// To [`Query::Where`].
    Where(WhereAnswer),
    /// To [`Query::Labels`].
    Labels(Vec<LabelCount>),
    /// To [`Query::Graph`].
    Graph(GraphAnswer),
    /// To [`Query::Grid`].
    Grid(Grid),
}

/// Where something is, with what probability.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct WhereAnswer {
    /// The question's text.
    pub text: String,
    /// The name asked for, as the map spells it (`elevator lobby`); none if the question was not
    /// understood.
    pub label: Option<String>,
    /// How the name was found: `exact`; `kind`, as that of names which nobody asked for by themselves ("archive" for
    /// the old archive); `synonym`; `sound`, as a misheard one; or `unknown`.
    pub via: String,
    /// Probability that it is nowhere in the map, or that the map is none of those kept. Sums to one with
    /// the candidates'.
    pub p_none: f64,
    /// Posterior mass of graphs that were dropped; part of `p_none`.
    pub unresolved: f64,
    /// Best first.
    pub candidates: Vec<Candidate>,
    /// Names that may have been meant where this one is unknown.
    pub suggestions: Vec<String>,
    /// Newest pose of the robot in the map, if it has one and is not lost.
    pub robot: Option<Pose2>,
}

/// One place that may be meant.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Candidate {
    /// The region, by its id; a place that lies in none.
    pub place: PlaceId,
    /// What it is called.
    pub label: String,
    /// The same as a guide spells it: `Nick's Office`.
    pub shown: String,
    /// Probability that this one is meant.
    pub probability: f64,
    /// Probability that the name applies to it.
    pub p_is: f64,
    /// Its pose in the map (of the best particle).
    pub pose: Pose2,
    /// Covariance, x y yaw, map axes.
    pub covariance: Matrix3<f64>,
    /// Outline of the region, metres, map; empty for a place that lies in none.
    pub polygon_m: Vec<(f64, f64)>,
    /// Where to send a robot: free floor with room for it, looking in; a place that lies in no region is one where a
    /// robot stood.
    pub goal: Goal,
    /// Length of the way there from the robot over known free space, where that was asked for and there is one, metres.
    pub walk_m: Option<f64>,
    /// Ids of the utterances it rests on.
    pub because: Vec<String>,
}

/// What is at a point of the map.
#[derive(Clone, Debug, PartialEq)]
pub struct WhatAnswer {
    /// The point in the best graph's map.
    pub x_m: f64,
    /// See `x_m`.
    pub y_m: f64,
    /// Id of the region in which it lies.
    pub region: Option<PlaceId>,
    /// What kind of space that is.
    pub shape: Option<Shape>,
    /// Names as guides spell them and as the map does, with the probability that each applies; likeliest first.
    pub names: Vec<(String, String, f64)>,
    /// Posterior mass of graphs that were dropped.
    pub unresolved: f64,
}

/// A name and where it was given.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct LabelCount {
    /// The name.
    pub label: String,
    /// The same as a guide spells it.
    pub shown: String,
    /// Utterances that spoke of it.
    pub utterances: u64,
    /// Place that most likely bears it.
    pub place: PlaceId,
}

/// A vertex of the best graph.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PlaceView {
    /// Its id.
    pub id: PlaceId,
    /// Stamp of its first scan, ns.
    pub stamp_ns: i64,
    /// Pose in the map.
    pub pose: Pose2,
    /// Names with probabilities that each applies, best first.
    pub labels: Vec<(String, f64)>,
}

/// A loop edge (the chain of successive places is implied).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct EdgeView {
    /// Older place.
    pub i: PlaceId,
    /// Newer place.
    pub j: PlaceId,
    /// How it was proposed.
    pub kind: crate::edge::EdgeKind,
    /// Measured transform.
    pub i_from_j: Pose2,
}

/// A distinct graph of the posterior.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ParticleView {
    /// Its posterior mass; all sum to one with what is unresolved.
    pub weight: f64,
    /// Its loop edges.
    pub edges: Vec<EdgeView>,
    /// Poses of all places, open ones too, in its own map; in the order of the answer's places.
    /// Empty in what came over the network.
    pub poses: Vec<Pose2>,
}

/// The posterior's graphs; `places` in the best one.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct GraphAnswer {
    /// +1 when coordinates jump.
    pub epoch: u64,
    /// +1 per change.
    pub rev: u64,
    /// Places of the best graph.
    pub places: Vec<PlaceView>,
    /// Distinct graphs, best first.
    pub particles: Vec<ParticleView>,
    /// Posterior mass of graphs that were dropped; sums to one with the particles' weights.
    pub unresolved: f64,
    /// What the best graphs disagree about; empty where one is all there is.
    pub differences: Vec<Difference>,
    /// 1 / Σ w² over particles, among those kept.
    pub effective_sample_size: f64,
}

/// One way that the map can be, in what it differs from the others told.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Difference {
    /// Weight of the graph.
    pub weight: f64,
    /// "place 41 is place 7 again, place 60 is new ground".
    pub words: String,
}
