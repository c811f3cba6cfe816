//! Answers of `ask/regions`, the parts of a map that people would call rooms, of `ask/what` and `ask/labels`.

use crate::answer::MapIdentity;
use crate::stream::Stamp;
use serde::{Deserialize, Serialize};

/// All regions of the best graph that the robot was in.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RegionsReply {
    /// [`crate::answer::ANSWER_VERSION`].
    pub v: u32,
    /// `regions`.
    pub query: String,
    /// Of which map.
    pub map: MapIdentity,
    /// In the order of their ids.
    pub regions: Vec<Region>,
    /// What was drawn at a desk and stands, oldest first.
    #[serde(default)]
    pub areas: Vec<Area>,
}

/// An area that somebody drew: `do/area`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Area {
    /// By which `do/undo` takes it back.
    pub id: String,
    /// What it is called.
    pub name: Option<String>,
    /// Whether robots keep out.
    pub forbidden: bool,
    /// Its corners in the map.
    pub polygon_m: Vec<[f64; 2]>,
}

/// A part of the map between narrowings of its free space.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Region {
    /// The id of its oldest place: of two that become one the lower stays.
    pub id: u64,
    /// By its shape: `corridor`, `room`, or, of more than 80 m², `hall`.
    pub kind: String,
    /// What it may be called, likeliest first.
    pub names: Vec<RegionName>,
    /// Area of its free space.
    pub area_m2: f64,
    /// Its outline in the map, counter-clockwise.
    pub polygon_m: Vec<[f64; 2]>,
    /// Outlines of what stands in it, clockwise.
    pub holes_m: Vec<Vec<[f64; 2]>>,
    /// Where it opens into others.
    pub doorways: Vec<Doorway>,
    /// Places in it, oldest first.
    pub places: Vec<u64>,
}

impl Region {
    /// Outline and holes as one line that goes to each hole and back: what it surrounds, by how often a ray crosses it, is the
    /// region without its holes.
    pub fn line_m(&self) -> Vec<[f64; 2]> {
        let closed = |line: &[[f64; 2]]| line.iter().chain(line.first()).copied().collect::<Vec<_>>();
        let mut whole = self.polygon_m.clone();
        for hole in &self.holes_m {
            whole.extend(self.polygon_m.first().filter(|first| whole.last() != Some(first)));
            whole.extend(closed(hole));
            whole.extend(self.polygon_m.first());
        }
        whole
    }
}

/// A name of a region.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RegionName {
    /// As the map knows it.
    pub label: String,
    /// Probability that it applies to a place in the region.
    pub p: f64,
}

/// A narrowing between two regions.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Doorway {
    /// Id of the region behind it.
    pub to: u64,
    /// Its middle in the map.
    pub x_m: f64,
    /// See `x_m`.
    pub y_m: f64,
    /// How wide it is.
    pub width_m: f64,
}

/// Answer of `ask/what`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct WhatReply {
    /// [`crate::answer::ANSWER_VERSION`].
    pub v: u32,
    /// `what`.
    pub query: String,
    /// Of which map.
    pub map: MapIdentity,
    /// Stamp of the newest message in the answer's map.
    pub stamp: Stamp,
    /// The point asked for, or where the robot is: metres, map frame.
    pub x_m: f64,
    /// See `x_m`.
    pub y_m: f64,
    /// Id of the region in which it lies; none if in none.
    pub region: Option<u64>,
    /// What kind of space that is by its shape: `corridor`, `room`, `hall`.
    pub kind: Option<String>,
    /// What it may be called, likeliest first.
    pub names: Vec<Called>,
    /// Posterior mass of graphs that were dropped.
    #[serde(default)]
    pub unresolved: f64,
}

/// A name that may apply.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Called {
    /// As the map knows it.
    pub label: String,
    /// As a guide spells it.
    pub shown: String,
    /// Probability that it applies.
    pub p: f64,
}

/// Answer of `ask/labels`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct LabelsReply {
    /// [`crate::answer::ANSWER_VERSION`].
    pub v: u32,
    /// `labels`.
    pub query: String,
    /// Of which map.
    pub map: MapIdentity,
    /// All names taught.
    pub labels: Vec<LabelEntry>,
}

/// A name.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct LabelEntry {
    /// The name.
    pub label: String,
    /// The same as a guide spells it.
    #[serde(default)]
    pub shown: String,
    /// Utterances that spoke of it.
    pub utterances: u64,
    /// Region that most likely bears it.
    pub region: u64,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_corridor_goes_round_is_not_in_it() {
        let square = |low: f64, high: f64| vec![[low, low], [high, low], [high, high], [low, high]];
        let region = Region {
            id: 0,
            kind: "corridor".into(),
            names: vec![],
            area_m2: 64.0,
            polygon_m: square(0.0, 10.0),
            holes_m: vec![square(2.0, 4.0), square(6.0, 8.0)],
            doorways: vec![],
            places: vec![],
        };
        let line = region.line_m();
        // As `toponym_core::geometry::is_inside`.
        let is_inside = |x: f64, y: f64| {
            let next = line.iter().skip(1).chain(line.first());
            let crosses = |(a, b): &(&[f64; 2], &[f64; 2])| {
                (a[1] > y) != (b[1] > y) && x < a[0] + (y - a[1]) / (b[1] - a[1]) * (b[0] - a[0])
            };
            line.iter().zip(next).filter(crosses).count() % 2 == 1
        };
        for (x, y, inside) in [
            (1.0, 5.0, true),
            (5.0, 5.3, true),
            (3.0, 3.1, false),
            (7.0, 7.1, false),
            (9.0, 3.0, true),
            (11.0, 1.0, false),
        ] {
            assert_eq!(is_inside(x, y), inside, "{x} {y}");
        }
    }
}
