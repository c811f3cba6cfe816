//! The posterior at one moment against all hypotheses.

use super::topology::Layout;
use crate::graph::{Graphs, Particle};
use crate::truth::Truth;

/// Scores of the graphs at one moment.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Checkpoint {
    /// Weight and, per hypothesis, whether the graph is of it; the best graph first.
    pub graphs: Vec<(f64, Vec<bool>)>,
    /// The best graph's edges that are true, and all.
    pub edges: Share,
    /// The truth's required loops that the best graph closed, and all.
    pub loops: Share,
    /// Best graphs in order before the first with an edge that is not true.
    pub top_all_true: usize,
}

/// So many right of so many.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Share {
    /// Right ones.
    pub right: usize,
    /// All.
    pub of: usize,
}

impl Share {
    /// Of what can be told right from wrong.
    pub fn count(items: impl IntoIterator<Item = bool>) -> Self {
        items
            .into_iter()
            .fold(Self::default(), |s, right| Self { right: s.right + usize::from(right), of: s.of + 1 })
    }

    /// From 0 to 1; of nothing there is no share.
    pub fn value(self) -> Option<f64> {
        (self.of > 0).then(|| self.right as f64 / self.of as f64)
    }
}

impl Checkpoint {
    /// Scores graphs.
    pub fn new(graphs: &Graphs, truth: &Truth) -> Self {
        let stamps_s = graphs.stamps_s();
        let layouts: Vec<Layout> =
            truth.hypotheses.iter().map(|h| Layout::new(h, truth, &stamps_s)).collect();
        let of = |p: &Particle| (p.weight, layouts.iter().map(|l| l.is_of(p)).collect());
        let (Some(true_layout), Some(best)) = (layouts.first(), graphs.particles.first()) else {
            return Self::default();
        };
        let all_true = |p: &&Particle| p.edges.iter().all(|e| true_layout.is_true(e));
        Self {
            graphs: graphs.particles.iter().map(of).collect(),
            edges: Share::count(best.edges.iter().map(|e| true_layout.is_true(e))),
            loops: Share::count(true_layout.loops().iter().map(|l| true_layout.is_closed(best, l))),
            top_all_true: graphs.particles.iter().take_while(all_true).count(),
        }
    }

    /// Weight of the graphs that are of the truth.
    pub fn mass_true(&self) -> f64 {
        self.mass().first().copied().unwrap_or(0.0)
    }

    /// Weight of the graphs of each hypothesis; one that is of two counts for both.
    pub fn mass(&self) -> Vec<f64> {
        let hypotheses = self.graphs.first().map_or(0, |g| g.1.len());
        let of = |h: usize| self.graphs.iter().filter(|g| g.1[h]).fold(0.0, |sum, g| sum + g.0);
        (0..hypotheses).map(|h| of(h).min(1.0)).collect()
    }

    /// Weight of the graphs of none of the hypotheses.
    pub fn mass_of_none(&self) -> f64 {
        self.graphs.iter().filter(|g| !g.1.contains(&true)).fold(0.0, |sum, g| sum + g.0)
    }

    /// Mass of the graphs that were dropped.
    fn unresolved(&self) -> f64 {
        (1.0 - self.graphs.iter().map(|g| g.0).sum::<f64>()).max(0.0)
    }

    /// The best graph's weight, and whether it is of the truth.
    pub fn best(&self) -> Option<(f64, bool)> {
        self.graphs.first().map(|(weight, of)| (*weight, of.first() == Some(&true)))
    }

    /// Distance in total variation from a reference's masses of the hypotheses. What is of none, or was
    /// dropped, is a class of its own; what is of several is shared among them as the reference shares it, so that what
    /// nobody can tell apart yet is no distance.
    pub fn total_variation(&self, reference: &[f64]) -> f64 {
        let mut mass = vec![0.0; reference.len()];
        for (weight, of) in &self.graphs {
            let held: Vec<usize> = (0..reference.len()).filter(|&h| of.get(h) == Some(&true)).collect();
            let sum: f64 = held.iter().map(|&h| reference[h]).sum();
            for &h in &held {
                mass[h] += weight * if sum > 0.0 { reference[h] / sum } else { 1.0 / held.len() as f64 };
            }
        }
        let rest = (1.0 - reference.iter().sum::<f64>()).max(0.0);
        let apart: f64 = mass.iter().zip(reference).map(|(a, b)| (a - b).abs()).sum();
        0.5 * (apart + (self.mass_of_none() + self.unresolved() - rest).abs())
    }
}

#[cfg(test)]
mod tests {
    use super::super::topology::tests::{elsewhere, map_of, out_and_back, stamps};
    use super::*;
    use crate::graph::{Edge, Place};
    use crate::truth::Hypothesis;
    use toponym_core::Pose2;

    fn truth() -> Truth {
        let hypotheses = vec![Hypothesis::truth("truth"), elsewhere()];
        Truth { path: out_and_back(), hypotheses, ..Truth::default() }
    }

    fn graphs(until: u32, particles: Vec<Particle>) -> Graphs {
        let places = stamps(until).into_iter().map(|stamp_s| Place { stamp_s, name: None }).collect();
        Graphs { places, particles }
    }

    fn weighed(weight: f64, graph: Particle) -> Particle {
        Particle { weight, ..graph }
    }

    /// With the edge that made it so: without any, it would also be of whom no loop is asked.
    fn true_map() -> Particle {
        let edge = Edge { i: 10, j: 50, i_from_j: Pose2::new(0.0, 0.0, std::f64::consts::PI) };
        Particle { edges: vec![edge], ..map_of(&Hypothesis::truth("truth"), 60) }
    }

    fn false_edge() -> Vec<Edge> {
        vec![Edge { i: 0, j: 5, i_from_j: Pose2::default() }]
    }

    #[test]
    fn mass_is_the_weight_of_the_graphs_of_each_hypothesis_and_the_rest() {
        let none = Particle { edges: false_edge(), ..true_map() };
        let particles =
            vec![weighed(0.5, map_of(&elsewhere(), 60)), weighed(0.3, true_map()), weighed(0.2, none)];
        let checkpoint = Checkpoint::new(&graphs(60, particles), &truth());
        assert_eq!(checkpoint.mass(), [0.3, 0.5]);
        assert!((checkpoint.mass_of_none() - 0.2).abs() < 1e-12);
        assert_eq!(checkpoint.best(), Some((0.5, false)));
        assert_eq!((checkpoint.loops, checkpoint.top_all_true), (Share { right: 0, of: 1 }, 2));
    }

    #[test]
    fn the_best_graphs_edges_make_precision() {
        let edges = [false_edge(), vec![Edge { i: 0, j: 5, i_from_j: Pose2::new(5.0, 0.0, 0.0) }]].concat();
        let best = Particle { edges, ..true_map() };
        let checkpoint = Checkpoint::new(&graphs(60, vec![best]), &truth());
        assert_eq!(checkpoint.edges, Share { right: 1, of: 2 });
        assert_eq!((checkpoint.loops.value(), checkpoint.top_all_true), (Some(1.0), 0));
        assert_eq!(Share::default().value(), None);
    }

    #[test]
    fn total_variation_counts_none_and_shares_what_is_undecided() {
        let particles = vec![weighed(0.6, true_map()), weighed(0.4, map_of(&elsewhere(), 60))];
        let checkpoint = Checkpoint::new(&graphs(60, particles), &truth());
        assert!((checkpoint.total_variation(&[1.0, 0.0]) - 0.4).abs() < 1e-12);
        assert!(checkpoint.total_variation(&[0.6, 0.4]) < 1e-12);
        let dropped = Checkpoint::new(&graphs(60, vec![weighed(0.6, true_map())]), &truth());
        assert!((dropped.total_variation(&[1.0, 0.0]) - 0.4).abs() < 1e-12, "it might be anything");
        let none = Particle { edges: false_edge(), ..true_map() };
        let lost = Checkpoint::new(&graphs(60, vec![none]), &truth());
        assert!((lost.total_variation(&[0.5, 0.5]) - 1.0).abs() < 1e-12);
        // Until the ways part, a graph is of both.
        let early = map_of(&Hypothesis::truth("truth"), 20);
        let undecided = Checkpoint::new(&graphs(20, vec![early]), &truth());
        assert_eq!(undecided.mass(), [1.0, 1.0]);
        assert!(undecided.total_variation(&[0.7, 0.3]) < 1e-12);
    }

    #[test]
    fn of_no_graph_nothing_is_said() {
        let checkpoint = Checkpoint::new(&Graphs::default(), &truth());
        assert_eq!((checkpoint.mass_true(), checkpoint.best()), (0.0, None));
    }
}
