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

use crate::geometry::Pose2;
use crate::graph::{Graph, Vertex};
use crate::particle::Particle;
use crate::scan::agree::{Look, agreement};
use crate::scan::front::LOCAL_PATH_M;
use crate::smoothing::{Relative, Structure};
use rayon::prelude::*;

/// Older places that the newest one is compared with, at most …
const COMPARED_MAX: usize = 3;
/// … which lie so near in the map …
const NEAR_M: f64 = 5.0;
/// … and so far apart along the path: their content overlaps otherwise.
const SPREAD_M: f64 = 2.0;
/// Points of either place, and range images that they are looked up in.
const POINTS: usize = 24;
const VIEWS: usize = 3;
/// Relative poses less certain than this predict nothing …
const SIGMA_MAX_M: f64 = 0.3;
const SIGMA_MAX_RAD: f64 = 0.05;
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
/// s. As for fits: a place's content is seen from some three places.
const SHARED_SCANS: f64 = 3.0;

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
        .filter(|(d, _)| *d < NEAR_M)
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
fn look(r: &Relative) -> Option<Look> {
    let sigma_m = r.covariance[(0, 0)].max(r.covariance[(1, 1)]).sqrt();
    let sigma_rad = r.covariance[(2, 2)].sqrt();
    (sigma_m < SIGMA_MAX_M && sigma_rad < SIGMA_MAX_RAD).then_some(Look {
        points_max: POINTS,
        views_max: VIEWS,
        tolerance_m: Look::CLOSE.tolerance_m + SIGMAS * sigma_m,
        tolerance_per_m: Look::CLOSE.tolerance_per_m + SIGMAS * sigma_rad,
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
mod tests {
    use super::*;
    use crate::config::Config;
    use crate::effects::EdgeKind;
    use crate::filter::Filter;
    use crate::loops::Fit;
    use crate::scan::front::{Chain, FrozenPlace, OpenPlace};
    use crate::scan::matching::Mode;
    use crate::scan::place::Content;
    use crate::scan::rooms::{HALL, ROOM, content};
    use crate::smoothing::{Factor, FactorId};
    use crate::weigh::add_edge;
    use nalgebra::Matrix3;
    use std::sync::Arc;

    const OLD: Pose2 = Pose2 { x_m: -1.5, y_m: -1.0, yaw_rad: 0.3 };
    const NEW: Pose2 = Pose2 { x_m: 1.0, y_m: 0.5, yaw_rad: 2.1 };

    /// A place just left, whose chain edge says `previous_from_this`, or next to nothing.
    fn left(id: u64, path_m: f64, previous_from_this: Option<Pose2>, content: Content) -> FrozenPlace {
        let information =
            Matrix3::from_diagonal_element(if previous_from_this.is_some() { 1e4 } else { 0.1 });
        let previous_from_this = previous_from_this.unwrap_or_default();
        let chain = Chain { previous_from_this, information, broken: false };
        let front_from_place = Pose2::default();
        FrozenPlace { open: OpenPlace { id, stamp_ns: 0, front_from_place, path_m, chain }, content }
    }

    /// Two visits, 20 m of path apart, of what their contents show.
    fn two_visits(old: Content, new: Content) -> Graph {
        let mut graph = Graph::default();
        graph.add(left(0, 0.0, None, old));
        graph.add(left(1, 20.0, None, new));
        graph
    }

    fn room_twice() -> Graph {
        two_visits(content(&ROOM, &OLD), content(&ROOM, &NEW))
    }

    /// Particles that hold one edge each, or none, over a chain of given standard deviation that predicts
    /// `chained`.
    fn particles(chained: Pose2, sigma: f64, edges: &[Option<Pose2>]) -> (Structure, Vec<Particle>) {
        let mut structure = Structure::new();
        let certain = Matrix3::from_diagonal_element(1e4);
        let chain = Matrix3::from_diagonal_element(sigma.powi(-2));
        structure.add_pose(Pose2::default(), &chain).unwrap();
        structure.add_pose(chained, &chain).unwrap();
        let factors: Vec<Option<FactorId>> = edges
            .iter()
            .map(|e| {
                e.map(|i_from_j| {
                    structure.add_factor(Factor { i: 0, j: 1, i_from_j, information: certain }).unwrap()
                })
            })
            .collect();
        structure.arrange();
        let particle = |factor: Option<FactorId>| {
            let mut p = Particle::empty(1);
            if let Some(factor) = factor {
                p.belief.hold(factor);
            }
            p.update(&structure).unwrap();
            p
        };
        let particles = factors.into_iter().map(particle).collect();
        (structure, particles)
    }

    /// Where the other visit is, and two places where it is not.
    fn edges() -> [Pose2; 3] {
        [OLD.between(&NEW), Pose2::new(0.5, 2.5, -0.4), Pose2::new(-2.0, 0.0, 1.2)]
    }

    #[test]
    fn a_false_edge_loses_to_its_twin_without_and_a_true_one_loses_nothing() {
        let graph = room_twice();
        let [real, wrong, other] = edges();
        let (structure, mut all) = particles(real, 3.0, &[Some(real), Some(wrong), Some(other), None]);
        weigh_overlaps(&graph, &structure, &mut all, 1);
        let logs: Vec<f64> = all.iter().map(|p| p.log_weight).collect();
        assert_eq!((logs[0], logs[3]), (0.0, 0.0), "{logs:?}");
        assert!(logs[1] < -0.5 && logs[2] < -0.5, "{logs:?}");
    }

    #[test]
    fn a_step_of_the_filter_weighs_by_it() {
        let further = Pose2::new(0.4, 0.1, 0.1);
        let mut filter = Filter::new(Config { loops: false, ..Config::default() });
        filter.step(left(0, 0.0, None, content(&ROOM, &OLD)));
        filter.step(left(1, 20.0, None, content(&ROOM, &NEW)));
        let covariance = Matrix3::from_diagonal_element(1e-4);
        let [real, wrong, _] = edges();
        let twins = [real, wrong].map(|i_from_j| {
            let mode = Mode { i_from_j, covariance, score: 0.9, overlap: 0.6 };
            let fit = Fit::supported_by(0, mode, EdgeKind::Distance, 3);
            let mut twin = filter.particles[0].clone();
            twin.take(add_edge(Arc::make_mut(&mut filter.structure), &fit, 1).unwrap());
            twin
        });
        filter.particles = twins.to_vec();
        filter.step(left(2, 21.0, Some(further), content(&ROOM, &NEW.compose(&further))));
        assert_eq!(filter.best().edges[0].i_from_j, real);
        assert!(filter.best().weight() > 0.6, "{}", filter.best().weight());
    }

    #[test]
    fn another_hall_is_not_the_room() {
        let graph = two_visits(content(&ROOM, &OLD), content(&HALL, &NEW));
        let (structure, all) = particles(Pose2::default(), 3.0, &[Some(OLD.between(&NEW))]);
        assert!(log_factor(&graph, &structure, &all[0], 1) < -0.5);
    }

    #[test]
    fn who_drifted_is_not_punished_and_who_is_certain_of_the_same_is() {
        let graph = room_twice();
        let factor = |sigma| {
            let (structure, all) = particles(edges()[1], sigma, &[None]);
            log_factor(&graph, &structure, &all[0], 1)
        };
        assert_eq!(factor(1.0).to_bits(), 0.0f64.to_bits());
        assert!(factor(0.02) < -0.5);
    }

    #[test]
    fn new_ground_is_worth_what_known_ground_is() {
        let graph = room_twice();
        let (structure, all) = particles(Pose2::new(12.0, 0.0, 0.0), 0.02, &[None]);
        assert_eq!(log_factor(&graph, &structure, &all[0], 1).to_bits(), 0.0f64.to_bits());
    }

    #[test]
    fn no_place_changes_a_weight_by_more_than_the_cap() {
        let cap = CHANGED.ln() / SHARED_SCANS;
        for seen in 0..40 {
            for seen_through in 0..40 {
                let overlap = Overlap { seen: f64::from(seen), seen_through: 50.0 * f64::from(seen_through) };
                let log = overlap.log_factor();
                assert!((cap - 1e-12..=0.0).contains(&log), "{overlap:?} {log}");
            }
        }
        let nothing = Overlap { seen: 0.0, seen_through: 0.0 };
        assert!(nothing.log_factor().abs() < 1e-12);
    }

    #[test]
    fn more_seen_through_weighs_more() {
        let factor = |seen_through| Overlap { seen: 30.0, seen_through }.log_factor();
        assert!(factor(1.0).abs() < 1e-12, "one chair");
        assert!(factor(8.0) < -0.1 && factor(16.0) < 2.0 * factor(8.0));
    }

    #[test]
    fn the_same_graphs_weigh_the_same_and_a_single_one_is_left_alone() {
        let graph = room_twice();
        let [real, wrong, other] = edges();
        let (structure, all) = particles(real, 3.0, &[Some(real), Some(wrong), Some(other), None]);
        let weighed = |mut all: Vec<Particle>| {
            weigh_overlaps(&graph, &structure, &mut all, 1);
            all.iter().map(|p| p.log_weight.to_bits()).collect::<Vec<_>>()
        };
        let once = weighed(all.clone());
        assert_eq!(weighed(all.clone()), once);
        let mut reversed = weighed(all.iter().rev().cloned().collect());
        reversed.reverse();
        assert_eq!(reversed, once);
        assert_eq!(weighed(vec![all[1].clone()]), [0.0f64.to_bits()]);
    }
}
