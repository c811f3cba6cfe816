//! Stretches of path that no scan measured: in the dark, or across a break of odometry.
//!
//! They part the map, and what ties its parts again are revisits. How far a graph knows where the robot is
//! in the map, is what the best tied way from its first place adds up to:
//!
//! ```text
//! part 0 ──stretch── part 1 ──stretch── part 2      steady mapping within a part counts nothing
//!    └───────────── revisit ───────────────┘        a revisit counts the covariance of its fit
//! ```
//!
//! Within a part the map goes along with the robot: a corridor's far end may be metres off as seen from its
//! beginning, and yet all that is near the robot is where the map has it.

use crate::edge::Vertex;
use crate::filter::particle::Particle;
use crate::geometry::Pose2;
use crate::graph::spread::Spread;
use crate::graph::stretches::{Stretch, carried};
use crate::track::front::FrontEnd;
use nalgebra::Matrix3;
use std::collections::BTreeMap;

/// A particle's best tied way from the first place of its map to the newest.
#[derive(Clone, Copy, Debug, Default)]
pub struct Way {
    /// What it adds up to.
    pub spread: Spread,
    /// The newest stretch on it.
    stretch: Option<usize>,
}

impl Way {
    /// Through a particle's graph, parted by `vague` stretches.
    pub fn of(particle: &Particle, vague: &[&Stretch]) -> Self {
        if vague.is_empty() {
            return Self::default();
        }
        let belief = &particle.belief;
        let yaw_rad = |v: Vertex| if (v as usize) < belief.len() { belief.pose(v).yaw_rad } else { 0.0 };
        let part = |v: Vertex| vague.partition_point(|s| s.last <= v);
        // The best link between two parts either way: a stretch, or the surest fit.
        let mut links: BTreeMap<(usize, usize), Self> = BTreeMap::new();
        let stretches = vague.iter().enumerate().map(|(k, s)| {
            let spread = Spread::new(&s.covariance, yaw_rad(s.last));
            ((k, k + 1), Self { spread, stretch: Some(k) })
        });
        let fits = particle.edges.iter().filter_map(|e| {
            let (a, b) = (part(e.i.min(e.j)), part(e.i.max(e.j)));
            let link = || Self { spread: Spread::new(&e.covariance, yaw_rad(e.j)), stretch: None };
            (a < b).then(|| ((a, b), link()))
        });
        for (parts, link) in stretches.chain(fits) {
            let known = links.entry(parts).or_insert(link);
            if link.spread.size() < known.spread.size() {
                *known = link;
            }
        }
        shortest(&links, vague.len())
    }

    /// The newest of these stretches that it goes over.
    pub fn stretch<'a>(&self, vague: &[&'a Stretch]) -> Option<&'a Stretch> {
        vague.get(self.stretch?).copied()
    }
}

/// From part 0 to a part, by the links' sizes.
fn shortest(links: &BTreeMap<(usize, usize), Way>, to: usize) -> Way {
    let mut ways: Vec<Option<Way>> = vec![None; to + 1];
    ways[0] = Some(Way::default());
    // A way goes over no part twice, so so many rounds do; mostly two.
    for _ in 0..to {
        let mut better = false;
        for (&(a, b), link) in links {
            for (from, to) in [(a, b), (b, a)] {
                let Some(way) = ways[from] else { continue };
                let on = Way { spread: way.spread.plus(link.spread), stretch: way.stretch.max(link.stretch) };
                if ways[to].is_none_or(|known| on.spread.size() < known.spread.size()) {
                    ways[to] = Some(on);
                    better = true;
                }
            }
        }
        if !better {
            break;
        }
    }
    ways[to].unwrap_or_default()
}

/// What no scan has measured of the path since the newest place that was left; none where scans have
/// measured all of it.
pub fn ahead(front: &FrontEnd, map_from_front: &Pose2) -> Option<Spread> {
    let mut ahead: Option<Spread> = None;
    // Of the stretch that goes on, with the frame at its end.
    let mut on: Option<(Pose2, Matrix3<f64>)> = None;
    let mut end = |stretch: Option<(Pose2, Matrix3<f64>)>| {
        if let Some((front_from_end, covariance)) = stretch {
            let spread = Spread::new(&covariance, map_from_front.compose(&front_from_end).yaw_rad);
            ahead = Some(ahead.unwrap_or_default().plus(spread));
        }
    };
    for place in front.open_places() {
        if place.chain.broken || place.chain.unseen {
            let before = on.take().map_or_else(Matrix3::zeros, |(_, covariance)| covariance);
            on = Some((place.front_from_place, carried(&before, &place.chain)));
        } else {
            end(on.take());
        }
    }
    if front.sees_nothing() {
        let body = front.front_from_body();
        let covariance = on.take().map_or_else(Matrix3::zeros, |(from, covariance)| {
            let f = body.between(&from).adjoint();
            f * covariance * f.transpose()
        });
        on = Some((body, covariance + front.since_place()));
    }
    end(on);
    ahead
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::edge::EdgeKind;
    use crate::filter::particle::Edge;
    use crate::graph::stretches::Stretches;
    use crate::track::places::Chain;
    use nalgebra::Vector3;

    fn diagonal(sigma_m: f64) -> Matrix3<f64> {
        Matrix3::from_diagonal(&Vector3::new(sigma_m.powi(2), sigma_m.powi(2), 1e-4))
    }

    /// Stretches that end at these places, each with such a spread.
    fn stretches(ends: &[(Vertex, f64)]) -> Stretches {
        let mut stretches = Stretches::default();
        for &(v, sigma_m) in ends {
            let information = diagonal(sigma_m).try_inverse().unwrap();
            let previous_from_this = Pose2::new(1.0, 0.0, 0.0);
            let chain = Chain { previous_from_this, information, broken: false, unseen: true, failed: 1e-4 };
            stretches.extend(v, &chain, 1.0);
        }
        stretches
    }

    /// A graph that ties these pairs, each as well as told.
    fn graph(ties: &[(Vertex, Vertex, f64)]) -> Particle {
        let mut particle = Particle::empty();
        for (k, &(i, j, sigma_m)) in ties.iter().enumerate() {
            particle.add(Edge {
                i,
                j,
                kind: EdgeKind::Distance,
                i_from_j: Pose2::default(),
                covariance: diagonal(sigma_m),
                question: crate::edge::QuestionId { boot: 0, n: k as u32 },
                log_looks: 0.0,
                factor: k as u32,
            });
        }
        particle
    }

    fn near(stretches: &Stretches, ties: &[(Vertex, Vertex, f64)]) -> f64 {
        Way::of(&graph(ties), &stretches.vague()).spread.near([0.0; 3])
    }

    #[test]
    fn a_revisit_across_a_stretch_tells_where_the_robot_is() {
        let one = stretches(&[(20, 3.0)]);
        assert!(near(&one, &[]) < 0.1);
        assert!(near(&one, &[(3, 12, 0.05)]) < 0.1, "it ties places before the dark");
        assert!(near(&one, &[(3, 30, 0.05)]) > 0.999);
        assert!(near(&one, &[(3, 30, 1.5)]) < 0.5, "a bare corridor's fit says little");
        assert!(near(&stretches(&[]), &[]) > 1.0 - 1e-6);
    }

    #[test]
    fn of_several_ways_the_best_tied_counts() {
        // Out of one room into another and a third.
        let two = stretches(&[(20, 3.0), (40, 3.0)]);
        assert!(near(&two, &[(3, 50, 0.05)]) > 0.999, "the third is the first");
        let back = near(&two, &[(30, 50, 0.05)]);
        assert!((back - near(&stretches(&[(20, 3.0)]), &[])).abs() < 1e-3, "the third is the second: {back}");
        assert!(near(&two, &[]) < 0.7 * back);
        let vague = two.vague();
        assert_eq!(Way::of(&graph(&[(30, 50, 0.05)]), &vague).stretch(&vague).unwrap().last, 20);
    }
}
