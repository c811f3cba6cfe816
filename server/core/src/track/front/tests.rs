mod unaided;

use super::*;
use crate::event::{Laser, Scan};
use crate::scan::sweep::sweep;
use std::f64::consts::PI;

/// What a laser sees of an 8 × 6 m room with a pillar, or nothing at all.
fn seen(body: &Pose2, blind: bool) -> Sweep {
    let laser = Laser {
        id: "front".into(),
        body_from_laser: Pose2::default(),
        upside_down: false,
        range_min_m: 0.05,
        range_max_m: 20.0,
        ignored_rad: vec![],
    };
    let range = |k: i32| {
        let (s, c) = (body.yaw_rad + f64::from(k).to_radians()).sin_cos();
        let along = |p: f64, d: f64, lo: f64, hi: f64| ((if d > 0.0 { hi } else { lo }) - p) / d;
        let wall = along(body.x_m, c, -4.0, 4.0).min(along(body.y_m, s, -3.0, 3.0));
        // A pillar of 30 cm radius at (2, 1.5).
        let (px, py) = (2.0 - body.x_m, 1.5 - body.y_m);
        let (ahead, off) = (px * c + py * s, px * s - py * c);
        let pillar = if ahead > 0.0 && off.abs() < 0.3 { ahead - (0.09 - off * off).sqrt() } else { wall };
        if blind { f32::INFINITY } else { wall.min(pillar) as f32 }
    };
    let scan = Scan {
        robot: "r".into(),
        laser: "front".into(),
        stamp_ns: 0,
        angle_min_rad: -std::f64::consts::FRAC_PI_2,
        angle_increment_rad: 1f64.to_radians(),
        time_increment_s: 0.0,
        ranges_m: (-90..=90).map(range).collect(),
    };
    sweep(&scan, &laser, |_| Pose2::default())
}

fn drive(front: &mut FrontEnd, x_m: impl Iterator<Item = f64>, blind: bool) -> Vec<FrozenPlace> {
    let poses = x_m.map(|x| Pose2::new(x, -1.0, 0.0));
    let mut frozen: Vec<FrozenPlace> = poses
        .enumerate()
        .flat_map(|(k, p)| front.scan(k as i64 * 200_000_000, p, seen(&p, blind)).frozen)
        .collect();
    frozen.extend(front.freeze(f64::INFINITY));
    frozen
}

#[test]
fn going_back_over_its_own_path_leaves_no_place_empty() {
    let there = (0..30).map(|k| -3.0 + 0.2 * f64::from(k));
    let back = (0..30).rev().map(|k| -3.0 + 0.2 * f64::from(k));
    let mut front = FrontEnd::new(1.0);
    let frozen = drive(&mut front, there.chain(back), false);
    assert!(frozen.len() > 8);
    assert!(frozen.iter().all(|f| f.content.cloud.len() > 100), "a place without scans can't be met again");
    let end = front.front_from_body();
    assert!(end.x_m.hypot(end.y_m) < 0.02, "back where it began: {end:?}");
}

#[test]
fn a_blind_laser_breaks_no_odometry() {
    let mut front = FrontEnd::new(1.0);
    let frozen = drive(&mut front, (0..100).map(|k| 0.2 * f64::from(k)), true);
    assert!(frozen.len() > 15);
    assert!(frozen.iter().all(|f| !f.open.chain.broken));
}

#[test]
fn only_a_long_break_loses_the_robot() {
    for (gap_s, lost) in [(1, false), (60, true)] {
        let mut front = FrontEnd::new(1.0);
        let mut frozen = Vec::new();
        for k in 0..30i64 {
            let pose = Pose2::new(-3.0 + 0.2 * k as f64, -1.0, 0.0);
            let (mut odom, mut stamp_ns) = (pose, k * 200_000_000);
            if k >= 15 {
                odom = Pose2::new(50.0, 9.0, 1.0).compose(&pose);
                stamp_ns += gap_s * 1_000_000_000;
            }
            if k == 15 {
                front.break_odometry();
            }
            frozen.extend(front.scan(stamp_ns, odom, seen(&pose, false)).frozen);
        }
        frozen.extend(front.freeze(f64::INFINITY));
        assert_eq!(frozen.iter().any(|f| f.open.chain.broken), lost, "after {gap_s} s");
    }
}

/// Odometry of a path of poses, each increment spoilt.
fn spoilt(path: &[Pose2], spoil: impl Fn(usize, Pose2) -> Pose2) -> Vec<Pose2> {
    let mut odom = Pose2::new(5.0, -2.0, 0.7);
    let mut all = vec![odom];
    for (k, w) in path.windows(2).enumerate() {
        odom = odom.compose(&spoil(k, w[0].between(&w[1])));
        all.push(odom);
    }
    all
}

/// Wheels that make one step which the robot doesn't; the last pose.
fn slipped(step: Pose2) -> (Pose2, FrontEnd) {
    let mut front = FrontEnd::new(1.0);
    let mut last = Pose2::default();
    for k in 0..40_i64 {
        last = Pose2::new(-3.0 + 0.1 * k as f64, -1.0, 0.0);
        let here = Pose2::new(-1.0, -1.0, 0.0);
        let odom = if k < 20 { last } else { here.compose(&step).compose(&here.between(&last)) };
        front.scan(k * 200_000_000, odom, seen(&last, false));
    }
    (last, front)
}

#[test]
fn a_step_that_only_wheels_make_is_none() {
    for step in [Pose2::new(0.0, 0.0, 1.0), Pose2::new(0.0, 0.0, PI / 2.0), Pose2::new(1.0, 0.0, 0.0)] {
        let (last, front) = slipped(step);
        let went = front.front_from_body();
        let off_m = went.distance_m(&Pose2::new(-3.0, -1.0, 0.0).between(&last));
        assert!(off_m < 0.05 && went.yaw_rad.abs() < 0.02, "{step:?}: {went:?}");
        assert!(front.open_places().any(|p| p.chain.failed > 0.01), "scans and wheels part");
    }
}

#[test]
fn a_scan_that_only_fits_half_a_turn_away_is_of_somewhere_new() {
    let mut front = FrontEnd::new(1.0);
    for k in 0..45_i64 {
        // Once about on the spot; what it sees then is the same room built the other way round.
        let here = Pose2::new(-1.0, -1.0, PI / 20.0 * k.min(40) as f64);
        let sees = if k <= 40 { here } else { here.compose(&Pose2::new(0.0, 0.0, PI)) };
        front.scan(k * 200_000_000, here, seen(&sees, false));
    }
    let went = front.front_from_body();
    assert!(went.yaw_rad.abs() < 0.5, "no robot turns half about in .2 s: {went:?}");
    assert!(front.failed > 0.01, "nor is it sure where it is");
}

#[test]
fn at_rest_and_turning_on_the_spot_it_stays_where_it_is() {
    let at_rest = (0..300).map(|_| 0.0);
    let turning = (0..300).map(|k| 0.05 * f64::from(k));
    for yaws in [at_rest.collect::<Vec<_>>(), turning.collect()] {
        let path: Vec<Pose2> = yaws.iter().map(|&yaw| Pose2::new(-1.0, -1.0, yaw)).collect();
        let odom = spoilt(&path, |_, d| Pose2::new(0.002 * d.yaw_rad, 0.0, 0.93 * d.yaw_rad));
        let mut front = FrontEnd::new(1.0);
        for (k, (pose, odom)) in path.iter().zip(&odom).enumerate() {
            front.scan(k as i64 * 100_000_000, *odom, seen(pose, false));
        }
        let (end, truth) = (front.front_from_body(), path[0].between(&path[299]));
        let off = truth.between(&end);
        assert!(off.x_m.hypot(off.y_m) < 0.02 && off.yaw_rad.abs() < 0.01, "{off:?}");
        assert_eq!(front.open_places().count(), 1, "no place was added");
        assert!(front.since_place()[(2, 2)].sqrt() < 0.02, "{}", front.since_place());
    }
}

/// Four metres in the dark with wheels that suddenly turn the robot by 1.5° a metre.
fn over_the_dark(check: impl Fn(usize, &mut FrontEnd)) -> (Vec<Pose2>, Vec<FrozenPlace>) {
    let there = (0..60).map(|k| -3.0 + 0.1 * f64::from(k));
    let back = (0..40).map(|k| 3.0 - 0.1 * f64::from(k));
    let path: Vec<Pose2> = there.chain(back).map(|x| Pose2::new(x, -1.0, 0.0)).collect();
    let dark = |k: usize| (20..60).contains(&k);
    let bend = |k: usize| if dark(k) { 0.026 } else { 0.0 };
    let odom = spoilt(&path, |k, d| Pose2::new(d.x_m, 0.0, bend(k) * d.x_m));
    let mut front = FrontEnd::new(1.0);
    let mut frozen = Vec::new();
    for (k, (pose, odom)) in path.iter().zip(&odom).enumerate() {
        frozen.extend(front.scan(k as i64 * 100_000_000, *odom, seen(pose, dark(k))).frozen);
        check(k, &mut front);
    }
    frozen.extend(front.freeze(f64::INFINITY));
    (path, frozen)
}

#[test]
fn a_blind_stretch_is_bridged_and_its_places_are_corrected() {
    let (path, frozen) = over_the_dark(|_, _| {});
    let ids: Vec<_> = frozen.iter().map(|f| f.open.id).collect();
    assert_eq!(ids, (0..ids.len() as u64).collect::<Vec<_>>(), "in order, none left out");
    let mut chained = Pose2::default();
    for f in &frozen {
        chained = chained.compose(&f.open.chain.previous_from_this);
        let truth = path[0].between(&path[(f.open.stamp_ns / 100_000_000) as usize]);
        let off = truth.between(&chained);
        // In the dark itself, a smoother can only spread what it finds at the end.
        let lit = !f.content.cloud.is_empty();
        let most_m = if lit { 0.05 } else { 0.15 };
        assert!(off.x_m.hypot(off.y_m) < most_m, "place {}: {off:?}", f.open.id);
        assert!(!f.open.chain.broken);
    }
    assert!(frozen.iter().any(|f| f.content.cloud.is_empty()), "some places were dark");
}

#[test]
fn a_saved_front_end_goes_on_as_if_it_had_not_been() {
    let poses = |frozen: &[FrozenPlace]| frozen.iter().map(|f| f.open.front_from_place).collect::<Vec<_>>();
    let config = bincode::config::standard();
    let saved = over_the_dark(|k, front| {
        if [10, 35, 62, 80].contains(&k) {
            let bytes = bincode::serde::encode_to_vec(&*front, config).unwrap();
            *front = bincode::serde::decode_from_slice(&bytes, config).unwrap().0;
        }
    });
    assert_eq!(poses(&saved.1), poses(&over_the_dark(|_, _| {}).1));
}

/// Bits of a number that is not random, in −½ … ½.
fn spread(k: usize) -> f64 {
    f64::from((k as u32).wrapping_mul(2_654_435_761).rotate_left(13).wrapping_mul(0x9e37_79b1) >> 8)
        / f64::from(1 << 24)
        - 0.5
}

/// Middles of the legs, 14 cm thick, of a guide who keeps 1.5 m ahead in strides of 1.4 m.
fn legs(walked_m: f64) -> Vec<(f64, f64)> {
    let swing_m = 0.22 * (std::f64::consts::TAU * walked_m / 1.4).sin();
    vec![(1.5 + swing_m, 0.1), (1.5 - swing_m, -0.1)]
}

/// What a full circle of 12 m sees between two bare walls, ±1.2 m, that end nowhere: 720 rays with
/// noise, all at once or one after the other while the robot drives on. A guide may walk ahead.
fn between_walls(k: usize, step_m: f64, swept: bool, guided: bool) -> Sweep {
    let laser = Laser {
        id: "round".into(),
        body_from_laser: Pose2::default(),
        upside_down: false,
        range_min_m: 0.05,
        range_max_m: 12.0,
        ignored_rad: vec![],
    };
    let legs = if guided { legs(k as f64 * step_m) } else { vec![] };
    let range = |ray: usize| {
        let (s, c) = (ray as f64 * 0.5).to_radians().sin_cos();
        let leg = |&(x, y): &(f64, f64)| {
            let (ahead, off) = (x * c + y * s, x * s - y * c);
            (ahead > 0.0 && off.abs() < 0.07).then(|| ahead - (0.0049 - off * off).sqrt())
        };
        let nearest = legs.iter().filter_map(leg).fold(1.2 / s.abs(), f64::min);
        (nearest + 0.05 * spread(720 * k + ray)) as f32
    };
    let scan = Scan {
        robot: "r".into(),
        laser: "round".into(),
        stamp_ns: 0,
        angle_min_rad: 0.0,
        angle_increment_rad: 0.5f64.to_radians(),
        time_increment_s: if swept { 0.1 / 720.0 } else { 0.0 },
        ranges_m: (0..720).map(range).collect(),
    };
    sweep(&scan, &laser, |dt_s| Pose2::new(step_m * dt_s / 0.1, 0.0, 0.0))
}

#[test]
fn along_a_bare_corridor_odometry_decides_and_the_covariance_shows_it() {
    let (step_m, n) = (0.067, 240);
    for (swept, wheels) in [(false, 0.95), (true, 0.95), (true, 1.05)] {
        let mut front = FrontEnd::new(1.0);
        let mut frozen = Vec::new();
        let mut odom_m = 0.0;
        for k in 0..n {
            let seen = between_walls(k, step_m, swept, false);
            frozen.extend(front.scan(k as i64 * 100_000_000, Pose2::new(odom_m, 0.0, 0.0), seen).frozen);
            odom_m += step_m * (wheels + 0.1 * spread(k));
        }
        odom_m = front.odom_from_body.unwrap().x_m;
        let here = front.front_from_body();
        assert!((here.x_m - odom_m).abs() < 0.006 * odom_m, "{swept} {wheels}: {odom_m}, made {here:?}");
        assert!(here.y_m.abs() < 0.05 && here.yaw_rad.abs() < 0.02, "{here:?}");
        frozen.extend(front.freeze(f64::INFINITY));
        for f in &frozen[1..] {
            let p = f.open.chain.information.try_inverse().unwrap();
            // Wheels are thought to err by 4 cm in a metre.
            assert!(p[(0, 0)].sqrt() > 0.035 && p[(1, 1)].sqrt() < 0.02, "{p}");
        }
    }
}

#[test]
fn a_guide_ahead_in_a_bare_corridor_does_not_hold_the_robot_back() {
    let (step_m, n) = (0.067, 240);
    let mut front = FrontEnd::new(1.0);
    for k in 0..n {
        let odom = Pose2::new(k as f64 * step_m, 0.0, 0.0);
        front.scan(k as i64 * 100_000_000, odom, between_walls(k, step_m, false, true));
    }
    let (here, path_m) = (front.front_from_body(), (n - 1) as f64 * step_m);
    assert!((here.x_m - path_m).abs() < 0.01 * path_m, "{path_m}, made {here:?}");
}

/// In the room for 12 m, then in the dark round a square and back to where it began; the path.
fn round_a_square(front: &mut FrontEnd, side_m: f64, check: impl Fn(&FrontEnd)) -> Vec<Pose2> {
    let there = (0..60).map(|k| Pose2::new(-3.0 + 0.1 * f64::from(k), -1.0, 0.0));
    let mut path: Vec<Pose2> = there.clone().chain(there.rev()).collect();
    let lit = path.len();
    let side = (side_m / 0.1) as usize;
    for k in 1..=4 * side {
        let yaw_rad = if k % side == 0 { std::f64::consts::FRAC_PI_2 } else { 0.0 };
        path.push(path[path.len() - 1].compose(&Pose2::new(0.1, 0.0, yaw_rad)));
    }
    for (k, pose) in path.iter().enumerate() {
        front.scan(k as i64 * 100_000_000, *pose, seen(pose, k >= lit));
        check(front);
    }
    path
}

/// The end of some edges of the chain, and its covariance.
fn chained<'a>(chain: impl Iterator<Item = &'a Chain>) -> (Pose2, Matrix3<f64>) {
    let (mut made, mut covariance) = (Pose2::default(), Matrix3::zeros());
    for edge in chain {
        let over = edge.previous_from_this.inverse().adjoint();
        covariance = over * covariance * over.transpose() + edge.information.try_inverse().unwrap();
        made = made.compose(&edge.previous_from_this);
    }
    (made, covariance)
}

#[test]
fn edges_in_the_dark_add_up_to_what_wheels_are_worth_over_all_of_it() {
    let mut front = FrontEnd::new(1.0);
    round_a_square(&mut front, 20.0, |front| {
        let Some(dark) = &front.dark else { return };
        if front.open_places().last().is_none_or(|p| p.front_from_place != front.front_from_body()) {
            return;
        }
        let held = front.open_places().filter(|p| p.id > dark.last).map(|p| &p.chain);
        let (claimed, worth) = (chained(held).1, dark.drift.covariance(&front.wheels));
        let root = worth.cholesky().unwrap().l().try_inverse().unwrap();
        let ratio = (root * claimed * root.transpose()).symmetric_eigenvalues();
        assert!(ratio.min() > 0.99 && ratio.max() < 1.3, "{ratio}, {claimed} {worth}");
    });
    let drift = front.dark.as_ref().unwrap().drift;
    let all = drift.covariance(&front.wheels);
    assert!(all[(2, 2)] > 1.3 * drift.noise[(2, 2)], "there is much to add up: {all} {}", drift.noise);
}

#[test]
fn after_long_in_the_dark_a_look_alike_is_not_taken_for_what_was_left() {
    let mut front = FrontEnd::new(1.0);
    let path = round_a_square(&mut front, 20.0, |_| {});
    let last = front.dark.as_ref().unwrap().last;
    let mut frozen = Vec::new();
    // Beyond the dark there is the room once more, a metre aside of it.
    for k in path.len()..path.len() + 40 {
        let odom = path[path.len() - 1].compose(&Pose2::new(0.1 * (k + 1 - path.len()) as f64, 0.0, 0.0));
        let aside = Pose2::new(odom.x_m + 0.6, odom.y_m + 0.8, odom.yaw_rad);
        frozen.extend(front.scan(k as i64 * 100_000_000, odom, seen(&aside, false)).frozen);
    }
    frozen.extend(front.freeze(f64::INFINITY));
    frozen.retain(|f| f.open.id > last);
    let first = frozen.iter().position(|f| !f.content.cloud.is_empty()).unwrap();
    let (made, covariance) = chained(frozen[..=first].iter().map(|f| &f.open.chain));
    let told = Pose2::new(-3.0, -1.0, 0.0).between(&path[path.len() - 1]);
    assert!(made.distance_m(&told) < 0.5, "{made:?} {told:?}");
    assert!(covariance.fixed_view::<2, 2>(0, 0).trace().sqrt() > 0.7, "{covariance}");
}

#[test]
fn without_odometry_scans_alone_make_places() {
    let mut front = FrontEnd::new(1.0);
    for k in 0..60 {
        let pose = Pose2::new(-3.0 + 0.1 * f64::from(k), -1.0, 0.0);
        front.scan(i64::from(k) * 200_000_000, Pose2::default(), seen(&pose, false));
    }
    assert!((front.front_from_body.x_m - 5.9).abs() < 0.05, "{:?}", front.front_from_body);
    assert_eq!(front.next_place, 6);
}
