//! Motions of the plane and their small errors: twists (x, y, yaw), metres and radians.

use super::super::geom::wrap;
use nalgebra::{Matrix3, Vector3};
use std::f64::consts::TAU;
use toponym_proto::Pose;

/// The covariance m seen through a: `a m aᵀ`.
pub(super) fn through(a: &Matrix3<f64>, m: &Matrix3<f64>) -> Matrix3<f64> {
    a * m * a.transpose()
}

/// `log N(e; 0, m)`; nothing is possible by a covariance that is none.
pub(super) fn log_normal(e: &Vector3<f64>, m: &Matrix3<f64>) -> f64 {
    m.cholesky().map_or(f64::NEG_INFINITY, |root| {
        let log_root_det: f64 = root.l().diagonal().iter().map(|d| d.ln()).sum();
        -0.5 * e.dot(&root.solve(e)) - log_root_det - 1.5 * TAU.ln()
    })
}

/// The twist whose exponential is the motion.
pub(super) fn log(motion: &Pose) -> Vector3<f64> {
    let yaw = wrap(motion.yaw_rad);
    let half = yaw / 2.0;
    let straight = if half.abs() < 1e-6 { 1.0 } else { half / half.tan() };
    Vector3::new(straight * motion.x_m + half * motion.y_m, straight * motion.y_m - half * motion.x_m, yaw)
}

/// Adjoint of `motion⁻¹`: a twist before the motion, seen after it.
pub(super) fn carried_over(motion: &Pose) -> Matrix3<f64> {
    let (s, c) = motion.yaw_rad.sin_cos();
    let (x, y) = (motion.x_m, motion.y_m);
    Matrix3::new(c, s, s * x - c * y, -s, c, c * x + s * y, 0.0, 0.0, 1.0)
}

#[cfg(test)]
mod tests {
    use super::super::super::geom::{between, compose};
    use super::*;

    /// exp(twist) by many small steps.
    fn exp(twist: Vector3<f64>) -> Pose {
        let n = 100_000;
        let step = twist / f64::from(n);
        let step = Pose { x_m: step[0], y_m: step[1], yaw_rad: step[2] };
        (0..n).fold(Pose::default(), |at, _| compose(&at, &step))
    }

    #[test]
    fn log_undoes_exp_and_wraps() {
        for twist in [[1.0, 0.5, 1.2], [0.3, -2.0, -2.9], [1.0, 2.0, 0.0]] {
            let twist = Vector3::from(twist);
            let got = log(&exp(twist));
            assert!((got - twist).amax() < 1e-4, "{got:?}, not {twist:?}");
        }
        let around = Pose { yaw_rad: std::f64::consts::TAU + 0.1, ..Pose::default() };
        assert!((log(&around)[2] - 0.1).abs() < 1e-12);
    }

    #[test]
    fn a_twist_is_carried_over_a_motion() {
        let motion = Pose { x_m: 2.0, y_m: -1.0, yaw_rad: 0.8 };
        let twist = Vector3::new(1e-3, -2e-3, 1.5e-3);
        // exp(twist) ∘ motion = motion ∘ exp(carried)
        let got = log(&between(&motion, &compose(&exp(twist), &motion)));
        let want = carried_over(&motion) * twist;
        assert!((got - want).amax() < 1e-8, "{got:?}, not {want:?}");
    }

    #[test]
    fn a_normal_density_is_that_of_its_matrix() {
        let alone = log_normal(&Vector3::x(), &Matrix3::from_diagonal(&Vector3::new(4.0, 1.0, 1.0)));
        let want = -0.125 - 2f64.ln() - 1.5 * std::f64::consts::TAU.ln();
        assert!((alone - want).abs() < 1e-12, "{alone}, not {want}");
        let m = Matrix3::new(4.0, 1.0, 0.5, 1.0, 3.0, -0.2, 0.5, -0.2, 2.0);
        let e = Vector3::new(1.0, -2.0, 0.5);
        let exponent = log_normal(&e, &m) - log_normal(&Vector3::zeros(), &m);
        assert!((exponent + 0.5 * e.dot(&(m.try_inverse().unwrap() * e))).abs() < 1e-12);
        assert!(log_normal(&e, &Matrix3::zeros()).is_infinite());
    }
}
