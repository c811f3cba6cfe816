//! Driving along a path in curves, as robots do, rather than from corner to corner.

use super::body::{Body, Motion, STEP_S};
use super::floor::Floor;
use crate::geom::{Point, distance_m, wrap};
use toponym_proto::Pose;

/// Distance of the path's points.
const POINT_M: f64 = 0.05;
/// The robot heads for a point this far ahead on its path, by the room there is.
const AHEAD_M: (f64, f64) = (0.2, 0.6);
/// With its target further aside than this the robot turns on the spot.
const ASIDE_RAD: f64 = 0.9;
/// The path ends here.
const THERE_M: f64 = 0.06;
/// Nobody takes longer than this for a metre: whoever does is stuck.
const STUCK_S_PER_M: f64 = 60.0;

/// A path over the free floor.
pub(crate) struct Track<'a> {
    floor: &'a Floor,
    points: Vec<Point>,
}

impl<'a> Track<'a> {
    /// The path along the corners of a route.
    pub(crate) fn new(floor: &'a Floor, route: &[Point]) -> Self {
        let mut points: Vec<Point> = route.first().copied().into_iter().collect();
        for leg in route.windows(2) {
            let steps = (distance_m(leg[0], leg[1]) / POINT_M).ceil();
            points.extend((1..=steps as usize).map(|k| {
                let f = k as f64 / steps;
                [0, 1].map(|axis| leg[0][axis] + f * (leg[1][axis] - leg[0][axis]))
            }));
        }
        Self { floor, points }
    }
}

impl Body {
    /// Drives along a path and stops at its end.
    pub(crate) fn follow(
        &mut self,
        track: &Track<'_>,
        cruise_mps: f64,
        motion: &Motion,
        poses: &mut Vec<Pose>,
    ) {
        let Some(last) = track.points.len().checked_sub(1) else { return };
        let steps_max = (STUCK_S_PER_M * (1.0 + last as f64 * POINT_M) / STEP_S) as usize;
        let mut passed = 0;
        for _ in 0..steps_max {
            let here = [self.pose.x_m, self.pose.y_m];
            let ahead_m = track.floor.clearance_m(here).clamp(AHEAD_M.0, AHEAD_M.1);
            while passed < last && distance_m(track.points[passed], here) < ahead_m {
                passed += 1;
            }
            let target = track.points[passed];
            let left_m = distance_m(here, target) + (last - passed) as f64 * POINT_M;
            if left_m < THERE_M {
                return;
            }
            let off_rad = wrap((target[1] - here[1]).atan2(target[0] - here[0]) - self.pose.yaw_rad);
            let turn_radps = (2.5 * off_rad).clamp(-motion.turn_max_radps, motion.turn_max_radps);
            let straight = (1.0 - off_rad.abs() / ASIDE_RAD).max(0.0);
            let brake_mps = (2.0 * motion.accel_mps2 * left_m).sqrt();
            // Where it is narrow one drives slowly.
            let narrow_mps = 0.15 + ahead_m;
            let wanted_mps = (cruise_mps * straight).min(brake_mps * straight).min(narrow_mps);
            self.step(wanted_mps, turn_radps, motion, poses);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geom::{Area, Rect, Segment};

    #[test]
    fn the_robot_stays_on_its_path_and_stops_at_its_end() {
        let area: Area = Rect::new([0.0, 0.0], [8.0, 6.0]).into();
        let walls: Vec<Segment> = area.edges().collect();
        let floor = Floor::new(&[area], &walls);
        let route = [[1.0, 1.0], [5.0, 1.0], [5.0, 5.0], [1.0, 5.0]];
        let mut body = Body { pose: Pose { x_m: 1.0, y_m: 1.0, yaw_rad: 3.0 }, speed_mps: 0.0 };
        let mut poses = vec![body.pose];
        let motion = Motion::default();
        body.follow(&Track::new(&floor, &route), 0.9, &motion, &mut poses);
        assert!(distance_m([body.pose.x_m, body.pose.y_m], route[3]) < THERE_M);
        let legs: Vec<_> = route.windows(2).map(|w| Segment { a: w[0], b: w[1] }).collect();
        let off_m =
            |p: &Pose| legs.iter().map(|l| l.distance_m([p.x_m, p.y_m])).fold(f64::INFINITY, f64::min);
        let worst_m = poses.iter().map(off_m).fold(0.0, f64::max);
        assert!(worst_m < 0.3, "{worst_m} m");
        assert!(poses.len() as f64 * STEP_S < 12.0 / 0.9 * 2.0, "{} s", poses.len() as f64 * STEP_S);
        // Curves are driven, not stood through.
        let turning = poses.windows(2).filter(|w| wrap(w[1].yaw_rad - w[0].yaw_rad).abs() > 0.3 * STEP_S);
        let moving =
            turning.filter(|w| distance_m([w[0].x_m, w[0].y_m], [w[1].x_m, w[1].y_m]) > 0.2 * STEP_S);
        assert!(moving.count() > 50);
    }
}
