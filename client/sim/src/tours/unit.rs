//! Suites of rooms behind one door: what is stamped side by side.

use super::stamp::Quarter;
use crate::building::{furnish_once, pieces};
use crate::geom::{Point, Rect};
use crate::random::Draw;
use crate::world::Plan;

/// Thickness of a wall.
pub(super) const WALL_M: f64 = 0.2;
/// Suites drawn until in one of them no furniture bars a way.
const DRAWS: usize = 50;
/// Pieces of furniture per 10 m².
const CLUTTER: f64 = 1.3;

/// Bounds that a suite is drawn within, metres.
pub(super) struct Style {
    /// Along the front.
    pub width_m: (f64, f64),
    /// Of the front room, inwards.
    pub front_m: (f64, f64),
    /// Of the hallway and what lies beside it; none: the back room joins the front one.
    pub hall_m: Option<(f64, f64)>,
    /// Rooms beside the hallway.
    pub sides: usize,
    /// Of the back room.
    pub back_m: (f64, f64),
    /// Whether a last room follows, which is not alike.
    pub annex: bool,
}

/// Rooms behind a door in a front along y = 0, inwards towards −y. Room 0 is the front one; with
/// a hallway, 1 is that, then the sides; the back room is last.
pub(super) struct Unit {
    pub plan: Plan,
    pub width_m: f64,
    /// Middle of the front door, outside.
    pub door: Point,
    /// The room by which one gets to the annex, and the middle of the door to it.
    annex: Option<Point>,
    annex_name: usize,
}

impl Unit {
    /// Draws a suite whose furniture bars no way.
    pub fn draw(style: &Style, draw: &mut Draw) -> Self {
        for _ in 0..DRAWS {
            let unit = Self::drawn(style, draw);
            let world = unit.plan.clone().build();
            let door = world.waypoint_near([unit.door[0], -0.8]);
            let last = unit.annex.map_or(door, |[x, y]| world.waypoint_near([x, y + 0.8]));
            let reached = |to| world.route(door, to).is_some();
            if world.rooms.iter().map(|r| r.spot).chain([last]).all(reached) {
                return unit;
            }
        }
        // The tour will say that there is no way.
        Self::drawn(style, draw)
    }

    fn drawn(style: &Style, draw: &mut Draw) -> Self {
        let mut plan = Plan::default();
        let width_m = draw.within(style.width_m);
        let front_m = draw.within(style.front_m);
        plan.room("", Rect::new([0.0, -front_m], [width_m, 0.0]));
        let door_x = draw.within((0.3, 0.7)) * width_m;
        plan.door([door_x, 0.0], [door_x, WALL_M], 1.2);
        let inner_m = match style.hall_m {
            Some(hall_m) => halls(&mut plan, style, [width_m, front_m, draw.within(hall_m)], draw),
            None => back(&mut plan, [width_m, front_m, draw.within(style.back_m)], draw),
        };
        let annex = style.annex.then(|| [draw.within((0.3, 0.7)) * width_m, -inner_m]);
        // Furniture keeps clear of that door, too.
        plan.waypoints.extend(annex.map(|[x, y]| [x, y + 0.8]));
        for k in 0..plan.rooms.len() {
            if style.hall_m.is_some() && k == 1 {
                continue;
            }
            for _ in 0..pieces(CLUTTER, &plan.rooms[k].1).max(3) {
                furnish_once(&mut plan, k, draw);
            }
        }
        let annex_name = plan.rooms.len();
        Self { plan, width_m, door: [door_x, WALL_M], annex, annex_name }
    }

    /// Index of the back room.
    pub fn back(&self) -> usize {
        self.annex_name - 1
    }

    /// Index of the annex.
    pub fn annex(&self) -> usize {
        self.annex_name
    }

    /// Adds a copy at a place, with an annex of its own if the style has one. Answers the index of
    /// its first room.
    pub fn put(&self, into: &mut Plan, at: &Quarter, names: &[String], draw: &mut Draw) -> usize {
        let name = |k: usize| names.get(k).cloned().unwrap_or_default();
        let mut plan = self.plan.clone();
        if let Some([x, y]) = self.annex {
            let deep_m = draw.within((3.4, 6.5));
            let wall = y - WALL_M;
            plan.room("", Rect::new([0.0, wall - deep_m], [self.width_m, wall]));
            plan.door([x, y], [x, wall], 1.1);
            // Glare in the doorway: nobody sees in from outside.
            plan.dark(Rect::new([x - 0.6, wall + WALL_M / 4.0], [x + 0.6, y - WALL_M / 4.0]));
            let k = plan.rooms.len() - 1;
            for _ in 0..pieces(CLUTTER, &plan.rooms[k].1).max(4) {
                furnish_once(&mut plan, k, draw);
            }
        }
        into.stamp(&plan, at, name)
    }
}

/// A back room behind the front one; answers how deep all is.
fn back(plan: &mut Plan, [width_m, front_m, back_m]: [f64; 3], draw: &mut Draw) -> f64 {
    let (x, top) = (draw.within((0.3, 0.7)) * width_m, -front_m - WALL_M);
    plan.room("", Rect::new([0.0, top - back_m], [width_m, top]));
    plan.door([x, -front_m], [x, top], 1.1);
    front_m + WALL_M + back_m
}

/// A hallway inwards with rooms beside it, and the back room; answers how deep all is.
fn halls(plan: &mut Plan, style: &Style, [width_m, front_m, hall_m]: [f64; 3], draw: &mut Draw) -> f64 {
    let hall_wide_m = draw.within((1.7, 2.0));
    let on_left = draw.chance(0.5);
    let (top, bottom) = (-front_m - WALL_M, -front_m - WALL_M - hall_m);
    let hall = if on_left { (0.0, hall_wide_m) } else { (width_m - hall_wide_m, width_m) };
    let side = if on_left { (hall_wide_m + WALL_M, width_m) } else { (0.0, width_m - hall_wide_m - WALL_M) };
    plan.corridor("", Rect::new([hall.0, bottom], [hall.1, top]));
    let middle = f64::midpoint(hall.0, hall.1);
    plan.door([middle, top + WALL_M], [middle, top], 1.1);
    let (wall, beyond) = if on_left { (hall.1, side.0) } else { (hall.0, side.1) };
    let each_m = (hall_m + WALL_M) / style.sides.max(1) as f64;
    for k in 0..style.sides {
        let high = top - k as f64 * each_m;
        let low = high - each_m + WALL_M;
        plan.room("", Rect::new([side.0, low], [side.1, high]));
        let y = low + draw.within((0.35, 0.65)) * (high - low);
        plan.door([wall, y], [beyond, y], 1.0);
    }
    let back_m = draw.within(style.back_m);
    plan.room("", Rect::new([0.0, bottom - WALL_M - back_m], [width_m, bottom - WALL_M]));
    plan.door([middle, bottom], [middle, bottom - WALL_M], 1.1);
    front_m + WALL_M + hall_m + WALL_M + back_m
}
