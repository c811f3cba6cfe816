//! Many estimates of one graph that differ in the loop edges they hold: the load of a particle filter,
//! with equal particles kept once.

use crate::draws::{Draws, Plan, Split};
use crate::failure::Failure;
use crate::feed::{add_loop, add_pose, failed};
use crate::g2o::Graph;
use crate::report::{Progress, Stats, growth_mb, mean, memory_max_mb, round, timed};
use serde::Serialize;
use std::collections::HashSet;
use std::hint::black_box;
use std::iter::repeat_n;
use toponym_core::smoothing::{Belief, FactorId, SmoothError, Smoother, Structure, Work};

/// The line printed.
#[derive(Serialize)]
pub struct Report {
    peer: &'static str,
    ver: &'static str,
    pg: String,
    poses: usize,
    edges: usize,
    particles: u32,
    accept: f64,
    /// None if there is no resampling.
    resample_every: Option<usize>,
    seed: u64,
    independent: bool,
    total_s: f64,
    structure_s: f64,
    beliefs_s: f64,
    step: Option<Stats>,
    distinct_trees: f64,
    distinct_trees_end: usize,
    shared_clique_fraction: f64,
    chi2_mean: f64,
    rss_mb: Option<f64>,
    reelim_mean: f64,
    relin_mean: f64,
    factors_mean: f64,
}

/// Particles share a structure, and the numbers of the cliques they agree on.
pub fn run_shared(graph: &Graph, plan: &Plan) -> Result<Report, Failure> {
    let memory_before = memory_max_mb();
    let mut draws = Draws::new(plan);
    let mut cost = Cost::default();
    let mut structure = Structure::new();
    let mut groups = vec![Group { belief: Belief::new(), held: Held::new(graph), count: plan.particles }];
    let mut progress = Progress::new(graph.poses());
    for k in 0..graph.poses() {
        cost.next_step();
        let (factors, ms) = timed(|| grow(&mut structure, graph, k));
        let factors = factors?;
        cost.structure_ms += ms;
        let splits: Vec<Split> = groups.iter().map(|g| draws.split(g.count, factors.len())).collect();
        groups = take(groups, &splits, &factors, &structure, &mut cost).map_err(failed(graph, k))?;
        cost.trees.push(groups.len() as f64);
        if k > 0 && k.is_multiple_of(plan.resample_every) {
            let mut counts: Vec<u32> = groups.iter().map(|g| g.count).collect();
            draws.resample(&mut counts);
            groups.iter_mut().zip(counts).for_each(|(group, count)| group.count = count);
            // Few are left that differ: now what was put off costs least.
            let caught_up = cost.beliefs(|| {
                groups.retain(|g| g.count > 0);
                groups.iter_mut().try_for_each(|g| g.belief.catch_up(&structure).map(drop))
            });
            caught_up.map_err(failed(graph, k))?;
        }
        progress.tick(k, || format!(", {} distinct trees", groups.len()));
    }
    drop(progress);
    let rss_mb = growth_mb(memory_before, memory_max_mb());
    let chi2_sum: f64 = groups
        .iter()
        .map(|g| f64::from(g.count) * graph.chi2(&g.belief.poses(), |edge| g.held.has(edge)))
        .sum();
    Ok(Report {
        resample_every: Some(plan.resample_every),
        distinct_trees_end: groups.len(),
        shared_clique_fraction: round(shared_fraction(&groups), 4),
        chi2_mean: chi2_sum / f64::from(plan.particles),
        ..cost.report(graph, plan, rss_mb)
    })
}

/// The same particles with no sharing at all: a smoother each. Without resampling, since that would be
/// copying.
pub fn run_independent(graph: &Graph, plan: &Plan) -> Result<Report, Failure> {
    let memory_before = memory_max_mb();
    let mut draws = Draws::new(plan);
    let mut cost = Cost::default();
    // Not clones of one, which might share.
    let mut smoothers: Vec<Smoother> = (0..plan.particles).map(|_| Smoother::new()).collect();
    let mut holds = vec![Held::new(graph); plan.particles as usize];
    let mut progress = Progress::new(graph.poses());
    for k in 0..graph.poses() {
        cost.next_step();
        let kept: Vec<Vec<usize>> =
            smoothers.iter().map(|_| graph.loops(k).filter(|_| draws.keep()).collect()).collect();
        let (added, ms) = timed(|| -> Result<(), Failure> {
            for (smoother, edges) in smoothers.iter_mut().zip(&kept) {
                add_pose(smoother, graph, k)?;
                for &edge in edges {
                    add_loop(smoother, graph, &graph.edges[edge])?;
                }
            }
            Ok(())
        });
        added?;
        cost.structure_ms += ms;
        let works = cost.beliefs(|| -> Result<Vec<Work>, SmoothError> {
            let update = |smoother: &mut Smoother| {
                let work = smoother.update_newest();
                black_box(smoother.pose(k as u32));
                work
            };
            smoothers.iter_mut().map(update).collect()
        });
        works.map_err(failed(graph, k))?.iter().for_each(|work| cost.work(work));
        holds.iter_mut().zip(kept).for_each(|(held, edges)| held.insert_all(edges));
        cost.trees.push(smoothers.len() as f64);
        progress.tick(k, String::new);
    }
    drop(progress);
    let rss_mb = growth_mb(memory_before, memory_max_mb());
    Ok(Report {
        independent: true,
        distinct_trees_end: smoothers.len(),
        chi2_mean: mean(
            smoothers.iter().zip(&holds).map(|(s, held)| graph.chi2(&s.poses(), |edge| held.has(edge))),
        ),
        ..cost.report(graph, plan, rss_mb)
    })
}

/// Particles that hold the same edges: one estimate.
struct Group {
    belief: Belief,
    held: Held,
    count: u32,
}

/// A loop edge of this step: its place in the graph, and the structure's handle of it.
type Offered = (usize, FactorId);

/// Adds pose k and all its edges to what the particles share.
fn grow(structure: &mut Structure, graph: &Graph, k: usize) -> Result<Vec<Offered>, Failure> {
    add_pose(structure, graph, k)?;
    let factors = graph
        .loops(k)
        .map(|edge| Ok((edge, add_loop(structure, graph, &graph.edges[edge])?)))
        .collect::<Result<_, Failure>>()?;
    structure.arrange();
    Ok(factors)
}

/// Takes a pose into all groups; each comes apart into those who keep the same edges.
fn take(
    groups: Vec<Group>,
    splits: &[Split],
    offered: &[Offered],
    structure: &Structure,
    cost: &mut Cost,
) -> Result<Vec<Group>, SmoothError> {
    let newest = structure.len() as u32 - 1;
    let (beliefs, holds): (Vec<Belief>, Vec<Held>) = groups.into_iter().map(|g| (g.belief, g.held)).unzip();
    let mut updated: Vec<(Belief, Work)> = Vec::with_capacity(splits.iter().map(Split::len).sum());
    // All in one go: the clock itself costs as much as a small update.
    cost.beliefs(|| -> Result<(), SmoothError> {
        for (belief, split) in beliefs.into_iter().zip(splits) {
            // The last part goes on with the original: what only it needs is changed in place.
            for (mask, mut belief) in split.keys().zip(repeat_n(belief, split.len())) {
                for (_, id) in kept(mask, offered) {
                    belief.hold(id);
                }
                let work = belief.update_newest(structure)?;
                black_box(belief.pose(newest));
                updated.push((belief, work));
            }
        }
        Ok(())
    })?;
    let mut updated = updated.into_iter();
    let mut groups = Vec::with_capacity(updated.len());
    for (held, split) in holds.iter().zip(splits) {
        for ((mask, &count), (belief, work)) in split.iter().zip(updated.by_ref()) {
            cost.work(&work);
            let mut held = held.clone();
            held.insert_all(kept(mask, offered).map(|(edge, _)| edge));
            groups.push(Group { belief, held, count });
        }
    }
    Ok(groups)
}

/// Of the edges offered those that the mask keeps.
fn kept<'a>(mask: &'a [bool], offered: &'a [Offered]) -> impl Iterator<Item = Offered> + 'a {
    mask.iter().zip(offered).filter(|(keep, _)| **keep).map(|(_, &offer)| offer)
}

/// Share of the cliques of all trees that would not be there if equal ones were counted once.
fn shared_fraction(groups: &[Group]) -> f64 {
    let mut distinct = HashSet::new();
    let mut all = 0;
    for group in groups {
        for id in group.belief.front_ids() {
            distinct.insert(id);
            all += 1;
        }
    }
    1.0 - distinct.len() as f64 / f64::from(all.max(1))
}

/// Which edges a particle holds, a bit each: those that poses start from, and the loop edges it took.
#[derive(Clone)]
struct Held(Vec<u64>);

impl Held {
    fn new(graph: &Graph) -> Self {
        let mut held = Self(vec![u64::MAX; graph.edges.len().div_ceil(64)]);
        for edge in (0..graph.poses()).flat_map(|k| graph.loops(k)) {
            held.0[edge / 64] &= !(1 << (edge % 64));
        }
        held
    }

    fn insert_all(&mut self, edges: impl IntoIterator<Item = usize>) {
        for edge in edges {
            self.0[edge / 64] |= 1 << (edge % 64);
        }
    }

    fn has(&self, edge: usize) -> bool {
        self.0[edge / 64] >> (edge % 64) & 1 == 1
    }
}

/// Where the time goes.
#[derive(Default)]
struct Cost {
    structure_ms: f64,
    beliefs_ms: f64,
    /// Total when each step began.
    began_ms: Vec<f64>,
    /// Distinct trees at each step.
    trees: Vec<f64>,
    /// Updates, and their work in all.
    updates: f64,
    eliminated: f64,
    relinearised: f64,
    factors: f64,
}

impl Cost {
    fn next_step(&mut self) {
        self.began_ms.push(self.total_ms());
    }

    fn total_ms(&self) -> f64 {
        self.structure_ms + self.beliefs_ms
    }

    /// Does what is to be counted as the particles' own.
    fn beliefs<T>(&mut self, work: impl FnOnce() -> T) -> T {
        let (result, ms) = timed(work);
        self.beliefs_ms += ms;
        result
    }

    fn work(&mut self, work: &Work) {
        self.updates += 1.0;
        self.eliminated += f64::from(work.eliminated);
        self.relinearised += f64::from(work.relinearised);
        self.factors += f64::from(work.factors);
    }

    /// All that is known of the costs; the rest as of no particles.
    fn report(mut self, graph: &Graph, plan: &Plan, rss_mb: Option<f64>) -> Report {
        self.next_step();
        let per_update = |sum: f64| round(sum / self.updates.max(1.0), 1);
        Report {
            peer: "toponym",
            ver: env!("CARGO_PKG_VERSION"),
            pg: graph.name(),
            poses: graph.poses(),
            edges: graph.edges.len(),
            particles: plan.particles,
            accept: plan.accept,
            resample_every: None,
            seed: plan.seed,
            independent: false,
            total_s: round(self.total_ms() / 1e3, 4),
            structure_s: round(self.structure_ms / 1e3, 4),
            beliefs_s: round(self.beliefs_ms / 1e3, 4),
            step: Stats::of(self.began_ms.windows(2).map(|w| w[1] - w[0])),
            distinct_trees: round(mean(self.trees.iter().copied()), 1),
            distinct_trees_end: 0,
            shared_clique_fraction: 0.0,
            chi2_mean: 0.0,
            rss_mb: rss_mb.map(|mb| round(mb, 1)),
            reelim_mean: per_update(self.eliminated),
            relin_mean: per_update(self.relinearised),
            factors_mean: per_update(self.factors),
        }
    }
}
