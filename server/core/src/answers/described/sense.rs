//! What a sentence says of where something is, over what its words and its landmarks may mean: eqs. (14–16).

use super::Which;
use super::features::{Clause, Scene, Speaker};
use crate::filter::labels::LabelId;
use crate::geometry::Pose2;
use crate::language::act::{Analysis, Head, Locate, Modifiers, Phrase, Restriction};
use crate::language::{Frame, Name, Relation};
use crate::regions::{Rooms, Shape};
use crate::talk::ledger::{Entry, Ledger};
use crate::talk::locate::{located_by, narrowing};

/// Landmarks looked at, the likeliest.
const LANDMARKS_MAX: usize = 4;
/// "This hallway" and "the nearest exit" are about so near.
const THIS_M: f64 = 10.0;
/// A description says nothing, or something else, so often.
pub const DOUBT: f64 = 0.05;
/// A landmark that was described itself may lie by another that was.
pub const DEPTH_MAX: usize = 2;

/// What makes sense of descriptions of one figure in a map.
pub struct Sense<'a> {
    /// The rooms.
    pub rooms: &'a Rooms,
    /// Regions that bear a name, and how likely each is meant by it, so many descriptions deep.
    pub bearers: &'a dyn Fn(LabelId, usize) -> Vec<(usize, f64)>,
    /// What was said.
    pub ledger: &'a Ledger,
    /// The map as the figure is looked for in it.
    pub scene: &'a Scene<'a>,
    /// What is known before.
    pub prior: &'a Which,
    /// How many descriptions of landmarks led here.
    pub depth: usize,
}

impl Sense<'_> {
    /// Which region a name's is by what is said of it: readings are summed, what one reading says is all so. None if
    /// nothing is.
    pub fn of(&self, entry: &Entry, speaker: &Speaker, label: LabelId) -> Option<Which> {
        let is_figure =
            |l: &Locate| l.figure.label().and_then(|name| self.ledger.label(name.as_str())) == Some(label);
        let (mut sum, mut rest) = (Which::nothing(self.prior.p.len()), 1.0);
        for reading in &entry.parse.analyses {
            let located: Vec<(f64, Locate)> =
                located_by(reading).into_iter().filter(|(_, l)| is_figure(l)).collect();
            let Analysis { weight, .. } = reading;
            let each = located.iter().filter_map(|(certainty, l)| self.clause(l, *certainty, speaker));
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

    fn clause(&self, l: &Locate, certainty: f64, speaker: &Speaker) -> Option<Which> {
        let Locate { relation, modifiers, landmarks, frame, .. } = l;
        let which = self.lies((*relation, modifiers, landmarks), *frame, speaker)?;
        let mut doubted = Which::nothing(which.p.len());
        doubted.add(certainty, &which);
        doubted.add(1.0 - certainty, self.prior);
        Some(doubted)
    }

    /// (15): the sum over what the landmarks may be; none where nobody knows any.
    pub fn lies(
        &self,
        (relation, modifiers, landmarks): (Relation, &Modifiers, &[Phrase]),
        frame: Option<Frame>,
        speaker: &Speaker,
    ) -> Option<Which> {
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
        (rest < 1.0).then_some(sum)
    }

    /// Regions that a landmark may be, with probabilities that sum to at most one; none: it is where who speaks is.
    fn landmark(&self, phrase: &Phrase, speaker: &Speaker) -> Option<Vec<(usize, f64)>> {
        let regions = &self.rooms.regions;
        let name = match phrase.head {
            Head::Here | Head::Agent | Head::Speaker | Head::Path | Head::It => return None,
            _ => phrase.label(),
        };
        let label = name.as_ref().and_then(|name| self.ledger.label(name.as_str()));
        let mut p: Vec<(usize, f64)> = label.map_or_else(Vec::new, |label| (self.bearers)(label, self.depth));
        let here = self.rooms.at(speaker.pose.x_m, speaker.pose.y_m);
        let in_way = here.is_some_and(|r| regions[r].shape == Shape::Corridor);
        // "The hallway" is the one that we are in, even if nobody named it.
        if phrase.features.this || phrase.features.nearest || is_way(phrase) {
            for (r, p) in &mut p {
                let away_m =
                    if Some(*r) == here { 0.0 } else { to_region_m(&regions[*r].polygon_m, &speaker.pose) };
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
            let Some(so) = self.lies((*relation, modifiers, landmarks), None, speaker) else { continue };
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
