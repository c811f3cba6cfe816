//! Step 4 of Algorithm 1, the words: what a sentence says for or against a particle.
//!
//! A name said of a place is predicted by what was said before of the places that a particle has
//! close by. Before it enters the labels (12) it weighs the particle by
//!
//! ```text
//! p(λ | G, X, L) = (1 − ε) · (α_l + α₀ p₀(l)) / (Σ α + α₀) + ε · p₀(l)
//! ```
//!
//! the Dirichlet-multinomial over the joined evidence, and ε for talk that is false or misheard.
//! p₀ is how often a name is said of anything: a rare name where it is known to be is strong
//! evidence, "hallway" is weak. A description weighs by the 1/Z of eq. (16): what is known of its figure,
//! times how well that lies as described.

use crate::edge::Vertex;
use crate::filter::labels::{BASE, LabelId, Labels, Source, probability};
use crate::geometry::Pose2;
use crate::language::act::Sameness;

/// ε: one sentence in ten is false, misheard, or put where it does not belong.
const FALSE_TALK: f64 = 0.1;
/// What one sentence may say for or against a particle: twenty to one.
const LOG_WORDS_MAX: f64 = 3.0;
/// Names people may use of a place before any was said: the size of the lexicon, about.
const NAMES: f64 = 150.0;
/// How near two places are for what is said of one to be expected of the other: standard deviation
/// of a Gaussian kernel, the size of a room.
const JOINED_M: f64 = 4.0;

/// p₀(l): how often a name is said of anything, given how often it was among how many.
pub fn base_probability(times_said: usize, of: usize) -> f64 {
    (times_said as f64 + 1.0) / (of as f64 + NAMES)
}

/// log p(λ | G, X, L) − log p₀ of a name said of place `v` in one particle, `poses` of all places
/// in its map.
pub fn log_label(
    labels: &Labels,
    poses: &[Pose2],
    (v, label): (Vertex, LabelId),
    again: Sameness,
    p0: f64,
) -> f64 {
    let Near { of_label, all } = near(labels, poses, v, label);
    let predicted = match again {
        Sameness::Open => (of_label + BASE * p0) / (all + BASE),
        // "Back in the lobby": it was called so before.
        Sameness::Same => of_label / (all + BASE),
        // "Another lobby": it was not.
        Sameness::Other => p0 * (1.0 - probability(of_label)),
    };
    bounded(((1.0 - FALSE_TALK) * predicted + FALSE_TALK * p0) / p0)
}

/// The same for "this is not the kitchen".
pub fn log_denied(labels: &Labels, poses: &[Pose2], (v, label): (Vertex, LabelId)) -> f64 {
    let is = probability(near(labels, poses, v, label).of_label);
    bounded((1.0 - FALSE_TALK) * (1.0 - is) + FALSE_TALK)
}

/// The same for a sentence that locates, of its [`crate::language::Grounding::likelihood_ratio`].
pub fn log_located(likelihood_ratio: f64) -> f64 {
    bounded((1.0 - FALSE_TALK) * likelihood_ratio + FALSE_TALK)
}

fn bounded(ratio: f64) -> f64 {
    ratio.ln().clamp(-LOG_WORDS_MAX, LOG_WORDS_MAX)
}

/// α of the places joined with one.
struct Near {
    of_label: f64,
    all: f64,
}

fn near(labels: &Labels, poses: &[Pose2], v: Vertex, label: LabelId) -> Near {
    let (mut of_label, mut all) = (0.0, 0.0);
    let Some(here) = poses.get(v as usize) else { return Near { of_label, all } };
    for e in labels.evidence().iter().filter(|e| !matches!(e.source, Source::Denied | Source::Tied)) {
        let Some(there) = poses.get(e.place as usize) else { continue };
        let share = e.weight * (-0.5 * (here.distance_m(there) / JOINED_M).powi(2)).exp();
        all += share;
        of_label += if e.label == label { share } else { 0.0 };
    }
    Near { of_label, all }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::filter::labels::{DIRECT, Evidence};

    /// The gym at place 0, the kitchen at place 1, 50 m apart; place 2 where it is told.
    fn told(x_m: f64) -> (Labels, Vec<Pose2>) {
        let mut labels = Labels::default();
        for place in 0..2 {
            labels.add(Evidence::new(place, place, place, DIRECT, Source::Direct));
        }
        (labels, [0.0, 50.0, x_m].map(|x_m| Pose2::new(x_m, 0.0, 0.0)).to_vec())
    }

    fn gym(x_m: f64, again: Sameness) -> f64 {
        let (labels, poses) = told(x_m);
        log_label(&labels, &poses, (2, 0), again, base_probability(1, 2))
    }

    #[test]
    fn a_name_speaks_for_the_map_in_which_it_was_said_nearby() {
        assert!(gym(1.0, Sameness::Open) > 2.0);
        assert!(gym(25.0, Sameness::Open).abs() < 0.1, "new places are called anything");
        assert!(gym(50.0, Sameness::Open) < -0.4, "that is the kitchen");
        assert!(gym(50.0, Sameness::Open) > (FALSE_TALK / 2.0).ln(), "talk may be false");
    }

    #[test]
    fn the_same_again_and_another_one_say_opposite_things() {
        assert!(gym(1.0, Sameness::Same) > 2.0 && gym(25.0, Sameness::Same) < -2.0);
        assert!(gym(1.0, Sameness::Other) < -1.0 && gym(25.0, Sameness::Other) > -0.1);
    }

    #[test]
    fn a_name_said_of_many_places_says_little() {
        let (labels, poses) = told(1.0);
        let log = |times, of| log_label(&labels, &poses, (2, 0), Sameness::Open, base_probability(times, of));
        assert!(log(1, 300) > log(100, 300) + 1.0);
    }

    #[test]
    fn denial_speaks_against_the_map_in_which_it_was_said_nearby() {
        let (labels, poses) = told(1.0);
        assert!(log_denied(&labels, &poses, (2, 0)) < -1.0);
        assert!(log_denied(&labels, &poses, (2, 1)).abs() < 0.01);
    }
}
