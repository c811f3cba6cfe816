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
use crate::smoothing::{Factor, Relative, Structure};
use std::f64::consts::{LN_10, TAU};

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
/// Places' content overlaps along the path: an edge per place uses each scan some three times, so
/// its information and what it says for or against a particle are a third.
const SHARED_SCANS: f64 = 3.0;
/// Cap on what one fit may say for or against a particle.
const LOG_WEIGHT_STEP_MAX: f64 = 4.0 * LN_10;
/// A loop raises `Σ eᵀ Ω e` by its distance² at most, and none is drawn beyond some hundred: where it
/// rises by more, Gauss-Newton has lost its way.
const CHI2_RISE_MAX: f64 = 1000.0;
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
pub fn judge(
    structure: &Structure,
    particle: &Particle,
    fit: &Fit,
    t: Vertex,
    gamma_per_m2: f64,
) -> Option<Judgement> {
    let predicted = particle.belief.relative(structure, t, &[fit.i]).ok()?.into_iter().next()?;
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
    let posterior = (log_taken - log_evidence).exp();
    (log_evidence.is_finite() && posterior.is_finite()).then_some(Judgement {
        log_evidence,
        posterior,
        distance2,
    })
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

/// What becomes of a particle and a fit.
pub struct Choice {
    /// The particle with the edge, if any of its copies takes it.
    pub taken: Option<Particle>,
    /// The particle without, if any refuses.
    pub refused: Option<Particle>,
    /// All copies without, should the edge not go with the poses of those who take it.
    undecided: Particle,
}

/// Draws e for each of the particle's copies and weighs both outcomes. `relief` is the largest
/// log-evidence any particle has for this fit: weights are relative to it, and none may lose more
/// than the cap. One without a judgement refuses, and weighs what it did.
pub fn choose(
    mut particle: Particle,
    fit: &Fit,
    judgement: Option<Judgement>,
    relief: f64,
    t: Vertex,
    draw: (u64, u64),
) -> Choice {
    let Some(judgement) = judgement else {
        return Choice { taken: None, refused: Some(particle.clone()), undecided: particle };
    };
    particle.log_weight += ((judgement.log_evidence - relief) / SHARED_SCANS).max(-LOG_WEIGHT_STEP_MAX);
    let p = judgement.posterior;
    let taking = if p > 1.0 - CERTAIN {
        particle.count
    } else if p < CERTAIN {
        0
    } else {
        let u = uniform(draw.0, (u64::from(t) << 32) | u64::from(fit.i), draw.1, Purpose::Edge);
        match particle.count {
            1 => u32::from(u < p),
            // Stochastic rounding of count · p; both outcomes stay, each with its exact share.
            n => ((f64::from(n) * p + u).floor() as u32).clamp(1, n - 1),
        }
    };
    let refusing = particle.count - taking;
    // Where both outcomes stay, each has its exact share; where one was drawn, all of it.
    let both = taking > 0 && refusing > 0;
    // A fresh semantic edge is the boldest guess: its refusal stays for a while.
    let sibling = both && fit.kind == EdgeKind::Semantic && p > 0.5;
    let part = |count: u32, share: f64| {
        (count > 0).then(|| {
            let mut q = particle.clone();
            q.count = count;
            q.log_weight += if both { share.ln() } else { 0.0 };
            q
        })
    };
    let taken = part(taking, p);
    let mut refused = part(refusing, 1.0 - p);
    if let Some(r) = refused.as_mut().filter(|_| sibling) {
        r.kept_until = r.belief.len() as Vertex - 1 + SIBLING_KEPT;
    }
    Choice { taken, refused, undecided: particle }
}

/// Adds the edge of a fit to what all particles share; none of them takes it yet. None if its numbers
/// are no measurement.
pub fn add_edge(structure: &mut Structure, fit: &Fit, t: Vertex) -> Option<Edge> {
    let covariance = fit.mode.covariance * SHARED_SCANS;
    let information = covariance.try_inverse()?;
    let factor = structure
        .add_factor(Factor {
            i: fit.i,
            j: t,
            i_from_j: fit.mode.i_from_j,
            information: (information + information.transpose()) * 0.5,
        })
        .ok()?;
    structure.arrange();
    Some(Edge {
        i: fit.i,
        j: t,
        kind: fit.kind,
        i_from_j: fit.mode.i_from_j,
        covariance,
        named: fit.named,
        factor,
    })
}

impl Choice {
    /// Those who take the edge do so; where it does not go with their poses, all copies refuse.
    pub fn take(&mut self, structure: &Structure, edge: Option<&Edge>) {
        let Some(taken) = self.taken.take() else { return };
        self.taken = edge.and_then(|edge| with_edge(taken, structure, edge));
        if self.taken.is_none() {
            self.refused = Some(self.undecided.clone());
        }
    }
}

fn with_edge(mut particle: Particle, structure: &Structure, edge: &Edge) -> Option<Particle> {
    let before = particle.belief.chi2(structure);
    particle.take(edge.clone());
    particle.update(structure).ok()?;
    (particle.belief.chi2(structure) < before + CHI2_RISE_MAX).then_some(particle)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Pose2;
    use crate::scan::matching::Mode;
    use nalgebra::{Matrix3, Vector3};

    /// A chain of n places 1 m apart, straight on, that has drifted by `sigma_m` per place.
    fn chain(n: u32, sigma_m: f64) -> (Structure, Particle) {
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

    /// What becomes of a chain of 21 and a fit of its two ends.
    fn decided(fit: &Fit, judgement: Judgement, relief: f64) -> Choice {
        let (mut structure, p) = chain(21, 0.1);
        let mut choice = choose(p, fit, Some(judgement), relief, 20, (1, 0));
        let edge = add_edge(&mut structure, fit, 20);
        choice.take(&structure, edge.as_ref());
        choice
    }

    fn fit(x_m: f64, score: f64, support: u32) -> Fit {
        let covariance = Matrix3::from_diagonal(&Vector3::new(4e-4, 4e-4, 1.6e-5));
        let mode = Mode { i_from_j: Pose2::new(x_m, 0.0, 0.0), covariance, score, overlap: 0.6 };
        Fit::supported_by(0, mode, EdgeKind::Distance, support)
    }

    #[test]
    fn a_fit_where_it_is_expected_is_taken_and_a_far_one_refused() {
        let (structure, p) = chain(21, 0.1);
        let near = judge(&structure, &p, &fit(20.3, 0.95, 4), 20, 0.2).unwrap();
        assert!(near.posterior > 0.99, "{near:?}");
        let far = judge(&structure, &p, &fit(14.0, 0.95, 4), 20, 0.2).unwrap();
        assert!(far.posterior < 1e-6 && far.distance2 > 100.0, "{far:?}");
    }

    #[test]
    fn evidence_is_the_marginal_over_both_outcomes() {
        let (structure, p) = chain(21, 0.1);
        let j = judge(&structure, &p, &fit(20.4, 0.9, 3), 20, 0.2).unwrap();
        // p(z) p(e=0|z) = p(e=0) p(z|e=0).
        let refused = j.log_evidence + (1.0 - j.posterior).ln();
        let far = judge(&structure, &p, &fit(-40.0, 0.9, 3), 20, 0.2).unwrap();
        assert!((refused - far.log_evidence).abs() < 1e-6, "{refused} {far:?}");
    }

    #[test]
    fn more_support_and_a_better_score_persuade_more() {
        let (structure, p) = chain(21, 2.0);
        let posterior =
            |score, support| judge(&structure, &p, &fit(26.0, score, support), 20, 0.2).unwrap().posterior;
        assert!(posterior(0.9, 6) > posterior(0.9, 3));
        assert!(posterior(0.95, 3) > posterior(0.8, 3));
    }

    #[test]
    fn both_outcomes_share_the_weight_and_the_copies() {
        let judgement = Judgement { log_evidence: -3.0, posterior: 0.7, distance2: 1.0 };
        let choice = decided(&fit(20.0, 0.9, 3), judgement, -3.0);
        let (taken, refused) = (choice.taken.unwrap(), choice.refused.unwrap());
        assert_eq!(taken.count + refused.count, 10);
        assert!((taken.weight() - 0.7).abs() < 1e-12 && (refused.weight() - 0.3).abs() < 1e-12);
        assert_eq!((taken.edges.len(), refused.edges.len()), (1, 0));
    }

    #[test]
    fn an_unlikely_outcome_keeps_its_exact_share_too() {
        for posterior in [0.01, 0.99] {
            let judgement = Judgement { log_evidence: 0.0, posterior, distance2: 1.0 };
            let choice = decided(&fit(20.0, 0.9, 3), judgement, 0.0);
            let (taken, refused) = (choice.taken.unwrap(), choice.refused.unwrap());
            assert!((taken.weight() - posterior).abs() < 1e-12);
            assert!((refused.weight() - (1.0 - posterior)).abs() < 1e-12);
        }
    }

    #[test]
    fn adding_an_edge_that_was_predicted_gains_a_particle_nothing_over_its_twin() {
        // Two equal particles meet the same fit; what one takes must not weigh more than what the
        // prediction of both already said: their sum is the weight before.
        let (structure, p) = chain(21, 0.1);
        let f = fit(20.0, 0.95, 5);
        let judgement = judge(&structure, &p, &f, 20, 0.2).unwrap();
        let before = p.weight();
        let choice = decided(&f, judgement, judgement.log_evidence);
        let after: f64 = [choice.taken, choice.refused].iter().flatten().map(Particle::weight).sum();
        assert!((after - before).abs() < 1e-12);
    }

    #[test]
    fn no_fit_costs_more_than_the_cap() {
        let judgement = Judgement { log_evidence: -500.0, posterior: 0.0, distance2: 900.0 };
        let choice = decided(&fit(14.0, 0.9, 3), judgement, 5.0);
        assert!((choice.refused.unwrap().log_weight + LOG_WEIGHT_STEP_MAX).abs() < 1e-12);
    }

    #[test]
    fn an_edge_that_does_not_go_with_the_poses_is_refused_by_all_copies() {
        // Taken against all odds: the chain would have to shrink to half its length.
        let judgement = Judgement { log_evidence: 0.0, posterior: 0.7, distance2: 1.0 };
        let mut absurd = fit(20.0, 0.9, 3);
        absurd.mode.i_from_j = Pose2::new(-400.0, 0.0, 3.0);
        let choice = decided(&absurd, judgement, 0.0);
        let refused = choice.refused.unwrap();
        assert!(choice.taken.is_none() && refused.edges.is_empty());
        assert_eq!((refused.count, refused.weight()), (10, 1.0));
    }

    #[test]
    fn the_refusal_of_a_fresh_semantic_edge_is_kept_for_a_while() {
        let judgement = Judgement { log_evidence: 0.0, posterior: 0.999, distance2: 1.0 };
        let mut semantic = fit(20.0, 0.9, 3);
        semantic.kind = EdgeKind::Semantic;
        let choice = decided(&semantic, judgement, 0.0);
        let refused = choice.refused.unwrap();
        assert_eq!((refused.count, refused.kept_until), (1, 25));
    }
}
