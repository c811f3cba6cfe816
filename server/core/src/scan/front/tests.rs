use super::*;
use crate::event::{Laser, Scan};
use crate::scan::sweep::sweep;

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
