//! Prior-free search for the transforms under which two clouds overlap: correlative scan matching
//! (Olson 2009) by best-first branch and bound over pooled grids (Hess et al. 2016), at the few
//! headings that the directions of the surfaces allow (Censi et al. 2005).
//!
//! The window is the whole circle and ± [`WINDOW_M`] between the two frames, whoever asks: never
//! one that the asker's drift has fixed.
//!
//! A cell of the grid holds one bit per octant of directions: a surface counts as hit only by one
//! that faces the same way. Wrong transforms then hit little, their bounds are low, and the search
//! stays short.

use crate::geometry::{Pose2, wrap};
use crate::scan::cloud::Point;
use crate::scan::place::spread;
use std::collections::BinaryHeap;
use std::f32::consts::TAU;

/// Half the window's edge.
pub const WINDOW_M: f64 = 10.0;
/// Cell of the target's grid, and step of the translations.
const CELL_M: f32 = 0.25;
/// Translations tried along an axis.
const SHIFTS: usize = (2.0 * WINDOW_M) as usize * 4;
/// Source points beyond are not used: a heading's step moves them by more than a surface's blur.
const REACH_M: f32 = 16.0;
/// The grid's cells on an edge: whatever the window can move a source point to.
const SIZE: usize = SHIFTS + 2 * (REACH_M / CELL_M) as usize;
/// Blur of the target's surfaces to either side.
const BLUR_M: f32 = 0.2;
/// Blur of their directions to either side.
const BLUR_RAD: f32 = 0.26;
/// Headings in the circle.
const HEADINGS: usize = 120;
/// Headings tried.
const HEADINGS_TRIED: usize = 20;
/// Modes nearer than this are one.
const DISTINCT_M: f64 = 0.75;
const DISTINCT_RAD: f64 = 0.2;
/// Translations on an edge of a block.
const BLOCK: usize = 2;
/// Blocks along an axis, and the bytes that their sums are padded to.
const BLOCKS: usize = SHIFTS / BLOCK;
const LANES: usize = BLOCKS.next_multiple_of(16);
/// Edge of the grid of one phase.
const PHASE_SIZE: usize = SIZE / BLOCK;
/// Source points used at most; sums are bytes.
const POINTS_MAX: usize = 160;
/// Nodes looked at before the search gives up on further modes.
const BUDGET: usize = 2_000;

/// A cloud to be laid over a target.
#[derive(Clone, Debug)]
pub struct Source {
    points: Vec<Oriented>,
    directions: [f32; HEADINGS],
}

/// The target as grids of octants, and how much of it faces where.
#[derive(Clone, Debug)]
pub struct Raster {
    cells: Vec<u8>,
    /// The OR over BLOCK × BLOCK cells to the upper right of each cell, de-interleaved: the cells
    /// that the blocks of translations take one point to lie side by side.
    blocks: Vec<u8>,
    directions: [f32; HEADINGS],
}

#[derive(Clone, Copy, Debug)]
struct Oriented {
    x: f32,
    y: f32,
    /// Direction of the normal, turns in [0, 1).
    turn: f32,
}

/// A source point under a heading.
#[derive(Clone, Copy, Debug)]
struct Placed {
    /// Its cell when the translation is the window's lower left corner.
    x: u16,
    y: u16,
    /// Bit of its direction.
    octant: u8,
}

fn oriented(cloud: &[Point]) -> impl Iterator<Item = Oriented> + '_ {
    cloud.iter().filter(|p| p.has_normal()).map(|p| Oriented {
        x: p.x,
        y: p.y,
        turn: (p.ny.atan2(p.nx) / TAU).rem_euclid(1.0) % 1.0,
    })
}

/// How much faces where, in steps of a heading.
fn directions(points: &[Oriented]) -> [f32; HEADINGS] {
    let mut sums = [0.0; HEADINGS];
    for p in points {
        sums[((p.turn * HEADINGS as f32) as usize).min(HEADINGS - 1)] += 1.0;
    }
    sums
}

impl Source {
    /// Of points spread evenly over the surfaces.
    pub fn new(sample: &[Point]) -> Self {
        let points: Vec<Oriented> =
            oriented(&spread(sample, POINTS_MAX)).filter(|p| p.x.hypot(p.y) < REACH_M).collect();
        Self { directions: directions(&points), points }
    }
}

impl Raster {
    /// Rasterises a cloud; `sample` is its points spread evenly over the surfaces.
    pub fn new(cloud: &[Point], sample: &[Point]) -> Self {
        let mut cells = vec![0u8; SIZE * SIZE];
        for p in oriented(cloud) {
            let (s, c) = (p.turn * TAU).sin_cos();
            let blur = BLUR_RAD / TAU;
            let bits = octant(p.turn - blur) | octant(p.turn + blur);
            for along in [-BLUR_M, 0.0, BLUR_M] {
                let (x, y) = (cell(p.x + along * c), cell(p.y + along * s));
                if x < SIZE && y < SIZE {
                    cells[y * SIZE + x] |= bits;
                }
            }
        }
        let blocks = pool(&cells);
        let spread: Vec<Oriented> = oriented(sample).collect();
        Self { cells, blocks, directions: directions(&spread) }
    }
}

/// Bit of a direction's octant.
fn octant(turn: f32) -> u8 {
    1 << ((turn.rem_euclid(1.0) * 8.0) as u8).min(7)
}

/// Index along an axis; negative ones wrap to huge ones.
fn cell(v_m: f32) -> usize {
    (v_m / CELL_M + SIZE as f32 / 2.0).floor() as isize as usize
}

/// The OR over BLOCK × BLOCK cells to the upper right of each cell, by phase.
fn pool(cells: &[u8]) -> Vec<u8> {
    // Lanes beyond the last block read into the next row, and beyond the last row.
    let mut blocks = vec![0u8; SIZE * SIZE + LANES];
    let mut any = [0u8; SIZE];
    for y in 0..SIZE - 1 {
        let (here, above) = cells[y * SIZE..(y + 2) * SIZE].split_at(SIZE);
        for ((a, h), b) in any.iter_mut().zip(here).zip(above) {
            *a = h | b;
        }
        let (even, odd) = (phase_index(0, y), phase_index(1, y));
        for (k, out) in blocks[even..even + PHASE_SIZE].iter_mut().enumerate() {
            *out = any[2 * k] | any[2 * k + 1];
        }
        for (k, out) in blocks[odd..odd + PHASE_SIZE - 1].iter_mut().enumerate() {
            *out = any[2 * k + 1] | any[2 * k + 2];
        }
    }
    blocks
}

/// Where the block that begins at a cell is held.
fn phase_index(x: usize, y: usize) -> usize {
    let phase = (y % BLOCK) * BLOCK + x % BLOCK;
    (phase * PHASE_SIZE + y / BLOCK) * PHASE_SIZE + x / BLOCK
}

/// A block of translations at one heading, or one translation.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Node {
    /// Upper bound of the score; first, so that the heap orders by it.
    bound: u8,
    /// One translation.
    leaf: bool,
    heading: u8,
    /// Lower left translation, cells from the window's corner.
    x: u8,
    y: u8,
}

/// Transforms `target_from_source` under which the clouds overlap best, best first, at most
/// `modes_max`, each with the share of source points that hit. Those below `score_min` are left out.
pub fn search(target: &Raster, source: &Source, score_min: f64, modes_max: usize) -> Vec<(Pose2, f64)> {
    let floor = ((score_min * source.points.len() as f64) as u8).max(1);
    let mut placed: Vec<(u8, Vec<Placed>)> = Vec::new();
    let mut heap = BinaryHeap::new();
    for heading in headings(target, source) {
        let points = place(source, heading);
        push_blocks(&mut heap, target, &points, placed.len() as u8, floor);
        placed.push((heading as u8, points));
    }
    let mut found: Vec<(Pose2, f64)> = Vec::new();
    for _ in 0..BUDGET {
        let Some(node) = heap.pop() else { break };
        let (heading, points) = &placed[usize::from(node.heading)];
        let pose = pose_of(node, *heading);
        if near_known(node, &pose, &found) {
            continue;
        }
        if node.leaf {
            found.push((pose, f64::from(node.bound) / source.points.len() as f64));
            if found.len() == modes_max {
                break;
            }
            continue;
        }
        for (dx, dy) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
            let child = Node { leaf: true, x: node.x + dx, y: node.y + dy, ..node };
            let bound = hits(target, points, child.x, child.y);
            if bound >= floor {
                heap.push(Node { bound, ..child });
            }
        }
    }
    found
}

/// The headings under which the surfaces' directions correlate best.
fn headings(target: &Raster, source: &Source) -> Vec<usize> {
    let t = &target.directions;
    let blurred: Vec<f32> = (0..2 * HEADINGS)
        .map(|k| 2.0 * t[k % HEADINGS] + t[(k + 1) % HEADINGS] + t[(k + HEADINGS - 1) % HEADINGS])
        .collect();
    let mut scored: Vec<(f32, usize)> = (0..HEADINGS)
        .map(|h| (source.directions.iter().zip(&blurred[h..]).map(|(a, b)| a * b).sum(), h))
        .collect();
    scored.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
    scored.into_iter().take(HEADINGS_TRIED).map(|(_, h)| h).collect()
}

fn place(source: &Source, heading: usize) -> Vec<Placed> {
    let turn = heading as f32 / HEADINGS as f32;
    let (s, c) = (turn * TAU).sin_cos();
    let half = SHIFTS / 2;
    source
        .points
        .iter()
        .map(|p| Placed {
            // Turning may round a point at the reach's edge to just beyond it.
            x: cell(c * p.x - s * p.y).saturating_sub(half) as u16,
            y: cell(s * p.x + c * p.y).saturating_sub(half) as u16,
            octant: octant(p.turn + turn),
        })
        .collect()
}

/// Pushes the blocks of a heading whose bounds reach the floor.
fn push_blocks(heap: &mut BinaryHeap<Node>, target: &Raster, points: &[Placed], heading: u8, floor: u8) {
    let starts: Vec<(usize, u8)> =
        points.iter().map(|p| (phase_index(p.x.into(), p.y.into()), p.octant)).collect();
    for row in 0..BLOCKS {
        let mut sums = [0u8; LANES];
        for &(start, octant) in &starts {
            let from = start + row * PHASE_SIZE;
            for (sum, cell) in sums.iter_mut().zip(&target.blocks[from..from + LANES]) {
                *sum += u8::from(cell & octant != 0);
            }
        }
        for (k, &bound) in sums[..BLOCKS].iter().enumerate() {
            if bound >= floor {
                heap.push(Node { bound, leaf: false, heading, x: (k * BLOCK) as u8, y: (row * BLOCK) as u8 });
            }
        }
    }
}

fn hits(target: &Raster, points: &[Placed], x: u8, y: u8) -> u8 {
    let shift = usize::from(y) * SIZE + usize::from(x);
    let hit = |p: &&Placed| target.cells[usize::from(p.y) * SIZE + usize::from(p.x) + shift] & p.octant != 0;
    points.iter().filter(hit).count() as u8
}

/// Whether the whole block belongs to a mode already found.
fn near_known(node: Node, centre: &Pose2, found: &[(Pose2, f64)]) -> bool {
    let half_m = if node.leaf { 0.0 } else { f64::from(CELL_M) * 0.71 };
    found.iter().any(|(known, _)| {
        known.distance_m(centre) + half_m < DISTINCT_M
            && wrap(known.yaw_rad - centre.yaw_rad).abs() < DISTINCT_RAD
    })
}

fn pose_of(node: Node, heading: u8) -> Pose2 {
    let middle = if node.leaf { 0.0 } else { 0.5 };
    let shift_m = |k: u8| (f64::from(k) + middle - SHIFTS as f64 / 2.0) * f64::from(CELL_M);
    Pose2::new(shift_m(node.x), shift_m(node.y), f64::from(heading) * std::f64::consts::TAU / HEADINGS as f64)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn line(from: (f32, f32), to: (f32, f32)) -> impl Iterator<Item = Point> {
        let (dx, dy) = (to.0 - from.0, to.1 - from.1);
        let length = dx.hypot(dy);
        let n = (length / 0.1) as usize;
        (0..n).map(move |k| {
            let f = k as f32 / n as f32;
            Point { x: from.0 + f * dx, y: from.1 + f * dy, nx: -dy / length, ny: dx / length }
        })
    }

    /// An L of walls with a stub: unlike itself under every turn.
    fn walls() -> Vec<Point> {
        line((-4.0, -3.0), (5.0, -3.0))
            .chain(line((5.0, -3.0), (5.0, 2.0)))
            .chain(line((1.0, -3.0), (1.0, -1.0)))
            .collect()
    }

    fn found(target: &[Point], source: &[Point], modes_max: usize) -> Vec<(Pose2, f64)> {
        search(&Raster::new(target, target), &Source::new(source), 0.3, modes_max)
    }

    proptest! {
        #[test]
        fn finds_a_transform_anywhere_in_the_window(
            x in -9.7f64..9.7, y in -9.7f64..9.7, yaw in -3.1f64..3.1,
        ) {
            let truth = Pose2::new(x, y, yaw);
            // Halfway between the two, which both see.
            let halfway = Pose2::new(x / 2.0, y / 2.0, 0.0);
            let target: Vec<Point> = walls().iter().map(|p| p.moved(&halfway)).collect();
            let source: Vec<Point> = target.iter().map(|p| p.moved(&truth.inverse())).collect();
            let (best, share) = found(&target, &source, 4)[0];
            for p in &source {
                let (is, should) = (p.moved(&best), p.moved(&truth));
                prop_assert!((is.x - should.x).hypot(is.y - should.y) < 1.0, "{best:?}");
            }
            prop_assert!(share > 0.7, "{share}");
        }

        #[test]
        fn the_best_is_the_best_of_all_translations(
            corners in prop::collection::vec((-7.0f32..7.0, -7.0f32..7.0), 4..9),
        ) {
            let cloud: Vec<Point> = corners.windows(2).flat_map(|c| line(c[0], c[1])).collect();
            let (target, source) = (Raster::new(&walls(), &walls()), Source::new(&cloud));
            let n = source.points.len() as f64;
            let brute = headings(&target, &source)
                .into_iter()
                .filter_map(|h| {
                    let points = place(&source, h);
                    (0..SHIFTS as u8).flat_map(|y| (0..SHIFTS as u8).map(move |x| (x, y)))
                        .map(|(x, y)| hits(&target, &points, x, y))
                        .max()
                })
                .max()
                .unwrap_or(0);
            let best = search(&target, &source, 0.0, 1).first().map_or(0.0, |f| f.1);
            prop_assert!((best - f64::from(brute) / n).abs() < 1e-9, "{best} {brute} of {n}");
        }
    }

    #[test]
    fn a_wall_is_not_hit_from_behind() {
        let wall: Vec<Point> = line((-3.0, 1.0), (3.0, 1.0)).collect();
        let behind: Vec<Point> = wall.iter().map(|p| Point { nx: -p.nx, ny: -p.ny, ..*p }).collect();
        // Only turned round does the one lie on the other.
        for (pose, _) in found(&wall, &behind, 8) {
            assert!(wrap(pose.yaw_rad).abs() > 2.8, "{pose:?}");
        }
    }

    #[test]
    fn a_straight_wall_has_many_modes_and_an_empty_place_none() {
        let wall: Vec<Point> = line((-10.0, 1.0), (10.0, 1.0)).collect();
        let piece = &wall[70..130];
        assert_eq!(found(&wall, piece, 4).len(), 4);
        assert!(found(&[], piece, 4).is_empty());
        assert!(found(&wall, &[], 4).is_empty());
    }

    #[test]
    fn modes_are_apart_and_in_order() {
        let modes = found(&walls(), &walls(), 12);
        assert!(modes.len() > 1 && modes.windows(2).all(|m| m[0].1 >= m[1].1));
        for (k, (a, _)) in modes.iter().enumerate() {
            for (b, _) in &modes[..k] {
                assert!(
                    a.distance_m(b) > DISTINCT_M - 1e-6 || wrap(a.yaw_rad - b.yaw_rad).abs() >= DISTINCT_RAD
                );
            }
        }
    }
}
