//! Steps 1 and 4 for one particle: take or refuse a measured edge, and weigh, eqs. (17–18).
//!
//! For each fit z between the new place and an older one the particle either has the edge or not,
//!
//! ```text
//! w_t = w_{t-1} · Σ_{e ∈ {0,1}} p(e) p(z | e)                                   (17)
//! p(z | e = 1) = ∫ p(z | x) p(x) dx = N(z; h(x⁻), H Σ⁻ Hᵀ + R) · fit(score)      (18)
//! p(z | e = 0) = density of such a fit by chance
//! ```
//!
//! and e is drawn from its posterior (the local optimum: the proposal cancels, and z is counted
//! once). The poses x⁻ are those before z.

use crate::effects::EdgeKind;
use crate::graph::Vertex;
use crate::loops::Fit;
use crate::particle::{Edge, Particle};
use crate::propose::{LOST_SIGMA_M, RELOCALISATION_P, distance_probability};
use crate::random::{Purpose, uniform};
use crate::scan::correlate::WINDOW_M;
use crate::smoothing::{Factor, Relative};
use nalgebra::Matrix3;
use std::f64::consts::{LN_10, TAU};
use std::sync::Arc;

/// Share of matched pairs of unrelated places that fit by chance with one place's support.
const CHANCE_PER_PAIR: f64 = 0.05;
/// Each further place that agrees makes chance less likely by this factor …
const CHANCE_PER_SUPPORT: f64 = 0.3;
/// … until look-alike corridors set a floor.
const SUPPORT_COUNTED_MAX: i32 = 6;
/// Scores of true fits lie above those of chance ones: the log-ratio per unit of score.
const LOG_RATIO_PER_SCORE: f64 = 8.0;
const SCORE_EVEN: f64 = 0.85;
/// Posterior probabilities beyond this are certainty.
const CERTAIN: f64 = 1e-4;
/// Places' content overlaps along the path: an edge per place uses each scan some three times.
const SHARED_SCANS: f64 = 3.0;
/// Cap on what one fit may say for or against a particle.
const LOG_WEIGHT_STEP_MAX: f64 = 4.0 * LN_10;
/// Places for which the refusal of a fresh semantic edge is kept as an alternative.
const SIBLING_KEPT: Vertex = 5;

/// What a particle thinks of a fit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Judgement {
    /// log Σ_e p(e) p(z|e).
    pub log_evidence: f64,
    /// p(e = 1 | z).
    pub posterior: f64,
    /// Mahalanobis distance² of z from the prediction.
    pub distance2: f64,
}

/// Eq. (18) for both e, and the posterior of e.
pub fn judge(particle: &Particle, fit: &Fit, t: Vertex, gamma_per_m2: f64) -> Option<Judgement> {
    let predicted = particle.smoother.relative(t, &[fit.i]).ok()?.into_iter().next()?;
    let prior = edge_prior(particle, fit, t, &predicted, gamma_per_m2);
    let innovation = predicted.covariance + fit.mode.covariance;
    let off = predicted.i_from_a.between(&fit.mode.i_from_j).log();
    let distance2 = (off.transpose() * innovation.try_inverse()? * off).x;
    let log_density = -0.5 * (distance2 + (innovation * TAU).determinant().ln());
    let log_fit = LOG_RATIO_PER_SCORE * (fit.mode.score - SCORE_EVEN);
    let log_taken = prior.ln() + log_density + log_fit.min(1.0);
    let log_refused = (1.0 - prior).ln() + chance_log_density(fit);
    let (hi, lo) = if log_taken > log_refused { (log_taken, log_refused) } else { (log_refused, log_taken) };
    let log_evidence = hi + (lo - hi).exp().ln_1p();
    Some(Judgement { log_evidence, posterior: (log_taken - log_evidence).exp(), distance2 })
}

/// p(e = 1) before the scans: eq. (7) of this particle, or the names', whichever says more.
fn edge_prior(particle: &Particle, fit: &Fit, t: Vertex, predicted: &Relative, gamma_per_m2: f64) -> f64 {
    let by_distance = distance_probability(predicted, gamma_per_m2);
    let by_name = match fit.kind {
        EdgeKind::Semantic => particle.labels.similarity(fit.i, t).max(0.1),
        _ => 0.0,
    };
    let sigma_m = predicted.covariance[(0, 0)].max(predicted.covariance[(1, 1)]).sqrt();
    let lost = if sigma_m > LOST_SIGMA_M { RELOCALISATION_P } else { 0.0 };
    by_distance.max(by_name).max(lost).clamp(1e-3, 0.9)
}

/// Fits by chance lie anywhere in the search's window.
fn chance_log_density(fit: &Fit) -> f64 {
    let window = (2.0 * WINDOW_M).powi(2) * TAU;
    let further = (fit.support as i32 - 1).min(SUPPORT_COUNTED_MAX);
    (CHANCE_PER_PAIR * CHANCE_PER_SUPPORT.powi(further) / window).ln()
}

/// What became of a particle and a fit.
pub struct Choice {
    /// The particle with the edge, if any of its copies took it.
    pub taken: Option<Particle>,
    /// The particle without, if any refused.
    pub refused: Option<Particle>,
    /// Why.
    pub judgement: Judgement,
}

/// Draws e for each of the particle's copies and weighs both outcomes. `relief` is the largest
/// log-evidence any particle has for this fit: none may lose more than the cap against it.
pub fn choose(
    mut particle: Particle,
    fit: &Fit,
    judgement: Judgement,
    relief: f64,
    t: Vertex,
    draw: (u64, u64),
) -> Choice {
    particle.log_weight += judgement.log_evidence.max(relief - LOG_WEIGHT_STEP_MAX);
    let p = judgement.posterior;
    let mut taking = if p > 1.0 - CERTAIN {
        particle.count
    } else if p < CERTAIN {
        0
    } else {
        // Stochastic rounding of count · p, by a draw of this particle's own.
        let u = uniform(draw.0, (u64::from(t) << 32) | u64::from(fit.i), draw.1, Purpose::Edge);
        (f64::from(particle.count) * p + u).floor().min(f64::from(particle.count)) as u32
    };
    // A fresh semantic edge is the boldest guess: its refusal stays for a while.
    let sibling =
        fit.kind == EdgeKind::Semantic && taking == particle.count && taking > 1 && p < 1.0 - CERTAIN;
    if sibling {
        taking -= 1;
    }
    let refusing = particle.count - taking;
    // Where both outcomes stay, each has its exact share; where one was drawn, all of it.
    let both = taking > 0 && refusing > 0;
    let part = |count: u32, share: f64| {
        (count > 0).then(|| {
            let mut q = particle.clone();
            q.count = count;
            q.log_weight += if both { share.ln() } else { 0.0 };
            q
        })
    };
    let mut taken = part(taking, p);
    let mut refused = part(refusing, 1.0 - p);
    if let Some(r) = refused.as_mut().filter(|_| sibling) {
        r.kept_until = t + SIBLING_KEPT;
    }
    if let Some(q) = taken.as_mut()
        && !add_edge(q, fit, t)
    {
        // The smoother refused the factor: the particle goes on without.
        taken = None;
        refused = part(particle.count, 1.0);
    }
    Choice { taken, refused, judgement }
}

/// Adds the edge and updates the poses, eq. (10).
fn add_edge(particle: &mut Particle, fit: &Fit, t: Vertex) -> bool {
    let covariance = fit.mode.covariance * SHARED_SCANS;
    let information = covariance.try_inverse().unwrap_or_else(Matrix3::zeros);
    let factor = Factor {
        i: fit.i,
        j: t,
        i_from_j: fit.mode.i_from_j,
        information: (information + information.transpose()) * 0.5,
    };
    let mut smoother = particle.smoother.clone();
    if smoother.add_factor(factor).and_then(|_| smoother.update()).is_err() {
        return false;
    }
    particle.smoother = smoother;
    Arc::make_mut(&mut particle.edges).push(Edge {
        i: fit.i,
        j: t,
        kind: fit.kind,
        i_from_j: fit.mode.i_from_j,
        covariance,
    });
    true
}
