//! Gauss–Newton over all poses, each step shortened until the cost falls by its fair share.

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
/// A step must win this share of the decrement (a full step of a quadratic cost wins it all).
const GAIN_MIN: f64 = 0.25;
/// A cost may rise by this share: rounding of the sum.
const RISE: f64 = 1e-12;
/// Shorter steps tried before giving up.
const SHORTER_MAX: u32 = 12;

/// The optimum and the factorised information matrix there.
pub(super) struct Solution {
    pub poses: Vec<Pose2>,
    pub chi2: f64,
    pub cholesky: Cholesky,
}

/// Minimises the objective from the given poses; pose 0 stays.
pub(super) fn solve(poses: Vec<Pose2>, factors: &[&Factor]) -> Result<Solution, SmoothError> {
    let symbolic = Symbolic::new(poses.len(), factors)?;
    let mut at = Point::new(poses, factors);
    let mut decrement = f64::INFINITY;
    for _ in 0..ITERATIONS_MAX {
        let (hessian, descent) = linearise(&symbolic, &at, factors);
        let cholesky = Cholesky::factorise(&symbolic, hessian)?;
        let mut step = descent.clone();
        cholesky.solve(&mut step);
        let last = std::mem::replace(&mut decrement, dot(&step, &descent));
        let slow = decrement <= DECREMENT_SLOW.0 && decrement >= DECREMENT_SLOW.1 * last;
        if slow || is_small(&step, decrement, factors.len()) {
            return Ok(Solution { poses: at.poses, chi2: at.cost, cholesky });
        }
        at = line_search(&symbolic, &at, &step, decrement, factors).ok_or(SmoothError::NotConverged)?;
    }
    Err(SmoothError::NotConverged)
}

/// Poses with their cost.
struct Point {
    poses: Vec<Pose2>,
    errors: Vec<Vector3<f64>>,
    /// `Σ eᵀ Ω e`.
    cost: f64,
}

impl Point {
    fn new(poses: Vec<Pose2>, factors: &[&Factor]) -> Self {
        let errors: Vec<_> = factors.iter().map(|f| f.error(&poses)).collect();
        let cost = factors.iter().zip(&errors).map(|(f, e)| e.dot(&(f.information * e))).sum();
        Self { poses, errors, cost }
    }
}

/// The point a share t of the step away, t = 1 unless that wins too little: large residuals make
/// Gauss–Newton overshoot, again and again or for good. Along the step the cost starts with the
/// slope −2·decrement; each t is the minimum of the parabola through the last one tried.
fn line_search(
    symbolic: &Symbolic,
    from: &Point,
    step: &[Vector3<f64>],
    decrement: f64,
    factors: &[&Factor],
) -> Option<Point> {
    let mut t = 1.0;
    for _ in 0..SHORTER_MAX {
        let tried = Point::new(moved(symbolic, &from.poses, step, t), factors);
        let rise = tried.cost - from.cost;
        if rise <= RISE * from.cost - GAIN_MIN * t * decrement {
            return Some(tried);
        }
        let best = decrement * t * t / (rise + 2.0 * t * decrement);
        // Also where the cost was not finite.
        t *= if best.is_finite() { (best / t).clamp(0.1, 0.6) } else { 0.1 };
    }
    None
}

/// Information matrix (10) and half the negative gradient, at `poses`.
fn linearise(symbolic: &Symbolic, at: &Point, factors: &[&Factor]) -> (Blocks, Vec<Vector3<f64>>) {
    let mut h = Blocks::zeros(symbolic);
    let mut descent = vec![Vector3::zeros(); symbolic.columns()];
    for (f, e) in factors.iter().zip(&at.errors) {
        let (i, j) = (symbolic.position[f.i as usize], symbolic.position[f.j as usize]);
        let part = f.linearise(&at.poses, e);
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

/// `x ← x·exp(t·δ)`.
fn moved(symbolic: &Symbolic, poses: &[Pose2], step: &[Vector3<f64>], t: f64) -> Vec<Pose2> {
    let one = |(pose, &at): (&Pose2, &u32)| {
        if at == ANCHORED { *pose } else { pose.compose(&Pose2::exp(&(step[at as usize] * t))) }
    };
    poses.iter().zip(&symbolic.position).map(one).collect()
}
