//! Soft colours of rooms, for the picture.

use embedded_graphics::pixelcolor::Rgb888;
use std::collections::BTreeMap;
use toponym_core::answers::query::Grid;
use toponym_proto::regions::Region;

/// Colours that letters and lines are legible on; neighbours have different ones as far as they go.
const SHADES: [Rgb888; 8] = [
    Rgb888::new(0xfd, 0xe9, 0xd9),
    Rgb888::new(0xdd, 0xee, 0xfb),
    Rgb888::new(0xe3, 0xf4, 0xde),
    Rgb888::new(0xf3, 0xe3, 0xf5),
    Rgb888::new(0xfd, 0xf6, 0xcc),
    Rgb888::new(0xd9, 0xf3, 0xf0),
    Rgb888::new(0xfb, 0xdf, 0xe4),
    Rgb888::new(0xe8, 0xe6, 0xe0),
];

/// The shade of each cell of a grid that lies in a region.
pub fn shades(grid: &Grid, regions: &[Region]) -> Vec<Option<Rgb888>> {
    let mut cells = vec![None; grid.cells.len()];
    let mut own: BTreeMap<u64, usize> = BTreeMap::new();
    for (k, region) in regions.iter().enumerate() {
        let near = |shade: &usize| region.doorways.iter().any(|d| own.get(&d.to) == Some(shade));
        let turn = (0..SHADES.len()).map(|n| (k + n) % SHADES.len());
        let shade = turn.clone().find(|shade| !near(shade)).unwrap_or(k % SHADES.len());
        own.insert(region.id, shade);
        fill(grid, region, SHADES[shade], &mut cells);
    }
    cells
}

/// Row by row, between every other crossing of its outlines.
fn fill(grid: &Grid, region: &Region, shade: Rgb888, cells: &mut [Option<Rgb888>]) {
    let grid_from_map = grid.map_from_grid.inverse();
    let to_cells = |line: &Vec<[f64; 2]>| -> Vec<(f64, f64)> {
        let to_cell = |p: &[f64; 2]| {
            let (x, y) = grid_from_map.apply(p[0], p[1]);
            (x / grid.resolution_m, y / grid.resolution_m)
        };
        line.iter().map(to_cell).collect()
    };
    let lines: Vec<_> = std::iter::once(&region.polygon_m).chain(&region.holes_m).map(to_cells).collect();
    let edges: Vec<((f64, f64), (f64, f64))> =
        lines.iter().flat_map(|l| (0..l.len()).map(|k| (l[k], l[(k + 1) % l.len()]))).collect();
    for row in 0..grid.height {
        let y = row as f64 + 0.5;
        let crosses = edges.iter().filter(|(a, b)| (a.1 > y) != (b.1 > y));
        let mut xs: Vec<f64> = crosses.map(|(a, b)| a.0 + (y - a.1) / (b.1 - a.1) * (b.0 - a.0)).collect();
        xs.sort_by(f64::total_cmp);
        for pair in xs.chunks_exact(2) {
            let column = |x: f64| ((x - 0.5).ceil().max(0.0) as usize).min(grid.width);
            cells[row * grid.width + column(pair[0])..row * grid.width + column(pair[1])].fill(Some(shade));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use toponym_core::Pose2;
    use toponym_proto::regions::Doorway;

    fn region(id: u64, corners: [(f64, f64); 2], to: u64) -> Region {
        let [(x0, y0), (x1, y1)] = corners;
        Region {
            id,
            kind: "room".into(),
            names: vec![],
            area_m2: 1.0,
            polygon_m: vec![[x0, y0], [x1, y0], [x1, y1], [x0, y1]],
            holes_m: vec![vec![[x0 + 1.0, y0 + 1.0], [x0 + 1.0, y0 + 2.0], [x0 + 2.0, y0 + 1.0]]],
            doorways: vec![Doorway { to, x_m: x1, y_m: y0, width_m: 1.0 }],
            places: vec![id],
        }
    }

    #[test]
    fn rooms_are_filled_up_to_their_outlines_and_neighbours_differ() {
        let grid = Grid {
            resolution_m: 0.5,
            width: 20,
            height: 10,
            map_from_grid: Pose2::new(-1.0, -1.0, 0.0),
            cells: vec![0; 200],
        };
        let regions = [region(5, [(0.0, 0.0), (4.0, 3.0)], 9), region(9, [(4.0, 0.0), (8.0, 3.0)], 5)];
        let shades = shades(&grid, &regions);
        let count = |shade: usize| shades.iter().filter(|s| **s == Some(SHADES[shade])).count();
        // 8 by 6 cells without the triangle of 2 by 2.
        assert_eq!((count(0), count(1)), (47, 47));
        assert_eq!(shades[2 * 20 + 2], Some(SHADES[0]));
        assert_eq!(shades[2 * 20 + 1], None);
    }
}
