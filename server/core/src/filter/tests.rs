use super::*;
use crate::scan::matching::Mode;
use crate::scan::place::Content;
use crate::track::front::OpenPlace;
use nalgebra::Vector3;

/// A straight chain of places 1 m apart whose ends fit so that half of the posterior believes it.
fn split() -> Filter {
    let mut filter = Filter::new(Config::default());
    for _ in 0..21 {
        filter.extend(&chain());
    }
    let fits = vec![fit(0, 17.7, EdgeKind::Distance)];
    filter.weigh_measured(20, &Measured { fits, refused: vec![] });
    filter
}

/// Places 1 m apart on a straight line.
fn straight() -> Filter {
    let mut filter = Filter::new(Config { loops: false, ..Config::default() });
    for v in 0_u32..21 {
        let front_from_place = Pose2::new(f64::from(v), 0.0, 0.0);
        let (id, path_m, chain) = (v.into(), f64::from(v), chain());
        let open = OpenPlace { id, stamp_ns: 0, front_from_place, path_m, chain };
        filter.step(FrozenPlace { open, content: Content::new(&[]) }, &|_, _| {});
    }
    filter
}

#[test]
fn of_what_all_know_two_edges_a_place_are_enough() {
    let mut filter = straight();
    let mut fits: Vec<Fit> = (16..20).map(|i| fit(i, f64::from(20 - i), EdgeKind::Distance)).collect();
    fits.push(fit(15, 5.0, EdgeKind::Semantic));
    fits.push(fit(0, 20.0, EdgeKind::Distance));
    let effects = filter.weigh_measured(20, &Measured { fits, refused: vec![] });
    let taken = |e: &&Effect| matches!(e, Effect::EdgeAccepted { .. });
    assert_eq!((effects.len(), effects.iter().filter(taken).count()), (6, 4));
    let older = |p: &Particle| -> Vec<Vertex> { p.edges.iter().map(|e| e.i).collect() };
    assert_eq!(older(filter.best()), [16, 17, 15], "words are said once");
    assert!(filter.particles.iter().any(|p| older(p) == [16, 17, 15, 0]), "news is news");
}

fn fit(i: Vertex, x_m: f64, kind: EdgeKind) -> Fit {
    let covariance = Matrix3::from_diagonal(&Vector3::new(4e-4, 4e-4, 1.6e-5));
    let mode = Mode { i_from_j: Pose2::new(x_m, 0.0, 0.0), covariance, score: 0.9, overlap: 0.6 };
    Fit::supported_by(i, mode, kind, 3)
}

fn chain() -> Chain {
    let information = Matrix3::from_diagonal(&Vector3::new(100.0, 100.0, 1e6));
    Chain { previous_from_this: Pose2::new(1.0, 0.0, 0.0), information, broken: false }
}

fn length_m(filter: &Filter) -> f64 {
    filter.best().belief.pose(20).x_m
}

#[test]
fn a_fit_splits_a_particle_into_one_with_the_edge_and_one_without() {
    let filter = split();
    let [a, b] = &filter.particles[..] else { panic!("{}", filter.particles.len()) };
    let (with, without) = if a.edges.is_empty() { (b, a) } else { (a, b) };
    assert_eq!((with.edges.len(), without.edges.len(), with.count + without.count), (1, 0, 30));
    assert!((with.belief.pose(20).x_m - 17.7).abs() < 0.05);
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
    assert!((length_m(&filter) - 17.7).abs() < 0.05);
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
    let see = |filter: &mut Filter| {
        let fits = vec![fit(0, 17.7, EdgeKind::Distance)];
        filter.weigh_measured(20, &Measured { fits, refused: vec![] });
    };
    see(&mut filter);
    let once = log_odds(&filter);
    (0..3).for_each(|_| see(&mut filter));
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
