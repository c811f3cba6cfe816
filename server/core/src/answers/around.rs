//! "What is this?" and "where is the nearest restroom?"

use crate::answers::meaning::alike;
use crate::answers::query::{Candidate, WhatAnswer, WhereAnswer};
use crate::answers::snapshot::Snapshot;
use crate::edge::PlaceId;
use crate::filter::labels::LabelId;
use crate::geometry::Pose2;
use std::collections::BTreeMap;

/// What is called so less likely is not looked for nearby.
const IS_MIN: f64 = 0.2;
/// Names of places so near are told where a point lies in no room.
const NEAR_M: f64 = 4.0;
/// Less likely names are noise.
const NAME_MIN: f64 = 0.02;

impl Snapshot {
    /// What a region may be called, likeliest first.
    pub fn called(&self, region: usize) -> Vec<(String, f64)> {
        let (named, ledger) = (self.named(), self.ledger());
        let mut names: BTreeMap<LabelId, f64> = named.given_names(region, ledger).into_iter().collect();
        names.extend(named.described_names(ledger).map(|(label, which)| (label, which.p[region])));
        let spelled = |(label, p): (LabelId, f64)| (ledger.name(label).to_owned(), p);
        let mut names: Vec<(String, f64)> = names
            .into_iter()
            .filter(|(_, p)| *p >= NAME_MIN)
            .map(spelled)
            .filter(|n| !n.0.is_empty())
            .collect();
        names.sort_by(|a, b| b.1.total_cmp(&a.1).then_with(|| a.0.cmp(&b.0)));
        names
    }

    /// What is at a point of the best graph's map.
    pub fn what(&self, x_m: f64, y_m: f64) -> WhatAnswer {
        let (rooms, at) = (self.rooms(), Pose2::new(x_m, y_m, 0.0));
        let region = rooms.at(x_m, y_m);
        let names = match region {
            Some(r) => self.called(r),
            None => self.called_around(&at, NEAR_M, None),
        };
        WhatAnswer {
            x_m,
            y_m,
            region: region.map(|r| rooms.regions[r].id),
            shape: region.map(|r| rooms.regions[r].shape),
            names: names
                .into_iter()
                .map(|(name, p)| (self.ledger().spelled(&name).to_owned(), name, p))
                .collect(),
            unresolved: self.unresolved(),
        }
    }

    /// What is called so, or is of that kind, by the way there from the robot: `probability` is that it is the nearest
    /// that is so, `p_none` that none is.
    pub fn nearest(&self, text: &str, lang: Option<&str>) -> WhereAnswer {
        let Some(name) = self.asked(text, lang).map(|asked| asked.name) else {
            return WhereAnswer { text: text.to_owned(), ..self.nowhere(None) };
        };
        let asked = WhereAnswer { text: text.to_owned(), ..self.where_named(&name) };
        let mut candidates: BTreeMap<PlaceId, Candidate> = BTreeMap::new();
        let labels = alike(name.as_str(), self.ledger(), &self.known());
        for candidate in labels.into_iter().flat_map(|label| self.candidates_of(label)) {
            let likelier = |known: &Candidate| known.p_is >= candidate.p_is;
            if candidate.p_is >= IS_MIN && !candidates.get(&candidate.place).is_some_and(likelier) {
                candidates.insert(candidate.place, candidate);
            }
        }
        let mut candidates: Vec<Candidate> = candidates.into_values().collect();
        if let Some(robot) = asked.robot {
            let goals: Vec<(f64, f64)> =
                candidates.iter().map(|c| (c.goal.pose.x_m, c.goal.pose.y_m)).collect();
            let walks_m = self.rooms().walks_m((robot.x_m, robot.y_m), &goals);
            candidates.iter_mut().zip(walks_m).for_each(|(c, walk_m)| c.walk_m = walk_m);
        }
        let far_m = |c: &Candidate| c.walk_m.unwrap_or(f64::INFINITY);
        candidates.sort_by(|a, b| {
            far_m(a).total_cmp(&far_m(b)).then(b.p_is.total_cmp(&a.p_is)).then(a.place.cmp(&b.place))
        });
        let mut none = 1.0 - self.unresolved();
        for c in &mut candidates {
            c.probability = none * c.p_is;
            none -= c.probability;
        }
        WhereAnswer { p_none: none + self.unresolved(), candidates, ..asked }
    }

    fn candidates_of(&self, label: LabelId) -> Vec<Candidate> {
        self.found(label).bearers.into_iter().map(|r| self.candidate(label, r)).collect()
    }
}
