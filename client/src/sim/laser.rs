//! A laser range finder.

use super::geom::apply;
use super::random::Draw;
use super::robot::Drive;
use super::world::World;
use std::f64::consts::{PI, TAU};
use toponym_proto::stream::Laser;

/// A laser: where it sits and how it measures.
#[derive(Clone, Debug, PartialEq)]
pub struct LaserModel {
    /// Id, mounting and reach, as the robot's setup tells them.
    pub mount: Laser,
    /// Field of view, centred on the laser's x axis.
    pub fov_rad: f64,
    /// Rays per sweep, at least 2.
    pub beams: usize,
    /// Standard deviation of a range, metres.
    pub noise_m: f64,
    /// Share of the rays that come back without information (NaN).
    pub dropouts: f64,
    /// Sweeps per second.
    pub rate_hz: f64,
    /// From the first ray to the last; 0: all at once.
    pub sweep_s: f64,
}

impl Default for LaserModel {
    /// Half a circle ahead in whole degrees, as on many robots.
    fn default() -> Self {
        Self {
            mount: Laser {
                id: "front".into(),
                x_m: 0.2,
                y_m: 0.0,
                yaw_rad: 0.0,
                upside_down: false,
                range_min_m: 0.05,
                range_max_m: 20.0,
                ignored_rad: Vec::new(),
            },
            fov_rad: PI,
            beams: 181,
            noise_m: 0.01,
            dropouts: 0.002,
            rate_hz: 5.0,
            sweep_s: 0.0,
        }
    }
}

impl LaserModel {
    /// Bearing of the first ray, laser frame.
    pub fn angle_min_rad(&self) -> f64 {
        -self.fov_rad / 2.0
    }

    /// Bearing from ray to ray; a full circle does not see its first ray twice.
    pub fn angle_increment_rad(&self) -> f64 {
        let gaps = if self.fov_rad >= TAU - 1e-9 { self.beams } else { self.beams.saturating_sub(1) };
        self.fov_rad / gaps.max(1) as f64
    }

    /// Time from ray to ray.
    pub fn time_increment_s(&self) -> f64 {
        self.sweep_s / self.beams.saturating_sub(1).max(1) as f64
    }

    /// One sweep, first ray at `t_s`. Ranges are whole millimetres; `+inf` nothing seen, NaN no
    /// information.
    pub fn sweep(&self, world: &World, drive: &Drive, t_s: f64, draw: &mut Draw) -> Vec<f32> {
        let handed = if self.mount.upside_down { -1.0 } else { 1.0 };
        (0..self.beams)
            .map(|k| {
                let body = drive.at(t_s + k as f64 * self.time_increment_s());
                let bearing = self.angle_min_rad() + k as f64 * self.angle_increment_rad();
                let origin = apply(&body, [self.mount.x_m, self.mount.y_m]);
                let direction = body.yaw_rad + self.mount.yaw_rad + handed * bearing;
                let range = world.cast(origin, direction, self.mount.range_max_m);
                // Drawn for every ray, seen or not: one wall more must not shift the others' noise.
                let (noise_m, dropped) = (self.noise_m * draw.normal(), draw.chance(self.dropouts));
                match range {
                    _ if dropped => f32::NAN,
                    None => f32::INFINITY,
                    Some(range_m) => (((range_m + noise_m).max(0.0) * 1e3).round() / 1e3) as f32,
                }
            })
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sim::geom::Rect;
    use crate::sim::world::Plan;
    use toponym_proto::Pose;

    fn room() -> World {
        let mut plan = Plan::default();
        plan.room("a", Rect::new([0.0, 0.0], [6.0, 4.0]));
        plan.build()
    }

    fn exact(mount: Laser) -> LaserModel {
        LaserModel { mount, noise_m: 0.0, dropouts: 0.0, ..LaserModel::default() }
    }

    fn standing(x_m: f64, y_m: f64, yaw_rad: f64) -> Drive {
        Drive { poses: vec![Pose { x_m, y_m, yaw_rad }] }
    }

    #[test]
    fn ranges_follow_from_the_mounting() {
        let base = LaserModel::default().mount;
        let drive = standing(1.0, 1.0, 0.0);
        let sweep = |mount: Laser| exact(mount).sweep(&room(), &drive, 0.0, &mut Draw::new(1, 0));
        let upright = sweep(Laser { x_m: 0.5, ..base.clone() });
        assert_eq!((upright[0], upright[90], upright[180]), (1.0, 4.5, 3.0));
        let turned = sweep(Laser { x_m: 0.5, upside_down: true, ..base.clone() });
        assert_eq!((turned[0], turned[90], turned[180]), (3.0, 4.5, 1.0));
        let left = sweep(Laser { x_m: 0.0, yaw_rad: PI / 2.0, ..base });
        assert_eq!((left[0], left[90], left[180]), (5.0, 3.0, 1.0));
    }

    #[test]
    fn noise_and_dropouts_are_as_said() {
        let laser = LaserModel { dropouts: 0.1, beams: 2, fov_rad: 0.002, ..LaserModel::default() };
        let (world, drive) = (room(), standing(1.0, 1.0, 0.0));
        let mut draw = Draw::new(1, 0);
        let all: Vec<f32> = (0..2000).flat_map(|_| laser.sweep(&world, &drive, 0.0, &mut draw)).collect();
        let seen: Vec<f64> = all.iter().filter(|r| r.is_finite()).map(|&r| f64::from(r) - 4.8).collect();
        let lost = 1.0 - seen.len() as f64 / all.len() as f64;
        assert!((lost - 0.1).abs() < 0.02, "{lost}");
        let sigma = (seen.iter().map(|e| e * e).sum::<f64>() / seen.len() as f64).sqrt();
        assert!((sigma - 0.01).abs() < 0.001, "{sigma}");
    }

    #[test]
    fn a_swept_ray_sees_where_the_robot_is_by_then() {
        let laser = LaserModel { sweep_s: 0.18, ..exact(LaserModel::default().mount) };
        let poses =
            (0..20).map(|k| Pose { x_m: 1.0 + 0.02 * f64::from(k), y_m: 1.0, yaw_rad: 0.0 }).collect();
        let ranges = laser.sweep(&room(), &Drive { poses }, 0.0, &mut Draw::new(1, 0));
        // Ray 90 leaves 0.09 s after the first, 0.09 m further on.
        assert!((f64::from(ranges[90]) - (6.0 - 1.2 - 0.09)).abs() < 2e-3, "{}", ranges[90]);
    }

    #[test]
    fn beyond_the_reach_there_is_nothing() {
        let mut laser = exact(LaserModel::default().mount);
        laser.mount.range_max_m = 2.0;
        let ranges = laser.sweep(&room(), &standing(1.0, 1.0, 0.0), 0.0, &mut Draw::new(1, 0));
        assert!(ranges[90].is_infinite() && ranges[0].is_finite());
    }
}
