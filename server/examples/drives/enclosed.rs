//! Whether places of maps are of one room, by how far apart they lie and by what is seen from either.

use crate::faults::buildings;
use crate::rooms::{contains, drawn, rooms};
use std::collections::BTreeMap;
use std::path::Path;
use toponym_core::scan::enclosure::{Enclosure, of_one_room};
use toponym_core::{Config, Mapper, Pose2};
use toponym_proto::Message;
use toponym_server::convert::event;

/// Pairs farther apart are not looked at.
const FAR_M: f64 = 12.0;

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
}

/// Tables and the constants that explain them best.
pub fn report(plans: Option<&Path>, seeds: std::ops::Range<u64>) {
    let plans = plans.map(buildings).unwrap_or_default();
    let (mut pairs, mut shapes) = (Vec::new(), Vec::new());
    for seed in seeds {
        let (_, scenario) = drawn(&plans, seed);
        let Ok(recording) = scenario.run() else { continue };
        let truth: BTreeMap<i64, Pose2> =
            recording.truth.scans.iter().map(|(s, p)| (s.ns, Pose2::new(p.x_m, p.y_m, p.yaw_rad))).collect();
        let outlines = rooms(&scenario);
        let is_way: Vec<bool> = scenario
            .world
            .rooms
            .iter()
            .map(|r| ["corridor", "hall"].iter().any(|w| r.name.to_lowercase().contains(w)))
            .collect();
        let mut mapper = Mapper::new(Config::default());
        for message in recording.messages.iter().filter(|m| !matches!(m, Message::Say(_))) {
            mapper.step(event(message.clone()));
        }
        let at = |p: &toponym_core::graph::Place| {
            let pose = *truth.get(&p.stamp_ns)?;
            let room = outlines.iter().position(|room| contains(room, pose.x_m, pose.y_m))?;
            Some(At { pose, enclosure: p.enclosure.clone(), room })
        };
        let places: Vec<At> = mapper.graph().places().iter().filter_map(|p| at(p)).collect();
        shapes.extend(places.iter().map(|p| (p.enclosure.elongation(), is_way[p.room])));
        for (k, a) in places.iter().enumerate() {
            for b in &places[..k] {
                let distance_m = a.pose.distance_m(&b.pose);
                if distance_m < FAR_M {
                    let held = of_one_room(Some(&a.enclosure), Some(&b.enclosure), &a.pose.between(&b.pose));
                    pairs.extend(held.map(|held| Pair { distance_m, held, is_one: a.room == b.room }));
                }
            }
        }
    }
    println!("{} pairs; share of one room by distance (rows, 1 m) and what is seen (quarters)", pairs.len());
    for row in 0..FAR_M as usize {
        let cell = |column: usize| {
            let of = |p: &&Pair| p.distance_m as usize == row && ((p.held * 3.999) as usize) == column;
            let (n, one) =
                pairs.iter().filter(of).fold((0, 0), |(n, one), p| (n + 1, one + usize::from(p.is_one)));
            format!("{:.2} of {n:6}", f64::from(one as u32) / f64::from(n.max(1) as u32))
        };
        println!("{row:3} m  {}  {}  {}  {}", cell(0), cell(1), cell(2), cell(3));
    }
    let mut best = (f64::INFINITY, 0.0, 0.0, 0.0);
    let p = |pair: &Pair, kernel_m: f64, leak: f64, most: f64| {
        most * (-0.5 * (pair.distance_m / kernel_m).powi(2)).exp() * (leak + (1.0 - leak) * pair.held)
    };
    let cost = |kernel_m: f64, leak: f64, most: f64| {
        let of = |pair: &Pair| {
            let p = p(pair, kernel_m, leak, most).clamp(1e-3, 0.999);
            -(if pair.is_one { p } else { 1.0 - p }).ln()
        };
        pairs.iter().map(of).sum::<f64>() / pairs.len().max(1) as f64
    };
    for kernel_m in [2.0, 2.5, 3.0, 3.5, 4.0, 5.0, 6.0, 8.0, 12.0] {
        for leak in [0.02, 0.05, 0.1, 0.15, 0.2, 0.3, 0.5, 1.0] {
            for most in [0.8, 0.9, 0.95, 1.0] {
                let cost = cost(kernel_m, leak, most);
                if cost < best.0 {
                    best = (cost, kernel_m, leak, most);
                }
            }
        }
    }
    println!("best: {best:?}; by distance alone: {:?}", [2.0, 3.0, 4.0, 6.0].map(|k| cost(k, 1.0, 1.0)));
    println!("share of ways by elongation");
    for k in 0..16 {
        let bin = |s: &&(f64, bool)| ((s.0 - 1.0) * 2.0) as usize == k;
        let (n, ways) = shapes.iter().filter(bin).fold((0, 0), |(n, w), s| (n + 1, w + usize::from(s.1)));
        println!(
            "{:.1}  {:.2} of {n}",
            1.0 + k as f64 / 2.0,
            f64::from(ways as u32) / f64::from(n.max(1) as u32)
        );
    }
}
