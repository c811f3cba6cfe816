//! Logistic regression with part of the log-odds given, by iterated reweighted least squares.

use nalgebra::{SMatrix, SVector};

/// Ridge on all weights but the constant, in examples; some thousands are learned from.
const RIDGE: f64 = 1.0;
/// Newton steps; some eight are needed.
const STEPS: usize = 40;
/// Weights change by no more than this in a step.
const STEP_MAX: f64 = 3.0;

/// An example.
pub struct Example<const N: usize> {
    /// The first is the constant 1.
    pub features: [f64; N],
    /// Log-odds that are given.
    pub given: f64,
    /// For how many it counts.
    pub weight: f64,
    /// What it is.
    pub is_true: bool,
}

impl<const N: usize> Example<N> {
    /// Probability that it is true.
    pub fn probability(&self, weights: &[f64; N]) -> f64 {
        let dot: f64 = self.features.iter().zip(weights).map(|(x, w)| x * w).sum();
        1.0 / (1.0 + (-(self.given + dot).clamp(-35.0, 35.0)).exp())
    }
}

/// The weights by those examples whose numbers are chosen.
pub fn fit<const N: usize>(examples: &[Example<N>], chosen: impl Fn(usize) -> bool) -> [f64; N] {
    let mut weights = [0.0; N];
    for _ in 0..STEPS {
        let mut hessian = SMatrix::<f64, N, N>::identity() * RIDGE;
        let mut gradient: SVector<f64, N> = -RIDGE * SVector::from(weights);
        gradient[0] = 0.0;
        for (_, e) in examples.iter().enumerate().filter(|(k, _)| chosen(*k)) {
            let (x, p) = (SVector::from(e.features), e.probability(&weights));
            gradient += x * (e.weight * (f64::from(e.is_true) - p));
            hessian += x * x.transpose() * (e.weight * p * (1.0 - p));
        }
        let Some(inverse) = hessian.try_inverse() else { break };
        let step = inverse * gradient;
        let scale = (STEP_MAX / step.amax().max(STEP_MAX)).min(1.0);
        for (w, s) in weights.iter_mut().zip(step.iter()) {
            *w += scale * s;
        }
    }
    weights
}
