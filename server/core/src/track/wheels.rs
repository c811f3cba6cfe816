//! Online calibration of wheel odometry, and what its increments are worth.
//!
//! While the laser sees, the motion that registration found over some decimetres of path tells what
//! odometry got wrong. Three systematic errors are estimated by a Kalman filter,
//!
//! ```text
//! d  = (1 + s) d_odom                    s: scale (tyres' pressure)
//! ψ  = (1 + k) ψ_odom + b d_odom         k: scale of turns (track width), b: unequal wheels
//! ```
//!
//! and what they leave over is noise that grows with path and turning, as a random walk:
//! `σ_d² = f_d (q_d d + q_dψ |ψ|)`, `σ_ψ² = f_ψ (q_ψd d + q_ψ |ψ|)`. The factors f are learned from the
//! innovations, so that a blind stretch is bridged with a covariance that fits this robot. A slip has
//! a heavy tail: it counts with the weight of a Student distribution.

use crate::geometry::{Pose2, wrap};
use nalgebra::{Matrix2, Matrix3, Vector2, Vector3};
use serde::{Deserialize, Serialize};

/// Variance per metre of path, and per radian turned, that a robot is thought to have at first: 4 cm
/// and 2° after a metre, 3 cm and 3° after a radian.
const D_PER_M: f64 = 0.04 * 0.04;
const D_PER_RAD: f64 = 0.03 * 0.03;
const YAW_PER_M: f64 = 0.035 * 0.035;
const YAW_PER_RAD: f64 = 0.05 * 0.05;
/// Variance per second at rest: encoders tick, floors shake.
const D_PER_S: f64 = 1e-6;
const YAW_PER_S: f64 = 2.5e-7;
/// Systematic errors thought possible at first, one standard deviation.
const SCALE_SIGMA: f64 = 0.05;
const BEND_SIGMA_RAD_PER_M: f64 = 0.02;
const TURN_SIGMA: f64 = 0.05;
/// They wander by so much over 100 m or 100 rad.
const SCALE_WANDER: f64 = 0.005;
const BEND_WANDER_RAD_PER_M: f64 = 0.002;
const TURN_WANDER: f64 = 0.01;
/// No wheels are worse; what seems worse is a slip or a false fit.
const SCALE_MAX: f64 = 0.25;
const BEND_MAX_RAD_PER_M: f64 = 0.15;
const TURN_MAX: f64 = 0.25;
/// Motion that is compared with registration at a time.
const WINDOW_M: f64 = 0.5;
const WINDOW_RAD: f64 = 0.5;
/// Longer ones had a blind stretch in them.
const WINDOW_MAX_M: f64 = 3.0;
/// Degrees of freedom of the heavy tail.
const TAIL: f64 = 4.0;
/// Windows that the first guess of the noise counts for, and those remembered.
const NOISE_PRIOR: f64 = 6.0;
const NOISE_KEPT: f64 = 80.0;
const NOISE_MIN: f64 = 0.01;
const NOISE_MAX: f64 = 30.0;

/// A factor on a variance, learned from innovations.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
struct Noise {
    factor: f64,
    weight: f64,
}

impl Noise {
    const FIRST: Self = Self { factor: 1.0, weight: NOISE_PRIOR };

    /// Takes a squared innovation of which `own` is this noise's variance without the factor and
    /// `other` that of everything else.
    fn learn(&mut self, squared: f64, own: f64, other: f64) {
        let mine = self.factor * own;
        // What else is uncertain hides this noise.
        let weight = (mine / (mine + other)).powi(2);
        let seen = (squared - other).clamp(0.0, 9.0 * (mine + other)) / own.max(1e-12);
        self.weight = (self.weight + weight).min(NOISE_KEPT);
        self.factor += (seen - self.factor) * weight / self.weight;
        self.factor = self.factor.clamp(NOISE_MIN, NOISE_MAX);
    }
}

/// Motion since the scans last told the pose, or since a window began.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
struct Run {
    /// Calibrated odometry.
    pose: Pose2,
    /// Signed distance and turn.
    forward_m: f64,
    turn_rad: f64,
    /// Lengths, whatever the sign.
    path_m: f64,
    turned_rad: f64,
}

impl Run {
    fn add(&mut self, increment: &Pose2, calibrated: &Pose2) {
        self.pose = self.pose.compose(calibrated);
        self.forward_m += increment.x_m;
        self.turn_rad += wrap(increment.yaw_rad);
        self.path_m += increment.x_m.hypot(increment.y_m);
        self.turned_rad += wrap(increment.yaw_rad).abs();
    }
}

/// What is known of a robot's wheels.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Wheels {
    scale: f64,
    scale_variance: f64,
    /// b and k.
    bend: Vector2<f64>,
    bend_covariance: Matrix2<f64>,
    noise_d: Noise,
    noise_yaw: Noise,
    /// Since the scans last told the pose.
    unseen: Run,
    /// Since this pose, known with this covariance, was told.
    window: Option<(Pose2, Matrix3<f64>)>,
    run: Run,
}

impl Default for Wheels {
    fn default() -> Self {
        Self {
            scale: 0.0,
            scale_variance: SCALE_SIGMA.powi(2),
            bend: Vector2::zeros(),
            bend_covariance: Matrix2::from_diagonal(&Vector2::new(
                BEND_SIGMA_RAD_PER_M.powi(2),
                TURN_SIGMA.powi(2),
            )),
            noise_d: Noise::FIRST,
            noise_yaw: Noise::FIRST,
            unseen: Run::default(),
            window: None,
            run: Run::default(),
        }
    }
}

impl Wheels {
    /// An increment of odometry, calibrated, and the covariance (right perturbation) that it adds.
    pub fn drive(&mut self, increment: &Pose2, dt_s: f64) -> (Pose2, Matrix3<f64>) {
        let (forward_m, turn_rad) = (increment.x_m, wrap(increment.yaw_rad));
        let calibrated = Pose2::new(
            increment.x_m * (1.0 + self.scale),
            increment.y_m * (1.0 + self.scale),
            turn_rad + self.bend.x * forward_m + self.bend.y * turn_rad,
        );
        let mut run = Run::default();
        run.add(increment, &calibrated);
        // Systematic errors add up, not their squares: what they add to the variance grows with the
        // motion since the last look.
        let before = Vector2::new(self.unseen.forward_m, self.unseen.turn_rad);
        let after = before + Vector2::new(forward_m, turn_rad);
        let of_bend = |v: &Vector2<f64>| (v.transpose() * self.bend_covariance * v).x;
        let grown_d = self.scale_variance * (after.x * after.x - before.x * before.x).max(0.0);
        let grown_yaw = (of_bend(&after) - of_bend(&before)).max(0.0);
        let d = self.noise_d.factor * variance_d(&run) + D_PER_S * dt_s + 1e-10;
        let yaw = self.noise_yaw.factor * variance_yaw(&run) + YAW_PER_S * dt_s + 1e-11 + grown_yaw;
        self.unseen.add(increment, &calibrated);
        self.run.add(increment, &calibrated);
        (calibrated, Matrix3::from_diagonal(&Vector3::new(d + grown_d, d, yaw)))
    }

    /// Path since the scans last told the pose.
    pub fn unseen_m(&self) -> f64 {
        self.unseen.path_m
    }

    /// How much the robot turned, to either side, since the scans last told the pose.
    pub fn unseen_rad(&self) -> f64 {
        self.unseen.turned_rad
    }

    /// The scans told the pose: learns from the motion since a while ago.
    pub fn told(&mut self, map_from_body: &Pose2, covariance: &Matrix3<f64>) {
        self.unseen = Run::default();
        let long = self.run.path_m >= WINDOW_M || self.run.turned_rad >= WINDOW_RAD;
        if let Some((from, from_covariance)) = self.window {
            if !long {
                return;
            }
            if self.run.path_m <= WINDOW_MAX_M {
                self.learn(&from.between(map_from_body), &(from_covariance + covariance));
            }
        }
        self.window = Some((*map_from_body, *covariance));
        self.run = Run::default();
    }

    /// The pose has no more to do with the one before.
    pub fn lift(&mut self) {
        self.unseen = Run::default();
        self.window = None;
        self.run = Run::default();
    }

    fn learn(&mut self, moved: &Pose2, fixes: &Matrix3<f64>) {
        let run = self.run;
        let off = run.pose.between(moved).log();
        // Scale.
        let (own, fix) = (variance_d(&run), fixes[(0, 0)].max(fixes[(1, 1)]));
        self.scale_variance += SCALE_WANDER.powi(2) * run.path_m / 100.0;
        let known = self.scale_variance * run.forward_m.powi(2);
        let noise = self.noise_d.factor * own + fix;
        let spread = known + noise / weight(off.x * off.x / (known + noise));
        self.noise_d.learn(f64::midpoint(off.x * off.x, off.y * off.y), own, known / 2.0 + fix);
        let gain = self.scale_variance * run.forward_m / spread;
        self.scale = (self.scale + gain * off.x).clamp(-SCALE_MAX, SCALE_MAX);
        self.scale_variance *= 1.0 - gain * run.forward_m;
        // Yaw.
        let (own, fix) = (variance_yaw(&run), fixes[(2, 2)]);
        self.bend_covariance[(0, 0)] += BEND_WANDER_RAD_PER_M.powi(2) * run.path_m / 100.0;
        self.bend_covariance[(1, 1)] += TURN_WANDER.powi(2) * run.turned_rad / 100.0;
        let h = Vector2::new(run.forward_m, run.turn_rad);
        let ph = self.bend_covariance * h;
        let known = h.dot(&ph);
        let noise = self.noise_yaw.factor * own + fix;
        let spread = known + noise / weight(off.z * off.z / (known + noise));
        self.noise_yaw.learn(off.z * off.z, own, known + fix);
        self.bend += ph * (off.z / spread);
        self.bend.x = self.bend.x.clamp(-BEND_MAX_RAD_PER_M, BEND_MAX_RAD_PER_M);
        self.bend.y = self.bend.y.clamp(-TURN_MAX, TURN_MAX);
        self.bend_covariance -= ph * ph.transpose() / spread;
    }
}

/// Weight of an innovation by its Mahalanobis distance²: none of a slip is believed.
fn weight(distance2: f64) -> f64 {
    ((TAIL + 1.0) / (TAIL + distance2)).min(1.0)
}

fn variance_d(run: &Run) -> f64 {
    D_PER_M * run.path_m + D_PER_RAD * run.turned_rad
}

fn variance_yaw(run: &Run) -> f64 {
    YAW_PER_M * run.path_m + YAW_PER_RAD * run.turned_rad
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::{Purpose, uniform};

    /// What a robot's wheels do wrong: scale, yaw per metre, and noise of both per root metre.
    struct Robot {
        scale: f64,
        bend_rad_per_m: f64,
        noise_m: f64,
        noise_rad: f64,
    }

    fn gauss(step: u64, draw: u64) -> f64 {
        let u = |k| uniform(7, step, draw * 16 + k, Purpose::Test);
        (0..12).map(u).sum::<f64>() - 6.0
    }

    /// Drives `steps` of 10 cm in a gentle curve, its true pose told to 5 mm and .1° by scans unless it
    /// is blind, and returns truth and what odometry was made of, with its covariance.
    fn drive(
        wheels: &mut Wheels,
        robot: &Robot,
        steps: std::ops::Range<u64>,
        blind: bool,
    ) -> (Pose2, Pose2, Matrix3<f64>) {
        let (mut truth, mut made, mut covariance) = (Pose2::default(), Pose2::default(), Matrix3::zeros());
        let told = Matrix3::from_diagonal(&Vector3::new(2.5e-5, 2.5e-5, 3e-6));
        for k in steps {
            let step = Pose2::new(0.1, 0.0, 0.05 * (k as f64 * 0.01).sin());
            let root = 0.1f64.sqrt();
            let odometry = Pose2::new(
                step.x_m * (1.0 - robot.scale) + robot.noise_m * root * gauss(k, 0),
                0.0,
                step.yaw_rad - robot.bend_rad_per_m * 0.1 + robot.noise_rad * root * gauss(k, 1),
            );
            let (increment, q) = wheels.drive(&odometry, 0.1);
            let f = increment.inverse().adjoint();
            covariance = f * covariance * f.transpose() + q;
            truth = truth.compose(&step);
            made = made.compose(&increment);
            if !blind {
                let off = Vector3::new(0.005 * gauss(k, 2), 0.005 * gauss(k, 3), 0.0017 * gauss(k, 4));
                wheels.told(&truth.compose(&Pose2::exp(&off)), &told);
            }
        }
        (truth, made, covariance)
    }

    #[test]
    fn scale_and_bias_are_learned_while_the_laser_sees() {
        let robot = Robot { scale: 0.06, bend_rad_per_m: 0.03, noise_m: 0.01, noise_rad: 0.01 };
        let mut wheels = Wheels::default();
        drive(&mut wheels, &robot, 0..1000, false);
        let (truth, made, _) = drive(&mut wheels, &robot, 1000..1200, true);
        // Uncalibrated it would be off by 34° after 20 m.
        let off = truth.between(&made);
        assert!(off.yaw_rad.abs() < 0.15 && off.x_m.hypot(off.y_m) < 1.2, "{off:?}");
    }

    #[test]
    fn the_covariance_of_a_blind_stretch_fits_the_robot() {
        for (noise_m, noise_rad) in [(0.003, 0.003), (0.02, 0.035), (0.08, 0.1)] {
            let robot = Robot { scale: 0.02, bend_rad_per_m: 0.004, noise_m, noise_rad };
            let mut wheels = Wheels::default();
            let (mut covered, mut sum, n) = (0, 0.0, 60);
            drive(&mut wheels, &robot, 0..1000, false);
            for run in 0..n {
                let from = 1000 + run * 300;
                drive(&mut wheels, &robot, from..from + 200, false);
                let (truth, made, covariance) = drive(&mut wheels, &robot, from + 200..from + 300, true);
                let off = truth.between(&made).log();
                let distance2 = off.dot(&(covariance.try_inverse().unwrap() * off));
                covered += u32::from(distance2 < 7.815);
                sum += distance2 / 3.0;
            }
            let (share, mean) = (f64::from(covered) / n as f64, sum / n as f64);
            assert!(share >= 0.85 && mean > 0.1, "{noise_rad}: {share} covered, {mean} of the variance");
        }
    }

    #[test]
    fn a_slip_does_not_spoil_what_was_learned() {
        let robot = Robot { scale: 0.0, bend_rad_per_m: 0.0, noise_m: 0.01, noise_rad: 0.01 };
        let mut wheels = Wheels::default();
        drive(&mut wheels, &robot, 0..500, false);
        let before = wheels.clone();
        // Half a metre of wheels turning on the spot.
        for _ in 0..5 {
            wheels.drive(&Pose2::new(0.1, 0.0, 0.0), 0.1);
        }
        let here = before.window.map_or(Pose2::default(), |w| w.0);
        wheels.told(&here, &(Matrix3::identity() * 1e-5));
        assert!((wheels.scale - before.scale).abs() < 0.02, "{} after {}", wheels.scale, before.scale);
    }

    #[test]
    fn at_rest_nothing_is_learned_and_next_to_nothing_forgotten() {
        let mut wheels = Wheels::default();
        let mut sum = Matrix3::zeros();
        for _ in 0..600 {
            let (increment, q) = wheels.drive(&Pose2::default(), 0.1);
            assert_eq!(increment, Pose2::default());
            sum += q;
            wheels.told(&Pose2::default(), &(Matrix3::identity() * 1e-6));
        }
        assert!(sum[(0, 0)].sqrt() < 0.02 && sum[(2, 2)].sqrt() < 0.01);
        assert_eq!((wheels.scale, wheels.noise_yaw), (0.0, Noise::FIRST));
    }
}
