//! Ids and edges that everyone names: vertices of the graph, and what ties two of them.

use serde::{Deserialize, Serialize};

/// A place: a vertex of the graph. Never reused.
pub type PlaceId = u64;

/// Index of a place in the graph: the vertex v of the paper. Equal to its id.
pub type Vertex = u32;

/// Number of a question that graphs answer: has the robot been here before? Never reused.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct QuestionId {
    /// The robot's boot, or segment of odometry, in which it was asked.
    pub boot: u32,
    /// Counts up.
    pub n: u32,
}

/// How an edge between two places came about.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum EdgeKind {
    /// Proposed because the two are near, eqs. (6–7).
    Distance,
    /// Proposed because the two are called alike, eqs. (8–9).
    Semantic,
    /// Proposed because the robot had lost its place.
    Relocalisation,
}

/// A pair to look at.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Proposal {
    /// The older place.
    pub i: Vertex,
    /// By which distribution.
    pub kind: EdgeKind,
    /// Its probability there.
    pub probability: f64,
}
