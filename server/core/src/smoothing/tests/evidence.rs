//! The evidence of a set of factors: what one more adds, and in which order it does not matter.

use crate::geometry::Pose2;
use crate::smoothing::tests::batch::manhattan;
use crate::smoothing::tests::script::{GOOD, POOR, Script, Sigma, information};
use crate::smoothing::{Belief, Factor, Structure};
use nalgebra::Matrix3;
use rand::seq::SliceRandom;
use std::f64::consts::TAU;

/// Of a metre by wheels that are matched to scans.
const WHEELS: Sigma = (0.02, 0.008);

/// A walk through a city with its loops taken out: its structure, a belief that holds none, and them.
fn city(seed: u64) -> (Structure, Belief, Vec<u32>) {
    let mut s = manhattan(seed, 150, 30, WHEELS);
    let ids: Vec<u32> = s.loops.iter().map(|(id, _)| *id).collect();
    for &id in &ids {
        s.smoother.release(id);
    }
    s.smoother.settle().unwrap();
    (s.smoother.structure().clone(), s.smoother.belief().clone(), ids)
}

fn density(belief: &Belief, structure: &Structure, id: u32) -> f64 {
    let f = structure.factor(id).unwrap();
    let covariance = f.information.try_inverse().unwrap();
    let predicted = belief.relative(structure, f.j, &[f.i]).unwrap().remove(0);
    predicted.log_density(&f.i_from_j, &covariance).unwrap().log_density
}

#[test]
fn one_more_factor_adds_its_predicted_density() {
    let mut all_off = Vec::new();
    let mut least = f64::INFINITY;
    for seed in 0..4 {
        let (structure, none, mut ids) = city(seed);
        let start = none.log_evidence(&structure);
        // A chain alone predicts nothing.
        assert!(start.abs() < 1e-6, "{start}");
        let mut ends = Vec::new();
        for _ in 0..4 {
            let mut belief = none.clone();
            let mut before = start;
            for &id in &ids {
                let predicted = density(&belief, &structure, id);
                belief.hold(id);
                belief.settle(&structure).unwrap();
                let after = belief.log_evidence(&structure);
                all_off.push((after - before - predicted).abs());
                least = least.min(predicted);
                before = after;
            }
            let chi2 = belief.chi2(&structure);
            assert!((belief.least_chi2(&structure) - chi2).abs() < 1e-6 * chi2);
            ends.push(before);
            ids.shuffle(&mut Script::new(seed).rng);
        }
        for end in &ends {
            assert!((end - ends[0]).abs() < 1e-6 * ends[0].abs(), "{ends:?}");
        }
    }
    // The prediction is linear, the evidence is not: the first loop at the end of a long chain bends more.
    all_off.sort_unstable_by(f64::total_cmp);
    let n = all_off.len();
    assert!(all_off[n * 99 / 100] < 0.05 && all_off[n - 1] < 0.2, "{:?}", &all_off[n * 98 / 100..]);
    assert!(least < 2.0, "all alike: {least}");
}

#[test]
fn updates_know_the_evidence_as_well_as_the_poses() {
    // Neither settled nor held back: within hundredths of nats of the optimum's.
    let (structure, mut belief, ids) = city(7);
    for id in ids {
        belief.hold(id);
        belief.update(&structure).unwrap();
        let mut settled = belief.clone();
        settled.settle(&structure).unwrap();
        let (got, want) = (belief.log_evidence(&structure), settled.log_evidence(&structure));
        assert!((got - want).abs() < 0.02, "{got} {want}");
    }
}

#[test]
fn a_tight_factor_is_as_likely_as_what_is_seen_from_it() {
    // Loops say nothing of it before they are there; then, that it is right, or that the robot was carried.
    for carried in [false, true] {
        let mut s = Script::new(11);
        for _ in 0..20 {
            s.wander();
        }
        let id = s.smoother.loosen(12, &information(POOR)).unwrap();
        let odds = |s: &mut Script| {
            s.smoother.settle().unwrap();
            let tight = s.smoother.log_evidence();
            let mut loose = s.smoother.clone();
            loose.release(id);
            loose.settle().unwrap();
            tight - loose.log_evidence()
        };
        assert!(odds(&mut s).abs() < 1e-6);
        if carried {
            let by = Pose2::new(1.5, -1.0, 0.2);
            s.truth[12..].iter_mut().for_each(|p| *p = p.compose(&by));
        }
        s.close(4, 15, GOOD);
        let odds = odds(&mut s);
        assert!(if carried { odds < -5.0 } else { odds > 2.0 }, "{carried}: {odds}");
    }
}

#[test]
fn evidence_of_what_fails_is_none() {
    let mut s = Script::new(1);
    assert!(s.smoother.log_evidence().abs() < 1e-12);
    for _ in 0..9 {
        s.wander();
    }
    s.smoother.update().unwrap();
    let (belief, structure) = (s.smoother.belief(), s.smoother.structure());
    let z = Pose2::new(1.0, 0.0, 0.0);
    let r = Matrix3::identity();
    let predicted = |i| belief.relative(structure, 3, &[i]).unwrap().remove(0);
    for r in [-1e3 * r, f64::NAN * r] {
        assert_eq!(predicted(0).log_density(&z, &r), None);
    }
    // Of a pose in its own frame: zero, exactly.
    let own = predicted(3).log_density(&Pose2::default(), &r).unwrap();
    assert!((own.log_density + 1.5 * TAU.ln()).abs() < 1e-9 && own.distance2 < 1e-12);
    let far = Factor { i: 0, j: 9, i_from_j: Pose2::new(1e12, 0.0, 0.0), information: 1e300 * r };
    s.smoother.add_factor(far).unwrap();
    assert!(s.smoother.update().is_err());
    assert!(s.smoother.log_evidence() < f64::MIN);
}
