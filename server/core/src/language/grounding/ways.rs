//! The way from the speaker to every place, over ground that the robot has driven.
//!
//! A straight line goes through walls; people mean the way one walks. Places are joined to the next
//! on the path driven and to those of other passes close by.

use crate::language::grounding::place::GroundPlace;
use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// Passes this near each other are on the same floor: half a corridor, less than what two drives on
/// either side of a wall keep between them.
const JOIN_M: f64 = 1.2;
/// Nobody describes what is further than this; bounds the search.
const FAR_M: f64 = 80.0;
/// A step on the path driven longer than this is a gap in it: the robot was carried.
const STEP_MAX_M: f64 = 5.0;

/// Shortest ways from one place: a tree over the places that were driven.
pub struct Ways {
    /// Length of the way to every place; infinite if none was found.
    walk_m: Vec<f64>,
    /// The first place on the way that is [`ONSET_M`] from the speaker, or the place itself.
    onset: Vec<u32>,
    /// Places that a way was found to, each after the one before on its way and followed by all that
    /// lie behind it; beside each, how many come before on its way.
    tree: Vec<(u32, u32)>,
}

/// A point of a way.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Step {
    /// Position in the map.
    pub at: (f64, f64),
    /// Length of the way up to there.
    pub walk_m: f64,
}

impl Step {
    /// Straight on to a point.
    pub fn to(self, at: (f64, f64)) -> Self {
        let (dx, dy) = (at.0 - self.at.0, at.1 - self.at.1);
        Self { at, walk_m: self.walk_m + (dx * dx + dy * dy).sqrt() }
    }
}

/// Not on a way, or no way.
const NONE: u32 = u32::MAX;
/// Which way one sets off shows so far on.
const ONSET_M: f64 = 2.0;

impl Ways {
    /// Ways from place `from`, which is one of `places`.
    pub fn new(places: &[GroundPlace], from: usize) -> Self {
        let grid = Grid::new(places, &places[from]);
        let mut walk_m = vec![f64::INFINITY; places.len()];
        let mut before = vec![NONE; places.len()];
        let mut onset: Vec<u32> = (0..places.len() as u32).collect();
        let mut order = Vec::new();
        walk_m[from] = 0.0;
        // Distances are not negative, so their bits are in order.
        let mut open = BinaryHeap::from([Reverse((0_u64, from as u32))]);
        while let Some(Reverse((bits, at))) = open.pop() {
            let (so_far_m, k) = (f64::from_bits(bits), at as usize);
            if so_far_m > walk_m[k] {
                continue;
            }
            order.push(at);
            if before[k] != NONE {
                let first = onset[before[k] as usize];
                if distance_m(&places[first as usize], &places[from]) > ONSET_M {
                    onset[k] = first;
                }
            }
            let mut reach = |other: usize, most_m: f64| {
                let step_m = distance_m(&places[k], &places[other]);
                let total_m = so_far_m + step_m;
                if step_m <= most_m && total_m < walk_m[other] && total_m <= FAR_M {
                    walk_m[other] = total_m;
                    before[other] = at;
                    open.push(Reverse((total_m.to_bits(), other as u32)));
                }
            };
            if k > 0 {
                reach(k - 1, STEP_MAX_M);
            }
            if k + 1 < places.len() {
                reach(k + 1, STEP_MAX_M);
            }
            grid.near(&places[k], |other| reach(other, JOIN_M));
        }
        Self { walk_m, onset, tree: in_depth(&order, &before) }
    }

    /// Length of the way to a place; none if there is no way.
    pub fn walk_m(&self, place: usize) -> Option<f64> {
        Some(self.walk_m[place]).filter(|m| m.is_finite())
    }

    /// A place by which one sets off on the way to another.
    pub fn onset(&self, place: usize) -> usize {
        self.onset[place] as usize
    }

    /// Calls `f` with every place that a way was found to and that way, from the speaker to the place.
    /// One pass over the tree: a place's way is that of the one before it, and a step.
    pub fn visit(&self, places: &[GroundPlace], mut f: impl FnMut(usize, &[Step])) {
        let mut way = Vec::new();
        for &(place, depth) in &self.tree {
            let place = place as usize;
            way.truncate(depth as usize);
            way.push(Step { at: (places[place].x_m, places[place].y_m), walk_m: self.walk_m[place] });
            f(place, &way);
        }
    }
}

/// The tree given by the place `before` each of `order`, which begins at the root, depth first.
fn in_depth(order: &[u32], before: &[u32]) -> Vec<(u32, u32)> {
    // How many lie behind each, itself included; then each takes its turn within its parent's range.
    let mut sizes = vec![1_u32; before.len()];
    for &k in order.iter().skip(1).rev() {
        sizes[before[k as usize] as usize] += sizes[k as usize];
    }
    let mut tree = vec![(0, 0); order.len()];
    let (mut next, mut depth) = (vec![0_u32; before.len()], vec![0_u32; before.len()]);
    for &k in order {
        let (child, parent) = (k as usize, before[k as usize] as usize);
        let mut slot = 0;
        if let Some(free) = next.get_mut(parent) {
            slot = *free;
            *free += sizes[child];
            depth[child] = depth[parent] + 1;
        }
        tree[slot as usize] = (k, depth[child]);
        next[child] = slot + 1;
    }
    tree
}

/// Places by cells of [`JOIN_M`].
struct Grid {
    corner: (f64, f64),
    /// The first place of each cell, and after each place the next of its cell, the earlier first.
    first: Vec<u32>,
    next: Vec<u32>,
}

/// Cells that cover [`FAR_M`] to either side, and one more for neighbours.
const CELLS: usize = 2 * (FAR_M / JOIN_M) as usize + 4;

impl Grid {
    /// Of the places within [`FAR_M`] of `middle`, the only ones that a way can lead to.
    fn new(places: &[GroundPlace], middle: &GroundPlace) -> Self {
        let half_m = 0.5 * JOIN_M * CELLS as f64;
        let corner = (middle.x_m - half_m, middle.y_m - half_m);
        let mut grid = Self { corner, first: vec![NONE; CELLS * CELLS], next: vec![NONE; places.len()] };
        for (k, p) in places.iter().enumerate().rev() {
            if let Some(cell) = grid.cell(p) {
                grid.next[k] = std::mem::replace(&mut grid.first[cell], k as u32);
            }
        }
        grid
    }

    /// The cell of a place; none near the grid's edge.
    fn cell(&self, p: &GroundPlace) -> Option<usize> {
        let index = |m: f64| Some((m / JOIN_M) as usize).filter(|k| (1..CELLS - 1).contains(k));
        Some(index(p.y_m - self.corner.1)? * CELLS + index(p.x_m - self.corner.0)?)
    }

    /// Calls `f` for all places in a place's cell and the eight round it, row by row.
    fn near(&self, place: &GroundPlace, mut f: impl FnMut(usize)) {
        let Some(cell) = self.cell(place) else { return };
        for middle in [cell - CELLS, cell, cell + CELLS] {
            for cell in middle - 1..=middle + 1 {
                let mut k = self.first[cell];
                while k != NONE {
                    f(k as usize);
                    k = self.next[k as usize];
                }
            }
        }
    }
}

fn distance_m(a: &GroundPlace, b: &GroundPlace) -> f64 {
    let (dx, dy) = (a.x_m - b.x_m, a.y_m - b.y_m);
    (dx * dx + dy * dy).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(x_m: f64, y_m: f64, path_m: f64) -> GroundPlace {
        GroundPlace { x_m, y_m, yaw_rad: 0.0, path_m }
    }

    /// The way to a place, from the speaker.
    fn way(ways: &Ways, places: &[GroundPlace], to: usize) -> Vec<(f64, f64)> {
        let mut found = Vec::new();
        ways.visit(places, |k, way| {
            assert_eq!(way.last().map(|s| s.walk_m), ways.walk_m(k));
            assert!(way.windows(2).all(|w| (w[0].to(w[1].at).walk_m - w[1].walk_m).abs() < 1e-9));
            if k == to {
                found = way.iter().map(|s| s.at).collect();
            }
        });
        found
    }

    #[test]
    fn a_way_keeps_to_what_was_driven_and_takes_short_cuts() {
        // Up one aisle, over, and down another, 6 m apart; then a pass beside the first aisle.
        let mut places: Vec<GroundPlace> = (0..=20).map(|k| at(f64::from(k), 0.0, f64::from(k))).collect();
        places.extend((1..=6).map(|k| at(20.0, f64::from(k), 20.0 + f64::from(k))));
        places.extend((1..=20).map(|k| at(20.0 - f64::from(k), 6.0, 26.0 + f64::from(k))));
        let ways = Ways::new(&places, 0);
        let path = way(&ways, &places, 46);
        assert_eq!((path.len(), path[0], path[20]), (47, (0.0, 0.0), (20.0, 0.0)), "not through the wall");
        assert_eq!((ways.walk_m(46), ways.onset(46)), (Some(46.0), 3));
        places.extend((1..=6).map(|k| at(0.0, 6.0 - f64::from(k), 46.0 + f64::from(k))));
        let ways = Ways::new(&places, 0);
        assert!(ways.walk_m(46).unwrap() < 6.1, "the loop is closed");
        let mut visits = Vec::new();
        ways.visit(&places, |k, _| visits.push(k));
        visits.sort_unstable();
        assert!(visits.into_iter().eq(0..places.len()), "each place once");
    }

    #[test]
    fn nothing_is_found_beyond_a_gap_or_too_far_off() {
        let mut places =
            vec![at(0.0, 0.0, 0.0), at(1.0, 0.0, 1.0), at(80.0, 0.0, 2.0), at(f64::NAN, 0.0, 3.0)];
        let ways = Ways::new(&places, 0);
        assert_eq!((ways.walk_m(1), ways.walk_m(2), ways.walk_m(3)), (Some(1.0), None, None));
        assert!(way(&ways, &places, 2).is_empty());
        places = (0..100).map(|k| at(f64::from(k), 0.0, f64::from(k))).collect();
        let ways = Ways::new(&places, 0);
        assert_eq!((ways.walk_m(80), ways.walk_m(81)), (Some(80.0), None));
    }
}
