//! Names of rooms: what was said outright of which region of the best graph, and where descriptions put what they
//! speak of.

use crate::answers::described::Which;
use crate::answers::described::features::{Clause, Scene, Speaker};
use crate::edge::Vertex;
use crate::event::StampNs;
use crate::filter::labels::{Evidence, LabelId, Labels, Source};
use crate::filter::naming::Tally;
use crate::geometry::{Pose2, wrap};
use crate::language::act::{Analysis, Head, Locate, Modifiers, Phrase, Restriction};
use crate::language::{GroundPlace, Name, Relation};
use crate::regions::{Rooms, Shape};
use crate::talk::describe::{located_by, narrowing};
use crate::talk::ledger::{Entry, Ledger};
use std::collections::BTreeMap;

/// Landmarks looked at, the likeliest.
const LANDMARKS_MAX: usize = 4;
/// "This hallway" and "the nearest exit" are about so near.
const THIS_M: f64 = 10.0;
/// A description says nothing, or something else, so often.
const DOUBT: f64 = 0.1;
/// A landmark that was described itself may lie by another that was.
const DEPTH_MAX: usize = 2;

/// Where something may be said of: a region, or a place that lies in none.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Spot {
    /// By its index.
    Region(usize),
    /// By its number.
    Place(Vertex),
}

/// The rooms of the best graph and their names.
#[derive(Clone, Debug, Default)]
pub struct Named {
    /// The rooms.
    pub rooms: Rooms,
    /// All places, not frozen ones too, in the best graph's map.
    places: Vec<GroundPlace>,
    stamps_ns: Vec<StampNs>,
    /// The region of each frozen place.
    region_of: Vec<Option<usize>>,
    /// What was said outright of each region.
    outright: Vec<BTreeMap<LabelId, Tally>>,
}

/// A description and what comes of it.
pub struct Described {
    /// Which region is meant.
    pub which: Which,
    /// The same before anything was described.
    pub prior: Which,
    /// The sentences.
    pub utterances: Vec<u32>,
}

impl Named {
    /// Of the best graph: rooms, all places with their stamps, and what is said of them.
    pub fn new(
        rooms: Rooms,
        (places, stamps_ns): (Vec<GroundPlace>, Vec<StampNs>),
        labels: &Labels,
        ledger: &Ledger,
    ) -> Self {
        let mut region_of = vec![None; places.len()];
        for (r, region) in rooms.regions.iter().enumerate() {
            for &v in &region.places {
                region_of[v as usize] = Some(r);
            }
        }
        let outright = vec![BTreeMap::new(); rooms.regions.len()];
        let mut named = Self { rooms, places, stamps_ns, region_of, outright };
        for e in labels.evidence() {
            if let Spot::Region(r) = named.spot(e, ledger) {
                let tally: &mut Tally = named.outright[r].entry(e.label).or_default();
                match e.source {
                    Source::Direct | Source::DirectOther => tally.said += e.weight,
                    Source::Denied => tally.denied -= e.weight,
                    _ => {}
                }
            }
        }
        named
    }

    /// Of what a piece of evidence speaks. Of where one is, who says it is, and a place is some steps long.
    pub fn spot(&self, e: &Evidence, ledger: &Ledger) -> Spot {
        let entry = ledger.entries().get(e.utterance as usize);
        let here = entry.filter(|entry| entry.held == e.place && e.source != Source::Carried);
        let region = match here.and_then(|entry| self.speaker(entry)) {
            Some(Speaker { pose, .. }) => self.rooms.at(pose.x_m, pose.y_m),
            None => self.region_of.get(e.place as usize).copied().flatten(),
        };
        region.map_or(Spot::Place(e.place), Spot::Region)
    }

    /// The place that stands for a spot, nearest to where its name was given if that is known.
    pub fn anchor(&self, spot: Spot, said_at: Option<(f64, f64)>) -> Vertex {
        let region = match spot {
            Spot::Place(v) => return v,
            Spot::Region(r) => &self.rooms.regions[r],
        };
        let (x, y) = said_at.unwrap_or(region.middle_m);
        let far_m = |v: &Vertex| {
            let p = &self.places[*v as usize];
            (p.x_m - x).hypot(p.y_m - y)
        };
        region.places.iter().copied().min_by(|a, b| far_m(a).total_cmp(&far_m(b))).unwrap_or(0)
    }

    /// Where who said something was: between the place held and the next.
    pub fn speaker(&self, entry: &Entry) -> Option<Speaker> {
        let v = entry.held as usize;
        let (from, began_ns) = (self.places.get(v)?, *self.stamps_ns.get(v)?);
        let here = Pose2::new(from.x_m, from.y_m, from.yaw_rad);
        let Some((to, next_ns)) = self.places.get(v + 1).zip(self.stamps_ns.get(v + 1)) else {
            return Some(Speaker { pose: here, place: entry.held, path_m: from.path_m });
        };
        let whole = (next_ns - began_ns).max(1) as f64;
        let share = ((entry.stamp_ns - began_ns) as f64 / whole).clamp(0.0, 1.0);
        let between = |a: f64, b: f64| a + share * (b - a);
        // A break lies between two places that are far apart.
        if (to.x_m - from.x_m).hypot(to.y_m - from.y_m) > 2.0 * (to.path_m - from.path_m).max(1.0) {
            return Some(Speaker { pose: here, place: entry.held, path_m: from.path_m });
        }
        let yaw_rad = from.yaw_rad + share * wrap(to.yaw_rad - from.yaw_rad);
        let pose = Pose2::new(between(from.x_m, to.x_m), between(from.y_m, to.y_m), yaw_rad);
        Some(Speaker { pose, place: entry.held, path_m: between(from.path_m, to.path_m) })
    }

    /// Where a name's descriptions put it; none if there are none.
    pub fn described(&self, label: LabelId, ledger: &Ledger) -> Option<Described> {
        self.described_at(label, ledger, 0)
    }

    /// The same by what descriptions were grounded to in a particle, each a distribution over places.
    pub fn grounded(&self, label: LabelId, labels: &Labels) -> Option<Described> {
        let of_it = |e: &&Evidence| e.label == label && e.source == Source::Grounded;
        let (mut which, mut utterances) = (Which::nothing(self.rooms.regions.len()), Vec::new());
        for e in labels.evidence().iter().filter(of_it) {
            utterances.push(e.utterance);
            match self.region_of.get(e.place as usize).copied().flatten() {
                Some(r) => which.p[r] += e.weight,
                None => which.p_none += e.weight,
            }
        }
        utterances.dedup();
        which.p_none += (1.0 - which.p.iter().sum::<f64>() - which.p_none).max(0.0);
        let prior = which.clone();
        (!utterances.is_empty()).then(|| Described { which: which.normalised(), prior, utterances })
    }

    fn described_at(&self, label: LabelId, ledger: &Ledger, depth: usize) -> Option<Described> {
        let other = self.other(label, ledger);
        let scene =
            Scene { rooms: &self.rooms, places: &self.places, other: &other, way: ledger.is_way(label) };
        let prior = Which::anywhere(&scene);
        let (mut which, mut utterances): (Option<Which>, Vec<u32>) = (None, Vec::new());
        for utterance in ledger.descriptions() {
            let entry = &ledger.entries()[utterance as usize];
            if !entry.stands || !ledger.speaks_of(utterance, label) {
                continue;
            }
            let said = Said { named: self, ledger, entry, scene: &scene, prior: &prior, depth };
            if let Some(of_it) = said.of(label) {
                utterances.push(utterance);
                which = Some(match which {
                    None => {
                        let mut doubted = Which::nothing(of_it.p.len());
                        doubted.add(1.0 - DOUBT, &of_it);
                        doubted.add(DOUBT, &prior);
                        doubted
                    }
                    Some(which) => which.and(&of_it, &prior, DOUBT),
                });
            }
        }
        Some(Described { which: which?, prior, utterances })
    }

    /// By region, the probability that it was given another name outright.
    fn other(&self, label: LabelId, ledger: &Ledger) -> Vec<f64> {
        let is_other = |l: &LabelId| *l != label && !ledger.is_way(*l);
        let of = |names: &BTreeMap<LabelId, Tally>| {
            names.iter().filter(|(l, _)| is_other(l)).map(|(_, t)| t.told()).fold(0.0, f64::max)
        };
        self.outright.iter().map(of).collect()
    }

    /// Regions that bear a name, and how likely each is meant by it.
    fn bearers(&self, label: LabelId, ledger: &Ledger, depth: usize) -> Vec<(usize, f64)> {
        let told = |names: &BTreeMap<LabelId, Tally>| names.get(&label).map_or(0.0, |t| t.told());
        let outright = self.outright.iter().map(told).enumerate();
        let mut p: Vec<(usize, f64)> = outright.filter(|(_, p)| *p > 0.0).collect();
        if p.is_empty() && depth < DEPTH_MAX {
            let described = self.described_at(label, ledger, depth + 1);
            p.extend(described.into_iter().flat_map(|d| d.which.p.into_iter().enumerate()));
        }
        p
    }
}

/// A sentence that describes, in a map.
struct Said<'a> {
    named: &'a Named,
    ledger: &'a Ledger,
    entry: &'a Entry,
    scene: &'a Scene<'a>,
    prior: &'a Which,
    depth: usize,
}

impl Said<'_> {
    /// Which region a name's is by what is said of it: readings are summed, what one reading says is all so. None if
    /// nothing is.
    fn of(&self, label: LabelId) -> Option<Which> {
        let speaker = self.named.speaker(self.entry)?;
        let is_figure = |l: &Locate| {
            l.figure.label().and_then(|name| self.ledger.label(name.as_str())) == Some(label)
        };
        let (mut sum, mut rest) = (Which::nothing(self.prior.p.len()), 1.0);
        for reading in &self.entry.parse.analyses {
            let located: Vec<(f64, Locate)> =
                located_by(reading).into_iter().filter(|(_, l)| is_figure(l)).collect();
            let Analysis { weight, .. } = reading;
            let each = located.iter().map(|(certainty, l)| self.clause(l, *certainty, &speaker));
            if let Some(all) = each.reduce(|a, b| a.and(&b, self.prior, DOUBT)) {
                sum.add(*weight, &all);
                rest -= weight;
            }
        }
        if rest >= 1.0 {
            return None;
        }
        sum.add(rest.max(0.0), self.prior);
        Some(sum)
    }

    fn clause(&self, l: &Locate, certainty: f64, speaker: &Speaker) -> Which {
        let Locate { relation, modifiers, landmarks, frame, .. } = l;
        let mut which = self.lies((*relation, modifiers, landmarks), *frame, speaker);
        let mut doubted = Which::nothing(which.p.len());
        doubted.add(certainty, &which);
        doubted.add(1.0 - certainty, self.prior);
        std::mem::swap(&mut which, &mut doubted);
        which
    }

    /// (15): the sum over what the landmarks may be.
    fn lies(
        &self,
        (relation, modifiers, landmarks): (Relation, &Modifiers, &[Phrase]),
        frame: Option<crate::language::Frame>,
        speaker: &Speaker,
    ) -> Which {
        let way = landmarks.first().is_some_and(is_way);
        let narrowing = narrowing(modifiers, landmarks.first());
        let clause = |landmarks: Vec<usize>| {
            let speaker = Some(*speaker);
            Which::of(self.scene, &Clause { relation, frame, narrowing, landmarks, way, speaker })
        };
        let beliefs: Vec<Option<Vec<(usize, f64)>>> =
            landmarks.iter().map(|l| self.landmark(l, speaker)).collect();
        let mut sum = Which::nothing(self.prior.p.len());
        let mut rest = 1.0;
        let mut add = |landmarks: Vec<usize>, p: f64| {
            sum.add(p, &clause(landmarks));
            rest -= p;
        };
        match beliefs.as_slice() {
            [] | [None, ..] => add(Vec::new(), 1.0),
            [Some(first)] | [Some(first), None, ..] => first.iter().for_each(|&(r, p)| add(vec![r], p)),
            [Some(first), Some(second), ..] => {
                for (&(a, p), &(b, q)) in first.iter().flat_map(|a| second.iter().map(move |b| (a, b))) {
                    if a != b {
                        add(vec![a, b], p * q);
                    }
                }
            }
        }
        sum.add(rest.max(0.0), self.prior);
        sum
    }

    /// Regions that a landmark may be, with probabilities that sum to at most one; none: it is where who speaks is.
    fn landmark(&self, phrase: &Phrase, speaker: &Speaker) -> Option<Vec<(usize, f64)>> {
        let regions = &self.named.rooms.regions;
        let name = match phrase.head {
            Head::Here | Head::Agent | Head::Speaker | Head::Path | Head::It => return None,
            _ => phrase.label(),
        };
        let label = name.as_ref().and_then(|name| self.ledger.label(name.as_str()));
        let mut p: Vec<(usize, f64)> =
            label.map_or_else(Vec::new, |label| self.named.bearers(label, self.ledger, self.depth));
        let here = self.named.rooms.at(speaker.pose.x_m, speaker.pose.y_m);
        let in_way = here.is_some_and(|r| regions[r].shape == Shape::Corridor);
        // "The hallway" is the one that we are in, even if nobody named it.
        if phrase.features.this || phrase.features.nearest || is_way(phrase) {
            for (r, p) in &mut p {
                let away_m = if Some(*r) == here { 0.0 } else { to_region_m(&regions[*r].polygon_m, &speaker.pose) };
                *p *= (-away_m / THIS_M).exp();
            }
            if p.iter().all(|(_, p)| *p < 0.1) && (phrase.features.this || in_way) {
                return None;
            }
        }
        for Restriction { relation, modifiers, landmarks } in &phrase.within {
            if self.depth >= DEPTH_MAX {
                break;
            }
            let so = self.lies((*relation, modifiers, landmarks), None, speaker);
            for (r, p) in &mut p {
                *p *= so.p[*r] / self.prior.p[*r].max(1e-6);
            }
        }
        p.retain(|(_, p)| *p > 0.01);
        p.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
        p.truncate(LANDMARKS_MAX);
        // One landmark is meant: what applies to several is shared among them.
        let sum = p.iter().map(|(_, p)| p).sum::<f64>().max(1.0);
        Some(p.into_iter().map(|(r, p)| (r, p / sum)).collect())
    }
}

fn is_way(phrase: &Phrase) -> bool {
    phrase.head == Head::Path || phrase.label().as_ref().is_some_and(Name::is_way)
}

/// From a pose to the nearest corner of an outline: near enough.
fn to_region_m(outline: &[(f64, f64)], pose: &Pose2) -> f64 {
    outline.iter().map(|p| (p.0 - pose.x_m).hypot(p.1 - pose.y_m)).fold(f64::INFINITY, f64::min)
}
