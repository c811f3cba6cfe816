//! Normalise, merge equal particles, and resample below an effective sample size.
//!
//! Graphs are discrete: equal particles are merged into one with a count, and the heavy ones keep
//! their exact weight while the light ones are drawn by stratified sampling (Fearnhead and
//! Clifford 2003). Nothing is copied.

use crate::edge::Vertex;
use crate::filter::particle::Particle;
use crate::random::{Purpose, generator};
use rand::RngExt;

/// Lighter ones are left to the draw: hardly ever does one become likely again.
const NEGLIGIBLE: f64 = 1e-4;

/// Scales weights to sum to one.
pub fn normalise(particles: &mut [Particle]) {
    let top = particles.iter().map(|p| p.log_weight).fold(f64::NEG_INFINITY, f64::max);
    let sum: f64 = particles.iter().map(|p| (p.log_weight - top).exp()).sum();
    let log_sum = top + sum.ln();
    for p in particles {
        p.log_weight -= log_sum;
    }
}

/// Makes one of equal particles, and puts the best first.
pub fn merge(mut particles: Vec<Particle>) -> Vec<Particle> {
    let mut merged: Vec<Particle> = Vec::with_capacity(particles.len());
    particles.sort_by(|a, b| b.log_weight.total_cmp(&a.log_weight));
    for p in particles {
        if let Some(same) = merged.iter_mut().find(|m| m.same_graph(&p)) {
            same.log_weight = log_add(same.log_weight, p.log_weight);
            same.count += p.count;
            same.kept_until = same.kept_until.max(p.kept_until);
        } else {
            merged.push(p);
        }
    }
    merged.sort_by(|a, b| b.log_weight.total_cmp(&a.log_weight));
    merged
}

fn log_add(a: f64, b: f64) -> f64 {
    let (hi, lo) = if a > b { (a, b) } else { (b, a) };
    hi + (lo - hi).exp().ln_1p()
}

/// 1 / Σ w² over single particles.
pub fn effective_sample_size(particles: &[Particle]) -> f64 {
    1.0 / particles.iter().map(|p| p.weight().powi(2) / f64::from(p.count)).sum::<f64>()
}

/// Whether particles cost more than they tell: few weigh much, there are more graphs than particles, or one
/// is lighter than [`NEGLIGIBLE`].
pub fn is_wasteful(particles: &[Particle], n: u32, resample_below: f64) -> bool {
    effective_sample_size(particles) < resample_below * f64::from(n)
        || particles.len() > n as usize
        || particles.iter().any(|p| p.weight() < NEGLIGIBLE)
}

/// Gives each distinct graph its share of the `n` particles. Graphs that weigh at least one
/// particle keep their weight; of the lighter ones a stratified draw survives at a particle's
/// weight each. Siblings kept on purpose survive as they are.
pub fn resample(particles: Vec<Particle>, n: u32, seed: u64, t: Vertex) -> Vec<Particle> {
    let unit = 1.0 / f64::from(n);
    let mut offset: f64 = generator(seed, t.into(), 0, Purpose::Resample).random::<f64>() * unit;
    let mut kept = Vec::with_capacity(particles.len());
    for mut p in particles {
        let weight = p.weight();
        if weight >= unit || p.kept_until > t {
            p.count = ((weight / unit).round() as u32).max(1);
            kept.push(p);
            continue;
        }
        // Systematic over the light ones: one survives each time their weights pass a unit.
        offset -= weight;
        if offset < 0.0 {
            offset += unit;
            p.log_weight = unit.ln();
            p.count = 1;
            kept.push(p);
        }
    }
    balance(&mut kept, n);
    normalise(&mut kept);
    kept
}

/// Brings counts to sum to n: the heaviest graph takes or gives what rounding left over; beyond
/// that the lightest are dropped.
fn balance(particles: &mut Vec<Particle>, n: u32) {
    while particles.len() > n as usize {
        particles.pop();
    }
    let others: u32 = particles.iter().skip(1).map(|p| p.count).sum();
    if others < n {
        if let Some(first) = particles.first_mut() {
            first.count = n - others;
        }
        return;
    }
    for p in particles.iter_mut() {
        p.count = 1;
    }
    let others = particles.len() as u32 - 1;
    if let Some(first) = particles.first_mut() {
        first.count = n - others;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::edge::EdgeKind;
    use crate::filter::particle::Edge;
    use crate::geometry::Pose2;
    use std::sync::Arc;

    /// Particles with the given weights and counts, each of a graph of its own.
    fn particles(weights: &[(f64, u32)]) -> Vec<Particle> {
        let one = |(k, &(weight, count)): (usize, &(f64, u32))| {
            let edge = Edge {
                i: k as u32,
                j: 99,
                kind: EdgeKind::Distance,
                i_from_j: Pose2::default(),
                covariance: nalgebra::Matrix3::identity(),
                revisit: k as u32,
                named: None,
                factor: k as u32,
            };
            let taken = Arc::new(vec![edge.revisit]);
            Particle {
                edges: Arc::new(vec![edge]),
                taken,
                log_weight: f64::ln(weight),
                count,
                ..Particle::empty(1)
            }
        };
        weights.iter().enumerate().map(one).collect()
    }

    fn total(particles: &[Particle]) -> (f64, u32) {
        (particles.iter().map(Particle::weight).sum(), particles.iter().map(|p| p.count).sum())
    }

    #[test]
    fn equal_particles_become_one_with_their_weight_and_count() {
        let mut all = particles(&[(0.2, 3), (0.5, 4)]);
        all.extend(particles(&[(0.3, 5)]));
        let merged = merge(all);
        assert_eq!(merged.len(), 2);
        assert!((merged[0].weight() - 0.5).abs() < 1e-12 && (merged[1].weight() - 0.5).abs() < 1e-12);
        assert_eq!(total(&merged).1, 12);
    }

    #[test]
    fn which_fits_of_a_revisit_became_edges_is_no_difference() {
        let mut all = particles(&[(0.2, 3), (0.8, 4)]);
        all[0].taken = all[1].taken.clone();
        let heavier = all[1].edges.clone();
        let merged = merge(all);
        assert_eq!((merged.len(), &merged[0].edges), (1, &heavier));
        assert_eq!(total(&merged).1, 7);
    }

    #[test]
    fn effective_sample_size_counts_particles() {
        assert!((effective_sample_size(&particles(&[(0.5, 5), (0.5, 5)])) - 10.0).abs() < 1e-9);
        assert!((effective_sample_size(&particles(&[(1.0, 1), (1e-9, 9)])) - 1.0).abs() < 1e-6);
    }

    #[test]
    fn particles_are_drawn_when_few_weigh_much_or_one_next_to_nothing() {
        let wasteful = |weights: &[(f64, u32)]| is_wasteful(&particles(weights), 10, 0.5);
        assert!(!wasteful(&[(0.6, 6), (0.4, 4)]));
        assert!(wasteful(&[(0.97, 1), (0.03, 9)]));
        assert!(wasteful(&[(1.0 - 1e-5, 9), (1e-5, 1)]));
        assert!(wasteful(&[(1.0 / 11.0, 1); 11]));
    }

    #[test]
    fn resampling_keeps_the_heavy_exactly_and_the_light_on_average() {
        let weights = [(0.6, 5), (0.25, 5), (0.05, 4), (0.04, 3), (0.03, 2), (0.03, 1)];
        let mut mean = vec![0.0; weights.len()];
        let runs = 4000;
        for seed in 0..runs {
            let kept = resample(particles(&weights), 10, seed, 1);
            let (weight, count) = total(&kept);
            assert!((weight - 1.0).abs() < 1e-9);
            assert_eq!(count, 10);
            for p in &kept {
                mean[p.edges[0].i as usize] += p.weight() / runs as f64;
            }
        }
        for (m, (w, _)) in mean.iter().zip(&weights) {
            assert!((m - w).abs() < 0.01, "{mean:?}");
        }
    }

    #[test]
    fn a_kept_sibling_survives_whatever_its_weight() {
        let mut all = particles(&[(1.0 - 1e-6, 29), (1e-6, 1)]);
        all[1].kept_until = 5;
        assert_eq!(resample(all.clone(), 30, 1, 3).len(), 2);
        assert_eq!(resample(all, 30, 1, 5).len(), 1);
    }

    #[test]
    fn more_graphs_than_particles_are_thinned() {
        let many: Vec<(f64, u32)> = (0..50).map(|_| (0.02, 1)).collect();
        let kept = resample(particles(&many), 10, 7, 1);
        assert_eq!(total(&kept).1, 10);
        assert!(kept.len() <= 10);
    }
}
