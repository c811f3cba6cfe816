//! A robot that goes up and down a hall of 12 m by 6 m, message by message, for as long as one likes: for tests and measurements
//! that need a living robot and no building.

use toponym_proto::{Header, Laser, Message, Odom, Pose, Scan, Setup, Stamp};

/// From message to message on the robot's clock, ns.
pub const PERIOD_NS: i64 = 25_000_000;
/// The hall, metres.
const LENGTH_M: f64 = 12.0;
const HALF_WIDTH_M: f64 = 3.0;
/// Bearing of the first ray, and of the last on the other side.
const BEARING_RAD: f64 = 2.0;

/// Message `n` of the robot's stream into a map: a setup, then odometry and sweeps of so many rays by turns. Of the headers only
/// the stamps are filled in.
pub fn message(n: u64, map: &str, beams: u16) -> Message {
    let header = Header { stamp: Stamp { ns: n as i64 * PERIOD_NS }, ..Header::default() };
    let along_m = (n as f64 * 0.01) % 16.0;
    let x_m = 2.0 + along_m.min(16.0 - along_m);
    match n {
        0 => setup(header, map),
        _ if n % 2 == 1 => odom(header, x_m),
        _ => scan(header, x_m, beams),
    }
}

/// The robot presents itself.
pub fn setup(header: Header, map: &str) -> Message {
    let laser = Laser {
        id: "front".into(),
        x_m: 0.0,
        y_m: 0.0,
        yaw_rad: 0.0,
        upside_down: false,
        range_min_m: 0.05,
        range_max_m: 30.0,
        ignored_rad: vec![],
    };
    Message::Setup(Setup { header, map: map.into(), lasers: vec![laser] })
}

/// Odometry of a robot that stands so far from the wall behind it.
pub fn odom(header: Header, x_m: f64) -> Message {
    Message::Odom(Odom { header, odom_from_body: Pose { x_m, y_m: 0.0, yaw_rad: 0.0 } })
}

/// What it sees from there.
pub fn scan(header: Header, x_m: f64, beams: u16) -> Message {
    let step_rad = 2.0 * BEARING_RAD / f64::from(beams);
    let range_m = |k: u16| {
        let (sin, cos) = (step_rad * f64::from(k) - BEARING_RAD).sin_cos();
        let along = if cos > 0.0 { (LENGTH_M - x_m) / cos } else { -x_m / cos };
        along.min(HALF_WIDTH_M / sin.abs()) as f32
    };
    Message::Scan(Scan {
        header,
        laser: "front".into(),
        angle_min_rad: -BEARING_RAD,
        angle_increment_rad: step_rad,
        time_increment_s: 0.0,
        ranges_m: (0..beams).map(range_m).collect(),
    })
}
