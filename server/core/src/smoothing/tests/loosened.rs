//! Chain factors that some particles let go.

use crate::geometry::Pose2;
use crate::smoothing::tests::dense::Term;
use crate::smoothing::tests::exact::check;
use crate::smoothing::tests::saved::{bytes, loaded};
use crate::smoothing::tests::script::{GOOD, POOR, Script, information, op};
use crate::smoothing::{FactorId, SmoothError, Smoother};
use nalgebra::Matrix3;
use proptest::prelude::*;
use proptest::sample::Index;
use std::collections::BTreeMap;

/// Tight factors loosened, with the terms they are in the reference, and their information there.
type Loosened = BTreeMap<FactorId, (u32, Matrix3<f64>)>;

/// Loosens what a pose started with, or holds or lets go what it was before.
fn turn(s: &mut Script, loosened: &mut Loosened, pose: u32, release: bool) {
    let term = s.starts.get(&pose).copied().filter(|term| s.graph.terms.contains_key(term));
    let got = s.smoother.loosen(pose, &information(POOR));
    let Some(term) = term else { return assert!(got.is_err(), "pose {pose}: {got:?}") };
    let id = got.unwrap();
    let Some(Term::Between(factor)) = s.graph.terms.get_mut(&term) else { return };
    let (_, tight) = loosened.entry(id).or_insert((term, factor.information));
    factor.information = if release { information(POOR) } else { *tight };
    if release {
        s.smoother.release(id);
    } else {
        s.smoother.hold(id);
    }
}

/// What hangs by a loosened edge may have no optimum that Gauss–Newton comes to: the script is passed over then. Where
/// the dense one comes to it, the smoother must, too.
fn settle_where_there_is_an_optimum(s: &mut Script) -> Result<(), TestCaseError> {
    prop_assume!(s.graph.clone().finds_an_optimum(0));
    s.smoother.settle().map(drop).map_err(|e| TestCaseError::fail(e.to_string()))
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    #[test]
    fn what_is_loosened_is_held_by_the_wide_one_or_the_tight_one(
        seed in any::<u64>(),
        ops in prop::collection::vec((op(), any::<(Index, bool)>(), prop::bool::weighted(0.5)), 1..20),
    ) {
        let mut s = Script::new(seed);
        let mut loosened = Loosened::new();
        for (op, (which, release), settle) in &ops {
            s.apply(op);
            if *settle {
                settle_where_there_is_an_optimum(&mut s)?;
            }
            let present = s.present();
            // Before or after it is arranged.
            turn(&mut s, &mut loosened, present[which.index(present.len())], *release);
            if *settle {
                settle_where_there_is_an_optimum(&mut s)?;
                check(&mut s)?;
            }
        }
        settle_where_there_is_an_optimum(&mut s)?;
        check(&mut s)?;
    }
}

fn walk(seed: u64) -> Script {
    let mut s = Script::new(seed);
    for _ in 0..20 {
        s.wander();
    }
    for (i, j) in [(0, 9), (4, 17), (11, 20)] {
        s.close(i, j, GOOD);
    }
    s.smoother.settle().unwrap();
    s
}

/// All that is known: poses and covariances.
fn known(s: &Smoother) -> (Vec<Pose2>, Vec<Matrix3<f64>>) {
    (s.poses(), (0..s.len() as u32).map(|p| s.marginal(p)).collect())
}

#[test]
fn who_keeps_the_factor_knows_what_it_knew_to_the_bit() {
    let mut s = walk(3).smoother;
    let before = known(&s);
    let fronts: Vec<usize> = s.belief().front_ids().collect();
    let id = s.loosen(8, &information(POOR)).unwrap();
    assert_eq!(s.loosen(8, &information(GOOD)), Ok(id));
    let work = s.settle().unwrap();
    assert_eq!((known(&s), work.eliminated), (before.clone(), 0));
    assert!(s.belief().front_ids().eq(fronts));
    // Let go, and taken back: the same numbers of the same factors.
    s.release(id);
    s.settle().unwrap();
    let loose = known(&s);
    assert!(loose.1[8][(0, 0)] > before.1[8][(0, 0)]);
    let mut again: Smoother = loaded(&bytes(&s));
    again.settle().unwrap();
    assert_eq!(known(&again), loose);
    s.hold(id);
    s.settle().unwrap();
    for (got, want) in s.poses().iter().zip(&before.0) {
        assert!(got.between(want).log().amax() < 1e-9);
    }
}

#[test]
fn a_loosened_factor_that_is_removed_leaves_the_wide_one_to_all() {
    let mut s = walk(4);
    let id = s.smoother.loosen(8, &information(POOR)).unwrap();
    s.smoother.remove_factor(id).unwrap();
    assert_eq!(s.smoother.remove_factor(id), Err(SmoothError::NoSuchFactor(id)));
    let term = s.starts[&8];
    let Some(Term::Between(factor)) = s.graph.terms.get_mut(&term) else { panic!() };
    factor.information = information(POOR);
    s.smoother.settle().unwrap();
    check(&mut s).unwrap();
}

#[test]
fn what_cannot_be_loosened_stays_as_it_is() {
    let mut s = walk(5);
    s.marginalise(&[6]);
    s.smoother.settle().unwrap();
    let before = bytes(&s.smoother);
    let wide = information(POOR);
    let nowhere = SmoothError::NoSuchPose { pose: 99, len: 21 };
    let none = Matrix3::zeros();
    for (pose, wide, why) in [
        (0, wide, SmoothError::Needed(0)),
        (6, wide, SmoothError::Marginalised(6)),
        (7, wide, SmoothError::NoSuchFactor(6)),
        (99, wide, nowhere),
        (8, none, SmoothError::NotPositiveDefinite),
        (8, wide * f64::NAN, SmoothError::NotFinite),
    ] {
        assert_eq!(s.smoother.loosen(pose, &wide), Err(why));
    }
    assert!(bytes(&s.smoother) == before);
    assert_eq!(Smoother::new().loosen(0, &wide), Err(SmoothError::NoSuchPose { pose: 0, len: 0 }));
}
