//! Steps 1 and 4 for one particle: what a fit says of its graph, eqs. (17–18).
//!
//! A fit z between the newest place and an older one is answered: the robot is there, or it is not and z is by
//! chance. Against a graph that has it elsewhere, on new ground say, one that has it there weighs by
//!
//! ```text
//! w_there / w_elsewhere = p_D · N(z; h(x⁻), S) / λ_c(z),    S = H Σ⁻ Hᵀ + R          (17–18)
//! ```
//!
//! with poses x⁻ before z. N is exactly what the edge adds to the graph's own evidence, so that a weight is a
//! function of the graph: whatever the order in which edges came, their product is the same. There is no p(e)
//! beside: where a graph lays the places is all that it knows of whether they are one.
//!
//! After a break of odometry the prediction is no Gaussian: mostly the robot is where it was, else anywhere on
//! the floor that was driven, or on new ground, [`started`].

use crate::edge::Vertex;
use crate::filter::chance::{log_add, log_chance};
use crate::filter::failure::log_failed;
use crate::filter::loops::{AGREE_M, AGREE_RAD, agree};
use crate::filter::particle::{Edge, LetGo, Particle};
use crate::filter::propose::LOST_SIGMA_M;
use crate::geometry::wrap;
use crate::graph::Graph;
use crate::smoothing::{LogDensity, Relative, Structure};
use nalgebra::{Matrix3, Vector3};
use std::f64::consts::{PI, TAU};

/// p_D: how often a pair that truly overlaps yields a fit, and its neighbours as many as count.
pub(crate) const DETECTED: f64 = 0.8;
/// τ: share of fits whose errors are three times what they say.
const TAIL: f64 = 0.02;
/// Of robots whose odometry broke so many are where they were, within so much; so many on floor that was
/// driven, each place of it standing for so much.
const STAYED: f64 = 0.3;
const STAYED_SIGMA: [f64; 3] = [1.0, 1.0, 1.0];
const SOMEWHERE: f64 = 0.6;
const PLACE_M2: f64 = 2.0;

/// A fit that a chain explains worse than chance by so much may be one across a stretch that failed.
const UNEXPLAINED: f64 = -4.0;

/// What a particle thinks of a fit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Judgement {
    /// log w_there / w_elsewhere.
    pub log_there: f64,
    /// Mahalanobis distance² of z from the prediction.
    pub distance2: f64,
    /// Whether the particle ties the two places already, and where z has them: with the edge and without
    /// its map is the same.
    pub known: bool,
    /// What the particle lets go to have the robot there, if it has to.
    pub lets_go: Option<LetGo>,
}

/// Eq. (18) of a fit, as the edge that it would be. R is that by which the edge is inserted.
pub fn judge(graph: &Graph, structure: &Structure, particle: &Particle, edge: &Edge) -> Option<Judgement> {
    let predicted = particle.belief.relative(structure, edge.j, &[edge.i]).ok()?.into_iter().next()?;
    let (log_n, distance2) = log_density(&predicted, edge)?;
    let held = DETECTED.ln() + edge.log_looks + log_n
        - log_chance(turned_rad(&predicted, edge), {
            (predicted.covariance[(2, 2)] + edge.covariance[(2, 2)]).sqrt()
        });
    let judged = Judgement { log_there: held, distance2, known: is_known(&predicted, edge), lets_go: None };
    let otherwise = DETECTED.ln() + edge.log_looks - log_chance(0.0, PI);
    let broken =
        predicted.sigma_m() > LOST_SIGMA_M && graph.place(edge.i).segment != graph.place(edge.j).segment;
    let judged = if broken {
        let log_there = otherwise + started(&predicted, edge, graph.places().len())?;
        Judgement { log_there, lets_go: start(graph, particle, edge), ..judged }
    } else if held < UNEXPLAINED {
        log_failed(graph, particle, edge).map_or(judged, |(log_f, let_go)| {
            if otherwise + log_f > held {
                Judgement { log_there: otherwise + log_f, lets_go: Some(let_go), ..judged }
            } else {
                judged
            }
        })
    } else {
        judged
    };
    judged.log_there.is_finite().then_some(judged)
}

/// The start of the newest segment, moved to where an edge has it.
fn start(graph: &Graph, particle: &Particle, edge: &Edge) -> Option<LetGo> {
    let from = (edge.i + 1..=edge.j).rev().find(|&v| graph.place(v).chain.broken)?;
    let pose = |v: Vertex| particle.belief.pose(v);
    let moved = pose(edge.i).compose(&edge.i_from_j).compose(&pose(edge.j).inverse());
    Some(LetGo { from, moved })
}

fn turned_rad(predicted: &Relative, edge: &Edge) -> f64 {
    wrap(edge.i_from_j.yaw_rad - predicted.i_from_a.yaw_rad)
}

/// log N(z; h, S), with the tail of N, and z's Mahalanobis distance² from the prediction.
pub fn log_density(predicted: &Relative, edge: &Edge) -> Option<(f64, f64)> {
    let LogDensity { log_density, distance2 } = predicted.log_density(&edge.i_from_j, &edge.covariance)?;
    // N(9S), by N(S).
    let wide = log_density + 0.5 * (distance2 - distance2 / 9.0) - 3.0 * 3.0_f64.ln();
    Some((log_add((1.0 - TAIL).ln() + log_density, TAIL.ln() + wide), distance2))
}

/// log density of a fit after a break of odometry, m⁻² rad⁻¹, in a map of so many places.
fn started(predicted: &Relative, edge: &Edge, places: usize) -> Option<f64> {
    let sigma = Vector3::from(STAYED_SIGMA);
    let stayed =
        Relative { covariance: Matrix3::from_diagonal(&sigma.component_mul(&sigma)), ..predicted.clone() };
    let floor_m2 = PLACE_M2 * places.max(1) as f64;
    Some(log_add(STAYED.ln() + log_density(&stayed, edge)?.0, (SOMEWHERE / (floor_m2 * TAU)).ln()))
}

/// Whether the prediction is as good as a fit, and they agree.
fn is_known(predicted: &Relative, edge: &Edge) -> bool {
    agree(&predicted.i_from_a, &edge.i_from_j, 1.0)
        && predicted.sigma_m() < AGREE_M
        && predicted.sigma_rad() < AGREE_RAD
}

#[cfg(test)]
pub(crate) mod tests;
