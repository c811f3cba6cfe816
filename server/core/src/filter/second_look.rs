//! Step 1 once more, for places that the robot left long ago: where names came late, they may still propose
//! edges.

use crate::config::Config;
use crate::edge::{EdgeKind, Proposal, Vertex};
use crate::filter::labels::Evidence;
use crate::filter::particle::Particle;
use crate::filter::propose::propose_named;
use crate::graph::Graph;
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, VecDeque};

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

/// Each waits once, and not too many.
fn wait(waiting: &mut VecDeque<Vertex>, places: impl Iterator<Item = Vertex>) {
    for v in places {
        if !waiting.contains(&v) {
            waiting.push_back(v);
        }
    }
    waiting.drain(..waiting.len().saturating_sub(WAITING_MAX));
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
    use crate::filter::labels::{Labels, Source};

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
