//! The Bayes tree's shape: cliques of poses, and how the top of it is made anew.
//!
//! Kaess et al. (IJRR 2012): a clique holds the poses eliminated together (frontals) and those that
//! they depend on (separators), all of which are in its parent. A new factor touches only the
//! cliques from its poses up to the root; that top is cut off, ordered anew and re-attached to the
//! subtrees below it (orphans), which stay as they are.

use crate::smoothing::factor::At;
use crate::smoothing::order::Order;
use crate::smoothing::{Factor, FactorId};
use serde::{Deserialize, Serialize};

/// No clique; in a [`Share`], the origin.
pub(super) const NONE: u32 = u32::MAX;
/// Poses eliminated together at most: a larger clique would be redone for one of its poses.
const FRONTALS_MAX: usize = 8;

/// Some poses given others.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub(super) struct Clique {
    /// Frontals, then separators, each in elimination order.
    pub poses: Vec<u32>,
    /// Number of frontals.
    pub frontals: usize,
    pub parent: u32,
    pub children: Vec<u32>,
    /// Where its separators are among its parent's poses.
    pub slots: Vec<u32>,
    /// Factors whose poses are all here and whose first eliminated one is a frontal.
    pub factors: Vec<Share>,
    /// Never reused, as numbers of cliques are: tells a belief whether it is the one that lagged.
    pub serial: u32,
    /// A child's is below its parent's.
    pub rank: u64,
}

/// A factor in a clique: the places of its poses among the clique's, [`NONE`] for the origin.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct Share {
    pub id: FactorId,
    pub at: Places,
}

/// Places of a factor's poses in a front.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) enum Places {
    Two(u32, u32),
    Many(Vec<u32>),
}

/// A factor as all particles know it.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) enum Entry {
    /// A measurement, with its z ready for use.
    Between(Factor, At),
    /// What marginalised poses left on these; the numbers are each belief's own.
    Prior(Vec<u32>),
    Removed,
}

impl Entry {
    /// Its poses, the origin among them.
    pub fn poses(&self) -> impl Iterator<Item = u32> {
        let (pair, many): (Option<[u32; 2]>, &[u32]) = match self {
            Self::Between(f, _) => (Some([f.i, f.j]), &[]),
            Self::Prior(poses) => (None, poses),
            Self::Removed => (None, &[]),
        };
        pair.into_iter().flatten().chain(many.iter().copied())
    }
}

impl Clique {
    pub fn separators(&self) -> &[u32] {
        &self.poses[self.frontals..]
    }

    /// Multiply-adds to eliminate it, about.
    pub fn cost(&self) -> u64 {
        let (f, n) = (self.frontals as u64, self.poses.len() as u64);
        27 * f * n * n / 2 + 200 * self.factors.len() as u64 + 200
    }
}

/// All cliques.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub(super) struct Tree {
    pub cliques: Vec<Clique>,
    free: Vec<u32>,
    /// The clique where each pose is a frontal; [`NONE`] for the origin.
    pub clique_of: Vec<u32>,
    /// By factor.
    pub clique_of_factor: Vec<u32>,
    /// Cliques made last, children first.
    pub fresh: Vec<u32>,
    /// Cliques without a parent.
    pub roots: Vec<u32>,
    serial: u32,
    rank: u64,
    #[serde(skip)]
    work: Work,
}

/// Work space of [`Tree::remake`]; a copy of a tree begins with none.
#[derive(Debug, Default)]
struct Work {
    order: Order,
    /// Local number of a pose, or place in a front.
    local: Vec<u32>,
    /// Poses by local number.
    poses: Vec<u32>,
    factors: Vec<FactorId>,
    orphans: Vec<u32>,
    /// Place in the elimination order by local number.
    place: Vec<u32>,
    /// Of each column: the next one of its group, itself at the end; then its clique.
    group: Vec<u32>,
    ends_group: Vec<bool>,
    /// Poses of new factors, local.
    late: Vec<u32>,
}

impl Clone for Work {
    fn clone(&self) -> Self {
        Self::default()
    }
}

impl Work {
    /// Groups columns into cliques: one joins its parent where it has nearly the same others. The
    /// newest pose stays alone, since it is touched at every step.
    fn group(&mut self) {
        let Self { order, ends_group, .. } = self;
        let columns = order.columns.len();
        self.place.resize(columns.max(self.place.len()), 0);
        self.group.clear();
        self.group.extend(0..columns as u32);
        ends_group.clear();
        ends_group.resize(columns, true);
        let mut size = vec![1; columns];
        for c in 0..columns - 1 {
            let met = order.elements[order.given + c].len();
            let joins = |&e: &usize| {
                // Zeros that joining adds, and what the columns have then.
                let zeros = size[e] * (met + 1 - order.elements[order.given + e].len());
                size[e] < FRONTALS_MAX && 5 * zeros <= 2 * (met + 1 + size[e])
            };
            let children = order.columns[c].elements.iter();
            let children = children.filter_map(|&e| (e as usize).checked_sub(order.given));
            if let Some(child) = children.filter(joins).max_by_key(|&e| size[e]) {
                self.group[child] = c as u32;
                ends_group[child] = false;
                size[c] = size[child] + 1;
            }
        }
    }
}

impl Tree {
    /// Makes the top anew: the cliques from `touched` poses to their roots, with `new_poses` and
    /// `new_factors`. Removed factors and poses in `gone` drop out.
    pub fn remake(
        &mut self,
        entries: &[Entry],
        touched: &[u32],
        new_poses: &[u32],
        new_factors: &[FactorId],
        gone: &[u32],
    ) {
        let mut work = std::mem::take(&mut self.work);
        let affected = self.cut(touched, &mut work);
        work.poses.extend_from_slice(new_poses);
        work.factors.extend_from_slice(new_factors);
        if !gone.is_empty() {
            work.poses.retain(|p| gone.binary_search(p).is_err());
        }
        self.roots.retain(|&c| self.cliques[c as usize].frontals > 0);
        work.local.resize(self.clique_of.len(), NONE);
        self.fresh.clear();
        if !work.poses.is_empty() {
            self.order(entries, &mut work, new_factors.len());
            work.group();
            self.build(entries, &mut work);
            self.roots.extend(self.fresh.iter().filter(|&&c| self.cliques[c as usize].parent == NONE));
        }
        self.free.extend(affected);
        self.work = work;
    }

    /// Places a factor, the newest, beside one of the same poses, in a clique that keeps its shape.
    pub fn stand_in(&mut self, beside: FactorId) {
        let id = self.clique_of_factor.len() as FactorId;
        let number = self.clique_of_factor[beside as usize];
        self.clique_of_factor.push(number);
        let Some(clique) = self.cliques.get_mut(number as usize) else { return };
        if let Some(share) = clique.factors.iter().find(|share| share.id == beside) {
            let at = share.at.clone();
            clique.factors.push(Share { id, at });
        }
    }

    /// Takes off the cliques above the touched poses; returns them, emptied of their content.
    fn cut(&mut self, touched: &[u32], work: &mut Work) -> Vec<u32> {
        work.poses.clear();
        work.factors.clear();
        work.orphans.clear();
        let mut affected = Vec::new();
        for &pose in touched {
            let mut c = self.clique_of[pose as usize];
            // A clique already cut off has no frontals.
            while c != NONE && self.cliques[c as usize].frontals > 0 {
                let clique = &mut self.cliques[c as usize];
                work.poses.extend_from_slice(&clique.poses[..clique.frontals]);
                work.factors.extend(clique.factors.drain(..).map(|share| share.id));
                clique.frontals = 0;
                affected.push(c);
                c = clique.parent;
            }
        }
        for &c in &affected {
            let children = std::mem::take(&mut self.cliques[c as usize].children);
            let whole = |&&child: &&u32| self.cliques[child as usize].frontals > 0;
            work.orphans.extend(children.iter().filter(whole));
        }
        affected
    }

    /// Orders the poses of the top.
    fn order(&self, entries: &[Entry], work: &mut Work, new_factors: usize) {
        let Work { order, local, poses, factors, orphans, late, .. } = work;
        let mut newest = 0;
        for (k, &p) in poses.iter().enumerate() {
            local[p as usize] = k as u32;
            newest = if p > poses[newest] { k } else { newest };
        }
        order.clear(poses.len());
        for &orphan in orphans.iter() {
            let separators = self.cliques[orphan as usize].separators();
            order.element(separators.iter().map(|&p| local[p as usize]));
        }
        factors.retain(|&id| !matches!(entries[id as usize], Entry::Removed));
        for &id in factors.iter() {
            match &entries[id as usize] {
                Entry::Between(f, _) if f.i != 0 && f.j != 0 => {
                    order.join(local[f.i as usize], local[f.j as usize]);
                }
                Entry::Prior(all) => {
                    order.element(all.iter().filter(|&&p| p != 0).map(|&p| local[p as usize]));
                }
                _ => {}
            }
        }
        late.clear();
        let ends = factors[factors.len() - new_factors..].iter().flat_map(|&id| entries[id as usize].poses());
        late.extend(ends.filter(|&p| p != 0).map(|p| local[p as usize]));
        order.run(late, newest as u32);
    }

    /// Makes the cliques: one per group of columns, children first.
    fn build(&mut self, entries: &[Entry], work: &mut Work) {
        let Work { order, local, poses, factors, orphans, place, group, ends_group, .. } = work;
        for (k, column) in order.columns.iter().enumerate() {
            place[column.pose as usize] = k as u32;
            if group[k] == k as u32 {
                let number = self.empty(k as u64);
                self.fresh.push(number);
                group[k] = number;
            }
        }
        // Groups point to their last column, which has the number by now.
        for k in (0..order.columns.len()).rev() {
            if !ends_group[k] {
                group[k] = group[group[k] as usize];
            }
        }
        self.rank += order.columns.len() as u64;
        for (k, column) in order.columns.iter().enumerate() {
            let number = group[k];
            let pose = poses[column.pose as usize];
            self.clique_of[pose as usize] = number;
            self.cliques[number as usize].poses.push(pose);
            for &element in &column.elements {
                let child = match (element as usize).checked_sub(order.given) {
                    None => orphans.get(element as usize).copied(),
                    Some(column) => Some(group[column]),
                };
                if let Some(child) = child.filter(|&child| child != number) {
                    self.cliques[child as usize].parent = number;
                    self.cliques[number as usize].children.push(child);
                }
            }
        }
        for &id in factors.iter() {
            let first = |p: &u32| place[local[*p as usize] as usize];
            let first = entries[id as usize].poses().filter(|&p| p != 0).map(|p| first(&p)).min();
            if let Some(first) = first {
                self.clique_of_factor[id as usize] = group[first as usize];
                let share = Share { id, at: Places::Two(NONE, NONE) };
                self.cliques[group[first as usize] as usize].factors.push(share);
            }
        }
        for (k, _) in order.columns.iter().enumerate().filter(|&(k, _)| ends_group[k]) {
            let separators = &mut order.elements[order.given + k];
            separators.sort_unstable_by_key(|&p| place[p as usize]);
            let clique = &mut self.cliques[group[k] as usize];
            clique.frontals = clique.poses.len();
            clique.poses.extend(separators.iter().map(|&p| poses[p as usize]));
        }
        for k in 0..self.fresh.len() {
            self.place(self.fresh[k], entries, local);
        }
    }

    /// An empty clique's number.
    fn empty(&mut self, column: u64) -> u32 {
        let number = self.free.pop().unwrap_or_else(|| {
            self.cliques.push(Clique::default());
            self.cliques.len() as u32 - 1
        });
        self.serial += 1;
        let clique = &mut self.cliques[number as usize];
        (clique.serial, clique.rank, clique.parent) = (self.serial, self.rank + column, NONE);
        clique.poses.clear();
        clique.slots.clear();
        clique.children.clear();
        number
    }

    /// Finds where a clique's factors and children go in it.
    fn place(&mut self, number: u32, entries: &[Entry], at: &mut [u32]) {
        let mut clique = std::mem::take(&mut self.cliques[number as usize]);
        for (k, &p) in clique.poses.iter().enumerate() {
            at[p as usize] = k as u32;
        }
        for &child in &clique.children {
            let child = &mut self.cliques[child as usize];
            child.slots.clear();
            child.slots.extend(child.poses[child.frontals..].iter().map(|&p| at[p as usize]));
        }
        let place = |p: u32| if p == 0 { NONE } else { at[p as usize] };
        for share in &mut clique.factors {
            share.at = match &entries[share.id as usize] {
                Entry::Between(f, _) => Places::Two(place(f.i), place(f.j)),
                Entry::Prior(poses) => Places::Many(poses.iter().map(|&p| place(p)).collect()),
                Entry::Removed => Places::Many(Vec::new()),
            };
        }
        self.cliques[number as usize] = clique;
    }
}
