//! A particle: {G, X, L, w} of eq. (4). No two are equal.

use crate::edge::{EdgeKind, QuestionId, Vertex};
use crate::filter::labels::Labels;
use crate::filter::loops::Fit;
use crate::geometry::Pose2;
use crate::smoothing::{Belief, Factor, FactorId, SmoothError, Structure};
use nalgebra::Matrix3;
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// An edge says that two places are one only if they lie this near; scans tie farther ones too.
const SAME_PLACE_M: f64 = 3.0;

/// A loop edge of G: everything but the chain of successive places.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Edge {
    /// The older place.
    pub i: Vertex,
    /// The newer place.
    pub j: Vertex,
    /// How it was proposed.
    pub kind: EdgeKind,
    /// Measured transform.
    pub i_from_j: Pose2,
    /// R: covariance of it, right perturbation.
    pub covariance: Matrix3<f64>,
    /// The question that it answers.
    pub question: QuestionId,
    /// log r of its looks, see [`crate::filter::chance`].
    pub log_looks: f64,
    /// Its factor in the structure that all particles share, once it has one.
    pub factor: FactorId,
}

/// Places' content overlaps along the path: an edge per place uses each scan some three times, so
/// its information is a third.
const SHARED_SCANS: f64 = 3.0;

impl Edge {
    /// The edge of a fit of place `t`, without a factor yet.
    pub fn of(fit: &Fit, t: Vertex, question: QuestionId, log_looks: f64) -> Self {
        Self {
            i: fit.i,
            j: t,
            kind: fit.kind,
            i_from_j: fit.mode.i_from_j,
            covariance: fit.mode.covariance * SHARED_SCANS,
            question,
            log_looks,
            factor: FactorId::MAX,
        }
    }

    /// Gives it a factor in what all particles share; none of them holds it yet. None if its numbers are no
    /// measurement.
    pub fn enter(mut self, structure: &mut Structure) -> Option<Self> {
        let information = self.covariance.try_inverse()?;
        let information = (information + information.transpose()) * 0.5;
        let factor = Factor { i: self.i, j: self.j, i_from_j: self.i_from_j, information };
        self.factor = structure.add_factor(factor).ok()?;
        structure.arrange();
        Some(self)
    }
}

/// A stretch let go: the poses from `from` on are moved rigidly.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LetGo {
    /// The place whose edge from the one before failed.
    pub from: Vertex,
    /// What was at p is at `moved ∘ p`.
    pub moved: Pose2,
}

/// One assignment of answers to questions, with what follows from it.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Particle {
    /// G: loop edges in the order they were added.
    pub edges: Arc<Vec<Edge>>,
    /// The questions that G's loop edges answer, in order.
    pub taken: Arc<Vec<QuestionId>>,
    /// Questions of late that were answered by "elsewhere".
    pub refused: Vec<QuestionId>,
    /// X.
    pub belief: Belief,
    /// L.
    pub labels: Labels,
    /// What people said, as a share of log w, see [`crate::filter::words`].
    pub log_words: f64,
    /// Places whose edge from the one before failed.
    pub failed: Arc<Vec<Vertex>>,
    /// log w; normalised after each step.
    pub log_weight: f64,
    /// Path at which it last paid for a fit that it expected and nobody found, metres.
    pub missed_at_m: Option<f64>,
}

impl Particle {
    /// With nothing in it.
    pub fn empty() -> Self {
        Self {
            edges: Arc::default(),
            taken: Arc::default(),
            refused: Vec::new(),
            belief: Belief::new(),
            labels: Labels::default(),
            log_words: 0.0,
            log_weight: 0.0,
            failed: Arc::default(),
            missed_at_m: None,
        }
    }

    /// Whether its answer to a question is "there".
    pub fn holds(&self, question: QuestionId) -> bool {
        self.taken.binary_search(&question).is_ok()
    }

    /// Answers a question by "there".
    pub fn take(&mut self, question: QuestionId) {
        if let Err(at) = self.taken.binary_search(&question) {
            Arc::make_mut(&mut self.taken).insert(at, question);
        }
    }

    /// Answers a question by "elsewhere".
    pub fn refuse(&mut self, question: QuestionId) {
        if !self.refused.contains(&question) {
            self.refused.push(question);
        }
    }

    /// Adds an edge to G, and what it says of labels to L; X follows at the next update.
    pub fn add(&mut self, edge: Edge) {
        self.belief.hold(edge.factor);
        if edge.i_from_j.x_m.hypot(edge.i_from_j.y_m) < SAME_PLACE_M {
            self.labels.carry_over(edge.i, edge.j);
        }
        self.take(edge.question);
        Arc::make_mut(&mut self.edges).push(edge);
    }

    /// Takes a question's edges out of G, and what was carried over them out of L; the answer is "elsewhere"
    /// then. X follows at the next update.
    pub fn give_up(&mut self, question: QuestionId) {
        let (gone, kept): (Vec<Edge>, Vec<Edge>) =
            self.edges.iter().cloned().partition(|e| e.question == question);
        for edge in &gone {
            self.belief.release(edge.factor);
            self.labels.carry_back(edge.i, edge.j);
        }
        Arc::make_mut(&mut self.taken).retain(|&q| q != question);
        self.edges = Arc::new(kept);
        self.refuse(question);
    }

    /// Lets a stretch of the chain go that [`Structure::loosen`] has loosened, or that ties nothing, and begins
    /// where its answer has the rest. X follows at the next update.
    pub fn let_go(&mut self, structure: &Structure, let_go: &LetGo) -> Result<(), SmoothError> {
        if let Some(tight) = structure.loosened(let_go.from) {
            self.belief.release(tight);
            Arc::make_mut(&mut self.failed).push(let_go.from);
        }
        self.belief.rebase(structure, let_go.from, &let_go.moved)
    }

    /// X given G, eq. (10). On an error poses stay where they were, and covariances are unknown.
    pub fn update(&mut self, structure: &Structure) -> Result<(), SmoothError> {
        self.belief.update(structure)?;
        // A loop may move more poses than an update's budget reaches. What is judged next must see
        // them all where they belong: half of them moved are worse than none.
        if self.belief.pending() {
            self.belief.finish(structure)?;
        }
        Ok(())
    }

    /// w.
    pub fn weight(&self) -> f64 {
        self.log_weight.exp()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_question_is_answered_whether_or_not_it_has_edges() {
        let mut p = Particle::empty();
        let id = |n| QuestionId { boot: 0, n };
        for (factor, n) in [4, 2, 4].into_iter().enumerate() {
            p.add(Edge {
                i: 0,
                j: 9,
                kind: EdgeKind::Distance,
                i_from_j: Pose2::default(),
                covariance: Matrix3::identity(),
                question: id(n),
                log_looks: 0.0,
                factor: factor as FactorId,
            });
        }
        p.take(id(7));
        assert_eq!(p.taken[..], [id(2), id(4), id(7)]);
        p.give_up(id(4));
        assert_eq!((&p.taken[..], p.edges.len(), &p.refused[..]), (&[id(2), id(7)][..], 1, &[id(4)][..]));
    }
}
