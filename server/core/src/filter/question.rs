//! Questions: has the robot been here before? One for the fits of one stretch of path with another, whose
//! answers are exclusive: new ground, or there.
//!
//! The fits that follow one another along a revisit say the same with growing support. Were each asked about
//! for itself, what doubts the first would be persuaded by the tenth, and graphs that differ only in redundant
//! edges would fill the filter. So a particle answers once. What later fits add for or against an answer is
//! for or against all that gave it.

use crate::edge::{QuestionId, Vertex};
use crate::filter::loops::{Fit, agree};
use crate::geometry::Pose2;
use crate::graph::Graph;
use serde::{Deserialize, Serialize};
use std::collections::VecDeque;

/// Questions remembered; the ones not seen for longest give way. A place has some eight fits.
const REMEMBERED_MAX: usize = 256;
/// A revisit may go unseen for so much path, front-end increments being good to some decimetres over it, and
/// is the same question when it is seen again: look-alikes that continue are the same look-alikes.
const SAME_PATH_M: f64 = 40.0;
/// By how much two ways to the same fit may differ per metre between them, in units of what fits may.
const DRIFT_PER_M: f64 = 0.1;

/// A question by its newest fit.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Question {
    /// Its number.
    pub id: QuestionId,
    /// The older place.
    pub i: Vertex,
    /// The newer place.
    pub j: Vertex,
    /// Where the fit has the newer one.
    pub i_from_j: Pose2,
    /// What its fits so far look like, see [`crate::filter::chance`].
    pub log_looks: f64,
}

/// The questions of late.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct Questions {
    /// Last seen first.
    remembered: VecDeque<Question>,
    next: u32,
}

/// What a fit says of the question that it belongs to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Testimony {
    /// The question.
    pub question: QuestionId,
    /// log p(looks | there) / p(looks | chance), see [`crate::filter::chance`].
    pub log_looks: f64,
    /// How much that is more than the question's fit before this one said.
    pub gained: f64,
}

impl Questions {
    /// Remembers a fit of place `t`: as the newest of its question, or as the first of a new one.
    pub fn see(&mut self, graph: &Graph, fit: &Fit, t: Vertex, log_looks: f64) -> Testimony {
        let before = self.remembered.iter().position(|q| q.is_seen_again(graph, fit, t));
        let before = before.and_then(|at| self.remembered.remove(at));
        let id = before.as_ref().map_or(QuestionId { boot: graph.place(t).segment, n: self.next }, |q| q.id);
        self.next += u32::from(before.is_none());
        // A stretch that was seen to agree stays seen, even where the next fit has fewer behind it.
        let (known, log_looks) =
            before.map_or((log_looks, log_looks), |q| (q.log_looks, q.log_looks.max(log_looks)));
        self.remembered.push_front(Question { id, i: fit.i, j: t, i_from_j: fit.mode.i_from_j, log_looks });
        self.remembered.truncate(REMEMBERED_MAX);
        Testimony { question: id, log_looks, gained: log_looks - known }
    }

    /// All that are remembered, the last seen first.
    pub fn iter(&self) -> impl Iterator<Item = &Question> {
        self.remembered.iter()
    }

    /// Whether a fit may still come that belongs to a question.
    pub fn remembers(&self, id: QuestionId) -> bool {
        self.remembered.iter().any(|q| q.id == id)
    }
}

impl Question {
    /// Whether a fit of place `t` says the same, by the front end, some metres on.
    fn is_seen_again(&self, graph: &Graph, fit: &Fit, t: Vertex) -> bool {
        if graph.apart(self.j, t, SAME_PATH_M) || graph.apart(self.i, fit.i, SAME_PATH_M) {
            return false;
        }
        let path_m = |v: Vertex| graph.place(v).path_m;
        let between_m = (path_m(self.j) - path_m(t)).abs() + (path_m(self.i) - path_m(fit.i)).abs();
        let expected =
            graph.chained(fit.i, self.i).compose(&self.i_from_j).compose(&graph.chained(self.j, t));
        agree(&expected, &fit.mode.i_from_j, 2.0 + DRIFT_PER_M * between_m)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::edge::EdgeKind;
    use crate::filter::loops::tests::straight;
    use crate::scan::matching::Mode;
    use nalgebra::Matrix3;

    /// A fit with place `i`, seen `x_m` from there.
    fn fit(i: Vertex, x_m: f64) -> Fit {
        let i_from_j = Pose2::new(x_m, 0.0, 0.0);
        let mode = Mode { i_from_j, covariance: Matrix3::identity(), score: 0.9, overlap: 0.6 };
        Fit::supported_by(i, mode, EdgeKind::Distance, 3)
    }

    fn id(n: u32) -> QuestionId {
        QuestionId { boot: 0, n }
    }

    #[test]
    fn what_says_the_same_some_places_on_is_the_same_question() {
        let graph = straight(160);
        let mut questions = Questions::default();
        let first = questions.see(&graph, &fit(10, 0.5), 40, 1.0);
        assert_eq!(first, Testimony { question: id(0), log_looks: 1.0, gained: 0.0 });
        // Three places on, against a place two metres on, and .2 m off.
        let next = questions.see(&graph, &fit(12, 1.3), 43, 1.75);
        assert_eq!(next, Testimony { question: id(0), log_looks: 1.75, gained: 0.75 });
        // With fewer places behind it after a while unseen.
        let later = questions.see(&graph, &fit(32, 1.3), 63, 1.0);
        assert_eq!(later, Testimony { question: id(0), log_looks: 1.75, gained: 0.0 });
        let news = [(&fit(33, 9.5), 64), (&fit(90, 0.5), 120), (&fit(24, 1.3), 155)];
        let ids = news.map(|(fit, t)| questions.see(&graph, fit, t, 0.0).question);
        assert_eq!(ids, [id(1), id(2), id(3)], "another transform, another place, long after");
    }

    #[test]
    fn few_questions_are_remembered_the_last_seen_longest() {
        let graph = straight(60);
        let mut questions = Questions::default();
        for k in 0..2 * REMEMBERED_MAX {
            questions.see(&graph, &fit(10, 0.5), 40, 0.0);
            questions.see(&graph, &fit(10, 5.0 + 2.0 * k as f64), 40, 0.0);
        }
        assert_eq!(questions.remembered.len(), REMEMBERED_MAX);
        assert!(questions.remembers(id(0)) && !questions.remembers(id(1)));
    }
}
