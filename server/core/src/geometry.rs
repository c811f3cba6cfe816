//! SE(2): poses, their composition, exponential map and adjoint.
//!
//! `X·exp(δ)` with δ = (x, y, yaw) in the body frame is the perturbation used everywhere.

use nalgebra::{Matrix3, Vector3};
use serde::{Deserialize, Serialize};
use std::f64::consts::{FRAC_PI_4, PI, TAU};

/// Wraps an angle to (−π, π].
pub fn wrap(angle_rad: f64) -> f64 {
    if angle_rad > -PI && angle_rad <= PI {
        return angle_rad;
    }
    let a = angle_rad.rem_euclid(TAU);
    if a > PI { a - TAU } else { a }
}

/// Whether a point lies in a polygon, by how often a ray from it crosses the outline.
pub fn is_inside(polygon: &[(f64, f64)], (x, y): (f64, f64)) -> bool {
    let next = polygon.iter().skip(1).chain(polygon.first());
    let crosses = |(a, b): &(&(f64, f64), &(f64, f64))| {
        (a.1 > y) != (b.1 > y) && x < a.0 + (y - a.1) / (b.1 - a.1) * (b.0 - a.0)
    };
    polygon.iter().zip(next).filter(crosses).count() % 2 == 1
}

/// Whether a point lies in a polygon, or nearer to its outline than that.
pub fn is_near(polygon: &[(f64, f64)], (x, y): (f64, f64), reach_m: f64) -> bool {
    let next = polygon.iter().skip(1).chain(polygon.first());
    let off_m = |(a, b): (&(f64, f64), &(f64, f64))| {
        let (dx, dy) = (b.0 - a.0, b.1 - a.1);
        let along = ((x - a.0) * dx + (y - a.1) * dy) / (dx * dx + dy * dy);
        let share = if along.is_finite() { along.clamp(0.0, 1.0) } else { 0.0 };
        (x - a.0 - share * dx).hypot(y - a.1 - share * dy)
    };
    is_inside(polygon, (x, y)) || polygon.iter().zip(next).any(|side| off_m(side) < reach_m)
}

/// A rigid transform of the plane, or the pose of a body.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Pose2 {
    /// Metres.
    pub x_m: f64,
    /// Metres.
    pub y_m: f64,
    /// Radians in (−π, π].
    pub yaw_rad: f64,
}

impl Pose2 {
    /// From metres and radians; the angle is wrapped.
    pub fn new(x_m: f64, y_m: f64, yaw_rad: f64) -> Self {
        Self { x_m, y_m, yaw_rad: wrap(yaw_rad) }
    }

    /// `self ∘ other`.
    #[must_use]
    pub fn compose(&self, other: &Self) -> Self {
        let (x_m, y_m) = self.apply(other.x_m, other.y_m);
        Self::new(x_m, y_m, self.yaw_rad + other.yaw_rad)
    }

    /// `self⁻¹`.
    #[must_use]
    pub fn inverse(&self) -> Self {
        let (s, c) = self.yaw_rad.sin_cos();
        Self::new(-c * self.x_m - s * self.y_m, s * self.x_m - c * self.y_m, -self.yaw_rad)
    }

    /// `self⁻¹ ∘ other`: other in the frame of self.
    #[must_use]
    pub fn between(&self, other: &Self) -> Self {
        let (s, c) = self.yaw_rad.sin_cos();
        let (dx, dy) = (other.x_m - self.x_m, other.y_m - self.y_m);
        Self::new(c * dx + s * dy, -s * dx + c * dy, other.yaw_rad - self.yaw_rad)
    }

    /// The point (x, y) of the body's frame in the outer frame, metres.
    pub fn apply(&self, x_m: f64, y_m: f64) -> (f64, f64) {
        let (s, c) = self.yaw_rad.sin_cos();
        (self.x_m + c * x_m - s * y_m, self.y_m + s * x_m + c * y_m)
    }

    /// Exponential map of a twist (x, y, yaw).
    pub fn exp(v: &Vector3<f64>) -> Self {
        let w = v.z;
        let (a, b) =
            if w.abs() < 1e-6 { (1.0 - w * w / 6.0, w / 2.0) } else { (w.sin() / w, (1.0 - w.cos()) / w) };
        Self::new(a * v.x - b * v.y, b * v.x + a * v.y, w)
    }

    /// Logarithm: inverse of [`Pose2::exp`].
    pub fn log(&self) -> Vector3<f64> {
        let w = self.yaw_rad;
        let half = w / 2.0;
        let a = if w.abs() < 1e-6 { 1.0 - w * w / 12.0 } else { half * half.cos() / half.sin() };
        Vector3::new(a * self.x_m + half * self.y_m, -half * self.x_m + a * self.y_m, w)
    }

    /// Adjoint: `X·exp(δ)·X⁻¹ = exp(Ad_X δ)`.
    pub fn adjoint(&self) -> Matrix3<f64> {
        let (s, c) = self.yaw_rad.sin_cos();
        Matrix3::new(c, -s, self.y_m, s, c, -self.x_m, 0.0, 0.0, 1.0)
    }

    /// Distance between the origins, metres.
    pub fn distance_m(&self, other: &Self) -> f64 {
        (self.x_m - other.x_m).hypot(self.y_m - other.y_m)
    }

    /// Whether all three numbers are finite.
    pub fn is_finite(&self) -> bool {
        self.x_m.is_finite() && self.y_m.is_finite() && self.yaw_rad.is_finite()
    }

    /// The pose a share `f` of the way from self (0) to other (1): translation and yaw blended.
    #[must_use]
    pub fn blend(&self, other: &Self, f: f64) -> Self {
        Self::new(
            self.x_m + f * (other.x_m - self.x_m),
            self.y_m + f * (other.y_m - self.y_m),
            self.yaw_rad + f * wrap(other.yaw_rad - self.yaw_rad),
        )
    }
}

/// Covariance of `a⁻¹∘b` (right perturbation) from those of a and b and the cross term
/// `Σ_ab = E[δa δbᵀ]`.
pub fn relative_covariance(
    a: &Pose2,
    b: &Pose2,
    cov_a: &Matrix3<f64>,
    cov_b: &Matrix3<f64>,
    cross_ab: &Matrix3<f64>,
) -> Matrix3<f64> {
    // exp(−δa)·a⁻¹b·exp(δb) = a⁻¹b·exp(−Ad_{b⁻¹a} δa + δb)
    let h = -b.between(a).adjoint();
    let m = h * cov_a * h.transpose() + h * cross_ab + (h * cross_ab).transpose() + cov_b;
    (m + m.transpose()) * 0.5
}

/// Directions from a robot's nose, by eighths to the left.
const SIDES: [&str; 8] = [
    "straight ahead",
    "ahead on the left",
    "on the left",
    "behind on the left",
    "behind",
    "behind on the right",
    "on the right",
    "ahead on the right",
];

/// A bearing in words.
pub fn side(bearing_rad: f64) -> &'static str {
    SIDES[((bearing_rad / FRAC_PI_4).round() as i32).rem_euclid(8) as usize]
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn pose() -> impl Strategy<Value = Pose2> {
        (-50.0..50.0, -50.0..50.0, -3.1..3.1).prop_map(|(x, y, a)| Pose2::new(x, y, a))
    }

    fn near(a: &Pose2, b: &Pose2) -> bool {
        a.distance_m(b) < 1e-9 && wrap(a.yaw_rad - b.yaw_rad).abs() < 1e-9
    }

    #[test]
    fn inside_is_what_the_outline_surrounds() {
        let mut angle = vec![(0.0, 0.0), (4.0, 0.0), (4.0, 1.0), (1.0, 1.0), (1.0, 4.0), (0.0, 4.0)];
        for _ in 0..2 {
            for (point, inside) in
                [((0.5, 3.0), true), ((3.0, 0.5), true), ((2.0, 2.0), false), ((-1.0, 0.5), false)]
            {
                assert_eq!(is_inside(&angle, point), inside, "{point:?}");
            }
            angle.reverse();
        }
        assert!(!is_inside(&[], (0.0, 0.0)));
        let twice = [(0.0, 0.0), (0.0, 0.0), (4.0, 0.0), (4.0, 4.0)];
        for (point, near) in
            [((4.2, 2.0), true), ((4.4, 2.0), false), ((-0.2, -0.2), true), ((3.0, 1.0), true)]
        {
            assert_eq!(is_near(&twice, point, 0.3), near, "{point:?}");
        }
    }

    proptest! {
        #[test]
        fn group_laws(a in pose(), b in pose(), c in pose()) {
            prop_assert!(near(&a.compose(&a.inverse()), &Pose2::default()));
            prop_assert!(near(&a.compose(&b).compose(&c), &a.compose(&b.compose(&c))));
            prop_assert!(near(&a.between(&b), &a.inverse().compose(&b)));
            prop_assert!(near(&Pose2::exp(&a.log()), &a));
        }

        #[test]
        fn adjoint_moves_a_perturbation_across(a in pose(), x in -0.5..0.5, y in -0.5..0.5, w in -0.5..0.5) {
            let d = Vector3::new(x, y, w);
            let left = a.compose(&Pose2::exp(&d)).compose(&a.inverse());
            prop_assert!(near(&left, &Pose2::exp(&(a.adjoint() * d))));
        }

        #[test]
        fn relative_covariance_is_the_linearised_spread(a in pose(), b in pose()) {
            // Numerical Jacobians of log((a⁻¹b)⁻¹ · (a·exp δa)⁻¹(b·exp δb)).
            let z = a.between(&b);
            let eps = 1e-6;
            let mut ja = Matrix3::zeros();
            let mut jb = Matrix3::zeros();
            for k in 0..3 {
                let mut d = Vector3::zeros();
                d[k] = eps;
                let pa = a.compose(&Pose2::exp(&d)).between(&b);
                let pb = a.between(&b.compose(&Pose2::exp(&d)));
                ja.set_column(k, &(z.between(&pa).log() / eps));
                jb.set_column(k, &(z.between(&pb).log() / eps));
            }
            let (ca, cb) = (Matrix3::from_diagonal(&Vector3::new(0.1, 0.2, 0.01)), Matrix3::identity() * 0.05);
            let want = ja * ca * ja.transpose() + jb * cb * jb.transpose();
            let got = relative_covariance(&a, &b, &ca, &cb, &Matrix3::zeros());
            prop_assert!((want - got).norm() < 1e-3 * (1.0 + want.norm()));
        }
    }
}
