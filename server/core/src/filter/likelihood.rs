//! Step 4 where no fit was measured: do the newest place's scans go with what a graph says was seen there
//! before? Eqs. (17–18) for a graph that lays the place over older ones:
//!
//! ```text
//! w_t = w_{t-1} · min(1, ε + (1 − ε) · Π_k r(o_k)^β)^(1/s)
//! r(o) = p(o | one floor) / p(o | unrelated),   o ∈ {seen there too, seen through}
//! ```
//!
//! over points k of both places, the newest one's the same for every particle. The field that they are
//! looked up in is shared by all: a place's range images, [`crate::scan::agree`]. Walls that stand where
//! the other place saw through are what a false loop looks like once it is taken.
//!
//! - What the other place did not see has r = 1, and both densities sum to one over what it did: new ground
//!   is worth what a true overlap is, but for the little that true overlaps lose by bad luck.
//! - What agrees raises no weight: the fit that tied the places has counted it. Contradiction is news.
//! - Only where a graph knows how the two places lie to each other does it predict anything. One that has
//!   drifted lays the newest place nowhere in particular, and the integral over where is flat.
//! - ε is the share of floor that has changed since. β and s are tempers: beams of a place depend on each
//!   other, and neighbouring places show the same walls. What a place may change log w by is ln ε / s.

use crate::edge::Vertex;
use crate::filter::decide::SHARED_SCANS;
use crate::filter::particle::Particle;
use crate::filter::propose::SPREAD_M;
use crate::geometry::Pose2;
use crate::graph::Graph;
use crate::scan::agree::agreement;
use crate::scan::view::Closeness;
use crate::smoothing::{Relative, Structure};
use crate::track::front::LOCAL_PATH_M;
use rayon::prelude::*;

/// Older places that the newest one is compared with, at most …
const COMPARED_MAX: usize = 3;
/// … which lie so near in the map, [`SPREAD_M`] apart along the path.
const COMPARED_M: f64 = 5.0;
/// Points of either place, and range images that they are looked up in.
const POINTS: usize = 24;
const VIEWS: usize = 3;
/// Relative poses less certain than this predict nothing …
const COMPARED_SIGMA_MAX_M: f64 = 0.3;
const COMPARED_SIGMA_MAX_RAD: f64 = 0.05;
/// … and more certain ones may be off by so many standard deviations.
const SIGMAS: f64 = 2.0;
// The next three are from simulated offices and apartments, half of them with people about (example
// `drives overlap` of the server).

/// Of the points that the other place saw or saw through, it saw so many where the two truly overlap …
const SEEN_SAME: f64 = 0.95;
/// … and so many where they are unrelated: laid over each other at random, slipped along the path, or as
/// scans look alike.
const SEEN_UNRELATED: f64 = 0.66;
/// β: so the two tell true overlaps from others as surely as they claim to.
const TEMPER: f64 = 0.4;
/// ε. Set by reasoning: doors, chairs and people change less than a place's every wall.
const CHANGED: f64 = 0.02;

/// Weighs each graph by what place `t` sees of the older places that the graph lays it over. A single graph
/// needs no weighing.
pub fn weigh_overlaps(graph: &Graph, structure: &Structure, particles: &mut [Particle], t: Vertex) {
    if particles.len() > 1 {
        particles.par_iter_mut().for_each(|p| p.log_weight += log_factor(graph, structure, p, t));
    }
}

/// The logarithm of what place `t` multiplies the weight of a graph by, in [ln ε / s, 0].
pub fn log_factor(graph: &Graph, structure: &Structure, particle: &Particle, t: Vertex) -> f64 {
    let near = nearest(graph, t, |v| particle.belief.pose(v));
    let predicted = particle.belief.relative(structure, t, &near).unwrap_or_default();
    compare(graph, t, &predicted).map_or(0.0, |overlap| overlap.log_factor())
}

/// The older places nearest to place `t` in a map, spread along the path.
pub fn nearest(graph: &Graph, t: Vertex, pose: impl Fn(Vertex) -> Pose2) -> Vec<Vertex> {
    let here = pose(t);
    let mut near: Vec<(f64, Vertex)> = (0..t)
        .filter(|&i| graph.apart(i, t, LOCAL_PATH_M))
        .map(|i| (pose(i).distance_m(&here), i))
        .filter(|(d, _)| *d < COMPARED_M)
        .collect();
    near.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    let mut chosen: Vec<Vertex> = Vec::with_capacity(COMPARED_MAX);
    for (_, i) in near {
        if chosen.len() < COMPARED_MAX && chosen.iter().all(|&c| graph.apart(c, i, SPREAD_M)) {
            chosen.push(i);
        }
    }
    chosen
}

/// How a place and older ones see each other's surfaces.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Overlap {
    /// Points that the other place saw too, per older place.
    pub seen: f64,
    /// Points that the other place saw through, per older place.
    pub seen_through: f64,
}

/// Compares place `t` with older places where they are predicted to lie; none if none is certain enough.
pub fn compare(graph: &Graph, t: Vertex, predicted: &[Relative]) -> Option<Overlap> {
    let here = &graph.place(t).content;
    let (mut seen, mut seen_through, mut places) = (0, 0, 0);
    for (r, look) in predicted.iter().filter_map(|r| Some((r, look(r)?))) {
        let both = agreement(&graph.place(r.i).content, here, &r.i_from_a, &look);
        seen += both.agree;
        seen_through += both.conflict;
        places += 1;
    }
    let per_place = |n: u32| f64::from(n) / f64::from(places);
    (places > 0).then(|| Overlap { seen: per_place(seen), seen_through: per_place(seen_through) })
}

/// How closely a prediction can be compared, if at all.
fn look(r: &Relative) -> Option<Closeness> {
    let (sigma_m, sigma_rad) = (r.sigma_m(), r.sigma_rad());
    (sigma_m < COMPARED_SIGMA_MAX_M && sigma_rad < COMPARED_SIGMA_MAX_RAD).then_some(Closeness {
        points_max: POINTS,
        views_max: VIEWS,
        tolerance_m: Closeness::CLOSE.tolerance_m + SIGMAS * sigma_m,
        tolerance_per_m: Closeness::CLOSE.tolerance_per_m + SIGMAS * sigma_rad,
    })
}

impl Overlap {
    /// ln Π_k r(o_k), the points taken for independent.
    pub fn log_ratio(&self) -> f64 {
        self.seen * (SEEN_SAME / SEEN_UNRELATED).ln()
            + self.seen_through * ((1.0 - SEEN_SAME) / (1.0 - SEEN_UNRELATED)).ln()
    }

    /// The logarithm of a weight's factor, in [ln ε / s, 0].
    pub fn log_factor(&self) -> f64 {
        let tempered = (TEMPER * self.log_ratio()).exp();
        (CHANGED + (1.0 - CHANGED) * tempered).ln().min(0.0) / SHARED_SCANS
    }
}

#[cfg(test)]
mod tests;
