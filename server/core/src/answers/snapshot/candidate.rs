//! A place that may be meant, and all that is told of it.

use super::Snapshot;
use crate::answers::named::Spot;
use crate::answers::query::{Candidate, Goal};
use crate::answers::whereabouts::{Bearer, SAME_PLACE_M};
use crate::edge::{PlaceId, Vertex};
use crate::effects::TrackState;
use crate::filter::labels::{LabelId, Source};
use crate::geometry::{Pose2, is_inside};
use nalgebra::Matrix3;
use std::collections::BTreeSet;

/// Sentences told as reasons, the newest: of a name that was said a thousand times they would be the most of an answer.
const BECAUSE_MAX: usize = 32;

impl Snapshot {
    pub(crate) fn candidate(&self, label: LabelId, bearer: Bearer) -> Candidate {
        let Bearer { spot, room, place, p_is, probability } = bearer;
        let pose = self.poses[place as usize];
        let stood = Goal { pose, is_reachable: None };
        let (id, polygon_m, mut goal) = match room {
            None => (PlaceId::from(place), Vec::new(), stood),
            Some(r) => {
                let (rooms, from) = (self.rooms(), self.now.robot.map(|p| (p.x_m, p.y_m)));
                let from = from.filter(|_| self.now.state != TrackState::Lost);
                let goal = rooms.goal(r, (pose.x_m, pose.y_m), from).unwrap_or(stood);
                (rooms.regions[r].id, rooms.regions[r].polygon_m.clone(), goal)
            }
        };
        if self.forbidden().iter().any(|area| is_inside(area, (goal.pose.x_m, goal.pose.y_m))) {
            goal.is_reachable = Some(false);
        }
        Candidate {
            place: id,
            label: self.ledger.name(label).to_owned(),
            shown: self.ledger.spelled(self.ledger.name(label)).to_owned(),
            probability,
            p_is,
            pose,
            covariance: self.covariance(place),
            polygon_m,
            goal,
            walk_m: None,
            because: self.because(label, spot),
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

    /// Ids of the sentences that speak for a name there.
    pub(super) fn because(&self, label: LabelId, spot: Spot) -> Vec<String> {
        let named = self.named();
        let is_near = |v: Vertex| match spot {
            Spot::Place(at) => self.poses[v as usize].distance_m(&self.poses[at as usize]) < SAME_PLACE_M,
            Spot::Region(_) => false,
        };
        let mut utterances: BTreeSet<u32> = BTreeSet::new();
        for e in self.particles[0].labels.evidence().iter().filter(|e| e.label == label) {
            let outright = !matches!(e.source, Source::Grounded | Source::Carried);
            if outright && (named.spot(e) == spot || is_near(e.place)) {
                utterances.insert(e.utterance);
            }
        }
        if let (Spot::Region(r), Some(described)) = (spot, named.described(label, &self.ledger))
            && described.which.p[r] > described.prior.p[r]
        {
            utterances.extend(&described.utterances);
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
