//! How noisy wheels are: what they get wrong now and then, a random walk of path and turning.
//!
//! Over a window of some path w and turning |ψ| that registration saw, odometry is off by r, whose variance is
//!
//! ```text
//! V = a w + c |ψ| + ρ F + K
//! ```
//!
//! with a and c, the noise sought, F what registration thinks its own variance is, ρ how far that is true, and K
//! that of the systematic errors. How much of r is the wheels' and how much is registration's shows in windows of
//! different lengths; how much is of the path and how much of turning, on straights and in bends. So the three
//! are learned together, by Bayes' rule on a grid of them. Where registration says less than the wheels, it
//! follows them, and that they agree says nothing: such a window counts for little.

use serde::{Deserialize, Serialize};

/// Values tried of each: `LEAST · 2^k` per metre and per radian, `4^k / 16` of ρ: registration is no worse
/// than it says, or what it is off by counts for the wheels'.
const PER_M: usize = 16;
const PER_RAD: usize = 14;
const FIXES: usize = 3;
const LEAST_PER_M: f64 = 1e-6;
const LEAST_PER_RAD: f64 = 4e-6;
/// How widely a variance is believed to lie about the first guess, and the ratio of the two about theirs:
/// standard deviations of the logarithm.
const SPREAD: f64 = 1.2;
const RATIO_SPREAD: f64 = 1.0;
/// Share of windows in which something else happened: a slip, a false fit.
const WILD: f64 = 0.02;
/// Windows remembered.
const KEPT: f64 = 300.0;

/// Where noise is believed to lie before anything was seen.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct First {
    /// Variance per metre, its median.
    pub per_m: f64,
    /// Variance per radian, its median.
    pub per_rad: f64,
    /// What a window may be off by if something else happened.
    pub wild: f64,
}

/// A motion that was measured.
#[derive(Clone, Copy, Debug)]
pub(super) struct Look {
    /// What odometry is off by, squared.
    pub squared: f64,
    pub path_m: f64,
    pub turned_rad: f64,
    /// F and K.
    pub fix: f64,
    pub known: f64,
}

/// What is known of the noise of one coordinate.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Noise {
    first: First,
    /// Log likelihood of each (a, c, ρ), ρ fastest.
    told: Vec<f64>,
    /// Their means.
    per_m: f64,
    per_rad: f64,
    fix: f64,
}

impl Noise {
    pub fn new(first: First) -> Self {
        let told = vec![0.0; PER_M * PER_RAD * FIXES];
        let mut noise = Self { first, told, per_m: 0.0, per_rad: 0.0, fix: 1.0 };
        noise.average();
        noise
    }

    /// Variance after some path and turning.
    pub fn variance(&self, path_m: f64, turned_rad: f64) -> f64 {
        self.per_m * path_m + self.per_rad * turned_rad
    }

    /// How far registration's own variance is true.
    pub fn fix(&self) -> f64 {
        self.fix
    }

    pub fn learn(&mut self, look: &Look) {
        let mine = self.variance(look.path_m, look.turned_rad);
        if mine < 1e-9 {
            // It did not move.
            return;
        }
        let weight = (mine / (mine + self.fix * look.fix + look.known)).powi(2);
        let normal = |variance: f64| (-0.5 * look.squared / variance).exp() / variance.sqrt();
        // What is off by more than this noise explains says nothing of it: it may be off by anything.
        let wild = WILD / self.first.wild;
        for (told, (a, c, rho)) in self.told.iter_mut().zip(grid()) {
            let variance = a * look.path_m + c * look.turned_rad + rho * look.fix + look.known;
            let density = (1.0 - WILD) * normal(variance) + wild;
            *told = *told * (1.0 - weight / KEPT) + weight * density.ln();
        }
        self.average();
    }

    fn average(&mut self) {
        let first = self.first;
        let prior = |a: f64, c: f64| {
            let off = (a / first.per_m).ln();
            let ratio = (c / first.per_rad).ln() - off;
            -0.5 * ((off / SPREAD).powi(2) + (ratio / RATIO_SPREAD).powi(2))
        };
        let logs: Vec<f64> =
            self.told.iter().zip(grid()).map(|(told, (a, c, _))| told + prior(a, c)).collect();
        let most = logs.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let mut sums = [0.0; 4];
        for (log, (a, c, rho)) in logs.iter().zip(grid()) {
            let p = (log - most).exp();
            for (sum, value) in sums.iter_mut().zip([1.0, a, c, rho]) {
                *sum += p * value;
            }
        }
        [self.per_m, self.per_rad, self.fix] = [1, 2, 3].map(|k| sums[k] / sums[0]);
    }
}

/// Every (a, c, ρ), in the order in which they are kept.
fn grid() -> impl Iterator<Item = (f64, f64, f64)> {
    let doubled = |k: usize| (1u64 << k) as f64;
    (0..PER_M * PER_RAD * FIXES).map(move |k| {
        let (a, c, rho) = (k / (PER_RAD * FIXES), k / FIXES % PER_RAD, k % FIXES);
        (LEAST_PER_M * doubled(a), LEAST_PER_RAD * doubled(c), doubled(2 * rho) / 16.0)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::{Purpose, uniform};

    fn gauss(step: u64) -> f64 {
        (0..12).map(|k| uniform(5, step, k, Purpose::Test)).sum::<f64>() - 6.0
    }

    /// Windows of .4, .8 and 1.6 m, every third of them in a bend, that registration sees with variance `fix` and
    /// believes to see with four times that.
    fn learned(per_m: f64, per_rad: f64, fix: f64) -> Noise {
        let mut noise = Noise::new(First { per_m: 1e-3, per_rad: 2e-3, wild: 0.3 });
        for k in 0..150 {
            let path_m = [0.4, 0.8, 1.6][k as usize % 3];
            let turned_rad = if k / 3 % 3 == 0 { path_m } else { 0.02 };
            let variance = per_m * path_m + per_rad * turned_rad + fix;
            let squared = gauss(k).powi(2) * variance;
            noise.learn(&Look { squared, path_m, turned_rad, fix: 4.0 * fix, known: 0.0 });
        }
        noise
    }

    #[test]
    fn noise_is_learned_whatever_registration_thinks_of_itself() {
        for (per_m, per_rad) in [(1.44e-4, 4e-4), (1.2e-3, 2.5e-3), (2e-4, 2e-3), (1e-3, 5e-4)] {
            let noise = learned(per_m, per_rad, 3e-5);
            // Straight on, and in narrow circles.
            for (path_m, turned_rad) in [(1.0, 0.0), (1.0, 1.0)] {
                let share = noise.variance(path_m, turned_rad) / (per_m * path_m + per_rad * turned_rad);
                assert!((0.5..1.7).contains(&share), "{share} of {per_m} {per_rad}, {turned_rad} rad");
            }
        }
    }

    #[test]
    fn wheels_that_registration_follows_are_not_taken_for_exact_ones() {
        let mut noise = Noise::new(First { per_m: 1e-3, per_rad: 2e-3, wild: 0.3 });
        let before = noise.variance(1.0, 0.0);
        for _ in 0..200 {
            noise.learn(&Look { squared: 0.0, path_m: 0.8, turned_rad: 0.0, fix: 0.1, known: 0.0 });
        }
        assert!(noise.variance(1.0, 0.0) > 0.7 * before, "{} of {before}", noise.variance(1.0, 0.0));
    }
}
