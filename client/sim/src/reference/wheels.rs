//! What the wheels tell of the motion in the dark.
//!
//! The systematic errors θ = (s, t, b) are learned where the laser tells the motion
//! (`calibration.rs`), and leave the dark with a mean motion m and an error of it,
//! m⁻¹ ∘ δ_dark = exp(G (θ − θ̂) + noise).

use super::super::Drive;
use super::super::body::STEP_S;
use super::super::calibration::{Systematic, step, variances, way_m};
use super::super::geom::{between, compose};
use super::plane::{carried_over, log, log_normal, through};
use super::{HAIR_S, Hypothesis, Seen, Stretch, WheelsPrior, pose};
use nalgebra::{Matrix3, Vector3};
use toponym_proto::Pose;

/// Keeps what exact wheels measure from being infinitely certain: 0.1 mm and 0.1 mrad a stretch.
const STRETCH_VARIANCE: f64 = 1e-8;

/// The motion over one dark stretch.
#[derive(Clone, Debug)]
pub(super) struct Link {
    from_s: f64,
    to_s: f64,
    /// The motion m, corrected by the mean of the systematic errors.
    pub(super) motion: Pose,
    /// Covariance of its error by noise, right perturbation, m and rad.
    pub(super) noise: Matrix3<f64>,
    /// Its error per systematic error, G.
    pub(super) by_systematic: Matrix3<f64>,
}

impl Link {
    /// Each step c is corrected to dx = mx / (1 + s), dθ = (mθ − b w) / (1 + t), and errors so far
    /// are carried over it: Q ← A Q Aᵀ + Q_c, G ← A G + J_c with A = Ad(c⁻¹).
    pub(super) fn new(
        drive: &Drive,
        odometry: &Drive,
        prior: &WheelsPrior,
        errors: &Vector3<f64>,
        stretch: &Stretch,
    ) -> Self {
        let mut link = Self {
            from_s: stretch.from_s,
            to_s: stretch.to_s,
            motion: Pose::default(),
            noise: Matrix3::from_diagonal_element(STRETCH_VARIANCE),
            by_systematic: Matrix3::zeros(),
        };
        let (s, t, b) = (errors.x, errors.y, errors.z);
        for k in stretch.steps() {
            let (Some(truth), Some(measured)) = (step(drive, k), step(odometry, k)) else { continue };
            let (x_m, y_m) = (measured.x_m / (1.0 + s), measured.y_m / (1.0 + s));
            let yaw_rad = (measured.yaw_rad - b * x_m.hypot(y_m)) / (1.0 + t);
            link.append(&Pose { x_m, y_m, yaw_rad }, variances(&truth, prior), (s, t));
        }
        link
    }

    fn append(&mut self, step: &Pose, [x_variance, yaw_variance]: [f64; 2], (s, t): (f64, f64)) {
        // Errors of the step's coordinates, turned into the frame at its end.
        let turned = carried_over(&Pose { x_m: 0.0, y_m: 0.0, yaw_rad: step.yaw_rad });
        let spread = Vector3::new(x_variance / (1.0 + s).powi(2), 0.0, yaw_variance / (1.0 + t).powi(2));
        let by_systematic = Matrix3::from_rows(&[
            Vector3::new(-step.x_m / (1.0 + s), 0.0, 0.0).transpose(),
            Vector3::new(-step.y_m / (1.0 + s), 0.0, 0.0).transpose(),
            Vector3::new(0.0, -step.yaw_rad / (1.0 + t), -way_m(step) / (1.0 + t)).transpose(),
        ]);
        let over = carried_over(step);
        self.noise = through(&over, &self.noise) + through(&turned, &Matrix3::from_diagonal(&spread));
        self.by_systematic = over * self.by_systematic + turned * by_systematic;
        self.motion = compose(&self.motion, step);
    }

    /// What the motion lacks of another one, `log(m⁻¹ ∘ other)`.
    pub(super) fn residual(&self, other: &Pose) -> Vector3<f64> {
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
    let links = ended.map(|d| Link::new(drive, odometry, prior, &systematic.mean, d)).collect();
    Links { systematic, links }
}

/// What the wheels tell of the motion over each dark stretch to an observer who knows their noise and has learned
/// in the light until its end what they always get wrong: the motion, and the covariance of its right perturbation.
pub fn motions(
    drive: &Drive,
    odometry: &Drive,
    prior: &WheelsPrior,
    dark: &[Stretch],
) -> Vec<(Pose, Matrix3<f64>)> {
    let told = |stretch: &Stretch| {
        let lit = |k: &usize| !dark.iter().any(|d| d.steps().contains(k));
        let steps_over = ((stretch.to_s + HAIR_S) / STEP_S) as usize;
        let known = Systematic::learn(drive, odometry, prior, (0..steps_over).filter(lit));
        let link = Link::new(drive, odometry, prior, &known.mean, stretch);
        (link.motion, link.noise + through(&link.by_systematic, &known.covariance))
    };
    dark.iter().map(told).collect()
}

impl Links {
    /// Log density of all the motions that a hypothesis asks for, together: the systematic errors
    /// are the same in all of them, so each stretch, too, teaches what they are, under that
    /// hypothesis. With one stretch, this is log N(log(m⁻¹ ∘ rel); 0, Q + G P Gᵀ).
    pub(super) fn log_density(&self, drive: &Drive, hypothesis: &Hypothesis) -> f64 {
        let (mut mean, mut covariance) = (Vector3::zeros(), self.systematic.covariance);
        let mut sum = 0.0;
        for link in &self.links {
            let asked = between(&pose(hypothesis, drive, link.from_s), &pose(hypothesis, drive, link.to_s));
            let g = &link.by_systematic;
            let surprise = link.residual(&asked) - g * mean;
            let spread = link.noise + through(g, &covariance);
            sum += log_normal(&surprise, &spread);
            // Kalman's update of the systematic errors.
            let Some(root) = spread.cholesky() else { continue };
            let gain = covariance * g.transpose() * root.inverse();
            mean += gain * surprise;
            covariance -= through(&gain, &spread);
        }
        sum
    }
}
