//! What each stage of scan matching costs, from a scan's ranges to loops between places.
//!
//! `cargo bench -p toponym-core --bench scan`. A robot drives twice round the corridor of a made-up
//! building. Times are CPU times of the one thread. Without cargo's `--bench`, as in
//! `cargo test --all-targets`, it only shows that it runs.

use clap::Parser;
use cpu_time::ThreadTime;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::f64::consts::{FRAC_PI_2, PI, TAU};
use std::hint::black_box;
use toponym_core::event::{Laser, Odom, Scan, Setup};
use toponym_core::scan::correlate::Source;
use toponym_core::scan::matching::{index, modes, refine};
use toponym_core::scan::sweep::{Sweep, sweep};
use toponym_core::track::front::FrontEnd;
use toponym_core::track::places::FrozenPlace;
use toponym_core::{Config, Event, Mapper, Pose2};

/// The corridor's centre line is a rectangle of this size …
const LENGTH_M: f64 = 40.0;
const DEPTH_M: f64 = 20.0;
/// … and it is so wide.
const WIDTH_M: f64 = 2.4;
const ROOM_M: f64 = 4.0;
const DOOR_M: f64 = 1.0;
const SIGMA_RANGE_M: f64 = 0.01;
/// Errors of the wheels: a share of the way, and of the turn.
const SLIP: f64 = 0.03;

/// Measures the stages of scan matching.
#[derive(Parser)]
struct Options {
    /// Beams of the laser, over 360°
    #[arg(long, default_value_t = 720)]
    beams: u32,
    /// Path between scans, metres
    #[arg(long, default_value_t = 0.1)]
    step_m: f64,
    /// Of the building and of all noise
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// What cargo says to all benches
    #[arg(long, hide = true)]
    bench: bool,
}

/// A wall from one point to another.
type Wall = [f64; 4];

fn main() {
    let mut options = Options::parse();
    if !options.bench {
        (options.beams, options.step_m) = (90, 0.5);
    }
    let mut rng = ChaCha8Rng::seed_from_u64(options.seed);
    let walls = building(&mut rng);
    let (poses, odometry) = drive(options.step_m, &mut rng);
    let scans: Vec<Scan> =
        poses.iter().enumerate().map(|(k, p)| scan(k, &walls, p, options.beams, &mut rng)).collect();
    println!("{} scans of {} beams", scans.len(), options.beams);

    let sweeps: Vec<Sweep> =
        time("sweep: points, normals, range image", &scans, |s| sweep(s, &laser(), |_| Pose2::default()));
    let mut front = FrontEnd::new(Config::default().place_spacing_m);
    let inputs: Vec<_> = scans.iter().zip(&odometry).zip(sweeps).collect();
    let placed =
        time("front end: one scan", inputs, |((s, odom), sweep)| front.scan(s.stamp_ns, *odom, sweep));
    let places: Vec<FrozenPlace> = placed.into_iter().flat_map(|p| p.frozen).collect();

    let round = places.len() / 2;
    let again: Vec<(usize, usize)> =
        (0..round.saturating_sub(8)).step_by(2).map(|k| (k, k + round)).collect();
    let elsewhere: Vec<(usize, usize)> =
        (0..round / 2).step_by(2).map(|k| (k, k + round + round / 4)).collect();
    let content = |k: usize| &places[k].content;
    let look = |(i, j): (usize, usize)| modes(content(i), content(j), &Source::new(&content(j).sample));
    let known = time("search: a place seen before", again.clone(), look);
    time("search: a place never seen", elsewhere, look);
    let fits: Vec<_> =
        again.iter().zip(&known).filter_map(|(pair, m)| Some((*pair, m.first()?.i_from_j))).collect();
    time("registration: two places from a guess", fits, |((i, j), guess)| {
        refine(content(i), &index(content(i)), content(j), &guess)
    });

    let mut mapper = Mapper::new(Config::default());
    mapper.step(Event::Setup(Setup { robot: "r".into(), lasers: vec![laser()] }));
    time("all, 30 particles: one scan with its odometry", scans.iter().zip(&odometry), |(s, odom)| {
        let odom_from_body = *odom;
        let odom = Odom { robot: "r".into(), boot: 0, stamp_ns: s.stamp_ns, odom_from_body };
        (mapper.step(Event::Odom(odom)), mapper.step(Event::Scan(s.clone())))
    });
}

/// Runs a stage over all its inputs and prints what it costs.
fn time<I, O>(stage: &str, inputs: impl IntoIterator<Item = I>, mut work: impl FnMut(I) -> O) -> Vec<O> {
    let mut took_ms = Vec::new();
    let outputs: Vec<O> = inputs
        .into_iter()
        .map(|input| {
            let began = ThreadTime::now();
            let output = black_box(work(input));
            took_ms.push(began.elapsed().as_secs_f64() * 1e3);
            output
        })
        .collect();
    let mean = took_ms.iter().sum::<f64>() / took_ms.len().max(1) as f64;
    took_ms.sort_by(f64::total_cmp);
    let at = |share: f64| took_ms.get((took_ms.len() as f64 * share) as usize).copied().unwrap_or(f64::NAN);
    println!("{stage:46} {mean:8.3} ms mean {:8.3} p99 {:8.3} max", at(0.99), at(0.999_999));
    outputs
}

/// A corridor round a block, with rooms of different depths behind open doors.
fn building(rng: &mut ChaCha8Rng) -> Vec<Wall> {
    let (l, d, w) = (LENGTH_M / 2.0, DEPTH_M / 2.0, WIDTH_M / 2.0);
    let mut walls = Vec::new();
    for (reach, outwards) in [(w, 1.0), (-w, -1.0)] {
        let (x, y) = (l + reach, d + reach);
        for [x0, y0, x1, y1] in [[-x, -y, x, -y], [x, -y, x, y], [x, y, -x, y], [-x, y, -x, -y]] {
            let (dx, dy) = (x1 - x0, y1 - y0);
            let length = f64::hypot(dx, dy);
            let (dx, dy) = (dx / length, dy / length);
            let mut at = 0.0;
            while at < length {
                let room = (ROOM_M * rng.random_range(0.6..1.4)).min(length - at);
                let door = at + rng.random_range(0.1..0.6) * room;
                let end = (door + DOOR_M).min(at + room);
                let depth = outwards * rng.random_range(2.0..6.0);
                // Along the wall, and behind it.
                let point = |s: f64, r: f64| [x0 + dx * s + dy * r, y0 + dy * s - dx * r];
                let mut wall = |a: [f64; 2], b: [f64; 2]| walls.push([a[0], a[1], b[0], b[1]]);
                wall(point(at, 0.0), point(door, 0.0));
                wall(point(end, 0.0), point(at + room, 0.0));
                wall(point(at, depth), point(at + room, depth));
                wall(point(at, 0.0), point(at, depth));
                wall(point(at + room, 0.0), point(at + room, depth));
                at += room;
            }
        }
    }
    walls
}

/// Twice round along the centre line, turning on the spot: true poses, and odometry.
fn drive(step_m: f64, rng: &mut ChaCha8Rng) -> (Vec<Pose2>, Vec<Pose2>) {
    let mut pose = Pose2::new(-LENGTH_M / 2.0, -DEPTH_M / 2.0, 0.0);
    let (mut poses, mut odometry, mut odom) = (vec![pose], vec![pose], pose);
    let mut go = |by: Pose2| {
        let mut error = || 1.0 + SLIP * rng.random_range(-1.0..1.0);
        let seen = Pose2::new(by.x_m * error(), by.y_m, by.yaw_rad * error());
        (pose, odom) = (pose.compose(&by), odom.compose(&seen));
        poses.push(pose);
        odometry.push(odom);
    };
    for side in 0..8 {
        let length_m = if side % 2 == 0 { LENGTH_M } else { DEPTH_M };
        let steps = (length_m / step_m).round();
        (0..steps as u32).for_each(|_| go(Pose2::new(length_m / steps, 0.0, 0.0)));
        (0..10).for_each(|_| go(Pose2::new(0.0, 0.0, FRAC_PI_2 / 10.0)));
    }
    (poses, odometry)
}

fn laser() -> Laser {
    Laser {
        id: "laser".into(),
        body_from_laser: Pose2::default(),
        upside_down: false,
        range_min_m: 0.05,
        range_max_m: 20.0,
        ignored_rad: vec![],
    }
}

fn scan(k: usize, walls: &[Wall], world_from_laser: &Pose2, beams: u32, rng: &mut ChaCha8Rng) -> Scan {
    let step_rad = TAU / f64::from(beams);
    let ranges_m = (0..beams)
        .map(|b| {
            let bearing = world_from_laser.yaw_rad - PI + f64::from(b) * step_rad;
            let (s, c) = bearing.sin_cos();
            let hit = |w: &Wall| {
                let (dx, dy) = (w[2] - w[0], w[3] - w[1]);
                let (ox, oy) = (w[0] - world_from_laser.x_m, w[1] - world_from_laser.y_m);
                let det = dx * s - dy * c;
                let (range_m, along) = ((dx * oy - dy * ox) / det, (c * oy - s * ox) / det);
                (range_m > 0.0 && (0.0..=1.0).contains(&along)).then_some(range_m)
            };
            let range_m = walls.iter().filter_map(hit).fold(f64::INFINITY, f64::min);
            (range_m + SIGMA_RANGE_M * rng.random_range(-1.7..1.7)) as f32
        })
        .collect();
    Scan {
        robot: "r".into(),
        laser: "laser".into(),
        stamp_ns: k as i64 * 100_000_000,
        angle_min_rad: -PI,
        angle_increment_rad: step_rad,
        time_increment_s: 0.0,
        ranges_m,
    }
}
