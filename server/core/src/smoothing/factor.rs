//! Between-factors: their error, its linearisation, and the checks an information matrix passes.

use super::SmoothError;
use crate::geometry::Pose2;
use nalgebra::{Matrix3, Vector3};
use serde::{Deserialize, Serialize};

/// Asymmetry tolerated in an information matrix, as a share of its largest entry: rounding, no more.
const ASYMMETRY_MAX: f64 = 1e-9;

/// A measured relative pose z of two places: error `e = log(z⁻¹ · xᵢ⁻¹xⱼ)`, cost `eᵀ Ω e`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Factor {
    /// The pose that z is expressed in.
    pub i: u32,
    /// The pose that z locates.
    pub j: u32,
    /// z: metres, radians.
    pub i_from_j: Pose2,
    /// Ω, inverse covariance of the right perturbation of z (frame j): 1/m², 1/rad².
    pub information: Matrix3<f64>,
}

/// One factor's share of the normal equations.
pub(super) struct Linearised {
    /// Hessian blocks of (i, i), (i, j), (j, j).
    pub h_ii: Matrix3<f64>,
    pub h_ij: Matrix3<f64>,
    pub h_jj: Matrix3<f64>,
    /// Half the gradient of the cost.
    pub g_i: Vector3<f64>,
    pub g_j: Vector3<f64>,
}

impl Factor {
    /// `e = log(z⁻¹ · xᵢ⁻¹xⱼ)`.
    pub(super) fn error(&self, poses: &[Pose2]) -> Vector3<f64> {
        let i_from_j = poses[self.i as usize].between(&poses[self.j as usize]);
        self.i_from_j.between(&i_from_j).log()
    }

    /// With `δj` the error moves by `Jr⁻¹(e) δj`, with `δi` by `−Jr⁻¹(e) Ad(xⱼ⁻¹xᵢ) δi`.
    pub(super) fn linearise(&self, poses: &[Pose2], e: &Vector3<f64>) -> Linearised {
        let jr = right_jacobian_inverse(e);
        let weighted = jr.transpose() * self.information;
        let h_jj = weighted * jr;
        let g_j = weighted * e;
        let h = -poses[self.j as usize].between(&poses[self.i as usize]).adjoint();
        let h_ij = h.transpose() * h_jj;
        Linearised { h_ii: h_ij * h, h_ij, h_jj, g_i: h.transpose() * g_j, g_j }
    }

    /// Refuses what is not a measurement between two of the first `len` poses.
    pub(super) fn check(&self, len: usize) -> Result<(), SmoothError> {
        for pose in [self.i, self.j] {
            if pose as usize >= len {
                return Err(SmoothError::NoSuchPose { pose, len });
            }
        }
        if self.i == self.j {
            return Err(SmoothError::SamePose(self.i));
        }
        if !self.i_from_j.is_finite() {
            return Err(SmoothError::NotFinite);
        }
        Ok(())
    }
}

/// The information matrix made exactly symmetric, and its inverse.
pub(super) fn checked_information(
    information: &Matrix3<f64>,
) -> Result<(Matrix3<f64>, Matrix3<f64>), SmoothError> {
    if information.iter().any(|v| !v.is_finite()) {
        return Err(SmoothError::NotFinite);
    }
    if (information - information.transpose()).amax() > ASYMMETRY_MAX * information.amax() {
        return Err(SmoothError::NotSymmetric);
    }
    let symmetric = symmetrised(information);
    let covariance = symmetric.cholesky().ok_or(SmoothError::NotPositiveDefinite)?.inverse();
    if covariance.iter().any(|v| !v.is_finite()) {
        return Err(SmoothError::NotPositiveDefinite);
    }
    Ok((symmetric, symmetrised(&covariance)))
}

/// (M + Mᵀ)/2.
pub(super) fn symmetrised(m: &Matrix3<f64>) -> Matrix3<f64> {
    (m + m.transpose()) * 0.5
}

/// `F M Fᵀ`.
pub(super) fn sandwich(f: &Matrix3<f64>, m: &Matrix3<f64>) -> Matrix3<f64> {
    f * m * f.transpose()
}

/// `Jr⁻¹(v)` of SE(2): `log(exp(v)·exp(δ)) = v + Jr⁻¹(v) δ + O(δ²)`.
///
/// `Jr⁻¹ = I + ad/2 + c·ad²` with `c = (1 − (w/2)·cot(w/2)) / w²`, since `ad³ = −w²·ad`.
pub(super) fn right_jacobian_inverse(v: &Vector3<f64>) -> Matrix3<f64> {
    let w = v.z;
    let half = w / 2.0;
    // The closed form cancels for small angles; its series is exact to 1e-16 there.
    let c = if w.abs() < 1e-2 {
        let w2 = w * w;
        (1.0 + w2 / 60.0 * (1.0 + w2 / 42.0)) / 12.0
    } else {
        (1.0 - half * half.cos() / half.sin()) / (w * w)
    };
    let ad = Matrix3::new(0.0, -w, v.y, w, 0.0, -v.x, 0.0, 0.0, 0.0);
    Matrix3::identity() + ad * 0.5 + ad * ad * c
}
