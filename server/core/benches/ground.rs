//! What grounding a sentence costs: `cargo bench -p toponym-core --bench ground`.
//!
//! A robot has driven up and down parallel hallways and into the rooms on them. Every relation is said
//! from many places, each time of eight landmarks that the name may mean, and grounded by every
//! particle. Times are CPU times of the one thread, per sentence. Without cargo's `--bench`, as in
//! `cargo test --all-targets`, it only shows that it runs.

use clap::Parser;
use cpu_time::ThreadTime;
use std::hint::black_box;
use toponym_core::language::{GroundPlace, LandmarkBelief, Narrowing, Reading, Relation, ground_clause};

/// Length of a hallway, distance to the next, from door to door, into a room.
const HALLWAY_M: i32 = 40;
const NEXT_M: i32 = 12;
const PITCH_M: i32 = 4;
const DEPTH_M: i32 = 4;
/// Landmarks that a name may mean.
const LANDMARKS: usize = 8;
/// Places that are spoken from.
const STANDS: usize = 20;

/// Measures grounding.
#[derive(Parser)]
struct Options {
    /// Places driven
    #[arg(long, default_value_t = 2000)]
    places: usize,
    /// Maps in which every sentence is grounded
    #[arg(long, default_value_t = 30)]
    particles: usize,
    /// What cargo says to all benches
    #[arg(long, hide = true)]
    bench: bool,
}

fn main() {
    let options = Options::parse();
    let (count, stands) = if options.bench { (options.places, STANDS) } else { (300, 1) };
    let places = drive(count);
    println!(
        "{} places, {} particles, {LANDMARKS} landmarks; ms of a sentence",
        places.len(),
        options.particles
    );
    println!("{:<12} {:>8} {:>8}", "relation", "mean", "worst");
    let mut all = Vec::new();
    for &relation in Relation::ALL {
        let times: Vec<f64> = (0..stands)
            .map(|k| {
                sentence_ms(relation, &places, (2 * k + 1) * places.len() / (2 * stands), options.particles)
            })
            .collect();
        let worst = times.iter().copied().fold(0.0, f64::max);
        println!(
            "{:<12} {:>8.2} {worst:>8.2}",
            relation.notation(),
            times.iter().sum::<f64>() / times.len() as f64
        );
        all.extend(times);
    }
    all.sort_by(f64::total_cmp);
    println!("all: median {:.2}, p99 {:.2}", all[all.len() / 2], all[all.len() * 99 / 100]);
}

/// Up and down hallways, into every room on the left.
fn drive(count: usize) -> Vec<GroundPlace> {
    let mut route = Vec::new();
    for hall in 0.. {
        let y = NEXT_M * hall;
        for step in 0..=HALLWAY_M {
            let x = if hall % 2 == 0 { step } else { HALLWAY_M - step };
            route.push((x, y));
            if step % PITCH_M == 2 {
                route.extend((1..=DEPTH_M).chain((0..DEPTH_M).rev()).map(|d| (x, y + d)));
            }
        }
        let end = if hall % 2 == 0 { HALLWAY_M } else { 0 };
        route.extend((1..NEXT_M).map(|d| (end, y + d)));
        if route.len() >= count {
            break;
        }
    }
    route.truncate(count);
    let place = |k: usize| {
        let ((x, y), (to_x, to_y)) = (route[k], route[(k + 1).min(route.len() - 1)]);
        let yaw_rad = f64::from(to_y - y).atan2(f64::from(to_x - x));
        GroundPlace { x_m: f64::from(x), y_m: f64::from(y), yaw_rad, path_m: k as f64 }
    };
    (0..route.len()).map(place).collect()
}

fn sentence_ms(relation: Relation, places: &[GroundPlace], stand: usize, particles: usize) -> f64 {
    // Some near, some far: names come again.
    let of = |k: usize| (stand + 7 * k * k) % places.len();
    let beliefs: Vec<(usize, f64)> = (0..LANDMARKS).map(|k| (of(k), 1.0 / LANDMARKS as f64)).collect();
    let belief = LandmarkBelief { places: &beliefs, way: relation == Relation::Down };
    let other = LandmarkBelief { places: &beliefs, way: false };
    let landmarks = [belief, other];
    let count = if relation == Relation::Between { 2 } else { 1 };
    let narrowing = Narrowing::default();
    let reading = Reading { weight: 1.0, relation, frame: None, narrowing, landmarks: &landmarks[..count] };
    let start = ThreadTime::now();
    for _ in 0..particles {
        black_box(ground_clause(black_box(&[reading]), places, stand, &[]));
    }
    start.elapsed().as_secs_f64() * 1e3
}
