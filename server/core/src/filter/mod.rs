//! Algorithm 1: the Rao-Blackwellized particle filter over semantic graphs.
//!
//! One step per place, when the robot has left it. Particles hold p(G, X, L | z, u, λ) =
//! p(L | X, G, z, u, λ) · p(X | G, z, u, λ) · p(G | z, u, λ), eq. (2).

pub mod absence;
pub mod answer;
pub mod chance;
pub mod failure;
pub mod floors;
pub mod ghosts;
pub mod labels;
pub mod loops;
pub mod naming;
pub mod particle;
pub mod propose;
pub mod prune;
pub mod question;
mod reasons;
mod reopen;
pub(crate) mod second_look;
pub mod weigh;
pub mod words;

use crate::config::Config;
use crate::edge::{EdgeKind, Proposal, Vertex};
use crate::effects::{Effect, Effects};
use crate::filter::absence::pay;
use crate::filter::answer::{Child, Given, Stance, born, children, stance};
use crate::filter::chance::{log_add, log_looks};
use crate::filter::ghosts::{Ghost, Ghosts, difference};
use crate::filter::loops::{Fit, Loops, Measured, measure_again};
use crate::filter::particle::{Edge, Particle};
use crate::filter::propose::{PointedAt, propose};
use crate::filter::prune::{KEPT_MIN, effective_sample_size, keep_best, merge, normalise, rank};
use crate::filter::question::{Questions, Testimony};
use crate::filter::reasons::{refusals, report};
use crate::filter::second_look::SecondLooks;
use crate::filter::weigh::{Judgement, judge};
use crate::filter::words::Words;
use crate::geometry::Pose2;
use crate::graph::Graph;
use crate::smoothing::{Belief, FactorId, SmoothError, Structure};
use crate::track::places::{Chain, FrozenPlace};
use nalgebra::Matrix3;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::sync::Arc;

/// Edges of a place that tell no particle anything new: they are measurements still, but who comes for the
/// tenth time needs no nine of them.
const KNOWN_MAX: usize = 2;

/// What ties the two ends of a stretch that failed, standard deviations: m, m, rad.
const LOOSE: [f64; 3] = [20.0, 20.0, 3.0];

/// The posterior over semantic graphs, and what all particles share.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Filter {
    /// Settings.
    pub config: Config,
    /// Places, chain, matches.
    pub graph: Graph,
    /// Factors of all particles together, and in what order they are eliminated.
    pub structure: Arc<Structure>,
    /// Distinct particles, best first; weights sum to one.
    pub particles: Vec<Particle>,
    loops: Loops,
    questions: Questions,
    /// What was dropped.
    ghosts: Ghosts,
    /// Factors that some particles hold and others don't.
    disputed: Vec<FactorId>,
    second_looks: SecondLooks,
    /// Where somebody saw the robot last.
    pointed_at: Option<PointedAt>,
}

impl Filter {
    /// One particle with nothing in it.
    pub fn new(config: Config) -> Self {
        Self {
            config,
            graph: Graph::default(),
            structure: Arc::default(),
            particles: vec![Particle::empty()],
            loops: Loops::default(),
            questions: Questions::default(),
            ghosts: Ghosts::default(),
            disputed: Vec::new(),
            second_looks: SecondLooks::default(),
            pointed_at: None,
        }
    }

    /// Algorithm 1 for a place just left. What sentences say of graphs comes by `words`. A trial may
    /// `spoil` what was measured, to see the filter survive it.
    pub fn step(
        &mut self,
        frozen: FrozenPlace,
        words: &dyn Words,
        spoil: &dyn Fn(Vertex, &mut Measured),
    ) -> Effects {
        let chain = frozen.open.chain;
        let t = self.graph.add(frozen); // v_t
        self.extend(&chain); // its edge to v_{t-1}
        let proposals = if self.config.loops { self.propose(t) } else { Vec::new() }; // 1. edges e_tj, (5–9)
        let mut measured = self.loops.measure(&mut self.graph, t, &proposals); // z_t, each pair once
        spoil(t, &mut measured);
        let mut effects = self.answer_all(t, &measured, words); // 1–4: G, X, L and w, (10), (17–18)
        effects.extend(self.look_again(words)); // the same for a place that was named since it was left
        self.pay_missed(t, &measured); // 4. w where nothing was found, (18)
        effects.extend(self.reopen(words)); // what was dropped comes back where it became likely
        let size = effective_sample_size(&self.particles);
        self.keep_best(); // normalise; in place of resampling: the N best, without a draw
        self.forget();
        effects.push(self.weighed(t, proposals, size));
        effects
    }

    fn weighed(&self, t: Vertex, proposed: Vec<Proposal>, effective_sample_size: f64) -> Effect {
        Effect::Weighed {
            place: t.into(),
            stamp_ns: self.graph.place(t).stamp_ns,
            proposed,
            weights: self.particles.iter().map(|p| (1.0 - self.unresolved()) * p.weight()).collect(),
            unresolved: self.unresolved(),
            effective_sample_size,
        }
    }

    /// Posterior mass of the graphs that were dropped. The weights of the particles sum to one among
    /// themselves.
    pub fn unresolved(&self) -> f64 {
        self.ghosts.unresolved(self.best().log_words)
    }

    /// The best particle.
    pub fn best(&self) -> &Particle {
        &self.particles[0]
    }

    /// Makes anew what a saved filter leaves out. Before that, covariances are unknown.
    pub fn restore(&mut self) -> Result<(), SmoothError> {
        let structure = &self.structure;
        self.particles.par_iter_mut().try_for_each(|p| p.belief.restore(structure))
    }

    /// All that is left to do when no more comes: what waits for a second look gets it.
    pub fn finish(&mut self, words: &dyn Words) -> Effects {
        let mut effects = Effects::new();
        while let Some(v) = self.second_looks.next() {
            effects.extend(self.look_again_from(v, words));
        }
        effects.extend(self.reopen(words));
        self.keep_best();
        effects
    }

    /// Weights that sum to one, the best particle first.
    pub fn rank(&mut self) {
        normalise(&mut self.particles);
        rank(&mut self.particles);
    }

    /// Places whose names have changed wait for a second look. One not left yet needs none: its first is
    /// to come. The paper gives none.
    pub fn named_anew(&mut self, places: impl IntoIterator<Item = Vertex>) {
        if !self.config.rules.by_paper() {
            let left = self.graph.places().len() as Vertex;
            self.second_looks.wait(places.into_iter().filter(|&v| v < left));
        }
    }

    /// The robot was seen there: near by it is looked for from now on.
    pub fn look_near(&mut self, place: Vertex, map_from_place: Pose2, within_m: f64) {
        self.pointed_at = Some(PointedAt { place, map_from_place, within_m });
    }

    /// Puts an edge into the graph of every particle, whatever speaks against it: a trial, see
    /// [`crate::trial`]. The other answer is dropped, not forgotten.
    pub fn impose(&mut self, t: Vertex, fit: &Fit) {
        let looks = log_looks(fit, 1);
        let question = self.questions.see(&self.graph, fit, t, looks).question;
        let edge = Edge::of(fit, t, question, looks);
        let judged = judge(&self.graph, &self.structure, self.best(), &edge);
        let Some(edge) = edge.enter(Arc::make_mut(&mut self.structure)) else { return };
        let log_odds = -judged.map_or(0.0, |j| j.log_there);
        let log_words = self.best().log_words;
        self.ghosts.drop_answer(Ghost { edge: edge.clone(), there: false, log_odds, since: 0.0, log_words });
        self.particles.iter_mut().for_each(|p| p.add(edge.clone()));
        self.update();
    }

    /// Looks at the pairs that the names of one place that waits propose by now.
    fn look_again(&mut self, words: &dyn Words) -> Effects {
        self.second_looks.next().map_or_else(Effects::new, |v| self.look_again_from(v, words))
    }

    fn look_again_from(&mut self, v: Vertex, words: &dyn Words) -> Effects {
        let mut effects = Effects::new();
        for (t, proposal) in second_look::pairs(&self.config, &self.graph, &self.particles, v) {
            let measured = measure_again(&mut self.graph, t, &[proposal]);
            effects.extend(self.answer_all(t, &measured, words));
        }
        effects
    }

    fn extend(&mut self, chain: &Chain) {
        let structure = Arc::make_mut(&mut self.structure);
        // Chain edges come from the front end, whose covariances are sound by construction;
        // should one not be, the place is tied by a vague edge rather than lost.
        if structure.add_pose(chain.previous_from_this, &chain.information).is_err() {
            let _ = structure.add_pose(Pose2::default(), &Matrix3::identity());
        }
        structure.arrange();
        self.update();
    }

    /// X of each particle given its G, (10). One whose numbers fail is dropped, unless all do: those
    /// go on by dead reckoning.
    fn update(&mut self) {
        let structure = &self.structure;
        let sound: Vec<bool> = self.particles.par_iter_mut().map(|p| p.update(structure).is_ok()).collect();
        if sound.contains(&true) {
            let mut sound = sound.into_iter();
            self.particles.retain(|_| sound.next() == Some(true));
        }
    }

    /// The union of what the particles would look at, one entry per older place, in order.
    fn propose(&self, t: Vertex) -> Vec<Proposal> {
        let followed = |b: &Belief, i: Vertex| self.loops.covers(&self.graph, i, t, |v| b.pose(v));
        let shared = (&self.graph, &*self.structure, self.pointed_at.as_ref());
        let per_particle: Vec<Vec<Proposal>> =
            self.particles.par_iter().map(|p| propose(&self.config, shared, p, t, followed)).collect();
        let mut union: BTreeMap<Vertex, Proposal> = BTreeMap::new();
        for p in per_particle.into_iter().flatten() {
            let known = union.entry(p.i).or_insert(p);
            if p.probability > known.probability {
                *known = p;
            }
        }
        union.into_values().collect()
    }

    /// Answers to all that was measured at place t.
    fn answer_all(&mut self, t: Vertex, measured: &Measured, words: &dyn Words) -> Effects {
        let mut effects = refusals(t, measured);
        let (fits, mut known) = (measured.fits.len(), 0);
        for fit in &measured.fits {
            let testimony = self.questions.see(&self.graph, fit, t, log_looks(fit, fits));
            let edge = Edge::of(fit, t, testimony.question, testimony.log_looks);
            let (stances, judged) = self.stances(&edge, &testimony);
            self.ghosts.gain(testimony.question, testimony.gained);
            let is_dropped = stances.iter().all(|s| *s == Stance::Elsewhere);
            if let (true, Some(Some(judged))) = (is_dropped, judged.first()) {
                self.ghosts.see(&edge, judged.log_there);
            }
            let news = fit.kind == EdgeKind::Semantic || !judged.iter().all(|j| j.is_some_and(|j| j.known));
            known += usize::from(!news);
            let wanted = news || known <= KNOWN_MAX;
            let share = self.answer(&edge, &stances, wanted, words);
            effects.push(report(t, fit, share, judged.first().and_then(Option::as_ref)));
        }
        for p in &mut self.particles {
            p.refused.retain(|&id| self.questions.remembers(id));
        }
        effects
    }

    /// Where each particle stands towards an edge, and what it thinks of it.
    fn stances(&self, edge: &Edge, testimony: &Testimony) -> (Vec<Stance>, Vec<Option<Judgement>>) {
        let Self { graph, structure, questions, .. } = self;
        let of = |p: &Particle| {
            let judgement = judge(graph, structure, p, edge);
            let others = questions.iter().filter(|q| q.id != testimony.question);
            (stance(p, edge, testimony, judgement, others), judgement)
        };
        self.particles.par_iter().map(of).collect::<Vec<_>>().into_iter().unzip()
    }

    /// The best of all answers become the particles; the others are dropped. Returns the posterior share of
    /// those that hold the edge.
    fn answer(&mut self, edge: &Edge, stances: &[Stance], wanted: bool, words: &dyn Words) -> f64 {
        let mut all = children(&self.particles, stances);
        if let Some(Stance::There { log_gain, .. }) = stances.first() {
            self.ghosts.kept_gained(*log_gain);
        }
        let log_sum = all.iter().map(|c| c.log_weight).fold(f64::NEG_INFINITY, log_add);
        let worth = all.partition_point(|c| c.log_weight >= log_sum + KEPT_MIN.ln());
        let dropped = all.split_off(worth.min(self.config.particles.max(1) as usize).max(1));
        let log_kept = all.iter().map(|c| c.log_weight).fold(f64::NEG_INFINITY, log_add);
        let best = all[0];
        for child in &dropped {
            self.drop_child(edge, child, &best, log_kept);
        }
        let adds = |c: &Child| c.there && c.adds && (wanted || c.is_new);
        let entered =
            if all.iter().any(adds) { edge.clone().enter(Arc::make_mut(&mut self.structure)) } else { None };
        self.disputed.extend(entered.iter().map(|e| e.factor));
        all.iter().filter_map(|c| c.lets_go).for_each(|l| self.loosen(l.from));
        let given = Given { graph: &self.graph, structure: &self.structure, words };
        let (parents, question) = (&self.particles, edge.question);
        let birth = |c: &Child| {
            let edge = entered.as_ref().filter(|_| adds(c));
            born(&parents[c.parent], c, question, edge, given)
        };
        let born: Vec<Option<Particle>> = all.par_iter().map(birth).collect();
        for child in all.iter().zip(&born).filter_map(|(c, born)| born.is_none().then_some(c)) {
            self.drop_child(edge, child, &best, log_kept);
        }
        let particles: Vec<Particle> = born.into_iter().flatten().collect();
        if !particles.is_empty() {
            self.particles = particles;
        }
        let there = |p: &&Particle| p.holds(edge.question);
        self.rank();
        self.update(); // X of those who answer "elsewhere"
        self.particles.iter().filter(there).map(Particle::weight).sum()
    }

    /// A child is dropped for its answer, or where the best gives the same, for what its parent had said before.
    fn drop_child(&mut self, edge: &Edge, child: &Child, best: &Child, log_kept: f64) {
        let log_odds = child.log_weight - log_kept;
        let ghost = if child.is_new && child.there != best.there {
            let log_words = self.particles[best.parent].log_words;
            Some(Ghost { edge: edge.clone(), there: child.there, log_odds, since: 0.0, log_words })
        } else {
            difference(&self.particles[child.parent], &self.particles[best.parent])
                .map(|g| Ghost { log_odds, ..g })
        };
        if let Some(ghost) = ghost {
            self.ghosts.drop_answer(ghost);
        }
    }

    /// Makes a stretch of the chain one that particles may let go.
    fn loosen(&mut self, from: Vertex) {
        let structure = Arc::make_mut(&mut self.structure);
        // Where odometry broke it says next to nothing already.
        if self.graph.place(from).chain.broken || structure.loosened(from).is_some() {
            return;
        }
        if let Ok(tight) =
            structure.loosen(from, &Matrix3::from_diagonal(&LOOSE.map(|sigma| sigma.powi(-2)).into()))
        {
            structure.arrange();
            self.particles.iter_mut().for_each(|p| p.belief.hold_as_before(tight));
            self.disputed.push(tight);
        }
    }

    /// Who expected place t to look like one that was looked at, and nothing was found, pays.
    fn pay_missed(&mut self, t: Vertex, measured: &Measured) {
        let (graph, structure) = (&self.graph, &self.structure);
        let paid: Vec<f64> =
            self.particles.par_iter_mut().map(|p| pay(graph, structure, p, t, &measured.looked)).collect();
        self.ghosts.kept_gained(paid[0]);
        for (p, log) in self.particles.iter_mut().zip(paid) {
            p.log_weight += log;
        }
    }

    /// Merges particles that say the same and keeps the best; what tells the others from the best of all is
    /// dropped, not forgotten.
    fn keep_best(&mut self) {
        normalise(&mut self.particles);
        self.particles = merge(&self.structure, std::mem::take(&mut self.particles));
        let dropped = keep_best(&mut self.particles, self.config.particles.max(1) as usize);
        let best = &self.particles[0];
        let kept = 1.0 - dropped.iter().map(Particle::weight).sum::<f64>();
        for ghost in dropped.iter().filter_map(|p| difference(p, best)) {
            self.ghosts.drop_answer(Ghost { log_odds: ghost.log_odds - kept.ln(), ..ghost });
        }
        self.ghosts.forget(self.particles[0].log_words);
    }

    /// Takes out the factors that no particle holds any more.
    fn forget(&mut self) {
        let (structure, particles) = (&mut self.structure, &self.particles);
        self.disputed.retain(|&factor| {
            let holders = particles.iter().filter(|p| p.belief.holds(factor)).count();
            if holders == 0 {
                let _ = Arc::make_mut(structure).remove_factor(factor);
            }
            0 < holders && holders < particles.len()
        });
    }
}

#[cfg(test)]
mod tests;
