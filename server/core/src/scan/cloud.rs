//! Sets of points with normals, thinned, and a grid index over them.

use crate::geometry::Pose2;
use serde::{Deserialize, Serialize};

/// A point of a surface and the unit normal towards where it was seen from; a zero normal: the
/// surface is not flat there.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Point {
    /// Metres.
    pub x: f32,
    /// Metres.
    pub y: f32,
    /// Unit or zero.
    pub nx: f32,
    /// Unit or zero.
    pub ny: f32,
}

impl Point {
    /// Whether the surface is flat here.
    pub fn has_normal(&self) -> bool {
        self.nx != 0.0 || self.ny != 0.0
    }

    /// The same point in an outer frame.
    #[must_use]
    pub fn moved(&self, outer_from_inner: &Pose2) -> Self {
        let (s, c) = outer_from_inner.yaw_rad.sin_cos();
        self.turned(outer_from_inner, s, c)
    }

    /// The same with the sine and cosine of the turn at hand.
    pub(crate) fn turned(&self, by: &Pose2, s: f64, c: f64) -> Self {
        let (x, y) = (f64::from(self.x), f64::from(self.y));
        let (nx, ny) = (f64::from(self.nx), f64::from(self.ny));
        Self {
            x: (by.x_m + c * x - s * y) as f32,
            y: (by.y_m + s * x + c * y) as f32,
            nx: (c * nx - s * ny) as f32,
            ny: (s * nx + c * ny) as f32,
        }
    }
}

/// The points in an outer frame: the sine of the turn is taken once for all.
pub fn moved<'a>(points: &'a [Point], outer_from_inner: &'a Pose2) -> impl Iterator<Item = Point> + 'a {
    let (s, c) = outer_from_inner.yaw_rad.sin_cos();
    points.iter().map(move |p| p.turned(outer_from_inner, s, c))
}

/// A surface point that another is laid on.
#[derive(Clone, Copy, Debug)]
pub struct Nearest<'a> {
    /// The point.
    pub point: &'a Point,
    /// Whether it was seen there for long enough to be no passer-by.
    pub stands: bool,
}

/// Surfaces that points can be laid on.
pub trait Surfaces {
    /// The nearest surface point within `gate_m` whose normal agrees with `p`'s to 45°.
    fn nearest(&self, p: &Point, gate_m: f32) -> Option<Nearest<'_>>;
}

/// Largest whole number not above: `f32::floor` is a library call on the oldest CPUs that we run on.
pub(crate) fn floor(v: f32) -> i32 {
    let whole = v as i32;
    whole.saturating_sub(i32::from(v < whole as f32))
}

/// One point per voxel and side of a wall: the mean of its points, in the order of voxels.
pub fn thin(points: &[Point], voxel_m: f32) -> Vec<Point> {
    let voxel = |p: &Point| (floor(p.x / voxel_m), floor(p.y / voxel_m));
    let (x0, y0) = points.iter().map(voxel).fold((i32::MAX, i32::MAX), |m, v| (m.0.min(v.0), m.1.min(v.1)));
    // Row, column and number in one word, so that a plain sort groups the voxels: 20 bits each way
    // are 50 km at 5 cm.
    let word = |(i, p): (usize, &Point)| -> u64 {
        let (x, y) = voxel(p);
        let cell = |v: i32, v0: i32| u64::from(v.wrapping_sub(v0) as u32) & 0xf_ffff;
        (cell(y, y0) << 44) | (cell(x, x0) << 24) | (i as u64 & 0xff_ffff)
    };
    let mut order: Vec<u64> = points.iter().enumerate().map(word).collect();
    order.sort_unstable();
    let mut out = Vec::with_capacity(order.len() / 2);
    for voxel in order.chunk_by(|a, b| a >> 24 == b >> 24) {
        merge_voxel(voxel.iter().map(|&w| &points[(w & 0xff_ffff) as usize]), &mut out);
    }
    out
}

/// Means of the points with a normal, by side, or else of the points without.
fn merge_voxel<'a>(points: impl Iterator<Item = &'a Point>, out: &mut Vec<Point>) {
    // Two sides of a thin wall and the rest.
    let mut sums = [(Point::default(), 0.0f32); 3];
    for p in points {
        let first = sums[0].1 == 0.0 || sums[0].0.nx * p.nx + sums[0].0.ny * p.ny > 0.0;
        let slot = if p.has_normal() { usize::from(!first) } else { 2 };
        let (sum, n) = &mut sums[slot];
        sum.x += p.x;
        sum.y += p.y;
        sum.nx += p.nx;
        sum.ny += p.ny;
        *n += 1.0;
    }
    let flat = sums[0].1 > 0.0;
    for (sum, n) in sums {
        if n == 0.0 || (!sum.has_normal() && flat) {
            continue;
        }
        let norm = sum.nx.hypot(sum.ny);
        let unit = if norm > 0.0 { 1.0 / norm } else { 0.0 };
        out.push(Point { x: sum.x / n, y: sum.y / n, nx: sum.nx * unit, ny: sum.ny * unit });
    }
}

/// Points sorted into the cells of a grid, for nearest-neighbour look-ups.
#[derive(Clone, Debug)]
pub struct Index {
    points: Vec<Point>,
    /// Start of each cell's points; one more than there are cells.
    starts: Vec<u32>,
    x0: f32,
    y0: f32,
    inv_cell: f32,
    width: i32,
    height: i32,
}

impl Index {
    /// Indexes the points that have normals. `cell_m` is the largest gate of a look-up.
    pub fn new(points: &[Point], cell_m: f32) -> Self {
        let flat = || points.iter().filter(|p| p.has_normal());
        let (mut x0, mut y0, mut x1, mut y1) = (f32::MAX, f32::MAX, f32::MIN, f32::MIN);
        for p in flat() {
            (x0, y0, x1, y1) = (x0.min(p.x), y0.min(p.y), x1.max(p.x), y1.max(p.y));
        }
        if x0 > x1 {
            (x0, y0, x1, y1) = (0.0, 0.0, 0.0, 0.0);
        }
        let inv_cell = 1.0 / cell_m;
        let (width, height) = (((x1 - x0) * inv_cell) as i32 + 1, ((y1 - y0) * inv_cell) as i32 + 1);
        let cell_of =
            |p: &Point| (((p.y - y0) * inv_cell) as i32 * width + ((p.x - x0) * inv_cell) as i32) as usize;
        let mut starts = vec![0u32; (width * height) as usize + 1];
        for p in flat() {
            starts[cell_of(p) + 1] += 1;
        }
        for c in 1..starts.len() {
            starts[c] += starts[c - 1];
        }
        let mut next = starts.clone();
        let mut sorted = vec![Point::default(); *starts.last().unwrap_or(&0) as usize];
        for p in flat() {
            let slot = &mut next[cell_of(p)];
            sorted[*slot as usize] = *p;
            *slot += 1;
        }
        Self { points: sorted, starts, x0, y0, inv_cell, width, height }
    }

    /// Number of points.
    pub fn len(&self) -> usize {
        self.points.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.points.is_empty()
    }
}

impl Surfaces for Index {
    /// The gate is the cell at most. All that was indexed stands.
    fn nearest(&self, p: &Point, gate_m: f32) -> Option<Nearest<'_>> {
        let (cx, cy) = ((p.x - self.x0) * self.inv_cell, (p.y - self.y0) * self.inv_cell);
        if !(cx > -2.0 && cy > -2.0 && cx < 1e6 && cy < 1e6) {
            return None;
        }
        // Only cells that the gate's square touches.
        let reach = gate_m * self.inv_cell;
        let (c0, c1) = ((cx - reach).floor().max(0.0) as i32, ((cx + reach) as i32).min(self.width - 1));
        let (r0, r1) = ((cy - reach).floor().max(0.0) as i32, ((cy + reach) as i32).min(self.height - 1));
        let (mut best, mut best_d2) = (None, gate_m * gate_m);
        let mut row = r0;
        while row <= r1 && c0 <= c1 {
            let first = self.starts[(row * self.width + c0) as usize] as usize;
            let last = self.starts[(row * self.width + c1) as usize + 1] as usize;
            for q in &self.points[first..last] {
                let d2 = (q.x - p.x).powi(2) + (q.y - p.y).powi(2);
                if d2 < best_d2 && (!p.has_normal() || q.nx * p.nx + q.ny * p.ny > 0.7) {
                    (best, best_d2) = (Some(q), d2);
                }
            }
            row += 1;
        }
        best.map(|point| Nearest { point, stands: true })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn point() -> impl Strategy<Value = Point> {
        (-9.0f32..9.0, -9.0f32..9.0, -3.1f32..3.1).prop_map(|(x, y, a)| Point {
            x,
            y,
            nx: a.cos(),
            ny: a.sin(),
        })
    }

    proptest! {
        #[test]
        fn nearest_is_the_nearest(points in prop::collection::vec(point(), 0..80), p in point(), gate in 0.1f32..1.0) {
            let index = Index::new(&points, 1.0);
            let d2 = |q: &Point| (q.x - p.x).powi(2) + (q.y - p.y).powi(2);
            let brute = points
                .iter()
                .filter(|q| d2(q) < gate * gate && q.nx * p.nx + q.ny * p.ny > 0.7)
                .map(d2)
                .fold(f32::INFINITY, f32::min);
            let found = index.nearest(&p, gate).map_or(f32::INFINITY, |q| d2(q.point));
            prop_assert_eq!(found.to_bits(), brute.to_bits());
        }

        #[test]
        fn thinning_leaves_a_point_per_voxel_and_side(points in prop::collection::vec(point(), 1..200)) {
            let thinned = thin(&points, 0.5);
            prop_assert!(thinned.len() <= points.len());
            for p in &points {
                prop_assert!(thinned.iter().any(|q| (q.x - p.x).abs() < 0.51 && (q.y - p.y).abs() < 0.51));
            }
        }
    }

    #[test]
    fn both_sides_of_a_thin_wall_are_kept() {
        let side = |x, nx| Point { x, y: 0.01, nx, ny: 0.0 };
        assert_eq!(thin(&[side(0.01, -1.0), side(0.02, 1.0), side(0.02, -1.0)], 0.1).len(), 2);
    }
}
