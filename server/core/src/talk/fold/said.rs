//! What was said and stands, as names of places.

use crate::edge::Vertex;
use crate::filter::labels::LabelId;
use crate::filter::naming::{BASE, Tally};
use crate::language::act::Sameness;
use crate::talk::Talk;
use crate::talk::claims::{Claim, Claims, Testimony};
use std::collections::BTreeMap;

/// What an utterance says of a name at a place: at most one in all its readings.
#[derive(Clone, Copy)]
pub(super) struct Units {
    /// Where.
    pub place: Vertex,
    /// What it means.
    pub label: LabelId,
    /// How.
    pub told: Told,
}

/// What is told of a name at a place.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Told {
    /// What was said outright.
    pub tally: Tally,
    /// Probability that what is described so is there.
    pub described: f64,
}

impl Told {
    /// Adds a share of another.
    pub(super) fn add(&mut self, other: Self, share: f64) {
        self.tally.add(other.tally, share);
        self.described += share * other.described;
    }
}

impl Talk {
    /// What was not taken back, and what it says of names.
    pub(super) fn standing(&self) -> Vec<(&Testimony, Vec<Units>)> {
        let stands = |u: u32| self.ledger.entries().get(u as usize).is_some_and(|e| e.stands);
        self.testimonies.iter().filter(|t| stands(t.utterance)).map(|t| (t, self.units(t))).collect()
    }

    /// What a name as said in an utterance means, unless it was forgotten since.
    pub(super) fn meant(&self, utterance: u32, said: LabelId) -> Option<LabelId> {
        let label = self.ledger.meant(said);
        self.ledger.speaks_of(utterance, label).then_some(label)
    }

    /// Names of rooms that an utterance speaks of.
    pub(super) fn names(&self, testimony: &Testimony) -> impl Iterator<Item = LabelId> {
        let claims = testimony.readings.iter().flat_map(|r| &r.claims);
        let said = claims.filter_map(|(_, claim)| claim.name());
        said.filter_map(|said| self.meant(testimony.utterance, said))
            .filter(|&label| !self.ledger.is_way(label))
    }

    /// What an utterance locates: with what probability, what name that means, and as said.
    pub(super) fn described(&self, testimony: &Testimony) -> impl Iterator<Item = (f64, LabelId, LabelId)> {
        let of = |r: &Claims| {
            let located = |&(certainty, claim): &(f64, Claim)| match claim {
                Claim::Located { said } => Some((certainty, said)),
                _ => None,
            };
            r.claims.iter().filter_map(located).map(|(p, said)| (r.weight * p, said)).collect::<Vec<_>>()
        };
        let mut by_name: BTreeMap<LabelId, f64> = BTreeMap::new();
        for (p, said) in testimony.readings.iter().flat_map(of) {
            *by_name.entry(said).or_default() += p;
        }
        let meant =
            move |(said, p): (LabelId, f64)| Some((p.min(1.0), self.meant(testimony.utterance, said)?, said));
        by_name.into_iter().filter_map(meant)
    }

    /// How often an utterance tells of something that bears each name. "The gym again" tells of none that was not told of.
    pub(super) fn said(&self, testimony: &Testimony) -> Vec<(LabelId, f64)> {
        let mut times: BTreeMap<LabelId, f64> = BTreeMap::new();
        for Claims { weight, claims } in &testimony.readings {
            for &(certainty, claim) in claims {
                let said = match claim {
                    Claim::Called { again: Sameness::Same, .. } => continue,
                    Claim::Called { said, .. } | Claim::Located { said } => said,
                    _ => continue,
                };
                if let Some(label) = self.meant(testimony.utterance, said) {
                    *times.entry(label).or_default() += weight * certainty;
                }
            }
        }
        times.into_iter().map(|(label, times)| (label, times.min(1.0))).collect()
    }

    fn units(&self, testimony: &Testimony) -> Vec<Units> {
        let mut units: Vec<Units> = Vec::new();
        for Claims { weight, claims } in &testimony.readings {
            for &(certainty, claim) in claims {
                let one = weight * certainty;
                let (place, said, tally) = match claim {
                    Claim::Called { place, said, .. } => (place, said, Tally { said: one, denied: 0.0 }),
                    Claim::Denied { place, said } => (place, said, Tally { said: 0.0, denied: one }),
                    _ => continue,
                };
                let Some(label) = self.meant(testimony.utterance, said) else { continue };
                let told = Told { tally, described: 0.0 };
                match units.iter_mut().find(|u| (u.place, u.label) == (place, label)) {
                    Some(known) => known.told.add(told, 1.0),
                    None => units.push(Units { place, label, told }),
                }
            }
        }
        for Units { told: Told { tally, .. }, .. } in &mut units {
            *tally = Tally { said: tally.said.min(1.0), denied: tally.denied.min(1.0) };
        }
        units
    }
}

/// The evidence joined with one place, by name.
pub(super) struct Joined {
    /// What is told, by name.
    pub of: Vec<Told>,
    /// Names with any.
    pub names: Vec<LabelId>,
}

impl Joined {
    pub(super) fn of(names: usize) -> Self {
        Self { of: vec![Told::default(); names], names: Vec::new() }
    }

    pub(super) fn clear(&mut self) {
        for &label in &self.names {
            self.of[label as usize] = Told::default();
        }
        self.names.clear();
    }

    pub(super) fn add(&mut self, label: LabelId, told: Told, share: f64) {
        let known = &mut self.of[label as usize];
        if *known == Told::default() {
            self.names.push(label);
        }
        known.add(told, share);
    }

    /// Σ_k (α_k + α₀ p₀(k) f_k) over the names of one class.
    pub(super) fn total(&self, is_of_class: impl Fn(LabelId) -> bool, p0: impl Fn(LabelId) -> f64) -> f64 {
        let of = |&label: &LabelId| {
            let tally = self.of[label as usize].tally;
            let left = tally.left();
            let denied = if left < 1.0 { BASE * p0(label) * (1.0 - left) } else { 0.0 };
            tally.concentration() - denied
        };
        BASE + self.names.iter().filter(|&&label| is_of_class(label)).map(of).sum::<f64>()
    }
}
