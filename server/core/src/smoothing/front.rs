//! A clique's numbers: a dense symmetric front, of which the frontals are eliminated.
//!
//! A front holds the lower triangle of its share of Λ, eq. (10), in 3×3 blocks, and its right-hand
//! side as a last row. Block column J is a panel of three columns, each from the diagonal block's
//! first row down to the last row, one after the other; panels follow each other. Eliminating the
//! frontals leaves
//!
//! ```text
//! frontals' panels:   L (diagonal blocks lower triangular), last row (L⁻¹ b)ᵀ
//! separators' panels: Λ_SS − L_S L_Sᵀ, last row (b_S − L_S L⁻¹ b)ᵀ: what the parent takes up
//! ```

// Inlined, a loop runs in the registers of who calls it; called, in those that every processor has.
#![allow(clippy::inline_always)]

use crate::smoothing::kernels::{
    Ill, back, block_of, columns_of, dots, eliminate_panel, offset, rows_of, solve_lower, subtract_products,
    wide,
};
use crate::smoothing::sums::Sums;
use faer::{Mat, MatRef};
use nalgebra::{Matrix3, Vector3};
use std::f64::consts::TAU;
use std::ops::Range;

/// Where a pose keeps less than this share of its diagonal, what it keeps is rounding for a good
/// part: such a front is better eliminated by QR.
const KEPT_MIN: f64 = 1e-10;

/// Products of pivots that those of three more leave finite and digits of.
const PIVOTS: Range<f64> = 1e-100..1e100;

/// Numbers of one clique for one belief.
#[derive(Clone, Debug)]
pub(super) struct Front {
    /// Poses.
    pub blocks: usize,
    /// How many of them are eliminated here.
    pub frontals: usize,
    values: Vec<f64>,
    /// Its part of the evidence and that of all below it, once it is eliminated.
    pub sums: Sums,
    /// `[R | d]` of what is left on the separators, where `RᵀR` would lose digits of it.
    root: Option<Box<Mat<f64>>>,
}

impl Front {
    /// Sum of every eighth number of the frontals' panels: one from each line of memory, of 64 bytes.
    pub fn touched(&self) -> f64 {
        self.values[..offset(self.blocks, self.frontals)].iter().step_by(8).sum()
    }

    /// Zeros.
    pub fn new(blocks: usize, frontals: usize) -> Self {
        Self {
            blocks,
            frontals,
            values: vec![0.0; offset(blocks, blocks)],
            sums: Sums::default(),
            root: None,
        }
    }

    /// Rows of a panel, the right-hand side's counted.
    fn height(&self, j: usize) -> usize {
        3 * (self.blocks - j) + 1
    }

    fn panel(&self, j: usize) -> &[f64] {
        &self.values[offset(self.blocks, j)..offset(self.blocks, j + 1)]
    }

    fn panel_mut(&mut self, j: usize) -> &mut [f64] {
        let (from, to) = (offset(self.blocks, j), offset(self.blocks, j + 1));
        &mut self.values[from..to]
    }

    /// Λ_rc += m, whichever of the two comes first.
    pub fn add(&mut self, r: usize, c: usize, m: &Matrix3<f64>) {
        if r < c {
            self.add_below(c, r, &m.transpose());
        } else {
            self.add_below(r, c, m);
        }
    }

    fn add_below(&mut self, r: usize, c: usize, m: &Matrix3<f64>) {
        let height = self.height(c);
        let panel = self.panel_mut(c);
        for k in 0..3 {
            let at = k * height + 3 * (r - c);
            for (v, m) in panel[at..at + 3].iter_mut().zip(m.column(k).iter()) {
                *v += m;
            }
        }
    }

    /// b_c += v.
    pub fn add_rhs(&mut self, c: usize, v: &Vector3<f64>) {
        let height = self.height(c);
        let panel = self.panel_mut(c);
        for k in 0..3 {
            panel[(k + 1) * height - 1] += v[k];
        }
    }

    /// Takes up what an eliminated child leaves, whose separators are at `slots` here.
    pub fn take_up(&mut self, child: &Self, slots: &[u32]) {
        wide(
            #[inline(always)]
            || self.take_up_inline(child, slots),
        );
    }

    #[inline(always)]
    fn take_up_inline(&mut self, child: &Self, slots: &[u32]) {
        for (k, &c) in slots.iter().enumerate() {
            let (source, height) = (child.panel(child.frontals + k), child.height(child.frontals + k));
            self.take_up_panel(source, height, &slots[k..], c as usize);
        }
    }

    #[inline(always)]
    fn take_up_panel(&mut self, source: &[f64], height: usize, slots: &[u32], c: usize) {
        let into_height = self.height(c);
        let mut k = 0;
        while k < slots.len() {
            let r = slots[k] as usize;
            if r < c {
                // The child's order is older than this front's.
                let block = |row: usize, col: usize| source[col * height + 3 * k + row];
                self.add_below(c, r, &Matrix3::from_fn(|a, b| block(b, a)));
                k += 1;
                continue;
            }
            let run = 1 + slots[k..].windows(2).take_while(|w| w[1] == w[0] + 1).count();
            let into = self.panel_mut(c);
            for col in 0..3 {
                let from = &source[col * height + 3 * k..][..3 * run];
                let into = &mut into[col * into_height + 3 * (r - c)..][..3 * run];
                for (v, s) in into.iter_mut().zip(from) {
                    *v += s;
                }
            }
            k += run;
        }
        let into = self.panel_mut(c);
        for col in 0..3 {
            into[(col + 1) * into_height - 1] += source[(col + 1) * height - 1];
        }
    }

    /// Partial Cholesky of the frontals.
    pub fn eliminate(&mut self) -> Result<(), Ill> {
        wide(
            #[inline(always)]
            || self.eliminate_inline(),
        )
    }

    #[inline(always)]
    fn eliminate_inline(&mut self) -> Result<(), Ill> {
        let before: Vec<[f64; 3]> = (0..self.blocks).map(|j| self.diagonal(j)).collect();
        for j in 0..self.frontals {
            if !self.keeps(j, &before[j]) {
                return Err(Ill);
            }
            let (head, tail) = self.values.split_at_mut(offset(self.blocks, j + 1));
            let panel = &mut head[offset(self.blocks, j)..];
            let height = 3 * (self.blocks - j) + 1;
            eliminate_panel(panel, height)?;
            let (x0, rest) = panel.split_at(height);
            let (x1, x2) = rest.split_at(height);
            let mut tail = tail;
            for first in (3..height - 1).step_by(3) {
                let rows = height - first;
                let (panel, after) = tail.split_at_mut(3 * rows);
                let x = [&x0[first..], &x1[first..], &x2[first..]];
                let (p0, rest) = panel.split_at_mut(rows);
                let (p1, p2) = rest.split_at_mut(rows);
                // `panel −= x xᵀ`: where the smoother spends its time.
                subtract_products([p0, p1, p2], x, columns_of(&block_of(x, 0).transpose()), rows);
                tail = after;
            }
        }
        if (self.frontals..self.blocks).all(|j| self.keeps(j, &before[j])) { Ok(()) } else { Err(Ill) }
    }

    /// Whether a block's diagonal is more than rounding of what it was.
    fn keeps(&self, j: usize, before: &[f64; 3]) -> bool {
        self.diagonal(j).iter().zip(before).all(|(a, b)| *a > KEPT_MIN * b || *b == 0.0)
    }

    /// Whether so little would be rounding on a block's diagonal.
    pub fn drowns(&self, j: usize, little: &Matrix3<f64>) -> bool {
        self.diagonal(j).iter().zip(little.diagonal().iter()).any(|(all, little)| *little < KEPT_MIN * all)
    }

    /// What is left on the separators, where it has digits that [`Front::left`] lost.
    pub fn root(&self) -> Option<MatRef<'_, f64>> {
        self.root.as_deref().map(Mat::as_ref)
    }

    /// What is left on the separators: `[Λ_SS | b_S]`.
    pub fn left(&self) -> Mat<f64> {
        let n = 3 * (self.blocks - self.frontals);
        let mut left = Mat::zeros(n, n + 1);
        for c in 0..n {
            let column = self.columns(self.frontals + c / 3)[c % 3];
            for r in c..n {
                left[(r, c)] = column[r - c / 3 * 3];
                left[(c, r)] = left[(r, c)];
            }
            left[(c, n)] = column[column.len() - 1];
        }
        left
    }

    /// From an upper triangular root `[R | d]` of the whole front: `Λ = RᵀR`, `b = Rᵀd`. None where a
    /// frontal is not held by anything.
    pub fn from_root(blocks: usize, frontals: usize, root: MatRef<'_, f64>) -> Option<Self> {
        let mut front = Self::new(blocks, frontals);
        let (n, f) = (3 * blocks, 3 * frontals);
        let separators = root.submatrix(f, f, n - f, n - f + 1);
        let left = separators.subcols(0, n - f).transpose() * separators;
        for c in 0..n {
            let height = front.height(c / 3);
            let panel = front.panel_mut(c / 3);
            let column = &mut panel[c % 3 * height..(c % 3 + 1) * height];
            if c >= f {
                (c / 3 * 3..n).for_each(|r| column[r - c / 3 * 3] = left[(r - f, c - f)]);
                column[height - 1] = left[(c - f, n - f)];
                continue;
            }
            let pivot = root[(c, c)];
            if !(pivot.is_finite() && pivot != 0.0) {
                return None;
            }
            (c..n).for_each(|r| column[r - c / 3 * 3] = pivot.signum() * root[(c, r)]);
            column[height - 1] = pivot.signum() * root[(c, n)];
        }
        let lost = |c: usize| {
            let column = separators.col(c).subrows(0, c + 1);
            column[c] * column[c] < KEPT_MIN * column.squared_norm_l2()
        };
        if (0..n - f).any(lost) {
            front.root = Some(Box::new(separators.to_owned()));
        }
        Some(front)
    }

    /// What the frontals' elimination adds to the evidence: `−dᵀd` and `−½ log|L Lᵀ/2π|`.
    pub fn eliminated(&self) -> Sums {
        let mut sums = Sums { chi2: 0.0, log_weight: 1.5 * TAU.ln() * self.frontals as f64 };
        // As few logarithms as the range of numbers allows.
        let mut pivots = 1.0_f64;
        for j in 0..self.frontals {
            let [c0, c1, c2] = self.columns(j);
            let last = c0.len() - 1;
            sums.chi2 -= c0[last] * c0[last] + c1[last] * c1[last] + c2[last] * c2[last];
            pivots *= c0[0] * c1[1] * c2[2];
            if !PIVOTS.contains(&pivots) {
                sums.log_weight -= pivots.ln();
                pivots = 1.0;
            }
        }
        sums.log_weight -= pivots.ln();
        sums
    }

    fn diagonal(&self, j: usize) -> [f64; 3] {
        let (panel, height) = (self.panel(j), self.height(j));
        [panel[0], panel[height + 1], panel[2 * height + 2]]
    }

    /// `L_FFᵀ x_F = d − L_Sᵀ x_S`: fills the frontals' part of x, three numbers a block.
    pub fn solve_back(&self, x: &mut [f64]) {
        wide(
            #[inline(always)]
            || self.solve_back_inline(x),
        );
    }

    #[inline(always)]
    fn solve_back_inline(&self, x: &mut [f64]) {
        for j in (0..self.frontals).rev() {
            let columns = self.columns(j);
            let last = columns[0].len() - 1;
            let sums = dots(rows_of(columns, 3..last), &x[3 * (j + 1)..3 * self.blocks]);
            let t = [columns[0][last] - sums[0], columns[1][last] - sums[1], columns[2][last] - sums[2]];
            back(columns, t, &mut x[3 * j..3 * j + 3]);
        }
    }

    /// `L_FF y = b_F`, `b_S −= L_S y`, for three right-hand sides, column after column: the frontals'
    /// rows become y.
    pub fn solve_forward(&self, b: &mut [f64]) {
        wide(
            #[inline(always)]
            || {
                let n = 3 * self.blocks;
                for j in 0..self.frontals {
                    let columns = self.columns(j);
                    let diagonal = block_of(columns, 0);
                    let at = 3 * j;
                    let head = Matrix3::from_fn(|r, c| b[c * n + at + r]);
                    let y = solve_lower(&diagonal, &head);
                    for c in 0..3 {
                        b[c * n + at..][..3].copy_from_slice(y.column(c).as_slice());
                    }
                    let rows = n - at - 3;
                    let l = rows_of(columns, 3..3 + rows);
                    let (b0, rest) = b.split_at_mut(n);
                    let (b1, b2) = rest.split_at_mut(n);
                    let into = [&mut b0[at + 3..], &mut b1[at + 3..], &mut b2[at + 3..]];
                    let y = columns_of(&y);
                    subtract_products(into, l, y, rows);
                }
            },
        );
    }

    /// The columns of a panel.
    #[inline(always)]
    pub fn columns(&self, j: usize) -> [&[f64]; 3] {
        let (panel, height) = (self.panel(j), self.height(j));
        let (c0, rest) = panel.split_at(height);
        let (c1, c2) = rest.split_at(height);
        [c0, c1, c2]
    }
}
