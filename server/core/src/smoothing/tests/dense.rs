//! The reference: all poses at once, dense matrices, numerical Jacobians. It shares the definitions
//! of the error and of what a marginalised pose leaves, and no code, with the smoother.

use crate::geometry::{Pose2, wrap};
use crate::smoothing::Factor;
use nalgebra::{DMatrix, DVector, Matrix3, Vector3};
use std::collections::BTreeMap;
use std::f64::consts::TAU;

/// A part of the objective: `eᵀ W e − 2 bᵀ e`.
#[derive(Clone, Debug)]
pub enum Term {
    /// W = Ω, b = 0.
    Between(Factor),
    /// e = ξ of the others as seen from the first.
    Left(Left),
}

/// What a marginalised pose left on some others.
#[derive(Clone, Debug)]
pub struct Left {
    poses: Vec<u32>,
    z: Vec<Pose2>,
    w: DMatrix<f64>,
    b: DVector<f64>,
}

/// Poses by index and the terms between them.
#[derive(Clone, Debug, Default)]
pub struct Graph {
    pub poses: BTreeMap<u32, Pose2>,
    pub terms: BTreeMap<u32, Term>,
    /// Evidence of what was taken out, nats.
    left: f64,
    next: u32,
}

/// (x, y, yaw).
pub fn chart(p: &Pose2) -> Vector3<f64> {
    Vector3::new(p.x_m, p.y_m, p.yaw_rad)
}

/// `p ∘ d`.
pub fn moved(p: &Pose2, d: &Vector3<f64>) -> Pose2 {
    p.compose(&Pose2::new(d.x, d.y, d.z))
}

/// The chart of `z⁻¹ · a⁻¹b`.
pub fn error(z: &Pose2, a: &Pose2, b: &Pose2) -> Vector3<f64> {
    chart(&z.inverse().compose(&a.inverse().compose(b)))
}

/// `½ log|M/2π|`.
fn half_log_det(m: &DMatrix<f64>) -> f64 {
    let l = m.clone().cholesky().unwrap().unpack();
    l.diagonal().map(|d| d.ln() - 0.5 * TAU.ln()).sum()
}

/// Derivative at zero by the central difference of eighth order; every third row is an angle.
pub fn derivative(at: impl Fn(f64) -> DVector<f64>) -> DVector<f64> {
    let h = 0.02;
    let weights = [4.0 / 5.0, -1.0 / 5.0, 4.0 / 105.0, -1.0 / 280.0];
    let mut sum = DVector::zeros(at(0.0).len());
    for (k, weight) in (1..).zip(weights) {
        let mut change = at(f64::from(k) * h) - at(f64::from(-k) * h);
        change.iter_mut().skip(2).step_by(3).for_each(|angle| *angle = wrap(*angle));
        sum += change * (weight / h);
    }
    sum
}

impl Term {
    pub fn poses(&self) -> Vec<u32> {
        match self {
            Self::Between(f) => vec![f.i, f.j],
            Self::Left(left) => left.poses.clone(),
        }
    }

    /// The factor, if it links neighbours of the chain between two poses.
    pub fn link(&self, from: u32, to: u32) -> Option<&Factor> {
        match self {
            Self::Between(f) if f.i >= from && f.j <= to && f.i + 1 == f.j => Some(f),
            _ => None,
        }
    }

    /// The factor, if it links these two.
    pub fn between(&self, i: u32, j: u32) -> Option<&Factor> {
        match self {
            Self::Between(f) if (f.i, f.j) == (i, j) => Some(f),
            _ => None,
        }
    }

    /// e at the poses, in the order of [`Term::poses`].
    fn error(&self, at: &[Pose2]) -> DVector<f64> {
        match self {
            Self::Between(f) => DVector::from_column_slice(error(&f.i_from_j, &at[0], &at[1]).as_slice()),
            Self::Left(left) => {
                let parts = left.z.iter().zip(&at[1..]).map(|(z, p)| error(z, &at[0], p));
                DVector::from_vec(parts.flat_map(|e| [e.x, e.y, e.z]).collect())
            }
        }
    }

    /// W and b.
    fn weight(&self) -> (DMatrix<f64>, DVector<f64>) {
        match self {
            Self::Between(f) => {
                (DMatrix::from_column_slice(3, 3, f.information.as_slice()), DVector::zeros(3))
            }
            Self::Left(left) => (left.w.clone(), left.b.clone()),
        }
    }

    /// Logarithm of its density at the poses, nats: `½ log|Ω/2π| − ½ eᵀ Ω e`; of what was left, but for a
    /// constant.
    fn log_density(&self, at: &[Pose2]) -> f64 {
        let (e, (w, b)) = (self.error(at), self.weight());
        let normaliser = match self {
            Self::Between(_) => half_log_det(&w),
            Self::Left(_) => 0.0,
        };
        normaliser - 0.5 * e.dot(&(w * &e - 2.0 * b))
    }

    /// `Jᵀ W J` and `Jᵀ (b − W e)`. Poses are taken relative to the first, which keeps digits.
    fn system(&self, at: &[Pose2]) -> (DMatrix<f64>, DVector<f64>) {
        let at: Vec<Pose2> = at.iter().map(|p| at[0].between(p)).collect();
        let columns: Vec<DVector<f64>> = (0..3 * at.len())
            .map(|c| {
                derivative(|h| {
                    let mut at = at.clone();
                    at[c / 3] = moved(&at[c / 3], &Vector3::ith(c % 3, h));
                    self.error(&at)
                })
            })
            .collect();
        let j = DMatrix::from_columns(&columns);
        let (w, b) = self.weight();
        (j.transpose() * &w * &j, j.transpose() * (b - w * self.error(&at)))
    }
}

impl Graph {
    pub fn insert(&mut self, term: Term) -> u32 {
        self.next += 1;
        self.terms.insert(self.next, term);
        self.next
    }

    /// Adds a pose where a factor puts it; returns the factor's term.
    pub fn start(&mut self, f: Factor) -> u32 {
        match self.poses.get(&f.i).copied() {
            Some(i) if !self.poses.contains_key(&f.j) => self.poses.insert(f.j, i.compose(&f.i_from_j)),
            _ => self.poses.insert(f.i, self.poses[&f.j].compose(&f.i_from_j.inverse())),
        };
        self.insert(Term::Between(f))
    }

    /// Information matrix and half the negative gradient over some poses at `at`; others are fixed.
    pub fn system(&self, free: &[u32], at: impl Fn(u32) -> Pose2) -> (DMatrix<f64>, DVector<f64>) {
        let (mut h, mut g) = (DMatrix::zeros(3 * free.len(), 3 * free.len()), DVector::zeros(3 * free.len()));
        for term in self.terms.values() {
            let poses = term.poses();
            let values: Vec<Pose2> = poses.iter().map(|&p| at(p)).collect();
            let (part_h, part_g) = term.system(&values);
            let places: Vec<_> = poses.iter().map(|p| free.iter().position(|q| q == p)).collect();
            let placed = |k: usize| places[k / 3].map(|at| 3 * at + k % 3);
            for (r, row) in (0..part_g.len()).filter_map(|r| Some((r, placed(r)?))) {
                g[row] += part_g[r];
                for (c, column) in (0..part_g.len()).filter_map(|c| Some((c, placed(c)?))) {
                    h[(row, column)] += part_h[(r, c)];
                }
            }
        }
        (h, g)
    }

    /// Takes a pose out: the Schur complement of its terms at `at`, in steps of its neighbours as
    /// seen from the first of those that it holds with not less than 0.3 times the most information.
    pub fn marginalise(&mut self, pose: u32, at: impl Fn(u32) -> Pose2) {
        let (of_pose, rest): (BTreeMap<_, _>, BTreeMap<_, _>) =
            std::mem::take(&mut self.terms).into_iter().partition(|(_, term)| term.poses().contains(&pose));
        self.terms = rest;
        self.poses.remove(&pose);
        let alone = Self { terms: of_pose, ..Self::default() };
        let mut poses: Vec<u32> = alone.terms.values().flat_map(Term::poses).filter(|&p| p != pose).collect();
        poses.sort_unstable();
        poses.dedup();
        let (h, g) = alone.system(&[pose], &at);
        self.left += alone.log_densities(&at) - half_log_det(&h);
        self.left += 0.5 * g.dot(&h.cholesky().unwrap().solve(&g));
        if poses.len() < 2 {
            return;
        }
        let held = |p: &u32| {
            let h = alone.system(&[*p], &at).0;
            h[(0, 0)] + h[(1, 1)]
        };
        let most = poses.iter().map(held).fold(0.0, f64::max);
        let first = poses.iter().position(|p| held(p) >= 0.3 * most).unwrap();
        let reference = poses.remove(first);
        let free: Vec<u32> = [pose].iter().chain(&poses).copied().collect();
        let (h, g) = alone.system(&free, &at);
        let n = h.nrows() - 3;
        let inverse = h.view((0, 0), (3, 3)).into_owned().cholesky().unwrap().inverse();
        let gain = h.view((3, 0), (n, 3)) * inverse;
        let left = Left {
            z: poses.iter().map(|&p| at(reference).between(&at(p))).collect(),
            w: h.view((3, 3), (n, n)) - &gain * h.view((0, 3), (3, n)),
            b: g.rows(3, n) - gain * g.rows(0, 3),
            poses: [reference].iter().chain(&poses).copied().collect(),
        };
        self.insert(Term::Left(left));
    }

    fn log_densities(&self, at: impl Fn(u32) -> Pose2) -> f64 {
        let of = |term: &Term| term.log_density(&term.poses().iter().map(|&p| at(p)).collect::<Vec<_>>());
        self.terms.values().map(of).sum()
    }

    /// Logarithm of the evidence by Laplace's method where the poses are, nats.
    pub fn log_evidence(&self) -> f64 {
        let free = self.but(0);
        let h = self.system(&free, |p| self.poses[&p]).0;
        let volume = if free.is_empty() { 0.0 } else { half_log_det(&h) };
        self.left + self.log_densities(|p| self.poses[&p]) - volume
    }

    /// Farthest coordinate, 1 m at least.
    pub fn extent_m(&self) -> f64 {
        self.poses.values().map(|p| p.x_m.hypot(p.y_m)).fold(1.0, f64::max)
    }

    /// All poses but one.
    pub fn but(&self, fixed: u32) -> Vec<u32> {
        self.poses.keys().copied().filter(|&p| p != fixed).collect()
    }

    /// The poses from one on, and the terms between them.
    pub fn only_from(&self, first: u32) -> Self {
        let inside = |term: &Term| term.poses().iter().all(|p| *p >= first);
        let terms = self.terms.iter().filter(|(_, term)| inside(term));
        let poses = self.poses.range(first..).map(|(p, pose)| (*p, *pose)).collect();
        Self { poses, terms: terms.map(|(k, term)| (*k, term.clone())).collect(), ..self.clone() }
    }

    /// Gauss–Newton from where the poses are to where they move no more, one of them fixed.
    pub fn solve(&mut self, fixed: u32) {
        assert!(self.finds_an_optimum(fixed), "no optimum");
    }

    /// The same; false if it goes round in circles.
    pub fn finds_an_optimum(&mut self, fixed: u32) -> bool {
        let free = self.but(fixed);
        let mut steps = vec![f64::INFINITY];
        while !free.is_empty() && steps.last() > Some(&(1e-12 * self.extent_m())) {
            let (h, g) = self.system(&free, |p| self.poses[&p]);
            let step = h.cholesky().unwrap().solve(&g);
            for (k, p) in free.iter().enumerate() {
                let pose = moved(&self.poses[p], &step.fixed_rows::<3>(3 * k).into_owned());
                self.poses.insert(*p, pose);
            }
            steps.push(step.amax());
            if steps.len() >= 100 {
                return false;
            }
        }
        true
    }

    /// Covariances of all poses as seen from one of them.
    pub fn covariance(&self, fixed: u32) -> Covariance {
        let free = self.but(fixed);
        let all = if free.is_empty() {
            DMatrix::zeros(0, 0)
        } else {
            self.system(&free, |p| self.poses[&p]).0.cholesky().unwrap().inverse()
        };
        Covariance { free, all }
    }

    /// `Σ eᵀ Ω e` over the factors between poses that are still there.
    pub fn chi2(&self) -> f64 {
        let cost = |term: &Term| match term {
            Term::Between(f) => {
                let e = error(&f.i_from_j, &self.poses[&f.i], &self.poses[&f.j]);
                e.dot(&(f.information * e))
            }
            Term::Left(_) => 0.0,
        };
        self.terms.values().map(cost).sum()
    }
}

/// Covariances of right perturbations as seen from one pose.
pub struct Covariance {
    free: Vec<u32>,
    pub all: DMatrix<f64>,
}

impl Covariance {
    /// Zero where one of the two is the pose that sees.
    pub fn block(&self, i: u32, j: u32) -> Matrix3<f64> {
        match (self.free.binary_search(&i), self.free.binary_search(&j)) {
            (Ok(i), Ok(j)) => self.all.fixed_view::<3, 3>(3 * i, 3 * j).into_owned(),
            _ => Matrix3::zeros(),
        }
    }
}
