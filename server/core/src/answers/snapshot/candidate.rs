//! A place that may be meant, and all that is told of it.

use super::Snapshot;
use crate::answers::query::Candidate;
use crate::answers::whereabouts::{Region, SAME_REGION_M};
use crate::edge::{PlaceId, Vertex};
use crate::filter::labels::LabelId;
use crate::geometry::Pose2;
use nalgebra::Matrix3;
use std::collections::BTreeSet;

/// Sentences told as reasons, the newest: of a name that was said a thousand times they would be the most of an answer.
const BECAUSE_MAX: usize = 32;

impl Snapshot {
    pub(super) fn candidate(&self, label: LabelId, Region { place, p_is, probability }: Region) -> Candidate {
        Candidate {
            place: PlaceId::from(place),
            label: self.ledger.name(label).to_owned(),
            shown: self.ledger.spelled(self.ledger.name(label)).to_owned(),
            probability,
            p_is,
            pose: self.poses[place as usize],
            covariance: self.covariance(place),
            because: self.because(label, place),
        }
    }

    /// Spread of a place over the posterior, best particle's map axes: its own covariance there and
    /// that of its position relative to the robot between particles.
    fn covariance(&self, v: Vertex) -> Matrix3<f64> {
        let best = &self.particles[0].belief;
        let Some(last) = (best.len() as Vertex).checked_sub(1) else { return Matrix3::zeros() };
        let known = v.min(last);
        let mut sum = in_map_axes(&best.pose(known), &best.marginal(&self.structure, known));
        if v > last {
            return sum;
        }
        let here = best.pose(last);
        for p in self.particles.iter().skip(1) {
            let there = here.compose(&p.belief.pose(last).between(&p.belief.pose(v)));
            let (dx, dy) = (there.x_m - self.poses[v as usize].x_m, there.y_m - self.poses[v as usize].y_m);
            let spread = Matrix3::new(dx * dx, dx * dy, 0.0, dx * dy, dy * dy, 0.0, 0.0, 0.0, 0.0);
            sum += p.weight() * spread;
        }
        sum
    }

    pub(super) fn because(&self, label: LabelId, v: Vertex) -> Vec<String> {
        let at = self.poses[v as usize];
        let mut utterances: BTreeSet<u32> = BTreeSet::new();
        for e in self.particles[0].labels.evidence().iter().filter(|e| e.label == label) {
            if self.poses[e.place as usize].distance_m(&at) < SAME_REGION_M {
                utterances.insert(e.utterance);
            }
        }
        let newest = utterances.len().saturating_sub(BECAUSE_MAX);
        let ids = utterances.into_iter().skip(newest);
        ids.map(|u| self.ledger.entries().get(u as usize).map_or_else(String::new, |e| e.id.clone()))
            .collect()
    }
}

/// Covariance of a right perturbation as that of (x, y, yaw) along the map's axes.
fn in_map_axes(pose: &Pose2, covariance: &Matrix3<f64>) -> Matrix3<f64> {
    // The adjoint of a pure rotation.
    let a = Pose2::new(0.0, 0.0, pose.yaw_rad).adjoint();
    a * covariance * a.transpose()
}
