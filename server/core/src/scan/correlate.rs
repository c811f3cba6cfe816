//! Prior-free search for the transforms under which two clouds overlap: correlative scan matching
//! (Olson 2009) by best-first branch and bound over max-pooled grids (Hess et al. 2016).
//!
//! The window is the whole circle and ± [`WINDOW_M`] between the two frames, whoever asks: never
//! one that the asker's drift has fixed.

use super::cloud::Point;
use crate::geometry::{Pose2, wrap};
use std::collections::BinaryHeap;
use std::f64::consts::TAU;

/// Half the window's edge.
pub const WINDOW_M: f64 = 10.0;
/// Cell of the target's grid.
const CELL_M: f64 = 0.125;
/// Half the grid's edge. Target points nearer to the edge than the coarsest block are not used:
/// a block that begins outside the grid then holds nothing, and its bound is right.
const RADIUS_M: f64 = 20.0;
/// The grid's cells on an edge.
const SIZE: usize = (2.0 * RADIUS_M / CELL_M) as usize;
/// Blur of the target's surfaces, in cells.
const BLUR_CELLS: i32 = 2;
/// Pooling of the coarsest level: 2^5 cells = 4 m.
const LEVELS: usize = 6;
/// Headings tried.
const HEADINGS: usize = 240;
/// Modes nearer than this are one.
const DISTINCT_M: f64 = 0.75;
const DISTINCT_RAD: f64 = 0.2;
/// Nodes looked at before the search gives up on further modes.
const BUDGET: usize = 60_000;

/// The target as max-pooled grids: level h holds the maximum over 2^h × 2^h cells to the upper
/// right.
#[derive(Clone, Debug)]
pub struct Pyramid {
    levels: Vec<Vec<u8>>,
}

impl Pyramid {
    /// Rasterises a cloud; origin in the grid's centre.
    pub fn new(cloud: &[Point]) -> Self {
        let mut base = vec![0u8; SIZE * SIZE];
        let used_m = (RADIUS_M - f64::from(1u16 << (LEVELS - 1)) * CELL_M - CELL_M * 2.0) as f32;
        for p in cloud.iter().filter(|p| p.x.abs() < used_m && p.y.abs() < used_m) {
            stamp(&mut base, f64::from(p.x), f64::from(p.y));
        }
        let mut levels = vec![base];
        for h in 1..LEVELS {
            let pooled = pool(&levels[h - 1], 1 << (h - 1));
            levels.push(pooled);
        }
        Self { levels }
    }
}

fn stamp(grid: &mut [u8], x_m: f64, y_m: f64) {
    const FALLOFF: [u8; 9] = [255, 190, 150, 110, 90, 70, 50, 40, 30];
    let (cx, cy) = (cell(x_m), cell(y_m));
    for dy in -BLUR_CELLS..=BLUR_CELLS {
        for dx in -BLUR_CELLS..=BLUR_CELLS {
            let (x, y) = (cx + dx, cy + dy);
            if x >= 0 && y >= 0 && (x as usize) < SIZE && (y as usize) < SIZE {
                let value = FALLOFF[(dx * dx + dy * dy) as usize % 9];
                let c = &mut grid[y as usize * SIZE + x as usize];
                *c = (*c).max(value);
            }
        }
    }
}

fn cell(v_m: f64) -> i32 {
    ((v_m + RADIUS_M) / CELL_M).floor() as i32
}

/// Maximum of the cells at 0 and `step` along both axes.
fn pool(from: &[u8], step: usize) -> Vec<u8> {
    let mut rows = from.to_vec();
    for row in rows.chunks_exact_mut(SIZE) {
        for x in 0..SIZE - step {
            row[x] = row[x].max(row[x + step]);
        }
    }
    for y in 0..SIZE - step {
        let (head, tail) = rows.split_at_mut((y + step) * SIZE);
        for (a, b) in head[y * SIZE..(y + 1) * SIZE].iter_mut().zip(&tail[..SIZE]) {
            *a = (*a).max(*b);
        }
    }
    rows
}

/// A block of translations at one heading.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Node {
    /// Upper bound of the score; first, so that the heap orders by it.
    bound: u32,
    /// Finer first among equals.
    fineness: u8,
    heading: u16,
    /// Lower left translation, cells.
    x: i16,
    y: i16,
}

/// Transforms `target_from_source` under which the clouds overlap best, best first, at most
/// `modes_max`, each with the mean look-up value in [0, 1]. Those below `score_min`, or below 70 %
/// of the best, are left out.
pub fn search(target: &Pyramid, source: &[Point], score_min: f64, modes_max: usize) -> Vec<(Pose2, f64)> {
    if source.is_empty() {
        return Vec::new();
    }
    let rotated: Vec<Vec<(i16, i16)>> = (0..HEADINGS).map(|h| rotate(source, h)).collect();
    let full = source.len() as f64 * 255.0;
    let mut floor = (score_min * full) as u32;
    let mut heap = BinaryHeap::new();
    let (top, half) = ((LEVELS - 1) as u8, (WINDOW_M / CELL_M) as i16);
    let block = 1i16 << top;
    for (heading, points) in rotated.iter().enumerate() {
        for y in (-half..half).step_by(block as usize) {
            for x in (-half..half).step_by(block as usize) {
                let node = Node { bound: 0, fineness: 0, heading: heading as u16, x, y };
                push(&mut heap, target, points, node, floor);
            }
        }
    }
    let mut found: Vec<(Pose2, f64)> = Vec::new();
    let mut looked_at = 0;
    while let Some(node) = heap.pop() {
        looked_at += 1;
        if node.bound < floor || looked_at > BUDGET {
            break;
        }
        let level = top - node.fineness;
        if near_known(&node, level, &found) {
            continue;
        }
        if level == 0 {
            let score = f64::from(node.bound) / full;
            if found.is_empty() {
                floor = floor.max((f64::from(node.bound) * 0.7) as u32);
            }
            found.push((pose_of(&node, 0), score));
            if found.len() == modes_max {
                break;
            }
            continue;
        }
        let step = 1i16 << (level - 1);
        for (dx, dy) in [(0, 0), (step, 0), (0, step), (step, step)] {
            let child = Node {
                bound: 0,
                fineness: node.fineness + 1,
                heading: node.heading,
                x: node.x + dx,
                y: node.y + dy,
            };
            push(&mut heap, target, &rotated[usize::from(node.heading)], child, floor);
        }
    }
    found
}

fn push(heap: &mut BinaryHeap<Node>, target: &Pyramid, points: &[(i16, i16)], mut node: Node, floor: u32) {
    let grid = &target.levels[LEVELS - 1 - usize::from(node.fineness)];
    let mut sum = 0u32;
    for &(px, py) in points {
        let (x, y) = ((px + node.x) as usize, (py + node.y) as usize);
        // Negative coordinates wrap to huge ones.
        if x < SIZE && y < SIZE {
            sum += u32::from(grid[y * SIZE + x]);
        }
    }
    if sum >= floor {
        node.bound = sum;
        heap.push(node);
    }
}

/// Whether the whole block belongs to a mode already found.
fn near_known(node: &Node, level: u8, found: &[(Pose2, f64)]) -> bool {
    let centre = pose_of(node, level);
    let half_m = f64::from(1u16 << level) * CELL_M * 0.71;
    found.iter().any(|(known, _)| {
        known.distance_m(&centre) + half_m < DISTINCT_M + CELL_M
            && wrap(known.yaw_rad - centre.yaw_rad).abs() < DISTINCT_RAD
    })
}

fn pose_of(node: &Node, level: u8) -> Pose2 {
    let middle = f64::from((1u16 << level) - 1) / 2.0;
    Pose2::new(
        (f64::from(node.x) + middle) * CELL_M,
        (f64::from(node.y) + middle) * CELL_M,
        f64::from(node.heading) * TAU / HEADINGS as f64,
    )
}

/// Source points under a heading, in the target's cells.
fn rotate(source: &[Point], heading: usize) -> Vec<(i16, i16)> {
    let turn = Pose2::new(0.0, 0.0, heading as f64 * TAU / HEADINGS as f64);
    source
        .iter()
        .map(|p| {
            let (x, y) = turn.apply(f64::from(p.x), f64::from(p.y));
            (cell(x).clamp(-8000, 8000) as i16, cell(y).clamp(-8000, 8000) as i16)
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// An L of walls with a stub: unlike itself under every turn.
    fn walls() -> Vec<Point> {
        let line = |x0: f32, y0: f32, x1: f32, y1: f32| {
            (0..60).map(move |k| {
                let f = k as f32 / 60.0;
                Point { x: x0 + f * (x1 - x0), y: y0 + f * (y1 - y0), nx: 1.0, ny: 0.0 }
            })
        };
        line(-4.0, -3.0, 5.0, -3.0)
            .chain(line(5.0, -3.0, 5.0, 2.0))
            .chain(line(1.0, -3.0, 1.0, -1.0))
            .collect()
    }

    #[test]
    fn finds_a_transform_anywhere_in_the_window() {
        let target = walls();
        for truth in [Pose2::new(7.3, -6.1, 2.4), Pose2::new(-9.0, 3.3, -0.7), Pose2::new(0.0, 0.0, 3.1)] {
            let source: Vec<Point> = target.iter().map(|p| p.moved(&truth.inverse())).collect();
            let found = search(&Pyramid::new(&target), &source, 0.4, 4);
            let (best, score) = found[0];
            let off = truth.between(&best);
            assert!(off.x_m.hypot(off.y_m) < 0.3 && off.yaw_rad.abs() < 0.05, "{truth:?} {best:?}");
            assert!(score > 0.8, "{score}");
        }
    }

    #[test]
    fn no_bound_is_below_what_it_bounds() {
        let pyramid = Pyramid::new(&walls());
        let points = rotate(&walls(), 17);
        let score = |fineness: u8, x: i16, y: i16| {
            let mut heap = BinaryHeap::new();
            push(&mut heap, &pyramid, &points, Node { bound: 0, fineness, heading: 17, x, y }, 0);
            heap.pop().map_or(0, |n| n.bound)
        };
        for (x, y) in [(-32, 0), (0, 0), (16, -48), (40, 24)] {
            let block = score(2, x, y);
            let within = (0..8).flat_map(|dx| (0..8).map(move |dy| (dx, dy)));
            let best = within.map(|(dx, dy)| score(5, x + dx, y + dy)).max().unwrap_or(0);
            assert!(block >= best, "block at ({x}, {y}): {block} < {best}");
        }
    }

    #[test]
    fn a_straight_wall_has_many_modes_and_an_empty_place_none() {
        let wall: Vec<Point> =
            (0..200).map(|k| Point { x: k as f32 * 0.1 - 10.0, y: 1.0, nx: 0.0, ny: -1.0 }).collect();
        let piece = &wall[70..130];
        assert!(search(&Pyramid::new(&wall), piece, 0.4, 4).len() == 4);
        assert!(search(&Pyramid::new(&[]), piece, 0.4, 4).is_empty());
        assert!(search(&Pyramid::new(&wall), &[], 0.4, 4).is_empty());
    }
}
