use super::*;
use crate::edge::QuestionId;
use crate::filter::words::Silence;
use crate::scan::matching::Mode;
use crate::scan::place::Content;
use crate::track::places::OpenPlace;
use nalgebra::Vector3;

/// Where the chain's ends fit so that both answers are likely.
const UNSURE_M: f64 = 18.6;

/// A straight chain of places 1 m apart whose ends fit so that a good part of the posterior believes it.
fn split() -> Filter {
    let mut filter = straight();
    see(&mut filter, vec![fit(0, UNSURE_M, EdgeKind::Distance)]);
    filter
}

/// Fits of the last place.
fn see(filter: &mut Filter, fits: Vec<Fit>) -> Effects {
    let effects = filter.answer_all(20, &Measured { fits, ..Measured::default() }, &Silence);
    filter.rank();
    effects
}

/// Places 1 m apart on a straight line.
fn straight() -> Filter {
    let mut filter = Filter::new(Config { loops: false, ..Config::default() });
    for v in 0_u32..21 {
        let front_from_place = Pose2::new(f64::from(v), 0.0, 0.0);
        let (id, path_m, chain) = (v.into(), f64::from(v), chain());
        let open = OpenPlace { id, stamp_ns: 0, front_from_place, path_m, chain };
        filter.step(FrozenPlace { open, content: Content::new(&[]) }, &Silence, &|_, _| {});
    }
    filter
}

#[test]
fn of_what_all_know_two_edges_a_place_are_enough() {
    let mut filter = straight();
    let mut fits: Vec<Fit> = (16..20).map(|i| fit(i, f64::from(20 - i), EdgeKind::Distance)).collect();
    fits.push(fit(15, 5.0, EdgeKind::Semantic));
    fits.push(fit(0, 20.0, EdgeKind::Distance));
    let effects = see(&mut filter, fits);
    assert_eq!(effects.len(), 6);
    let older = |p: &Particle| -> Vec<Vertex> { p.edges.iter().map(|e| e.i).collect() };
    assert!(filter.particles.iter().all(|p| older(p).starts_with(&[16, 17, 15])), "words are said once");
    assert!(filter.particles.iter().any(|p| older(p).contains(&0)), "news is news");
}

fn fit(i: Vertex, x_m: f64, kind: EdgeKind) -> Fit {
    let covariance = Matrix3::from_diagonal(&Vector3::new(4e-4, 4e-4, 1.6e-5));
    let mode = Mode { i_from_j: Pose2::new(x_m, 0.0, 0.0), covariance, score: 0.9, overlap: 0.6 };
    Fit::supported_by(i, mode, kind, 3)
}

fn chain() -> Chain {
    let information = Matrix3::from_diagonal(&Vector3::new(100.0, 100.0, 1e6));
    Chain {
        previous_from_this: Pose2::new(1.0, 0.0, 0.0),
        information,
        broken: false,
        unseen: false,
        failed: 1e-4,
    }
}

fn length_m(filter: &Filter) -> f64 {
    filter.best().belief.pose(20).x_m
}

#[test]
fn a_fit_splits_a_particle_into_one_with_the_edge_and_one_without() {
    let filter = split();
    let [a, b] = &filter.particles[..] else { panic!("{}", filter.particles.len()) };
    let (with, without) = if a.edges.is_empty() { (b, a) } else { (a, b) };
    assert_eq!((with.edges.len(), without.edges.len()), (1, 0));
    assert!((with.weight() + without.weight() - 1.0).abs() < 1e-9 && with.weight() > 0.02);
    assert!((with.belief.pose(20).x_m - UNSURE_M).abs() < 0.05);
    assert!((without.belief.pose(20).x_m - 20.0).abs() < 1e-9);
    assert_eq!(filter.disputed, [with.edges[0].factor]);
}

#[test]
fn a_factor_that_no_particle_holds_any_more_is_taken_out() {
    let mut filter = split();
    let factor = filter.disputed[0];
    filter.forget();
    assert!(filter.structure.factor(factor).is_some() && filter.disputed == [factor]);
    filter.particles.retain(|p| p.edges.is_empty());
    filter.forget();
    assert!(filter.structure.factor(factor).is_none() && filter.disputed.is_empty());
    filter.extend(&chain());
    assert!((length_m(&filter) - 20.0).abs() < 1e-9);
}

#[test]
fn a_factor_that_all_particles_hold_stays() {
    let mut filter = split();
    let factor = filter.disputed[0];
    filter.particles.retain(|p| !p.edges.is_empty());
    filter.forget();
    assert!(filter.structure.factor(factor).is_some() && filter.disputed.is_empty());
    filter.extend(&chain());
    assert!((length_m(&filter) - UNSURE_M).abs() < 0.05);
}

/// Log-odds of the edge between those who hold it and those who refused.
fn log_odds(filter: &Filter) -> f64 {
    let log_weight = |held: bool| {
        let of = filter.particles.iter().filter(|p| p.edges.is_empty() != held);
        of.map(Particle::weight).sum::<f64>().ln()
    };
    log_weight(true) - log_weight(false)
}

#[test]
fn what_was_seen_once_persuades_once() {
    let mut filter = straight();
    let see = |filter: &mut Filter| see(filter, vec![fit(0, UNSURE_M, EdgeKind::Distance)]);
    see(&mut filter);
    let once = log_odds(&filter);
    for _ in 0..3 {
        see(&mut filter);
    }
    assert!(once.is_finite() && (log_odds(&filter) - once).abs() < 1e-9, "{once} {}", log_odds(&filter));
}

#[test]
fn an_imposed_edge_is_in_every_graph() {
    let mut filter = straight();
    filter.impose(20, &fit(0, 12.0, EdgeKind::Relocalisation));
    assert!(
        filter.particles.iter().all(|p| { p.edges.iter().any(|e| (e.i_from_j.x_m - 12.0).abs() < 1e-12) })
    );
    assert!(length_m(&filter) < 19.0);
}

#[test]
fn a_false_loop_forced_on_all_is_undone() {
    let mut filter = straight();
    filter.impose(20, &fit(0, 12.0, EdgeKind::Relocalisation));
    filter.reopen(&Silence);
    filter.keep_best();
    assert!((length_m(&filter) - 20.0).abs() < 1e-6 && filter.unresolved() < 0.02, "{}", filter.unresolved());
}

#[test]
fn what_the_best_map_came_to_say_by_itself_is_no_other_graph() {
    let mut filter = straight();
    let question = QuestionId { boot: 9, n: 9 };
    let edge = Edge::of(&fit(0, 12.0, EdgeKind::Distance), 20, question, 0.0);
    // Dropped from a map that had the places elsewhere, and much was against that since.
    let ghost = Ghost { edge, there: true, log_odds: -3.0, since: 8.0, log_words: 0.0 };
    filter.ghosts.drop_answer(ghost.clone());
    filter.reopen(&Silence);
    assert_eq!(filter.particles.len(), 2, "another graph, of which nobody paid for where it had the places");
    let mut filter = straight();
    filter.impose(20, &fit(1, 11.0, EdgeKind::Relocalisation));
    filter.ghosts = Ghosts::default();
    filter.ghosts.drop_answer(ghost);
    filter.reopen(&Silence);
    let edges: Vec<usize> = filter.particles.iter().map(|p| p.edges.len()).collect();
    assert!(edges == [1] && filter.unresolved() < 1e-3, "{edges:?} {}", filter.unresolved());
}

#[test]
fn what_is_dropped_is_told() {
    let mut filter = straight();
    filter.config.particles = 1;
    see(&mut filter, vec![fit(0, UNSURE_M, EdgeKind::Distance)]);
    filter.keep_best();
    let split = split();
    let lighter = split.particles[1].weight();
    assert_eq!(filter.particles.len(), 1);
    assert!((filter.unresolved() - lighter).abs() < 0.2 * lighter, "{} {lighter}", filter.unresolved());
}

#[test]
fn independent_revisits_weigh_the_same_in_whatever_order_they_are_seen() {
    let weights = |order: [usize; 2]| {
        let mut filter = straight();
        let fits = [(9, fit(0, 7.8, EdgeKind::Distance)), (20, fit(11, 10.2, EdgeKind::Distance))];
        for (t, fit) in order.map(|k| fits[k].clone()) {
            filter.answer_all(t, &Measured { fits: vec![fit], ..Measured::default() }, &Silence);
        }
        filter.keep_best();
        filter.particles.iter().map(Particle::weight).collect::<Vec<_>>()
    };
    let (a, b) = (weights([0, 1]), weights([1, 0]));
    assert_eq!((a.len(), b.len()), (4, 4), "{a:?} {b:?}");
    assert!(a.iter().zip(&b).all(|(a, b)| (a - b).abs() < 1e-6), "{a:?} {b:?}");
}
