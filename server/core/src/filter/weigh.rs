//! Steps 1 and 4 for one particle: what it thinks of a measured edge, eqs. (17–18).
//!
//! For each fit z between the new place and an older one the particle either has the edge or not,
//!
//! ```text
//! w_t = w_{t-1} · Σ_{e ∈ {0,1}} p(e) p(z | e)                                   (17)
//! p(z | e = 1) = ∫ p(z | x) p(x) dx = N(z; h(x⁻), H Σ⁻ Hᵀ + R) · p(looks | e = 1)      (18)
//! p(z | e = 0) = density of fits by chance · p(looks | e = 0)
//! ```
//!
//! The ratio of the looks ([`crate::filter::chance`]) and the power of the densities are learned in simulation,
//! so that p(e = 1 | z) is calibrated there. e is drawn from its posterior (the local optimum: the
//! proposal cancels, and z is counted once), once for all fits of a revisit ([`crate::filter::decide`]). The
//! poses x⁻ are those before z.

use crate::edge::{EdgeKind, Vertex};
use crate::filter::loops::{AGREE_M, AGREE_RAD, Fit, agree};
use crate::filter::particle::Particle;
use crate::filter::propose::{LOST_SIGMA_M, RELOCALISATION_P, distance_probability};
use crate::filter::revisit::Testimony;
use crate::scan::correlate::WINDOW_M;
use crate::smoothing::{Relative, Structure};
use std::f64::consts::TAU;

/// Power of the densities. What is found by chance is not spread evenly, but mostly has the heading of what
/// is true and lies in the same corridor: of three degrees of freedom one is left to tell them apart.
/// Learned from the same drives as [`crate::filter::chance::LOOKS`] it is somewhat less.
pub const DENSITY_POWER: f64 = 1.0 / 3.0;

/// What a particle thinks of a fit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Judgement {
    /// log Σ_e p(e) p(z|e).
    pub log_evidence: f64,
    /// p(e = 1 | z).
    pub posterior: f64,
    /// Mahalanobis distance² of z from the prediction.
    pub distance2: f64,
    /// Whether the particle ties the two places already, and where z has them: with the edge and without
    /// its map is the same.
    pub known: bool,
}

/// What a particle thinks of a fit. Who has decided on its revisit weighs what was learned of it since.
pub fn judge(
    structure: &Structure,
    particle: &Particle,
    fit: &Fit,
    t: Vertex,
    testimony: &Testimony,
    gamma_per_m2: f64,
) -> Option<Judgement> {
    let judgement = judge_alone(structure, particle, fit, t, testimony.log_looks, gamma_per_m2)?;
    let (log_evidence, posterior) = if particle.holds(testimony.revisit) && judgement.known {
        (testimony.gained, judgement.posterior)
    } else if particle.refused.contains(&testimony.revisit) {
        (0.0, 0.0)
    } else {
        (judgement.log_evidence, judgement.posterior)
    };
    Some(Judgement { log_evidence, posterior, ..judgement })
}

/// Eq. (18) for both e, and the posterior of e, as if no other fit of the revisit had been seen.
pub fn judge_alone(
    structure: &Structure,
    particle: &Particle,
    fit: &Fit,
    t: Vertex,
    log_looks: f64,
    gamma_per_m2: f64,
) -> Option<Judgement> {
    let predicted = particle.belief.relative(structure, t, &[fit.i]).ok()?.into_iter().next()?;
    let prior = edge_prior(particle, fit, t, &predicted, gamma_per_m2);
    weigh(prior, &predicted, fit, log_looks)
}

/// The same for a prior p(e = 1), a predicted relative pose and log p(looks | e = 1) / p(looks | e = 0).
/// p(z | e = 0), which all particles share, is left out of both.
pub fn weigh(prior: f64, predicted: &Relative, fit: &Fit, log_looks: f64) -> Option<Judgement> {
    let (log_ratio, distance2) = log_density_ratio(predicted, fit)?;
    let log_taken = prior.ln() + DENSITY_POWER * log_ratio + log_looks;
    let log_refused = (1.0 - prior).ln();
    let (hi, lo) = if log_taken > log_refused { (log_taken, log_refused) } else { (log_refused, log_taken) };
    let log_evidence = hi + (lo - hi).exp().ln_1p();
    let posterior = (log_taken - log_evidence).exp();
    let known = is_known(predicted, fit);
    (log_evidence.is_finite() && posterior.is_finite()).then_some(Judgement {
        log_evidence,
        posterior,
        distance2,
        known,
    })
}

/// Log of how much denser the prediction is at z than fits by chance, which lie anywhere in the search's
/// window; and z's Mahalanobis distance² from the prediction.
pub fn log_density_ratio(predicted: &Relative, fit: &Fit) -> Option<(f64, f64)> {
    let window = (2.0 * WINDOW_M).powi(2) * TAU;
    let innovation = predicted.covariance + fit.mode.covariance;
    let off = predicted.i_from_a.between(&fit.mode.i_from_j).log();
    let distance2 = (off.transpose() * innovation.try_inverse()? * off).x;
    Some((window.ln() - 0.5 * (distance2 + (innovation * TAU).determinant().ln()), distance2))
}

/// Whether the prediction is as good as a fit, and they agree.
fn is_known(predicted: &Relative, fit: &Fit) -> bool {
    agree(&predicted.i_from_a, &fit.mode.i_from_j, 1.0)
        && predicted.sigma_m() < AGREE_M
        && predicted.sigma_rad() < AGREE_RAD
}

/// p(e = 1) before the scans: eq. (7) of this particle, or the names', whichever says more.
fn edge_prior(particle: &Particle, fit: &Fit, t: Vertex, predicted: &Relative, gamma_per_m2: f64) -> f64 {
    let by_distance = distance_probability(predicted, gamma_per_m2);
    let by_name = match fit.kind {
        EdgeKind::Semantic => particle.labels.similarity(fit.i, t).max(0.1),
        _ => 0.0,
    };
    let lost = if predicted.sigma_m() > LOST_SIGMA_M { RELOCALISATION_P } else { 0.0 };
    by_distance.max(by_name).max(lost).clamp(1e-3, 0.9)
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use crate::filter::chance::log_looks;
    use crate::geometry::Pose2;
    use crate::scan::matching::Mode;
    use nalgebra::{Matrix3, Vector3};
    use std::sync::Arc;

    /// A chain of n places 1 m apart, straight on, that has drifted by `sigma_m` per place.
    pub(crate) fn chain(n: u32, sigma_m: f64) -> (Structure, Particle) {
        let (mut structure, mut p) = (Structure::new(), Particle::empty(10));
        let covariance = Matrix3::from_diagonal(&Vector3::new(sigma_m.powi(2), sigma_m.powi(2), 1e-6));
        let information = covariance.try_inverse().unwrap();
        for _ in 0..n {
            structure.add_pose(Pose2::new(1.0, 0.0, 0.0), &information).unwrap();
        }
        structure.arrange();
        p.update(&structure).unwrap();
        (structure, p)
    }

    pub(crate) fn fit(x_m: f64, score: f64, support: u32) -> Fit {
        let covariance = Matrix3::from_diagonal(&Vector3::new(4e-4, 4e-4, 1.6e-5));
        let mode = Mode { i_from_j: Pose2::new(x_m, 0.0, 0.0), covariance, score, overlap: 0.6 };
        Fit::supported_by(0, mode, EdgeKind::Distance, support)
    }

    /// What a particle thinks of one of `fits` fits of the last of 21 places.
    fn alone(structure: &Structure, p: &Particle, fit: &Fit, fits: usize) -> Judgement {
        judge_alone(structure, p, fit, 20, log_looks(fit, fits), 0.2).unwrap()
    }

    #[test]
    fn a_fit_where_it_is_expected_is_taken_and_a_far_one_refused() {
        let (structure, p) = chain(21, 0.1);
        let near = alone(&structure, &p, &fit(20.3, 0.95, 4), 1);
        assert!(near.posterior > 0.95, "{near:?}");
        let far = alone(&structure, &p, &fit(14.0, 0.95, 4), 1);
        assert!(far.posterior < 1e-6 && far.distance2 > 100.0, "{far:?}");
    }

    #[test]
    fn evidence_is_the_sum_over_both_outcomes_written_out() {
        let (sigma_m, x_m) = (0.1, 20.4);
        let (structure, p) = chain(21, sigma_m);
        let f = fit(x_m, 0.9, 3);
        let j = alone(&structure, &p, &f, 1);
        // Twenty steps along x from place 0, of which each turns by 1 mrad: what is left of the chain's
        // lateral spread and of its heading by hand, then S, N(z; h, S) and both outcomes.
        let steps = 20.0;
        let along = steps * sigma_m * sigma_m + 4e-4;
        let lever: f64 = (0..20).map(|k| f64::from(k).powi(2)).sum();
        let (across, turn) = (steps * sigma_m * sigma_m + lever * 1e-6 + 4e-4, steps * 1e-6 + 1.6e-5);
        let cross: f64 = (0..20).map(f64::from).sum::<f64>() * 1e-6;
        let determinant = along * (across * turn - cross * cross);
        let off = x_m - steps;
        let log_n = -0.5 * (off * off / along + (TAU.powi(3) * determinant).ln());
        let looks = log_looks(&f, 1);
        let d_m = |s: f64| steps + s * along.sqrt();
        let kernel = |s: f64| (-0.5 * s * s).exp();
        let (mut sum, mut mass) = (0.0, 0.0);
        for k in -3000..=3000 {
            let s = f64::from(k) * 1e-3;
            sum += kernel(s) / (1.0 + 0.2 * d_m(s).powi(2));
            mass += kernel(s);
        }
        let prior = sum / mass;
        let window = (2.0 * WINDOW_M).powi(2) * TAU;
        let taken = prior * ((log_n + window.ln()) * DENSITY_POWER + looks).exp();
        let expected = (taken + 1.0 - prior).ln();
        assert!((j.log_evidence - expected).abs() < 0.02, "{} {expected}", j.log_evidence);
        assert!((j.posterior - taken / (taken + 1.0 - prior)).abs() < 0.02);
    }

    #[test]
    fn more_support_and_a_better_score_persuade_more() {
        let (structure, p) = chain(21, 2.0);
        let posterior = |score, support| alone(&structure, &p, &fit(26.0, score, support), 1).posterior;
        assert!(posterior(0.9, 6) > posterior(0.9, 3));
        assert!(posterior(0.95, 3) > posterior(0.8, 3));
    }

    #[test]
    fn where_much_fits_a_single_fit_persuades_less() {
        let (structure, p) = chain(21, 2.0);
        let posterior = |fits| alone(&structure, &p, &fit(26.0, 0.9, 3), fits).posterior;
        assert!(posterior(1) > posterior(2) && posterior(2) > posterior(6));
    }

    #[test]
    fn densities_are_tempered() {
        let (structure, p) = chain(21, 0.3);
        let log_odds = |j: &Judgement| (j.posterior / (1.0 - j.posterior)).ln();
        let (near, far) =
            (alone(&structure, &p, &fit(20.0, 0.9, 3), 1), alone(&structure, &p, &fit(23.0, 0.9, 3), 1));
        let priors = |x_m: f64| {
            let predicted = p.belief.relative(&structure, 20, &[0]).unwrap().remove(0);
            let prior = edge_prior(&p, &fit(x_m, 0.9, 3), 20, &predicted, 0.2);
            (prior / (1.0 - prior)).ln()
        };
        let expected = 0.5 * DENSITY_POWER * (far.distance2 - near.distance2) + priors(20.0) - priors(23.0);
        assert!((log_odds(&near) - log_odds(&far) - expected).abs() < 1e-6);
    }

    #[test]
    fn who_has_decided_weighs_what_was_learned_since() {
        // Tied so well that the fit is known: nothing is left to decide on.
        let (structure, p) = chain(21, 0.01);
        let f = fit(20.0, 0.9, 6);
        let testimony = Testimony { revisit: 7, log_looks: 3.0, gained: 0.5 };
        let thinks = |p: &Particle| judge(&structure, p, &f, 20, &testimony, 0.2).unwrap();
        let (asked, held) = (thinks(&p), Particle { taken: Arc::new(vec![3, 7]), ..p.clone() });
        let refused = Particle { refused: vec![7], ..p.clone() };
        assert!(asked.known && asked.log_evidence > 1.0);
        assert_eq!((thinks(&held).log_evidence, thinks(&held).posterior), (0.5, asked.posterior));
        assert_eq!((thinks(&refused).log_evidence, thinks(&refused).posterior), (0.0, 0.0));
        let other = Particle { taken: Arc::new(vec![6]), refused: vec![8], ..p.clone() };
        assert_eq!(thinks(&other), asked);
    }

    #[test]
    fn a_fit_is_known_where_it_is_expected_and_only_there() {
        let (structure, p) = chain(21, 0.01);
        let known = |x_m| alone(&structure, &p, &fit(x_m, 0.9, 3), 1).known;
        assert!(known(20.1) && !known(20.5));
        let (structure, p) = chain(21, 0.3);
        assert!(!alone(&structure, &p, &fit(20.0, 0.9, 3), 1).known, "expected by luck");
    }
}
