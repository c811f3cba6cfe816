//! Parts of the smoother against their definitions: elimination orders and fronts.

use crate::smoothing::front::Front;
use crate::smoothing::order::Order;
use nalgebra::{DMatrix, Matrix3, Vector3};
use proptest::prelude::*;
use rand::seq::SliceRandom;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::collections::BTreeSet;

/// A graph to order.
#[derive(Clone, Debug)]
struct Problem {
    poses: usize,
    joins: Vec<(u32, u32)>,
    elements: Vec<BTreeSet<u32>>,
    late: Vec<u32>,
    last: u32,
}

fn problem() -> impl Strategy<Value = Problem> {
    (1..=12_usize).prop_flat_map(|poses| {
        let n = poses as u32;
        let joins = prop::collection::vec((0..n, 0..n), 0..=2 * poses);
        let elements = prop::collection::vec(prop::collection::btree_set(0..n, 1..=4.min(poses)), 0..4);
        let late = prop::collection::vec(0..n, 0..4);
        (Just(poses), joins, elements, late, 0..n).prop_map(|(poses, mut joins, elements, late, last)| {
            joins.retain(|(a, b)| a != b);
            Problem { poses, joins, elements, late, last }
        })
    })
}

impl Problem {
    fn run(&self, order: &mut Order) {
        order.clear(self.poses);
        for &(a, b) in &self.joins {
            order.join(a, b);
        }
        for (k, poses) in (0..).zip(&self.elements) {
            assert_eq!(order.element(poses.iter().copied()), k);
        }
        order.run(&self.late, self.last);
    }

    /// What eliminating the poses one by one joins each to.
    fn eliminated(&self, sequence: &[u32]) -> Vec<BTreeSet<u32>> {
        let mut joined = vec![BTreeSet::new(); self.poses];
        let pairs = self.elements.iter().flat_map(|e| e.iter().flat_map(|&a| e.iter().map(move |&b| (a, b))));
        for (a, b) in self.joins.iter().copied().chain(pairs).filter(|(a, b)| a != b) {
            joined[a as usize].insert(b);
            joined[b as usize].insert(a);
        }
        let eliminate = |&p: &u32| {
            let met = std::mem::take(&mut joined[p as usize]);
            for &q in &met {
                joined[q as usize].extend(&met);
                joined[q as usize].retain(|r| *r != p && *r != q);
            }
            met
        };
        sequence.iter().map(eliminate).collect()
    }

    fn check(&self, order: &Order) -> Result<(), TestCaseError> {
        let sequence: Vec<u32> = order.columns.iter().map(|c| c.pose).collect();
        let mut sorted = sequence.clone();
        sorted.sort_unstable();
        prop_assert_eq!(sorted, (0..self.poses as u32).collect::<Vec<_>>());
        prop_assert_eq!(sequence.last(), Some(&self.last));
        let held_back: Vec<bool> =
            sequence.iter().map(|p| *p == self.last || self.late.contains(p)).collect();
        prop_assert!(held_back.is_sorted(), "{sequence:?}");
        prop_assert_eq!(order.given, self.elements.len());
        for (k, met) in self.eliminated(&sequence).into_iter().enumerate() {
            let element = &order.elements[order.given + k];
            prop_assert_eq!(element.len(), met.len(), "twice in the element of column {}", k);
            prop_assert_eq!(element.iter().copied().collect::<BTreeSet<_>>(), met, "column {}", k);
        }
        // Each element is taken up once: by the first of its poses to go.
        for e in 0..order.given + self.poses {
            let taken_by =
                |c: &usize| order.columns[*c].elements.iter().filter(|&&t| t as usize == e).count();
            let takers: Vec<usize> =
                (0..self.poses).flat_map(|c| std::iter::repeat_n(c, taken_by(&c))).collect();
            let first = sequence.iter().position(|p| order.elements[e].contains(p));
            prop_assert_eq!(takers, first.into_iter().collect::<Vec<_>>(), "element {}", e);
        }
        Ok(())
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(512))]

    #[test]
    fn orders_are_symbolic_eliminations(first in problem(), second in problem()) {
        // The second finds the work space of the first.
        let mut order = Order::default();
        for problem in [first, second] {
            problem.run(&mut order);
            problem.check(&order)?;
        }
    }

    #[test]
    fn fronts_equal_dense_elimination(seed in any::<u64>(), (blocks, frontals) in sizes()) {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let (h, b) = system(&mut rng, blocks);
        let mut front = assembled(&mut rng, &h, &b, frontals);
        prop_assert!(front.eliminate().is_ok());
        let (f, s) = (3 * frontals, 3 * (blocks - frontals));
        let cholesky = h.view((0, 0), (f, f)).into_owned().cholesky().unwrap();
        let mut x = random(&mut rng, 3 * blocks, 1);
        let want = cholesky.solve(&(b.rows(0, f) - h.view((0, f), (f, s)) * x.rows(f, s)));
        front.solve_back(x.as_mut_slice());
        prop_assert!(near(&x.rows(0, f).into_owned(), &want), "{x} {want}");
        let (want_h, want_b) = schur(&h, &b, frontals);
        let (got_h, got_b) = left(&front);
        prop_assert!(near(&got_h, &want_h), "{got_h} {want_h}");
        prop_assert!(near(&got_b, &want_b), "{got_b} {want_b}");
    }

    #[test]
    fn a_front_takes_up_what_children_leave(
        seed in any::<u64>(), (blocks, frontals) in sizes(), more in 0..4_usize, shuffled in any::<bool>(),
    ) {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let (h, b) = system(&mut rng, blocks);
        let mut child = assembled(&mut rng, &h, &b, frontals);
        prop_assert!(child.eliminate().is_ok());
        let separators = blocks - frontals;
        let mut slots: Vec<u32> = (0..(separators + more) as u32).collect();
        slots.shuffle(&mut rng);
        slots.truncate(separators);
        if !shuffled {
            slots.sort_unstable();
        }
        let (mut want_h, mut want_b) = system(&mut rng, separators + more);
        let mut parent = assembled(&mut rng, &want_h, &want_b, 0);
        parent.take_up(&child, &slots);
        let (left_h, left_b) = schur(&h, &b, frontals);
        let at = |r: usize| 3 * slots[r / 3] as usize + r % 3;
        for r in 0..3 * separators {
            want_b[at(r)] += left_b[r];
            (0..3 * separators).for_each(|c| want_h[(at(r), at(c))] += left_h[(r, c)]);
        }
        let (got_h, got_b) = left(&parent);
        prop_assert!(near(&got_h, &want_h), "{slots:?} {got_h} {want_h}");
        prop_assert!(near(&got_b, &want_b), "{slots:?} {got_b} {want_b}");
    }
}

/// Blocks of a front, and of them frontals.
fn sizes() -> impl Strategy<Value = (usize, usize)> {
    (1..=5_usize).prop_flat_map(|blocks| (Just(blocks), 1..=blocks))
}

fn random(rng: &mut ChaCha8Rng, rows: usize, columns: usize) -> DMatrix<f64> {
    DMatrix::from_fn(rows, columns, |_, _| rng.random_range(-1.0..1.0))
}

/// A positive definite system of so many blocks.
fn system(rng: &mut ChaCha8Rng, blocks: usize) -> (DMatrix<f64>, DMatrix<f64>) {
    let root = random(rng, 3 * blocks, 3 * blocks);
    (&root * root.transpose() + DMatrix::identity(3 * blocks, 3 * blocks), random(rng, 3 * blocks, 1))
}

/// A front of it, block by block in two parts, each from one side of the diagonal or the other.
fn assembled(rng: &mut ChaCha8Rng, h: &DMatrix<f64>, b: &DMatrix<f64>, frontals: usize) -> Front {
    let blocks = h.nrows() / 3;
    let mut front = Front::new(blocks, frontals);
    for c in 0..blocks {
        for share in [0.25, 0.75] {
            front.add_rhs(c, &Vector3::from_column_slice((b.rows(3 * c, 3) * share).as_slice()));
            for r in c..blocks {
                let block: Matrix3<f64> = h.fixed_view::<3, 3>(3 * r, 3 * c) * share;
                if rng.random_bool(0.5) {
                    front.add(r, c, &block);
                } else {
                    front.add(c, r, &block.transpose());
                }
            }
        }
    }
    front
}

/// What a front has left on its separators.
fn left(front: &Front) -> (DMatrix<f64>, DMatrix<f64>) {
    let left = front.left();
    let n = left.nrows();
    (DMatrix::from_fn(n, n, |r, c| left[(r, c)]), DMatrix::from_fn(n, 1, |r, _| left[(r, n)]))
}

/// The same of a dense system.
fn schur(h: &DMatrix<f64>, b: &DMatrix<f64>, frontals: usize) -> (DMatrix<f64>, DMatrix<f64>) {
    let (f, s) = (3 * frontals, h.nrows() - 3 * frontals);
    let gain = h.view((0, 0), (f, f)).into_owned().cholesky().unwrap().solve(&h.view((0, f), (f, s)));
    (h.view((f, f), (s, s)) - h.view((f, 0), (s, f)) * &gain, b.rows(f, s) - gain.transpose() * b.rows(0, f))
}

/// Equal but for rounding: numbers are near one, and the systems' condition is below 100.
fn near(got: &DMatrix<f64>, want: &DMatrix<f64>) -> bool {
    got.shape() == want.shape() && (got - want).iter().all(|d| d.abs() < 1e-11)
}
