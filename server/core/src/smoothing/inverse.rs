//! The selected inverse: a clique's covariances from those of its separators, a pose at a time
//! (Takahashi, Fagan, Chin 1973). With R the poses after j in the clique,
//!
//! ```text
//! Y = L_Rj L_jj⁻¹,   Σ_Rj = −Σ_RR Y,   Σ_tj = −Σ_tR Y,   Σ_jj = L_jj⁻ᵀ L_jj⁻¹ − Yᵀ Σ_Rj
//! ```

// Inlined, a loop runs in the registers of who calls it; called, in those that every processor has.
#![allow(clippy::inline_always)]

use crate::smoothing::factor::symmetrised;
use crate::smoothing::front::Front;
use crate::smoothing::kernels::{block_of, dots, rows_of, solve_lower, wide};
use crate::smoothing::tree::Clique;
use nalgebra::Matrix3;

/// Rows come in whole registers of so many numbers, as wide as those of most processors: no loop has a
/// remainder to do one by one.
const LANES: usize = 4;

/// Covariances over a clique's coordinates, and three rows below them those with the newest pose: column
/// after column. What is not filled is of no account.
#[derive(Default)]
pub(super) struct Sigma {
    /// Coordinates.
    n: usize,
    /// Rows, whole registers of them.
    height: usize,
    values: Vec<f64>,
    /// Y, three columns.
    y: Vec<f64>,
}

impl Sigma {
    /// Makes room for a clique's, and takes those of its separators from its parent's.
    pub fn gather(&mut self, clique: &Clique, parent: Option<&Self>) {
        self.n = 3 * clique.poses.len();
        self.height = (self.n + 3).next_multiple_of(LANES);
        grow(&mut self.values, self.n * self.height);
        grow(&mut self.y, 3 * self.n);
        if let Some(parent) = parent {
            wide(
                #[inline(always)]
                || self.gather_inline(clique, parent),
            );
        }
    }

    #[inline(always)]
    fn gather_inline(&mut self, clique: &Clique, parent: &Self) {
        let (h, from, last) = (self.height, 3 * clique.frontals, parent.n);
        let mut rest = &mut self.values[from * h..];
        for &slot in &clique.slots {
            let [t0, t1, t2] = parent.columns(slot as usize);
            let (own, after) = rest.split_at_mut(3 * h);
            let (o0, others) = own.split_at_mut(h);
            let (o1, o2) = others.split_at_mut(h);
            let mut at = from;
            for &slot in &clique.slots {
                // A register's worth: the fourth number is overwritten by what comes next.
                let theirs = 3 * slot as usize..3 * slot as usize + LANES;
                o0[at..at + LANES].copy_from_slice(&t0[theirs.clone()]);
                o1[at..at + LANES].copy_from_slice(&t1[theirs.clone()]);
                o2[at..at + LANES].copy_from_slice(&t2[theirs]);
                at += 3;
            }
            o0[at..at + 3].copy_from_slice(&t0[last..last + 3]);
            o1[at..at + 3].copy_from_slice(&t1[last..last + 3]);
            o2[at..at + 3].copy_from_slice(&t2[last..last + 3]);
            rest = after;
        }
    }

    /// Fills in the frontals'; for a leaf not all of those among them.
    pub fn fill(&mut self, front: &Front, is_leaf: bool) {
        wide(
            #[inline(always)]
            || {
                for j in (0..front.frontals).rev() {
                    self.fill_pose(j, front.columns(j), j > 0 || !is_leaf);
                }
            },
        );
    }

    /// Σ_Rj, Σ_tj and Σ_jj, and Σ_jR if `both`.
    #[inline(always)]
    fn fill_pose(&mut self, j: usize, panel: [&[f64]; 3], both: bool) {
        let (n, h, from) = (self.n, self.height, 3 * (j + 1));
        let rows = n - from;
        let l_jj = block_of(panel, 0);
        let y = &mut self.y[..3 * rows];
        let (y0, rest) = y.split_at_mut(rows);
        let (y1, y2) = rest.split_at_mut(rows);
        divide(rows_of(panel, 3..3 + rows), &l_jj, [&mut *y0, &mut *y1, &mut *y2]);
        let y = [&*y0, &*y1, &*y2];
        let (head, done) = self.values.split_at_mut(from * h);
        let own = &mut head[3 * j * h..];
        // From a whole register on: those above R are not filled yet, and will be.
        let mut at = from / LANES * LANES;
        while at < h {
            at += match h - at {
                4 => multiply::<4>(done, h, at, y, own),
                8 => multiply::<8>(done, h, at, y, own),
                _ => multiply::<12>(done, h, at, y, own),
            };
        }
        let (p0, rest) = own.split_at_mut(h);
        let (p1, p2) = rest.split_at_mut(h);
        let p = rows_of([p0, p1, p2], from..n);
        let inverse = solve_lower(&l_jj, &Matrix3::identity());
        let sigma_jj =
            inverse.tr_mul(&inverse) - Matrix3::from([dots(y, p[0]), dots(y, p[1]), dots(y, p[2])]);
        if both {
            let mut at = from - 3;
            for ((a, b), c) in p[0].iter().zip(p[1]).zip(p[2]) {
                done[at..at + 3].copy_from_slice(&[*a, *b, *c]);
                at += h;
            }
        }
        for c in 0..3 {
            own[c * h + 3 * j..][..3].copy_from_slice(sigma_jj.column(c).as_slice());
        }
    }

    /// Pose k is the newest: below this clique its covariances go along.
    pub fn begin_newest(&mut self, k: usize) {
        for column in self.values.chunks_exact_mut(self.height).take(self.n) {
            column.copy_within(3 * k..3 * k + 3, self.n);
        }
    }

    /// Σ_kk.
    pub fn marginal(&self, k: usize) -> Matrix3<f64> {
        symmetrised(&block_of(self.columns(k), 3 * k))
    }

    /// Σ_tk, t the newest pose.
    pub fn cross(&self, k: usize) -> Matrix3<f64> {
        block_of(self.columns(k), self.n)
    }

    #[inline(always)]
    fn columns(&self, k: usize) -> [&[f64]; 3] {
        let (c0, rest) = self.values[3 * k * self.height..][..3 * self.height].split_at(self.height);
        let (c1, c2) = rest.split_at(self.height);
        [c0, c1, c2]
    }
}

/// Makes room; what was there is of no account.
fn grow(values: &mut Vec<f64>, len: usize) {
    if values.len() < len {
        *values = vec![0.0; len];
    }
}

/// `X L⁻¹` of a lower triangular block.
#[inline(always)]
fn divide([x0, x1, x2]: [&[f64]; 3], l: &Matrix3<f64>, [y0, y1, y2]: [&mut [f64]; 3]) {
    let (i0, i1, i2) = (1.0 / l.m11, 1.0 / l.m22, 1.0 / l.m33);
    let rows = x0.len();
    let (x1, x2) = (&x1[..rows], &x2[..rows]);
    let (y0, y1, y2) = (&mut y0[..rows], &mut y1[..rows], &mut y2[..rows]);
    for i in 0..rows {
        let c = x2[i] * i2;
        let b = (x1[i] - c * l.m32) * i1;
        (y0[i], y1[i], y2[i]) = ((x0[i] - b * l.m21 - c * l.m31) * i0, b, c);
    }
}

/// Some rows of `−Σ Y`, of Σ's columns that are h apart, into columns as far apart. Returns how many.
#[inline(always)]
fn multiply<const ROWS: usize>(
    sigma: &[f64],
    h: usize,
    at: usize,
    [y0, y1, y2]: [&[f64]; 3],
    into: &mut [f64],
) -> usize {
    let mut sums = [[0.0; ROWS]; 3];
    for (k, ((y0, y1), y2)) in y0.iter().zip(y1).zip(y2).enumerate() {
        let column = &sigma[k * h + at..][..ROWS];
        for r in 0..ROWS {
            sums[0][r] = column[r].mul_add(-y0, sums[0][r]);
            sums[1][r] = column[r].mul_add(-y1, sums[1][r]);
            sums[2][r] = column[r].mul_add(-y2, sums[2][r]);
        }
    }
    for (k, sums) in sums.iter().enumerate() {
        into[k * h + at..][..ROWS].copy_from_slice(sums);
    }
    ROWS
}
