//! Elimination of a front by QR, for where Cholesky would lose digits.
//!
//! Where a pose known to centimetres hangs on one known to kilometres, `Λ_SS − L_S L_Sᵀ` subtracts
//! two numbers alike in all their digits. From square roots, `Λ = AᵀA`, A = QR, nothing is
//! subtracted: R's first rows are the frontals' `Lᵀ`, and what is left is `R_Sᵀ R_S`. Where that
//! square would lose digits, the parent takes up R_S, and is eliminated by QR as well.

use crate::smoothing::factor::residual;
use crate::smoothing::front::Front;
use crate::smoothing::structure::Structure;
use crate::smoothing::tree::{Clique, Entry, NONE, Places, Share};
use crate::smoothing::{Belief, SmoothError};
use faer::linalg::solvers::{Qr, SelfAdjointEigen};
use faer::{Mat, MatRef, Side};

/// Share of a child's largest (scaled) eigenvalue below which another is rounding.
const ROUNDING: f64 = 1e-13;

/// The front of a clique, assembled from square roots `[A | d]` and eliminated.
pub(super) fn eliminated(
    structure: &Structure,
    belief: &Belief,
    clique: &Clique,
) -> Result<Front, SmoothError> {
    let n = 3 * clique.poses.len();
    let mut parts: Vec<Mat<f64>> = Vec::new();
    for share in &clique.factors {
        parts.extend(factor_rows(structure, belief, share, clique)?);
    }
    for &child in &clique.children {
        if let Some(numbers) = &belief.fronts[child as usize] {
            let slots = &structure.tree.cliques[child as usize].slots;
            parts.push(match numbers.root() {
                Some(rows) => spread(rows, slots, n),
                None => spread(root(numbers.left().as_ref())?.as_ref(), slots, n),
            });
        }
    }
    let height = parts.iter().map(Mat::nrows).sum::<usize>().max(n + 1);
    let mut stacked = Mat::zeros(height, n + 1);
    let mut at = 0;
    for part in &parts {
        stacked.subrows_mut(at, part.nrows()).copy_from(part);
        at += part.nrows();
    }
    refuse_infinite(stacked.as_ref())?;
    let qr = Qr::new(stacked.as_ref());
    Front::from_root(clique.poses.len(), clique.frontals, qr.thin_R()).ok_or(SmoothError::Singular)
}

/// `Ω^½ [J | −e]` of a between-factor; the root of a prior's linearisation.
fn factor_rows(
    structure: &Structure,
    belief: &Belief,
    share: &Share,
    clique: &Clique,
) -> Result<Option<Mat<f64>>, SmoothError> {
    let n = 3 * clique.poses.len();
    match (&structure.entries[share.id as usize], &share.at) {
        (Entry::Between(f, z), &Places::Two(i, j)) if belief.has(structure, share.id) => {
            let [at_i, at_j] = belief.points_of(f);
            let r = residual(z, &at_i, &at_j);
            let root = f.information.cholesky().ok_or(SmoothError::Singular)?.l().transpose();
            let mut rows = Mat::zeros(3, n + 1);
            for (place, jacobian) in [(i, root * r.j_i), (j, root * r.j_j)] {
                if place != NONE {
                    for (k, column) in jacobian.column_iter().enumerate() {
                        (0..3).for_each(|row| rows[(row, 3 * place as usize + k)] = column[row]);
                    }
                }
            }
            let error = root * r.error;
            (0..3).for_each(|row| rows[(row, n)] = -error[row]);
            Ok(Some(rows))
        }
        (Entry::Prior(poses), Places::Many(places)) => {
            let Some(prior) = belief.prior(share.id) else { return Ok(None) };
            let mut alone = Front::new(clique.poses.len(), 0);
            prior.add_to(&mut alone, poses, places, belief.points_among(poses));
            root(alone.left().as_ref()).map(Some)
        }
        _ => Ok(None),
    }
}

/// `[A | d]` with `AᵀA = H`, `Aᵀd = b`, of `[H | b]` with a semidefinite H, scaled to a unit diagonal
/// first.
fn root(system: MatRef<'_, f64>) -> Result<Mat<f64>, SmoothError> {
    refuse_infinite(system)?;
    let n = system.nrows();
    let scale: Vec<f64> =
        (0..n).map(|k| system[(k, k)]).map(|v| if v > 0.0 { v.sqrt() } else { 1.0 }).collect();
    let scaled = Mat::from_fn(n, n, |r, c| system[(r, c)] / (scale[r] * scale[c]));
    let eigen = SelfAdjointEigen::new(scaled.as_ref(), Side::Lower).map_err(|_| SmoothError::Singular)?;
    let values = eigen.S().column_vector();
    let least = ROUNDING * (0..n).map(|k| values[k].abs()).fold(0.0, f64::max);
    let mut rows = Mat::zeros(n, n + 1);
    for k in (0..n).filter(|&k| values[k] > least) {
        let root = values[k].sqrt();
        for c in 0..n {
            let v = eigen.U()[(c, k)];
            rows[(k, c)] = root * v * scale[c];
            rows[(k, n)] += v * system[(c, n)] / (scale[c] * root);
        }
    }
    Ok(rows)
}

fn refuse_infinite(m: MatRef<'_, f64>) -> Result<(), SmoothError> {
    if m.is_all_finite() { Ok(()) } else { Err(SmoothError::Singular) }
}

/// Rows over a child's separators as rows over the front, right-hand side last.
fn spread(rows: MatRef<'_, f64>, slots: &[u32], n: usize) -> Mat<f64> {
    let mut wide = Mat::zeros(rows.nrows(), n + 1);
    for (k, &slot) in slots.iter().enumerate() {
        wide.subcols_mut(3 * slot as usize, 3).copy_from(rows.subcols(3 * k, 3));
    }
    wide.col_mut(n).copy_from(rows.col(rows.ncols() - 1));
    wide
}
