//! What was dropped comes back where it became likely: an answer given up or given after all, with the weight
//! that its graph has by now.

use crate::effects::{Effect, Effects};
use crate::filter::Filter;
use crate::filter::absence::log_contradictions;
use crate::filter::answer::{Given, with_edge};
use crate::filter::ghosts::{Ghost, REOPENED};
use crate::filter::particle::Particle;
use crate::filter::weigh::judge;
use crate::filter::words::Words;
use std::sync::Arc;

/// Answers that come back per place: each is a graph solved anew.
const REOPENED_MAX: usize = 2;

impl Filter {
    /// Brings back what became likely.
    pub(super) fn reopen(&mut self, words: &dyn Words) -> Effects {
        self.tell_anew();
        let mut effects = Effects::new();
        for _ in 0..REOPENED_MAX {
            let Some(ghost) = self.ghosts.next_reopened(self.particles[0].log_words) else { break };
            let (i, j, kind) = (ghost.edge.i, ghost.edge.j, ghost.edge.kind);
            let Some(child) = self.come_back(&ghost, words) else { continue };
            let what = if ghost.there { "may be there after all" } else { "may not be there after all" };
            let reason =
                format!("edge {j}–{i}: {what}, log odds {:.1}", child.log_weight - self.best().log_weight);
            self.particles.push(child);
            self.rank();
            effects.push(Effect::EdgeRefused { i: i.into(), j: j.into(), kind, reason });
        }
        effects
    }

    /// The odds of answers that the best map refuses, as it is by now. What it says by itself by now is no other
    /// graph: that it was dropped from one that did not is no evidence for it.
    fn tell_anew(&mut self) {
        let Self { graph, structure, particles, ghosts, .. } = self;
        let best = &particles[0];
        ghosts.retain(|ghost| {
            if ghost.there && !best.holds(ghost.edge.question) {
                let Some(judged) = judge(graph, structure, best, &ghost.edge) else { return true };
                ghost.log_odds = judged.log_there + ghost.since;
                return !judged.known;
            }
            true
        });
    }

    /// The best particle with the other answer. None if no graph comes of it, or the same.
    fn come_back(&mut self, ghost: &Ghost, words: &dyn Words) -> Option<Particle> {
        if self.best().holds(ghost.edge.question) == ghost.there {
            return None;
        }
        if ghost.there { self.take_after_all(ghost, words) } else { self.give_up(ghost, words) }
    }

    fn take_after_all(&mut self, ghost: &Ghost, words: &dyn Words) -> Option<Particle> {
        let judged = judge(&self.graph, &self.structure, self.best(), &ghost.edge)?;
        let edge = ghost.edge.clone().enter(Arc::make_mut(&mut self.structure))?;
        self.disputed.push(edge.factor);
        if let Some(let_go) = judged.lets_go {
            self.loosen(let_go.from);
        }
        self.update();
        let mut p = self.best().clone();
        p.refused.retain(|&q| q != edge.question);
        p.log_weight += judged.log_there + ghost.since;
        let given = Given { graph: &self.graph, structure: &self.structure, words };
        let mut p = with_edge(p, &edge, judged.lets_go, given)?;
        let lost = log_contradictions(&self.graph, &self.structure, &p, edge.j);
        p.log_weight += lost;
        let log_odds = p.log_weight - self.best().log_weight;
        if log_odds < REOPENED.ln() {
            self.ghosts.drop_answer(Ghost { log_odds, since: ghost.since + lost, ..ghost.clone() });
            return None;
        }
        Some(p)
    }

    fn give_up(&mut self, ghost: &Ghost, words: &dyn Words) -> Option<Particle> {
        let question = ghost.edge.question;
        let mut p = self.best().clone();
        self.disputed.extend(p.edges.iter().filter(|e| e.question == question).map(|e| e.factor));
        p.give_up(question);
        p.update(&self.structure).ok()?;
        let judged = judge(&self.graph, &self.structure, &p, &ghost.edge)?;
        if judged.known {
            return None;
        }
        p.log_weight += ghost.since - judged.log_there;
        p.weigh_words(&self.graph, words);
        Some(p)
    }
}
