//! Step 2 of Algorithm 1: the Gaussian over the poses of each particle's graph.
//!
//! The poses X = x_0 … x_t in SE(2) given a topology G are Gaussian in information form,
//!
//! ```text
//! p(X | G, z, u, λ) = N⁻¹(X; η, Λ)                                   (10)
//! ```
//!
//! the local quadratic of the objective
//!
//! ```text
//! X* = argmin Σ_k e_kᵀ Ω_k e_k,   e_k = z_k⁻¹ · xᵢ⁻¹xⱼ as (x, y, yaw),   x_0 = origin
//!  Λ = Σ_k J_kᵀ Ω_k J_k = L Lᵀ,   Σ = Λ⁻¹,   x = x̄ ⊕ δ
//! ```
//!
//! kept up to date as poses and factors come and go, by incremental smoothing and mapping on a Bayes
//! tree (Kaess et al., iSAM2, IJRR 2012).
//!
//! | symbol | meaning | where |
//! |---|---|---|
//! | z_k, Ω_k, e_k, J_k | a between-factor, its information, error, Jacobian | [`factor`] |
//! | G | poses and factors of all particles together | [`structure`] |
//! | cliques | who is eliminated with whom, given whom | [`tree`], in the [`order`] of least fill |
//! | L, η | a clique's share of them, for one particle | [`front`]; by QR where digits are few: [`qr`] |
//! | x̄, δ | linearisation points and steps of one particle | [`belief`], in [`frames`]; brought up to date in [`update`] |
//! | Σ_jj, Σ_tj | covariances | [`covariance`]; of all poses by the selected [`inverse`] |
//! | p(z) | how well factors go together | [`evidence`] |
//! | p(X \ x_v) | what a marginalised pose leaves | [`marginal`] |
//!
//! What all particles share is the [`Structure`]; a [`Belief`] is one particle's numbers, in chunks
//! and cliques that its clones share until they differ. [`Smoother`] is the two for one particle.
//!
//! The first pose is the origin and the gauge: fixed exactly, of zero covariance. All covariances
//! are those of right perturbations, in the body's frame.

// Equations in comments, not identifiers.
#![allow(clippy::doc_markdown)]

mod belief;
mod chunked;
mod covariance;
mod evidence;
mod factor;
mod frames;
mod front;
mod inverse;
mod kernels;
mod marginal;
mod order;
mod qr;
mod smoother;
mod structure;
mod sums;
#[cfg(test)]
mod tests;
mod tree;
mod update;

pub use belief::Belief;
pub use covariance::{Joint, JointPart, JointRoom, LogDensity, Relative};
pub use factor::Factor;
pub use smoother::Smoother;
pub use structure::Structure;
pub use update::Work;

/// Handle of a factor; never reused.
pub type FactorId = u32;

/// Why a change was refused.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum SmoothError {
    /// The index is not that of a pose.
    #[error("there is no pose {pose} among {len}")]
    NoSuchPose {
        /// The index given.
        pose: u32,
        /// Number of poses.
        len: usize,
    },
    /// The pose is no longer there.
    #[error("pose {0} was marginalised")]
    Marginalised(u32),
    /// The pose cannot be marginalised, nor, if it is the first, loosened or moved.
    #[error("pose {0} is still needed: it is the first, the newest, or not arranged yet")]
    Needed(u32),
    /// A factor from a pose to itself.
    #[error("a factor from pose {0} to itself")]
    SamePose(u32),
    /// The handle is not that of a present factor.
    #[error("there is no factor {0}")]
    NoSuchFactor(FactorId),
    /// NaN or infinite numbers in a transform or an information matrix.
    #[error("a transform or information matrix is not finite")]
    NotFinite,
    /// An information matrix that differs from its transpose.
    #[error("an information matrix is not symmetric")]
    NotSymmetric,
    /// An information matrix with an eigenvalue that is not clearly positive.
    #[error("an information matrix is not positive definite")]
    NotPositiveDefinite,
    /// The graph's information matrix is singular to working precision.
    #[error("the graph's information matrix is singular to working precision")]
    Singular,
    /// No minimum was found: the factors contradict one another wildly.
    #[error("the poses did not converge: the factors contradict one another")]
    NotConverged,
    /// More poses or factors than can be indexed.
    #[error("the graph is too large")]
    TooLarge,
    /// The belief missed an update that the structure relied on.
    #[error("the belief was not updated since poses were marginalised, or not at all")]
    Behind,
}
