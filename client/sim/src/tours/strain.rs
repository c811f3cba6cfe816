//! How hard it is on the wheels' noise that the robot ended elsewhere than it did: the distance of
//! two look-alike doors in standard deviations of what wheels know after a dark stretch.

use crate::geom::{between, compose, wrap};
use crate::{Drive, WheelsPrior};
use toponym_proto::Pose;

/// The motion is looked at in steps of this, seconds.
const LOOK_S: f64 = 0.2;
/// Steps of Gauss and Newton.
const ROUNDS: usize = 15;
/// A path that ends this far off its aim does not fit at all.
const MISSED: f64 = 0.05;

/// One step of the motion, body frame: ahead, aside, turn.
struct Step {
    way_m: f64,
    motion: Pose,
}

fn steps(drive: &Drive, (from_s, to_s): (f64, f64)) -> Vec<Step> {
    let n = ((to_s - from_s) / LOOK_S).ceil().max(1.0) as usize;
    let at = |k: usize| drive.at((from_s + k as f64 * LOOK_S).min(to_s));
    let step = |k| {
        let motion = between(&at(k), &at(k + 1));
        Step { way_m: motion.x_m.hypot(motion.y_m), motion }
    };
    (0..n).map(step).collect()
}

/// What the laser leaves unknown of the wheels' own errors, having watched them on the lit
/// stretches: σ of the scale, and the root of the covariance of turn error and bias, `[a 0; b c]`.
pub(super) struct Calibrated {
    pub scale: f64,
    pub turn_bias: [f64; 3],
}

pub(super) fn calibrated(drive: &Drive, blind_s: &[(f64, f64)], prior: &WheelsPrior) -> Calibrated {
    let mut scale = prior.scale.powi(-2);
    let mut info = [prior.turn.powi(-2), 0.0, prior.yaw_bias_rad_per_m.powi(-2)];
    for (k, step) in steps(drive, (0.0, drive.duration_s())).iter().enumerate() {
        let t_s = k as f64 * LOOK_S;
        if blind_s.iter().any(|&(from, to)| (from..to).contains(&t_s)) {
            continue;
        }
        let turn_rad = step.motion.yaw_rad;
        let yaw_var =
            prior.yaw_noise_rad.powi(2) * step.way_m + prior.turn_noise_rad.powi(2) * turn_rad.abs();
        if step.way_m > 1e-6 {
            scale += step.way_m / prior.noise_m.powi(2);
        }
        if yaw_var > 1e-12 {
            info[0] += turn_rad * turn_rad / yaw_var;
            info[1] += turn_rad * step.way_m / yaw_var;
            info[2] += step.way_m * step.way_m / yaw_var;
        }
    }
    let det = info[0] * info[2] - info[1] * info[1];
    let (var_turn, cov, var_bias) = (info[2] / det, -info[1] / det, info[0] / det);
    let a = var_turn.sqrt();
    let b = cov / a;
    Calibrated { scale: scale.sqrt().recip(), turn_bias: [a, b, (var_bias - b * b).max(0.0).sqrt()] }
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
    let known = calibrated(drive, blind_s, prior);
    // Unit draws: along and yaw of each step, then scale, turn, bias.
    let mut draws = vec![0.0; 2 * steps.len() + 3];
    for _ in 0..ROUNDS {
        let (poses, rows) = linearised(&steps, &draws, &known, prior);
        let reached = &poses[poses.len() - 1];
        let off = [end.x_m - reached.x_m, end.y_m - reached.y_m, wrap(end.yaw_rad - reached.yaw_rad)];
        let mut aim = off;
        let mut gram = [[0.0; 3]; 3];
        for (row, draw) in rows.iter().zip(&draws) {
            for i in 0..3 {
                aim[i] += row[i] * draw;
                for j in 0..3 {
                    gram[i][j] += row[i] * row[j];
                }
            }
        }
        let Some(pull) = solved(gram, aim) else { return f64::INFINITY };
        for (row, draw) in rows.iter().zip(&mut draws) {
            *draw = (0..3).map(|i| row[i] * pull[i]).sum();
        }
    }
    let (poses, _) = linearised(&steps, &draws, &known, prior);
    let reached = &poses[poses.len() - 1];
    let missed =
        (end.x_m - reached.x_m).hypot(end.y_m - reached.y_m) + wrap(end.yaw_rad - reached.yaw_rad).abs();
    if missed > MISSED { f64::INFINITY } else { draws.iter().map(|d| d * d).sum::<f64>().sqrt() }
}

/// The path with given draws, and what each draw does to its end.
fn linearised(
    steps: &[Step],
    draws: &[f64],
    known: &Calibrated,
    prior: &WheelsPrior,
) -> (Vec<Pose>, Vec<[f64; 3]>) {
    let n = steps.len();
    let [a, b, c] = known.turn_bias;
    let (scale, turn, bias) =
        (known.scale * draws[2 * n], a * draws[2 * n + 1], b * draws[2 * n + 1] + c * draws[2 * n + 2]);
    let along = |s: &Step| prior.noise_m * s.way_m.sqrt();
    let yaw = |s: &Step| {
        (prior.yaw_noise_rad.powi(2) * s.way_m + prior.turn_noise_rad.powi(2) * s.motion.yaw_rad.abs()).sqrt()
    };
    let mut poses = vec![Pose::default()];
    for (k, step) in steps.iter().enumerate() {
        let motion = Pose {
            x_m: step.motion.x_m * (1.0 + scale) + along(step) * draws[2 * k],
            y_m: step.motion.y_m * (1.0 + scale),
            yaw_rad: step.motion.yaw_rad * (1.0 + turn) + bias * step.way_m + yaw(step) * draws[2 * k + 1],
        };
        poses.push(compose(&poses[k], &motion));
    }
    let end = poses[n];
    let mut rows = Vec::with_capacity(2 * n + 3);
    let mut own = [[0.0; 3]; 3];
    for (k, step) in steps.iter().enumerate() {
        let (s, c) = poses[k].yaw_rad.sin_cos();
        let ahead = [c, s, 0.0];
        let turned = [poses[k + 1].y_m - end.y_m, end.x_m - poses[k + 1].x_m, 1.0];
        rows.push(ahead.map(|v| v * along(step)));
        rows.push(turned.map(|v| v * yaw(step)));
        for i in 0..3 {
            own[0][i] += ahead[i] * step.way_m * known.scale;
            own[1][i] += turned[i] * (step.motion.yaw_rad * a + step.way_m * b);
            own[2][i] += turned[i] * step.way_m * known.turn_bias[2];
        }
    }
    rows.extend(own);
    (poses, rows)
}

/// Solves a symmetric positive definite system by Cramer's rule.
fn solved(m: [[f64; 3]; 3], v: [f64; 3]) -> Option<[f64; 3]> {
    let det = |m: &[[f64; 3]; 3]| {
        m[0][0] * (m[1][1] * m[2][2] - m[1][2] * m[2][1]) - m[0][1] * (m[1][0] * m[2][2] - m[1][2] * m[2][0])
            + m[0][2] * (m[1][0] * m[2][1] - m[1][1] * m[2][0])
    };
    let whole = det(&m);
    (whole > 0.0).then(|| {
        [0, 1, 2].map(|k| {
            let mut replaced = m;
            for i in 0..3 {
                replaced[i][k] = v[i];
            }
            det(&replaced) / whole
        })
    })
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
