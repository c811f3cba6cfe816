//! A particle: {G, X, L, w} of eq. (4). Equal particles are one, with a count.

use crate::edge::{EdgeKind, RevisitId, Vertex};
use crate::filter::labels::Labels;
use crate::geometry::Pose2;
use crate::smoothing::{Belief, FactorId, SmoothError, Structure};
use nalgebra::Matrix3;
use serde::{Deserialize, Serialize};
use std::collections::BTreeSet;
use std::sync::Arc;

/// An edge says that two places are one only if they lie this near; scans tie farther ones too.
const SAME_PLACE_M: f64 = 3.0;

/// A loop edge of G: everything but the chain of successive places.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Edge {
    /// The older place.
    pub i: Vertex,
    /// The newer place.
    pub j: Vertex,
    /// How it was proposed.
    pub kind: EdgeKind,
    /// Measured transform.
    pub i_from_j: Pose2,
    /// Covariance of it, right perturbation.
    pub covariance: Matrix3<f64>,
    /// The revisit that it is of.
    pub revisit: RevisitId,
    /// The pair (older, newer) whose names led to the revisit, if any did.
    pub named: Option<(Vertex, Vertex)>,
    /// Its factor in the structure that all particles share.
    pub factor: FactorId,
}

/// Equal particles.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Particle {
    /// G: loop edges in the order they were added.
    pub edges: Arc<Vec<Edge>>,
    /// The revisits that G's loop edges are of, in order.
    pub taken: Arc<Vec<RevisitId>>,
    /// Revisits of late that were decided against.
    pub refused: Vec<RevisitId>,
    /// X.
    pub belief: Belief,
    /// L.
    pub labels: Labels,
    /// The words' share in log w, when they were last asked: see [`crate::filter::words`].
    pub log_words: f64,
    /// log w of all of them together; normalised after each step.
    pub log_weight: f64,
    /// How many they are.
    pub count: u32,
    /// Refused a fresh semantic edge: kept until this place, whatever its weight.
    pub kept_until: Vertex,
}

impl Particle {
    /// `count` particles with nothing in them.
    pub fn empty(count: u32) -> Self {
        Self {
            edges: Arc::default(),
            taken: Arc::default(),
            refused: Vec::new(),
            belief: Belief::new(),
            labels: Labels::default(),
            log_words: 0.0,
            log_weight: 0.0,
            count,
            kept_until: 0,
        }
    }

    /// Whether G has an edge of a revisit.
    pub fn holds(&self, revisit: RevisitId) -> bool {
        self.taken.binary_search(&revisit).is_ok()
    }

    /// Adds an edge to G, and what it says of labels to L; X follows at the next update.
    pub fn take(&mut self, edge: Edge) {
        self.belief.hold(edge.factor);
        if edge.i_from_j.x_m.hypot(edge.i_from_j.y_m) < SAME_PLACE_M {
            self.labels.carry_over(edge.i, edge.j);
        }
        if let Err(at) = self.taken.binary_search(&edge.revisit) {
            Arc::make_mut(&mut self.taken).insert(at, edge.revisit);
        }
        Arc::make_mut(&mut self.edges).push(edge);
    }

    /// Takes edges out of G, and what was carried over them out of L; X follows at the next update.
    pub fn give_up(&mut self, unwanted: impl Fn(&Edge) -> bool) {
        let (gone, kept): (Vec<Edge>, Vec<Edge>) = self.edges.iter().cloned().partition(unwanted);
        for edge in &gone {
            self.belief.release(edge.factor);
            self.labels.carry_back(edge.i, edge.j);
        }
        let taken: BTreeSet<RevisitId> = kept.iter().map(|e| e.revisit).collect();
        self.taken = Arc::new(taken.into_iter().collect());
        self.edges = Arc::new(kept);
    }

    /// X given G, eq. (10). On an error poses stay where they were, and covariances are unknown.
    pub fn update(&mut self, structure: &Structure) -> Result<(), SmoothError> {
        self.belief.update(structure)?;
        // A loop may move more poses than an update's budget reaches. What is judged next must see
        // them all where they belong: half of them moved are worse than none.
        if self.belief.pending() {
            self.belief.settle(structure)?;
        }
        Ok(())
    }

    /// w of all of them together.
    pub fn weight(&self) -> f64 {
        self.log_weight.exp()
    }

    /// Whether two believe in the same revisits. Which of a revisit's fits became edges is no difference.
    pub fn same_graph(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.taken, &other.taken) || self.taken == other.taken
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_revisit_is_taken_while_one_of_its_edges_is_held() {
        let mut p = Particle::empty(1);
        for (factor, revisit) in [4, 2, 4].into_iter().enumerate() {
            p.take(Edge {
                i: 0,
                j: 9,
                kind: EdgeKind::Distance,
                i_from_j: Pose2::default(),
                covariance: Matrix3::identity(),
                revisit,
                named: None,
                factor: factor as FactorId,
            });
        }
        assert_eq!(p.taken[..], [2, 4]);
        p.give_up(|e| e.factor == 0);
        assert_eq!(p.taken[..], [2, 4]);
        p.give_up(|e| e.revisit == 4);
        assert_eq!(p.taken[..], [2]);
    }
}
