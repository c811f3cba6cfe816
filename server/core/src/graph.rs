//! What all particles share: places with their scans, the chain between them, and the memo of
//! what was matched. Append-only.

pub mod spread;
pub mod stretches;

use self::stretches::Stretches;
use crate::edge::{PlaceId, Vertex};
use crate::event::StampNs;
use crate::geometry::Pose2;
use crate::scan::enclosure::Enclosure;
use crate::scan::matching::Mode;
use crate::scan::place::Content;
use crate::track::places::{Chain, FrozenPlace};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::ops::Range;
use std::sync::Arc;

/// A place: where the robot was each metre of its path.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Place {
    /// Its id, never reused.
    pub id: PlaceId,
    /// Stamp of its first scan.
    pub stamp_ns: StampNs,
    /// Path travelled when it began, metres.
    pub path_m: f64,
    /// Its frame in the front end's; comparable within a segment.
    pub front_from_place: Pose2,
    /// Counts breaks of odometry.
    pub segment: u32,
    /// Edge from the place before.
    pub chain: Chain,
    /// What it looks like.
    pub content: Content,
    /// How far its room reaches.
    pub enclosure: Enclosure,
}

/// What matching a pair of places found.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Matched {
    /// Modes, best first.
    pub modes: Vec<Mode>,
}

/// The shared layer.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct Graph {
    places: Vec<Arc<Place>>,
    /// Stretches that part the map.
    pub stretches: Stretches,
    /// Prior-free matches by pair (older, newer).
    pub memo: BTreeMap<(Vertex, Vertex), Matched>,
}

impl Graph {
    /// Adds a vertex and returns its index.
    pub fn add(&mut self, frozen: FrozenPlace) -> Vertex {
        let segment = self.places.last().map_or(0, |p| p.segment + u32::from(frozen.open.chain.broken));
        if let Some(before) = self.places.last() {
            let path_m = frozen.open.path_m - before.path_m;
            self.stretches.extend(self.places.len() as Vertex, &frozen.open.chain, path_m);
        }
        self.places.push(Arc::new(Place {
            id: frozen.open.id,
            stamp_ns: frozen.open.stamp_ns,
            path_m: frozen.open.path_m,
            front_from_place: frozen.open.front_from_place,
            segment,
            chain: frozen.open.chain,
            enclosure: Enclosure::of(&frozen.content),
            content: frozen.content,
        }));
        (self.places.len() - 1) as Vertex
    }

    /// All places, oldest first.
    pub fn places(&self) -> &[Arc<Place>] {
        &self.places
    }

    /// One place. Indexes like a slice.
    pub fn place(&self, v: Vertex) -> &Place {
        &self.places[v as usize]
    }

    /// Vertices of the same segment within `reach_m` of path, a contiguous range.
    pub fn along(&self, v: Vertex, reach_m: f64) -> Range<Vertex> {
        let here = self.place(v);
        let near = |p: &Place| p.segment == here.segment && (p.path_m - here.path_m).abs() <= reach_m;
        let mut first = v;
        while first > 0 && near(self.place(first - 1)) {
            first -= 1;
        }
        let mut end = v + 1;
        while (end as usize) < self.places.len() && near(self.place(end)) {
            end += 1;
        }
        first..end
    }

    /// `a_from_b` by the front end; good over a few metres of one segment.
    pub fn chained(&self, a: Vertex, b: Vertex) -> Pose2 {
        self.place(a).front_from_place.between(&self.place(b).front_from_place)
    }

    /// Whether two places are so far apart along the path that scans tying them are news.
    pub fn apart(&self, a: Vertex, b: Vertex, path_m: f64) -> bool {
        let (a, b) = (self.place(a), self.place(b));
        a.segment != b.segment || (a.path_m - b.path_m).abs() > path_m
    }

    /// Makes the front end doubt the edge to a place.
    #[cfg(test)]
    pub(crate) fn doubt(&mut self, v: Vertex, failed: f64) {
        Arc::make_mut(&mut self.places[v as usize]).chain.failed = failed;
    }
}
