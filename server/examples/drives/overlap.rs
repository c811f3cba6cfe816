//! How two places that truly overlap see each other's surfaces, and how unrelated ones do.
//!
//! A place is laid where it was, and where a false loop would lay it: at random beside another place,
//! slipped along its own heading, or as another place's scans look alike, and from there on along with the
//! robot. Older places around are known to 5 cm, as they are after a loop.

use crate::drive::Drive;
use nalgebra::{Matrix3, Vector3};
use std::f64::consts::TAU;
use toponym_core::Pose2;
use toponym_core::edge::Vertex;
use toponym_core::filter::likelihood::{Overlap, compare, nearest};
use toponym_core::filter::loops::SCORE_MIN;
use toponym_core::random::{Purpose, uniform};
use toponym_core::scan::correlate::Source;
use toponym_core::scan::matching::modes;
use toponym_core::smoothing::Relative;
use toponym_core::track::front::LOCAL_PATH_M;

/// Standard deviations of a relative pose: metres, metres, radians.
const KNOWN: [f64; 3] = [0.05, 0.05, 0.0025];
/// A false loop lays a place at least so far from where it was …
const FALSE_M: f64 = 1.0;
/// … beside another within so much, or slipped by so much at most.
const BESIDE_M: f64 = 2.0;
const SLIPPED_M: f64 = 6.0;
/// Share of points that both must see for scans to look alike.
const ALIKE_OVERLAP_MIN: f64 = 0.25;
/// Places over which a look-alike is believed, and between those at which one is looked for.
const BELIEVED: Vertex = 16;
const LOOKED_FOR_EVERY: Vertex = 5;
const SEED: u64 = 11;

const KINDS: [&str; 4] = ["where it was", "at random", "slipped", "alike"];

/// One place laid over others.
struct Laid {
    kind: usize,
    drive: usize,
    overlap: Overlap,
}

/// The constants of the core's `likelihood.rs`, and what places do to a weight by them.
pub fn report(drives: &[Drive]) {
    let laid: Vec<Laid> = drives.iter().enumerate().flat_map(|(d, drive)| of_drive(d, drive)).collect();
    let mut shares = [0.0; 4];
    for (kind, name) in KINDS.iter().enumerate() {
        let of_kind = || laid.iter().filter(|l| l.kind == kind);
        let n = of_kind().count().max(1) as f64;
        let per_drive = |d| {
            let sum =
                |of: fn(&Overlap) -> f64| of_kind().filter(|l| l.drive == d).map(|l| of(&l.overlap)).sum();
            let (seen, through): (f64, f64) = (sum(|o| o.seen), sum(|o| o.seen_through));
            seen / (seen + through).max(1.0)
        };
        shares[kind] = (0..drives.len()).map(per_drive).sum::<f64>() / drives.len() as f64;
        let mean = of_kind().map(|l| l.overlap.log_factor()).sum::<f64>() / n;
        let punished = of_kind().filter(|l| l.overlap.log_factor() < -0.03).count() as f64 / n;
        println!(
            "{name}: {n} places, {:.3} seen; log w {mean:+.3} a place, {punished:.3} of them lose",
            shares[kind]
        );
    }
    println!("SEEN_SAME {:.3}, SEEN_UNRELATED {:.3}", shares[0], shares[1..].iter().sum::<f64>() / 3.0);
    println!("TEMPER {:.2}", temper(&laid, drives.len()));
}

/// The power of the ratios that calls true overlaps and others what they are with the least log-loss.
fn temper(laid: &[Laid], drives: usize) -> f64 {
    // True overlaps count as much as all others, and each drive as much as any.
    let mut counts = vec![[0.0; 4]; drives];
    for l in laid {
        counts[l.drive][l.kind] += 1.0;
    }
    let loss = |power: f64| -> f64 {
        let one = |l: &Laid| {
            let (sign, weight) = if l.kind == 0 { (-1.0, 1.0) } else { (1.0, 1.0 / 3.0) };
            weight / counts[l.drive][l.kind] * (sign * power * l.overlap.log_ratio()).exp().ln_1p()
        };
        laid.iter().map(one).sum()
    };
    let powers = (1..=100).map(|k| 0.01 * f64::from(k));
    powers.min_by(|a, b| loss(*a).total_cmp(&loss(*b))).unwrap_or_default()
}

fn of_drive(number: usize, drive: &Drive) -> Vec<Laid> {
    let (graph, truth) = (&drive.graph, &drive.truth);
    let mut laid = Vec::new();
    let mut alike: Option<(Vertex, Pose2)> = None;
    for t in 0..truth.len() as Vertex {
        let here = truth[t as usize];
        let older = (0..t).take_while(|&i| graph.apart(i, t, LOCAL_PATH_M)).count() as f64;
        if older < 1.0 {
            continue;
        }
        let mut draws = 0..;
        let mut draw = || uniform(SEED, t.into(), draws.next().unwrap_or_default(), Purpose::Inject);
        let other = (draw() * older) as Vertex;
        let mut within = |half: f64| half * (2.0 * draw() - 1.0);
        let beside = Pose2::new(within(BESIDE_M), within(BESIDE_M), within(TAU / 2.0));
        let by_m = within(SLIPPED_M - FALSE_M);
        let slipped = here.compose(&Pose2::new(by_m + FALSE_M.copysign(by_m), 0.0, 0.0));
        if alike.is_none() && t % LOOKED_FOR_EVERY == 0 {
            alike = looks_alike(drive, other, t).map(|at| (t, at.compose(&here.inverse())));
        }
        alike = alike.filter(|(since, _)| t - since < BELIEVED);
        let believed = alike.map(|(_, world_from_world)| world_from_world.compose(&here));
        let at = [Some(here), Some(truth[other as usize].compose(&beside)), Some(slipped), believed];
        for (kind, at) in at.into_iter().enumerate() {
            let place = at.filter(|at| kind == 0 || at.distance_m(&here) >= FALSE_M);
            let overlap = place.and_then(|at| lay(drive, t, at));
            laid.extend(overlap.map(|overlap| Laid { kind, drive: number, overlap }));
        }
    }
    laid
}

/// A place where it was not, but as the scans of another look.
fn looks_alike(drive: &Drive, other: Vertex, t: Vertex) -> Option<Pose2> {
    let (i, j) = (&drive.graph.place(other).content, &drive.graph.place(t).content);
    modes(i, j, &Source::new(&j.sample))
        .into_iter()
        .filter(|m| m.score >= SCORE_MIN && m.overlap >= ALIKE_OVERLAP_MIN)
        .map(|m| drive.truth[other as usize].compose(&m.i_from_j))
        .find(|at| at.distance_m(&drive.truth[t as usize]) >= FALSE_M)
}

/// How place `t` and the older ones compare, were it at `world_from_t`.
fn lay(drive: &Drive, t: Vertex, world_from_t: Pose2) -> Option<Overlap> {
    let world_from = |v: Vertex| if v == t { world_from_t } else { drive.truth[v as usize] };
    let covariance = Matrix3::from_diagonal(&Vector3::from(KNOWN.map(|sigma| sigma * sigma)));
    let near = nearest(&drive.graph, t, world_from).into_iter();
    let predicted: Vec<Relative> =
        near.map(|i| Relative { i, i_from_a: world_from(i).between(&world_from_t), covariance }).collect();
    compare(&drive.graph, t, &predicted)
}
