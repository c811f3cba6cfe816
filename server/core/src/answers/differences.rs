//! What the best graphs disagree about, in words: "place 41 is place 7 again" or new ground.

use crate::answers::query::Difference;
use crate::edge::{PlaceId, QuestionId, Vertex};
use crate::filter::particle::Particle;
use std::collections::{BTreeMap, BTreeSet};

/// Graphs told of.
const WAYS_MAX: usize = 3;
/// Lighter ones are not.
const WEIGHT_MIN: f64 = 0.05;
/// Revisits told of each.
const REVISITS_MAX: usize = 3;
/// Two revisits whose newer places are so near along the chain are about the same stretch of path.
const SAME_STRETCH: Vertex = 5;

/// The best graphs, each by the revisits that not all of them hold. `told`: the mass of all graphs that are
/// left, of which `particles`, best first, have their shares. `name` tells what a place is called.
pub fn differences(
    particles: &[Particle],
    told: f64,
    name: impl Fn(PlaceId) -> Option<String>,
) -> Vec<Difference> {
    let weight = |p: &Particle| told * p.weight();
    let ways: Vec<&Particle> = particles.iter().filter(|p| weight(p) >= WEIGHT_MIN).take(WAYS_MAX).collect();
    let disputed = disputed(&ways);
    if ways.len() < 2 || disputed.is_empty() {
        return Vec::new();
    }
    let name = |v: Vertex| {
        let place = format!("place {v}");
        name(v.into()).map_or(place.clone(), |name| format!("{name} ({place})"))
    };
    let words = |p: &Particle| words(&held(p), &disputed, &name);
    ways.iter().map(|p| Difference { weight: weight(p), words: words(p) }).collect()
}

/// All of them in a sentence; none of one graph.
pub fn sentence(differences: &[Difference]) -> Option<String> {
    let count = match differences.len() {
        0 | 1 => return None,
        2 => "two",
        3 => "three",
        _ => "several",
    };
    let each = differences.iter().map(|d| format!("({:.0} %) {}", 100.0 * d.weight, d.words));
    Some(format!("{count} ways this map can be: {}", each.collect::<Vec<_>>().join("; ")))
}

fn held(p: &Particle) -> BTreeSet<QuestionId> {
    p.edges.iter().map(|e| e.question).collect()
}

/// The revisits that some hold and others don't, each by where it began: newer place, older place.
fn disputed(ways: &[&Particle]) -> BTreeMap<(Vertex, Vertex), QuestionId> {
    let held: Vec<BTreeSet<QuestionId>> = ways.iter().map(|p| held(p)).collect();
    let mut began: BTreeMap<QuestionId, (Vertex, Vertex)> = BTreeMap::new();
    for e in ways.iter().flat_map(|p| p.edges.iter()) {
        let pair = (e.i.max(e.j), e.i.min(e.j));
        let known = began.entry(e.question).or_insert(pair);
        *known = pair.min(*known);
    }
    let by_all = |revisit: &QuestionId| held.iter().all(|h| h.contains(revisit));
    began.into_iter().filter(|(r, _)| !by_all(r)).map(|(r, pair)| (pair, r)).collect()
}

fn words(
    held: &BTreeSet<QuestionId>,
    disputed: &BTreeMap<(Vertex, Vertex), QuestionId>,
    name: &dyn Fn(Vertex) -> String,
) -> String {
    let own: Vec<Vertex> = disputed.iter().filter(|(_, r)| held.contains(r)).map(|((j, _), _)| *j).collect();
    let mut said: Vec<String> = Vec::new();
    let mut new: Option<Vertex> = None;
    for (&(j, i), revisit) in disputed {
        if held.contains(revisit) {
            said.push(format!("{} is {} again", name(j), name(i)));
        } else if !own.iter().chain(&new).any(|&known| known.abs_diff(j) <= SAME_STRETCH) {
            said.push(format!("{} is new ground", name(j)));
            new = Some(j);
        }
    }
    let more = said.len().saturating_sub(REVISITS_MAX);
    said.truncate(REVISITS_MAX);
    let more = if more > 0 { format!(", and {more} more") } else { String::new() };
    said.join(", ") + &more
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::edge::EdgeKind;
    use crate::filter::particle::Edge;
    use crate::geometry::Pose2;

    /// A graph of such a weight with these edges: older place, newer place, revisit.
    fn graph(weight: f64, edges: &[(Vertex, Vertex, u32)]) -> Particle {
        let mut particle = Particle { log_weight: weight.ln(), ..Particle::empty() };
        for (k, &(i, j, n)) in edges.iter().enumerate() {
            particle.add(Edge {
                i,
                j,
                kind: EdgeKind::Distance,
                i_from_j: Pose2::default(),
                covariance: nalgebra::Matrix3::identity(),
                question: QuestionId { boot: 0, n },
                log_looks: 0.0,
                factor: k as u32,
            });
        }
        particle
    }

    fn told(particles: &[Particle], kept: f64) -> Vec<(u32, String)> {
        let name = |id| (id == 7).then(|| "gym".to_owned());
        let percent = |d: Difference| ((100.0 * d.weight).round() as u32, d.words);
        differences(particles, kept, name).into_iter().map(percent).collect()
    }

    #[test]
    fn a_revisit_is_told_by_where_it_began_and_who_doubts_it_by_new_ground() {
        let common = (2, 30, 0);
        let one = graph(0.72, &[common, (8, 42, 1), (7, 41, 1), (9, 43, 1)]);
        let other = graph(0.25, &[common]);
        let light = graph(0.03, &[]);
        let want =
            [(72, "place 41 is gym (place 7) again".to_owned()), (25, "place 41 is new ground".to_owned())];
        assert_eq!(told(&[one, other, light], 1.0), want);
    }

    #[test]
    fn two_places_that_one_may_be_are_no_new_ground() {
        let ways = [graph(0.6, &[(7, 41, 1)]), graph(0.4, &[(20, 43, 2)])];
        let want = [
            (45, "place 41 is gym (place 7) again".to_owned()),
            (30, "place 43 is place 20 again".to_owned()),
        ];
        assert_eq!(told(&ways, 0.75), want, "weights are of all the posterior");
        let differences = differences(&ways, 0.75, |_| None);
        assert_eq!(
            sentence(&differences).unwrap(),
            "two ways this map can be: (45 %) place 41 is place 7 again; (30 %) place 43 is place 20 again"
        );
    }

    #[test]
    fn of_many_revisits_the_first_are_told() {
        let many: Vec<_> = (0..5).map(|k| (k, 40 + 20 * k, k)).collect();
        let told = told(&[graph(0.5, &many), graph(0.3, &[]), graph(0.2, &many[..1])], 1.0);
        assert!(told[0].1.ends_with("place 80 is place 2 again, and 2 more"), "{told:?}");
        assert!(told[1].1.starts_with("place 40 is new ground, place 60 is new ground"), "{told:?}");
        assert!(told[2].1.starts_with("place 40 is place 0 again, place 60 is new ground"), "{told:?}");
    }

    #[test]
    fn one_graph_differs_from_nothing() {
        assert_eq!(told(&[graph(0.97, &[(7, 41, 1)]), graph(0.03, &[])], 1.0), []);
        assert_eq!(told(&[graph(0.6, &[]), graph(0.4, &[])], 1.0), []);
        assert_eq!(sentence(&[]), None);
    }
}
