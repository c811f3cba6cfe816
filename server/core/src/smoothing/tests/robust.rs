//! Graphs that are far out of shape, and digits that are far apart.

use crate::geometry::Pose2;
use crate::smoothing::tests::dense::{Graph, chart};
use crate::smoothing::tests::script::{Script, Sigma};
use crate::smoothing::{Belief, Factor, Structure};
use nalgebra::{Matrix3, Vector3};
use rand::RngExt;
use std::f64::consts::PI;

const TIGHT: Sigma = (0.01, 0.005);

/// A robot that was carried: a link of 50 m and π rad between two tours at centimetres.
fn carried(seed: u64, places: u32) -> Script {
    let mut s = Script::new(seed);
    let tour = |s: &mut Script| {
        for k in 0..places {
            s.extend(Pose2::new(1.0, 0.0, if k % 5 == 4 { 1.5 } else { 0.0 }), TIGHT);
        }
    };
    tour(&mut s);
    s.extend(Pose2::new(40.0, -30.0, 2.0), (50.0, PI));
    tour(&mut s);
    s
}

/// Covariance of the end of a chain of factors as seen from its start, link by link.
fn reckoned(s: &Script, from: u32, to: u32) -> Matrix3<f64> {
    let links: Vec<_> = s.graph.terms.values().filter_map(|term| term.link(from, to)).collect();
    assert_eq!(links.len() as u32, to - from);
    let mut covariance = Matrix3::zeros();
    for link in links {
        let back = link.i_from_j.inverse().adjoint();
        covariance = back * covariance * back.transpose() + link.information.try_inverse().unwrap();
    }
    covariance
}

#[test]
fn relative_covariances_survive_behind_a_lost_odometry() {
    let n = 150;
    let mut s = carried(13, n);
    let (first, newest) = (n + 1, 2 * n + 1);
    s.smoother.update().unwrap();
    // A loop in the first tour; the second stays a chain.
    s.close(0, 40, TIGHT);
    s.smoother.settle().unwrap();
    for (i, a) in [(first + 19, newest), (newest - 1, newest), (first + 20, first + 60), (first, newest)] {
        let got = &s.smoother.relative(a, &[i]).unwrap()[0];
        let want = reckoned(&s, i, a);
        // To the last digits, which a difference of absolute covariances would lose.
        assert!((got.covariance - want).amax() < 1e-11 * want.amax(), "{i} {a}");
    }
    let link = reckoned(&s, newest - 1, newest);
    let got = &s.smoother.relative(newest, &[newest - 1]).unwrap()[0];
    assert!((got.covariance - link).amax() < 1e-14 * link.amax());
    assert!(s.smoother.marginal(newest)[(2, 2)] > 9.0);
}

/// A session that hangs on the origin by `far`, whose own links are `near`, with loops.
fn hardly_anchored(far: Sigma, near: Sigma) -> Script {
    let mut s = Script::new(29);
    for _ in 0..10 {
        s.wander();
    }
    s.anchor(far);
    for k in 0..20 {
        s.extend(Pose2::new(1.0, 0.3, f64::from(k) * 0.1), near);
    }
    s.close(11, 25, near);
    s.close(14, 31, near);
    s
}

/// Relative poses and covariances are those of the session alone.
fn check_alone(s: &Script, alone: &Graph) {
    let all: Vec<u32> = alone.poses.keys().copied().collect();
    for &a in &all {
        let from_a = alone.covariance(a);
        for i in all.iter().copied().filter(|&i| i != a) {
            let got = &s.smoother.relative(i, &[a]).unwrap()[0];
            let want = from_a.block(i, i);
            assert!((got.covariance - want).amax() < 1e-5 * want.amax(), "{i} from {a}");
            let off = chart(&got.i_from_a.between(&alone.poses[&a].between(&alone.poses[&i])));
            assert!(off.amax() < 1e-8, "{i} from {a}: {off:?}");
        }
    }
}

#[test]
fn a_session_hardly_anchored_keeps_its_digits() {
    // Up to a thousand kilometres against tenths of millimetres.
    for far_m in [1e2, 1e4, 1e6] {
        for (near, yaw_rad) in [(1e-2, PI), (1e-3, 0.01), (1e-4, PI), (1e-4, 0.01)] {
            let mut s = hardly_anchored((far_m, yaw_rad), (near, near));
            s.smoother.settle().unwrap();
            let mut alone = s.graph.only_from(11);
            alone.solve(11);
            check_alone(&s, &alone);
            // Where the session as a whole is, its anchor alone says.
            let anchor = s.smoother.relative(11, &[0]).unwrap()[0].covariance;
            let want = s.graph.terms.values().find_map(|term| term.between(0, 11)).unwrap();
            let root = want.information.cholesky().unwrap().l();
            let off = (root.transpose() * anchor * root - Matrix3::identity()).amax();
            assert!(off < 1e-3, "{far_m} m, {near}: {off:e}");
        }
    }
}

#[test]
fn a_wild_start_descends_to_a_minimum_or_says_that_it_does_not() {
    // Bent far out of shape, so that full steps overshoot.
    let mut settled = 0;
    for seed in 0..40 {
        let mut s = Script::new(seed);
        for _ in 0..40 {
            let turn = s.rng.random_range(-1.5..1.5);
            s.extend(Pose2::new(1.0, 0.0, turn), (0.3, 0.6));
        }
        for k in 0..if seed < 20 { 1 } else { 10 } {
            s.close(3 * k, 40 - k, (0.01, 0.01));
        }
        if s.smoother.settle().is_ok() {
            let (h, g) = s.graph.system(&s.graph.but(0), |p| s.smoother.pose(p));
            let decrement = g.dot(&h.cholesky().unwrap().solve(&g));
            assert!(decrement < 1e-9, "seed {seed}: {decrement}");
            settled += 1;
        }
    }
    assert!(settled >= 30, "{settled} of 40");
}

#[test]
fn a_relocalisation_pulls_a_carried_tour_into_place() {
    let n = 60;
    let mut s = carried(17, n);
    let newest = 2 * n + 1;
    s.smoother.update().unwrap();
    assert!(s.smoother.marginal(newest).amax() > 1e3);
    s.close(10, newest, TIGHT);
    s.close(12, newest - 3, TIGHT);
    s.smoother.update().unwrap();
    assert!(!s.smoother.belief().pending());
    for k in [n + 1, n + 30, newest] {
        assert!(s.smoother.pose(k).distance_m(&s.truth[k as usize]) < 1.5);
    }
    assert!(s.smoother.marginal(newest).amax() < 2.0);
}

#[test]
fn a_way_of_hundreds_of_metres_in_the_dark_closes_from_where_it_went() {
    // To and fro over a yard, by wheels that do not know their turns.
    let (mut structure, mut belief) = (Structure::new(), Belief::new());
    let information = Matrix3::from_diagonal(&Vector3::new(400.0, 2500.0, 900.0));
    let turn = |k: u32| if k % 25 < 6 { 0.5 } else { 0.0 };
    for k in 0..300 {
        structure.add_pose(Pose2::new(1.0, 0.0, turn(k)), &information).unwrap();
        structure.arrange();
        belief.update(&structure).unwrap();
    }
    let went = belief.pose(0).between(&belief.pose(299));
    let z = went.compose(&Pose2::new(3.0, 25.0, -0.3));
    let fit = Factor { i: 0, j: 299, i_from_j: z, information: Matrix3::identity() * 1e3 };
    belief.hold(structure.add_factor(fit).unwrap());
    structure.arrange();
    belief.update(&structure).unwrap();
    assert!(belief.pending());
    belief.finish(&structure).unwrap();
    assert!(!belief.pending() && belief.pose(0).between(&belief.pose(299)).distance_m(&z) < 0.1);
}
