//! Figures of how questions are answered: in which rooms, and whether probabilities mean what they say.

use super::answers::Answered;
use super::checkpoint::Share;
use super::spread::{Bad, Claim, median};
use super::summary::Rate;
use super::{Calibration, Outcome, Spread};
use serde::Serialize;
use std::collections::BTreeMap;

/// Whoever says of something that it is nowhere, or somewhere, more likely than not.
const LIKELIER: f64 = 0.5;

/// Over all seeds.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Answers {
    /// By how the name was told: `outright`, `one relation`, `two relations`, `never`.
    #[serde(rename = "answers_by")]
    pub by_telling: BTreeMap<&'static str, By>,
    /// −ln of the mass that answers give what is right, mean by seed.
    pub nll: Option<Spread>,
    /// Squared error of the probabilities, mean by seed.
    pub brier: Option<Spread>,
    /// Calibration error of `probability`.
    pub ece: Option<f64>,
    /// The same of each probability told, whole.
    pub ece_of: BTreeMap<&'static str, Calibration>,
    /// Share of the best candidates that are right, among those of at least that probability.
    pub right_from: BTreeMap<&'static str, Rate>,
}

/// Of the names told in one way.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct By {
    /// Best candidates in a right room; of names never told p_none > 0.5.
    pub right: Rate,
    /// Median mass on what is right.
    pub mass: Option<f64>,
    /// p_none on the right side of 0.5.
    pub found: Rate,
}

impl Answers {
    /// Of answers to what was asked of each seed.
    pub fn of(outcomes: &[Outcome]) -> Self {
        let mut ways: BTreeMap<&'static str, Vec<&Answered>> = BTreeMap::new();
        for answered in outcomes.iter().flat_map(|o| &o.answers) {
            ways.entry(way(answered.relations)).or_default().push(answered);
        }
        let by_seed = |of: fn(&Answered) -> f64| -> Vec<f64> {
            let asked = outcomes.iter().map(|o| &o.answers).filter(|a| !a.is_empty());
            asked.map(|a| a.iter().map(of).sum::<f64>() / a.len() as f64).collect()
        };
        let claims = |of: fn(&Answered) -> Vec<Claim>| {
            let of_seed = |o: &Outcome| o.answers.iter().flat_map(of).collect();
            Calibration::of(&outcomes.iter().map(of_seed).collect::<Vec<Vec<Claim>>>())
        };
        let kinds: [(&'static str, Option<Calibration>); 3] = [
            ("probability", claims(|a| a.probability.clone())),
            ("p_is", claims(|a| a.p_is.clone())),
            ("p_none", claims(|a| vec![a.p_none])),
        ];
        let ece_of: BTreeMap<_, _> = kinds.into_iter().filter_map(|(kind, c)| Some((kind, c?))).collect();
        let from = [("0.5", 0.5), ("0.8", 0.8), ("0.9", 0.9), ("0.95", 0.95)];
        let right_from = |least: f64| {
            let best = |a: &Answered| a.best.filter(|c| c.0 >= least);
            Rate::of(outcomes, |o| Share::count(o.answers.iter().filter_map(best).map(|c| c.1)))
        };
        Self {
            by_telling: ways.into_iter().map(|(way, of)| (way, By::of(&of))).collect(),
            nll: Spread::of(&by_seed(Answered::nll), Bad::High),
            brier: Spread::of(&by_seed(|a| a.brier), Bad::High),
            ece: ece_of.get("probability").map(|c| c.ece),
            ece_of,
            right_from: from.map(|(name, least)| (name, right_from(least))).into(),
        }
    }
}

fn way(relations: Option<usize>) -> &'static str {
    match relations {
        None => "never",
        Some(0) => "outright",
        Some(1) => "one relation",
        Some(_) => "two relations",
    }
}

impl By {
    fn of(answered: &[&Answered]) -> Self {
        let share = |is: fn(&Answered) -> bool| {
            let share = Share::count(answered.iter().map(|a| is(a)));
            Rate { right: share.right, of: share.of, share: share.value() }
        };
        Self {
            right: share(|a| a.is_in),
            mass: median(&answered.iter().map(|a| a.mass).collect::<Vec<f64>>()),
            found: share(|a| (a.p_none.0 > LIKELIER) == a.p_none.1),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::graph::{Answer, Candidate};
    use crate::score::{Mapped, answers::answered};
    use crate::truth::{Question, Truth};
    use toponym_core::Pose2;

    #[test]
    fn answers_are_told_apart_by_how_names_were_told() {
        let room = vec![[0.0, 0.0], [4.0, 0.0], [4.0, 2.0], [0.0, 2.0]];
        let questions: Vec<Question> = [("gym", 0), ("cafe", 1), ("pool", 0)]
            .map(|(text, relations)| Question {
                text: text.into(),
                rooms: if text == "pool" { vec![] } else { vec![room.clone()] },
                relations,
            })
            .into();
        let answer = |text: &str, p: f64, x: f64| {
            let candidates = vec![Candidate { at_m: [x, 1.0], probability: p, p_is: p }];
            Answer { question: text.into(), p_none: 1.0 - p, candidates }
        };
        let told = [answer("gym", 0.95, 1.0), answer("cafe", 0.6, 9.0), answer("pool", 0.1, 9.0)];
        let mut outcome = Outcome::new(1, &Truth::default(), &Mapped::default(), None);
        outcome.answers = answered(&told, &questions, &Pose2::default());
        let all = Answers::of(&[outcome]);
        let right = |way: &str| (all.by_telling[way].right.right, all.by_telling[way].right.of);
        assert_eq!((right("outright"), right("one relation"), right("never")), ((1, 1), (0, 1), (1, 1)));
        assert_eq!(all.right_from["0.9"].share, Some(1.0));
        assert_eq!(all.right_from["0.5"].share, Some(0.5));
        let wanted = (0.05 + 0.6 + 0.1) / 3.0;
        assert!((all.ece.unwrap() - wanted).abs() < 1e-9, "{all:?}");
        let mean = |of: &dyn Fn(f64) -> f64| (of(0.95) + of(1e-3) + of(0.9)) / 3.0;
        assert!((all.nll.unwrap().median - mean(&|m| -m.ln())).abs() < 1e-9);
        assert!(all.by_telling["never"].found.share == Some(1.0));
    }
}
