//! Step 3 of Algorithm 1: the Dirichlet over labels at every vertex, eq. (12), kept as evidence.
//!
//! The vocabulary is open: a place's concentration over names is what was said of it, plus a total
//! of [`BASE`] spread over everything that might be said. Evidence, not counters, is stored, so
//! that each Δα can be traced to its utterance.

use crate::graph::Vertex;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::sync::Arc;

/// Index of a name in the ledger.
pub type LabelId = u32;

/// Total concentration of the names not said.
const BASE: f64 = 1.0;
/// Concentration against a name that was said: one utterance leaves one doubt in six, as the
/// paper's α = 0.2 does.
const DOUBT: f64 = 0.2;
/// Δα of "this is the gym".
pub const DIRECT: f64 = 1.0;
/// Δα carried over a new edge from a directly labelled vertex.
pub const CARRIED: f64 = 0.5;

/// How a Δα came about.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Source {
    /// Said of the place held.
    Direct,
    /// Said of the place held, and that it is not the one called so before.
    DirectOther,
    /// Grounded by a relation, eqs. (13–16).
    Grounded,
    /// Carried over an edge.
    Carried,
}

/// One Δα.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Evidence {
    /// The utterance, an index into the ledger.
    pub utterance: u32,
    /// The name.
    pub label: LabelId,
    /// The place.
    pub place: Vertex,
    /// Δα.
    pub weight: f64,
    /// Where it comes from.
    pub source: Source,
}

/// L of one particle: all evidence, in the order it came.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct Labels {
    evidence: Arc<Vec<Evidence>>,
}

impl Labels {
    /// Adds a Δα.
    pub fn add(&mut self, e: Evidence) {
        Arc::make_mut(&mut self.evidence).push(e);
    }

    /// All evidence.
    pub fn evidence(&self) -> &[Evidence] {
        &self.evidence
    }

    /// Σ Δα by name at a place.
    pub fn at(&self, place: Vertex) -> BTreeMap<LabelId, f64> {
        let mut sums = BTreeMap::new();
        for e in self.evidence.iter().filter(|e| e.place == place) {
            *sums.entry(e.label).or_insert(0.0) += e.weight;
        }
        sums
    }

    /// Probability that a name applies to each place that has evidence for it.
    pub fn applies(&self, label: LabelId) -> BTreeMap<Vertex, f64> {
        let mut sums: BTreeMap<Vertex, f64> = BTreeMap::new();
        for e in self.evidence.iter().filter(|e| e.label == label) {
            *sums.entry(e.place).or_insert(0.0) += e.weight;
        }
        sums.into_iter().map(|(v, weight)| (v, probability(weight))).collect()
    }

    /// Eqs. (8–9): Σ_l p(l_t = l) p(l_i = l) for every other place i, over the names said (θ
    /// uniform over them).
    pub fn similar(&self, t: Vertex) -> BTreeMap<Vertex, f64> {
        let here: Vec<&Evidence> = self.evidence.iter().filter(|e| e.place == t).collect();
        if here.is_empty() {
            return BTreeMap::new();
        }
        let mut totals: BTreeMap<Vertex, f64> = BTreeMap::new();
        for e in self.evidence.iter() {
            *totals.entry(e.place).or_insert(BASE) += e.weight;
        }
        let total = |v: Vertex| totals.get(&v).copied().unwrap_or(BASE);
        let mut similar = BTreeMap::new();
        for a in &here {
            for b in self.evidence.iter().filter(|b| b.label == a.label && b.place != t) {
                // "Another lobby" is none of those before.
                let other = |later: &Evidence, earlier: &Evidence| {
                    later.source == Source::DirectOther && earlier.utterance < later.utterance
                };
                if a.utterance == b.utterance || other(a, b) || other(b, a) {
                    continue;
                }
                *similar.entry(b.place).or_insert(0.0) += a.weight / total(t) * (b.weight / total(b.place));
            }
        }
        similar
    }

    /// [`Labels::similar`] of one pair.
    pub fn similarity(&self, i: Vertex, t: Vertex) -> f64 {
        self.similar(t).get(&i).copied().unwrap_or(0.0)
    }

    /// A new edge carries each direct label of either end to the other, once per utterance.
    pub fn carry_over(&mut self, i: Vertex, j: Vertex) {
        let carried: Vec<Evidence> = [(i, j), (j, i)]
            .into_iter()
            .flat_map(|(from, to)| {
                self.evidence
                    .iter()
                    .filter(move |e| {
                        e.place == from && matches!(e.source, Source::Direct | Source::DirectOther)
                    })
                    .map(move |e| Evidence { place: to, weight: CARRIED, source: Source::Carried, ..*e })
            })
            .filter(|e| {
                !self.evidence.iter().any(|o| o.utterance == e.utterance && o.source == Source::Carried)
            })
            .collect();
        if !carried.is_empty() {
            Arc::make_mut(&mut self.evidence).extend(carried);
        }
    }
}

/// P(name applies) for a total Δα.
pub fn probability(weight: f64) -> f64 {
    weight / (weight + DOUBT)
}

#[cfg(test)]
#[allow(clippy::float_cmp)]
mod tests {
    use super::*;

    fn said(utterance: u32, label: LabelId, place: Vertex, source: Source) -> Evidence {
        Evidence { utterance, label, place, weight: DIRECT, source }
    }

    #[test]
    fn places_called_alike_are_similar_however_many_names_there_are() {
        let mut l = Labels::default();
        l.add(said(0, 0, 3, Source::Direct));
        l.add(said(1, 0, 90, Source::Direct));
        let before = l.similarity(3, 90);
        for k in 2..150 {
            l.add(said(k, k, 100 + k, Source::Direct));
        }
        assert_eq!(before, l.similarity(3, 90));
        assert!((before - 0.25).abs() < 1e-12);
        assert_eq!(l.similarity(200, 201), 0.0, "unlabelled places have nothing in common");
    }

    #[test]
    fn another_lobby_is_not_the_first_but_may_be_met_again() {
        let mut l = Labels::default();
        l.add(said(0, 0, 3, Source::Direct));
        l.add(said(1, 0, 50, Source::DirectOther));
        l.add(said(2, 0, 90, Source::Direct));
        assert_eq!(l.similarity(3, 50), 0.0);
        assert!(l.similarity(50, 90) > 0.0);
    }

    #[test]
    fn a_label_is_carried_once_per_utterance() {
        let mut l = Labels::default();
        l.add(said(0, 0, 3, Source::Direct));
        l.carry_over(3, 50);
        l.carry_over(3, 51);
        assert_eq!(l.at(50)[&0], CARRIED);
        assert!(l.at(51).is_empty());
    }
}
