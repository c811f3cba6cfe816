//! Trials of the filter: what the matcher found replaced by what it might have found, and edges that nobody
//! found at all.
//!
//! A fit that counts as evidence has passed every gate of the matcher and the agreement of several
//! places; its transform is replaced after all of them, so that only eqs. (17–18) stand between a wrong
//! edge and the map. A forced edge is in every particle's graph without being asked.

use crate::edge::{EdgeKind, Vertex};
use crate::filter::Filter;
use crate::filter::loops::{Fit, SUPPORT_MIN};
use crate::geometry::Pose2;
use crate::random::{Purpose, generator};
use crate::scan::correlate::WINDOW_M;
use crate::scan::matching::Mode;
use nalgebra::{Matrix3, Vector3};
use rand::RngExt;
use serde::{Deserialize, Serialize};
use std::f64::consts::PI;

/// What a forced edge claims of itself: 2 cm and ¼°, as good fits do.
const CLAIMED: [f64; 3] = [4e-4, 4e-4, 1.6e-5];

/// What is spoilt; by default nothing.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Trial {
    /// Share of the matched loop transforms that are replaced by ones uniform over the search's window.
    pub inject_loops: f64,
    /// Seed of these.
    pub seed: u64,
    /// Edges that every particle takes once the newer place is left.
    pub force_loops: Vec<ForcedLoop>,
}

/// An edge that nobody found.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ForcedLoop {
    /// The older place.
    pub i: Vertex,
    /// The newer place.
    pub j: Vertex,
    /// The transform.
    pub i_from_j: Pose2,
}

impl Trial {
    /// Replaces the transforms of some fits at place `t`.
    pub fn spoil(&self, t: Vertex, fits: &mut [Fit]) {
        if self.inject_loops <= 0.0 {
            return;
        }
        for fit in fits {
            let mut draw = generator(self.seed, t.into(), fit.i.into(), Purpose::Inject);
            if draw.random::<f64>() < self.inject_loops {
                let mut within = |half: f64| half * (2.0 * draw.random::<f64>() - 1.0);
                fit.mode.i_from_j = Pose2::new(within(WINDOW_M), within(WINDOW_M), within(PI));
            }
        }
    }

    /// Forces the edges of the newest place upon every particle.
    pub fn force(&self, filter: &mut Filter) {
        let Some(t) = filter.graph.places().len().checked_sub(1).map(|v| v as Vertex) else { return };
        for forced in self.force_loops.iter().filter(|f| f.j == t && f.i < t) {
            let covariance = Matrix3::from_diagonal(&Vector3::from(CLAIMED));
            let mode = Mode { i_from_j: forced.i_from_j, covariance, score: 1.0, overlap: 1.0 };
            filter.impose(t, &Fit::supported_by(forced.i, mode, EdgeKind::Relocalisation, SUPPORT_MIN));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::edge::EdgeKind;
    use crate::scan::matching::Mode;
    use nalgebra::Matrix3;

    fn fits() -> Vec<Fit> {
        let mode = Mode {
            i_from_j: Pose2::new(1.0, 2.0, 0.5),
            covariance: Matrix3::identity(),
            score: 0.9,
            overlap: 0.6,
        };
        (0..1000).map(|i| Fit::supported_by(i, mode, EdgeKind::Distance, 3)).collect()
    }

    #[test]
    fn the_share_asked_for_is_replaced_by_anything_in_the_window() {
        let trial = Trial { inject_loops: 0.3, seed: 1, force_loops: Vec::new() };
        let mut spoilt = fits();
        trial.spoil(2000, &mut spoilt);
        let wrong: Vec<&Fit> = spoilt.iter().filter(|f| (f.mode.i_from_j.x_m - 1.0).abs() > 1e-12).collect();
        assert!((250..350).contains(&wrong.len()), "{}", wrong.len());
        let side = |f: &&&Fit| f.mode.i_from_j.x_m > 0.0;
        assert!((wrong.len() / 3..wrong.len() * 2 / 3).contains(&wrong.iter().filter(side).count()));
        assert!(wrong.iter().all(|f| f.mode.i_from_j.y_m.abs() <= WINDOW_M));
        let mut again = fits();
        trial.spoil(2000, &mut again);
        assert_eq!(spoilt, again);
    }

    #[test]
    fn nothing_is_replaced_unasked() {
        let mut same = fits();
        Trial::default().spoil(2000, &mut same);
        assert_eq!(same, fits());
    }
}
