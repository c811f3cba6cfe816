//! Step 1 of Algorithm 1: which older places are looked at, eqs. (5–9).
//!
//! The draws are common to all particles: particles that agree look at the same places, and each
//! pair is matched once. A proposal decides only where we look; whether an edge enters a particle
//! is decided in [`crate::filter::weigh`], where the proposal's probability is accounted for.

use crate::config::Config;
use crate::edge::{EdgeKind, Proposal, Vertex};
use crate::filter::particle::Particle;
use crate::geometry::Pose2;
use crate::graph::Graph;
use crate::random::{Purpose, uniform};
use crate::smoothing::{Belief, Relative, Structure};
use crate::track::front::LOCAL_PATH_M;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Older places looked at per new place and particle.
const LOOKED_AT_MAX: usize = 5;
/// Places proposed are so far apart along the path: their content overlaps otherwise.
pub(crate) const SPREAD_M: f64 = 2.0;
/// Beyond, two places' scans hardly overlap, and eq. (6) is small.
pub const NEAR_M: f64 = 10.0;
/// Position uncertainty at which the robot counts as lost.
pub const LOST_SIGMA_M: f64 = 10.0;
/// Probability of an edge to any place looked at, when lost.
pub const RELOCALISATION_P: f64 = 0.2;
/// The same for the places just before the break: mostly a robot is where it was.
const STAYED_P: f64 = 0.9;
const STAYED_PATH_M: f64 = 3.0;
/// Probability of an edge to a place where somebody saw the robot …
const POINTED_AT_P: f64 = 0.9;
/// … less so beside it, as a Gaussian whose deviation is this and how well it was seen, …
const POINTED_AT_M: f64 = 1.5;
/// … so far along the path since.
const POINTED_AT_PATH_M: f64 = 15.0;
/// Similarities below are chance.
pub const SIMILARITY_MIN: f64 = 0.02;

/// Eqs. (6–7): p(edge) = ∫ 1/(1+γd²) p(d) dd, where d = |x_i⁻¹ x_t| follows a folded Gaussian given
/// the joint covariance of the two poses.
pub fn distance_probability(relative: &Relative, gamma_per_m2: f64) -> f64 {
    let (mean_m, sigma_m) = distance(relative);
    // Trapezia over ± 3 σ, none wider than the kernel; folding is |d|, and the integrand is even.
    let (mut sum, mut mass) = (0.0, 0.0);
    let half = (3.0 * sigma_m).clamp(6.0, 300.0) as i32;
    for k in -half..=half {
        let s = f64::from(k) * 3.0 / f64::from(half);
        let (d, p) = (mean_m + s * sigma_m, (-0.5 * s * s).exp());
        sum += p / (1.0 + gamma_per_m2 * d * d);
        mass += p;
    }
    sum / mass
}

/// Mean and standard deviation of the distance between two places, metres.
pub fn distance(relative: &Relative) -> (f64, f64) {
    let t = &relative.i_from_a;
    let mean_m = t.x_m.hypot(t.y_m);
    // Direction of the translation in the newer place's frame, where the covariance lives.
    let bearing = t.y_m.atan2(t.x_m) - t.yaw_rad;
    let (s, c) = bearing.sin_cos();
    let m = &relative.covariance;
    let along = c * c * m[(0, 0)] + 2.0 * c * s * m[(0, 1)] + s * s * m[(1, 1)];
    (mean_m, along.max(0.0).sqrt())
}

/// Whether a place is tied to no older segment: the last place of each is known, seen from it, to no
/// better than [`LOST_SIGMA_M`].
pub fn is_lost(graph: &Graph, structure: &Structure, belief: &Belief, t: Vertex) -> bool {
    let segment = |v: Vertex| graph.place(v).segment;
    let ends: Vec<Vertex> =
        (0..t).filter(|&i| segment(i) != segment(t) && segment(i) != segment(i + 1)).collect();
    !ends.is_empty()
        && belief
            .relative(structure, t, &ends)
            .is_ok_and(|all| all.iter().all(|r| r.sigma_m() > LOST_SIGMA_M))
}

/// Where somebody saw the robot last, in the map.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct PointedAt {
    /// The place that it was at.
    pub place: Vertex,
    /// Where that lies.
    pub map_from_place: Pose2,
    /// Standard deviation in each direction, metres.
    pub within_m: f64,
}

/// What equal particles would look at from place `t`: distance edges, semantic edges, where the robot was seen, and any
/// place when it is lost. `followed` says which older places are already being followed.
pub fn propose(
    config: &Config,
    (graph, structure, pointed_at): (&Graph, &Structure, Option<&PointedAt>),
    particle: &Particle,
    t: Vertex,
    followed: impl Fn(&Belief, Vertex) -> bool,
) -> Vec<Proposal> {
    let belief = &particle.belief;
    let marginal = belief.marginal(structure, t);
    let sigma_m = marginal[(0, 0)].max(marginal[(1, 1)]).sqrt();
    // What is being followed needs no second look; words do get one, wherever they point.
    if graph.place(t).content.is_bare() {
        return Vec::new();
    }
    let older = (0..t).filter(|&i| {
        graph.apart(i, t, LOCAL_PATH_M) && !graph.place(i).content.is_bare() && !followed(belief, i)
    });
    let lost = is_lost(graph, structure, belief, t);
    let here = belief.pose(t);
    let within_m = NEAR_M + 3.0 * sigma_m.min(LOST_SIGMA_M);
    let near: Vec<Vertex> =
        older.clone().filter(|&i| !lost && belief.pose(i).distance_m(&here) < within_m).collect();
    let mut proposals: Vec<Proposal> = belief
        .relative(structure, t, &near)
        .unwrap_or_default()
        .iter()
        .map(|r| Proposal {
            i: r.i,
            kind: EdgeKind::Distance,
            probability: distance_probability(r, config.gamma_per_m2),
        })
        .collect();
    if let Some(at) = pointed_at.filter(|at| at.place <= t && !graph.apart(at.place, t, POINTED_AT_PATH_M)) {
        let here = at.map_from_place.compose(&graph.chained(at.place, t));
        let looked_at = |i| {
            let off = belief.pose(i).distance_m(&here) / (at.within_m + POINTED_AT_M);
            let probability = POINTED_AT_P * (-0.5 * off * off).exp();
            Proposal { i, kind: EdgeKind::Relocalisation, probability }
        };
        proposals.extend(older.clone().map(looked_at).filter(|p| p.probability > SIMILARITY_MIN));
    }
    if lost {
        let before_break = (0..t).rev().find(|&i| graph.place(i).segment != graph.place(t).segment);
        let stayed = |i| before_break.is_some_and(|b| !graph.apart(i, b, STAYED_PATH_M));
        proposals.extend(older.map(|i| Proposal {
            i,
            kind: EdgeKind::Relocalisation,
            probability: if stayed(i) { STAYED_P } else { RELOCALISATION_P },
        }));
    }
    likeliest(&mut proposals);
    if config.semantic_edges {
        // Names are given to places not frozen yet, too; those have nothing to match.
        let matchable = |i| i < t && graph.apart(i, t, LOCAL_PATH_M);
        merge_semantic(&mut proposals, particle.labels.similar(t), matchable);
    }
    draw(config.seed, graph, t, config.particles, proposals)
}

/// Of each place once, as likely as anything has it.
fn likeliest(proposals: &mut Vec<Proposal>) {
    proposals.sort_by(|a, b| a.i.cmp(&b.i).then(b.probability.total_cmp(&a.probability)));
    proposals.dedup_by_key(|p| p.i);
}

/// What equal particles would look at for the names of a place, wherever the robot is now: any other
/// place left, older or newer.
pub fn propose_named(config: &Config, graph: &Graph, particle: &Particle, v: Vertex) -> Vec<Proposal> {
    if !(config.loops && config.semantic_edges) {
        return Vec::new();
    }
    let left = graph.places().len() as Vertex;
    let mut proposals = Vec::new();
    merge_semantic(&mut proposals, particle.labels.similar(v), |i| {
        i < left && graph.apart(i, v, LOCAL_PATH_M)
    });
    draw(config.seed, graph, v, config.particles, proposals)
}

/// Eqs. (8–9): an edge that the words propose too is a semantic one, of either's probability.
fn merge_semantic(
    proposals: &mut Vec<Proposal>,
    similar: BTreeMap<Vertex, f64>,
    matchable: impl Fn(Vertex) -> bool,
) {
    for (i, probability) in similar {
        if probability < SIMILARITY_MIN || !matchable(i) {
            continue;
        }
        let kind = EdgeKind::Semantic;
        match proposals.iter_mut().find(|p| p.i == i) {
            Some(p) => {
                let either = 1.0 - (1.0 - p.probability) * (1.0 - probability);
                *p = Proposal { i, kind, probability: either };
            }
            None => proposals.push(Proposal { i, kind, probability }),
        }
    }
}

/// An independent draw per older place; of those drawn the likeliest, spread along the path.
///
/// A near place that is not drawn now is drawn from the next place, a metre on. A name is said
/// once: there each of the equal particles draws for itself.
pub fn draw(seed: u64, graph: &Graph, t: Vertex, count: u32, proposals: Vec<Proposal>) -> Vec<Proposal> {
    let any_of = |p: &Proposal| match p.kind {
        EdgeKind::Semantic => 1.0 - (1.0 - p.probability).powi(count as i32),
        EdgeKind::Distance | EdgeKind::Relocalisation => p.probability,
    };
    let mut drawn: Vec<(f64, Proposal)> = proposals
        .into_iter()
        .map(|p| (any_of(&p) / uniform(seed, t.into(), p.i.into(), Purpose::Propose).max(1e-9), p))
        .filter(|(ratio, _)| *ratio > 1.0)
        .collect();
    drawn.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.i.cmp(&b.1.i)));
    let mut chosen: Vec<Proposal> = Vec::new();
    for (_, p) in drawn {
        if chosen.len() == LOOKED_AT_MAX {
            break;
        }
        if chosen.iter().all(|c| graph.apart(c.i, p.i, SPREAD_M)) {
            chosen.push(p);
        }
    }
    chosen
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Matrix3, Vector3};

    fn relative(x_m: f64, y_m: f64, yaw_rad: f64, sigma: [f64; 2]) -> Relative {
        let covariance = Matrix3::from_diagonal(&Vector3::new(sigma[0].powi(2), sigma[1].powi(2), 0.01));
        Relative { i: 0, i_from_a: Pose2::new(x_m, y_m, yaw_rad), covariance }
    }

    #[test]
    fn distance_probability_is_the_mean_over_the_folded_gaussian() {
        // Against a fine sum over d ~ |N(4, 1.5²)|.
        let r = relative(4.0, 0.0, 0.0, [1.5, 9.0]);
        let (mut sum, mut mass) = (0.0, 0.0);
        for k in -6000..=6000 {
            let s = f64::from(k) * 1e-3;
            let d: f64 = (4.0 + 1.5 * s).abs();
            let p = (-0.5 * s * s).exp();
            sum += p / (1.0 + 0.2 * d * d);
            mass += p;
        }
        assert!((distance_probability(&r, 0.2) - sum / mass).abs() < 2e-3);
        let sure = relative(0.0, 5.0, 1.0, [1e-9, 1e-9]);
        assert!((distance_probability(&sure, 0.2) - 1.0 / 6.0).abs() < 1e-9);
    }

    #[test]
    fn only_the_spread_towards_the_other_place_counts() {
        // The body looks along the map's y: its x axis points at a place 3 m ahead.
        let r = relative(0.0, 3.0, std::f64::consts::FRAC_PI_2, [0.7, 5.0]);
        let (mean_m, sigma_m) = distance(&r);
        assert!((mean_m - 3.0).abs() < 1e-12 && (sigma_m - 0.7).abs() < 1e-9, "{mean_m} {sigma_m}");
    }
}
