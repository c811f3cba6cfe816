//! Normalise, merge equal particles, and resample below an effective sample size.
//!
//! Graphs are discrete: equal particles are merged into one with a count, and the heavy ones keep
//! their exact weight while the light ones are drawn by stratified sampling (Fearnhead and
//! Clifford 2003). Nothing is copied.

use crate::graph::Vertex;
use crate::particle::Particle;
use crate::random::{Purpose, generator};
use rand::RngExt;

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
pub fn merge(particles: Vec<Particle>) -> Vec<Particle> {
    let mut merged: Vec<Particle> = Vec::with_capacity(particles.len());
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
