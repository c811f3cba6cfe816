//! Regions: the parts of a map that people would call rooms, by the narrowings of its free space.
//!
//! ```text
//! places, poses ─ raster ─▶ free cells ─ clearance ─▶ distance to what stands there
//!               ─ basins ─▶ parts that narrowings part ─ outline ─▶ polygons, doorways
//! ```
//!
//! Clearance is highest in the midst of a room and has a saddle in each doorway. Two parts are one where the saddle
//! between them is nearly as wide as the narrower of them (a bend, a pillar), and no narrowing against the wider.

mod basins;
mod clearance;
pub mod occupancy;
mod outline;
mod raster;
#[cfg(test)]
mod tests;

use crate::edge::{PlaceId, Vertex};
use crate::geometry::Pose2;
use crate::graph::Place;
use std::sync::Arc;

/// A part of the map.
#[derive(Clone, Debug, PartialEq)]
pub struct Region {
    /// The id of its oldest place: of two that become one the lower stays.
    pub id: PlaceId,
    /// Places in it, oldest first; at least one.
    pub places: Vec<Vertex>,
    /// Its outline in the map, metres, counter-clockwise.
    pub polygon_m: Vec<(f64, f64)>,
    /// Outlines of what stands in it, clockwise.
    pub holes_m: Vec<Vec<(f64, f64)>>,
    /// Area of its free space, m².
    pub area_m2: f64,
    /// Where one goes into others.
    pub doorways: Vec<Doorway>,
    /// What kind of space it is by its shape.
    pub shape: Shape,
}

/// A narrowing between two regions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Doorway {
    /// Index of the region behind it.
    pub to: usize,
    /// Its middle in the map, metres.
    pub at_m: (f64, f64),
    /// How wide it is, metres.
    pub width_m: f64,
}

/// Kinds of space, by shape.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Shape {
    /// Long and narrow.
    Corridor,
    /// All others of up to [`HALL_M2`].
    Room,
    /// Larger.
    Hall,
}

/// A larger room is a hall.
const HALL_M2: f64 = 80.0;
/// A space so many times as long as it is wide is a corridor.
const CORRIDOR: f64 = 4.0;

/// The regions of a map that robots were in: of places with their poses in it, oldest first.
pub fn regions(places: &[(Pose2, Arc<Place>)]) -> Vec<Region> {
    let Some(raster) = raster::Raster::new(places) else { return Vec::new() };
    let clearance = clearance::clearance(&raster);
    let parts = basins::basins(&raster, &clearance);
    let mut within: Vec<Vec<Vertex>> = vec![Vec::new(); parts.cells.len()];
    for (v, (pose, _)) in places.iter().enumerate() {
        if let Some(part) = raster.near(pose.x_m, pose.y_m, |cell| parts.of[cell]) {
            within[part as usize].push(v as Vertex);
        }
    }
    // Those that were seen through a door alone are none yet.
    let mut index = vec![None; parts.cells.len()];
    for (n, part) in (0..parts.cells.len()).filter(|&part| !within[part].is_empty()).enumerate() {
        index[part] = Some(n);
    }
    (0..parts.cells.len())
        .filter(|&part| index[part].is_some())
        .map(|part| {
            let cells = &parts.cells[part];
            let outline = outline::outline(&raster, cells, &|cell| parts.of[cell] == Some(part as u32));
            let doorways = parts.saddles.iter().filter_map(|s| {
                let to = if s.of[0] == part as u32 {
                    s.of[1]
                } else if s.of[1] == part as u32 {
                    s.of[0]
                } else {
                    return None;
                };
                let width_m = 2.0 * f64::from(clearance[s.cell]);
                Some(Doorway { to: index[to as usize]?, at_m: raster.middle(s.cell), width_m })
            });
            let area_m2 = cells.len() as f64 * raster.resolution_m.powi(2);
            Region {
                id: places[within[part][0] as usize].1.id,
                places: std::mem::take(&mut within[part]),
                polygon_m: outline.polygon_m,
                holes_m: outline.holes_m,
                area_m2,
                doorways: doorways.collect(),
                shape: shape(area_m2, f64::from(parts.peak_m[part])),
            }
        })
        .collect()
}

/// `peak_m`: the widest clearance in it.
fn shape(area_m2: f64, peak_m: f64) -> Shape {
    let width_m = 2.0 * peak_m;
    if area_m2 > CORRIDOR * width_m * width_m {
        Shape::Corridor
    } else if area_m2 > HALL_M2 {
        Shape::Hall
    } else {
        Shape::Room
    }
}
