//! A scan laid on the local map where wheels don't say how the robot moved.
//!
//! Registration from a guess stays near it along a corridor: normals' noise holds it there, and with a guess by
//! nothing but inertia the robot drives on for ever, or never starts. So what scan and map say is summed up over
//! all that the robot may have done since: poses fitted from several headings, each slid along the direction that
//! its points say the least of,
//!
//! ```text
//! p(X | z) ∝ p(X) exp(w Σ_k exp(−r_k² / 2 σ²)),   r_k: from point k to its surface
//! ```
//!
//! and the variance of the slide, by the looks alone, is what is claimed along that direction.

use crate::geometry::Pose2;
use crate::scan::align::{Alignment, CORRELATED_BEAMS, Prior, align};
use crate::scan::cloud::{Nearest, Point, Surfaces};
use crate::scan::weak::Weak;
use crate::track::front::FrontEnd;
use crate::track::front::registration::{GATE_M, LEAP_RAD, LESS, Stood};
use crate::track::front::trust::Trust;
use crate::track::local::LocalMap;
use nalgebra::{Matrix3, Vector3};
use std::f64::consts::{PI, TAU};

/// It is slid so far, beyond what is uncertain anyway, but no farther than that, …
const FAST_M: f64 = 0.6;
const FAR_M: f64 = 2.4;
/// … in strides, each in so many steps to either side of it.
const STRIDE_M: f64 = 0.2;
const FINE: i32 = 2;
const FINE_M: f64 = 0.04;
/// It is held there while the rest is fitted.
const HELD_M: f64 = 0.005;
/// A point lies on its surface to so much, and farther than the gate it lies on none.
const ON_M: f64 = 0.05;
const ON_GATE_M: f32 = 0.15;
/// After so long it may be anywhere near: places are tried in rings so far apart.
const LONG_S: f64 = 2.5;
const RING_M: f64 = 0.5;
/// Step of the headings tried where nothing fits as expected, …
const TURN_RAD: f64 = 0.08;
/// … what is near a surface then, …
const NEAR_M: f64 = 0.1;
const NEAR_GATE_M: f32 = 0.3;
/// … and how many are followed up.
const FOLLOWED: usize = 6;
/// Guesses nearer than this, metres and radians, are one.
const ALIKE: f64 = 0.02;
/// A look counts so much beside what is expected of robots. On twenty simulated drives without odometry (`drives faults
/// --only constant --from 301`) 3 to 24 do alike, and 6 leaves fewest wrong ones untold.
const EVIDENCE: f64 = 6.0;

impl FrontEnd {
    /// Where the points fit best of all that the robot may have moved to since it `stood`; each counts for `looks`
    /// independent ones. Its information is what [`FrontEnd::correct`] makes of as many looks.
    pub(super) fn search(&mut self, points: &[Point], stood: &Stood, looks: f64) -> Option<Alignment> {
        let content = self.usual_share - LESS;
        let (trust, short) = (self.trust.clone(), self.is_short());
        let local = self.local();
        local.all_stands = short;
        let searched = Searched { points, local, looks, stood, trust: &trust };
        let (here, dt_s) = (stood.front_from_body, stood.dt_s);
        let mut guesses = vec![here];
        let went = trust.goes_on(dt_s).map(|went| here.compose(&Pose2::exp(&went)));
        for guess in went.into_iter().chain([stood.by_wheels]) {
            if !guesses.iter().any(|g| g.distance_m(&guess) < ALIKE && turned(g, &guess) < ALIKE) {
                guesses.push(guess);
            }
        }
        let mut fits: Vec<Alignment> = guesses.iter().filter_map(|guess| searched.fit(guess)).collect();
        let long = dt_s > LONG_S;
        if long || !fits.iter().any(|f| f.inlier_share >= content) {
            let (any_m, any_rad) = Trust::anything(dt_s);
            let reach_m = if long { (2.0 * any_m).min(FAR_M) } else { 0.0 };
            guesses.extend(rings(&here, reach_m));
            let headings = searched.headings(&guesses, (LEAP_RAD + 3.0 * any_rad).min(PI));
            fits.extend(headings.iter().filter_map(|guess| searched.fit(guess)));
        }
        let likely = |fit: &Alignment| searched.likely(&fit.target_from_source);
        let best = fits.into_iter().max_by(|a, b| likely(a).total_cmp(&likely(b)))?;
        Some(searched.slide(best))
    }
}

/// What is searched for, and where.
struct Searched<'a> {
    points: &'a [Point],
    local: &'a LocalMap,
    looks: f64,
    stood: &'a Stood,
    trust: &'a Trust,
}

/// A pose tried along a slide: how far it was slid, log p(X), and the looks that lie on surfaces there.
struct Tried {
    slid_m: f64,
    expected: f64,
    on: f64,
    pose: Pose2,
}

impl Tried {
    fn likely(&self) -> f64 {
        self.expected + EVIDENCE * self.on
    }
}

impl Searched<'_> {
    fn expected(&self, pose: &Pose2) -> f64 {
        let moved = self.stood.front_from_body.between(pose);
        let by_wheels = self.stood.front_from_body.between(&self.stood.by_wheels);
        self.trust.log_expects(&moved, &by_wheels, self.stood.dt_s, &self.stood.known)
    }

    fn on(&self, pose: &Pose2) -> f64 {
        self.looks * laid_on_surfaces(self.points, self.local, pose)
    }

    fn likely(&self, pose: &Pose2) -> f64 {
        self.expected(pose) + EVIDENCE * self.on(pose)
    }

    fn fit(&self, guess: &Pose2) -> Option<Alignment> {
        let prior = Prior { target_from_source: *guess, information: wide(), where_weak: 1.0 };
        let found = align(self.points, self.local, guess, Some(&prior), GATE_M);
        found.filter(|a| self.stood.reaches(&a.target_from_source))
    }

    /// Guesses turned from where it may be that lay most points near surfaces.
    fn headings(&self, from: &[Pose2], reach_rad: f64) -> Vec<Pose2> {
        let few: Vec<Point> = self.points.iter().step_by(2).copied().collect();
        let n = (reach_rad / TURN_RAD) as i32;
        let heading = |base: &Pose2, k: i32| base.compose(&Pose2::new(0.0, 0.0, TURN_RAD * f64::from(k)));
        let guesses = from.iter().flat_map(|base| (-n..=n).map(move |k| heading(base, k)));
        let mut laid: Vec<(f64, Pose2)> =
            guesses.map(|g| (laid_on(&few, self.local, &g, NEAR_M, NEAR_GATE_M), g)).collect();
        laid.sort_by(|a, b| b.0.total_cmp(&a.0));
        let mut kept: Vec<Pose2> = Vec::new();
        for (_, guess) in laid {
            let near = |k: &Pose2| turned(k, &guess) < 2.5 * TURN_RAD && k.distance_m(&guess) < RING_M;
            if kept.len() < FOLLOWED && !kept.iter().any(near) {
                kept.push(guess);
            }
        }
        kept
    }

    /// The fit at its likeliest place along the direction of which its points say the least.
    fn slide(&self, fit: Alignment) -> Alignment {
        let Some(weak) = Weak::of(&fit.information) else { return fit };
        let u = Vector3::new(weak.x, weak.y, 0.0);
        let held = |at: &Pose2| {
            let information = wide() + u * u.transpose() / HELD_M.powi(2);
            let prior = Prior { target_from_source: *at, information, where_weak: 1.0 };
            align(self.points, self.local, at, Some(&prior), ON_GATE_M)
        };
        let tried = self.tried(&fit.target_from_source, &u, held);
        let Some(best) = tried.iter().max_by(|a, b| a.likely().total_cmp(&b.likely())) else { return fit };
        // What is known along there is what the looks say, however sharply they are ranked.
        let (mut sum, mut square) = (0.0, 0.0);
        for t in &tried {
            let p = (t.on - best.on).exp();
            (sum, square) = (sum + p, square + p * (t.slid_m - best.slid_m).powi(2));
        }
        let variance = square / sum + FINE_M * FINE_M / 12.0;
        let Some(mut found) = held(&best.pose) else { return fit };
        let across = Matrix3::identity() - u * u.transpose();
        let along = u * u.transpose() / (variance * self.looks * CORRELATED_BEAMS);
        found.information = across * found.information * across + along;
        found
    }

    /// Poses along u: the rest is fitted anew at each stride, and stays in the fine steps round it.
    fn tried(
        &self,
        from: &Pose2,
        u: &Vector3<f64>,
        held: impl Fn(&Pose2) -> Option<Alignment>,
    ) -> Vec<Tried> {
        let slid = |from: &Pose2, d_m: f64| from.compose(&Pose2::new(d_m * u.x, d_m * u.y, 0.0));
        let far_m = FAST_M + 2.5 * (self.stood.known * u).dot(u).sqrt();
        let n = (far_m.min(FAR_M) / STRIDE_M) as i32;
        let mut tried = Vec::new();
        for stride_m in (-n..=n).map(|k| STRIDE_M * f64::from(k)) {
            let Some(there) = held(&slid(from, stride_m)) else { continue };
            for step_m in (-FINE..=FINE).map(|k| FINE_M * f64::from(k)) {
                let pose = slid(&there.target_from_source, step_m);
                let (expected, on) = (self.expected(&pose), self.on(&pose));
                tried.push(Tried { slid_m: stride_m + step_m, expected, on, pose });
            }
        }
        tried
    }
}

/// Places around one, up to a distance.
fn rings(here: &Pose2, reach_m: f64) -> impl Iterator<Item = Pose2> {
    (1..=(reach_m / RING_M) as i32).flat_map(move |ring| {
        let n = 6 * ring;
        (0..n).map(move |k| {
            let (s, c) = (TAU * f64::from(k) / f64::from(n)).sin_cos();
            let d_m = RING_M * f64::from(ring);
            here.compose(&Pose2::new(d_m * c, d_m * s, 0.0))
        })
    })
}

/// How many of the points lie on surfaces at a pose.
pub(super) fn laid_on_surfaces(points: &[Point], local: &LocalMap, pose: &Pose2) -> f64 {
    laid_on(points, local, pose, ON_M, ON_GATE_M)
}

fn laid_on(points: &[Point], local: &LocalMap, pose: &Pose2, on_m: f64, gate_m: f32) -> f64 {
    let (s, c) = pose.yaw_rad.sin_cos();
    let on = |p: &Point| {
        let moved = p.turned(pose, s, c);
        local.nearest(&moved, gate_m).map_or(0.0, |Nearest { point: q, .. }| {
            let r = f64::from((moved.x - q.x) * q.nx + (moved.y - q.y) * q.ny);
            (-r * r / (2.0 * on_m * on_m)).exp()
        })
    };
    points.iter().map(on).sum()
}

fn turned(a: &Pose2, b: &Pose2) -> f64 {
    a.between(b).yaw_rad.abs()
}

fn wide() -> Matrix3<f64> {
    Matrix3::from_diagonal(&Vector3::new(4.0, 4.0, 2.0))
}
