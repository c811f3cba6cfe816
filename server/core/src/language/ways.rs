//! The way from the speaker to every place, over ground that the robot has driven.
//!
//! A straight line goes through walls; people mean the way one walks. Places are joined to the next
//! on the path driven and to those of other passes close by.

use super::ground::GroundPlace;
use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// Passes this near each other are on the same floor: half a corridor, less than what two drives on
/// either side of a wall keep between them.
const JOIN_M: f64 = 1.2;
/// Nobody describes what is further than this; bounds the search.
const FAR_M: f64 = 80.0;
/// A step on the path driven longer than this is a gap in it: the robot was carried.
const STEP_MAX_M: f64 = 5.0;

/// Shortest ways from one place.
pub struct Ways {
    /// Length of the way to every place; infinite if none was found.
    walk_m: Vec<f64>,
    /// The place before on the way.
    before: Vec<u32>,
    /// Places that a way was found to, the nearer first.
    order: Vec<u32>,
    /// The first place on the way that is [`ONSET_M`] from the speaker, or the place itself.
    onset: Vec<u32>,
}

/// Not on a way, or no way.
const NONE: u32 = u32::MAX;
/// Which way one sets off shows so far on.
const ONSET_M: f64 = 2.0;

impl Ways {
    /// Ways from place `from`, which is one of `places`.
    pub fn new(places: &[GroundPlace], from: usize) -> Self {
        let grid = Grid::new(places);
        let mut ways = Self {
            walk_m: vec![f64::INFINITY; places.len()],
            before: vec![NONE; places.len()],
            order: Vec::new(),
            onset: (0..places.len() as u32).collect(),
        };
        ways.walk_m[from] = 0.0;
        // Distances are not negative, so their bits are in order.
        let mut open = BinaryHeap::from([Reverse((0_u64, from as u32))]);
        while let Some(Reverse((bits, at))) = open.pop() {
            let walk_m = f64::from_bits(bits);
            let k = at as usize;
            if walk_m > ways.walk_m[k] || walk_m > FAR_M {
                continue;
            }
            ways.order.push(at);
            if let Some(&before) = ways.before.get(k).filter(|b| **b != NONE) {
                let onset = ways.onset[before as usize];
                if distance_m(&places[onset as usize], &places[from]) > ONSET_M {
                    ways.onset[k] = onset;
                }
            }
            let mut reach = |other: usize, most_m: f64| {
                let step_m = distance_m(&places[k], &places[other]);
                let total_m = walk_m + step_m;
                if step_m <= most_m && total_m < ways.walk_m[other] {
                    ways.walk_m[other] = total_m;
                    ways.before[other] = at;
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
        ways
    }

    /// Length of the way to a place; none if there is no way.
    pub fn walk_m(&self, place: usize) -> Option<f64> {
        Some(self.walk_m[place]).filter(|m| m.is_finite())
    }

    /// A place by which one sets off on the way to another.
    pub fn onset(&self, place: usize) -> usize {
        self.onset[place] as usize
    }

    /// For every place, from which one on the way there may come within reach of something, its gap
    /// from that beyond reach given for every place; negative is within. One pass for all ways.
    pub fn first_near(&self, places: &[GroundPlace], over_m: impl Fn(&GroundPlace) -> f64) -> Vec<u32> {
        let mut first = vec![NONE; places.len()];
        for &k in &self.order {
            let (k, before) = (k as usize, self.before[k as usize]);
            let here_m = over_m(&places[k]);
            first[k] = if before == NONE {
                if here_m <= 0.0 { k as u32 } else { NONE }
            } else if first[before as usize] != NONE {
                first[before as usize]
            } else {
                // The step there may come within reach if both its ends are near enough.
                let from = &places[before as usize];
                let may = over_m(from) + here_m <= distance_m(from, &places[k]);
                if may { before } else { NONE }
            };
        }
        first
    }

    /// The end of the way to a place, from `first` on it, into `path`; nothing if `first` is none.
    pub fn path(&self, places: &[GroundPlace], first: u32, to: usize, path: &mut Vec<(f64, f64)>) {
        path.clear();
        if first == NONE {
            return;
        }
        let mut k = to as u32;
        while k != NONE {
            path.push((places[k as usize].x_m, places[k as usize].y_m));
            k = if k == first { NONE } else { self.before[k as usize] };
        }
        path.reverse();
    }
}

/// Places by cells of [`JOIN_M`], sorted.
struct Grid(Vec<((i64, i64), u32)>);

impl Grid {
    fn new(places: &[GroundPlace]) -> Self {
        let mut cells: Vec<_> = places.iter().enumerate().map(|(k, p)| (cell(p), k as u32)).collect();
        cells.sort_unstable();
        Self(cells)
    }

    /// Calls `f` for all places in a place's cell and the eight round it.
    fn near(&self, place: &GroundPlace, mut f: impl FnMut(usize)) {
        let (row, column) = cell(place);
        for row in [row.saturating_sub(1), row, row.saturating_add(1)] {
            let first = self.0.partition_point(|c| c.0 < (row, column.saturating_sub(1)));
            let cells = self.0[first..].iter();
            cells.take_while(|c| c.0 <= (row, column.saturating_add(1))).for_each(|c| f(c.1 as usize));
        }
    }
}

fn cell(p: &GroundPlace) -> (i64, i64) {
    ((p.y_m / JOIN_M).floor() as i64, (p.x_m / JOIN_M).floor() as i64)
}

fn distance_m(a: &GroundPlace, b: &GroundPlace) -> f64 {
    (a.x_m - b.x_m).hypot(a.y_m - b.y_m)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(x_m: f64, y_m: f64, path_m: f64) -> GroundPlace {
        GroundPlace { x_m, y_m, yaw_rad: 0.0, path_m }
    }

    #[test]
    fn a_way_keeps_to_what_was_driven_and_takes_short_cuts() {
        // Up one aisle, over, and down another, 6 m apart; then a pass beside the first aisle.
        let mut places: Vec<GroundPlace> = (0..=20).map(|k| at(f64::from(k), 0.0, f64::from(k))).collect();
        places.extend((1..=6).map(|k| at(20.0, f64::from(k), 20.0 + f64::from(k))));
        places.extend((1..=20).map(|k| at(20.0 - f64::from(k), 6.0, 26.0 + f64::from(k))));
        let mut path = Vec::new();
        let ways = Ways::new(&places, 0);
        ways.path(&places, 0, 46, &mut path);
        assert_eq!((path.len(), path[0], path[20]), (47, (0.0, 0.0), (20.0, 0.0)), "not through the wall");
        assert_eq!((ways.walk_m(46), ways.onset(46)), (Some(46.0), 3));
        // From where it comes within 2 m of the corner.
        let first = ways.first_near(&places, |p| (p.x_m - 20.0).hypot(p.y_m) - 2.0);
        assert_eq!((first[46], first[10]), (17, NONE));
        ways.path(&places, first[30], 30, &mut path);
        assert_eq!((path.len(), path[0]), (14, (17.0, 0.0)));
        places.extend((1..=6).map(|k| at(0.0, 6.0 - f64::from(k), 46.0 + f64::from(k))));
        assert!(Ways::new(&places, 0).walk_m(46).unwrap() < 6.1, "the loop is closed");
    }

    #[test]
    fn nothing_is_found_beyond_a_gap() {
        let places = [at(0.0, 0.0, 0.0), at(1.0, 0.0, 1.0), at(80.0, 0.0, 2.0), at(f64::NAN, 0.0, 3.0)];
        let ways = Ways::new(&places, 0);
        assert_eq!((ways.walk_m(1), ways.walk_m(2), ways.walk_m(3)), (Some(1.0), None, None));
        let mut path = vec![(1.0, 1.0)];
        ways.path(&places, ways.first_near(&places, |_| -1.0)[2], 2, &mut path);
        assert!(path.is_empty());
    }
}
