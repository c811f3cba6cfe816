//! What tells a true fit from one by chance, apart from where it lies: p(looks | e) of eq. (18).
//!
//! Offices repeat: fits by chance are followed over ten places and more, mostly with the right heading and
//! in the right corridor. So agreement counts by its logarithm, and each rival found at the same place
//! counts against a fit.

use crate::filter::loops::{Fit, SUPPORT_MIN};

/// Weights of [`looks`]. Learned by `--example drives -- chance` of the server from simulated drives with
/// people about (`server/ARCHITECTURE.md`).
pub const LOOKS: [f64; 4] = [2.52, -2.75, 1.70, -2.28];
/// Shares of contradicted points by which they are scaled, and below which they are not known to be.
const CONTRADICTED: f64 = 0.1;
const CONTRADICTED_MIN: f64 = 0.005;

/// 1, and the logarithms of the share of contradicted points over [`CONTRADICTED`], of the places that
/// agree over [`SUPPORT_MIN`], and of the number of fits found at the same place.
pub fn looks(fit: &Fit, fits: usize) -> [f64; 4] {
    let contradicted = (1.0 - fit.mode.score).max(CONTRADICTED_MIN);
    let support = f64::from(fit.support) / f64::from(SUPPORT_MIN);
    [1.0, (contradicted / CONTRADICTED).ln(), support.ln(), (fits.max(1) as f64).ln()]
}

/// log p(looks | true) / p(looks | chance) of one of `fits` fits at a place.
pub fn log_looks(fit: &Fit, fits: usize) -> f64 {
    LOOKS.iter().zip(looks(fit, fits)).map(|(weight, look)| weight * look).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::edge::EdgeKind;
    use crate::geometry::Pose2;
    use crate::scan::matching::Mode;
    use nalgebra::Matrix3;

    fn fit(score: f64, support: u32) -> Fit {
        let (i_from_j, covariance) = (Pose2::default(), Matrix3::identity());
        let mode = Mode { i_from_j, covariance, score, overlap: 0.6 };
        Fit::supported_by(0, mode, EdgeKind::Distance, support)
    }

    #[test]
    fn support_speaks_for_a_fit_and_contradiction_and_rivals_against_it() {
        let usual = log_looks(&fit(0.9, 3), 1);
        assert!((usual - LOOKS[0]).abs() < 1e-12);
        assert!(log_looks(&fit(0.9, 6), 1) > usual);
        assert!(log_looks(&fit(0.8, 3), 1) < usual);
        assert!(log_looks(&fit(0.9, 3), 2) < usual);
    }

    #[test]
    fn a_fit_that_nothing_contradicts_is_not_beyond_doubt() {
        assert!((log_looks(&fit(1.0, 3), 1) - log_looks(&fit(0.995, 3), 1)).abs() < 1e-9);
        assert!(log_looks(&fit(1.0, 3), 0).is_finite());
    }
}
