//! Whether a scan is a look at anything, and when it was taken by odometry's clock.

use crate::event::{Scan, StampNs};
use crate::geometry::Pose2;
use serde::{Deserialize, Serialize};

/// A driver that repeats a scan bit by bit while odometry says that the robot moved so far is frozen.
const FROZEN_M: f64 = 0.02;
const FROZEN_RAD: f64 = 0.02;
/// Stamps further from odometry's when they arrive, …
const APART_NS: i64 = 1_000_000_000;
/// … by the same from scan to scan, are of another clock.
const STEADY_NS: i64 = 300_000_000;
/// A laser whose first scans all have their finite ranges beyond reach, not all of them alike, and taken for
/// millimetres within it, sends millimetres.
const MILLIMETRE_SCANS: u32 = 10;
const MILLIMETRES_UNLIKE: usize = 10;
/// Scans in a row in which nothing is within reach, and path in odometry meanwhile, before that is told.
const BLIND_SCANS: u32 = 20;
const BLIND_M: f64 = 1.0;

/// What one laser sent lately.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub(super) struct Looks {
    last: Vec<f32>,
    /// Odometry when these ranges came first.
    last_at: Pose2,
    /// Odometry's newest stamp less the scan's, when the last scan arrived.
    lag_ns: Option<i64>,
    blind: u32,
    blind_from: Pose2,
    /// Scans from the first on that make sense in millimetres alone, and whether one did not.
    in_millimetres: u32,
    in_metres: bool,
}

impl Looks {
    /// When a scan was taken by odometry's clock, whose newest stamp is `newest_ns`: at its own stamp, or if that is of
    /// another clock now; and how far the clocks are apart then.
    pub fn taken_ns(&mut self, scan: &Scan, newest_ns: Option<StampNs>) -> (StampNs, Option<i64>) {
        let Some(newest_ns) = newest_ns else { return (scan.stamp_ns, None) };
        let lag_ns = newest_ns.saturating_sub(scan.stamp_ns);
        let before = self.lag_ns.replace(lag_ns);
        let steady = before.is_some_and(|b| b.saturating_sub(lag_ns).saturating_abs() < STEADY_NS);
        if lag_ns.saturating_abs() > APART_NS && steady {
            (newest_ns, Some(lag_ns))
        } else {
            (scan.stamp_ns, None)
        }
    }

    /// Whether a laser sends millimetres, going by its first scans.
    pub fn sends_millimetres(&mut self, scan: &Scan, range_min_m: f64, range_max_m: f64) -> bool {
        if self.in_metres || self.in_millimetres >= MILLIMETRE_SCANS {
            return !self.in_metres;
        }
        let mut finite: Vec<f64> =
            scan.ranges_m.iter().filter(|r| r.is_finite()).map(|r| f64::from(*r)).collect();
        if finite.is_empty() {
            return false;
        }
        finite.sort_by(f64::total_cmp);
        let within = finite.iter().filter(|r| (range_min_m..range_max_m).contains(&(*r / 1000.0))).count();
        let far = finite.iter().all(|r| *r > range_max_m);
        finite.dedup();
        // A quarter of all rays is enough: the others may see nothing.
        let plausible = far && 4 * within > scan.ranges_m.len() && finite.len() >= MILLIMETRES_UNLIKE;
        self.in_metres = !plausible;
        self.in_millimetres += u32::from(plausible);
        false
    }

    /// Whether a scan repeats the one before, though the robot has moved since.
    pub fn is_frozen(&mut self, scan: &Scan, odom_from_body: &Pose2) -> bool {
        let same = scan.ranges_m.len() == self.last.len()
            && scan.ranges_m.iter().zip(&self.last).all(|(a, b)| a.to_bits() == b.to_bits());
        if !same {
            self.last.clone_from(&scan.ranges_m);
            self.last_at = *odom_from_body;
            return false;
        }
        let moved = self.last_at.between(odom_from_body);
        moved.x_m.hypot(moved.y_m) > FROZEN_M || moved.yaw_rad.abs() > FROZEN_RAD
    }

    /// Whether nothing has been within reach for some path.
    pub fn is_blind(&mut self, hits: usize, odom_from_body: &Pose2) -> bool {
        if hits > 0 {
            self.blind = 0;
        }
        if self.blind == 0 {
            self.blind_from = *odom_from_body;
        }
        self.blind += u32::from(hits == 0);
        self.blind >= BLIND_SCANS && self.blind_from.distance_m(odom_from_body) > BLIND_M
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn scan(stamp_ns: StampNs, range_m: f32) -> Scan {
        Scan {
            robot: "r".into(),
            laser: "front".into(),
            stamp_ns,
            angle_min_rad: 0.0,
            angle_increment_rad: 0.1,
            time_increment_s: 0.0,
            ranges_m: vec![range_m, f32::NAN],
        }
    }

    #[test]
    fn a_scan_of_another_clock_is_of_now() {
        let mut looks = Looks::default();
        let hour_ns = 3600 * 1_000_000_000;
        for k in 1..5_i64 {
            let (now, apart) = looks.taken_ns(&scan(k * 100_000_000 - hour_ns, 1.0), Some(k * 100_000_000));
            assert_eq!(apart.is_some(), k > 1, "{k}");
            assert!(k == 1 || now == k * 100_000_000);
        }
        // Scans that come in one batch after their odometry are of their own time.
        let mut looks = Looks::default();
        for k in 1..50_i64 {
            assert_eq!(looks.taken_ns(&scan(k * 500_000_000, 1.0), Some(hour_ns)), (k * 500_000_000, None));
        }
    }

    #[test]
    fn what_repeats_while_the_robot_moves_is_no_look() {
        let mut looks = Looks::default();
        let at = |x_m| Pose2::new(x_m, 0.0, 0.0);
        assert!(!looks.is_frozen(&scan(0, 1.0), &at(0.0)));
        assert!(!looks.is_frozen(&scan(1, 1.0), &at(0.0)), "it stands");
        assert!(looks.is_frozen(&scan(2, 1.0), &at(0.1)));
        assert!(!looks.is_frozen(&scan(3, 1.01), &at(0.2)));
    }

    #[test]
    fn millimetres_are_told_by_the_first_scans() {
        let sent = |looks: &mut Looks, range_m: &dyn Fn(usize) -> f32| {
            let ranges_m = (0..100).map(range_m).collect();
            looks.sends_millimetres(&Scan { ranges_m, ..scan(0, 1.0) }, 0.05, 20.0)
        };
        let millimetres = |k: usize| 1500.0 + 10.0 * k as f32;
        let mut looks = Looks::default();
        let told: Vec<bool> = (0..12).map(|_| sent(&mut looks, &millimetres)).collect();
        assert_eq!(told.iter().position(|t| *t), Some(10));
        assert!(sent(&mut looks, &|_| 5.0), "once told it stays");
        // In the open a SICK says the same of all rays; and who once sent metres sends metres.
        for first in [|_| 81.91, |k| 1.0 + k as f32 * 0.01] as [fn(usize) -> f32; 2] {
            let mut looks = Looks::default();
            sent(&mut looks, &first);
            assert!((0..40).all(|_| !sent(&mut looks, &millimetres)));
        }
    }

    #[test]
    fn nothing_in_reach_for_a_while_is_blind() {
        let mut looks = Looks::default();
        let told: Vec<bool> =
            (0..40).map(|k| looks.is_blind(0, &Pose2::new(0.06 * f64::from(k), 0.0, 0.0))).collect();
        assert_eq!(told.iter().position(|t| *t), Some(19));
        assert!(!looks.is_blind(9, &Pose2::new(9.0, 0.0, 0.0)));
    }
}
