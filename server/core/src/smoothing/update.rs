//! Incremental update of a belief (iSAM2): cliques that changed are eliminated anew, steps follow by
//! back-substitution, and poses that left their linearisation points are linearised anew.

use crate::smoothing::belief::{Belief, Step};
use crate::smoothing::chunked::Chunked;
use crate::smoothing::factor::At;
use crate::smoothing::structure::{Stiffness, Structure};
use crate::smoothing::tree::{Clique, NONE};
use crate::smoothing::{SmoothError, qr};
use std::sync::Arc;

/// How hard an update tries. Where no unit is given, in standard deviations of a pose's stiffest
/// factor.
#[derive(Clone, Copy, Debug)]
pub(super) struct Effort {
    /// A step that changes by less is not passed on to the cliques below until changes add up to that.
    pub passed_on: f64,
    /// Poses whose factors err by more are linearised anew,
    pub far: f64,
    /// once there is one whose factors err by this.
    pub urgent: f64,
    /// So are poses that move by more, metres or radians: Jacobians follow the poses.
    pub moved: f64,
    /// Multiply-adds that linearising anew may cost; what is left waits for the next update.
    pub budget: u64,
}

impl Effort {
    /// For every step of a robot.
    pub const USUAL: Self =
        Self { passed_on: 0.001, far: 0.001, urgent: 0.001, moved: f64::INFINITY, budget: 5_000_000 };
    /// Where only the newest pose is read.
    pub const NEWEST: Self = Self { passed_on: 0.1, far: 0.03, urgent: 0.3, ..Self::USUAL };
    /// To the optimum, whatever it costs.
    pub const EXACT: Self = Self { passed_on: 0.0, far: 1e-10, urgent: 1e-10, moved: 1e-9, budget: u64::MAX };
}

/// Linearisations in one update, if the budget allows: more would mean that it does not converge.
const ROUNDS_MAX: u32 = 100;
/// Linearisations that bring nothing nearer, before smaller steps are taken.
const IN_VAIN_MAX: u32 = 5;
/// Share of the objective by which rounding may change it.
const STILL: f64 = 1e-6;
/// Arrangements by which poses other than the newest lag at least, before they are looked at.
const LAG: u64 = 10;
/// So many times what is urgent does not wait for that.
const AT_ONCE: f64 = 10.0;

/// What an update did.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Work {
    /// Poses eliminated anew.
    pub eliminated: u32,
    /// Poses linearised anew.
    pub relinearised: u32,
    /// Factors recalculated.
    pub factors: u32,
}

/// Cliques to eliminate anew, with their ranks.
type Dirty = Vec<(u64, u32)>;

impl Belief {
    /// Step 2 of Algorithm 1: the Gaussian (10) given all factors held. Poses far from their
    /// linearisation points are linearised anew, as many as the budget allows.
    ///
    /// On an error poses are those of the last solution that was found, and covariances are refused,
    /// until an update succeeds: let go of the factor that did not fit.
    pub fn update(&mut self, structure: &Structure) -> Result<Work, SmoothError> {
        self.update_by(structure, Effort::USUAL, true)
    }

    /// As [`Belief::update`] for who reads no pose but the newest: the others may lag, until some
    /// factors are no longer nearly linear or [`Belief::catch_up`] is called.
    pub fn update_newest(&mut self, structure: &Structure) -> Result<Work, SmoothError> {
        self.update_by(structure, Effort::NEWEST, false)
    }

    /// Does what [`Belief::update_newest`] put off. Costs least when few beliefs differ, as after
    /// resampling.
    pub fn catch_up(&mut self, structure: &Structure) -> Result<Work, SmoothError> {
        self.update_by(structure, Effort::NEWEST, true)
    }

    /// Does what an update's budget left.
    pub fn finish(&mut self, structure: &Structure) -> Result<Work, SmoothError> {
        self.update_by(structure, Effort { budget: u64::MAX, ..Effort::USUAL }, true)
    }

    /// Brings all poses to the optimum, whatever it costs.
    pub fn settle(&mut self, structure: &Structure) -> Result<Work, SmoothError> {
        self.update_by(structure, Effort::EXACT, true)
    }

    /// Makes anew the numbers that are not saved, and changes nothing else: for a belief just loaded.
    pub fn restore(&mut self, structure: &Structure) -> Result<(), SmoothError> {
        self.start_poses(structure);
        let mut all = Dirty::new();
        self.spoil_all(structure, &mut all);
        all.sort_unstable();
        self.eliminate(structure, &all, &mut Work::default())
    }

    fn update_by(&mut self, structure: &Structure, effort: Effort, all: bool) -> Result<Work, SmoothError> {
        let mut solved = None;
        let result = self.try_update(structure, effort, all, &mut solved);
        self.behind = result.is_err();
        if let (true, Some(solved)) = (self.behind, solved) {
            (self.points, self.steps) = solved;
        }
        result
    }

    fn try_update(
        &mut self,
        structure: &Structure,
        mut effort: Effort,
        all: bool,
        solved: &mut Option<(Chunked<At>, Chunked<Step>)>,
    ) -> Result<Work, SmoothError> {
        let mut work = Work::default();
        self.start_poses(structure);
        self.marginalise(structure)?;
        if self.fronts.len() == 0 {
            self.restore(structure)?;
        }
        let mut dirty = self.stale(structure);
        let mut descent = Descent { least: f64::INFINITY, in_vain: 0, chi2: f64::INFINITY, share: 1.0 };
        for _ in 0..ROUNDS_MAX {
            self.eliminate(structure, &dirty, &mut work)?;
            self.solve_top(structure, &dirty, &effort)?;
            let late = structure.epoch >= self.all_at + LAG || self.farthest > AT_ONCE * effort.urgent;
            if !(all || late && self.farthest > effort.urgent) {
                return Ok(work);
            }
            self.farthest = 0.0;
            self.solve_below(structure, &effort)?;
            self.all_at = structure.epoch;
            // To go back to if that leads nowhere.
            solved.get_or_insert_with(|| (self.points.clone(), self.steps.clone()));
            dirty = self.relinearise(structure, &mut effort, &mut descent, &mut work);
            if dirty.is_empty() {
                return Ok(work);
            }
        }
        Err(SmoothError::NotConverged)
    }

    /// Cliques made since the last update or with factors that changed, and all above them.
    fn stale(&mut self, structure: &Structure) -> Dirty {
        let tree = &structure.tree;
        self.fronts.resize(tree.cliques.len());
        let mut dirty = Dirty::new();
        if self.behind || self.epoch + 1 < structure.epoch {
            self.spoil_all(structure, &mut dirty);
        } else if self.epoch < structure.epoch {
            for &c in &tree.fresh {
                self.spoil(c, &tree.cliques[c as usize], &mut dirty);
            }
        }
        self.epoch = structure.epoch;
        for id in std::mem::take(&mut self.changed) {
            self.spoil_up(structure, tree.clique_of_factor[id as usize], &mut dirty);
        }
        dirty.sort_unstable();
        dirty
    }

    fn spoil_all(&mut self, structure: &Structure, dirty: &mut Dirty) {
        self.fronts.resize(structure.tree.cliques.len());
        for (c, clique) in structure.tree.cliques.iter().enumerate().filter(|(_, c)| c.frontals > 0) {
            self.spoil(c as u32, clique, dirty);
        }
    }

    fn spoil(&mut self, c: u32, clique: &Clique, dirty: &mut Dirty) {
        *self.fronts.make_mut(c as usize) = None;
        dirty.push((clique.rank, c));
    }

    /// Spoils a clique and those above up to the first spoilt one; returns the cost.
    fn spoil_up(&mut self, structure: &Structure, mut c: u32, dirty: &mut Dirty) -> u64 {
        let mut cost = 0;
        while c != NONE && self.fronts[c as usize].is_some() {
            let clique = &structure.tree.cliques[c as usize];
            self.spoil(c, clique, dirty);
            cost += clique.cost();
            c = clique.parent;
        }
        cost
    }

    fn eliminate(
        &mut self,
        structure: &Structure,
        dirty: &Dirty,
        work: &mut Work,
    ) -> Result<(), SmoothError> {
        for &(_, c) in dirty {
            let clique = &structure.tree.cliques[c as usize];
            work.eliminated += clique.frontals as u32;
            work.factors += clique.factors.len() as u32;
            let by_cholesky = self
                .assembled(structure, clique)
                .and_then(|mut front| front.eliminate().is_ok().then_some(front));
            let mut front = match by_cholesky {
                Some(front) => front,
                None => qr::eliminated(structure, self, clique)?,
            };
            front.sums = self.sums_of(structure, clique, &front);
            *self.fronts.make_mut(c as usize) = Some(Arc::new(front));
        }
        Ok(())
    }

    /// Back-substitution through the cliques eliminated anew, from the roots down.
    fn solve_top(
        &mut self,
        structure: &Structure,
        dirty: &Dirty,
        effort: &Effort,
    ) -> Result<(), SmoothError> {
        self.solution += 1;
        let mut x = Vec::new();
        for &(_, c) in dirty.iter().rev() {
            // Each step is kept here, however small, so that the newest pose is exact.
            self.solve_clique(structure, c, &Effort { passed_on: 0.0, ..*effort }, &mut x)?;
            let clique = |c: u32| &structure.tree.cliques[c as usize];
            let whole = |&&c: &&u32| dirty.binary_search(&(clique(c).rank, c)).is_err();
            let children = clique(c).children.iter().filter(whole);
            self.below.extend(children.map(|&c| (clique(c).serial, c)));
        }
        Ok(())
    }

    /// Back-substitution below, as far as steps change.
    fn solve_below(&mut self, structure: &Structure, effort: &Effort) -> Result<(), SmoothError> {
        let cliques = &structure.tree.cliques;
        let mut below = std::mem::take(&mut self.below);
        // Nothing is left out then, not even what earlier updates did not pass on.
        let exact = effort.passed_on <= 0.0;
        if exact {
            below.extend(
                cliques.iter().zip(0..).filter(|(c, _)| c.frontals > 0).map(|(c, at)| (c.serial, at)),
            );
        }
        let lives = |c: u32, serial| cliques[c as usize].serial == serial && cliques[c as usize].frontals > 0;
        below.retain(|&(serial, c)| lives(c, serial));
        below.sort_unstable_by_key(|&(_, c)| (cliques[c as usize].rank, c));
        below.dedup();
        let mut x = Vec::new();
        let mut seen = vec![0_u64; cliques.len() / 64 + 1];
        while let Some((_, c)) = below.pop() {
            let (word, bit) = (c as usize / 64, 1 << (c % 64));
            if seen[word] & bit != 0 {
                continue;
            }
            seen[word] |= bit;
            let clique = &cliques[c as usize];
            let moved = |&p: &u32| self.steps[p as usize].moved > self.all_solved;
            if exact || clique.separators().iter().any(moved) {
                self.solve_clique(structure, c, effort, &mut x)?;
                below.extend(clique.children.iter().map(|&c| (0, c)));
            }
        }
        self.all_solved = self.solution;
        Ok(())
    }

    /// Steps of a clique's frontals. Where they hardly change the old ones stay, so that changes add
    /// up.
    fn solve_clique(
        &mut self,
        structure: &Structure,
        c: u32,
        effort: &Effort,
        x: &mut Vec<f64>,
    ) -> Result<(), SmoothError> {
        let clique = &structure.tree.cliques[c as usize];
        let front = self.fronts[c as usize].as_ref().ok_or(SmoothError::Behind)?;
        x.clear();
        x.extend(clique.poses.iter().flat_map(|&p| self.steps[p as usize].by));
        front.solve_back(x);
        if x.iter().any(|v| !v.is_finite()) {
            return Err(SmoothError::NotConverged);
        }
        for (k, &p) in clique.poses[..clique.frontals].iter().enumerate() {
            let step = [x[3 * k], x[3 * k + 1], x[3 * k + 2]];
            let old = &self.steps[p as usize].by;
            let change = step.iter().zip(old).map(|(new, old)| (new - old).abs()).fold(0.0, f64::max);
            let stiffness = &structure.stiffness[p as usize];
            let passed_on = change * stiffness.per_m > effort.passed_on;
            // One that stays may mind more than it did, for a new factor.
            let by = farness(if passed_on { &step } else { old }, stiffness);
            if by > Effort::USUAL.far
                && let Err(at) = self.strayed.binary_search(&p)
            {
                self.strayed.insert(at, p);
            }
            if passed_on {
                self.farthest = self.farthest.max(by);
                *self.steps.make_mut(p as usize) = Step { by: step, moved: self.solution };
            }
        }
        Ok(())
    }

    /// Poses that are to be linearised anew, and how far they went.
    fn far(&mut self, structure: &Structure, effort: &Effort) -> Vec<(f64, u32)> {
        let stray = |p: u32| farness(&self.steps[p as usize].by, &structure.stiffness[p as usize]);
        let mut strayed = std::mem::take(&mut self.strayed);
        strayed.retain(|&p| !structure.is_marginalised[p as usize] && stray(p) > Effort::USUAL.far);
        let by = |p: u32| {
            let step = self.steps[p as usize].by.iter().fold(0.0, |most: f64, v| most.max(v.abs()));
            (stray(p).max(effort.far * (step / effort.moved)), p)
        };
        let is_far = |&(by, p): &(f64, u32)| by > effort.far && !structure.is_marginalised[p as usize];
        // Less than an update minds: of any pose.
        let far = if effort.far < Effort::USUAL.far {
            (0..self.steps.len() as u32).map(by).filter(is_far).collect()
        } else {
            strayed.iter().copied().map(by).filter(is_far).collect()
        };
        self.strayed = strayed;
        far
    }

    /// Linearises the poses farthest from their points anew, as many as the budget allows.
    fn relinearise(
        &mut self,
        structure: &Structure,
        effort: &mut Effort,
        descent: &mut Descent,
        work: &mut Work,
    ) -> Dirty {
        let mut far = self.far(structure, effort);
        far.sort_unstable_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
        self.pending = false;
        let mut dirty = Dirty::new();
        if descent.ends(far.first().map_or(0.0, |(by, _)| *by), || self.chi2(structure)) {
            return dirty;
        }
        for (_, p) in far {
            let held = structure.of_pose[p as usize].iter().filter(|&&id| self.has(structure, id));
            let cliques: Vec<u32> = held.map(|&id| structure.tree.clique_of_factor[id as usize]).collect();
            // Where all is spoilt anyway it costs nothing.
            if effort.budget == 0 && cliques.iter().any(|&c| self.fronts[c as usize].is_some()) {
                self.pending = true;
                continue;
            }
            for c in cliques {
                let cost = self.spoil_up(structure, c, &mut dirty);
                effort.budget = effort.budget.saturating_sub(cost);
            }
            let step = self.steps[p as usize].by.map(|v| descent.share * v);
            let point = self.points.make_mut(p as usize);
            *point = At::new(point.moved(&step));
            self.steps.make_mut(p as usize).by = [0.0; 3];
            work.relinearised += 1;
        }
        dirty.sort_unstable();
        dirty
    }
}

/// Whether linearising anew leads somewhere.
struct Descent {
    /// How far the farthest pose was from its linearisation point, at best.
    least: f64,
    /// Linearisations since then.
    in_vain: u32,
    /// The objective when last nothing came nearer.
    chi2: f64,
    /// Of each step that is taken.
    share: f64,
}

impl Descent {
    /// Looks at how far the farthest pose is. Where that gets no better and the objective neither, what
    /// is left is rounding. Before, steps may overshoot: smaller ones are taken.
    fn ends(&mut self, by: f64, chi2: impl Fn() -> f64) -> bool {
        self.in_vain = if by < self.least { 0 } else { self.in_vain + 1 };
        self.least = self.least.min(by);
        if self.in_vain < IN_VAIN_MAX {
            return false;
        }
        (self.least, self.in_vain) = (by, 0);
        self.share *= 0.5;
        let before = std::mem::replace(&mut self.chi2, chi2());
        (before - self.chi2).abs() <= STILL * (1.0 + self.chi2)
    }
}

/// By how many standard deviations the linearised factors of a pose err at most after a step: a
/// turn by φ stretches an arm ℓ by ℓφ²/2, and turns a shift by φ times it.
fn farness(step: &[f64; 3], stiffness: &Stiffness) -> f64 {
    let (shift_m, turn_rad) = ((step[0] * step[0] + step[1] * step[1]).sqrt(), step[2].abs());
    turn_rad * (0.5 * stiffness.per_rad * turn_rad + stiffness.per_m * shift_m)
}
