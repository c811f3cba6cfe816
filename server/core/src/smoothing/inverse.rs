//! The selected inverse: from the covariances of a clique's separators those of its frontals
//! (Takahashi, Fagan, Chin 1973), a clique at a time:
//!
//! ```text
//! Y = L_S L_FF⁻¹,   Σ_SF = −Σ_SS Y,   Σ_FF = L_FF⁻ᵀ L_FF⁻¹ − Yᵀ Σ_SF
//! ```

// Inlined, a loop runs in the registers of who calls it; called, in those that every processor has.
#![allow(clippy::inline_always)]

use super::front::Front;
use super::kernels::{block_of, columns_of, rows_of, solve_lower, subtract_products, wide};
use nalgebra::Matrix3;

/// Rows of Σ_SS Y that are summed side by side.
const TILE: usize = 8;

/// Which covariances of a clique are asked for.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Fill {
    /// Each frontal's with itself: enough for a leaf.
    Diagonal,
    /// All, for the children to take theirs from.
    All,
}

/// Working memory, used again from clique to clique.
#[derive(Default)]
pub(super) struct Scratch {
    /// `[L_FF⁻¹; Y]`, n rows by 3·frontals.
    y: Vec<f64>,
    /// Σ_SS Y.
    product: Vec<f64>,
}

/// Numbers that hold the covariances over n coordinates: a symmetric matrix column after column, three
/// columns of cross-covariances with the newest pose, and what the last tile reads beyond.
pub(super) fn filled_len(n: usize) -> usize {
    n * n + 3 * n + TILE
}

/// Makes room; what is there is of no account, and never cleared.
pub(super) fn grow(values: &mut Vec<f64>, len: usize) {
    if values.len() < len {
        values.resize(len, 0.0);
    }
}

impl Front {
    /// Fills the frontals' covariances into `sigma` (see [`filled_len`]), which holds the separators'.
    pub fn fill_covariance(&self, sigma: &mut [f64], scratch: &mut Scratch, fill: Fill) {
        wide(
            #[inline(always)]
            || self.fill_inline(sigma, scratch, fill),
        );
    }

    #[inline(always)]
    fn fill_inline(&self, sigma: &mut [f64], scratch: &mut Scratch, fill: Fill) {
        let (n, f) = (3 * self.blocks, 3 * self.frontals);
        let s = n - f;
        self.solve_separators(&mut scratch.y);
        // A tile's last rows may lie beyond the separators.
        let height = s.next_multiple_of(TILE);
        grow(&mut scratch.product, height * f);
        multiply(&sigma[f * n..], n, f, &scratch.y, n, &mut scratch.product, height);
        let y = |c: usize| &scratch.y[c * n..][..n];
        let product = |c: usize| &scratch.product[c * height..][..s];
        for j in 0..f {
            let first = if fill == Fill::All { 0 } else { j / 3 * 3 };
            for i in first..=j {
                // L_FF⁻¹ is lower triangular: its columns begin at their own rows.
                let value = dot(&y(i)[j..f], &y(j)[j..f]) + dot(&y(i)[f..], product(j));
                (sigma[j * n + i], sigma[i * n + j]) = (value, value);
            }
            if fill == Fill::All {
                for (m, v) in product(j).iter().enumerate() {
                    sigma[j * n + f + m] = -v;
                    sigma[(f + m) * n + j] = -v;
                }
            }
        }
        let cross = &mut sigma[n * n..][..3 * n];
        for column in cross.chunks_exact_mut(n) {
            let (frontals, separators) = column.split_at_mut(f);
            for (j, v) in frontals.iter_mut().enumerate() {
                *v = -dot(&y(j)[f..], separators);
            }
        }
    }

    /// `[L_FF⁻¹; L_S L_FF⁻¹]`, n rows by 3·frontals, column after column.
    #[inline(always)]
    fn solve_separators(&self, y: &mut Vec<f64>) {
        let n = 3 * self.blocks;
        grow(y, n * 3 * self.frontals);
        for j in (0..self.frontals).rev() {
            let panel = self.columns(j);
            let own = block_of(panel, 0);
            let (head, done) = y.split_at_mut(3 * (j + 1) * n);
            let (c0, rest) = head[3 * j * n..].split_at_mut(n);
            let (c1, c2) = rest.split_at_mut(n);
            let below = 3 * self.frontals;
            let from = below - 3 * j;
            let l_s = rows_of(panel, from..from + n - below);
            for (column, l_s) in [&mut *c0, &mut *c1, &mut *c2].into_iter().zip(l_s) {
                column[3 * (j + 1)..below].fill(0.0);
                column[below..].copy_from_slice(l_s);
            }
            for k in j + 1..self.frontals {
                let l_kj = columns_of(&block_of(panel, 3 * (k - j)));
                let y_k = &done[3 * (k - j - 1) * n..][..3 * n];
                let (y0, rest) = y_k.split_at(n);
                let (y1, y2) = rest.split_at(n);
                let at = 3 * k;
                let into = [&mut c0[at..], &mut c1[at..], &mut c2[at..]];
                subtract_products(into, [&y0[at..], &y1[at..], &y2[at..]], l_kj, n - at);
            }
            divide([&mut c0[3 * (j + 1)..], &mut c1[3 * (j + 1)..], &mut c2[3 * (j + 1)..]], &own);
            let inverse = solve_lower(&own, &Matrix3::identity());
            for (c, column) in [c0, c1, c2].into_iter().enumerate() {
                column[3 * j..][..3].copy_from_slice(inverse.column(c).as_slice());
            }
        }
    }
}

/// `X ← X L⁻¹` of a lower triangular block.
#[inline(always)]
fn divide([x0, x1, x2]: [&mut [f64]; 3], l: &Matrix3<f64>) {
    let (i0, i1, i2) = (1.0 / l.m11, 1.0 / l.m22, 1.0 / l.m33);
    for ((a, b), c) in x0.iter_mut().zip(x1).zip(x2) {
        *c *= i2;
        *b = (*b - *c * l.m32) * i1;
        *a = (*a - *b * l.m21 - *c * l.m31) * i0;
    }
}

/// `product = Σ_SS Y`: Σ's columns are n apart, and the separators' rows of Σ and Y begin at f; the
/// product's columns are `height` apart.
#[inline(always)]
fn multiply(sigma: &[f64], n: usize, f: usize, y: &[f64], stride: usize, product: &mut [f64], height: usize) {
    for from in (0..height).step_by(TILE) {
        for c in (0..f).step_by(3) {
            let y = &y[c * stride..][..3 * stride];
            let y = rows_of([y, &y[stride..], &y[2 * stride..]], f..n);
            let sums = tile(&sigma[f + from..], n, y);
            for (k, sum) in sums.iter().enumerate() {
                product[(c + k) * height + from..][..TILE].copy_from_slice(sum);
            }
        }
    }
}

/// Some rows of Σ's columns, n apart, times three columns.
#[inline(always)]
fn tile(sigma: &[f64], n: usize, [y0, y1, y2]: [&[f64]; 3]) -> [[f64; TILE]; 3] {
    let mut sums = [[0.0; TILE]; 3];
    for (k, ((y0, y1), y2)) in y0.iter().zip(y1).zip(y2).enumerate() {
        let column = &sigma[k * n..][..TILE];
        for r in 0..TILE {
            sums[0][r] = column[r].mul_add(*y0, sums[0][r]);
            sums[1][r] = column[r].mul_add(*y1, sums[1][r]);
            sums[2][r] = column[r].mul_add(*y2, sums[2][r]);
        }
    }
    sums
}

/// `aᵀb` in eight interleaved sums.
#[inline(always)]
fn dot(a: &[f64], b: &[f64]) -> f64 {
    let mut sums = [0.0f64; TILE];
    let whole = a.len().min(b.len()) / TILE * TILE;
    for (a, b) in a[..whole].chunks_exact(TILE).zip(b[..whole].chunks_exact(TILE)) {
        for r in 0..TILE {
            sums[r] = a[r].mul_add(b[r], sums[r]);
        }
    }
    for (a, b) in a[whole..].iter().zip(&b[whole..]) {
        sums[0] = a.mul_add(*b, sums[0]);
    }
    ((sums[0] + sums[1]) + (sums[2] + sums[3])) + ((sums[4] + sums[5]) + (sums[6] + sums[7]))
}
