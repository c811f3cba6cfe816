//! Algorithm 1: the Rao-Blackwellized particle filter over semantic graphs.
//!
//! One step per place, when the robot has left it. Particles hold p(G, X, L | z, u, λ) =
//! p(L | X, G, z, u, λ) · p(X | G, z, u, λ) · p(G | z, u, λ), eq. (2).

use crate::config::Config;
use crate::effects::{Effect, Effects};
use crate::graph::{Graph, Vertex};
use crate::listen::Ledger;
use crate::loops::{Fit, Loops, Measured};
use crate::particle::Particle;
use crate::propose::{Proposal, propose};
use crate::resample::{effective_sample_size, merge, normalise, resample};
use crate::scan::front::{Chain, FrozenPlace};
use crate::weigh::{Judgement, choose, judge};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::sync::Arc;

/// An edge says that two places are one only if they lie this near; scans tie farther ones too.
const SAME_PLACE_M: f64 = 3.0;

/// The posterior over semantic graphs, and what all particles share.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Filter {
    /// Settings.
    pub config: Config,
    /// Places, chain, matches.
    pub graph: Graph,
    /// What was said.
    pub ledger: Arc<Ledger>,
    /// Distinct particles, best first; weights sum to one.
    pub particles: Vec<Particle>,
    loops: Loops,
}

impl Filter {
    /// N equal particles with nothing in them.
    pub fn new(config: Config) -> Self {
        let particles = vec![Particle::empty(config.particles.max(1))];
        Self { config, graph: Graph::default(), ledger: Arc::default(), particles, loops: Loops::default() }
    }

    /// Algorithm 1 for a place just left.
    pub fn step(&mut self, frozen: FrozenPlace) -> Effects {
        let chain = frozen.open.chain;
        let t = self.graph.add(frozen); // v_t
        self.extend(&chain); // its edge to v_{t-1}
        let proposals = self.propose(t); // 1. edges e_tj, (5–9)
        let measured = self.loops.measure(&mut self.graph, t, &proposals); // z_t, each pair once
        let mut effects = refusals(t, &measured);
        for fit in &measured.fits {
            effects.push(self.take_or_refuse(t, fit)); // 1, 2 and 4: G, X and w, (10), (17–18)
        } // 3. labels came with the sentences; edges carry them over
        normalise(&mut self.particles);
        self.particles = merge(std::mem::take(&mut self.particles));
        let size = effective_sample_size(&self.particles);
        let n = self.config.particles.max(1);
        if size < self.config.resample_below * f64::from(n) || self.particles.len() > n as usize {
            self.particles = resample(std::mem::take(&mut self.particles), n, self.config.seed, t);
            effects.push(Effect::Resampled { effective_sample_size: size });
        }
        effects
    }

    /// The best particle.
    pub fn best(&self) -> &Particle {
        &self.particles[0]
    }

    fn extend(&mut self, chain: &Chain) {
        self.particles.par_iter_mut().for_each(|p| {
            // Chain edges come from the front end, whose covariances are sound by construction;
            // should one not be, the place is tied by a vague edge rather than lost.
            if p.smoother.add_pose(chain.previous_from_this, &chain.information).is_err() {
                let vague = nalgebra::Matrix3::identity();
                let _ = p.smoother.add_pose(crate::Pose2::default(), &vague);
            }
        });
    }

    /// The union of what the particles would look at, one entry per older place, in order.
    fn propose(&self, t: Vertex) -> Vec<Proposal> {
        let followed = |i: Vertex| self.loops.covers(&self.graph, i);
        let per_particle: Vec<Vec<Proposal>> =
            self.particles.par_iter().map(|p| propose(&self.config, &self.graph, p, t, followed)).collect();
        let mut union: BTreeMap<Vertex, Proposal> = BTreeMap::new();
        for p in per_particle.into_iter().flatten() {
            let known = union.entry(p.i).or_insert(p);
            if p.probability > known.probability {
                *known = p;
            }
        }
        union.into_values().collect()
    }

    /// Each particle takes the edge of a fit or refuses it, and is weighed by the fit.
    fn take_or_refuse(&mut self, t: Vertex, fit: &Fit) -> Effect {
        let gamma = self.config.gamma_per_m2;
        let before = std::mem::take(&mut self.particles);
        let judged: Vec<Option<Judgement>> = before.par_iter().map(|p| judge(p, fit, t, gamma)).collect();
        let relief = judged.iter().flatten().map(|j| j.log_evidence).fold(f64::NEG_INFINITY, f64::max);
        let (seed, places) = (self.config.seed, self.graph.place(fit.i).id);
        let outcomes: Vec<(Option<Particle>, Option<Particle>)> = before
            .into_par_iter()
            .zip(judged.par_iter())
            .enumerate()
            .map(|(k, (p, judgement))| match judgement {
                None => (None, Some(p)),
                Some(j) => {
                    let mut choice = choose(p, fit, *j, relief, t, (seed, k as u64));
                    let apart_m = fit.mode.i_from_j.x_m.hypot(fit.mode.i_from_j.y_m);
                    if let Some(taken) = choice.taken.as_mut().filter(|_| apart_m < SAME_PLACE_M) {
                        taken.labels.carry_over(fit.i, t);
                    }
                    (choice.taken, choice.refused)
                }
            })
            .collect();
        let top = outcomes
            .iter()
            .flat_map(|(a, b)| [a, b])
            .flatten()
            .map(|p| p.log_weight)
            .fold(f64::NEG_INFINITY, f64::max);
        let mass = |p: &Option<Particle>| p.as_ref().map_or(0.0, |p| (p.log_weight - top).exp());
        let taken: f64 = outcomes.iter().map(|o| mass(&o.0)).sum();
        let refused: f64 = outcomes.iter().map(|o| mass(&o.1)).sum();
        self.particles = outcomes.into_iter().flat_map(|(a, b)| [a, b]).flatten().collect();
        self.particles.sort_by(|a, b| b.log_weight.total_cmp(&a.log_weight));
        report(places, t, fit, taken / (taken + refused), judged.iter().flatten().next())
    }
}

fn report(i: u64, t: Vertex, fit: &Fit, weight: f64, best: Option<&Judgement>) -> Effect {
    let (posterior, distance) = best.map_or((0.0, f64::NAN), |j| (j.posterior, j.distance2.sqrt()));
    let figures = format!(
        "score {:.2}, overlap {:.2}, {} places over {:.0} m agree, {distance:.1} σ from prediction, \
         p = {posterior:.3}",
        fit.mode.score, fit.mode.overlap, fit.support, fit.support_path_m
    );
    let (j, kind) = (u64::from(t), fit.kind);
    if weight > 0.0 {
        Effect::EdgeAccepted { i, j, kind, weight, reason: format!("edge {t}–{i} taken: {figures}") }
    } else {
        Effect::EdgeRefused { i, j, kind, reason: format!("edge {t}–{i} refused by all: {figures}") }
    }
}

fn refusals(t: Vertex, measured: &Measured) -> Effects {
    measured
        .refused
        .iter()
        .map(|r| Effect::EdgeRefused { i: r.i.into(), j: t.into(), kind: r.kind, reason: r.reason.clone() })
        .collect()
}
