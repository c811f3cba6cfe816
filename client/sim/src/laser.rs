//! A laser range finder.

use super::people::People;
use super::random::Draw;
use super::robot::Drive;
use super::world::{Surface, World};
use crate::geom::apply;
use std::f64::consts::{PI, TAU};
use toponym_proto::Pose;
use toponym_proto::stream::Laser;

/// Dark walls are seen up to here.
const DARK_MAX_M: f64 = 3.0;
/// Glass is seen within this of its normal.
const GLASS_MAX_RAD: f64 = 0.35;

/// A part of the robot in the laser's way.
#[derive(Clone, Debug, PartialEq)]
pub struct Post {
    /// Bearing of its edges, laser frame, from the lower on.
    pub sector_rad: (f64, f64),
    /// Range at these edges, metres.
    pub range_m: (f64, f64),
}

/// A laser: where it sits and how it measures.
#[derive(Clone, Debug, PartialEq)]
pub struct LaserModel {
    /// Id, mounting and reach, as the robot's setup tells them.
    pub mount: Laser,
    /// Field of view, centred on the laser's x axis.
    pub fov_rad: f64,
    /// Rays per sweep, from and to, at least 2; drawn anew for each where they differ.
    pub beams: (usize, usize),
    /// Standard deviation of a range, metres.
    pub noise_m: f64,
    /// Share of the rays that come back without information (NaN).
    pub dropouts: f64,
    /// Sweeps per second.
    pub rate_hz: f64,
    /// From one end of the field of view to the other; 0: all at once.
    pub sweep_s: f64,
    /// What of the robot it sees.
    pub post: Option<Post>,
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
            beams: (181, 181),
            noise_m: 0.01,
            dropouts: 0.002,
            rate_hz: 5.0,
            sweep_s: 0.0,
            post: None,
        }
    }
}

/// One sweep of a laser.
#[derive(Clone, Debug, PartialEq)]
pub struct Sweep {
    /// Whole millimetres; `+inf` nothing seen, NaN no information.
    pub ranges_m: Vec<f32>,
    /// Bearing from ray to ray.
    pub angle_increment_rad: f64,
    /// Time from ray to ray.
    pub time_increment_s: f64,
}

/// What a ray may meet.
#[derive(Clone, Copy, Debug)]
pub struct Scene<'a> {
    /// Walls.
    pub world: &'a World,
    /// The robot.
    pub drive: &'a Drive,
    /// Legs.
    pub people: &'a People,
}

impl LaserModel {
    /// A cheap lidar that turns ten times a second: mounted backwards, never the same number of
    /// rays, and with a post of the robot in its way.
    pub fn rplidar() -> Self {
        let post = Post { sector_rad: (2.45, 2.75), range_m: (0.1, 0.3) };
        Self {
            mount: Laser {
                id: "lidar".into(),
                x_m: 0.08,
                y_m: -0.03,
                yaw_rad: PI,
                upside_down: false,
                range_min_m: 0.05,
                range_max_m: 12.0,
                ignored_rad: vec![(post.sector_rad.0 - 0.04, post.sector_rad.1 + 0.04)],
            },
            fov_rad: TAU,
            beams: (715, 725),
            noise_m: 0.015,
            dropouts: 0.01,
            rate_hz: 10.0,
            sweep_s: 0.1,
            post: Some(post),
        }
    }

    /// Bearing of the first ray, laser frame.
    pub fn angle_min_rad(&self) -> f64 {
        -self.fov_rad / 2.0
    }

    /// Steps from one end of the field of view to the other; a full circle does not see its first
    /// ray twice.
    fn gaps(&self, beams: usize) -> f64 {
        let gaps = if self.fov_rad >= TAU - 1e-9 { beams } else { beams.saturating_sub(1) };
        gaps.max(1) as f64
    }

    /// One sweep, first ray at `t_s`.
    pub fn sweep(&self, scene: &Scene<'_>, t_s: f64, draw: &mut Draw) -> Sweep {
        let (least, most) = self.beams;
        let beams = if least < most { least + draw.below(most - least + 1) } else { least };
        let angle_increment_rad = self.fov_rad / self.gaps(beams);
        let time_increment_s = self.sweep_s / self.gaps(beams);
        let start = scene.drive.at(t_s);
        let blind = scene.world.is_dark([start.x_m, start.y_m]);
        let near = scene.people.near([start.x_m, start.y_m], self.mount.range_max_m, t_s);
        let ranges_m = (0..beams)
            .map(|k| {
                let at_s = t_s + k as f64 * time_increment_s;
                let bearing = self.angle_min_rad() + k as f64 * angle_increment_rad;
                let range_m = self.range_m(scene, &near, at_s, bearing);
                // Drawn for every ray, seen or not: one wall more must not shift the others' noise.
                let (noise_m, dropped) = (self.noise_m * draw.normal(), draw.chance(self.dropouts));
                match range_m {
                    _ if blind => f32::INFINITY,
                    _ if dropped => f32::NAN,
                    None => f32::INFINITY,
                    Some(range_m) => (((range_m + noise_m).max(0.0) * 1e3).round() / 1e3) as f32,
                }
            })
            .collect();
        Sweep { ranges_m, angle_increment_rad, time_increment_s }
    }

    /// True ranges of a sweep at once from a place of the body, without people and noise; none
    /// where nothing comes back.
    pub fn ranges_m(&self, world: &World, world_from_body: &Pose) -> Vec<Option<f64>> {
        let beams = self.beams.0;
        if world.is_dark([world_from_body.x_m, world_from_body.y_m]) {
            return vec![None; beams];
        }
        let drive = Drive { poses: vec![*world_from_body] };
        let scene = Scene { world, drive: &drive, people: &People::default() };
        let bearing = |k: usize| self.angle_min_rad() + k as f64 * self.fov_rad / self.gaps(beams);
        (0..beams).map(|k| self.range_m(&scene, &[], 0.0, bearing(k))).collect()
    }

    /// True range of one ray; none if nothing sends it back.
    fn range_m(&self, scene: &Scene<'_>, near: &[usize], t_s: f64, bearing: f64) -> Option<f64> {
        if let Some(range_m) = self.post.as_ref().and_then(|p| p.range_m(bearing)) {
            return Some(range_m);
        }
        let body = scene.drive.at(t_s);
        let handed = if self.mount.upside_down { -1.0 } else { 1.0 };
        let origin = apply(&body, [self.mount.x_m, self.mount.y_m]);
        let direction = body.yaw_rad + self.mount.yaw_rad + handed * bearing;
        let wall = scene.world.strike(origin, direction, self.mount.range_max_m);
        let leg_m = scene.people.cast(near, t_s, origin, direction);
        let reach_m = self.mount.range_max_m.min(scene.world.dark_from_m(origin, direction));
        match (wall, leg_m.filter(|&m| m < reach_m)) {
            (Some(wall), Some(leg_m)) if leg_m < wall.range_m => Some(leg_m),
            (None, leg_m) => leg_m,
            (Some(wall), _) => {
                let sends_back = match scene.world.surfaces.get(wall.wall).copied().unwrap_or_default() {
                    Surface::Plain => true,
                    Surface::Dark => wall.range_m < DARK_MAX_M,
                    Surface::Glass => scene.world.walls[wall.wall].incidence_rad(direction) < GLASS_MAX_RAD,
                };
                sends_back.then_some(wall.range_m)
            }
        }
    }
}

impl Post {
    /// Its range in a direction, laser frame; none beside it.
    fn range_m(&self, bearing_rad: f64) -> Option<f64> {
        let (from, to) = self.sector_rad;
        let f = (bearing_rad - from) / (to - from);
        (0.0..=1.0).contains(&f).then_some(self.range_m.0 + f * (self.range_m.1 - self.range_m.0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geom::{Rect, compose};
    use crate::world::Plan;
    use std::collections::BTreeSet;

    fn room() -> World {
        let mut plan = Plan::default();
        plan.room("a", Rect::new([0.0, 0.0], [6.0, 4.0]));
        plan.build()
    }

    fn exact(mount: Laser) -> LaserModel {
        LaserModel { mount, noise_m: 0.0, dropouts: 0.0, ..LaserModel::default() }
    }

    fn swept(laser: &LaserModel, world: &World, drive: &Drive, draw: &mut Draw) -> Vec<f32> {
        laser.sweep(&Scene { world, drive, people: &People::default() }, 0.0, draw).ranges_m
    }

    fn standing(x_m: f64, y_m: f64, yaw_rad: f64) -> Drive {
        Drive { poses: vec![Pose { x_m, y_m, yaw_rad }] }
    }

    #[test]
    fn ranges_follow_from_the_mounting() {
        let base = LaserModel::default().mount;
        let drive = standing(1.0, 1.0, 0.0);
        let sweep = |mount: Laser| swept(&exact(mount), &room(), &drive, &mut Draw::new(1, 0));
        let upright = sweep(Laser { x_m: 0.5, ..base.clone() });
        assert_eq!((upright[0], upright[90], upright[180]), (1.0, 4.5, 3.0));
        let turned = sweep(Laser { x_m: 0.5, upside_down: true, ..base.clone() });
        assert_eq!((turned[0], turned[90], turned[180]), (3.0, 4.5, 1.0));
        let left = sweep(Laser { x_m: 0.0, yaw_rad: PI / 2.0, ..base });
        assert_eq!((left[0], left[90], left[180]), (5.0, 3.0, 1.0));
    }

    #[test]
    fn noise_and_dropouts_are_as_said() {
        let laser = LaserModel { dropouts: 0.1, beams: (2, 2), fov_rad: 0.002, ..LaserModel::default() };
        let (world, drive) = (room(), standing(1.0, 1.0, 0.0));
        let mut draw = Draw::new(1, 0);
        let all: Vec<f32> = (0..2000).flat_map(|_| swept(&laser, &world, &drive, &mut draw)).collect();
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
        let ranges = swept(&laser, &room(), &Drive { poses }, &mut Draw::new(1, 0));
        // Ray 90 leaves 0.09 s after the first, 0.09 m further on.
        assert!((f64::from(ranges[90]) - (6.0 - 1.2 - 0.09)).abs() < 2e-3, "{}", ranges[90]);
    }

    #[test]
    fn beyond_the_reach_there_is_nothing() {
        let mut laser = exact(LaserModel::default().mount);
        laser.mount.range_max_m = 2.0;
        let ranges = swept(&laser, &room(), &standing(1.0, 1.0, 0.0), &mut Draw::new(1, 0));
        assert!(ranges[90].is_infinite() && ranges[0].is_finite());
    }

    /// Turning on the spot at 1 rad/s while driving 0.6 m/s: where the rays strike, by the truth.
    fn points_of(laser: &LaserModel, sweep: &Sweep, drive: &Drive) -> Vec<[f64; 2]> {
        let handed = if laser.mount.upside_down { -1.0 } else { 1.0 };
        let rays = sweep.ranges_m.iter().enumerate().filter(|(_, r)| r.is_finite());
        rays.filter_map(|(k, &range_m)| {
            let bearing = laser.angle_min_rad() + k as f64 * sweep.angle_increment_rad;
            let ignored = |&(from, to): &(f64, f64)| (from..to).contains(&bearing);
            if laser.mount.ignored_rad.iter().any(ignored) {
                return None;
            }
            let mount = Pose {
                x_m: laser.mount.x_m,
                y_m: laser.mount.y_m,
                yaw_rad: laser.mount.yaw_rad + handed * bearing,
            };
            let ray = compose(&drive.at(k as f64 * sweep.time_increment_s), &mount);
            Some(apply(&ray, [f64::from(range_m), 0.0]))
        })
        .collect()
    }

    #[test]
    fn the_walls_are_straight_after_deskewing_with_the_truth() {
        let poses = (0..8)
            .map(|k| Pose { x_m: 2.0 + 0.012 * f64::from(k), y_m: 2.0, yaw_rad: 0.3 + 0.02 * f64::from(k) })
            .collect();
        let (world, drive) = (room(), Drive { poses });
        for upside_down in [false, true] {
            let mut laser = LaserModel { noise_m: 0.0, dropouts: 0.0, ..LaserModel::rplidar() };
            laser.mount.upside_down = upside_down;
            let scene = Scene { world: &world, drive: &drive, people: &People::default() };
            let sweep = laser.sweep(&scene, 0.0, &mut Draw::new(1, 0));
            let points = points_of(&laser, &sweep, &drive);
            assert!(points.len() > 650);
            let worst =
                |points: &[[f64; 2]]| points.iter().map(|&p| world.clearance_m(p)).fold(0.0, f64::max);
            assert!(worst(&points) < 1e-3, "{} m off the walls", worst(&points));
            let still = Drive { poses: vec![drive.at(0.0)] };
            let skewed = points_of(&laser, &sweep, &still);
            assert!(worst(&skewed) > 0.1, "the motion must show");
        }
    }

    #[test]
    fn an_rplidar_varies_its_beams_and_sees_its_post_where_the_setup_says() {
        let laser = LaserModel::rplidar();
        let (world, drive) = (room(), standing(3.0, 2.0, 0.0));
        let mut draw = Draw::new(1, 0);
        let scene = Scene { world: &world, drive: &drive, people: &People::default() };
        let sweeps: Vec<Sweep> = (0..300).map(|_| laser.sweep(&scene, 0.0, &mut draw)).collect();
        let beams: BTreeSet<usize> = sweeps.iter().map(|s| s.ranges_m.len()).collect();
        assert_eq!(beams, (715..=725).collect());
        for sweep in &sweeps {
            let turned_rad = sweep.angle_increment_rad * sweep.ranges_m.len() as f64;
            let took_s = sweep.time_increment_s * sweep.ranges_m.len() as f64;
            assert!((turned_rad - TAU).abs() < 1e-9 && (took_s - 0.1).abs() < 1e-9);
            for (k, &range_m) in sweep.ranges_m.iter().enumerate() {
                let bearing = laser.angle_min_rad() + k as f64 * sweep.angle_increment_rad;
                let (from, to) = laser.mount.ignored_rad[0];
                let on_post = range_m < 0.5;
                assert!(!on_post || (from..to).contains(&bearing), "{range_m} m at {bearing}");
                let within = (from + 0.05..to - 0.05).contains(&bearing);
                assert!(on_post || !within || !range_m.is_finite(), "{range_m} m through the post");
            }
        }
    }

    #[test]
    fn on_dark_floor_there_is_nothing_to_see_not_even_dropouts() {
        let mut world = room();
        world.dark = vec![Rect::new([0.0, 0.0], [2.0, 4.0])];
        let laser = LaserModel { dropouts: 0.5, ..LaserModel::default() };
        let look = |x_m| swept(&laser, &world, &standing(x_m, 2.0, 0.0), &mut Draw::new(1, 0));
        // The laser itself, 0.2 m ahead, is out of the dark already.
        assert!(look(1.9).iter().all(|r| *r == f32::INFINITY));
        assert!(look(2.1).iter().any(|r| r.is_finite()));
        let at = |x_m| laser.ranges_m(&world, &Pose { x_m, y_m: 2.0, yaw_rad: 0.0 });
        assert!(at(1.9).iter().all(Option::is_none));
        assert_eq!(at(2.1)[90].map(|r| (r * 1e6).round() / 1e6), Some(3.7));
    }

    #[test]
    fn dark_walls_are_seen_from_near_and_glass_squarely() {
        let mut world = room();
        let laser = exact(LaserModel::default().mount);
        let look = |world: &World, x_m: f64| {
            let ranges = swept(&laser, world, &standing(x_m, 2.0, 0.0), &mut Draw::new(1, 0));
            (ranges[90].is_finite(), ranges[120].is_finite())
        };
        assert_eq!(look(&world, 1.0), (true, true));
        world.surfaces = vec![Surface::Dark; world.walls.len()];
        assert_eq!((look(&world, 1.0), look(&world, 4.0)), ((false, false), (true, true)));
        world.surfaces = vec![Surface::Glass; world.walls.len()];
        assert_eq!(look(&world, 4.0), (true, false));
    }
}
