//! From a run and the truth to figures.

mod answers;
mod assurance;
mod checkpoint;
mod metric;
mod spread;
mod summary;
mod topology;

pub use answers::Answered;
pub use assurance::Answers;
pub use checkpoint::{Checkpoint, Share};
pub use spread::{Calibration, Spread};
pub use summary::{Masses, NegLog, Rate, Setting, Summary};

use crate::graph::{Answer, Graphs};
use crate::truth::Truth;
use toponym_core::Pose2;

/// A best graph of at least this weight claims to be sure.
const ASSURED: f64 = 0.99;

/// What a run left behind, whoever ran it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Mapped {
    /// The graphs at the truth's checkpoints, the last at the end; those not looked at are none.
    pub checkpoints: Vec<Option<Graphs>>,
    /// The graphs as each place began; at least at the end.
    pub moments: Vec<Moment>,
    /// Stamps and poses of the robot in the best graph's map, at the end.
    pub trajectory: Vec<(f64, Pose2)>,
    /// What was answered at the end.
    pub answers: Vec<Answer>,
    /// Posterior mass of graphs that were dropped, at the end, if the mapper tells of it.
    pub unresolved: Option<f64>,
    /// Processor time per second of tour, if known.
    pub cpu_ms_per_s: Option<f64>,
}

/// The graphs at one moment, in short.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Moment {
    /// Distinct graphs.
    pub alive: usize,
    /// Weight of the best one.
    pub weight: f64,
    /// Whether it is of the truth.
    pub of_truth: bool,
}

impl Moment {
    /// Of graphs as they are now; none of no graph.
    pub fn of(graphs: &Graphs, truth: &Truth) -> Option<Self> {
        let (best, hypothesis) = (graphs.particles.first()?, truth.hypotheses.first()?);
        let layout = topology::Layout::new(hypothesis, truth, &graphs.stamps_s());
        Some(Self { alive: graphs.particles.len(), weight: best.weight, of_truth: layout.is_of(best) })
    }

    /// Whether it claims to be sure of what is not so.
    pub fn is_assured_wrong(&self) -> bool {
        self.weight >= ASSURED && !self.of_truth
    }
}

/// A scored run of one seed.
#[derive(Clone, Debug, PartialEq)]
pub struct Outcome {
    /// The tour's seed, and the filter's.
    pub seed: u64,
    /// Names of the hypotheses; the first is the truth.
    pub hypotheses: Vec<String>,
    /// At the checkpoints looked at.
    pub checkpoints: Vec<Option<Checkpoint>>,
    /// As each place began.
    pub moments: Vec<Moment>,
    /// Error of the best graph's trajectory after rigid alignment.
    pub ate_rmse_m: Option<f64>,
    /// Names said outright that are at their place.
    pub labels: Share,
    /// How questions were answered.
    pub answers: Vec<Answered>,
    /// Posterior mass of graphs that were dropped, if told.
    pub unresolved: Option<f64>,
    /// Processor time per second of tour, if known.
    pub cpu_ms_per_s: Option<f64>,
    /// What a reference makes of it.
    pub reference: Option<Reference>,
}

/// The masses that a reference gives the hypotheses.
#[derive(Clone, Debug, PartialEq)]
pub struct Reference {
    /// By checkpoint, by hypothesis.
    pub mass: Vec<Vec<f64>>,
    /// By checkpoint, of all hypotheses that ask for no other graph than the truth until then.
    pub mass_true: Vec<f64>,
}

impl Reference {
    /// Of masses by checkpoint and hypothesis.
    pub fn new(mass: Vec<Vec<f64>>, truth: &Truth) -> Self {
        let so_far = |t_s: f64, row: &Vec<f64>| {
            let same = truth.hypotheses.iter().map(|h| topology::is_as_true(h, truth, t_s));
            row.iter().zip(same).filter(|(_, same)| *same).map(|(m, _)| m).sum()
        };
        let mass_true = truth.checkpoints_s.iter().zip(&mass).map(|(t_s, row)| so_far(*t_s, row)).collect();
        Self { mass, mass_true }
    }
}

impl Outcome {
    /// Scores a run.
    pub fn new(seed: u64, truth: &Truth, mapped: &Mapped, reference: Option<Vec<Vec<f64>>>) -> Self {
        let laid = metric::lay(&mapped.trajectory, &truth.path);
        let end = mapped.checkpoints.last().and_then(Option::as_ref);
        let score = |graphs: &Option<Graphs>| graphs.as_ref().map(|g| Checkpoint::new(g, truth));
        Self {
            seed,
            hypotheses: truth.hypotheses.iter().map(|h| h.name.clone()).collect(),
            checkpoints: mapped.checkpoints.iter().map(score).collect(),
            moments: mapped.moments.clone(),
            ate_rmse_m: laid.map(|l| l.rmse_m),
            labels: end.map_or(Share::default(), |graphs| metric::labels(graphs, truth)),
            answers: laid.map_or(Vec::new(), |l| {
                answers::answered(&mapped.answers, &truth.questions, &l.true_from_map)
            }),
            unresolved: mapped.unresolved,
            cpu_ms_per_s: mapped.cpu_ms_per_s,
            reference: reference.map(|mass| Reference::new(mass, truth)),
        }
    }

    /// The graphs at the end.
    pub fn end(&self) -> Option<&Checkpoint> {
        self.checkpoints.last().and_then(Option::as_ref)
    }

    /// Weight of the true graphs at a checkpoint.
    pub fn mass_true(&self, checkpoint: usize) -> Option<f64> {
        self.checkpoints.get(checkpoint)?.as_ref().map(Checkpoint::mass_true)
    }
}

#[cfg(test)]
mod tests {
    use super::topology::tests::{elsewhere, map_of, out_and_back, stamps};
    use super::*;
    use crate::graph::Place;
    use crate::truth::{Hypothesis, Piece};

    fn truth() -> Truth {
        let hypotheses = vec![Hypothesis::truth("here"), elsewhere()];
        let checkpoints_s = Truth::checkpoints_s((0.0, 60.0));
        Truth { path: out_and_back(), hypotheses, checkpoints_s, ..Truth::default() }
    }

    #[test]
    fn only_a_sure_graph_that_is_not_the_truths_is_assured_wrong() {
        let moment = |hypothesis: &Hypothesis, weight| {
            let places = stamps(60).into_iter().map(|stamp_s| Place { stamp_s, name: None }).collect();
            let best = crate::graph::Particle { weight, ..map_of(hypothesis, 60) };
            Moment::of(&Graphs { places, particles: vec![best] }, &truth()).unwrap()
        };
        assert!(moment(&elsewhere(), 0.99).is_assured_wrong());
        assert!(!moment(&elsewhere(), 0.98).is_assured_wrong());
        assert!(!moment(&Hypothesis::truth("here"), 1.0).is_assured_wrong());
    }

    #[test]
    fn a_references_mass_on_the_truth_is_that_of_all_who_ask_for_the_same_graph() {
        let rows = vec![vec![0.5, 0.5], vec![0.4, 0.6], vec![0.3, 0.7], vec![0.9, 0.1]];
        let mass_true = Reference::new(rows.clone(), &truth()).mass_true;
        // The ways part at 31 s, but only at the end is there a loop that one of them asks for.
        assert_eq!(mass_true, [1.0, 1.0, 1.0, 0.9]);
        // To whom both have gone somewhere new, it is the same graph.
        let moved = |name: &str, y_m| {
            let world_from_true = toponym_core::Pose2::new(0.0, y_m, 0.0);
            Hypothesis { name: name.into(), pieces: vec![Piece { from_s: 31.0, world_from_true }] }
        };
        let new = Truth { hypotheses: vec![moved("here", 50.0), moved("there", 90.0)], ..truth() };
        assert_eq!(Reference::new(rows, &new).mass_true, [1.0; 4]);
    }
}
