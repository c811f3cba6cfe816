//! The loops where the smoother spends its time, over panels of three columns.
//!
//! Always inlined, into functions that run with the widest registers that the processor has. No sum
//! is reordered by that, and products are added with one rounding everywhere (in software, slowly,
//! where the processor can't): the same bits come out on every machine. Iterators' closures and
//! `array::map` are calls to code that is not wide: loops are written out.

// Inlined, a loop runs in the registers of who calls it; called, in those that every processor has.
#![allow(clippy::inline_always)]

pub(super) use crate::wide::wide;
use nalgebra::Matrix3;
use std::ops::Range;

/// A pivot that keeps less than this share of its diagonal has lost all digits.
const PIVOT_MIN: f64 = 1e-14;
/// Elimination by Cholesky would lose digits; the front is spoilt.
#[derive(Debug)]
pub(super) struct Ill;

/// The block of a panel that begins at a row.
#[inline(always)]
pub(super) fn block_of([a, b, c]: [&[f64]; 3], at: usize) -> Matrix3<f64> {
    Matrix3::new(a[at], b[at], c[at], a[at + 1], b[at + 1], c[at + 1], a[at + 2], b[at + 2], c[at + 2])
}

/// Columns of a block.
#[inline(always)]
pub(super) fn columns_of(m: &Matrix3<f64>) -> [[f64; 3]; 3] {
    [[m.m11, m.m21, m.m31], [m.m12, m.m22, m.m32], [m.m13, m.m23, m.m33]]
}

/// The same rows of three columns.
#[inline(always)]
pub(super) fn rows_of([a, b, c]: [&[f64]; 3], rows: Range<usize>) -> [&[f64]; 3] {
    [&a[rows.clone()], &b[rows.clone()], &c[rows]]
}

/// `x = L_jj⁻ᵀ t`, of a panel's diagonal block.
#[inline(always)]
pub(super) fn back([c0, c1, c2]: [&[f64]; 3], t: [f64; 3], x: &mut [f64]) {
    let x2 = t[2] / c2[2];
    let x1 = (t[1] - c1[2] * x2) / c1[1];
    let x0 = (t[0] - c0[1] * x1 - c0[2] * x2) / c0[0];
    x.copy_from_slice(&[x0, x1, x2]);
}

/// `L⁻¹ m` of a lower triangular block.
#[inline(always)]
pub(super) fn solve_lower(l: &Matrix3<f64>, m: &Matrix3<f64>) -> Matrix3<f64> {
    let (i0, i1, i2) = (1.0 / l[(0, 0)], 1.0 / l[(1, 1)], 1.0 / l[(2, 2)]);
    let mut x = Matrix3::zeros();
    for c in 0..3 {
        let x0 = m[(0, c)] * i0;
        let x1 = (m[(1, c)] - x0 * l[(1, 0)]) * i1;
        let x2 = (m[(2, c)] - x0 * l[(2, 0)] - x1 * l[(2, 1)]) * i2;
        (x[(0, c)], x[(1, c)], x[(2, c)]) = (x0, x1, x2);
    }
    x
}

/// `into_c −= Σ_k y_ck columns_k`.
#[inline(always)]
pub(super) fn subtract_products(into: [&mut [f64]; 3], columns: [&[f64]; 3], y: [[f64; 3]; 3], rows: usize) {
    let [p0, p1, p2] = into;
    let (p0, p1, p2) = (&mut p0[..rows], &mut p1[..rows], &mut p2[..rows]);
    let [x0, x1, x2] = rows_of(columns, 0..rows);
    for i in 0..rows {
        let (u, v, w) = (x0[i], x1[i], x2[i]);
        p0[i] = w.mul_add(-y[0][2], v.mul_add(-y[0][1], u.mul_add(-y[0][0], p0[i])));
        p1[i] = w.mul_add(-y[1][2], v.mul_add(-y[1][1], u.mul_add(-y[1][0], p1[i])));
        p2[i] = w.mul_add(-y[2][2], v.mul_add(-y[2][1], u.mul_add(-y[2][0], p2[i])));
    }
}

/// Where panel j begins.
pub(super) fn offset(blocks: usize, j: usize) -> usize {
    3 * (3 * (blocks * j - j * j.saturating_sub(1) / 2) + j)
}

/// Cholesky of a panel's diagonal block, and `X L⁻ᵀ` below.
#[inline(always)]
pub(super) fn eliminate_panel(panel: &mut [f64], height: usize) -> Result<(), Ill> {
    let (c0, rest) = panel.split_at_mut(height);
    let (c1, c2) = rest.split_at_mut(height);
    let root = |pivot: f64, diagonal: f64| {
        // Also refuses NaN.
        if pivot > PIVOT_MIN * diagonal && pivot < f64::INFINITY { Ok(pivot.sqrt()) } else { Err(Ill) }
    };
    let l00 = root(c0[0], c0[0])?;
    let i0 = 1.0 / l00;
    let (l10, l20) = (c0[1] * i0, c0[2] * i0);
    let l11 = root(c1[1] - l10 * l10, c1[1])?;
    let i1 = 1.0 / l11;
    let l21 = (c1[2] - l20 * l10) * i1;
    let l22 = root(c2[2] - l20 * l20 - l21 * l21, c2[2])?;
    let i2 = 1.0 / l22;
    (c0[0], c0[1], c0[2]) = (l00, l10, l20);
    (c1[0], c1[1], c1[2]) = (0.0, l11, l21);
    (c2[0], c2[1], c2[2]) = (0.0, 0.0, l22);
    for ((a, b), c) in c0[3..].iter_mut().zip(&mut c1[3..]).zip(&mut c2[3..]) {
        *a *= i0;
        *b = (*b - *a * l10) * i1;
        *c = (*c - *a * l20 - *b * l21) * i2;
    }
    Ok(())
}

/// Products of three columns with x, in four interleaved sums each, so that they run side by side.
#[inline(always)]
pub(super) fn dots(columns: [&[f64]; 3], x: &[f64]) -> [f64; 3] {
    let mut sums = [[0.0; 4]; 3];
    let whole = x.len() / 4 * 4;
    let [a, b, c] = rows_of(columns, 0..whole);
    let (a, b, c) = (a.chunks_exact(4), b.chunks_exact(4), c.chunks_exact(4));
    for (((a, b), c), x) in a.zip(b).zip(c).zip(x.chunks_exact(4)) {
        for l in 0..4 {
            sums[0][l] = a[l].mul_add(x[l], sums[0][l]);
            sums[1][l] = b[l].mul_add(x[l], sums[1][l]);
            sums[2][l] = c[l].mul_add(x[l], sums[2][l]);
        }
    }
    for i in whole..x.len() {
        for (sum, column) in sums.iter_mut().zip(columns) {
            sum[0] = column[i].mul_add(x[i], sum[0]);
        }
    }
    let total = |s: [f64; 4]| (s[0] + s[1]) + (s[2] + s[3]);
    [total(sums[0]), total(sums[1]), total(sums[2])]
}
