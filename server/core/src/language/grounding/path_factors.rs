//! Factors of path relations, learned: logistic regression on [`path_features`](super::path_features).

use crate::language::grounding::footprint::Footprint;
use crate::language::grounding::path_features::{FEATURES, GAP_MIN, features_of_steps};
use crate::language::grounding::path_weights::PATH_WEIGHTS;
use crate::language::grounding::ways::Step;
use crate::language::relation::Relation;

/// Least step in which a path is searched.
const STEP_M: f64 = 0.2;

/// The factor of a path relation beside one landmark.
pub struct PathFactor {
    landmark: Footprint,
    approach_m: f64,
    weights: &'static [f64; FEATURES],
    bias: f64,
    /// What one goes through, one is in on the way.
    enters: bool,
}

impl PathFactor {
    /// None if it is no relation of paths.
    pub fn new(relation: Relation, landmark: Footprint) -> Option<Self> {
        let (_, weights, bias) = PATH_WEIGHTS.iter().find(|w| w.0 == relation)?;
        Some(Self {
            landmark,
            approach_m: approach_m(relation),
            weights,
            bias: *bias,
            enters: relation == Relation::Through,
        })
    }

    /// p(a path is so), where both answers were equally likely before looking. The path leads from
    /// `start` over `rest`.
    pub fn p(&self, start: Step, rest: &[Step]) -> f64 {
        let features = features_of_steps(start, rest, &self.landmark);
        if self.enters && features[GAP_MIN] > 0.0 {
            return 0.0;
        }
        1.0 / (1.0 + (-(dot(self.weights, &features) + self.bias)).exp())
    }

    /// p of the path straight from a point to another: none of what never comes near the landmark.
    pub fn p_straight(&self, from: (f64, f64), to: (f64, f64)) -> f64 {
        let (from_m, to_m) = (self.before_m(from), self.before_m(to));
        let start = Step { at: from, walk_m: 0.0 };
        let end = start.to(to);
        self.start(start, from_m, end, to_m).map_or(0.0, |start| self.p(start, &[end]))
    }

    /// Distance of a point from where examples of the relation begin; negative is nearer the landmark.
    pub fn before_m(&self, at: (f64, f64)) -> f64 {
        self.landmark.signed_distance_m(self.landmark.local(at.0, at.1)) - self.approach_m
    }

    /// Where a step first comes so near the landmark that the examples begin there, `before_m` of its
    /// ends given; none if it doesn't. What was walked before tells nothing.
    pub fn start(&self, from: Step, from_m: f64, to: Step, to_m: f64) -> Option<Step> {
        let length_m = to.walk_m - from.walk_m;
        // A distance changes by no more than what is walked: the step there may come near only if
        // both its ends are near enough, and on it so far there is nothing to be found.
        if from_m + to_m > length_m {
            return None;
        }
        let (mut walked_m, mut over_m, mut at) = (0.0, from_m, from.at);
        while over_m > 0.0 {
            walked_m += over_m.max(STEP_M);
            if walked_m > length_m {
                return None;
            }
            let f = walked_m / length_m;
            at = (from.at.0 + f * (to.at.0 - from.at.0), from.at.1 + f * (to.at.1 - from.at.1));
            over_m = self.before_m(at);
        }
        (over_m <= 0.0).then_some(Step { at, walk_m: from.walk_m + walked_m })
    }
}

/// Four sums at once: one after the other would take longer than the features.
fn dot(a: &[f64; FEATURES], b: &[f64; FEATURES]) -> f64 {
    let mut sums = [0.0; 4];
    for (a, b) in a.chunks_exact(4).zip(b.chunks_exact(4)) {
        for (sum, (a, b)) in sums.iter_mut().zip(a.iter().zip(b)) {
            *sum += a * b;
        }
    }
    (sums[0] + sums[1]) + (sums[2] + sums[3])
}

/// How far before the landmark the examples of a relation begin: median gap of the true ones, at least
/// half a metre.
fn approach_m(relation: Relation) -> f64 {
    match relation {
        Relation::Past => 3.7,
        Relation::To => 6.4,
        Relation::Around => 0.7,
        // All of the way tells.
        Relation::Towards | Relation::AwayFrom => f64::INFINITY,
        _ => 0.5,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// p of a path of three points or two, from its first.
    fn p(relation: Relation, path: &[(f64, f64)], landmark: &Footprint) -> f64 {
        let mut steps = vec![Step { at: path[0], walk_m: 0.0 }];
        for &to in &path[1..] {
            steps.push(steps[steps.len() - 1].to(to));
        }
        PathFactor::new(relation, *landmark).unwrap().p(steps[0], &steps[1..])
    }

    #[test]
    fn what_is_plain_is_plain() {
        let desk = Footprint::spot(0.0, 0.0, 1.0);
        let hallway = Footprint::strip((0.0, 0.0), (20.0, 0.0), 1.0);
        let by = [(-6.0, 2.0), (0.0, 2.0), (6.0, 2.0)];
        let up_to = [(-6.0, 0.5), (-1.0, 0.2)];
        let from = [(1.2, 0.0), (7.0, 0.5)];
        let along = [(1.0, 0.1), (10.0, 0.2), (18.0, 0.0)];
        let over = [(10.0, -1.2), (10.2, 1.2)];
        assert!(p(Relation::Past, &by, &desk) > 0.9);
        assert!(p(Relation::Past, &up_to, &desk) < 0.3);
        assert!(p(Relation::To, &up_to, &desk) > 0.8 && p(Relation::To, &from, &desk) < 0.1);
        assert!(p(Relation::AwayFrom, &from, &desk) > 0.8);
        assert!(p(Relation::AwayFrom, &up_to, &desk) < 0.1);
        assert!(p(Relation::Down, &along, &hallway) > 0.9);
        assert!(p(Relation::Down, &by, &hallway) < 0.3);
        assert!(p(Relation::Across, &over, &hallway) > p(Relation::Across, &along, &hallway));
    }

    #[test]
    fn a_path_begins_where_it_comes_near() {
        let factor = PathFactor::new(Relation::Past, Footprint::spot(0.0, 0.0, 1.0)).unwrap();
        let start = |from: (f64, f64), to: (f64, f64)| {
            let a = Step { at: from, walk_m: 3.0 };
            factor.start(a, factor.before_m(from), a.to(to), factor.before_m(to))
        };
        let near = start((-9.0, 0.0), (9.0, 0.0)).unwrap();
        assert!((near.at.0 + 4.7).abs() < 0.2 && (near.walk_m - 12.0 - near.at.0).abs() < 1e-9, "{near:?}");
        assert_eq!(start((-9.0, 6.0), (9.0, 6.0)), None, "it passes too far off");
        assert_eq!(start((1.0, 0.0), (9.0, 0.0)).unwrap().at, (1.0, 0.0));
        assert!(factor.p_straight((-9.0, 6.0), (9.0, 6.0)) <= 0.0);
        assert!(start((f64::NAN, 0.0), (9.0, 0.0)).is_none());
    }

    #[test]
    fn static_relations_have_none() {
        assert!(PathFactor::new(Relation::Near, Footprint::spot(0.0, 0.0, 1.0)).is_none());
    }
}
