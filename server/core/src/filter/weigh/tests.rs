use super::*;
use crate::edge::{EdgeKind, QuestionId};
use crate::filter::chance::log_looks;
use crate::filter::loops::Fit;
use crate::filter::loops::tests::straight;
use crate::geometry::Pose2;
use crate::scan::matching::Mode;

/// A chain of n places 1 m apart, straight on, that has drifted by `sigma_m` per place.
pub(crate) fn chain(n: u32, sigma_m: f64) -> (Structure, Particle) {
    let (mut structure, mut p) = (Structure::new(), Particle::empty());
    let covariance = Matrix3::from_diagonal(&Vector3::new(sigma_m.powi(2), sigma_m.powi(2), 1e-6));
    let information = covariance.try_inverse().unwrap();
    for _ in 0..n {
        structure.add_pose(Pose2::new(1.0, 0.0, 0.0), &information).unwrap();
    }
    structure.arrange();
    p.update(&structure).unwrap();
    (structure, p)
}

/// A fit with place 0, seen `x_m` from there.
pub(crate) fn fit(x_m: f64, score: f64, support: u32) -> Fit {
    let covariance = Matrix3::from_diagonal(&Vector3::new(4e-4, 4e-4, 1.6e-5));
    let mode = Mode { i_from_j: Pose2::new(x_m, 0.0, 0.0), covariance, score, overlap: 0.6 };
    Fit::supported_by(0, mode, EdgeKind::Distance, support)
}

/// The edge of a fit of the last of 21 places.
pub(crate) fn edge(fit: &Fit) -> Edge {
    Edge::of(fit, 20, QuestionId::default(), log_looks(fit, 1))
}

/// What a particle thinks of it.
fn of(structure: &Structure, p: &Particle, fit: &Fit) -> Judgement {
    judge(&straight(21), structure, p, &edge(fit)).unwrap()
}

#[test]
fn a_fit_where_it_is_expected_persuades_and_a_far_one_does_not() {
    let (structure, p) = chain(21, 0.1);
    let near = of(&structure, &p, &fit(20.3, 0.95, 4));
    assert!(near.log_there > 1.5 && near.lets_go.is_none(), "{near:?}");
    let far = of(&structure, &p, &fit(14.0, 0.95, 4));
    assert!(far.log_there < -5.0 && far.distance2 > 100.0, "{far:?}");
    assert!(far.lets_go.is_some(), "if at all, then since a stretch failed");
}

#[test]
fn a_density_is_that_of_the_prediction_written_out() {
    let (sigma_m, x_m) = (0.1, 20.4);
    let (structure, p) = chain(21, sigma_m);
    let predicted = p.belief.relative(&structure, 20, &[0]).unwrap().remove(0);
    let (log_n, distance2) = log_density(&predicted, &edge(&fit(x_m, 0.9, 3))).unwrap();
    // Twenty steps along x from place 0, of which each turns by 1 mrad: what is left of the chain's lateral
    // spread and of its heading by hand, then S and N(z; h, S).
    let steps = 20.0;
    let along = steps * sigma_m * sigma_m + 3.0 * 4e-4;
    let lever: f64 = (0..20).map(|k| f64::from(k).powi(2)).sum();
    let across = steps * sigma_m * sigma_m + lever * 1e-6 + 3.0 * 4e-4;
    let turn = steps * 1e-6 + 3.0 * 1.6e-5;
    let cross: f64 = (0..20).map(f64::from).sum::<f64>() * 1e-6;
    let determinant = along * (across * turn - cross * cross);
    let d2 = (x_m - steps).powi(2) / along;
    assert!((distance2 - d2).abs() < 0.01, "{distance2} {d2}");
    let n = |times: f64| (-0.5 * d2 / times).exp() / (TAU.powi(3) * determinant * times.powi(3)).sqrt();
    let expected = ((1.0 - TAIL) * n(1.0) + TAIL * n(9.0)).ln();
    assert!((log_n - expected).abs() < 0.01, "{log_n} {expected}");
}

#[test]
fn a_vague_prediction_gains_no_more_than_a_sharp_one_that_was_right() {
    let there = |sigma_m| {
        let (structure, p) = chain(21, sigma_m);
        of(&structure, &p, &fit(20.0, 0.9, 3)).log_there
    };
    assert!(there(0.05) > there(0.5) + 3.0 && there(0.5) > there(3.0) + 3.0);
}

#[test]
fn a_fit_is_known_where_it_is_expected_and_only_there() {
    let (structure, p) = chain(21, 0.01);
    let known = |x_m| of(&structure, &p, &fit(x_m, 0.9, 3)).known;
    assert!(known(20.1) && !known(20.5));
    let (structure, p) = chain(21, 0.3);
    assert!(!of(&structure, &p, &fit(20.0, 0.9, 3)).known, "expected by luck");
}

#[test]
fn the_stretch_that_contradicts_itself_is_let_go_and_the_rest_moves_rigidly() {
    let (_, p) = chain(21, 0.01);
    let mut graph = straight(21);
    graph.doubt(13, 0.3);
    let e = edge(&fit(17.0, 0.9, 6));
    let (log, let_go) = log_failed(&graph, &p, &e).unwrap();
    assert_eq!(let_go.from, 13);
    assert!((let_go.moved.compose(&p.belief.pose(20)).x_m - 17.0).abs() < 1e-6);
    assert!(log > (0.3 * 0.001_f64).ln(), "{log}");
}

#[test]
fn a_failure_before_an_older_loop_explains_nothing() {
    let (_, mut p) = chain(21, 0.01);
    let mut tie = edge(&fit(19.0, 0.9, 6));
    tie.j = 19;
    p.add(Edge { factor: 0, ..tie });
    let (_, let_go) = log_failed(&straight(21), &p, &edge(&fit(17.0, 0.9, 6))).unwrap();
    assert_eq!(let_go.from, 20);
}
