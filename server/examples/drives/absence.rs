//! How places contradict each other that a map lays over one another, where it is right and where it is not.
//!
//! The simulator's tours say what may have happened beside what did: each hypothesis is a map of the same places.
//! Every [`SAME_WALLS_M`] of the path in the light that comes back to where it was before, by a map, is a look.

use crate::dark::{mapped, pose};
use crate::logistic::{Example, fit};
use nalgebra::Matrix3;
use rayon::prelude::*;
use std::ops::Range;
use toponym_core::Pose2;
use toponym_core::edge::Vertex;
use toponym_core::filter::absence::{CONTRADICTED, FLOOR_M, OVERLAP_M, SAME_WALLS_M, contradicted};
use toponym_core::graph::Graph;
use toponym_core::smoothing::Relative;
use toponym_core::track::front::LOCAL_PATH_M;
use toponym_sim::tours::{Hypothesis, tour};

const TOURS: [&str; 8] = ["small", "large", "autonomous", "twins", "ring", "rows", "clean", "start"];
/// How well a map knows that: standard deviations, m, m, rad.
const SIGMAS: [f64; 3] = [0.05, 0.05, 0.01];
/// Edges of the bins that are told, shares of points.
const BINS: [f64; 9] = [0.0, 0.02, 0.05, 0.1, 0.15, 0.2, 0.3, 0.5, 1.01];

struct Look {
    /// Which drive.
    drive: usize,
    is_right: bool,
    share: f64,
}

/// Learns, and shows what right and wrong maps look like, by drives learned from and others.
pub fn report(seeds: Range<u64>) {
    let drives: Vec<(&str, u64)> = TOURS.iter().flat_map(|&t| seeds.clone().map(move |s| (t, s))).collect();
    let all: Vec<Look> = drives
        .par_iter()
        .enumerate()
        .flat_map_iter(|(drive, &(name, seed))| looks(name, seed, drive))
        .collect();
    for (whose, half) in [("half of the drives", 0), ("the other half", 1)] {
        let looks: Vec<&Look> = all.iter().filter(|l| l.drive % 2 == half).collect();
        println!("{whose}: w {:.2} (of the library: {CONTRADICTED:.2?})", learned(&looks));
        for is_right in [true, false] {
            let of: Vec<&&Look> = looks.iter().filter(|l| l.is_right == is_right).collect();
            let share = |bin: &[f64]| {
                of.iter().filter(|l| (bin[0]..bin[1]).contains(&l.share)).count() as f64
                    / of.len().max(1) as f64
            };
            let shares: Vec<f64> = BINS.windows(2).map(share).collect();
            println!("  {} {shares:.4?} ({} looks)", if is_right { "right" } else { "wrong" }, of.len());
        }
    }
    println!("all: w {:.2}", learned(&all.iter().collect::<Vec<_>>()));
}

/// w of log p(c | right) / p(c | wrong), for c₀ of the library: right and wrong maps count the same.
fn learned(looks: &[&Look]) -> f64 {
    let right = looks.iter().filter(|l| l.is_right).count();
    let counts = [looks.len() - right, right].map(|n| looks.len() as f64 / (2 * n.max(1)) as f64);
    let example = |l: &&Look| Example {
        features: [(l.share / CONTRADICTED.0).max(1.0).ln()],
        given: 0.0,
        weight: counts[usize::from(l.is_right)],
        is_true: l.is_right,
    };
    let examples: Vec<Example<1>> = looks.iter().map(example).collect();
    -fit(&examples, |_| true)[0]
}

fn looks(name: &str, seed: u64, drive: usize) -> Vec<Look> {
    let tour = tour(name, seed).unwrap();
    let played = tour.play().unwrap();
    let (graph, truth) = mapped(&played, &tour.blind_s);
    let stamp_s = |v: usize| graph.places()[v].stamp_ns as f64 * 1e-9;
    let truly = Hypothesis { name: String::new(), pieces: Vec::new() };
    let others = tour.hypotheses.iter().filter(|h| !h.pieces.is_empty());
    let maps = std::iter::once(&truly).chain(others).map(|h| -> Vec<Option<Pose2>> {
        let moved = |v: usize, p: &Pose2| {
            let at = toponym_proto::Pose { x_m: p.x_m, y_m: p.y_m, yaw_rad: p.yaw_rad };
            pose(&h.at(stamp_s(v), &at))
        };
        truth.iter().enumerate().map(|(v, p)| p.as_ref().map(|p| moved(v, p))).collect()
    });
    maps.enumerate()
        .flat_map(|(k, map)| {
            let shares = shares(&graph, &map, |i, t| k == 0 || differs(&truth, &map, i, t));
            shares.into_iter().map(move |share| Look { drive, is_right: k == 0, share })
        })
        .collect()
}

/// Whether a map lays two places otherwise than the truth does.
fn differs(truth: &[Option<Pose2>], map: &[Option<Pose2>], i: usize, t: usize) -> bool {
    let between = |m: &[Option<Pose2>]| Some(m[i]?.between(&m[t]?));
    let (Some(a), Some(b)) = (between(truth), between(map)) else { return false };
    let off = a.between(&b);
    off.x_m.hypot(off.y_m) > OVERLAP_M || off.yaw_rad.abs() > 0.5
}

/// The shares of contradicted points of all looks in a map, at pairs that `counts`.
fn shares(graph: &Graph, map: &[Option<Pose2>], counts: impl Fn(usize, usize) -> bool) -> Vec<f64> {
    let covariance = Matrix3::from_diagonal(&SIGMAS.map(|s| s * s).into());
    let (mut shares, mut last_m) = (Vec::new(), f64::NEG_INFINITY);
    for t in 0..map.len() {
        let path_m = graph.places()[t].path_m;
        if path_m - last_m < SAME_WALLS_M {
            continue;
        }
        let relative = |i: usize| {
            let i_from_a = map[i]?.between(&map[t]?);
            let near = i_from_a.x_m.hypot(i_from_a.y_m) < OVERLAP_M
                && graph.apart(i as Vertex, t as Vertex, LOCAL_PATH_M);
            (near && counts(i, t)).then_some(Relative { i: i as Vertex, i_from_a, covariance })
        };
        let near: Vec<Relative> = (0..t).filter_map(relative).collect();
        let floors = near.chunk_by(|a, b| !graph.apart(a.i, b.i, FLOOR_M));
        let of_floors: Vec<f64> =
            floors.filter_map(|floor| contradicted(graph, t as Vertex, floor)).collect();
        if !of_floors.is_empty() {
            last_m = path_m;
        }
        shares.extend(of_floors);
    }
    shares
}
