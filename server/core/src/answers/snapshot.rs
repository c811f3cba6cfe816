//! The posterior at one moment, immutable: what questions are answered from, over all particles.

use crate::answers::differences::differences;
use crate::answers::named::Named;
use crate::answers::query::{
    Answer, Difference, EdgeView, GraphAnswer, LabelCount, ParticleView, PlaceView, Query,
};
use crate::edge::{PlaceId, Vertex};
use crate::effects::TrackState;
use crate::event::StampNs;
use crate::filter::Filter;
use crate::filter::labels::LabelId;
use crate::filter::particle::Particle;
use crate::filter::prune::effective_sample_size;
use crate::geometry::Pose2;
use crate::graph::Place;
use crate::language::act::{About, Act, Head, Question};
use crate::language::{Content, GroundPlace, Name, Speech};
use crate::regions::Rooms;
use crate::regions::occupancy::Plot;
use crate::scan::cloud::Point;
use crate::smoothing::Structure;
use crate::talk::ledger::Ledger;
use crate::track::places::OpenPlace;
use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, OnceLock};

/// Names told of a place.
const NAMES_MAX: usize = 5;
/// Less probable names are noise.
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

/// What snapshots share, made by the first that is asked for it.
#[derive(Clone, Debug, Default)]
pub(crate) struct Shared {
    /// Of one posterior.
    rooms: Arc<OnceLock<Arc<Rooms>>>,
    /// Of one posterior and the places that it has, not frozen ones too.
    named: Arc<OnceLock<Named>>,
    /// Of the posterior that was asked last: what follows differs little.
    plot: Arc<Mutex<Option<Plot>>>,
}

impl Shared {
    /// The same posterior with one more place that is not frozen.
    pub fn with_place(&self) -> Self {
        Self { named: Arc::default(), ..self.clone() }
    }

    /// Another posterior.
    pub fn anew(&self) -> Self {
        Self { plot: self.plot.clone(), ..Self::default() }
    }
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
    shared: Shared,
    /// Descriptions are where the paper's rule put them.
    by_paper: bool,
    now: Now,
}

impl Snapshot {
    /// `shared`: with other snapshots of the same posterior and places.
    pub(crate) fn new(
        filter: &Filter,
        ledger: Arc<Ledger>,
        shared: Shared,
        open: Vec<OpenPlace>,
        now: Now,
    ) -> Self {
        let places = filter.graph.places().to_vec();
        let poses = poses(filter.best(), &places, &open);
        let (structure, particles) = (filter.structure.clone(), filter.particles.clone());
        let (unresolved, by_paper) = (filter.unresolved(), filter.config.rules.by_paper());
        Self { places, open, structure, particles, poses, unresolved, ledger, shared, by_paper, now }
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

    /// Posterior mass of graphs that were dropped.
    pub fn unresolved(&self) -> f64 {
        self.unresolved
    }

    /// How many places are left behind, the first of all: newer ones are not tied to the graph yet.
    pub fn left_behind(&self) -> usize {
        self.places.len()
    }

    /// Places that are left behind, oldest first.
    pub(crate) fn frozen(&self) -> &[Arc<Place>] {
        &self.places
    }

    /// Poses of all places, open ones too, in the best particle's map.
    pub(crate) fn poses(&self) -> &[Pose2] {
        &self.poses
    }

    /// The likeliest particle.
    pub(crate) fn best(&self) -> &Particle {
        &self.particles[0]
    }

    /// Whether nothing was said, taken back or mended between this one and another.
    pub fn says_the_same(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.ledger, &other.ledger)
    }

    /// What was said.
    pub(crate) fn ledger(&self) -> &Ledger {
        &self.ledger
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

    /// What each place of the best graph saw, in its own frame: its stamp, its pose in the map, its surfaces.
    pub fn clouds(&self) -> impl Iterator<Item = (StampNs, Pose2, &[Point])> {
        self.places.iter().zip(&self.poses).map(|(p, pose)| (p.stamp_ns, *pose, &p.content.cloud[..]))
    }

    /// The same with what they are called.
    pub(crate) fn named(&self) -> &Named {
        self.shared.named.get_or_init(|| {
            let (rooms, labels) = (self.rooms().clone(), &self.particles[0].labels);
            Named::new(rooms, self.ground_places(), labels, &self.ledger)
        })
    }

    fn ground_places(&self) -> (Vec<GroundPlace>, Vec<StampNs>) {
        let frozen = self.places.iter().map(|p| (p.path_m, p.stamp_ns));
        let all = frozen.chain(self.open.iter().map(|o| (o.path_m, o.stamp_ns))).zip(&self.poses);
        let place = |((path_m, stamp_ns), &Pose2 { x_m, y_m, yaw_rad })| {
            (GroundPlace { x_m, y_m, yaw_rad, path_m }, stamp_ns)
        };
        all.map(place).unzip()
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

    fn speech(&self, lang: Option<&str>) -> Option<Speech> {
        Speech::new(lang, self.ledger.glossary.clone())
    }

    /// Whether a question counts from the robot: "where am I?", "the nearest exit". Who is lost can't be told.
    pub fn is_of_robot(&self, text: &str, lang: Option<&str>) -> bool {
        let of_here = |act: &Act| match &act.content {
            Content::Ask { kind: Question::Where, about: About::Phrase(phrase) } => {
                phrase.head == Head::Here || phrase.features.nearest
            }
            _ => false,
        };
        self.speech(lang).is_some_and(|speech| speech.parse(text).acts().iter().any(of_here))
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
mod find;
mod floor;
#[cfg(test)]
mod tests;
