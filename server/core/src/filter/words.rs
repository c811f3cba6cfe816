//! What people said as evidence about graphs: see [`crate::talk`], which tells it.

use crate::filter::particle::Particle;

/// What people said as evidence about graphs: log p(λ | G), relative to sentences that say nothing.
pub trait Words: Sync {
    /// log p(λ_1 … λ_n | G, X, L) of one particle, sentences folded in the order they were said.
    fn log_likelihood(&self, particle: &Particle) -> f64;
}
