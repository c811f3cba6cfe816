//! A small building to drive through: a ring corridor with niches, so that no two stretches are
//! alike, and a robot with bad odometry and a laser of any mounting.

use toponym_core::event::{Event, Laser, Odom, Scan, Setup, Utterance};
use toponym_core::geometry::Pose2;

/// Wall segments of the ring: outer 20 × 14 m, inner 14 × 8 m, with niches and pillars.
pub fn walls() -> Vec<[f64; 4]> {
    let mut walls = Vec::new();
    let mut polygon = |points: &[(f64, f64)]| {
        for (a, b) in points.iter().zip(points.iter().cycle().skip(1)) {
            walls.push([a.0, a.1, b.0, b.1]);
        }
    };
    polygon(&[
        (0.0, 0.0),
        (4.0, 0.0),
        (4.0, -1.5),
        (6.5, -1.5),
        (6.5, 0.0),
        (20.0, 0.0),
        (20.0, 4.0),
        (21.5, 4.0),
        (21.5, 6.0),
        (20.0, 6.0),
        (20.0, 14.0),
        (13.0, 14.0),
        (13.0, 15.2),
        (9.0, 15.2),
        (9.0, 14.0),
        (0.0, 14.0),
        (0.0, 9.5),
        (-2.0, 9.5),
        (-2.0, 8.0),
        (0.0, 8.0),
    ]);
    polygon(&[
        (3.0, 3.0),
        (17.0, 3.0),
        (17.0, 11.0),
        (12.0, 11.0),
        (12.0, 10.2),
        (8.0, 10.2),
        (8.0, 11.0),
        (3.0, 11.0),
    ]);
    polygon(&[(9.0, 0.4), (9.4, 0.4), (9.4, 0.9), (9.0, 0.9)]);
    polygon(&[(18.6, 9.0), (19.3, 9.0), (19.3, 9.5), (18.6, 9.5)]);
    polygon(&[(4.0, 13.2), (4.8, 13.2), (4.8, 13.6), (4.0, 13.6)]);
    walls
}

/// Distance to the nearest wall from (x, y) along a direction; infinite beyond `max_m`.
pub fn range(walls: &[[f64; 4]], x: f64, y: f64, bearing: f64, max_m: f64) -> f64 {
    let (dy, dx) = bearing.sin_cos();
    let mut best = f64::INFINITY;
    for w in walls {
        let (ex, ey) = (w[2] - w[0], w[3] - w[1]);
        let det = dx * ey - dy * ex;
        if det.abs() < 1e-12 {
            continue;
        }
        let (px, py) = (w[0] - x, w[1] - y);
        let (t, s) = ((px * ey - py * ex) / det, (px * dy - py * dx) / det);
        if t > 0.0 && (0.0..=1.0).contains(&s) {
            best = best.min(t);
        }
    }
    if best < max_m { best } else { f64::INFINITY }
}

/// True poses of a drive round the ring, one each 0.2 m or 11°, `laps` times.
pub fn drive(laps: usize) -> Vec<Pose2> {
    let corners = [(1.5, 1.5), (18.5, 1.5), (18.5, 12.5), (1.5, 12.5)];
    let mut poses = vec![Pose2::new(1.5, 1.5, 0.0)];
    for leg in 0..4 * laps {
        let (from, to) = (corners[leg % 4], corners[(leg + 1) % 4]);
        let heading = f64::atan2(to.1 - from.1, to.0 - from.0);
        let length = f64::hypot(to.0 - from.0, to.1 - from.1);
        let steps = (length / 0.2) as usize;
        for k in 1..=steps {
            let f = k as f64 / steps as f64;
            poses.push(Pose2::new(from.0 + f * (to.0 - from.0), from.1 + f * (to.1 - from.1), heading));
        }
        for k in 1..=8 {
            poses.push(Pose2::new(to.0, to.1, heading + std::f64::consts::FRAC_PI_2 * f64::from(k) / 8.0));
        }
    }
    poses
}

/// A 180° laser at the front.
pub fn laser() -> Laser {
    Laser {
        id: "front".into(),
        body_from_laser: Pose2::new(0.2, 0.0, 0.0),
        upside_down: false,
        range_min_m: 0.05,
        range_max_m: 20.0,
        ignored_rad: vec![],
    }
}

/// Odometry that overestimates turns by 4 % and bends to the left.
pub fn worn(true_step: &Pose2) -> Pose2 {
    let d = true_step.x_m.hypot(true_step.y_m);
    Pose2::new(true_step.x_m * 1.03, true_step.y_m, true_step.yaw_rad * 1.04 + 0.006 * d)
}

/// A scan from a true pose; noise of ± 1 cm that a hash of the beam decides.
pub fn scan(walls: &[[f64; 4]], laser: &Laser, body: &Pose2, stamp_ns: i64, beams: usize) -> Scan {
    let at = body.compose(&laser.body_from_laser);
    let sign = if laser.upside_down { -1.0 } else { 1.0 };
    let step = std::f64::consts::PI / (beams - 1) as f64;
    let ranges_m = (0..beams)
        .map(|k| {
            let bearing = -std::f64::consts::FRAC_PI_2 + k as f64 * step;
            let r = range(walls, at.x_m, at.y_m, at.yaw_rad + sign * bearing, laser.range_max_m);
            let hash = (stamp_ns as u64 ^ (k as u64) << 32).wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 40;
            (r + 0.01 * (hash as f64 / 2f64.powi(23) - 1.0)) as f32
        })
        .collect();
    Scan {
        robot: "r".into(),
        laser: laser.id.clone(),
        stamp_ns,
        angle_min_rad: -std::f64::consts::FRAC_PI_2,
        angle_increment_rad: step,
        time_increment_s: 0.0,
        ranges_m,
    }
}

/// Events of a drive, with the sentences said at given steps.
pub fn events(poses: &[Pose2], laser: &Laser, said: &[(usize, &str)]) -> Vec<Event> {
    let walls = walls();
    let mut events = vec![Event::Setup(Setup { robot: "r".into(), lasers: vec![laser.clone()] })];
    let mut odom = Pose2::default();
    for (k, pose) in poses.iter().enumerate() {
        let stamp_ns = k as i64 * 200_000_000;
        for (n, (_, text)) in said.iter().enumerate().filter(|(_, s)| s.0 == k) {
            events.push(Event::Utterance(say(&format!("u{n}"), text, stamp_ns)));
        }
        if k > 0 {
            odom = odom.compose(&worn(&poses[k - 1].between(pose)));
        }
        events.push(Event::Odom(Odom { robot: "r".into(), boot: 0, stamp_ns, odom_from_body: odom }));
        events.push(Event::Scan(scan(&walls, laser, pose, stamp_ns, 181)));
    }
    events
}

/// A sentence.
pub fn say(id: &str, text: &str, began_ns: i64) -> Utterance {
    Utterance {
        id: id.into(),
        text: text.into(),
        lang: None,
        alternatives: vec![],
        speaker: None,
        began_ns,
        ended_ns: began_ns,
        retracts: None,
        answers: None,
    }
}
