//! How the rooms of a building lie to each other, by its walls and doors: what people may say of them and be right.

use crate::geom::{Point, Segment, distance_m};
use crate::world::{RoomKind, World};
use toponym_proto::Pose;

/// Walls no thicker part rooms that are next to each other, …
const WALL_MAX_M: f64 = 0.7;
/// … along no less than this.
const SHARED_MIN_M: f64 = 1.2;
/// Doors of neighbours are no further apart on the way.
const NEIGHBOURS_M: f64 = 10.0;
/// Doors across from each other are no further apart.
const ACROSS_M: f64 = 5.0;
/// Doors near each other.
const NEAR_M: f64 = 6.0;
/// What lies "down the hallway" is no nearer and no further, and in sight within this angle.
const DOWN_M: std::ops::RangeInclusive<f64> = 4.0..=25.0;
const DOWN_RAD: f64 = 0.6;
/// Between points at which a route or an edge is looked at.
const STEP_M: f64 = 0.1;
/// Of corridors so many, the nearest, are tried for the way to a room.
const TRIED: usize = 3;

/// How one room lies to others.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Lies {
    NextTo(usize),
    AcrossFrom(usize),
    Near(usize),
    Between(usize, usize),
}

impl Lies {
    /// The rooms that it speaks of beside the one that lies so.
    pub fn landmarks(self) -> impl Iterator<Item = usize> {
        let (a, b) = match self {
            Self::NextTo(a) | Self::AcrossFrom(a) | Self::Near(a) => (a, None),
            Self::Between(a, b) => (a, Some(b)),
        };
        std::iter::once(a).chain(b)
    }

    /// As people say it, {0} and {1} in the landmarks' stead.
    pub fn pattern(self) -> &'static str {
        match self {
            Self::NextTo(_) => "next to the {0}",
            Self::AcrossFrom(_) => "across from the {0}",
            Self::Near(_) => "near the {0}",
            Self::Between(..) => "between the {0} and the {1}",
        }
    }

    /// As people say it.
    pub fn words(self, world: &World) -> String {
        let names = self.landmarks().map(|k| &world.rooms[k].name).enumerate();
        names.fold(self.pattern().to_owned(), |words, (k, name)| words.replace(&format!("{{{k}}}"), name))
    }
}

/// Where a room is entered.
#[derive(Clone, Copy, Debug)]
struct Door {
    at: Point,
    /// The room that one comes from.
    from: usize,
}

/// A building and its doors.
pub(super) struct Layout<'a> {
    world: &'a World,
    doors: Vec<Option<Door>>,
}

impl<'a> Layout<'a> {
    /// Of the rooms given; of others no doors are known.
    pub fn new(world: &'a World, rooms: &[usize]) -> Self {
        let mut layout = Self { world, doors: vec![None; world.rooms.len()] };
        for &room in rooms {
            layout.doors[room] = layout.door(room);
        }
        layout
    }

    fn door(&self, room: usize) -> Option<Door> {
        let rooms = &self.world.rooms;
        let (area, spot) = (&rooms[room].area, rooms[room].spot);
        let far_m = |k: &usize| distance_m(rooms[*k].area.centre(), area.centre());
        let mut corridors: Vec<usize> =
            (0..rooms.len()).filter(|&k| k != room && rooms[k].kind == RoomKind::Corridor).collect();
        corridors.sort_by(|a, b| far_m(a).total_cmp(&far_m(b)));
        let routes = corridors.into_iter().take(TRIED).filter_map(|c| self.world.route(rooms[c].spot, spot));
        let length_m = |route: &Vec<Point>| route.windows(2).map(|w| distance_m(w[0], w[1])).sum::<f64>();
        let route = routes.min_by(|a, b| length_m(a).total_cmp(&length_m(b)))?;
        let points: Vec<Point> = along(&route).collect();
        let outside = points.iter().rposition(|p| !area.contains(*p, 0.0))?;
        let before = points[..=outside].iter().rev();
        let from = before.into_iter().find_map(|p| self.room_at(*p).filter(|&k| k != room))?;
        Some(Door { at: points[outside], from })
    }

    fn room_at(&self, p: Point) -> Option<usize> {
        self.world.rooms.iter().position(|r| r.area.contains(p, 0.0))
    }

    /// All that may be said of how a room lies to some of those given.
    pub fn of(&self, room: usize, others: &[usize]) -> Vec<Lies> {
        let others = || others.iter().copied().filter(move |&k| k != room);
        let mut all = Vec::new();
        let beside: Vec<usize> = others().filter(|&k| self.are_next(room, k)).collect();
        for (k, &a) in beside.iter().enumerate() {
            all.extend(
                beside[k + 1..]
                    .iter()
                    .filter(|&&b| self.is_between(room, a, b))
                    .map(|&b| Lies::Between(a, b)),
            );
        }
        all.extend(beside.iter().map(|&k| Lies::NextTo(k)));
        all.extend(others().filter(|&k| self.are_across(room, k)).map(Lies::AcrossFrom));
        all.extend(others().filter(|&k| self.doors_m(room, k).is_some_and(|m| m <= NEAR_M)).map(Lies::Near));
        all
    }

    /// Whether who is at a pose, in a corridor, has a room before them down that corridor.
    pub fn is_down(&self, room: usize, corridor: usize, at: &Pose) -> bool {
        let door = self.door_from(room, corridor, at);
        door.is_some_and(|[x, y]| DOWN_M.contains(&x.hypot(y)) && y.atan2(x).abs() <= DOWN_RAD)
    }

    /// Where the door of a room is from a pose in the corridor that it opens to: so far ahead, and to the left.
    pub fn door_from(&self, room: usize, corridor: usize, at: &Pose) -> Option<Point> {
        let door = self.doors[room].filter(|d| d.from == corridor)?;
        let local = crate::geom::between(at, &Pose { x_m: door.at[0], y_m: door.at[1], yaw_rad: 0.0 });
        Some([local.x_m, local.y_m])
    }

    /// Whether a room lies to the left of who goes along a corridor; none if it lies ahead or behind.
    pub fn side_from(&self, room: usize, corridor: usize, at: &Pose) -> Option<bool> {
        let door = self.doors[room].filter(|d| d.from == corridor)?;
        let centre = self.world.rooms[room].area.centre();
        let inward_rad = (centre[1] - door.at[1]).atan2(centre[0] - door.at[0]) - at.yaw_rad;
        let sin = inward_rad.sin();
        (sin.abs() > 0.7).then_some(sin > 0.0)
    }

    /// How far a corridor goes on ahead of a pose in it.
    pub fn end_m(&self, corridor: usize, at: &Pose) -> Option<f64> {
        let (s, c) = at.yaw_rad.sin_cos();
        let ahead = self.world.rooms[corridor].area.corners.iter();
        ahead.map(|p| (p[0] - at.x_m) * c + (p[1] - at.y_m) * s).reduce(f64::max)
    }

    /// Distance of the doors of two rooms that open on one space.
    fn doors_m(&self, a: usize, b: usize) -> Option<f64> {
        let (a, b) = (self.doors[a]?, self.doors[b]?);
        (a.from == b.from).then(|| distance_m(a.at, b.at))
    }

    fn are_next(&self, a: usize, b: usize) -> bool {
        self.doors_m(a, b).is_some_and(|m| m <= NEIGHBOURS_M) && self.shared_m(a, b) >= SHARED_MIN_M
    }

    /// Length of the wall that two rooms share.
    fn shared_m(&self, a: usize, b: usize) -> f64 {
        let [a, b] = [a, b].map(|k| &self.world.rooms[k].area);
        let other: Vec<Segment> = b.edges().collect();
        let near = |p: &Point| other.iter().any(|e| e.distance_m(*p) <= WALL_MAX_M);
        let corners: Vec<Point> = a.corners.iter().copied().chain(a.corners.first().copied()).collect();
        along(&corners).filter(near).count() as f64 * STEP_M
    }

    fn are_across(&self, a: usize, b: usize) -> bool {
        let (Some(of_a), Some(of_b)) = (self.doors[a], self.doors[b]) else { return false };
        let is_corridor = self.world.rooms[of_a.from].kind == RoomKind::Corridor;
        is_corridor && self.doors_m(a, b).is_some_and(|m| m <= ACROSS_M) && {
            let [u, v] = [(a, of_a), (b, of_b)].map(|(k, door)| {
                let c = self.world.rooms[k].area.centre();
                unit([c[0] - door.at[0], c[1] - door.at[1]])
            });
            u[0] * v[0] + u[1] * v[1] < -0.5
        }
    }

    fn is_between(&self, room: usize, a: usize, b: usize) -> bool {
        let [c, a, b] = [room, a, b].map(|k| self.world.rooms[k].area.centre());
        let [u, v] = [a, b].map(|p| unit([p[0] - c[0], p[1] - c[1]]));
        u[0] * v[0] + u[1] * v[1] < -0.8
    }
}

fn unit(v: Point) -> Point {
    let length = v[0].hypot(v[1]).max(1e-9);
    [v[0] / length, v[1] / length]
}

/// Points of a polyline, each a step on.
fn along(line: &[Point]) -> impl Iterator<Item = Point> + '_ {
    line.windows(2).flat_map(|w| {
        let steps = (distance_m(w[0], w[1]) / STEP_M).ceil().max(1.0) as usize;
        (0..steps).map(move |k| {
            let f = k as f64 / steps as f64;
            [0, 1].map(|axis| w[0][axis] + f * (w[1][axis] - w[0][axis]))
        })
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::storey::{Storey, tests::ROW};
    use crate::{Draw, FloorPlan};
    use std::path::Path;

    #[test]
    fn rooms_in_a_row_lie_next_to_and_between_each_other() {
        let plan = FloorPlan::parse(ROW, Path::new("row.xml")).unwrap();
        let world = Storey::new(&plan, &mut Draw::new(1, 3)).world;
        let [kitchen, workshop, library, hallway] =
            ["kitchen", "workshop", "library", "hallway"].map(|n| world.room(n).unwrap());
        let layout = Layout::new(&world, &[kitchen, workshop, library]);
        let all = [kitchen, workshop, library];
        let of = layout.of(workshop, &all);
        assert!(of.contains(&Lies::Between(kitchen, library)), "{of:?}");
        assert!(of.contains(&Lies::NextTo(kitchen)) && of.contains(&Lies::Near(kitchen)));
        assert!(!of.iter().any(|l| matches!(l, Lies::AcrossFrom(_))));
        assert!(!layout.of(kitchen, &all).contains(&Lies::NextTo(library)));
        let towards = |yaw_rad| Pose { x_m: 1.0, y_m: 1.0, yaw_rad };
        assert!(layout.is_down(library, hallway, &towards(0.0)));
        assert!(!layout.is_down(library, hallway, &towards(3.0)), "behind");
        assert!(!layout.is_down(kitchen, hallway, &towards(0.0)), "right here");
    }
}
