//! Two places' scans to modes: the measurement z behind every loop edge.

use crate::geometry::Pose2;
use crate::scan::agree::agreement;
use crate::scan::align::{align, sound_information};
use crate::scan::cloud::{Index, Point};
use crate::scan::correlate::{Raster, Source, search};
use crate::scan::place::Content;
use crate::scan::view::Closeness;
use nalgebra::{Matrix3, Vector3};
use serde::{Deserialize, Serialize};

/// Modes kept of a pair.
const MODES_MAX: usize = 4;
// Shares and scores below are from true and unrelated pairs of six logs together: Intel, CSAIL, Stata with
// two ranges, two simulated offices.

/// Share of the source's points that must hit for a transform to be looked at.
const HIT_SHARE_MIN: f64 = 0.22;
/// Transforms looked at.
const GUESSES_MAX: usize = 24;
/// At a rough look, true fits score more than this, and most others less …
const ROUGH_SCORE_MIN: f64 = 0.83;
const ROUGH_OVERLAP_MIN: f64 = 0.18;
/// … as after a rough registration, with so many points.
const BRIEF_SCORE_MIN: f64 = 0.7;
const BRIEF_OVERLAP_MIN: f64 = 0.2;
const BRIEF_POINTS: usize = 75;
/// Points that a mode is registered with in the end: more make it no truer.
const POLISH_POINTS: usize = 400;
/// Modes worth less than this share of the best are none.
const WORTH_SHARE_MIN: f64 = 0.5;
/// Modes nearer than this are one.
const DISTINCT_M: f64 = 0.3;
const DISTINCT_RAD: f64 = 0.1;
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

/// The mode at a guess, if registration finds one. `index` is that of the older place `i`.
pub fn refine(i: &Content, index: &Index, j: &Content, guess: &Pose2) -> Option<Mode> {
    let coarse = align(&j.sample, index, guess, None, GATE_M)?;
    polish(i, index, j, &coarse.target_from_source)
}

/// For [`refine`].
pub fn index(content: &Content) -> Index {
    Index::new(&content.cloud, GATE_M)
}

/// The mode at a transform that a sample is registered to.
fn polish(i: &Content, index: &Index, j: &Content, coarse: &Pose2) -> Option<Mode> {
    let some = every_nth(&j.cloud, POLISH_POINTS);
    let found = align(&some, index, coarse, None, GATE_M / 2.0)?;
    let floor = Matrix3::from_diagonal(&Vector3::new(SIGMA_M.powi(2), SIGMA_M.powi(2), SIGMA_RAD.powi(2)));
    // Along a bare corridor the information is all but singular: a metre's uncertainty or more.
    let weak = Matrix3::from_diagonal(&Vector3::new(0.04, 0.04, 1.0));
    let per_sample = j.sample.len() as f64 / some.len().max(1) as f64;
    let information = sound_information(&some, index, &found, GATE_M / 8.0);
    let covariance = (information * per_sample + weak).try_inverse()? + floor;
    let agreement = agreement(i, j, &found.target_from_source, &Closeness::CLOSE);
    Some(Mode {
        i_from_j: found.target_from_source,
        covariance: (covariance + covariance.transpose()) * 0.5,
        score: agreement.score(),
        overlap: agreement.overlap(),
    })
}

/// Whether a rough look at a transform, far cheaper than registration, leaves it open that the places
/// fit nearby.
pub fn plausible(i: &Content, j: &Content, guess: &Pose2) -> bool {
    let rough = agreement(i, j, guess, &Closeness::ROUGH);
    rough.score() >= ROUGH_SCORE_MIN && rough.overlap() >= ROUGH_OVERLAP_MIN
}

/// All modes of a pair, best first, found without any prior. `source` is made of `j`.
pub fn modes(i: &Content, j: &Content, source: &Source) -> Vec<Mode> {
    let found = search(&Raster::new(&i.cloud, &i.sample), source, HIT_SHARE_MIN, GUESSES_MAX);
    let guesses: Vec<Pose2> =
        found.into_iter().map(|(guess, _)| guess).filter(|guess| plausible(i, j, guess)).collect();
    if guesses.is_empty() {
        return Vec::new();
    }
    let index = index(i);
    let mut modes: Vec<Mode> = Vec::new();
    for guess in registered(i, &index, j, &guesses) {
        if modes.iter().any(|m| same(&m.i_from_j, &guess)) {
            continue;
        }
        let Some(mode) = polish(i, &index, j, &guess) else { continue };
        if !modes.iter().any(|m| same(&m.i_from_j, &mode.i_from_j)) {
            modes.push(mode);
        }
        if modes.len() == MODES_MAX {
            break;
        }
    }
    modes.sort_by(|a, b| (b.score * b.overlap).total_cmp(&(a.score * a.overlap)));
    modes
}

/// Guesses registered with a few points, without those that the laser contradicts and those worth
/// far less than the best; best first.
fn registered(i: &Content, index: &Index, j: &Content, guesses: &[Pose2]) -> Vec<Pose2> {
    let few = every_nth(&j.sample, BRIEF_POINTS);
    let mut registered: Vec<(f64, Pose2)> = Vec::new();
    for guess in guesses {
        let Some(found) = align(&few, index, guess, None, GATE_M) else { continue };
        let brief = agreement(i, j, &found.target_from_source, &Closeness::BRIEF);
        if brief.score() >= BRIEF_SCORE_MIN && brief.overlap() >= BRIEF_OVERLAP_MIN {
            registered.push((brief.worth(), found.target_from_source));
        }
    }
    registered.sort_by(|a, b| b.0.total_cmp(&a.0));
    let least = registered.first().map_or(0.0, |best| WORTH_SHARE_MIN * best.0);
    registered.into_iter().filter(|r| r.0 >= least).map(|r| r.1).collect()
}

/// At most `n` points, evenly from a list that is in the order of voxels.
fn every_nth(points: &[Point], n: usize) -> Vec<Point> {
    points.iter().step_by(points.len().div_ceil(n).max(1)).copied().collect()
}

fn same(a: &Pose2, b: &Pose2) -> bool {
    let off = a.between(b);
    off.x_m.hypot(off.y_m) < DISTINCT_M && off.yaw_rad.abs() < DISTINCT_RAD
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::wrap;
    use crate::scan::tests::{HALL, ROOM, content};
    use std::f64::consts::PI;

    fn found(i: &Content, j: &Content) -> Vec<Mode> {
        modes(i, j, &Source::new(&j.sample))
    }

    #[test]
    fn a_room_is_known_again_from_elsewhere_and_turned_round() {
        let old = Pose2::new(-1.5, -1.0, 0.3);
        for new in [Pose2::new(0.5, 1.0, -2.6), Pose2::new(1.8, 0.2, 1.9), old] {
            let best = found(&content(&ROOM, &old), &content(&ROOM, &new))[0];
            let off = old.between(&new).between(&best.i_from_j);
            assert!(off.x_m.hypot(off.y_m) < 0.05 && off.yaw_rad.abs() < 0.01, "{new:?} {best:?}");
            assert!(best.score > 0.9 && best.overlap > 0.4, "{best:?}");
            assert!(best.covariance[(0, 0)].max(best.covariance[(1, 1)]).sqrt() < 0.1, "{best:?}");
        }
    }

    #[test]
    fn a_bare_corridor_is_free_along_itself() {
        let corridor = [[-40.0, -1.0, 40.0, -1.0], [-40.0, 1.0, 40.0, 1.0]];
        let modes =
            found(&content(&corridor, &Pose2::default()), &content(&corridor, &Pose2::new(2.0, 0.2, 0.0)));
        assert!(!modes.is_empty());
        for m in modes {
            assert!(m.covariance[(0, 0)].max(m.covariance[(1, 1)]).sqrt() > 0.15, "{m:?}");
        }
    }

    #[test]
    fn a_room_that_looks_the_same_turned_round_has_two_modes() {
        let oblong =
            [[-4.0, -3.0, 4.0, -3.0], [4.0, -3.0, 4.0, 3.0], [4.0, 3.0, -4.0, 3.0], [-4.0, 3.0, -4.0, -3.0]];
        let place = content(&oblong, &Pose2::new(0.3, 0.2, 0.1));
        let modes = found(&place, &place);
        assert_eq!(modes.len(), 2, "{modes:?}");
        assert!((wrap(modes[0].i_from_j.yaw_rad - modes[1].i_from_j.yaw_rad).abs() - PI).abs() < 0.02);
    }

    #[test]
    fn what_is_not_alike_does_not_fit() {
        let alike = |m: &Mode| m.score > 0.85 && m.overlap > 0.25;
        let modes = found(&content(&ROOM, &Pose2::default()), &content(&HALL, &Pose2::default()));
        assert!(!modes.iter().any(alike), "{modes:?}");
        let empty = content(&[], &Pose2::default());
        assert!(found(&empty, &content(&ROOM, &Pose2::default())).is_empty());
    }
}
