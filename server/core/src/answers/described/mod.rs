//! Which room is meant by "next to the kitchen": (14–16) over regions, by what regions, their doorways and the way of who
//! speaks tell. The weights are learned ([`weights`]); a room that is not in the map yet is an answer, too.
//!
//! ```text
//! p(figure is R | relation, landmark L) = exp(w · φ(R, L)) / (Σ_regions exp(w · φ) + exp(w · φ(not in the map)))
//! ```

pub mod features;
pub mod sense;
#[cfg(test)]
pub(crate) mod tests;
mod weights;

use self::features::{Alternatives, Clause, FEATURES, Scene};
use crate::language::Relation;

/// Relations that are weighed alike.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Kind {
    /// Nothing is said of where it lies.
    Anywhere,
    /// "Next to".
    Beside,
    /// "Across from".
    Across,
    /// "Between".
    Between,
    /// "Near".
    Near,
    /// "Down the hallway", and all that lies along a way.
    Down,
    /// "On the left".
    Side,
    /// "At the end of".
    End,
    /// "Past".
    Past,
    /// Any other.
    Other,
}

impl Kind {
    /// All of them, in the order of their weights.
    pub const ALL: [Self; 10] = [
        Self::Anywhere,
        Self::Beside,
        Self::Across,
        Self::Between,
        Self::Near,
        Self::Down,
        Self::Side,
        Self::End,
        Self::Past,
        Self::Other,
    ];

    /// How a relation is weighed.
    pub fn of(relation: Relation) -> Self {
        use Relation as R;
        match relation {
            R::NextTo => Self::Beside,
            R::AcrossFrom | R::Across => Self::Across,
            R::Between => Self::Between,
            R::Near => Self::Near,
            R::Down | R::Along | R::To | R::Towards | R::AheadOf => Self::Down,
            R::LeftSide | R::RightSide => Self::Side,
            R::AtEndOf => Self::End,
            R::Past => Self::Past,
            _ => Self::Other,
        }
    }
}

/// Which region is meant; with what is not in the map yet they sum to one.
#[derive(Clone, Debug, PartialEq)]
pub struct Which {
    /// By region.
    pub p: Vec<f64>,
    /// Probability that it is none of them.
    pub p_none: f64,
}

impl Which {
    /// What is known where nothing is said of where something lies.
    pub fn anywhere(scene: &Scene) -> Self {
        let clause = Clause::anywhere();
        Self::softmax(&scene.alternatives(&clause), &weights::WEIGHTS[Kind::Anywhere as usize])
    }

    /// What a clause says.
    pub fn of(scene: &Scene, clause: &Clause) -> Self {
        Self::softmax(&scene.alternatives(clause), &weights::WEIGHTS[Kind::of(clause.relation) as usize])
    }

    /// By weights.
    pub fn softmax(alternatives: &Alternatives, weights: &[f64; FEATURES]) -> Self {
        let score =
            |features: &[f64; FEATURES]| features.iter().zip(weights).map(|(f, w)| f * w).sum::<f64>();
        let scores: Vec<Option<f64>> = alternatives.regions.iter().map(|r| r.as_ref().map(score)).collect();
        let none = score(&alternatives.none);
        let most = scores.iter().flatten().copied().fold(none, f64::max);
        let weigh = |score: f64| (score - most).exp();
        let p: Vec<f64> = scores.into_iter().map(|s| s.map_or(0.0, weigh)).collect();
        let sum = p.iter().sum::<f64>() + weigh(none);
        Self { p: p.into_iter().map(|p| p / sum).collect(), p_none: weigh(none) / sum }
    }

    /// What two that tell of the same say together, each but for `doubt` that it says nothing; `prior` is what both
    /// begin with.
    #[must_use]
    pub fn and(&self, other: &Self, prior: &Self, doubt: f64) -> Self {
        let says = |p: f64, prior: f64| {
            let ratio = if prior > 0.0 { p / prior } else { 0.0 };
            (1.0 - doubt) * ratio + doubt
        };
        let weigh = |p: f64, of: f64, prior: f64| p * says(of, prior);
        let p: Vec<f64> = (0..self.p.len()).map(|r| weigh(self.p[r], other.p[r], prior.p[r])).collect();
        Self { p, p_none: weigh(self.p_none, other.p_none, prior.p_none) }.normalised()
    }

    /// A mixture: adds so much of another.
    pub fn add(&mut self, share: f64, other: &Self) {
        for (p, other) in self.p.iter_mut().zip(&other.p) {
            *p += share * other;
        }
        self.p_none += share * other.p_none;
    }

    /// Of nothing: what mixtures begin with.
    pub fn nothing(regions: usize) -> Self {
        Self { p: vec![0.0; regions], p_none: 0.0 }
    }

    /// So that they sum to one.
    #[must_use]
    pub fn normalised(mut self) -> Self {
        let sum = self.p.iter().sum::<f64>() + self.p_none;
        if sum > 0.0 {
            self.p.iter_mut().for_each(|p| *p /= sum);
            self.p_none /= sum;
        } else {
            self.p_none = 1.0;
        }
        self
    }
}
