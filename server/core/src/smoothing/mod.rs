//! Step 2 of Algorithm 1: the Gaussian over the poses of one particle's graph.
//!
//! The poses X = x_0 … x_t in SE(2) given a topology G are Gaussian in information form,
//!
//! ```text
//! p(X | G, z, u, λ) = N⁻¹(X; η, Λ)                                   (10)
//! ```
//!
//! which is the local quadratic of the objective, at its minimum:
//!
//! ```text
//! X* = argmin Σ_k ‖log(z_k⁻¹ · xᵢ⁻¹xⱼ)‖²_Ω_k,   x_0 = origin
//!  Λ = Σ_k J_kᵀ Ω_k J_k,   Σ = Λ⁻¹,   x ← x·exp(δ)
//! ```
//!
//! | symbol | meaning | where |
//! |---|---|---|
//! | z_k, Ω_k, J_k | a between-factor, its information, its Jacobian | [`factor`] |
//! | X* | Gauss–Newton with a line search | `solve` |
//! | Λ = L Lᵀ | sparse Cholesky in 3×3 blocks, minimum-degree order, newest pose last | `symbolic`, `cholesky` |
//! | Σ_jj, Σ_tj | selected inverse, back-substitution | `covariance` |
//!
//! The first pose is the origin and the gauge: fixed exactly, of zero covariance. All covariances
//! are those of right perturbations, in the body's frame. A chain extension x_{t+1} = x_t·u is
//! exact without a solve: its factor's error is zero, Σ_{t+1,t+1} = F Σ_tt Fᵀ + Q and
//! Σ_{t+1,j} = F Σ_tj with F = Ad(u⁻¹).

// Equations in comments, not identifiers.
#![allow(clippy::doc_markdown)]

use crate::geometry::Pose2;
use covariance::Covariances;
use factor::{checked_information, sandwich, symmetrised};
use nalgebra::Matrix3;
use serde::{Deserialize, Serialize};
use std::sync::Arc;

mod cholesky;
mod covariance;
pub mod factor;
mod solve;
mod symbolic;
#[cfg(test)]
mod tests;

pub use factor::Factor;

/// Handle of a loop factor inside one [`Smoother`] and its clones; never reused.
pub type FactorId = u32;

/// Why a smoother refused a change; it is as before then.
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
    /// Gauss–Newton found no minimum: the factors contradict one another wildly.
    #[error("the poses did not converge: the factors contradict one another")]
    NotConverged,
    /// More poses or factors than can be indexed.
    #[error("the graph is too large")]
    TooLarge,
}

/// The poses of one particle. A clone shares everything with its original until one of them
/// changes.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Smoother {
    poses: Arc<Vec<Pose2>>,
    /// Link k joins pose k to pose k + 1.
    chain: Arc<Vec<Link>>,
    /// By [`FactorId`]; removed ones leave a hole.
    loops: Arc<Vec<Option<Factor>>>,
    /// At the last solution.
    covariances: Arc<Covariances>,
    /// Of the poses after the newest of the last solution, in order.
    tail: Arc<Vec<Tail>>,
    chi2: f64,
    /// Whether loop factors changed since the last solution.
    dirty: bool,
}

/// A chain edge, with its covariance Q = Ω⁻¹.
#[derive(Clone, Debug, Serialize, Deserialize)]
struct Link {
    factor: Factor,
    covariance: Matrix3<f64>,
}

/// A pose added since the last solution, whose newest pose is m.
#[derive(Clone, Debug, Serialize, Deserialize)]
struct Tail {
    /// Σ_kk.
    marginal: Matrix3<f64>,
    /// Covariance of `x_m⁻¹x_k`.
    since_newest: Matrix3<f64>,
}

/// Joint covariance of the newest pose with others.
#[derive(Clone, Debug, PartialEq)]
pub struct Joint {
    /// Index of the newest pose t.
    pub newest: u32,
    /// Σ_tt.
    pub marginal: Matrix3<f64>,
    /// One per candidate, in the order asked for.
    pub others: Vec<JointPart>,
}

/// One candidate's part of a [`Joint`].
#[derive(Clone, Debug, PartialEq)]
pub struct JointPart {
    /// The candidate's index.
    pub j: u32,
    /// Σ_jj.
    pub marginal: Matrix3<f64>,
    /// Σ_tj = E[δt δjᵀ].
    pub cross: Matrix3<f64>,
}

/// A predicted relative pose.
#[derive(Clone, Debug, PartialEq)]
pub struct Relative {
    /// The candidate's index.
    pub i: u32,
    /// `xᵢ⁻¹ x_a`, a the pose asked about.
    pub i_from_a: Pose2,
    /// Covariance of its right perturbation, i.e. in the frame of a.
    pub covariance: Matrix3<f64>,
}

impl Default for Smoother {
    fn default() -> Self {
        Self::new()
    }
}

impl Smoother {
    /// Without poses.
    pub fn new() -> Self {
        Self {
            poses: Arc::default(),
            chain: Arc::default(),
            loops: Arc::default(),
            covariances: Arc::new(Covariances::origin()),
            tail: Arc::default(),
            chi2: 0.0,
            dirty: false,
        }
    }

    /// Number of poses.
    pub fn len(&self) -> usize {
        self.poses.len()
    }

    /// Whether there is no pose yet.
    pub fn is_empty(&self) -> bool {
        self.poses.is_empty()
    }

    /// Extends the chain by a pose and returns its index. No solve: the others stay as they are.
    ///
    /// `information` is that of the right perturbation of `previous_from_new` (frame of the new
    /// pose). The first pose is the origin, whatever the arguments.
    pub fn add_pose(
        &mut self,
        previous_from_new: Pose2,
        information: &Matrix3<f64>,
    ) -> Result<u32, SmoothError> {
        let index = u32::try_from(self.len()).map_err(|_| SmoothError::TooLarge)?;
        if index == 0 {
            Arc::make_mut(&mut self.poses).push(Pose2::default());
            return Ok(0);
        }
        if !previous_from_new.is_finite() {
            return Err(SmoothError::NotFinite);
        }
        let (information, covariance) = checked_information(information)?;
        let previous = index - 1;
        let f = previous_from_new.inverse().adjoint();
        let propagated = |m: &Matrix3<f64>| symmetrised(&(sandwich(&f, m) + covariance));
        let tail = Tail {
            marginal: propagated(&self.marginal(previous)),
            since_newest: propagated(&self.since_newest(previous)),
        };
        let pose = self.pose(previous).compose(&previous_from_new);
        let factor = Factor { i: previous, j: index, i_from_j: previous_from_new, information };
        Arc::make_mut(&mut self.poses).push(pose);
        Arc::make_mut(&mut self.chain).push(Link { factor, covariance });
        Arc::make_mut(&mut self.tail).push(tail);
        Ok(index)
    }

    /// Adds a loop factor; poses and covariances follow at the next [`Smoother::update`].
    pub fn add_factor(&mut self, mut factor: Factor) -> Result<FactorId, SmoothError> {
        factor.check(self.len())?;
        (factor.information, _) = checked_information(&factor.information)?;
        let id = u32::try_from(self.loops.len()).map_err(|_| SmoothError::TooLarge)?;
        Arc::make_mut(&mut self.loops).push(Some(factor));
        self.dirty = true;
        Ok(id)
    }

    /// Removes a loop factor; poses and covariances follow at the next [`Smoother::update`].
    pub fn remove_factor(&mut self, id: FactorId) -> Result<(), SmoothError> {
        if self.factor(id).is_none() {
            return Err(SmoothError::NoSuchFactor(id));
        }
        Arc::make_mut(&mut self.loops)[id as usize] = None;
        self.dirty = true;
        Ok(())
    }

    /// A present loop factor.
    pub fn factor(&self, id: FactorId) -> Option<&Factor> {
        self.loops.get(id as usize)?.as_ref()
    }

    /// Solves if loop factors changed. On an error poses and covariances stay those of the last
    /// solution; removing the factor that did not fit mends it.
    pub fn update(&mut self) -> Result<(), SmoothError> {
        if !self.dirty {
            return Ok(());
        }
        let factors: Vec<&Factor> =
            self.chain.iter().map(|link| &link.factor).chain(self.loops.iter().flatten()).collect();
        let solution = solve::solve(self.poses.to_vec(), &factors)?;
        self.poses = Arc::new(solution.poses);
        self.chi2 = solution.chi2;
        self.covariances = Arc::new(Covariances::of(solution.cholesky));
        self.tail = Arc::default();
        self.dirty = false;
        Ok(())
    }

    /// Pose i: origin_from_i. Indexes like a slice.
    pub fn pose(&self, i: u32) -> Pose2 {
        self.poses[i as usize]
    }

    /// All poses.
    pub fn poses(&self) -> &[Pose2] {
        &self.poses
    }

    /// The objective's value at the last solution.
    pub fn chi2(&self) -> f64 {
        self.chi2
    }

    /// Σ_ii in the frame of i: m², m·rad, rad². Indexes like a slice.
    pub fn marginal(&self, i: u32) -> Matrix3<f64> {
        match self.tail_of(i) {
            Some(tail) => tail.marginal,
            None => self.covariances.marginal(i),
        }
    }

    /// Joint covariance of the newest pose with each candidate.
    ///
    /// For the relation of the two prefer [`Smoother::relative`]: it stays exact where the
    /// absolute covariances are large.
    pub fn joint(&self, candidates: &[u32]) -> Result<Joint, SmoothError> {
        let newest = self.checked(self.len().saturating_sub(1) as u32)?;
        let m = self.covariances.newest;
        let part = |&j: &u32| {
            self.checked(j)?;
            let marginal = self.marginal(j);
            // Σ_tj = Ad(x_t⁻¹x_k) Σ_kj along the chain after k.
            let (k, at_k) = if j > m { (j, marginal) } else { (m, self.covariances.cross_with_newest(j)) };
            Ok(JointPart { j, marginal, cross: self.transport(newest, k) * at_k })
        };
        let others = candidates.iter().map(part).collect::<Result<_, _>>()?;
        Ok(Joint { newest, marginal: self.marginal(newest), others })
    }

    /// Predicted pose of a in the frame of each candidate, with its covariance.
    ///
    /// Linear in the candidates where a is the newest pose or was added since the last solution;
    /// one sparse solve more for an older a.
    pub fn relative(&self, a: u32, candidates: &[u32]) -> Result<Vec<Relative>, SmoothError> {
        self.checked(a)?;
        for &i in candidates {
            self.checked(i)?;
        }
        let m = self.covariances.newest;
        let column = self.covariances.column(a.min(m));
        let along_chain = self.along_chain(a, candidates);
        let covariance = |i: u32| match (a > m, i > m) {
            (true, true) => along_chain[(i - m - 1) as usize],
            (_, false) => {
                let to_base = self.covariances.relative(&self.poses, &column, i);
                sandwich(&self.transport(a, a.min(m)), &to_base) + self.since_newest(a)
            }
            (false, true) => {
                let to_base = self.covariances.relative(&self.poses, &column, m);
                // That is x_m⁻¹x_a in frame a; on to x_i, still in frame a.
                to_base + sandwich(&self.transport(a, i), &self.since_newest(i))
            }
        };
        let one = |&i: &u32| Relative {
            i,
            i_from_a: self.pose(i).between(&self.pose(a)),
            covariance: symmetrised(&covariance(i)),
        };
        Ok(candidates.iter().map(one).collect())
    }

    /// Covariance of `xᵢ⁻¹x_a`, frame of a, for every i after the last solution's newest pose m
    /// down to (and up to) the outermost candidate, by i − m − 1. Empty if a is not after m.
    fn along_chain(&self, a: u32, candidates: &[u32]) -> Vec<Matrix3<f64>> {
        let m = self.covariances.newest;
        if a <= m {
            return Vec::new();
        }
        let lowest = candidates.iter().copied().filter(|&i| i > m).min().unwrap_or(a).min(a);
        let highest = candidates.iter().copied().max().unwrap_or(a).max(a);
        let mut all = vec![Matrix3::zeros(); (highest - m) as usize];
        let slot = |i: u32| (i - m - 1) as usize;
        // The link into pose k adds its Q, which lives in frame k.
        let link = |k: u32| sandwich(&self.transport(a, k), &self.chain[k as usize - 1].covariance);
        for i in (lowest..a).rev() {
            all[slot(i)] = all[slot(i + 1)] + link(i + 1);
        }
        for i in a + 1..=highest {
            all[slot(i)] = all[slot(i - 1)] + link(i);
        }
        all
    }

    /// Ad(x_to⁻¹ x_from): moves a perturbation from one frame to another.
    fn transport(&self, to: u32, from: u32) -> Matrix3<f64> {
        self.pose(to).between(&self.pose(from)).adjoint()
    }

    /// Covariance of `x_m⁻¹x_k`, m the newest pose of the last solution; zero up to m.
    fn since_newest(&self, k: u32) -> Matrix3<f64> {
        self.tail_of(k).map_or_else(Matrix3::zeros, |tail| tail.since_newest)
    }

    fn tail_of(&self, i: u32) -> Option<&Tail> {
        let after = i.checked_sub(self.covariances.newest + 1)?;
        self.tail.get(after as usize)
    }

    fn checked(&self, i: u32) -> Result<u32, SmoothError> {
        if (i as usize) < self.len() {
            return Ok(i);
        }
        Err(SmoothError::NoSuchPose { pose: i, len: self.len() })
    }
}
