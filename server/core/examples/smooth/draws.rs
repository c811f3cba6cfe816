//! What the particles decide by chance: which edges they take, and who survives.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::collections::BTreeMap;
use std::f64::consts::TAU;

/// What is asked for.
pub struct Plan {
    pub particles: u32,
    /// Probability with which a particle takes a loop edge.
    pub accept: f64,
    pub resample_every: usize,
    pub seed: u64,
}

/// How many of a group's particles keep which of the edges offered, in a fixed order.
pub type Split = BTreeMap<Vec<bool>, u32>;

/// The particles' random decisions. Edges and weights have streams of their own: how often one
/// resamples does not change how the edges' coins fall.
pub struct Draws {
    accept: f64,
    edges: ChaCha8Rng,
    weights: ChaCha8Rng,
}

impl Draws {
    pub fn new(plan: &Plan) -> Self {
        let edges = ChaCha8Rng::seed_from_u64(plan.seed);
        let mut weights = edges.clone();
        weights.set_stream(1);
        Self { accept: plan.accept, edges, weights }
    }

    /// Whether one particle takes one edge.
    pub fn keep(&mut self) -> bool {
        self.edges.random::<f64>() < self.accept
    }

    /// What `count` equal particles take of so many edges.
    pub fn split(&mut self, count: u32, edges: usize) -> Split {
        let mut parts = Split::new();
        for _ in 0..count {
            let mask: Vec<bool> = (0..edges).map(|_| self.keep()).collect();
            *parts.entry(mask).or_insert(0) += 1;
        }
        parts
    }

    /// Gives each particle a random weight and draws as many again, systematically. `counts`, of equal
    /// particles, become what is drawn of each.
    pub fn resample(&mut self, counts: &mut [u32]) {
        let n: u32 = counts.iter().sum();
        let weights: Vec<f64> =
            counts.iter().map(|&count| (0..count).map(|_| self.normal().exp()).sum()).collect();
        let total: f64 = weights.iter().sum();
        let offset: f64 = self.weights.random();
        let (mut sum, mut drawn) = (0.0, 0);
        for (count, weight) in counts.iter_mut().zip(weights) {
            sum += weight;
            // Marks lie at offset, offset + 1, … of n; those below the running sum are drawn.
            let below = (sum / total * f64::from(n) - offset).ceil().clamp(0.0, f64::from(n)) as u32;
            *count = below - drawn;
            drawn = below;
        }
        // Rounding may leave the last mark just above the sum.
        if let Some(last) = counts.last_mut() {
            *last += n - drawn;
        }
    }

    /// Standard normal, by Box and Muller.
    fn normal(&mut self) -> f64 {
        let (u, v): (f64, f64) = (self.weights.random(), self.weights.random());
        // 1 − u is above zero.
        (-2.0 * (1.0 - u).ln()).sqrt() * (TAU * v).cos()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::mean;

    fn draws(accept: f64) -> Draws {
        Draws::new(&Plan { particles: 1, accept, resample_every: 1, seed: 7 })
    }

    #[test]
    fn every_particle_decides() {
        let parts = draws(0.5).split(1000, 2);
        assert_eq!(parts.values().sum::<u32>(), 1000);
        assert_eq!(parts.len(), 4);
        assert!(parts.values().all(|&n| (200..300).contains(&n)), "{parts:?}");
        assert_eq!(draws(1.0).split(9, 2), BTreeMap::from([(vec![true, true], 9)]));
        assert_eq!(draws(0.5).split(9, 0), BTreeMap::from([(vec![], 9)]));
    }

    #[test]
    fn resampling_keeps_the_number_and_follows_the_counts() {
        let mut draws = draws(0.5);
        let (mut first, mut gone) = (0, 0);
        for _ in 0..200 {
            let mut counts = [40, 1, 9];
            draws.resample(&mut counts);
            assert_eq!(counts.iter().sum::<u32>(), 50);
            first += counts[0];
            gone += u32::from(counts[1] == 0);
        }
        assert!((7700..8300).contains(&first), "{first}");
        assert!((40..160).contains(&gone), "{gone}");
    }

    #[test]
    fn normal_has_unit_variance() {
        let mut draws = draws(0.5);
        let v: Vec<f64> = (0..10_000).map(|_| draws.normal()).collect();
        let variance = mean(v.iter().map(|x| x * x));
        assert!(mean(v.iter().copied()).abs() < 0.05 && (variance - 1.0).abs() < 0.05, "{variance}");
    }
}
