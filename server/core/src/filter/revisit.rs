//! Revisits: the fits of one stretch of path with another are one question, and are decided on once.
//!
//! The fits that follow one another along a revisit say the same with growing support. Were each decided
//! on for itself, what doubts the first would be persuaded by the tenth, and graphs that differ only in
//! redundant edges would fill the filter. So a particle is asked once whether the revisit is true. What
//! later fits add for or against it, is for or against all that believe in it.

use crate::edge::{RevisitId, Vertex};
use crate::filter::loops::{FOLLOW_REACH_M, Fit, agree};
use crate::geometry::Pose2;
use crate::graph::Graph;
use serde::{Deserialize, Serialize};
use std::collections::VecDeque;

/// Revisits remembered; the ones not seen for longest give way. A place has some eight fits, and a
/// revisit is taken up again within some six places.
const REMEMBERED_MAX: usize = 64;

/// A revisit by its newest fit.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct Revisit {
    id: RevisitId,
    i: Vertex,
    j: Vertex,
    i_from_j: Pose2,
    log_looks: f64,
}

/// The revisits of late.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct Revisits {
    /// Last seen first.
    remembered: VecDeque<Revisit>,
    next: RevisitId,
}

/// What a fit says of the revisit that it belongs to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Testimony {
    /// The revisit.
    pub revisit: RevisitId,
    /// log p(looks | true) / p(looks | chance), see [`crate::filter::chance`].
    pub log_looks: f64,
    /// How much that is more than the revisit's fit before this one said.
    pub gained: f64,
}

impl Revisits {
    /// Remembers a fit of place `t`: as the newest of its revisit, or as the first of a new one.
    pub fn see(&mut self, graph: &Graph, fit: &Fit, t: Vertex, log_looks: f64) -> Testimony {
        let before = self.remembered.iter().position(|r| r.continued_by(graph, fit, t));
        let before = before.and_then(|at| self.remembered.remove(at));
        let id = before.as_ref().map_or(self.next, |r| r.id);
        self.next += u32::from(before.is_none());
        self.remembered.push_front(Revisit { id, i: fit.i, j: t, i_from_j: fit.mode.i_from_j, log_looks });
        self.remembered.truncate(REMEMBERED_MAX);
        Testimony { revisit: id, log_looks, gained: before.map_or(0.0, |r| log_looks - r.log_looks) }
    }

    /// Whether a fit may still come that continues a revisit.
    pub fn remembers(&self, id: RevisitId) -> bool {
        self.remembered.iter().any(|r| r.id == id)
    }
}

impl Revisit {
    /// Whether a fit of place `t` says the same, by the front end, a few metres on.
    fn continued_by(&self, graph: &Graph, fit: &Fit, t: Vertex) -> bool {
        if graph.apart(self.j, t, FOLLOW_REACH_M) || graph.apart(self.i, fit.i, 2.0 * FOLLOW_REACH_M) {
            return false;
        }
        let expected =
            graph.chained(fit.i, self.i).compose(&self.i_from_j).compose(&graph.chained(self.j, t));
        agree(&expected, &fit.mode.i_from_j, 2.0)
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

    #[test]
    fn what_says_the_same_some_places_on_continues_a_revisit() {
        let graph = straight(60);
        let mut revisits = Revisits::default();
        let first = revisits.see(&graph, &fit(10, 0.5), 40, 1.0);
        assert_eq!(first, Testimony { revisit: 0, log_looks: 1.0, gained: 0.0 });
        // Three places on, against a place two metres on, and .2 m off.
        let next = revisits.see(&graph, &fit(12, 1.3), 43, 1.75);
        assert_eq!(next, Testimony { revisit: 0, log_looks: 1.75, gained: 0.75 });
        let news = [(&fit(13, 2.5), 44), (&fit(40, 0.5), 45), (&fit(24, 1.3), 55)];
        let ids = news.map(|(fit, t)| revisits.see(&graph, fit, t, 0.0).revisit);
        assert_eq!(ids, [1, 2, 3], "another transform, another place, long after");
    }

    #[test]
    fn few_revisits_are_remembered_the_last_seen_longest() {
        let graph = straight(60);
        let mut revisits = Revisits::default();
        for k in 0..2 * REMEMBERED_MAX {
            revisits.see(&graph, &fit(10, 0.5), 40, 0.0);
            revisits.see(&graph, &fit(10, 5.0 + 2.0 * k as f64), 40, 0.0);
        }
        assert_eq!(revisits.remembered.len(), REMEMBERED_MAX);
        assert!(revisits.remembers(0) && !revisits.remembers(1));
    }
}
