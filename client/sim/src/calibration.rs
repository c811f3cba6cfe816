//! What a laser that sees the motion teaches of the wheels.
//!
//! One step of the drive goes δ = (dx, dy, dθ) in the body frame, w metres far, and is measured
//! ([`Drive::measured`]) as
//!
//! ```text
//! mx = (1 + s) dx + ε₁,      ε₁ ~ N(0, noise_m² w)
//! my = (1 + s) dy
//! mθ = (1 + t) dθ + b w + ε₂,  ε₂ ~ N(0, yaw_noise² w + turn_noise² |dθ|)
//! ```

use super::geom::between;
use super::{Drive, WheelsPrior};
use nalgebra::{Matrix3, Vector3};
use toponym_proto::Pose;

/// Keeps what exact wheels measure from being infinitely certain: variance of a step, m² or rad².
const STEP_VARIANCE: f64 = 1e-14;

/// What is known of the systematic errors (s, t, b).
#[derive(Clone, Debug)]
pub(crate) struct Systematic {
    pub(crate) mean: Vector3<f64>,
    pub(crate) covariance: Matrix3<f64>,
}

impl Systematic {
    /// From the steps of the drive that a laser saw.
    ///
    /// Linear regression: mx − dx = s dx + ε₁ and mθ − dθ = t dθ + b w + ε₂ with the prior
    /// N(0, S²), S = diag(σ), give the covariance P = S (I + S Λ S)⁻¹ S, Λ = Σ a aᵀ/σ², and the
    /// mean P Σ a r/σ². The sideways motion is left out: robots here do not move sideways.
    pub(crate) fn learn(
        drive: &Drive,
        odometry: &Drive,
        prior: &WheelsPrior,
        steps: impl Iterator<Item = usize>,
    ) -> Self {
        let (mut information, mut pull) = (Matrix3::zeros(), Vector3::zeros());
        for k in steps {
            let (Some(truth), Some(measured)) = (step(drive, k), step(odometry, k)) else { continue };
            let [x_variance, yaw_variance] = variances(&truth, prior);
            for (row, residual, variance) in [
                (Vector3::new(truth.x_m, 0.0, 0.0), measured.x_m - truth.x_m, x_variance),
                (
                    Vector3::new(0.0, truth.yaw_rad, way_m(&truth)),
                    measured.yaw_rad - truth.yaw_rad,
                    yaw_variance,
                ),
            ] {
                let weight = 1.0 / (variance + STEP_VARIANCE);
                pull += row * residual * weight;
                information += row * row.transpose() * weight;
            }
        }
        // In this form, a σ of 0, an error known to be absent, is nothing special.
        let sigmas = Matrix3::from_diagonal(&Vector3::new(prior.scale, prior.turn, prior.yaw_bias_rad_per_m));
        let scaled = Matrix3::identity() + sigmas * information * sigmas;
        // The identity and more is positive definite, always.
        let known = scaled.cholesky().map_or_else(Matrix3::identity, |root| root.inverse());
        let covariance = sigmas * known * sigmas;
        Self { mean: covariance * pull, covariance }
    }
}

/// The motion from one pose to the next, body frame.
pub(crate) fn step(drive: &Drive, k: usize) -> Option<Pose> {
    Some(between(drive.poses.get(k)?, drive.poses.get(k + 1)?))
}

/// Length of a motion.
pub(crate) fn way_m(step: &Pose) -> f64 {
    step.x_m.hypot(step.y_m)
}

/// Variances of a step's measured way, m², and turn, rad², by noise.
pub(crate) fn variances(truth: &Pose, prior: &WheelsPrior) -> [f64; 2] {
    let (way_m, turn_rad) = (way_m(truth), truth.yaw_rad.abs());
    [
        prior.noise_m.powi(2) * way_m,
        prior.yaw_noise_rad.powi(2) * way_m + prior.turn_noise_rad.powi(2) * turn_rad,
    ]
}
