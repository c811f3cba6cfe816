//! What a speaker sees when he locates something: where he stands and goes, the ways from there, and
//! what the path driven tells of a landmark's shape and of how it lies to the hallway.

use crate::language::grounding::footprint::Footprint;
use crate::language::grounding::place::GroundPlace;
use crate::language::grounding::scales::Scales;
use crate::language::grounding::ways::Ways;
use std::cell::OnceCell;

/// The approach whose direction is "ahead".
const APPROACH_M: f64 = 2.0;
/// Half of what a landmark takes of which only the place is known: a room of some 3 m.
const SPOT_HALF_M: f64 = 1.5;
/// Half of a hallway's width, and how far off its middle line a robot keeps on it.
pub(crate) const WAY_HALF_M: f64 = 1.2;
/// Longest stretch without a place on a hallway that is driven along: excursions into rooms between.
const WAY_GAP_M: f64 = 3.0;
/// No hallway is followed further.
const WAY_MAX_M: f64 = 80.0;
/// From where a robot turns to a room's walls, at least.
const ROOM_MARGIN_M: f64 = 0.8;
/// Places of a room that its outline is taken from.
const OUTLINE_MAX: usize = 24;
/// So near the middle line of the hallway one is back in it.
const HINGE_M: f64 = 0.7;
/// Back at a place is within so much of it.
const HERE_M: f64 = 1.2;
/// A room is entered within so much path from the hallway …
const ENTRY_MAX_M: f64 = 12.0;
/// … after a turn of at least this (cos 50°).
const ENTRY_COS: f64 = 0.64;

/// The map as a speaker sees it.
pub struct Scene<'a> {
    /// All places.
    pub places: &'a [GroundPlace],
    /// Ways from the speaker, once they are asked for: most relations don't.
    ways: OnceCell<Ways>,
    /// The speaker's place.
    pub speaker: usize,
    /// Unit vector of the approach.
    pub ahead: (f64, f64),
    /// Of the templates.
    pub scales: Scales,
}

/// A room, by what was driven of it, and how it lies to the hallway that it was entered from.
#[derive(Clone)]
pub struct Room {
    /// Indices of the places on the way in, and on the way out: rooms behind it are not of it.
    pub visits: [std::ops::Range<usize>; 2],
    /// Where the hallway was left.
    pub hinge: (f64, f64),
    /// Unit vector along the hallway, the way it was driven.
    pub along: (f64, f64),
}

impl<'a> Scene<'a> {
    /// From the place held when the sentence began; none if there is no such place.
    pub fn new(places: &'a [GroundPlace], speaker: usize, scales: Scales) -> Option<Self> {
        let here = places.get(speaker)?;
        let ahead = heading(places, speaker).unwrap_or((here.yaw_rad.cos(), here.yaw_rad.sin()));
        Some(Self { places, ways: OnceCell::new(), speaker, ahead, scales })
    }

    /// Ways from the speaker.
    pub fn ways(&self) -> &Ways {
        self.ways.get_or_init(|| Ways::new(self.places, self.speaker))
    }

    /// Length of the way from the speaker to a place; straight, where none is known.
    pub fn walk_m(&self, place: usize) -> f64 {
        self.ways().walk_m(place).unwrap_or_else(|| self.straight_m(self.at(place)))
    }

    /// From the speaker straight to a point.
    pub fn straight_m(&self, at: (f64, f64)) -> f64 {
        (at.0 - self.stand().0).hypot(at.1 - self.stand().1)
    }

    /// Where the speaker stands.
    pub fn stand(&self) -> (f64, f64) {
        self.at(self.speaker)
    }

    /// Where a place lies.
    pub fn at(&self, place: usize) -> (f64, f64) {
        (self.places[place].x_m, self.places[place].y_m)
    }

    /// An axis, in the direction that is rather ahead.
    pub fn onward_along(&self, axis: (f64, f64)) -> (f64, f64) {
        let ahead = axis.0 * self.ahead.0 + axis.1 * self.ahead.1 >= 0.0;
        if ahead { axis } else { (-axis.0, -axis.1) }
    }

    /// The floor of a landmark of which the place is known.
    pub fn footprint(&self, place: usize, way: bool) -> Footprint {
        let (x_m, y_m) = self.at(place);
        if way {
            return self.stretch(place);
        }
        let outline = self.room(place).map_or(Vec::new(), |r| r.inside(self));
        match Footprint::around(&outline) {
            Some(floor) => floor.grown(ROOM_MARGIN_M),
            None => Footprint::spot(x_m, y_m, SPOT_HALF_M),
        }
    }

    /// The straight stretch driven through a place: the longest of those in the robot's direction
    /// there and some metres before and after, since it may just have turned.
    pub fn stretch(&self, place: usize) -> Footprint {
        let p = self.places[place];
        let directions =
            [Some((p.yaw_rad.cos(), p.yaw_rad.sin())), heading(self.places, place), self.onward(place)];
        let stretches = directions.into_iter().flatten().map(|d| self.stretch_along(place, d));
        stretches
            .max_by(|a, b| a.half_length_m.total_cmp(&b.half_length_m))
            .unwrap_or_else(|| Footprint::spot(p.x_m, p.y_m, WAY_HALF_M))
    }

    /// Direction of the next metres of path.
    fn onward(&self, place: usize) -> Option<(f64, f64)> {
        let p = self.places[place];
        let next = self.places[place..].iter().take_while(|q| q.path_m - p.path_m <= APPROACH_M).last()?;
        unit((next.x_m, next.y_m), (p.x_m, p.y_m))
    }

    fn stretch_along(&self, place: usize, d: (f64, f64)) -> Footprint {
        let (x_m, y_m) = self.at(place);
        let mut along: Vec<f64> = self
            .places
            .iter()
            .map(|p| (p.x_m - x_m, p.y_m - y_m))
            .filter(|v| (v.1 * d.0 - v.0 * d.1).abs() < WAY_HALF_M)
            .map(|v| v.0 * d.0 + v.1 * d.1)
            .filter(|u| u.abs() < WAY_MAX_M)
            .collect();
        along.sort_unstable_by(f64::total_cmp);
        let walk = |far_m: f64, &u: &f64| if u - far_m <= WAY_GAP_M { u } else { far_m };
        let end_m = along.iter().filter(|u| **u > 0.0).fold(0.0, walk);
        let start_m = -along.iter().rev().filter(|u| **u < 0.0).map(|u| -u).fold(0.0, |far, u| walk(far, &u));
        let point = |u: f64| (x_m + u * d.0, y_m + u * d.1);
        Footprint::strip(point(start_m), point(end_m), WAY_HALF_M)
    }

    /// The room that a place lies in: what was driven between leaving the hallway and being back
    /// there; none if the place lies on no such excursion, or the robot has not come out yet.
    pub fn room(&self, place: usize) -> Option<Room> {
        let count = self.places.len();
        let arrival = self.turn(place, (0..place).rev());
        let (turned, along) = arrival.or_else(|| self.turn(place, place + 1..count))?;
        let hinge = self.at(turned);
        // Into the room opposite, a robot goes straight over the hallway.
        let p = self.places[place];
        let in_hallway = |&k: &usize| {
            let (x_m, y_m) = self.at(k);
            ((y_m - hinge.1) * along.0 - (x_m - hinge.0) * along.1).abs() < HINGE_M
        };
        let near = |&k: &usize| (self.places[k].path_m - p.path_m).abs() <= ENTRY_MAX_M;
        let before = (0..place).rev().take_while(near).find(in_hallway);
        let after = (place + 1..count).take_while(near).find(in_hallway);
        let (first, after) = (before? + 1, after?);
        // What was driven between the first time here and the last lies behind.
        let here = |&k: &usize| (self.at(k).0 - p.x_m).hypot(self.at(k).1 - p.y_m) <= HERE_M;
        let enter = (first..=place).find(here).unwrap_or(place);
        let leave = (place..after).rev().find(here).unwrap_or(place);
        let inner = (enter..=leave).take_while(here).last().unwrap_or(place) + 1;
        let outer = (inner..=leave).rev().take_while(here).last().unwrap_or(inner);
        Some(Room { visits: [first..inner, outer..after], hinge, along })
    }

    /// The place, of some in order from one in a room, where the robot went across the way in or
    /// out, and the direction that it went.
    fn turn(&self, place: usize, walk: impl Iterator<Item = usize>) -> Option<(usize, (f64, f64))> {
        let p = self.places[place];
        let mut inward = None;
        for k in walk.take_while(|&k| (self.places[k].path_m - p.path_m).abs() <= ENTRY_MAX_M) {
            let at = self.at(k);
            if (at.0 - p.x_m).hypot(at.1 - p.y_m) >= APPROACH_M {
                inward = inward.or_else(|| unit((p.x_m, p.y_m), at));
            }
            let along = (self.places[k].yaw_rad.cos(), self.places[k].yaw_rad.sin());
            if inward.is_some_and(|d| (d.0 * along.0 + d.1 * along.1).abs() < ENTRY_COS) {
                return Some((k, along));
            }
        }
        None
    }
}

impl Room {
    /// Unit vector from the hallway to the side where a point lies.
    pub fn inward(&self, at: (f64, f64)) -> (f64, f64) {
        let (dx, dy) = (at.0 - self.hinge.0, at.1 - self.hinge.1);
        let side = if dy * self.along.0 - dx * self.along.1 >= 0.0 { 1.0 } else { -1.0 };
        (-side * self.along.1, side * self.along.0)
    }

    /// What was driven inside, farther from the hallway's middle than half its width.
    fn inside(&self, scene: &Scene) -> Vec<(f64, f64)> {
        let (hinge, along) = (self.hinge, self.along);
        let across_m = |p: &(f64, f64)| (p.1 - hinge.1) * along.0 - (p.0 - hinge.0) * along.1;
        let places = self.visits.iter().cloned().flatten().map(|k| scene.at(k));
        places.filter(|p| across_m(p).abs() > WAY_HALF_M).take(OUTLINE_MAX).collect()
    }
}

/// Direction of the last metres of path before a place; none if it hardly moved.
fn heading(places: &[GroundPlace], place: usize) -> Option<(f64, f64)> {
    let p = &places[place];
    let before = places[..place].iter().rev().take_while(|q| p.path_m - q.path_m <= APPROACH_M).last()?;
    unit((p.x_m, p.y_m), (before.x_m, before.y_m))
}

/// Unit vector to `a` from `b`; none if they are one point.
pub fn unit(a: (f64, f64), b: (f64, f64)) -> Option<(f64, f64)> {
    let (dx, dy) = (a.0 - b.0, a.1 - b.1);
    let length_m = (dx * dx + dy * dy).sqrt();
    (length_m.is_finite() && length_m > 0.1).then(|| (dx / length_m, dy / length_m))
}
