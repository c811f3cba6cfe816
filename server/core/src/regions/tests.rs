//! Rooms drawn by hand, and brute force as the oracle of what is clever.

use super::Rooms;
use super::basins::{Parts, basins};
use super::clearance::clearance;
use super::occupancy::grid;
use super::outline::{doubled_area, loops, outline};
use super::raster::Raster;
use super::reach::drivable;
use crate::event::{Laser, Scan};
use crate::geometry::Pose2;
use crate::graph::Place;
use crate::scan::enclosure::Enclosure;
use crate::scan::place::Content;
use crate::scan::sweep::sweep;
use crate::scan::view::View;
use crate::track::places::Chain;
use nalgebra::Matrix3;
use proptest::prelude::*;
use std::f64::consts::TAU;
use std::sync::Arc;

/// A raster of free rectangles: from x, y on, so wide and so high, cells of 0.1 m.
pub fn raster(width: usize, height: usize, rooms: &[(usize, usize, usize, usize)]) -> Raster {
    let mut free = vec![false; width * height];
    for &(x, y, w, h) in rooms {
        for row in y..y + h {
            free[row * width + x..row * width + x + w].fill(true);
        }
    }
    Raster { width, height, resolution_m: 0.1, corner_m: (0.0, 0.0), free }
}

pub fn parts(raster: &Raster) -> (Parts, Vec<f32>) {
    let clearance = clearance(raster);
    (basins(raster, &clearance), clearance)
}

#[test]
fn rooms_end_at_their_doors() {
    // Two rooms of 4 m by 3 m at a corridor of 2 m by 12 m that bends, doors of 0.9 m.
    let doors = [(25, 42, 9, 2), (85, 42, 9, 2)];
    let corridor = [(2, 22, 120, 20), (102, 22, 20, 80)];
    let rooms = [(10, 44, 40, 30), (60, 44, 40, 30)];
    let all: Vec<_> = doors.iter().chain(&corridor).chain(&rooms).copied().collect();
    let raster = raster(130, 110, &all);
    let (parts, clearance) = parts(&raster);
    assert_eq!(parts.cells.len(), 3, "{:?}", parts.peak_m);
    let at = |x: usize, y: usize| parts.of[y * raster.width + x].unwrap();
    assert!(at(30, 60) != at(80, 60) && at(30, 60) != at(20, 30) && at(80, 60) != at(20, 30));
    assert_eq!(at(5, 30), at(110, 100), "a bend parts nothing");
    let at_m = |s: &super::basins::Saddle| (s.of, raster.middle(s.cell), clearance[s.cell]);
    assert_eq!(parts.saddles.len(), 2, "{:?}", parts.saddles.iter().map(at_m).collect::<Vec<_>>());
    for s in &parts.saddles {
        assert!((2.0 * clearance[s.cell] - 0.9).abs() < 0.25, "{}", clearance[s.cell]);
    }
}

#[test]
fn a_map_too_large_for_its_cells_has_larger_ones() {
    let posed =
        |x_m: f64| vec![(Pose2::default(), place(0, 3.0)), (Pose2::new(x_m, x_m, 0.0), place(1, 3.0))];
    let mut plot = Rooms::plot();
    plot.follow(&posed(1_000_000.0));
    assert!(plot.resolution_m() > 200.0, "{}", plot.resolution_m());
    plot.follow(&posed(10.0));
    assert_eq!(plot.grid(), grid(&posed(10.0), 0.1));
    let room = grid(&posed(0.0)[..1], 0.1);
    let count = |wanted: fn(i8) -> bool| room.cells.iter().filter(|&&cell| wanted(cell)).count();
    assert!(
        (60..64).contains(&room.width) && (60..64).contains(&room.height),
        "{} {}",
        room.width,
        room.height
    );
    assert!(count(|cell| cell > 50) >= 80 && count(|cell| (0..50).contains(&cell)) > 2000);
}

#[test]
fn a_corridor_ends_where_a_hall_begins_and_a_niche_is_its_rooms() {
    let raster = raster(250, 140, &[(2, 60, 100, 18), (102, 10, 140, 120), (30, 78, 12, 6)]);
    let (parts, _) = parts(&raster);
    assert_eq!(parts.cells.len(), 2, "{:?}", parts.peak_m);
}

#[test]
fn an_outline_goes_around_all_cells_and_what_stands_in_them() {
    let mut raster = raster(60, 60, &[(5, 5, 50, 40)]);
    for y in 20..30 {
        raster.free[y * 60 + 20..y * 60 + 30].fill(false);
    }
    let cells: Vec<usize> = (0..3600).filter(|&c| raster.free[c]).collect();
    let outline = outline(&raster, &cells, &|cell| raster.free[cell]);
    assert_eq!(outline.polygon_m.len(), 4, "{:?}", outline.polygon_m);
    assert!((area(&outline.polygon_m) - 20.0).abs() < 1e-9);
    assert_eq!(outline.holes_m.len(), 1);
    assert!((area(&outline.holes_m[0]) + 1.0).abs() < 1e-9);
}

#[test]
fn a_robot_drives_through_what_is_wider_than_itself() {
    // Two rooms at a corridor, one by a door of 0.9 m, the other by one of 0.4 m.
    let raster = raster(
        130,
        90,
        &[(2, 12, 120, 20), (25, 32, 9, 3), (85, 32, 4, 3), (10, 35, 40, 30), (60, 35, 40, 30)],
    );
    let drivable = |forbidden: &[_]| drivable(&raster, &clearance(&raster), &[], forbidden);
    let at = |x: usize, y: usize| drivable(&[])[y * raster.width + x];
    assert!(at(60, 20).is_some() && at(80, 50).is_some());
    assert_eq!((at(60, 20), at(60, 20) == at(80, 50)), (at(30, 50), false));
    assert_eq!(at(3, 20), None, "there is no room beside a wall");
    // Where it keeps out of the wider door it comes into neither.
    let (low, high) = (raster.middle(30 * raster.width + 20), raster.middle(36 * raster.width + 40));
    let kept = drivable(&[vec![low, (high.0, low.1), high, (low.0, high.1)]]);
    let of = |x: usize, y: usize| kept[y * raster.width + x];
    assert!(of(60, 20).is_some() && of(30, 50).is_some() && of(60, 20) != of(30, 50));
}

/// Counter-clockwise.
fn area(line: &[(f64, f64)]) -> f64 {
    let pairs = (0..line.len()).map(|k| (line[k], line[(k + 1) % line.len()]));
    pairs.map(|(a, b)| 0.5 * (a.0 * b.1 - a.1 * b.0)).sum()
}

/// A place in the middle of a square room with walls so far away.
fn place(k: usize, wall_m: f64) -> Arc<Place> {
    let laser = Laser {
        id: "front".into(),
        body_from_laser: Pose2::new(0.1, 0.0, 0.0),
        upside_down: false,
        range_min_m: 0.1,
        range_max_m: 20.0,
        ignored_rad: vec![],
    };
    let ray = |n: u32| {
        let bearing = f64::from(n) * TAU / 90.0;
        (wall_m / bearing.cos().abs().max(bearing.sin().abs())) as f32
    };
    let scan = Scan {
        robot: "r".into(),
        laser: "front".into(),
        stamp_ns: 0,
        angle_min_rad: 0.0,
        angle_increment_rad: TAU / 90.0,
        time_increment_s: 0.0,
        ranges_m: (0..90).map(ray).collect(),
    };
    let seen = sweep(&scan, &laser, |_| Pose2::default());
    let view = View { place_from_laser: laser.body_from_laser, image: seen.image };
    let content = Content { cloud: seen.points, views: vec![view], sample: vec![] };
    Arc::new(Place {
        id: k as u64,
        stamp_ns: 0,
        path_m: k as f64,
        front_from_place: Pose2::default(),
        segment: 0,
        chain: Chain {
            previous_from_this: Pose2::default(),
            information: Matrix3::identity(),
            broken: false,
            unseen: false,
            failed: 0.0,
        },
        enclosure: Enclosure::of(&content),
        content,
    })
}

/// Whether a place is there at all, and where.
fn whereabouts() -> impl Strategy<Value = Vec<(f64, f64, f64)>> {
    prop::collection::vec((-20.0..20.0, -20.0..20.0, -3.0..3.0), 0..7)
}

proptest! {
    #[test]
    fn a_plot_that_followed_is_as_one_that_began_there(
        maps in prop::collection::vec((whereabouts(), any::<u8>()), 1..5),
    ) {
        let places: Vec<Arc<Place>> = (0..7).map(|k| place(k, 1.5 + k as f64)).collect();
        let mut plot = Rooms::plot();
        let mut before: Vec<Pose2> = Vec::new();
        for (poses, stay) in maps {
            let pose = |(k, &(x, y, yaw)): (usize, &(f64, f64, f64))| match before.get(k) {
                Some(old) if stay >> k & 1 == 1 => *old,
                _ => Pose2::new(x, y, yaw),
            };
            before = poses.iter().enumerate().map(pose).collect();
            let posed: Vec<_> = before.iter().copied().zip(places.iter().cloned()).collect();
            plot.follow(&posed);
            prop_assert_eq!(plot.grid(), grid(&posed, 0.1));
        }
    }

    #[test]
    fn clearance_is_the_distance_to_the_nearest_cell_that_is_not_free(
        free in prop::collection::vec(prop::bool::weighted(0.8), 7 * 9),
    ) {
        let raster = Raster { width: 9, height: 7, resolution_m: 0.1, corner_m: (0.0, 0.0), free };
        let found = clearance(&raster);
        for cell in 0..63_i64 {
            let (x, y) = (cell % 9, cell / 9);
            let taken = |u: i64, v: i64| {
                !(0..9).contains(&u) || !(0..7).contains(&v) || !raster.free[(v * 9 + u) as usize]
            };
            let all = (-1..10).flat_map(|u| (-1..8).map(move |v| (u, v))).filter(|&(u, v)| taken(u, v));
            let nearest = all.map(|(u, v)| (u - x).pow(2) + (v - y).pow(2)).min().unwrap();
            prop_assert!((f64::from(found[cell as usize]) - 0.1 * (nearest as f64).sqrt()).abs() < 1e-6);
        }
    }

    #[test]
    fn every_free_cell_is_in_one_part_and_outlines_hold_as_much_as_their_cells(
        free in prop::collection::vec(prop::bool::weighted(0.7), 12 * 12),
    ) {
        let raster = Raster { width: 12, height: 12, resolution_m: 0.1, corner_m: (0.0, 0.0), free };
        let (parts, _) = parts(&raster);
        for cell in 0..144 {
            prop_assert_eq!(parts.of[cell].is_some(), raster.free[cell]);
        }
        for (part, cells) in (0..).zip(&parts.cells) {
            prop_assert!(cells.iter().all(|&cell| parts.of[cell] == Some(part)));
            let loops = loops(&raster, cells, &|cell| parts.of[cell] == Some(part));
            let area: i64 = loops.iter().map(|line| doubled_area(line)).sum();
            prop_assert_eq!(area, 2 * cells.len() as i64);
        }
        prop_assert_eq!(parts.cells.iter().map(Vec::len).sum::<usize>(), parts.of.iter().flatten().count());
    }
}
