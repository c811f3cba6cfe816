//! Parts of the evidence, clique by clique: see [`super::evidence`].

use nalgebra::{Matrix3, Vector3};
use serde::{Deserialize, Serialize};
use std::f64::consts::TAU;
use std::ops::AddAssign;

/// What some factors and eliminated poses add to the evidence, which is `log_weight − ½ chi2`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct Sums {
    /// Part of χ².
    pub chi2: f64,
    /// Part of `Σ ½ log|Ω/2π| − ½ log|Λ/2π|`, nats; units are metres and radians.
    pub log_weight: f64,
}

impl AddAssign for Sums {
    fn add_assign(&mut self, other: Self) {
        self.chi2 += other.chi2;
        self.log_weight += other.log_weight;
    }
}

impl Sums {
    /// A factor with an error, and its `½ log|Ω/2π|`.
    pub fn of_factor(error: &Vector3<f64>, information: &Matrix3<f64>, log_weight: f64) -> Self {
        Self { chi2: error.dot(&(information * error)), log_weight }
    }

    /// Eliminates a pose of which so much is known: its block of Λ, and η there.
    pub fn eliminate(&mut self, own: &Matrix3<f64>, b: &Vector3<f64>) {
        if let Some(cholesky) = own.cholesky() {
            self.chi2 -= b.dot(&cholesky.solve(b));
            self.log_weight -= half_log_det(own);
        }
    }

    /// `log_weight − ½ chi2`.
    pub fn nats(&self) -> f64 {
        self.log_weight - 0.5 * self.chi2
    }
}

/// `½ log|M/2π|` of an information matrix.
pub(super) fn half_log_det(m: &Matrix3<f64>) -> f64 {
    let diagonal = m.cholesky().map_or_else(Matrix3::zeros, |c| c.l()).diagonal();
    diagonal.product().ln() - 1.5 * TAU.ln()
}
