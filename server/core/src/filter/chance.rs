//! What tells a true fit from one by chance, apart from where it lies: p(looks | answer) of eq. (18), and how
//! dense such fits are.
//!
//! Offices repeat: fits by chance are followed over ten places and more, with walls parallel to walls, and
//! whole wings are built twice. So agreement counts by its logarithm, each rival found at the same place counts
//! against a fit, and true copies put a bound on what looks alone can say:
//!
//! ```text
//! λ_c(z) = (ν + 1/r) / V · (Σ_m π_m N(θ_z; θ⁻ + mπ/2, σ_θ²) + π/2π)   fits by chance and copies, per m², rad
//! r      = f₁ / f_c: logistic, of how many agree, over how long, how well
//! ```
//!
//! The heading is the robot's own: what is built twice is built parallel, so that a heading which was
//! predicted speaks for a copy next door as well.

use crate::filter::loops::{Fit, SUPPORT_MIN};
use crate::geometry::wrap;
use std::f64::consts::{FRAC_PI_2, TAU};

/// Weights of [`looks`]. Learned by `--example drives -- chance` of the server from simulated drives with
/// people about (`server/ARCHITECTURE.md`).
pub const LOOKS: [f64; 4] = [1.92, -1.88, 1.17, -1.74];
/// V: the area in which a pair is searched, m².
const SEARCHED_M2: f64 = 400.0;
/// ν: copies of a stretch, as far as scans can tell, in such an area, by which tours without words are about likeliest
/// (`server/ARCHITECTURE.md`, Numbers) …
const COPIES: f64 = 6.0;
/// … and π_m: their headings, by quarter turns, and any.
const TURNED: [f64; 4] = [0.65, 0.1, 0.1, 0.1];
const ASKEW: f64 = 0.05;
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

/// −log (ν + 1/r) of one of `fits` fits at a place.
pub fn log_looks(fit: &Fit, fits: usize) -> f64 {
    let log_ratio: f64 = LOOKS.iter().zip(looks(fit, fits)).map(|(weight, look)| weight * look).sum();
    -(COPIES + (-log_ratio).exp()).ln()
}

/// log (Σ_m π_m N(θ_z; θ⁻ + mπ/2, σ_θ²) + π/2π) / V, in m⁻² rad⁻¹, of a fit turned by `off_rad` from the prediction,
/// whose spread is σ_θ.
pub fn log_chance(off_rad: f64, sigma_rad: f64) -> f64 {
    let sigma_rad = sigma_rad.max(1e-6);
    let of = |(turns, share): (usize, &f64)| {
        let off = wrap(off_rad - turns as f64 * FRAC_PI_2) / sigma_rad;
        share.ln() - 0.5 * (off * off + TAU.ln()) - sigma_rad.ln()
    };
    TURNED.iter().enumerate().map(of).fold((ASKEW / TAU).ln(), log_add) - SEARCHED_M2.ln()
}

/// ln (eᵃ + eᵇ).
pub(crate) fn log_add(a: f64, b: f64) -> f64 {
    let (hi, lo) = if a > b { (a, b) } else { (b, a) };
    if hi == f64::NEG_INFINITY { hi } else { hi + (lo - hi).exp().ln_1p() }
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
        assert!(log_looks(&fit(0.9, 6), 1) > usual);
        assert!(log_looks(&fit(0.8, 3), 1) < usual);
        assert!(log_looks(&fit(0.9, 3), 2) < usual);
    }

    #[test]
    fn however_much_agrees_a_look_alike_may_agree_as_much() {
        let best = log_looks(&fit(1.0, 1000), 1);
        assert!(best < -COPIES.ln() && best > -(1.1 * COPIES).ln());
        assert!((best - log_looks(&fit(0.995, 1000), 0)).abs() < 1e-9, "nor is it beyond doubt");
    }

    #[test]
    fn a_heading_that_was_predicted_is_no_evidence_and_one_askew_is() {
        let ratio = |off: f64, sigma: f64| {
            -0.5 * ((off / sigma).powi(2) + TAU.ln()) - sigma.ln() - log_chance(off, sigma)
        };
        assert!((ratio(0.0, 0.01) - ratio(0.0, 0.2)).abs() < 0.01);
        assert!(log_chance(0.8, 0.001) > log_chance(0.0, 3.0) - 4.0, "fits lie at any angle, too");
        assert!(ratio(FRAC_PI_2, 0.1) < -50.0, "a quarter turn is a copy's");
        let askew = log_chance(0.8, 3.0);
        assert!((askew - log_chance(0.0, 3.0)).abs() < 0.1, "of a heading unknown nothing is");
    }
}
