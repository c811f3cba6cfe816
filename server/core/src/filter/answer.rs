//! Steps 1 and 4 of Algorithm 1 for a fit: every particle's answers to its question, each a child with its
//! exact weight. Where the paper draws, the best are kept: answers are few, and what is not among the best is
//! told as unresolved ([`crate::filter::ghosts`]).

use crate::edge::{QuestionId, Vertex};
use crate::filter::particle::{Edge, LetGo, Particle};
use crate::filter::question::{Question, Testimony};
use crate::filter::weigh::Judgement;
use crate::filter::words::Words;
use crate::geometry::Pose2;
use crate::graph::Graph;
use crate::smoothing::Structure;

/// Two answers that lay a place within so much of one another are one.
const SAME_M: f64 = 1.0;
const SAME_RAD: f64 = 0.17;
/// Look-alikes are looked for so far from where they were seen, metres.
const TWIN_M: f64 = 25.0;
/// A loop raises `Σ eᵀ Ω e` by its distance² at most, and none is taken beyond some hundred: where it
/// rises by more, Gauss-Newton has lost its way.
const CHI2_RISE_MAX: f64 = 1000.0;
/// A fit farther than this from where a particle has the place, distance², is none of its answer.
const OUTLIER: f64 = 30.0;

/// Where a particle stands towards a fit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Stance {
    /// "There", before or because its map says the same: the weight gains by what is new in the fit. Whether
    /// the edge goes with its map.
    There {
        /// By so much.
        log_gain: f64,
        /// Whether it adds the edge.
        fits: bool,
    },
    /// "Elsewhere", before.
    Elsewhere,
    /// "Elsewhere", because its map shows a look-alike there that it has refused before. That one looks as it
    /// did is expected as much as that a place does.
    Again,
    /// Not asked yet: both answers, of which "there" weighs by so much more.
    Open {
        /// By so much.
        log_there: f64,
        /// What is let go for it.
        lets_go: Option<LetGo>,
        /// Whether either answer expects the fit, for the place looks like what is there.
        again: bool,
    },
}

/// Where a particle stands, from what it thinks of the fit; `others` are the other questions.
pub fn stance<'a>(
    particle: &Particle,
    edge: &Edge,
    testimony: &Testimony,
    judgement: Option<Judgement>,
    others: impl Iterator<Item = &'a Question>,
) -> Stance {
    let Some(Judgement { log_there, distance2, known, lets_go }) = judgement else {
        return Stance::Elsewhere;
    };
    if particle.refused.contains(&testimony.question) {
        return Stance::Elsewhere;
    }
    if particle.holds(testimony.question) {
        return Stance::There { log_gain: testimony.gained, fits: distance2 < OUTLIER };
    }
    if known {
        return Stance::There { log_gain: log_there, fits: true };
    }
    let refused: Vec<&Question> = others.filter(|q| particle.refused.contains(&q.id)).collect();
    match look_alike(particle, edge, &refused) {
        Some(LookAlike::Same) => Stance::Again,
        other => Stance::Open { log_there, lets_go, again: other.is_some() },
    }
}

/// Why a fit is expected of the newest place by who has it elsewhere.
enum LookAlike {
    /// It was refused as what is there before.
    Same,
    /// It looks like something that looks like what is there.
    Twin,
}

/// Whether a fit is where what a particle refused shows a look-alike of the newest place, or a look-alike of
/// that: who looks like one of twins looks like the other.
fn look_alike(particle: &Particle, edge: &Edge, refused: &[&Question]) -> Option<LookAlike> {
    let pose = |v: Vertex| particle.belief.pose(v);
    let (here, there) = (pose(edge.j), pose(edge.i).compose(&edge.i_from_j));
    let older = |q: &Question, at: &Pose2| pose(q.i).compose(&q.i_from_j).compose(&pose(q.j).between(at));
    let newer =
        |q: &Question, at: &Pose2| pose(q.j).compose(&q.i_from_j.inverse()).compose(&pose(q.i).between(at));
    if refused.iter().any(|q| same(&there, &older(q, &here))) {
        return Some(LookAlike::Same);
    }
    let twins = |at: Pose2| {
        let near = move |v: Vertex| pose(v).distance_m(&at) < TWIN_M;
        let of = move |q: &&Question| [near(q.j).then(|| older(q, &at)), near(q.i).then(|| newer(q, &at))];
        refused.iter().flat_map(of).flatten()
    };
    let is_there = |twin: Pose2| same(&there, &twin);
    let any = twins(here).any(|twin| is_there(twin) || twins(twin).any(is_there));
    (any && !same(&there, &here)).then_some(LookAlike::Twin)
}

/// Whether two poses are one answer.
pub fn same(a: &Pose2, b: &Pose2) -> bool {
    a.distance_m(b) < SAME_M && a.between(b).yaw_rad.abs() < SAME_RAD
}

/// One answer of one particle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Child {
    /// Which particle's.
    pub parent: usize,
    /// "There".
    pub there: bool,
    /// Whether it adds the fit's edge.
    pub adds: bool,
    /// Whether it is one of both answers, and nothing that the particle had said before.
    pub is_new: bool,
    /// What it lets go of the chain.
    pub lets_go: Option<LetGo>,
    /// log w.
    pub log_weight: f64,
}

/// All answers of all particles, likeliest first.
pub fn children(particles: &[Particle], stances: &[Stance]) -> Vec<Child> {
    // What is known to some and a look-alike seen again to others is news to neither.
    let expected = |s: &Stance| if let Stance::There { log_gain, .. } = s { Some(*log_gain) } else { None };
    let again = stances.iter().filter_map(expected).fold(0.0, f64::max);
    let of = |(parent, (p, stance)): (usize, (&Particle, &Stance))| {
        let child = |there, adds, log: f64| {
            let is_new = matches!(stance, Stance::Open { .. });
            Child { parent, there, adds, is_new, lets_go: None, log_weight: p.log_weight + log }
        };
        match *stance {
            Stance::There { log_gain, fits } => vec![child(true, fits, log_gain)],
            Stance::Elsewhere => vec![child(false, false, 0.0)],
            Stance::Again => vec![child(false, false, again)],
            Stance::Open { log_there, lets_go, again: is_again } => {
                let expected = if is_again { again } else { 0.0 };
                vec![
                    child(false, false, expected),
                    Child { lets_go, ..child(true, true, expected + log_there) },
                ]
            }
        }
    };
    let mut all: Vec<Child> = particles.iter().zip(stances).enumerate().flat_map(of).collect();
    all.sort_by(|a, b| b.log_weight.total_cmp(&a.log_weight).then(a.parent.cmp(&b.parent)));
    all
}

/// What a particle's weight depends on beside itself.
#[derive(Clone, Copy)]
pub struct Given<'a> {
    /// Places and chain.
    pub graph: &'a Graph,
    /// Factors.
    pub structure: &'a Structure,
    /// What was said.
    pub words: &'a dyn Words,
}

/// A child as a particle of its own: G, X and w. Where the edge does not go with the poses, an answer that the
/// map gave by itself stands without it, and another has no graph: None.
pub fn born(
    parent: &Particle,
    child: &Child,
    question: QuestionId,
    edge: Option<&Edge>,
    given: Given<'_>,
) -> Option<Particle> {
    let mut p = parent.clone();
    p.log_weight = child.log_weight;
    if !child.there {
        p.refuse(question);
        return Some(p);
    }
    p.take(question);
    let Some(edge) = edge.filter(|_| child.adds) else { return Some(p) };
    let tied = with_edge(p.clone(), edge, child.lets_go, given);
    if tied.is_none() && !child.is_new { Some(p) } else { tied }
}

/// A particle that takes an edge into its graph, and for it lets a stretch go. None where the edge does not go
/// with the poses.
pub fn with_edge(
    mut p: Particle,
    edge: &Edge,
    lets_go: Option<LetGo>,
    Given { graph, structure, words }: Given<'_>,
) -> Option<Particle> {
    let before = p.belief.least_chi2(structure);
    p.add(edge.clone());
    if let Some(let_go) = lets_go {
        p.let_go(structure, &let_go).ok()?;
    }
    p.update(structure).ok()?;
    // What was said before counts for the floors that are one by now.
    p.weigh_words(graph, words);
    (p.belief.least_chi2(structure) < before + CHI2_RISE_MAX).then_some(p)
}
