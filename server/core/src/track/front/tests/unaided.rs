//! Without wheels that could be believed.

use super::*;

#[test]
fn without_wheels_scans_tell_the_way() {
    // It stands, drives, stops, turns, drives on and comes back, a scan a second whose stamps jitter.
    let mut pose = Pose2::new(-3.0, -1.0, 0.0);
    let mut steps = vec![Pose2::default(); 3];
    steps.extend(vec![Pose2::new(0.3, 0.0, 0.02); 12]);
    steps.extend(vec![Pose2::default(); 4]);
    steps.extend(vec![Pose2::new(0.0, 0.0, 0.5); 6]);
    steps.extend(vec![Pose2::new(0.3, 0.0, 0.0); 10]);
    let (start, mut front, mut most_m) = (pose, FrontEnd::new(1.0), 0.0f64);
    for (k, step) in steps.iter().enumerate() {
        pose = pose.compose(step);
        let stamp_ns = k as i64 * 1_000_000_000 + [0, 400_000_000, -300_000_000][k % 3];
        front.scan(stamp_ns, Pose2::default(), seen(&pose, false));
        let off = front.front_from_body().between(&start.between(&pose));
        most_m = most_m.max(off.x_m.hypot(off.y_m));
    }
    assert!(most_m < 0.1, "{most_m} m off");
    assert!(front.freeze(f64::INFINITY).iter().all(|f| !f.open.chain.broken));
}

#[test]
fn carried_while_nothing_is_seen_it_is_found_again() {
    let mut front = FrontEnd::new(1.0);
    let last = Pose2::new(-1.6, -1.0, 0.0);
    for k in 0..=7_i64 {
        let pose = Pose2::new(-3.0 + 0.2 * k as f64, -1.0, 0.0);
        front.scan(k * 200_000_000, pose, seen(&pose, false));
    }
    let there = Pose2::new(-0.3, 0.2, 0.5);
    front.scan(8_000_000_000, last, seen(&there, false));
    let off = front.front_from_body().between(&Pose2::new(-3.0, -1.0, 0.0).between(&there));
    assert!(off.x_m.hypot(off.y_m) < 0.05 && off.yaw_rad.abs() < 0.02, "{off:?}");
    let beyond = Pose2::new(0.7, 0.2, 0.5);
    front.scan(8_200_000_000, last.compose(&there.between(&beyond)), seen(&beyond, false));
    let failed = front.freeze(f64::INFINITY).iter().map(|f| f.open.chain.failed).fold(0.0, f64::max);
    assert!(failed > 0.1, "it may be a look-alike: {failed}");
}
