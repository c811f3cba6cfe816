//! One pose and its edges into whatever estimates them.

use crate::failure::Failure;
use crate::g2o::{Edge, Graph};
use nalgebra::{Matrix3, Vector3};
use std::f64::consts::PI;
use toponym_core::Pose2;
use toponym_core::smoothing::{Factor, FactorId, SmoothError, Smoother, Structure};

/// Standard deviation of the position of a pose that no edge ties to an older one, metres.
pub const VAGUE_M: f64 = 50.0;
const VAGUE_RAD: f64 = PI;

/// What a smoother and the structure that particles share have in common.
pub trait Grow {
    fn add_pose_from(&mut self, factor: Factor) -> Result<u32, SmoothError>;
    fn add_anchor(&mut self, pose: Pose2, information: &Matrix3<f64>) -> Result<u32, SmoothError>;
    fn add_factor(&mut self, factor: Factor) -> Result<FactorId, SmoothError>;
}

impl Grow for Smoother {
    fn add_pose_from(&mut self, factor: Factor) -> Result<u32, SmoothError> {
        self.add_pose_from(factor)
    }

    fn add_anchor(&mut self, pose: Pose2, information: &Matrix3<f64>) -> Result<u32, SmoothError> {
        self.add_anchor(pose, information)
    }

    fn add_factor(&mut self, factor: Factor) -> Result<FactorId, SmoothError> {
        self.add_factor(factor)
    }
}

impl Grow for Structure {
    fn add_pose_from(&mut self, factor: Factor) -> Result<u32, SmoothError> {
        self.add_pose_from(factor)
    }

    fn add_anchor(&mut self, pose: Pose2, information: &Matrix3<f64>) -> Result<u32, SmoothError> {
        self.add_anchor(pose, information)
    }

    fn add_factor(&mut self, factor: Factor) -> Result<FactorId, SmoothError> {
        self.add_factor(factor)
    }
}

/// Adds pose k of the graph: from its first edge to an older one, or on its own.
pub fn add_pose(to: &mut impl Grow, graph: &Graph, k: usize) -> Result<(), Failure> {
    let added = match graph.first(k) {
        Some(edge) => to.add_pose_from(edge.factor()),
        // The very first is the origin, whatever its information.
        None => to.add_anchor(Pose2::default(), &vague()),
    };
    added.map(|_| ()).map_err(|source| at(graph, graph.first(k).map_or(graph.line(k), |e| e.line), source))
}

/// Adds one of the other edges.
pub fn add_loop(to: &mut impl Grow, graph: &Graph, edge: &Edge) -> Result<FactorId, Failure> {
    to.add_factor(edge.factor()).map_err(|source| at(graph, edge.line, source))
}

/// A failure of the estimate while it takes in pose k.
pub fn failed(graph: &Graph, k: usize) -> impl Fn(SmoothError) -> Failure {
    move |source| at(graph, graph.line(k), source)
}

fn at(graph: &Graph, line: usize, source: SmoothError) -> Failure {
    Failure::Smooth { file: graph.file.clone(), line, source }
}

fn vague() -> Matrix3<f64> {
    Matrix3::from_diagonal(&Vector3::new(VAGUE_M.powi(-2), VAGUE_M.powi(-2), VAGUE_RAD.powi(-2)))
}
