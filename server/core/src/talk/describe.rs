//! Step 3 of Algorithm 1, descriptions: where each particle puts what a sentence locates, eqs.
//! (13–16), when it is said and again as the map grows: what was not there yet may be by now.

use crate::edge::Vertex;
use crate::filter::Filter;
use crate::filter::labels::{Evidence, LabelId, Labels, Source};
use crate::filter::particle::Particle;
use crate::filter::second_look::gained;
use crate::geometry::Pose2;
use crate::language::act::{
    Analysis, Content, Distance, Head, Locate, Modifiers, Ordinal, Parse, Phrase, Restriction,
};
use crate::language::{
    GroundPlace, Grounding, LandmarkBelief, Narrowing, Reading, Relation, ground_by_paper, ground_clause,
    pointed_to, seen_from_here,
};
use crate::talk::ledger::Ledger;
use crate::talk::{Here, Talk};
use rayon::prelude::*;
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

/// Groundings less probable are not kept.
const GROUNDED_MIN: f64 = 0.002;
/// Descriptions grounded again per place, in turn.
const AGAIN_PER_PLACE: usize = 1;
/// "This hallway" and "the nearest exit" are about so near.
const THIS_M: f64 = 10.0;

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
    let ground = |p: &mut Particle| {
        let scene = Scene {
            places: places(&poses(p), path_m),
            labels: &p.labels,
            ledger,
            utterance,
            held: held as usize,
            by_paper,
        };
        let (grounded, ratios) = scene.grounded(parse);
        for (figure, ratio) in ratios {
            p.labels.describe(utterance, figure, ratio);
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
    labels: &'a Labels,
    ledger: &'a Ledger,
    utterance: u32,
    held: usize,
    by_paper: bool,
}

impl Scene<'_> {
    /// Δα of all that a sentence locates: for each figure a clause, summed over its readings. Beside it
    /// for each how much likelier it is here than where nobody knows anything.
    fn grounded(&self, parse: &Parse) -> (Vec<Evidence>, Vec<(LabelId, f64)>) {
        let mut clauses: BTreeMap<LabelId, Vec<(f64, Locate)>> = BTreeMap::new();
        for (certainty, l) in located(parse) {
            let said = l.figure.label().and_then(|name| self.ledger.said(name.as_str()));
            if let Some(said) = said.filter(|&s| self.ledger.speaks_of(self.utterance, self.ledger.meant(s)))
            {
                clauses.entry(said).or_default().push((certainty, l));
            }
        }
        let (mut grounded, mut ratios) = (Vec::new(), Vec::new());
        for (said, readings) in clauses {
            let label = self.ledger.meant(said);
            let certainty = readings.iter().map(|r| r.0).sum::<f64>().min(1.0);
            let grounding = self.place_of(&readings, label);
            // Given all names, and of other descriptions those before: each pair is told once.
            let before = |e: &Evidence| e.source != Source::Grounded || e.utterance < self.utterance;
            ratios.push((said, grounding.likelihood_ratio_by(&self.applies(label, before))));
            let p = grounding.p;
            grounded.extend(p.iter().enumerate().filter(|(_, p)| *p * certainty >= GROUNDED_MIN).map(
                |(v, p)| {
                    let (utterance, place, weight) = (self.utterance, v as Vertex, certainty * p);
                    Evidence { utterance, said, label, place, weight, source: Source::Grounded }
                },
            ));
        }
        (grounded, ratios)
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
            return Grounding { p, p_elsewhere: 0.0, likelihood_ratio: 1.0, ratios: Vec::new() };
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
        ground_clause(&readings, &self.places, self.held, &self.applies(figure, |_| true))
    }

    /// Where a landmark may be: (place, probability), summing to at most one; empty if nobody knows.
    fn landmark(&self, phrase: &Phrase) -> Vec<(usize, f64)> {
        let mut p: Vec<f64> = match (&phrase.head, phrase.label()) {
            (Head::Here | Head::Agent | Head::Speaker | Head::Path, _) => return vec![(self.held, 1.0)],
            (_, Some(name)) => match self.ledger.label(name.as_str()) {
                Some(label) => self.applies(label, |_| true),
                None => Vec::new(),
            },
            _ => Vec::new(),
        };
        if phrase.features.this || phrase.features.nearest {
            let here = self.places[self.held];
            for (p, place) in p.iter_mut().zip(&self.places) {
                *p *= (-(place.x_m - here.x_m).hypot(place.y_m - here.y_m) / THIS_M).exp();
            }
            // "This hallway" is the one we are in, even if nobody named it.
            if phrase.features.this && p.iter().all(|p| *p < GROUNDED_MIN) {
                return vec![(self.held, 1.0)];
            }
        }
        for restriction in &phrase.within {
            self.restrict(&mut p, restriction);
        }
        // One landmark is meant: what applies to several is shared among them.
        let sum = p.iter().sum::<f64>().max(1.0);
        p.into_iter().enumerate().filter(|(_, p)| *p > 0.0).map(|(i, p)| (i, p / sum)).collect()
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

    /// P(name applies) at every place, by what other sentences said, those of them that count.
    fn applies(&self, label: LabelId, counts: impl Fn(&Evidence) -> bool) -> Vec<f64> {
        let applies = self.labels.applies_by_others(label, self.utterance, counts);
        (0..self.places.len() as Vertex).map(|v| applies.get(&v).copied().unwrap_or(0.0)).collect()
    }
}

/// What the readings of a text locate, each with the probability that it is said and meant.
pub(crate) fn located(parse: &Parse) -> Vec<(f64, Locate)> {
    let of = |a: &Analysis| located_by(a).into_iter().map(|(p, l)| (a.weight * p, l)).collect::<Vec<_>>();
    parse.analyses.iter().flat_map(of).collect()
}

/// What one reading locates, each with the probability that it is meant.
pub(crate) fn located_by(reading: &Analysis) -> Vec<(f64, Locate)> {
    let of = |content: &Content| match content {
        Content::Label { at, what, .. } if at.head == Head::There => Some(pointed_to(what)),
        Content::Locate(l) if l.figure.head == Head::Here => seen_from_here(l),
        Content::Locate(l) => Some(by_doors(l)),
        // "The last office on the left is Nick's".
        Content::Alias { what, also } => described(also, what),
        Content::Correct { is, .. } => match &**is {
            Content::Locate(l) => Some(by_doors(l)),
            _ => None,
        },
        _ => None,
    };
    let there = |l: &Locate| l.relation == Relation::At && l.landmarks.iter().any(|p| p.head == Head::There);
    let all = reading.acts.iter().filter_map(|act| Some((act.certainty, of(&act.content)?)));
    all.map(|(p, l)| (p, if there(&l) { pointed_to(&l.figure) } else { l })).collect()
}

/// "It is the second door on the left": what is at a described spot lies as that is described.
fn by_doors(l: &Locate) -> Locate {
    let is_counted = |p: &&Phrase| p.features.ordinal.is_some() || p.features.count.is_some();
    let spot = l.landmarks.first().filter(is_counted).filter(|_| l.relation == Relation::At);
    spot.and_then(|spot| described(&l.figure, spot)).unwrap_or_else(|| l.clone())
}

/// A figure that lies as a phrase says: "the second door *on the left*".
fn described(figure: &Phrase, as_said: &Phrase) -> Option<Locate> {
    let Restriction { relation, modifiers, landmarks } = as_said.within.first()?.clone();
    let modifiers = Modifiers { count: counted(as_said).or(modifiers.count), ..modifiers };
    Some(Locate { figure: figure.clone(), relation, modifiers, landmarks, frame: None, repaired: false })
}

/// "The second door", "two doors".
fn counted(phrase: &Phrase) -> Option<u32> {
    match phrase.features.ordinal {
        Some(Ordinal::Nth(n)) => Some(n),
        _ => phrase.features.count,
    }
}

/// A landmark's places, and whether it is one that one goes along.
fn belief<'a>(phrase: &Phrase, places: &'a [(usize, f64)]) -> LandmarkBelief<'a> {
    let way = phrase.head == Head::Path || phrase.label().is_some_and(|name| name.is_way());
    LandmarkBelief { places, way }
}

/// "Just", "twenty meters", "the second door".
pub(crate) fn narrowing(modifiers: &Modifiers, landmark: Option<&Phrase>) -> Narrowing {
    let nth = landmark.and_then(counted);
    let distance_m = modifiers.distance.map(Distance::metres);
    Narrowing { just: modifiers.just, distance_m, doors: nth.or(modifiers.count) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::Config;
    use crate::effects::HeardStatus;
    use crate::event::Utterance;
    use crate::language::Name;
    use crate::language::grammar::parse::parse;
    use crate::smoothing::Factor;
    use nalgebra::{Matrix3, Vector3};

    #[test]
    fn a_door_counted_along_the_way_is_located_and_may_be_whose() {
        for (text, relation, count) in [
            ("the kitchen is the second door on the left", Relation::LeftSide, Some(2)),
            ("the second office on the left is Nick's", Relation::LeftSide, Some(2)),
            ("two doors down from here is the server room", Relation::Down, Some(2)),
            ("the last office on the right is Nick's", Relation::RightSide, None),
        ] {
            let parse = parse(text);
            let all = located(&parse);
            let (_, l) = all.first().unwrap_or_else(|| panic!("{text} {}", parse.notation()));
            assert_eq!((l.relation, l.modifiers.count), (relation, count), "{text}");
            assert!(l.figure.label().is_some(), "{text}");
        }
    }

    #[test]
    fn what_lies_there_or_here_is_located_from_here() {
        for (text, relation) in [
            ("that is the gym", Relation::Near),
            ("the gym is over there", Relation::Near),
            ("the room over there is the gym", Relation::Near),
            ("the gym is down the hall", Relation::Down),
            ("we are right outside the gym", Relation::NextTo),
        ] {
            let all = located(&parse(text));
            assert_eq!((all[0].1.figure.label(), all[0].1.relation), (Name::new("gym"), relation), "{text}");
        }
        assert!(located(&parse("this is the gym")).is_empty());
    }

    /// Two particles that know a gym and a kitchen, in the first 20 m and in the second 3 m apart, and the
    /// log-weight of the second over that of the first once a sentence is said on the way.
    fn weighed(sentence: &str) -> f64 {
        let (mut talk, mut filter) = (Talk::default(), Filter::new(Config::default()));
        let structure = Arc::make_mut(&mut filter.structure);
        for _ in 0..21 {
            let information = Matrix3::from_diagonal(&Vector3::new(100.0, 100.0, 1e6));
            structure.add_pose(Pose2::new(1.0, 0.0, 0.0), &information).unwrap();
        }
        let i_from_j = Pose2::new(3.0, 0.0, 0.0);
        let tie =
            structure.add_factor(Factor { i: 0, j: 20, i_from_j, information: Matrix3::identity() * 1e6 });
        structure.arrange();
        let mut apart = Particle::empty();
        let mut near = Particle::empty();
        near.belief.hold(tie.unwrap());
        for p in [&mut apart, &mut near] {
            p.update(structure).unwrap();
        }
        filter.particles = vec![apart, near];
        let path_m: Vec<f64> = (0..21).map(f64::from).collect();
        for (held, text) in [(0, "this is the gym"), (20, "this is the kitchen"), (10, sentence)] {
            let here = Here {
                held: Some(held),
                poses: &|p| p.belief.poses(),
                path_m: path_m.clone(),
                part: vec![],
                dark: vec![],
            };
            let u = Utterance { id: text.into(), text: text.into(), ..Utterance::default() };
            assert_eq!(talk.hear(&mut filter, &u, &here).0.status, HeardStatus::Understood);
        }
        let length_m = |p: &Particle| p.belief.pose(20).x_m;
        let (near, apart): (Vec<_>, Vec<_>) = filter.particles.iter().partition(|p| length_m(p) < 10.0);
        near[0].log_weight - apart[0].log_weight
    }

    #[test]
    fn a_sentence_speaks_for_the_map_in_which_it_is_true() {
        let nothing = weighed("the lounge is near the cafe");
        assert!(weighed("the kitchen is near the gym") > nothing + 0.5);
        assert!(weighed("the kitchen is twenty meters from the gym") < nothing - 1.0);
        assert!(weighed("this is where we started") > nothing + 1.0);
        assert!(weighed("this is not where we started") < nothing - 1.0);
        assert!(weighed("this is the same place as the gym") > nothing + 1.0);
    }
}
