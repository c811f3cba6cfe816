//! p(λ | G): all claims folded in the order said, over one particle's map. A pure function of ledger, poses
//! and how well the descriptions fit there.
//!
//! Names come first, each given those before it ([`crate::filter::naming`]); descriptions are given all names, so
//! nothing is told twice. Readings are alternatives, and so are the claim and its being said of nothing:
//!
//! ```text
//! log p(λ_n | G, λ_<n) − log p₀ = log( Σ_r w_r Π_c (q_c ratio_c + 1 − q_c) + 1 − Σ_r w_r )
//! ```

use crate::edge::Vertex;
use crate::filter::floors::Floors;
use crate::filter::labels::LabelId;
use crate::filter::naming::{
    BASE, BaseMeasure, Near, REACH_M, Site, Support, Tally, share, share_between, unless_false,
};
use crate::filter::particle::Particle;
use crate::geometry::Pose2;
use crate::graph::stretches::Stretch;
use crate::language::act::Sameness;
use crate::talk::Talk;
use crate::talk::claims::{Claim, Claims, Testimony};
use std::collections::{BTreeMap, BTreeSet};
use std::f64::consts::TAU;

/// How often two places spoken of lie in one room by chance: a room of some floor.
const ONE_BY_CHANCE: f64 = 1.0 / 30.0;
/// "The hallway again" and "back in the lobby" mean another of the kind so often.
const OF_ITS_KIND: [f64; 2] = [0.9, 0.3];
/// How often a place has been seen before when somebody speaks of it.
const VISITED_BY_CHANCE: f64 = 0.3;
/// Who comes back over floor that was talked about introduces so much less than on new floor: assumed, not learned.
const INTRODUCED_AGAIN: f64 = 0.5;
/// Talk is about floor so far around.
const TALKED_ABOUT_M: f64 = 10.0;
/// Places so far back along the path are no visit before.
const VISITED_BACK: Vertex = 12;
/// Sentences that are weighed anew in each map; what was said before them is taken as said, so that the time for one more
/// is bounded.
const WEIGHED_MAX: usize = 1000;
/// Floor on which a robot may be, when somebody points out where it is: a building's.
const SITE_M2: f64 = 5000.0;
/// Two successive places are hardly farther apart.
const SPACING_MAX_M: f64 = 2.0;

/// log p(λ_1 … λ_n | G, X, L), relative to sentences that say nothing; `vague` stretches part the map.
pub fn log_likelihood(talk: &Talk, vague: &[&Stretch], particle: &Particle) -> f64 {
    let standing = talk.standing();
    if standing.is_empty() {
        return 0.0;
    }
    let mut fold = Fold::new(talk, Floors::of(vague, particle), particle, &standing);
    let (old, new) = standing.split_at(standing.len().saturating_sub(WEIGHED_MAX));
    for (t, units) in old {
        fold.hear(t, units);
    }
    let log_ratios = new.iter().map(|(t, units)| {
        let ratio = fold.ratio(t, units) * fold.introduced(t);
        fold.hear(t, units);
        ratio.ln()
    });
    log_ratios.sum()
}

/// What an utterance says of a name at a place: at most one in all its readings.
#[derive(Clone, Copy)]
struct Units {
    place: Vertex,
    label: LabelId,
    tally: Tally,
}

impl Talk {
    /// What was not taken back, and what it says of names.
    fn standing(&self) -> Vec<(&Testimony, Vec<Units>)> {
        let stands = |u: u32| self.ledger.entries().get(u as usize).is_some_and(|e| e.stands);
        self.testimonies.iter().filter(|t| stands(t.utterance)).map(|t| (t, self.units(t))).collect()
    }

    /// What a name as said in an utterance means, unless it was forgotten since.
    fn meant(&self, utterance: u32, said: LabelId) -> Option<LabelId> {
        let label = self.ledger.meant(said);
        self.ledger.speaks_of(utterance, label).then_some(label)
    }

    /// Names of rooms that an utterance speaks of.
    fn names(&self, testimony: &Testimony) -> impl Iterator<Item = LabelId> {
        let claims = testimony.readings.iter().flat_map(|r| &r.claims);
        let said = claims.filter_map(|(_, claim)| claim.name());
        said.filter_map(|said| self.meant(testimony.utterance, said))
            .filter(|&label| !self.ledger.is_way(label))
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
                match units.iter_mut().find(|u| (u.place, u.label) == (place, label)) {
                    Some(known) => known.tally.add(tally, 1.0),
                    None => units.push(Units { place, label, tally }),
                }
            }
        }
        for Units { tally, .. } in &mut units {
            *tally = Tally { said: tally.said.min(1.0), denied: tally.denied.min(1.0) };
        }
        units
    }
}

/// The evidence joined with one place, by name.
struct Joined {
    of: Vec<Tally>,
    /// Names with any.
    names: Vec<LabelId>,
}

impl Joined {
    fn of(names: usize) -> Self {
        Self { of: vec![Tally::default(); names], names: Vec::new() }
    }

    fn clear(&mut self) {
        for &label in &self.names {
            self.of[label as usize] = Tally::default();
        }
        self.names.clear();
    }

    fn add(&mut self, label: LabelId, tally: Tally, share: f64) {
        let known = &mut self.of[label as usize];
        if *known == Tally::default() {
            self.names.push(label);
        }
        known.add(tally, share);
    }

    /// Σ_k (α_k + α₀ p₀(k) f_k) over the names of one class.
    fn total(&self, is_of_class: impl Fn(LabelId) -> bool, p0: impl Fn(LabelId) -> f64) -> f64 {
        let of = |&label: &LabelId| {
            let tally = self.of[label as usize];
            let left = tally.left();
            let denied = if left < 1.0 { BASE * p0(label) * (1.0 - left) } else { 0.0 };
            tally.concentration() - denied
        };
        BASE + self.names.iter().filter(|&&label| is_of_class(label)).map(of).sum::<f64>()
    }
}

/// What was said so far, over one particle's map.
struct Fold<'a> {
    talk: &'a Talk,
    floors: Floors,
    particle: &'a Particle,
    base: BaseMeasure,
    /// Sites by place.
    numbers: BTreeMap<Vertex, usize>,
    near: Near,
    /// What was said of each site so far.
    told: Vec<Vec<(LabelId, Tally)>>,
    joined: Joined,
    /// Names that were spoken of so far, and where.
    mentioned: BTreeSet<LabelId>,
    spoken_at: BTreeSet<Vertex>,
}

impl<'a> Fold<'a> {
    /// Nothing heard yet, but p₀ known of all that will be.
    fn new(
        talk: &'a Talk,
        floors: Floors,
        particle: &'a Particle,
        standing: &[(&Testimony, Vec<Units>)],
    ) -> Self {
        let names = talk.ledger.names().len();
        let mut base =
            BaseMeasure::new((0..names as LabelId).map(|label| talk.ledger.is_way(label)).collect());
        let (mut numbers, mut sites) = (BTreeMap::new(), Vec::new());
        for units in standing.iter().flat_map(|(_, units)| units) {
            base.count(units.label, units.tally.said);
            if let Some(site) = site(talk, &floors, particle, units.place) {
                numbers.entry(units.place).or_insert_with(|| {
                    sites.push(site);
                    sites.len() - 1
                });
            }
        }
        let told = vec![Vec::new(); sites.len()];
        Self {
            talk,
            floors,
            particle,
            base,
            numbers,
            near: Near::new(sites),
            told,
            joined: Joined::of(names),
            mentioned: BTreeSet::new(),
            spoken_at: BTreeSet::new(),
        }
    }

    fn hear(&mut self, testimony: &Testimony, units: &[Units]) {
        self.mentioned.extend(self.talk.names(testimony));
        if testimony.is_pose() {
            return;
        }
        self.spoken_at.insert(self.talk.ledger.entries()[testimony.utterance as usize].held);
        for Units { place, label, tally } in units {
            let Some(&site) = self.numbers.get(place) else { continue };
            if self.told[site].is_empty() {
                self.near.tell(site);
            }
            match self.told[site].iter_mut().find(|(l, _)| l == label) {
                Some((_, known)) => known.add(*tally, 1.0),
                None => self.told[site].push((*label, *tally)),
            }
        }
    }

    /// p(λ | G, λ before) over that of a sentence that says nothing.
    fn ratio(&mut self, testimony: &Testimony, units: &[Units]) -> f64 {
        let own: Vec<(LabelId, f64)> = units.iter().map(|u| (u.label, u.tally.said)).collect();
        let (mut ratio, mut rest) = (0.0, 1.0);
        for Claims { weight, claims } in &testimony.readings {
            let each = |&(certainty, claim): &(f64, Claim)| {
                let certainty = certainty.clamp(0.0, 1.0);
                certainty * self.of_claim(testimony.utterance, claim, &own) + 1.0 - certainty
            };
            ratio += weight * claims.iter().map(each).product::<f64>();
            rest -= weight;
        }
        ratio + rest.max(0.0)
    }

    /// Names that nobody spoke of before are for floor where nobody spoke before. A way that was driven in silence is
    /// no such floor.
    fn introduced(&self, testimony: &Testimony) -> f64 {
        let is_first = self.mentioned.is_empty();
        let held = self.talk.ledger.entries()[testimony.utterance as usize].held;
        if is_first || self.talk.names(testimony).all(|label| self.mentioned.contains(&label)) {
            return 1.0;
        }
        let at = |v: Vertex| site(self.talk, &self.floors, self.particle, v);
        let Some(here) = at(held) else { return 1.0 };
        let before = self.spoken_at.iter().filter(|&&v| v + VISITED_BACK < held).filter_map(|&v| at(v));
        let near = before.filter(|s| s.floor == here.floor).map(|s| s.pose.distance_m(&here.pose));
        let off = near.fold(f64::INFINITY, f64::min) / TALKED_ABOUT_M;
        1.0 - (-0.5 * off * off).exp() * (1.0 - INTRODUCED_AGAIN)
    }

    fn of_claim(&mut self, utterance: u32, claim: Claim, own: &[(LabelId, f64)]) -> f64 {
        match claim {
            Claim::Called { place, said, again } => self.called(utterance, (place, said), again, own),
            Claim::Denied { place, said } => self.denied(utterance, (place, said)),
            Claim::One { a, b, same } => self.one(a, b, same),
            Claim::Visited { place, before } => self.visited(place, before),
            Claim::At { place, map_from_place, sigma } => self.at(place, &map_from_place, sigma),
            Claim::Located { said } => match self.talk.meant(utterance, said) {
                Some(_) => unless_false(self.particle.labels.described(utterance, said)),
                None => 1.0,
            },
        }
    }

    /// "This is the gym", by what was said before of what is near.
    fn called(
        &mut self,
        utterance: u32,
        (place, said): (Vertex, LabelId),
        again: Sameness,
        own: &[(LabelId, f64)],
    ) -> f64 {
        let Some(label) = self.talk.meant(utterance, said) else { return 1.0 };
        self.join(place);
        let (base, joined) = (&self.base, &self.joined);
        let p0 = |l: LabelId| base.probability(l, own);
        let tally = joined.of[label as usize];
        let is_way = base.is_way(label);
        let total = joined.total(|l| base.is_way(l) == is_way, p0);
        match again {
            Sameness::Open => {
                let predicted = tally.concentration() + BASE * p0(label) * tally.left();
                unless_false(predicted / total / p0(label))
            }
            // "Back in the lobby": it was called so before.
            Sameness::Same => {
                let called_so = tally.concentration() / total / p0(label);
                let open = called_so + BASE * tally.left() / total;
                let kind = OF_ITS_KIND[usize::from(!is_way)];
                unless_false(kind * open + (1.0 - kind) * called_so)
            }
            // "Another lobby": it was not.
            Sameness::Other => unless_false(1.0 - tally.applies()),
        }
    }

    /// "This is not the gym".
    fn denied(&mut self, utterance: u32, (place, said): (Vertex, LabelId)) -> f64 {
        let Some(label) = self.talk.meant(utterance, said) else { return 1.0 };
        self.join(place);
        unless_false(1.0 - self.joined.of[label as usize].applies())
    }

    /// Gathers what was said of a place and those near.
    fn join(&mut self, place: Vertex) {
        let Self { numbers, near, told, joined, .. } = self;
        joined.clear();
        if let Some(&site) = numbers.get(&place) {
            near.joined(site, |k, share| {
                told[k].iter().for_each(|&(label, tally)| joined.add(label, tally, share));
            });
        }
    }

    /// "This is where we started": density of lying in one room, over that of any two places.
    fn one(&self, a: Vertex, b: Vertex, same: bool) -> f64 {
        let at = |v| site(self.talk, &self.floors, self.particle, v);
        let (Some(a), Some(b)) = (at(a), at(b)) else { return 1.0 };
        so(share_between(&a, &b), ONE_BY_CHANCE, same)
    }

    /// "The robot is here": its density there, over that anywhere in the building. What nothing ties to where the map
    /// began may be anywhere.
    fn at(&self, place: Vertex, told: &Pose2, [sigma_m, sigma_rad]: [f64; 2]) -> f64 {
        let site = site(self.talk, &self.floors, self.particle, place);
        let Some(here) = site.filter(|site| site.floor == self.floors.floor(0)) else { return 1.0 };
        let (off_m, turned_rad) = (told.distance_m(&here.pose), told.between(&here.pose).yaw_rad);
        let d2 = (off_m / sigma_m).powi(2) + (turned_rad / sigma_rad).powi(2);
        let peak = SITE_M2 / (TAU * sigma_m * sigma_m) * (TAU.sqrt() / sigma_rad);
        unless_false(peak * (-0.5 * d2).exp())
    }

    /// "We have been here before".
    fn visited(&self, place: Vertex, before: bool) -> f64 {
        let Some(here) = site(self.talk, &self.floors, self.particle, place) else { return 1.0 };
        so(share(self.nearest_m(place, &here)), VISITED_BY_CHANCE, before)
    }

    /// How near the path came before on the same floor, up to some metres before the place. Far stretches are
    /// skipped: a path is no shorter than the straight line.
    fn nearest_m(&self, place: Vertex, here: &Site) -> f64 {
        let (belief, ends) = (&self.particle.belief, &self.floors.ends);
        let end = place.saturating_sub(VISITED_BACK).min(belief.len() as Vertex);
        let (mut v, mut nearest_m) = (0, f64::INFINITY);
        while v < end {
            let part = self.floors.part(v);
            if self.floors.floor(part) != here.floor {
                v = ends.get(part).map_or(end, |&next| next);
                continue;
            }
            let distance_m = belief.pose(v).distance_m(&here.pose);
            nearest_m = nearest_m.min(distance_m);
            v += (((distance_m - nearest_m.min(REACH_M)) / SPACING_MAX_M) as Vertex).max(1);
        }
        nearest_m
    }
}

/// A place in a particle's map.
fn site(talk: &Talk, floors: &Floors, particle: &Particle, v: Vertex) -> Option<Site> {
    let pose = talk.testimonies.pose(particle, v)?;
    let part = talk.testimonies.part(particle, &floors.ends, v);
    let drift_m2 = floors.drift_m2[part.min(floors.ends.len())];
    Some(Site { pose, floor: floors.floor(part), dark: talk.testimonies.is_dark(v), drift_m2 })
}

/// What a yes or no says where the truth is `is`, and is so `by_chance`.
fn so(is: f64, by_chance: f64, said: bool) -> f64 {
    unless_false(if said { is / by_chance } else { (1.0 - is) / (1.0 - by_chance) })
}

#[cfg(test)]
mod tests;
