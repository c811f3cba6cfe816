//! What an observer may believe who knows the building, the simulator's noise, and a list of
//! hypotheses about where the robot is: the odds that a mapping server's are held against.
//!
//! The posterior over hypotheses h at a time t, from what came in up to t:
//!
//! ```text
//! log w_h(t) = log prior_h
//!            + Σ over dark stretches that ended   log N(log(m⁻¹ ∘ rel_h); 0, Σ)      wheels
//!            + Σ over scans in the light          log p(scan | T_h x) − log p(scan | x)   laser
//!            + Σ over sentences                   log p(name | T_h at)                words
//! ```
//!
//! with x the true pose, world frame, T_h the hypothesis' `world_from_true` at that time, m the
//! motion that the wheels tell of and rel_h the one that the hypothesis asks for. Nothing here is
//! shared with a mapping server: an error of its filter can't hide in its own yardstick.
//!
//! What is approximate:
//!
//! - motion in the dark is linearised: good while its heading is known to 0.2 rad at the stretch's
//!   end; beyond, the ends become banana-shaped, and the tails are heavier than this says;
//! - the laser is taken to give every pose in the light exactly, and a hypothesis to hold it rigidly
//!   at `T_h x`: rooms whose walls differ by less than the laser's noise are not fitted anew;
//! - how far and how much the robot turned in the dark, and with it how large the noise is, comes
//!   from the truth, not from the wheels' own noisy steps;
//! - wheels are without faults: a slip in the dark is taken for noise;
//! - a ray that a hypothesis can't explain costs a bounded amount;
//! - not every scan is used, see [`Seen::stride_s`].

mod plane;
mod rays;
mod wheels;
mod words;

#[cfg(test)]
mod tests;

pub use wheels::motions;

use super::body::STEP_S;
use super::tours::{Claim, Hypothesis, Piece, Said};
use super::{Drive, LaserModel, WheelsPrior, World};
use toponym_proto::{Message, Pose};

/// Times closer than this are the same: stamps are rounded, and 3 · 0.1 is not 0.3.
const HAIR_S: f64 = 1e-6;

/// A time in which the laser tells nothing of the motion.
#[derive(Clone, Debug, PartialEq)]
pub struct Stretch {
    /// Last time in the light before it or first in the dark, seconds from the start of the drive.
    pub from_s: f64,
    /// First time in the light after it.
    pub to_s: f64,
    /// The wheels tell nothing either: the robot was off, and may have been carried.
    pub carried: bool,
}

/// Everything that came in, and the simulator's settings behind it.
#[derive(Clone, Copy, Debug)]
pub struct Seen<'a> {
    /// The building.
    pub world: &'a World,
    /// Where the robot really went.
    pub drive: &'a Drive,
    /// The same as its wheels measured it.
    pub odometry: &'a Drive,
    /// What is known of these wheels: their noise, and how wrong they may always be.
    pub prior: &'a WheelsPrior,
    /// When it was dark, in order of time, apart from each other.
    pub dark: &'a [Stretch],
    /// The robot's lasers.
    pub lasers: &'a [LaserModel],
    /// Its messages; only scans matter.
    pub stream: &'a [Message],
    /// Of each laser, scans closer to each other than this are left out, seconds: they cost time
    /// and say little more. 1 is fine.
    pub stride_s: f64,
    /// What people said.
    pub said: &'a [Said],
    /// Share of false sentences.
    pub epsilon: f64,
    /// Number of names that a false sentence draws from.
    pub vocabulary: usize,
}

/// What speaks for a hypothesis against the truth: log likelihood ratios.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Terms {
    /// Of the motion in the dark.
    pub wheels: f64,
    /// Of the scans in the light.
    pub laser: f64,
    /// Of the sentences.
    pub words: f64,
}

impl Terms {
    fn sum(&self) -> f64 {
        self.wheels + self.laser + self.words
    }
}

/// The belief at a time.
#[derive(Clone, Debug, PartialEq)]
pub struct Posterior {
    /// Seconds from the start of the drive.
    pub at_s: f64,
    /// Probability of each hypothesis; they add up to 1.
    pub p: Vec<f64>,
    /// What decided, for each hypothesis.
    pub terms: Vec<Terms>,
}

/// A hypothesis that can't be weighed.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ReferenceError {
    /// It moves the robot where the laser would have seen it.
    #[error("{hypothesis}: moved at {from_s} s, when it is neither dark nor carried")]
    LitJump {
        /// Its name.
        hypothesis: String,
        /// When it begins to hold the robot elsewhere.
        from_s: f64,
    },
}

/// The posterior over hypotheses at each of the times `at_s`. `prior` has a weight for each
/// hypothesis; missing ones are 1.
///
/// # Errors
/// If a hypothesis moves the robot outside all dark stretches.
pub fn posterior(
    seen: &Seen<'_>,
    hypotheses: &[Hypothesis],
    prior: &[f64],
    at_s: &[f64],
) -> Result<Vec<Posterior>, ReferenceError> {
    for hypothesis in hypotheses {
        check(hypothesis, seen.dark)?;
    }
    let told: Vec<_> = hypotheses.iter().map(|h| (rays::ratios(seen, h), words::ratios(seen, h))).collect();
    let at = |&t_s: &f64| {
        let links = wheels::links(seen, t_s);
        let of_truth = links.log_density(seen.drive, &truth());
        let weigh = |(h, (laser, words)): (&Hypothesis, &(Vec<_>, Vec<_>))| Terms {
            // The truth itself is no different from the truth, whatever the rounding.
            wheels: if h.pieces.is_empty() { 0.0 } else { links.log_density(seen.drive, h) - of_truth },
            laser: sum_up_to(t_s, laser),
            words: sum_up_to(t_s, words),
        };
        let terms: Vec<Terms> = hypotheses.iter().zip(&told).map(weigh).collect();
        Posterior { at_s: t_s, p: normalised(&terms, prior), terms }
    };
    Ok(at_s.iter().map(at).collect())
}

/// Where a hypothesis holds the robot to be, which really is where the drive says.
fn pose(hypothesis: &Hypothesis, drive: &Drive, t_s: f64) -> Pose {
    hypothesis.at(t_s + HAIR_S, &drive.at(t_s))
}

/// Each piece begins later than a dark stretch does, and not later than it ends.
fn check(hypothesis: &Hypothesis, dark: &[Stretch]) -> Result<(), ReferenceError> {
    let within = |p: &Piece, d: &Stretch| d.from_s + HAIR_S < p.from_s && p.from_s <= d.to_s + HAIR_S;
    match hypothesis.pieces.iter().find(|p| !dark.iter().any(|d| within(p, d))) {
        Some(p) => Err(ReferenceError::LitJump { hypothesis: hypothesis.name.clone(), from_s: p.from_s }),
        None => Ok(()),
    }
}

/// The hypothesis that the robot is where it is.
fn truth() -> Hypothesis {
    Hypothesis { name: String::new(), pieces: Vec::new() }
}

impl Stretch {
    /// On dark floor.
    pub fn dark((from_s, to_s): (f64, f64)) -> Self {
        Self { from_s, to_s, carried: false }
    }

    /// The robot was off, and somewhere else, with its odometry anew, from `at_s` on.
    pub fn restart(at_s: f64) -> Self {
        Self { from_s: at_s - STEP_S, to_s: at_s, carried: true }
    }

    /// Time steps of the drive, from the first on and before the last, that it touches.
    fn steps(&self) -> std::ops::Range<usize> {
        let step = |t_s: f64| t_s.max(0.0) / STEP_S;
        step(self.from_s + HAIR_S).floor() as usize..step(self.to_s - HAIR_S).ceil() as usize
    }

    /// Whether the laser sees nothing at a time. It may or may not at the very first.
    fn hides(&self, t_s: f64) -> bool {
        self.from_s - HAIR_S < t_s && t_s < self.to_s - HAIR_S
    }
}

fn sum_up_to(t_s: f64, timed: &[(f64, f64)]) -> f64 {
    timed.iter().filter(|(at_s, _)| *at_s <= t_s + HAIR_S).fold(0.0, |sum, (_, log_ratio)| sum + log_ratio)
}

/// Probabilities ∝ prior · exp(sum of terms).
fn normalised(terms: &[Terms], prior: &[f64]) -> Vec<f64> {
    let weights = prior.iter().copied().chain(std::iter::repeat(1.0));
    let logs: Vec<f64> = terms.iter().zip(weights).map(|(t, w)| w.ln() + t.sum()).collect();
    let most = logs.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let total: f64 = logs.iter().map(|l| (l - most).exp()).sum();
    logs.iter().map(|l| (l - most).exp() / total).collect()
}
