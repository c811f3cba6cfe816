//! What the wheels tell of the motion in the dark.
//!
//! One step of the drive goes δ = (dx, dy, dθ) in the body frame, w metres far, and is measured
//! (`Drive::measured`) as
//!
//! ```text
//! mx = (1 + s) dx + ε₁,      ε₁ ~ N(0, noise_m² w)
//! my = (1 + s) dy
//! mθ = (1 + t) dθ + b w + ε₂,  ε₂ ~ N(0, yaw_noise² w + turn_noise² |dθ|)
//! ```
//!
//! The systematic errors θ = (s, t, b) are learned where the laser tells δ, and leave the dark with
//! a mean motion m and an error of it, m⁻¹ ∘ δ_dark = exp(G (θ − θ̂) + noise).

use super::super::Drive;
use super::super::body::STEP_S;
use super::super::geom::{between, compose};
use super::plane::{
    Mat3, Vec3, ZERO, add, apply, carried_over, diagonal, inverse, log, log_normal, mul, through, transpose,
};
use super::{HAIR_S, Hypothesis, Seen, Stretch, WheelsPrior, pose};
use toponym_proto::Pose;

/// Keeps what exact wheels measure from being infinitely certain: variance of a step, m² or rad².
const STEP_VARIANCE: f64 = 1e-14;
/// The same for a whole stretch: 0.1 mm, 0.1 mrad.
const STRETCH_VARIANCE: f64 = 1e-8;

/// What is known of the systematic errors (s, t, b).
#[derive(Clone, Debug)]
pub(super) struct Systematic {
    pub(super) mean: Vec3,
    pub(super) covariance: Mat3,
}

impl Systematic {
    /// From the steps of the drive that a laser saw.
    ///
    /// Linear regression: mx − dx = s dx + ε₁ and mθ − dθ = t dθ + b w + ε₂ with the prior
    /// N(0, S²), S = diag(σ), give the covariance P = S (I + S Λ S)⁻¹ S, Λ = Σ a aᵀ/σ², and the
    /// mean P Σ a r/σ². The sideways motion is left out: robots here do not move sideways.
    pub(super) fn learn(
        drive: &Drive,
        odometry: &Drive,
        prior: &WheelsPrior,
        steps: impl Iterator<Item = usize>,
    ) -> Self {
        let (mut information, mut pull) = (ZERO, [0.0; 3]);
        for k in steps {
            let (Some(truth), Some(measured)) = (step(drive, k), step(odometry, k)) else { continue };
            let [x_variance, yaw_variance] = variances(&truth, prior);
            for (row, residual, variance) in [
                ([truth.x_m, 0.0, 0.0], measured.x_m - truth.x_m, x_variance),
                ([0.0, truth.yaw_rad, way_m(&truth)], measured.yaw_rad - truth.yaw_rad, yaw_variance),
            ] {
                let variance = variance + STEP_VARIANCE;
                for i in 0..3 {
                    pull[i] += row[i] * residual / variance;
                    for j in 0..3 {
                        information[i][j] += row[i] * row[j] / variance;
                    }
                }
            }
        }
        // In this form, a σ of 0, an error known to be absent, is nothing special.
        let sigmas = diagonal([prior.scale, prior.turn, prior.yaw_bias_rad_per_m]);
        let scaled = add(&diagonal([1.0; 3]), &through(&sigmas, &information));
        let covariance = through(&sigmas, &inverse(&scaled));
        Self { mean: apply(&covariance, pull), covariance }
    }
}

/// The motion over one dark stretch.
#[derive(Clone, Debug)]
pub(super) struct Link {
    from_s: f64,
    to_s: f64,
    /// The motion m, corrected by the mean of the systematic errors.
    pub(super) motion: Pose,
    /// Covariance of its error by noise, right perturbation, m and rad.
    pub(super) noise: Mat3,
    /// Its error per systematic error, G.
    pub(super) by_systematic: Mat3,
}

impl Link {
    /// Each step c is corrected to dx = mx / (1 + s), dθ = (mθ − b w) / (1 + t), and errors so far
    /// are carried over it: Q ← A Q Aᵀ + Q_c, G ← A G + J_c with A = Ad(c⁻¹).
    pub(super) fn new(
        drive: &Drive,
        odometry: &Drive,
        prior: &WheelsPrior,
        errors: Vec3,
        stretch: &Stretch,
    ) -> Self {
        let mut link = Self {
            from_s: stretch.from_s,
            to_s: stretch.to_s,
            motion: Pose::default(),
            noise: diagonal([STRETCH_VARIANCE; 3]),
            by_systematic: ZERO,
        };
        let [s, t, b] = errors;
        for k in stretch.steps() {
            let (Some(truth), Some(measured)) = (step(drive, k), step(odometry, k)) else { continue };
            let (x_m, y_m) = (measured.x_m / (1.0 + s), measured.y_m / (1.0 + s));
            let yaw_rad = (measured.yaw_rad - b * x_m.hypot(y_m)) / (1.0 + t);
            link.append(&Pose { x_m, y_m, yaw_rad }, variances(&truth, prior), errors);
        }
        link
    }

    fn append(&mut self, step: &Pose, [x_variance, yaw_variance]: [f64; 2], [s, t, _]: Vec3) {
        // Errors of the step's coordinates, turned into the frame at its end.
        let turned = carried_over(&Pose { x_m: 0.0, y_m: 0.0, yaw_rad: step.yaw_rad });
        let noise = diagonal([x_variance / (1.0 + s).powi(2), 0.0, yaw_variance / (1.0 + t).powi(2)]);
        let by_systematic = [
            [-step.x_m / (1.0 + s), 0.0, 0.0],
            [-step.y_m / (1.0 + s), 0.0, 0.0],
            [0.0, -step.yaw_rad / (1.0 + t), -way_m(step) / (1.0 + t)],
        ];
        let over = carried_over(step);
        self.noise = add(&through(&over, &self.noise), &through(&turned, &noise));
        self.by_systematic = add(&mul(&over, &self.by_systematic), &mul(&turned, &by_systematic));
        self.motion = compose(&self.motion, step);
    }

    /// What the motion lacks of another one, `log(m⁻¹ ∘ other)`.
    pub(super) fn residual(&self, other: &Pose) -> Vec3 {
        log(&between(&self.motion, other))
    }
}

/// The dark stretches up to a time, as the wheels tell of them.
pub(super) struct Links {
    systematic: Systematic,
    links: Vec<Link>,
}

/// The dark stretches that were over at a time, with what the light had taught until then. A
/// carried robot has no link.
pub(super) fn links(seen: &Seen<'_>, t_s: f64) -> Links {
    let Seen { drive, odometry, prior, dark, .. } = *seen;
    let hidden: Vec<_> = dark.iter().map(Stretch::steps).collect();
    let lit = |k: &usize| !hidden.iter().any(|d| d.contains(k));
    let steps_over = ((t_s + HAIR_S) / STEP_S) as usize;
    let systematic = Systematic::learn(drive, odometry, prior, (0..steps_over).filter(lit));
    let ended = dark.iter().filter(|d| d.to_s <= t_s + HAIR_S && !d.carried);
    let links = ended.map(|d| Link::new(drive, odometry, prior, systematic.mean, d)).collect();
    Links { systematic, links }
}

impl Links {
    /// Log density of all the motions that a hypothesis asks for, together: the systematic errors
    /// are the same in all of them, so each stretch, too, teaches what they are, under that
    /// hypothesis. With one stretch, this is log N(log(m⁻¹ ∘ rel); 0, Q + G P Gᵀ).
    pub(super) fn log_density(&self, drive: &Drive, hypothesis: &Hypothesis) -> f64 {
        let (mut mean, mut covariance) = ([0.0; 3], self.systematic.covariance);
        let mut sum = 0.0;
        for link in &self.links {
            let asked = between(&pose(hypothesis, drive, link.from_s), &pose(hypothesis, drive, link.to_s));
            let (g, residual) = (&link.by_systematic, link.residual(&asked));
            let expected = apply(g, mean);
            let surprise = [0, 1, 2].map(|i| residual[i] - expected[i]);
            let spread = add(&link.noise, &through(g, &covariance));
            sum += log_normal(surprise, &spread);
            // Kalman's update of the systematic errors.
            let gain = mul(&mul(&covariance, &transpose(g)), &inverse(&spread));
            let change = apply(&gain, surprise);
            mean = [0, 1, 2].map(|i| mean[i] + change[i]);
            let known = through(&gain, &spread);
            covariance = [0, 1, 2].map(|i| [0, 1, 2].map(|j| covariance[i][j] - known[i][j]));
        }
        sum
    }
}

/// The motion from one pose to the next, body frame.
fn step(drive: &Drive, k: usize) -> Option<Pose> {
    Some(between(drive.poses.get(k)?, drive.poses.get(k + 1)?))
}

fn way_m(step: &Pose) -> f64 {
    step.x_m.hypot(step.y_m)
}

/// Variances of a step's measured way, m², and turn, rad², by noise.
fn variances(truth: &Pose, prior: &WheelsPrior) -> [f64; 2] {
    let (way_m, turn_rad) = (way_m(truth), truth.yaw_rad.abs());
    [
        prior.noise_m.powi(2) * way_m,
        prior.yaw_noise_rad.powi(2) * way_m + prior.turn_noise_rad.powi(2) * turn_rad,
    ]
}
