//! Motions of the plane and their small errors: twists (x, y, yaw), metres and radians.

use super::super::geom::wrap;
use toponym_proto::Pose;

/// Three numbers.
pub(super) type Vec3 = [f64; 3];
/// Three rows.
pub(super) type Mat3 = [Vec3; 3];

/// Nothing.
pub(super) const ZERO: Mat3 = [[0.0; 3]; 3];

/// The matrix with that diagonal.
pub(super) fn diagonal(d: Vec3) -> Mat3 {
    [[d[0], 0.0, 0.0], [0.0, d[1], 0.0], [0.0, 0.0, d[2]]]
}

/// `a + b`.
pub(super) fn add(a: &Mat3, b: &Mat3) -> Mat3 {
    [0, 1, 2].map(|i| [0, 1, 2].map(|j| a[i][j] + b[i][j]))
}

/// `a b`.
pub(super) fn mul(a: &Mat3, b: &Mat3) -> Mat3 {
    [0, 1, 2].map(|i| [0, 1, 2].map(|j| (0..3).map(|k| a[i][k] * b[k][j]).sum()))
}

/// `aᵀ`.
pub(super) fn transpose(a: &Mat3) -> Mat3 {
    [0, 1, 2].map(|i| [0, 1, 2].map(|j| a[j][i]))
}

/// `a v`.
pub(super) fn apply(a: &Mat3, v: Vec3) -> Vec3 {
    [0, 1, 2].map(|i| dot(a[i], v))
}

/// `u · v`.
pub(super) fn dot(u: Vec3, v: Vec3) -> f64 {
    u.iter().zip(v).map(|(a, b)| a * b).sum()
}

/// `a m aᵀ`: the covariance m seen through a.
pub(super) fn through(a: &Mat3, m: &Mat3) -> Mat3 {
    mul(&mul(a, m), &transpose(a))
}

/// The lower triangle l of a positive definite matrix, `l lᵀ`.
pub(super) fn cholesky(m: &Mat3) -> Mat3 {
    let mut l = ZERO;
    for i in 0..3 {
        for j in 0..=i {
            let rest = m[i][j] - (0..j).map(|k| l[i][k] * l[j][k]).sum::<f64>();
            l[i][j] = if i == j { rest.sqrt() } else { rest / l[j][j] };
        }
    }
    l
}

/// `l⁻¹ v`.
fn forward(l: &Mat3, v: Vec3) -> Vec3 {
    let mut x = v;
    for i in 0..3 {
        x[i] = (v[i] - (0..i).map(|k| l[i][k] * x[k]).sum::<f64>()) / l[i][i];
    }
    x
}

/// The inverse of a positive definite matrix.
pub(super) fn inverse(m: &Mat3) -> Mat3 {
    let l = cholesky(m);
    // Columns of l⁻¹, as rows: m⁻¹ = l⁻ᵀ l⁻¹.
    let columns = diagonal([1.0; 3]).map(|e| forward(&l, e));
    mul(&columns, &transpose(&columns))
}

/// `log N(e; 0, m)`.
pub(super) fn log_normal(e: Vec3, m: &Mat3) -> f64 {
    let l = cholesky(m);
    let u = forward(&l, e);
    let log_root_det: f64 = (0..3).map(|i| l[i][i].ln()).sum();
    -0.5 * dot(u, u) - log_root_det - 1.5 * std::f64::consts::TAU.ln()
}

/// The twist whose exponential is the motion.
pub(super) fn log(motion: &Pose) -> Vec3 {
    let yaw = wrap(motion.yaw_rad);
    let half = yaw / 2.0;
    let straight = if half.abs() < 1e-6 { 1.0 } else { half / half.tan() };
    [straight * motion.x_m + half * motion.y_m, straight * motion.y_m - half * motion.x_m, yaw]
}

/// Adjoint of `motion⁻¹`: a twist before the motion, seen after it.
pub(super) fn carried_over(motion: &Pose) -> Mat3 {
    let (s, c) = motion.yaw_rad.sin_cos();
    let (x, y) = (motion.x_m, motion.y_m);
    [[c, s, s * x - c * y], [-s, c, c * x + s * y], [0.0, 0.0, 1.0]]
}

#[cfg(test)]
mod tests {
    use super::super::super::geom::{between, compose};
    use super::*;

    /// exp(twist) by many small steps.
    fn exp(twist: Vec3) -> Pose {
        let n = 100_000;
        let step = twist.map(|v| v / f64::from(n));
        let step = Pose { x_m: step[0], y_m: step[1], yaw_rad: step[2] };
        (0..n).fold(Pose::default(), |at, _| compose(&at, &step))
    }

    #[test]
    fn log_undoes_exp_and_wraps() {
        for twist in [[1.0, 0.5, 1.2], [0.3, -2.0, -2.9], [1.0, 2.0, 0.0]] {
            let got = log(&exp(twist));
            assert!((0..3).all(|i| (got[i] - twist[i]).abs() < 1e-4), "{got:?}, not {twist:?}");
        }
        let around = Pose { yaw_rad: std::f64::consts::TAU + 0.1, ..Pose::default() };
        assert!((log(&around)[2] - 0.1).abs() < 1e-12);
    }

    #[test]
    fn a_twist_is_carried_over_a_motion() {
        let motion = Pose { x_m: 2.0, y_m: -1.0, yaw_rad: 0.8 };
        let twist = [1e-3, -2e-3, 1.5e-3];
        // exp(twist) ∘ motion = motion ∘ exp(carried)
        let got = log(&between(&motion, &compose(&exp(twist), &motion)));
        let want = apply(&carried_over(&motion), twist);
        assert!((0..3).all(|i| (got[i] - want[i]).abs() < 1e-8), "{got:?}, not {want:?}");
    }

    #[test]
    fn a_normal_density_is_that_of_its_matrix() {
        let m = [[4.0, 1.0, 0.5], [1.0, 3.0, -0.2], [0.5, -0.2, 2.0]];
        let unit = mul(&m, &inverse(&m));
        for (row, want) in unit.iter().zip(diagonal([1.0; 3])) {
            assert!((0..3).all(|j| (row[j] - want[j]).abs() < 1e-12), "{unit:?}");
        }
        let alone = log_normal([1.0, 0.0, 0.0], &diagonal([4.0, 1.0, 1.0]));
        let want = -0.125 - 2f64.ln() - 1.5 * std::f64::consts::TAU.ln();
        assert!((alone - want).abs() < 1e-12, "{alone}, not {want}");
        let e = [1.0, -2.0, 0.5];
        let exponent = log_normal(e, &m) - log_normal([0.0; 3], &m);
        assert!((exponent + 0.5 * dot(e, apply(&inverse(&m), e))).abs() < 1e-12);
    }
}
