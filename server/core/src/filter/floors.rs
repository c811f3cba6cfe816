//! Floors: parts of the map between stretches that no scan measured, joined by revisits. What lies on one floor
//! hangs together; between two there is only odometry.

use crate::edge::Vertex;
use crate::filter::particle::Particle;
use crate::graph::stretches::{self, Stretch};

/// The parts of a map, and which of them a particle's revisits tie.
#[derive(Clone, Debug)]
pub struct Floors {
    /// Last places of the stretches between parts.
    pub ends: Vec<Vertex>,
    /// By part, what the stretches before it add up to: variance, m².
    pub drift_m2: Vec<f64>,
    /// By part.
    of: Vec<usize>,
}

impl Floors {
    /// Of a particle, whose map these stretches part.
    pub fn of(vague: &[&Stretch], particle: &Particle) -> Self {
        let ends: Vec<Vertex> = vague.iter().map(|s| s.last).collect();
        let variance_m2 = |s: &&Stretch| (s.covariance[(0, 0)] + s.covariance[(1, 1)]) * 0.5;
        let drift_m2 = vague.iter().map(variance_m2).scan(0.0, |sum, m2| {
            *sum += m2;
            Some(*sum)
        });
        let drift_m2 = std::iter::once(0.0).chain(drift_m2).collect();
        let mut of: Vec<usize> = (0..=ends.len()).collect();
        if !ends.is_empty() {
            let part = |v: Vertex| stretches::part(&ends, v);
            for e in particle.edges.iter() {
                let (a, b) = (of[part(e.i)], of[part(e.j)]);
                if a != b {
                    of.iter_mut().filter(|f| **f == a).for_each(|f| *f = b);
                }
            }
        }
        Self { ends, drift_m2, of }
    }

    /// Of a part; one that has no end yet is for itself.
    pub fn floor(&self, part: usize) -> usize {
        self.of.get(part).copied().unwrap_or(part)
    }

    /// The part that a place is in.
    pub fn part(&self, v: Vertex) -> usize {
        stretches::part(&self.ends, v)
    }
}
