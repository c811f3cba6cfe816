//! Gauss–Newton over all poses, with Marquardt's damping when a step would raise the cost.

use super::cholesky::{Blocks, Cholesky};
use super::symbolic::{ANCHORED, Symbolic};
use super::{Factor, SmoothError};
use crate::geometry::Pose2;
use nalgebra::Vector3;

/// A graph that needs more steps than this is inconsistent beyond repair.
const ITERATIONS_MAX: u32 = 50;
/// Converged when no pose moves by more, metres and radians.
const STEP_MAX: f64 = 1e-9;
/// Converged, too, when the step is this small a share of a standard deviation squared, per
/// factor: what rounding alone does to a weakly held part of the graph.
const DECREMENT_PER_FACTOR: f64 = 1e-16;
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
    let mut cost = chi2(&poses, factors);
    let mut damping = 0.0;
    let (mut hessian, mut descent) = linearise(&symbolic, &poses, factors);
    for _ in 0..ITERATIONS_MAX {
        let cholesky = Cholesky::factorise(&symbolic, &hessian, damping)?;
        let mut step = descent.clone();
        cholesky.solve(&mut step);
        // Only an undamped step measures the distance to the optimum, and only the undamped
        // factor is that of the covariances.
        if damping == 0.0 && is_small(&step, &descent, factors.len()) {
            return Ok(Solution { poses, chi2: cost, cholesky });
        }
        let tried = moved(&symbolic, &poses, &step);
        let tried_cost = chi2(&tried, factors);
        if tried_cost <= cost * (1.0 + RISE) + f64::MIN_POSITIVE {
            (poses, cost) = (tried, tried_cost);
            (hessian, descent) = linearise(&symbolic, &poses, factors);
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

fn chi2(poses: &[Pose2], factors: &[&Factor]) -> f64 {
    factors.iter().map(|f| f.chi2(poses)).sum()
}

/// Information matrix (10) and half the negative gradient, at `poses`.
fn linearise(symbolic: &Symbolic, poses: &[Pose2], factors: &[&Factor]) -> (Blocks, Vec<Vector3<f64>>) {
    let mut h = Blocks::zeros(symbolic);
    let mut descent = vec![Vector3::zeros(); symbolic.columns()];
    for f in factors {
        let (i, j) = (symbolic.position[f.i as usize], symbolic.position[f.j as usize]);
        let part = f.linearise(poses);
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

fn is_small(step: &[Vector3<f64>], descent: &[Vector3<f64>], factors: usize) -> bool {
    let largest = step.iter().map(Vector3::amax).fold(0.0, f64::max);
    // δᵀ H δ, the step's length in standard deviations, squared.
    let decrement: f64 = step.iter().zip(descent).map(|(s, d)| s.dot(d)).sum();
    largest <= STEP_MAX || decrement <= DECREMENT_PER_FACTOR * factors as f64
}

/// `x ← x·exp(δ)`.
fn moved(symbolic: &Symbolic, poses: &[Pose2], step: &[Vector3<f64>]) -> Vec<Pose2> {
    let one = |(pose, &at): (&Pose2, &u32)| {
        if at == ANCHORED { *pose } else { pose.compose(&Pose2::exp(&step[at as usize])) }
    };
    poses.iter().zip(&symbolic.position).map(one).collect()
}
