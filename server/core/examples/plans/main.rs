//! How well "room relation landmark" is grounded on hallways of real floor plans, by geometry alone.
//!
//! ```sh
//! cargo run --release -p toponym-core --example plans -- kth/            # the half of the buildings
//! cargo run --release -p toponym-core --example plans -- kth/ --fit      # that scales were chosen on
//! cargo run --release -p toponym-core --example plans -- kth/ --choose   # chooses and prints them
//! ```
//! A robot drives each straight hallway and visits its rooms. Statements that are true by the plan's
//! walls and doors (`statements.rs`) are grounded on the places driven. Counted is the mass on the
//! rooms a statement is true of (one or two), among all rooms, and how often the likeliest room is one.
//! `--later` is another task: the figure is not visited when it is spoken of, only the floor driven so
//! far is known, and it is grounded again after the first visit of a right room.
//!
//! Beside it the paper's rule, σ(−d/30 m) for every relation.
#![allow(clippy::unwrap_used, reason = "a tool: a wrong file ends it")]

mod choose;
mod plan;
mod statements;
mod tour;

use clap::Parser;
use plan::Hallway;
use rand::{RngExt, SeedableRng, seq::IndexedRandom};
use rand_chacha::ChaCha8Rng;
use statements::{Speaker, Statement};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use toponym_core::language::{LandmarkBelief, Reading, Relation, Scales, ground_with};
use tour::Tour;

/// No landmark and kind of statement tells more than this per hallway: all count alike.
const PER_KIND: usize = 12;
/// Scale of the paper's rule.
const PAPER_M: f64 = 30.0;

#[derive(Parser)]
#[command(about = "Grounds true statements on real floor plans")]
struct Args {
    /// Folder with plans, a folder a building.
    plans: PathBuf,
    /// The buildings that scales were chosen on, instead of the others.
    #[arg(long)]
    fit: bool,
    /// Speak of rooms not visited yet, ground when they have been.
    #[arg(long)]
    later: bool,
    /// Choose scales on those buildings and print them.
    #[arg(long)]
    choose: bool,
}

/// What one statement got: mass and hit by factors, the same by the paper's rule, and what went to
/// places not seen yet.
struct Outcome {
    ours: (f64, bool),
    paper: (f64, bool),
    elsewhere: f64,
}

fn main() {
    let args = Args::parse();
    if args.choose {
        return choose::choose(&args.plans);
    }
    let (outcomes, halls) = outcomes(&args.plans, args.fit, args.later, &Scales::FITTED);
    println!("{halls} hallways; mass: median on the right rooms; top: share with a right room likeliest");
    println!(
        "{:<17} {:>5}  {:>6} {:>6}  {:>6} {:>6}  {:>9}",
        "statement", "n", "mass", "top", "paper", "top", "elsewhere"
    );
    for (kind, of) in &outcomes {
        print(kind, of);
    }
    let all: Vec<Outcome> = outcomes.into_values().flatten().collect();
    print("all", &all);
}

type Outcomes = BTreeMap<&'static str, Vec<Outcome>>;

/// Of all statements, by kind, in one half of the buildings; and how many hallways these have.
fn outcomes(plans: &Path, fit: bool, later: bool, scales: &Scales) -> (Outcomes, usize) {
    let mut buildings: Vec<PathBuf> = std::fs::read_dir(plans).unwrap().map(|e| e.unwrap().path()).collect();
    buildings.sort();
    let (mut outcomes, mut halls) = (Outcomes::new(), 0);
    for building in buildings.iter().skip(usize::from(!fit)).step_by(2) {
        for file in files(building) {
            for hall in plan::hallways(&std::fs::read_to_string(file).unwrap()) {
                measure(&hall, halls, later, scales, &mut outcomes);
                halls += 1;
            }
        }
    }
    (outcomes, halls)
}

fn files(folder: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for entry in std::fs::read_dir(folder).into_iter().flatten() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            found.extend(files(&path));
        } else if path.extension().is_some_and(|e| e == "xml") {
            found.push(path);
        }
    }
    found.sort();
    found
}

fn print(kind: &str, of: &[Outcome]) {
    let median = |f: &dyn Fn(&Outcome) -> f64| {
        let mut sorted: Vec<f64> = of.iter().map(f).collect();
        sorted.sort_by(f64::total_cmp);
        sorted.get(sorted.len() / 2).copied().unwrap_or(0.0)
    };
    let share = |f: &dyn Fn(&Outcome) -> bool| {
        100.0 * of.iter().filter(|o| f(o)).count() as f64 / of.len().max(1) as f64
    };
    println!(
        "{kind:<17} {:>5}  {:>6.3} {:>5.1}%  {:>6.3} {:>5.1}%  {:>9.3}",
        of.len(),
        median(&|o| o.ours.0),
        share(&|o| o.ours.1),
        median(&|o| o.paper.0),
        share(&|o| o.paper.1),
        median(&|o| o.elsewhere)
    );
}

/// Makes statements in a hallway and grounds them.
fn measure(hall: &Hallway, seed: usize, later: bool, scales: &Scales, outcomes: &mut Outcomes) {
    let mut random = ChaCha8Rng::seed_from_u64(seed as u64);
    let now: Vec<bool> = hall.rooms.iter().map(|_| !later || random.random()).collect();
    let tour = Tour::new(hall, |k| now[k]);
    let mut said: BTreeMap<&str, Vec<(usize, Statement)>> = BTreeMap::new();
    for direction in [1.0, -1.0] {
        let stands = tour.stands(direction);
        let mut speak = |statements: &dyn Fn(&Speaker) -> Vec<Statement>| {
            let Some(&stand) = stands.choose(&mut random) else { return };
            let speaker = Speaker { hall, x_m: tour.places[stand].x_m, direction };
            for s in statements(&speaker) {
                said.entry(s.kind).or_default().push((stand, s));
            }
        };
        for landmark in 0..hall.rooms.len() {
            speak(&|speaker| speaker.of_landmark(landmark));
            speak(&|speaker| speaker.of_hallway());
        }
    }
    for (kind, said) in said {
        let some: Vec<&(usize, Statement)> = said.sample(&mut random, PER_KIND).collect();
        for (stand, statement) in some {
            let known = if later { tour.at_first_visit(*stand, statement) } else { Some(tour.clone()) };
            let outcome = known.and_then(|tour| judge(hall, &tour, *stand, statement, scales));
            outcomes.entry(kind).or_default().extend(outcome);
        }
    }
}

/// Grounds a statement; none if its landmarks or figures were not driven to.
fn judge(hall: &Hallway, tour: &Tour, stand: usize, said: &Statement, scales: &Scales) -> Option<Outcome> {
    let spots: Option<Vec<usize>> = said.landmarks.iter().map(|&l| tour.landmark(hall, l)).collect();
    let mut spots: Vec<[(usize, f64); 1]> = spots?.into_iter().map(|k| [(k, 1.0)]).collect();
    let way = spots.is_empty() && !matches!(said.relation, Relation::LeftOf | Relation::RightOf);
    if spots.is_empty() {
        spots.push([(stand, 1.0)]);
    }
    let landmarks: Vec<LandmarkBelief> = spots.iter().map(|s| LandmarkBelief { places: s, way }).collect();
    let (relation, frame, narrowing) = (said.relation, said.frame, said.narrowing);
    let reading = Reading { weight: 1.0, relation, frame, narrowing, landmarks: &landmarks };
    let grounded = ground_with(scales, &[reading], &tour.places, stand, &[]);
    let ours = in_rooms(hall, tour, &grounded.p);
    let landmark = tour.places[spots[0][0].0];
    let paper: Vec<f64> = tour
        .places
        .iter()
        .map(|p| 1.0 / (1.0 + ((p.x_m - landmark.x_m).hypot(p.y_m - landmark.y_m) / PAPER_M).exp()))
        .collect();
    // One vertex a room, as in the paper.
    let mut once = vec![0.0; hall.rooms.len()];
    for k in (0..hall.rooms.len()).filter(|k| !said.landmarks.contains(k)) {
        once[k] = tour.landmark(hall, k).map_or(0.0, |spot| paper[spot]);
    }
    Some(Outcome {
        ours: score(ours, &said.figures),
        paper: score(once, &said.figures),
        elsewhere: grounded.p_elsewhere,
    })
}

fn in_rooms(hall: &Hallway, tour: &Tour, p: &[f64]) -> Vec<f64> {
    let mut rooms = vec![0.0; hall.rooms.len()];
    for (k, p) in tour.room.iter().zip(p) {
        if let Some(k) = *k {
            rooms[k] += p;
        }
    }
    rooms
}

/// Mass on the right rooms, and whether the likeliest is one.
fn score(mut rooms: Vec<f64>, figures: &[usize]) -> (f64, bool) {
    let total: f64 = rooms.iter().sum();
    if total <= 0.0 {
        return (0.0, false);
    }
    for p in &mut rooms {
        *p /= total;
    }
    let best = (0..rooms.len()).max_by(|&a, &b| rooms[a].total_cmp(&rooms[b]));
    (figures.iter().map(|&k| rooms[k]).sum(), best.is_some_and(|k| figures.contains(&k)))
}
