//! `--regions`: the map's rooms as JSON, in the trajectory's frame.

use serde::Serialize;
use std::collections::BTreeMap;
use toponym_core::Snapshot;
use toponym_core::edge::PlaceId;
use toponym_core::regions::Shape;

/// A region as it is written.
#[derive(Serialize)]
pub struct RegionEntry {
    /// The id of its oldest place.
    id: PlaceId,
    kind: &'static str,
    /// Each name with the probability that it applies somewhere in it, likeliest first.
    names: Vec<(String, f64)>,
    area_m2: f64,
    polygon_m: Vec<[f64; 2]>,
    holes_m: Vec<Vec<[f64; 2]>>,
    doorways: Vec<DoorwayEntry>,
}

/// A doorway as it is written.
#[derive(Serialize)]
struct DoorwayEntry {
    to: PlaceId,
    x_m: f64,
    y_m: f64,
    width_m: f64,
}

/// All regions of a map.
pub fn entries(snapshot: &Snapshot) -> Vec<RegionEntry> {
    let regions = snapshot.regions();
    let labels: Vec<(PlaceId, Vec<(String, f64)>)> =
        snapshot.graph().places.into_iter().map(|p| (p.id, p.labels)).collect();
    let id = |k: usize| labels[regions[k].places[0] as usize].0;
    let millimetres = |m: f64| (m * 1000.0).round() / 1000.0;
    let line = |line: &[(f64, f64)]| line.iter().map(|p| [millimetres(p.0), millimetres(p.1)]).collect();
    let entry = |k: usize| {
        let region = &regions[k];
        let mut names: BTreeMap<&str, f64> = BTreeMap::new();
        for (name, p) in region.places.iter().flat_map(|&v| &labels[v as usize].1) {
            let most = names.entry(name).or_insert(0.0);
            *most = most.max(*p);
        }
        let mut names: Vec<(String, f64)> = names.into_iter().map(|(name, p)| (name.to_owned(), p)).collect();
        names.sort_by(|a, b| b.1.total_cmp(&a.1).then_with(|| a.0.cmp(&b.0)));
        let doorway = |d: &toponym_core::regions::Doorway| DoorwayEntry {
            to: id(d.to),
            x_m: millimetres(d.at_m.0),
            y_m: millimetres(d.at_m.1),
            width_m: millimetres(d.width_m),
        };
        RegionEntry {
            id: id(k),
            kind: match region.shape {
                Shape::Corridor => "corridor",
                Shape::Room => "room",
                Shape::Hall => "hall",
            },
            names,
            area_m2: millimetres(region.area_m2),
            polygon_m: line(&region.polygon_m),
            holes_m: region.holes_m.iter().map(|hole| line(hole)).collect(),
            doorways: region.doorways.iter().map(doorway).collect(),
        }
    };
    (0..regions.len()).map(entry).collect()
}
