//! Ray casting: walls sorted into square buckets.

use crate::geom::{Point, Segment};

/// Edge of a bucket.
const BUCKET_M: f64 = 0.5;

/// Where a ray meets a wall.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Strike {
    /// Way of the ray, metres.
    pub range_m: f64,
    /// Index of the wall.
    pub wall: usize,
}

/// Walls sorted into square buckets: a ray looks only at those along its way.
#[derive(Clone, Debug, Default)]
pub(crate) struct Buckets {
    origin: Point,
    columns: usize,
    rows: usize,
    /// Wall indices per bucket, row-major.
    walls: Vec<Vec<u32>>,
}

impl Buckets {
    pub(crate) fn new(walls: &[Segment]) -> Self {
        let ends = || walls.iter().flat_map(|w| [w.a, w.b]);
        let low = |k: usize| ends().map(|p| p[k]).fold(f64::INFINITY, f64::min) - BUCKET_M;
        let high = |k: usize| ends().map(|p| p[k]).fold(f64::NEG_INFINITY, f64::max) + BUCKET_M;
        if walls.is_empty() {
            return Self::default();
        }
        let origin = [low(0), low(1)];
        let columns = ((high(0) - origin[0]) / BUCKET_M).ceil() as usize;
        let rows = ((high(1) - origin[1]) / BUCKET_M).ceil() as usize;
        let mut buckets = Self { origin, columns, rows, walls: vec![Vec::new(); columns * rows] };
        for (index, wall) in walls.iter().enumerate() {
            let (low, high) = (buckets.corner(wall, f64::min, -0.1), buckets.corner(wall, f64::max, 0.1));
            for row in low[1]..=high[1] {
                for column in low[0]..=high[0] {
                    // Half a diagonal round the middle: a superset of the buckets crossed.
                    let middle = [
                        origin[0] + (column as f64 + 0.5) * BUCKET_M,
                        origin[1] + (row as f64 + 0.5) * BUCKET_M,
                    ];
                    if wall.distance_m(middle) <= 0.72 * BUCKET_M {
                        buckets.walls[row * columns + column].push(index as u32);
                    }
                }
            }
        }
        buckets
    }

    /// First or last bucket a wall may touch; `margin`, in buckets, because a wall may lie on a
    /// border, where rounding decides.
    fn corner(&self, wall: &Segment, pick: fn(f64, f64) -> f64, margin: f64) -> [usize; 2] {
        let index = |k: usize, n: usize| {
            let at = (pick(wall.a[k], wall.b[k]) - self.origin[k]) / BUCKET_M + margin;
            (at.max(0.0) as usize).min(n - 1)
        };
        [index(0, self.columns), index(1, self.rows)]
    }

    /// Walks the buckets along the ray and takes the first wall met.
    pub(crate) fn cast(
        &self,
        walls: &[Segment],
        origin: Point,
        bearing_rad: f64,
        max_m: f64,
    ) -> Option<Strike> {
        let (s, c) = bearing_rad.sin_cos();
        let direction = [c, s];
        let start = [0, 1].map(|k| (origin[k] - self.origin[k]) / BUCKET_M);
        let size = [self.columns as i64, self.rows as i64];
        let mut cell = start.map(|v| v.floor() as i64);
        let step = direction.map(|d| if d < 0.0 { -1 } else { 1 });
        // Ray length to the next bucket border, and from border to border, per axis.
        let mut border_m = [0, 1].map(|k| {
            let next = if step[k] > 0 { cell[k] as f64 + 1.0 } else { cell[k] as f64 };
            if direction[k] == 0.0 { f64::INFINITY } else { (next - start[k]) * BUCKET_M / direction[k] }
        });
        let delta_m = direction.map(|d| BUCKET_M / d.abs());
        loop {
            let axis = usize::from(border_m[1] < border_m[0]);
            let leaves_m = border_m[axis];
            if cell.iter().zip(size).all(|(&k, n)| (0..n).contains(&k)) {
                let nearest = self.walls[cell[1] as usize * self.columns + cell[0] as usize]
                    .iter()
                    .filter_map(|&wall| {
                        let range_m = walls[wall as usize].hit(origin, direction)?;
                        Some(Strike { range_m, wall: wall as usize })
                    })
                    .min_by(|a, b| a.range_m.total_cmp(&b.range_m));
                if let Some(strike) = nearest.filter(|s| s.range_m <= leaves_m) {
                    return (strike.range_m < max_m).then_some(strike);
                }
            } else if self.leaves_for_good(cell, step) {
                return None;
            }
            if leaves_m >= max_m {
                return None;
            }
            cell[axis] += step[axis];
            border_m[axis] += delta_m[axis];
        }
    }

    fn leaves_for_good(&self, cell: [i64; 2], step: [i64; 2]) -> bool {
        let past = |k: usize, n: usize| if step[k] > 0 { cell[k] >= n as i64 } else { cell[k] < 0 };
        past(0, self.columns) || past(1, self.rows)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::storey::tests::two_rooms;
    use crate::{World, demo_building};

    /// Casts many rays, from within and from without, against all walls.
    fn compare(world: &World, from: Point, size_m: [f64; 2]) {
        for k in 0..2000 {
            let at = |axis: usize, n: u32| from[axis] + f64::from(k % n) / f64::from(n) * size_m[axis];
            let origin = [at(0, 47), at(1, 31)];
            let bearing = f64::from(k) * 0.7;
            let (s, c) = bearing.sin_cos();
            let all = world.walls.iter().filter_map(|w| w.hit(origin, [c, s]));
            let want = all.fold(f64::INFINITY, f64::min);
            match world.strike(origin, bearing, 20.0) {
                Some(got) => {
                    assert!(
                        (got.range_m - want).abs() < 1e-9,
                        "ray {k} from {origin:?}: {got:?}, not {want}"
                    );
                    let wall = world.walls[got.wall].hit(origin, [c, s]);
                    assert!(wall.is_some_and(|m| (m - want).abs() < 1e-9), "ray {k}: another wall");
                }
                None => assert!(want >= 20.0, "ray {k} from {origin:?}: nothing, not {want}"),
            }
        }
    }

    #[test]
    fn buckets_change_no_range() {
        compare(&demo_building(), [-8.0, -9.0], [48.0, 34.0]);
        compare(&two_rooms().world, [-1.0, -1.0], [12.0, 6.0]);
    }
}
