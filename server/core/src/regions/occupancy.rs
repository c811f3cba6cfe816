//! What stands where, by what places have seen: points and passes along each ray of their range images are counted cell
//! by cell (Moravec and Elfes 1985, in log-odds).
//!
//! Counts add up and can be taken back, so that a [`Plot`] follows a map whose places move: it costs what moved.

use super::tiles::{Count, Tiles};
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

/// Cells a grid may have at most, about; beyond, its resolution is made coarser.
const CELLS_MAX: f64 = 16e6;
/// Finest resolution.
const RESOLUTION_MIN_M: f64 = 0.02;
const HIT: i32 = 6;
const PASS: i32 = -2;
const CLAMP: i32 = 60;
/// A robot is no narrower, from its middle.
const ROBOT_M: f64 = 0.2;
/// Between places that lie farther apart nobody knows where it drove.
const STRIDE_MAX_M: f64 = 2.0;
/// Poses are rounded to such a share of a cell: a place that moves less need not be laid anew.
const STEP: f64 = 0.2;
/// The same of their yaw, radians; 2 cm at 10 m.
const YAW_STEP_RAD: f64 = 0.002;

/// The grid of places with their poses in the map.
pub fn grid(places: &[(Pose2, Arc<Place>)], resolution_m: f64) -> Grid {
    let mut plot = Plot::new(resolution_m);
    plot.follow(places);
    plot.grid()
}

/// Counts of what places have seen.
#[derive(Clone, Debug)]
pub struct Plot {
    /// As it was asked for.
    finest_m: f64,
    resolution_m: f64,
    tiles: Tiles,
    laid: Vec<Laid>,
}

/// A place that is counted.
#[derive(Clone, Debug)]
struct Laid {
    place: Arc<Place>,
    /// Its pose in steps.
    at: [i64; 3],
    /// Opposite corners of what it has seen, metres.
    corners_m: [(f64, f64); 2],
}

impl Laid {
    fn is(&self, other: &Self) -> bool {
        self.at == other.at && Arc::ptr_eq(&self.place, &other.place)
    }
}

impl Plot {
    /// Of nothing. `resolution_m`: edge of a cell.
    pub fn new(resolution_m: f64) -> Self {
        let finest_m = if resolution_m.is_finite() { resolution_m.max(RESOLUTION_MIN_M) } else { 0.05 };
        Self { finest_m, resolution_m: finest_m, tiles: Tiles::default(), laid: Vec::new() }
    }

    /// Edge of a cell: that asked for, doubled until the map has not too many.
    pub fn resolution_m(&self) -> f64 {
        self.resolution_m
    }

    /// Cells of which something is known.
    pub fn tiles(&self) -> &Tiles {
        &self.tiles
    }

    /// Makes it that of these places, whatever it was of before.
    pub fn follow(&mut self, places: &[(Pose2, Arc<Place>)]) {
        let new: Vec<Laid> =
            places.iter().enumerate().map(|(k, (p, place))| self.laid_as(k, p, place)).collect();
        let resolution_m = fitting_m(self.finest_m, &new);
        if resolution_m.to_bits() != self.resolution_m.to_bits() {
            *self = Self { resolution_m, ..Self::new(self.finest_m) };
            // Steps are others now.
            return self.follow(places);
        }
        let old = std::mem::take(&mut self.laid);
        let stays = |k: usize| old.get(k).zip(new.get(k)).is_some_and(|(a, b)| a.is(b));
        let pair_stays = |k: usize| stays(k) && stays(k + 1);
        for (all, change) in [(&old, -1), (&new, 1)] {
            for laid in (0..all.len()).filter(|&k| !stays(k)).map(|k| &all[k]) {
                self.lay(laid, change);
            }
            for k in (1..all.len()).map(|k| k - 1).filter(|&k| !pair_stays(k)) {
                self.drive(&all[k], &all[k + 1], change);
            }
        }
        self.laid = new;
    }

    /// How the place of an index is counted at a pose.
    fn laid_as(&self, index: usize, pose: &Pose2, place: &Arc<Place>) -> Laid {
        let step_m = STEP * self.resolution_m;
        let steps = |value: f64, step: f64| (value / step).round() as i64;
        let at = [steps(pose.x_m, step_m), steps(pose.y_m, step_m), steps(pose.yaw_rad, YAW_STEP_RAD)];
        let mut laid = Laid { place: place.clone(), at, corners_m: [(0.0, 0.0); 2] };
        laid.corners_m = match self.laid.get(index).filter(|old| old.is(&laid)) {
            Some(old) => old.corners_m,
            None => corners_m(&self.pose(&laid), place),
        };
        laid
    }

    fn pose(&self, laid: &Laid) -> Pose2 {
        let [x, y, yaw] = laid.at.map(|steps| steps as f64);
        let step_m = STEP * self.resolution_m;
        Pose2::new(x * step_m, y * step_m, yaw * YAW_STEP_RAD)
    }

    fn cell(&self, (x_m, y_m): (f64, f64)) -> (i32, i32) {
        ((x_m / self.resolution_m).floor() as i32, (y_m / self.resolution_m).floor() as i32)
    }

    /// Counts what a place has seen, or takes it back.
    fn lay(&mut self, laid: &Laid, change: i32) {
        let pose = self.pose(laid);
        for view in &laid.place.content.views {
            let laser = pose.compose(&view.place_from_laser);
            let from = self.cell((laser.x_m, laser.y_m));
            for end in ends(&laser, view.image.rays()) {
                let to = self.cell(end);
                pass(&mut self.tiles, from, to, change);
            }
        }
        for p in &laid.place.content.cloud {
            let (x, y) = self.cell(pose.apply(f64::from(p.x), f64::from(p.y)));
            let hits = &mut self.tiles.at(x, y).hits;
            *hits = hits.wrapping_add_signed(change);
        }
    }

    /// Where the robot drove from a place to the next nothing stands: people who walked with it leave traces there.
    fn drive(&mut self, from: &Laid, to: &Laid, change: i32) {
        let (a, b) = (self.pose(from), self.pose(to));
        if from.place.segment != to.place.segment || a.distance_m(&b) > STRIDE_MAX_M {
            return;
        }
        let reach = (ROBOT_M / self.resolution_m) as i32;
        let steps = (a.distance_m(&b) / self.resolution_m).ceil().max(1.0);
        for k in 0..=steps as usize {
            let share = k as f64 / steps;
            let (x, y) = self.cell((a.x_m + share * (b.x_m - a.x_m), a.y_m + share * (b.y_m - a.y_m)));
            for (dx, dy) in (-reach..=reach).flat_map(|dy| (-reach..=reach).map(move |dx| (dx, dy))) {
                if dx * dx + dy * dy <= reach * reach {
                    let drives = &mut self.tiles.at(x + dx, y + dy).drives;
                    *drives = drives.wrapping_add_signed(change);
                }
            }
        }
    }

    /// As percentages, as far as anything is known.
    pub fn grid(&self) -> Grid {
        let resolution_m = self.resolution_m;
        let Some([low, high]) = self.tiles.bounds() else {
            return Grid {
                resolution_m,
                width: 0,
                height: 0,
                map_from_grid: Pose2::default(),
                cells: Vec::new(),
            };
        };
        let (width, height) = ((high.0 - low.0 + 1) as usize, (high.1 - low.1 + 1) as usize);
        let mut cells = vec![-1; width * height];
        for (x, y, count) in self.tiles.known() {
            let percent = 100.0 / (1.0 + (-0.15 * f64::from(odds(&count))).exp());
            cells[(y - low.1) as usize * width + (x - low.0) as usize] = percent.round() as i8;
        }
        let corner_m = |cell: i32| f64::from(cell) * resolution_m;
        let map_from_grid = Pose2::new(corner_m(low.0), corner_m(low.1), 0.0);
        Grid { resolution_m, width, height, map_from_grid, cells }
    }
}

/// Whether nothing stands in a cell of which something is known.
pub fn is_free(count: &Count) -> bool {
    odds(count) < 0
}

/// Log-odds, in a scale of its own, that something stands in a cell: rays through it first, then points in it.
fn odds(count: &Count) -> i32 {
    if count.drives > 0 {
        return -CLAMP;
    }
    let clamped = |count: u32, step: i32, most: i32| count.min((most / step.abs()) as u32) as i32 * step;
    (clamped(count.passes, PASS, CLAMP) + clamped(count.hits, HIT, 2 * CLAMP)).min(CLAMP)
}

/// Bresenham, the last cell excepted.
fn pass(tiles: &mut Tiles, (mut x, mut y): (i32, i32), (x1, y1): (i32, i32), change: i32) {
    let (dx, dy) = ((x1 - x).abs(), -(y1 - y).abs());
    let (sx, sy) = ((x1 - x).signum(), (y1 - y).signum());
    let mut error = dx + dy;
    while (x, y) != (x1, y1) {
        let passes = &mut tiles.at(x, y).passes;
        *passes = passes.wrapping_add_signed(change);
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

/// Where rays end, metres.
fn ends(laser: &Pose2, rays: impl Iterator<Item = (f64, f64)>) -> impl Iterator<Item = (f64, f64)> {
    rays.map(|(bearing_rad, range_m)| laser.apply(range_m * bearing_rad.cos(), range_m * bearing_rad.sin()))
}

/// Opposite corners of what a place has seen, metres.
fn corners_m(pose: &Pose2, place: &Place) -> [(f64, f64); 2] {
    let mut corners = [(pose.x_m, pose.y_m); 2];
    let mut include = |(x, y): (f64, f64)| {
        let [low, high] = corners;
        corners = [(low.0.min(x), low.1.min(y)), (high.0.max(x), high.1.max(y))];
    };
    for view in &place.content.views {
        let laser = pose.compose(&view.place_from_laser);
        ends(&laser, view.image.rays()).for_each(&mut include);
    }
    for p in &place.content.cloud {
        include(pose.apply(f64::from(p.x), f64::from(p.y)));
    }
    corners
}

/// Edge of a cell such that there are not too many.
fn fitting_m(finest_m: f64, all: &[Laid]) -> f64 {
    let corners = all.iter().map(|l| l.corners_m);
    let Some([low, high]) =
        corners.reduce(|[a, b], [c, d]| [(a.0.min(c.0), a.1.min(c.1)), (b.0.max(d.0), b.1.max(d.1))])
    else {
        return finest_m;
    };
    let mut resolution_m = finest_m;
    while (high.0 - low.0) * (high.1 - low.1) > CELLS_MAX * resolution_m * resolution_m {
        resolution_m *= 2.0;
    }
    resolution_m
}

#[cfg(test)]
mod tests {
    use super::*;

    fn known(tiles: &Tiles) -> Vec<(i32, i32)> {
        tiles.known().map(|(x, y, _)| (x, y)).collect()
    }

    #[test]
    fn a_ray_clears_every_cell_but_its_last() {
        let mut tiles = Tiles::default();
        pass(&mut tiles, (0, 0), (7, 3), 1);
        assert_eq!(known(&tiles).len(), 7);
        assert!(!known(&tiles).contains(&(7, 3)));
        pass(&mut tiles, (5, 5), (5, 5), 1);
        pass(&mut tiles, (0, 0), (7, 3), -1);
        assert_eq!(known(&tiles), [], "what is taken back was never there");
    }

    #[test]
    fn points_weigh_more_than_passes_and_a_robot_more_than_both() {
        let of = |passes, hits, drives| odds(&Count { passes, hits, drives });
        assert_eq!((of(1, 0, 0), of(0, 1, 0), of(2, 1, 0)), (-2, 6, 2));
        assert_eq!((of(1_000_000, 0, 0), of(0, 1_000_000, 0)), (-CLAMP, CLAMP));
        assert_eq!((of(1_000_000, 10, 0), of(1_000_000, 1_000_000, 0)), (0, CLAMP));
        assert_eq!(of(0, 50, 1), -CLAMP);
    }
}
