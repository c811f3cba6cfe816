//! A floor of a building: walls to range against, rooms with names, ways to walk.

use super::cast::{Buckets, Strike};
use super::floor::Floor;
use crate::geom::{Area, Point, Rect, Segment, distance_m, outline};

/// Body radius and a margin: a way keeps this far from every wall.
const CLEARANCE_M: f64 = 0.32;
/// A visit to a room begins this far inside.
const INSIDE_M: f64 = 0.8;
/// Ways longer than this are left to the waypoints in between.
const WAY_MAX_M: f64 = 9.0;

/// What a room is to a visitor.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RoomKind {
    /// Something with a name of its own.
    Room,
    /// What leads from room to room.
    Corridor,
}

/// A named part of the floor.
#[derive(Clone, Debug, PartialEq)]
pub struct Room {
    /// What people call it; empty if nobody calls it anything.
    pub name: String,
    /// Its floor.
    pub area: Area,
    /// What it is.
    pub kind: RoomKind,
    /// A visitor counts as inside from this far off its outline on, metres.
    pub inside_m: f64,
    /// Where a visitor stops, as an index into [`World::waypoints`].
    pub spot: usize,
}

/// The drawing a [`World`] is built from.
#[derive(Clone, Debug, Default)]
pub struct Plan {
    /// Free floor: rooms, corridors and door openings, each a rectangle.
    pub floor: Vec<Rect>,
    /// Furniture and pillars.
    pub furniture: Vec<Segment>,
    /// Name, area, kind, and where a visitor stops.
    pub rooms: Vec<(String, Rect, RoomKind, Point)>,
    /// Floor on which lasers see nothing.
    pub dark: Vec<Rect>,
    /// More points to walk by: both sides of each door, corridors' middles.
    pub waypoints: Vec<Point>,
}

impl Plan {
    /// A room.
    pub fn room(&mut self, name: &str, area: Rect) {
        self.floor.push(area);
        self.rooms.push((name.into(), area, RoomKind::Room, area.centre()));
    }

    /// A corridor with waypoints along its middle, about two metres apart.
    pub fn corridor(&mut self, name: &str, area: Rect) {
        self.floor.push(area);
        self.rooms.push((name.into(), area, RoomKind::Corridor, area.centre()));
        let (dx, dy) = (area.x1_m - area.x0_m, area.y1_m - area.y0_m);
        let half = dx.min(dy) / 2.0;
        let [x, y] = area.centre();
        let (from, to) = if dx > dy {
            ([area.x0_m + half, y], [area.x1_m - half, y])
        } else {
            ([x, area.y0_m + half], [x, area.y1_m - half])
        };
        let steps = (distance_m(from, to) / 2.0).ceil().max(1.0);
        for k in 0..=(steps as usize) {
            let f = k as f64 / steps;
            self.waypoints.push([from[0] + f * (to[0] - from[0]), from[1] + f * (to[1] - from[1])]);
        }
    }

    /// Floor on which a laser sees nothing, nor through it: sunlight, fog. It is floor only where
    /// something else makes it so.
    pub fn dark(&mut self, area: Rect) {
        self.dark.push(area);
    }

    /// A door opening across the wall between two facing points of neighbouring rooms.
    pub fn door(&mut self, from: Point, to: Point, width_m: f64) {
        let (dx, dy) = (to[0] - from[0], to[1] - from[1]);
        let length_m = dx.hypot(dy);
        let half = if dx.abs() > dy.abs() { [0.0, width_m / 2.0] } else { [width_m / 2.0, 0.0] };
        self.floor
            .push(Rect::new([from[0] - half[0], from[1] - half[1]], [to[0] + half[0], to[1] + half[1]]));
        for (end, sign) in [(from, -1.0), (to, 1.0)] {
            let step = sign * 0.8 / length_m;
            self.waypoints.push([end[0] + step * dx, end[1] + step * dy]);
        }
    }

    /// A box of furniture or a pillar, turned by `yaw_rad`.
    pub fn block(&mut self, centre: Point, size_m: [f64; 2], yaw_rad: f64) {
        let (s, c) = yaw_rad.sin_cos();
        let corner = |u: f64, v: f64| {
            let (x, y) = (u * size_m[0] / 2.0, v * size_m[1] / 2.0);
            [centre[0] + c * x - s * y, centre[1] + s * x + c * y]
        };
        let corners = [corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)];
        for k in 0..4 {
            self.furniture.push(Segment { a: corners[k], b: corners[(k + 1) % 4] });
        }
    }

    /// The floor with its walls put up and its ways found.
    pub fn build(self) -> World {
        let mut walls = outline(&self.floor);
        walls.extend(self.furniture);
        let mut waypoints = Vec::new();
        let rooms = self
            .rooms
            .into_iter()
            .map(|(name, area, kind, spot)| {
                waypoints.push(spot);
                let (area, spot) = (area.into(), waypoints.len() - 1);
                Room { name, area, kind, inside_m: INSIDE_M, spot }
            })
            .collect();
        waypoints.extend(self.waypoints);
        let ways = Ways::Seen(find_ways(&waypoints, &walls));
        let mut world = World::new(walls, rooms, waypoints, ways);
        world.dark = self.dark;
        world
    }
}

/// What a wall does to a laser's ray.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Surface {
    /// Sends it back.
    #[default]
    Plain,
    /// Sends it back from near only.
    Dark,
    /// Sends it back only where it strikes squarely.
    Glass,
}

/// How one gets from waypoint to waypoint.
#[derive(Clone, Debug)]
pub(crate) enum Ways {
    /// Straight between waypoints; per waypoint those in reach, with their distances in metres.
    Seen(Vec<Vec<(usize, f64)>>),
    /// Anywhere over the free floor.
    Open(Floor),
}

/// A floor of a building.
#[derive(Clone, Debug)]
pub struct World {
    /// Everything that stops a ray.
    pub walls: Vec<Segment>,
    /// What they are made of; missing: plain.
    pub surfaces: Vec<Surface>,
    /// Named parts of the floor.
    pub rooms: Vec<Room>,
    /// Points to walk by.
    pub waypoints: Vec<Point>,
    /// Floor on which lasers see nothing.
    pub dark: Vec<Rect>,
    ways: Ways,
    buckets: Buckets,
}

impl World {
    /// A floor of plain walls.
    pub(crate) fn new(walls: Vec<Segment>, rooms: Vec<Room>, waypoints: Vec<Point>, ways: Ways) -> Self {
        let buckets = Buckets::new(&walls);
        Self { walls, surfaces: Vec::new(), rooms, waypoints, dark: Vec::new(), ways, buckets }
    }

    /// Range of a ray; none if nothing stops it within `range_max_m`.
    pub fn cast(&self, origin: Point, bearing_rad: f64, range_max_m: f64) -> Option<f64> {
        Some(self.strike(origin, bearing_rad, range_max_m)?.range_m)
    }

    /// Where a ray meets the first wall; none if nothing stops it within `range_max_m`.
    pub fn strike(&self, origin: Point, bearing_rad: f64, range_max_m: f64) -> Option<Strike> {
        let strike = self.buckets.cast(&self.walls, origin, bearing_rad, range_max_m)?;
        (strike.range_m < self.dark_from_m(origin, bearing_rad)).then_some(strike)
    }

    /// Whether a point lies on floor on which lasers see nothing.
    pub fn is_dark(&self, p: Point) -> bool {
        self.dark.iter().any(|d| d.contains(p, 0.0))
    }

    /// How far a ray goes before it comes upon dark floor, from beyond which nothing comes back.
    pub fn dark_from_m(&self, origin: Point, bearing_rad: f64) -> f64 {
        let (s, c) = bearing_rad.sin_cos();
        self.dark.iter().filter_map(|d| d.entry_m(origin, [c, s])).fold(f64::INFINITY, f64::min)
    }

    /// Distance of a point to the nearest wall, metres.
    pub fn clearance_m(&self, p: Point) -> f64 {
        self.walls.iter().map(|w| w.distance_m(p)).fold(f64::INFINITY, f64::min)
    }

    /// The free floor, where ways are not bound to waypoints.
    pub(crate) fn floor(&self) -> Option<&Floor> {
        match &self.ways {
            Ways::Seen(_) => None,
            Ways::Open(floor) => Some(floor),
        }
    }

    /// Index of the waypoint nearest to a point.
    pub(crate) fn waypoint_near(&self, p: Point) -> usize {
        let near = |k: &usize| distance_m(self.waypoints[*k], p);
        (0..self.waypoints.len()).min_by(|a, b| near(a).total_cmp(&near(b))).unwrap_or_default()
    }

    /// Index of the first room of that name.
    pub fn room(&self, name: &str) -> Option<usize> {
        self.rooms.iter().position(|r| r.name == name)
    }

    /// A short walk between two waypoints, both included; none if there is no way.
    pub fn route(&self, from: usize, to: usize) -> Option<Vec<Point>> {
        match &self.ways {
            Ways::Seen(ways) => seen_route(&self.waypoints, ways, from, to),
            Ways::Open(floor) => floor.route(*self.waypoints.get(from)?, *self.waypoints.get(to)?),
        }
    }
}

/// The shortest walk from waypoint to waypoint.
fn seen_route(waypoints: &[Point], ways: &[Vec<(usize, f64)>], from: usize, to: usize) -> Option<Vec<Point>> {
    // Dijkstra in O(n²): a floor has a few hundred waypoints.
    let n = waypoints.len();
    let (mut cost_m, mut before, mut done) = (vec![f64::INFINITY; n], vec![n; n], vec![false; n]);
    *cost_m.get_mut(from)? = 0.0;
    while let Some(at) = (0..n).filter(|&k| !done[k]).min_by(|&a, &b| cost_m[a].total_cmp(&cost_m[b])) {
        if cost_m[at].is_infinite() {
            return None;
        }
        if at == to {
            break;
        }
        done[at] = true;
        for &(next, way_m) in &ways[at] {
            // Each leg costs a little extra, so that straight walks beat zigzags.
            let through = cost_m[at] + way_m + 0.2;
            if through < cost_m[next] {
                cost_m[next] = through;
                before[next] = at;
            }
        }
    }
    let mut route = vec![*waypoints.get(to)?];
    let mut at = to;
    while at != from {
        at = before[at];
        route.push(*waypoints.get(at)?);
    }
    route.reverse();
    Some(route)
}

fn find_ways(waypoints: &[Point], walls: &[Segment]) -> Vec<Vec<(usize, f64)>> {
    let mut ways = vec![Vec::new(); waypoints.len()];
    for (i, &a) in waypoints.iter().enumerate() {
        for (j, &b) in waypoints.iter().enumerate().skip(i + 1) {
            let length_m = distance_m(a, b);
            let line = Segment { a, b };
            if length_m <= WAY_MAX_M && walls.iter().all(|w| w.gap_m(&line) >= CLEARANCE_M) {
                ways[i].push((j, length_m));
                ways[j].push((i, length_m));
            }
        }
    }
    ways
}

#[cfg(test)]
mod tests {
    use super::*;

    fn two_rooms() -> World {
        let mut plan = Plan::default();
        plan.room("a", Rect::new([0.0, 0.0], [4.0, 4.0]));
        plan.room("b", Rect::new([4.2, 0.0], [8.0, 4.0]));
        plan.door([4.0, 2.0], [4.2, 2.0], 1.0);
        plan.build()
    }

    #[test]
    fn ranges_are_those_of_the_drawing() {
        let world = two_rooms();
        let cast = |x, y, deg: f64| world.cast([x, y], deg.to_radians(), 30.0);
        for (x, y, deg, want) in [
            (1.0, 1.0, 0.0, 3.0),
            (1.0, 1.0, 90.0, 3.0),
            (1.0, 1.0, 180.0, 1.0),
            (1.0, 1.0, 225.0, 2f64.sqrt()),
            (1.0, 2.0, 0.0, 7.0),
            (7.0, 2.0, 180.0, 7.0),
        ] {
            let got = cast(x, y, deg).unwrap();
            assert!((got - want).abs() < 1e-9, "({x}, {y}) {deg}°: {got}, not {want}");
        }
        assert_eq!(world.cast([1.0, 2.0], 0.0, 6.9), None, "beyond the laser's reach");
        assert_eq!(cast(-3.0, 6.0, 90.0), None, "outside, looking away");
        let outside = cast(-3.0, 1.0, 0.0).unwrap();
        assert!((outside - 3.0).abs() < 1e-9, "outside, looking in");
    }

    #[test]
    fn nothing_comes_back_from_beyond_dark_floor() {
        let mut plan = Plan::default();
        plan.room("a", Rect::new([0.0, 0.0], [8.0, 4.0]));
        plan.dark(Rect::new([4.0, 1.0], [5.0, 3.0]));
        let world = plan.build();
        assert_eq!(world.cast([1.0, 2.0], 0.0, 30.0), None);
        assert_eq!(world.cast([4.5, 2.0], 1.0, 30.0), None, "from within");
        assert_eq!(world.cast([1.0, 0.5], 0.0, 30.0), Some(7.0), "beside it");
        assert_eq!(world.cast([3.0, 2.0], std::f64::consts::PI, 30.0), Some(3.0), "away from it");
        assert!(world.is_dark([4.5, 2.0]) && !world.is_dark([3.9, 2.0]));
    }

    #[test]
    fn a_route_goes_through_the_door_and_there_is_none_through_a_wall() {
        let world = two_rooms();
        let route = world.route(0, 1).unwrap();
        assert_eq!((route[0], route[route.len() - 1]), (world.waypoints[0], world.waypoints[1]));
        for leg in route.windows(2) {
            let line = Segment { a: leg[0], b: leg[1] };
            assert!(world.walls.iter().all(|w| w.gap_m(&line) >= CLEARANCE_M));
        }
        let mut plan = Plan::default();
        plan.room("a", Rect::new([0.0, 0.0], [4.0, 4.0]));
        plan.room("b", Rect::new([4.2, 0.0], [8.0, 4.0]));
        assert_eq!(plan.build().route(0, 1), None);
    }
}
