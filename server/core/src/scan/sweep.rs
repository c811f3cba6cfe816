//! One sweep of a laser: validated, de-skewed, in the body frame at the reference time.

use crate::event::{Laser, Scan};
use crate::geometry::Pose2;
use crate::scan::cloud::Point;
use serde::{Deserialize, Serialize};
use std::f64::consts::{PI, TAU};

/// Returns beyond are too sparse to match and noisier than the map.
const RANGE_USED_MAX_M: f64 = 30.0;
/// Beams on either side that a normal is fitted to …
const NORMAL_REACH: usize = 3;
/// … and where they are dense, more, until they span so much to either side: noise must not turn it.
/// From tours of the Stata Center, where 8 cm round off corners, and simulated offices.
const NORMAL_SPAN_M: f64 = 0.05;
const NORMAL_REACH_MAX: usize = 16;
/// A normal needs neighbours this near (plus what the beam spacing explains).
const NORMAL_GAP_M: f64 = 0.12;
/// Thickness over length of a neighbourhood that still counts as a line.
const NORMAL_FLATNESS_MAX: f64 = 0.25;
/// No robot drives farther within a sweep: such a ray's time is wrong.
const MOVED_MAX_M: f64 = 5.0;
/// Bins of a range image.
const BINS: usize = 360;

/// A sweep in the body frame at its reference time (that of its first ray).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Sweep {
    /// What was hit, with normals towards the laser where the surface is flat.
    pub points: Vec<Point>,
    /// How far the laser saw in each direction.
    pub image: RangeImage,
    /// The body at the last ray in the body frame at the first, as odometry says.
    pub moved: Pose2,
}

/// How far a laser saw, by bearing: the map's free space in 1.4 kB.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RangeImage {
    /// The laser in the body frame.
    pub body_from_laser: Pose2,
    /// Nearest return per bin of 1° from −π; NaN where nothing is known.
    nearest_m: Vec<f32>,
    /// Farthest return per bin.
    farthest_m: Vec<f32>,
}

impl RangeImage {
    /// Nearest and farthest return at a bearing (laser frame), looking one bin to either side;
    /// none where the laser has no information.
    pub fn at(&self, bearing_rad: f64) -> Option<(f64, f64)> {
        let centre = bin(bearing_rad);
        let (mut near, mut far) = (f32::INFINITY, f32::NEG_INFINITY);
        for k in [centre + BINS - 1, centre, centre + 1] {
            near = near.min(self.nearest_m[k % BINS]);
            far = far.max(self.farthest_m[k % BINS]);
        }
        (near.is_finite() && !self.nearest_m[centre].is_nan()).then(|| (f64::from(near), f64::from(far)))
    }
}

impl RangeImage {
    /// Bearing and range of every ray that hit something, laser frame.
    pub fn rays(&self) -> impl Iterator<Item = (f64, f64)> + '_ {
        let bearing = |k: usize| (k as f64 + 0.5) * (TAU / BINS as f64) - PI;
        self.nearest_m
            .iter()
            .enumerate()
            .filter(|(_, r)| r.is_finite())
            .map(move |(k, r)| (bearing(k), f64::from(*r)))
    }
}

fn bin(bearing_rad: f64) -> usize {
    (((bearing_rad + PI).rem_euclid(TAU)) * (BINS as f64 / TAU)) as usize % BINS
}

/// A ray that hit something: laser frame at the reference time.
struct Hit {
    x_m: f64,
    y_m: f64,
    beam: usize,
}

/// Makes a sweep of a scan. `motion(dt_s)` is the body's pose `dt_s` after the first ray, in the
/// body frame at the first ray; it de-skews scans whose `time_increment_s` is not zero.
pub fn sweep(scan: &Scan, laser: &Laser, motion: impl Fn(f64) -> Pose2) -> Sweep {
    let takes_s = scan.takes_s();
    let moved = if takes_s > 0.0 { motion(takes_s) } else { Pose2::default() };
    let hits = hits(scan, laser, motion);
    let step_rad = scan.angle_increment_rad.abs();
    let image = image(&hits, laser, step_rad);
    let points = (0..hits.len())
        .map(|k| {
            let (nx, ny) = normal(&hits, k, step_rad);
            let (x, y) = laser.body_from_laser.apply(hits[k].x_m, hits[k].y_m);
            let (s, c) = laser.body_from_laser.yaw_rad.sin_cos();
            Point { x: x as f32, y: y as f32, nx: (c * nx - s * ny) as f32, ny: (s * nx + c * ny) as f32 }
        })
        .collect();
    Sweep { points, image, moved }
}

fn hits(scan: &Scan, laser: &Laser, motion: impl Fn(f64) -> Pose2) -> Vec<Hit> {
    // Compared as it was sent: a "nothing seen" of 5.6 m is a hair less in 32 bits.
    let far = (laser.range_max_m as f32).min(RANGE_USED_MAX_M as f32);
    let laser_from_body = laser.body_from_laser.inverse();
    let sign = if laser.upside_down { -1.0 } else { 1.0 };
    let mut hits = Vec::with_capacity(scan.ranges_m.len());
    for (beam, &range) in scan.ranges_m.iter().enumerate() {
        let is_far = range >= far;
        let range = f64::from(range);
        let bearing = scan.angle_min_rad + beam as f64 * scan.angle_increment_rad;
        if range.is_nan() || range < laser.range_min_m || is_far || ignored(laser, bearing) {
            continue;
        }
        let (s, c) = (sign * bearing).sin_cos();
        let (mut x_m, mut y_m) = (range * c, range * s);
        if scan.time_increment_s > 0.0 {
            let moved = motion(beam as f64 * scan.time_increment_s);
            if moved.x_m.hypot(moved.y_m) > MOVED_MAX_M {
                continue;
            }
            let (bx, by) = laser.body_from_laser.apply(x_m, y_m);
            let (bx, by) = moved.apply(bx, by);
            (x_m, y_m) = laser_from_body.apply(bx, by);
        }
        hits.push(Hit { x_m, y_m, beam });
    }
    hits
}

fn ignored(laser: &Laser, bearing_rad: f64) -> bool {
    laser
        .ignored_rad
        .iter()
        .any(|(from, to)| (bearing_rad - from).rem_euclid(TAU) <= (to - from).rem_euclid(TAU))
}

/// Total least squares over neighbouring beams, oriented towards the laser; zero where the
/// neighbourhood is not a line.
fn normal(hits: &[Hit], k: usize, step_rad: f64) -> (f64, f64) {
    let here = &hits[k];
    let range_m = (here.x_m * here.x_m + here.y_m * here.y_m).sqrt();
    // Three beams' spacing on a wall seen at 20° of incidence or more.
    let gap_m = NORMAL_GAP_M + 3.0 * range_m * step_rad.min(0.1);
    let (mut n, mut sx, mut sy, mut sxx, mut sxy, mut syy) = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0);
    let mut add = |h: &Hit| {
        let (x, y) = (h.x_m - here.x_m, h.y_m - here.y_m);
        n += 1.0;
        sx += x;
        sy += y;
        sxx += x * x;
        sxy += x * y;
        syy += y * y;
    };
    add(here);
    for ahead in [true, false] {
        let mut last = here;
        for step in 1..=NORMAL_REACH_MAX {
            let Some(i) = (if ahead { Some(k + step) } else { k.checked_sub(step) }) else { break };
            let Some(h) = hits.get(i) else { break };
            let near = |a: &Hit, within_m: f64| {
                (h.x_m - a.x_m).powi(2) + (h.y_m - a.y_m).powi(2) <= within_m * within_m
            };
            if h.beam.abs_diff(here.beam) > step.max(NORMAL_REACH) + 1
                || !near(last, gap_m)
                || (step > NORMAL_REACH && !near(here, NORMAL_SPAN_M))
            {
                break;
            }
            add(h);
            last = h;
        }
    }
    if n < 3.0 {
        return (0.0, 0.0);
    }
    let (cxx, cxy, cyy) = (sxx - sx * sx / n, sxy - sx * sy / n, syy - sy * sy / n);
    let (mean, half) = (f64::midpoint(cxx, cyy), ((cxx - cyy).powi(2) / 4.0 + cxy * cxy).sqrt());
    if mean + half < 1e-8 || ((mean - half).max(0.0) / (mean + half)).sqrt() > NORMAL_FLATNESS_MAX {
        return (0.0, 0.0);
    }
    // Direction of the line is half the angle of (cxx − cyy, 2 cxy); the normal is across.
    let along = 0.5 * (2.0 * cxy).atan2(cxx - cyy);
    let (nx, ny) = (-along.sin(), along.cos());
    let sign = if nx * here.x_m + ny * here.y_m > 0.0 { -1.0 } else { 1.0 };
    (sign * nx, sign * ny)
}

fn image(hits: &[Hit], laser: &Laser, step_rad: f64) -> RangeImage {
    let mut nearest_m = vec![f32::NAN; BINS];
    let mut farthest_m = vec![f32::NAN; BINS];
    // A beam stands for half its spacing to either side.
    let reach = ((step_rad / 2.0) * (BINS as f64 / TAU)).ceil() as usize;
    for h in hits {
        let range = (h.x_m * h.x_m + h.y_m * h.y_m).sqrt() as f32;
        let centre = bin(h.y_m.atan2(h.x_m));
        for k in centre + BINS - reach.min(BINS / 2)..=centre + BINS + reach.min(BINS / 2) {
            // f32::min and max pass over NaN.
            nearest_m[k % BINS] = nearest_m[k % BINS].min(range);
            farthest_m[k % BINS] = farthest_m[k % BINS].max(range);
        }
    }
    RangeImage { body_from_laser: laser.body_from_laser, nearest_m, farthest_m }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn laser() -> Laser {
        Laser {
            id: "front".into(),
            body_from_laser: Pose2::new(0.3, 0.1, 0.5),
            upside_down: false,
            range_min_m: 0.1,
            range_max_m: 10.0,
            ignored_rad: vec![],
        }
    }

    fn scan(ranges_m: Vec<f32>) -> Scan {
        Scan {
            robot: "r".into(),
            laser: "front".into(),
            stamp_ns: 0,
            angle_min_rad: -1.0,
            angle_increment_rad: 0.01,
            time_increment_s: 0.0,
            ranges_m,
        }
    }

    /// A wall 2 m ahead of the laser.
    fn wall() -> Vec<f32> {
        (0..200).map(|k| (2.0 / f64::cos(-1.0 + 0.01 * f64::from(k))) as f32).collect()
    }

    #[test]
    fn points_lie_on_the_wall_with_normals_towards_the_laser() {
        let s = sweep(&scan(wall()), &laser(), |_| Pose2::default());
        for p in &s.points {
            let q = p.moved(&laser().body_from_laser.inverse());
            assert!((q.x - 2.0).abs() < 1e-4);
            assert!(q.nx < -0.99 && q.ny.abs() < 0.1, "{q:?}");
        }
        let (near, far) = s.image.at(0.0).unwrap();
        assert!((near - 2.0).abs() < 0.01 && (far - 2.0).abs() < 0.02);
        assert!(s.image.at(2.0).is_none(), "behind the laser nothing is known");
    }

    #[test]
    fn dense_noisy_beams_still_have_normals() {
        // A quarter of a degree apart at 1 m, noise of a centimetre is more than their spacing.
        let mut dense = scan(vec![]);
        dense.angle_increment_rad = 0.25f64.to_radians();
        let noise = |k: u32| f64::from(k.wrapping_mul(2_654_435_761) >> 16) / 65_536.0 - 0.5;
        dense.ranges_m = (0..440)
            .map(|k| (1.0 / (-1.0 + f64::from(k) * 0.25f64.to_radians()).cos() + 0.02 * noise(k)) as f32)
            .collect();
        let points = sweep(&dense, &laser(), |_| Pose2::default()).points;
        let back = laser().body_from_laser.inverse();
        let right = points.iter().filter(|p| p.moved(&back).nx < -0.9).count();
        assert!(right > 380, "{right} of {}", points.len());
    }

    #[test]
    fn what_is_no_return_is_no_point() {
        let mut ranges = wall();
        ranges[..60]
            .copy_from_slice(&[[f32::NAN, f32::INFINITY, f32::NEG_INFINITY, 0.05, -1.0, 10.0]; 10].concat());
        assert_eq!(sweep(&scan(ranges), &laser(), |_| Pose2::default()).points.len(), 140);
        let blind = Laser { ignored_rad: vec![(-1.0, -0.5), (3.0, -3.0)], ..laser() };
        assert_eq!(sweep(&scan(wall()), &blind, |_| Pose2::default()).points.len(), 149);
    }

    #[test]
    fn an_inverted_laser_runs_the_other_way() {
        let mut ranges = wall();
        ranges.truncate(100); // bearings −1 … 0: to the right, or upside down to the left
        let inverted = Laser { upside_down: true, body_from_laser: Pose2::default(), ..laser() };
        let s = sweep(&scan(ranges), &inverted, |_| Pose2::default());
        assert!(s.points.iter().all(|p| p.y > -0.01 && (p.x - 2.0).abs() < 1e-4));
    }

    #[test]
    fn rays_of_an_absurd_time_are_left_out() {
        let mut s = scan(wall());
        s.time_increment_s = 1.0;
        let kept = sweep(&s, &laser(), |dt_s| Pose2::new(3.0 * dt_s, 0.0, 0.0)).points;
        assert_eq!(kept.len(), 2);
    }

    #[test]
    fn a_swept_scan_is_taken_back_to_its_first_ray() {
        // The body turns by 1 rad/s while the sweep takes 0.2 s.
        let at = |dt_s: f64| Pose2::new(0.0, 0.0, dt_s);
        let mount = Laser { body_from_laser: Pose2::default(), ..laser() };
        let mut s = scan(vec![]);
        s.time_increment_s = 1e-3;
        s.ranges_m = (0..200)
            .map(|k| (2.0 / f64::cos(-1.0 + 0.01 * f64::from(k) + 1e-3 * f64::from(k))) as f32)
            .collect();
        let deskewed = sweep(&s, &mount, at);
        assert!(deskewed.points.iter().all(|p| (p.x - 2.0).abs() < 1e-3));
        let skewed = sweep(&s, &mount, |_| Pose2::default());
        assert!(skewed.points.iter().any(|p| (p.x - 2.0).abs() > 0.1));
    }
}
