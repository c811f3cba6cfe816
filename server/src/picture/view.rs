//! Which part of a map is shown, and how large.

use super::canvas::Canvas;
use embedded_graphics::pixelcolor::Rgb888;
use embedded_graphics::prelude::*;
use embedded_graphics::primitives::Rectangle;
use toponym_core::Pose2;
use toponym_core::answers::query::Grid;

/// Longest side of the map's part of the picture, pixels.
const SIDE_MAX: usize = 1800;
/// Largest edge of a cell, pixels.
const CELL_MAX: usize = 6;
/// Free border round the map, pixels.
pub const MARGIN: i32 = 20;
/// Narrowest picture that the legend fits into, pixels.
const WIDTH_MIN: i32 = 760;
/// Edge of a block of cells, metres.
const BLOCK_M: f64 = 1.0;
/// From such a share of its cells on a block is known.
const DENSE: f64 = 0.6;
/// Share of the known blocks that may fall outside the picture on each side.
const STRAY: f64 = 0.001;

const UNKNOWN: Rgb888 = Rgb888::new(0xd8, 0xdc, 0xe0);

/// Edge of a grid's cell such that a map of this extent fits into a picture, metres.
pub fn resolution_m(extent_m: f64) -> f64 {
    (extent_m / SIDE_MAX as f64).max(0.05)
}

/// Which part of the map is shown, and how large.
pub struct View {
    /// Map to grid axes, which the picture is aligned with.
    grid_from_map: Pose2,
    /// Corners shown, grid axes, metres.
    low: [f64; 2],
    high: [f64; 2],
    pub pixels_per_m: f64,
}

impl View {
    /// Nearly all that is known of the grid, and every pose.
    pub fn of<'a>(grid: &Grid, poses: impl Iterator<Item = &'a Pose2>) -> Self {
        let grid_from_map = grid.map_from_grid.inverse();
        let (mut low, mut high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
        let mut show = |x: f64, y: f64| {
            (low, high) = ([low[0].min(x), low[1].min(y)], [high[0].max(x), high[1].max(y)]);
        };
        for end in grid_bounds(grid) {
            show(end[0], end[1]);
        }
        for pose in poses {
            let (x, y) = grid_from_map.apply(pose.x_m, pose.y_m);
            show(x, y);
        }
        if low[0] > high[0] {
            (low, high) = ([0.0; 2], [1.0; 2]);
        }
        let side_m = (high[0] - low[0]).max(high[1] - low[1]).max(grid.resolution_m);
        // Whole pixels per cell keep walls crisp; only a map too large for that is shrunk.
        let per_cell = (SIDE_MAX as f64 * grid.resolution_m / side_m).min(CELL_MAX as f64);
        let per_cell = if per_cell >= 1.0 { per_cell.floor() } else { per_cell };
        Self { grid_from_map, low, high, pixels_per_m: per_cell / grid.resolution_m }
    }

    /// Width and height of the map's part of the picture, pixels.
    pub fn size(&self) -> (i32, i32) {
        let side = |k: usize| ((self.high[k] - self.low[k]) * self.pixels_per_m).ceil() as i32 + 2 * MARGIN;
        (side(0).max(WIDTH_MIN), side(1))
    }

    pub fn pixel(&self, x_m: f64, y_m: f64) -> Point {
        let (x, y) = self.grid_from_map.apply(x_m, y_m);
        self.grid_pixel(x, y)
    }

    /// Pictures count rows downwards, maps upwards.
    fn grid_pixel(&self, x_m: f64, y_m: f64) -> Point {
        let x = ((x_m - self.low[0]) * self.pixels_per_m).round() as i32 + MARGIN;
        let y = ((self.high[1] - y_m) * self.pixels_per_m).round() as i32 + MARGIN;
        Point::new(x, y)
    }

    /// The grid in the map's part of the picture; what is free in its shade.
    pub fn cells(&self, grid: &Grid, shades: &[Option<Rgb888>]) -> Canvas {
        let (width, height) = self.size();
        let mut canvas = Canvas::new(Size::new(width as u32, height as u32), UNKNOWN);
        // Occupied cells last: where several share a pixel, a wall must not get lost.
        let mut known: Vec<usize> = (0..grid.cells.len()).filter(|&k| grid.cells[k] >= 0).collect();
        known.sort_by_key(|&k| grid.cells[k]);
        for k in known {
            let (x, y) = ((k % grid.width) as f64, (k / grid.width) as f64);
            let corner = |dx: f64, dy: f64| {
                self.grid_pixel((x + dx) * grid.resolution_m, (y + dy) * grid.resolution_m)
            };
            let (top_left, below_right) = (corner(0.0, 1.0), corner(1.0, 0.0));
            let size = Size::new(
                (below_right.x - top_left.x).max(1) as u32,
                (below_right.y - top_left.y).max(1) as u32,
            );
            let paper = shades[k].unwrap_or(Rgb888::WHITE);
            let light = 255 - u32::from(grid.cells[k].clamp(0, 100) as u8) * 235 / 100;
            let inked = |paper: u8| (u32::from(paper) * light / 255) as u8;
            let colour = Rgb888::new(inked(paper.r()), inked(paper.g()), inked(paper.b()));
            canvas.fill(Rectangle::new(top_left, size), colour);
        }
        canvas
    }
}

/// Opposite corners of what is known of a grid, grid axes, metres. A stray beam through a window would shrink all the
/// rest: what is known counts in blocks that are mostly known, and the outermost [`STRAY`] of those on each side may
/// fall outside.
fn grid_bounds(grid: &Grid) -> Vec<[f64; 2]> {
    let block = (BLOCK_M / grid.resolution_m).round().max(1.0) as usize;
    let (columns, rows) = (grid.width.div_ceil(block), grid.height.div_ceil(block));
    let mut known = vec![0_usize; columns * rows];
    for k in (0..grid.cells.len()).filter(|&k| grid.cells[k] >= 0) {
        known[k / grid.width / block * columns + k % grid.width / block] += 1;
    }
    let is_dense = |k: &usize| known[*k] as f64 >= DENSE * (block * block) as f64;
    let bounds = |count: usize, cells: usize, line: &dyn Fn(usize) -> usize| {
        let mut dense = vec![0_usize; count];
        for k in (0..known.len()).filter(is_dense) {
            dense[line(k)] += 1;
        }
        let stray = (STRAY * dense.iter().sum::<usize>() as f64) as usize;
        let seen = |left: &mut usize, n: &usize| {
            *left += n;
            Some(*left)
        };
        let first = dense.iter().scan(0, seen).position(|sum| sum > stray)?;
        let last = count - dense.iter().rev().scan(0, seen).position(|sum| sum > stray)?;
        let end_m = |line: usize| (line * block).min(cells) as f64 * grid.resolution_m;
        Some([end_m(first), end_m(last)])
    };
    let x = bounds(columns, grid.width, &|k| k % columns);
    let y = bounds(rows, grid.height, &|k| k / columns);
    x.zip(y).map_or(Vec::new(), |(x, y)| vec![[x[0], y[0]], [x[1], y[1]]])
}

#[cfg(test)]
mod tests {
    use super::super::tests::grid;
    use super::*;

    #[test]
    fn a_stray_beam_does_not_shrink_the_map() {
        let mut cells = vec![-1; 400 * 40];
        for row in 0..40 {
            cells[row * 400..row * 400 + 100].fill(0);
        }
        cells[20 * 400 + 399] = 100;
        let stray = Grid { width: 400, cells, ..grid() };
        assert_eq!(grid_bounds(&stray), [[0.0, 0.0], [10.0, 4.0]]);
        let size = |grid: &Grid| View::of(grid, [].iter()).size();
        assert_eq!(size(&stray), size(&grid()));
    }
}
