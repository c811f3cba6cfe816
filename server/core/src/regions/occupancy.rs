//! Occupancy grid of the best particle, on demand: counting hits and passes along each ray of the
//! places' range images (Moravec and Elfes 1985, in log-odds).

use crate::geometry::Pose2;
use crate::graph::Place;
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// Occupancy grid. Row 0 has the lowest y.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Grid {
    /// Edge of a cell.
    pub resolution_m: f64,
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Pose of the lower left corner in the map.
    pub map_from_grid: Pose2,
    /// −1 unknown, 0 free … 100 occupied; row-major.
    pub cells: Vec<i8>,
}

/// Cells a grid may have at most; beyond, its resolution is made coarser.
pub const CELLS_MAX: usize = 16_000_000;
/// Finest resolution.
pub const RESOLUTION_MIN_M: f64 = 0.02;
const HIT: i16 = 6;
const PASS: i16 = -2;
const CLAMP: i16 = 60;
/// A robot is no narrower, from its middle.
const ROBOT_M: f64 = 0.2;
/// Between places that lie farther apart nobody knows where it drove.
const STRIDE_MAX_M: f64 = 2.0;
/// Room around the outermost points.
const MARGIN_M: f64 = 1.0;

/// The grid of places with their poses in the map.
pub fn grid(places: &[(Pose2, Arc<Place>)], resolution_m: f64) -> Grid {
    let (mut x0, mut y0, mut x1, mut y1) = (f64::MAX, f64::MAX, f64::MIN, f64::MIN);
    let mut include = |x: f64, y: f64| {
        (x0, y0, x1, y1) = (x0.min(x), y0.min(y), x1.max(x), y1.max(y));
    };
    for (pose, place) in places {
        include(pose.x_m, pose.y_m);
        for p in &place.content.cloud {
            let (x, y) = pose.apply(f64::from(p.x), f64::from(p.y));
            include(x, y);
        }
    }
    if x0 > x1 {
        return empty(resolution_m);
    }
    (x0, y0, x1, y1) = (x0 - MARGIN_M, y0 - MARGIN_M, x1 + MARGIN_M, y1 + MARGIN_M);
    let mut resolution_m = if resolution_m.is_finite() { resolution_m.max(RESOLUTION_MIN_M) } else { 0.05 };
    let cells = |r: f64| ((x1 - x0) / r).ceil() * ((y1 - y0) / r).ceil();
    if cells(resolution_m) > CELLS_MAX as f64 {
        resolution_m = ((x1 - x0) * (y1 - y0) / CELLS_MAX as f64).sqrt() * 1.01;
    }
    let (width, height) =
        (((x1 - x0) / resolution_m).ceil() as usize, ((y1 - y0) / resolution_m).ceil() as usize);
    let mut board =
        Board { odds: vec![0; width * height], known: vec![false; width * height], width, height };
    let to_cell =
        |x: f64, y: f64| (((x - x0) / resolution_m).floor() as i64, ((y - y0) / resolution_m).floor() as i64);
    for (pose, place) in places {
        for view in &place.content.views {
            let laser = pose.compose(&view.place_from_laser);
            let from = to_cell(laser.x_m, laser.y_m);
            for (bearing_rad, range_m) in view.image.rays() {
                let (x, y) = laser.apply(range_m * bearing_rad.cos(), range_m * bearing_rad.sin());
                board.clear(from, to_cell(x, y));
            }
        }
    }
    for (pose, place) in places {
        for p in &place.content.cloud {
            let (x, y) = pose.apply(f64::from(p.x), f64::from(p.y));
            let (cx, cy) = to_cell(x, y);
            board.add(cx, cy, HIT);
        }
    }
    // Where the robot drove nothing stands: people who walked with it leave traces there.
    let follows = |pair: &&[(Pose2, Arc<Place>)]| {
        pair[0].1.segment == pair[1].1.segment && pair[0].0.distance_m(&pair[1].0) <= STRIDE_MAX_M
    };
    for pair in places.windows(2).filter(follows) {
        let (a, b) = (pair[0].0, pair[1].0);
        let steps = (a.distance_m(&b) / resolution_m).ceil().max(1.0);
        for k in 0..=steps as usize {
            let share = k as f64 / steps;
            let (x, y) = (a.x_m + share * (b.x_m - a.x_m), a.y_m + share * (b.y_m - a.y_m));
            board.drive(to_cell(x, y), (ROBOT_M / resolution_m) as i64);
        }
    }
    Grid { resolution_m, width, height, map_from_grid: Pose2::new(x0, y0, 0.0), cells: board.percentages() }
}

fn empty(resolution_m: f64) -> Grid {
    Grid { resolution_m, width: 0, height: 0, map_from_grid: Pose2::default(), cells: Vec::new() }
}

struct Board {
    odds: Vec<i16>,
    known: Vec<bool>,
    width: usize,
    height: usize,
}

impl Board {
    fn add(&mut self, x: i64, y: i64, change: i16) {
        if x < 0 || y < 0 || x as usize >= self.width || y as usize >= self.height {
            return;
        }
        let k = y as usize * self.width + x as usize;
        self.odds[k] = (self.odds[k] + change).clamp(-CLAMP, CLAMP);
        self.known[k] = true;
    }

    /// A robot stood here.
    fn drive(&mut self, (x, y): (i64, i64), reach: i64) {
        for (dx, dy) in (-reach..=reach).flat_map(|dy| (-reach..=reach).map(move |dx| (dx, dy))) {
            if dx * dx + dy * dy <= reach * reach {
                self.add(x + dx, y + dy, -2 * CLAMP);
            }
        }
    }

    /// Bresenham, the last cell excepted.
    fn clear(&mut self, (mut x, mut y): (i64, i64), (x1, y1): (i64, i64)) {
        let (dx, dy) = ((x1 - x).abs(), -(y1 - y).abs());
        let (sx, sy) = ((x1 - x).signum(), (y1 - y).signum());
        let mut error = dx + dy;
        while (x, y) != (x1, y1) {
            self.add(x, y, PASS);
            let twice = 2 * error;
            if twice >= dy {
                error += dy;
                x += sx;
            }
            if twice <= dx {
                error += dx;
                y += sy;
            }
        }
    }

    fn percentages(&self) -> Vec<i8> {
        self.odds
            .iter()
            .zip(&self.known)
            .map(|(&odds, &known)| {
                if !known {
                    return -1;
                }
                (100.0 / (1.0 + (-0.15 * f64::from(odds)).exp())).round() as i8
            })
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn where_a_robot_stood_nothing_stands() {
        let mut b = Board { odds: vec![CLAMP; 100], known: vec![true; 100], width: 10, height: 10 };
        b.drive((5, 5), 2);
        let free: Vec<usize> = (0..100).filter(|&k| b.odds[k] == -CLAMP).collect();
        assert_eq!((free.len(), free[0], free[12]), (13, 35, 75), "a disc of radius 2");
        b.drive((0, 0), 3);
    }

    #[test]
    fn a_ray_clears_every_cell_but_its_last() {
        let mut b = Board { odds: vec![0; 100], known: vec![false; 100], width: 10, height: 10 };
        b.clear((0, 0), (7, 3));
        assert_eq!(b.known.iter().filter(|k| **k).count(), 7);
        assert!(!b.known[3 * 10 + 7]);
        b.clear((5, 5), (5, 5));
        b.clear((-3, 2), (20, 2));
        assert_eq!((0..10).filter(|x| b.known[20 + x]).count(), 10, "rays may leave the grid");
    }
}
