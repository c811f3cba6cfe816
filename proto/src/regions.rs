//! Answer of `ask/regions`: the parts of a map that people would call rooms.

use crate::answer::MapIdentity;
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
