//! Two places' scans to modes: the measurement z behind every loop edge.

use super::agree::agreement;
use super::align::align;
use super::cloud::Index;
use super::correlate::{self, Pyramid};
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
    pyramid: Option<Pyramid>,
}

impl Target {
    /// For registration from a guess.
    pub fn near(content: &Content) -> Self {
        Self { index: Index::new(&content.cloud, GATE_M), pyramid: None }
    }

    /// For the prior-free search too.
    pub fn wide(content: &Content) -> Self {
        Self { pyramid: Some(Pyramid::new(&content.cloud)), ..Self::near(content) }
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
    let Some(pyramid) = &target.pyramid else { return Vec::new() };
    let points = spread(&j.cloud, SEARCH_POINTS);
    let mut modes: Vec<Mode> = Vec::new();
    for (guess, _) in correlate::search(pyramid, &points, SEARCH_SCORE_MIN, MODES_MAX) {
        let Some(mode) = refine(i, target, j, &guess) else { continue };
        let known = |m: &Mode| {
            let d = m.i_from_j.between(&mode.i_from_j);
            d.x_m.hypot(d.y_m) < 0.3 && d.yaw_rad.abs() < 0.1
        };
        if !modes.iter().any(known) {
            modes.push(mode);
        }
    }
    modes.sort_by(|a, b| (b.score * b.overlap).total_cmp(&(a.score * a.overlap)));
    modes
}
