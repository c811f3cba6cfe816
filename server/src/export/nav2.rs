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
    let shades = grid.cells.iter().map(|&cell| shade(cell));
    written(grid, ("trinary", 0.65, 0.196), ["map.yaml", "map.pgm"], &shades.collect::<Vec<_>>())
}

/// The same of values from 0 to 100, for costmap filters; in mode `scale` Nav2 reads just these.
pub fn picture(grid: &Grid, mode: &str, names: [&'static str; 2], values: &[u8]) -> [Content; 2] {
    let shade = |&value: &u8| (255.0 - 2.55 * f64::from(value)).round() as u8;
    let how = if mode == "scale" { (mode, 1.0, 0.0) } else { (mode, 0.65, 0.196) };
    written(grid, how, names, &values.iter().map(shade).collect::<Vec<_>>())
}

/// `how`: mode, and the thresholds of occupied and free.
fn written(
    grid: &Grid,
    (mode, occupied, free): (&str, f64, f64),
    [yaml, pgm]: [&'static str; 2],
    shades: &[u8],
) -> [Content; 2] {
    let origin = grid.map_from_grid;
    // Costmaps ignore a yaw: the grid has none.
    let how = format!(
        "image: {pgm}\nmode: {mode}\nresolution: {}\norigin: [{:.6}, {:.6}, 0.0]\nnegate: 0\n\
         occupied_thresh: {occupied}\nfree_thresh: {free}\n",
        grid.resolution_m, origin.x_m, origin.y_m
    );
    let mut picture = format!("P5\n{} {}\n255\n", grid.width, grid.height).into_bytes();
    // Pictures count rows downwards, grids upwards.
    picture.extend(shades.chunks_exact(grid.width.max(1)).rev().flatten());
    [(yaml, how.into_bytes()), (pgm, picture)]
}

fn shade(cell: i8) -> u8 {
    match cell {
        OCCUPIED.. => OCCUPIED_SHADE,
        0..FREE => FREE_SHADE,
        _ => UNKNOWN_SHADE,
    }
}
