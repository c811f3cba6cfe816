//! How well factors go together: the evidence of all that are held, and the density of one more.
//!
//! With e_k of density N(e_k; 0, Ω_k⁻¹) the evidence is their product, integrated over all poses; at
//! linearisation points near the optimum (Laplace's method), with Λ = L Lᵀ and d = L⁻¹ η,
//!
//! ```text
//! E = Σ_k ½ log|Ω_k/2π| − ½ χ² − ½ log|Λ/2π|
//! χ² = Σ_k ēₖᵀ Ω_k ēₖ − dᵀd,   ē at the linearisation points
//! ```
//!
//! A clique adds its factors' terms, its frontals' part of d, and its part of L's diagonal. It keeps
//! the sum of its own and of all below it: what changes there makes it anew anyway, and the roots say
//! all. What a marginalised pose's factors add goes to the belief when the pose does.
//!
//! E does not depend on the order of factors, and one more adds `log N(z; h(x̄), H Σ Hᵀ + R)`.

use crate::geometry::Pose2;
use crate::smoothing::belief::Belief;
use crate::smoothing::factor::residual;
use crate::smoothing::front::Front;
use crate::smoothing::structure::Structure;
use crate::smoothing::tree::{Clique, Entry, Share};
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

    fn nats(&self) -> f64 {
        self.log_weight - 0.5 * self.chi2
    }
}

/// `½ log|M/2π|` of an information matrix.
pub(super) fn half_log_det(m: &Matrix3<f64>) -> f64 {
    let diagonal = m.cholesky().map_or_else(Matrix3::zeros, |c| c.l()).diagonal();
    diagonal.product().ln() - 1.5 * TAU.ln()
}

/// The density of a measurement that a belief does not hold, as it sees it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LogDensity {
    /// `log N(log(h⁻¹z); 0, S)`, nats; units are metres and radians.
    pub log_density: f64,
    /// `νᵀ S⁻¹ ν`, ν = log(h⁻¹z): of three degrees of freedom.
    pub distance2: f64,
}

impl Belief {
    /// Logarithm of the density of all factors held, given the structure and nothing else, in nats; units
    /// are metres and radians, so only differences between beliefs of one structure, and of as many
    /// measurements, are odds. At the last update; −∞ while updates fail.
    ///
    /// Of poses that were marginalised it holds what they said when they were.
    pub fn log_evidence(&self, structure: &Structure) -> f64 {
        if self.behind { f64::NEG_INFINITY } else { self.sums(structure).nats() }
    }

    /// The least of the objective's quadratic at the linearisation points, marginalised factors counted:
    /// [`Belief::chi2`] of the optimum without a walk through all factors, as true as these are near.
    pub fn least_chi2(&self, structure: &Structure) -> f64 {
        if self.behind { f64::INFINITY } else { self.sums(structure).chi2 }
    }

    fn sums(&self, structure: &Structure) -> Sums {
        let mut sums = self.left;
        for &root in &structure.tree.roots {
            if let Some(front) = self.fronts.get(root as usize).and_then(Option::as_ref) {
                sums += front.sums;
            }
        }
        sums
    }

    /// Those of an eliminated clique and all below it.
    pub(super) fn sums_of(&self, structure: &Structure, clique: &Clique, front: &Front) -> Sums {
        let mut sums = front.eliminated();
        for Share { id, .. } in &clique.factors {
            match &structure.entries[*id as usize] {
                Entry::Between(f, z) if self.has(structure, *id) => {
                    let [at_i, at_j] = self.points_of(f);
                    let error = residual(z, &at_i, &at_j).error;
                    sums += Sums::of_factor(&error, &f.information, structure.log_weights[*id as usize]);
                }
                Entry::Prior(poses) => {
                    let prior = self.prior(*id);
                    sums.chi2 += prior.map_or(0.0, |prior| prior.cost(poses, self.points_among(poses)));
                }
                _ => {}
            }
        }
        for &child in &clique.children {
            if let Some(child) = &self.fronts[child as usize] {
                sums += child.sums;
            }
        }
        sums
    }

    /// Density of a measured pose z of j in the frame of i (metres, radians), of the covariance R of z's
    /// right perturbation (frame of j: m², m·rad, rad²), given what the belief knows: h is the pose
    /// predicted, and `S = Σ_h + R`. None where the two poses are not both there, or S is no covariance.
    pub fn log_density(
        &self,
        structure: &Structure,
        i: u32,
        j: u32,
        z: &Pose2,
        covariance: &Matrix3<f64>,
    ) -> Option<LogDensity> {
        let predicted = self.relative(structure, j, &[i]).ok()?.pop()?;
        let s = (predicted.covariance + covariance).cholesky()?;
        let v = predicted.i_from_a.between(z).log();
        let distance2 = v.dot(&s.solve(&v));
        let log_density = -0.5 * distance2 - s.l().diagonal().product().ln() - 1.5 * TAU.ln();
        log_density.is_finite().then_some(LogDensity { log_density, distance2 })
    }
}
