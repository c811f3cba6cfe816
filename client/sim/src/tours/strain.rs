//! How hard it is on the wheels' noise that the robot ended elsewhere than it did: the distance of
//! two look-alike doors in standard deviations of what wheels know after a dark stretch.

use crate::body::STEP_S;
use crate::calibration::{Systematic, variances, way_m};
use crate::geom::{between, compose, wrap};
use crate::{Drive, WheelsPrior};
use nalgebra::{Matrix, Matrix3, Vector3};
use toponym_proto::Pose;

/// The motion is looked at in steps of this, seconds.
const LOOK_S: f64 = 0.2;
/// Steps of Gauss and Newton.
const ROUNDS: usize = 15;
/// A path that ends this far off its aim does not fit at all.
const MISSED: f64 = 0.05;

/// Steps of the motion, body frame.
fn steps(drive: &Drive, (from_s, to_s): (f64, f64)) -> Vec<Pose> {
    let n = ((to_s - from_s) / LOOK_S).ceil().max(1.0) as usize;
    let at = |k: usize| drive.at((from_s + k as f64 * LOOK_S).min(to_s));
    (0..n).map(|k| between(&at(k), &at(k + 1))).collect()
}

/// What the laser leaves unknown of the wheels' own errors (scale, turn, bias), having watched them on
/// the lit stretches: the root l of their covariance, `l lᵀ`.
pub(super) fn unknown(drive: &Drive, blind_s: &[(f64, f64)], prior: &WheelsPrior) -> Matrix3<f64> {
    let lit = |k: &usize| !blind_s.iter().any(|&(from, to)| (from..to).contains(&(*k as f64 * STEP_S)));
    let learned = Systematic::learn(drive, drive, prior, (0..drive.poses.len()).filter(lit));
    // Without one, nothing is unknown.
    learned.covariance.cholesky().map_or_else(Matrix3::zeros, |root| root.l())
}

/// How many standard deviations of the wheels' noise it takes at least to end the stretch at
/// `end` seen from its start rather than where it ended; infinite if no noise does.
pub(super) fn strain(
    drive: &Drive,
    blind_s: &[(f64, f64)],
    stretch_s: (f64, f64),
    end: &Pose,
    prior: &WheelsPrior,
) -> f64 {
    let steps = steps(drive, stretch_s);
    let unknown = unknown(drive, blind_s, prior);
    // Unit draws: along and yaw of each step, then scale, turn, bias.
    let mut draws = vec![0.0; 2 * steps.len() + 3];
    for _ in 0..ROUNDS {
        let (end_by_draws, rows) = linearised(&steps, &draws, &unknown, prior);
        let (mut aim, mut gram) = (off(&end_by_draws, end), Matrix3::zeros());
        for (row, draw) in rows.iter().zip(&draws) {
            aim += row * *draw;
            gram += row * row.transpose();
        }
        let Some(root) = gram.cholesky() else { return f64::INFINITY };
        let pull = root.solve(&aim);
        for (row, draw) in rows.iter().zip(&mut draws) {
            *draw = row.dot(&pull);
        }
    }
    let (reached, _) = linearised(&steps, &draws, &unknown, prior);
    let missed = off(&reached, end);
    if missed.xy().norm() + missed.z.abs() > MISSED {
        return f64::INFINITY;
    }
    draws.iter().map(|d| d * d).sum::<f64>().sqrt()
}

/// What is missing from one pose to another, world axes.
fn off(from: &Pose, to: &Pose) -> Vector3<f64> {
    Vector3::new(to.x_m - from.x_m, to.y_m - from.y_m, wrap(to.yaw_rad - from.yaw_rad))
}

/// The end of the path with given draws, and what each draw does to it.
fn linearised(
    steps: &[Pose],
    draws: &[f64],
    unknown: &Matrix3<f64>,
    prior: &WheelsPrior,
) -> (Pose, Vec<Vector3<f64>>) {
    let n = steps.len();
    let errors = unknown * Vector3::from_column_slice(&draws[2 * n..]);
    let (scale, turn, bias) = (errors.x, errors.y, errors.z);
    let sigmas = |step: &Pose| variances(step, prior).map(f64::sqrt);
    let mut poses = vec![Pose::default()];
    for (k, step) in steps.iter().enumerate() {
        let [along, yaw] = sigmas(step);
        let motion = Pose {
            x_m: step.x_m * (1.0 + scale) + along * draws[2 * k],
            y_m: step.y_m * (1.0 + scale),
            yaw_rad: step.yaw_rad * (1.0 + turn) + bias * way_m(step) + yaw * draws[2 * k + 1],
        };
        poses.push(compose(&poses[k], &motion));
    }
    let end = poses[n];
    let mut rows = Vec::with_capacity(2 * n + 3);
    let mut by_errors = Matrix3::zeros();
    for (k, step) in steps.iter().enumerate() {
        let [along, yaw] = sigmas(step);
        let (s, c) = poses[k].yaw_rad.sin_cos();
        let ahead = Vector3::new(c, s, 0.0);
        let turned = Vector3::new(poses[k + 1].y_m - end.y_m, end.x_m - poses[k + 1].x_m, 1.0);
        rows.extend([ahead * along, turned * yaw]);
        let way_m = way_m(step);
        by_errors += Matrix3::from_columns(&[ahead * way_m, turned * step.yaw_rad, turned * way_m]);
    }
    let by_errors = by_errors * unknown;
    rows.extend(by_errors.column_iter().map(Matrix::into_owned));
    (end, rows)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Draw, Wheels};

    /// 60 m straight on.
    fn straight() -> Drive {
        Drive { poses: (0..=3000).map(|k| Pose { x_m: 0.02 * f64::from(k), ..Pose::default() }).collect() }
    }

    #[test]
    fn a_shift_by_what_the_wheels_spread_is_one_deviation() {
        let drive = straight();
        let whole = (0.0, drive.duration_s());
        let prior =
            WheelsPrior { scale: 1e-6, turn: 1e-6, yaw_bias_rad_per_m: 1e-9, ..WheelsPrior::between(0.2) };
        // Where the noise alone ends, and one deviation aside with the same heading.
        let wheels = Wheels {
            scale_error: 0.0,
            turn_error: 0.0,
            yaw_bias_rad_per_m: 0.0,
            ..prior.draw(&mut Draw::new(0, 0))
        };
        let ends: Vec<Pose> = (0..400)
            .map(|seed| *drive.measured(&wheels, &mut Draw::new(seed, 0)).poses.last().unwrap())
            .collect();
        let mean = |f: &dyn Fn(&Pose) -> f64| ends.iter().map(f).sum::<f64>() / ends.len() as f64;
        let (yy, yt, tt) =
            (mean(&|p| p.y_m * p.y_m), mean(&|p| p.y_m * p.yaw_rad), mean(&|p| p.yaw_rad * p.yaw_rad));
        let aside_m = (yy - yt * yt / tt).sqrt();
        let end = Pose { x_m: 60.0, y_m: aside_m, yaw_rad: 0.0 };
        let found = strain(&drive, &[whole], whole, &end, &prior);
        assert!((found - 1.0).abs() < 0.15, "{found}");
        let nowhere = strain(&drive, &[whole], whole, &Pose { x_m: 60.0, ..Pose::default() }, &prior);
        assert!(nowhere < 1e-6, "{nowhere}");
    }

    #[test]
    fn what_the_laser_watched_is_known_better() {
        let drive = straight();
        let prior = WheelsPrior::between(0.5);
        let end = Pose { x_m: 40.0, y_m: 4.0, yaw_rad: 0.0 };
        let blind = (20.0, 60.0);
        let watched = strain(&drive, &[blind], blind, &end, &prior);
        let never = strain(&drive, &[(0.0, 60.0)], blind, &end, &prior);
        assert!(watched > 1.03 * never, "{watched} {never}");
    }
}
