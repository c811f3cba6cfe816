//! Nav2's map: a picture and how to read it (`nav2_map_server`, `map_io.cpp`).

use super::Content;
use toponym_core::answers::query::Grid;

/// From such a percentage on something stands there, …
const OCCUPIED: i8 = 65;
/// … and below such a one nothing does; between, nobody knows.
const FREE: i8 = 50;
/// Shades: of 205 Nav2 makes p = 50 / 255 = 0.196, just above the threshold below, as its own saver does: unknown.
const UNKNOWN_SHADE: u8 = 205;
const OCCUPIED_SHADE: u8 = 0;
const FREE_SHADE: u8 = 254;

/// `map.yaml` and `map.pgm`.
pub fn files(grid: &Grid) -> [Content; 2] {
    let origin = grid.map_from_grid;
    // Costmaps ignore a yaw: the grid has none.
    let yaml = format!(
        "image: map.pgm\nmode: trinary\nresolution: {}\norigin: [{:.6}, {:.6}, 0.0]\nnegate: 0\noccupied_thresh: 0.65\n\
         free_thresh: 0.196\n",
        grid.resolution_m, origin.x_m, origin.y_m
    );
    let mut pgm = format!("P5\n{} {}\n255\n", grid.width, grid.height).into_bytes();
    // Pictures count rows downwards, grids upwards.
    for row in grid.cells.chunks_exact(grid.width.max(1)).rev() {
        pgm.extend(row.iter().map(|&cell| shade(cell)));
    }
    [("map.yaml", yaml.into_bytes()), ("map.pgm", pgm)]
}

fn shade(cell: i8) -> u8 {
    match cell {
        OCCUPIED.. => OCCUPIED_SHADE,
        0..FREE => FREE_SHADE,
        _ => UNKNOWN_SHADE,
    }
}
