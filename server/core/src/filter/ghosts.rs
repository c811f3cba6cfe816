//! What was dropped: answers and their odds, without poses.
//!
//! The best graphs are kept and no others. Of what is dropped the answer stays that told it from what was kept,
//! with its odds. They change with all that the kept graphs gain or pay after, and while they last they are
//! told:
//!
//! ```text
//! unresolved = 1 − Π_q (1 − u_q),    u_q = odds_q / (1 + odds_q)
//! ```
//!
//! An answer of u_q > [`REOPENED`] comes back as a graph; one of less than [`FORGOTTEN`] is forgotten.

use crate::edge::QuestionId;
use crate::filter::chance::log_add;
use crate::filter::particle::{Edge, Particle};
use serde::{Deserialize, Serialize};

/// Odds from which a dropped answer comes back.
pub const REOPENED: f64 = 0.02;
/// Odds below which it is forgotten.
pub const FORGOTTEN: f64 = 1e-6;
/// Answers remembered, the likeliest.
const REMEMBERED_MAX: usize = 64;

/// An answer that no graph gives any more.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Ghost {
    /// An edge of the question.
    pub edge: Edge,
    /// Whether the answer dropped was "there".
    pub there: bool,
    /// Its odds against what was kept.
    pub log_odds: f64,
    /// How much of that the kept graphs gained or lost since, see [`Ghosts::kept_gained`], and what its own was found
    /// to have lost.
    pub since: f64,
    /// log p(λ | G) of the best graph when it was dropped.
    pub log_words: f64,
}

impl Ghost {
    /// u_q, with log p(λ | G) of the best graph as it is by now: what that did not expect to be said speaks for
    /// what was dropped.
    pub fn share(&self, log_words: f64) -> f64 {
        let log_odds = self.log_odds + (self.log_words - log_words).max(0.0);
        1.0 / (1.0 + (-log_odds).exp())
    }
}

/// All answers dropped.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct Ghosts {
    ghosts: Vec<Ghost>,
}

impl Ghosts {
    /// Remembers an answer that was dropped.
    pub fn drop_answer(&mut self, ghost: Ghost) {
        let same = |g: &&mut Ghost| (g.edge.question, g.there) == (ghost.edge.question, ghost.there);
        match self.ghosts.iter_mut().find(same) {
            Some(g) => g.log_odds = log_add(g.log_odds, ghost.log_odds),
            None => self.ghosts.push(ghost),
        }
        self.ghosts
            .sort_by(|a, b| b.log_odds.total_cmp(&a.log_odds).then(a.edge.question.cmp(&b.edge.question)));
        self.ghosts.truncate(REMEMBERED_MAX);
    }

    /// A fit of a question was seen that says so much more for "there".
    pub fn gain(&mut self, question: QuestionId, log_gain: f64) {
        for g in self.ghosts.iter_mut().filter(|g| g.edge.question == question) {
            g.log_odds += if g.there { log_gain } else { -log_gain };
        }
    }

    /// A fit of a question to which all graphs say "elsewhere" was seen, and weighs so much for "there" by the best
    /// one: of all fits of a question the likeliest is what the answer is worth.
    pub fn see(&mut self, edge: &Edge, log_there: f64) {
        let known = self.ghosts.iter_mut().find(|g| g.there && g.edge.question == edge.question);
        if let Some(g) = known.filter(|g| g.log_odds < log_there + g.since) {
            g.edge = edge.clone();
            g.log_odds = log_there + g.since;
        }
    }

    /// The kept graphs gained so much, or paid, for where they lay the newest places. Graphs that held those
    /// elsewhere did neither; where nobody knows what a graph would have gained, it is held to have gained as much.
    pub fn kept_gained(&mut self, log_gain: f64) {
        for g in &mut self.ghosts {
            let log_gain = if g.there { log_gain.min(0.0) } else { log_gain };
            g.log_odds -= log_gain;
            g.since -= log_gain;
        }
    }

    /// Takes out the likeliest answer that is to come back.
    pub fn next_reopened(&mut self, log_words: f64) -> Option<Ghost> {
        let at = self.ghosts.iter().position(|g| g.share(log_words) > REOPENED)?;
        Some(self.ghosts.remove(at))
    }

    /// Tells odds anew, and keeps those for which that answers yes.
    pub fn retain(&mut self, tell: impl FnMut(&mut Ghost) -> bool) {
        self.ghosts.retain_mut(tell);
    }

    /// Forgets what became impossible.
    pub fn forget(&mut self, log_words: f64) {
        self.ghosts.retain(|g| g.share(log_words) > FORGOTTEN);
    }

    /// Posterior mass of all that was dropped.
    pub fn unresolved(&self, log_words: f64) -> f64 {
        1.0 - self.ghosts.iter().map(|g| 1.0 - g.share(log_words)).product::<f64>()
    }
}

/// The newest answer that tells a dropped particle from the best: with odds as if it weighed alone.
pub fn difference(dropped: &Particle, best: &Particle) -> Option<Ghost> {
    let edge_of = |p: &Particle, other: &Particle| {
        p.edges.iter().filter(|e| !other.holds(e.question)).max_by_key(|e| e.question).cloned()
    };
    let (theirs, ours) = (edge_of(dropped, best), edge_of(best, dropped));
    let there = theirs.as_ref().map(|e| e.question) > ours.as_ref().map(|e| e.question);
    let edge = if there { theirs } else { ours }?;
    Some(Ghost { edge, there, log_odds: dropped.log_weight, since: 0.0, log_words: best.log_words })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::filter::weigh::tests::{edge, fit};

    fn ghost(n: u32, there: bool, share: f64) -> Ghost {
        let edge = Edge { question: QuestionId { boot: 0, n }, ..edge(&fit(1.0, 0.9, 3)) };
        Ghost { edge, there, log_odds: (share / (1.0 - share)).ln(), since: 0.0, log_words: 0.0 }
    }

    #[test]
    fn what_is_dropped_adds_up_and_may_fall_again() {
        let mut ghosts = Ghosts::default();
        ghosts.drop_answer(ghost(0, false, 0.001));
        ghosts.drop_answer(ghost(1, true, 0.002));
        assert!((ghosts.unresolved(0.0) - (1.0 - 0.999 * 0.998)).abs() < 1e-12);
        ghosts.gain(QuestionId { boot: 0, n: 0 }, 20.0);
        ghosts.forget(0.0);
        assert!((ghosts.unresolved(0.0) - 0.002).abs() < 1e-9);
    }

    #[test]
    fn what_becomes_likely_comes_back() {
        let mut ghosts = Ghosts::default();
        ghosts.drop_answer(ghost(0, false, 0.001));
        assert_eq!(ghosts.next_reopened(0.0), None);
        // The kept graphs expected a fit in vain, twice.
        ghosts.kept_gained(-3.2);
        assert_eq!(ghosts.next_reopened(0.0).map(|g| g.edge.question.n), Some(0));
        assert!(ghosts.unresolved(0.0) < 1e-12);
    }

    #[test]
    fn what_the_kept_pay_speaks_for_what_they_refuse_and_what_they_gain_not_against_it() {
        let mut ghosts = Ghosts::default();
        ghosts.drop_answer(ghost(0, true, 0.001));
        let before = ghosts.unresolved(0.0);
        ghosts.kept_gained(9.0);
        assert!((ghosts.unresolved(0.0) - before).abs() < 1e-12);
        ghosts.kept_gained(-2.0);
        assert!(ghosts.unresolved(0.0) > 7.0 * before);
    }

    #[test]
    fn an_answer_is_worth_its_likeliest_fit() {
        let mut ghosts = Ghosts::default();
        ghosts.drop_answer(ghost(0, true, 0.001));
        let likelier = Edge { j: 77, ..ghost(0, true, 0.5).edge };
        ghosts.see(&Edge { j: 76, ..likelier.clone() }, -9.0);
        assert!(ghosts.unresolved(0.0) < 0.0011);
        ghosts.see(&likelier, -2.0);
        assert_eq!(ghosts.next_reopened(0.0).map(|g| g.edge.j), Some(77));
    }

    #[test]
    fn what_the_kept_did_not_expect_to_hear_speaks_for_the_dropped_until_it_is_taken_back() {
        let mut ghosts = Ghosts::default();
        ghosts.drop_answer(ghost(0, false, 0.001));
        let before = ghosts.unresolved(0.0);
        assert!(ghosts.unresolved(-2.0) > 7.0 * before);
        assert!((ghosts.unresolved(3.0) - before).abs() < 1e-12, "names elsewhere say nothing against it");
    }

    #[test]
    fn few_are_remembered_the_likeliest() {
        let mut ghosts = Ghosts::default();
        (0..100).for_each(|n| ghosts.drop_answer(ghost(n, false, 1e-5 * f64::from(n + 1))));
        assert_eq!(ghosts.ghosts.len(), REMEMBERED_MAX);
        assert_eq!(ghosts.ghosts[0].edge.question.n, 99);
    }
}
