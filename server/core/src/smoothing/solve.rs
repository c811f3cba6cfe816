//! Gauss–Newton over all poses, with Marquardt's damping when a step would raise the cost.

use super::cholesky::{Blocks, Cholesky};
use super::symbolic::{ANCHORED, Symbolic};
use super::{Factor, SmoothError};
use crate::geometry::Pose2;
use nalgebra::Vector3;

/// A graph that needs more steps than this is inconsistent beyond repair.
const ITERATIONS_MAX: u32 = 60;
/// Converged when no pose moves by more, metres and radians.
const STEP_MAX: f64 = 1e-9;
/// Converged, too, when the decrement `δᵀ H δ` (the step in standard deviations, squared) is no
/// more than this per factor: what rounding alone does to a weakly held part of the graph.
const DECREMENT_PER_FACTOR: f64 = 1e-16;
/// Converged, last, when the decrement is below a thousandth of a standard deviation squared and
/// shrinks slowly: large residuals make Gauss–Newton linear, and further digits mean nothing.
const DECREMENT_SLOW: (f64, f64) = (1e-6, 0.25);
/// A cost may rise by this share: rounding of the sum.
const RISE: f64 = 1e-12;
/// First damping tried, and the last before giving up.
const DAMPING: (f64, f64) = (1e-4, 1e8);

/// The optimum and the factorised information matrix there.
pub(super) struct Solution {
    pub poses: Vec<Pose2>,
    pub chi2: f64,
    pub cholesky: Cholesky,
}

/// Minimises the objective from the given poses; pose 0 stays.
pub(super) fn solve(mut poses: Vec<Pose2>, factors: &[&Factor]) -> Result<Solution, SmoothError> {
    let symbolic = Symbolic::new(poses.len(), factors)?;
    let (errors, mut cost) = evaluate(&poses, factors);
    let (mut hessian, mut descent) = linearise(&symbolic, &poses, factors, &errors);
    let (mut damping, mut decrement) = (0.0, f64::INFINITY);
    for _ in 0..ITERATIONS_MAX {
        let cholesky = Cholesky::factorise(&symbolic, &hessian, damping)?;
        let mut step = descent.clone();
        cholesky.solve(&mut step);
        // Only an undamped step measures the distance to the optimum, and only the undamped
        // factor is that of the covariances.
        if damping == 0.0 {
            let last = std::mem::replace(&mut decrement, dot(&step, &descent));
            let slow = decrement <= DECREMENT_SLOW.0 && decrement >= DECREMENT_SLOW.1 * last;
            if slow || is_small(&step, decrement, factors.len()) {
                return Ok(Solution { poses, chi2: cost, cholesky });
            }
        }
        let tried = moved(&symbolic, &poses, &step);
        let (errors, tried_cost) = evaluate(&tried, factors);
        if tried_cost <= cost * (1.0 + RISE) + f64::MIN_POSITIVE {
            (poses, cost) = (tried, tried_cost);
            (hessian, descent) = linearise(&symbolic, &poses, factors, &errors);
            damping = if damping > DAMPING.0 { damping / 10.0 } else { 0.0 };
        } else {
            damping = (damping * 10.0).max(DAMPING.0);
            if damping > DAMPING.1 {
                break;
            }
        }
    }
    Err(SmoothError::NotConverged)
}

/// Every factor's error, and the cost `Σ eᵀ Ω e`.
fn evaluate(poses: &[Pose2], factors: &[&Factor]) -> (Vec<Vector3<f64>>, f64) {
    let errors: Vec<_> = factors.iter().map(|f| f.error(poses)).collect();
    let cost = factors.iter().zip(&errors).map(|(f, e)| e.dot(&(f.information * e))).sum();
    (errors, cost)
}

/// Information matrix (10) and half the negative gradient, at `poses`.
fn linearise(
    symbolic: &Symbolic,
    poses: &[Pose2],
    factors: &[&Factor],
    errors: &[Vector3<f64>],
) -> (Blocks, Vec<Vector3<f64>>) {
    let mut h = Blocks::zeros(symbolic);
    let mut descent = vec![Vector3::zeros(); symbolic.columns()];
    for (f, e) in factors.iter().zip(errors) {
        let (i, j) = (symbolic.position[f.i as usize], symbolic.position[f.j as usize]);
        let part = f.linearise(poses, e);
        if i != ANCHORED {
            h.diagonal[i as usize] += part.h_ii;
            descent[i as usize] -= part.g_i;
        }
        if j != ANCHORED {
            h.diagonal[j as usize] += part.h_jj;
            descent[j as usize] -= part.g_j;
        }
        if i != ANCHORED && j != ANCHORED {
            // Stored below the diagonal: the later of the two is the row.
            let (block, row, column) = if i > j { (part.h_ij, i, j) } else { (part.h_ij.transpose(), j, i) };
            h.below[symbolic.slot(row, column)] += block;
        }
    }
    (h, descent)
}

fn dot(a: &[Vector3<f64>], b: &[Vector3<f64>]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a.dot(b)).sum()
}

fn is_small(step: &[Vector3<f64>], decrement: f64, factors: usize) -> bool {
    let largest = step.iter().map(Vector3::amax).fold(0.0, f64::max);
    largest <= STEP_MAX || decrement <= DECREMENT_PER_FACTOR * factors as f64
}

/// `x ← x·exp(δ)`.
fn moved(symbolic: &Symbolic, poses: &[Pose2], step: &[Vector3<f64>]) -> Vec<Pose2> {
    let one = |(pose, &at): (&Pose2, &u32)| {
        if at == ANCHORED { *pose } else { pose.compose(&Pose2::exp(&step[at as usize])) }
    };
    poses.iter().zip(&symbolic.position).map(one).collect()
}
