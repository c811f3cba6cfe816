//! People walking about: the guide ahead of the robot, others on errands of their own.

use super::SimError;
use super::random::Draw;
use super::robot::Drive;
use super::world::World;
use crate::geom::{Point, distance_m};

/// Time step of the walks, seconds.
const STEP_S: f64 = 0.1;
/// Nobody comes closer to the robot's middle than this.
const APART_M: f64 = 0.6;
/// How far the guide walks ahead along the robot's path.
const AHEAD_M: f64 = 1.5;
/// Half the distance between two legs.
const HIP_M: f64 = 0.1;
/// A leg swings this far forward and back.
const SWING_M: f64 = 0.22;
/// Length of a double step.
const STRIDE_M: f64 = 1.4;
/// Radius of a leg in trousers.
const LEG_M: f64 = 0.07;
/// A person's legs stay within this of their middle.
const REACH_M: f64 = 0.4;
/// Rooms on the round of the others; each walks it from elsewhere on.
const ROUND_ROOMS: usize = 16;

/// One person's walk.
#[derive(Clone, Debug, PartialEq)]
struct Walk {
    /// Where, each time step.
    at: Vec<Point>,
    /// Unit vector ahead, each time step.
    ahead: Vec<Point>,
    /// Way walked up to there, metres.
    walked_m: Vec<f64>,
}

/// All the people of a drive.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct People {
    walks: Vec<Walk>,
}

impl People {
    /// That many people: the first is the guide, who walks ahead of the robot; the others walk
    /// from room to room as they please, but not into the robot.
    pub fn walking(world: &World, drive: &Drive, people: usize, draw: &mut Draw) -> Result<Self, SimError> {
        if people == 0 {
            return Ok(Self::default());
        }
        let steps = (drive.duration_s() / STEP_S) as usize + 2;
        let mut walks = vec![Walk::of(drive, guided(drive, steps))];
        let round = if people > 1 { round(world, draw)? } else { Trail::default() };
        for _ in 1..people {
            walks.push(Walk::of(drive, strolled(&round, steps, draw)));
        }
        Ok(Self { walks })
    }

    /// Those who may be seen from a point within a reach, for half a second from `t_s` on.
    pub fn near(&self, from: Point, reach_m: f64, t_s: f64) -> Vec<usize> {
        let close = |w: &Walk| distance_m(w.at[w.step(t_s)], from) < reach_m + 1.0;
        (0..self.walks.len()).filter(|&k| close(&self.walks[k])).collect()
    }

    /// Range of a ray to the first leg of some of the people at a time.
    pub fn cast(&self, among: &[usize], t_s: f64, origin: Point, bearing_rad: f64) -> Option<f64> {
        let (s, c) = bearing_rad.sin_cos();
        let mut nearest: Option<f64> = None;
        for &who in among {
            let walk = &self.walks[who];
            if strike(origin, [c, s], walk.at[walk.step(t_s)], REACH_M + 0.3).is_none() {
                continue;
            }
            for leg in walk.legs(t_s) {
                let range_m = strike(origin, [c, s], leg, LEG_M);
                nearest = range_m.into_iter().chain(nearest).reduce(f64::min);
            }
        }
        nearest
    }
}

impl Walk {
    /// A walk along points, one each time step, that keeps clear of the robot.
    fn of(drive: &Drive, mut at: Vec<Point>) -> Self {
        for (k, p) in at.iter_mut().enumerate() {
            let robot = drive.at(k as f64 * STEP_S);
            let (dx, dy) = (p[0] - robot.x_m, p[1] - robot.y_m);
            let apart_m = dx.hypot(dy);
            if apart_m < APART_M {
                let (s, c) = robot.yaw_rad.sin_cos();
                let away = if apart_m > 1e-9 { [dx / apart_m, dy / apart_m] } else { [-s, c] };
                *p = [robot.x_m + APART_M * away[0], robot.y_m + APART_M * away[1]];
            }
        }
        let (mut ahead, mut walked_m) = (vec![[1.0, 0.0]], vec![0.0]);
        for pair in at.windows(2) {
            let step_m = distance_m(pair[0], pair[1]);
            let last = ahead[ahead.len() - 1];
            let turned = step_m > 0.01;
            ahead.push(if turned { [0, 1].map(|k| (pair[1][k] - pair[0][k]) / step_m) } else { last });
            walked_m.push(walked_m[walked_m.len() - 1] + step_m);
        }
        Self { at, ahead, walked_m }
    }

    fn step(&self, t_s: f64) -> usize {
        ((t_s / STEP_S).max(0.0) as usize).min(self.at.len() - 1)
    }

    /// Middles of both legs.
    fn legs(&self, t_s: f64) -> [Point; 2] {
        let k = self.step(t_s);
        let next = (k + 1).min(self.at.len() - 1);
        let f = (t_s / STEP_S - k as f64).clamp(0.0, 1.0);
        let between = |a: f64, b: f64| a + f * (b - a);
        let [u, v] = self.ahead[next];
        let phase = std::f64::consts::TAU * between(self.walked_m[k], self.walked_m[next]) / STRIDE_M;
        [1.0, -1.0].map(|side| {
            let (forward, left) = (side * SWING_M * phase.sin(), side * HIP_M);
            let middle = [0, 1].map(|axis| between(self.at[k][axis], self.at[next][axis]));
            [middle[0] + forward * u - left * v, middle[1] + forward * v + left * u]
        })
    }
}

/// Range of a ray to a disc; 0 from inside.
fn strike(origin: Point, direction: Point, centre: Point, radius_m: f64) -> Option<f64> {
    let d = [centre[0] - origin[0], centre[1] - origin[1]];
    let along = d[0] * direction[0] + d[1] * direction[1];
    let aside = d[0] * direction[1] - d[1] * direction[0];
    let half2 = radius_m * radius_m - aside * aside;
    let far = along + half2.max(0.0).sqrt();
    (half2 >= 0.0 && far >= 0.0).then(|| (along - half2.sqrt()).max(0.0))
}

/// A line to walk along.
#[derive(Clone, Debug, Default)]
struct Trail {
    points: Vec<Point>,
    /// Way from the first point, metres.
    at_m: Vec<f64>,
}

impl Trail {
    fn new(points: Vec<Point>) -> Self {
        let mut at_m: Vec<f64> = Vec::with_capacity(points.len());
        for (k, p) in points.iter().enumerate() {
            let before = if k == 0 { 0.0 } else { at_m[k - 1] + distance_m(points[k - 1], *p) };
            at_m.push(before);
        }
        Self { points, at_m }
    }

    fn length_m(&self) -> f64 {
        self.at_m.last().copied().unwrap_or_default()
    }

    /// The point at a distance from the start, held at the ends, and the unit vector ahead.
    fn at(&self, m: f64) -> (Point, Point) {
        let last = self.points.len().saturating_sub(1);
        let k = self.at_m.partition_point(|&at| at <= m).clamp(1, last.max(1));
        let (Some(&a), Some(&b)) = (self.points.get(k - 1), self.points.get(k.min(last))) else {
            return ([0.0; 2], [1.0, 0.0]);
        };
        let length_m = distance_m(a, b).max(1e-9);
        let ahead = [(b[0] - a[0]) / length_m, (b[1] - a[1]) / length_m];
        let on_m = (m - self.at_m[k - 1]).clamp(0.0, length_m);
        ([a[0] + on_m * ahead[0], a[1] + on_m * ahead[1]], ahead)
    }
}

/// Where the guide is: ahead on the path that the robot will drive.
fn guided(drive: &Drive, steps: usize) -> Vec<Point> {
    let spots: Vec<Point> =
        (0..steps).map(|k| drive.at(k as f64 * STEP_S)).map(|pose| [pose.x_m, pose.y_m]).collect();
    let trail = Trail::new(spots);
    trail.at_m.iter().map(|m| trail.at(m + AHEAD_M).0).collect()
}

/// A round through rooms and back to the first.
fn round(world: &World, draw: &mut Draw) -> Result<Trail, SimError> {
    let rooms: Vec<usize> = (0..ROUND_ROOMS).map(|_| draw.below(world.rooms.len())).collect();
    let mut points = Vec::new();
    for (&from, &to) in rooms.iter().zip(rooms.iter().cycle().skip(1)) {
        let spot = |k: usize| world.rooms.get(k).map(|r| r.spot).ok_or(SimError::NoSuchRoom(k));
        points.extend(world.route(spot(from)?, spot(to)?).ok_or(SimError::NoWay(from, to))?);
    }
    Ok(Trail::new(points))
}

/// Round and round, from anywhere on, at one's own pace, one way or the other.
fn strolled(round: &Trail, steps: usize, draw: &mut Draw) -> Vec<Point> {
    let length_m = round.length_m().max(1e-9);
    let (start_m, pace_mps, aside_m) =
        (draw.within((0.0, length_m)), draw.within((0.8, 1.5)), draw.within((-0.15, 0.15)));
    let way = if draw.chance(0.5) { 1.0 } else { -1.0 };
    (0..steps)
        .map(|k| {
            let m = start_m + way * pace_mps * STEP_S * k as f64;
            let (p, ahead) = round.at(m.rem_euclid(length_m));
            [p[0] - aside_m * ahead[1], p[1] + aside_m * ahead[0]]
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::storey::tests::two_rooms;
    use toponym_proto::Pose;

    fn ahead(length_m: f64) -> Drive {
        let steps = (length_m / 0.01) as usize;
        let at = |k: usize| Pose { x_m: 1.0 + 0.01 * k as f64, y_m: 1.5, yaw_rad: 0.0 };
        Drive { poses: (0..=steps).map(at).collect() }
    }

    #[test]
    fn a_ray_strikes_the_near_side_of_a_disc() {
        let strike = |x, y| strike([0.0, 0.0], [1.0, 0.0], [x, y], 0.5);
        assert_eq!(strike(2.0, 0.0), Some(1.5));
        assert_eq!((strike(2.0, 0.6), strike(-2.0, 0.0)), (None, None));
        assert_eq!(strike(0.2, 0.0), Some(0.0), "from inside");
    }

    #[test]
    fn the_guide_walks_ahead_on_two_legs() {
        let drive = ahead(3.0);
        let people = People::walking(&two_rooms().world, &drive, 1, &mut Draw::new(1, 0)).unwrap();
        for t_s in [0.0, 1.0, 2.0] {
            let robot = drive.at(t_s);
            let from = [robot.x_m, robot.y_m];
            let near = people.near(from, 12.0, t_s);
            assert_eq!(near, [0]);
            let hits = (-200..=200).filter_map(|k| people.cast(&near, t_s, from, f64::from(k) * 1e-3));
            let nearest = hits.fold(f64::INFINITY, f64::min);
            assert!((nearest - AHEAD_M).abs() < SWING_M + LEG_M + 0.01, "{nearest} m at {t_s} s");
            assert_eq!(people.cast(&near, t_s, from, 3.0), None, "behind");
        }
    }

    #[test]
    fn nobody_walks_into_the_robot() {
        let drive = ahead(3.0);
        let people = People::walking(&two_rooms().world, &drive, 8, &mut Draw::new(3, 0)).unwrap();
        for walk in &people.walks {
            for (k, &p) in walk.at.iter().enumerate() {
                let robot = drive.at(k as f64 * STEP_S);
                assert!(distance_m(p, [robot.x_m, robot.y_m]) > APART_M - 1e-9);
            }
        }
        let apart = |w: &[Walk]| distance_m(w[0].at[0], w[1].at[0]) > 0.1;
        assert!(people.walks.windows(2).all(apart), "each from elsewhere on");
    }
}
