//! How well factors go together: the evidence of all that are held.
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
//! E does not depend on the order of factors, and one more adds `log N(z; h(x̄), H Σ Hᵀ + R)`, which is
//! [`super::Relative::log_density`].

use crate::smoothing::belief::Belief;
use crate::smoothing::factor::residual;
use crate::smoothing::front::Front;
use crate::smoothing::structure::Structure;
use crate::smoothing::sums::Sums;
use crate::smoothing::tree::{Clique, Entry, Share};

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
}
