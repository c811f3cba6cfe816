//! The posterior at one moment, immutable: what questions are answered from, over all particles.

use crate::answers::differences::differences;
use crate::answers::meaning::{Meaning, meaning};
use crate::answers::query::{
    Answer, Difference, EdgeView, GraphAnswer, Grid, LabelCount, ParticleView, PlaceView, Query, WhereAnswer,
};
use crate::answers::whereabouts::{Region, whereabouts};
use crate::edge::{PlaceId, Vertex};
use crate::effects::TrackState;
use crate::filter::Filter;
use crate::filter::labels::LabelId;
use crate::filter::particle::Particle;
use crate::filter::prune::effective_sample_size;
use crate::geometry::Pose2;
use crate::graph::Place;
use crate::language::act::{About, Act, Head, Question};
use crate::language::{Content, Name, Speech};
use crate::regions;
use crate::regions::occupancy::grid;
use crate::smoothing::Structure;
use crate::talk::ledger::Ledger;
use crate::track::places::OpenPlace;
use std::collections::BTreeMap;
use std::sync::Arc;

/// Candidates told.
const CANDIDATES_MAX: usize = 10;
/// Names told of a place.
const NAMES_MAX: usize = 5;
/// Less probable names and candidates are noise.
const PROBABILITY_MIN: f64 = 0.02;

/// Places are called by a name in what graphs differ about, if it likely applies.
const CALLED_MIN: f64 = 0.5;

/// The robot at one moment, and the map's counters.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Now {
    /// Its pose in the best particle's map.
    pub robot: Option<Pose2>,
    /// Whether to believe it.
    pub state: TrackState,
    /// +1 when the map's coordinates jump.
    pub epoch: u64,
    /// +1 per change.
    pub rev: u64,
}

/// The posterior at one moment.
#[derive(Clone, Debug)]
pub struct Snapshot {
    places: Vec<Arc<Place>>,
    open: Vec<OpenPlace>,
    structure: Arc<Structure>,
    particles: Vec<Particle>,
    /// Poses of all places, open ones too, in the best particle's map.
    poses: Vec<Pose2>,
    /// Posterior mass of graphs that were dropped.
    unresolved: f64,
    ledger: Arc<Ledger>,
    now: Now,
}

impl Snapshot {
    pub(crate) fn new(filter: &Filter, ledger: Arc<Ledger>, open: Vec<OpenPlace>, now: Now) -> Self {
        let places = filter.graph.places().to_vec();
        let poses = poses(filter.best(), &places, &open);
        let (structure, particles) = (filter.structure.clone(), filter.particles.clone());
        let unresolved = filter.unresolved();
        Self { places, open, structure, particles, poses, unresolved, ledger, now }
    }

    /// +1 when the map's coordinates jump.
    pub fn epoch(&self) -> u64 {
        self.now.epoch
    }

    /// +1 per change.
    pub fn rev(&self) -> u64 {
        self.now.rev
    }

    /// Whether there is no place yet.
    pub fn is_empty(&self) -> bool {
        self.places.is_empty() && self.open.is_empty()
    }

    /// Newest pose of the robot in the map.
    pub fn robot(&self) -> Option<Pose2> {
        self.now.robot
    }

    /// Whether to believe that pose.
    pub fn state(&self) -> TrackState {
        self.now.state
    }

    /// Answers a question; never fails: not knowing is an answer.
    pub fn answer(&self, query: &Query) -> Answer {
        match query {
            Query::Where { text, lang } => Answer::Where(self.where_is(text, lang.as_deref())),
            Query::Labels => Answer::Labels(self.labels()),
            Query::Graph => Answer::Graph(self.graph()),
            Query::Grid { resolution_m } => Answer::Grid(self.grid(*resolution_m)),
        }
    }

    /// Occupancy grid of the best particle.
    pub fn grid(&self, resolution_m: f64) -> Grid {
        let posed: Vec<(Pose2, Arc<Place>)> =
            self.poses.iter().copied().zip(self.places.iter().cloned()).collect();
        grid(&posed, resolution_m)
    }

    /// Regions of the best graph.
    pub fn regions(&self) -> Vec<regions::Region> {
        let posed: Vec<(Pose2, Arc<Place>)> =
            self.poses.iter().copied().zip(self.places.iter().cloned()).collect();
        regions::regions(&posed)
    }

    /// All graphs; places as in the best.
    pub fn graph(&self) -> GraphAnswer {
        GraphAnswer {
            epoch: self.now.epoch,
            rev: self.now.rev,
            places: self.places(),
            particles: self.particles.iter().map(|p| self.particle(p)).collect(),
            unresolved: self.unresolved,
            differences: self.differences(),
            effective_sample_size: effective_sample_size(&self.particles),
        }
    }

    /// All places, open ones too, in the best graph.
    pub fn places(&self) -> Vec<PlaceView> {
        let ids = self
            .places
            .iter()
            .map(|p| (p.id, p.stamp_ns))
            .chain(self.open.iter().map(|o| (o.id, o.stamp_ns)));
        ids.zip(&self.poses)
            .enumerate()
            .map(|(v, ((id, stamp_ns), pose))| PlaceView {
                id,
                stamp_ns,
                pose: *pose,
                labels: self.names_of(v as Vertex),
            })
            .collect()
    }

    /// What the best graphs disagree about.
    pub fn differences(&self) -> Vec<Difference> {
        let called = |id: PlaceId| {
            let (name, p) = self.names_of(id as Vertex).into_iter().next()?;
            (p >= CALLED_MIN).then_some(name)
        };
        differences(&self.particles, 1.0 - self.unresolved, called)
    }

    fn particle(&self, p: &Particle) -> ParticleView {
        let edges = p.edges.iter().map(|e| EdgeView {
            i: PlaceId::from(e.i),
            j: PlaceId::from(e.j),
            kind: e.kind,
            i_from_j: e.i_from_j,
        });
        ParticleView {
            weight: (1.0 - self.unresolved) * p.weight(),
            edges: edges.collect(),
            poses: poses(p, &self.places, &self.open),
        }
    }

    /// Every name taught and the place most likely called so.
    pub fn labels(&self) -> Vec<LabelCount> {
        let mut out = Vec::new();
        for (k, label) in self.ledger.names().iter().enumerate() {
            let applies = self.applies(k as LabelId);
            let Some((&place, _)) = applies.iter().max_by(|a, b| a.1.total_cmp(b.1).then(b.0.cmp(a.0)))
            else {
                continue;
            };
            let mut utterances: Vec<u32> = self.particles[0]
                .labels
                .evidence()
                .iter()
                .filter(|e| e.label == k as LabelId)
                .map(|e| e.utterance)
                .collect();
            utterances.sort_unstable();
            utterances.dedup();
            out.push(LabelCount {
                label: label.clone(),
                shown: self.ledger.spelled(label).to_owned(),
                utterances: utterances.len() as u64,
                place: PlaceId::from(place),
            });
        }
        out
    }

    /// P(name applies) per place over the whole posterior.
    fn applies(&self, label: LabelId) -> BTreeMap<Vertex, f64> {
        let mut sum = BTreeMap::new();
        for p in &self.particles {
            for (v, applies) in p.labels.applies(label) {
                *sum.entry(v).or_insert(0.0) += p.weight() * applies;
            }
        }
        sum
    }

    fn names_of(&self, v: Vertex) -> Vec<(String, f64)> {
        let mut sums: BTreeMap<LabelId, f64> = BTreeMap::new();
        for p in &self.particles {
            for (label, applies) in p.labels.names(v) {
                *sums.entry(label).or_insert(0.0) += p.weight() * applies;
            }
        }
        let mut names: Vec<(String, f64)> = sums
            .into_iter()
            .filter(|(_, p)| *p >= PROBABILITY_MIN)
            .map(|(label, p)| (self.ledger.name(label).to_owned(), p))
            // A tie between two places has none.
            .filter(|(name, _)| !name.is_empty())
            .collect();
        names.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
        names.truncate(NAMES_MAX);
        names
    }

    /// "Where is the gym?": over all particles, which place is meant.
    fn where_is(&self, text: &str, lang: Option<&str>) -> WhereAnswer {
        let name = self.speech(lang).and_then(|speech| speech.parse_query(text));
        let found = name.map(|name| self.where_named(&name));
        WhereAnswer { text: text.to_owned(), ..found.unwrap_or_else(|| self.nowhere(None)) }
    }

    fn speech(&self, lang: Option<&str>) -> Option<Speech> {
        Speech::new(lang, self.ledger.glossary.clone())
    }

    /// Whether a question is about the robot's own place: "where am I?" Who is lost can't be told.
    pub fn is_of_robot(&self, query: &Query) -> bool {
        let Query::Where { text, lang } = query else { return false };
        let of_here = |act: &Act| match &act.content {
            Content::Ask { kind: Question::Where, about: About::Phrase(phrase) } => phrase.head == Head::Here,
            _ => false,
        };
        self.speech(lang.as_deref()).is_some_and(|speech| speech.parse(text).acts().iter().any(of_here))
    }

    fn nowhere(&self, name: Option<&Name>) -> WhereAnswer {
        WhereAnswer {
            text: name.map_or_else(String::new, |n| n.as_str().to_owned()),
            label: name.map(|n| n.as_str().to_owned()),
            via: "unknown".to_owned(),
            p_none: 1.0,
            unresolved: self.unresolved,
            candidates: Vec::new(),
            suggestions: Vec::new(),
            // Who is lost is nowhere to count distances from.
            robot: self.now.robot.filter(|_| self.now.state != TrackState::Lost),
        }
    }

    /// Where is what people may mean by a name.
    pub(crate) fn where_named(&self, name: &Name) -> WhereAnswer {
        let Meaning { via, p, labels, suggestions } =
            meaning(name, &self.ledger, &|label| self.is_known(label), &|| self.known());
        let names = |ids: Vec<LabelId>| ids.iter().map(|&id| self.ledger.name(id).to_owned()).collect();
        let (via, suggestions) = (via.to_owned(), names(suggestions));
        let mut answer = WhereAnswer { via, suggestions, ..self.nowhere(Some(name)) };
        let pose = |p: &Particle, v: Vertex| self.pose(p, v);
        let found = |&label: &LabelId| {
            let found = whereabouts(&self.particles, &pose, label, PROBABILITY_MIN);
            (label, found.regions, found.p_none)
        };
        let found: Vec<(LabelId, Vec<Region>, f64)> = labels.iter().map(found).collect();
        // One place is meant: names that are as likely share it, as far as each is anywhere.
        let somewhere: f64 = found.iter().map(|(.., p_none)| 1.0 - p_none).sum();
        let share = p * self.resolved() / somewhere.max(1.0);
        let mut all: Vec<(LabelId, Region)> = Vec::new();
        for (label, regions, _) in found {
            let likely = regions.into_iter().filter(|r| r.p_is >= PROBABILITY_MIN);
            all.extend(likely.map(|r| (label, Region { probability: share * r.probability, ..r })));
        }
        all.sort_by(|(_, a), (_, b)| b.probability.total_cmp(&a.probability).then(a.place.cmp(&b.place)));
        all.truncate(CANDIDATES_MAX);
        // None of those told: of the others each is next to impossible.
        answer.p_none = 1.0 - all.iter().map(|(_, r)| r.probability).sum::<f64>();
        answer.candidates = all.into_iter().map(|(label, r)| self.candidate(label, r)).collect();
        answer
    }

    /// Pose of a place, or of one that is not frozen yet, in a particle's map.
    fn pose(&self, p: &Particle, v: Vertex) -> Option<Pose2> {
        let frozen = p.belief.len();
        if (v as usize) < frozen {
            return Some(p.belief.pose(v));
        }
        open_poses(p, &self.places, &self.open).get(v as usize - frozen).copied()
    }

    /// Whether something speaks for a name.
    fn is_known(&self, label: LabelId) -> bool {
        let mut evidence = self.particles.iter().flat_map(|p| p.labels.evidence());
        evidence.any(|e| e.label == label && e.weight > 0.0) && !self.ledger.name(label).is_empty()
    }

    /// Names that something speaks for, in the order first said.
    fn known(&self) -> Vec<LabelId> {
        let mut known = vec![false; self.ledger.names().len()];
        for e in self.particles.iter().flat_map(|p| p.labels.evidence()).filter(|e| e.weight > 0.0) {
            if let Some(known) = known.get_mut(e.label as usize) {
                *known = true;
            }
        }
        let ids = (0..known.len()).filter(|&id| known[id]).map(|id| id as LabelId);
        ids.filter(|&id| !self.ledger.name(id).is_empty()).collect()
    }

    /// Names of places so near a pose of the best map, but for one, each with the most that it applies to any of
    /// them; likeliest first.
    pub(crate) fn called_around(&self, pose: &Pose2, reach_m: f64, but: Option<&str>) -> Vec<(String, f64)> {
        let near = (0..self.poses.len()).filter(|&v| self.poses[v].distance_m(pose) < reach_m);
        let mut names: BTreeMap<String, f64> = BTreeMap::new();
        for (name, p) in near.flat_map(|v| self.names_of(v as Vertex)) {
            let most = names.entry(name).or_insert(0.0);
            *most = most.max(p);
        }
        let mut names: Vec<_> = names.into_iter().filter(|(name, _)| Some(name.as_str()) != but).collect();
        names.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
        names
    }

    /// A name as one says it, spelled as the guide does.
    pub(crate) fn spoken(&self, name: &str) -> String {
        let Some(canonical) = Name::new(name) else { return name.to_owned() };
        let article = if canonical.with_article() == canonical.as_str() { "" } else { "the " };
        format!("{article}{}", self.ledger.spelled(name))
    }

    /// Share of the posterior that the particles stand for; what was pruned and may yet be true is none of
    /// them, and no question is answered from it.
    fn resolved(&self) -> f64 {
        1.0 - self.unresolved
    }
}

/// Poses of all places, open ones too, in a particle's map.
fn poses(p: &Particle, places: &[Arc<Place>], open: &[OpenPlace]) -> Vec<Pose2> {
    let mut poses = p.belief.poses();
    poses.extend(open_poses(p, places, open));
    poses
}

/// Poses, in a particle's map, of the places that are not frozen yet.
pub fn open_poses(p: &Particle, places: &[Arc<Place>], open: &[OpenPlace]) -> Vec<Pose2> {
    let last = p.belief.len().checked_sub(1).map(|v| v as Vertex);
    let map_from_front = match (last, open.first()) {
        (Some(v), _) => p.belief.pose(v).compose(&places[v as usize].front_from_place.inverse()),
        (None, Some(first)) => first.front_from_place.inverse(),
        (None, None) => Pose2::default(),
    };
    open.iter().map(|o| map_from_front.compose(&o.front_from_place)).collect()
}

mod candidate;
#[cfg(test)]
mod tests;
