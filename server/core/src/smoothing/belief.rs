//! One particle's Gaussian over its poses: linearisation points, steps from them, and the numbers
//! of each clique.

use crate::geometry::Pose2;
use crate::smoothing::chunked::Chunked;
use crate::smoothing::factor::{At, residual};
use crate::smoothing::frames::Frames;
use crate::smoothing::front::Front;
use crate::smoothing::marginal::Prior;
use crate::smoothing::structure::{Holders, Structure};
use crate::smoothing::sums::Sums;
use crate::smoothing::tree::{Clique, Entry, NONE, Places, Share};
use crate::smoothing::{Factor, FactorId, SmoothError};
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// δ of a pose.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
pub(super) struct Step {
    /// Metres, metres, radians in the frame of the linearisation point.
    pub by: [f64; 3],
    /// Solution in which it last changed.
    pub moved: u32,
}

/// One particle's numbers. A clone shares everything with its original until one of them changes.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct Belief {
    /// Where the frames of linearisation points are.
    frames: Frames,
    /// Linearisation points, each in its frame.
    pub(super) points: Chunked<At>,
    pub(super) steps: Chunked<Step>,
    /// Factors held, a bit each.
    held: Chunked<u64>,
    /// By prior's factor.
    pub(super) priors: Arc<Vec<(FactorId, Arc<Prior>)>>,
    /// By clique. Not saved: they follow from the rest.
    #[serde(skip)]
    pub(super) fronts: Chunked<Option<Arc<Front>>>,
    /// The structure's arrangement that these are for.
    pub(super) epoch: u64,
    /// Number of solutions.
    pub(super) solution: u32,
    /// Factors held or let go since the last update.
    pub(super) changed: Vec<FactorId>,
    /// Poses that may be farther from their linearisation points than an update minds, in order: it looks at
    /// these alone.
    pub(super) strayed: Vec<u32>,
    /// Whether poses far from their linearisation points wait for their turn.
    pub(super) pending: bool,
    marginalised: usize,
    /// What marginalised poses left of the evidence.
    pub(super) left: Sums,
    /// Cliques below those solved anew whose poses lag, with their serials.
    pub(super) below: Vec<(u32, u32)>,
    /// Solution, and arrangement, at which no pose lagged.
    pub(super) all_solved: u32,
    pub(super) all_at: u64,
    /// How far a pose went since then, in standard deviations.
    pub(super) farthest: f64,
    /// Whether the last update failed, so that the next one has all to do.
    pub(super) behind: bool,
}

impl Belief {
    /// Without poses.
    pub fn new() -> Self {
        Self::default()
    }

    /// Holds a factor of the structure from the next update on.
    pub fn hold(&mut self, id: FactorId) {
        self.set_held(id, true);
    }

    /// Goes on to hold a factor that [`Structure::loosen`] has just made one that not all hold. Any other
    /// time it takes [`Belief::hold`].
    pub fn hold_as_before(&mut self, id: FactorId) {
        self.mark_held(id, true);
    }

    /// Moves all poses from one on as a whole: what was at p is at `moved ∘ p` (origin's frame: metres,
    /// radians). From there the next update goes on, which has to solve anew only what the factors
    /// between the moved and the others reach. For a start near an optimum that is far: no step is
    /// too long for it, no turn too wide. What is held does not change.
    ///
    /// Errors: the first pose, which is the origin; a pose that it has not been updated with;
    /// numbers that are not finite. Nothing moves then.
    pub fn rebase(&mut self, structure: &Structure, from: u32, moved: &Pose2) -> Result<(), SmoothError> {
        if from == 0 {
            return Err(SmoothError::Needed(0));
        }
        if from as usize >= self.len() {
            return Err(SmoothError::NoSuchPose { pose: from, len: self.len() });
        }
        if !moved.is_finite() {
            return Err(SmoothError::NotFinite);
        }
        self.frames.rebase(from, moved);
        let of_moved = structure.of_pose.iter().take(self.len()).skip(from as usize).flatten();
        let crosses = |id: &&FactorId| {
            self.has(structure, **id) && structure.entries[**id as usize].poses().any(|p| p < from)
        };
        let crossing: Vec<FactorId> = of_moved.filter(crosses).copied().collect();
        self.changed.extend(crossing);
        Ok(())
    }

    /// Lets a factor go from the next update on.
    pub fn release(&mut self, id: FactorId) {
        self.set_held(id, false);
    }

    fn set_held(&mut self, id: FactorId, held: bool) {
        if self.mark_held(id, held) {
            self.changed.push(id);
        }
    }

    /// Returns whether that is new.
    fn mark_held(&mut self, id: FactorId, held: bool) -> bool {
        if self.holds(id) == held {
            return false;
        }
        let (word, bit) = (id as usize / 64, id % 64);
        while self.held.len() <= word {
            self.held.push(0);
        }
        *self.held.make_mut(word) ^= 1 << bit;
        true
    }

    /// Whether it holds a factor.
    pub fn holds(&self, id: FactorId) -> bool {
        self.held.get(id as usize / 64).is_some_and(|word| word >> (id % 64) & 1 == 1)
    }

    /// Whether some poses wait to be linearised anew: another update would bring it nearer to the
    /// optimum.
    pub fn pending(&self) -> bool {
        self.pending
    }

    /// What tells each clique's numbers from others: beliefs share those that are equal.
    pub fn front_ids(&self) -> impl Iterator<Item = usize> {
        self.fronts.iter().flatten().map(|front| Arc::as_ptr(front) as usize)
    }

    /// Pose i: origin_from_i; of a marginalised one, as it was last. Indexes like a slice.
    pub fn pose(&self, i: u32) -> Pose2 {
        self.frames.outward(i, self.points[i as usize].moved(&self.steps[i as usize].by))
    }

    /// All poses.
    pub fn poses(&self) -> Vec<Pose2> {
        let moved = self.points.iter().zip(self.steps.iter()).map(|(point, step)| point.moved(&step.by));
        (0..).zip(moved).map(|(i, pose)| self.frames.outward(i, pose)).collect()
    }

    /// Number of poses.
    pub fn len(&self) -> usize {
        self.points.len()
    }

    /// Whether there is no pose yet.
    pub fn is_empty(&self) -> bool {
        self.points.len() == 0
    }

    /// The objective at the poses: `Σ eᵀ Ω e` over the factors held.
    pub fn chi2(&self, structure: &Structure) -> f64 {
        let poses: Vec<At> = self.poses().into_iter().map(At::new).collect();
        let cost = |(id, entry): (usize, &Entry)| match entry {
            Entry::Between(f, z) if self.has(structure, id as FactorId) => {
                f.cost(z, &poses[f.i as usize], &poses[f.j as usize])
            }
            _ => 0.0,
        };
        structure.entries.iter().enumerate().map(cost).sum()
    }

    pub(super) fn has(&self, structure: &Structure, id: FactorId) -> bool {
        match structure.holders[id as usize] {
            Holders::All => true,
            Holders::Some => self.holds(id),
            Holders::Others(tight) => !self.holds(tight),
        }
    }

    /// New poses begin where the factor says that they were added with.
    pub(super) fn start_poses(&mut self, structure: &Structure) {
        for k in self.len()..structure.len() {
            let pose = match structure.entries.get(structure.starts[k] as usize) {
                Some(Entry::Between(f, _)) if k > 0 && f.j as usize == k => {
                    self.pose(f.i).compose(&f.i_from_j)
                }
                Some(Entry::Between(f, _)) if k > 0 => self.pose(f.j).compose(&f.i_from_j.inverse()),
                _ => Pose2::default(),
            };
            self.points.push(At::new(self.frames.inward(k as u32, pose)));
            self.steps.push(Step::default());
        }
    }

    pub(super) fn marginalise(&mut self, structure: &Structure) -> Result<(), SmoothError> {
        let all = structure.marginalised_before + structure.marginalised.len();
        if self.marginalised == all {
            return Ok(());
        }
        if self.marginalised < structure.marginalised_before {
            return Err(SmoothError::Behind);
        }
        let from = self.marginalised - structure.marginalised_before;
        for one in &structure.marginalised[from..] {
            let (sums, prior) = Prior::left_by(one, structure, self)?;
            self.left += sums;
            if let (Some(id), Some(prior)) = (one.prior, prior) {
                Arc::make_mut(&mut self.priors).push((id, Arc::new(prior)));
            }
        }
        self.marginalised = all;
        // Those of which priors have been made since.
        let present = |id: FactorId| !matches!(structure.entries[id as usize], Entry::Removed);
        Arc::make_mut(&mut self.priors).retain(|(id, _)| present(*id));
        Ok(())
    }

    /// A clique's front before elimination: its factors and what its children leave. None where sums
    /// would lose digits.
    pub(super) fn assembled(&self, structure: &Structure, clique: &Clique) -> Option<Front> {
        let mut front = Front::new(clique.poses.len(), clique.frontals);
        for share in &clique.factors {
            self.add_factor(structure, share, &mut front);
        }
        for &child in &clique.children {
            if let Some(numbers) = &self.fronts[child as usize] {
                if numbers.root().is_some() {
                    return None;
                }
                front.take_up(numbers, &structure.tree.cliques[child as usize].slots);
            }
        }
        let drowns = |share: &Share| match (&structure.entries[share.id as usize], &share.at) {
            (Entry::Between(f, _), &Places::Two(i, j)) if self.has(structure, share.id) => {
                [i, j].into_iter().any(|p| p != NONE && front.drowns(p as usize, &f.information))
            }
            _ => false,
        };
        (!clique.factors.iter().any(drowns)).then_some(front)
    }

    fn add_factor(&self, structure: &Structure, share: &Share, front: &mut Front) {
        match (&structure.entries[share.id as usize], &share.at) {
            (Entry::Between(f, z), &Places::Two(i, j)) if self.has(structure, share.id) => {
                let [at_i, at_j] = self.points_of(f);
                let part = residual(z, &at_i, &at_j).weighted(&f.information);
                if i != NONE {
                    front.add(i as usize, i as usize, &part.h_ii);
                    front.add_rhs(i as usize, &part.b_i);
                }
                if j != NONE {
                    front.add(j as usize, j as usize, &part.h_jj);
                    front.add_rhs(j as usize, &part.b_j);
                }
                if i != NONE && j != NONE {
                    front.add(i as usize, j as usize, &part.h_ij);
                }
            }
            (Entry::Prior(poses), Places::Many(places)) => {
                if let Some(prior) = self.prior(share.id) {
                    prior.add_to(front, poses, places, self.points_among(poses));
                }
            }
            _ => {}
        }
    }

    /// Linearisation points of a factor's two poses, as seen from somewhere.
    pub(super) fn points_of(&self, f: &Factor) -> [At; 2] {
        let poses = [f.i, f.j];
        poses.map(self.points_among(&poses))
    }

    /// Linearisation points of some poses, as seen from somewhere: from within their frame if they share it,
    /// since there they are what they were, to the bit, before it moved.
    pub(super) fn points_among(&self, poses: &[u32]) -> impl Fn(u32) -> At {
        let within = self.frames.one_has(poses);
        move |p| {
            let point = self.points[p as usize];
            if within { point } else { At::new(self.frames.outward(p, point.pose)) }
        }
    }

    pub(super) fn prior(&self, id: FactorId) -> Option<&Prior> {
        let k = self.priors.binary_search_by_key(&id, |(id, _)| *id).ok()?;
        Some(&self.priors[k].1)
    }
}
