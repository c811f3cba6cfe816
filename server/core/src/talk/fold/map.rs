//! One particle's map as what is said of it needs it.

use crate::edge::Vertex;
use crate::filter::floors::Floors;
use crate::filter::naming::{REACH_M, Site};
use crate::filter::particle::Particle;
use crate::graph::Graph;
use crate::talk::Talk;

/// Places so far back along the path are no visit before.
pub(super) const VISITED_BACK: Vertex = 12;
/// Two successive places are hardly farther apart.
const SPACING_MAX_M: f64 = 2.0;

/// One particle's map.
pub(super) struct Map<'a> {
    talk: &'a Talk,
    graph: &'a Graph,
    pub floors: Floors,
    pub particle: &'a Particle,
}

impl<'a> Map<'a> {
    pub(super) fn new(talk: &'a Talk, graph: &'a Graph, particle: &'a Particle) -> Self {
        Self { talk, graph, floors: Floors::of(&graph.stretches.vague(), particle), particle }
    }

    /// A place in it.
    pub(super) fn site(&self, v: Vertex) -> Option<Site<'a>> {
        let (told, floors) = (&self.talk.testimonies, &self.floors);
        let part = told.part(self.particle, &floors.ends, v);
        Some(Site {
            pose: told.pose(self.particle, v)?,
            floor: floors.floor(part),
            dark: told.is_dark(v),
            drift_m2: floors.drift_m2[part.min(floors.ends.len())],
            enclosure: self.graph.places().get(v as usize).map(|place| &place.enclosure),
        })
    }

    /// How near the path came before on the same floor, up to some metres before the place. Far stretches are
    /// skipped: a path is no shorter than the straight line.
    pub(super) fn nearest_m(&self, place: Vertex, here: &Site) -> f64 {
        let Self { particle: Particle { belief, .. }, floors, .. } = self;
        let end = place.saturating_sub(VISITED_BACK).min(belief.len() as Vertex);
        let (mut v, mut nearest_m) = (0, f64::INFINITY);
        while v < end {
            let part = floors.part(v);
            if floors.floor(part) != here.floor {
                v = floors.ends.get(part).map_or(end, |&next| next);
                continue;
            }
            let distance_m = belief.pose(v).distance_m(&here.pose);
            nearest_m = nearest_m.min(distance_m);
            v += (((distance_m - nearest_m.min(REACH_M)) / SPACING_MAX_M) as Vertex).max(1);
        }
        nearest_m
    }
}
