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

/// A pose may be held for so long until the next one: who repeats it for longer stands still.
const HELD_MAX_S: f64 = 2.5;
/// How fast it is learned whether poses are held and for how long, per motion.
const HELD_GAIN: f64 = 0.1;

/// Recent odometry, in the order of arrival.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct Odometry {
    recent: VecDeque<(StampNs, Pose2)>,
    boot: u64,
    /// Stamp of the newest message, be its pose held or not.
    arrived_ns: Option<StampNs>,
    /// When the newest pose came first, and whether it was repeated, bit by bit.
    since_ns: StampNs,
    held: bool,
    /// Of motions lately, the share that came after a pose was held, and for how long it was, seconds.
    held_share: f64,
    held_s: f64,
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
        self.arrived_ns = Some(odom.stamp_ns);
        if self.holds(odom) {
            return step;
        }
        self.recent.push_back((odom.stamp_ns, odom.odom_from_body));
        if self.recent.len() > KEPT {
            self.recent.pop_front();
        }
        step
    }

    /// Whether a pose is the one before, repeated until there is a newer one: of where the robot is meanwhile it says
    /// nothing.
    fn holds(&mut self, odom: &Odom) -> bool {
        let Some((_, last)) = self.recent.back() else {
            (self.since_ns, self.held) = (odom.stamp_ns, false);
            return false;
        };
        let since_s = odom.stamp_ns.saturating_sub(self.since_ns).max(0) as f64 * 1e-9;
        if *last == odom.odom_from_body {
            self.held = true;
            return self.is_stale() && since_s < HELD_MAX_S.min(1.5 * self.held_s);
        }
        let held = std::mem::take(&mut self.held);
        if held && since_s < HELD_MAX_S {
            let first = self.held_share < HELD_GAIN;
            self.held_s += if first { 1.0 } else { HELD_GAIN } * (since_s - self.held_s);
        }
        self.held_share += HELD_GAIN * (f64::from(u8::from(held)) - self.held_share);
        self.since_ns = odom.stamp_ns;
        false
    }

    /// Whether odometry is slower than its messages: most motions come after a pose was repeated.
    pub fn is_stale(&self) -> bool {
        self.held_share > 0.5
    }

    /// How long one waits for odometry that is newer, seconds.
    pub fn period_s(&self) -> f64 {
        if self.is_stale() { self.held_s } else { 0.0 }
    }

    /// Stamp of the newest message, if any.
    pub fn arrived_ns(&self) -> Option<StampNs> {
        self.arrived_ns
    }

    /// Newest stamp of a pose that is not merely held, if any.
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

    #[test]
    fn what_is_repeated_until_there_is_newer_is_interpolated() {
        let mut o = Odometry::default();
        // 10 messages a second, measured at each fifth.
        let told = |k: i64| odom(k * 100_000_000, 0.5 * (k / 5) as f64, 0);
        for k in 0..100 {
            o.push(&told(k));
        }
        assert!(o.is_stale() && (o.period_s() - 0.5).abs() < 0.05, "{}", o.period_s());
        o.push(&told(100));
        assert!((o.at(9_700_000_000).unwrap().x_m - 9.7).abs() < 1e-9, "between the measurements");
        // Who stands still is not waited for.
        for k in 101..130 {
            o.push(&odom(k * 100_000_000, 10.0, 0));
        }
        assert_eq!(o.newest_ns(), o.arrived_ns());
        // Wheels that are measured each time hold nothing.
        let mut o = Odometry::default();
        (0..100).for_each(|k| drop(o.push(&odom(k * 100_000_000, 0.1 * k as f64, 0))));
        assert!(!o.is_stale());
    }
}
