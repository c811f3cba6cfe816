//! Buildings of our own making: one fixed, and any number drawn from a seed.

use super::random::Draw;
use super::world::{Plan, World};
use crate::geom::{Point, Rect, Segment, distance_m};

/// Thickness of a wall.
const WALL_M: f64 = 0.2;

/// Names for the rooms of a random office.
pub(crate) const NAMES: [&str; 24] = [
    "kitchen",
    "library",
    "gym",
    "workshop",
    "print room",
    "meeting room",
    "cafeteria",
    "lecture hall",
    "machine lab",
    "lounge",
    "mail room",
    "server room",
    "reading room",
    "storage room",
    "reception",
    "bathroom",
    "classroom",
    "copy room",
    "music room",
    "first aid room",
    "nursery",
    "studio",
    "archive",
    "canteen",
];

/// The building of the demo, 43 m by 30 m: corridors in a ring, seven rooms, and two lobbies that
/// look exactly alike, half a turn apart.
pub fn demo_building() -> World {
    let mut plan = Plan::default();
    plan.corridor("hallway", Rect::new([0.0, 0.0], [32.0, 2.2]));
    plan.corridor("hallway", Rect::new([0.0, 14.0], [32.0, 16.2]));
    plan.corridor("hallway", Rect::new([0.0, 0.0], [2.2, 16.2]));
    plan.corridor("hallway", Rect::new([29.8, 0.0], [32.0, 16.2]));
    plan.room("elevator lobby", Rect::new([-5.4, 5.0], [-WALL_M, 11.2]));
    plan.room("elevator lobby", Rect::new([32.0 + WALL_M, 5.0], [37.4, 11.2]));
    plan.room("gym", Rect::new([4.0, -7.4], [13.0, -WALL_M]));
    plan.room("lecture hall", Rect::new([18.0, -6.6], [28.0, -WALL_M]));
    plan.room("kitchen", Rect::new([2.4, 2.4], [9.4, 7.8]));
    plan.room("mail room", Rect::new([21.5, 2.4], [29.6, 8.0]));
    plan.room("library", Rect::new([11.0, 6.4], [20.0, 13.8]));
    plan.room("cafe", Rect::new([20.5, 16.4], [29.0, 22.0]));
    plan.room("workshop", Rect::new([3.5, 16.4], [13.5, 21.6]));
    plan.door([0.0, 8.1], [-WALL_M, 8.1], 3.2);
    plan.door([32.0, 8.1], [32.0 + WALL_M, 8.1], 3.2);
    plan.door([9.0, 0.0], [9.0, -WALL_M], 1.6);
    plan.door([21.0, 0.0], [21.0, -WALL_M], 1.2);
    plan.door([6.8, 2.2], [6.8, 2.4], 1.1);
    plan.door([29.8, 5.2], [29.6, 5.2], 1.1);
    plan.door([14.2, 14.0], [14.2, 13.8], 1.4);
    plan.door([24.5, 16.2], [24.5, 16.4], 1.8);
    plan.door([6.0, 16.2], [6.0, 16.4], 1.1);
    // Half a turn about the building's middle (16, 8.1) maps one lobby onto the other.
    for (x, y, w, h) in [(-4.2, 6.2, 0.5, 0.5), (-4.2, 10.0, 0.5, 0.5), (-1.4, 10.9, 1.6, 0.45)] {
        plan.block([x, y], [w, h], 0.0);
        plan.block([32.0 - x, 16.2 - y], [w, h], 0.0);
    }
    // Pillars, lockers and radiators give the corridors places of their own.
    for (x, y, w, h) in
        [(12.0, 0.15, 1.4, 0.3), (26.4, 2.1, 0.9, 0.2), (31.8, 13.1, 0.4, 0.9), (17.0, 16.05, 2.0, 0.3)]
    {
        plan.block([x, y], [w, h], 0.0);
    }
    let mut draw = Draw::new(7, 0);
    let first_room = 4;
    for k in first_room + 2..plan.rooms.len() {
        furnish(&mut plan, k, &mut draw);
    }
    plan.build()
}

/// How a random office is drawn.
#[derive(Clone, Debug, PartialEq)]
pub struct OfficeStyle {
    /// Length of the ring of corridors, from and to, metres.
    pub length_m: (f64, f64),
    /// Its width, from and to, metres.
    pub width_m: (f64, f64),
    /// Width of a room along its corridor, from and to, metres.
    pub room_m: (f64, f64),
    /// Pieces of furniture per 10 m² of a room.
    pub clutter: f64,
}

impl Default for OfficeStyle {
    fn default() -> Self {
        Self { length_m: (26.0, 46.0), width_m: (15.0, 26.0), room_m: (3.2, 8.5), clutter: 1.2 }
    }
}

/// An office drawn from a seed: a ring of corridors, now and then with one across, and rooms on
/// both sides.
pub fn random_office(style: &OfficeStyle, seed: u64) -> World {
    let mut draw = Draw::new(seed, 1);
    let mut plan = Plan::default();
    let (length, width) = (draw.within(style.length_m), draw.within(style.width_m));
    let c = draw.within((1.7, 2.7));
    let bars = [
        Rect::new([0.0, 0.0], [length, c]),
        Rect::new([0.0, width - c], [length, width]),
        Rect::new([0.0, 0.0], [c, width]),
        Rect::new([length - c, 0.0], [length, width]),
    ];
    for bar in bars {
        plan.corridor("hallway", bar);
    }
    let mut inner = vec![(c + WALL_M, length - c - WALL_M)];
    if draw.chance(0.5) {
        let x = draw.within((0.35, 0.65)) * length;
        plan.corridor("hallway", Rect::new([x, 0.0], [x + c, width]));
        inner = vec![(c + WALL_M, x - WALL_M), (x + c + WALL_M, length - c - WALL_M)];
    }
    let first_room = plan.rooms.len();
    let mut names = Names { left: Vec::new() };
    let depth = |draw: &mut Draw| draw.within((4.0, 8.0));
    // Rows of rooms: where the corridor's wall is, which way they go, from where to where.
    let split = draw.within((0.4, 0.6)) * (width - 2.0 * c - 2.0 * WALL_M) + c + WALL_M;
    for &(from, to) in &inner {
        let (south, north) = (split - WALL_M / 2.0 - c - WALL_M, width - c - WALL_M - split - WALL_M / 2.0);
        row(&mut plan, style, &mut draw, &mut names, [c, 1.0, from, to, south], false);
        row(&mut plan, style, &mut draw, &mut names, [width - c, -1.0, from, to, north], false);
    }
    let d = depth(&mut draw);
    row(&mut plan, style, &mut draw, &mut names, [0.0, -1.0, 0.0, length, d], false);
    let d = depth(&mut draw);
    row(&mut plan, style, &mut draw, &mut names, [width, 1.0, 0.0, length, d], false);
    let d = depth(&mut draw);
    row(&mut plan, style, &mut draw, &mut names, [0.0, -1.0, 0.0, width, d], true);
    let d = depth(&mut draw);
    row(&mut plan, style, &mut draw, &mut names, [length, 1.0, 0.0, width, d], true);
    for k in first_room..plan.rooms.len() {
        for _ in 0..pieces(style.clutter, &plan.rooms[k].1) {
            furnish_once(&mut plan, k, &mut draw);
        }
    }
    plan.build()
}

/// Names in a random order, each once before any comes again.
struct Names {
    left: Vec<&'static str>,
}

impl Names {
    fn next(&mut self, draw: &mut Draw) -> &'static str {
        if self.left.is_empty() {
            self.left = NAMES.to_vec();
        }
        let k = draw.below(self.left.len());
        self.left.swap_remove(k)
    }
}

/// A row of rooms along one side of a corridor: `[wall, outward ±1, from, to, depth]`, metres;
/// `upright` rows run along y. Some rooms are left out: bare wall.
fn row(
    plan: &mut Plan,
    style: &OfficeStyle,
    draw: &mut Draw,
    names: &mut Names,
    at: [f64; 5],
    upright: bool,
) {
    let [wall, outward, from, to, depth] = at;
    let point = |along: f64, across: f64| if upright { [across, along] } else { [along, across] };
    let mut start = from;
    while to - start >= style.room_m.0 {
        let mut end = start + draw.within(style.room_m);
        if to - end < style.room_m.0 + WALL_M {
            end = to;
        }
        let (near, far) = (wall + outward * WALL_M, wall + outward * (WALL_M + depth));
        if draw.chance(0.85) {
            let name = names.next(draw);
            plan.room(name, Rect::new(point(start, near), point(end, far)));
            let width_m = draw.within((0.95, 1.5));
            let door = start + draw.within((0.25, 0.75)) * (end - start);
            plan.door(point(door, wall), point(door, near), width_m);
        }
        start = end + WALL_M;
    }
}

pub(crate) fn pieces(per_10_m2: f64, area: &Rect) -> usize {
    ((area.x1_m - area.x0_m) * (area.y1_m - area.y0_m) / 10.0 * per_10_m2).round() as usize
}

/// Puts furniture where it bars no way of the room `k`.
fn furnish(plan: &mut Plan, k: usize, draw: &mut Draw) {
    for _ in 0..pieces(1.2, &plan.rooms[k].1) {
        furnish_once(plan, k, draw);
    }
}

/// One piece, against a wall or free; given up if it would bar the way from door to middle.
pub(crate) fn furnish_once(plan: &mut Plan, k: usize, draw: &mut Draw) {
    let (_, area, _, spot) = plan.rooms[k].clone();
    let size_m = [draw.within((0.4, 1.8)), draw.within((0.35, 0.8))];
    let reach_m = size_m[0].hypot(size_m[1]) / 2.0;
    let free = draw.chance(0.35);
    let x = draw.within((area.x0_m + reach_m, area.x1_m - reach_m));
    let y = draw.within((area.y0_m + reach_m, area.y1_m - reach_m));
    let (centre, yaw_rad) = if free {
        ([x, y], draw.within((0.0, 3.1)))
    } else {
        let depth_m = size_m[1] / 2.0;
        match draw.below(4) {
            0 => ([x, area.y0_m + depth_m], 0.0),
            1 => ([x, area.y1_m - depth_m], 0.0),
            2 => ([area.x0_m + depth_m, y], std::f64::consts::FRAC_PI_2),
            _ => ([area.x1_m - depth_m, y], std::f64::consts::FRAC_PI_2),
        }
    };
    let inside = |p: &&Point| area.contains(**p, 0.0);
    let lanes = plan.waypoints.iter().filter(inside).map(|&door| Segment { a: door, b: spot });
    let barred = lanes.map(|lane| lane.distance_m(centre)).fold(distance_m(spot, centre), f64::min);
    if barred > reach_m + 0.55 {
        plan.block(centre, size_m, yaw_rad);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn all_rooms_in_reach(world: &World) {
        for room in &world.rooms {
            assert!(world.route(world.rooms[0].spot, room.spot).is_some(), "no way to the {}", room.name);
        }
    }

    #[test]
    fn every_room_of_the_demo_can_be_reached() {
        let world = demo_building();
        assert!(world.rooms.len() >= 12);
        all_rooms_in_reach(&world);
    }

    #[test]
    fn the_two_lobbies_look_alike() {
        let world = demo_building();
        for k in 0..90 {
            let bearing = f64::from(k) * 0.07;
            let half_turn = bearing + std::f64::consts::PI;
            let a = world.cast([-2.5, 8.0], bearing, 30.0);
            let b = world.cast([34.5, 8.2], half_turn, 30.0);
            // Through the opening the corridors may differ; inside they may not.
            if let (Some(a), Some(b)) = (a, b)
                && a.max(b) < 2.5
            {
                assert!((a - b).abs() < 1e-6, "bearing {bearing}: {a} and {b}");
            }
        }
    }

    #[test]
    fn random_offices_have_rooms_that_can_be_reached_and_repeat_by_seed() {
        for seed in 0..12 {
            let world = random_office(&OfficeStyle::default(), seed);
            assert!(world.rooms.len() >= 12, "seed {seed}: {} rooms", world.rooms.len());
            all_rooms_in_reach(&world);
            assert_eq!(world.walls, random_office(&OfficeStyle::default(), seed).walls);
        }
    }
}
