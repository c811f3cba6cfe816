//! What people said as evidence about graphs: log p(λ | G), a function of the graph and not of when it
//! was asked.

use crate::filter::Filter;
use crate::filter::particle::Particle;
use crate::graph::Graph;
use rayon::prelude::*;

/// What people said as evidence about graphs, relative to sentences that say nothing.
pub trait Words: Sync {
    /// log p(λ_1 … λ_n | G, X, L) of one particle, sentences folded in the order they were said; `graph` is what
    /// all particles share.
    fn log_likelihood(&self, graph: &Graph, particle: &Particle) -> f64;
}

/// Nobody said anything.
pub struct Silence;

impl Words for Silence {
    fn log_likelihood(&self, _: &Graph, _: &Particle) -> f64 {
        0.0
    }
}

impl Filter {
    /// Puts each particle's share of the words in its weight as it is now, in place of what it was when last
    /// asked: w ∝ p(λ | G) however often, and in whatever order, it is asked.
    pub fn weigh_words(&mut self, words: &dyn Words) {
        let graph = &self.graph;
        self.particles.par_iter_mut().for_each(|p| p.weigh_words(graph, words));
        self.rank();
    }
}

impl Particle {
    /// [`Filter::weigh_words`] of one particle, its weight not normalised yet: for a child just born too.
    pub fn weigh_words(&mut self, graph: &Graph, words: &dyn Words) {
        let now = words.log_likelihood(graph, self);
        self.log_weight += now - self.log_words;
        self.log_words = now;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::Config;

    /// Says a constant of any graph.
    struct Saying(f64);

    impl Words for Saying {
        fn log_likelihood(&self, _: &Graph, particle: &Particle) -> f64 {
            self.0 * particle.failed.len() as f64
        }
    }

    #[test]
    fn words_count_once_however_often_they_weigh_and_leave_nothing_behind() {
        let mut filter = Filter::new(Config::default());
        filter.particles =
            vec![Particle::empty(), Particle { failed: std::sync::Arc::new(vec![1]), ..Particle::empty() }];
        filter.rank();
        for _ in 0..3 {
            filter.weigh_words(&Saying(1.5));
        }
        let [heavy, light] = &filter.particles[..] else { panic!() };
        assert_eq!((heavy.failed.len(), light.failed.len()), (1, 0));
        assert!((heavy.log_weight - light.log_weight - 1.5).abs() < 1e-12);
        assert!((heavy.weight() + light.weight() - 1.0).abs() < 1e-12);
        filter.weigh_words(&Silence);
        assert!(filter.particles.iter().all(|p| (p.weight() - 0.5).abs() < 1e-12 && p.log_words == 0.0));
    }
}
