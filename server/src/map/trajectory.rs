//! The robot's pose at every odometry line of a log.

use std::fmt::Write as _;
use toponym_core::Pose2;

/// How a pose is written.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, clap::ValueEnum)]
pub enum Format {
    /// `t x y theta`
    #[default]
    Plain,
    /// `t x y z qx qy qz qw`, as evo and the TUM benchmark read it
    Tum,
}

/// One line per row, the stamp as the log wrote it, metres and radians in the map.
pub fn text(format: Format, stamps: &[String], poses: &[Pose2]) -> String {
    let mut text = String::with_capacity(poses.len() * 48);
    for (stamp, p) in stamps.iter().zip(poses) {
        // Writing to a string cannot fail.
        let _ = match format {
            Format::Plain => writeln!(text, "{stamp} {:.6} {:.6} {:.6}", p.x_m, p.y_m, p.yaw_rad),
            Format::Tum => {
                let (qz, qw) = (p.yaw_rad / 2.0).sin_cos();
                writeln!(text, "{stamp} {:.6} {:.6} 0 0 0 {qz:.8} {qw:.8}", p.x_m, p.y_m)
            }
        };
    }
    text
}

/// Length of a trajectory. Steps below a centimetre are gathered first: the jitter of a robot
/// that stands would add up to metres.
pub fn path_m(poses: &[Pose2]) -> f64 {
    let mut total_m = 0.0;
    let mut last: Option<&Pose2> = None;
    for pose in poses {
        let step_m = last.map_or(0.0, |l| l.distance_m(pose));
        if last.is_none() || step_m >= 0.01 {
            total_m += step_m;
            last = Some(pose);
        }
    }
    total_m
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_keep_the_stamps_text() {
        let rows = |format| text(format, &["976052857.3375460".into()], &[Pose2::new(1.0, -2.5, 0.25)]);
        assert_eq!(rows(Format::Plain), "976052857.3375460 1.000000 -2.500000 0.250000\n");
        assert_eq!(rows(Format::Tum), "976052857.3375460 1.000000 -2.500000 0 0 0 0.12467473 0.99219767\n");
    }

    #[test]
    fn jitter_is_no_path() {
        let standing: Vec<Pose2> =
            (0..1000).map(|k| Pose2::new(f64::from(k % 2) * 0.004, 0.0, 0.0)).collect();
        assert!(path_m(&standing) < 1e-9);
        let driving: Vec<Pose2> = (0..=1000).map(|k| Pose2::new(f64::from(k) * 0.004, 0.0, 0.0)).collect();
        assert!((path_m(&driving) - 4.0).abs() < 0.02);
    }
}
