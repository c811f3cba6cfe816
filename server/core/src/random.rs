//! Random draws keyed by what they are for: the same key gives the same draw, in any order and on
//! any thread.

use rand::{Rng, RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// What a draw decides.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Purpose {
    /// Which older place is looked at.
    Propose,
    /// What a test draws.
    Test,
    /// Which measurements are replaced by random ones, and by which.
    Inject,
}

/// A generator for one decision: `who` is a place, a particle or a pair.
pub fn generator(seed: u64, step: u64, who: u64, purpose: Purpose) -> impl Rng {
    let mut key = [0u8; 32];
    for (chunk, word) in key.chunks_exact_mut(8).zip([seed, step, who, purpose as u64]) {
        chunk.copy_from_slice(&word.to_le_bytes());
    }
    ChaCha8Rng::from_seed(key)
}

/// A draw in [0, 1).
pub fn uniform(seed: u64, step: u64, who: u64, purpose: Purpose) -> f64 {
    generator(seed, step, who, purpose).random()
}
