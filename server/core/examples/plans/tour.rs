//! A robot's drive along a hallway, into every room and back: the places that grounding gets to see.

use crate::plan::{Hallway, Point, inside};
use crate::statements::Statement;
use toponym_core::language::GroundPlace;

/// Places are so far apart.
const STEP_M: f64 = 1.0;

/// The places of a tour.
#[derive(Clone)]
pub struct Tour {
    /// In the order driven.
    pub places: Vec<GroundPlace>,
    /// The room that each lies in.
    pub room: Vec<Option<usize>>,
    /// Statements are made at the places before this one.
    spoken: usize,
}

impl Tour {
    /// Up the hallway visiting the rooms of `first`, back through the hallway alone, and if there are
    /// others, up again visiting those.
    pub fn new(hall: &Hallway, first: impl Fn(usize) -> bool) -> Self {
        let end_m = hall.half_length_m - 0.5;
        let outer = |k: &usize| hall.rooms[*k].through.is_none();
        let (now, later): (Vec<_>, Vec<_>) = (0..hall.rooms.len()).filter(outer).partition(|&k| first(k));
        let mut route = vec![(-end_m, 0.0)];
        route.extend(now.iter().flat_map(|&k| visit(hall, k)));
        route.extend([(end_m, 0.0), (-end_m, 0.0)]);
        let spoken = places(&route).len();
        route.extend(later.iter().flat_map(|&k| visit(hall, k)));
        let places = places(&route);
        let room_of = |p: &GroundPlace| hall.rooms.iter().position(|r| inside((p.x_m, p.y_m), &r.outline));
        let room = places.iter().map(room_of).collect();
        Self { places, room, spoken }
    }

    /// The place of a room where one names it: the one nearest its middle.
    pub fn landmark(&self, hall: &Hallway, room: usize) -> Option<usize> {
        let middle = hall.rooms[room].middle;
        let far_m = |k: usize| (self.places[k].x_m - middle.0).hypot(self.places[k].y_m - middle.1);
        (0..self.places.len())
            .filter(|&k| self.room[k] == Some(room))
            .min_by(|&a, &b| far_m(a).total_cmp(&far_m(b)))
    }

    /// The tour up to the end of the first visit of a room that a statement is true of; none unless
    /// that is still to come where it is said, at place `stand`, and its landmarks were visited.
    pub fn at_first_visit(&self, stand: usize, said: &Statement) -> Option<Self> {
        let first = |room: &usize| self.room.iter().position(|r| *r == Some(*room));
        let told: Option<Vec<usize>> = said.landmarks.iter().map(first).collect();
        let coming: Option<Vec<usize>> = said.figures.iter().map(first).collect();
        let start = coming?.into_iter().min()?;
        if told?.iter().any(|&k| k > stand) || start <= stand {
            return None;
        }
        let visit = self.room[start..].iter().take_while(|r| **r == self.room[start]).count();
        let end = start + visit;
        Some(Self {
            places: self.places[..end].to_vec(),
            room: self.room[..end].to_vec(),
            spoken: self.spoken,
        })
    }

    /// Places in the hallway where the robot drives along it, up (1) or down (−1).
    pub fn stands(&self, direction: f64) -> Vec<usize> {
        let drives = |p: &GroundPlace| p.y_m.abs() < 0.1 && (p.yaw_rad.cos() - direction).abs() < 0.1;
        (2..self.spoken).filter(|&k| (k - 2..=k).all(|k| drives(&self.places[k]))).collect()
    }
}

/// Into a room and those behind it, from the hallway and back there.
fn visit(hall: &Hallway, k: usize) -> Vec<Point> {
    let (room, end_m) = (&hall.rooms[k], hall.half_length_m - 0.5);
    let at = (room.door.0.clamp(-end_m, end_m), 0.0);
    let mut visit = vec![at, room.door, room.middle];
    for inner in hall.rooms.iter().filter(|r| r.through == Some(k)) {
        visit.extend([inner.door, inner.middle, inner.door, room.middle]);
    }
    visit.extend([room.door, at]);
    visit
}

fn places(route: &[Point]) -> Vec<GroundPlace> {
    let mut places = Vec::new();
    let (mut path_m, mut next_m) = (0.0, 0.0);
    for leg in route.windows(2) {
        let (dx, dy) = (leg[1].0 - leg[0].0, leg[1].1 - leg[0].1);
        let length_m = dx.hypot(dy);
        while next_m <= path_m + length_m && length_m > 0.0 {
            let f = (next_m - path_m) / length_m;
            let (x_m, y_m) = (leg[0].0 + f * dx, leg[0].1 + f * dy);
            places.push(GroundPlace { x_m, y_m, yaw_rad: dy.atan2(dx), path_m: next_m });
            next_m += STEP_M;
        }
        path_m += length_m;
    }
    places
}
