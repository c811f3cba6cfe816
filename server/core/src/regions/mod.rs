//! Regions: the parts of a map that people would call rooms, by the narrowings of its free space.
//!
//! ```text
//! places, poses ─ occupancy ─▶ counts ─ raster ─▶ free cells ─ clearance ─▶ distance to what stands there
//!               ─ basins ─▶ parts that narrowings part ─ niches ─▶ with their corners ─ outline ─▶ polygons, doorways
//! ```
//!
//! Clearance is highest in the midst of a room and has a saddle in each doorway. Two parts are one where the saddle
//! between them is nearly as wide as the narrower of them (a bend, a pillar), and no narrowing against the wider.

mod basins;
mod clearance;
mod niches;
pub mod occupancy;
mod outline;
mod raster;
mod reach;
#[cfg(test)]
mod tests;
mod tiles;

use self::basins::{Parts, Saddle};
use self::occupancy::Plot;
use self::raster::Raster;
pub use self::reach::{FOOTPRINT_M, Goal};
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
    /// Mean of its free space in the map, metres: of a bent one it may lie outside.
    pub middle_m: (f64, f64),
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

/// What was seen and not entered counts from this size on: smaller ones are niches.
const UNENTERED_MIN_M2: f64 = 1.5;
/// A larger room is a hall.
const HALL_M2: f64 = 80.0;
/// A space so many times as long as it is wide is a corridor.
const CORRIDOR: f64 = 4.0;

/// The regions of a map that robots were in, and what lies between and beside them.
#[derive(Clone, Debug, Default)]
pub struct Rooms {
    /// The regions.
    pub regions: Vec<Region>,
    /// Openings from a region, by its index, into what was seen and not entered; map, metres.
    pub unentered: Vec<(usize, (f64, f64))>,
    floor: Option<Floor>,
}

/// The cells that regions are made of.
#[derive(Clone, Debug)]
struct Floor {
    raster: Raster,
    /// Metres to what is not free.
    clearance: Vec<f32>,
    /// The region of each cell.
    of: Vec<Option<u32>>,
    /// The cells of each region.
    cells: Vec<Vec<usize>>,
    /// See [`reach`].
    drivable: Vec<Option<u32>>,
}

impl Rooms {
    /// Of places with their poses in the map, oldest first; `plot` is of these or of others, best of nearly the same. No way
    /// leads through what is `forbidden`: polygons in the map, metres.
    pub fn new(plot: &mut Plot, places: &[(Pose2, Arc<Place>)], forbidden: &[Vec<(f64, f64)>]) -> Self {
        plot.follow(places);
        let Some(raster) = Raster::new(plot) else { return Self::default() };
        let clearance = clearance::clearance(&raster);
        let mut parts = basins::basins(&raster, &clearance);
        let mut within: Vec<Vec<Vertex>> = vec![Vec::new(); parts.cells.len()];
        for (v, (pose, _)) in places.iter().enumerate() {
            if let Some(part) = raster.near(pose.x_m, pose.y_m, |cell| parts.of[cell]) {
                within[part as usize].push(v as Vertex);
            }
        }
        niches::take_up_niches(&raster, &mut parts, &|part| !within[part as usize].is_empty());
        // Those that were seen through a door alone are none yet.
        let mut index = vec![None; parts.cells.len()];
        for (n, part) in (0..parts.cells.len()).filter(|&part| !within[part].is_empty()).enumerate() {
            index[part] = Some(n);
        }
        let mut regions = Vec::new();
        for part in (0..parts.cells.len()).filter(|&part| index[part].is_some()) {
            let oldest = places[within[part][0] as usize].1.id;
            let doorways = doorways(&raster, &clearance, &parts.saddles, &index, part as u32);
            regions.push(region(
                &raster,
                &parts,
                part,
                (oldest, std::mem::take(&mut within[part])),
                doorways,
            ));
        }
        let least = (UNENTERED_MIN_M2 / raster.resolution_m.powi(2)) as usize;
        let beyond = |from: u32, to: u32, cell: usize| {
            let is_unentered = index[to as usize].is_none() && parts.cells[to as usize].len() >= least;
            Some((index[from as usize].filter(|_| is_unentered)?, raster.middle(cell)))
        };
        let both = |s: &Saddle| [beyond(s.of[0], s.of[1], s.cell), beyond(s.of[1], s.of[0], s.cell)];
        let unentered = parts.saddles.iter().flat_map(both).flatten().collect();
        for part in &mut parts.of {
            *part = part.and_then(|part| index[part as usize]).map(|n| n as u32);
        }
        let entered = (0..index.len()).filter(|&part| index[part].is_some());
        let cells = entered.map(|part| std::mem::take(&mut parts.cells[part])).collect();
        let drivable = reach::drivable(&raster, &clearance, places, forbidden);
        let floor = Floor { raster, clearance, of: parts.of, cells, drivable };
        Self { regions, unentered, floor: Some(floor) }
    }

    /// What to keep from one map to the next: of nothing yet.
    pub fn plot() -> Plot {
        Plot::new(raster::RESOLUTION_M)
    }

    /// Regions drawn by hand, without their cells.
    #[cfg(test)]
    pub(crate) fn drawn(regions: Vec<Region>) -> Self {
        Self { regions, ..Self::default() }
    }

    /// The region in which a point of the map lies, or that is next to it.
    pub fn at(&self, x_m: f64, y_m: f64) -> Option<usize> {
        let floor = self.floor.as_ref()?;
        floor.raster.near(x_m, y_m, |cell| floor.of[cell]).map(|n| n as usize)
    }
}

/// Index of its own, and of those of its saddles behind which there is another region.
fn doorways(
    raster: &Raster,
    clearance: &[f32],
    saddles: &[Saddle],
    index: &[Option<usize>],
    part: u32,
) -> Vec<Doorway> {
    let behind = |s: &Saddle| match s.of {
        [a, b] if a == part => Some(b),
        [a, b] if b == part => Some(a),
        _ => None,
    };
    let doorway = |s: &Saddle| {
        let width_m = 2.0 * f64::from(clearance[s.cell]);
        Some(Doorway { to: index[behind(s)? as usize]?, at_m: raster.middle(s.cell), width_m })
    };
    saddles.iter().filter_map(doorway).collect()
}

fn region(
    raster: &Raster,
    parts: &Parts,
    part: usize,
    (id, places): (PlaceId, Vec<Vertex>),
    doorways: Vec<Doorway>,
) -> Region {
    let cells = &parts.cells[part];
    let outline = outline::outline(raster, cells, &|cell| parts.of[cell] == Some(part as u32));
    let area_m2 = cells.len() as f64 * raster.resolution_m.powi(2);
    let middle = |axis: fn((f64, f64)) -> f64| {
        cells.iter().map(|&c| axis(raster.middle(c))).sum::<f64>() / cells.len() as f64
    };
    Region {
        id,
        places,
        polygon_m: outline.polygon_m,
        holes_m: outline.holes_m,
        middle_m: (middle(|p| p.0), middle(|p| p.1)),
        area_m2,
        doorways,
        shape: shape(area_m2, f64::from(parts.peak_m[part])),
    }
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
