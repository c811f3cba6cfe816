//! What a marginalised pose leaves: a Gaussian over its neighbours' poses relative to one of them.
//!
//! Eliminating pose v from its factors gives `cost(ξ) = ξᵀ H ξ − 2 bᵀ ξ` in small steps ξ of its
//! neighbours from where they were. Measured from one neighbour r, `ξᵢ = zᵢ⁻¹ · x_r⁻¹xᵢ`, it stays true
//! when a later loop turns and moves all of them together. With one neighbour beside r it is a
//! between-factor. r is one that v held well: from one hardly known relative to the others, or not at
//! all where a particle lacks the factor, the others would seem to bend when they turn together.

use crate::smoothing::factor::{At, Linearised, Residual, residual};
use crate::smoothing::front::Front;
use crate::smoothing::structure::{Marginalised, Structure};
use crate::smoothing::sums::Sums;
use crate::smoothing::tree::{Entry, NONE};
use crate::smoothing::{Belief, SmoothError};
use nalgebra::{DMatrix, DVector};
use serde::{Deserialize, Serialize};

/// Share of the best held neighbour's information with which another will do as the reference.
const HELD_WELL: f64 = 0.3;

/// A Gaussian over poses relative to one of a list.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct Prior {
    /// r: its place in the list.
    reference: usize,
    /// zᵢ of the others.
    z: Vec<At>,
    /// H and b, three rows a pose of `z`.
    h: DMatrix<f64>,
    b: DVector<f64>,
}

/// A system over some poses, three rows each.
struct System {
    h: DMatrix<f64>,
    b: DVector<f64>,
}

impl System {
    fn zeros(poses: usize) -> Self {
        Self { h: DMatrix::zeros(3 * poses, 3 * poses), b: DVector::zeros(3 * poses) }
    }

    /// Of a pose's factors, at the belief's estimate: the pose itself first, then its neighbours.
    fn of(one: &Marginalised, poses: &[u32], structure: &Structure, belief: &Belief) -> (Self, Sums) {
        // In the frame of the pose itself, which loses no digits far from the origin.
        let own = belief.pose(one.pose);
        let at = |p: u32| At::new(own.between(&belief.pose(p)));
        let place = |p: u32| poses.binary_search(&p).map_or(0, |k| k + 1);
        let (mut system, mut sums) = (Self::zeros(poses.len() + 1), Sums::default());
        for (id, entry) in one.factors.iter().filter(|(id, _)| belief.has(structure, *id)) {
            let places: Vec<usize> = entry.poses().map(place).collect();
            match entry {
                Entry::Between(f, z) => {
                    let r = residual(z, &at(f.i), &at(f.j));
                    sums += Sums::of_factor(&r.error, &f.information, structure.log_weights[*id as usize]);
                    system.add(&Self::of_factor(&r.weighted(&f.information)), &places);
                }
                Entry::Prior(of) => {
                    if let Some(prior) = belief.prior(*id) {
                        sums.chi2 += prior.cost(of, at);
                        system.add(&prior.linearised(of, at), &places);
                    }
                }
                Entry::Removed => {}
            }
        }
        (system, sums)
    }

    fn of_factor(part: &Linearised) -> Self {
        let mut two = Self::zeros(2);
        two.h.fixed_view_mut::<3, 3>(0, 0).copy_from(&part.h_ii);
        two.h.fixed_view_mut::<3, 3>(0, 3).copy_from(&part.h_ij);
        two.h.fixed_view_mut::<3, 3>(3, 0).copy_from(&part.h_ij.transpose());
        two.h.fixed_view_mut::<3, 3>(3, 3).copy_from(&part.h_jj);
        two.b.fixed_rows_mut::<3>(0).copy_from(&part.b_i);
        two.b.fixed_rows_mut::<3>(3).copy_from(&part.b_j);
        two
    }

    /// Adds a system over the poses at `places`.
    fn add(&mut self, part: &Self, places: &[usize]) {
        for (a, &r) in places.iter().enumerate() {
            let mut b = self.b.fixed_rows_mut::<3>(3 * r);
            b += part.b.fixed_rows::<3>(3 * a);
            for (k, &c) in places.iter().enumerate() {
                let mut block = self.h.fixed_view_mut::<3, 3>(3 * r, 3 * c);
                block += part.h.fixed_view::<3, 3>(3 * a, 3 * k);
            }
        }
    }

    /// Which pose but the first is held well by the first: the earliest of those held not much worse
    /// than the best. Counted from zero.
    fn well_held(&self) -> usize {
        let n = self.b.len();
        let held = |k: usize| self.h[(k, k)] + self.h[(k + 1, k + 1)];
        let best = (3..n).step_by(3).map(held).fold(0.0, f64::max);
        (3..n).step_by(3).position(|k| held(k) >= HELD_WELL * best).unwrap_or(0)
    }
}

impl Prior {
    /// What a pose's factors leave at the belief's estimate: of the evidence, and the prior on its
    /// neighbours where there are some.
    pub fn left_by(
        one: &Marginalised,
        structure: &Structure,
        belief: &Belief,
    ) -> Result<(Sums, Option<Self>), SmoothError> {
        let mut poses: Vec<u32> = one.factors.iter().flat_map(|(_, entry)| entry.poses()).collect();
        poses.sort_unstable();
        poses.dedup();
        poses.retain(|&p| p != one.pose);
        let (system, mut sums) = System::of(one, &poses, structure, belief);
        let pivot = system.h.fixed_view::<3, 3>(0, 0).into_owned();
        sums.eliminate(&pivot, &system.b.fixed_rows::<3>(0).into_owned());
        if one.prior.is_none() {
            return Ok((sums, None));
        }
        let reference = system.well_held();
        let rest: Vec<usize> = (0..3 * poses.len()).filter(|k| k / 3 != reference).map(|k| k + 3).collect();
        let inverse = pivot.cholesky().ok_or(SmoothError::Singular)?.inverse();
        let across = system.h.columns(0, 3).select_rows(&rest);
        let gain = &across * inverse;
        let h = system.h.select_rows(&rest).select_columns(&rest) - &gain * across.transpose();
        let b = system.b.select_rows(&rest) - gain * system.b.rows(0, 3);
        let from = belief.pose(poses[reference]);
        let others = poses.iter().enumerate().filter(|(k, _)| *k != reference);
        let z = others.map(|(_, &p)| At::new(from.between(&belief.pose(p)))).collect();
        Ok((sums, Some(Self { reference, z, h: (&h + h.transpose()) * 0.5, b })))
    }

    /// ξ at some poses, and its derivatives.
    fn xi(&self, poses: &[u32], at: &impl Fn(u32) -> At) -> (DVector<f64>, Vec<Residual>) {
        let reference = at(poses[self.reference]);
        let others = poses.iter().enumerate().filter(|(place, _)| *place != self.reference);
        let each = self.z.iter().zip(others).map(|(z, (_, &p))| residual(z, &reference, &at(p)));
        let each: Vec<Residual> = each.collect();
        (DVector::from_iterator(3 * each.len(), each.iter().flat_map(|r| r.error.iter().copied())), each)
    }

    /// `ξᵀ H ξ − 2 bᵀ ξ`: by how much χ² is above where the poses were.
    pub fn cost(&self, poses: &[u32], at: impl Fn(u32) -> At) -> f64 {
        let (xi, _) = self.xi(poses, &at);
        xi.dot(&(&self.h * &xi - 2.0 * &self.b))
    }

    /// H and b of steps of the poses.
    fn linearised(&self, poses: &[u32], at: impl Fn(u32) -> At) -> System {
        let n = self.z.len();
        let (xi, each) = self.xi(poses, &at);
        let mut jacobian = DMatrix::zeros(3 * n, 3 * n + 3);
        let others = (0..poses.len()).filter(|place| *place != self.reference);
        for (k, (r, place)) in each.iter().zip(others).enumerate() {
            jacobian.fixed_view_mut::<3, 3>(3 * k, 3 * self.reference).copy_from(&r.j_i);
            jacobian.fixed_view_mut::<3, 3>(3 * k, 3 * place).copy_from(&r.j_j);
        }
        let b = jacobian.tr_mul(&(&self.b - &self.h * xi));
        System { h: jacobian.tr_mul(&(&self.h * &jacobian)), b }
    }

    /// Adds its share to a front, at the places of its poses there.
    pub fn add_to(&self, front: &mut Front, poses: &[u32], places: &[u32], at: impl Fn(u32) -> At) {
        let system = self.linearised(poses, at);
        for (a, &r) in places.iter().enumerate().filter(|(_, r)| **r != NONE) {
            front.add_rhs(r as usize, &system.b.fixed_rows::<3>(3 * a).into_owned());
            for (k, &c) in places.iter().enumerate().filter(|(_, c)| **c != NONE && **c <= r) {
                let block = system.h.fixed_view::<3, 3>(3 * a, 3 * k).into_owned();
                front.add(r as usize, c as usize, &block);
            }
        }
    }
}
