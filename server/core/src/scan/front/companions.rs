//! Who comes along: the guide's legs ahead of the robot, a trolley that it pulls.
//!
//! In a bare corridor the walls leave the way along free, and ten points that keep their distance from
//! the robot say with one voice that it stands still. A surface that should have come nearer since some
//! decimetres ago, and is seen at the same range as then, is left out.

use crate::geometry::{Pose2, wrap};
use crate::scan::cloud::Point;
use crate::scan::sweep::{RangeImage, Sweep};
use serde::{Deserialize, Serialize};
use std::collections::VecDeque;

/// A scan is compared with one from so far back …
const BACK_M: f64 = 0.5;
/// … heading nearly the same way.
const TURNED_MAX_RAD: f64 = 0.35;
/// A surface tells by coming nearer, or going away, by so much at least.
const NEARER_M: f64 = 0.3;
/// Legs swing.
const SAME_RANGE_M: f64 = 0.15;
/// Companions are few: where more keeps its range than this share, the wheels slip.
const SHARE_MAX: f64 = 0.25;
/// Scans are remembered every so often, and so many.
const EVERY_M: f64 = 0.1;
const REMEMBERED_MAX: usize = 16;

/// Scans of the last decimetres: how far was seen from where, by odometry.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub(super) struct Companions {
    past: VecDeque<(Pose2, RangeImage)>,
}

impl Companions {
    /// The sweep without what comes along.
    pub fn dismiss(&mut self, odom_from_body: &Pose2, mut sweep: Sweep) -> Sweep {
        if let Some(comes_along) = self.compare(odom_from_body, &sweep) {
            let count = comes_along.iter().filter(|c| **c).count();
            if count as f64 <= SHARE_MAX * comes_along.len() as f64 {
                let mut flags = comes_along.into_iter();
                sweep.points.retain(|_| flags.next() != Some(true));
            }
        }
        self.remember(odom_from_body, &sweep.image);
        sweep
    }

    /// Odometry broke: what was remembered has no place any more.
    pub fn forget(&mut self) {
        self.past.clear();
    }

    /// For each point whether it comes along; none without a scan to compare with.
    fn compare(&self, odom_from_body: &Pose2, sweep: &Sweep) -> Option<Vec<bool>> {
        let mount = &sweep.image.body_from_laser;
        let (then, image) = self.past.iter().rev().find(|(then, image)| {
            image.body_from_laser == *mount && then.distance_m(odom_from_body) >= BACK_M
        })?;
        let then_from_now = then.between(odom_from_body);
        if wrap(then_from_now.yaw_rad).abs() > TURNED_MAX_RAD {
            return None;
        }
        let laser_from_body = mount.inverse();
        let comes_along = |p: &Point| {
            let (x, y) = (f64::from(p.x), f64::from(p.y));
            let (lx, ly) = laser_from_body.apply(x, y);
            let range_m = lx.hypot(ly);
            let (was_x, was_y) = then_from_now.apply(x, y);
            let nearer_m = (was_x - x) * f64::from(p.nx) + (was_y - y) * f64::from(p.ny);
            // A point without a normal may be a wall's, seen along it.
            if nearer_m.abs() < NEARER_M {
                return false;
            }
            let same = |then_m: f64| (range_m - then_m).abs() < SAME_RANGE_M;
            image.at(ly.atan2(lx)).is_some_and(|(near_m, far_m)| same(near_m) || same(far_m))
        };
        Some(sweep.points.iter().map(comes_along).collect())
    }

    fn remember(&mut self, odom_from_body: &Pose2, image: &RangeImage) {
        let same = |(_, other): &&(Pose2, RangeImage)| other.body_from_laser == image.body_from_laser;
        let last = self.past.iter().rev().find(same);
        if last.is_none_or(|(then, _)| then.distance_m(odom_from_body) >= EVERY_M) {
            self.past.push_back((*odom_from_body, image.clone()));
        }
        while self.past.len() > REMEMBERED_MAX {
            self.past.pop_front();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::event::{Laser, Scan};
    use crate::scan::sweep::sweep;
    use std::f64::consts::{PI, TAU};

    /// What is seen from `x_m` along a corridor 2.4 m wide that ends at 15 m, with a post at 6 m by the
    /// wall, and, if there is one, a guide ahead.
    fn seen(x_m: f64, guide_m: Option<f64>) -> Sweep {
        let disc = |cx: f64, cy: f64, r: f64, c: f64, s: f64| {
            let along = cx * c + cy * s;
            let off2 = cx * cx + cy * cy - along * along;
            (along > 0.0 && off2 < r * r).then(|| along - (r * r - off2).sqrt())
        };
        let ranges_m = (0..720)
            .map(|k| {
                let (s, c) = (f64::from(k) * TAU / 720.0 - PI).sin_cos();
                let wall = if s == 0.0 { f64::INFINITY } else { 1.2 / s.abs() };
                let end = if c > 0.0 { (15.0 - x_m) / c } else { f64::INFINITY };
                let post = disc(6.0 - x_m, 0.9, 0.15, c, s).unwrap_or(f64::INFINITY);
                let legs = guide_m.and_then(|ahead| disc(ahead, 0.1, 0.08, c, s)).unwrap_or(f64::INFINITY);
                wall.min(end).min(post).min(legs) as f32
            })
            .collect();
        let scan = Scan {
            robot: "r".into(),
            laser: "l".into(),
            stamp_ns: 0,
            angle_min_rad: -PI,
            angle_increment_rad: TAU / 720.0,
            time_increment_s: 0.0,
            ranges_m,
        };
        let laser = Laser {
            id: "l".into(),
            body_from_laser: Pose2::default(),
            upside_down: false,
            range_min_m: 0.05,
            range_max_m: 12.0,
            ignored_rad: vec![],
        };
        sweep(&scan, &laser, |_| Pose2::default())
    }

    /// What is left of the last of some scans 7 cm apart by odometry, `step_m` in truth.
    fn left(step_m: f64, guide_m: Option<f64>) -> (Sweep, Sweep) {
        let mut companions = Companions::default();
        let mut last = None;
        for k in 0..30 {
            let sweep = seen(f64::from(k) * step_m, guide_m);
            let odom_from_body = Pose2::new(f64::from(k) * 0.07, 0.0, 0.0);
            last = Some((sweep.clone(), companions.dismiss(&odom_from_body, sweep)));
        }
        last.unwrap()
    }

    #[test]
    fn a_guide_ahead_is_left_out_and_nothing_else() {
        let (all, kept) = left(0.07, Some(1.5));
        let legs = |s: &Sweep| s.points.iter().filter(|p| (p.x - 1.5).abs() < 0.2 && p.y.abs() < 0.3).count();
        assert!(legs(&all) >= 10 && legs(&kept) == 0, "{} {}", legs(&all), legs(&kept));
        let gone = all.points.len() - kept.points.len();
        assert!(gone <= legs(&all) + 3, "{gone} of {}", all.points.len());
    }

    #[test]
    fn what_stands_still_stays() {
        let (all, kept) = left(0.07, None);
        assert!(all.points.len() - kept.points.len() <= 3);
    }

    #[test]
    fn where_wheels_slip_all_stays() {
        // Stuck before the end wall: all that faces the robot keeps its range.
        let mut companions = Companions::default();
        for k in 0..30 {
            let sweep = seen(14.2, None);
            let all = sweep.points.len();
            let odom_from_body = Pose2::new(f64::from(k) * 0.07, 0.0, 0.0);
            assert_eq!(companions.dismiss(&odom_from_body, sweep).points.len(), all);
        }
    }
}
