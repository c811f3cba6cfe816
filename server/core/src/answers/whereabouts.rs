//! Where a name applies, over the whole posterior: each particle by its own map, joined by the rooms of the best one.
//!
//! ```text
//! told_i(c)      = α / (max(α, 1) + δ + η ρ)       α: said of c; ρ: other names said of it; rooms that are one in map i count once
//! κ_i            = 1 − μ Π_c (1 − told_i(c))                        what was not rightly said here is so elsewhere
//! P_i(c)         ∝ κ_i o(c)/Σ o · r(c) + (1 − κ_i) q(c)             o: odds of told_i; q: descriptions, r = q / prior
//! P_i(none)      ∝ (1 − κ_i) q(none)
//! probability(c) = Σ_i w_i P_i(c),   p_none = Σ_i w_i P_i(none)       Σ_c + p_none = 1
//! p_is(c)        = Σ_i w_i (1 − (1 − told_i(c)) (1 − (1 − κ_i) q(c)))
//! ```
//!
//! An utterance counts once, however many near places it is evidence of, and what was carried over an edge not at all:
//! places that an edge joins lie near one another.

use crate::answers::named::{Described, Named, Spot, given};
use crate::edge::Vertex;
use crate::filter::labels::{Evidence, LabelId, Source};
use crate::filter::naming::Tally;
use crate::filter::particle::Particle;
use crate::geometry::Pose2;
use crate::talk::ledger::Ledger;
use std::collections::{BTreeMap, BTreeSet};

/// Places nearer than this that lie in no room and bear one name are one.
pub const SAME_PLACE_M: f64 = 6.0;
/// Two rooms are one in a map that lays them so near, …
const SAME_ROOM_M: f64 = 2.0;
/// … if the best one lays them so much further apart.
const JOINED_M: f64 = 3.0;
/// Spots looked at, those of which most is said.
const SPOTS_MAX: usize = 64;
/// μ: of names that were given to the wrong room, so many are in no other room seen (from the tours told of at
/// [`given`]).
const NOWHERE: f64 = 0.3;
/// No odds are better: what is said twice may be of two rooms.
const ODDS_MAX: f64 = 20.0;
/// No name is so well known that a description can't be of another place.
const KNOWN_MAX: f64 = 0.97;
/// Of something that was named outright, a description is so often loose or false.
const LOOSE: f64 = 0.3;
/// No description moves a name that was given further.
const RATIO_MAX: f64 = 20.0;

/// A spot that may bear the name.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bearer {
    /// A room, or a spot.
    pub spot: Spot,
    /// Index of the region in which it lies.
    pub room: Option<usize>,
    /// The place that stands for it.
    pub place: Vertex,
    /// P(name applies).
    pub p_is: f64,
    /// P(this one is meant).
    pub probability: f64,
}

/// Where a name may apply.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Whereabouts {
    /// The likeliest first.
    pub bearers: Vec<Bearer>,
    /// Probability that it applies nowhere seen.
    pub p_none: f64,
}

/// What is known of the map and of what was said.
pub struct Known<'a> {
    /// The posterior.
    pub particles: &'a [Particle],
    /// Pose of a particle's place, or of one that is not frozen yet.
    pub pose: &'a dyn Fn(&Particle, Vertex) -> Option<Pose2>,
    /// The rooms.
    pub named: &'a Named,
    /// What was said.
    pub ledger: &'a Ledger,
    /// Descriptions are where the paper's rule put them.
    pub by_paper: bool,
}

/// Where a name applies; what is less probable than `p_min` is left out.
pub fn whereabouts(known: &Known, label: LabelId, p_min: f64) -> Whereabouts {
    let by_paper = known.by_paper.then(|| known.named.grounded(label, &known.particles[0].labels)).flatten();
    let described =
        if known.by_paper { by_paper.as_ref() } else { known.named.described(label, known.ledger) };
    let mut spots = spots(known, label);
    let said = spots.len();
    if let Some(Described { which, .. }) = described {
        let is_said = |r: usize| spots.iter().any(|s| known.named.region(s.0) == Some(r));
        let likely = (0..which.p.len()).filter(|&r| which.p[r] >= p_min && !is_said(r)).map(Spot::Region);
        let new: Vec<(Spot, Vertex)> = likely.map(|spot| (spot, known.named.anchor(spot, None))).collect();
        spots.extend(new);
    }
    let mut found = Whereabouts::default();
    let region = |&(spot, place): &(Spot, Vertex)| {
        let room = known.named.region(spot);
        Bearer { spot, room, place, p_is: 0.0, probability: 0.0 }
    };
    found.bearers = spots.iter().map(region).collect();
    for particle in known.particles {
        Map::new(known, particle, &spots[..said], label).share_out(described, &mut found);
    }
    // Spots that are one with another in all maps are told once; what else is left out is none of those told.
    let is_told = |b: &Bearer| b.probability > 0.0 && b.probability.max(b.p_is) >= p_min;
    let (mut bearers, left): (Vec<Bearer>, Vec<Bearer>) = found.bearers.into_iter().partition(is_told);
    bearers.sort_by(|a, b| b.probability.total_cmp(&a.probability).then(a.place.cmp(&b.place)));
    let p_none = found.p_none + left.iter().map(|r| r.probability).sum::<f64>();
    Whereabouts { bearers, p_none }
}

/// Whether a piece of evidence says outright what something is called.
fn is_outright(e: &Evidence, label: LabelId) -> bool {
    e.label == label && matches!(e.source, Source::Direct | Source::DirectOther | Source::Denied)
}

/// Spots of which something was said outright, in any map, with the place that stands for each: where it was said.
fn spots(known: &Known, label: LabelId) -> Vec<(Spot, Vertex)> {
    let mut said: BTreeMap<Spot, (f64, u32, Vertex)> = BTreeMap::new();
    let evidence = known.particles.iter().flat_map(|p| p.labels.evidence());
    for e in evidence.filter(|e| is_outright(e, label) && e.source != Source::Denied) {
        let spot = said.entry(known.named.spot(e)).or_insert((0.0, e.utterance, e.place));
        spot.0 += e.weight;
        (spot.1, spot.2) = (spot.1, spot.2).min((e.utterance, e.place));
    }
    let mut spots: Vec<_> = said.into_iter().collect();
    spots.sort_by(|a, b| b.1.0.total_cmp(&a.1.0).then(a.0.cmp(&b.0)));
    spots.truncate(SPOTS_MAX);
    // It stands for its spot where the name was given first.
    let place = |(spot, (_, utterance, place)): (Spot, (f64, u32, Vertex))| {
        let entry = known.ledger.entries().get(utterance as usize).filter(|entry| entry.held == place);
        let at = entry.and_then(|entry| known.named.speaker(entry)).map(|s| (s.pose.x_m, s.pose.y_m));
        (spot, known.named.anchor(spot, at))
    };
    spots.into_iter().map(place).collect()
}

/// What one particle has heard of a name: by cluster of spots that are one in its map.
struct Map {
    weight: f64,
    /// The cluster of each spot.
    cluster: Vec<usize>,
    /// P(name was rightly given) of each cluster.
    told: Vec<f64>,
}

impl Map {
    fn new(known: &Known, particle: &Particle, spots: &[(Spot, Vertex)], label: LabelId) -> Self {
        let cluster = clusters(known, particle, spots);
        let mut tallies = vec![Tally::default(); spots.len()];
        // By utterance and cluster the most that it says: what it says of places near each other is one thing.
        let mut said: BTreeMap<(u32, usize), (f64, f64)> = BTreeMap::new();
        for e in particle.labels.evidence().iter().filter(|e| is_outright(e, label)) {
            let spot = known.named.spot(e);
            let of = spots.iter().position(|s| s.0 == spot).map(|k| cluster[k]);
            if let Some(of) = of {
                let most = said.entry((e.utterance, of)).or_default();
                match e.source {
                    Source::Denied => most.1 = most.1.max(-e.weight),
                    _ => most.0 = most.0.max(e.weight),
                }
            }
        }
        for ((_, of), (says, denies)) in said {
            tallies[of].add(Tally { said: says, denied: denies }, 1.0);
        }
        let told = |k: usize| given(tallies[k], known.named.rivals(spots[k].0, label, known.ledger));
        Self { weight: particle.weight(), told: (0..spots.len()).map(told).collect(), cluster }
    }

    /// Adds this particle's share to all spots and to none.
    fn share_out(&self, described: Option<&Described>, found: &mut Whereabouts) {
        let said = self.cluster.len();
        let is_first = |k: usize| k >= said || self.cluster[k] == k;
        let told = |k: usize| self.told[self.cluster[k]];
        let odds = |k: usize| (told(k) / (1.0 - told(k)).max(1e-9)).min(ODDS_MAX);
        let firsts = || (0..said).filter(|&k| is_first(k));
        let sum: f64 = firsts().map(odds).sum();
        let unknown: f64 = firsts().map(|k| 1.0 - told(k)).product();
        let unknown = if sum > 0.0 { NOWHERE * unknown } else { 1.0 };
        let known = if described.is_some() { (1.0 - unknown).min(KNOWN_MAX) } else { 1.0 - unknown };
        let q = |r: &Bearer| match (r.room, described) {
            (Some(room), Some(d)) => (d.which.p[room], d.prior.p[room]),
            _ => (0.0, 0.0),
        };
        let ratio = |r: &Bearer| match q(r) {
            _ if described.is_none() => 1.0,
            (p, prior) if prior > 0.0 => LOOSE + (1.0 - LOOSE) * (p / prior).min(RATIO_MAX),
            _ => LOOSE,
        };
        let of_spot = |k: usize, r: &Bearer| {
            let outright = if k < said && sum > 0.0 { known * odds(k) / sum * ratio(r) } else { 0.0 };
            outright + if k < said { 0.0 } else { (1.0 - known) * q(r).0 }
        };
        let p: Vec<f64> = found
            .bearers
            .iter()
            .enumerate()
            .map(|(k, r)| if is_first(k) { of_spot(k, r) } else { 0.0 })
            .collect();
        // A room that bears the name, and one too unlikely to be told, are none of the others.
        let described_none = described.map_or(1.0, |d| {
            1.0 - found.bearers.iter().skip(said).map(|r| q(r).0).sum::<f64>()
                - said_by(d, &found.bearers[..said])
        });
        let none = (1.0 - known) * described_none.max(0.0);
        let all = p.iter().sum::<f64>() + none;
        let scale = if all > 0.0 { self.weight / all } else { 0.0 };
        found.p_none += if all > 0.0 { scale * none } else { self.weight };
        for (k, (region, p)) in found.bearers.iter_mut().zip(p).enumerate() {
            region.probability += scale * p;
            let outright = if k < said { told(k) } else { 0.0 };
            let new = if k < said { 0.0 } else { p / all.max(f64::MIN_POSITIVE) };
            region.p_is += self.weight * (1.0 - (1.0 - outright) * (1.0 - new));
        }
    }
}

/// What descriptions give the spots that bear the name.
fn said_by(described: &Described, spots: &[Bearer]) -> f64 {
    let rooms: BTreeSet<usize> = spots.iter().filter_map(|r| r.room).collect();
    rooms.into_iter().map(|room| described.which.p[room]).sum()
}

/// By spot, the first that it is one with in a particle's map.
fn clusters(known: &Known, particle: &Particle, spots: &[(Spot, Vertex)]) -> Vec<usize> {
    let pose = |p: &Particle, k: usize| (known.pose)(p, spots[k].1).unwrap_or_default();
    let best = &known.particles[0];
    let are_one = |a: usize, b: usize| {
        let apart_m = pose(particle, a).distance_m(&pose(particle, b));
        match (spots[a].0, spots[b].0) {
            (Spot::Region(_), Spot::Region(_)) => {
                let in_best_m = pose(best, a).distance_m(&pose(best, b));
                apart_m < SAME_ROOM_M && in_best_m > apart_m + JOINED_M
            }
            _ => apart_m < SAME_PLACE_M,
        }
    };
    (0..spots.len()).map(|k| (0..k).find(|&o| are_one(o, k)).unwrap_or(k)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::answers::named::FALSE_ODDS;
    use crate::answers::named::tests::{first, heard};
    use crate::filter::labels::DIRECT;
    use crate::language::READ;
    use proptest::prelude::*;

    /// Particles with weights, whose places lie along x where told, and what all have heard.
    fn found(maps: &[(f64, &[f64])], heard: &[Evidence]) -> Whereabouts {
        let particles: Vec<Particle> = maps
            .iter()
            .map(|&(weight, _)| {
                let mut p = Particle { log_weight: weight.ln(), ..Particle::empty() };
                for e in heard {
                    p.labels.add(*e);
                }
                p
            })
            .collect();
        let pose = |p: &Particle, v: Vertex| {
            let k = maps.iter().position(|m| (m.0 - p.weight()).abs() < 1e-9).unwrap();
            maps[k].1.get(v as usize).map(|&x_m| Pose2::new(x_m, 0.0, 0.0))
        };
        let (named, ledger) = (Named::default(), Ledger::default());
        let known =
            Known { particles: &particles, pose: &pose, named: &named, ledger: &ledger, by_paper: false };
        whereabouts(&known, 0, 0.02)
    }

    fn direct(utterance: u32, place: Vertex) -> Evidence {
        Evidence::new(utterance, 0, place, DIRECT, Source::Direct)
    }

    #[test]
    fn an_utterance_and_what_an_edge_carried_over_are_one_witness() {
        let carried = Evidence::new(0, 0, 1, 0.5, Source::Carried);
        let one = found(&[(1.0, &[0.0, 1.0])], &[direct(0, 0), carried]);
        assert_eq!(one.bearers.len(), 1);
        let told = 1.0 / (1.0 / READ + FALSE_ODDS) / READ;
        assert!((one.bearers[0].p_is - told).abs() < 1e-9, "{one:?}");
        assert!((one.p_none - NOWHERE * (1.0 - told)).abs() < 1e-9);
        let two = found(&[(1.0, &[0.0, 1.0])], &[direct(0, 0), carried, direct(1, 0)]);
        assert!(two.bearers[0].p_is > told && two.bearers[0].p_is < 1.0, "{two:?}");
    }

    #[test]
    fn each_particle_answers_by_its_own_map() {
        // Said twice; in the best map of two rooms, in the other of one.
        let maps: [(f64, &[f64]); 2] = [(0.6, &[0.0, 50.0]), (0.4, &[0.0, 1.0])];
        let two = found(&maps, &[direct(0, 0), direct(1, 1)]);
        let [a, b] = &two.bearers[..] else { panic!("{two:?}") };
        assert!(a.p_is > 0.9 && b.p_is > 0.9, "{two:?}");
        let not = |said: f64| FALSE_ODDS / (said / READ + FALSE_ODDS);
        let none = NOWHERE * (0.6 * not(1.0) * not(1.0) + 0.4 * not(2.0));
        assert!((two.p_none - none).abs() < 1e-9, "{two:?}");
        assert!((a.probability - b.probability - 0.4 * (1.0 - none)).abs() < 0.02, "{two:?}");
        // The best map has them as one, the other apart: that is a region, too.
        let maps: [(f64, &[f64]); 2] = [(0.6, &[0.0, 1.0]), (0.4, &[0.0, 50.0])];
        assert_eq!(found(&maps, &[direct(0, 0), direct(1, 1)]).bearers.len(), 2);
    }

    #[test]
    fn a_name_said_again_beside_the_first_time_is_told_once() {
        let again = found(&[(1.0, &[0.0, 2.0, 50.0])], &[direct(0, 0), direct(1, 1), direct(2, 2)]);
        assert_eq!(again.bearers.len(), 2, "{again:?}");
    }

    #[test]
    fn what_is_named_outright_keeps_a_description_that_disagrees_at_arms_length() {
        let described = ("The gym is across from the kitchen.", None);
        let kitchen = ("This is the kitchen.", Some(first(2)));
        let gym = |said: &[(&str, Option<u32>)]| {
            let (named, ledger, labels) = heard(said);
            let particles = [Particle { labels, ..Particle::empty() }];
            let pose = |_: &Particle, v: Vertex| Some(Pose2::new(f64::from(v), 0.0, 0.0));
            let known =
                Known { particles: &particles, pose: &pose, named: &named, ledger: &ledger, by_paper: false };
            whereabouts(&known, ledger.label("gym").unwrap(), 0.01)
        };
        let in_room = |found: &Whereabouts, room: usize| {
            found.bearers.iter().filter(|b| b.room == Some(room)).map(|b| b.probability).sum::<f64>()
        };
        let alone = gym(&[kitchen, described]);
        assert!(in_room(&alone, 6) > 0.4 && alone.p_none > 0.0, "{alone:?}");
        let elsewhere = gym(&[kitchen, described, ("This is the gym.", Some(first(1)))]);
        assert!(in_room(&elsewhere, 1) > 0.8 && in_room(&elsewhere, 6) > 0.0, "{elsewhere:?}");
        let there = gym(&[kitchen, described, ("This is the gym.", Some(first(6)))]);
        assert!(in_room(&there, 6) > in_room(&elsewhere, 1), "{there:?}");
        for found in [alone, elsewhere, there] {
            let sum = found.bearers.iter().map(|b| b.probability).sum::<f64>() + found.p_none;
            assert!((sum - 1.0).abs() < 1e-9, "{found:?}");
        }
    }

    proptest! {
        #[test]
        fn probabilities_and_none_sum_to_one(
            heard in prop::collection::vec((0_u32..8, 0_u32..6, 0.02..1.0_f64, any::<bool>()), 0..12),
            first in prop::collection::vec(0.0..60.0_f64, 6), second in prop::collection::vec(0.0..60.0_f64, 6),
        ) {
            let evidence: Vec<Evidence> = heard
                .iter()
                .map(|&(utterance, place, weight, denied)| {
                    let (weight, source) = if denied { (-weight, Source::Denied) } else { (weight, Source::Direct) };
                    Evidence::new(utterance, 0, place, weight, source)
                })
                .collect();
            let found = found(&[(0.7, &first), (0.3, &second)], &evidence);
            let sum = found.bearers.iter().map(|r| r.probability).sum::<f64>() + found.p_none;
            prop_assert!((sum - 1.0).abs() < 1e-9);
            prop_assert!(found.bearers.iter().all(|r| (0.0..=1.0 + 1e-9).contains(&r.p_is)));
        }
    }
}
