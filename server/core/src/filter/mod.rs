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
use crate::edge::EdgeKind;
use crate::edge::Proposal;
use crate::edge::Vertex;
use crate::effects::{Effect, Effects};
use crate::filter::chance::log_looks;
use crate::filter::decide::{Choice, add_edge, choose};
use crate::filter::likelihood::weigh_overlaps;
use crate::filter::loops::{Fit, Loops, Measured};
use crate::filter::particle::Particle;
use crate::filter::propose::propose;
use crate::filter::resample::{effective_sample_size, is_wasteful, merge, normalise, resample};
use crate::filter::revisit::{Revisits, Testimony};
use crate::filter::weigh::{Judgement, judge};
use crate::geometry::Pose2;
use crate::graph::Graph;
use crate::inject::inject;
use crate::smoothing::{FactorId, SmoothError, Structure};
use crate::talk::ledger::Ledger;
use crate::track::front::{Chain, FrozenPlace};
use nalgebra::Matrix3;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, VecDeque};
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
    /// What was said.
    pub ledger: Arc<Ledger>,
    /// Factors of all particles together, and in what order they are eliminated.
    pub structure: Arc<Structure>,
    /// Distinct particles, best first; weights sum to one.
    pub particles: Vec<Particle>,
    loops: Loops,
    revisits: Revisits,
    /// Factors that some particles hold and others don't.
    pub(crate) disputed: Vec<FactorId>,
    /// Places named anew since they were left, oldest first; see [`crate::filter::second_look`].
    pub(crate) named_anew: VecDeque<Vertex>,
}

impl Filter {
    /// N equal particles with nothing in them.
    pub fn new(config: Config) -> Self {
        let particles = vec![Particle::empty(config.particles.max(1))];
        Self {
            config,
            graph: Graph::default(),
            ledger: Arc::default(),
            structure: Arc::default(),
            particles,
            loops: Loops::default(),
            revisits: Revisits::default(),
            disputed: Vec::new(),
            named_anew: VecDeque::new(),
        }
    }

    /// Algorithm 1 for a place just left.
    pub fn step(&mut self, frozen: FrozenPlace) -> Effects {
        let chain = frozen.open.chain;
        let t = self.graph.add(frozen); // v_t
        self.extend(&chain); // its edge to v_{t-1}
        let proposals = if self.config.loops { self.propose(t) } else { Vec::new() }; // 1. edges e_tj, (5–9)
        let measured = self.loops.measure(&mut self.graph, t, &proposals); // z_t, each pair once
        let mut effects = self.weigh_measured(t, measured); // 1, 2 and 4: G, X and w, (10), (17–18)
        effects.extend(self.look_again()); // the same for a place that was named since it was left
        weigh_overlaps(&self.graph, &self.structure, &mut self.particles, t); // 4. w where nothing fitted, (18)
        self.reground(); // 3. L: edges carry labels over; descriptions are grounded in the map as it is now
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
            weights: self.particles.iter().map(|p| (p.count, p.weight())).collect(),
            effective_sample_size,
        }
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
    pub(crate) fn weigh_measured(&mut self, t: Vertex, mut measured: Measured) -> Effects {
        inject(&self.config, t, &mut measured.fits);
        let mut effects = refusals(t, &measured);
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
    pub(crate) fn forget(&mut self) {
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
mod tests {
    use super::*;
    use crate::edge::EdgeKind;
    use crate::scan::matching::Mode;
    use crate::scan::place::Content;
    use crate::track::front::OpenPlace;
    use nalgebra::Vector3;

    /// A straight chain of places 1 m apart whose ends fit so that half of the posterior believes it.
    fn split() -> Filter {
        let mut filter = Filter::new(Config::default());
        for _ in 0..21 {
            filter.extend(&chain());
        }
        let fits = vec![fit(0, 17.7, EdgeKind::Distance)];
        filter.weigh_measured(20, Measured { fits, refused: vec![] });
        filter
    }

    #[test]
    fn of_what_all_know_two_edges_a_place_are_enough() {
        let mut filter = Filter::new(Config { loops: false, ..Config::default() });
        for v in 0_u32..21 {
            let front_from_place = Pose2::new(f64::from(v), 0.0, 0.0);
            let (id, path_m, chain) = (v.into(), f64::from(v), chain());
            let open = OpenPlace { id, stamp_ns: 0, front_from_place, path_m, chain };
            filter.step(FrozenPlace { open, content: Content::new(&[]) });
        }
        let mut fits: Vec<Fit> = (16..20).map(|i| fit(i, f64::from(20 - i), EdgeKind::Distance)).collect();
        fits.push(fit(15, 5.0, EdgeKind::Semantic));
        fits.push(fit(0, 20.0, EdgeKind::Distance));
        let effects = filter.weigh_measured(20, Measured { fits, refused: vec![] });
        let taken = |e: &&Effect| matches!(e, Effect::EdgeAccepted { .. });
        assert_eq!((effects.len(), effects.iter().filter(taken).count()), (6, 4));
        let older = |p: &Particle| -> Vec<Vertex> { p.edges.iter().map(|e| e.i).collect() };
        assert_eq!(older(filter.best()), [16, 17, 15], "words are said once");
        assert!(filter.particles.iter().any(|p| older(p) == [16, 17, 15, 0]), "news is news");
    }

    fn fit(i: Vertex, x_m: f64, kind: EdgeKind) -> Fit {
        let covariance = Matrix3::from_diagonal(&Vector3::new(4e-4, 4e-4, 1.6e-5));
        let mode = Mode { i_from_j: Pose2::new(x_m, 0.0, 0.0), covariance, score: 0.9, overlap: 0.6 };
        Fit::supported_by(i, mode, kind, 3)
    }

    fn chain() -> Chain {
        let information = Matrix3::from_diagonal(&Vector3::new(100.0, 100.0, 1e6));
        Chain { previous_from_this: Pose2::new(1.0, 0.0, 0.0), information, broken: false }
    }

    fn length_m(filter: &Filter) -> f64 {
        filter.best().belief.pose(20).x_m
    }

    #[test]
    fn a_fit_splits_a_particle_into_one_with_the_edge_and_one_without() {
        let filter = split();
        let [a, b] = &filter.particles[..] else { panic!("{}", filter.particles.len()) };
        let (with, without) = if a.edges.is_empty() { (b, a) } else { (a, b) };
        assert_eq!((with.edges.len(), without.edges.len(), with.count + without.count), (1, 0, 30));
        assert!((with.belief.pose(20).x_m - 17.7).abs() < 0.05);
        assert!((without.belief.pose(20).x_m - 20.0).abs() < 1e-9);
        assert_eq!(filter.disputed, [with.edges[0].factor]);
    }

    #[test]
    fn a_factor_that_no_particle_holds_any_more_is_taken_out() {
        let mut filter = split();
        let factor = filter.disputed[0];
        filter.forget();
        assert!(filter.structure.factor(factor).is_some() && filter.disputed == [factor]);
        filter.particles.retain(|p| p.edges.is_empty());
        filter.forget();
        assert!(filter.structure.factor(factor).is_none() && filter.disputed.is_empty());
        filter.extend(&chain());
        assert!((length_m(&filter) - 20.0).abs() < 1e-9);
    }

    #[test]
    fn a_factor_that_all_particles_hold_stays() {
        let mut filter = split();
        let factor = filter.disputed[0];
        filter.particles.retain(|p| !p.edges.is_empty());
        filter.forget();
        assert!(filter.structure.factor(factor).is_some() && filter.disputed.is_empty());
        filter.extend(&chain());
        assert!((length_m(&filter) - 17.7).abs() < 0.05);
    }
}
