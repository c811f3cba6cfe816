//! Steps 1 and 4 for one particle: what becomes of it, given what it thinks of a fit; see [`crate::filter::weigh`].

use crate::edge::{EdgeKind, RevisitId, Vertex};
use crate::filter::loops::Fit;
use crate::filter::particle::{Edge, Particle};
use crate::filter::weigh::Judgement;
use crate::random::{Purpose, uniform};
use crate::smoothing::{Factor, Structure};
use std::f64::consts::LN_10;

/// Posterior probabilities beyond this are certainty: calibration is known no finer.
const CERTAIN: f64 = 1e-2;
/// But an edge that words propose is the boldest guess: its refusal is to be kept.
const CERTAIN_SAID: f64 = 1e-4;
/// Places' content overlaps along the path: an edge per place uses each scan some three times, so
/// its information is a third.
pub(crate) const SHARED_SCANS: f64 = 3.0;
/// Cap on what one fit may say for or against a particle.
const LOG_WEIGHT_STEP_MAX: f64 = 4.0 * LN_10;
/// A loop raises `Σ eᵀ Ω e` by its distance² at most, and none is drawn beyond some hundred: where it
/// rises by more, Gauss-Newton has lost its way.
const CHI2_RISE_MAX: f64 = 1000.0;
/// Places for which the refusal of a fresh semantic edge is kept as an alternative.
const SIBLING_KEPT: Vertex = 5;

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
    revisit: RevisitId,
    judgement: Option<Judgement>,
    relief: f64,
    t: Vertex,
    draw: (u64, u64),
) -> Choice {
    let Some(judgement) = judgement else {
        return Choice { taken: None, refused: Some(particle.clone()), undecided: particle };
    };
    particle.log_weight += (judgement.log_evidence - relief).max(-LOG_WEIGHT_STEP_MAX);
    let p = judgement.posterior;
    let certain = if fit.kind == EdgeKind::Semantic { CERTAIN_SAID } else { CERTAIN };
    let decides = !judgement.known && (certain..=1.0 - certain).contains(&p);
    let taking = if decides {
        let u = uniform(draw.0, (u64::from(t) << 32) | u64::from(fit.i), draw.1, Purpose::Edge);
        match particle.count {
            1 => u32::from(u < p),
            // Stochastic rounding of count · p; both outcomes stay, each with its exact share.
            n => ((f64::from(n) * p + u).floor() as u32).clamp(1, n - 1),
        }
    } else if p > 0.5 {
        particle.count
    } else {
        0
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
    if let Some(r) = refused.as_mut() {
        if sibling {
            r.kept_until = r.belief.len() as Vertex - 1 + SIBLING_KEPT;
        }
        if decides && !r.holds(revisit) {
            r.refused.push(revisit);
        }
    }
    Choice { taken, refused, undecided: particle }
}

/// Adds the edge of a fit to what all particles share; none of them takes it yet. None if its numbers
/// are no measurement.
pub fn add_edge(structure: &mut Structure, fit: &Fit, revisit: RevisitId, t: Vertex) -> Option<Edge> {
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
        revisit,
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
    use crate::filter::weigh::tests::{chain, fit};
    use crate::geometry::Pose2;
    use std::sync::Arc;

    /// What becomes of a chain of 21 and a fit of its two ends.
    fn decided(fit: &Fit, judgement: Judgement, relief: f64) -> Choice {
        let (mut structure, p) = chain(21, 0.1);
        let mut choice = choose(p, fit, 0, Some(judgement), relief, 20, (1, 0));
        let edge = add_edge(&mut structure, fit, 0, 20);
        choice.take(&structure, edge.as_ref());
        choice
    }

    #[test]
    fn both_outcomes_share_the_weight_and_the_copies() {
        let judgement = Judgement { log_evidence: -3.0, posterior: 0.7, distance2: 1.0, known: false };
        let choice = decided(&fit(20.0, 0.9, 3), judgement, -3.0);
        let (taken, refused) = (choice.taken.unwrap(), choice.refused.unwrap());
        assert_eq!(taken.count + refused.count, 10);
        assert!((taken.weight() - 0.7).abs() < 1e-12 && (refused.weight() - 0.3).abs() < 1e-12);
        assert_eq!((taken.edges.len(), refused.edges.len()), (1, 0));
    }

    #[test]
    fn an_unlikely_outcome_keeps_its_exact_share_too() {
        for posterior in [0.01, 0.99] {
            let judgement = Judgement { log_evidence: 0.0, posterior, distance2: 1.0, known: false };
            let choice = decided(&fit(20.0, 0.9, 3), judgement, 0.0);
            let (taken, refused) = (choice.taken.unwrap(), choice.refused.unwrap());
            assert!((taken.weight() - posterior).abs() < 1e-12);
            assert!((refused.weight() - (1.0 - posterior)).abs() < 1e-12);
        }
    }

    #[test]
    fn no_fit_costs_more_than_the_cap() {
        let judgement = Judgement { log_evidence: -500.0, posterior: 0.0, distance2: 900.0, known: false };
        let choice = decided(&fit(14.0, 0.9, 3), judgement, 5.0);
        assert!((choice.refused.unwrap().log_weight + LOG_WEIGHT_STEP_MAX).abs() < 1e-12);
    }

    #[test]
    fn an_edge_that_does_not_go_with_the_poses_is_refused_by_all_copies() {
        // Taken against all odds: the chain would have to shrink to half its length.
        let judgement = Judgement { log_evidence: 0.0, posterior: 0.7, distance2: 1.0, known: false };
        let mut absurd = fit(20.0, 0.9, 3);
        absurd.mode.i_from_j = Pose2::new(-400.0, 0.0, 3.0);
        let choice = decided(&absurd, judgement, 0.0);
        let refused = choice.refused.unwrap();
        assert!(choice.taken.is_none() && refused.edges.is_empty());
        assert_eq!((refused.count, refused.weight()), (10, 1.0));
    }

    #[test]
    fn the_refusal_of_a_fresh_semantic_edge_is_kept_for_a_while() {
        let judgement = Judgement { log_evidence: 0.0, posterior: 0.999, distance2: 1.0, known: false };
        let mut semantic = fit(20.0, 0.9, 3);
        semantic.kind = EdgeKind::Semantic;
        let choice = decided(&semantic, judgement, 0.0);
        let refused = choice.refused.unwrap();
        assert_eq!((refused.count, refused.kept_until), (1, 25));
    }

    #[test]
    fn a_revisit_is_decided_on_once() {
        let unsure = Judgement { log_evidence: 0.0, posterior: 0.7, distance2: 1.0, known: false };
        let choice = decided(&fit(20.0, 0.9, 3), unsure, 0.0);
        let (taken, refused) = (choice.taken.unwrap(), choice.refused.unwrap());
        assert_eq!((&taken.taken[..], &taken.refused[..]), (&[0][..], &[][..]));
        assert_eq!((&refused.taken[..], &refused.refused[..]), (&[][..], &[0][..]));
        // Who holds it doubts a fit, but not the revisit.
        let holds = Particle { taken: Arc::new(vec![0]), ..Particle::empty(10) };
        let choice = choose(holds, &fit(20.0, 0.9, 3), 0, Some(unsure), 0.0, 20, (1, 0));
        assert!(choice.refused.unwrap().refused.is_empty());
        // Who is as good as certain that it is false may still learn better.
        let sure = Judgement { posterior: 0.001, ..unsure };
        assert!(decided(&fit(20.0, 0.9, 3), sure, 0.0).refused.unwrap().refused.is_empty());
    }

    #[test]
    fn what_is_known_parts_nobody() {
        for (posterior, edges) in [(0.8, 1), (0.2, 0)] {
            let known = Judgement { log_evidence: 0.0, posterior, distance2: 1.0, known: true };
            let choice = decided(&fit(20.0, 0.9, 3), known, 0.0);
            let all: Vec<Particle> = [choice.taken, choice.refused].into_iter().flatten().collect();
            assert_eq!((all.len(), all[0].count, all[0].edges.len()), (1, 10, edges));
            assert!(all[0].refused.is_empty());
        }
    }
}
