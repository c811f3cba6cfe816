//! Wheel odometry as it comes: repeated and backward stamps, restarts, jumps.

use crate::event::{Odom, StampNs};
use crate::geometry::Pose2;
use serde::{Deserialize, Serialize};
use std::collections::VecDeque;

/// Odometry kept to look back in: some seconds at any usual rate.
const KEPT: usize = 512;
/// No robot here drives faster.
const SPEED_MAX_M_S: f64 = 5.0;
/// A step this long needs no excuse of time: logs skip, stamps lie.
const STEP_MAX_M: f64 = 2.0;

/// After so long a silence, odometry that is at its origin again was restarted.
const SILENCE_S: f64 = 1.0;

fn is_near(a: &Pose2, b: &Pose2) -> bool {
    a.distance_m(b) < 0.5 && a.between(b).yaw_rad.abs() < 0.3
}

/// Recent odometry, in the order of arrival.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct Odometry {
    recent: VecDeque<(StampNs, Pose2)>,
    boot: u64,
}

/// What a new odometry pose means.
#[derive(Clone, Debug, PartialEq)]
pub enum Step {
    /// It continues.
    Continued,
    /// It restarted or jumped: no motion may be read from it.
    Broken(String),
}

impl Odometry {
    /// Takes a pose in the order of arrival.
    pub fn push(&mut self, odom: &Odom) -> Step {
        let step = match self.recent.back() {
            None => Step::Continued,
            Some(_) if odom.boot != self.boot => {
                Step::Broken(format!("boot {} follows boot {}", odom.boot, self.boot))
            }
            Some((stamp_ns, last)) => {
                let dt_s = odom.stamp_ns.saturating_sub(*stamp_ns).max(0) as f64 * 1e-9;
                let d_m = last.distance_m(&odom.odom_from_body);
                let origin = Pose2::default();
                if is_near(&odom.odom_from_body, &origin) && d_m > STEP_MAX_M && dt_s > SILENCE_S {
                    Step::Broken(format!("odometry begins anew after {dt_s:.1} s of silence"))
                } else if d_m > STEP_MAX_M + SPEED_MAX_M_S * dt_s {
                    Step::Broken(format!("odometry jumped by {d_m:.1} m in {dt_s:.2} s"))
                } else {
                    Step::Continued
                }
            }
        };
        if step != Step::Continued {
            self.recent.clear();
        }
        self.boot = odom.boot;
        self.recent.push_back((odom.stamp_ns, odom.odom_from_body));
        if self.recent.len() > KEPT {
            self.recent.pop_front();
        }
        step
    }

    /// Newest stamp, if any.
    pub fn newest_ns(&self) -> Option<StampNs> {
        self.recent.back().map(|r| r.0)
    }

    /// Pose at a stamp: interpolated between the latest-arrived pair that brackets it, else the
    /// nearer end. None without any odometry.
    pub fn at(&self, stamp_ns: StampNs) -> Option<Pose2> {
        let mut later = self.recent.back()?;
        if later.0 < stamp_ns {
            return Some(later.1);
        }
        for earlier in self.recent.iter().rev() {
            if earlier.0 == stamp_ns {
                return Some(earlier.1);
            }
            if earlier.0 < stamp_ns && stamp_ns <= later.0 {
                let since = |t: StampNs| (i128::from(t) - i128::from(earlier.0)) as f64;
                let f = since(stamp_ns) / since(later.0);
                let twist = earlier.1.between(&later.1).log() * f;
                return Some(earlier.1.compose(&Pose2::exp(&twist)));
            }
            later = earlier;
        }
        Some(later.1)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn odom(stamp_ns: i64, x_m: f64, boot: u64) -> Odom {
        Odom { robot: "r".into(), boot, stamp_ns, odom_from_body: Pose2::new(x_m, 0.0, 0.0) }
    }

    #[test]
    fn stamps_may_step_back_and_repeat() {
        let mut o = Odometry::default();
        for (t, x) in [(0, 0.0), (100, 1.0), (90, 1.1), (90, 1.2), (200, 2.0)] {
            assert_eq!(o.push(&odom(t, x, 0)), Step::Continued);
        }
        assert!((o.at(145).unwrap().x_m - 1.6).abs() < 1e-9);
        assert!((o.at(90).unwrap().x_m - 1.2).abs() < 1e-9, "the latest-arrived of equal stamps");
        assert!((o.at(999).unwrap().x_m - 2.0).abs() < 1e-9);
        assert!((o.at(-5).unwrap().x_m).abs() < 1e-9);
    }

    #[test]
    fn a_boot_or_a_jump_breaks_the_segment() {
        let mut o = Odometry::default();
        o.push(&odom(0, 0.0, 0));
        assert!(matches!(o.push(&odom(1_000_000, 9.0, 0)), Step::Broken(_)));
        assert!(matches!(o.push(&odom(2_000_000, 9.0, 1)), Step::Broken(_)));
        assert_eq!(o.push(&odom(5_000_000_000, 5.0, 1)), Step::Continued);
        assert!(matches!(o.push(&odom(9_000_000_000, 0.1, 1)), Step::Broken(_)), "from 0 after a silence");
        assert!((o.at(0).unwrap().x_m - 0.1).abs() < 1e-12, "what was before the break is forgotten");
    }
}
