//! How far the front end's chain is off over stretches in which the laser sees nothing, beside what it claims
//! and what one may claim who knows the wheels' noise and the motion in the light exactly.
//!
//! Errors are those of the first place in the light seen from the last one before, as twists at the mean.

use crate::drive::mean;
use nalgebra::{Matrix3, Vector3};
use rayon::prelude::*;
use std::ops::Range;
use toponym_core::graph::Graph;
use toponym_core::{Config, Effect, Event, Mapper, Pose2};
use toponym_proto::Message;
use toponym_server::convert::event;
use toponym_sim::reference::{Stretch, motions};
use toponym_sim::tours::{Played, tour};
use toponym_sim::{Draw, WheelsPrior};

/// Tours with dark floor, and offices in which the laser goes blind, on wheels from smooth (0) to rough (1).
const TOURS: [&str; 6] = ["small", "large", "autonomous", "twins", "ring", "rows"];
const OFFICES: [(&str, f64); 3] =
    [("office, smooth wheels", 0.0), ("office, fair", 0.4), ("office, rough", 1.0)];
/// There it goes blind between these, metres of path.
const BLINDED_M: [(f64, f64); 3] = [(40.0, 55.0), (85.0, 125.0), (150.0, 158.0)];
/// Shorter stretches are doorways.
const CROSSING_M: f64 = 5.0;
/// Of χ² with three degrees of freedom.
const CHI2_95: f64 = 7.815;

/// A dark stretch as it was mapped.
struct Crossing {
    path_m: f64,
    off: Vector3<f64>,
    claimed: Matrix3<f64>,
    ideal_off: Vector3<f64>,
    ideal: Matrix3<f64>,
}

/// A line for each kind of tour that is asked for; all of them if none is.
pub fn report(kinds: &[String], seeds: Range<u64>, each: bool) {
    let offices = OFFICES.map(|(name, roughness)| (name, Some(roughness)));
    let all = TOURS.map(|name| (name, None)).into_iter().chain(offices);
    for (name, roughness) in
        all.filter(|a| kinds.is_empty() || kinds.iter().any(|k| a.0.starts_with(k.as_str())))
    {
        let crossings: Vec<(u64, Crossing)> = seeds
            .clone()
            .into_par_iter()
            .flat_map_iter(|seed| crossings(name, roughness, seed).into_iter().map(move |c| (seed, c)))
            .collect();
        for (seed, crossing) in crossings.iter().filter(|_| each) {
            println!("{name} {seed}: {}", described(crossing));
        }
        let crossings: Vec<Crossing> = crossings.into_iter().map(|c| c.1).collect();
        println!("{name}: {}", summed(&crossings));
    }
}

fn crossings(name: &str, roughness: Option<f64>, seed: u64) -> Vec<Crossing> {
    let mut tour = tour(if roughness.is_some() { "clean" } else { name }, seed).unwrap();
    if let Some(roughness) = roughness {
        tour.wheels_prior = WheelsPrior::between(roughness);
        tour.scenario.wheels = tour.wheels_prior.draw(&mut Draw::new(seed, 99));
    }
    let played = tour.play().unwrap();
    let dark_s = if roughness.is_some() { blinded_s(&played) } else { tour.blind_s.clone() };
    let stretches: Vec<Stretch> = dark_s.iter().map(|&s| Stretch::dark(s)).collect();
    let ideal = motions(&played.drive, &played.odometry, &tour.wheels_prior, &stretches);
    let (graph, truth) = mapped(&played, &dark_s);
    let at = |t_s: f64| pose(&played.drive.at(t_s));
    let crossing = |(&(from_s, to_s), (motion, covariance)): (&(f64, f64), &(_, Matrix3<f64>))| {
        let path_m = path_m(&played, from_s, to_s);
        let lit = |v: &usize| truth[*v].is_some();
        let stamp_s = |v: usize| graph.places()[v].stamp_ns as f64 * 1e-9;
        let before = (0..truth.len()).filter(lit).rfind(|&v| stamp_s(v) < from_s)?;
        let after = (0..truth.len()).filter(lit).find(|&v| stamp_s(v) > to_s - 1e-3)?;
        let (made, claimed) = chained(&graph, before, after)?;
        Some(Crossing {
            path_m,
            off: made.between(&truth[before]?.between(&truth[after]?)).log(),
            claimed,
            ideal_off: pose(motion).between(&at(from_s).between(&at(to_s))).log(),
            ideal: *covariance,
        })
    };
    dark_s.iter().zip(&ideal).filter_map(crossing).filter(|c| c.path_m > CROSSING_M).collect()
}

/// The chain from a place to a later one, and its covariance; none if it is broken.
fn chained(graph: &Graph, from: usize, to: usize) -> Option<(Pose2, Matrix3<f64>)> {
    let (mut made, mut covariance) = (Pose2::default(), Matrix3::zeros());
    for place in graph.places().get(from + 1..=to)? {
        let step = &place.chain.previous_from_this;
        let f = step.inverse().adjoint();
        covariance = f * covariance * f.transpose() + place.chain.information.try_inverse()?;
        made = made.compose(step);
        if place.chain.broken {
            return None;
        }
    }
    Some((made, covariance))
}

/// Places without loops, and where those are that were seen.
pub fn mapped(played: &Played, dark_s: &[(f64, f64)]) -> (Graph, Vec<Option<Pose2>>) {
    let mut mapper = Mapper::new(Config { particles: 1, loops: false, ..Config::default() });
    let mut placed: Vec<Vec<Pose2>> = Vec::new();
    for message in &played.stream {
        for effect in mapper.step(event(blinded(message, dark_s))) {
            let Effect::ScanPlaced { stamp_ns, place, place_from_body, .. } = effect else { continue };
            placed.resize(placed.len().max(place as usize + 1), Vec::new());
            let t_s = stamp_ns as f64 * 1e-9;
            if !is_dark(t_s, dark_s) {
                placed[place as usize].push(pose(&played.drive.at(t_s)).compose(&place_from_body.inverse()));
            }
        }
    }
    mapper.step(Event::Flush);
    let truth = placed.iter().map(|poses| (!poses.is_empty()).then(|| mean(poses))).collect();
    (mapper.graph().clone(), truth)
}

fn is_dark(t_s: f64, dark_s: &[(f64, f64)]) -> bool {
    dark_s.iter().any(|(from, to)| (from - 1e-3..to + 1e-3).contains(&t_s))
}

/// A scan in the dark sees nothing.
fn blinded(message: &Message, dark_s: &[(f64, f64)]) -> Message {
    let mut message = message.clone();
    if let Message::Scan(scan) = &mut message
        && is_dark(scan.header.stamp.seconds(), dark_s)
    {
        scan.ranges_m.fill(f32::INFINITY);
    }
    message
}

fn path_m(played: &Played, from_s: f64, to_s: f64) -> f64 {
    let times = (0..).map(|k| from_s + 0.1 * f64::from(k)).take_while(|t_s| *t_s < to_s);
    times
        .map(|t_s| pose(&played.drive.at(t_s)).distance_m(&pose(&played.drive.at((t_s + 0.1).min(to_s)))))
        .sum()
}

/// When [`BLINDED_M`] were driven.
fn blinded_s(played: &Played) -> Vec<(f64, f64)> {
    let times = (0..(10.0 * played.drive.duration_s()) as u32).map(|k| 0.1 * f64::from(k));
    let mut way_m = 0.0;
    let driven: Vec<(f64, f64)> = times
        .map(|t_s| {
            way_m += pose(&played.drive.at(t_s - 0.1)).distance_m(&pose(&played.drive.at(t_s)));
            (t_s, way_m)
        })
        .collect();
    let when = |at_m: f64| driven.iter().find(|d| d.1 >= at_m).map(|d| d.0);
    BLINDED_M.iter().filter_map(|&(from, to)| Some((when(from)?, when(to)?))).collect()
}

pub fn pose(p: &toponym_proto::Pose) -> Pose2 {
    Pose2::new(p.x_m, p.y_m, p.yaw_rad)
}

fn distance2(off: &Vector3<f64>, covariance: &Matrix3<f64>) -> f64 {
    covariance.try_inverse().map_or(f64::INFINITY, |information| off.dot(&(information * off)))
}

fn three(v: &Vector3<f64>) -> String {
    format!("{:.2} m {:.2} m {:.1}°", v.x, v.y, v.z.to_degrees())
}

fn described(c: &Crossing) -> String {
    let sigma = |m: &Matrix3<f64>| m.diagonal().map(f64::sqrt);
    format!(
        "{:.0} m, off {}, claimed {}, ideal off {}, claimed {}, distance² {:.1}, ideal {:.1}",
        c.path_m,
        three(&c.off),
        three(&sigma(&c.claimed)),
        three(&c.ideal_off),
        three(&sigma(&c.ideal)),
        distance2(&c.off, &c.claimed),
        distance2(&c.ideal_off, &c.ideal),
    )
}

fn summed(crossings: &[Crossing]) -> String {
    let n = crossings.len().max(1) as f64;
    let sum = |f: &dyn Fn(&Crossing) -> Vector3<f64>| crossings.iter().map(f).sum::<Vector3<f64>>() / n;
    let errors = sum(&|c| c.off.component_mul(&c.off)).map(f64::sqrt);
    let claimed = sum(&|c| c.claimed.diagonal()).map(f64::sqrt);
    let ratio = |c: &Crossing| c.claimed.diagonal().component_div(&c.ideal.diagonal()).map(f64::ln);
    let ratio = sum(&ratio).map(|l| (l / 2.0).exp());
    let volume = sum(&|c| Vector3::repeat((c.claimed.determinant() / c.ideal.determinant()).ln())).x;
    let worth = |d2: &dyn Fn(&Crossing) -> f64| {
        let mut all: Vec<f64> = crossings.iter().map(d2).collect();
        all.sort_by(f64::total_cmp);
        let covered = all.iter().filter(|d| **d < CHI2_95).count() as f64 / n;
        let median = all.get(all.len() / 2).copied().unwrap_or_default();
        format!(
            "{covered:.2} covered, NEES/3 {:.2} (median {:.2})",
            all.iter().sum::<f64>() / n / 3.0,
            median / 2.366
        )
    };
    format!(
        "{} stretches; off {}; claimed {}; of ideal {:.2} {:.2} {:.2}, volume^(1/3) {:.2}; {}; ideal: {}",
        crossings.len(),
        three(&errors),
        three(&claimed),
        ratio.x,
        ratio.y,
        ratio.z,
        (volume / 6.0).exp(),
        worth(&|c| distance2(&c.off, &c.claimed)),
        worth(&|c| distance2(&c.ideal_off, &c.ideal)),
    )
}
