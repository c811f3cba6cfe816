//! Rooms to test by: what places in them look like.

use crate::event::{Laser, Scan};
use crate::geometry::Pose2;
use crate::scan::place::Content;
use crate::scan::sweep::{Sweep, sweep};
use std::f64::consts::{PI, TAU};

/// A room of 9 m × 6 m with a niche, a cupboard and a screen.
pub const ROOM: [[f64; 4]; 9] = [
    [-4.0, -3.0, 5.0, -3.0],
    [5.0, -3.0, 5.0, 3.0],
    [5.0, 3.0, 2.0, 3.0],
    [2.0, 3.0, 2.0, 4.2],
    [2.0, 4.2, 0.5, 4.2],
    [0.5, 4.2, 0.5, 3.0],
    [0.5, 3.0, -4.0, 3.0],
    [-4.0, 3.0, -4.0, -3.0],
    [3.2, -3.0, 3.2, -1.6],
];

/// A hall of 18 m × 14 m, not square.
pub const HALL: [[f64; 4]; 4] =
    [[-9.0, -7.0, 9.0, -7.0], [9.0, -7.0, 7.0, 8.0], [7.0, 8.0, -9.0, 6.0], [-9.0, 6.0, -9.0, -7.0]];

/// What a laser of 360° sees of walls, (x0, y0, x1, y1), from a pose.
pub fn seen(walls: &[[f64; 4]], world_from_laser: &Pose2) -> Sweep {
    let ranges_m = (0..720)
        .map(|k| {
            let (s, c) = (world_from_laser.yaw_rad - PI + f64::from(k) * TAU / 720.0).sin_cos();
            let hit = |w: &[f64; 4]| {
                let (dx, dy) = (w[2] - w[0], w[3] - w[1]);
                let (ox, oy) = (w[0] - world_from_laser.x_m, w[1] - world_from_laser.y_m);
                let det = dx * s - dy * c;
                let (range, along) = ((dx * oy - dy * ox) / det, (c * oy - s * ox) / det);
                (range > 0.0 && (0.0..=1.0).contains(&along)).then_some(range as f32)
            };
            walls.iter().filter_map(hit).fold(f32::INFINITY, f32::min)
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
        range_max_m: 80.0,
        ignored_rad: vec![],
    };
    sweep(&scan, &laser, |_| Pose2::default())
}

/// A place's content: scans of two metres' path along its x axis.
pub fn content(walls: &[[f64; 4]], world_from_place: &Pose2) -> Content {
    let steps: Vec<(Pose2, Sweep)> = (-2..=2)
        .map(|k| Pose2::new(f64::from(k) * 0.4, 0.0, 0.0))
        .map(|step| (step, seen(walls, &world_from_place.compose(&step))))
        .collect();
    let steps: Vec<(Pose2, &Sweep)> = steps.iter().map(|(p, s)| (*p, s)).collect();
    Content::new(&steps)
}
