//! Two places' scans to modes: the measurement z behind every loop edge.

use super::agree::{agreement, quick};
use super::align::align;
use super::cloud::Index;
use super::correlate;
use super::place::{Content, spread};
use crate::geometry::Pose2;
use nalgebra::{Matrix3, Vector3};
use serde::{Deserialize, Serialize};

/// Modes kept of a pair.
const MODES_MAX: usize = 4;
/// Look-up score below which the search does not descend.
const SEARCH_SCORE_MIN: f64 = 0.4;
/// Points of the source that the search looks up.
const SEARCH_POINTS: usize = 160;
const GATE_M: f32 = 0.5;
/// What registration of two places may be wrong by beyond its own information.
const SIGMA_M: f64 = 0.02;
const SIGMA_RAD: f64 = 0.004;

/// One way in which two places' scans fit.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Mode {
    /// The newer place in the older one's frame.
    pub i_from_j: Pose2,
    /// Covariance of it, right perturbation.
    pub covariance: Matrix3<f64>,
    /// Share of what both could see that agrees, [0, 1].
    pub score: f64,
    /// Share of all points that both saw, [0, 1].
    pub overlap: f64,
}

/// A place made ready as a target.
pub struct Target {
    index: Index,
    pyramid: Option<correlate::Target>,
}

impl Target {
    /// For registration from a guess.
    pub fn near(content: &Content) -> Self {
        Self { index: Index::new(&content.cloud, GATE_M), pyramid: None }
    }

    /// For the prior-free search too.
    pub fn wide(content: &Content) -> Self {
        Self { pyramid: Some(correlate::Target::new(&content.cloud, &content.sample)), ..Self::near(content) }
    }
}

/// The mode at a guess, if registration finds one.
pub fn refine(i: &Content, target: &Target, j: &Content, guess: &Pose2) -> Option<Mode> {
    let coarse = align(&j.sample, &target.index, guess, None, GATE_M)?;
    let found = align(&j.cloud, &target.index, &coarse.target_from_source, None, GATE_M / 2.0)?;
    let floor = Matrix3::from_diagonal(&Vector3::new(SIGMA_M.powi(2), SIGMA_M.powi(2), SIGMA_RAD.powi(2)));
    // Along a bare corridor the information is all but singular: a metre's uncertainty or more.
    let weak = Matrix3::from_diagonal(&Vector3::new(0.04, 0.04, 1.0));
    let per_sample = j.sample.len() as f64 / j.cloud.len().max(1) as f64;
    let covariance = (found.information * per_sample + weak).try_inverse()? + floor;
    let agreement = agreement(i, j, &found.target_from_source);
    Some(Mode {
        i_from_j: found.target_from_source,
        covariance: (covariance + covariance.transpose()) * 0.5,
        score: agreement.score(),
        overlap: agreement.overlap(),
    })
}

/// All modes of a pair, best first, found without any prior.
pub fn modes(i: &Content, target: &Target, j: &Content) -> Vec<Mode> {
    let e = |k: &str, d: f64| std::env::var(k).map_or(d, |v| v.parse().unwrap());
    let Some(pyramid) = &target.pyramid else { return Vec::new() };
    let points = correlate::Source::new(&spread(&j.sample, SEARCH_POINTS));
    let few: Vec<_> = j.sample.iter().step_by(j.sample.len().div_ceil(75).max(1)).copied().collect();
    let mut guesses: Vec<(f64, Pose2)> = Vec::new();
    let found = correlate::search(pyramid, &points, e("SMIN", 0.2), e("K", 24.0) as usize);
    let mut stats = [found.len(), 0, 0, 0];
    for (guess, _) in &found {
        let q = quick(i, j, guess, 60, 4, 0.4, 0.03);
        if q.score() < e("Q1", 0.83) || q.overlap() < e("O1", 0.18) {
            continue;
        }
        stats[1] += 1;
        let Some(a) = align(&few, &target.index, guess, None, GATE_M) else { continue };
        let q = quick(i, j, &a.target_from_source, 60, 4, 0.25, 0.02);
        if q.score() < e("Q2", 0.7) || q.overlap() < e("O2", 0.2) {
            continue;
        }
        guesses.push((q.score() * q.overlap(), a.target_from_source));
    }
    stats[2] = guesses.len();
    guesses.sort_by(|a, b| b.0.total_cmp(&a.0));
    let mut modes: Vec<Mode> = Vec::new();
    for (_, guess) in guesses {
        let near = |m: &Mode| {
            let d = m.i_from_j.between(&guess);
            d.x_m.hypot(d.y_m) < 0.3 && d.yaw_rad.abs() < 0.1
        };
        if modes.iter().any(near) {
            continue;
        }
        stats[3] += 1;
        let Some(mode) = refine(i, target, j, &guess) else { continue };
        let known = |m: &Mode| {
            let d = m.i_from_j.between(&mode.i_from_j);
            d.x_m.hypot(d.y_m) < 0.3 && d.yaw_rad.abs() < 0.1
        };
        if !modes.iter().any(known) {
            modes.push(mode);
            if modes.len() == MODES_MAX {
                break;
            }
        }
    }
    if e("STATS", 0.0) > 0.0 { eprintln!("STATS {stats:?}"); }
    modes.sort_by(|a, b| (b.score * b.overlap).total_cmp(&(a.score * a.overlap)));
    modes
}
