//! Normalise, merge particles that say the same, and keep the best: the paper's resampling without draws.
//!
//! Assignments of answers are discrete and weights exact, so that a copy would say nothing and a draw only lose
//! something. N particles are the N best.

use crate::edge::QuestionId;
use crate::filter::answer::same;
use crate::filter::chance::log_add;
use crate::filter::particle::Particle;
use crate::smoothing::Structure;

/// Graphs that weigh less are dropped: a question closes when the rest does.
pub const KEPT_MIN: f64 = 1e-5;
/// Two places are one answer where both graphs know them to this.
const SAME_SIGMA_M: f64 = 0.5;

/// Scales weights to sum to one.
pub fn normalise(particles: &mut [Particle]) {
    let log_sum = particles.iter().map(|p| p.log_weight).fold(f64::NEG_INFINITY, log_add);
    for p in particles {
        p.log_weight -= log_sum;
    }
}

/// The best first.
pub fn rank(particles: &mut [Particle]) {
    particles.sort_by(|a, b| b.log_weight.total_cmp(&a.log_weight));
}

/// Makes one of particles that say the same, the best first.
pub fn merge(structure: &Structure, mut particles: Vec<Particle>) -> Vec<Particle> {
    rank(&mut particles);
    let mut merged: Vec<Particle> = Vec::with_capacity(particles.len());
    for p in particles {
        match merged.iter_mut().find(|m| say_same(structure, m, &p)) {
            Some(m) => m.log_weight = log_add(m.log_weight, p.log_weight),
            None => merged.push(p),
        }
    }
    rank(&mut merged);
    merged
}

/// Whether two give the same answers, or differ in answers that their maps give alike.
fn say_same(structure: &Structure, a: &Particle, b: &Particle) -> bool {
    let one_sided = |x: &Particle, y: &Particle| -> Vec<QuestionId> {
        x.taken.iter().copied().filter(|&q| !y.holds(q)).collect()
    };
    fail_alike(a, b)
        && (a.taken == b.taken
            || is_laid_alike(structure, a, b, &one_sided(a, b))
                && is_laid_alike(structure, b, a, &one_sided(b, a)))
}

/// Whether two let the same stretches go, or others that bend their maps alike.
fn fail_alike(a: &Particle, b: &Particle) -> bool {
    let one_sided = a.failed.iter().filter(|v| !b.failed.contains(v));
    let mut bent = one_sided.chain(b.failed.iter().filter(|v| !a.failed.contains(v)));
    let step = |p: &Particle, v: u32| p.belief.pose(v - 1).between(&p.belief.pose(v));
    bent.all(|&v| same(&step(a, v), &step(b, v)))
}

/// Whether `other` lays the places of a particle's answers as the particle does, and as surely.
fn is_laid_alike(structure: &Structure, p: &Particle, other: &Particle, answers: &[QuestionId]) -> bool {
    answers.iter().all(|&question| {
        let edges = p.edges.iter().filter(|e| e.question == question);
        let (mut any, mut alike) = (false, true);
        for e in edges {
            any = true;
            let there = |q: &Particle| q.belief.pose(e.i).between(&q.belief.pose(e.j));
            let sure = other
                .belief
                .relative(structure, e.j, &[e.i])
                .is_ok_and(|r| r.iter().all(|r| r.sigma_m() < SAME_SIGMA_M));
            alike &= sure && same(&there(p), &there(other));
        }
        // An answer without edges is one that a map gave by itself.
        !any || alike
    })
}

/// Keeps the `n` best of ranked particles, and of those the ones that weigh something. Returns the others.
pub fn keep_best(particles: &mut Vec<Particle>, n: usize) -> Vec<Particle> {
    let light = particles.partition_point(|p| p.weight() >= KEPT_MIN);
    let dropped = particles.split_off(light.min(n).max(1));
    normalise(particles);
    dropped
}

/// 1 / Σ w²: how many particles weigh as much as these.
pub fn effective_sample_size(particles: &[Particle]) -> f64 {
    1.0 / particles.iter().map(|p| p.weight().powi(2)).sum::<f64>()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::filter::weigh::tests::chain;
    use std::sync::Arc;

    /// A particle that gave so many answers.
    fn weighed(answers: u32, weight: f64) -> Particle {
        let mut p = chain(3, 0.1).1;
        p.taken = Arc::new((0..answers).map(|n| QuestionId { boot: 0, n }).collect());
        p.log_weight = weight.ln();
        p
    }

    #[test]
    fn weights_sum_to_one() {
        let mut particles = vec![weighed(0, 3e-9), weighed(1, 1e-9)];
        normalise(&mut particles);
        assert!((particles[0].weight() - 0.75).abs() < 1e-12);
        assert!((effective_sample_size(&particles) - 1.0 / (0.5625 + 0.0625)).abs() < 1e-9);
    }

    #[test]
    fn answers_that_a_map_gives_by_itself_make_no_other_graph() {
        let (structure, _) = chain(3, 0.1);
        let merged = merge(&structure, vec![weighed(0, 0.5), weighed(1, 0.3), weighed(1, 0.2)]);
        assert_eq!(merged.len(), 1);
        assert!((merged[0].weight() - 1.0).abs() < 1e-12);
    }

    #[test]
    fn the_best_are_kept_and_the_rest_is_told() {
        let mut particles: Vec<Particle> =
            [0.6, 0.3, 0.0999, 1e-6].into_iter().zip(0..).map(|(w, n)| weighed(n, w)).collect();
        let dropped = keep_best(&mut particles, 2);
        assert_eq!((particles.len(), dropped.len()), (2, 2));
        assert!((particles[0].weight() - 2.0 / 3.0).abs() < 1e-12);
        let dropped = keep_best(&mut vec![weighed(0, 1e-9)], 30);
        assert!(dropped.is_empty(), "one is kept whatever it weighs");
    }
}
