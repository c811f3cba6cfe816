//! Between-factors: their error, its linearisation, and the checks an information matrix passes.

use crate::geometry::{Pose2, wrap};
use crate::smoothing::SmoothError;
use nalgebra::{Matrix3, Vector3};
use serde::{Deserialize, Serialize};

/// Asymmetry tolerated in an information matrix, as a share of its largest entry: rounding, no more.
const ASYMMETRY_MAX: f64 = 1e-9;

/// A measured relative pose z of two places: error `e = z⁻¹ · xᵢ⁻¹xⱼ` as (x, y, yaw), cost `eᵀ Ω e`.
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
    /// Minus half the gradient of the cost.
    pub b_i: Vector3<f64>,
    pub b_j: Vector3<f64>,
}

/// A factor's error and its derivatives.
pub(super) struct Residual {
    pub error: Vector3<f64>,
    /// ∂e/∂δᵢ and ∂e/∂δⱼ.
    pub j_i: Matrix3<f64>,
    pub j_j: Matrix3<f64>,
}

/// A pose to linearise at, with the cosine and sine of its yaw.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub(super) struct At {
    pub pose: Pose2,
    pub cos: f64,
    pub sin: f64,
}

impl At {
    pub fn new(pose: Pose2) -> Self {
        let (sin, cos) = pose.yaw_rad.sin_cos();
        Self { pose, cos, sin }
    }

    /// x ⊕ δ: x ∘ (δ as a pose).
    pub fn moved(&self, d: &[f64; 3]) -> Pose2 {
        let Pose2 { x_m, y_m, yaw_rad } = self.pose;
        let x_m = x_m + self.cos * d[0] - self.sin * d[1];
        let y_m = y_m + self.sin * d[0] + self.cos * d[1];
        Pose2 { x_m, y_m, yaw_rad: wrap(yaw_rad + d[2]) }
    }

    /// `self⁻¹ other`.
    fn between(&self, other: &Self) -> Pose2 {
        let (dx, dy) = (other.pose.x_m - self.pose.x_m, other.pose.y_m - self.pose.y_m);
        Pose2 {
            x_m: self.cos * dx + self.sin * dy,
            y_m: self.cos * dy - self.sin * dx,
            yaw_rad: other.pose.yaw_rad - self.pose.yaw_rad,
        }
    }
}

/// Error of a measured `z` and its derivatives at (xᵢ, xⱼ).
///
/// With R_z the rotation of z and t the translation of `xᵢ⁻¹xⱼ`, the error is
/// `(R_zᵀ (t − t_z), yaw − yaw_z)`: a step (ρ, φ) of xⱼ moves t by `Rᵢⱼ ρ` and yaw by φ, one of xᵢ
/// moves t by `−ρ − φ·(−t_y, t_x)` and yaw by −φ.
pub(super) fn residual(z: &At, x_i: &At, x_j: &At) -> Residual {
    let p = x_i.between(x_j);
    let (dx, dy) = (p.x_m - z.pose.x_m, p.y_m - z.pose.y_m);
    let (c, s) = (z.cos, z.sin);
    let error = Vector3::new(c * dx + s * dy, c * dy - s * dx, wrap(p.yaw_rad - z.pose.yaw_rad));
    // R_zᵀ Rᵢⱼ, from the cosines and sines at hand.
    let (ci, si) = (c * x_i.cos - s * x_i.sin, s * x_i.cos + c * x_i.sin);
    let (cm, sm) = (ci * x_j.cos + si * x_j.sin, ci * x_j.sin - si * x_j.cos);
    let j_j = Matrix3::new(cm, -sm, 0.0, sm, cm, 0.0, 0.0, 0.0, 1.0);
    let (tx, ty) = (c * p.y_m - s * p.x_m, -c * p.x_m - s * p.y_m);
    let j_i = Matrix3::new(-c, -s, tx, s, -c, ty, 0.0, 0.0, -1.0);
    Residual { error, j_i, j_j }
}

impl Residual {
    /// Share of the normal equations `Σ Jᵀ Ω J δ = −Σ Jᵀ Ω e`.
    pub fn weighted(&self, information: &Matrix3<f64>) -> Linearised {
        let (w_i, w_j) = (information * self.j_i, information * self.j_j);
        let h_ii = self.j_i.tr_mul(&w_i);
        let h_ij = self.j_i.tr_mul(&w_j);
        let h_jj = self.j_j.tr_mul(&w_j);
        Linearised { h_ii, h_ij, h_jj, b_i: -w_i.tr_mul(&self.error), b_j: -w_j.tr_mul(&self.error) }
    }
}

impl Factor {
    /// `eᵀ Ω e` at two poses; z with its cosine and sine.
    pub(super) fn cost(&self, z: &At, x_i: &At, x_j: &At) -> f64 {
        let e = residual(z, x_i, x_j).error;
        e.dot(&(self.information * e))
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

/// The information matrix made exactly symmetric.
pub(super) fn checked_information(information: &Matrix3<f64>) -> Result<Matrix3<f64>, SmoothError> {
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
    Ok(symmetric)
}

/// (M + Mᵀ)/2.
pub(super) fn symmetrised(m: &Matrix3<f64>) -> Matrix3<f64> {
    (m + m.transpose()) * 0.5
}

/// `F M Fᵀ`.
pub(super) fn sandwich(f: &Matrix3<f64>, m: &Matrix3<f64>) -> Matrix3<f64> {
    f * m * f.transpose()
}
