//! How questions were answered: in the right room, and as surely as it says.

use super::checkpoint::Share;
use super::spread::Claim;
use crate::graph::{Answer, Candidate};
use crate::truth::{Outline, Question};
use toponym_core::Pose2;
use toponym_sim::geom::{Area, Point};

/// An answer this near to a right room is right.
const NEAR_M: f64 = 3.0;
/// In a room is who is in it but for so much, by which maps err.
const IN_M: f64 = 0.3;
/// Below this a mass counts as this in its logarithm.
const MASS_MIN: f64 = 1e-3;

/// How one question was answered.
#[derive(Clone, Debug, PartialEq)]
pub struct Answered {
    /// By how many relations alone the name was told; 0: outright; none: never.
    pub relations: Option<usize>,
    /// The best candidate is in a right room or near it; of what was never said nothing is known.
    pub is_right: bool,
    /// The best candidate is in a right room.
    pub is_in: bool,
    /// Probability of the candidates in right rooms; of what was never said, that it is nowhere.
    pub mass: f64,
    /// Probabilities that the candidates are meant, and whether they are in a right room; those that are count as one, for
    /// where several rooms bear a name any of them is right.
    pub probability: Vec<Claim>,
    /// Of the best candidate.
    pub best: Option<Claim>,
    /// Of each candidate the probability that its name applies there.
    pub p_is: Vec<Claim>,
    /// That it is nowhere.
    pub p_none: Claim,
    /// (1 − mass)² and the squares of what wrong candidates have.
    pub brier: f64,
}

impl Answered {
    /// −ln of the mass.
    pub fn nll(&self) -> f64 {
        -self.mass.max(MASS_MIN).ln()
    }

    fn new(question: &Question, answer: &Answer, true_from_map: &Pose2) -> Self {
        let is_named = !question.rooms.is_empty();
        let away_m = |c: &Candidate| {
            let (x_m, y_m) = true_from_map.apply(c.at_m[0], c.at_m[1]);
            question.rooms.iter().map(|room| distance_m(room, [x_m, y_m])).fold(f64::INFINITY, f64::min)
        };
        let claims = |of: fn(&Candidate) -> f64| -> Vec<Claim> {
            answer.candidates.iter().map(|c| (of(c), away_m(c) <= IN_M)).collect()
        };
        let probability = claims(|c| c.probability);
        let in_rooms: f64 = probability.iter().filter(|c| c.1).map(|c| c.0).sum();
        let wrong: f64 = probability.iter().filter(|c| !c.1).map(|c| c.0 * c.0).sum();
        let mass = if is_named { in_rooms } else { answer.p_none };
        let none = if is_named { answer.p_none.powi(2) } else { 0.0 };
        let (best_m, best_p) = (answer.candidates.first().map(away_m), probability.first().copied());
        Self {
            relations: is_named.then_some(question.relations),
            is_right: if is_named { best_m.is_some_and(|m| m <= NEAR_M) } else { answer.p_none > 0.5 },
            is_in: if is_named { best_m.is_some_and(|m| m <= IN_M) } else { answer.p_none > 0.5 },
            mass,
            probability: probability
                .into_iter()
                .filter(|c| !c.1)
                .chain((in_rooms > 0.0).then_some((in_rooms, true)))
                .collect(),
            best: best_p,
            p_is: claims(|c| c.p_is),
            p_none: (answer.p_none, !is_named),
            brier: (1.0 - mass).powi(2) + wrong + none,
        }
    }
}

/// Each question's answer; one that was not answered is answered by not knowing.
pub fn answered(answers: &[Answer], questions: &[Question], true_from_map: &Pose2) -> Vec<Answered> {
    let nothing = Answer { question: String::new(), p_none: 1.0, candidates: Vec::new() };
    let of = |q: &Question| {
        let answer = answers.iter().find(|a| a.question == q.text).unwrap_or(&nothing);
        Answered::new(q, answer, true_from_map)
    };
    questions.iter().map(of).collect()
}

/// Those answered rightly.
pub fn right(answered: &[Answered]) -> Share {
    Share::count(answered.iter().map(|a| a.is_right))
}

/// How far a point is outside of an outline.
fn distance_m(corners: &Outline, p: Point) -> f64 {
    let area = Area { corners: corners.clone() };
    let to_edge_m = || area.edges().map(|e| e.distance_m(p)).fold(f64::INFINITY, f64::min);
    if area.contains(p, 0.0) { 0.0 } else { to_edge_m() }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn room() -> Outline {
        vec![[0.0, 0.0], [4.0, 0.0], [4.0, 2.0], [0.0, 2.0]]
    }

    fn candidate(at_m: [f64; 2], probability: f64) -> Candidate {
        Candidate { at_m, probability, p_is: probability }
    }

    #[test]
    fn an_outline_is_left_by_so_many_metres() {
        assert!(distance_m(&room(), [1.0, 1.0]).abs() < 1e-12);
        assert!((distance_m(&room(), [7.0, 1.0]) - 3.0).abs() < 1e-12);
        assert!((distance_m(&room(), [-3.0, 6.0]) - 5.0).abs() < 1e-12);
    }

    #[test]
    fn an_answer_is_right_in_a_right_room_and_unsure_of_what_was_never_said() {
        let question = |text: &str, rooms| Question { text: text.into(), rooms, relations: 0 };
        let questions =
            [question("gym", vec![room()]), question("pool", vec![]), question("hall", vec![room()])];
        // The map lies 10 m to the left of the truth.
        let right_of = Pose2::new(10.0, 0.0, 0.0);
        let score = |gym_m: Option<[f64; 2]>, pool| {
            let answer = |question: &str, p_none, at_m: Option<[f64; 2]>| Answer {
                question: question.into(),
                p_none,
                candidates: at_m.into_iter().map(|at_m| candidate(at_m, 1.0 - p_none)).collect(),
            };
            let said = [answer("gym", 0.1, gym_m), answer("pool", pool, Some([0.0, 0.0]))];
            right(&answered(&said, &questions, &right_of))
        };
        assert_eq!(score(Some([-3.1, 1.0]), 0.6).right, 2, "2.9 m beyond the wall");
        assert_eq!(score(Some([-2.9, 1.0]), 0.6).right, 1);
        assert_eq!(score(None, 0.4), Share { right: 0, of: 3 }, "not answered is wrong");
    }

    #[test]
    fn mass_is_that_of_right_rooms_and_what_is_wrong_costs() {
        let question = Question { text: "gym".into(), rooms: vec![room()], relations: 2 };
        let candidates =
            vec![candidate([1.0, 1.0], 0.5), candidate([9.0, 1.0], 0.2), candidate([3.0, 1.0], 0.1)];
        let answer = Answer { question: "gym".into(), p_none: 0.2, candidates };
        let a = &answered(&[answer], &[question], &Pose2::default())[0];
        assert_eq!((a.relations, a.is_in, a.p_none), (Some(2), true, (0.2, false)));
        assert!((a.mass - 0.6).abs() < 1e-12 && (a.nll() + 0.6_f64.ln()).abs() < 1e-12);
        assert!((a.brier - (0.16 + 0.04 + 0.04)).abs() < 1e-12);
        assert_eq!((a.best, a.probability[0]), (Some((0.5, true)), (0.2, false)));
        assert!((a.probability[1].0 - 0.6).abs() < 1e-12 && a.probability[1].1);
    }
}
