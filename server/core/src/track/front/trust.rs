//! Whether wheels are to be believed, by what scans say they did.
//!
//! At each scan wheels predict a motion, and registration finds one. They part by e = log(predicted⁻¹ · found).
//! Wheels are right, or they are not (they slip, spin, stand still while somebody pushes): a chain of two states,
//!
//! ```text
//! p(right → wrong) = FAILS,  p(wrong → right) = RECOVERS,    per scan
//! p(e | right) = Π_k N(e_k; S_k) with a tail,   p(e | wrong) = Π_k ½ p(e_k | right) + ½ N(e_k; S_k + W_k)
//! ```
//!
//! or, where a scan fits better elsewhere than near wheels and they hold it there all the same, by how many independent
//! looks more it explains there than the best of many poses does by chance (`rivalled`);
//!
//! with S the variances of both together, W what robots can do meanwhile (who slips ahead need not turn), filtered forwards.
//! While they are more likely wrong than right, the scan is searched for wherever robots may go meanwhile
//! (`search.rs`). Scans that see nothing say nothing: then what is known of wheels that move decays towards how often
//! they are wrong at all.

use crate::geometry::Pose2;
use nalgebra::{Matrix3, Vector3};
use serde::{Deserialize, Serialize};

/// Per scan: a slip in some thousand, and it lasts some ten.
const FAILS: f64 = 3e-4;
const RECOVERS: f64 = 0.1;
/// Of wheels that are right, so many scans part from them three times as far: people walk by.
const TAIL: f64 = 0.02;
/// The best of so many poses away from what wheels say explains more by chance.
const RIVALS: f64 = 20.0;
/// What robots do, one standard deviation: speed, and what a scan or two that came late add.
const SPEED_M_S: f64 = 0.7;
const SPEED_RAD_S: f64 = 0.7;
const LATE_M: f64 = 0.05;
const LATE_RAD: f64 = 0.05;
/// How much a speed changes within a second.
const FASTER_M_S2: f64 = 0.7;
const FASTER_RAD_S2: f64 = 1.5;
/// It goes on as it did or stands, each to so much, from one scan to the next with such probabilities.
const GOES_ON: f64 = 0.3;
const STANDS: f64 = 0.01;
const STANDS_M: f64 = 0.03;
/// Otherwise it moves by anything up to this, one standard deviation.
const ANY_M_S: f64 = 0.5;
const ANY_RAD_S: f64 = 0.5;
/// After so long without a look and without wheels the robot may have been carried off.
const ADRIFT_S: f64 = 3.0;
/// A speed that scans saw longer ago says nothing any more.
const SEEN_LATELY_S: f64 = 1.0;

/// What is thought of the wheels.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Trust {
    /// Probability that they are wrong now.
    wrong: f64,
    /// The body's speed as scans last saw it: x, y, yaw per second, and since how long it is not seen.
    speed: Vector3<f64>,
    /// What it did from one scan to the next.
    step: Vector3<f64>,
    unseen_s: f64,
}

impl Default for Trust {
    fn default() -> Self {
        Self { wrong: FAILS / RECOVERS, speed: Vector3::zeros(), step: Vector3::zeros(), unseen_s: 0.0 }
    }
}

impl Trust {
    /// Whether they are more likely wrong than right.
    pub fn is_lost(&self) -> bool {
        self.wrong > 0.5
    }

    /// Whether neither scans nor wheels have told for so long where the robot goes that it may be anywhere.
    pub fn is_adrift(&self) -> bool {
        self.is_lost() && self.unseen_s > ADRIFT_S
    }

    /// Where the body is has been found otherwise.
    pub fn settle(&mut self) {
        (self.speed, self.unseen_s) = (Vector3::zeros(), 0.0);
    }

    /// Time passes: the motion expected if wheels are not believed, and its covariance. That wheels which stand still
    /// work again shows when they move.
    pub fn pass(&mut self, dt_s: f64, wheels_move: bool) -> (Pose2, Matrix3<f64>) {
        let recovers = if wheels_move { RECOVERS } else { 0.0 };
        self.wrong = self.wrong * (1.0 - recovers) + (1.0 - self.wrong) * FAILS;
        self.unseen_s += dt_s;
        let still_known = self.unseen_s - dt_s < SEEN_LATELY_S;
        let motion =
            if still_known { Pose2::exp(&(self.speed * dt_s.min(SEEN_LATELY_S))) } else { Pose2::default() };
        let (d_m, turn_rad) = if still_known {
            (FASTER_M_S2 * dt_s * dt_s + 0.01, FASTER_RAD_S2 * dt_s * dt_s + 0.01)
        } else {
            (SPEED_M_S * dt_s + LATE_M, SPEED_RAD_S * dt_s + LATE_RAD)
        };
        (motion, squares(d_m, turn_rad))
    }

    /// What it may have done in `dt_s` if it goes on: as fast as it was seen to, or as far from scan to scan, for stamps
    /// jitter.
    pub fn goes_on(&self, dt_s: f64) -> [Vector3<f64>; 2] {
        let known = if self.unseen_s - dt_s < SEEN_LATELY_S { 1.0 } else { 0.0 };
        [self.speed * dt_s.min(SEEN_LATELY_S) * known, self.step * known]
    }

    /// Log-density, but for a constant, of a motion if wheels say nothing: the robot goes on as it was last seen to, or
    /// stands, or does anything that robots do. `known`: covariance of where it was.
    pub fn log_expects(&self, moved: &Pose2, by_wheels: &Pose2, dt_s: f64, known: &Matrix3<f64>) -> f64 {
        let moved = moved.log();
        let density = |from: &Vector3<f64>, d_m: f64, turn_rad: f64| {
            let e = moved - from;
            normal(e.x, d_m * d_m + known[(0, 0)])
                * normal(e.y, d_m * d_m + known[(1, 1)])
                * normal(e.z, turn_rad * turn_rad + known[(2, 2)])
        };
        let [fast, far] = self.goes_on(dt_s);
        // Wheels that are wrong are often nearly right, unless they stand still.
        let told = if *by_wheels == Pose2::default() { fast } else { by_wheels.log() };
        let on: f64 = [fast, far, told]
            .iter()
            .map(|w| density(w, 0.3 * w.xy().norm() + STANDS_M, 0.3 * w.z.abs() + STANDS_M))
            .sum();
        let stands = density(&Vector3::zeros(), STANDS_M, STANDS_M);
        let (any_m, any_rad) = Self::anything(dt_s);
        let any = density(&Vector3::zeros(), any_m, any_rad);
        (GOES_ON / 3.0 * on + STANDS * stands + (1.0 - GOES_ON - STANDS) * any).max(f64::MIN_POSITIVE).ln()
    }

    /// Since when scans have not told where it is.
    pub fn unseen_s(&self) -> f64 {
        self.unseen_s
    }

    /// What a robot of which nothing is known does meanwhile, standard deviations: metres, radians.
    pub fn anything(dt_s: f64) -> (f64, f64) {
        (ANY_M_S * dt_s + LATE_M, ANY_RAD_S * dt_s + LATE_RAD)
    }

    /// Where wheels say nothing of it, a scan explains so many independent looks more than near them.
    pub fn rivalled(&mut self, looks: f64) {
        let odds = self.wrong / (1.0 - self.wrong) * (looks - RIVALS.ln()).exp();
        self.believe(odds / (1.0 + odds));
    }

    /// Neither is ever impossible.
    fn believe(&mut self, wrong: f64) {
        self.wrong = wrong.clamp(1e-6, 1.0 - 1e-3);
    }

    /// Scans saw a motion, off from that of the wheels by `parted`; `spread`: S.
    pub fn saw(&mut self, moved: &Pose2, parted: &Vector3<f64>, spread: &Matrix3<f64>) {
        let dt_s = std::mem::take(&mut self.unseen_s);
        if dt_s > 0.0 {
            self.step = moved.log();
            self.speed = self.step / dt_s;
        }
        let may = [SPEED_M_S * dt_s + LATE_M, SPEED_M_S * dt_s + LATE_M, SPEED_RAD_S * dt_s + LATE_RAD];
        let (mut right, mut wrong) = (1.0, 1.0);
        for (k, may) in may.into_iter().enumerate() {
            let (e, variance) = (parted[k], spread[(k, k)]);
            let as_told = (1.0 - TAIL) * normal(e, variance) + TAIL * normal(e, 9.0 * variance);
            right *= as_told;
            wrong *= 0.5 * as_told + 0.5 * normal(e, variance + may * may);
        }
        let sum = self.wrong * wrong + (1.0 - self.wrong) * right;
        if sum > 0.0 {
            self.believe(self.wrong * wrong / sum);
        }
    }
}

fn squares(d_m: f64, turn_rad: f64) -> Matrix3<f64> {
    Matrix3::from_diagonal(&Vector3::new(d_m * d_m, d_m * d_m, turn_rad * turn_rad))
}

/// N(e; variance), but for a constant factor.
fn normal(e: f64, variance: f64) -> f64 {
    (-0.5 * e * e / variance).exp() / variance.sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Scans and wheels part by so much, ten times a second.
    fn part(trust: &mut Trust, times: usize, by_m: f64) {
        for _ in 0..times {
            trust.pass(0.1, true);
            let parted = Vector3::new(by_m, 0.0, 0.0);
            trust.saw(&Pose2::new(0.05, 0.0, 0.0), &parted, &squares(0.008, 0.004));
        }
    }

    #[test]
    fn a_slip_is_noticed_at_once_and_forgotten_soon() {
        let mut trust = Trust::default();
        part(&mut trust, 100, 0.004);
        assert!(trust.wrong < 0.01, "{trust:?}");
        part(&mut trust, 1, 0.5);
        assert!(trust.is_lost(), "{trust:?}");
        part(&mut trust, 10, 0.004);
        assert!(!trust.is_lost(), "{trust:?}");
    }

    #[test]
    fn wheels_that_stand_still_are_not_believed_and_the_robot_goes_on() {
        let mut trust = Trust::default();
        part(&mut trust, 10, 0.05);
        assert!(trust.is_lost(), "{trust:?}");
        let (motion, _) = trust.pass(0.1, false);
        assert!((motion.x_m - 0.05).abs() < 1e-9, "{motion:?}");
    }

    #[test]
    fn what_fits_better_elsewhere_by_chance_makes_no_slip_and_what_does_so_again_does() {
        let mut trust = Trust::default();
        for _ in 0..50 {
            for looks in [4.0, 2.5, 3.0] {
                trust.pass(0.1, true);
                trust.rivalled(looks);
                assert!(!trust.is_lost(), "{trust:?}");
            }
            part(&mut trust, 3, 0.003);
        }
        for _ in 0..4 {
            trust.pass(0.1, true);
            trust.rivalled(6.0);
        }
        assert!(trust.is_lost(), "{trust:?}");
    }

    #[test]
    fn somebody_who_walks_by_makes_no_slip() {
        let mut trust = Trust::default();
        for _ in 0..20 {
            part(&mut trust, 1, 0.024);
            part(&mut trust, 20, 0.003);
            assert!(!trust.is_lost(), "{trust:?}");
        }
    }
}
