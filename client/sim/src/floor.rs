//! The free floor as a grid: how far the walls are, and ways that keep off them.

use crate::geom::{Area, Point, Segment, crossing_x, distance_m};
use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// Edge of a cell.
const CELL_M: f64 = 0.1;
/// No way leads closer to a wall: the robot's radius of some 0.15 m, and what it cuts off corners.
const BODY_M: f64 = 0.24;
/// With this much room a way takes no further heed of walls.
const COMFORT_M: f64 = 0.6;
/// Distances to walls are told up to here.
const SEEN_M: f64 = 1.0;
/// A straight piece of a way joins at most so many cells of the search.
const STRAIGHT_CELLS: usize = 120;
/// What a straight piece may lose of the clearance of what it replaces: the grid's own rounding.
const ROUNDING_M: f64 = 0.04;

/// Columns and rows to a cell's neighbours.
const AROUND: [(i64, i64); 8] = [(1, 0), (0, 1), (-1, 0), (0, -1), (1, 1), (-1, 1), (-1, -1), (1, -1)];

/// Free floor.
#[derive(Clone, Debug)]
pub(crate) struct Floor {
    origin: Point,
    columns: usize,
    rows: usize,
    /// Distance of each cell's middle to the nearest wall, row-major, metres; 0 off the floor.
    clearance_m: Vec<f64>,
}

impl Floor {
    /// The floor inside any of the areas, away from all walls.
    pub(crate) fn new(areas: &[Area], walls: &[Segment]) -> Self {
        let boxes = areas.iter().map(Area::bounds);
        let [low, high] = boxes.fold([[f64::INFINITY; 2], [f64::NEG_INFINITY; 2]], |[l, h], [a, b]| {
            [[l[0].min(a[0]), l[1].min(a[1])], [h[0].max(b[0]), h[1].max(b[1])]]
        });
        let count = |k: usize| ((high[k] - low[k]) / CELL_M).ceil().max(1.0) as usize + 1;
        let (columns, rows) = if areas.is_empty() { (1, 1) } else { (count(0), count(1)) };
        let mut floor = Self { origin: low, columns, rows, clearance_m: vec![0.0; columns * rows] };
        for area in areas {
            for cell in floor.cells_in(area) {
                floor.clearance_m[cell] = SEEN_M;
            }
        }
        for wall in walls {
            floor.keep_off(wall);
        }
        floor
    }

    /// Cells whose middles lie in an area.
    pub(crate) fn cells_in(&self, area: &Area) -> Vec<usize> {
        let [low, high] = area.bounds();
        let (first, last) = (self.index(1, low[1] - CELL_M), self.index(1, high[1] + CELL_M));
        let mut cells = Vec::new();
        for row in first..=last {
            let y = self.middle(row * self.columns)[1];
            let mut crossings: Vec<f64> = area.edges().filter_map(|e| crossing_x(&e, y)).collect();
            crossings.sort_by(f64::total_cmp);
            for pair in crossings.chunks_exact(2) {
                for column in self.index(0, pair[0] - CELL_M)..=self.index(0, pair[1] + CELL_M) {
                    let cell = row * self.columns + column;
                    if (pair[0]..pair[1]).contains(&self.middle(cell)[0]) {
                        cells.push(cell);
                    }
                }
            }
        }
        cells
    }

    fn keep_off(&mut self, wall: &Segment) {
        let span = |k: usize| {
            let (low, high) = (wall.a[k].min(wall.b[k]), wall.a[k].max(wall.b[k]));
            self.index(k, low - SEEN_M)..=self.index(k, high + SEEN_M)
        };
        let (columns, rows) = (span(0), span(1));
        for row in rows {
            for column in columns.clone() {
                let cell = row * self.columns + column;
                let distance_m = wall.distance_m(self.middle(cell));
                self.clearance_m[cell] = self.clearance_m[cell].min(distance_m);
            }
        }
    }

    /// Column (0) or row (1) of a coordinate, held within the grid.
    fn index(&self, axis: usize, at: f64) -> usize {
        let n = if axis == 0 { self.columns } else { self.rows };
        (((at - self.origin[axis]) / CELL_M).max(0.0) as usize).min(n - 1)
    }

    fn cell(&self, p: Point) -> usize {
        self.index(1, p[1]) * self.columns + self.index(0, p[0])
    }

    /// The middle of a cell.
    pub(crate) fn middle(&self, cell: usize) -> Point {
        let at = |k: usize, n: usize| self.origin[k] + (n as f64 + 0.5) * CELL_M;
        [at(0, cell % self.columns), at(1, cell / self.columns)]
    }

    /// Distance to the nearest wall, up to a metre, to the grid's accuracy.
    pub(crate) fn clearance_m(&self, p: Point) -> f64 {
        self.clearance_m[self.cell(p)]
    }

    fn is_free(&self, cell: usize) -> bool {
        self.clearance_m[cell] >= BODY_M
    }

    /// Free neighbours of a cell and how far they are, metres.
    fn neighbours(&self, cell: usize) -> impl Iterator<Item = (usize, f64)> + '_ {
        let (column, row) = ((cell % self.columns) as i64, (cell / self.columns) as i64);
        AROUND.into_iter().filter_map(move |(dx, dy)| {
            let (x, y) = (column + dx, row + dy);
            let within = (0..self.columns as i64).contains(&x) && (0..self.rows as i64).contains(&y);
            let next = within.then(|| y as usize * self.columns + x as usize)?;
            let step_m = if dx != 0 && dy != 0 { CELL_M * std::f64::consts::SQRT_2 } else { CELL_M };
            self.is_free(next).then_some((next, step_m))
        })
    }

    /// The largest part of the floor that a robot can drive all over: per cell, whether it is
    /// part of it.
    pub(crate) fn largest_part(&self) -> Vec<bool> {
        let n = self.clearance_m.len();
        let (mut part, mut sizes) = (vec![usize::MAX; n], Vec::new());
        for seed in 0..n {
            if part[seed] != usize::MAX || !self.is_free(seed) {
                continue;
            }
            let (mut size, mut open) = (0, vec![seed]);
            part[seed] = sizes.len();
            while let Some(cell) = open.pop() {
                size += 1;
                for (next, _) in self.neighbours(cell) {
                    if part[next] == usize::MAX {
                        part[next] = sizes.len();
                        open.push(next);
                    }
                }
            }
            sizes.push(size);
        }
        // Of equal ones the first: the same in every run.
        let largest = (0..sizes.len()).max_by_key(|&k| (sizes[k], Reverse(k)));
        part.into_iter().map(|p| Some(p) == largest).collect()
    }

    /// A short walk that keeps off walls where there is room; none if there is no way.
    pub(crate) fn route(&self, from: Point, to: Point) -> Option<Vec<Point>> {
        let cells = self.search(self.cell(from), self.cell(to))?;
        let mut route = vec![from];
        route.extend(self.straightened(&cells).into_iter().map(|cell| self.middle(cell)));
        route.push(to);
        Some(route)
    }

    /// A* over the cells; near walls a metre costs up to four.
    fn search(&self, from: usize, to: usize) -> Option<Vec<usize>> {
        let n = self.clearance_m.len();
        let (mut cost, mut before, mut done) = (vec![f64::INFINITY; n], vec![n; n], vec![false; n]);
        let goal = self.middle(to);
        cost[from] = 0.0;
        // Costs are not negative: their bits sort as they do.
        let mut open = BinaryHeap::from([Reverse((0, from))]);
        while let Some(Reverse((_, cell))) = open.pop() {
            if cell == to {
                let mut cells = vec![to];
                cells.extend(
                    std::iter::successors(Some(to), |&c| (before[c] < n).then_some(before[c])).skip(1),
                );
                cells.reverse();
                return Some(cells);
            }
            if std::mem::replace(&mut done[cell], true) {
                continue;
            }
            for (next, step_m) in self.neighbours(cell) {
                let want = (COMFORT_M - self.clearance_m[next]).max(0.0) / (COMFORT_M - BODY_M);
                let through = cost[cell] + step_m * (1.0 + 3.0 * want);
                if through < cost[next] {
                    (cost[next], before[next]) = (through, cell);
                    let least = through + distance_m(self.middle(next), goal);
                    open.push(Reverse((least.to_bits(), next)));
                }
            }
        }
        None
    }

    /// Corners of a way along cells: as few as lead no closer to the walls.
    fn straightened(&self, cells: &[usize]) -> Vec<usize> {
        let mut corners = Vec::new();
        let mut at = 0;
        while at + 1 < cells.len() {
            let mut clearance_m = COMFORT_M;
            let mut best = at + 1;
            for (k, &cell) in cells.iter().enumerate().skip(at + 1).take(STRAIGHT_CELLS) {
                clearance_m = clearance_m.min(self.clearance_m[cell]);
                if self.clearance_along_m(cells[at], cell) >= clearance_m - ROUNDING_M {
                    best = k;
                }
            }
            corners.push(cells[best]);
            at = best;
        }
        corners.pop();
        corners
    }

    /// Least clearance on the straight line between two cells.
    fn clearance_along_m(&self, from: usize, to: usize) -> f64 {
        let (a, b) = (self.middle(from), self.middle(to));
        let steps = (2.0 * distance_m(a, b) / CELL_M).ceil().max(1.0);
        (0..=steps as usize)
            .map(|k| k as f64 / steps)
            .map(|f| self.clearance_m([a[0] + f * (b[0] - a[0]), a[1] + f * (b[1] - a[1])]))
            .fold(f64::INFINITY, f64::min)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geom::Rect;

    /// Two rooms of 4 m by 4 m with a door of the given width in the wall between them.
    fn two_rooms(door_m: f64) -> (Floor, Vec<Segment>) {
        let outline: Area = Rect::new([0.0, 0.0], [8.0, 4.0]).into();
        let mut walls: Vec<Segment> = outline.edges().collect();
        let (from, to) = (3.0 - door_m / 2.0, 3.0 + door_m / 2.0);
        walls.push(Segment { a: [4.0, 0.0], b: [4.0, from] });
        walls.push(Segment { a: [4.0, to], b: [4.0, 4.0] });
        (Floor::new(&[outline], &walls), walls)
    }

    #[test]
    fn a_way_goes_through_the_middle_of_the_door() {
        let (floor, walls) = two_rooms(0.8);
        let route = floor.route([1.0, 1.0], [7.0, 1.0]).unwrap();
        assert_eq!((route[0], route[route.len() - 1]), ([1.0, 1.0], [7.0, 1.0]));
        assert!(route.len() < 8, "{route:?}");
        for leg in route.windows(2) {
            let line = Segment { a: leg[0], b: leg[1] };
            let gap_m = walls.iter().map(|w| w.gap_m(&line)).fold(f64::INFINITY, f64::min);
            assert!(gap_m > 0.25, "{gap_m} m at {leg:?}");
        }
    }

    #[test]
    fn a_door_too_narrow_parts_the_floor() {
        let (floor, _) = two_rooms(0.4);
        assert_eq!(floor.route([1.0, 1.0], [7.0, 1.0]), None);
        let part = floor.largest_part();
        let reached = |p| part[floor.cell(p)];
        assert_ne!(reached([1.0, 1.0]), reached([7.0, 1.0]));
        let (open, _) = two_rooms(0.8);
        assert!(open.largest_part()[open.cell([1.0, 1.0])] && open.largest_part()[open.cell([7.0, 1.0])]);
    }

    #[test]
    fn clearance_is_the_distance_to_the_walls_and_nought_off_the_floor() {
        let (floor, walls) = two_rooms(0.8);
        for cell in 0..floor.clearance_m.len() {
            let p = floor.middle(cell);
            let on = (0.0..8.0).contains(&p[0]) && (0.0..4.0).contains(&p[1]);
            let nearest = walls.iter().map(|w| w.distance_m(p)).fold(SEEN_M, f64::min);
            let want = if on { nearest } else { 0.0 };
            assert!((floor.clearance_m[cell] - want).abs() < 1e-9, "{p:?}");
        }
    }
}
