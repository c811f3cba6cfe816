//! Covariances (6–7) from the tree: `Σ = L⁻ᵀ L⁻¹`.
//!
//! `Y_i = L⁻¹ E_i` is zero but on the cliques from pose i up to its root, so that
//!
//! ```text
//! Σ_ij = Y_iᵀ Y_j
//! cov(x_i⁻¹x_a) = ‖Y_a − Y_i Tᵀ‖²,   T = Ad(x_a⁻¹x_i)
//! ```
//!
//! A relative covariance is a sum of squares: it keeps all its digits where the two poses are known
//! to millimetres from one another and to kilometres from the origin. The newest pose is a root, where
//! its Y begins and ends.

use super::factor::{sandwich, symmetrised};
use super::inverse::{Fill, Scratch, filled_len, grow};
use super::kernels::block_of;
use super::structure::Structure;
use super::tree::{Clique, NONE};
use super::{Belief, SmoothError};
use crate::geometry::Pose2;
use nalgebra::Matrix3;
use std::rc::Rc;

/// Joint covariance of the newest pose with others.
#[derive(Clone, Debug, PartialEq)]
pub struct Joint {
    /// Index of the newest pose t.
    pub newest: u32,
    /// Σ_tt.
    pub marginal: Matrix3<f64>,
    /// One per candidate, in the order asked for.
    pub others: Vec<JointPart>,
}

/// One candidate's part of a [`Joint`].
#[derive(Clone, Debug, PartialEq)]
pub struct JointPart {
    /// The candidate's index.
    pub j: u32,
    /// Σ_jj.
    pub marginal: Matrix3<f64>,
    /// Σ_tj = E[δt δjᵀ].
    pub cross: Matrix3<f64>,
}

/// A predicted relative pose.
#[derive(Clone, Debug, PartialEq)]
pub struct Relative {
    /// The candidate's index.
    pub i: u32,
    /// `xᵢ⁻¹ x_a`, a the pose asked about.
    pub i_from_a: Pose2,
    /// Covariance of its right perturbation, i.e. in the frame of a.
    pub covariance: Matrix3<f64>,
}

/// Y of one pose: by clique from the pose's own to the root, the frontals' blocks.
type Column = Vec<(u32, Vec<Matrix3<f64>>)>;

impl Belief {
    /// Σ_ii in the frame of i: m², m·rad, rad². Zero for the first pose; infinite while updates fail.
    /// Indexes like a slice.
    pub fn marginal(&self, structure: &Structure, i: u32) -> Matrix3<f64> {
        if self.behind {
            return Matrix3::from_diagonal_element(f64::INFINITY);
        }
        let mut sum = Matrix3::zeros();
        self.climb(structure, i, |_, y| sum += gram(y));
        symmetrised(&sum)
    }

    /// Joint covariance of the newest pose with each candidate: `Σ_tj = Y_tᵀ Y_j`.
    ///
    /// For the relation of the two prefer [`Belief::relative`]: it stays exact where the absolute
    /// covariances are large.
    pub fn joint(&self, structure: &Structure, candidates: &[u32]) -> Result<Joint, SmoothError> {
        let newest = self.len().saturating_sub(1) as u32;
        self.check(structure, newest)?;
        let of_newest = self.column(structure, newest);
        let part = |&j: &u32| {
            self.check(structure, j)?;
            let (mut marginal, mut cross) = (Matrix3::zeros(), Matrix3::zeros());
            self.climb(structure, j, |c, y| {
                marginal += gram(y);
                if let Some((_, of_newest)) = of_newest.iter().find(|(at, _)| *at == c) {
                    cross += product(of_newest, y);
                }
            });
            Ok(JointPart { j, marginal: symmetrised(&marginal), cross })
        };
        let others = candidates.iter().map(part).collect::<Result<_, _>>()?;
        let marginal = of_newest.iter().map(|(_, y)| gram(y)).sum::<Matrix3<f64>>();
        Ok(Joint { newest, marginal: symmetrised(&marginal), others })
    }

    /// Predicted pose of a in the frame of each candidate, with its covariance.
    pub fn relative(
        &self,
        structure: &Structure,
        a: u32,
        candidates: &[u32],
    ) -> Result<Vec<Relative>, SmoothError> {
        self.check(structure, a)?;
        let of_a = self.column(structure, a);
        let one = |&i: &u32| {
            self.check(structure, i)?;
            let t = self.pose(a).between(&self.pose(i)).adjoint();
            let (mut own, mut common) = (Matrix3::zeros(), Matrix3::zeros());
            // From this one on, of a's cliques, the two go the same way.
            let mut met = of_a.len();
            self.climb(structure, i, |c, y| match of_a.iter().position(|(at, _)| *at == c) {
                Some(at) if i != a => {
                    met = met.min(at);
                    let apart: Vec<_> =
                        of_a[at].1.iter().zip(y).map(|(a, i)| a - i * t.transpose()).collect();
                    common += gram(&apart);
                }
                Some(at) => met = met.min(at),
                None => own += gram(y),
            });
            let of_a_alone: Matrix3<f64> = of_a[..met].iter().map(|(_, y)| gram(y)).sum();
            Ok(Relative {
                i,
                i_from_a: self.pose(i).between(&self.pose(a)),
                covariance: symmetrised(&(of_a_alone + sandwich(&t, &own) + common)),
            })
        };
        candidates.iter().map(one).collect()
    }

    /// Joint covariance of the newest pose with every pose, marginalised ones left out: from the
    /// roots down, each clique's joint covariance from its parent's.
    pub fn joint_all(&self, structure: &Structure) -> Result<Joint, SmoothError> {
        let newest = self.len().saturating_sub(1) as u32;
        self.check(structure, newest)?;
        let tree = &structure.tree;
        // The origin's are zero; those of marginalised poses are left out at the end.
        let zeros = |j: usize| JointPart { j: j as u32, marginal: Matrix3::zeros(), cross: Matrix3::zeros() };
        let mut others: Vec<JointPart> = (0..self.len()).map(zeros).collect();
        let mut scratch = Scratch::default();
        let mut spare: Vec<Vec<f64>> = Vec::new();
        let mut stack: Vec<(u32, Rc<Vec<f64>>)> = Vec::new();
        let roots = tree.cliques.iter().enumerate().filter(|(_, c)| c.frontals > 0 && c.parent == NONE);
        stack.extend(roots.map(|(c, _)| (c as u32, Rc::default())));
        while let Some((c, above)) = stack.pop() {
            let clique = &tree.cliques[c as usize];
            let Some(front) = &self.fronts[c as usize] else { return Err(SmoothError::Behind) };
            let n = 3 * clique.poses.len();
            let mut own = spare.pop().unwrap_or_default();
            gather(clique, tree.cliques.get(clique.parent as usize), &above, &mut own);
            let outer = if clique.children.is_empty() { Fill::Diagonal } else { Fill::All };
            front.fill_covariance(&mut own, &mut scratch, outer);
            let (sigma, rest) = own.split_at_mut(n * n);
            let cross = &mut rest[..3 * n];
            if let Some(at) = clique.poses[..clique.frontals].iter().position(|&p| p == newest) {
                // Its cross-covariances begin here: with those of its own clique.
                cross.copy_from_slice(&sigma[3 * at * n..][..3 * n]);
            }
            for (k, &j) in clique.poses[..clique.frontals].iter().enumerate() {
                let part = &mut others[j as usize];
                part.marginal = block_of(columns(sigma, n, 3 * k), 3 * k);
                part.cross = block_of(columns(cross, n, 0), 3 * k).transpose();
            }
            if let Ok(done) = Rc::try_unwrap(above) {
                spare.push(done);
            }
            let own = Rc::new(own);
            stack.extend(clique.children.iter().map(|&child| (child, Rc::clone(&own))));
            if let Ok(leaf) = Rc::try_unwrap(own) {
                spare.push(leaf);
            }
        }
        let marginal = others[newest as usize].marginal;
        others.retain(|p| structure.check_pose(p.j).is_ok());
        Ok(Joint { newest, marginal, others })
    }

    fn check(&self, structure: &Structure, pose: u32) -> Result<(), SmoothError> {
        structure.check_pose(pose)?;
        if self.behind || pose as usize >= self.len() { Err(SmoothError::Behind) } else { Ok(()) }
    }

    fn column(&self, structure: &Structure, a: u32) -> Column {
        let mut column = Column::new();
        self.climb(structure, a, |c, y| column.push((c, y.to_vec())));
        column
    }

    /// Solves `L Y = E_i` from the pose's clique to the root.
    fn climb(&self, structure: &Structure, i: u32, mut visit: impl FnMut(u32, &[Matrix3<f64>])) {
        let cliques = &structure.tree.cliques;
        let mut c = structure.tree.clique_of[i as usize];
        let (mut b, mut above, mut y) = (Vec::new(), Vec::new(), Vec::new());
        if c != NONE {
            let clique = &cliques[c as usize];
            let n = 3 * clique.poses.len();
            b.resize(3 * n, 0.0);
            if let Some(at) = clique.poses.iter().position(|&p| p == i) {
                (0..3).for_each(|k| b[k * n + 3 * at + k] = 1.0);
            }
        }
        while c != NONE {
            let clique = &cliques[c as usize];
            let Some(front) = &self.fronts[c as usize] else { return };
            front.solve_forward(&mut b);
            let n = 3 * clique.poses.len();
            y.clear();
            y.extend((0..clique.frontals).map(|k| Matrix3::from_fn(|r, c| b[c * n + 3 * k + r])));
            visit(c, &y);
            c = clique.parent;
            if c != NONE {
                let into = 3 * cliques[c as usize].poses.len();
                above.clear();
                above.resize(3 * into, 0.0);
                for (k, &slot) in (clique.frontals..).zip(&clique.slots) {
                    for c in 0..3 {
                        let from = &b[c * n + 3 * k..][..3];
                        above[c * into + 3 * slot as usize..][..3].copy_from_slice(from);
                    }
                }
                std::mem::swap(&mut b, &mut above);
            }
        }
    }
}

/// Three columns from column c, of n rows each.
fn columns(m: &[f64], n: usize, c: usize) -> [&[f64]; 3] {
    [&m[c * n..][..n], &m[(c + 1) * n..][..n], &m[(c + 2) * n..][..n]]
}

/// The separators' part of a clique's covariances, from its parent's: a symmetric matrix over the
/// front, then three columns of cross-covariances with the newest pose.
fn gather(clique: &Clique, parent: Option<&Clique>, above: &[f64], into: &mut Vec<f64>) {
    let n = 3 * clique.poses.len();
    // What is not written here the front fills in.
    grow(into, filled_len(n));
    let Some(parent) = parent else { return };
    let m = 3 * parent.poses.len();
    let from = 3 * clique.frontals;
    let columns = clique.slots.iter().flat_map(|&slot| [0, 1, 2].map(|c| 3 * slot as usize + c));
    for (k, column) in columns.chain(m..m + 3).enumerate() {
        let source = &above[column * m..][..m];
        let at = if column < m { (from + k) * n } else { (n + column - m) * n };
        for (into, &slot) in into[at + from..at + n].chunks_exact_mut(3).zip(&clique.slots) {
            into.copy_from_slice(&source[3 * slot as usize..][..3]);
        }
    }
}

/// `YᵀY`.
fn gram(y: &[Matrix3<f64>]) -> Matrix3<f64> {
    product(y, y)
}

/// `AᵀB`.
fn product(a: &[Matrix3<f64>], b: &[Matrix3<f64>]) -> Matrix3<f64> {
    a.iter().zip(b).map(|(a, b)| a.tr_mul(b)).sum()
}
