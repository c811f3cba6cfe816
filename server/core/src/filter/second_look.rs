//! Steps 1 and 4 once more, for places that the robot left long ago: where names came late, they may
//! still propose edges; where names were taken back, the revisits that they had led to are judged again.

use crate::config::Config;
use crate::edge::{EdgeKind, Proposal, Vertex};
use crate::filter::chance::log_looks;
use crate::filter::labels::Evidence;
use crate::filter::loops::{Fit, measure_again};
use crate::filter::particle::Particle;
use crate::filter::propose::{SIMILARITY_MIN, propose_named};
use crate::filter::weigh::judge_alone;
use crate::graph::Graph;
use crate::smoothing::{FactorId, Structure};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, BTreeSet, VecDeque};

/// Places named anew that wait for their turn; the oldest give way.
const WAITING_MAX: usize = 256;
/// A place that gains so much Δα of a name was named anew; see eq. (9) for what less would propose.
const NAMED_MIN: f64 = 0.1;
/// Pairs of a place looked at again.
const PAIRS_MAX: usize = 2;

/// Places named anew since they were left, oldest first.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct SecondLooks {
    waiting: VecDeque<Vertex>,
}

impl SecondLooks {
    /// These wait for a second look.
    pub fn wait(&mut self, places: impl IntoIterator<Item = Vertex>) {
        wait(&mut self.waiting, places.into_iter());
    }

    /// The next one whose turn it is.
    pub fn next(&mut self) -> Option<Vertex> {
        self.waiting.pop_front()
    }
}

/// The pairs that the names of a place propose by now and nobody has an edge of, likeliest first: the
/// newer place of each, and what to look at from there.
pub fn pairs(config: &Config, graph: &Graph, particles: &[Particle], v: Vertex) -> Vec<(Vertex, Proposal)> {
    let mut likeliest: BTreeMap<Vertex, f64> = BTreeMap::new();
    let drawn = |p: &Particle| propose_named(config, graph, p, v);
    for Proposal { i, probability, .. } in particles.iter().flat_map(drawn) {
        let known = likeliest.entry(i).or_insert(probability);
        *known = known.max(probability);
    }
    let mut pairs: Vec<(Vertex, f64)> =
        likeliest.into_iter().filter(|(i, _)| !tied(particles, *i, v)).collect();
    pairs.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
    let proposal = |(u, probability): (Vertex, f64)| {
        (u.max(v), Proposal { i: u.min(v), kind: EdgeKind::Semantic, probability })
    };
    pairs.into_iter().take(PAIRS_MAX).map(proposal).collect()
}

/// Whether some particle has an edge between two places: whoever has none has refused it.
fn tied(particles: &[Particle], a: Vertex, b: Vertex) -> bool {
    let pair = (a.min(b), a.max(b));
    particles.iter().any(|p| p.edges.iter().any(|e| (e.i, e.j) == pair))
}

/// Pairs whose names led to revisits, and still would.
pub fn led_by_names(particles: &[Particle]) -> BTreeSet<(Vertex, Vertex)> {
    let of = |p: &Particle| -> BTreeSet<(Vertex, Vertex)> {
        p.edges.iter().filter_map(|e| e.named).filter(|&pair| !unnamed(p, pair)).collect()
    };
    particles.iter().flat_map(of).collect()
}

/// What judging again has changed.
pub struct GivenUp {
    /// Revisits that some particle gave up.
    pub revisits: usize,
    /// Factors that not all particles hold any more.
    pub disputed: Vec<FactorId>,
}

/// Judges again the revisits, of those that names led to, whose names were taken back: who would not have
/// taken the edge for the distance alone gives up all edges of the revisit. Weights stay: what the scans
/// said they still say.
pub fn judge_again(
    particles: &mut [Particle],
    graph: &mut Graph,
    structure: &Structure,
    gamma_per_m2: f64,
    led: BTreeSet<(Vertex, Vertex)>,
) -> GivenUp {
    let doubt = |pair: &(Vertex, Vertex)| particles.iter().any(|p| unnamed(p, *pair));
    let doubted: Vec<(Vertex, Vertex)> = led.into_iter().filter(doubt).collect();
    let mut given_up = GivenUp { revisits: 0, disputed: Vec::new() };
    for pair in doubted {
        let proposal = Proposal { i: pair.0, kind: EdgeKind::Distance, probability: 0.0 };
        let fits = measure_again(graph, pair.1, &[proposal]).fits;
        let again = |p: &Particle| {
            if unnamed(p, pair) { without(p, structure, pair, &fits, gamma_per_m2) } else { None }
        };
        let again: Vec<Option<Particle>> = particles.par_iter().map(again).collect();
        given_up.revisits += usize::from(again.iter().any(Option::is_some));
        for (p, again) in particles.iter_mut().zip(again) {
            let Some(again) = again else { continue };
            let kept: BTreeSet<_> = again.edges.iter().map(|e| e.factor).collect();
            given_up.disputed.extend(p.edges.iter().map(|e| e.factor).filter(|f| !kept.contains(f)));
            *p = again;
        }
    }
    given_up
}

/// Each waits once, and not too many.
fn wait(waiting: &mut VecDeque<Vertex>, places: impl Iterator<Item = Vertex>) {
    for v in places {
        if !waiting.contains(&v) {
            waiting.push_back(v);
        }
    }
    waiting.drain(..waiting.len().saturating_sub(WAITING_MAX));
}

/// Whether the names of a pair would not propose an edge.
fn unnamed(p: &Particle, (i, j): (Vertex, Vertex)) -> bool {
    p.labels.similarity(i, j) < SIMILARITY_MIN
}

/// The particle without the edges of a revisit, if it would not take it by the distance alone.
fn without(
    particle: &Particle,
    structure: &Structure,
    pair: (Vertex, Vertex),
    fits: &[Fit],
    gamma_per_m2: f64,
) -> Option<Particle> {
    if particle.edges.iter().all(|e| e.named != Some(pair)) {
        return None;
    }
    let mut without = particle.clone();
    without.give_up(|e| e.named == Some(pair));
    without.update(structure).ok()?;
    let would = |fit: &Fit| {
        let log_looks = log_looks(fit, fits.len());
        judge_alone(structure, &without, fit, pair.1, log_looks, gamma_per_m2)
            .is_some_and(|j| j.posterior > 0.5)
    };
    (!fits.iter().any(would)).then_some(without)
}

/// The places at which an utterance says more of a name than before.
pub fn gained(before: &[Evidence], after: &[Evidence]) -> Vec<Vertex> {
    let was = |e: &Evidence| {
        before.iter().filter(|b| (b.place, b.label) == (e.place, e.label)).map(|b| b.weight).sum::<f64>()
    };
    after.iter().filter(|e| e.weight > NAMED_MIN && e.weight - was(e) > NAMED_MIN).map(|e| e.place).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::filter::decide::add_edge;
    use crate::filter::labels::{Labels, Source};
    use crate::geometry::Pose2;
    use crate::scan::matching::Mode;
    use nalgebra::{Matrix3, Vector3};

    /// A chain of 21 places 1 m apart and a fit of its ends at `x_m`, taken because both were called alike.
    fn tied(x_m: f64) -> (Structure, Particle, Fit) {
        let (mut structure, mut p) = (Structure::new(), Particle::empty(10));
        for _ in 0..21 {
            let information = Matrix3::from_diagonal(&Vector3::new(100.0, 100.0, 1e6));
            structure.add_pose(Pose2::new(1.0, 0.0, 0.0), &information).unwrap();
        }
        structure.arrange();
        for (utterance, place) in [(0, 0), (1, 20)] {
            p.labels.add(Evidence::new(utterance, 7, place, 1.0, Source::Direct));
        }
        p.update(&structure).unwrap();
        let covariance = Matrix3::from_diagonal(&Vector3::new(4e-4, 4e-4, 1.6e-5));
        let mode = Mode { i_from_j: Pose2::new(x_m, 0.0, 0.0), covariance, score: 0.9, overlap: 0.6 };
        let mut fit = Fit::supported_by(0, mode, EdgeKind::Semantic, 3);
        fit.named = Some((0, 20));
        p.take(add_edge(&mut structure, &fit, 0, 20).unwrap());
        p.update(&structure).unwrap();
        (structure, p, fit)
    }

    #[test]
    fn a_revisit_that_names_led_to_stays_only_if_it_is_where_the_map_expects_it() {
        let (structure, p, fit) = tied(20.1);
        assert!(without(&p, &structure, (0, 20), std::slice::from_ref(&fit), 0.2).is_none());
        assert!(without(&p, &structure, (0, 19), &[], 0.2).is_none(), "of other names");
        let (structure, p, fit) = tied(16.0);
        let again = without(&p, &structure, (0, 20), &[fit], 0.2).unwrap();
        assert!(again.edges.is_empty() && (again.belief.pose(20).x_m - 20.0).abs() < 1e-6);
        assert!((p.belief.pose(20).x_m - 16.0).abs() < 0.2);
    }

    #[test]
    fn what_an_edge_carried_goes_with_it() {
        let mut labels = Labels::default();
        labels.add(Evidence::new(0, 7, 3, 1.0, Source::Direct));
        let before = labels.clone();
        labels.carry_over(3, 50);
        labels.add(Evidence::new(1, 8, 60, 1.0, Source::Direct));
        labels.carry_back(60, 61);
        assert_eq!(labels.evidence().len(), 3);
        labels.carry_back(3, 50);
        labels.revoke(1);
        assert_eq!(labels.evidence(), before.evidence());
    }

    #[test]
    fn few_wait_for_a_second_look_and_none_twice() {
        let mut waiting = VecDeque::from([3]);
        wait(&mut waiting, [3, 4].into_iter());
        assert_eq!(waiting, [3, 4]);
        wait(&mut waiting, 10..1000);
        assert_eq!((waiting.len(), waiting.back()), (WAITING_MAX, Some(&999)));
    }

    #[test]
    fn a_place_is_named_anew_where_a_description_gains_much() {
        let grounded = |place, weight| Evidence::new(0, 7, place, weight, Source::Grounded);
        let (before, after) =
            ([grounded(1, 0.3), grounded(2, 0.1)], [grounded(1, 0.35), grounded(2, 0.5), grounded(3, 0.05)]);
        assert_eq!(gained(&before, &after), [2]);
    }
}
