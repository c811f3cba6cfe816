//! p(λ | G): all claims folded in the order said, over one particle's map. A pure function of ledger, poses
//! and where descriptions are grounded there.
//!
//! Each is given those before it, names and descriptions by one model ([`crate::filter::naming`]): what is described
//! is called so where it lies, on floor i with probability s_i, eq. (15), or on floor not seen yet, which may be called
//! anything. So a description speaks for maps that have what is called so there, and against such as have all
//! floor there called otherwise. Readings are alternatives, and so are the claim and its being said of nothing:
//!
//! ```text
//! log p(λ_n | G, λ_<n) − log p₀ = log( Σ_r w_r Π_c (q_c ratio_c + 1 − q_c) + 1 − Σ_r w_r )
//! ratio(described l)            = (1 − ε) (Σ_i s_i p(l | λ_<n at i) / p₀(l) + 1 − Σ_i s_i) + ε
//! ```
//!
//! Where l was spoken of before and is no name that many rooms bear, what is new in it, and floor not seen, counts
//! [`OF_ITS_KIND`]: "the gym" is mostly that one.
//! What is said without "again" counts [`UNMARKED`] where it was told of: who knows that it was says so the other times.

mod map;
mod said;

use self::map::{Map, VISITED_BACK};
use self::said::{Joined, Told, Units};
use crate::edge::Vertex;
use crate::filter::labels::{LabelId, Spot};
use crate::filter::naming::{BASE, BaseMeasure, Near, Support, share, share_between, unless_false};
use crate::filter::particle::Particle;
use crate::geometry::Pose2;
use crate::graph::Graph;
use crate::language::act::Sameness;
use crate::talk::Talk;
use crate::talk::claims::{Claim, Claims, Testimony};
use std::collections::{BTreeMap, BTreeSet};
use std::f64::consts::TAU;

/// How often two places spoken of lie in one room by chance: a room of some floor.
const ONE_BY_CHANCE: f64 = 1.0 / 30.0;
/// "The hallway again" and "back in the lobby" mean another of the kind so often.
const OF_ITS_KIND: [f64; 2] = [0.9, 0.3];
/// So many of those who speak of what was told of do not say "again" (who presupposes it says so: Heim, 1991): assumed.
const UNMARKED: f64 = 0.5;
/// How often a place has been seen before when somebody speaks of it.
const VISITED_BY_CHANCE: f64 = 0.3;
/// Who comes back over floor that was talked about introduces so much less than on new floor: assumed, not learned.
const INTRODUCED_AGAIN: f64 = 0.5;
/// Talk is about floor so far around.
const TALKED_ABOUT_M: f64 = 10.0;
/// Sentences that are weighed anew in each map; what was said before them is taken as said, so that the time for one more
/// is bounded.
const WEIGHED_MAX: usize = 1000;
/// Floor on which a robot may be, when somebody points out where it is: a building's.
const SITE_M2: f64 = 5000.0;

/// log p(λ_1 … λ_n | G, X, L), relative to sentences that say nothing; `graph` is what all particles share.
pub fn log_likelihood(talk: &Talk, graph: &Graph, particle: &Particle) -> f64 {
    let standing = talk.standing();
    if standing.is_empty() {
        return 0.0;
    }
    let mut fold = Fold::new(talk, graph, particle, &standing);
    let (old, new) = standing.split_at(standing.len().saturating_sub(WEIGHED_MAX));
    for (t, units) in old {
        fold.hear(t, units);
    }
    let log_ratios = new.iter().map(|(t, units)| {
        let ratio = fold.ratio(t) * fold.introduced(t);
        fold.hear(t, units);
        ratio.ln()
    });
    log_ratios.sum()
}

/// p(l | what was said near) / p₀(l), in two parts.
struct Predicted {
    /// By what was told to be called so.
    known: f64,
    /// By the base measure: something new.
    new: f64,
}

/// p(l is there | what was said) / p₀(l) of where what is described may lie, and of floor not seen yet.
struct Figure {
    spots: Vec<(Vertex, f64)>,
    unseen: f64,
}

impl Figure {
    fn ratio(&self) -> f64 {
        self.spots.iter().map(|spot| spot.1).sum::<f64>() + self.unseen
    }
}

/// What was said so far, over one particle's map.
struct Fold<'a> {
    talk: &'a Talk,
    map: Map<'a>,
    base: BaseMeasure,
    /// Sites by place.
    numbers: BTreeMap<Vertex, usize>,
    near: Near<'a>,
    /// What was said of each site so far.
    told: Vec<Vec<(LabelId, Told)>>,
    joined: Joined,
    /// Of the sentence at hand, by name as said: reckoned once, to weigh it and to take it in.
    figures: BTreeMap<LabelId, Figure>,
    /// Names that were spoken of so far, and where.
    mentioned: BTreeSet<LabelId>,
    spoken_at: BTreeSet<Vertex>,
}

impl<'a> Fold<'a> {
    /// Nothing heard yet, but p₀ known of all that will be.
    fn new(
        talk: &'a Talk,
        graph: &'a Graph,
        particle: &'a Particle,
        standing: &[(&Testimony, Vec<Units>)],
    ) -> Self {
        let map = Map::new(talk, graph, particle);
        let names = talk.ledger.names().len();
        let kind = |label| (talk.ledger.is_way(label), talk.ledger.is_common(label));
        let mut base = BaseMeasure::new(&(0..names as LabelId).map(kind).collect::<Vec<_>>());
        let (mut numbers, mut sites) = (BTreeMap::new(), Vec::new());
        for (testimony, units) in standing {
            for (label, times) in talk.said(testimony) {
                base.count(label, times);
            }
            let spots = talk.described(testimony).flat_map(|(_, _, said)| {
                particle.labels.described(testimony.utterance, said).iter().map(|spot| spot.place)
            });
            for place in units.iter().map(|u| u.place).chain(spots) {
                if let Some(site) = map.site(place) {
                    numbers.entry(place).or_insert_with(|| {
                        sites.push(site);
                        sites.len() - 1
                    });
                }
            }
        }
        let told = vec![Vec::new(); sites.len()];
        Self {
            talk,
            map,
            base,
            numbers,
            near: Near::new(sites),
            told,
            joined: Joined::of(names),
            figures: BTreeMap::new(),
            mentioned: BTreeSet::new(),
            spoken_at: BTreeSet::new(),
        }
    }

    fn hear(&mut self, testimony: &Testimony, units: &[Units]) {
        let described = self.described(testimony);
        self.figures.clear();
        self.mentioned.extend(self.talk.names(testimony));
        if testimony.is_pose() {
            return;
        }
        self.spoken_at.insert(self.talk.ledger.entries()[testimony.utterance as usize].held);
        for Units { place, label, told } in units.iter().chain(&described) {
            let Some(&site) = self.numbers.get(place) else { continue };
            if self.told[site].is_empty() {
                self.near.tell(site);
            }
            match self.told[site].iter_mut().find(|(l, _)| l == label) {
                Some((_, known)) => known.add(*told, 1.0),
                None => self.told[site].push((*label, *told)),
            }
        }
    }

    /// Where what an utterance describes lies, given all before it.
    fn described(&mut self, testimony: &Testimony) -> Vec<Units> {
        let (own, mut units) = (self.talk.said(testimony), Vec::new());
        for (p, label, said) in self.talk.described(testimony) {
            let figure = self.figure(testimony.utterance, (said, label), &own);
            let ratio = figure.ratio();
            units.extend(figure.spots.iter().map(|&(place, weight)| {
                let told = Told { described: p * weight / ratio, ..Told::default() };
                Units { place, label, told }
            }));
        }
        units
    }

    /// p(λ | G, λ before) over that of a sentence that says nothing.
    fn ratio(&mut self, testimony: &Testimony) -> f64 {
        let own = self.talk.said(testimony);
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
        let at = |v: Vertex| self.map.site(v);
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
                Some(label) => unless_false(self.figure(utterance, (said, label), own).ratio()),
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
        let Predicted { known, new } = self.predicted(place, label, own);
        match again {
            Sameness::Open => unless_false(UNMARKED * known + new),
            // "Back in the lobby": it was called so before.
            Sameness::Same => unless_false(known + OF_ITS_KIND[usize::from(!self.base.is_way(label))] * new),
            // "Another lobby": it was not, nor anything else.
            Sameness::Other => {
                let Told { tally, described } = self.joined.of[label as usize];
                unless_false(new * (1.0 - tally.applies()) * (1.0 - described.min(1.0)))
            }
        }
    }

    /// Where what is described may lie. "The gym" is mostly the one that was spoken of before.
    fn figure(
        &mut self,
        utterance: u32,
        (said, label): (LabelId, LabelId),
        own: &[(LabelId, f64)],
    ) -> &Figure {
        let known = self.figures.remove(&said);
        let figure = known.unwrap_or_else(|| self.figure_anew(utterance, (said, label), own));
        self.figures.entry(said).or_insert(figure)
    }

    fn figure_anew(
        &mut self,
        utterance: u32,
        (said, label): (LabelId, LabelId),
        own: &[(LabelId, f64)],
    ) -> Figure {
        let is_known = self.mentioned.contains(&label) && !self.talk.ledger.is_common(label);
        let another = if is_known { OF_ITS_KIND[1] } else { 1.0 };
        let spots = self.map.particle.labels.described(utterance, said);
        let unseen = another * (1.0 - spots.iter().map(|spot| spot.share).sum::<f64>());
        let weight = |spot: &Spot| {
            let Predicted { known, new } = self.predicted(spot.place, label, own);
            (spot.place, spot.share * (UNMARKED * known + another * new))
        };
        Figure { spots: spots.iter().map(weight).collect(), unseen }
    }

    /// p(l | what was said near a place) / p₀(l), eq. (12), summed over what of all that is described is there: at most
    /// one, for where a description leaves a hallway's rooms open it takes none of them from others.
    fn predicted(&mut self, place: Vertex, label: LabelId, own: &[(LabelId, f64)]) -> Predicted {
        self.join(place);
        let (base, joined) = (&self.base, &self.joined);
        let p0 = |l: LabelId| base.probability(l, own);
        let (tally, is_way) = (joined.of[label as usize].tally, base.is_way(label));
        let of_class = |l: LabelId| base.is_way(l) == is_way;
        let total = joined.total(of_class, p0);
        let described = |l: &&LabelId| of_class(**l) && joined.of[**l as usize].described > 0.0;
        let [itself, other] = joined.names.iter().filter(described).fold([0.0; 2], |mut sums, &l| {
            sums[usize::from(l != label)] += joined.of[l as usize].described;
            sums
        });
        let scale = 1.0 / (itself + other).max(1.0);
        let [itself, other] = [itself * scale, other * scale];
        // As it is without any of them, and with one.
        let [bare, one] = [(1.0 - itself - other) / total, 1.0 / (total + 1.0)];
        let told = tally.concentration() * (bare + (itself + other) * one) + itself * one;
        let new = BASE * tally.left() * (bare + (itself + other) * one);
        Predicted { known: told / p0(label), new }
    }

    /// "This is not the gym".
    fn denied(&mut self, utterance: u32, (place, said): (Vertex, LabelId)) -> f64 {
        let Some(label) = self.talk.meant(utterance, said) else { return 1.0 };
        self.join(place);
        unless_false(1.0 - self.joined.of[label as usize].tally.applies())
    }

    /// Gathers what was said of a place and those near.
    fn join(&mut self, place: Vertex) {
        let Self { numbers, near, told, joined, .. } = self;
        joined.clear();
        if let Some(&site) = numbers.get(&place) {
            for &(k, share) in near.joined(site) {
                for &(label, told) in &told[k as usize] {
                    joined.add(label, told, share);
                }
            }
        }
    }

    /// "This is where we started": density of lying in one room, over that of any two places.
    fn one(&self, a: Vertex, b: Vertex, same: bool) -> f64 {
        let at = |v| self.map.site(v);
        let (Some(a), Some(b)) = (at(a), at(b)) else { return 1.0 };
        so(share_between(&a, &b), ONE_BY_CHANCE, same)
    }

    /// "The robot is here": its density there, over that anywhere in the building. What nothing ties to where the map
    /// began may be anywhere.
    fn at(&self, place: Vertex, told: &Pose2, [sigma_m, sigma_rad]: [f64; 2]) -> f64 {
        let site = self.map.site(place);
        let Some(here) = site.filter(|site| site.floor == self.map.floors.floor(0)) else { return 1.0 };
        let (off_m, turned_rad) = (told.distance_m(&here.pose), told.between(&here.pose).yaw_rad);
        let d2 = (off_m / sigma_m).powi(2) + (turned_rad / sigma_rad).powi(2);
        let peak = SITE_M2 / (TAU * sigma_m * sigma_m) * (TAU.sqrt() / sigma_rad);
        unless_false(peak * (-0.5 * d2).exp())
    }

    /// "We have been here before".
    fn visited(&self, place: Vertex, before: bool) -> f64 {
        let Some(here) = self.map.site(place) else { return 1.0 };
        so(share(self.map.nearest_m(place, &here)), VISITED_BY_CHANCE, before)
    }
}

/// What a yes or no says where the truth is `is`, and is so `by_chance`.
fn so(is: f64, by_chance: f64, said: bool) -> f64 {
    unless_false(if said { is / by_chance } else { (1.0 - is) / (1.0 - by_chance) })
}

#[cfg(test)]
mod tests;
