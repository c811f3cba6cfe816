//! What all particles share: poses, factors, and the tree's shape.

use crate::geometry::Pose2;
use crate::smoothing::factor::{At, checked_information};
use crate::smoothing::sums::half_log_det;
use crate::smoothing::tree::{Entry, Tree};
use crate::smoothing::{Factor, FactorId, SmoothError};
use nalgebra::Matrix3;
use serde::{Deserialize, Serialize};

/// Poses and factors of all particles, and the Bayes tree of their union: a factor that a particle
/// does not hold is a zero in its numbers.
///
/// Additions take effect at [`Structure::arrange`], and in a particle's numbers at
/// [`super::Belief::update`]. The first pose is the origin and the gauge.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct Structure {
    pub(super) entries: Vec<Entry>,
    /// Factor that each pose starts from; of the first, no matter which.
    pub(super) starts: Vec<FactorId>,
    /// Who holds a factor.
    pub(super) holders: Vec<Holders>,
    /// What a factor adds to the evidence where it does not err, nats; none what a pose left.
    pub(super) log_weights: Vec<f64>,
    /// Factors of each pose.
    pub(super) of_pose: Vec<Vec<FactorId>>,
    /// How much the factors of each pose mind that it turns.
    pub(super) stiffness: Vec<Stiffness>,
    /// And what marginalised poses left on it, which stays.
    left_stiffness: Vec<Stiffness>,
    /// Poses of the last call of [`Structure::marginalise`], in order.
    pub(super) marginalised: Vec<Marginalised>,
    /// Number of poses marginalised before those.
    pub(super) marginalised_before: usize,
    pub(super) is_marginalised: Vec<bool>,
    pub(super) tree: Tree,
    /// Number of arrangements.
    pub(super) epoch: u64,
    new_poses: Vec<u32>,
    new_factors: Vec<FactorId>,
    touched: Vec<u32>,
    gone: Vec<u32>,
}

/// Which particles hold a factor.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(super) enum Holders {
    /// All: it is what a pose started from, or what a marginalised one left.
    All,
    /// Those told so.
    Some,
    /// Those that do not hold this one, which was loosened.
    Others(FactorId),
}

/// The largest of a pose's factors, in standard deviations of their translations.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
pub(super) struct Stiffness {
    /// Per metre.
    pub per_m: f64,
    /// Per radian by which one of its poses turns: times the distance measured.
    pub per_rad: f64,
}

impl Stiffness {
    fn take_up(&mut self, factor: &Factor) {
        let arm_m = factor.i_from_j.x_m.hypot(factor.i_from_j.y_m);
        let per_m = factor.information[(0, 0)].max(factor.information[(1, 1)]).sqrt();
        self.per_m = self.per_m.max(per_m);
        self.per_rad = self.per_rad.max(per_m * arm_m);
    }
}

/// One pose taken out.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct Marginalised {
    pub pose: u32,
    /// Its factors, which the prior replaces.
    pub factors: Vec<(FactorId, Entry)>,
    /// The prior's factor; None where it had one neighbour, of which it said nothing.
    pub prior: Option<FactorId>,
}

impl Structure {
    /// Without poses.
    pub fn new() -> Self {
        Self::default()
    }

    /// Number of poses, marginalised ones counted.
    pub fn len(&self) -> usize {
        self.starts.len()
    }

    /// Whether there is no pose yet.
    pub fn is_empty(&self) -> bool {
        self.starts.is_empty()
    }

    /// Extends the chain by a pose and returns its index.
    ///
    /// `information` is that of the right perturbation of `previous_from_new` (frame of the new
    /// pose). The first pose is the origin, whatever the arguments.
    pub fn add_pose(
        &mut self,
        previous_from_new: Pose2,
        information: &Matrix3<f64>,
    ) -> Result<u32, SmoothError> {
        let j = self.next()?;
        let i = j.saturating_sub(1);
        self.add_pose_from(Factor { i, j, i_from_j: previous_from_new, information: *information })
    }

    /// Adds a pose where a factor puts it: one end of the factor is the new pose, whose index is
    /// [`Structure::len`]. Every particle holds the factor.
    pub fn add_pose_from(&mut self, mut factor: Factor) -> Result<u32, SmoothError> {
        let new = self.next()?;
        if new == 0 {
            self.push_pose(0);
            return Ok(0);
        }
        factor.check(new as usize + 1)?;
        if factor.i.max(factor.j) != new {
            return Err(SmoothError::NoSuchPose { pose: new, len: self.len() });
        }
        self.check_present(&factor, new)?;
        factor.information = checked_information(&factor.information)?;
        self.push_pose(self.entries.len() as FactorId);
        self.push_factor(factor, Holders::All);
        Ok(new)
    }

    /// Starts a session that nothing links to the others yet: a pose that hangs on the origin alone.
    /// Say by the information how little is known of it. The first pose of all is the origin.
    pub fn add_anchor(
        &mut self,
        origin_from_new: Pose2,
        information: &Matrix3<f64>,
    ) -> Result<u32, SmoothError> {
        let j = self.next()?;
        self.add_pose_from(Factor { i: 0, j, i_from_j: origin_from_new, information: *information })
    }

    /// Adds a factor that a particle holds only if told so by [`super::Belief::hold`].
    pub fn add_factor(&mut self, mut factor: Factor) -> Result<FactorId, SmoothError> {
        factor.check(self.len())?;
        self.check_present(&factor, u32::MAX)?;
        factor.information = checked_information(&factor.information)?;
        u32::try_from(self.entries.len()).map_err(|_| SmoothError::TooLarge)?;
        Ok(self.push_factor(factor, Holders::Some))
    }

    /// Makes the factor that a pose started from one that a particle holds only if told so, and returns it.
    ///
    /// A particle that releases it holds another instead: of the same z, and of the information `wide`
    /// (1/m², 1/rad², frame of the factor's j), so that the pose stays tied to the others. A particle
    /// holds one of the two, never both: those that hold the tight one know what they knew before. All
    /// must be told so at once by [`super::Belief::hold_as_before`], which spoils no numbers, nor does
    /// this: no clique changes its shape. Loosened again ([`Structure::loosened`]) the factor is the same,
    /// `wide` is ignored, and nobody is to be told.
    ///
    /// Errors: no such pose, the first one, a marginalised one or one whose factor went with a
    /// marginalised neighbour ([`SmoothError::NoSuchFactor`]); `wide` no information matrix.
    pub fn loosen(&mut self, pose: u32, wide: &Matrix3<f64>) -> Result<FactorId, SmoothError> {
        self.check_pose(pose)?;
        let tight = self.starts[pose as usize];
        let information = checked_information(wide)?;
        let factor = match self.entries.get(tight as usize) {
            _ if pose == 0 => return Err(SmoothError::Needed(0)),
            Some(Entry::Between(factor, _)) => Factor { information, ..factor.clone() },
            _ => return Err(SmoothError::NoSuchFactor(tight)),
        };
        if self.loosened(pose).is_some() {
            return Ok(tight);
        }
        let id = u32::try_from(self.entries.len()).map_err(|_| SmoothError::TooLarge)?;
        self.holders[tight as usize] = Holders::Some;
        if self.tree.clique_of_factor[tight as usize] == super::tree::NONE {
            self.push_factor(factor, Holders::Others(tight));
            return Ok(tight);
        }
        // The poses are those of the tight one, and so is the clique.
        for p in [factor.i, factor.j] {
            self.stiffness[p as usize].take_up(&factor);
            self.of_pose[p as usize].push(id);
        }
        let z = At::new(factor.i_from_j);
        self.push_row(Entry::Between(factor, z), Holders::Others(tight));
        self.tree.stand_in(tight);
        Ok(tight)
    }

    /// What a pose started from, if that was loosened and is there.
    pub fn loosened(&self, pose: u32) -> Option<FactorId> {
        let id = *self.starts.get(pose as usize).filter(|_| pose > 0)?;
        self.factor(id).map(|_| id)
    }

    /// Takes a factor out for good. No particle may hold it any more. Of one that was loosened, all hold
    /// the other from now on.
    pub fn remove_factor(&mut self, id: FactorId) -> Result<(), SmoothError> {
        let factor = self.factor(id).ok_or(SmoothError::NoSuchFactor(id))?;
        let newer = factor.i.max(factor.j) as usize;
        if self.starts[newer] == id {
            let instead = |&&other: &&FactorId| self.holders[other as usize] == Holders::Others(id);
            if let Some(&other) = self.of_pose[newer].iter().find(instead) {
                self.holders[other as usize] = Holders::All;
                self.starts[newer] = other;
            }
        }
        self.remove(id);
        Ok(())
    }

    /// A present factor among those that particles hold or not.
    pub fn factor(&self, id: FactorId) -> Option<&Factor> {
        match self.entries.get(id as usize)? {
            Entry::Between(factor, _) if self.holders[id as usize] == Holders::Some => Some(factor),
            _ => None,
        }
    }

    /// Takes poses out; each leaves a prior on its neighbours, as each particle sees it when it is
    /// next updated, which every particle must be before the next call. Not the first pose, not the
    /// newest, none added since the last arrangement.
    pub fn marginalise(&mut self, poses: &[u32]) -> Result<(), SmoothError> {
        for &pose in poses {
            self.check_pose(pose)?;
            if pose == 0 || pose as usize + 1 == self.len() || self.new_poses.contains(&pose) {
                return Err(SmoothError::Needed(pose));
            }
        }
        self.marginalised_before += self.marginalised.len();
        self.marginalised.clear();
        for &pose in poses {
            if !std::mem::replace(&mut self.is_marginalised[pose as usize], true) {
                self.marginalise_one(pose);
            }
        }
        Ok(())
    }

    fn marginalise_one(&mut self, pose: u32) {
        let ids = self.of_pose[pose as usize].clone();
        let stiffness = self.stiffness[pose as usize];
        let factors: Vec<(FactorId, Entry)> = ids.into_iter().map(|id| (id, self.remove(id))).collect();
        let mut neighbours: Vec<u32> =
            factors.iter().flat_map(|(_, entry)| entry.poses()).filter(|&p| p != pose).collect();
        neighbours.sort_unstable();
        neighbours.dedup();
        for &p in &neighbours {
            for of in [&mut self.left_stiffness[p as usize], &mut self.stiffness[p as usize]] {
                of.per_m = of.per_m.max(stiffness.per_m);
                // From one neighbour to another it may be twice as far.
                of.per_rad = of.per_rad.max(2.0 * stiffness.per_rad);
            }
        }
        self.gone.push(pose);
        let prior = (neighbours.len() > 1).then(|| self.push_entry(Entry::Prior(neighbours), Holders::All));
        self.marginalised.push(Marginalised { pose, factors, prior });
    }

    /// Brings the tree up to date with all that was added and taken out.
    pub fn arrange(&mut self) {
        if self.new_poses.is_empty() && self.touched.is_empty() && self.gone.is_empty() {
            return;
        }
        self.epoch += 1;
        self.gone.sort_unstable();
        self.tree.remake(&self.entries, &self.touched, &self.new_poses, &self.new_factors, &self.gone);
        for list in [&mut self.new_poses, &mut self.new_factors, &mut self.touched, &mut self.gone] {
            list.clear();
        }
    }

    pub(super) fn check_pose(&self, pose: u32) -> Result<(), SmoothError> {
        match self.is_marginalised.get(pose as usize) {
            None => Err(SmoothError::NoSuchPose { pose, len: self.len() }),
            Some(true) => Err(SmoothError::Marginalised(pose)),
            Some(false) => Ok(()),
        }
    }

    fn check_present(&self, factor: &Factor, new: u32) -> Result<(), SmoothError> {
        [factor.i, factor.j].into_iter().filter(|&p| p != new).try_for_each(|p| self.check_pose(p))
    }

    fn next(&self) -> Result<u32, SmoothError> {
        u32::try_from(self.len()).map_err(|_| SmoothError::TooLarge)
    }

    fn push_pose(&mut self, start: FactorId) {
        let new = self.starts.len() as u32;
        self.starts.push(start);
        self.of_pose.push(Vec::new());
        self.stiffness.push(Stiffness::default());
        self.left_stiffness.push(Stiffness::default());
        self.is_marginalised.push(false);
        self.tree.clique_of.push(super::tree::NONE);
        if new > 0 {
            self.new_poses.push(new);
        }
    }

    fn push_factor(&mut self, factor: Factor, holders: Holders) -> FactorId {
        let z = At::new(factor.i_from_j);
        for p in [factor.i, factor.j] {
            self.stiffness[p as usize].take_up(&factor);
        }
        self.push_entry(Entry::Between(factor, z), holders)
    }

    fn push_entry(&mut self, entry: Entry, holders: Holders) -> FactorId {
        let id = self.entries.len() as FactorId;
        for p in entry.poses() {
            self.of_pose[p as usize].push(id);
            self.touched.push(p);
        }
        self.push_row(entry, holders);
        self.tree.clique_of_factor.push(super::tree::NONE);
        self.new_factors.push(id);
        id
    }

    fn push_row(&mut self, entry: Entry, holders: Holders) {
        self.log_weights.push(match &entry {
            Entry::Between(factor, _) => half_log_det(&factor.information),
            _ => 0.0,
        });
        self.entries.push(entry);
        self.holders.push(holders);
    }

    fn remove(&mut self, id: FactorId) -> Entry {
        let entry = std::mem::replace(&mut self.entries[id as usize], Entry::Removed);
        for p in entry.poses() {
            let of_pose = &mut self.of_pose[p as usize];
            of_pose.retain(|&f| f != id);
            let stiffness = &mut self.stiffness[p as usize];
            *stiffness = self.left_stiffness[p as usize];
            for &f in of_pose.iter() {
                if let Entry::Between(factor, _) = &self.entries[f as usize] {
                    stiffness.take_up(factor);
                }
            }
            self.touched.push(p);
        }
        self.new_factors.retain(|&f| f != id);
        entry
    }
}
