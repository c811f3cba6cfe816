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

use crate::geometry::Pose2;
use crate::smoothing::factor::{sandwich, symmetrised};
use crate::smoothing::inverse::Sigma;
use crate::smoothing::structure::Structure;
use crate::smoothing::tree::Clique;
use crate::smoothing::{Belief, SmoothError};
use nalgebra::{Dyn, Matrix3, MatrixView, MatrixXx3, U1, U3};
use std::f64::consts::TAU;
use std::hint::black_box;
use std::rc::Rc;

/// Joint covariance of the newest pose with others.
#[derive(Clone, Debug, Default, PartialEq)]
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

/// Room for the answers of [`Belief::joint_all`]. Kept, it is used again: made anew for each question,
/// its some two megabytes cost as much as the arithmetic.
#[derive(Default)]
pub struct JointRoom {
    joint: Joint,
    spare: Vec<Sigma>,
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

impl Relative {
    /// Standard deviation of the translation along the less certain axis of a, metres.
    pub fn sigma_m(&self) -> f64 {
        self.covariance[(0, 0)].max(self.covariance[(1, 1)]).sqrt()
    }

    /// Standard deviation of the heading.
    pub fn sigma_rad(&self) -> f64 {
        self.covariance[(2, 2)].sqrt()
    }

    /// Density of a measured pose z of a in the frame of the candidate (metres, radians), of the covariance R
    /// of z's right perturbation: `S = Σ_h + R` with h the pose predicted. What the edge adds to the evidence.
    /// None where S is no covariance.
    pub fn log_density(&self, z: &Pose2, covariance: &Matrix3<f64>) -> Option<LogDensity> {
        let s = (self.covariance + covariance).cholesky()?;
        let v = self.i_from_a.between(z).log();
        let distance2 = v.dot(&s.solve(&v));
        let log_density = -0.5 * distance2 - s.l().diagonal().product().ln() - 1.5 * TAU.ln();
        log_density.is_finite().then_some(LogDensity { log_density, distance2 })
    }
}

/// The density of a measurement that a belief does not hold, as it sees it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LogDensity {
    /// `log N(log(h⁻¹z); 0, S)`, nats; units are metres and radians.
    pub log_density: f64,
    /// `νᵀ S⁻¹ ν`, ν = log(h⁻¹z): of three degrees of freedom.
    pub distance2: f64,
}

/// Y of one pose: by clique from the pose's own to the root, the frontals' rows.
type Column = Vec<(u32, MatrixXx3<f64>)>;
/// One clique's.
type Rows<'a> = MatrixView<'a, f64, Dyn, U3, U1, Dyn>;

impl Belief {
    /// Σ_ii in the frame of i: m², m·rad, rad². Zero for the first pose; infinite while updates fail.
    /// Indexes like a slice.
    pub fn marginal(&self, structure: &Structure, i: u32) -> Matrix3<f64> {
        if self.behind {
            return Matrix3::from_diagonal_element(f64::INFINITY);
        }
        let mut sum = Matrix3::zeros();
        self.climb(structure, i, |_, y| sum += y.tr_mul(&y));
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
                marginal += y.tr_mul(&y);
                if let Some((_, of_newest)) = of_newest.iter().find(|(at, _)| *at == c) {
                    cross += of_newest.tr_mul(&y);
                }
            });
            Ok(JointPart { j, marginal: symmetrised(&marginal), cross })
        };
        let others = candidates.iter().map(part).collect::<Result<_, _>>()?;
        let marginal = of_newest.iter().map(|(_, y)| y.tr_mul(y)).sum::<Matrix3<f64>>();
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
                    let apart = &of_a[at].1 - y * t.transpose();
                    common += apart.tr_mul(&apart);
                }
                Some(at) => met = met.min(at),
                None => own += y.tr_mul(&y),
            });
            let of_a_alone: Matrix3<f64> = of_a[..met].iter().map(|(_, y)| y.tr_mul(y)).sum();
            Ok(Relative {
                i,
                i_from_a: self.pose(i).between(&self.pose(a)),
                covariance: symmetrised(&(of_a_alone + sandwich(&t, &own) + common)),
            })
        };
        candidates.iter().map(one).collect()
    }

    /// Joint covariance of the newest pose with every pose, marginalised ones left out: from the
    /// roots down, each clique's joint covariance from its parent's. The filter asks for few at a time
    /// ([`Belief::relative`]); this is what the example `smooth` measures.
    pub fn joint_all<'a>(
        &self,
        structure: &Structure,
        room: &'a mut JointRoom,
    ) -> Result<&'a Joint, SmoothError> {
        let newest = self.len().saturating_sub(1) as u32;
        self.check(structure, newest)?;
        let JointRoom { joint, spare } = room;
        let others = &mut joint.others;
        // The origin's are zero; those of marginalised poses are left out at the end.
        let zeros = |j: usize| JointPart { j: j as u32, marginal: Matrix3::zeros(), cross: Matrix3::zeros() };
        others.clear();
        others.extend((0..self.len()).map(zeros));
        self.descend(structure, spare, |frontals, sigma| {
            if let Some(k) = frontals.iter().position(|&p| p == newest) {
                sigma.begin_newest(k);
            }
            for (k, &j) in frontals.iter().enumerate() {
                let part = &mut others[j as usize];
                (part.marginal, part.cross) = (sigma.marginal(k), sigma.cross(k));
            }
        })?;
        (joint.newest, joint.marginal) = (newest, others[newest as usize].marginal);
        others.retain(|p| structure.check_pose(p.j).is_ok());
        Ok(joint)
    }

    /// Covariances of each clique, from the roots down; `visit` gets its frontals and them.
    fn descend(
        &self,
        structure: &Structure,
        spare: &mut Vec<Sigma>,
        mut visit: impl FnMut(&[u32], &mut Sigma),
    ) -> Result<(), SmoothError> {
        let cliques = &structure.tree.cliques;
        let mut stack: Vec<(u32, Option<Rc<Sigma>>)> = Vec::new();
        stack.extend(structure.tree.roots.iter().map(|&c| (c, None)));
        while let Some((c, above)) = stack.pop() {
            let clique = &cliques[c as usize];
            let Some(front) = &self.fronts[c as usize] else { return Err(SmoothError::Behind) };
            let mut own = spare.pop().unwrap_or_default();
            own.gather(clique, above.as_deref());
            own.fill(front, clique.children.is_empty());
            visit(&clique.poses[..clique.frontals], &mut own);
            spare.extend(above.and_then(Rc::into_inner));
            let own = Rc::new(own);
            let from = stack.len();
            for &child in &clique.children {
                self.read_ahead(child, &cliques[child as usize]);
                stack.push((child, Some(Rc::clone(&own))));
            }
            spare.extend(Rc::into_inner(own));
            // The largest last: then few large ones wait for other children at a time.
            let size = |k: &usize| cliques[stack[*k].0 as usize].poses.len();
            if let Some(largest) = (from..stack.len()).max_by_key(size) {
                stack.swap(from, largest);
            }
        }
        Ok(())
    }

    /// Reads from where a clique's numbers lie, so that they are near once it is its turn: each is
    /// somewhere else in memory, and much of the time would go into waiting for one after the other,
    /// while here the processor fetches them side by side.
    fn read_ahead(&self, c: u32, clique: &Clique) {
        let front = self.fronts[c as usize].as_ref().map(|front| front.touched());
        let lists = [&clique.poses, &clique.slots, &clique.children].map(|list| list.first().copied());
        black_box((front, lists));
    }

    fn check(&self, structure: &Structure, pose: u32) -> Result<(), SmoothError> {
        structure.check_pose(pose)?;
        if self.behind || pose as usize >= self.len() { Err(SmoothError::Behind) } else { Ok(()) }
    }

    fn column(&self, structure: &Structure, a: u32) -> Column {
        let mut column = Column::new();
        self.climb(structure, a, |c, y| column.push((c, y.into_owned())));
        column
    }

    /// Solves `L Y = E_i` from the pose's clique to the root.
    fn climb(&self, structure: &Structure, i: u32, mut visit: impl FnMut(u32, Rows)) {
        let cliques = &structure.tree.cliques;
        let mut c = structure.tree.clique_of[i as usize];
        let Some(clique) = cliques.get(c as usize) else { return };
        // The right-hand side over a clique's coordinates, three columns, and that over its parent's.
        let (mut b, mut above) = (vec![0.0; 9 * clique.poses.len()], Vec::new());
        if let Some(at) = clique.poses.iter().position(|&p| p == i) {
            (0..3).for_each(|k| b[3 * clique.poses.len() * k + 3 * at + k] = 1.0);
        }
        while let Some(clique) = cliques.get(c as usize) {
            let Some(front) = &self.fronts[c as usize] else { return };
            front.solve_forward(&mut b);
            let (n, rows) = (3 * clique.poses.len(), 3 * clique.frontals);
            visit(c, Rows::from_slice_with_strides_generic(&b, Dyn(rows), U3, U1, Dyn(n)));
            c = clique.parent;
            let Some(parent) = cliques.get(c as usize) else { return };
            let into = 3 * parent.poses.len();
            above.clear();
            above.resize(3 * into, 0.0);
            for (from, into) in b.chunks_exact(n).zip(above.chunks_exact_mut(into)) {
                for (from, &slot) in from[rows..].chunks_exact(3).zip(&clique.slots) {
                    into[3 * slot as usize..][..3].copy_from_slice(from);
                }
            }
            std::mem::swap(&mut b, &mut above);
        }
    }
}
