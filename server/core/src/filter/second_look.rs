//! Steps 1 and 4 once more, for places that the robot left long ago: where names came late, they may
//! still propose edges; where names were taken back, the revisits that they had led to are judged again.

use crate::config::Rules;
use crate::edge::EdgeKind;
use crate::edge::Proposal;
use crate::edge::Vertex;
use crate::effects::Effects;
use crate::filter::Filter;
use crate::filter::chance::log_looks;
use crate::filter::labels::Evidence;
use crate::filter::loops::{Fit, measure_again};
use crate::filter::particle::Particle;
use crate::filter::propose::{SIMILARITY_MIN, propose_named};
use crate::filter::weigh::judge_alone;
use crate::smoothing::Structure;
use rayon::prelude::*;
use std::collections::{BTreeMap, BTreeSet, VecDeque};

/// Places named anew that wait for their turn; the oldest give way.
const WAITING_MAX: usize = 256;
/// A place that gains so much Δα of a name was named anew; see eq. (9) for what less would propose.
const NAMED_MIN: f64 = 0.1;
/// Pairs of a place looked at again.
const PAIRS_MAX: usize = 2;

impl Filter {
    /// Places whose names have changed wait for a second look. One not left yet needs none: its first is
    /// to come. The paper gives none.
    pub(crate) fn named_anew(&mut self, places: impl IntoIterator<Item = Vertex>) {
        if self.config.rules == Rules::Paper {
            return;
        }
        let left = self.graph.places().len() as Vertex;
        wait(&mut self.named_anew, places.into_iter().filter(|&v| v < left));
    }

    /// All that is left to do when no more comes: descriptions are grounded in the whole map, and what
    /// waits for a second look gets it.
    pub fn finish(&mut self) -> Effects {
        self.reground_all();
        let mut effects = Effects::new();
        while !self.named_anew.is_empty() {
            effects.extend(self.look_again());
        }
        self.rank();
        effects
    }

    /// Looks at the pairs that the names of one place that waits propose by now.
    pub(crate) fn look_again(&mut self) -> Effects {
        let Some(v) = self.named_anew.pop_front() else { return Effects::new() };
        let mut likeliest: BTreeMap<Vertex, f64> = BTreeMap::new();
        let (config, graph) = (&self.config, &self.graph);
        let drawn = |p: &Particle| propose_named(config, graph, p, v);
        for Proposal { i, probability, .. } in self.particles.iter().flat_map(drawn) {
            let known = likeliest.entry(i).or_insert(probability);
            *known = known.max(probability);
        }
        let mut pairs: Vec<(Vertex, f64)> =
            likeliest.into_iter().filter(|(i, _)| !self.tied(*i, v)).collect();
        pairs.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
        let mut effects = Effects::new();
        for &(u, probability) in pairs.iter().take(PAIRS_MAX) {
            let (i, t) = (u.min(v), u.max(v));
            let proposal = Proposal { i, kind: EdgeKind::Semantic, probability };
            let measured = measure_again(&mut self.graph, t, &[proposal]);
            effects.extend(self.weigh_measured(t, measured));
        }
        effects
    }

    /// Whether some particle has an edge between two places: whoever has none has refused it.
    fn tied(&self, a: Vertex, b: Vertex) -> bool {
        let pair = (a.min(b), a.max(b));
        self.particles.iter().any(|p| p.edges.iter().any(|e| (e.i, e.j) == pair))
    }

    /// Pairs whose names led to revisits, and still would.
    pub(crate) fn led_by_names(&self) -> BTreeSet<(Vertex, Vertex)> {
        let of = |p: &Particle| -> BTreeSet<(Vertex, Vertex)> {
            p.edges.iter().filter_map(|e| e.named).filter(|&pair| !unnamed(p, pair)).collect()
        };
        self.particles.iter().flat_map(of).collect()
    }

    /// Judges again the revisits, of those that names led to, whose names were taken back: who would not
    /// have taken the edge for the distance alone gives up all edges of the revisit. Returns how many
    /// revisits some particle gave up. Weights stay: what the scans said they still say.
    pub(crate) fn judge_again(&mut self, led: BTreeSet<(Vertex, Vertex)>) -> usize {
        let doubt = |pair: &(Vertex, Vertex)| self.particles.iter().any(|p| unnamed(p, *pair));
        let doubted: Vec<(Vertex, Vertex)> = led.into_iter().filter(doubt).collect();
        let mut given_up = 0;
        for pair in doubted {
            let kind = EdgeKind::Distance;
            let fits =
                measure_again(&mut self.graph, pair.1, &[Proposal { i: pair.0, kind, probability: 0.0 }])
                    .fits;
            let (structure, gamma_per_m2) = (&self.structure, self.config.gamma_per_m2);
            let again = |p: &Particle| {
                if unnamed(p, pair) { without(p, structure, pair, &fits, gamma_per_m2) } else { None }
            };
            let again: Vec<Option<Particle>> = self.particles.par_iter().map(again).collect();
            given_up += usize::from(again.iter().any(Option::is_some));
            for (p, again) in self.particles.iter_mut().zip(again) {
                let Some(again) = again else { continue };
                let kept: BTreeSet<_> = again.edges.iter().map(|e| e.factor).collect();
                self.disputed.extend(p.edges.iter().map(|e| e.factor).filter(|f| !kept.contains(f)));
                *p = again;
            }
        }
        self.disputed.sort_unstable();
        self.disputed.dedup();
        self.forget();
        given_up
    }
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
pub(crate) fn gained(before: &[Evidence], after: &[Evidence]) -> Vec<Vertex> {
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
        let fit = Fit::supported_by(0, mode, EdgeKind::Semantic, 3);
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
