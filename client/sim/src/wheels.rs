//! Wheels, which measure a robot's motion badly.

use super::random::Draw;

/// What wheel odometry gets wrong. Variances add up along the path.
#[derive(Clone, Debug, PartialEq)]
pub struct Wheels {
    /// Relative error of every distance: .01 measures 1 % too far.
    pub scale_error: f64,
    /// Relative error of every turn.
    pub turn_error: f64,
    /// Turn imagined per metre driven.
    pub yaw_bias_rad_per_m: f64,
    /// Standard deviation of the distance after one metre.
    pub noise_m: f64,
    /// Standard deviation of the heading after one metre.
    pub yaw_noise_rad: f64,
    /// Standard deviation of the heading after one radian turned.
    pub turn_noise_rad: f64,
}

impl Default for Wheels {
    fn default() -> Self {
        Self {
            scale_error: 0.01,
            turn_error: 0.01,
            yaw_bias_rad_per_m: 0.002,
            noise_m: 0.01,
            yaw_noise_rad: 0.012,
            turn_noise_rad: 0.02,
        }
    }
}

impl Wheels {
    /// Wheels as bad as any that mapping has to cope with: after a metre off by 5 % and 2°, after a
    /// radian by 5 %, and always a quarter of a degree per metre to the left.
    pub fn rough() -> Self {
        Self {
            scale_error: 0.0,
            turn_error: 0.0,
            yaw_bias_rad_per_m: 0.25_f64.to_radians(),
            noise_m: 0.05,
            yaw_noise_rad: 2_f64.to_radians(),
            turn_noise_rad: 0.05,
        }
    }

    /// Wheels that measure exactly.
    pub fn perfect() -> Self {
        Self {
            scale_error: 0.0,
            turn_error: 0.0,
            yaw_bias_rad_per_m: 0.0,
            noise_m: 0.0,
            yaw_noise_rad: 0.0,
            turn_noise_rad: 0.0,
        }
    }
}

/// What is known of a robot's wheels before it drives: standard deviations, about zero, of what
/// they always get wrong, and the noise itself.
#[derive(Clone, Debug, PartialEq)]
pub struct WheelsPrior {
    /// Of [`Wheels::scale_error`].
    pub scale: f64,
    /// Of [`Wheels::turn_error`].
    pub turn: f64,
    /// Of [`Wheels::yaw_bias_rad_per_m`].
    pub yaw_bias_rad_per_m: f64,
    /// [`Wheels::noise_m`].
    pub noise_m: f64,
    /// [`Wheels::yaw_noise_rad`].
    pub yaw_noise_rad: f64,
    /// [`Wheels::turn_noise_rad`].
    pub turn_noise_rad: f64,
}

impl WheelsPrior {
    /// Between wheels with [`Wheels::default`]'s noise (0) and [`Wheels::rough`] ones (1).
    pub fn between(roughness: f64) -> Self {
        let (fair, rough) = (Wheels::default(), Wheels::rough());
        let blend = |a: f64, b: f64| a + roughness * (b - a);
        Self {
            scale: 0.015,
            turn: 0.02,
            yaw_bias_rad_per_m: blend(fair.yaw_bias_rad_per_m, rough.yaw_bias_rad_per_m),
            noise_m: blend(fair.noise_m, rough.noise_m),
            yaw_noise_rad: blend(fair.yaw_noise_rad, rough.yaw_noise_rad),
            turn_noise_rad: blend(fair.turn_noise_rad, rough.turn_noise_rad),
        }
    }

    /// One robot's wheels.
    pub fn draw(&self, draw: &mut Draw) -> Wheels {
        Wheels {
            scale_error: self.scale * draw.normal(),
            turn_error: self.turn * draw.normal(),
            yaw_bias_rad_per_m: self.yaw_bias_rad_per_m * draw.normal(),
            noise_m: self.noise_m,
            yaw_noise_rad: self.yaw_noise_rad,
            turn_noise_rad: self.turn_noise_rad,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wheels_spread_as_their_prior_says() {
        let prior = WheelsPrior::between(0.5);
        let drawn: Vec<Wheels> = (0..2000).map(|seed| prior.draw(&mut Draw::new(seed, 0))).collect();
        let sigma = |f: fn(&Wheels) -> f64| {
            (drawn.iter().map(|w| f(w).powi(2)).sum::<f64>() / drawn.len() as f64).sqrt()
        };
        assert!((sigma(|w| w.scale_error) / prior.scale - 1.0).abs() < 0.06);
        assert!((sigma(|w| w.turn_error) / prior.turn - 1.0).abs() < 0.06);
        assert!((sigma(|w| w.yaw_bias_rad_per_m) / prior.yaw_bias_rad_per_m - 1.0).abs() < 0.06);
        assert!(drawn.iter().all(|w| w.noise_m.to_bits() == prior.noise_m.to_bits()));
    }
}
