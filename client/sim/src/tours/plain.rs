//! Buildings without look-alikes, and one that is its own half turn.

use super::design::{Design, Walk};
use super::stamp::Quarter;
use super::unit::WALL_M;
use super::words::Names;
use super::{PLANS, Tour};
use crate::building::{demo_building, furnish_once, pieces};
use crate::geom::{Rect, distance_m};
use crate::random::Draw;
use crate::storey::Storey;
use crate::world::{Plan, RoomKind, World};
use crate::{Fault, FloorPlan, OfficeStyle, Scenario, SimError};
use std::collections::BTreeSet;
use toponym_proto::Pose;

/// Rooms on a tour of an office, and how many of them are visited once more in the end: whatever went wrong on
/// the way shows there.
const STOPS: usize = 8;
const AGAIN: usize = 4;
/// The guide says nothing for so long on the second day.
const LATE_M: f64 = 14.0;

/// An office and what goes wrong in it: `clean`, `slip`, `unsigned`, `break`.
pub(super) fn office(name: &'static str, seed: u64) -> Result<Tour, SimError> {
    let mut draw = Draw::new(seed, 4);
    let scenario = Scenario::office(&OfficeStyle::default(), STOPS, seed);
    let tour = &scenario.tour;
    let mut walk = Walk::from_room(&scenario.world, *tour.first().ok_or(SimError::NoTour)?)?;
    for &room in tour[1..].iter().chain(tour.iter().take(AGAIN)) {
        walk.to(room)?;
    }
    let (start, legs) = (walk.start, walk.legs);
    let faults = match name {
        "slip" if draw.chance(0.5) => {
            let turn = draw.within((40.0, 140.0)).round().to_radians();
            vec![Fault::SlipTurn { turn_rad: if draw.chance(0.5) { turn } else { -turn } }]
        }
        "slip" => vec![Fault::SlipAhead { way_m: (draw.within((1.0, 4.0)) * 10.0).round() / 10.0 }],
        "unsigned" => vec![Fault::Unsigned],
        "break" => vec![Fault::Break],
        _ => Vec::new(),
    };
    let design = Design { faults, ..Design::plain(scenario.world, start, legs) };
    Ok(design.tour(name, seed).0)
}

/// Rooms on a tour of a floor plan, of which [`AGAIN`] are visited once more; mostly near others, …
const PLAN_STOPS: usize = 10;
/// … with this share.
const NEXT_BY: f64 = 0.7;
/// Share of the rooms whose name another room on the tour bears, too, that keep it.
const ALIASED: f64 = 0.25;

/// A real floor plan, some of its rooms visited once more in the end: `plans`.
pub(super) fn plan(plan: &FloorPlan, seed: u64) -> Result<Tour, SimError> {
    let Storey { world, stops } = Storey::new(plan, &mut Draw::new(seed, 3));
    if stops.len() < 2 {
        return Err(SimError::TooSmall(stops.len()));
    }
    let mut draw = Draw::new(seed, 2);
    let tour = near_each_other(&world, stops, &mut draw);
    let (world, more) = renamed(world, &tour, &mut draw);
    let mut walk = Walk::from_room(&world, tour[0])?;
    for &room in tour[1..].iter().chain(tour.iter().take(AGAIN)) {
        walk.to(room)?;
    }
    let (start, legs) = (walk.start, walk.legs);
    let mut tour = Design::plain(world, start, legs).tour(PLANS, seed).0;
    tour.vocabulary.extend(more);
    tour.vocabulary.sort();
    tour.vocabulary.dedup();
    Ok(tour)
}

/// Rooms to visit, as people show a building: mostly one by the last, at times one far off.
fn near_each_other(world: &World, mut left: Vec<usize>, draw: &mut Draw) -> Vec<usize> {
    let mut tour: Vec<usize> = vec![left.swap_remove(draw.below(left.len()))];
    while tour.len() < PLAN_STOPS && !left.is_empty() {
        let from = world.rooms[tour[draw.below(tour.len())]].area.centre();
        let far_m = |k: &usize| distance_m(world.rooms[left[*k]].area.centre(), from);
        let nearest = || (0..left.len()).min_by(|a, b| far_m(a).total_cmp(&far_m(b))).unwrap_or_default();
        let next = if draw.chance(NEXT_BY) { nearest() } else { draw.below(left.len()) };
        tour.push(left.swap_remove(next));
    }
    tour
}

/// The rooms of a tour with names that mostly are theirs alone, and all other rooms without; beside them the names that
/// were left out.
fn renamed(mut world: World, tour: &[usize], draw: &mut Draw) -> (World, Vec<String>) {
    let mut fresh = Names::new(draw);
    let mut used: BTreeSet<String> = BTreeSet::new();
    for &room in tour {
        let name = world.rooms[room].name.clone();
        if !name.is_empty() && (!used.contains(&name) || draw.chance(ALIASED)) {
            used.insert(name);
            continue;
        }
        let name = std::iter::from_fn(|| Some(fresh.next()))
            .take(64)
            .find(|n| !used.contains(*n))
            .unwrap_or_default();
        used.insert(name.to_owned());
        name.clone_into(&mut world.rooms[room].name);
    }
    let mut more = Vec::new();
    for (k, room) in world.rooms.iter_mut().enumerate() {
        if room.kind == RoomKind::Room && !tour.contains(&k) {
            more.push(std::mem::take(&mut room.name));
        }
    }
    more.retain(|name| !name.is_empty() && !used.contains(name));
    (world, more)
}

/// Half of a ring of corridors with rooms: its half turn makes it whole.
fn half(length_m: f64, width_m: f64, draw: &mut Draw) -> Plan {
    let mut plan = Plan::default();
    let wide_m = draw.within((1.9, 2.5));
    plan.corridor("", Rect::new([0.0, 0.0], [length_m, wide_m]));
    plan.corridor("", Rect::new([0.0, 0.0], [wide_m, width_m]));
    // A lobby to the west, rooms to the south.
    let high = width_m * draw.within((0.62, 0.7));
    let low = high - draw.within((4.5, 6.0));
    plan.room("", Rect::new([-WALL_M - draw.within((4.0, 5.5)), low], [-WALL_M, high]));
    let y = f64::midpoint(low, high);
    plan.door([0.0, y], [-WALL_M, y], draw.within((1.2, 2.4)));
    let mut x = draw.within((0.0, 2.0));
    let deep_m = draw.within((4.5, 6.5));
    while length_m - x > 4.0 {
        let end = (x + draw.within((4.5, 8.0))).min(length_m);
        plan.room("", Rect::new([x, -WALL_M - deep_m], [end, -WALL_M]));
        let at = x + draw.within((0.3, 0.7)) * (end - x);
        plan.door([at, 0.0], [at, -WALL_M], 1.1);
        x = end + WALL_M;
    }
    for k in 2..plan.rooms.len() {
        for _ in 0..pieces(1.2, &plan.rooms[k].1).max(3) {
            furnish_once(&mut plan, k, draw);
        }
    }
    plan
}

/// A building that is its own half turn, the rooms to stop at in their order round it, and that turn.
fn half_turned(draw: &mut Draw) -> (World, Vec<usize>, Quarter) {
    let (length_m, width_m) = (draw.within((20.0, 28.0)), draw.within((12.0, 16.0)));
    let half = half(length_m, width_m, draw);
    let mut names = Names::new(draw);
    let turn = Quarter { turns: 2, by_m: [length_m, width_m] };
    let mut plan = Plan::default();
    for at in [Quarter::default(), turn] {
        let named: Vec<String> = (0..half.rooms.len())
            .map(|k| match k {
                0 | 1 => "hallway".to_owned(),
                2 => "elevator lobby".to_owned(),
                _ => names.next().to_owned(),
            })
            .collect();
        plan.stamp(&half, &at, |k| named[k].clone());
    }
    let (world, half_rooms) = (plan.build(), half.rooms.len());
    let rooms = (0..world.rooms.len()).filter(|k| k % half_rooms >= 2).collect();
    (world, rooms, turn)
}

/// The demo's building, of which the lobbies and what one sees of the corridors from many places are their own
/// half turn, and the rest is not.
fn demo() -> (World, Vec<usize>, Quarter) {
    let world = demo_building();
    let round =
        ["elevator lobby", "gym", "lecture hall", "mail room", "", "cafe", "library", "workshop", "kitchen"];
    let other_lobby = world.rooms.iter().rposition(|r| r.name == "elevator lobby");
    let stop = |name: &&str| if name.is_empty() { other_lobby } else { world.room(name) };
    let rooms = round.iter().filter_map(stop).collect();
    (world, rooms, Quarter { turns: 2, by_m: [32.0, 16.2] })
}

/// A second day that starts anywhere on the first one's map: `start`. In one of two seeds the building is its own
/// half turn, in the other it is the demo's, which only looks so here and there.
pub(super) fn start(name: &'static str, seed: u64) -> Result<Tour, SimError> {
    let mut draw = Draw::new(seed, 4);
    let (world, rooms, turn) = if draw.chance(0.5) { half_turned(&mut draw) } else { demo() };
    let from = draw.below(rooms.len());
    let mut first = Walk::from_room(&world, rooms[from])?;
    // Every room once, each half in its order: round the ring.
    for k in 1..=rooms.len() {
        first.to(rooms[(from + k) % rooms.len()])?;
    }
    // Spots, doors and corridors: all the floor that a route leads over.
    let mut second = Walk::from_waypoint(&world, draw.below(world.waypoints.len()));
    for _ in 0..5 {
        second.to(rooms[draw.below(rooms.len())])?;
    }
    let days = vec![(first.start, first.legs), (second.start, second.legs)];
    let returns =
        vec![vec![("as it is".to_owned(), Pose::default()), ("half a turn on".to_owned(), turn.pose())]];
    let plain = Design::plain(world, [0.0, 0.0], Vec::new());
    Ok(Design { days, returns, late_m: LATE_M, ..plain }.tour(name, seed).0)
}
