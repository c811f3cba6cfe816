//! What contradicts a graph, and what does not.

use super::*;
use crate::config::Config;
use crate::edge::EdgeKind;
use crate::filter::Filter;
use crate::filter::decide::add_edge;
use crate::filter::loops::Fit;
use crate::scan::matching::Mode;
use crate::scan::place::Content;
use crate::scan::tests::{HALL, ROOM, content};
use crate::smoothing::{Factor, FactorId};
use crate::track::front::{Chain, FrozenPlace, OpenPlace};
use nalgebra::Matrix3;
use std::sync::Arc;

const OLD: Pose2 = Pose2 { x_m: -1.5, y_m: -1.0, yaw_rad: 0.3 };
const NEW: Pose2 = Pose2 { x_m: 1.0, y_m: 0.5, yaw_rad: 2.1 };

/// A place just left, whose chain edge says `previous_from_this`, or next to nothing.
fn left(id: u64, path_m: f64, previous_from_this: Option<Pose2>, content: Content) -> FrozenPlace {
    let information = Matrix3::from_diagonal_element(if previous_from_this.is_some() { 1e4 } else { 0.1 });
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
    filter.step(left(0, 0.0, None, content(&ROOM, &OLD)), &|_, _| {});
    filter.step(left(1, 20.0, None, content(&ROOM, &NEW)), &|_, _| {});
    let covariance = Matrix3::from_diagonal_element(1e-4);
    let [real, wrong, _] = edges();
    let twins = [(0, real), (1, wrong)].map(|(revisit, i_from_j)| {
        let mode = Mode { i_from_j, covariance, score: 0.9, overlap: 0.6 };
        let fit = Fit::supported_by(0, mode, EdgeKind::Distance, 3);
        let mut twin = filter.particles[0].clone();
        twin.take(add_edge(Arc::make_mut(&mut filter.structure), &fit, revisit, 1).unwrap());
        twin
    });
    filter.particles = twins.to_vec();
    filter.step(left(2, 21.0, Some(further), content(&ROOM, &NEW.compose(&further))), &|_, _| {});
    assert_eq!(filter.best().edges[0].i_from_j, real);
    assert!((0.6..1.0).contains(&filter.best().weight()), "{}", filter.best().weight());
}

#[test]
fn another_hall_is_not_the_room() {
    let graph = two_visits(content(&ROOM, &OLD), content(&HALL, &NEW));
    let (structure, all) = particles(Pose2::default(), 3.0, &[Some(OLD.between(&NEW))]);
    assert!(log_factor(&graph, &structure, &all[0], 1) < -0.5);
}

#[test]
fn who_is_certain_of_a_false_pose_pays() {
    let graph = room_twice();
    let (structure, all) = particles(edges()[1], 0.02, &[None]);
    assert!(log_factor(&graph, &structure, &all[0], 1) < -0.5);
}

/// Furniture was moved: the true loop must not lose to the graph that only does not know where it is.
#[test]
#[ignore = "only contradiction weighs so far, and only where a graph is certain: ignorance is rewarded"]
fn not_knowing_is_worth_no_more_than_being_right() {
    let mut moved = content(&ROOM, &NEW);
    moved.sample.iter_mut().step_by(2).for_each(|p| (p.x, p.y) = (0.6 * p.x, 0.6 * p.y));
    let graph = two_visits(content(&ROOM, &OLD), moved);
    let real = edges()[0];
    let (structure, mut all) = particles(real, 3.0, &[Some(real), None]);
    weigh_overlaps(&graph, &structure, &mut all, 1);
    assert!(all[0].log_weight >= all[1].log_weight, "{} {}", all[0].log_weight, all[1].log_weight);
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
