//! Copies, files, and what is refused.

use crate::geometry::Pose2;
use crate::smoothing::tests::script::{GOOD, Script, information};
use crate::smoothing::{Belief, Factor, JointRoom, SmoothError, Smoother, Structure};
use nalgebra::{Matrix3, Vector3};
use serde::{Serialize, de::DeserializeOwned};

pub fn bytes<T: Serialize>(value: &T) -> Vec<u8> {
    bincode::serde::encode_to_vec(value, bincode::config::standard().with_fixed_int_encoding()).unwrap()
}

pub fn loaded<T: DeserializeOwned>(saved: &[u8]) -> T {
    let config = bincode::config::standard().with_fixed_int_encoding();
    bincode::serde::decode_from_slice(saved, config).unwrap().0
}

/// A walk with loops, a session and a gap, updated at every step.
fn walk(seed: u64) -> Script {
    let mut s = Script::new(seed);
    for k in 1..=20 {
        match k {
            8 => s.anchor((3.0, 0.3)),
            12 => s.marginalise(&[3, 5]),
            _ => s.wander(),
        }
        if k % 6 == 0 || k == 9 {
            let newest = s.newest();
            s.close(k / 3, newest, GOOD);
        }
        s.smoother.update_newest().unwrap();
    }
    s
}

#[test]
fn removing_every_loop_gives_dead_reckoning_back() {
    let mut s = Script::new(3);
    for _ in 0..20 {
        s.wander();
    }
    s.smoother.update().unwrap();
    let reckoned = s.smoother.clone();
    s.close(0, 20, (0.01, 0.01));
    s.smoother.update().unwrap();
    assert!(s.smoother.pose(20).distance_m(&reckoned.pose(20)) > 0.01);
    assert!(s.smoother.chi2() > 0.0);
    s.remove(0);
    s.smoother.settle().unwrap();
    assert!(s.smoother.pose(20).distance_m(&reckoned.pose(20)) < 1e-9);
    assert!(s.smoother.chi2() < 1e-12);
    super::exact::check(&mut s).unwrap();
}

#[test]
fn a_clone_and_its_original_go_their_own_ways() {
    let mut s = walk(5);
    let before = bytes(&s.smoother);
    let mut kept = s.smoother.clone();
    s.close(0, 9, (0.02, 0.01));
    s.wander();
    s.smoother.update().unwrap();
    assert!(bytes(&kept) == before && bytes(&s.smoother) != before);
    // And the other way round.
    let before = bytes(&s.smoother);
    kept.add_pose(Pose2::new(1.0, 0.0, 0.3), &information(GOOD)).unwrap();
    kept.settle().unwrap();
    assert!(bytes(&s.smoother) == before);
}

#[test]
fn a_saved_smoother_goes_on_bit_for_bit() {
    // Saved when clean, while a loop awaits its solution, and while a pose is being taken out.
    for pending in 0..3 {
        let mut s = walk(7);
        match pending {
            1 => drop(s.close(1, 19, GOOD)),
            2 => s.smoother.marginalise(&[7, 10]).unwrap(),
            _ => {}
        }
        let saved = bytes(&s.smoother);
        let mut again: Smoother = loaded(&saved);
        assert!(bytes(&again) == saved);
        for smoother in [&mut s.smoother, &mut again] {
            for k in 0..15 {
                let newest = smoother.add_pose(Pose2::new(0.9, 0.1, 0.2), &information((0.1, 0.1))).unwrap();
                if k % 4 == 0 {
                    let i_from_j = Pose2::new(1.0, 0.0, 0.5);
                    let f = Factor { i: 2, j: newest, i_from_j, information: Matrix3::identity() };
                    smoother.add_factor(f).unwrap();
                }
                match k % 3 {
                    0 => drop(smoother.update().unwrap()),
                    _ => drop(smoother.update_newest().unwrap()),
                }
            }
        }
        assert!(bytes(&s.smoother) == bytes(&again), "{pending}");
        let all = [0, 1, 2, 4, 9, 12, 20];
        assert_eq!(s.smoother.relative(4, &all), again.relative(4, &all));
        let joint = |smoother: &Smoother| smoother.joint_all(&mut JointRoom::default()).cloned();
        assert_eq!(joint(&s.smoother), joint(&again));
    }
}

#[test]
fn saved_particles_go_on_bit_for_bit() {
    let s = walk(9);
    let mut structure = s.smoother.structure().clone();
    let mut beliefs = vec![s.smoother.belief().clone(); 3];
    let id = structure
        .add_factor(Factor { i: 4, j: 15, i_from_j: Pose2::default(), information: Matrix3::identity() })
        .unwrap();
    structure.arrange();
    beliefs[1].update(&structure).unwrap();
    beliefs[1].hold(id);
    beliefs[2].hold(id);
    beliefs[2].update_newest(&structure).unwrap();
    let (mut structure_again, mut again): (Structure, Vec<Belief>) = loaded(&bytes(&(&structure, &beliefs)));
    for (structure, beliefs) in [(&mut structure, &mut beliefs), (&mut structure_again, &mut again)] {
        structure.add_pose(Pose2::new(1.0, 0.0, 0.1), &information(GOOD)).unwrap();
        structure.arrange();
        for belief in beliefs.iter_mut() {
            belief.update_newest(structure).unwrap();
        }
        beliefs[2].release(id);
        for belief in beliefs {
            belief.update(structure).unwrap();
        }
    }
    assert!(bytes(&(&structure, &beliefs)) == bytes(&(&structure_again, &again)));
    let joint =
        |structure, belief: &Belief| belief.joint_all(structure, &mut JointRoom::default()).unwrap().clone();
    for (a, b) in beliefs.iter().zip(&again) {
        assert_eq!(joint(&structure, a), joint(&structure_again, b));
    }
}

#[test]
fn an_empty_smoother_and_a_lone_pose_are_fine() {
    let mut s = Smoother::new();
    assert_eq!(s.joint(&[]), Err(SmoothError::NoSuchPose { pose: 0, len: 0 }));
    s.update().unwrap();
    assert_eq!(s.add_pose(Pose2::new(5.0, 1.0, 1.0), &Matrix3::zeros()), Ok(0));
    for _ in 0..2 {
        s.settle().unwrap();
        assert_eq!(s.poses(), [Pose2::default()]);
        assert_eq!(s.joint(&[0]).unwrap().marginal, Matrix3::zeros());
        assert_eq!(s.joint_all(&mut JointRoom::default()).unwrap().others.len(), 1);
        assert_eq!(s.relative(0, &[0]).unwrap()[0].covariance, Matrix3::zeros());
    }
}

#[test]
fn a_factor_that_cannot_be_solved_is_mended_by_its_removal() {
    let mut s = walk(23).smoother;
    s.settle().unwrap();
    let before = s.clone();
    let information = Matrix3::identity() * 1e300;
    let far = Factor { i: 0, j: 9, i_from_j: Pose2::new(1e12, 0.0, 0.0), information };
    let id = s.add_factor(far).unwrap();
    assert!(s.update().is_err());
    s.remove_factor(id).unwrap();
    s.settle().unwrap();
    assert!(s.pose(9).distance_m(&before.pose(9)) < 1e-9);
    assert!((s.marginal(9) - before.marginal(9)).amax() < 1e-8);
}

fn good() -> Factor {
    Factor { i: 0, j: 6, i_from_j: Pose2::default(), information: Matrix3::identity() }
}

/// Information matrices that are none, with the reason.
fn bad_information() -> [(Matrix3<f64>, SmoothError); 5] {
    let mut nan = Matrix3::identity();
    nan[(1, 2)] = f64::NAN;
    let mut skew = Matrix3::identity();
    skew[(0, 1)] = 0.5;
    [
        (nan, SmoothError::NotFinite),
        (Matrix3::identity() * f64::INFINITY, SmoothError::NotFinite),
        (skew, SmoothError::NotSymmetric),
        (Matrix3::from_diagonal(&Vector3::new(1.0, -1.0, 1.0)), SmoothError::NotPositiveDefinite),
        (Matrix3::zeros(), SmoothError::NotPositiveDefinite),
    ]
}

#[test]
fn bad_input_is_refused_and_changes_nothing() {
    let mut s = walk(11).smoother;
    s.settle().unwrap();
    let len = s.len();
    let before = bytes(&s);
    let nowhere = SmoothError::NoSuchPose { pose: 99, len };
    let not_a_number = Pose2 { x_m: f64::NAN, ..Pose2::default() };
    let infinite = Pose2 { y_m: f64::INFINITY, ..Pose2::default() };
    let mut cases = vec![
        (Factor { j: 99, ..good() }, nowhere.clone()),
        (Factor { j: 0, ..good() }, SmoothError::SamePose(0)),
        (Factor { j: 3, ..good() }, SmoothError::Marginalised(3)),
        (Factor { i_from_j: not_a_number, ..good() }, SmoothError::NotFinite),
        (Factor { i_from_j: infinite, ..good() }, SmoothError::NotFinite),
    ];
    cases.extend(bad_information().map(|(information, why)| (Factor { information, ..good() }, why)));
    for (factor, why) in cases {
        assert_eq!(s.add_factor(factor.clone()), Err(why.clone()));
        let from = Factor { i: factor.i, j: len as u32, ..factor };
        if matches!(
            why,
            SmoothError::NotFinite | SmoothError::NotSymmetric | SmoothError::NotPositiveDefinite
        ) {
            assert_eq!(s.add_pose_from(from.clone()), Err(why.clone()));
            assert_eq!(s.add_pose(from.i_from_j, &from.information), Err(why.clone()));
            assert_eq!(s.add_anchor(from.i_from_j, &from.information), Err(why));
        }
    }
    let new = len as u32;
    assert_eq!(s.add_pose_from(Factor { i: 5, j: new, ..good() }), Err(SmoothError::Marginalised(5)));
    assert!(matches!(s.add_pose_from(good()), Err(SmoothError::NoSuchPose { .. })));
    assert!(matches!(
        s.add_pose_from(Factor { i: new + 1, j: new, ..good() }),
        Err(SmoothError::NoSuchPose { .. })
    ));
    assert_eq!(s.remove_factor(999), Err(SmoothError::NoSuchFactor(999)));
    // Odometry is no loop, and what a marginalised pose left is none either.
    assert_eq!(s.remove_factor(0), Err(SmoothError::NoSuchFactor(0)));
    assert_eq!(s.joint(&[1, 99]), Err(nowhere.clone()));
    assert_eq!(s.relative(99, &[]), Err(nowhere));
    assert_eq!(s.relative(1, &[3]), Err(SmoothError::Marginalised(3)));
    assert!(bytes(&s) == before);
    let id = s.add_factor(good()).unwrap();
    s.remove_factor(id).unwrap();
    assert_eq!(s.remove_factor(id), Err(SmoothError::NoSuchFactor(id)));
}

#[test]
fn poses_that_cannot_go_stay() {
    let mut s = walk(12).smoother;
    s.settle().unwrap();
    let (len, newest, before) = (s.len(), s.len() as u32 - 1, s.poses());
    for (poses, why) in [
        (vec![0], SmoothError::Needed(0)),
        (vec![2, newest], SmoothError::Needed(newest)),
        (vec![3], SmoothError::Marginalised(3)),
        (vec![99], SmoothError::NoSuchPose { pose: 99, len }),
    ] {
        assert_eq!(s.marginalise(&poses), Err(why));
    }
    assert_eq!(s.poses(), before);
    assert!(s.relative(1, &[2, newest]).is_ok());
}
