//! Smoothing of a single graph: a structure and the one belief about it. The filter has many beliefs and does
//! without; benches, tests and the example `smooth` measure the smoother by this.

use crate::geometry::Pose2;
use crate::smoothing::{Belief, Factor, FactorId, Joint, JointRoom, Relative, SmoothError, Structure, Work};
use nalgebra::Matrix3;
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// The poses of one graph, with all its factors held. A clone shares all that neither changed. See
/// [`Structure`] for what is added and taken out, and [`Belief`] for what is known then; both hold as of the
/// last [`Smoother::update`].
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct Smoother {
    structure: Arc<Structure>,
    belief: Belief,
}

impl Smoother {
    /// Without poses.
    pub fn new() -> Self {
        Self::default()
    }

    /// See [`Structure::len`].
    pub fn len(&self) -> usize {
        self.structure.len()
    }

    /// Whether there is no pose yet.
    pub fn is_empty(&self) -> bool {
        self.structure.is_empty()
    }

    /// See [`Structure::add_pose`].
    pub fn add_pose(
        &mut self,
        previous_from_new: Pose2,
        information: &Matrix3<f64>,
    ) -> Result<u32, SmoothError> {
        Arc::make_mut(&mut self.structure).add_pose(previous_from_new, information)
    }

    /// See [`Structure::add_pose_from`].
    pub fn add_pose_from(&mut self, factor: Factor) -> Result<u32, SmoothError> {
        Arc::make_mut(&mut self.structure).add_pose_from(factor)
    }

    /// See [`Structure::add_anchor`].
    pub fn add_anchor(
        &mut self,
        origin_from_new: Pose2,
        information: &Matrix3<f64>,
    ) -> Result<u32, SmoothError> {
        Arc::make_mut(&mut self.structure).add_anchor(origin_from_new, information)
    }

    /// See [`Structure::add_factor`].
    pub fn add_factor(&mut self, factor: Factor) -> Result<FactorId, SmoothError> {
        let id = Arc::make_mut(&mut self.structure).add_factor(factor)?;
        self.belief.hold(id);
        Ok(id)
    }

    /// See [`Structure::remove_factor`].
    pub fn remove_factor(&mut self, id: FactorId) -> Result<(), SmoothError> {
        Arc::make_mut(&mut self.structure).remove_factor(id)?;
        self.belief.release(id);
        Ok(())
    }

    /// See [`Structure::loosen`]; the factor stays held.
    pub fn loosen(&mut self, pose: u32, wide: &Matrix3<f64>) -> Result<FactorId, SmoothError> {
        let known = self.structure.loosened(pose).is_some();
        let id = Arc::make_mut(&mut self.structure).loosen(pose, wide)?;
        if !known {
            self.belief.hold_as_before(id);
        }
        Ok(id)
    }

    /// See [`Belief::hold`].
    pub fn hold(&mut self, id: FactorId) {
        self.belief.hold(id);
    }

    /// See [`Belief::release`].
    pub fn release(&mut self, id: FactorId) {
        self.belief.release(id);
    }

    /// See [`Belief::rebase`].
    pub fn rebase(&mut self, from: u32, moved: &Pose2) -> Result<(), SmoothError> {
        self.belief.rebase(&self.structure, from, moved)
    }

    /// A present factor, added by [`Smoother::add_factor`].
    pub fn factor(&self, id: FactorId) -> Option<&Factor> {
        self.structure.factor(id)
    }

    /// See [`Structure::marginalise`]; what was added before takes effect first.
    pub fn marginalise(&mut self, poses: &[u32]) -> Result<(), SmoothError> {
        self.update()?;
        Arc::make_mut(&mut self.structure).marginalise(poses)
    }

    /// See [`Belief::update`].
    pub fn update(&mut self) -> Result<Work, SmoothError> {
        Arc::make_mut(&mut self.structure).arrange();
        self.belief.update(&self.structure)
    }

    /// See [`Belief::update_newest`].
    pub fn update_newest(&mut self) -> Result<Work, SmoothError> {
        Arc::make_mut(&mut self.structure).arrange();
        self.belief.update_newest(&self.structure)
    }

    /// See [`Belief::settle`].
    pub fn settle(&mut self) -> Result<Work, SmoothError> {
        Arc::make_mut(&mut self.structure).arrange();
        self.belief.settle(&self.structure)
    }

    /// The graph.
    pub fn structure(&self) -> &Structure {
        &self.structure
    }

    /// What is known of it.
    pub fn belief(&self) -> &Belief {
        &self.belief
    }

    /// See [`Belief::pose`].
    pub fn pose(&self, i: u32) -> Pose2 {
        self.belief.pose(i)
    }

    /// See [`Belief::poses`].
    pub fn poses(&self) -> Vec<Pose2> {
        self.belief.poses()
    }

    /// See [`Belief::chi2`].
    pub fn chi2(&self) -> f64 {
        self.belief.chi2(&self.structure)
    }

    /// See [`Belief::log_evidence`].
    pub fn log_evidence(&self) -> f64 {
        self.belief.log_evidence(&self.structure)
    }

    /// See [`Belief::marginal`].
    pub fn marginal(&self, i: u32) -> Matrix3<f64> {
        self.belief.marginal(&self.structure, i)
    }

    /// See [`Belief::joint`].
    pub fn joint(&self, candidates: &[u32]) -> Result<Joint, SmoothError> {
        self.belief.joint(&self.structure, candidates)
    }

    /// See [`Belief::joint_all`].
    pub fn joint_all<'a>(&self, room: &'a mut JointRoom) -> Result<&'a Joint, SmoothError> {
        self.belief.joint_all(&self.structure, room)
    }

    /// See [`Belief::relative`].
    pub fn relative(&self, a: u32, candidates: &[u32]) -> Result<Vec<Relative>, SmoothError> {
        self.belief.relative(&self.structure, a, candidates)
    }
}
