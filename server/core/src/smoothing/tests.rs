//! The smoother against a dense batch solution with numerical Jacobians.

use super::*;
use dense::{block, dense, dense_system, numeric_jacobian};
use nalgebra::Vector3;
use proptest::prelude::*;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

mod dense;

/// A graph as a script builds it: the smoother, and the same factors in a plain list.
struct Script {
    rng: ChaCha8Rng,
    truth: Vec<Pose2>,
    smoother: Smoother,
    chain: Vec<Factor>,
    loops: Vec<(FactorId, Factor)>,
}

fn diagonal_information(sigma_m: f64, sigma_rad: f64) -> Matrix3<f64> {
    Matrix3::from_diagonal(&Vector3::new(sigma_m, sigma_m, sigma_rad).map(|s| 1.0 / (s * s)))
}

/// Sum of four uniforms: near enough to a Gaussian of unit variance.
fn noise(rng: &mut ChaCha8Rng) -> f64 {
    (0..4).map(|_| rng.random_range(-0.866..0.866)).sum()
}

impl Script {
    fn new(seed: u64) -> Self {
        let mut smoother = Smoother::new();
        smoother.add_pose(Pose2::default(), &Matrix3::identity()).unwrap();
        Self {
            rng: ChaCha8Rng::seed_from_u64(seed),
            truth: vec![Pose2::default()],
            smoother,
            chain: vec![],
            loops: vec![],
        }
    }

    /// A noisy measurement of a true relative pose, with a full information matrix.
    fn measured(&mut self, i: u32, j: u32, sigma_m: f64, sigma_rad: f64) -> Factor {
        let truth = self.truth[i as usize].between(&self.truth[j as usize]);
        let skew = Pose2::new(0.3, -0.2, 0.4).adjoint();
        let information = symmetrised(&sandwich(&skew, &diagonal_information(sigma_m, sigma_rad)));
        let diagonal = Vector3::new(sigma_m, sigma_m, sigma_rad).map(|s| s * noise(&mut self.rng));
        let e = skew.transpose().try_inverse().unwrap() * diagonal;
        Factor { i, j, i_from_j: truth.compose(&Pose2::exp(&e)), information }
    }

    fn extend(&mut self, step: Pose2, sigma_m: f64, sigma_rad: f64) {
        let j = self.truth.len() as u32;
        self.truth.push(self.truth[j as usize - 1].compose(&step));
        let f = self.measured(j - 1, j, sigma_m, sigma_rad);
        assert_eq!(self.smoother.add_pose(f.i_from_j, &f.information), Ok(j));
        self.chain.push(f);
    }

    fn close(&mut self, i: u32, j: u32, sigma_m: f64, sigma_rad: f64) {
        let f = self.measured(i, j, sigma_m, sigma_rad);
        self.loops.push((self.smoother.add_factor(f.clone()).unwrap(), f));
    }

    fn remove(&mut self, k: usize) {
        let (id, _) = self.loops.remove(k);
        self.smoother.remove_factor(id).unwrap();
    }

    fn factors(&self) -> Vec<&Factor> {
        self.chain.iter().chain(self.loops.iter().map(|(_, f)| f)).collect()
    }

    /// A random walk with loops, some removed again; some poses after the last update.
    fn random(seed: u64, poses: usize, loops: usize, tail: usize) -> Self {
        let mut s = Self::new(seed);
        for k in 0..poses {
            let turn = s.rng.random_range(-1.0..1.0);
            s.extend(Pose2::new(1.0, 0.2, turn), 0.05, 0.02);
            if k > 2 && k % 4 == 0 {
                s.smoother.update().unwrap();
            }
            if k * loops / poses != (k + 1) * loops / poses {
                let (a, b) = (s.rng.random_range(0..=k as u32), k as u32 + 1);
                if s.rng.random() { s.close(a, b, 0.05, 0.02) } else { s.close(b, a, 0.05, 0.02) }
            }
            if s.loops.len() > 2 && s.rng.random_range(0..8) == 0 {
                let k = s.rng.random_range(0..s.loops.len());
                s.remove(k);
            }
        }
        s.smoother.update().unwrap();
        for _ in 0..tail {
            let turn = s.rng.random_range(-1.0..1.0);
            s.extend(Pose2::new(1.0, 0.0, turn), 0.1, 0.05);
        }
        s
    }
}

fn near(a: &Matrix3<f64>, b: &Matrix3<f64>, scale: f64) -> bool {
    (a - b).amax() <= 1e-8 * scale
}

/// Poses, marginals, joint and relative covariances all agree with the dense solution.
fn check_against_dense(script: &Script) -> Result<(), TestCaseError> {
    let (poses, covariance) = dense(script);
    let s = &script.smoother;
    let scale = covariance.amax().max(1e-3);
    let extent = poses.iter().map(|p| p.x_m.hypot(p.y_m)).fold(1.0, f64::max);
    for (k, pose) in poses.iter().enumerate() {
        let off = pose.between(&s.pose(k as u32)).log();
        prop_assert!(off.amax() < 1e-9 * extent, "pose {k} off by {off:?}");
    }
    let all: Vec<u32> = (0..s.len() as u32).collect();
    let joint = s.joint(&all).unwrap();
    let t = joint.newest;
    prop_assert!(near(&joint.marginal, &block(&covariance, t, t), scale));
    for part in &joint.others {
        let j = part.j;
        prop_assert!(near(&part.marginal, &block(&covariance, j, j), scale), "marginal {j}");
        prop_assert!(near(&part.cross, &block(&covariance, t, j), scale), "cross {j}");
    }
    for &a in &all {
        for r in s.relative(a, &all).unwrap() {
            let (pi, pa) = (&poses[r.i as usize], &poses[a as usize]);
            let [ii, aa, ia] = [(r.i, r.i), (a, a), (r.i, a)].map(|(p, q)| block(&covariance, p, q));
            let want = crate::geometry::relative_covariance(pi, pa, &ii, &aa, &ia);
            prop_assert!(near(&r.covariance, &want, scale * extent), "{} from {a}", r.i);
            prop_assert!(r.i_from_a.between(&pi.between(pa)).log().amax() < 1e-8 * extent);
        }
    }
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    #[test]
    fn graphs_with_additions_and_removals_equal_the_dense_solution(
        seed in 0_u64..1 << 40, poses in 1_usize..22, loops in 0_usize..9, tail in 0_usize..6,
    ) {
        check_against_dense(&Script::random(seed, poses, loops, tail))?;
    }

    #[test]
    fn the_error_moves_by_the_inverse_right_jacobian(x in -3.0..3.0, y in -3.0..3.0, w in -3.1..3.1) {
        let v = Vector3::new(x, y, w);
        let numeric = numeric_jacobian(|d| Pose2::exp(&v).compose(&Pose2::exp(d)).log());
        // Near ±π the stencil itself would wrap.
        prop_assume!(w.abs() < 3.13);
        prop_assert!((factor::right_jacobian_inverse(&v) - numeric).amax() < 1e-8);
    }
}

#[test]
fn an_empty_smoother_and_a_lone_pose_are_fine() {
    let mut s = Smoother::new();
    assert_eq!(s.joint(&[]), Err(SmoothError::NoSuchPose { pose: 0, len: 0 }));
    s.update().unwrap();
    assert_eq!(s.add_pose(Pose2::new(5.0, 1.0, 1.0), &Matrix3::zeros()), Ok(0));
    assert_eq!(s.poses(), [Pose2::default()]);
    assert_eq!(s.joint(&[0]).unwrap().marginal, Matrix3::zeros());
    assert_eq!(s.relative(0, &[0]).unwrap()[0].covariance, Matrix3::zeros());
}

#[test]
fn removing_every_loop_gives_dead_reckoning_back() {
    let mut s = Script::random(3, 20, 0, 0);
    let reckoned = s.smoother.clone();
    s.close(0, 20, 0.01, 0.01);
    s.smoother.update().unwrap();
    assert!(s.smoother.pose(20).distance_m(&reckoned.pose(20)) > 0.01);
    assert!(s.smoother.chi2() > 0.0);
    s.remove(0);
    s.smoother.update().unwrap();
    assert!(s.smoother.pose(20).distance_m(&reckoned.pose(20)) < 1e-9);
    assert!(s.smoother.chi2() < 1e-12);
    check_against_dense(&s).unwrap();
}

#[test]
fn a_clone_and_its_original_go_their_own_ways() {
    let mut s = Script::random(5, 15, 3, 2);
    let before = bytes(&s.smoother);
    let kept = s.smoother.clone();
    s.close(0, 9, 0.02, 0.01);
    s.extend(Pose2::new(1.0, 0.0, 0.3), 0.1, 0.1);
    s.smoother.update().unwrap();
    assert_eq!(bytes(&kept), before);
    assert_ne!(bytes(&s.smoother), before);
}

fn bytes(s: &Smoother) -> Vec<u8> {
    bincode::serde::encode_to_vec(s, bincode::config::standard().with_fixed_int_encoding()).unwrap()
}

#[test]
fn a_saved_smoother_goes_on_bit_for_bit() {
    // Saved while clean and while a loop awaits its solution.
    for pending in [false, true] {
        let mut s = Script::random(7, 18, 4, 3);
        if pending {
            s.close(1, 19, 0.05, 0.05);
        }
        let saved = bytes(&s.smoother);
        let config = bincode::config::standard().with_fixed_int_encoding();
        let (mut loaded, _): (Smoother, _) = bincode::serde::decode_from_slice(&saved, config).unwrap();
        for smoother in [&mut s.smoother, &mut loaded] {
            smoother.add_pose(Pose2::new(0.9, 0.1, 0.2), &diagonal_information(0.1, 0.1)).unwrap();
            let f =
                Factor { i: 2, j: 20, i_from_j: Pose2::new(1.0, 0.0, 0.5), information: Matrix3::identity() };
            smoother.add_factor(f).unwrap();
            smoother.update().unwrap();
        }
        let all: Vec<u32> = (0..loaded.len() as u32).collect();
        assert_eq!(s.smoother.relative(4, &all), loaded.relative(4, &all));
        assert_eq!(bytes(&s.smoother), bytes(&loaded));
    }
}

#[test]
fn bad_input_is_refused_and_changes_nothing() {
    let mut s = Script::random(11, 6, 1, 1).smoother;
    let before = bytes(&s);
    let good = Factor { i: 0, j: 5, i_from_j: Pose2::default(), information: Matrix3::identity() };
    let with = |m: Matrix3<f64>| Factor { information: m, ..good.clone() };
    let mut nan = Matrix3::identity();
    nan[(1, 2)] = f64::NAN;
    let mut skew = Matrix3::identity();
    skew[(0, 1)] = 0.5;
    let indefinite = Matrix3::from_diagonal(&Vector3::new(1.0, -1.0, 1.0));
    let cases = [
        (with(nan), SmoothError::NotFinite),
        (with(skew), SmoothError::NotSymmetric),
        (with(indefinite), SmoothError::NotPositiveDefinite),
        (with(Matrix3::zeros()), SmoothError::NotPositiveDefinite),
        (Factor { j: 99, ..good.clone() }, SmoothError::NoSuchPose { pose: 99, len: 8 }),
        (Factor { j: 0, ..good.clone() }, SmoothError::SamePose(0)),
        (
            Factor { i_from_j: Pose2 { x_m: f64::NAN, ..Pose2::default() }, ..good.clone() },
            SmoothError::NotFinite,
        ),
    ];
    for (factor, error) in cases {
        assert_eq!(s.add_factor(factor), Err(error));
    }
    for (information, error) in [
        (nan, SmoothError::NotFinite),
        (skew, SmoothError::NotSymmetric),
        (indefinite, SmoothError::NotPositiveDefinite),
    ] {
        assert_eq!(s.add_pose(Pose2::default(), &information), Err(error));
    }
    let infinite = Pose2 { y_m: f64::INFINITY, ..Pose2::default() };
    assert_eq!(s.add_pose(infinite, &Matrix3::identity()), Err(SmoothError::NotFinite));
    assert_eq!(s.remove_factor(9), Err(SmoothError::NoSuchFactor(9)));
    assert_eq!(s.joint(&[1, 8]), Err(SmoothError::NoSuchPose { pose: 8, len: 8 }));
    assert_eq!(s.relative(8, &[]), Err(SmoothError::NoSuchPose { pose: 8, len: 8 }));
    assert_eq!(bytes(&s), before);
    let id = s.add_factor(good).unwrap();
    s.remove_factor(id).unwrap();
    assert_eq!(s.remove_factor(id), Err(SmoothError::NoSuchFactor(id)));
}

#[test]
fn a_factor_that_cannot_be_solved_is_mended_by_its_removal() {
    let mut s = Script::random(23, 10, 2, 0).smoother;
    let before = s.clone();
    let information = Matrix3::identity() * 1e300;
    let far = Factor { i: 0, j: 9, i_from_j: Pose2::new(1e12, 0.0, 0.0), information };
    let id = s.add_factor(far).unwrap();
    assert!(s.update().is_err());
    assert_eq!(s.poses(), before.poses());
    assert_eq!(s.joint(&[3]), before.joint(&[3]));
    s.remove_factor(id).unwrap();
    s.update().unwrap();
    assert!(s.pose(9).distance_m(&before.pose(9)) < 1e-9);
}

#[test]
fn a_wild_start_descends_to_a_minimum() {
    // Bent far out of shape, so that full steps overshoot.
    for seed in 0..40 {
        let mut s = Script::new(seed);
        for _ in 0..40 {
            let turn = s.rng.random_range(-1.5..1.5);
            s.extend(Pose2::new(1.0, 0.0, turn), 0.3, 0.6);
        }
        for k in 0..if seed < 20 { 1 } else { 10 } {
            s.close(3 * k, 40 - k, 0.01, 0.01);
        }
        s.smoother.update().unwrap();
        let (h, g) = dense_system(s.smoother.poses(), &s.factors());
        let decrement = g.dot(&h.cholesky().unwrap().solve(&g));
        assert!(decrement < 1e-5, "seed {seed}: {decrement}");
    }
}

/// A robot that was carried: a link of 50 m and π rad between two tours at centimetres.
fn carried(seed: u64, places: usize) -> Script {
    let mut s = Script::new(seed);
    let tour = |s: &mut Script| {
        for k in 0..places {
            s.extend(Pose2::new(1.0, 0.0, if k % 5 == 4 { 1.5 } else { 0.0 }), 0.01, 0.005);
        }
    };
    tour(&mut s);
    s.extend(Pose2::new(40.0, -30.0, 2.0), 50.0, std::f64::consts::PI);
    tour(&mut s);
    s
}

#[test]
fn relative_covariances_survive_behind_a_lost_odometry() {
    let n = 150;
    let mut s = carried(13, n);
    let tail_only = s.smoother.relative(2 * n as u32 + 1, &[n as u32 + 20]).unwrap()[0].clone();
    let (first, newest) = (n as u32 + 1, 2 * n as u32 + 1);
    // A loop in the first tour, so that the solution covers both; the second tour stays a chain.
    s.close(0, 40, 0.01, 0.005);
    s.smoother.update().unwrap();
    let got = s.smoother.relative(newest, &[first + 19]).unwrap()[0].clone();
    assert!(got.i_from_a.between(&tail_only.i_from_a).log().amax() < 1e-9);
    assert!((got.covariance - tail_only.covariance).amax() < 1e-9 * tail_only.covariance.amax());
    assert!(s.smoother.marginal(newest)[(2, 2)] > 9.0);
    // To the last digits, which a difference of absolute covariances would lose.
    let link = checked_information(&s.chain[newest as usize - 1].information).unwrap().1;
    let got_link = s.smoother.relative(newest, &[newest - 1]).unwrap()[0].covariance;
    assert!((got_link - link).amax() < 1e-12 * link.amax());
    // And between two older places of the second tour, by the sparse solve.
    let got = s.smoother.relative(first + 60, &[first + 20]).unwrap()[0].clone();
    let f = s.chain[(first + 20) as usize..(first + 60) as usize].iter();
    let variance_rad2: f64 = f.map(|f| checked_information(&f.information).unwrap().1[(2, 2)]).sum();
    assert!((got.covariance[(2, 2)] - variance_rad2).abs() < 1e-6 * variance_rad2);
}

#[test]
fn a_relocalisation_pulls_a_carried_tour_into_place() {
    let n = 60;
    let mut s = carried(17, n);
    let newest = 2 * n as u32 + 1;
    assert!(s.smoother.marginal(newest).amax() > 1e3);
    s.close(10, newest, 0.01, 0.005);
    s.close(12, newest - 3, 0.01, 0.005);
    s.smoother.update().unwrap();
    for k in [n as u32 + 1, n as u32 + 30, newest] {
        assert!(s.smoother.pose(k).distance_m(&s.truth[k as usize]) < 1.5);
    }
    assert!(s.smoother.marginal(newest).amax() < 2.0);
}

/// A walk on a city's grid, loops where it comes by again.
fn manhattan(seed: u64, poses: usize, loops: usize) -> Script {
    let mut s = Script::new(seed);
    while s.truth.len() < poses {
        let turn = [0.0, 0.0, 0.0, 1.0, -1.0][s.rng.random_range(0..5)] * std::f64::consts::FRAC_PI_2;
        s.extend(Pose2::new(2.0, 0.0, turn), 0.05, 0.01);
    }
    let mut left = loops;
    while left > 0 {
        let (i, j) = (s.rng.random_range(0..poses as u32), s.rng.random_range(0..poses as u32));
        if i + 20 < j && s.truth[i as usize].distance_m(&s.truth[j as usize]) < 15.0 {
            s.close(i, j, 0.05, 0.01);
            left -= 1;
        }
    }
    s
}

#[test]
fn a_city_sized_graph_converges() {
    let mut s = manhattan(19, 600, 150);
    s.smoother.update().unwrap();
    // χ² of consistent noise: three degrees of freedom a loop, within five sigma.
    let degrees = 450.0_f64;
    assert!((s.smoother.chi2() - degrees).abs() < 5.0 * (2.0 * degrees).sqrt(), "{}", s.smoother.chi2());
    let (_, g) = dense_system(s.smoother.poses(), &s.factors());
    assert!(g.amax() < 1e-3, "gradient {}", g.amax());
    let again = s.smoother.poses().to_vec();
    s.smoother.update().unwrap();
    assert_eq!(s.smoother.poses(), again);
}
