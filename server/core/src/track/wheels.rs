//! Online calibration of wheel odometry, and what its increments are worth.
//!
//! While the laser sees, the motion that registration found over some decimetres of path tells what
//! odometry got wrong. Three systematic errors θ = (s, t, b) are estimated by a Kalman filter,
//!
//! ```text
//! d_odom = (1 + s) d                s: scale (tyres' pressure)
//! ψ_odom = (1 + t) ψ + b d          t: scale of turns (track width), b: unequal wheels
//! ```
//!
//! by regression of odometry on the motion seen and not the other way round: where what one regresses
//! on is noisy, slopes come out too small. What they leave over is noise that grows with path and
//! turning, as a random walk ([`noise`]). A slip has a heavy tail: it counts with the weight of a
//! Student distribution.
//!
//! Noise adds up as variances do, systematic errors as errors do: over a stretch in which nothing is
//! seen a pose is off by `e = G (θ − θ̂) + noise`, and a [`Drift`] carries both parts along.

mod noise;

use self::noise::{First, Look, Noise};
use crate::geometry::{Pose2, wrap};
use nalgebra::{Matrix3, Vector3};
use serde::{Deserialize, Serialize};

/// Noise of the distance and of the yaw that a robot is thought to have at first: in the mean, some 4 cm
/// and 2° after a metre, 3 cm and 3° after a radian.
const DISTANCE: First = First { per_m: 9e-4, per_rad: 3e-4, wild: 0.3 };
const YAW: First = First { per_m: 6e-4, per_rad: 1.2e-3, wild: 0.3 };
/// Variance per second at rest: encoders tick, floors shake.
const D_PER_S: f64 = 1e-6;
const YAW_PER_S: f64 = 2.5e-7;
/// Systematic errors (s, t, b) thought possible at first, one standard deviation: of b, that of wheels 40 cm
/// apart whose diameters differ by 0.4 %.
const ERRORS: Vector3<f64> = Vector3::new(0.05, 0.05, 0.01);
/// They wander by so much over 100 m, 100 rad and 100 m.
const WANDER: Vector3<f64> = Vector3::new(0.002, 0.003, 0.0005);
/// No wheels are worse; what seems worse is a slip or a false fit.
const ERRORS_MAX: Vector3<f64> = Vector3::new(0.25, 0.25, 0.15);
/// Motion that is compared with registration at a time, metres of path plus radians turned: windows of
/// different lengths tell noise, which grows with them, from what registration is off by, which does not.
const WINDOWS: [f64; 3] = [0.4, 0.8, 1.6];
/// Longer ones had a blind stretch in them.
const WINDOW_MAX: f64 = 4.0;
/// Degrees of freedom of the heavy tail.
const TAIL: f64 = 4.0;

/// What an increment of odometry says.
#[derive(Clone, Debug)]
pub struct Step {
    /// The motion, calibrated.
    pub motion: Pose2,
    /// Covariance of its error by noise, right perturbation.
    noise: Matrix3<f64>,
    /// Its error per systematic error.
    by_errors: Matrix3<f64>,
}

impl Step {
    /// A motion that wheels know nothing of.
    pub fn guess(motion: Pose2, noise: Matrix3<f64>) -> Self {
        Self { motion, noise, by_errors: Matrix3::zeros() }
    }
}

/// What a pose that is told by wheels alone is off by, right perturbation.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Drift {
    /// Covariance by noise.
    pub noise: Matrix3<f64>,
    /// G, its error per systematic error.
    pub by_errors: Matrix3<f64>,
}

impl Drift {
    /// By noise alone.
    pub fn of(noise: Matrix3<f64>) -> Self {
        Self { noise, by_errors: Matrix3::zeros() }
    }

    /// One step on.
    pub fn drive(&mut self, step: &Step) {
        let over = step.motion.inverse().adjoint();
        self.noise = over * self.noise * over.transpose() + step.noise;
        self.by_errors = over * self.by_errors + step.by_errors;
    }

    /// What the systematic errors make of it.
    pub fn systematic(&self, wheels: &Wheels) -> Matrix3<f64> {
        self.by_errors * wheels.covariance * self.by_errors.transpose()
    }

    /// All of it.
    pub fn covariance(&self, wheels: &Wheels) -> Matrix3<f64> {
        self.noise + self.systematic(wheels)
    }
}

/// Motion since a window began.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
struct Run {
    /// As odometry has it.
    pose: Pose2,
    /// Lengths, whatever the sign.
    path_m: f64,
    turned_rad: f64,
}

impl Run {
    fn add(&mut self, increment: &Pose2) {
        self.pose = self.pose.compose(increment);
        self.path_m += increment.x_m.hypot(increment.y_m);
        self.turned_rad += wrap(increment.yaw_rad).abs();
    }

    fn length(&self) -> f64 {
        self.path_m + self.turned_rad
    }
}

/// What is known of a robot's wheels.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Wheels {
    /// (s, t, b).
    errors: Vector3<f64>,
    covariance: Matrix3<f64>,
    distance: Noise,
    yaw: Noise,
    /// Path and turning since the scans last told the pose.
    unseen_m: f64,
    unseen_rad: f64,
    /// Since this pose, known with this covariance, was told.
    window: Option<(Pose2, Matrix3<f64>)>,
    run: Run,
    windows: usize,
}

impl Default for Wheels {
    fn default() -> Self {
        Self {
            errors: Vector3::zeros(),
            covariance: Matrix3::from_diagonal(&ERRORS.component_mul(&ERRORS)),
            distance: Noise::new(DISTANCE),
            yaw: Noise::new(YAW),
            unseen_m: 0.0,
            unseen_rad: 0.0,
            window: None,
            run: Run::default(),
            windows: 0,
        }
    }
}

impl Wheels {
    /// Takes an increment of odometry.
    pub fn drive(&mut self, increment: &Pose2, dt_s: f64) -> Step {
        let mut run = Run::default();
        run.add(increment);
        self.run.add(increment);
        self.unseen_m += run.path_m;
        self.unseen_rad += run.turned_rad;
        let (ahead, turn) = (1.0 + self.errors.x, 1.0 + self.errors.y);
        let (x_m, y_m) = (increment.x_m / ahead, increment.y_m / ahead);
        let yaw_rad = (wrap(increment.yaw_rad) - self.errors.z * x_m) / turn;
        // What noise alone may have turned is no turn: of many small steps that would add up.
        let turned_rad = (yaw_rad * yaw_rad - self.yaw.variance(run.path_m, 0.0)).max(0.0).sqrt();
        let d = self.distance.variance(run.path_m, turned_rad) + D_PER_S * dt_s + 1e-10;
        let yaw = self.yaw.variance(run.path_m, turned_rad) + YAW_PER_S * dt_s + 1e-11;
        // Of the coordinates of the step, as seen at its end.
        let turned = Pose2::new(0.0, 0.0, -yaw_rad).adjoint();
        let noise = Matrix3::from_diagonal(&Vector3::new(d, d, yaw));
        #[rustfmt::skip]
        let by_errors = Matrix3::new(
            -x_m / ahead, 0.0,             0.0,
            -y_m / ahead, 0.0,             0.0,
            0.0,          -yaw_rad / turn, -x_m / turn,
        );
        Step {
            motion: Pose2::new(x_m, y_m, yaw_rad),
            noise: turned * noise * turned.transpose(),
            by_errors: turned * by_errors,
        }
    }

    /// Covariance of a sweep's pose at its first ray, if what it shows is right on average over all of it: a random walk
    /// W of variance T at its end has averaged T / 3 = Var ∫ W(t) dt.
    pub fn blur(&self, moved: &Pose2) -> Matrix3<f64> {
        let (path_m, turned_rad) = (moved.x_m.hypot(moved.y_m), moved.yaw_rad.abs());
        let d = self.distance.variance(path_m, turned_rad);
        let yaw = self.yaw.variance(path_m, turned_rad);
        Matrix3::from_diagonal(&Vector3::new(d, d, yaw)) / 3.0
    }

    /// Path since the scans last told the pose.
    pub fn unseen_m(&self) -> f64 {
        self.unseen_m
    }

    /// How much the robot turned, to either side, since the scans last told the pose.
    pub fn unseen_rad(&self) -> f64 {
        self.unseen_rad
    }

    /// The scans told the pose: learns from the motion since a while ago.
    pub fn told(&mut self, map_from_body: &Pose2, covariance: &Matrix3<f64>) {
        (self.unseen_m, self.unseen_rad) = (0.0, 0.0);
        if let Some((from, from_covariance)) = self.window {
            if self.run.length() < WINDOWS[self.windows % WINDOWS.len()] {
                return;
            }
            if self.run.length() <= WINDOW_MAX {
                let moved = from.between(map_from_body);
                let over = moved.inverse().adjoint();
                self.learn(&moved, &(over * from_covariance * over.transpose() + covariance));
                self.windows += 1;
            }
        }
        self.window = Some((*map_from_body, *covariance));
        self.run = Run::default();
    }

    /// The pose has no more to do with the one before.
    pub fn lift(&mut self) {
        (self.unseen_m, self.unseen_rad) = (0.0, 0.0);
        self.window = None;
        self.run = Run::default();
    }

    fn learn(&mut self, moved: &Pose2, fixes: &Matrix3<f64>) {
        let run = self.run;
        let wandered = WANDER.component_mul(&WANDER) / 100.0;
        self.covariance += Matrix3::from_diagonal(&wandered.component_mul(&Vector3::new(
            run.path_m,
            run.turned_rad,
            run.path_m,
        )));
        let (seen, measured) = (moved.log(), run.pose.log());
        let (ahead, turn) = (Vector3::new(seen.x, 0.0, 0.0), Vector3::new(0.0, seen.z, seen.x));
        let off = measured - seen;
        // Not by its own noisy turns: those that noise made larger would count for less.
        let turned_rad = seen.z.abs();
        let look = |off: f64, row: &Vector3<f64>, fix: f64, wheels: &Self| Look {
            squared: (off - row.dot(&wheels.errors)).powi(2),
            path_m: run.path_m,
            turned_rad,
            fix,
            known: row.dot(&(wheels.covariance * row)),
        };
        let distance = look(off.x, &ahead, fixes[(0, 0)], self);
        self.distance.learn(&distance);
        let noise = self.distance.variance(run.path_m, turned_rad) + self.distance.fix() * fixes[(0, 0)];
        self.regress(&ahead, off.x, noise);
        let yaw = look(off.z, &turn, fixes[(2, 2)], self);
        self.yaw.learn(&yaw);
        let noise = self.yaw.variance(run.path_m, turned_rad) + self.yaw.fix() * fixes[(2, 2)];
        self.regress(&turn, off.z, noise);
    }

    /// Kalman's update of the systematic errors: `off = row · θ` and noise.
    fn regress(&mut self, row: &Vector3<f64>, off: f64, noise: f64) {
        let surprise = off - row.dot(&self.errors);
        let pulled = self.covariance * row;
        let known = row.dot(&pulled);
        let spread = known + noise / weight(surprise * surprise / (known + noise));
        self.errors += pulled * (surprise / spread);
        self.errors = self.errors.sup(&-ERRORS_MAX).inf(&ERRORS_MAX);
        self.covariance -= pulled * pulled.transpose() / spread;
    }
}

/// Weight of an innovation by its Mahalanobis distance²: none of a slip is believed.
fn weight(distance2: f64) -> f64 {
    ((TAIL + 1.0) / (TAIL + distance2)).min(1.0)
}

#[cfg(test)]
mod tests;
