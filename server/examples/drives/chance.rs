//! True fits and fits by chance, as a particle meets them that has drifted.
//!
//! A drift is drawn anew every [`EPOCH`] places, of each of [`DRIFTS_M`] as standard deviation. Places are
//! proposed around the drifted prediction and followed as in the filter, and each fit that counts as
//! evidence is weighed. It is true if its transform is within .5 m and 5° of the truth.

use crate::drive::Drive;
use crate::logistic::{Example, fit};
use nalgebra::{Matrix3, Vector3};
use std::collections::BTreeSet;
use toponym_core::Pose2;
use toponym_core::config::Config;
use toponym_core::edge::{EdgeKind, Proposal, QuestionId, Vertex};
use toponym_core::filter::chance::{LOOKS, log_chance, log_looks, looks};
use toponym_core::filter::loops::{Fit, Loops};
use toponym_core::filter::particle::Edge;
use toponym_core::filter::propose::{LOST_SIGMA_M, NEAR_M, distance_probability, draw};
use toponym_core::filter::weigh::log_density;
use toponym_core::random::{Purpose, uniform};
use toponym_core::smoothing::Relative;
use toponym_core::track::front::LOCAL_PATH_M;

const DRIFTS_M: [f64; 4] = [0.3, 1.0, 3.0, 8.0];
/// Drift of the heading by that of the position, at most the last: 10 m of path turn as much as they shift.
const DRIFT_RAD_PER_M: f64 = 0.04;
const DRIFT_RAD_MAX: f64 = 0.3;
/// Places with one drift.
const EPOCH: Vertex = 40;
const TRUE_M: f64 = 0.5;
const TRUE_RAD: f64 = 0.087;
/// Each drive counts for so many fits: those of one revisit are hardly independent.
const DRIVE_COUNTS: f64 = 2000.0;
/// Edges of the bins of probabilities.
const BINS: [f64; 10] = [0.0, 0.01, 0.1, 0.3, 0.5, 0.7, 0.9, 0.99, 0.999, 1.1];

/// A fit that was weighed.
struct Weighed {
    building: usize,
    is_true: bool,
    looks: [f64; 4],
    log_density_ratio: f64,
    /// p(e = 1 | z) by the library.
    posterior: f64,
    counts: f64,
}

/// Learns, and checks on buildings not learned from.
pub fn report(drives: &[Drive]) {
    let names: BTreeSet<&str> = drives.iter().map(|d| d.building.as_str()).collect();
    let building = |d: &Drive| names.iter().position(|n| *n == d.building).unwrap_or_default();
    let weighed: Vec<Weighed> = drives.iter().flat_map(|d| of_drive(d, building(d))).collect();
    let trues = weighed.iter().filter(|w| w.is_true).count();
    println!("{trues} true fits, {} by chance, {} buildings", weighed.len() - trues, names.len());

    let free: Vec<Example<5>> = examples(
        &weighed,
        |_| 0.0,
        |w| {
            let [a, b, c, d] = w.looks;
            [a, b, c, d, w.log_density_ratio]
        },
    );
    println!("LOOKS and a power of the density, learned together: {:.2?}", fit(&free, |_| true));
    let bound: Vec<Example<4>> = examples(&weighed, |w| w.log_density_ratio, |w| w.looks);
    println!("LOOKS: {:.2?}", fit(&bound, |_| true));
    println!("LOOKS of the library: {LOOKS:.2?}");

    let mut held_out = vec![0.0; weighed.len()];
    for b in 0..names.len() {
        let learned = fit(&bound, |k| weighed[k].building != b);
        for ((p, e), w) in held_out.iter_mut().zip(&bound).zip(&weighed) {
            if w.building == b {
                *p = e.probability(&learned);
            }
        }
    }
    calibration("learned from the other buildings", &weighed, &held_out);
    let library: Vec<f64> = weighed.iter().map(|w| w.posterior).collect();
    calibration("by the library", &weighed, &library);
}

fn examples<const N: usize>(
    weighed: &[Weighed],
    given: impl Fn(&Weighed) -> f64,
    features: impl Fn(&Weighed) -> [f64; N],
) -> Vec<Example<N>> {
    let example = |w: &Weighed| Example {
        features: features(w),
        given: given(w),
        weight: w.counts,
        is_true: w.is_true,
    };
    weighed.iter().map(example).collect()
}

/// Mean probability and share that is true, by bins of the probability.
fn calibration(of: &str, weighed: &[Weighed], probabilities: &[f64]) {
    println!("{of}: probability, share true (fits)");
    for bin in BINS.windows(2) {
        let (mut sum, mut p, mut trues, mut n) = (0.0, 0.0, 0.0, 0);
        for (w, q) in weighed.iter().zip(probabilities).filter(|(_, q)| (bin[0]..bin[1]).contains(*q)) {
            sum += w.counts;
            p += w.counts * q;
            trues += w.counts * f64::from(w.is_true);
            n += 1;
        }
        if n > 0 {
            println!("  {:.4} {:.4} ({n})", p / sum, trues / sum);
        }
    }
    let log_loss = |(w, q): (&Weighed, &f64)| {
        let q = q.clamp(1e-6, 1.0 - 1e-6);
        -w.counts * if w.is_true { q.ln() } else { (1.0 - q).ln() }
    };
    let sum: f64 = weighed.iter().map(|w| w.counts).sum();
    println!("  log-loss {:.4}", weighed.iter().zip(probabilities).map(log_loss).sum::<f64>() / sum);
}

fn of_drive(drive: &Drive, building: usize) -> Vec<Weighed> {
    let mut weighed: Vec<Weighed> =
        DRIFTS_M.iter().flat_map(|&drift_m| drifted(drive, building, drift_m)).collect();
    let counts = DRIVE_COUNTS / weighed.len().max(1) as f64;
    for w in &mut weighed {
        w.counts = counts;
    }
    eprintln!("{}: {} fits", drive.name, weighed.len());
    weighed
}

/// All fits of a drive along which predictions are off by some drift.
fn drifted(drive: &Drive, building: usize, drift_m: f64) -> Vec<Weighed> {
    let drift_rad = (drift_m * DRIFT_RAD_PER_M).min(DRIFT_RAD_MAX);
    let sigmas = Vector3::new(drift_m, drift_m, drift_rad);
    let covariance = Matrix3::from_diagonal(&sigmas.component_mul(&sigmas));
    let config = Config::default();
    let mut graph = drive.graph.clone();
    let (mut loops, mut off, mut weighed) = (Loops::default(), Pose2::default(), Vec::new());
    for t in 0..drive.truth.len() as Vertex {
        if t % EPOCH == 0 {
            let draws = Vector3::from_fn(|k, _| normal(config.seed, t.into(), drift_m.to_bits() ^ k as u64));
            off = Pose2::exp(&sigmas.component_mul(&draws));
            loops = Loops::default();
        }
        let truth = |i: Vertex| drive.truth[i as usize].between(&drive.truth[t as usize]);
        let pose = |i: Vertex| {
            let true_pose = drive.truth[i as usize];
            if i == t { true_pose.compose(&off) } else { true_pose }
        };
        let predicted = |i: Vertex| Relative { i, i_from_a: truth(i).compose(&off), covariance };
        let within_m = NEAR_M + 3.0 * drift_m.min(LOST_SIGMA_M);
        let near = (0..t).filter(|&i| graph.apart(i, t, LOCAL_PATH_M) && !loops.covers(&graph, i, t, pose));
        let near: Vec<Proposal> = near
            .map(predicted)
            .filter(|r| r.i_from_a.x_m.hypot(r.i_from_a.y_m) < within_m)
            .map(|r| Proposal {
                i: r.i,
                kind: EdgeKind::Distance,
                probability: distance_probability(&r, config.gamma_per_m2),
            })
            .collect();
        let proposals = draw(config.seed, &graph, t, 1, near);
        let fits = loops.measure(&mut graph, t, &proposals).fits;
        let is_true = |f: &Fit| {
            let off = truth(f.i).between(&f.mode.i_from_j);
            off.x_m.hypot(off.y_m) < TRUE_M && off.yaw_rad.abs() < TRUE_RAD
        };
        weighed.extend(fits.iter().filter_map(|f| {
            let predicted = predicted(f.i);
            let edge = Edge::of(f, t, QuestionId::default(), log_looks(f, fits.len()));
            let turned_rad = edge.i_from_j.yaw_rad - predicted.i_from_a.yaw_rad;
            let sigma_rad = (predicted.covariance[(2, 2)] + edge.covariance[(2, 2)]).sqrt();
            let log_density_ratio =
                (log_density(&predicted, &edge)?.0 - log_chance(turned_rad, sigma_rad)).clamp(-60.0, 60.0);
            Some(Weighed {
                building,
                is_true: is_true(f),
                looks: looks(f, fits.len()),
                log_density_ratio,
                posterior: 1.0 / (1.0 + (-log_density_ratio - edge.log_looks).exp()),
                counts: 1.0,
            })
        }));
    }
    weighed
}

/// Irwin and Hall's sum of uniform draws.
fn normal(seed: u64, a: u64, b: u64) -> f64 {
    (0..12).map(|k| uniform(seed, a << 32 | k, b, Purpose::Inject)).sum::<f64>() - 6.0
}
