//! Factors of path relations, learned: logistic regression on [`path_features`].

use super::Relation;
use super::footprint::Footprint;
use super::path_features::{FEATURES, path_features};
use super::path_weights::PATH_WEIGHTS;

/// Least step in which a path is searched.
const STEP_M: f64 = 0.2;

/// p(a path is `relation` the landmark), where both answers were equally likely before looking; none
/// if it is no relation of paths.
pub fn path_factor(relation: Relation, path: &[(f64, f64)], landmark: &Footprint) -> Option<f64> {
    let (w, bias) = weights(relation)?;
    let logit: f64 = w.iter().zip(path_features(path, landmark)).map(|(w, x)| w * x).sum();
    Some(1.0 / (1.0 + (-(logit + bias)).exp()))
}

/// How far before the landmark the examples of a relation begin: median gap of the true ones, at least
/// half a metre. What was walked before tells nothing.
pub fn approach_m(relation: Relation) -> f64 {
    match relation {
        Relation::Past => 3.7,
        Relation::To => 6.4,
        Relation::Around => 0.7,
        // All of the way tells.
        Relation::Towards | Relation::AwayFrom => f64::INFINITY,
        _ => 0.5,
    }
}

/// Cuts off what lies before a path first comes within `reach_m` of a landmark; false, and the path
/// is left whole, if it never does.
pub fn from_near(path: &mut Vec<(f64, f64)>, landmark: &Footprint, reach_m: f64) -> bool {
    let over_m = |p: (f64, f64)| landmark.signed_distance_m(landmark.local(p.0, p.1)) - reach_m;
    for k in 1..path.len() {
        let (a, b) = (path[k - 1], path[k]);
        let length_m = ((b.0 - a.0).powi(2) + (b.1 - a.1).powi(2)).sqrt();
        let mut walked_m = 0.0;
        // A distance changes by no more than what is walked: so far there is nothing to be found.
        while walked_m <= length_m {
            let f = if length_m > 0.0 { walked_m / length_m } else { 0.0 };
            let at = (a.0 + f * (b.0 - a.0), a.1 + f * (b.1 - a.1));
            let over_m = over_m(at);
            if over_m <= 0.0 {
                path[k - 1] = at;
                path.drain(..k - 1);
                return true;
            }
            if over_m.is_nan() {
                return false;
            }
            walked_m += over_m.max(STEP_M);
        }
    }
    false
}

fn weights(relation: Relation) -> Option<(&'static [f64; FEATURES], f64)> {
    PATH_WEIGHTS.iter().find(|w| w.0 == relation).map(|(_, w, bias)| (w, *bias))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The likeliest relation among some, for a path beside a door of 2 m or along a hallway.
    fn factor(relation: Relation, path: &[(f64, f64)], landmark: &Footprint) -> f64 {
        path_factor(relation, path, landmark).unwrap()
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
        assert!(factor(Relation::Past, &by, &desk) > 0.9);
        assert!(factor(Relation::Past, &up_to, &desk) < 0.3);
        assert!(factor(Relation::To, &up_to, &desk) > 0.8 && factor(Relation::To, &from, &desk) < 0.1);
        assert!(factor(Relation::AwayFrom, &from, &desk) > 0.8);
        assert!(factor(Relation::AwayFrom, &up_to, &desk) < 0.1);
        assert!(factor(Relation::Down, &along, &hallway) > 0.9);
        assert!(factor(Relation::Down, &by, &hallway) < 0.3);
        assert!(factor(Relation::Across, &over, &hallway) > factor(Relation::Across, &along, &hallway));
    }

    #[test]
    fn static_relations_have_none() {
        assert!(path_factor(Relation::Near, &[(0.0, 0.0)], &Footprint::spot(0.0, 0.0, 1.0)).is_none());
    }
}
