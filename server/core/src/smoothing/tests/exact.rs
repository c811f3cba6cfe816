//! Settled, the smoother says what the reference says.

use crate::geometry::Pose2;
use crate::smoothing::JointRoom;
use crate::smoothing::factor::{At, residual};
use crate::smoothing::tests::dense::{chart, derivative};
use crate::smoothing::tests::script::{Script, op};
use nalgebra::{DVector, Matrix3, Vector3};
use proptest::prelude::*;

/// Poses agree to this, metres or radians, times the map's extent.
const POSES: f64 = 1e-9;
/// Covariances agree to this share of their largest entry.
const COVARIANCES: f64 = 1e-8;

fn near(got: &Matrix3<f64>, want: &Matrix3<f64>, scale: f64) -> bool {
    (got - want).amax() <= COVARIANCES * scale
}

/// Poses, chi², evidence and all covariances of a settled smoother.
pub fn check(s: &mut Script) -> Result<(), TestCaseError> {
    s.graph.solve(0);
    let extent = s.graph.extent_m();
    for (&k, pose) in &s.graph.poses {
        let off = chart(&pose.between(&s.smoother.pose(k)));
        prop_assert!(off.amax() < POSES * extent, "pose {k} off by {off:?}");
    }
    let chi2 = s.graph.chi2();
    prop_assert!((s.smoother.chi2() - chi2).abs() < 1e-6 * (1.0 + chi2), "chi2 {chi2}");
    let (got, want) = (s.smoother.log_evidence(), s.graph.log_evidence());
    prop_assert!((got - want).abs() < 1e-6 * (1.0 + want.abs()), "evidence {got} {want}");
    check_absolute(s)?;
    s.present().into_iter().try_for_each(|a| check_relative(s, a))
}

fn check_absolute(s: &Script) -> Result<(), TestCaseError> {
    let (present, t) = (s.present(), s.newest());
    let covariance = s.graph.covariance(0);
    let scale = if covariance.all.is_empty() { 0.0 } else { covariance.all.amax() };
    let joint = s.smoother.joint(&present).unwrap();
    let mut room = JointRoom::default();
    let all = s.smoother.joint_all(&mut room).unwrap();
    prop_assert_eq!((joint.newest, all.newest), (t, t));
    prop_assert!(near(&joint.marginal, &covariance.block(t, t), scale));
    prop_assert!(near(&all.marginal, &covariance.block(t, t), scale));
    prop_assert_eq!(all.others.iter().map(|part| part.j).collect::<Vec<_>>(), present);
    for (part, other) in joint.others.iter().zip(&all.others) {
        let j = part.j;
        prop_assert_eq!(j, other.j);
        prop_assert!(near(&s.smoother.marginal(j), &covariance.block(j, j), scale), "marginal {j}");
        for part in [part, other] {
            prop_assert!(near(&part.marginal, &covariance.block(j, j), scale), "marginal {j}");
            prop_assert!(near(&part.cross, &covariance.block(t, j), scale), "cross {j}");
        }
    }
    Ok(())
}

/// All relative to a pose, and a pose relative to all.
fn check_relative(s: &Script, a: u32) -> Result<(), TestCaseError> {
    let present = s.present();
    // The graph as seen from a: nothing is subtracted.
    let from_a = s.graph.covariance(a);
    let extent = s.graph.extent_m();
    for r in s.smoother.relative(a, &present).unwrap() {
        let back = &s.smoother.relative(r.i, &[a]).unwrap()[0];
        let (pi, pa) = (s.graph.poses[&r.i], s.graph.poses[&a]);
        let off = chart(&r.i_from_a.between(&pi.between(&pa)));
        prop_assert!(off.amax() < POSES * extent, "{} from {a} off by {off:?}", r.i);
        let want = from_a.block(r.i, r.i);
        let scale = want.amax();
        prop_assert!(near(&back.covariance, &want, scale), "{a} from {}: {} {want}", r.i, back.covariance);
        let turn = pa.between(&pi).adjoint();
        let want = turn * want * turn.transpose();
        let scale = want.amax();
        prop_assert!(near(&r.covariance, &want, scale), "{} from {a}: {} {want}", r.i, r.covariance);
    }
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    #[test]
    fn every_step_of_a_script_equals_the_dense_solution(
        seed in any::<u64>(), ops in prop::collection::vec((op(), prop::bool::weighted(0.8)), 1..25),
    ) {
        let mut s = Script::new(seed);
        for (op, settle) in &ops {
            s.apply(op);
            if *settle {
                s.smoother.settle().unwrap();
                check(&mut s)?;
            }
        }
        s.smoother.settle().unwrap();
        check(&mut s)?;
    }

    #[test]
    fn jacobians_equal_numerical_ones(z in pose(), a in pose(), b in pose()) {
        let at = |d: [f64; 6]| {
            let [i, j] = [(a, 0), (b, 3)].map(|(p, k)| At::new(p).moved(&[d[k], d[k + 1], d[k + 2]]));
            DVector::from_column_slice(residual(&At::new(z), &At::new(i), &At::new(j)).error.as_slice())
        };
        let got = residual(&At::new(z), &At::new(a), &At::new(b));
        let want = super::dense::error(&z, &a, &b);
        prop_assert!((got.error - want).xy().amax() < 1e-12 * 100.0);
        prop_assert!(crate::geometry::wrap(got.error.z - want.z).abs() < 1e-12);
        for k in 0..6 {
            let want = derivative(|h| at(std::array::from_fn(|c| if c == k { h } else { 0.0 })));
            let got = if k < 3 { got.j_i.column(k) } else { got.j_j.column(k - 3) };
            prop_assert!((Vector3::from_column_slice(want.as_slice()) - got).amax() < 1e-10, "column {k}");
        }
    }
}

fn pose() -> impl Strategy<Value = Pose2> {
    (-30.0..30.0, -30.0..30.0, -3.1..3.1).prop_map(|(x, y, yaw)| Pose2::new(x, y, yaw))
}
