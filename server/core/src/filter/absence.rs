//! Step 4 where a graph expects something: the detector's other outcome, eqs. (17–18).
//!
//! A graph that lays the newest place over an older one expects the two to look alike. If it knows how they lie,
//! their scans are compared as they lie, and what share c of the compared points contradict weighs by
//!
//! ```text
//! p(c | right) / p(c | wrong) = κ + (1 − κ) · min(1, (c / c₀)^−w)
//! ```
//!
//! c₀ what contradicts in right maps, too, κ for what was moved between two visits. What agrees is no evidence: a
//! copy agrees, too. If it does not know, places that were looked at and do not look alike, or elsewhere only, weigh
//! by
//!
//! ```text
//! p(no fit | G) / p(no fit | new ground) = 1 − p_D · ō,    ō = P(the two overlap) under x⁻
//! ```
//!
//! and a graph that expects nothing there by 1. Pairs are the same for all particles; one that nobody looked at
//! says nothing. Neighbouring places show the same walls: floors are paid for once.

use crate::edge::Vertex;
use crate::filter::particle::Particle;
use crate::geometry::Pose2;
use crate::graph::Graph;
use crate::scan::agree::{Agreement, agreement};
use crate::scan::view::Closeness;
use crate::smoothing::{Relative, Structure};
use crate::track::front::LOCAL_PATH_M;
use libm::erf;

/// p_D of a single pair within [`OVERLAP_M`] of each other, by the search.
const FOUND: f64 = 0.8;
/// Places this near overlap …
pub const OVERLAP_M: f64 = 2.0;
/// … if either has so many surfaces to show.
const SURFACES_MIN: usize = 60;
/// Fits within so much of where they are expected, beyond its spread, are those expected.
const EXPECTED_M: f64 = 0.5;
const EXPECTED_RAD: f64 = 0.1;
/// So many standard deviations of the spread.
const SIGMAS: f64 = 3.0;
/// c₀, beyond which right maps hardly ever are, and w, the smaller of what either half of the drives teaches: by
/// `--example drives -- absence` of the server, from right and wrong maps of simulated tours.
pub const CONTRADICTED: (f64, f64) = (0.1, 5.5);
/// κ: of looks at a place that is known so many find something moved, a door or a table. Assumed: nothing is moved in
/// simulated tours.
const MOVED: f64 = 0.02;
/// How certain the relative pose must be for that …
const SURE_SIGMA_M: f64 = 0.3;
const SURE_SIGMA_RAD: f64 = 0.05;
/// … and how likely that the two overlap.
const SURE_OVERLAP: f64 = 0.5;
/// Points that must be seen or seen through for an outcome.
const COMPARED_MIN: u32 = 20;
/// Places along the path that are farther apart are of two floors, which either is expected to be found, metres.
pub const FLOOR_M: f64 = 10.0;
/// Places that are looked at again for a map that comes back.
const LOOKED_BACK: Vertex = 100;
/// Path that shows the same walls, metres.
pub const SAME_WALLS_M: f64 = 5.0;

/// log factor of place `t` for one particle, given what was looked at and what was found; what it pays is
/// remembered.
pub fn pay(
    graph: &Graph,
    structure: &Structure,
    particle: &mut Particle,
    t: Vertex,
    looked: &[(Vertex, Vec<Pose2>)],
) -> f64 {
    let path_m = graph.place(t).path_m;
    if particle.missed_at_m.is_some_and(|at_m| path_m - at_m < SAME_WALLS_M) {
        return 0.0;
    }
    let log = log_expected(graph, structure, particle, t, looked);
    if log < -0.1 {
        particle.missed_at_m = Some(path_m);
    }
    log
}

fn log_expected(
    graph: &Graph,
    structure: &Structure,
    particle: &Particle,
    t: Vertex,
    looked: &[(Vertex, Vec<Pose2>)],
) -> f64 {
    let shows = |v: Vertex| graph.place(v).content.sample.len() >= SURFACES_MIN;
    if !shows(t) {
        return 0.0;
    }
    let near = |i: Vertex| particle.belief.pose(i).distance_m(&particle.belief.pose(t)) < 3.0 * OVERLAP_M;
    let pairs: Vec<Vertex> = looked.iter().map(|(i, _)| *i).filter(|&i| shows(i) && near(i)).collect();
    let Ok(mut predicted) = particle.belief.relative(structure, t, &pairs) else { return 0.0 };
    predicted.sort_by_key(|r| r.i);
    let floors = predicted.chunk_by(|a, b| !graph.apart(a.i, b.i, FLOOR_M));
    let of = |floor: &[Relative]| match contradicted(graph, t, floor) {
        Some(share) => log_contradicted(share),
        None => log_missed(floor, looked),
    };
    floors.map(of).sum()
}

/// What a map has contradicted itself since place `from`, so far back as matters: for one that nobody kept.
pub fn log_contradictions(graph: &Graph, structure: &Structure, particle: &Particle, from: Vertex) -> f64 {
    let end = graph.places().len() as Vertex;
    let (mut log, mut last_m) = (0.0, f64::NEG_INFINITY);
    for t in from.max(end.saturating_sub(LOOKED_BACK))..end {
        let path_m = graph.place(t).path_m;
        if path_m - last_m < SAME_WALLS_M {
            continue;
        }
        let here = particle.belief.pose(t);
        let near = |i: &Vertex| particle.belief.pose(*i).distance_m(&here) < OVERLAP_M;
        let pairs: Vec<Vertex> =
            (0..t).filter(|&i| graph.apart(i, t, LOCAL_PATH_M)).filter(near).step_by(2).collect();
        let Ok(mut predicted) = particle.belief.relative(structure, t, &pairs) else { continue };
        predicted.sort_by_key(|r| r.i);
        let floors = predicted.chunk_by(|a, b| !graph.apart(a.i, b.i, FLOOR_M));
        let of_place: f64 =
            floors.filter_map(|floor| contradicted(graph, t, floor)).map(log_contradicted).sum();
        if of_place < -0.1 {
            last_m = path_m;
            log += of_place;
        }
    }
    log
}

/// log p(c | right) / p(c | wrong).
fn log_contradicted(share: f64) -> f64 {
    let (usual, power) = CONTRADICTED;
    (MOVED + (1.0 - MOVED) * (share / usual).max(1.0).powf(-power)).ln()
}

/// The share of points that contradict where a map lays place `t` for certain over places of one floor, by the
/// pair that sees most of each other; 0 if they see nothing of each other. None: it is not certain.
pub fn contradicted(graph: &Graph, t: Vertex, floor: &[Relative]) -> Option<f64> {
    let is_sure = |r: &&Relative| {
        r.sigma_m() < SURE_SIGMA_M && r.sigma_rad() < SURE_SIGMA_RAD && p_overlap(r) > SURE_OVERLAP
    };
    let compare = |r: &Relative| {
        let look = Closeness {
            tolerance_m: Closeness::CLOSE.tolerance_m + 2.0 * r.sigma_m(),
            tolerance_per_m: Closeness::CLOSE.tolerance_per_m + 2.0 * r.sigma_rad(),
            ..Closeness::CLOSE
        };
        agreement(&graph.place(r.i).content, &graph.place(t).content, &r.i_from_a, &look)
    };
    let best = floor.iter().filter(is_sure).map(compare).max_by_key(Agreement::compared)?;
    Some(if best.compared() < COMPARED_MIN { 0.0 } else { 1.0 - best.score() })
}

/// Of the places of one floor: some found is found.
fn log_missed(floor: &[Relative], looked: &[(Vertex, Vec<Pose2>)]) -> f64 {
    let found = |r: &&Relative| {
        let of = looked.iter().filter(|(i, _)| *i == r.i).flat_map(|(_, modes)| modes);
        p_overlap(r) > 0.01 && of.into_iter().any(|z| is_expected(r, z))
    };
    if floor.iter().any(|r| found(&r)) {
        return 0.0;
    }
    (1.0 - FOUND * floor.iter().map(p_overlap).fold(0.0, f64::max)).ln()
}

/// P(o): that the two places lie within [`OVERLAP_M`] of each other along either axis.
fn p_overlap(r: &Relative) -> f64 {
    let m = r.i_from_a.inverse();
    let within = |mean_m: f64, variance: f64| {
        let root = (2.0 * variance.max(1e-6)).sqrt();
        0.5 * (erf((OVERLAP_M - mean_m) / root) + erf((OVERLAP_M + mean_m) / root))
    };
    within(m.x_m, r.covariance[(0, 0)]) * within(m.y_m, r.covariance[(1, 1)])
}

fn is_expected(r: &Relative, z: &Pose2) -> bool {
    let off = r.i_from_a.between(z);
    off.x_m.hypot(off.y_m) < EXPECTED_M + SIGMAS * r.sigma_m()
        && off.yaw_rad.abs() < EXPECTED_RAD + SIGMAS * r.sigma_rad()
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Matrix3, Vector3};

    fn at(x_m: f64, sigma_m: f64) -> Relative {
        let v = sigma_m * sigma_m;
        let covariance = Matrix3::from_diagonal(&Vector3::new(v, v, 0.01));
        Relative { i: 0, i_from_a: Pose2::new(x_m, 0.0, 0.0), covariance }
    }

    #[test]
    fn overlap_is_sure_where_it_is_known_and_a_share_where_it_is_not() {
        assert!(p_overlap(&at(0.5, 0.1)) > 0.99 && p_overlap(&at(5.0, 0.1)) < 0.01);
        // Two sides of 4 m in a spread of 10 m: .159² by the table of the normal.
        assert!((p_overlap(&at(0.0, 10.0)) - 0.1585_f64.powi(2)).abs() < 1e-3);
    }

    #[test]
    fn what_agrees_is_no_evidence_and_what_contradicts_may_have_been_moved() {
        assert!(log_contradicted(0.0).abs() < 1e-12 && log_contradicted(0.03).abs() < 1e-12);
        assert!(log_contradicted(0.15) < -1.0);
        assert!((log_contradicted(0.9) - MOVED.ln()).abs() < 0.1);
    }

    #[test]
    fn a_fit_counts_as_found_where_it_is_expected_and_nowhere_else() {
        assert!(is_expected(&at(1.0, 0.1), &Pose2::new(1.3, 0.1, 0.05)));
        assert!(!is_expected(&at(1.0, 0.1), &Pose2::new(3.0, 0.0, 0.0)));
        assert!(!is_expected(&at(1.0, 0.1), &Pose2::new(1.0, 0.0, 3.1)));
    }
}
