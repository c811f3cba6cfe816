//! Corners of rooms behind furniture: parts that nobody entered and that make the room beside them more convex.
//!
//! A room that is seen through its door makes the one that it is seen from less convex.

use super::basins::Parts;
use super::raster::Raster;
use std::collections::BTreeSet;

/// A niche has no larger a share of its room.
const SHARE_MAX: f64 = 0.4;

/// Gives parts that are niches of the only part that they open into to that.
pub fn take_up_niches(raster: &Raster, parts: &mut Parts, is_entered: &dyn Fn(u32) -> bool) {
    for niche in (0..parts.cells.len() as u32).filter(|&part| !is_entered(part)) {
        let beside: BTreeSet<u32> =
            parts.saddles.iter().filter(|s| s.of.contains(&niche)).flat_map(|s| s.of).collect();
        let mut others = beside.into_iter().filter(|&part| part != niche);
        let (Some(room), None) = (others.next(), others.next()) else { continue };
        let [own, its] = [niche, room].map(|part| &parts.cells[part as usize]);
        if !is_entered(room) || own.len() as f64 > SHARE_MAX * its.len() as f64 {
            continue;
        }
        let both: Vec<usize> = its.iter().chain(own).copied().collect();
        if solidity(raster, &both) < solidity(raster, its) {
            continue;
        }
        for &cell in own {
            parts.of[cell] = Some(room);
        }
        parts.cells[niche as usize].clear();
        parts.cells[room as usize] = both;
        parts.cells[room as usize].sort_unstable();
        parts.saddles.retain(|s| !s.of.contains(&niche));
    }
}

/// Share of their convex hull that cells fill.
fn solidity(raster: &Raster, cells: &[usize]) -> f64 {
    // Of each row the ends alone can be corners of the hull.
    let mut rows: Vec<Option<(i64, i64)>> = vec![None; raster.height];
    for &cell in cells {
        let (x, row) = ((cell % raster.width) as i64, &mut rows[cell / raster.width]);
        *row = Some(row.map_or((x, x + 1), |(low, high)| (low.min(x), high.max(x + 1))));
    }
    let ends = |(y, row): (usize, &Option<(i64, i64)>)| row.map(|(low, high)| (y as i64, low, high));
    let rows: Vec<(i64, i64, i64)> = rows.iter().enumerate().filter_map(ends).collect();
    let corners = |of: fn(&(i64, i64, i64)) -> i64| {
        rows.iter().flat_map(move |row| [(of(row), row.0), (of(row), row.0 + 1)])
    };
    let mut hull = chain(corners(|row| row.2));
    let mut left: Vec<(i64, i64)> = corners(|row| row.1).collect();
    left.reverse();
    hull.extend(chain(left.into_iter()));
    let doubled: i64 = (0..hull.len())
        .map(|k| (hull[k], hull[(k + 1) % hull.len()]))
        .map(|(a, b)| a.0 * b.1 - b.0 * a.1)
        .sum();
    2.0 * cells.len() as f64 / doubled.max(1) as f64
}

/// Those of points that turn left only, from first to last (Andrew 1979, "Another efficient algorithm for convex hulls
/// in two dimensions").
fn chain(points: impl Iterator<Item = (i64, i64)>) -> Vec<(i64, i64)> {
    let mut hull: Vec<(i64, i64)> = Vec::new();
    for p in points {
        while let [.., a, b] = hull[..] {
            if (b.0 - a.0) * (p.1 - a.1) - (b.1 - a.1) * (p.0 - a.0) > 0 {
                break;
            }
            hull.pop();
        }
        hull.push(p);
    }
    hull
}

#[cfg(test)]
mod tests {
    use super::super::tests::{parts, raster};
    use super::*;

    #[test]
    fn what_is_convex_fills_its_hull() {
        let solid = |rooms: &[(usize, usize, usize, usize)]| {
            let raster = raster(60, 60, rooms);
            let cells: Vec<usize> = (0..3600).filter(|&c| raster.free[c]).collect();
            solidity(&raster, &cells)
        };
        assert!((solid(&[(3, 4, 20, 10)]) - 1.0).abs() < 1e-9);
        // An L of three squares: 3 of 3.5.
        assert!((solid(&[(0, 0, 20, 10), (0, 10, 10, 10)]) - 3.0 / 3.5).abs() < 1e-9);
    }

    #[test]
    fn a_corner_behind_a_desk_is_its_rooms_and_a_room_behind_a_door_is_not() {
        // A room of 5 m by 5 m whose corner, 2 m by 2 m, is behind a desk with a gap, and one behind a door.
        let mut raster = raster(120, 60, &[(4, 4, 50, 50), (56, 20, 25, 14), (54, 25, 2, 8)]);
        for k in 0..22 {
            raster.free[(32 + k) * 120 + 32] = k >= 17 && raster.free[(32 + k) * 120 + 32];
            raster.free[32 * 120 + 32 + k] = false;
        }
        let (mut parts, _) = parts(&raster);
        let at = |parts: &Parts, x: usize, y: usize| parts.of[y * 120 + x].unwrap();
        let (room, corner, behind) = (at(&parts, 20, 20), at(&parts, 45, 42), at(&parts, 75, 28));
        assert!(room != corner && room != behind && corner != behind);
        take_up_niches(&raster, &mut parts, &|part| part == room);
        assert_eq!((at(&parts, 45, 42), at(&parts, 75, 28)), (room, behind));
        assert_eq!(parts.saddles.len(), 1);
        assert!(parts.cells[corner as usize].is_empty() && parts.cells[room as usize].is_sorted());
    }
}
