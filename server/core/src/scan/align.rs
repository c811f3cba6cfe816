//! Point-to-line registration from a guess (Chen and Medioni 1991; Censi 2008), with a Gaussian
//! prior and an information matrix.
//!
//! Minimises Σ_k ρ(n_kᵀ(X p_k − q_k)) + ‖log(X₀⁻¹X)‖²_P over X = target_from_source, where q_k with
//! normal n_k is the target's point nearest to X p_k, by iteratively reweighted Gauss–Newton.
//!
//! Along a bare corridor only the normals' noise has a component, and that is no information: taken
//! for some it holds the pose back. So in the direction u of translation in which the pairs say the
//! least, a normal's component is shrunk by what noise may have made it (Breiman's non-negative
//! garrote): `n·u ← n·u (1 − τ²/(n·u)²)₊`. What faces along the corridor, a door's jamb or the end wall,
//! still counts; the rest leaves the direction to the prior, as solution remapping does (Zhang, Kaess
//! and Singh 2016), and the information shows it. What is left may be no part of the building, but the
//! legs of a guide who walks ahead: along u what was not seen to stand says as good as nothing, and a
//! prior may be given more weight than elsewhere.

use crate::geometry::Pose2;
use crate::scan::cloud::{Nearest, Point, Surfaces};
use crate::scan::weak::Weak;
use nalgebra::{Matrix3, Vector3};

/// Standard deviation of a range along the normal, walls' roughness included.
pub const SIGMA_M: f64 = 0.03;
/// Neighbouring beams err together: so many of them count as one.
pub const CORRELATED_BEAMS: f64 = 8.0;
/// Residuals beyond are mostly other things.
const KERNEL_M: f64 = 0.06;
/// A pair within this distance along the normal is an inlier.
const INLIER_M: f64 = 0.10;
const ITERATIONS_MAX: usize = 25;
/// Points that are enough to come near.
const COARSE_POINTS: usize = 60;
/// Fewer pairs are no fit.
const PAIRS_MIN: usize = 10;
/// Steps below end it.
const STILL_M: f64 = 3e-4;
const STILL_RAD: f64 = 5e-5;

/// How far a source is slid to see what noise says: farther than the gate, and than jambs are deep.
const SLID_M: [f64; 8] = [-0.8, -0.6, -0.4, -0.2, 0.2, 0.4, 0.6, 0.8];
/// Noise says so many standard deviations more than its mean at most.
const NOISE_SIGMAS: f64 = 3.0;

/// A Gaussian on the transform sought.
#[derive(Clone, Copy, Debug)]
pub struct Prior {
    /// Its mean.
    pub target_from_source: Pose2,
    /// Its information, right perturbation.
    pub information: Matrix3<f64>,
    /// Times that it counts, at most, in a direction of which the pairs say little.
    pub where_weak: f64,
}

impl Prior {
    /// Its information where the pairs are weak in a direction.
    fn information(&self, weak: Option<Weak>) -> Matrix3<f64> {
        let Some(weak) = weak else { return self.information };
        let u = Vector3::new(weak.x, weak.y, 0.0);
        let more = (self.where_weak - 1.0) * weak.share;
        self.information + u * (u.transpose() * self.information * u * more) * u.transpose()
    }
}

/// Where a cloud fits.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Alignment {
    /// The transform found.
    pub target_from_source: Pose2,
    /// Information that the points alone give on it (no prior), right perturbation.
    pub information: Matrix3<f64>,
    /// Share of the source's points that lie on the target's surfaces.
    pub inlier_share: f64,
    /// Root mean square distance of those from the surfaces, metres.
    pub residual_m: f64,
}

/// Registers `source` to `target`. Pairs farther apart than the gate do not count; the gate
/// shrinks from `gate_m` to a quarter of it, and only then do all points count. None if too few
/// points pair up.
pub fn align(
    source: &[Point],
    target: &impl Surfaces,
    guess: &Pose2,
    prior: Option<&Prior>,
    gate_m: f32,
) -> Option<Alignment> {
    let mut x = *guess;
    let mut gate = gate_m;
    let fine_m = gate_m * 0.25;
    let mut weak = None;
    for iteration in 0..ITERATIONS_MAX {
        let stride = if gate > fine_m { (source.len() / COARSE_POINTS).max(1) } else { 1 };
        let fit = linearise(source, stride, target, &x, gate, weak);
        weak = Weak::of(&fit.information);
        if fit.pairs < PAIRS_MIN / stride.min(2) {
            return None;
        }
        let (mut h, mut g) = (fit.information * stride as f64, fit.gradient * stride as f64);
        if let Some(p) = prior {
            let e = p.target_from_source.between(&x).log();
            let information = p.information(weak);
            h += information;
            g += information * e;
        }
        // Enough damping to stay put along a bare corridor.
        let damping = Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, 1.0)) * 1e-3;
        let step = -(h + damping).cholesky()?.solve(&g);
        x = x.compose(&Pose2::exp(&step));
        let still = |f: f64| step.xy().norm() < STILL_M * f && step.z.abs() < STILL_RAD * f;
        if gate <= fine_m && still(1.0) {
            break;
        }
        if still(10.0) || iteration % 3 == 2 {
            gate = (gate * 0.6).max(fine_m);
        }
    }
    let fit = linearise(source, 1, target, &x, gate, weak);
    (fit.pairs >= PAIRS_MIN && x.is_finite()).then(|| Alignment {
        target_from_source: x,
        information: fit.information,
        inlier_share: fit.inliers as f64 / source.len().max(1) as f64,
        residual_m: (fit.squares / fit.inliers.max(1) as f64).sqrt(),
    })
}

/// The information of an alignment less what is noise: where the pairs are weak in a direction, they say as
/// much with the source slid along it. Along a bare corridor nothing is left; a door's jambs, which meet
/// nothing when slid, keep theirs.
pub fn sound_information(
    source: &[Point],
    target: &impl Surfaces,
    found: &Alignment,
    gate_m: f32,
) -> Matrix3<f64> {
    let information = found.information;
    let Some(weak) = Weak::of(&information) else { return information };
    let u = Vector3::new(weak.x, weak.y, 0.0);
    let along = |slid_m: f64| {
        let x = found.target_from_source.compose(&Pose2::new(slid_m * weak.x, slid_m * weak.y, 0.0));
        (u.transpose() * linearise(source, 1, target, &x, gate_m, Some(weak)).information * u).x
    };
    let (here, slid) = (along(0.0), SLID_M.map(along));
    let mean = slid.iter().sum::<f64>() / slid.len() as f64;
    let variance = slid.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / slid.len() as f64;
    let sound = (1.0 - (mean + NOISE_SIGMAS * variance.sqrt()) / here.max(1e-9)).max(0.0);
    let keep = Matrix3::identity() - u * u.transpose() * (1.0 - sound.sqrt());
    keep * information * keep
}

struct Fit {
    information: Matrix3<f64>,
    gradient: Vector3<f64>,
    pairs: usize,
    inliers: usize,
    /// Sum over the inliers of their distance².
    squares: f64,
}

/// The normal equations of every `stride`-th point.
fn linearise(
    source: &[Point],
    stride: usize,
    target: &impl Surfaces,
    x: &Pose2,
    gate_m: f32,
    weak: Option<Weak>,
) -> Fit {
    let (s, c) = x.yaw_rad.sin_cos();
    let mut sums = [0.0f64; 9];
    let (mut pairs, mut inliers, mut squares) = (0, 0, 0.0);
    for p in source.iter().step_by(stride) {
        let moved = p.turned(x, s, c);
        let Some(Nearest { point: q, stands }) = target.nearest(&moved, gate_m) else { continue };
        let (nx, ny) = (f64::from(q.nx), f64::from(q.ny));
        let (dx, dy) = (f64::from(moved.x - q.x), f64::from(moved.y - q.y));
        // In the source's frame.
        let seen = (c * nx + s * ny, -s * nx + c * ny);
        let (a, b) = weak.map_or(seen, |w| if stands { w.denoised(seen) } else { w.damped(seen) });
        let r = a * (c * dx + s * dy) + b * (c * dy - s * dx);
        pairs += 1;
        if r.abs() < INLIER_M {
            inliers += 1;
            squares += r * r;
        }
        // Geman–McClure weight.
        let w = (1.0 / (1.0 + (r / KERNEL_M).powi(2))).powi(2);
        // d(nᵀ X exp(δ) p)/dδ: the normal in the source's frame, and its moment about p.
        let m = b * f64::from(p.x) - a * f64::from(p.y);
        for (sum, v) in sums.iter_mut().zip([a * a, a * b, a * m, b * b, b * m, m * m, a * r, b * r, m * r]) {
            *sum += w * v;
        }
    }
    let scale = 1.0 / (SIGMA_M * SIGMA_M * CORRELATED_BEAMS);
    let [aa, ab, am, bb, bm, mm, ar, br, mr] = sums.map(|v| v * scale);
    Fit {
        information: Matrix3::new(aa, ab, am, ab, bb, bm, am, bm, mm),
        gradient: Vector3::new(ar, br, mr),
        pairs,
        inliers,
        squares,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scan::cloud::Index;

    fn wall(x0: f32, y0: f32, x1: f32, y1: f32) -> impl Iterator<Item = Point> {
        let length = (x1 - x0).hypot(y1 - y0);
        let (nx, ny) = (-(y1 - y0) / length, (x1 - x0) / length);
        let n = (length / 0.05) as usize;
        (0..n).map(move |k| {
            let f = k as f32 / n as f32;
            Point { x: x0 + f * (x1 - x0), y: y0 + f * (y1 - y0), nx, ny }
        })
    }

    fn room() -> Vec<Point> {
        wall(-3.0, -2.0, 3.0, -2.0)
            .chain(wall(3.0, -2.0, 3.0, 2.0))
            .chain(wall(3.0, 2.0, -3.0, 2.0))
            .collect()
    }

    #[test]
    fn finds_the_transform_of_a_room() {
        let truth = Pose2::new(0.2, -0.15, 0.1);
        let source: Vec<Point> = room().iter().map(|p| p.moved(&truth.inverse())).collect();
        let found = align(&source, &Index::new(&room(), 0.6), &Pose2::default(), None, 0.6).unwrap();
        let off = truth.between(&found.target_from_source);
        assert!(off.x_m.hypot(off.y_m) < 1e-3 && off.yaw_rad.abs() < 1e-3, "{off:?}");
        assert!(found.inlier_share > 0.95);
    }

    #[test]
    fn a_corridor_says_nothing_along_itself_and_the_prior_decides_there() {
        let corridor: Vec<Point> = wall(-8.0, -1.0, 8.0, -1.0).chain(wall(8.0, 1.0, -8.0, 1.0)).collect();
        let source: Vec<Point> = corridor.iter().filter(|p| p.x.abs() < 4.0).copied().collect();
        let prior = Prior {
            target_from_source: Pose2::new(0.7, 0.05, 0.02),
            information: Matrix3::from_diagonal(&Vector3::new(25.0, 25.0, 100.0)),
            where_weak: 1.0,
        };
        let index = Index::new(&corridor, 0.6);
        let found = align(&source, &index, &prior.target_from_source, Some(&prior), 0.6).unwrap();
        assert!((found.target_from_source.x_m - 0.7).abs() < 0.02, "{found:?}");
        assert!(found.target_from_source.y_m.abs() < 0.005);
        assert!(found.information[(0, 0)] < 1e-3 * found.information[(1, 1)]);
    }

    /// The corridor with normals that tilt, and the prior that puts it forty centimetres farther on.
    fn rough_corridor() -> (Vec<Point>, Prior) {
        let tilted = |(k, p): (usize, Point)| {
            let tilt = 0.12 * (k as f32 * 2.399).sin();
            // Noise that turns a normal shifts its point too.
            Point { y: p.y + 0.1 * tilt, nx: p.ny * tilt.sin(), ny: p.ny * tilt.cos(), ..p }
        };
        let walls = wall(-8.0, -1.0, 8.0, -1.0).chain(wall(8.0, 1.0, -8.0, 1.0));
        let prior = Prior {
            target_from_source: Pose2::new(0.4, 0.0, 0.0),
            information: Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, 1.0)),
            where_weak: 1.0,
        };
        (walls.enumerate().map(tilted).collect(), prior)
    }

    fn near(points: &[Point]) -> Vec<Point> {
        points.iter().filter(|p| p.x.abs() < 4.0 || p.nx.abs() > 0.9).copied().collect()
    }

    #[test]
    fn the_noise_of_normals_says_nothing_along_a_corridor() {
        let (corridor, prior) = rough_corridor();
        let guess = prior.target_from_source;
        let found = align(&near(&corridor), &Index::new(&corridor, 0.6), &guess, Some(&prior), 0.6).unwrap();
        assert!((found.target_from_source.x_m - 0.4).abs() < 0.01, "{found:?}");
        assert!(found.information[(0, 0)] < 1e-4 * found.information[(1, 1)], "{found:?}");
    }

    #[test]
    fn a_few_points_across_a_corridor_still_say_where_along_it() {
        let (mut corridor, prior) = rough_corridor();
        // A door's jamb.
        corridor.extend(wall(6.0, 0.8, 6.0, 1.0));
        let guess = prior.target_from_source;
        let found = align(&near(&corridor), &Index::new(&corridor, 0.6), &guess, Some(&prior), 0.6).unwrap();
        assert!(found.target_from_source.x_m.abs() < 0.02, "{found:?}");
        // Unless the prior is to be trusted more than so few.
        let firm = Prior { where_weak: 1e6, ..prior };
        let found = align(&near(&corridor), &Index::new(&corridor, 0.6), &guess, Some(&firm), 0.6).unwrap();
        assert!((found.target_from_source.x_m - 0.4).abs() < 0.02, "{found:?}");
    }

    /// Surfaces of which none was seen for long.
    struct Fresh(Index);

    impl Surfaces for Fresh {
        fn nearest(&self, p: &Point, gate_m: f32) -> Option<Nearest<'_>> {
            self.0.nearest(p, gate_m).map(|q| Nearest { stands: false, ..q })
        }
    }

    #[test]
    fn what_was_not_seen_to_stand_says_nothing_along_a_corridor() {
        let (mut corridor, prior) = rough_corridor();
        // Legs, perhaps.
        corridor.extend(wall(3.0, 0.0, 3.0, 0.4));
        let guess = prior.target_from_source;
        let fresh = Fresh(Index::new(&corridor, 0.6));
        let found = align(&near(&corridor), &fresh, &guess, Some(&prior), 0.6).unwrap();
        assert!((found.target_from_source.x_m - 0.4).abs() < 0.02, "{found:?}");
        assert!(found.target_from_source.y_m.abs() < 0.01, "{found:?}");
        let stands = align(&near(&corridor), &fresh.0, &guess, Some(&prior), 0.6).unwrap();
        assert!(stands.target_from_source.x_m.abs() < 0.02, "{stands:?}");
    }

    #[test]
    fn a_room_seen_for_the_first_time_counts_in_full() {
        let truth = Pose2::new(0.2, -0.15, 0.1);
        let source: Vec<Point> = room().iter().map(|p| p.moved(&truth.inverse())).collect();
        let fresh = Fresh(Index::new(&room(), 0.6));
        let found = align(&source, &fresh, &Pose2::default(), None, 0.6).unwrap();
        let off = truth.between(&found.target_from_source);
        assert!(off.x_m.hypot(off.y_m) < 1e-3 && off.yaw_rad.abs() < 1e-3, "{off:?}");
    }

    /// How much of the information along x is sound of a cloud laid on itself, from a guess so far off.
    fn sound_share(cloud: &[Point], guess_m: f64) -> f64 {
        let (source, index) = (near(cloud), Index::new(cloud, 0.6));
        let found = align(&source, &index, &Pose2::new(guess_m, 0.0, 0.0), None, 0.25).unwrap();
        let sound = sound_information(&source, &index, &found, 0.0625);
        assert!((sound[(1, 1)] / found.information[(1, 1)] - 1.0).abs() < 0.05, "across it all is");
        assert!(sound.symmetric_eigenvalues().min() > -1e-6);
        sound[(0, 0)] / found.information[(0, 0)]
    }

    #[test]
    fn what_is_said_wherever_one_slides_along_a_corridor_is_noise() {
        // Some normals are turned by far more than is taken for noise.
        let turned = |(k, p): (usize, Point)| {
            let (s, c) = if k % 7 == 0 { (0.9 * (k as f32 * 1.3).sin()).sin_cos() } else { (0.0, 1.0) };
            Point { nx: c * p.nx - s * p.ny, ny: s * p.nx + c * p.ny, ..p }
        };
        let walls = wall(-8.0, -1.0, 8.0, -1.0).chain(wall(8.0, 1.0, -8.0, 1.0));
        let mut corridor: Vec<Point> = walls.enumerate().map(turned).collect();
        assert!(sound_share(&corridor, 0.4) < 0.1, "{}", sound_share(&corridor, 0.4));
        for x in [2.0, 3.0] {
            corridor.extend(wall(x, 1.0, x, 1.5).chain(wall(x + 0.9, 1.5, x + 0.9, 1.0)));
        }
        assert!(sound_share(&corridor, 0.05) > 0.5, "{}", sound_share(&corridor, 0.05));
    }

    #[test]
    fn too_little_is_no_fit() {
        assert!(align(&room()[..5], &Index::new(&room(), 0.6), &Pose2::default(), None, 0.6).is_none());
        assert!(align(&room(), &Index::new(&[], 0.6), &Pose2::default(), None, 0.6).is_none());
    }
}
