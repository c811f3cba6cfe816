//! Rooms drawn by hand along a corridor.

use super::features::{Clause, FEATURES, Scene, Speaker};
use super::{Kind, Which};
use crate::geometry::Pose2;
use crate::language::{GroundPlace, Narrowing, Relation};
use crate::regions::{Doorway, Region, Rooms, Shape};
use proptest::prelude::*;

/// A corridor along x, 24 m by 2 m, and on either side of it four rooms of 6 m by 4 m, each with its door in the middle.
/// The robot goes along and into each: the southern room first.
pub(crate) fn wing() -> (Rooms, Vec<GroundPlace>) {
    let mut places: Vec<GroundPlace> = Vec::new();
    let mut within: Vec<Vec<u32>> = vec![Vec::new(); 9];
    let mut go = |x_m: f64, y_m: f64, yaw_rad: f64, region: usize| {
        within[region].push(places.len() as u32);
        let path_m = places.len() as f64;
        places.push(GroundPlace { x_m, y_m, yaw_rad, path_m });
    };
    for k in 0..4 {
        for step in 0..6 {
            let x = 6.0 * f64::from(k) + f64::from(step);
            go(x, 1.0, 0.0, 0);
            if step == 3 {
                for (side, room) in [(-1.0, 1), (1.0, 5)] {
                    let into = |go: &mut dyn FnMut(f64, f64, f64, usize), y: f64| {
                        go(x, 1.0 + side * y, side * 1.57, room + k as usize);
                    };
                    for y in [2.0, 3.0, 2.0] {
                        into(&mut go, y);
                    }
                    go(x, 1.0, 0.0, 0);
                }
            }
        }
    }
    let shape = |x0: f64, y0: f64, x1: f64, y1: f64| vec![(x0, y0), (x1, y0), (x1, y1), (x0, y1)];
    let region = |id: usize, polygon_m: Vec<(f64, f64)>, doorways: Vec<Doorway>, shape| {
        let middle = |axis: fn(&(f64, f64)) -> f64| polygon_m.iter().map(axis).sum::<f64>() / 4.0;
        Region {
            id: id as u64,
            places: within[id].clone(),
            middle_m: (middle(|p| p.0), middle(|p| p.1)),
            holes_m: Vec::new(),
            area_m2: 24.0,
            doorways,
            shape,
            polygon_m: polygon_m.clone(),
        }
    };
    let door = |to: usize, x: f64, y: f64| Doorway { to, at_m: (x, y), width_m: 0.9 };
    let x = |k: usize| 6.0 * (k % 4) as f64;
    let y = |k: usize| if k < 4 { 0.0 } else { 2.0 };
    let doors = (0..8).map(|k| door(k + 1, x(k) + 3.0, y(k))).collect();
    let mut regions = vec![region(0, shape(0.0, 0.0, 24.0, 2.0), doors, Shape::Corridor)];
    for k in 0..8 {
        let (low, high) = if k < 4 { (-4.2, -0.2) } else { (2.2, 6.2) };
        let outline = shape(x(k) + 0.1, low, x(k) + 5.9, high);
        regions.push(region(k + 1, outline, vec![door(0, x(k) + 3.0, y(k))], Shape::Room));
    }
    (Rooms::drawn(regions), places)
}

fn said(relation: Relation, landmarks: Vec<usize>, x_m: f64) -> Clause {
    let speaker = Some(Speaker { pose: Pose2::new(x_m, 1.0, 0.0), place: x_m as u32, path_m: x_m });
    Clause { relation, frame: None, narrowing: Narrowing::default(), landmarks, way: false, speaker }
}

pub(crate) fn likeliest(which: &Which) -> usize {
    (0..which.p.len()).max_by(|&a, &b| which.p[a].total_cmp(&which.p[b])).unwrap()
}

#[test]
fn what_is_said_of_a_landmark_is_looked_for_where_it_holds() {
    let (rooms, places) = wing();
    let other = vec![0.0; 9];
    let scene = Scene::new(&rooms, &places, &other, false);
    let of = |relation, landmarks| Which::of(&scene, &said(relation, landmarks, 1.0));
    // The southern rooms are 1 to 4, the northern 5 to 8.
    let beside = of(Relation::NextTo, vec![2]);
    assert!(beside.p[1] + beside.p[3] > 0.6, "{beside:?}");
    assert_eq!(likeliest(&of(Relation::AcrossFrom, vec![2])), 6);
    assert_eq!(likeliest(&of(Relation::Between, vec![5, 7])), 6);
    assert!(beside.p[2] < 1e-9, "nothing lies next to itself");
}

#[test]
fn a_room_that_bears_another_name_is_hardly_meant() {
    let (rooms, places) = wing();
    let mut other = vec![0.0; 9];
    let clause = said(Relation::NextTo, vec![2], 1.0);
    let before = Which::of(&Scene::new(&rooms, &places, &other, false), &clause);
    other[1] = 0.97;
    let after = Which::of(&Scene::new(&rooms, &places, &other, false), &clause);
    assert!(after.p[1] < 0.05 && after.p[3] > before.p[3] + 0.1, "{before:?} {after:?}");
}

#[test]
fn what_lies_on_the_left_is_not_on_the_right() {
    let (rooms, places) = wing();
    let other = vec![0.0; 9];
    let scene = Scene::new(&rooms, &places, &other, false);
    let side = |relation, rooms: std::ops::Range<usize>| {
        Which::of(&scene, &said(relation, vec![], 1.0)).p[rooms].iter().sum::<f64>()
    };
    assert!(side(Relation::LeftSide, 5..9) > 4.0 * side(Relation::LeftSide, 1..5));
    assert!(side(Relation::RightSide, 1..5) > 4.0 * side(Relation::RightSide, 5..9));
}

#[test]
fn kinds_stand_in_the_order_of_their_weights() {
    for (k, kind) in Kind::ALL.into_iter().enumerate() {
        assert_eq!(kind as usize, k);
    }
}

proptest! {
    #[test]
    fn probabilities_sum_to_one_and_two_say_more_than_one(
        scores in prop::collection::vec(prop::option::weighted(0.8, -5.0..5.0_f64), 1..12), none in -5.0..5.0_f64,
    ) {
        let of = |score: f64| {
            let mut features = [0.0; FEATURES];
            features[0] = score;
            features
        };
        let mut weights = [0.0; FEATURES];
        weights[0] = 1.0;
        let regions = scores.iter().map(|s| s.map(of)).collect();
        let which = Which::softmax(&super::Alternatives { regions, none: of(none) }, &weights);
        prop_assert!((which.p.iter().sum::<f64>() + which.p_none - 1.0).abs() < 1e-9);
        let n = which.p.len();
        let prior = Which { p: vec![1.0 / (n + 1) as f64; n], p_none: 1.0 / (n + 1) as f64 };
        let both = which.and(&which, &prior, 0.0);
        prop_assert!((both.p.iter().sum::<f64>() + both.p_none - 1.0).abs() < 1e-9);
        let most = |w: &Which| w.p.iter().copied().fold(w.p_none, f64::max);
        prop_assert!(most(&both) >= most(&which) - 1e-9);
        let nothing = which.and(&prior, &prior, 0.0);
        prop_assert!((most(&nothing) - most(&which)).abs() < 1e-9);
    }
}
