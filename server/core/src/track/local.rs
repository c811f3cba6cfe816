//! The front end's local map: surfaces in voxels, to which scans are added and from which they are
//! taken again at the cost of their own points.
//!
//! Sums are kept in whole numbers, so that what is taken away leaves nothing behind: the map is a
//! function of the scans in it, whatever came and went before.
//!
//! Beside the mean of its points a voxel keeps from how far apart along the path it was seen: a wall is
//! seen from metres, the legs of somebody who walks along only while a foot is down.

use crate::geometry::Pose2;
use crate::scan::cloud::{Nearest, Point, Surfaces, floor, moved};
use crate::scan::place::VOXEL_M;

/// Voxels to a tile's side.
const TILE_VOXELS: i32 = 8;
/// Tiles to a side of the table, a power of two; it repeats beyond: 102 m, more than a local map and its scan span.
const TABLE: i32 = 256;
/// Fixed point: units to the metre, and to a unit normal.
const PER_M: f64 = (1 << 20) as f64;
const PER_UNIT: f32 = (1 << 15) as f32;
const PER_PATH_M: f64 = 100.0;
/// Standard deviation of the path over which a voxel must be seen to stand. While a walker's foot is
/// down, a robot that keeps up with him goes half a metre at most: evenly seen, a deviation of 0.15 m.
const STANDS_M: f64 = 0.2;

/// Voxel (row, column) and quarter of the compass that the surface faces.
type Key = (i32, i32, u8);

/// What was seen of a surface within a voxel.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct Sum {
    x: i64,
    y: i64,
    nx: i64,
    ny: i64,
    n: i64,
    /// Path at which it was seen, and its square; modulo 2⁶⁴, which their spread does not mind.
    path: i64,
    path2: i64,
}

impl Sum {
    fn mean(&self) -> Point {
        let m = 1.0 / (self.n as f64 * PER_M);
        let (nx, ny) = (self.nx as f32, self.ny as f32);
        let norm = (nx * nx + ny * ny).sqrt().max(1.0);
        Point { x: (self.x as f64 * m) as f32, y: (self.y as f64 * m) as f32, nx: nx / norm, ny: ny / norm }
    }

    fn stands(&self) -> bool {
        // n² times the variance.
        let spread = self.n.wrapping_mul(self.path2).wrapping_sub(self.path.wrapping_mul(self.path));
        spread as f64 >= (self.n as f64 * STANDS_M * PER_PATH_M).powi(2)
    }
}

/// A tile's surfaces in the order of their keys.
#[derive(Clone, Debug, Default, PartialEq)]
struct Tile {
    points: Vec<Point>,
    sums: Vec<(Key, Sum)>,
}

/// Surfaces in voxels.
#[derive(Clone, Debug, PartialEq)]
pub struct LocalMap {
    tiles: Vec<Tile>,
    /// Whether all in it is taken to stand.
    pub(super) all_stands: bool,
}

impl Default for LocalMap {
    fn default() -> Self {
        Self { tiles: vec![Tile::default(); (TABLE * TABLE) as usize], all_stands: false }
    }
}

impl LocalMap {
    /// Adds the points of a scan that have normals, seen so far along the path.
    pub fn add(&mut self, points: &[Point], map_from_scan: &Pose2, path_m: f64) {
        self.change(points, map_from_scan, path_m, 1);
    }

    /// Takes away what was added of the same scan at the same pose.
    pub fn take_away(&mut self, points: &[Point], map_from_scan: &Pose2, path_m: f64) {
        self.change(points, map_from_scan, path_m, -1);
    }

    fn change(&mut self, points: &[Point], map_from_scan: &Pose2, path_m: f64, sign: i64) {
        let path = (path_m * PER_PATH_M) as i64;
        let path2 = path.wrapping_mul(path);
        for p in moved(points, map_from_scan).filter(Point::has_normal) {
            let (row, column) = (voxel(p.y), voxel(p.x));
            // Quarters are centred on the axes: few buildings stand at 45° to their first scan.
            let facing =
                if p.nx.abs() > p.ny.abs() { u8::from(p.nx > 0.0) } else { 2 + u8::from(p.ny > 0.0) };
            let key = (row, column, facing);
            let tile = &mut self.tiles[tile(row.div_euclid(TILE_VOXELS), column.div_euclid(TILE_VOXELS))];
            let at = match tile.sums.binary_search_by_key(&key, |s| s.0) {
                Ok(at) => at,
                Err(at) => {
                    tile.sums.insert(at, (key, Sum::default()));
                    tile.points.insert(at, Point::default());
                    at
                }
            };
            let sum = &mut tile.sums[at].1;
            sum.x += sign * (f64::from(p.x) * PER_M) as i64;
            sum.y += sign * (f64::from(p.y) * PER_M) as i64;
            sum.nx += sign * (p.nx * PER_UNIT) as i64;
            sum.ny += sign * (p.ny * PER_UNIT) as i64;
            sum.n += sign;
            sum.path = sum.path.wrapping_add(path.wrapping_mul(sign));
            sum.path2 = sum.path2.wrapping_add(path2.wrapping_mul(sign));
            if sum.n == 0 {
                tile.sums.remove(at);
                tile.points.remove(at);
            } else {
                tile.points[at] = sum.mean();
            }
        }
    }
}

fn voxel(v: f32) -> i32 {
    floor(v / VOXEL_M)
}

fn tile(row: i32, column: i32) -> usize {
    ((row & (TABLE - 1)) * TABLE + (column & (TABLE - 1))) as usize
}

impl Surfaces for LocalMap {
    fn nearest(&self, p: &Point, gate_m: f32) -> Option<Nearest<'_>> {
        const PER_TILE: f32 = 1.0 / (TILE_VOXELS as f32 * VOXEL_M);
        let at = |v: f32| floor(v * PER_TILE);
        let (mut best, mut best_d2) = (None::<(&Tile, usize)>, gate_m * gate_m);
        let facing = p.has_normal();
        for row in at(p.y - gate_m)..=at(p.y + gate_m) {
            for column in at(p.x - gate_m)..=at(p.x + gate_m) {
                let tile = &self.tiles[tile(row, column)];
                for (k, q) in tile.points.iter().enumerate() {
                    let (dx, dy) = (q.x - p.x, q.y - p.y);
                    let d2 = dx * dx + dy * dy;
                    if d2 < best_d2 && (!facing || q.nx * p.nx + q.ny * p.ny > 0.7) {
                        (best, best_d2) = (Some((tile, k)), d2);
                    }
                }
            }
        }
        best.map(|(tile, k)| Nearest {
            point: &tile.points[k],
            stands: self.all_stands || tile.sums[k].1.stands(),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn point() -> impl Strategy<Value = Point> {
        (-4.0f32..4.0, -4.0f32..4.0, -3.1f32..3.1).prop_map(|(x, y, a)| Point {
            x,
            y,
            nx: a.cos(),
            ny: a.sin(),
        })
    }

    proptest! {
        #[test]
        fn nearest_is_the_nearest(points in prop::collection::vec(point(), 0..80), p in point(), gate in 0.1f32..1.0) {
            let mut map = LocalMap::default();
            map.add(&points, &Pose2::new(3.0, -2.0, 0.4), 0.0);
            let d2 = |q: &Point| (q.x - p.x).powi(2) + (q.y - p.y).powi(2);
            let brute = map
                .tiles
                .iter()
                .flat_map(|t| &t.points)
                .filter(|q| d2(q) < gate * gate && q.nx * p.nx + q.ny * p.ny > 0.7)
                .map(d2)
                .fold(f32::INFINITY, f32::min);
            let found = map.nearest(&p, gate).map_or(f32::INFINITY, |q| d2(q.point));
            prop_assert_eq!(found.to_bits(), brute.to_bits());
        }

        #[test]
        fn what_is_taken_away_leaves_nothing_behind(
            a in prop::collection::vec(point(), 0..60),
            b in prop::collection::vec(point(), 0..60),
        ) {
            let (at_a, at_b) = (Pose2::new(40.0, -7.0, 2.0), Pose2::new(39.5, -7.2, -1.0));
            let mut both = LocalMap::default();
            both.add(&a, &at_a, 3.0);
            both.add(&b, &at_b, 5.0);
            both.take_away(&a, &at_a, 3.0);
            let mut only = LocalMap::default();
            only.add(&b, &at_b, 5.0);
            prop_assert!(both == only);
        }
    }

    #[test]
    fn what_is_seen_over_some_path_stands() {
        // Path so long that its square, summed up, overflows.
        for start_m in [0.0, 1e9] {
            let post = [Point { x: 3.02, y: 1.01, nx: -1.0, ny: 0.0 }; 3];
            let stands = |map: &LocalMap| map.nearest(&post[0], 0.5).unwrap().stands;
            let mut map = LocalMap::default();
            for step_m in [0.0, 0.2, 0.4] {
                map.add(&post[..1], &Pose2::default(), start_m + step_m);
            }
            assert!(!stands(&map), "no longer than a foot is down");
            map.add(&post, &Pose2::default(), start_m + 1.0);
            assert!(stands(&map));
            map.take_away(&post, &Pose2::default(), start_m + 1.0);
            assert!(!stands(&map));
        }
    }

    #[test]
    fn a_wall_seen_twice_is_one_wall() {
        let wall = |y: f32| -> Vec<Point> {
            (0..40).map(|k| Point { x: 0.05 * k as f32 + 0.02, y, nx: 0.0, ny: 1.0 }).collect()
        };
        let mut map = LocalMap::default();
        map.add(&wall(0.01), &Pose2::default(), 0.0);
        map.add(&wall(0.03), &Pose2::default(), 0.0);
        let q = map.nearest(&Point { x: 1.0, y: 0.2, nx: 0.0, ny: 1.0 }, 0.5).unwrap().point;
        assert!((q.y - 0.02).abs() < 1e-4, "{q:?}");
        assert!(map.nearest(&Point { x: 1.0, y: 0.2, nx: 0.0, ny: -1.0 }, 0.5).is_none(), "the other side");
    }
}
