//! Grounding: which place is "the gym" in "the gym is down the hallway"? Paper III-E, eqs. (14–16),
//! the Generalized Grounding Graph with one factor per part of the clause.
//!
//! The relation's factor is a *density over the floor* (per m²), given speaker and landmark; a place
//! gets the mass of the floor that the robot saw as that place, and what lies on floor not yet seen
//! goes to "elsewhere". So nothing but the share of the neighbourhood that is already mapped decides
//! how far an unknown figure is trusted to be in the map. (The paper's σ(−d/30 m) for "near" has no
//! scale of its own and can't say "not here yet".)

use crate::language::act::Frame;
use crate::language::grounding::clause::{LandmarkBelief, Reading};
use crate::language::grounding::factor::{Factor, Target};
use crate::language::grounding::place::GroundPlace;
use crate::language::grounding::scales::Scales;
use crate::language::grounding::scene::Scene;
use crate::language::relation::Relation;

/// Which place is the figure; `p` and `p_elsewhere` sum to one.
#[derive(Clone, Debug, PartialEq)]
pub struct Grounding {
    /// Per place: probability that it is the figure.
    pub p: Vec<f64>,
    /// Probability that the figure is not in the map yet.
    pub p_elsewhere: f64,
    /// Per place: share of all floor where a thing may lie of which this is said, whatever it is called. What they
    /// lack to one is floor not seen yet.
    pub floor: Vec<f64>,
}

/// Landmark hypotheses summed over, per reading; the likeliest are kept.
const MAX_LANDMARKS: usize = 4;
/// Readings summed over; the likeliest are kept.
const MAX_READINGS: usize = 8;
/// A place stands for a strip of floor this wide, and no longer than this.
const CELL_WIDTH_M: f64 = 3.0;
const CELL_LENGTH_MAX_M: f64 = 3.0;
/// Floor on which a place known by name might lie: turns densities into likelihood ratios.
const FLOOR_M2: f64 = 3000.0;
/// Bounds of that ratio: no description moves a taught name further.
const RATIO: (f64, f64) = (0.05, 20.0);
/// Prior that a figure whose name was never taught has not been visited, even where all floor that
/// the words allow has been: guides describe what is yet to come, and a visit is when names are taught.
const NOT_YET: f64 = 0.5;
/// No name is so well known that it can't also apply to a place not yet seen.
const KNOWN_MAX: f64 = 0.95;
/// Whose left "left of the kitchen" is, where the words don't say: set by reasoning, mostly as who looks
/// at the landmark sees it.
const FRAMES: [(Frame, f64); 3] = [(Frame::Hearer, 0.7), (Frame::Intrinsic, 0.2), (Frame::Path, 0.1)];

/// Which place is the figure of a clause, eqs. (14–16), summed over its readings, frames and landmarks.
///
/// `speaker` is the index of the place held when the sentence began. `figure_prior` holds, per place,
/// the probability that the figure's name applies there; equal values (or a slice of another length)
/// mean that the name was never taught. What weights of readings and of landmarks lack to one is "an
/// unknown relation to an unknown place", so no readings say nothing. Linear in the places.
pub fn ground_clause(
    readings: &[Reading],
    places: &[GroundPlace],
    speaker: usize,
    figure_prior: &[f64],
) -> Grounding {
    ground_with(&Scales::FITTED, readings, places, speaker, figure_prior)
}

/// As [`ground_clause`], by templates of other scales.
pub fn ground_with(
    scales: &Scales,
    readings: &[Reading],
    places: &[GroundPlace],
    speaker: usize,
    figure_prior: &[f64],
) -> Grounding {
    let cells_m2: Vec<f64> = (0..places.len()).map(|i| cell_length_m(places, i) * CELL_WIDTH_M).collect();
    let (density, p_known) = clause_density(scales, readings, places, speaker);
    let p_unknown = (1.0 - p_known).max(0.0);
    let seen: f64 = density.iter().zip(&cells_m2).map(|(f, a)| f * a).sum();
    // Several passes over the same floor must not count it twice.
    let cap = if seen > 1.0 { 1.0 / seen } else { 1.0 };
    let (known, share) = taught(figure_prior, places.len());
    // (14), the sum over what the figure is: a place taught by that name, a place seen without being
    // named, or one not in the map yet.
    let floor: Vec<f64> = density.iter().zip(&cells_m2).map(|(f, m2)| f * m2 * cap).collect();
    let ratio = |f: f64| (f * FLOOR_M2 + p_unknown).clamp(RATIO.0, RATIO.1);
    let mut p: Vec<f64> = (0..places.len())
        .map(|i| known * share[i] * ratio(density[i]) + (1.0 - known) * (1.0 - NOT_YET) * floor[i])
        .collect();
    let elsewhere = (1.0 - known) * (1.0 - (1.0 - NOT_YET) * (seen * cap));
    let z = p.iter().sum::<f64>() + elsewhere; // 1/Z of (16)
    if !(z.is_finite() && z > 0.0) {
        return nothing_said(places.len());
    }
    for x in &mut p {
        *x /= z;
    }
    Grounding { p, p_elsewhere: elsewhere / z, floor }
}

/// Density of the figure of a clause at every place, per m²: (15) alone, its factors those of the path driven.
pub fn densities(readings: &[Reading], places: &[GroundPlace], speaker: usize) -> Vec<f64> {
    clause_density(&Scales::FITTED, readings, places, speaker).0
}

fn nothing_said(places: usize) -> Grounding {
    Grounding { p: vec![0.0; places], p_elsewhere: 1.0, floor: vec![0.0; places] }
}

/// Σ over readings, frames and landmarks of their probability times f(figure, landmark), per m² at every
/// place: (15), whose terms are the factors of (16). Beside it the probability of all these terms.
fn clause_density(
    scales: &Scales,
    readings: &[Reading],
    places: &[GroundPlace],
    speaker: usize,
) -> (Vec<f64>, f64) {
    let mut density = vec![0.0; places.len()];
    let mut total = 0.0;
    let Some(scene) = Scene::new(places, speaker, *scales) else { return (density, total) };
    let mut kept: Vec<&Reading> =
        readings.iter().filter(|r| r.weight.is_finite() && r.weight > 0.0).collect();
    kept.sort_by(|a, b| b.weight.total_cmp(&a.weight));
    kept.truncate(MAX_READINGS);
    let scale = 1.0 / kept.iter().map(|r| r.weight).sum::<f64>().max(1.0);
    let mut of_reading = Vec::new();
    for reading in kept {
        let targets = targets(&scene, reading.landmarks);
        of_reading.clear();
        of_reading.resize(places.len(), 0.0);
        for &(target, p) in &targets {
            for (frame, share) in frames(reading) {
                let factor = Factor::new(&scene, reading.relation, frame, reading.narrowing, target);
                if let Some(factor) = factor {
                    factor.add_densities(p * share, &mut of_reading);
                }
            }
        }
        if !contains_figure(reading.relation) {
            without_landmarks(&scene, &mut of_reading, &targets);
        }
        let weight = reading.weight * scale;
        for (sum, f) in density.iter_mut().zip(&of_reading) {
            *sum += weight * f;
        }
        total += weight * targets.iter().map(|t| t.1).sum::<f64>();
    }
    (density, total)
}

/// A thing is not located by itself: the likelier a place, or the room it is in, is the landmark, the
/// less it is the figure.
fn without_landmarks(scene: &Scene, density: &mut [f64], targets: &[(Target, f64)]) {
    let top = targets.iter().map(|t| t.1).fold(f64::MIN_POSITIVE, f64::max);
    for &(target, p) in targets {
        for place in [Some(target.place), target.other].into_iter().flatten() {
            let rest = 1.0 - p / top;
            let room = scene.room(place).filter(|_| !target.way);
            let Some(room) = room else {
                density[place] *= rest;
                continue;
            };
            let floor = scene.footprint(place, false);
            let inside = |k: usize| {
                let (x_m, y_m) = scene.at(k);
                floor.signed_distance_m(floor.local(x_m, y_m)) <= 0.0
            };
            for (k, f) in density.iter_mut().enumerate().filter(|(_, f)| **f > 0.0) {
                if room.visits.iter().any(|v| v.contains(&k)) || inside(k) {
                    *f *= rest;
                }
            }
        }
    }
}

/// The figure may be where the landmark is.
fn contains_figure(relation: Relation) -> bool {
    matches!(relation, Relation::At | Relation::In | Relation::On | Relation::Contains | Relation::To)
}

/// Whose left, front or way, with probabilities.
fn frames(reading: &Reading) -> impl Iterator<Item = (Frame, f64)> {
    let sided = matches!(
        reading.relation,
        Relation::LeftOf | Relation::RightOf | Relation::InFrontOf | Relation::Behind
    );
    let said = reading.frame.or((!sided).then_some(Frame::Hearer));
    FRAMES.into_iter().enumerate().filter_map(move |(k, of)| match said {
        Some(frame) => (k == 0).then_some((frame, 1.0)),
        None => Some(of),
    })
}

/// Landmarks, or pairs of them, with probabilities.
fn targets(scene: &Scene, landmarks: &[LandmarkBelief]) -> Vec<(Target, f64)> {
    let Some(first) = landmarks.first() else { return Vec::new() };
    let single = |(place, p): (usize, f64)| (Target { place, way: first.way, other: None }, p);
    let firsts: Vec<_> = likeliest(scene, first.places).into_iter().map(single).collect();
    let Some(second) = landmarks.get(1) else { return firsts };
    let seconds = likeliest(scene, second.places);
    let pair = |(target, p): (Target, f64), (other, q): (usize, f64)| {
        // "Between the office and the office" means two.
        (target.place != other).then_some((Target { other: Some(other), ..target }, p * q))
    };
    let mut pairs: Vec<_> =
        firsts.iter().flat_map(|&a| seconds.iter().filter_map(move |&b| pair(a, b))).collect();
    pairs.sort_by(|a, b| b.1.total_cmp(&a.1));
    pairs.truncate(MAX_LANDMARKS);
    pairs
}

/// Length of path that a place stands for: half way to its neighbours.
fn cell_length_m(places: &[GroundPlace], i: usize) -> f64 {
    let path = |j: usize| places.get(j).map_or(places[i].path_m, |p| p.path_m);
    let before = path(i.saturating_sub(1));
    ((path(i + 1) - before).abs() / 2.0).clamp(0.1, CELL_LENGTH_MAX_M)
}

/// The likeliest landmarks, the nearer first among equals, with their total kept.
fn likeliest(scene: &Scene, landmark: &[(usize, f64)]) -> Vec<(usize, f64)> {
    let (places, from) = (scene.places, scene.stand());
    let distance_m = |i: usize| (places[i].x_m - from.0).hypot(places[i].y_m - from.1);
    let mut kept: Vec<(usize, f64)> =
        landmark.iter().copied().filter(|&(i, p)| i < places.len() && p.is_finite() && p > 0.0).collect();
    let total: f64 = kept.iter().map(|l| l.1).sum();
    kept.sort_by(|a, b| {
        b.1.total_cmp(&a.1).then(distance_m(a.0).total_cmp(&distance_m(b.0))).then(a.0.cmp(&b.0))
    });
    kept.truncate(MAX_LANDMARKS);
    let left: f64 = kept.iter().map(|l| l.1).sum();
    let scale = total.min(1.0) / left;
    for l in &mut kept {
        l.1 *= scale;
    }
    kept
}

/// How surely the figure's name has been taught, and every place's share in it. What all places
/// have in common tells none of them apart and is not evidence of teaching.
fn taught(figure_prior: &[f64], places: usize) -> (f64, Vec<f64>) {
    let unit = |p: &f64| if p.is_finite() { p.clamp(0.0, 1.0) } else { 0.0 };
    let low = figure_prior.iter().map(unit).fold(1.0, f64::min);
    let told: Vec<f64> = figure_prior.iter().map(|p| unit(p) - low).collect();
    let total: f64 = told.iter().sum();
    if told.len() != places || total <= 0.0 {
        return (0.0, vec![0.0; places]);
    }
    let high = told.iter().copied().fold(0.0, f64::max);
    (high.min(KNOWN_MAX), told.iter().map(|p| p / total).collect())
}

#[cfg(test)]
mod tests;
