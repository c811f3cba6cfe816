//! Sparse Cholesky factorisation `H = L Lᵀ` in 3×3 blocks, its solves and its selected inverse.

use super::SmoothError;
use super::symbolic::Symbolic;
use nalgebra::{Matrix3, SMatrix};
use serde::{Deserialize, Serialize};

const NONE: u32 = u32::MAX;

/// A symmetric block matrix with the structure of its own factor, lower triangle, elimination
/// order.
pub(super) struct Blocks {
    pub diagonal: Vec<Matrix3<f64>>,
    /// In the order of [`Symbolic::row`]; zero where the factor fills in.
    pub below: Vec<Matrix3<f64>>,
}

impl Blocks {
    pub fn zeros(symbolic: &Symbolic) -> Self {
        Self {
            diagonal: vec![Matrix3::zeros(); symbolic.columns()],
            below: vec![Matrix3::zeros(); symbolic.row.len()],
        }
    }
}

/// The factor L of one information matrix.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct Cholesky {
    pub symbolic: Symbolic,
    /// Inverses of the diagonal blocks of L (lower triangular).
    diagonal_inverse: Vec<Matrix3<f64>>,
    /// Blocks of L below the diagonal.
    below: Vec<Matrix3<f64>>,
}

impl Cholesky {
    /// Factorises `h`, left-looking: column j takes what every earlier column k with a block in row j owes it.
    pub fn factorise(symbolic: &Symbolic, h: Blocks) -> Result<Self, SmoothError> {
        let n = symbolic.columns();
        let Blocks { mut diagonal, mut below } = h;
        let mut diagonal_inverse = Vec::with_capacity(n);
        let mut slot_of_row = vec![0_u32; n];
        // Columns whose next unused block lies in a given row, as linked lists.
        let (mut head, mut next) = (vec![NONE; n], vec![NONE; n]);
        let mut cursor: Vec<u32> = symbolic.start[..n].to_vec();
        for j in 0..n {
            let column = symbolic.column(j);
            for s in column.clone() {
                slot_of_row[symbolic.row[s] as usize] = (s - column.start) as u32;
            }
            let (done, open) = below.split_at_mut(column.start);
            let mut k = head[j];
            while k != NONE {
                let following = next[k as usize];
                let (first, end) = (cursor[k as usize] as usize, symbolic.column(k as usize).end);
                let l_jk = done[first];
                subtract_product(&mut diagonal[j], &l_jk, &l_jk);
                for s in first + 1..end {
                    let slot = slot_of_row[symbolic.row[s] as usize] as usize;
                    subtract_product(&mut open[slot], &done[s], &l_jk);
                }
                advance(symbolic, &mut cursor, &mut head, &mut next, k as usize, first + 1);
                k = following;
            }
            let inverse = inverse_lower_cholesky(&diagonal[j])?;
            for block in &mut open[..column.len()] {
                *block *= inverse.transpose();
            }
            diagonal_inverse.push(inverse);
            advance(symbolic, &mut cursor, &mut head, &mut next, j, column.start);
        }
        Ok(Self { symbolic: symbolic.clone(), diagonal_inverse, below })
    }

    /// Solves `L Lᵀ x = b` in place, by elimination position.
    pub fn solve<const C: usize>(&self, b: &mut [SMatrix<f64, 3, C>]) {
        let n = self.symbolic.columns();
        self.forward(b, 0, n);
        self.backward(b, n);
    }

    /// `H⁻¹` of the last variable: its marginal covariance.
    pub fn last_marginal(&self) -> Matrix3<f64> {
        let inverse = &self.diagonal_inverse[self.symbolic.columns() - 1];
        inverse.transpose() * inverse
    }

    /// How every variable answers a unit motion of the last one: `−H_oo⁻¹ H_ol`, o the others,
    /// l the last.
    pub fn response_to_last(&self) -> Vec<Matrix3<f64>> {
        let last = self.symbolic.columns() - 1;
        let mut x = vec![Matrix3::zeros(); last + 1];
        x[last] = Matrix3::identity();
        self.backward(&mut x, last);
        x
    }

    /// Column `at` of `H_oo⁻¹`: covariances with variable `at` given the last one.
    pub fn conditional_column(&self, at: usize) -> Vec<Matrix3<f64>> {
        let last = self.symbolic.columns() - 1;
        let mut x = vec![Matrix3::zeros(); last + 1];
        if at < last {
            x[at] = Matrix3::identity();
            self.forward(&mut x, at, last);
            x[last] = Matrix3::zeros();
            self.backward(&mut x, last);
        }
        x
    }

    /// Diagonal blocks of `H_oo⁻¹`: marginals given the last variable (whose own block is zero).
    ///
    /// Takahashi's recursion: with the unit factor `L̄ = L·diag(L)⁻¹`, and S the rows of column j,
    /// `Z_Sj = −Z_SS L̄_Sj` and `Z_jj = (L_jj L_jjᵀ)⁻¹ − L̄_Sjᵀ Z_Sj` need entries of Z within the
    /// structure of L only.
    pub fn conditional_marginals(&self) -> Vec<Matrix3<f64>> {
        let last = self.symbolic.columns() - 1;
        let mut diagonal = vec![Matrix3::zeros(); last + 1];
        let mut below = vec![Matrix3::zeros(); self.below.len()];
        let mut slot_of_row = vec![NONE; last + 1];
        let (mut unit, mut sum) = (Vec::new(), Vec::new());
        for j in (0..last).rev() {
            let rows = self.rows_but_last(j);
            unit.clear();
            unit.extend(self.below[rows.clone()].iter().map(|l| l * self.diagonal_inverse[j]));
            sum.clear();
            sum.resize(unit.len(), Matrix3::zeros());
            for (t, s) in rows.clone().enumerate() {
                slot_of_row[self.symbolic.row[s] as usize] = t as u32;
            }
            for (t, s) in rows.clone().enumerate() {
                let k = self.symbolic.row[s] as usize;
                sum[t] += diagonal[k] * unit[t];
                for q in self.rows_but_last(k) {
                    let u = slot_of_row[self.symbolic.row[q] as usize];
                    if u != NONE {
                        sum[u as usize] += below[q] * unit[t];
                        sum[t] += below[q].tr_mul(&unit[u as usize]);
                    }
                }
            }
            let inverse = &self.diagonal_inverse[j];
            let mut z_jj = inverse.tr_mul(inverse);
            for (t, s) in rows.enumerate() {
                slot_of_row[self.symbolic.row[s] as usize] = NONE;
                below[s] = -sum[t];
                z_jj += unit[t].tr_mul(&sum[t]);
            }
            diagonal[j] = super::factor::symmetrised(&z_jj);
        }
        diagonal
    }

    /// Storage range of column j without a block in the last row.
    fn rows_but_last(&self, j: usize) -> std::ops::Range<usize> {
        let mut range = self.symbolic.column(j);
        if range.end > range.start && self.symbolic.row[range.end - 1] as usize + 1 == self.symbolic.columns()
        {
            range.end -= 1;
        }
        range
    }

    /// `L y = b` for columns `from..to`, in place.
    fn forward<const C: usize>(&self, b: &mut [SMatrix<f64, 3, C>], from: usize, to: usize) {
        for j in from..to {
            let y = self.diagonal_inverse[j] * b[j];
            b[j] = y;
            for s in self.symbolic.column(j) {
                b[self.symbolic.row[s] as usize] -= self.below[s] * y;
            }
        }
    }

    /// `Lᵀ x = y` for columns `0..to` from the last to the first, in place.
    fn backward<const C: usize>(&self, y: &mut [SMatrix<f64, 3, C>], to: usize) {
        for j in (0..to).rev() {
            let mut rest = y[j];
            for s in self.symbolic.column(j) {
                rest -= self.below[s].tr_mul(&y[self.symbolic.row[s] as usize]);
            }
            y[j] = self.diagonal_inverse[j].tr_mul(&rest);
        }
    }
}

/// Moves column k's cursor to block `to` and files the column under that block's row.
fn advance(symbolic: &Symbolic, cursor: &mut [u32], head: &mut [u32], next: &mut [u32], k: usize, to: usize) {
    cursor[k] = to as u32;
    if to < symbolic.column(k).end {
        let row = symbolic.row[to] as usize;
        next[k] = head[row];
        head[row] = k as u32;
    }
}

/// `into −= a bᵀ`: where the factorisation spends its time.
#[inline]
fn subtract_product(into: &mut Matrix3<f64>, a: &Matrix3<f64>, b: &Matrix3<f64>) {
    for c in 0..3 {
        for r in 0..3 {
            into[(r, c)] -= a[(r, 0)] * b[(c, 0)] + a[(r, 1)] * b[(c, 1)] + a[(r, 2)] * b[(c, 2)];
        }
    }
}

/// Inverse of the Cholesky factor of a 3×3 block.
fn inverse_lower_cholesky(m: &Matrix3<f64>) -> Result<Matrix3<f64>, SmoothError> {
    let root = |v: f64| {
        // Also refuses NaN.
        if v > 0.0 && v.is_finite() { Ok(v.sqrt()) } else { Err(SmoothError::Singular) }
    };
    let l00 = root(m[(0, 0)])?;
    let (l10, l20) = (m[(1, 0)] / l00, m[(2, 0)] / l00);
    let l11 = root(m[(1, 1)] - l10 * l10)?;
    let l21 = (m[(2, 1)] - l20 * l10) / l11;
    let l22 = root(m[(2, 2)] - l20 * l20 - l21 * l21)?;
    let (i0, i1, i2) = (1.0 / l00, 1.0 / l11, 1.0 / l22);
    let i10 = -l10 * i0 * i1;
    let i21 = -l21 * i1 * i2;
    Ok(Matrix3::new(i0, 0.0, 0.0, i10, i1, 0.0, -(l20 * i0 + l21 * i10) * i2, i21, i2))
}
