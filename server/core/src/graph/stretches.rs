//! Stretches of path that no scan measured: in the dark, or across a break of odometry. They part the map.

use crate::edge::Vertex;
use crate::graph::spread::Spread;
use crate::track::places::Chain;
use nalgebra::Matrix3;
use serde::{Deserialize, Serialize};

/// A stretch over which the robot surely knew where it was parts nothing.
const SURE: f64 = 0.999;

/// From the last place that was seen to the first that is seen again, or to the newest.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Stretch {
    /// The last place that is not tied to the one before by any scan.
    pub last: Vertex,
    /// Of it, seen from the place before the first such; right perturbation.
    pub covariance: Matrix3<f64>,
    /// Length.
    pub path_m: f64,
    /// Whether odometry broke on it.
    pub broken: bool,
    /// Whether it leaves open where the robot was at its end.
    is_vague: bool,
}

/// All of them, oldest first.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct Stretches {
    all: Vec<Stretch>,
}

impl Stretches {
    /// Takes in the next place, and how far its chain edge goes.
    pub fn extend(&mut self, v: Vertex, chain: &Chain, path_m: f64) {
        if !(chain.broken || chain.unseen) {
            return;
        }
        let before = self.all.pop_if(|s| s.last + 1 == v);
        let known = before.as_ref().map_or_else(Matrix3::zeros, |s| s.covariance);
        let covariance = carried(&known, chain);
        self.all.push(Stretch {
            last: v,
            covariance,
            path_m: before.as_ref().map_or(0.0, |s| s.path_m) + path_m,
            broken: chain.broken || before.is_some_and(|s| s.broken),
            is_vague: Spread::new(&covariance, 0.0).near([0.0; 3]) < SURE,
        });
    }

    /// Those that leave it open where the robot was at their end.
    pub fn vague(&self) -> Vec<&Stretch> {
        self.all.iter().filter(|s| s.is_vague).collect()
    }

    /// The last places of these: the map's part k ends before the k-th.
    pub fn ends(&self) -> Vec<Vertex> {
        self.all.iter().filter(|s| s.is_vague).map(|s| s.last).collect()
    }
}

/// The part of the map that a place is in, by the ends of the stretches between parts.
pub fn part(ends: &[Vertex], v: Vertex) -> usize {
    ends.partition_point(|&end| end <= v)
}

/// A covariance over one more edge of the chain.
pub fn carried(covariance: &Matrix3<f64>, chain: &Chain) -> Matrix3<f64> {
    let f = chain.previous_from_this.inverse().adjoint();
    f * covariance * f.transpose() + chain.information.try_inverse().unwrap_or_else(Matrix3::zeros)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Pose2;
    use nalgebra::Vector3;

    #[test]
    fn successive_places_of_the_dark_are_one_stretch() {
        let mut stretches = Stretches::default();
        for (v, sigma_m, unseen) in
            [(5, 0.5, true), (6, 0.5, true), (7, 0.5, true), (8, 0.5, false), (20, 0.1, true)]
        {
            let sigma = Vector3::new(sigma_m, sigma_m, 1e-2);
            stretches.extend(
                v,
                &Chain {
                    previous_from_this: Pose2::new(1.0, 0.0, 0.0),
                    information: Matrix3::from_diagonal(&sigma.map(|s: f64| s.powi(-2))),
                    broken: false,
                    unseen,
                    failed: 1e-4,
                },
                1.0,
            );
        }
        assert_eq!(stretches.all.len(), 2);
        assert_eq!((stretches.all[0].last, stretches.all[0].path_m), (7, 3.0));
        assert!(stretches.all[0].covariance[(0, 0)] > 0.74);
        assert_eq!(stretches.ends(), [7], "a hand's breadth parts nothing");
    }
}
