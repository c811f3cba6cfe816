//! The best graph's map laid on the truth: its error, and what places are called.

use super::checkpoint::Share;
use crate::graph::Graphs;
use crate::truth::{Named, Path, Truth};
use toponym_core::Pose2;
use toponym_core::language::Speech;

/// Rows of a trajectory further than this from the truth's stamps are left out.
const SLACK_S: f64 = 0.1;

/// The rigid transform that lays a map's points best on the true ones.
pub fn align(pairs: &[([f64; 2], [f64; 2])]) -> Option<Pose2> {
    let n = (!pairs.is_empty()).then_some(pairs.len() as f64)?;
    let sum = pairs.iter().fold([0.0; 4], |s, (p, q)| [s[0] + p[0], s[1] + p[1], s[2] + q[0], s[3] + q[1]]);
    let [ax, ay, bx, by] = sum.map(|s| s / n);
    let (mut sin, mut cos) = (0.0, 0.0);
    for ([px, py], [qx, qy]) in pairs {
        let (px, py, qx, qy) = (px - ax, py - ay, qx - bx, qy - by);
        cos += px * qx + py * qy;
        sin += px * qy - py * qx;
    }
    let turned = Pose2::new(0.0, 0.0, sin.atan2(cos));
    let (x_m, y_m) = turned.apply(ax, ay);
    Some(Pose2::new(bx - x_m, by - y_m, turned.yaw_rad))
}

/// Where a trajectory lies by the truth, and by how much it errs after that.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Laid {
    /// Lays the map on the truth.
    pub true_from_map: Pose2,
    /// Root of the mean squared distance.
    pub rmse_m: f64,
}

/// Lays a trajectory (stamps and poses) on the true path; none if they share no time.
pub fn lay(trajectory: &[(f64, Pose2)], path: &Path) -> Option<Laid> {
    let (from_s, to_s) = path.span_s();
    let shared = |r: &&(f64, Pose2)| r.0 >= from_s - SLACK_S && r.0 <= to_s + SLACK_S;
    let pair = |(t_s, p): &(f64, Pose2)| {
        let at = path.at(*t_s);
        ([p.x_m, p.y_m], [at.x_m, at.y_m])
    };
    let pairs: Vec<_> = trajectory.iter().filter(shared).map(pair).collect();
    let true_from_map = align(&pairs)?;
    let squared = |([px, py], [qx, qy]): &([f64; 2], [f64; 2])| {
        let (x_m, y_m) = true_from_map.apply(*px, *py);
        (x_m - qx).powi(2) + (y_m - qy).powi(2)
    };
    let mean = pairs.iter().map(squared).sum::<f64>() / pairs.len() as f64;
    Some(Laid { true_from_map, rmse_m: mean.sqrt() })
}

/// Names said outright that the nearest named place's likeliest name has right. Places between named
/// ones have no name: a sentence names the one place that was held.
pub fn labels(graphs: &Graphs, truth: &Truth) -> Share {
    let names = || graphs.places.iter().filter_map(|p| Some((truth.path.at(p.stamp_s), p.name.as_ref()?)));
    let right = |named: &Named| {
        let at = truth.path.at(named.t_s);
        let nearest = names().min_by(|a, b| a.0.distance_m(&at).total_cmp(&b.0.distance_m(&at)));
        nearest.is_some_and(|(_, name)| spelled(name) == spelled(&named.name))
    };
    Share::count(truth.named.iter().map(right))
}

/// A name as the map spells it: "Lecture Hall 123" and "lecture hall one twenty three" are one.
fn spelled(name: &str) -> String {
    Speech::default().parse_query(name).map_or_else(|| name.to_lowercase(), |n| n.as_str().to_owned())
}

#[cfg(test)]
mod tests {
    use super::super::topology::tests::out_and_back;
    use super::*;
    use crate::graph::Place;

    #[test]
    fn a_map_that_lies_elsewhere_errs_by_nothing_and_one_bent_by_its_bend() {
        let path = out_and_back();
        let moved = Pose2::new(3.0, -7.0, 2.0);
        let mut trajectory: Vec<(f64, Pose2)> =
            path.rows().iter().map(|(t_s, p)| (*t_s, moved.compose(p))).collect();
        let laid = lay(&trajectory, &path).unwrap();
        assert!(laid.rmse_m < 1e-9 && laid.true_from_map.compose(&moved).x_m.abs() < 1e-9);
        trajectory[0].1.y_m += 1.0;
        assert!(lay(&trajectory, &path).unwrap().rmse_m > 0.05);
        // Rows that the truth knows nothing of are left out.
        trajectory.remove(0);
        trajectory.push((99.0, Pose2::new(1e3, 1e3, 0.0)));
        assert!(lay(&trajectory, &path).unwrap().rmse_m < 1e-9);
        assert_eq!(lay(&[], &path), None);
    }

    #[test]
    fn a_name_is_looked_for_at_the_named_place_nearest_to_where_it_was_said() {
        let place = |stamp_s, name: &str| Place { stamp_s, name: Some(name.into()) };
        let mut graphs = Graphs { places: vec![place(10.0, "Gym"), place(30.0, "cafe")], particles: vec![] };
        graphs.places.insert(1, Place { stamp_s: 12.0, name: None });
        let named = |t_s, name: &str| Named { t_s, name: name.into() };
        let named = vec![named(12.0, "gym"), named(47.0, "gym"), named(31.0, "gym")];
        let truth = Truth { path: out_and_back(), named, ..Truth::default() };
        assert_eq!(labels(&graphs, &truth), Share { right: 2, of: 3 }, "at 47 s it is back beside the first");
    }
}
