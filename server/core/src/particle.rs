//! A particle: {G, X, L, w} of eq. (4). Equal particles are one, with a count.

use crate::effects::EdgeKind;
use crate::geometry::Pose2;
use crate::graph::Vertex;
use crate::labels::Labels;
use crate::smoothing::Smoother;
use nalgebra::Matrix3;
use serde::{Deserialize, Serialize};
use std::sync::Arc;

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
}

/// Equal particles.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Particle {
    /// G: loop edges in the order they were added.
    pub edges: Arc<Vec<Edge>>,
    /// X.
    pub smoother: Smoother,
    /// L.
    pub labels: Labels,
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
            smoother: Smoother::new(),
            labels: Labels::default(),
            log_weight: 0.0,
            count,
            kept_until: 0,
        }
    }

    /// w of all of them together.
    pub fn weight(&self) -> f64 {
        self.log_weight.exp()
    }

    /// Whether two are the same graph with the same measurements.
    pub fn same_graph(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.edges, &other.edges) || self.edges == other.edges
    }
}
