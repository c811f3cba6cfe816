//! The loops where the smoother spends its time, over panels of three columns.
//!
//! Always inlined, into functions that run with the widest registers that the processor has. No sum
//! is reordered by that: the same bits come out on every machine.

// Inlined, a loop runs in the registers of who calls it; called, in those that every processor has.
#![allow(clippy::inline_always)]

use nalgebra::Matrix3;

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

/// `L⁻ᵀ m` of a lower triangular block.
#[inline(always)]
pub(super) fn solve_transposed(l: &Matrix3<f64>, m: &Matrix3<f64>) -> Matrix3<f64> {
    let (i0, i1, i2) = (1.0 / l[(0, 0)], 1.0 / l[(1, 1)], 1.0 / l[(2, 2)]);
    let mut x = Matrix3::zeros();
    for c in 0..3 {
        let x2 = m[(2, c)] * i2;
        let x1 = (m[(1, c)] - x2 * l[(2, 1)]) * i1;
        let x0 = (m[(0, c)] - x1 * l[(1, 0)] - x2 * l[(2, 0)]) * i0;
        (x[(0, c)], x[(1, c)], x[(2, c)]) = (x0, x1, x2);
    }
    x
}

/// `sums_c += Σ_k l_ck columns_k`, for three sums one after the other.
#[inline(always)]
pub(super) fn add_products(sums: &mut [f64], columns: [&[f64]; 3], l: [[f64; 3]; 3], rows: usize) {
    let (s0, rest) = sums.split_at_mut(rows);
    let (s1, s2) = rest.split_at_mut(rows);
    let [x0, x1, x2] = columns.map(|x| &x[..rows]);
    let s2 = &mut s2[..rows];
    for i in 0..rows {
        let (u, v, w) = (x0[i], x1[i], x2[i]);
        s0[i] += u * l[0][0] + v * l[0][1] + w * l[0][2];
        s1[i] += u * l[1][0] + v * l[1][1] + w * l[1][2];
        s2[i] += u * l[2][0] + v * l[2][1] + w * l[2][2];
    }
}

/// `into_c −= Σ_k y_ck columns_k`.
#[inline(always)]
pub(super) fn subtract_products(into: [&mut [f64]; 3], columns: [&[f64]; 3], y: [[f64; 3]; 3], rows: usize) {
    let [p0, p1, p2] = into.map(|p| &mut p[..rows]);
    let [x0, x1, x2] = columns.map(|x| &x[..rows]);
    for i in 0..rows {
        let (u, v, w) = (x0[i], x1[i], x2[i]);
        p0[i] -= u * y[0][0] + v * y[0][1] + w * y[0][2];
        p1[i] -= u * y[1][0] + v * y[1][1] + w * y[1][2];
        p2[i] -= u * y[2][0] + v * y[2][1] + w * y[2][2];
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
    let chunks = columns.map(|c| c[..whole].chunks_exact(4));
    let [a, b, c] = chunks;
    for (((a, b), c), x) in a.zip(b).zip(c).zip(x.chunks_exact(4)) {
        for l in 0..4 {
            sums[0][l] += a[l] * x[l];
            sums[1][l] += b[l] * x[l];
            sums[2][l] += c[l] * x[l];
        }
    }
    for i in whole..x.len() {
        for (sum, column) in sums.iter_mut().zip(columns) {
            sum[0] += column[i] * x[i];
        }
    }
    sums.map(|s| (s[0] + s[1]) + (s[2] + s[3]))
}
