//! Algorithm 1: the Rao-Blackwellized particle filter over semantic graphs.
//!
//! One step per place, when the robot has left it. Particles hold p(G, X, L | z, u, λ) =
//! p(L | X, G, z, u, λ) · p(X | G, z, u, λ) · p(G | z, u, λ), eq. (2).

pub mod chance;
pub mod decide;
pub mod labels;
pub mod likelihood;
pub mod loops;
pub mod particle;
pub mod propose;
pub mod resample;
pub mod revisit;
pub(crate) mod second_look;
pub mod weigh;

use crate::config::Config;
use crate::edge::{EdgeKind, Proposal, Vertex};
use crate::effects::{Effect, Effects};
use crate::filter::chance::log_looks;
use crate::filter::decide::{Choice, add_edge, choose};
use crate::filter::likelihood::weigh_overlaps;
use crate::filter::loops::{Fit, Loops, Measured, measure_again};
use crate::filter::particle::Particle;
use crate::filter::propose::propose;
use crate::filter::resample::{effective_sample_size, is_wasteful, merge, normalise, resample};
use crate::filter::revisit::{Revisits, Testimony};
use crate::filter::second_look::SecondLooks;
use crate::filter::weigh::{Judgement, judge};
use crate::geometry::Pose2;
use crate::graph::Graph;
use crate::smoothing::{FactorId, SmoothError, Structure};
use crate::track::front::{Chain, FrozenPlace};
use nalgebra::Matrix3;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

/// Edges of a place that tell no particle anything new: they are measurements still, but who comes for the
/// tenth time needs no nine of them.
const KNOWN_MAX: usize = 2;

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
    revisits: Revisits,
    /// Factors that some particles hold and others don't.
    disputed: Vec<FactorId>,
    second_looks: SecondLooks,
}

impl Filter {
    /// N equal particles with nothing in them.
    pub fn new(config: Config) -> Self {
        let particles = vec![Particle::empty(config.particles.max(1))];
        Self {
            config,
            graph: Graph::default(),
            structure: Arc::default(),
            particles,
            loops: Loops::default(),
            revisits: Revisits::default(),
            disputed: Vec::new(),
            second_looks: SecondLooks::default(),
        }
    }

    /// Algorithm 1 for a place just left. What sentences say of it comes through [`crate::talk`]. A trial may
    /// `spoil` what was measured, to see the filter survive it.
    pub fn step(&mut self, frozen: FrozenPlace, spoil: &dyn Fn(Vertex, &mut Measured)) -> Effects {
        let chain = frozen.open.chain;
        let t = self.graph.add(frozen); // v_t
        self.extend(&chain); // its edge to v_{t-1}
        let proposals = if self.config.loops { self.propose(t) } else { Vec::new() }; // 1. edges e_tj, (5–9)
        let mut measured = self.loops.measure(&mut self.graph, t, &proposals); // z_t, each pair once
        spoil(t, &mut measured);
        let mut effects = self.weigh_measured(t, &measured); // 1–4: G, X, L and w, (10), (17–18)
        effects.extend(self.look_again()); // the same for a place that was named since it was left
        weigh_overlaps(&self.graph, &self.structure, &mut self.particles, t); // 4. w where nothing fitted, (18)
        normalise(&mut self.particles);
        self.particles = merge(std::mem::take(&mut self.particles));
        let size = effective_sample_size(&self.particles);
        let n = self.config.particles.max(1);
        if is_wasteful(&self.particles, n, self.config.resample_below) {
            self.particles = resample(std::mem::take(&mut self.particles), n, self.config.seed, t);
            effects.push(Effect::Resampled { effective_sample_size: size });
        }
        self.forget();
        effects.push(self.weighed(t, proposals, size));
        effects
    }

    fn weighed(&self, t: Vertex, proposed: Vec<Proposal>, effective_sample_size: f64) -> Effect {
        Effect::Weighed {
            place: t.into(),
            stamp_ns: self.graph.place(t).stamp_ns,
            proposed,
            weights: self
                .particles
                .iter()
                .map(|p| (p.count, (1.0 - self.unresolved()) * p.weight()))
                .collect(),
            unresolved: self.unresolved(),
            effective_sample_size,
        }
    }

    /// The best particle.
    pub fn best(&self) -> &Particle {
        &self.particles[0]
    }

    /// Posterior mass of graphs that were dropped, in [0, 1]. Weights of those kept sum to one among
    /// themselves.
    pub fn unresolved(&self) -> f64 {
        0.0
    }

    /// Makes anew what a saved filter leaves out. Before that, covariances are unknown.
    pub fn restore(&mut self) -> Result<(), SmoothError> {
        let structure = &self.structure;
        self.particles.par_iter_mut().try_for_each(|p| p.belief.restore(structure))
    }

    /// All that is left to do when no more comes: what waits for a second look gets it.
    pub fn finish(&mut self) -> Effects {
        let mut effects = Effects::new();
        while let Some(v) = self.second_looks.next() {
            effects.extend(self.look_again_from(v));
        }
        self.rank();
        effects
    }

    /// Weights that sum to one, the best particle first.
    pub fn rank(&mut self) {
        normalise(&mut self.particles);
        self.particles.sort_by(|a, b| b.log_weight.total_cmp(&a.log_weight));
    }

    /// Places whose names have changed wait for a second look. One not left yet needs none: its first is
    /// to come. The paper gives none.
    pub fn named_anew(&mut self, places: impl IntoIterator<Item = Vertex>) {
        if !self.config.rules.by_paper() {
            let left = self.graph.places().len() as Vertex;
            self.second_looks.wait(places.into_iter().filter(|&v| v < left));
        }
    }

    /// Pairs whose names led to revisits, and still would.
    pub fn led_by_names(&self) -> BTreeSet<(Vertex, Vertex)> {
        second_look::led_by_names(&self.particles)
    }

    /// Judges again the revisits, of those that names led to, whose names were taken back. Returns how many
    /// revisits some particle gave up.
    pub fn judge_again(&mut self, led: BTreeSet<(Vertex, Vertex)>) -> usize {
        let Self { particles, graph, structure, .. } = self;
        let given_up = second_look::judge_again(particles, graph, structure, self.config.gamma_per_m2, led);
        self.disputed.extend(given_up.disputed);
        self.disputed.sort_unstable();
        self.disputed.dedup();
        self.forget();
        given_up.revisits
    }

    /// Puts an edge into the graph of every particle, whatever speaks against it: a trial, see
    /// [`crate::trial`].
    pub fn impose(&mut self, t: Vertex, fit: &Fit) {
        let revisit = self.revisits.see(&self.graph, fit, t, 0.0).revisit;
        let Some(edge) = add_edge(Arc::make_mut(&mut self.structure), fit, revisit, t) else { return };
        self.particles.iter_mut().for_each(|p| p.take(edge.clone()));
        self.update();
    }

    /// Looks at the pairs that the names of one place that waits propose by now.
    fn look_again(&mut self) -> Effects {
        self.second_looks.next().map_or_else(Effects::new, |v| self.look_again_from(v))
    }

    fn look_again_from(&mut self, v: Vertex) -> Effects {
        let mut effects = Effects::new();
        for (t, proposal) in second_look::pairs(&self.config, &self.graph, &self.particles, v) {
            let measured = measure_again(&mut self.graph, t, &[proposal]);
            effects.extend(self.weigh_measured(t, &measured));
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
        let followed = |i: Vertex| self.loops.covers(&self.graph, i);
        let per_particle: Vec<Vec<Proposal>> = self
            .particles
            .par_iter()
            .map(|p| propose(&self.config, &self.graph, &self.structure, p, t, followed))
            .collect();
        let mut union: BTreeMap<Vertex, Proposal> = BTreeMap::new();
        for p in per_particle.into_iter().flatten() {
            let known = union.entry(p.i).or_insert(p);
            if p.probability > known.probability {
                *known = p;
            }
        }
        union.into_values().collect()
    }

    /// All that was measured at place t.
    fn weigh_measured(&mut self, t: Vertex, measured: &Measured) -> Effects {
        let mut effects = refusals(t, measured);
        let (fits, mut known) = (measured.fits.len(), 0);
        for fit in &measured.fits {
            let testimony = self.revisits.see(&self.graph, fit, t, log_looks(fit, fits));
            let judged = self.judge(t, fit, &testimony); // (17–18)
            let news = fit.kind == EdgeKind::Semantic || !judged.iter().all(|j| j.is_some_and(|j| j.known));
            known += usize::from(!news);
            effects.push(if news || known <= KNOWN_MAX {
                self.take_or_refuse(t, fit, &testimony, &judged)
            } else {
                surplus(t, fit)
            });
        }
        for p in &mut self.particles {
            p.refused.retain(|&id| self.revisits.remembers(id));
        }
        effects
    }

    fn judge(&self, t: Vertex, fit: &Fit, testimony: &Testimony) -> Vec<Option<Judgement>> {
        let (structure, config) = (&self.structure, &self.config);
        let judge = |p: &Particle| judge(structure, p, fit, t, testimony, config.gamma_per_m2);
        self.particles.par_iter().map(judge).collect()
    }

    /// Each particle takes the edge of a fit or refuses it, and is weighed by the fit.
    fn take_or_refuse(
        &mut self,
        t: Vertex,
        fit: &Fit,
        testimony: &Testimony,
        judged: &[Option<Judgement>],
    ) -> Effect {
        let relief = judged.iter().flatten().map(|j| j.log_evidence).fold(f64::NEG_INFINITY, f64::max);
        let draw = |k| (self.config.seed, k as u64);
        let mut choices: Vec<Choice> = std::mem::take(&mut self.particles)
            .into_iter()
            .zip(judged)
            .enumerate()
            .map(|(k, (p, judgement))| choose(p, fit, testimony.revisit, *judgement, relief, t, draw(k)))
            .collect(); // G and w
        let wanted = choices.iter().any(|c| c.taken.is_some());
        let edge =
            wanted.then(|| add_edge(Arc::make_mut(&mut self.structure), fit, testimony.revisit, t)).flatten();
        self.disputed.extend(edge.iter().map(|e| e.factor));
        choices.par_iter_mut().for_each(|c| c.take(&self.structure, edge.as_ref())); // X, (10)
        let share = share_taken(&choices);
        self.particles = choices.into_iter().flat_map(|c| [c.taken, c.refused]).flatten().collect();
        self.particles.sort_by(|a, b| b.log_weight.total_cmp(&a.log_weight));
        self.update(); // X of those who refuse
        report(t, fit, share, judged.iter().flatten().next())
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

/// Share of the posterior that took the edge.
fn share_taken(choices: &[Choice]) -> f64 {
    let all = || choices.iter().flat_map(|c| [&c.taken, &c.refused]).flatten();
    let top = all().map(|p| p.log_weight).fold(f64::NEG_INFINITY, f64::max);
    let mass = |p: &Particle| (p.log_weight - top).exp();
    choices.iter().flat_map(|c| &c.taken).map(mass).sum::<f64>() / all().map(mass).sum::<f64>()
}

fn report(t: Vertex, fit: &Fit, weight: f64, best: Option<&Judgement>) -> Effect {
    let (posterior, distance) = best.map_or((0.0, f64::NAN), |j| (j.posterior, j.distance2.sqrt()));
    let figures = format!(
        "score {:.2}, overlap {:.2}, {} places over {:.0} m agree, {distance:.1} σ from prediction, \
         p = {posterior:.3}",
        fit.mode.score, fit.mode.overlap, fit.support, fit.support_path_m
    );
    let (i, j, kind) = (fit.i.into(), t.into(), fit.kind);
    if weight > 0.0 {
        Effect::EdgeAccepted { i, j, kind, weight, reason: format!("edge {t}–{i} taken: {figures}") }
    } else {
        Effect::EdgeRefused { i, j, kind, reason: format!("edge {t}–{i} refused by all: {figures}") }
    }
}

fn surplus(t: Vertex, fit: &Fit) -> Effect {
    let reason = format!("edge {t}–{} left out: all know it, and {KNOWN_MAX} others say it", fit.i);
    Effect::EdgeRefused { i: fit.i.into(), j: t.into(), kind: fit.kind, reason }
}

fn refusals(t: Vertex, measured: &Measured) -> Effects {
    measured
        .refused
        .iter()
        .map(|r| Effect::EdgeRefused { i: r.i.into(), j: t.into(), kind: r.kind, reason: r.reason.clone() })
        .collect()
}

#[cfg(test)]
mod tests;
