//! What is free, by all that the places of a map have seen.

use super::occupancy::{Plot, is_free};

/// Edge of a cell: walls are thicker, doorways far wider.
pub const RESOLUTION_M: f64 = 0.1;
/// What stands free and is smaller, people and pillars say, parts no space.
const CLUTTER_M2: f64 = 0.5;
/// A place lies in what is free so near to it.
const NEAR_M: f64 = 0.5;

/// Free cells, row by row.
#[derive(Clone, Debug)]
pub struct Raster {
    pub width: usize,
    pub height: usize,
    pub resolution_m: f64,
    /// The lower left corner in the map.
    pub corner_m: (f64, f64),
    pub free: Vec<bool>,
}

impl Raster {
    /// None of a map that has seen nothing.
    pub fn new(plot: &Plot) -> Option<Self> {
        let [low, high] = plot.tiles().bounds()?;
        let resolution_m = plot.resolution_m();
        // A free cell at the edge has one beside it that is not.
        let (width, height) = ((high.0 - low.0 + 3) as usize, (high.1 - low.1 + 3) as usize);
        let mut free = vec![false; width * height];
        for (x, y, _) in plot.tiles().known().filter(|(_, _, count)| is_free(count)) {
            free[(y - low.1 + 1) as usize * width + (x - low.0 + 1) as usize] = true;
        }
        let corner_m = |cell: i32| f64::from(cell - 1) * resolution_m;
        let mut raster =
            Self { width, height, resolution_m, corner_m: (corner_m(low.0), corner_m(low.1)), free };
        raster.clear();
        raster.free.contains(&true).then_some(raster)
    }

    /// The cells beside one, with those at its corners or without.
    pub fn beside(&self, cell: usize, corners: bool) -> impl Iterator<Item = usize> + use<> {
        let (width, height) = (self.width as i64, self.height as i64);
        let (x, y) = (cell as i64 % width, cell as i64 / width);
        let all = [(1, 0), (0, 1), (-1, 0), (0, -1), (1, 1), (-1, 1), (-1, -1), (1, -1)];
        let count = if corners { 8 } else { 4 };
        all.into_iter().take(count).filter_map(move |(dx, dy)| {
            let (x, y) = (x + dx, y + dy);
            ((0..width).contains(&x) && (0..height).contains(&y)).then_some((y * width + x) as usize)
        })
    }

    /// Makes what is not free, but small and with free space all around, free.
    fn clear(&mut self) {
        let small = (CLUTTER_M2 / self.resolution_m.powi(2)) as usize;
        let mut seen = self.free.clone();
        let mut is_large = vec![false; seen.len()];
        let (mut thing, mut small_things) = (Vec::new(), Vec::new());
        // What has free space all around has some to its left.
        for first in (1..seen.len()).filter(|&cell| self.free[cell - 1]) {
            if is_large[first] || std::mem::replace(&mut seen[first], true) {
                continue;
            }
            thing.clear();
            thing.push(first);
            let (mut at, mut large) = (0, false);
            while at < thing.len() && !large {
                for next in self.beside(thing[at], true) {
                    large |= is_large[next];
                    if !std::mem::replace(&mut seen[next], true) {
                        thing.push(next);
                    }
                }
                at += 1;
                large |= thing.len() > small;
            }
            if !large {
                small_things.extend_from_slice(&thing);
                continue;
            }
            for &cell in &thing {
                (seen[cell], is_large[cell]) = (false, true);
            }
        }
        for cell in small_things {
            self.free[cell] = true;
        }
    }

    /// Middle of a cell in the map, metres.
    pub fn middle(&self, cell: usize) -> (f64, f64) {
        let (x, y) = (cell % self.width, cell / self.width);
        let along = |from_m: f64, k: usize| from_m + (k as f64 + 0.5) * self.resolution_m;
        (along(self.corner_m.0, x), along(self.corner_m.1, y))
    }

    /// The cell in which a point of the map lies.
    pub fn cell(&self, x_m: f64, y_m: f64) -> Option<usize> {
        let along = |m: f64, corner_m: f64| ((m - corner_m) / self.resolution_m).floor();
        let (x, y) = (along(x_m, self.corner_m.0), along(y_m, self.corner_m.1));
        let is_inside = (0.0..self.width as f64).contains(&x) && (0.0..self.height as f64).contains(&y);
        is_inside.then(|| y as usize * self.width + x as usize)
    }

    /// The cells whose middles are so near to a point.
    pub fn around(&self, x_m: f64, y_m: f64, reach_m: f64) -> impl Iterator<Item = usize> + use<'_> {
        let to_cell = |m: f64, corner_m: f64| ((m - corner_m) / self.resolution_m).floor() as i64;
        let (cx, cy) = (to_cell(x_m, self.corner_m.0), to_cell(y_m, self.corner_m.1));
        let reach = (reach_m / self.resolution_m).ceil() as i64;
        let (width, height) = (self.width as i64, self.height as i64);
        let all = (-reach..=reach).flat_map(move |dy| (-reach..=reach).map(move |dx| (cx + dx, cy + dy)));
        let inside = all.filter(move |&(x, y)| (0..width).contains(&x) && (0..height).contains(&y));
        let cells = inside.map(move |(x, y)| (y * width + x) as usize);
        cells.filter(move |&cell| {
            let (x, y) = self.middle(cell);
            (x - x_m).hypot(y - y_m) <= reach_m
        })
    }

    /// What the nearest cell around a point has that has something.
    pub fn near<T>(&self, x_m: f64, y_m: f64, of: impl Fn(usize) -> Option<T>) -> Option<T> {
        let far_m = |cell: usize| {
            let (x, y) = self.middle(cell);
            (x - x_m).hypot(y - y_m)
        };
        let around = self.around(x_m, y_m, NEAR_M).map(|cell| (far_m(cell), cell));
        let mut cells: Vec<(f64, usize)> = around.collect();
        cells.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        cells.into_iter().find_map(|(_, cell)| of(cell))
    }
}
