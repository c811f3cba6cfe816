//! The outline of some cells: along their edges, then straightened.

use super::raster::Raster;
use std::collections::BTreeMap;

/// A corner that lies so near to the line without it goes.
const STRAIGHT_M: f64 = 0.12;

/// Outlines of a part.
pub struct Outline {
    /// Around all of it, counter-clockwise, map, metres.
    pub polygon_m: Vec<(f64, f64)>,
    /// Around what stands in it, clockwise.
    pub holes_m: Vec<Vec<(f64, f64)>>,
}

/// The outlines of cells that hang together; `is_in` tells them from others.
pub fn outline(raster: &Raster, cells: &[usize], is_in: &dyn Fn(usize) -> bool) -> Outline {
    // The largest goes around all of them.
    let mut loops = loops(raster, cells, is_in);
    loops.sort_by_key(|line| std::cmp::Reverse(doubled_area(line).abs()));
    let to_map = |corners: Vec<(i64, i64)>| {
        let metres = |(x, y): (i64, i64)| {
            (
                raster.corner_m.0 + x as f64 * raster.resolution_m,
                raster.corner_m.1 + y as f64 * raster.resolution_m,
            )
        };
        straightened(&corners.into_iter().map(metres).collect::<Vec<_>>())
    };
    let mut loops = loops.into_iter();
    let polygon_m = loops.next().map_or_else(Vec::new, to_map);
    Outline { polygon_m, holes_m: loops.map(to_map).filter(|hole| hole.len() > 2).collect() }
}

/// Closed lines along the edges of cells, cells to the left, by corners of the raster.
pub(super) fn loops(raster: &Raster, cells: &[usize], is_in: &dyn Fn(usize) -> bool) -> Vec<Vec<(i64, i64)>> {
    let width = raster.width as i64;
    let has = |x: i64, y: i64| {
        (0..width).contains(&x) && (0..raster.height as i64).contains(&y) && is_in((y * width + x) as usize)
    };
    // From each corner where edges go on; two at corners where cells touch.
    let mut edges: BTreeMap<(i64, i64), Vec<(i64, i64)>> = BTreeMap::new();
    for &cell in cells {
        let (x, y) = (cell as i64 % width, cell as i64 / width);
        let mut edge = |from: (i64, i64), to: (i64, i64)| edges.entry(from).or_default().push(to);
        if !has(x, y - 1) {
            edge((x, y), (x + 1, y));
        }
        if !has(x + 1, y) {
            edge((x + 1, y), (x + 1, y + 1));
        }
        if !has(x, y + 1) {
            edge((x + 1, y + 1), (x, y + 1));
        }
        if !has(x - 1, y) {
            edge((x, y + 1), (x, y));
        }
    }
    let mut all = Vec::new();
    while let Some((&start, _)) = edges.first_key_value() {
        let mut line = vec![start];
        let mut before = start;
        let mut at = start;
        while let Some(ways) = edges.get_mut(&at) {
            // Where cells touch at a corner the line turns right: they hang together there.
            let turn = |to: &(i64, i64)| {
                let (a, b) = ((at.0 - before.0, at.1 - before.1), (to.0 - at.0, to.1 - at.1));
                a.0 * b.1 - a.1 * b.0
            };
            let next = (0..ways.len()).min_by_key(|&k| turn(&ways[k])).unwrap_or(0);
            let to = ways.swap_remove(next);
            if ways.is_empty() {
                edges.remove(&at);
            }
            if to == start {
                break;
            }
            // Corners alone: what goes on straight is one edge.
            if turn(&to) == 0 && line.len() > 1 {
                line.pop();
            }
            (before, at) = (at, to);
            line.push(to);
        }
        all.push(line);
    }
    all
}

/// Twice the area that a closed line goes around, positive counter-clockwise.
pub(super) fn doubled_area(line: &[(i64, i64)]) -> i64 {
    (0..line.len()).map(|k| (line[k], line[(k + 1) % line.len()])).map(|(a, b)| a.0 * b.1 - a.1 * b.0).sum()
}

/// A closed line without the corners that say little (Douglas and Peucker 1973), from its two ends that lie farthest apart.
fn straightened(line: &[(f64, f64)]) -> Vec<(f64, f64)> {
    let far = |from: usize| {
        let apart = |k: &usize| (line[*k].0 - line[from].0).hypot(line[*k].1 - line[from].1);
        (0..line.len()).max_by(|a, b| apart(a).total_cmp(&apart(b))).unwrap_or(0)
    };
    if line.len() < 4 {
        return line.to_vec();
    }
    let (first, second) = (far(0), far(far(0)));
    let (first, second) = (first.min(second), first.max(second));
    let mut keep = vec![false; line.len()];
    let mut open = vec![(first, second), (second, first + line.len())];
    while let Some((from, to)) = open.pop() {
        keep[from % line.len()] = true;
        let (a, b) = (line[from % line.len()], line[to % line.len()]);
        let length_m = (b.0 - a.0).hypot(b.1 - a.1);
        let off_m = |k: usize| {
            let p = line[k % line.len()];
            let cross = (b.0 - a.0) * (p.1 - a.1) - (b.1 - a.1) * (p.0 - a.0);
            if length_m > 0.0 { cross.abs() / length_m } else { (p.0 - a.0).hypot(p.1 - a.1) }
        };
        let most = (from + 1..to).max_by(|&k, &l| off_m(k).total_cmp(&off_m(l)).then(l.cmp(&k)));
        if let Some(most) = most.filter(|&k| off_m(k) > STRAIGHT_M) {
            open.extend([(from, most), (most, to)]);
        }
    }
    (0..line.len()).filter(|&k| keep[k]).map(|k| line[k]).collect()
}
