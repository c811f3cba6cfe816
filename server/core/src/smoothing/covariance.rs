//! Covariances at the last solution, as sums of positive parts.
//!
//! After a lost odometry the newest places may hang on the first by a link of 50 m and π rad,
//! and on one another by links of a centimetre. A relative covariance taken as a difference of
//! absolute ones (10⁴ m² and more) would lose its last digits and, in the end, its definiteness.
//! So we hold
//!
//! - `C = H_oo⁻¹`: covariances given the first *and* the newest pose of the solution (m),
//! - `D_j = −(H_oo⁻¹ H_om)_j`: how pose j follows a motion of m, with `D_0 = 0`, `D_m = I`,
//! - `Σ_m`: marginal of m given the first pose;
//!
//! and add what is positive: `Σ_ij = C_ij + D_i Σ_m D_jᵀ`. For a relative pose `xᵢ⁻¹x_a` with
//! `T = Ad(x_a⁻¹xᵢ)` the motion common to both drops out *before* Σ_m comes in:
//!
//! ```text
//! cov = C_aa − T C_ia − C_ai Tᵀ + T C_ii Tᵀ + G Σ_m Gᵀ,   G = D_a − T D_i
//! ```

use super::cholesky::Cholesky;
use super::factor::{sandwich, symmetrised};
use super::symbolic::ANCHORED;
use crate::geometry::Pose2;
use nalgebra::Matrix3;
use serde::{Deserialize, Serialize};

/// Covariance data of the poses `0..=newest` at a solution.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct Covariances {
    /// m, the newest pose of the solution.
    pub newest: u32,
    /// C_jj by pose.
    conditional: Vec<Matrix3<f64>>,
    /// D_j by pose.
    response: Vec<Matrix3<f64>>,
    /// Σ_m.
    newest_marginal: Matrix3<f64>,
    /// None where the first pose is alone.
    cholesky: Option<Cholesky>,
}

impl Covariances {
    /// The first pose alone: exactly known.
    pub fn origin() -> Self {
        Self {
            newest: 0,
            conditional: vec![Matrix3::zeros()],
            response: vec![Matrix3::identity()],
            newest_marginal: Matrix3::zeros(),
            cholesky: None,
        }
    }

    /// All poses of a solution.
    pub fn of(cholesky: Cholesky) -> Self {
        let position = &cholesky.symbolic.position;
        Self {
            newest: position.len() as u32 - 1,
            conditional: by_pose(position, &cholesky.conditional_marginals()),
            response: by_pose(position, &cholesky.response_to_last()),
            newest_marginal: cholesky.last_marginal(),
            cholesky: Some(cholesky),
        }
    }

    /// Σ_ii.
    pub fn marginal(&self, i: u32) -> Matrix3<f64> {
        let i = i as usize;
        symmetrised(&(self.conditional[i] + sandwich(&self.response[i], &self.newest_marginal)))
    }

    /// `Σ_mj = Σ_m D_jᵀ`.
    pub fn cross_with_newest(&self, j: u32) -> Matrix3<f64> {
        self.newest_marginal * self.response[j as usize].transpose()
    }

    /// What [`Covariances::relative`] needs of pose a: `C_ia` by pose i. One sparse solve; none
    /// for the newest.
    pub fn column(&self, a: u32) -> Column {
        let conditional = match &self.cholesky {
            Some(cholesky) if a > 0 && a != self.newest => {
                let position = &cholesky.symbolic.position;
                Some(by_pose(position, &cholesky.conditional_column(position[a as usize] as usize)))
            }
            _ => None,
        };
        Column { a, conditional }
    }

    /// Covariance of `xᵢ⁻¹x_a` (right perturbation, frame of a).
    pub fn relative(&self, poses: &[Pose2], column: &Column, i: u32) -> Matrix3<f64> {
        let (a, i) = (column.a as usize, i as usize);
        if a == i {
            return Matrix3::zeros();
        }
        let t = poses[a].between(&poses[i]).adjoint();
        let g = self.response[a] - t * self.response[i];
        let mut sum = sandwich(&t, &self.conditional[i]) + sandwich(&g, &self.newest_marginal);
        if let Some(conditional) = &column.conditional {
            let cross = t * conditional[i];
            sum += conditional[a] - cross - cross.transpose();
        }
        symmetrised(&sum)
    }
}

/// Covariances of every pose with one of them, given the first and the newest.
pub(super) struct Column {
    a: u32,
    /// None where they are all zero: a is the first or the newest.
    conditional: Option<Vec<Matrix3<f64>>>,
}

/// From elimination order to pose order; zero for the anchored pose.
fn by_pose(position: &[u32], blocks: &[Matrix3<f64>]) -> Vec<Matrix3<f64>> {
    let block = |&p: &u32| if p == ANCHORED { Matrix3::zeros() } else { blocks[p as usize] };
    position.iter().map(block).collect()
}
