//! Where a name applies, over the whole posterior: each particle by its own map.
//!
//! ```text
//! p_is(c)        = Σ_i w_i P_i(name applies at c)
//! p_none         = Σ_i w_i Π_regions of i (1 − P_i said) Π_descriptions (1 − P_i put anywhere)
//! probability(c) = Σ_i w_i (1 − none_i) P_i(c) / Σ_regions of i P_i          Σ_c + p_none = 1
//! ```
//!
//! P_i counts an utterance once, however many near places it is evidence of, and what was carried over an
//! edge not at all: places that an edge joins lie near one another.

use crate::edge::Vertex;
use crate::filter::labels::{Evidence, LabelId, Source, take_up};
use crate::filter::naming::{Spoken, share};
use crate::filter::particle::Particle;
use crate::geometry::Pose2;
use std::collections::BTreeMap;

/// Places nearer than this that bear one name are one candidate.
pub const SAME_REGION_M: f64 = 6.0;
/// Places of a particle looked at, the likeliest.
const SITES_MAX: usize = 64;

/// A place that may bear the name.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Region {
    /// The likeliest of its places.
    pub place: Vertex,
    /// P(name applies).
    pub p_is: f64,
    /// P(this one is meant).
    pub probability: f64,
}

/// Where a name may apply.
#[derive(Clone, Debug, PartialEq)]
pub struct Whereabouts {
    /// The best particle's regions, best first, then what only others have.
    pub regions: Vec<Region>,
    /// Probability that it applies nowhere seen.
    pub p_none: f64,
}

/// Where a name applies; `pose` of a particle's place, or of one that is not frozen yet: only those that something is
/// said of are asked for. What weighs less than `p_min` founds no region.
pub fn whereabouts(
    particles: &[Particle],
    pose: &dyn Fn(&Particle, Vertex) -> Option<Pose2>,
    label: LabelId,
    p_min: f64,
) -> Whereabouts {
    let maps: Vec<Map> = particles.iter().map(|p| Map::new(p, pose, label)).collect();
    let mut found = Whereabouts { regions: Vec::new(), p_none: 0.0 };
    for map in &maps {
        map.find(&mut found.regions, p_min);
    }
    for map in &maps {
        map.share_out(&mut found);
    }
    found
}

/// What one particle has heard of a name, where it lies in its map.
struct Map<'a> {
    particle: &'a Particle,
    pose: &'a dyn Fn(&Particle, Vertex) -> Option<Pose2>,
    weight: f64,
    /// By utterance, each with the pose of its place.
    evidence: BTreeMap<u32, Vec<(Pose2, Evidence)>>,
}

impl<'a> Map<'a> {
    fn new(
        particle: &'a Particle,
        pose: &'a dyn Fn(&Particle, Vertex) -> Option<Pose2>,
        label: LabelId,
    ) -> Self {
        let wanted = |e: &&Evidence| e.label == label && !matches!(e.source, Source::Carried | Source::Tied);
        let mut evidence: BTreeMap<u32, Vec<(Pose2, Evidence)>> = BTreeMap::new();
        for e in particle.labels.evidence().iter().filter(wanted) {
            if let Some(at) = pose(particle, e.place) {
                evidence.entry(e.utterance).or_default().push((at, *e));
            }
        }
        Self { particle, pose, weight: particle.weight(), evidence }
    }

    /// Of a place that some map has.
    fn pose(&self, v: Vertex) -> Pose2 {
        (self.pose)(self.particle, v).unwrap_or_default()
    }

    /// All that speaks for the name at a place: of what each utterance says, by how much of it holds there.
    fn spoken(&self, at: Vertex) -> Spoken {
        let (at, mut spoken) = (self.pose(at), Spoken::default());
        for of_utterance in self.evidence.values() {
            let (mut said, mut denied, mut described) = (0.0_f64, 0.0_f64, 0.0);
            for (place, e) in of_utterance {
                let holds = e.weight * share(at.distance_m(place));
                match e.source {
                    Source::Grounded => described += holds,
                    Source::Denied => denied = denied.max(-holds),
                    _ => said = said.max(holds),
                }
            }
            spoken.tally.said += said;
            spoken.tally.denied += denied;
            spoken.undescribed *= 1.0 - described.clamp(0.0, 1.0);
        }
        spoken
    }

    /// Places with evidence, the likeliest first by what is said of themselves: where the name was given, rather
    /// than in the midst of what joins there.
    fn sites(&self) -> Vec<Vertex> {
        let mut own: BTreeMap<Vertex, Spoken> = BTreeMap::new();
        for (_, e) in self.evidence.values().flatten() {
            take_up(own.entry(e.place).or_default(), e);
        }
        let sites = own.into_iter().map(|(v, spoken)| (v, spoken.applies()));
        let mut sites: Vec<(Vertex, f64)> = sites.filter(|s| s.1 > 0.0).collect();
        sites.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
        sites.truncate(SITES_MAX);
        sites.into_iter().map(|s| s.0).collect()
    }

    /// Adds the regions that this map has and no map before.
    fn find(&self, regions: &mut Vec<Region>, p_min: f64) {
        for place in self.sites() {
            if !self.is_in(regions, place) && self.weight * self.spoken(place).applies() >= p_min {
                regions.push(Region { place, p_is: 0.0, probability: 0.0 });
            }
        }
    }

    fn is_in(&self, regions: &[Region], v: Vertex) -> bool {
        let at = self.pose(v);
        regions.iter().any(|r| self.pose(r.place).distance_m(&at) < SAME_REGION_M)
    }

    /// Adds this particle's share to all regions and to none.
    fn share_out(&self, found: &mut Whereabouts) {
        let poses: Vec<Pose2> = found.regions.iter().map(|r| self.pose(r.place)).collect();
        let spoken: Vec<Spoken> = found.regions.iter().map(|r| self.spoken(r.place)).collect();
        // What other maps take apart may be one region in this.
        let mut kept: Vec<usize> = Vec::new();
        for (k, region) in found.regions.iter_mut().enumerate() {
            region.p_is += self.weight * spoken[k].applies();
        }
        for k in 0..spoken.len() {
            if !kept.iter().any(|&o| poses[o].distance_m(&poses[k]) < SAME_REGION_M) {
                kept.push(k);
            }
        }
        let sum: f64 = kept.iter().map(|&k| spoken[k].applies()).sum();
        let none = if sum > 0.0 { self.nowhere(kept.iter().map(|&k| spoken[k])) } else { 1.0 };
        found.p_none += self.weight * none;
        for k in kept.into_iter().filter(|_| sum > 0.0) {
            found.regions[k].probability += self.weight * (1.0 - none) * spoken[k].applies() / sum;
        }
    }

    /// Probability that the name applies nowhere: what was said of no region is true, and no description is put
    /// anywhere. A description means one place, so its places are no witnesses of one another.
    fn nowhere(&self, regions: impl Iterator<Item = Spoken>) -> f64 {
        let unsaid: f64 = regions.map(|spoken| 1.0 - spoken.tally.told()).product();
        let put = |of_utterance: &Vec<(Pose2, Evidence)>| {
            let grounded = of_utterance.iter().filter(|(_, e)| e.source == Source::Grounded);
            grounded.map(|(_, e)| e.weight).sum::<f64>().clamp(0.0, 1.0)
        };
        self.evidence.values().map(|of| 1.0 - put(of)).product::<f64>() * unsaid
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::filter::labels::DIRECT;
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
        whereabouts(&particles, &pose, 0, 0.02)
    }

    fn direct(utterance: u32, place: Vertex) -> Evidence {
        Evidence::new(utterance, 0, place, DIRECT, Source::Direct)
    }

    #[test]
    fn an_utterance_and_what_an_edge_carried_over_are_one_witness() {
        let carried = Evidence::new(0, 0, 1, 0.5, Source::Carried);
        let one = found(&[(1.0, &[0.0, 1.0])], &[direct(0, 0), carried]);
        assert_eq!(one.regions.len(), 1);
        assert!((one.regions[0].p_is - 0.9).abs() < 1e-9 && (one.p_none - 0.1).abs() < 1e-9);
        let two = found(&[(1.0, &[0.0, 1.0])], &[direct(0, 0), carried, direct(1, 0)]);
        assert!(two.regions[0].p_is < 0.96, "{two:?}");
    }

    #[test]
    fn each_particle_answers_by_its_own_map() {
        // Said twice; in the best map of two rooms, in the other of one.
        let maps: [(f64, &[f64]); 2] = [(0.6, &[0.0, 50.0]), (0.4, &[0.0, 1.0])];
        let two = found(&maps, &[direct(0, 0), direct(1, 1)]);
        let [a, b] = &two.regions[..] else { panic!("{two:?}") };
        assert!(a.p_is > 0.9 && b.p_is > 0.9, "{two:?}");
        let none = 0.6 * 0.01 + 0.4 * (1.0 / 9.0) / (1.0 / 9.0 + 1.0 + share(1.0));
        assert!((two.p_none - none).abs() < 1e-9, "{two:?}");
        assert!((a.probability - b.probability - 0.4 * (1.0 - none)).abs() < 0.02, "{two:?}");
        // The best map has them as one, the other apart: that is a region, too.
        let maps: [(f64, &[f64]); 2] = [(0.6, &[0.0, 1.0]), (0.4, &[0.0, 50.0])];
        assert_eq!(found(&maps, &[direct(0, 0), direct(1, 1)]).regions.len(), 2);
    }

    #[test]
    fn the_places_of_a_description_are_no_witnesses_of_one_another() {
        let heard = [0, 1].map(|v| Evidence::new(0, 0, v, 0.5, Source::Grounded));
        let described = found(&[(1.0, &[0.0, 50.0])], &heard);
        assert!(described.p_none < 1e-9 && described.regions.iter().all(|r| (r.p_is - 0.5).abs() < 1e-9));
    }

    proptest! {
        #[test]
        fn probabilities_and_none_sum_to_one(
            heard in prop::collection::vec((0_u32..8, 0_u32..6, 0.02..1.0_f64, 0..3_u8), 0..12),
            first in prop::collection::vec(0.0..60.0_f64, 6), second in prop::collection::vec(0.0..60.0_f64, 6),
        ) {
            let evidence: Vec<Evidence> = heard
                .iter()
                .map(|&(utterance, place, weight, kind)| {
                    let (weight, source) = match kind {
                        0 => (weight, Source::Direct),
                        1 => (weight / 12.0, Source::Grounded),
                        _ => (-weight, Source::Denied),
                    };
                    Evidence::new(utterance, 0, place, weight, source)
                })
                .collect();
            let found = found(&[(0.7, &first), (0.3, &second)], &evidence);
            let sum = found.regions.iter().map(|r| r.probability).sum::<f64>() + found.p_none;
            prop_assert!((sum - 1.0).abs() < 1e-9);
            prop_assert!(found.regions.iter().all(|r| (0.0..=1.0 + 1e-9).contains(&r.p_is)));
        }
    }
}
