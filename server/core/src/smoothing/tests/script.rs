//! Graphs built step by step: in the smoother, and the same in the reference.

use crate::geometry::Pose2;
use crate::smoothing::tests::dense::{Graph, Term, moved};
use crate::smoothing::{Factor, FactorId, Smoother};
use nalgebra::{Matrix3, Vector3};
use proptest::prelude::*;
use proptest::sample::Index;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::collections::BTreeMap;

/// One change of a graph.
#[derive(Clone, Debug)]
pub enum Op {
    Extend,
    /// A pose from any other one, measured from the other's or from its own frame.
    Branch(Index, bool),
    Anchor,
    Close(Index, Index),
    Remove(Index),
    Marginalise(Vec<Index>),
}

pub fn op() -> impl Strategy<Value = Op> {
    prop_oneof![
        6 => Just(Op::Extend),
        1 => any::<(Index, bool)>().prop_map(|(at, inverse)| Op::Branch(at, inverse)),
        1 => Just(Op::Anchor),
        4 => any::<(Index, Index)>().prop_map(|(a, b)| Op::Close(a, b)),
        1 => any::<Index>().prop_map(Op::Remove),
        2 => prop::collection::vec(any::<Index>(), 1..4).prop_map(Op::Marginalise),
    ]
}

/// Standard deviations of a measurement: metres, radians.
pub type Sigma = (f64, f64);
pub const GOOD: Sigma = (0.05, 0.02);
pub const POOR: Sigma = (3.0, 0.3);

pub fn information((sigma_m, sigma_rad): Sigma) -> Matrix3<f64> {
    Matrix3::from_diagonal(&Vector3::new(sigma_m, sigma_m, sigma_rad).map(|s| 1.0 / (s * s)))
}

/// Sum of four uniforms: near enough to a Gaussian of unit variance.
fn noise(rng: &mut ChaCha8Rng) -> f64 {
    (0..4).map(|_| rng.random_range(-0.866..0.866)).sum()
}

#[derive(Clone)]
pub struct Script {
    pub rng: ChaCha8Rng,
    pub truth: Vec<Pose2>,
    pub smoother: Smoother,
    pub graph: Graph,
    /// Factors of the smoother with their terms in the graph.
    pub loops: Vec<(FactorId, u32)>,
    /// Terms that poses started with.
    pub starts: BTreeMap<u32, u32>,
}

impl Script {
    /// The origin alone.
    pub fn new(seed: u64) -> Self {
        let mut smoother = Smoother::new();
        smoother.add_pose(Pose2::default(), &Matrix3::identity()).unwrap();
        let mut graph = Graph::default();
        graph.poses.insert(0, Pose2::default());
        let rng = ChaCha8Rng::seed_from_u64(seed);
        Self { rng, truth: vec![Pose2::default()], smoother, graph, loops: vec![], starts: BTreeMap::new() }
    }

    pub fn newest(&self) -> u32 {
        self.truth.len() as u32 - 1
    }

    /// Poses that are still there.
    pub fn present(&self) -> Vec<u32> {
        self.graph.poses.keys().copied().collect()
    }

    /// A noisy measurement of a true relative pose, with a full information matrix.
    pub fn measured(&mut self, i: u32, j: u32, sigma: Sigma) -> Factor {
        let truth = self.truth[i as usize].between(&self.truth[j as usize]);
        let turn_per_m = sigma.1 / sigma.0;
        let skew = Pose2::new(0.3 * turn_per_m, 0.4 * turn_per_m, 0.4).adjoint();
        let full = skew * information(sigma) * skew.transpose();
        let e = Vector3::new(sigma.0, sigma.0, sigma.1).map(|s| s * noise(&mut self.rng));
        let e = skew.transpose().try_inverse().unwrap() * e;
        Factor { i, j, i_from_j: moved(&truth, &e), information: (full + full.transpose()) * 0.5 }
    }

    fn start(&mut self, f: Factor) {
        self.starts.insert(f.i.max(f.j), self.graph.start(f));
    }

    /// Goes on from the newest pose.
    pub fn extend(&mut self, step: Pose2, sigma: Sigma) {
        let j = self.truth.len() as u32;
        self.truth.push(self.truth[j as usize - 1].compose(&step));
        let f = self.measured(j - 1, j, sigma);
        assert_eq!(self.smoother.add_pose(f.i_from_j, &f.information), Ok(j));
        self.start(f);
    }

    /// A step ahead with a turn.
    pub fn wander(&mut self) {
        let turn = self.rng.random_range(-1.0..1.0);
        self.extend(Pose2::new(1.0, 0.2, turn), GOOD);
    }

    /// Goes on from any pose.
    pub fn branch(&mut self, from: u32, inverse: bool) {
        let new = self.truth.len() as u32;
        let turn = self.rng.random_range(-3.0..3.0);
        self.truth.push(self.truth[from as usize].compose(&Pose2::new(0.5, -0.7, turn)));
        let (i, j) = if inverse { (new, from) } else { (from, new) };
        let f = self.measured(i, j, GOOD);
        assert_eq!(self.smoother.add_pose_from(f.clone()), Ok(new));
        self.start(f);
    }

    /// Starts a session of which little is known.
    pub fn anchor(&mut self, sigma: Sigma) {
        let j = self.truth.len() as u32;
        let (x, y) = (self.rng.random_range(-9.0..9.0), self.rng.random_range(-9.0..9.0));
        self.truth.push(Pose2::new(x, y, self.rng.random_range(-3.0..3.0)));
        let f = self.measured(0, j, sigma);
        assert_eq!(self.smoother.add_anchor(f.i_from_j, &f.information), Ok(j));
        self.start(f);
    }

    pub fn close(&mut self, i: u32, j: u32, sigma: Sigma) -> FactorId {
        let f = self.measured(i, j, sigma);
        let id = self.smoother.add_factor(f.clone()).unwrap();
        self.loops.push((id, self.graph.insert(Term::Between(f))));
        id
    }

    /// Takes a loop out, by its place among those present.
    pub fn remove(&mut self, k: usize) {
        let (id, term) = self.loops.remove(k);
        self.smoother.remove_factor(id).unwrap();
        self.graph.terms.remove(&term);
    }

    pub fn marginalise(&mut self, poses: &[u32]) {
        self.smoother.marginalise(poses).unwrap();
        // Where the smoother has them now, settled or not.
        let at = self.smoother.poses();
        for &p in poses {
            self.graph.marginalise(p, |p| at[p as usize]);
        }
        self.loops.retain(|(_, term)| self.graph.terms.contains_key(term));
    }

    pub fn apply(&mut self, op: &Op) {
        let present = self.present();
        match op {
            Op::Extend => self.wander(),
            Op::Branch(from, inverse) => self.branch(present[from.index(present.len())], *inverse),
            Op::Anchor => self.anchor(POOR),
            Op::Close(a, b) => {
                let (a, b) = (a.index(present.len()), b.index(present.len()));
                if a != b {
                    self.close(present[a], present[b], GOOD);
                }
            }
            Op::Remove(k) if !self.loops.is_empty() => self.remove(k.index(self.loops.len())),
            Op::Marginalise(which) if present.len() > 2 => {
                let inner = &present[1..present.len() - 1];
                let mut poses: Vec<u32> = Vec::new();
                for p in which.iter().map(|k| inner[k.index(inner.len())]) {
                    if !poses.contains(&p) {
                        poses.push(p);
                    }
                }
                self.marginalise(&poses);
            }
            Op::Remove(_) | Op::Marginalise(_) => {}
        }
    }
}
