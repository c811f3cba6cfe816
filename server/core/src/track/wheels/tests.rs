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
    let (mut truth, mut made, mut drift) = (Pose2::default(), Pose2::default(), Drift::default());
    let told = Matrix3::from_diagonal(&Vector3::new(2.5e-5, 2.5e-5, 3e-6));
    for k in steps {
        let step = Pose2::new(0.1, 0.0, 0.05 * (k as f64 * 0.01).sin());
        let root = 0.1f64.sqrt();
        let odometry = Pose2::new(
            step.x_m * (1.0 - robot.scale) + robot.noise_m * root * gauss(k, 0),
            0.0,
            step.yaw_rad - robot.bend_rad_per_m * 0.1 + robot.noise_rad * root * gauss(k, 1),
        );
        let driven = wheels.drive(&odometry, 0.1);
        drift.drive(&driven);
        truth = truth.compose(&step);
        made = made.compose(&driven.motion);
        if !blind {
            let off = Vector3::new(0.005 * gauss(k, 2), 0.005 * gauss(k, 3), 0.0017 * gauss(k, 4));
            wheels.told(&truth.compose(&Pose2::exp(&off)), &told);
        }
    }
    (truth, made, drift.covariance(wheels))
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
    let off = wheels.errors - before.errors;
    assert!(off.x.abs() < 0.02 && off.y.abs() < 0.01 && off.z.abs() < 0.005, "{off}");
}

#[test]
fn at_rest_nothing_is_learned_and_next_to_nothing_forgotten() {
    let mut wheels = Wheels::default();
    let mut sum = Matrix3::zeros();
    for _ in 0..600 {
        let step = wheels.drive(&Pose2::default(), 0.1);
        assert_eq!(step.motion, Pose2::default());
        sum += step.noise;
        wheels.told(&Pose2::default(), &(Matrix3::identity() * 1e-6));
    }
    assert!(sum[(0, 0)].sqrt() < 0.02 && sum[(2, 2)].sqrt() < 0.01);
    assert_eq!((wheels.errors, wheels.yaw), (Vector3::zeros(), Noise::new(YAW)));
}

#[test]
fn turns_are_learned_as_large_as_they_are_by_noisy_wheels() {
    // Regressed on noisy turns, gentle as these are, it would come out a third too small.
    let (turn, mut wheels) = (0.1, Wheels::default());
    let told = Matrix3::from_diagonal(&Vector3::new(2.5e-5, 2.5e-5, 3e-6));
    let mut truth = Pose2::default();
    for k in 0..20_000 {
        let yaw_rad = if k / 100 % 2 == 0 { 0.02 } else { -0.02 };
        truth = truth.compose(&Pose2::new(0.1, 0.0, yaw_rad));
        wheels.drive(&Pose2::new(0.1, 0.0, (1.0 + turn) * yaw_rad + 0.03 * gauss(k, 0)), 0.1);
        wheels.told(&truth, &told);
    }
    let off = wheels.errors.y - turn;
    assert!(off.abs() < 0.035 && off.abs() < 3.0 * wheels.covariance[(1, 1)].sqrt(), "{}", wheels.errors);
}

#[test]
fn what_long_blind_stretches_claim_is_what_they_are_worth() {
    // Robots unlike each other, watched over 60 m each, then blind for 100.
    let (mut covered, mut sum, n) = (0, 0.0, 80);
    for run in 0..n {
        let robot = Robot {
            scale: 0.02 * gauss(run, 10),
            bend_rad_per_m: 0.004 * gauss(run, 11),
            noise_m: 0.02,
            noise_rad: 0.02,
        };
        let mut wheels = Wheels::default();
        let from = 10_000 * run;
        drive(&mut wheels, &robot, from..from + 600, false);
        let (truth, made, covariance) = drive(&mut wheels, &robot, from + 600..from + 1600, true);
        let off = made.between(&truth).log();
        let distance2 = off.dot(&(covariance.try_inverse().unwrap() * off));
        covered += u32::from(distance2 < 7.815);
        sum += distance2 / 3.0;
    }
    let (share, mean) = (f64::from(covered) / n as f64, sum / n as f64);
    assert!(share >= 0.88 && (0.6..1.5).contains(&mean), "{share} covered, {mean} of the variance");
}

#[test]
fn a_sweep_is_blurred_by_what_wheels_err_on_average_over_it() {
    let wheels = Wheels::default();
    let (step, steps) = (Pose2::new(0.002, 0.0, 0.0), 50);
    let per_step = wheels.yaw.variance(step.x_m, 0.0).sqrt();
    let average_off = |sweep: u64| {
        let (mut off, mut sum) = (0.0, 0.0);
        for k in 0..steps {
            off += per_step * gauss(sweep, k);
            sum += off;
        }
        sum / steps as f64
    };
    let n = 4000;
    let variance = (0..n).map(|sweep| average_off(sweep).powi(2)).sum::<f64>() / n as f64;
    let claimed = wheels.blur(&Pose2::new(step.x_m * steps as f64, 0.0, 0.0))[(2, 2)];
    assert!((0.9..1.15).contains(&(variance / claimed)), "{variance} {claimed}");
    assert_eq!(wheels.blur(&Pose2::default()), Matrix3::zeros());
}
