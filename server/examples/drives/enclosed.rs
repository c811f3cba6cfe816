//! Whether places of maps are of one room, by how far apart they lie and by what is seen from either; and what shape the
//! floor of ways is.

use crate::faults::buildings;
use crate::rooms::{contains, drawn, rooms};
use std::collections::BTreeMap;
use std::path::Path;
use toponym_core::graph::Place;
use toponym_core::scan::enclosure::{Enclosure, of_one_room};
use toponym_core::{Config, Mapper, Pose2};
use toponym_proto::Message;
use toponym_server::convert::event;
use toponym_sim::{RoomKind, Scenario};

/// Pairs farther apart are not looked at.
const FAR_M: f64 = 12.0;
/// Columns of the table: by how surely either holds the other.
const COLUMNS: usize = 4;

/// A pair of places.
struct Pair {
    distance_m: f64,
    held: f64,
    is_one: bool,
}

/// A place, where it truly is.
struct At {
    pose: Pose2,
    enclosure: Enclosure,
    room: usize,
    is_way: bool,
}

/// Both tables.
pub fn report(plans: Option<&Path>, seeds: std::ops::Range<u64>) {
    let plans = plans.map(buildings).unwrap_or_default();
    let drives: Vec<Vec<At>> = seeds.map(|seed| driven(&drawn(&plans, seed).1)).collect();
    let pairs: Vec<Pair> = drives.iter().flat_map(|places| near(places)).collect();
    println!("share of pairs that are of one room: by distance, and by how surely either holds the other");
    for row in 0..FAR_M as usize {
        let of = |column: usize| {
            let held = move |p: &&Pair| ((p.held * COLUMNS as f64) as usize).min(COLUMNS - 1) == column;
            let cell = pairs.iter().filter(move |p| p.distance_m as usize == row).filter(held);
            share(cell.map(|p| p.is_one))
        };
        println!("{row:3} m  {}", (0..COLUMNS).map(of).collect::<Vec<_>>().join("  "));
    }
    println!("share of places that are in ways: by length over width of what is enclosed");
    let places = || drives.iter().flatten();
    for bin in 0..12 {
        let is_in = |p: &&At| ((p.enclosure.elongation() - 1.0) * 2.0) as usize == bin;
        println!("{:3.1}  {}", 1.0 + bin as f64 / 2.0, share(places().filter(is_in).map(|p| p.is_way)));
    }
}

fn share(of: impl Iterator<Item = bool>) -> String {
    let (all, are) = of.fold((0_u32, 0_u32), |(all, are), is| (all + 1, are + u32::from(is)));
    format!("{:.2} of {all:6}", f64::from(are) / f64::from(all.max(1)))
}

/// The places of a drive that are in a room.
fn driven(scenario: &Scenario) -> Vec<At> {
    let Ok(recording) = scenario.run() else { return Vec::new() };
    let truth: BTreeMap<i64, Pose2> =
        recording.truth.scans.iter().map(|(s, p)| (s.ns, Pose2::new(p.x_m, p.y_m, p.yaw_rad))).collect();
    let mut mapper = Mapper::new(Config::default());
    for message in recording.messages.iter().filter(|m| !matches!(m, Message::Say(_))) {
        mapper.step(event(message.clone()));
    }
    let outlines = rooms(scenario);
    let at = |p: &Place| {
        let pose = *truth.get(&p.stamp_ns)?;
        let room = outlines.iter().position(|room| contains(room, pose.x_m, pose.y_m))?;
        let is_way = scenario.world.rooms[room].kind == RoomKind::Corridor;
        Some(At { pose, enclosure: p.enclosure.clone(), room, is_way })
    };
    mapper.graph().places().iter().filter_map(|p| at(p)).collect()
}

/// Its pairs of near places, of which either sees where the other is.
fn near(places: &[At]) -> Vec<Pair> {
    let of = |a: &At, b: &At| {
        let distance_m = a.pose.distance_m(&b.pose);
        let held = of_one_room(Some(&a.enclosure), Some(&b.enclosure), &a.pose.between(&b.pose))?;
        (distance_m < FAR_M).then_some(Pair { distance_m, held, is_one: a.room == b.room })
    };
    let pairs = places.iter().enumerate().flat_map(|(k, a)| places[..k].iter().map(move |b| (a, b)));
    pairs.filter_map(|(a, b)| of(a, b)).collect()
}
