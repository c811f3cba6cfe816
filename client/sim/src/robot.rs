//! A robot that drives a tour, and its wheels, which measure it badly.

use super::SimError;
use super::body::{Body, Motion, STEP_S};
use super::follow::Track;
use super::random::Draw;
use super::wheels::Wheels;
use super::world::World;
use crate::geom::{Point, between, blend, compose, distance_m};
use std::f64::consts::FRAC_PI_2;
use toponym_proto::Pose;

/// A motion: poses at equal time steps from 0 on.
#[derive(Clone, Debug, PartialEq)]
pub struct Drive {
    /// World frame.
    pub poses: Vec<Pose>,
}

impl Drive {
    /// Length in time.
    pub fn duration_s(&self) -> f64 {
        self.poses.len().saturating_sub(1) as f64 * STEP_S
    }

    /// Pose at a time, held before the start and after the end.
    pub fn at(&self, t_s: f64) -> Pose {
        let last = self.poses.len().saturating_sub(1);
        let k = (t_s / STEP_S).clamp(0.0, last as f64);
        let (low, high) = (k.floor() as usize, (k.floor() as usize + 1).min(last));
        match (self.poses.get(low), self.poses.get(high)) {
            (Some(a), Some(b)) => blend(a, b, k.fract()),
            _ => Pose::default(),
        }
    }

    /// Way driven, metres.
    pub fn path_m(&self) -> f64 {
        self.poses.windows(2).map(|w| distance_m([w[0].x_m, w[0].y_m], [w[1].x_m, w[1].y_m])).sum()
    }

    /// The same motion as the wheels measure it, from the origin of the odometry frame.
    #[must_use]
    pub fn measured(&self, wheels: &Wheels, draw: &mut Draw) -> Self {
        let mut at = Pose::default();
        let mut poses = vec![at];
        for pair in self.poses.windows(2) {
            let step = between(&pair[0], &pair[1]);
            let way_m = step.x_m.hypot(step.y_m);
            let turn_rad = step.yaw_rad.abs();
            let scale = 1.0 + wheels.scale_error;
            let noise_m = wheels.noise_m * way_m.sqrt() * draw.normal();
            let yaw_noise = wheels.yaw_noise_rad * way_m.sqrt() * draw.normal()
                + wheels.turn_noise_rad * turn_rad.sqrt() * draw.normal();
            let measured = Pose {
                x_m: step.x_m * scale + noise_m,
                y_m: step.y_m * scale,
                yaw_rad: step.yaw_rad * (1.0 + wheels.turn_error)
                    + wheels.yaw_bias_rad_per_m * way_m
                    + yaw_noise,
            };
            at = compose(&at, &measured);
            poses.push(at);
        }
        Self { poses }
    }
}

/// Drives from room to room (indices into [`World::rooms`]), resting at each.
pub fn drive(world: &World, tour: &[usize], motion: &Motion, draw: &mut Draw) -> Result<Drive, SimError> {
    let spot = |k: usize| world.rooms.get(k).map(|r| r.spot).ok_or(SimError::NoSuchRoom(k));
    let first = spot(*tour.first().ok_or(SimError::NoTour)?)?;
    let start = world.waypoints[first];
    let mut legs = Vec::new();
    for pair in tour.windows(2) {
        let route = world.route(spot(pair[0])?, spot(pair[1])?);
        legs.push(route.ok_or(SimError::NoWay(pair[0], pair[1]))?);
    }
    Ok(drive_legs(world, start, &legs, motion, draw))
}

/// Drives along legs, each from where the last one ends, resting after each.
pub(crate) fn drive_legs(
    world: &World,
    start: Point,
    legs: &[Vec<Point>],
    motion: &Motion,
    draw: &mut Draw,
) -> Drive {
    let ahead = legs.first().and_then(|l| l.get(1)).copied().unwrap_or([start[0] + 1.0, start[1]]);
    // Parked square to the walls, as robots are.
    let towards = (ahead[1] - start[1]).atan2(ahead[0] - start[0]);
    let yaw_rad = (towards / FRAC_PI_2).round() * FRAC_PI_2;
    let mut body = Body { pose: Pose { x_m: start[0], y_m: start[1], yaw_rad }, speed_mps: 0.0 };
    let mut poses = vec![body.pose];
    body.rest(motion.rest_s, &mut poses);
    for leg in legs {
        let cruise_mps = draw.within(motion.speed_mps);
        if let Some(floor) = world.floor() {
            body.follow(&Track::new(floor, leg), cruise_mps, motion, &mut poses);
            body.rest(motion.rest_s, &mut poses);
            continue;
        }
        for (k, &target) in leg.iter().enumerate().skip(1) {
            body.go_to(target, k + 1 == leg.len(), cruise_mps, motion, &mut poses);
        }
        body.rest(motion.rest_s, &mut poses);
    }
    Drive { poses }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{demo_building, random_office};

    #[test]
    fn the_robot_keeps_clear_of_walls_and_within_its_speed() {
        let motion = Motion::default();
        for world in [demo_building(), random_office(&crate::OfficeStyle::default(), 3)] {
            let tour: Vec<usize> = (0..world.rooms.len()).collect();
            let drive = drive(&world, &tour, &motion, &mut Draw::new(1, 0)).unwrap();
            for pose in drive.poses.iter().step_by(10) {
                let clearance_m = world.clearance_m([pose.x_m, pose.y_m]);
                assert!(clearance_m > 0.2, "{clearance_m} m at {pose:?}");
            }
            for pair in drive.poses.windows(2) {
                let step = between(&pair[0], &pair[1]);
                assert!(step.x_m.abs() / STEP_S <= motion.speed_mps.1 + 1e-9);
                assert!(step.yaw_rad.abs() / STEP_S <= motion.turn_max_radps + 1e-9);
            }
            let mean_mps = drive.path_m() / drive.duration_s();
            assert!(mean_mps > 0.3, "{mean_mps} m/s: it circles or stands");
        }
    }

    fn straight(length_m: f64) -> Drive {
        let steps = (length_m / 0.02) as usize;
        Drive { poses: (0..=steps).map(|k| Pose { x_m: 0.02 * k as f64, ..Pose::default() }).collect() }
    }

    #[test]
    fn perfect_wheels_measure_the_motion() {
        let mut truth = straight(3.0);
        truth.poses.push(Pose { x_m: 3.0, y_m: 0.0, yaw_rad: 0.4 });
        let measured = truth.measured(&Wheels::perfect(), &mut Draw::new(1, 0));
        for (a, b) in truth.poses.iter().zip(&measured.poses) {
            assert!((a.x_m - b.x_m).abs() + (a.yaw_rad - b.yaw_rad).abs() < 1e-9);
        }
    }

    #[test]
    fn drift_is_what_the_wheels_are_said_to_have() {
        let wheels = Wheels { yaw_noise_rad: 0.001, ..Wheels::default() };
        let truth = straight(50.0);
        let ends: Vec<Pose> = (0..200)
            .map(|seed| truth.measured(&wheels, &mut Draw::new(seed, 0)).poses.pop().unwrap())
            .collect();
        let mean = |f: &dyn Fn(&Pose) -> f64| ends.iter().map(f).sum::<f64>() / ends.len() as f64;
        let yaw = mean(&|p| p.yaw_rad);
        assert!((yaw - 50.0 * wheels.yaw_bias_rad_per_m).abs() < 0.003, "bias {yaw}");
        let spread = mean(&|p| (p.yaw_rad - yaw).powi(2)).sqrt();
        assert!((spread / (wheels.yaw_noise_rad * 50f64.sqrt()) - 1.0).abs() < 0.2, "spread {spread}");
        let x = mean(&|p| p.x_m.hypot(p.y_m));
        assert!((x - 50.5).abs() < 0.1, "scale {x}");
    }
}
