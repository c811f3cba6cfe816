//! Where a robot can stand, and whether it can drive there: cells with room around them, and how they hang together.

use super::raster::Raster;
use super::{Floor, Rooms};
use crate::geometry::{Pose2, is_near};
use crate::graph::Place;
use serde::{Deserialize, Serialize};
use std::cmp::Reverse;
use std::collections::BinaryHeap;
use std::sync::Arc;

/// A robot is no wider than this from its middle.
pub const FOOTPRINT_M: f64 = 0.3;
/// Room to spare where it is to stand.
const SPARE_M: f64 = 0.1;
/// Where it drove it can drive again, however near the walls.
const DRIVEN_M: f64 = 0.1;
/// A step to a cell beside, and to one at a corner.
const STRAIGHT: u32 = 70;
const ASLANT: u32 = 99;
/// Places further apart were not driven between as the crow flies.
const STRIDE_MAX_M: f64 = 2.0;

/// A pose to send a robot to.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Goal {
    /// In the map; it looks into the room from its nearest doorway.
    pub pose: Pose2,
    /// Whether there is a way over known free space; none if nobody knows from where.
    pub is_reachable: Option<bool>,
}

/// By cell, the number of the part of the floor that a robot can drive about in; none: it can't stand there.
pub(super) fn drivable(
    raster: &Raster,
    clearance: &[f32],
    places: &[(Pose2, Arc<Place>)],
    forbidden: &[Vec<(f64, f64)>],
) -> Vec<Option<u32>> {
    let mut open: Vec<bool> = clearance.iter().map(|&m| f64::from(m) >= FOOTPRINT_M).collect();
    for pair in places.windows(2).filter(|p| p[0].1.segment == p[1].1.segment) {
        let (a, b) = (pair[0].0, pair[1].0);
        let way_m = a.distance_m(&b);
        let steps = (way_m / raster.resolution_m).ceil().max(1.0);
        for k in (0..=steps as usize).filter(|_| way_m <= STRIDE_MAX_M) {
            let share = k as f64 / steps;
            let at = (a.x_m + share * (b.x_m - a.x_m), a.y_m + share * (b.y_m - a.y_m));
            for cell in raster.around(at.0, at.1, DRIVEN_M) {
                open[cell] |= raster.free[cell];
            }
        }
    }
    // No part of a robot is to be in them.
    for area in forbidden {
        let reach = |coordinate: fn(&(f64, f64)) -> f64| {
            let all = || area.iter().map(coordinate);
            all().fold(f64::INFINITY, f64::min) - FOOTPRINT_M
                ..=all().fold(f64::NEG_INFINITY, f64::max) + FOOTPRINT_M
        };
        let (columns, rows) = (reach(|p| p.0), reach(|p| p.1));
        for (cell, open) in open.iter_mut().enumerate().filter(|(_, open)| **open) {
            let (x, y) = raster.middle(cell);
            let may_be = columns.contains(&x) && rows.contains(&y);
            *open = !(may_be && is_near(area, (x, y), FOOTPRINT_M));
        }
    }
    let mut part = vec![None; open.len()];
    let mut parts = 0;
    for first in 0..open.len() {
        if !open[first] || part[first].is_some() {
            continue;
        }
        part[first] = Some(parts);
        let mut ahead = vec![first];
        while let Some(cell) = ahead.pop() {
            for next in raster.beside(cell, false).filter(|&next| open[next]) {
                if part[next].is_none() {
                    part[next] = Some(parts);
                    ahead.push(next);
                }
            }
        }
        parts += 1;
    }
    part
}

impl Rooms {
    /// How far a point is from what stands there or is not known, metres; 0 where nothing is free.
    pub fn clearance_m(&self, x_m: f64, y_m: f64) -> f64 {
        let Some(floor) = &self.floor else { return 0.0 };
        floor.raster.cell(x_m, y_m).map_or(0.0, |cell| floor.clearance[cell].into())
    }

    /// Where to stand in a region, as near as can be to a point, for who comes from another; none if there is no room.
    pub fn goal(&self, region: usize, near: (f64, f64), from: Option<(f64, f64)>) -> Option<Goal> {
        let floor = self.floor.as_ref()?;
        let here = from.and_then(|(x, y)| floor.raster.near(x, y, |cell| floor.drivable[cell]));
        let stands = |spare_m: f64, within: Option<u32>| {
            floor.nearest(region, near, |cell| {
                f64::from(floor.clearance[cell]) >= FOOTPRINT_M + spare_m
                    && floor.drivable[cell].is_some()
                    && (within.is_none() || floor.drivable[cell] == within)
            })
        };
        let tried = [(SPARE_M, here), (0.0, here), (SPARE_M, None), (0.0, None)];
        let at = tried.into_iter().find_map(|(spare_m, within)| stands(spare_m, within))?;
        let door = self.regions[region].doorways.iter().map(|d| d.at_m);
        let far_m = |p: &(f64, f64)| (p.0 - at.1.0).hypot(p.1 - at.1.1);
        let door = door.min_by(|a, b| far_m(a).total_cmp(&far_m(b)));
        let yaw_rad = door.map_or(0.0, |(x, y)| (at.1.1 - y).atan2(at.1.0 - x));
        let is_reachable = here.map(|here| floor.drivable[at.0] == Some(here));
        Some(Goal { pose: Pose2::new(at.1.0, at.1.1, yaw_rad), is_reachable })
    }
}

impl Rooms {
    /// Lengths of the ways from a point to others over known free space, by Dijkstra on the cells; none where there is
    /// no way.
    pub fn walks_m(&self, from: (f64, f64), to: &[(f64, f64)]) -> Vec<Option<f64>> {
        let Some(floor) = &self.floor else { return vec![None; to.len()] };
        let cell = |&(x, y): &(f64, f64)| floor.raster.near(x, y, |cell| floor.drivable[cell].map(|_| cell));
        let goals: Vec<Option<usize>> = to.iter().map(cell).collect();
        let Some(start) = cell(&from) else { return vec![None; to.len()] };
        let mut left =
            goals.iter().flatten().filter(|&&g| floor.drivable[g] == floor.drivable[start]).count();
        let mut far: Vec<u32> = vec![u32::MAX; floor.drivable.len()];
        let mut next = BinaryHeap::from([Reverse((0, start))]);
        far[start] = 0;
        while let Some(Reverse((way, cell))) = next.pop().filter(|_| left > 0) {
            if way > far[cell] {
                continue;
            }
            left -= goals.iter().filter(|g| **g == Some(cell)).count();
            for beside in
                floor.raster.beside(cell, true).filter(|&c| floor.drivable[c] == floor.drivable[start])
            {
                let straight = cell.abs_diff(beside) == 1 || cell.abs_diff(beside) == floor.raster.width;
                let there = way + if straight { STRAIGHT } else { ASLANT };
                if there < far[beside] {
                    far[beside] = there;
                    next.push(Reverse((there, beside)));
                }
            }
        }
        let metres = |far: u32| f64::from(far) / f64::from(STRAIGHT) * floor.raster.resolution_m;
        let reached = |g: &Option<usize>| g.map(|g| far[g]).filter(|&far| far < u32::MAX).map(metres);
        goals.iter().map(reached).collect()
    }
}

impl Floor {
    /// The cell of a region that is nearest to a point, of those wanted, and its middle.
    fn nearest(
        &self,
        region: usize,
        near: (f64, f64),
        wanted: impl Fn(usize) -> bool,
    ) -> Option<(usize, (f64, f64))> {
        let cells = self.cells.get(region)?.iter().copied().filter(|&cell| wanted(cell));
        let far_m = |p: (f64, f64)| (p.0 - near.0).hypot(p.1 - near.1);
        cells
            .map(|cell| (cell, self.raster.middle(cell)))
            .min_by(|a, b| far_m(a.1).total_cmp(&far_m(b.1)).then(a.0.cmp(&b.0)))
    }
}
