//! Figures of a tour over its seeds: what is printed, and what `--json` writes.

use super::answers::right;
use super::spread::{Bad, Claim, median};
use super::{Answers, Calibration, Moment, Outcome, Share, Spread};
use serde::Serialize;
use std::collections::BTreeMap;

/// Below this a mass counts as this in its logarithm.
const MASS_MIN: f64 = 1e-3;
/// Where a reference gives the truth less in the end, nobody could know.
const DECIDABLE: f64 = 0.9;

/// Between these a reference's best hypothesis leaves the question open.
const OPEN: std::ops::RangeInclusive<f64> = 0.3..=0.8;

/// Which runs were scored.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Setting {
    /// Name of the tour.
    pub tour: String,
    /// What people said.
    pub language: String,
    /// By whose rules it was taken in.
    pub preset: String,
    /// Particles; none where somebody else mapped.
    pub particles: Option<u32>,
}

/// All figures; keys are told in tests/README.md.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Summary {
    #[serde(flatten)]
    pub setting: Setting,
    pub seeds: usize,
    #[serde(flatten)]
    pub masses: Masses,
    pub mass_by_hypothesis: BTreeMap<String, Group>,
    pub mass_of_none: Option<Spread>,
    pub loop_precision: Option<f64>,
    pub loop_recall: Option<f64>,
    pub top_particles_all_true: Option<f64>,
    pub ate_rmse_m: Option<Spread>,
    pub label_accuracy: Rate,
    pub answers_right: Rate,
    #[serde(flatten)]
    pub answers: Answers,
    pub calibration: Option<Calibration>,
    pub calibration_below_95: Option<Calibration>,
    pub assured_wrong: AssuredWrong,
    pub unresolved: f64,
    pub unresolved_told: bool,
    pub graphs_alive: Option<Alive>,
    pub cpu_ms_per_s: Option<f64>,
    pub total_variation: BTreeMap<&'static str, Option<f64>>,
    pub by_truth: BTreeMap<String, Group>,
    pub undecidable: Option<Undecidable>,
    pub reference: Option<Masses>,
    pub reference_open: BTreeMap<&'static str, Option<f64>>,
    pub runs: Vec<Run>,
}

/// Mass on the true graphs, as the tour goes on.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Masses {
    pub mass_true_topology: Option<Spread>,
    pub mass_at_25: Option<Spread>,
    pub mass_at_50: Option<Spread>,
    pub mass_at_75: Option<Spread>,
    pub neg_log_mass: Option<NegLog>,
}

/// −ln of the mass at the end.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct NegLog {
    #[serde(flatten)]
    pub spread: Spread,
    pub mean: f64,
}

/// Seeds with something in common.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Group {
    pub seeds: usize,
    pub median: f64,
}

/// Right ones over all seeds together.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Rate {
    pub right: usize,
    pub of: usize,
    pub share: Option<f64>,
}

/// Share of moments at which a graph that is not the truth's is all but sure.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct AssuredWrong {
    pub checkpoints: Option<f64>,
    pub places: Option<f64>,
}

/// Distinct graphs over all seeds and places.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Alive {
    pub median: f64,
    pub max: usize,
}

/// Seeds whose truth nobody could know.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Undecidable {
    pub count: usize,
    pub seeds: Vec<u64>,
}

/// One seed.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Run {
    pub seed: u64,
    pub truth: String,
    /// By checkpoint.
    pub mass_true: Vec<Option<f64>>,
    /// At the end: weight of the best graph and whether it is of the truth.
    pub best: Option<Claim>,
    pub reference: Option<Vec<f64>>,
}

impl Summary {
    /// Of the outcomes of a tour in one language.
    pub fn new(setting: Setting, outcomes: &[Outcome]) -> Self {
        let each = |f: fn(&Outcome) -> Option<f64>| outcomes.iter().filter_map(f).collect::<Vec<f64>>();
        let claims = claims(outcomes);
        let none = each(|o| o.end().map(super::Checkpoint::mass_of_none));
        let unresolved = median(&each(|o| o.unresolved));
        Self {
            setting,
            seeds: outcomes.len(),
            masses: Masses::of(outcomes, Outcome::mass_true),
            mass_by_hypothesis: by_hypothesis(outcomes),
            mass_of_none: Spread::of(&none, Bad::High),
            loop_precision: median(&each(|o| o.end()?.edges.value())),
            loop_recall: median(&each(|o| o.end()?.loops.value())),
            top_particles_all_true: median(&each(|o| Some(o.end()?.top_all_true as f64))),
            ate_rmse_m: Spread::of(&each(|o| o.ate_rmse_m), Bad::High),
            label_accuracy: Rate::of(outcomes, |o| o.labels),
            answers_right: Rate::of(outcomes, |o| right(&o.answers)),
            answers: Answers::of(outcomes),
            calibration: Calibration::of(&claims),
            calibration_below_95: Calibration::of_unsure(&claims),
            assured_wrong: AssuredWrong::of(outcomes, &claims),
            unresolved: unresolved.unwrap_or(0.0),
            unresolved_told: unresolved.is_some(),
            graphs_alive: Alive::of(outcomes),
            cpu_ms_per_s: median(&each(|o| o.cpu_ms_per_s)),
            total_variation: total_variation(outcomes),
            by_truth: by_truth(outcomes),
            undecidable: Undecidable::of(outcomes),
            reference: outcomes
                .iter()
                .any(|o| o.reference.is_some())
                .then(|| Masses::of(outcomes, |o, k| o.reference.as_ref()?.mass_true.get(k).copied())),
            reference_open: reference_open(outcomes),
            runs: outcomes.iter().map(Run::of).collect(),
        }
    }
}

impl Masses {
    fn of(outcomes: &[Outcome], mass: impl Fn(&Outcome, usize) -> Option<f64>) -> Self {
        let at = |k: usize| outcomes.iter().filter_map(|o| mass(o, k)).collect::<Vec<f64>>();
        let spread = |k: usize| Spread::of(&at(k), Bad::Low);
        let neg_log: Vec<f64> = at(3).iter().map(|m| 0.0 - m.max(MASS_MIN).ln()).collect();
        Self {
            mass_true_topology: spread(3),
            mass_at_25: spread(0),
            mass_at_50: spread(1),
            mass_at_75: spread(2),
            neg_log_mass: Spread::of(&neg_log, Bad::High)
                .map(|spread| NegLog { spread, mean: neg_log.iter().sum::<f64>() / neg_log.len() as f64 }),
        }
    }
}

impl Rate {
    pub fn of(outcomes: &[Outcome], share: impl Fn(&Outcome) -> Share) -> Self {
        let sum = outcomes
            .iter()
            .map(share)
            .fold(Share::default(), |a, b| Share { right: a.right + b.right, of: a.of + b.of });
        Self { right: sum.right, of: sum.of, share: sum.value() }
    }
}

impl AssuredWrong {
    fn of(outcomes: &[Outcome], claims: &[Vec<Claim>]) -> Self {
        let moment = |(weight, of_truth): &Claim| Moment { alive: 0, weight: *weight, of_truth: *of_truth };
        let share = |moments: &mut dyn Iterator<Item = Moment>| {
            Share::count(moments.map(|m| m.is_assured_wrong())).value()
        };
        Self {
            checkpoints: share(&mut claims.iter().flatten().map(moment)),
            places: share(&mut outcomes.iter().flat_map(|o| o.moments.iter().copied())),
        }
    }
}

impl Alive {
    fn of(outcomes: &[Outcome]) -> Option<Self> {
        let alive: Vec<f64> = outcomes.iter().flat_map(|o| &o.moments).map(|m| m.alive as f64).collect();
        let max = outcomes.iter().flat_map(|o| &o.moments).map(|m| m.alive).max()?;
        Some(Self { median: median(&alive)?, max })
    }
}

impl Undecidable {
    /// None where there is no reference.
    fn of(outcomes: &[Outcome]) -> Option<Self> {
        let end = |o: &Outcome| Some((o.seed, *o.reference.as_ref()?.mass_true.last()?));
        let told: Vec<(u64, f64)> = outcomes.iter().filter_map(end).collect();
        let seeds: Vec<u64> = told.iter().filter(|t| t.1 < DECIDABLE).map(|t| t.0).collect();
        (!told.is_empty()).then_some(Self { count: seeds.len(), seeds })
    }
}

impl Run {
    fn of(outcome: &Outcome) -> Self {
        Self {
            seed: outcome.seed,
            truth: outcome.hypotheses.first().cloned().unwrap_or_default(),
            mass_true: (0..outcome.checkpoints.len()).map(|k| outcome.mass_true(k)).collect(),
            best: outcome.end().and_then(super::Checkpoint::best),
            reference: outcome.reference.as_ref().map(|r| r.mass_true.clone()),
        }
    }
}

/// The best graph's weight and whether it is of the truth, per seed and checkpoint.
fn claims(outcomes: &[Outcome]) -> Vec<Vec<Claim>> {
    let of = |o: &Outcome| o.checkpoints.iter().flatten().filter_map(super::Checkpoint::best).collect();
    outcomes.iter().map(of).collect()
}

fn total_variation(outcomes: &[Outcome]) -> BTreeMap<&'static str, Option<f64>> {
    at_checkpoints(|k| {
        let apart = |o: &Outcome| {
            let reference = o.reference.as_ref()?.mass.get(k)?;
            Some(o.checkpoints.get(k)?.as_ref()?.total_variation(reference))
        };
        median(&outcomes.iter().filter_map(apart).collect::<Vec<f64>>())
    })
}

/// Share of the seeds in which the reference leaves open which hypothesis it is.
fn reference_open(outcomes: &[Outcome]) -> BTreeMap<&'static str, Option<f64>> {
    at_checkpoints(|k| {
        let best = |o: &Outcome| o.reference.as_ref()?.mass.get(k)?.iter().copied().reduce(f64::max);
        Share::count(outcomes.iter().filter_map(best).map(|best| OPEN.contains(&best))).value()
    })
}

fn at_checkpoints(value: impl Fn(usize) -> Option<f64>) -> BTreeMap<&'static str, Option<f64>> {
    ["at_25", "at_50", "at_75", "at_end"].into_iter().enumerate().map(|(k, key)| (key, value(k))).collect()
}

/// Mass at the end of each hypothesis, by its name.
fn by_hypothesis(outcomes: &[Outcome]) -> BTreeMap<String, Group> {
    let masses = outcomes.iter().flat_map(|o| {
        let mass = o.end().map(super::Checkpoint::mass).unwrap_or_default();
        o.hypotheses.iter().cloned().zip(mass)
    });
    grouped(masses)
}

/// Mass at the end of the truth, by its name.
fn by_truth(outcomes: &[Outcome]) -> BTreeMap<String, Group> {
    let mass = |o: &Outcome| Some((o.hypotheses.first()?.clone(), o.end()?.mass_true()));
    grouped(outcomes.iter().filter_map(mass))
}

fn grouped(values: impl Iterator<Item = (String, f64)>) -> BTreeMap<String, Group> {
    let mut groups: BTreeMap<String, Vec<f64>> = BTreeMap::new();
    for (name, value) in values {
        groups.entry(name).or_default().push(value);
    }
    let group = |values: &[f64]| median(values).map(|median| Group { seeds: values.len(), median });
    groups.into_iter().filter_map(|(name, values)| Some((name, group(&values)?))).collect()
}

#[cfg(test)]
mod tests {
    use super::super::{Checkpoint, Reference};
    use super::*;

    /// A seed whose graphs put `mass` on the truth at the end, and all of it before.
    fn outcome(seed: u64, mass: f64, reference: f64) -> Outcome {
        let at = |mass: f64| {
            let graphs = vec![(mass, vec![true, false]), (1.0 - mass, vec![false, true])];
            Some(Checkpoint { graphs, loops: Share { right: 1, of: 2 }, ..Checkpoint::default() })
        };
        let moment = |alive, of_truth| Moment { alive, weight: 1.0, of_truth };
        let rows = |end: f64| vec![vec![1.0, 0.0], vec![1.0, 0.0], vec![1.0, 0.0], vec![end, 1.0 - end]];
        Outcome {
            seed,
            hypotheses: vec![if seed < 3 { "left" } else { "right" }.into(), "other".into()],
            checkpoints: vec![at(1.0), at(1.0), None, at(mass)],
            moments: vec![moment(1, true), moment(3, seed != 1)],
            ate_rmse_m: Some(seed as f64),
            labels: Share { right: 1, of: 2 },
            answers: Vec::new(),
            unresolved: None,
            cpu_ms_per_s: None,
            reference: Some(Reference { mass: rows(reference), mass_true: vec![1.0, 1.0, 1.0, reference] }),
        }
    }

    fn summary() -> Summary {
        let outcomes = [outcome(1, 0.0, 0.95), outcome(2, 0.5, 0.6), outcome(3, 1.0, 0.99)];
        Summary::new(Setting { tour: "t".into(), ..Setting::default() }, &outcomes)
    }

    #[test]
    fn masses_are_told_by_checkpoint_and_a_mass_of_nothing_has_a_finite_logarithm() {
        let summary = summary();
        let end = summary.masses.mass_true_topology.unwrap();
        assert!((end.median - 0.5).abs() < 1e-12 && (end.worst_decile - 0.1).abs() < 1e-12);
        assert_eq!(summary.masses.mass_at_75, None);
        let neg_log = summary.masses.neg_log_mass.unwrap();
        let values = [(1e3_f64).ln(), (2.0_f64).ln(), 0.0];
        assert!((neg_log.mean - values.iter().sum::<f64>() / 3.0).abs() < 1e-12);
        assert!((neg_log.spread.median - values[1]).abs() < 1e-12);
        assert!(neg_log.spread.worst_decile > values[1], "for a loss, large is bad");
        let reference = summary.reference.unwrap().mass_true_topology.unwrap();
        assert!((reference.median - 0.95).abs() < 1e-12);
    }

    #[test]
    fn seeds_are_grouped_by_what_was_true() {
        let summary = summary();
        assert_eq!(summary.by_truth["left"], Group { seeds: 2, median: 0.25 });
        assert_eq!(summary.by_truth["right"], Group { seeds: 1, median: 1.0 });
        assert_eq!(summary.mass_by_hypothesis["other"], Group { seeds: 3, median: 0.5 });
    }

    #[test]
    fn a_reference_that_gives_its_best_little_leaves_it_open() {
        let open = summary().reference_open;
        assert_eq!((open["at_75"], open["at_end"]), (Some(0.0), Some(1.0 / 3.0)));
    }

    #[test]
    fn seeds_that_nobody_could_know_are_listed() {
        assert_eq!(summary().undecidable, Some(Undecidable { count: 1, seeds: vec![2] }));
        let bare = Outcome { reference: None, ..outcome(1, 1.0, 1.0) };
        let summary = Summary::new(Setting::default(), &[bare]);
        assert_eq!((summary.undecidable, summary.reference), (None, None));
        assert_eq!((summary.total_variation["at_end"], summary.reference_open["at_end"]), (None, None));
    }

    #[test]
    fn shares_are_over_all_seeds_and_moments_over_all_places() {
        let summary = summary();
        assert_eq!(summary.label_accuracy, Rate { right: 3, of: 6, share: Some(0.5) });
        assert_eq!(summary.graphs_alive, Some(Alive { median: 2.0, max: 3 }));
        assert_eq!(summary.assured_wrong.places, Some(1.0 / 6.0));
        assert_eq!(summary.assured_wrong.checkpoints, Some(0.0));
        assert_eq!((summary.loop_precision, summary.loop_recall), (None, Some(0.5)));
        assert!((summary.total_variation["at_end"].unwrap() - 0.1).abs() < 1e-12);
    }

    #[test]
    fn keys_are_flat() {
        let json = serde_json::to_value(summary()).unwrap();
        assert_eq!((&json["tour"], &json["seeds"]), (&"t".into(), &3.into()));
        assert_eq!(json["mass_true_topology"]["median"], 0.5);
        assert!(json["neg_log_mass"]["worst_decile"].is_f64() && json["neg_log_mass"]["mean"].is_f64());
        assert_eq!(json["runs"][2]["truth"], "right");
    }
}
