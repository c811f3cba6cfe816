//! The reference: all poses at once, dense matrices, numerical Jacobians.

use super::*;
use nalgebra::{DMatrix, DVector};

fn error(f: &Factor, a: &Pose2, b: &Pose2) -> Vector3<f64> {
    f.i_from_j.inverse().compose(&a.inverse().compose(b)).log()
}

/// Jacobian of `error` in the perturbation of one end, five-point stencil.
pub fn numeric_jacobian(error_at: impl Fn(&Vector3<f64>) -> Vector3<f64>) -> Matrix3<f64> {
    let h = 1e-3;
    let column = |k: usize| {
        let at = |s: f64| error_at(&(Vector3::ith(k, s * h)));
        (at(-2.0) - at(2.0) + (at(1.0) - at(-1.0)) * 8.0) / (12.0 * h)
    };
    Matrix3::from_columns(&[column(0), column(1), column(2)])
}

/// Information matrix and half the negative gradient over all poses but the first.
pub fn dense_system(poses: &[Pose2], factors: &[&Factor]) -> (DMatrix<f64>, DVector<f64>) {
    let n = 3 * poses.len();
    let (mut h, mut g) = (DMatrix::zeros(n, n), DVector::zeros(n));
    for f in factors {
        let (i, j) = (f.i as usize, f.j as usize);
        let (a, b) = (poses[i], poses[j]);
        let ji = numeric_jacobian(|d| error(f, &a.compose(&Pose2::exp(d)), &b));
        let jj = numeric_jacobian(|d| error(f, &a, &b.compose(&Pose2::exp(d))));
        for (p, jp) in [(i, ji), (j, jj)] {
            let w = jp.transpose() * f.information;
            let mut part = g.fixed_rows_mut::<3>(3 * p);
            part -= w * error(f, &a, &b);
            for (q, jq) in [(i, ji), (j, jj)] {
                let mut block = h.fixed_view_mut::<3, 3>(3 * p, 3 * q);
                block += w * jq;
            }
        }
    }
    (h.view((3, 3), (n - 3, n - 3)).into_owned(), g.rows(3, n - 3).into_owned())
}

/// Optimum and covariance (of all poses, the first one's zero) by dense Gauss–Newton.
pub fn dense(script: &Script) -> (Vec<Pose2>, DMatrix<f64>) {
    let factors = script.factors();
    let mut poses = script.truth.clone();
    for _ in 0..30 {
        let (h, g) = dense_system(&poses, &factors);
        let step = h.cholesky().unwrap().solve(&g);
        for (k, pose) in poses[1..].iter_mut().enumerate() {
            *pose = pose.compose(&Pose2::exp(&step.fixed_rows::<3>(3 * k).into_owned()));
        }
        if step.amax() < 1e-12 {
            break;
        }
    }
    let n = 3 * poses.len();
    let mut covariance = DMatrix::zeros(n, n);
    let inverse = dense_system(&poses, &factors).0.cholesky().unwrap().inverse();
    covariance.view_mut((3, 3), (n - 3, n - 3)).copy_from(&inverse);
    (poses, covariance)
}

pub fn block(m: &DMatrix<f64>, i: u32, j: u32) -> Matrix3<f64> {
    m.fixed_view::<3, 3>(3 * i as usize, 3 * j as usize).into_owned()
}
