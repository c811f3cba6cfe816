//! Step 3 of Algorithm 1: the Dirichlet over labels at every vertex, eq. (12), kept as evidence.
//!
//! Evidence, not counters, is stored, so that each Δα can be traced to its utterance; what it makes probable
//! [`crate::filter::naming`] tells.

use crate::edge::Vertex;
pub use crate::filter::naming::LabelId;
use crate::filter::naming::{Spoken, Tally, alike};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::sync::Arc;

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
    /// Said not to be so; its Δα is negative.
    Denied,
    /// Two places are said to be one; the name is the tie's own: see [`tie`].
    Tied,
}

/// One Δα.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Evidence {
    /// The utterance, an index into the ledger.
    pub utterance: u32,
    /// The name as said.
    pub said: LabelId,
    /// What it means.
    pub label: LabelId,
    /// The place.
    pub place: Vertex,
    /// Δα.
    pub weight: f64,
    /// Where it comes from.
    pub source: Source,
}

impl Evidence {
    /// Of a name that means itself.
    pub fn new(utterance: u32, label: LabelId, place: Vertex, weight: f64, source: Source) -> Self {
        Self { utterance, said: label, label, place, weight, source }
    }
}

/// Adds a Δα to what speaks for its name.
pub fn take_up(spoken: &mut Spoken, e: &Evidence) {
    match e.source {
        Source::Grounded => spoken.undescribed *= 1.0 - e.weight.clamp(0.0, 1.0),
        Source::Denied => spoken.tally.denied -= e.weight,
        _ => spoken.tally.said += e.weight,
    }
}

/// Floor round a place, and how likely something described lies on it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Spot {
    /// The place.
    pub place: Vertex,
    /// The probability.
    pub share: f64,
}

/// L of one particle: all evidence, in the order it came.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct Labels {
    evidence: Arc<Vec<Evidence>>,
    /// By utterance and figure as said: [`Labels::described`].
    described: Arc<BTreeMap<(u32, LabelId), Vec<Spot>>>,
}

impl Labels {
    /// Adds a Δα.
    pub fn add(&mut self, e: Evidence) {
        Arc::make_mut(&mut self.evidence).push(e);
    }

    /// Takes back what an utterance said, what was carried over from it too. Whether there was any.
    pub fn revoke(&mut self, utterance: u32) -> bool {
        if self.described.keys().any(|(u, _)| *u == utterance) {
            Arc::make_mut(&mut self.described).retain(|(u, _), _| *u != utterance);
        }
        self.drop_if(|e| e.utterance == utterance)
    }

    /// Takes back what was said of a name. Whether there was any.
    pub fn forget(&mut self, label: LabelId) -> bool {
        self.drop_if(|e| e.label == label)
    }

    /// Grounds an utterance anew: what it was grounded to before is replaced.
    /// Returns that.
    pub fn reground(&mut self, utterance: u32, grounded: &[Evidence]) -> Vec<Evidence> {
        let of_it = |e: &Evidence| e.utterance == utterance && e.source == Source::Grounded;
        let before: Vec<Evidence> = self.evidence.iter().filter(|e| of_it(e)).copied().collect();
        if before != grounded {
            self.drop_if(of_it);
            Arc::make_mut(&mut self.evidence).extend_from_slice(grounded);
        }
        before
    }

    /// Where the figure of an utterance may lie by what is said of it, eq. (15), whatever it and the floor there are
    /// called; what the shares lack to one is floor not seen yet.
    pub fn described(&self, utterance: u32, figure: LabelId) -> &[Spot] {
        self.described.get(&(utterance, figure)).map_or(&[], Vec::as_slice)
    }

    /// Sets [`Labels::described`].
    pub fn describe(&mut self, utterance: u32, figure: LabelId, spots: Vec<Spot>) {
        if self.described(utterance, figure) != spots {
            Arc::make_mut(&mut self.described).insert((utterance, figure), spots);
        }
    }

    /// Looks up anew what the names mean. Returns the places whose names mean something else now.
    pub fn resolve(&mut self, meant: impl Fn(LabelId) -> LabelId) -> Vec<Vertex> {
        let is_other = |e: &&Evidence| e.label != meant(e.said);
        let others: Vec<Vertex> = self.evidence.iter().filter(is_other).map(|e| e.place).collect();
        if !others.is_empty() {
            for e in Arc::make_mut(&mut self.evidence) {
                e.label = meant(e.said);
            }
        }
        others
    }

    fn drop_if(&mut self, unwanted: impl Fn(&Evidence) -> bool) -> bool {
        let some = self.evidence.iter().any(&unwanted);
        if some {
            Arc::make_mut(&mut self.evidence).retain(|e| !unwanted(e));
        }
        some
    }

    /// All evidence.
    pub fn evidence(&self) -> &[Evidence] {
        &self.evidence
    }

    /// Probability that each name with evidence at a place applies to it.
    pub fn names(&self, place: Vertex) -> BTreeMap<LabelId, f64> {
        let mut sums: BTreeMap<LabelId, Spoken> = BTreeMap::new();
        for e in self.evidence.iter().filter(|e| e.place == place) {
            take_up(sums.entry(e.label).or_default(), e);
        }
        sums.into_iter().map(|(label, spoken)| (label, spoken.applies())).collect()
    }

    /// Probability that a name applies to each place that has evidence for it.
    pub fn applies(&self, label: LabelId) -> BTreeMap<Vertex, f64> {
        self.applies_if(|e| e.label == label)
    }

    /// The same without what one utterance says: what it describes is not its own evidence.
    pub fn applies_by_others(&self, label: LabelId, utterance: u32) -> BTreeMap<Vertex, f64> {
        self.applies_if(|e| e.label == label && e.utterance != utterance)
    }

    fn applies_if(&self, wanted: impl Fn(&Evidence) -> bool) -> BTreeMap<Vertex, f64> {
        let mut sums: BTreeMap<Vertex, Spoken> = BTreeMap::new();
        for e in self.evidence.iter().filter(|e| wanted(e)) {
            take_up(sums.entry(e.place).or_default(), e);
        }
        sums.into_iter().map(|(v, spoken)| (v, spoken.applies())).collect()
    }

    /// Eqs. (8–9): Σ_l p(l_t = l) p(l_i = l) for every other place i, over the names said (θ
    /// uniform over them).
    pub fn similar(&self, t: Vertex) -> BTreeMap<Vertex, f64> {
        let said = || self.evidence.iter().filter(|e| e.source != Source::Denied);
        let here: Vec<&Evidence> = said().filter(|e| e.place == t).collect();
        if here.is_empty() {
            return BTreeMap::new();
        }
        let left = self.left_by_denial();
        let weight = |e: &Evidence| e.weight * left.get(&(e.place, e.label)).copied().unwrap_or(1.0);
        let mut totals: BTreeMap<Vertex, f64> = BTreeMap::new();
        for e in said() {
            *totals.entry(e.place).or_insert(0.0) += weight(e);
        }
        let total = |v: Vertex| totals.get(&v).copied().unwrap_or(0.0);
        let mut similar = BTreeMap::new();
        for a in &here {
            for b in said().filter(|b| b.label == a.label && b.place != t) {
                // "Another lobby" is none of those before.
                let other = |later: &Evidence, earlier: &Evidence| {
                    later.source == Source::DirectOther && earlier.utterance < later.utterance
                };
                let one_place = a.utterance == b.utterance && a.source != Source::Tied;
                if one_place || other(a, b) || other(b, a) {
                    continue;
                }
                *similar.entry(b.place).or_insert(0.0) +=
                    alike(weight(a), total(t), weight(b), total(b.place));
            }
        }
        similar
    }

    /// Share of what was said of a place's name that denial has left, where any was denied.
    fn left_by_denial(&self) -> BTreeMap<(Vertex, LabelId), f64> {
        let key = |e: &Evidence| (e.place, e.label);
        let denied = self.evidence.iter().filter(|e| e.source == Source::Denied);
        let mut tallies: BTreeMap<_, Tally> = denied.map(|e| (key(e), Tally::default())).collect();
        for e in self.evidence.iter() {
            if let Some(tally) = tallies.get_mut(&key(e)) {
                match e.source {
                    Source::Denied => tally.denied -= e.weight,
                    _ => tally.said += e.weight,
                }
            }
        }
        let left = |t: Tally| t.concentration() / t.said.max(f64::MIN_POSITIVE);
        tallies.into_iter().map(|(key, tally)| (key, left(tally))).collect()
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
                    .map(move |e| Evidence {
                        place: to,
                        weight: CARRIED * e.weight,
                        source: Source::Carried,
                        ..*e
                    })
            })
            .filter(|e| {
                !self.evidence.iter().any(|o| o.utterance == e.utterance && o.source == Source::Carried)
            })
            .collect();
        if !carried.is_empty() {
            Arc::make_mut(&mut self.evidence).extend(carried);
        }
    }

    /// Without an edge, what it carried from either end to the other is gone.
    pub fn carry_back(&mut self, i: Vertex, j: Vertex) {
        let direct = |utterance, place| {
            let named = |e: &Evidence| matches!(e.source, Source::Direct | Source::DirectOther);
            self.evidence.iter().any(|e| e.utterance == utterance && e.place == place && named(e))
        };
        let carried = |e: &&Evidence| {
            let from = if e.place == i { j } else { i };
            e.source == Source::Carried && [i, j].contains(&e.place) && direct(e.utterance, from)
        };
        let unwanted: Vec<Evidence> = self.evidence.iter().filter(carried).copied().collect();
        self.drop_if(|e| unwanted.contains(e));
    }
}

/// The name that ties the places of which an utterance says that they are one. Nobody can say it.
pub fn tie(utterance: u32) -> LabelId {
    LabelId::MAX - utterance
}

#[cfg(test)]
#[allow(clippy::float_cmp)]
mod tests {
    use super::*;
    use crate::filter::naming::BASE;

    fn said(utterance: u32, label: LabelId, place: Vertex, source: Source) -> Evidence {
        Evidence::new(utterance, label, place, DIRECT, source)
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
        assert!((before - (1.0 / (1.0 + BASE)).powi(2)).abs() < 1e-12);
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
        assert_eq!(l.names(50)[&0], Tally { said: CARRIED, denied: 0.0 }.told());
        assert!(l.names(51).is_empty());
    }

    #[test]
    fn what_is_taken_back_was_never_said() {
        let mut l = Labels::default();
        l.add(said(0, 0, 3, Source::Direct));
        let before = l.clone();
        l.add(said(1, 0, 50, Source::Direct));
        l.carry_over(50, 80);
        assert!(l.similarity(3, 80) > 0.0);
        assert!(l.revoke(1) && !l.revoke(1));
        assert_eq!(l.evidence(), before.evidence());
    }

    #[test]
    fn a_name_denied_as_often_as_said_does_not_apply() {
        let mut l = Labels::default();
        l.add(said(0, 0, 3, Source::Direct));
        l.add(Evidence::new(1, 0, 3, -DIRECT, Source::Denied));
        assert_eq!(l.applies(0)[&3], 0.0);
        l.add(said(1, 0, 90, Source::Direct));
        assert_eq!(l.similarity(3, 90), 0.0, "nor is it a name in common");
        l.add(said(2, 0, 3, Source::Direct));
        assert!(l.applies(0)[&3] > 0.8);
    }

    #[test]
    fn another_name_counts_as_the_one_it_means_until_it_means_itself() {
        let mut l = Labels::default();
        l.add(said(0, 0, 3, Source::Direct));
        l.add(said(1, 1, 90, Source::Direct));
        l.resolve(|_| 0);
        assert!(l.similarity(3, 90) > 0.0 && l.applies(1).is_empty());
        l.resolve(|said| said);
        assert_eq!(l.applies(1).len(), 1);
    }

    #[test]
    fn places_said_to_be_one_are_similar() {
        let mut l = Labels::default();
        for place in [0, 50] {
            l.add(said(0, tie(0), place, Source::Tied));
            l.add(said(1, 1, place, Source::Direct));
        }
        assert!(l.similarity(0, 50) > 0.1);
        l.revoke(0);
        assert_eq!(l.similarity(0, 50), 0.0, "one sentence names one place");
    }

    #[test]
    fn grounding_anew_replaces_what_was_grounded_before() {
        let mut l = Labels::default();
        l.add(Evidence::new(0, 0, 3, 0.4, Source::Grounded));
        l.add(said(1, 0, 9, Source::Direct));
        l.reground(0, &[Evidence::new(0, 0, 4, 0.7, Source::Grounded)]);
        assert_eq!(l.applies(0).into_keys().collect::<Vec<_>>(), [4, 9]);
    }
}
