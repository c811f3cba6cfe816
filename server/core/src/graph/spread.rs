//! A Gaussian over a pose in the map's axes, position and heading apart, and how much of it is near.

use libm::erf;
use nalgebra::Matrix3;
use std::f64::consts::{PI, SQRT_2};

/// A pose within this of the one told is where it was told …
pub const NEAR_M: f64 = 1.0;
/// … if its heading is within this, too.
pub const NEAR_RAD: f64 = 10.0 * PI / 180.0;
/// Steps of the quadrature; it errs by less than a thousandth.
const STEPS: u32 = 64;
/// Narrower Gaussians are points to the quadrature.
const SIGMA_MIN: f64 = 1e-4;

/// Covariance of a pose: of the position along the map's axes, m², and of the heading, rad². What ties the
/// two is left out: it matters where both are large, and there the pose is not known either way.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Spread {
    xx: f64,
    xy: f64,
    yy: f64,
    yaw: f64,
}

impl Spread {
    /// Of a covariance of the right perturbation of a pose with this heading.
    pub fn new(covariance: &Matrix3<f64>, yaw_rad: f64) -> Self {
        let (s, c) = yaw_rad.sin_cos();
        let (a, b, d) = (covariance[(0, 0)], covariance[(0, 1)], covariance[(1, 1)]);
        Self {
            xx: c * c * a - 2.0 * c * s * b + s * s * d,
            xy: c * s * (a - d) + (c * c - s * s) * b,
            yy: s * s * a + 2.0 * c * s * b + c * c * d,
            yaw: covariance[(2, 2)],
        }
    }

    /// Of the sum of two independent errors.
    #[must_use]
    pub fn plus(self, other: Self) -> Self {
        Self {
            xx: self.xx + other.xx,
            xy: self.xy + other.xy,
            yy: self.yy + other.yy,
            yaw: self.yaw + other.yaw,
        }
    }

    /// How large it is against what counts as near; of a sum it is the sum.
    pub fn size(&self) -> f64 {
        (self.xx + self.yy) / NEAR_M.powi(2) + self.yaw / NEAR_RAD.powi(2)
    }

    /// Probability of being within [`NEAR_M`] and [`NEAR_RAD`] of the origin, for a mean of (x, y, yaw).
    pub fn near(&self, mean: [f64; 3]) -> f64 {
        let [x_m, y_m, yaw_rad] = mean;
        let heading = between(-NEAR_RAD, NEAR_RAD, yaw_rad, sigma(self.yaw));
        let p = heading * self.near_position(x_m, y_m);
        if p.is_finite() { p } else { 0.0 }
    }

    /// Over the disc, along the wider axis u of the position: ∫ p(u) P(|v| < √(r² − u²)) du.
    fn near_position(&self, x_m: f64, y_m: f64) -> f64 {
        let (half, off) = (0.5 * (self.xx - self.yy), 0.5 * (self.xx + self.yy));
        let root = half.hypot(self.xy);
        let (s, c) = (0.5 * self.xy.atan2(half)).sin_cos();
        let (u_m, v_m) = (c * x_m + s * y_m, -s * x_m + c * y_m);
        let (wide, narrow) = (sigma(off + root), sigma(off - root));
        let from = (u_m - 6.0 * wide).clamp(-NEAR_M, NEAR_M);
        let to = (u_m + 6.0 * wide).clamp(-NEAR_M, NEAR_M);
        let step = (to - from) / f64::from(STEPS);
        let slice = |k: u32| {
            let (a, b) = (from + f64::from(k) * step, from + f64::from(k + 1) * step);
            let chord = (NEAR_M.powi(2) - (0.5 * (a + b)).powi(2)).max(0.0).sqrt();
            between(a, b, u_m, wide) * between(-chord, chord, v_m, narrow)
        };
        (0..STEPS).map(slice).sum()
    }
}

fn sigma(variance: f64) -> f64 {
    variance.max(0.0).sqrt().max(SIGMA_MIN)
}

/// P(a < x < b) of a Gaussian.
fn between(a: f64, b: f64, mean: f64, sigma: f64) -> f64 {
    let at = |x: f64| erf((x - mean) / (sigma * SQRT_2));
    0.5 * (at(b) - at(a))
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Vector3;

    fn of(x_m: f64, y_m: f64, yaw_rad: f64) -> Spread {
        let variances = Vector3::new(x_m * x_m, y_m * y_m, yaw_rad * yaw_rad);
        Spread::new(&Matrix3::from_diagonal(&variances), 0.0)
    }

    #[test]
    fn of_a_round_spread_it_is_rayleighs() {
        for sigma_m in [1e-5, 0.1, 0.4, 1.0, 5.0, 300.0_f64] {
            let want = 1.0 - (-0.5 / sigma_m.powi(2)).exp();
            let got = of(sigma_m, sigma_m, 1e-5).near([0.0; 3]);
            assert!((got - want).abs() < 1e-3, "{sigma_m}: {got} {want}");
        }
        let heading = of(0.0, 0.0, NEAR_RAD).near([0.0; 3]);
        assert!((heading - 0.682_689).abs() < 1e-4, "{heading}");
    }

    #[test]
    fn of_a_long_one_it_is_as_a_fine_sum_says_whichever_way_it_lies() {
        let covariance = Matrix3::from_diagonal(&Vector3::new(2.25, 0.09, 1e-9));
        let (mut sum, mut all) = (0.0, 0.0);
        for k in -600..=600 {
            for l in -600..=600 {
                let (u, v) = (f64::from(k) * 0.01, f64::from(l) * 0.01);
                let p = (-0.5 * (u * u + v * v)).exp();
                all += p;
                sum += if (0.5 + 1.5 * u).hypot(0.2 + 0.3 * v) < 1.0 { p } else { 0.0 };
            }
        }
        for yaw_rad in [0.0, 0.7, -2.0_f64] {
            let (s, c) = yaw_rad.sin_cos();
            let mean = [c * 0.5 - s * 0.2, s * 0.5 + c * 0.2, 0.0];
            let got = Spread::new(&covariance, yaw_rad).near(mean);
            assert!((got - sum / all).abs() < 2e-3, "{yaw_rad}: {got} {}", sum / all);
        }
    }

    #[test]
    fn a_point_is_near_or_not_and_nonsense_is_not() {
        assert!(of(0.0, 0.0, 0.0).near([0.7, 0.7, 0.1]) > 0.999);
        assert!(of(0.0, 0.0, 0.0).near([0.8, 0.8, 0.0]) < 1e-9);
        assert!(of(0.0, 0.0, 0.0).near([0.0, 0.0, 0.2]) < 1e-9);
        assert!(of(f64::INFINITY, 1.0, 0.1).near([0.0; 3]) < 1e-9);
        assert!(of(1.0, 1.0, 0.1).near([f64::NAN, 0.0, 0.0]) < 1e-9);
    }
}
