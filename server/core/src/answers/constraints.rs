//! The best graph as others' smoothers read it, and what was said.

use super::snapshot::Snapshot;
use crate::edge::Vertex;
use crate::event::StampNs;
use crate::geometry::Pose2;
use nalgebra::Matrix3;

/// A measured transform between two places of the best graph.
#[derive(Clone, Debug, PartialEq)]
pub struct Constraint {
    /// The older place.
    pub i: Vertex,
    /// The newer place.
    pub j: Vertex,
    /// j's pose in i.
    pub i_from_j: Pose2,
    /// Its information, right perturbation: x, y, yaw in j's frame.
    pub information: Matrix3<f64>,
    /// Whether it closes a loop; else it is of the chain.
    pub is_loop: bool,
}

/// A sentence that was heard.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Sentence {
    /// The guide's id of it.
    pub id: String,
    /// When it began.
    pub stamp_ns: StampNs,
    /// What was said.
    pub text: String,
    /// Whether it was not taken back.
    pub stands: bool,
}

impl Snapshot {
    /// The best graph: the chain, but where odometry broke, and its loop edges.
    pub fn constraints(&self) -> Vec<Constraint> {
        let chain = self.frozen().iter().enumerate().skip(1).filter(|(_, place)| !place.chain.broken);
        let chain = chain.map(|(j, place)| Constraint {
            i: j as Vertex - 1,
            j: j as Vertex,
            i_from_j: place.chain.previous_from_this,
            information: place.chain.information,
            is_loop: false,
        });
        let loops = self.best().edges.iter().filter_map(|edge| {
            let information = edge.covariance.try_inverse()?;
            Some(Constraint { i: edge.i, j: edge.j, i_from_j: edge.i_from_j, information, is_loop: true })
        });
        chain.chain(loops).collect()
    }

    /// What was said, in the order in which it was heard.
    pub fn sentences(&self) -> Vec<Sentence> {
        let sentence = |e: &crate::talk::ledger::Entry| Sentence {
            id: e.id.clone(),
            stamp_ns: e.stamp_ns,
            text: e.text.clone(),
            stands: e.stands,
        };
        self.ledger().entries().iter().map(sentence).collect()
    }
}
