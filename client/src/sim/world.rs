//! A floor of a building: walls to range against, rooms with names, ways to walk.

use super::geom::{Point, Rect, Segment, distance_m, outline};

/// Body radius and a margin: a way keeps this far from every wall.
const CLEARANCE_M: f64 = 0.32;
/// Ways longer than this are left to the waypoints in between.
const WAY_MAX_M: f64 = 9.0;
/// Edge of a ray caster's bucket.
const BUCKET_M: f64 = 0.5;

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
    /// What people call it.
    pub name: String,
    /// Its floor.
    pub area: Rect,
    /// What it is.
    pub kind: RoomKind,
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
                Room { name, area, kind, spot: waypoints.len() - 1 }
            })
            .collect();
        waypoints.extend(self.waypoints);
        let ways = find_ways(&waypoints, &walls);
        let buckets = Buckets::new(&walls);
        World { walls, rooms, waypoints, ways, buckets }
    }
}

/// A floor of a building.
#[derive(Clone, Debug)]
pub struct World {
    /// Everything that stops a ray.
    pub walls: Vec<Segment>,
    /// Named parts of the floor.
    pub rooms: Vec<Room>,
    /// Points to walk by.
    pub waypoints: Vec<Point>,
    /// Per waypoint: those in reach, with their distances in metres.
    ways: Vec<Vec<(usize, f64)>>,
    buckets: Buckets,
}

impl World {
    /// Range of a ray; none if nothing stops it within `range_max_m`.
    pub fn cast(&self, origin: Point, bearing_rad: f64, range_max_m: f64) -> Option<f64> {
        self.buckets.cast(&self.walls, origin, bearing_rad, range_max_m)
    }

    /// Distance of a point to the nearest wall, metres.
    pub fn clearance_m(&self, p: Point) -> f64 {
        self.walls.iter().map(|w| w.distance_m(p)).fold(f64::INFINITY, f64::min)
    }

    /// Index of the first room of that name.
    pub fn room(&self, name: &str) -> Option<usize> {
        self.rooms.iter().position(|r| r.name == name)
    }

    /// The shortest walk between two waypoints, both included; none if there is no way.
    pub fn route(&self, from: usize, to: usize) -> Option<Vec<Point>> {
        // Dijkstra in O(n²): a floor has a few hundred waypoints.
        let n = self.waypoints.len();
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
            for &(next, way_m) in &self.ways[at] {
                // Each leg costs a little extra, so that straight walks beat zigzags.
                let through = cost_m[at] + way_m + 0.2;
                if through < cost_m[next] {
                    cost_m[next] = through;
                    before[next] = at;
                }
            }
        }
        let mut route = vec![*self.waypoints.get(to)?];
        let mut at = to;
        while at != from {
            at = before[at];
            route.push(*self.waypoints.get(at)?);
        }
        route.reverse();
        Some(route)
    }
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

/// Walls sorted into square buckets: a ray looks only at those along its way.
#[derive(Clone, Debug, Default)]
struct Buckets {
    origin: Point,
    columns: usize,
    rows: usize,
    /// Wall indices per bucket, row-major.
    walls: Vec<Vec<u32>>,
}

impl Buckets {
    fn new(walls: &[Segment]) -> Self {
        let ends = || walls.iter().flat_map(|w| [w.a, w.b]);
        let low = |k: usize| ends().map(|p| p[k]).fold(f64::INFINITY, f64::min) - BUCKET_M;
        let high = |k: usize| ends().map(|p| p[k]).fold(f64::NEG_INFINITY, f64::max) + BUCKET_M;
        if walls.is_empty() {
            return Self::default();
        }
        let origin = [low(0), low(1)];
        let columns = ((high(0) - origin[0]) / BUCKET_M).ceil() as usize;
        let rows = ((high(1) - origin[1]) / BUCKET_M).ceil() as usize;
        let mut buckets = Self { origin, columns, rows, walls: vec![Vec::new(); columns * rows] };
        for (index, wall) in walls.iter().enumerate() {
            let (low, high) = (buckets.corner(wall, f64::min, -0.1), buckets.corner(wall, f64::max, 0.1));
            for row in low[1]..=high[1] {
                for column in low[0]..=high[0] {
                    // Half a diagonal round the middle: a superset of the buckets crossed.
                    let middle = [
                        origin[0] + (column as f64 + 0.5) * BUCKET_M,
                        origin[1] + (row as f64 + 0.5) * BUCKET_M,
                    ];
                    if wall.distance_m(middle) <= 0.72 * BUCKET_M {
                        buckets.walls[row * columns + column].push(index as u32);
                    }
                }
            }
        }
        buckets
    }

    /// First or last bucket a wall may touch; `margin`, in buckets, because a wall may lie on a
    /// border, where rounding decides.
    fn corner(&self, wall: &Segment, pick: fn(f64, f64) -> f64, margin: f64) -> [usize; 2] {
        let index = |k: usize, n: usize| {
            let at = (pick(wall.a[k], wall.b[k]) - self.origin[k]) / BUCKET_M + margin;
            (at.max(0.0) as usize).min(n - 1)
        };
        [index(0, self.columns), index(1, self.rows)]
    }

    /// Walks the buckets along the ray and takes the first wall met.
    fn cast(&self, walls: &[Segment], origin: Point, bearing_rad: f64, max_m: f64) -> Option<f64> {
        let (s, c) = bearing_rad.sin_cos();
        let direction = [c, s];
        let start = [0, 1].map(|k| (origin[k] - self.origin[k]) / BUCKET_M);
        let size = [self.columns as i64, self.rows as i64];
        let mut cell = start.map(|v| v.floor() as i64);
        let step = direction.map(|d| if d < 0.0 { -1 } else { 1 });
        // Ray length to the next bucket border, and from border to border, per axis.
        let mut border_m = [0, 1].map(|k| {
            let next = if step[k] > 0 { cell[k] as f64 + 1.0 } else { cell[k] as f64 };
            if direction[k] == 0.0 { f64::INFINITY } else { (next - start[k]) * BUCKET_M / direction[k] }
        });
        let delta_m = direction.map(|d| BUCKET_M / d.abs());
        loop {
            let axis = usize::from(border_m[1] < border_m[0]);
            let leaves_m = border_m[axis];
            if cell.iter().zip(size).all(|(&k, n)| (0..n).contains(&k)) {
                let nearest = self.walls[cell[1] as usize * self.columns + cell[0] as usize]
                    .iter()
                    .filter_map(|&w| walls[w as usize].hit(origin, direction))
                    .fold(f64::INFINITY, f64::min);
                if nearest <= leaves_m {
                    return (nearest < max_m).then_some(nearest);
                }
            } else if self.leaves_for_good(cell, step) {
                return None;
            }
            if leaves_m >= max_m {
                return None;
            }
            cell[axis] += step[axis];
            border_m[axis] += delta_m[axis];
        }
    }

    fn leaves_for_good(&self, cell: [i64; 2], step: [i64; 2]) -> bool {
        let past = |k: usize, n: usize| if step[k] > 0 { cell[k] >= n as i64 } else { cell[k] < 0 };
        past(0, self.columns) || past(1, self.rows)
    }
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
    fn buckets_change_no_range() {
        let world = crate::sim::demo_building();
        for k in 0..2000 {
            let origin = [f64::from(k % 47) * 0.83 - 3.0, f64::from(k % 31) * 0.77 - 5.0];
            let bearing = f64::from(k) * 0.7;
            let (s, c) = bearing.sin_cos();
            let all = world.walls.iter().filter_map(|w| w.hit(origin, [c, s]));
            let want = all.fold(f64::INFINITY, f64::min);
            let got = world.cast(origin, bearing, 20.0).unwrap_or(f64::INFINITY);
            let right = if want < 20.0 { (got - want).abs() < 1e-9 } else { got.is_infinite() };
            assert!(right, "ray {k} from {origin:?}: {got}, not {want}");
        }
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
