//! Step 3 of Algorithm 1, descriptions: where each particle puts what a sentence locates, eqs.
//! (13–16), when it is said and again as the map grows: what was not there yet may be by now.

use crate::edge::Vertex;
use crate::filter::Filter;
use crate::filter::floors::Floors;
use crate::filter::labels::{Evidence, LabelId, Labels, Source, Spot};
use crate::filter::particle::Particle;
use crate::filter::second_look::gained;
use crate::geometry::Pose2;
use crate::graph::Graph;
use crate::language::act::{Head, Locate, Parse, Phrase, Restriction};
use crate::language::{GroundPlace, Grounding, LandmarkBelief, Reading, ground_by_paper, ground_clause};
use crate::talk::ledger::Ledger;
use crate::talk::locate::{located, narrowing};
use crate::talk::{Here, Talk};
use rayon::prelude::*;
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

/// Squares of floor that a description is weighed by, and the likeliest that are.
const SPOT_M: f64 = 2.0;
const SPOTS_MAX: usize = 32;
/// Of what is shaped like a hallway or like a room so much is none of the other kind for certain.
const SHAPED: f64 = 0.95;
/// A landmark that is less probable tells nothing of where the figure is.
const MEANT_MIN: f64 = 0.1;
/// Groundings less probable are not kept.
const GROUNDED_MIN: f64 = 0.002;
/// Descriptions grounded again per place, in turn.
const AGAIN_PER_PLACE: usize = 1;
/// "This hallway" and "the nearest exit" are about so near.
const THIS_M: f64 = 10.0;
/// Of several places called alike a far one is meant so often for once that the one at hand is, and a way at hand that
/// nobody named: assumed, both.
const FAR: f64 = 0.1;
const UNNAMED: f64 = 0.05;

/// Grounds what a sentence locates in every particle, anew if it was before. `poses` of a particle's
/// places, with the path travelled up to each.
pub(crate) fn ground(
    talk: &mut Talk,
    filter: &mut Filter,
    (utterance, parse, held): (u32, &Parse, Vertex),
    poses: &(dyn Fn(&Particle) -> Vec<Pose2> + Sync),
    path_m: &[f64],
) {
    let figures: Vec<_> = located(parse).iter().filter_map(|(_, l)| l.figure.label()).collect();
    if figures.is_empty() {
        return;
    }
    let ledger = Arc::make_mut(&mut talk.ledger);
    for name in &figures {
        ledger.enter_name(name);
    }
    let (ledger, by_paper) = (&talk.ledger, filter.config.rules.by_paper());
    let graph = &filter.graph;
    let vague = graph.stretches.vague();
    let ground = |p: &mut Particle| {
        let floors = Floors::of(&vague, p);
        let scene = Scene {
            places: places(&poses(p), path_m),
            floors: &floors,
            graph,
            labels: &p.labels,
            ledger,
            utterance,
            held: held as usize,
            by_paper,
        };
        let (grounded, described) = scene.grounded(parse);
        for (figure, spots) in described {
            p.labels.describe(utterance, figure, spots);
        }
        gained(&p.labels.reground(utterance, &grounded), &grounded)
    };
    let gained: Vec<Vec<Vertex>> = filter.particles.par_iter_mut().map(ground).collect();
    filter.named_anew(gained.into_iter().flatten().collect::<BTreeSet<_>>());
}

/// Grounds some descriptions again, one after the other in turn, in the map as it is now.
pub(crate) fn reground(talk: &mut Talk, filter: &mut Filter) {
    let (turn, all) = (filter.graph.places().len(), talk.ledger.descriptions().len());
    let due = (0..AGAIN_PER_PLACE.min(all)).map(|k| (turn * AGAIN_PER_PLACE + k) % all);
    let due: Vec<u32> = due.filter_map(|k| talk.ledger.descriptions().nth(k)).collect();
    reground_some(talk, filter, &due);
}

/// Grounds all descriptions again.
pub(crate) fn reground_all(talk: &mut Talk, filter: &mut Filter) {
    let all: Vec<u32> = talk.ledger.descriptions().collect();
    reground_some(talk, filter, &all);
}

fn reground_some(talk: &mut Talk, filter: &mut Filter, utterances: &[u32]) {
    if filter.config.rules.by_paper() {
        return;
    }
    let path_m: Vec<f64> = filter.graph.places().iter().map(|p| p.path_m).collect();
    for &utterance in utterances {
        let entry = &talk.ledger.entries()[utterance as usize];
        // Said at a place that is not in the graph yet: its time will come.
        if (entry.held as usize) < path_m.len() {
            let (parse, held) = (entry.parse.clone(), entry.held);
            ground(talk, filter, (utterance, &parse, held), &|p| p.belief.poses(), &path_m);
        }
    }
}

/// Grounds again the descriptions that speak of a name, as something new was said of it.
pub(crate) fn reground_about(talk: &mut Talk, filter: &mut Filter, label: LabelId, here: &Here) {
    if filter.config.rules.by_paper() {
        return;
    }
    let ledger = &talk.ledger;
    let speaks = |p: &Phrase| p.label().is_some_and(|name| ledger.label(name.as_str()) == Some(label));
    let about = |l: &Locate| speaks(&l.figure) || l.landmarks.iter().any(speaks);
    let of = |u: &u32| &ledger.entries()[*u as usize];
    let due = ledger.descriptions().filter(|u| located(&of(u).parse).iter().any(|(_, l)| about(l)));
    let due: Vec<(u32, Parse, Vertex)> = due.map(|u| (u, of(&u).parse.clone(), of(&u).held)).collect();
    for (utterance, parse, held) in due {
        ground(talk, filter, (utterance, &parse, held), here.poses, &here.path_m);
    }
}

fn places(poses: &[Pose2], path_m: &[f64]) -> Vec<GroundPlace> {
    let place =
        |(p, &path_m): (&Pose2, &f64)| GroundPlace { x_m: p.x_m, y_m: p.y_m, yaw_rad: p.yaw_rad, path_m };
    poses.iter().zip(path_m).map(place).collect()
}

/// One particle's map, seen from where the sentence was said.
struct Scene<'a> {
    places: Vec<GroundPlace>,
    floors: &'a Floors,
    graph: &'a Graph,
    labels: &'a Labels,
    ledger: &'a Ledger,
    utterance: u32,
    held: usize,
    by_paper: bool,
}

impl Scene<'_> {
    /// Δα of all that a sentence locates: for each figure a clause, summed over its readings. Beside it for each
    /// where it may lie, whatever is called how.
    fn grounded(&self, parse: &Parse) -> (Vec<Evidence>, Vec<(LabelId, Vec<Spot>)>) {
        let mut clauses: BTreeMap<LabelId, Vec<(f64, Locate)>> = BTreeMap::new();
        for (certainty, l) in located(parse) {
            let said = l.figure.label().and_then(|name| self.ledger.said(name.as_str()));
            if let Some(said) = said.filter(|&s| self.ledger.speaks_of(self.utterance, self.ledger.meant(s)))
            {
                clauses.entry(said).or_default().push((certainty, l));
            }
        }
        let (mut grounded, mut described) = (Vec::new(), Vec::new());
        for (said, readings) in clauses {
            let label = self.ledger.meant(said);
            let certainty = readings.iter().map(|r| r.0).sum::<f64>().min(1.0);
            let grounding = self.place_of(&readings, label);
            described.push((said, self.spots(&readings, &grounding.floor, self.ledger.is_way(label))));
            let p = grounding.p;
            grounded.extend(p.iter().enumerate().filter(|(_, p)| *p * certainty >= GROUNDED_MIN).map(
                |(v, p)| {
                    let (utterance, place, weight) = (self.utterance, v as Vertex, certainty * p);
                    Evidence { utterance, said, label, place, weight, source: Source::Grounded }
                },
            ));
        }
        (grounded, described)
    }

    /// The likeliest floor, in squares of [`SPOT_M`], each by its likeliest place; a room is no floor of a hallway. Where
    /// a map lays floors one over the other that nothing ties, only those count that the speaker or a landmark is on.
    fn spots(&self, readings: &[(f64, Locate)], shares: &[f64], is_way: bool) -> Vec<Spot> {
        let landmarks = readings.iter().flat_map(|(_, l)| &l.landmarks).flat_map(|l| self.landmark(l));
        let meant = landmarks.filter(|(_, p)| *p > MEANT_MIN).map(|(v, _)| self.floor(v));
        let floors: BTreeSet<usize> = meant.chain([self.floor(self.held)]).collect();
        let mut left_out = 0.0;
        let mut squares: BTreeMap<(usize, i64, i64), (f64, Spot)> = BTreeMap::new();
        for (v, &share) in shares.iter().enumerate().filter(|(_, share)| **share > 0.0) {
            let (at, place, floor) = (&self.places[v], v as Vertex, self.floor(v));
            if !floors.contains(&floor) {
                continue;
            }
            let square = |m: f64| (m / SPOT_M).floor() as i64;
            let key = (floor, square(at.x_m), square(at.y_m));
            let of_its_kind = share * self.of_kind(v, is_way);
            left_out += share - of_its_kind;
            let share = of_its_kind;
            let (most, spot) = squares.entry(key).or_insert((0.0, Spot { place, share: 0.0 }));
            spot.share += share;
            if share > *most {
                (*most, spot.place) = (share, place);
            }
        }
        let mut spots: Vec<Spot> = squares.into_values().map(|(_, spot)| spot).collect();
        spots.sort_by(|a, b| b.share.total_cmp(&a.share).then(a.place.cmp(&b.place)));
        spots.truncate(SPOTS_MAX);
        for spot in &mut spots {
            spot.share /= 1.0 - left_out;
        }
        spots
    }

    /// By its shape, how much likelier the floor of a place is a way's, or none, than floor that nobody has seen.
    fn of_kind(&self, place: usize, is_way: bool) -> f64 {
        let way = self.graph.places().get(place).map_or(0.5, |place| place.enclosure.way());
        (1.0 - SHAPED * if is_way { 1.0 - way } else { way }) / (1.0 - SHAPED * 0.5)
    }

    /// p(figure is place i | λ), eq. (14), given what is located as its readings say.
    fn place_of(&self, clause: &[(f64, Locate)], figure: LabelId) -> Grounding {
        let landmarks: Vec<Vec<Vec<(usize, f64)>>> = clause
            .iter()
            .map(|(_, l)| l.landmarks.iter().map(|phrase| self.landmark(phrase)).collect())
            .collect();
        if self.by_paper {
            let of_first = landmarks[0].first().into_iter().flatten();
            let likeliest = of_first.max_by(|a, b| a.1.total_cmp(&b.1).then(b.0.cmp(&a.0)));
            let p = ground_by_paper(clause[0].1.relation, &self.places, likeliest.map(|l| l.0));
            return Grounding { p, p_elsewhere: 0.0, floor: Vec::new() };
        }
        let beliefs: Vec<Vec<LandmarkBelief>> = clause
            .iter()
            .zip(&landmarks)
            .map(|((_, l), of)| l.landmarks.iter().zip(of).map(|(p, places)| belief(p, places)).collect())
            .collect();
        let whole = clause.iter().map(|r| r.0).sum::<f64>().max(f64::MIN_POSITIVE);
        let readings: Vec<Reading> = clause
            .iter()
            .zip(&beliefs)
            .map(|((certainty, l), landmarks)| Reading {
                weight: certainty / whole,
                relation: l.relation,
                frame: l.frame,
                narrowing: narrowing(&l.modifiers, l.landmarks.first()),
                landmarks,
            })
            .collect();
        ground_clause(&readings, &self.places, self.held, &self.applies(figure))
    }

    /// Where a landmark may be: (place, probability), summing to at most one; empty if nobody knows.
    fn landmark(&self, phrase: &Phrase) -> Vec<(usize, f64)> {
        let mut p: Vec<f64> = match (&phrase.head, phrase.label()) {
            (Head::Here | Head::Agent | Head::Speaker | Head::Path, _) => return vec![(self.held, 1.0)],
            (_, Some(name)) => match self.ledger.label(name.as_str()) {
                Some(label) => self.applies(label),
                None => Vec::new(),
            },
            _ => Vec::new(),
        };
        let is_near = phrase.features.this || phrase.features.nearest;
        self.prefer_near(&mut p, is_near, phrase.label().is_some_and(|name| name.is_way()));
        // "This hallway" is the one we are in, even if nobody named it.
        if phrase.features.this && p.iter().all(|p| *p < GROUNDED_MIN) {
            return vec![(self.held, 1.0)];
        }
        for restriction in &phrase.within {
            self.restrict(&mut p, restriction);
        }
        // One landmark is meant: what applies to several is shared among them.
        let sum = p.iter().sum::<f64>().max(1.0);
        p.into_iter().enumerate().filter(|(_, p)| *p > 0.0).map(|(i, p)| (i, p / sum)).collect()
    }

    /// Of several that are called so the near one is meant, mostly, and of ways the one at hand, named or not; `is_near`:
    /// said to be near.
    fn prefer_near(&self, p: &mut [f64], is_near: bool, is_way: bool) {
        let Some(here) = self.places.get(self.held) else { return };
        let told: f64 = p.iter().sum();
        for (v, (p, place)) in p.iter_mut().zip(&self.places).enumerate() {
            let is_here = self.floor(v) == self.floor(self.held);
            let near = (-(place.x_m - here.x_m).hypot(place.y_m - here.y_m) / THIS_M).exp();
            let near = if is_here { near } else { 0.0 };
            // What nobody had seen by then is meant where it is at hand alone.
            let far = if is_near || is_way || v > self.held { 0.0 } else { FAR };
            *p *= near + far;
        }
        let left: f64 = p.iter().sum::<f64>() + if is_way { UNNAMED } else { 0.0 };
        // A room alone is meant wherever it is.
        if !is_near && left > 0.0 {
            let scale = told.min(1.0) / left;
            for p in p {
                *p *= scale;
            }
        }
    }

    /// "The lounge *by the stairs*": of the places so called those that lie so, (15–16).
    fn restrict(&self, p: &mut [f64], restriction: &Restriction) {
        let places: Vec<Vec<(usize, f64)>> = restriction.landmarks.iter().map(|l| self.landmark(l)).collect();
        let landmarks: Vec<LandmarkBelief> =
            restriction.landmarks.iter().zip(&places).map(|(phrase, of)| belief(phrase, of)).collect();
        let narrowing = narrowing(&restriction.modifiers, restriction.landmarks.first());
        let (relation, frame) = (restriction.relation, None);
        let reading = Reading { weight: 1.0, relation, frame, narrowing, landmarks: &landmarks };
        let so = ground_clause(&[reading], &self.places, self.held, p).p;
        for (p, so) in p.iter_mut().zip(so) {
            *p = p.min(so);
        }
    }

    /// The floor of a place.
    fn floor(&self, place: usize) -> usize {
        self.floors.floor(self.floors.part(place as Vertex))
    }

    /// P(name applies) at every place, by what other sentences said.
    fn applies(&self, label: LabelId) -> Vec<f64> {
        let applies = self.labels.applies_by_others(label, self.utterance);
        (0..self.places.len() as Vertex).map(|v| applies.get(&v).copied().unwrap_or(0.0)).collect()
    }
}

/// A landmark's places, and whether it is one that one goes along.
fn belief<'a>(phrase: &Phrase, places: &'a [(usize, f64)]) -> LandmarkBelief<'a> {
    let way = phrase.head == Head::Path || phrase.label().is_some_and(|name| name.is_way());
    LandmarkBelief { places, way }
}

#[cfg(test)]
mod tests;
