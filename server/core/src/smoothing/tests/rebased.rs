//! Stretches moved as a whole: another start for the same optimum.

use crate::geometry::Pose2;
use crate::smoothing::tests::dense::{Term, chart, moved};
use crate::smoothing::tests::exact::check;
use crate::smoothing::tests::saved::{bytes, loaded};
use crate::smoothing::tests::script::{GOOD, Op, Script, information, op};
use crate::smoothing::{JointRoom, SmoothError, Smoother};
use nalgebra::Vector3;
use proptest::prelude::*;
use proptest::sample::Index;
use rand::RngExt;
use std::f64::consts::PI;

/// As little as a room and a guess of the heading.
const WIDE: (f64, f64) = (20.0, 3.0);

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    #[test]
    fn wherever_it_starts_from_near_the_optimum_it_gets_there(
        seed in any::<u64>(),
        ops in prop::collection::vec((op(), any::<Index>(), prop::bool::weighted(0.6)), 2..20),
    ) {
        let mut s = Script::new(seed);
        s.apply(&Op::Extend);
        for (op, from, settle) in &ops {
            s.apply(op);
            s.smoother.update().unwrap();
            let from = 1 + from.index(s.truth.len() - 1) as u32;
            let [x, y, yaw] = [(); 3].map(|()| s.rng.random_range(-0.2..0.2));
            let by = Pose2::new(x, y, yaw);
            let before = s.smoother.poses();
            s.smoother.rebase(from, &by).unwrap();
            for (p, before) in (0..).zip(before) {
                let want = if p < from { before } else { by.compose(&before) };
                prop_assert!(chart(&want.between(&s.smoother.pose(p))).amax() < 1e-12 * 100.0);
            }
            if *settle {
                s.smoother.settle().unwrap();
                check(&mut s)?;
            }
        }
        s.smoother.settle().unwrap();
        check(&mut s)?;
    }
}

/// A robot carried from one place of its tour to another while its odometry said that it stood: the new
/// stretch begins turned and shifted by `carried`, with `loops` from it to the old one.
fn carried(seed: u64, carried: Pose2, marginalised: &[u32]) -> (Script, u32) {
    let mut s = Script::new(seed);
    for k in 0..40 {
        s.extend(Pose2::new(1.0, 0.0, if k % 6 == 5 { 1.5 } else { 0.05 }), GOOD);
    }
    s.close(3, 28, GOOD);
    if !marginalised.is_empty() {
        s.smoother.settle().unwrap();
        s.marginalise(marginalised);
    }
    let first = s.truth.len() as u32;
    s.extend(Pose2::new(0.5, 0.0, 0.0), GOOD);
    for k in 0..30 {
        s.extend(Pose2::new(1.0, 0.0, if k % 6 == 2 { -1.5 } else { 0.0 }), GOOD);
    }
    s.smoother.update().unwrap();
    // What was carried is elsewhere than odometry thinks.
    let carried = s.truth[first as usize].compose(&carried).compose(&s.truth[first as usize].inverse());
    s.truth[first as usize..].iter_mut().for_each(|p| *p = carried.compose(p));
    (s, first)
}

/// Lets the chain's factor go in both, and holds a loop.
fn relocalise(s: &mut Script, first: u32, i: u32, j: u32) {
    let id = s.smoother.loosen(first, &information(WIDE)).unwrap();
    s.smoother.release(id);
    let term = s.starts[&first];
    let Some(Term::Between(factor)) = s.graph.terms.get_mut(&term) else { panic!() };
    factor.information = information(WIDE);
    let id = s.close(i, j, GOOD);
    // Moved to where the loop says that it is.
    let z = s.smoother.factor(id).unwrap().i_from_j;
    let by = s.smoother.pose(i).compose(&z).compose(&s.smoother.pose(j).inverse());
    s.smoother.rebase(first, &by).unwrap();
}

#[test]
fn a_stretch_turned_around_is_put_in_place() {
    for (seed, yaw_rad) in [(1, PI), (2, -PI + 0.01), (3, 2.0), (4, 3.0)] {
        for marginalised in [vec![], vec![5, 20, 21, 35]] {
            let (mut s, first) = carried(seed, Pose2::new(-20.0, 22.0, yaw_rad), &marginalised);
            relocalise(&mut s, first, 10, first + 12);
            s.smoother.update().unwrap();
            for (p, truth) in (0..).zip(&s.truth).filter(|(p, _)| !marginalised.contains(p)) {
                let off_m = s.smoother.pose(p).distance_m(truth);
                assert!(off_m < 5.0, "seed {seed}: pose {p} off by {off_m} m");
            }
            // A second loop bends it; batch from there.
            s.close(14, first + 25, GOOD);
            s.smoother.settle().unwrap();
            let at = s.smoother.poses();
            s.graph.poses.iter_mut().skip(1).for_each(|(&p, pose)| {
                *pose = moved(&at[p as usize], &Vector3::new(0.01, -0.01, 0.01));
            });
            check(&mut s).unwrap();
        }
    }
}

#[test]
fn priors_across_a_move_hold_as_before() {
    // One pose on each side of where it moves is gone: the prior ties the two sides.
    let mut s = Script::new(8);
    for _ in 0..12 {
        s.wander();
    }
    s.close(2, 9, GOOD);
    s.smoother.settle().unwrap();
    s.marginalise(&[6, 9]);
    s.smoother.settle().unwrap();
    check(&mut s).unwrap();
    s.smoother.rebase(7, &Pose2::new(1.0, -0.5, 0.5)).unwrap();
    s.smoother.settle().unwrap();
    check(&mut s).unwrap();
}

#[test]
fn a_move_costs_what_crosses_it() {
    let (mut s, first) = carried(5, Pose2::new(3.0, 1.0, 1.0), &[]);
    s.smoother.settle().unwrap();
    let fronts: Vec<usize> = s.smoother.belief().front_ids().collect();
    s.smoother.rebase(first, &Pose2::new(1e-7, 0.0, 1e-7)).unwrap();
    let work = s.smoother.update().unwrap();
    assert!(work.factors > 0 && work.eliminated < 30, "{work:?}");
    let kept = s.smoother.belief().front_ids().filter(|id| fronts.contains(id)).count();
    assert!(kept * 3 > fronts.len(), "{kept} of {}", fronts.len());
}

#[test]
fn saved_after_a_move_it_goes_on_bit_for_bit() {
    for updated in [false, true] {
        let (mut s, first) = carried(6, Pose2::new(-20.0, 22.0, PI), &[5, 20]);
        relocalise(&mut s, first, 10, first + 12);
        if updated {
            s.smoother.update().unwrap();
        }
        let mut again: Smoother = loaded(&bytes(&s.smoother));
        for smoother in [&mut s.smoother, &mut again] {
            for k in 0..12 {
                smoother.add_pose(Pose2::new(0.9, 0.1, 0.2), &information(GOOD)).unwrap();
                if k == 6 {
                    smoother.rebase(first + 20, &Pose2::new(0.1, 0.0, 0.1)).unwrap();
                }
                smoother.update().unwrap();
            }
        }
        assert!(bytes(&s.smoother) == bytes(&again), "{updated}");
        let joint = |smoother: &Smoother| smoother.joint_all(&mut JointRoom::default()).cloned();
        assert_eq!(joint(&s.smoother), joint(&again));
    }
}

#[test]
fn moves_of_nothing_or_to_nowhere_are_refused() {
    let (mut s, _) = carried(7, Pose2::default(), &[]);
    let (len, before) = (s.smoother.len(), bytes(&s.smoother));
    let by = Pose2::new(1.0, 0.0, 0.0);
    let endless = Pose2 { x_m: f64::INFINITY, ..by };
    let beyond = SmoothError::NoSuchPose { pose: len as u32, len };
    assert_eq!(s.smoother.rebase(0, &by), Err(SmoothError::Needed(0)));
    assert_eq!(s.smoother.rebase(len as u32, &by), Err(beyond));
    assert_eq!(s.smoother.rebase(1, &endless), Err(SmoothError::NotFinite));
    assert!(bytes(&s.smoother) == before);
}
