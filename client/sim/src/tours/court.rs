//! Suites side by side on a dark court: which of the equal doors did the robot come back to?

use super::Tour;
use super::design::{Design, Return, Walk, first_that_fits};
use super::stamp::Quarter;
use super::unit::{Style, Unit, WALL_M};
use super::words::Names;
use crate::SimError;
use crate::geom::{Point, Rect};
use crate::random::Draw;
use crate::world::Plan;
use std::cmp::Ordering;

/// The court reaches so far beyond what is in use, metres.
const MARGIN_M: f64 = 8.0;
/// Times that a court is drawn again, larger, for wheels to lose their way on.
const TRIES: i32 = 5;
/// But never so large that the robot is in the dark for more than 100 m.
const OUT_MAX_M: f64 = 46.0;
/// By so much each.
const LARGER: f64 = 1.12;

/// What goes on at a court with one row of suites.
struct Kind {
    style: Style,
    /// Suites side by side.
    units: usize,
    /// How far out on to the court.
    out_m: (f64, f64),
    late_m: f64,
    people: usize,
    /// Distance of the look-alikes in standard deviations of the wheels, from and to.
    aim: (f64, f64),
}

fn suite(annex: bool) -> Style {
    Style {
        width_m: (4.3, 4.9),
        front_m: (6.5, 9.0),
        hall_m: Some((5.5, 8.0)),
        sides: 1,
        back_m: (4.5, 6.0),
        annex,
    }
}

fn kind(name: &str) -> Kind {
    let annex = name.ends_with("-decided");
    let court =
        Kind { style: suite(annex), units: 2, out_m: (38.0, 44.0), late_m: 0.0, people: 0, aim: (0.4, 0.95) };
    match name {
        "autonomous" => Kind { people: 1, ..court },
        "twins" | "twins-decided" => {
            let style = Style { front_m: (4.0, 5.5), hall_m: Some((8.0, 10.0)), sides: 2, ..suite(annex) };
            Kind { style, late_m: 14.0, aim: (0.6, 1.0), ..court }
        }
        "rows" | "rows-decided" => {
            let style = Style {
                width_m: (3.2, 3.8),
                front_m: (4.5, 5.8),
                hall_m: None,
                sides: 0,
                back_m: (4.0, 5.5),
                annex,
            };
            Kind { style, units: 5, out_m: (24.0, 32.0), late_m: 12.0, aim: (0.6, 1.0), ..court }
        }
        _ => court,
    }
}

/// Names of the rooms of each suite.
fn named(name: &str, unit: &Unit, units: usize, draw: &mut Draw) -> Vec<Vec<String>> {
    let mut names = Names::new(draw);
    let (back, annex) = (unit.back(), unit.annex());
    (0..units)
        .map(|k| {
            let mut rooms: Vec<String> = (0..=annex).map(|_| names.next().to_owned()).collect();
            if back > 1 {
                rooms[1] = "hallway".into();
            }
            match (name, k) {
                ("small", 0) => (rooms[0], rooms[back]) = ("gym".into(), "elevator lobby".into()),
                ("small", _) => (rooms[0], rooms[back]) = Names::decoy(draw),
                ("autonomous", 0) => (rooms[0], rooms[back]) = ("lounge".into(), "lobby".into()),
                ("autonomous", _) => (rooms[0], rooms[back]) = ("lobby".into(), "lounge".into()),
                _ => {}
            }
            if name == "autonomous" {
                rooms[2] = "office".into();
            }
            rooms
        })
        .collect()
}

/// A court with a row of suites: `small`, `autonomous`, `twins`, `rows`.
pub(super) fn row(name: &'static str, seed: u64) -> Result<Tour, SimError> {
    let sizes = (0..TRIES).map(|k| LARGER.powi(k));
    first_that_fits(name, seed, sizes.map(|larger| row_design(name, &kind(name), larger, seed)))
}

fn row_design(name: &'static str, kind: &Kind, larger: f64, seed: u64) -> Result<Design, SimError> {
    let mut draw = Draw::new(seed, 4);
    let unit = Unit::draw(&kind.style, &mut draw);
    let each_m = unit.width_m + WALL_M;
    let whole_m = each_m * kind.units as f64;
    let out_m = (draw.within(kind.out_m) * larger).min(OUT_MAX_M);
    let turned = Quarter::turn(draw.below(4) as u8);
    let mut names = named(name, &unit, kind.units, &mut draw);
    // In the middle of three or more, with a neighbour on either side.
    let home = if kind.units > 2 { 1 + draw.below(kind.units - 2) } else { draw.below(2) };
    if home == 1 && kind.units == 2 {
        names.swap(0, 1);
    }
    let alike: Vec<usize> = if kind.units > 2 { vec![home - 1, home, home + 1] } else { vec![0, 1] };
    let led = alike[draw.below(alike.len())];
    let mut plan = Plan::default();
    let at = |k: usize| turned.after(&Quarter::shift([each_m * k as f64, 0.0]));
    let mut firsts = Vec::new();
    for (k, names) in names.iter().enumerate() {
        firsts.push(unit.put(&mut plan, &at(k), names, &mut draw));
    }
    let court = Rect::new([-MARGIN_M, WALL_M], [whole_m + MARGIN_M, out_m + MARGIN_M]);
    ground(&mut plan, &court, &turned);
    let world = plan.build();
    let door = |k: usize| at(k).point([unit.door[0], unit.door[1] + 0.8]);
    let open: Vec<Point> = excursion(&unit, each_m, (home, led), out_m, &mut draw)
        .into_iter()
        .map(|p| turned.point(p))
        .collect();
    let mut walk = Walk::from_room(&world, firsts[home] + first_stops(&unit, kind)[0])?;
    for stop in &first_stops(&unit, kind)[1..] {
        walk.to(firsts[home] + stop)?;
    }
    walk.across(door(home), &open, door(led), firsts[led])?;
    for stop in later_stops(&unit, kind) {
        walk.to(firsts[led] + stop)?;
    }
    let (start, legs) = (walk.start, walk.legs);
    let door = |k: usize| match k.cmp(&home) {
        Ordering::Equal => "the door it left by",
        _ if kind.units == 2 => "its look-alike",
        Ordering::Less => "the door before it",
        Ordering::Greater => "the door after it",
    };
    let moved = |k: &usize| (door(*k).to_owned(), at(*k).after(&at(led).inverse()).pose());
    let mut returns: Return = vec![moved(&led)];
    returns.extend(alike.iter().filter(|k| **k != led).map(moved));
    returns[0].1 = toponym_proto::Pose::default();
    let aim = draw.within(kind.aim);
    Ok(Design {
        returns: vec![returns],
        late_m: kind.late_m,
        aim,
        people: kind.people,
        ..Design::plain(world, start, legs)
    })
}

/// A court in the open, dark all over and half into the doorways to it: not all through, or rays
/// that strike the wall beside a door would meet the dark at the same range.
fn ground(plan: &mut Plan, court: &Rect, turned: &Quarter) {
    let mut ground = Plan::default();
    ground.room("courtyard", *court);
    let half_m = WALL_M / 2.0;
    ground.dark(Rect::new(
        [court.x0_m - half_m, court.y0_m - half_m],
        [court.x1_m + half_m, court.y1_m + half_m],
    ));
    plan.stamp(&ground, turned, |_| "courtyard".into());
}

/// Rooms visited before going out, the last one at the door; the first is the start.
fn first_stops(unit: &Unit, kind: &Kind) -> Vec<usize> {
    let mut stops = vec![unit.back()];
    if kind.style.hall_m.is_some() {
        stops.push(2);
    }
    if kind.style.annex {
        stops.splice(0..0, [0, unit.annex()]);
    }
    stops.push(0);
    stops
}

/// Rooms visited after coming back, which is to the front room.
fn later_stops(unit: &Unit, kind: &Kind) -> Vec<usize> {
    let mut stops = if kind.style.hall_m.is_some() {
        vec![2, unit.back(), 0, 2, unit.back()]
    } else {
        vec![1, 0, 1, 0, 1, 0, 1]
    };
    if kind.style.annex {
        stops.push(unit.annex());
    }
    stops
}

/// Out on to the court and back, not quite straight.
fn excursion(
    unit: &Unit,
    each_m: f64,
    (from, to): (usize, usize),
    out_m: f64,
    draw: &mut Draw,
) -> Vec<Point> {
    let side = if draw.chance(0.5) { 1.0 } else { -1.0 };
    let mut aside = |low: f64, high: f64| side * draw.within((low, high));
    let [a, b] = [from, to].map(|k| unit.door[0] + each_m * k as f64);
    vec![
        [a + aside(0.5, 2.0), 0.5 * out_m],
        [a + aside(1.0, 3.0), out_m],
        [b + aside(3.5, 6.0), out_m - 1.5],
        [b + aside(1.0, 4.0), 0.5 * out_m],
        [b, 4.0],
    ]
}

/// On its way to where look-alikes are the robot crosses a large court so many times more, at most.
const LARGE_TURNS: usize = 3;

/// Three buildings at one court, two of them with a look-alike beside them: `large`.
pub(super) fn large(name: &'static str, seed: u64) -> Result<Tour, SimError> {
    first_that_fits(name, seed, (1..=LARGE_TURNS).map(|turns| large_design(turns, seed)))
}

/// A suite put somewhere.
struct Put {
    at: Quarter,
    door: Point,
    first: usize,
    back: usize,
}

const SOUTH: [[&str; 4]; 2] =
    [["entrance", "hallway", "office", "elevator lobby"], ["entrance", "hallway", "library", "cafeteria"]];
const EAST: [[&str; 4]; 2] =
    [["cafeteria", "hallway", "workshop", "lobby"], ["lecture hall", "hallway", "office", "lobby"]];
const NORTH: [&str; 4] = ["lobby", "hallway", "cafeteria", "gym"];

fn large_design(turns: usize, seed: u64) -> Result<Design, SimError> {
    let mut draw = Draw::new(seed, 4);
    let units: Vec<Unit> = (0..3).map(|_| Unit::draw(&suite(false), &mut draw)).collect();
    let size = [draw.within((32.0, 38.0)), draw.within((32.0, 38.0))];
    let turned = Quarter::turn(draw.below(4) as u8);
    let each = |k: usize| units[k].width_m + WALL_M;
    let mut plan = Plan::default();
    let mut put = |plan: &mut Plan, unit: usize, at: Quarter, names: &[&str]| {
        let names: Vec<String> = names.iter().map(|n| (*n).to_owned()).collect();
        let at = turned.after(&at);
        let first = units[unit].put(plan, &at, &names, &mut draw);
        let door = at.point([units[unit].door[0], units[unit].door[1] + 0.8]);
        Put { at, door, first, back: units[unit].back() }
    };
    let south: Vec<Put> = (0..2)
        .map(|k| put(&mut plan, 0, Quarter::shift([3.0 + each(0) * k as f64, 0.0]), &SOUTH[k]))
        .collect();
    let east: Vec<Put> = (0..2)
        .map(|k| {
            let by_m = [size[0] + WALL_M, 3.0 + each(1) * k as f64];
            put(&mut plan, 1, Quarter { turns: 1, by_m }, &EAST[k])
        })
        .collect();
    let by_m = [each(2) + 4.0, size[1] + WALL_M];
    let north = put(&mut plan, 2, Quarter { turns: 2, by_m }, &NORTH);
    ground(&mut plan, &Rect::new([0.0, WALL_M], size), &turned);
    let world = plan.build();
    let (from, led, other, last) = (draw.below(2), draw.below(2), draw.below(2), draw.below(2));
    let mut walk = Walk::from_room(&world, south[from].first + south[from].back)?;
    walk.to(south[from].first + 2)?;
    let visits = [&south[from], &north, &south[led], &east[other], &north, &east[last]];
    for (k, pair) in visits.windows(2).enumerate() {
        let (out, into) = (pair[0], pair[1]);
        walk.to(out.first)?;
        let open: Vec<Point> = match k {
            1 => to_and_fro(1, turns, size, &mut draw),
            4 => to_and_fro(0, turns, size, &mut draw),
            _ => vec![[0, 1].map(|axis| size[axis] * draw.within((0.35, 0.6)))],
        };
        let open: Vec<Point> = open.into_iter().map(|p| turned.point(p)).collect();
        walk.across(out.door, &open, into.door, into.first)?;
        walk.to(into.first + 2)?;
        walk.to(into.first + into.back)?;
    }
    // So that the last return has room to show.
    for room in [0, 2, east[last].back] {
        walk.to(east[last].first + room)?;
    }
    let (start, legs) = (walk.start, walk.legs);
    let alike = |side: &str, all: &[Put], before: usize, truth: usize| -> Return {
        let moved = all[1 - truth].at.after(&all[truth].at.inverse()).pose();
        let which = |k| if k == before { "as before" } else { "its look-alike" };
        let name = |k: usize| format!("{side}, {}", which(k));
        vec![(name(truth), toponym_proto::Pose::default()), (name(1 - truth), moved)]
    };
    let sure = || vec![(String::new(), toponym_proto::Pose::default())];
    let aim = draw.within((0.35, 0.9));
    // To the north; back south; to the east; north again; back east.
    let returns =
        vec![sure(), alike("south", &south, from, led), sure(), sure(), alike("east", &east, other, last)];
    Ok(Design { returns, aim, ..Design::plain(world, start, legs) })
}

/// Across a court and back along an axis, from the far side to the near one (`y`), or from there
/// on (`x`): what costs the wheels their bearings aside of it.
fn to_and_fro(axis: usize, turns: usize, size: [f64; 2], draw: &mut Draw) -> Vec<Point> {
    let mut points = Vec::new();
    // South is near on the y axis, east on the x axis: the last leg leads there.
    let (near, far) = if axis == 1 { (0.15, 0.85) } else { (0.85, 0.15) };
    for k in 0..turns {
        let aside = draw.within((0.35, 0.65)) + 0.05 * k as f64;
        for along in [far, near] {
            let mut p = [aside * size[0], aside * size[1]];
            p[axis] = along * size[axis];
            points.push(p);
        }
        let mut p = [0.0, 0.0];
        p[axis] = far * size[axis];
        p[1 - axis] = (aside + 0.08) * size[1 - axis];
        points.push(p);
    }
    points
}
