//! A robot's body: how fast it drives and turns, and the steps that it makes.

use crate::geom::{Point, compose, wrap};
use toponym_proto::Pose;

/// Time step of a [`crate::Drive`], seconds.
pub const STEP_S: f64 = 0.02;
/// A waypoint counts as passed from here, metres.
const PASSED_M: f64 = 0.25;

/// How the robot moves.
#[derive(Clone, Debug, PartialEq)]
pub struct Motion {
    /// Cruising speed, drawn anew between these for each leg, m/s.
    pub speed_mps: (f64, f64),
    /// Fastest turn.
    pub turn_max_radps: f64,
    /// Largest change of speed.
    pub accel_mps2: f64,
    /// Rest at each stop of the tour.
    pub rest_s: f64,
}

impl Default for Motion {
    fn default() -> Self {
        Self { speed_mps: (0.5, 1.0), turn_max_radps: 0.9, accel_mps2: 0.8, rest_s: 1.5 }
    }
}

/// The robot on its way.
pub(crate) struct Body {
    pub(crate) pose: Pose,
    pub(crate) speed_mps: f64,
}

impl Body {
    pub(crate) fn rest(&mut self, rest_s: f64, poses: &mut Vec<Pose>) {
        self.speed_mps = 0.0;
        poses.extend(std::iter::repeat_n(self.pose, (rest_s / STEP_S) as usize));
    }

    /// Turns towards the target, on the spot if it is not ahead, and drives there.
    pub(crate) fn go_to(
        &mut self,
        target: Point,
        stop: bool,
        cruise_mps: f64,
        motion: &Motion,
        poses: &mut Vec<Pose>,
    ) {
        loop {
            let (dx, dy) = (target[0] - self.pose.x_m, target[1] - self.pose.y_m);
            let left_m = dx.hypot(dy);
            if left_m < if stop { 0.05 } else { PASSED_M } {
                return;
            }
            let off_rad = wrap(dy.atan2(dx) - self.pose.yaw_rad);
            let turn_radps = (3.0 * off_rad).clamp(-motion.turn_max_radps, motion.turn_max_radps);
            let ahead = (1.0 - off_rad.abs() / 0.6).max(0.0);
            let brake_mps = if stop { (2.0 * motion.accel_mps2 * left_m).sqrt() } else { f64::INFINITY };
            // Slow where the target is near and aside, or the robot would circle round it.
            let wanted_mps = (cruise_mps * ahead).min(brake_mps).min(0.15 + 1.5 * left_m * ahead);
            self.step(wanted_mps, turn_radps, motion, poses);
        }
    }

    /// Moves on for one time step.
    pub(crate) fn step(&mut self, wanted_mps: f64, turn_radps: f64, motion: &Motion, poses: &mut Vec<Pose>) {
        let change = motion.accel_mps2 * STEP_S;
        self.speed_mps += (wanted_mps - self.speed_mps).clamp(-2.0 * change, change);
        let step = Pose { x_m: self.speed_mps * STEP_S, y_m: 0.0, yaw_rad: turn_radps * STEP_S };
        self.pose = compose(&self.pose, &step);
        poses.push(self.pose);
    }
}
