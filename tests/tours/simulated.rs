//! Tours of the simulator.

use crate::tour::{Spoken, Tour, outright};
use crate::truth::{Hypothesis, Named, Path, Piece, Question, Truth};
use anyhow::Result;
use toponym_core::Pose2;
use toponym_core::language::{is_of_kind, misheard, synonyms};
use toponym_proto::Pose;
use toponym_sim::STEP_S;
use toponym_sim::reference::{Seen, Stretch, posterior};
use toponym_sim::tours::{self, Asked, Language, Played, Said, Told};

/// Time between two rows of the true path.
const ROW_S: f64 = 0.1;
/// Of each laser, the reference looks at a scan in so much time.
const STRIDE_S: f64 = 1.0;
/// Share of false sentences in [`Language::False20`].
const FALSE_SHARE: f64 = 0.2;

/// Their names.
pub fn names() -> &'static [&'static str] {
    tours::TOURS
}

/// Plays one.
pub fn tour(name: &str, seed: u64, languages: &[Language]) -> Result<Tour> {
    played(&tours::tour(name, seed)?, languages)
}

/// Plays one that was made.
pub fn played(tour: &tours::Tour, languages: &[Language]) -> Result<Tour> {
    let played = tour.play()?;
    let path = path(&played, tour.second_day_s);
    let checkpoints_s = Truth::checkpoints_s(path.span_s());
    let hypotheses: Vec<Hypothesis> = tour.hypotheses.iter().map(hypothesis).collect();
    let spoken = languages.iter().filter_map(|&language| {
        let spoken = spoken(&played, language)?;
        let reference = reference(tour, &played, language, &checkpoints_s);
        Some(reference.map(|mass| (language, Spoken { reference: Some(mass), ..spoken })))
    });
    let spoken = spoken.collect::<Result<_>>()?;
    Ok(Tour {
        seed: tour.seed,
        robot: tour.scenario.robot.clone(),
        path,
        hypotheses,
        dark_s: tour.blind_s.clone(),
        spoken,
        stream: played.stream,
    })
}

/// A pose of the simulator's.
pub fn pose(p: &Pose) -> Pose2 {
    Pose2::new(p.x_m, p.y_m, p.yaw_rad)
}

fn path(played: &Played, second_day_s: Option<f64>) -> Path {
    let rows = (played.drive.duration_s() / ROW_S) as usize;
    let mut times: Vec<f64> = (0..=rows).map(|k| k as f64 * ROW_S).collect();
    // Overnight it was carried: no pose between the two days may be made up.
    times.extend(second_day_s.into_iter().flat_map(|s| [s - STEP_S, s]));
    times.sort_by(f64::total_cmp);
    Path::new(times.into_iter().map(|t_s| (t_s, pose(&played.drive.at(t_s)))).collect())
}

fn hypothesis(h: &tours::Hypothesis) -> Hypothesis {
    let piece = |p: &tours::Piece| Piece { from_s: p.from_s, world_from_true: pose(&p.world_from_true) };
    Hypothesis { name: h.name.clone(), pieces: h.pieces.iter().map(piece).collect() }
}

fn spoken(played: &Played, language: Language) -> Option<Spoken> {
    let said = played.narration.get(&language)?.clone();
    let asked = played.questions.get(&language).into_iter().flatten();
    // What means the same as a name that was said is no name never said.
    let names: Vec<&str> = said.iter().filter_map(|s| Some(s.claim.as_ref()?.name.as_str())).collect();
    let means = |asked: &str, name: &&str| {
        synonyms(asked, name).max(misheard(asked, name)) > 0.0 || is_of_kind(name, asked)
    };
    let is_fair = |text: &str, asked: &Asked| {
        let name = text.rsplit_once("the ").map_or(text, |t| t.1);
        asked.told != Told::Never || !names.iter().any(|n| means(name, n))
    };
    let questions = asked.filter(|(text, asked)| is_fair(text, asked)).map(|(text, asked)| Question {
        text: text.clone(),
        rooms: asked.rooms.clone(),
        relations: if let Told::Related(relations) = asked.told { relations } else { 0 },
    });
    Some(Spoken {
        named: said.iter().filter_map(named).collect(),
        questions: questions.collect(),
        said,
        reference: None,
    })
}

/// A name that was said where it holds.
fn named(said: &Said) -> Option<Named> {
    outright(&said.sentence.text)?;
    let claim = said.claim.as_ref().filter(|c| c.held)?;
    Some(Named { t_s: said.sentence.began_s, name: claim.name.clone() })
}

/// What an observer who knows the building and the noise may believe: by checkpoint and hypothesis.
fn reference(
    tour: &tours::Tour,
    played: &Played,
    language: Language,
    checkpoints_s: &[f64],
) -> Result<Vec<Vec<f64>>> {
    if tour.hypotheses.len() < 2 {
        return Ok(vec![vec![1.0; tour.hypotheses.len()]; checkpoints_s.len()]);
    }
    let mut dark: Vec<Stretch> = tour.blind_s.iter().map(|&s| Stretch::dark(s)).collect();
    dark.extend(tour.second_day_s.map(Stretch::restart));
    dark.sort_by(|a, b| a.from_s.total_cmp(&b.from_s));
    let seen = Seen {
        world: &tour.scenario.world,
        drive: &played.drive,
        odometry: &played.odometry,
        prior: &tour.wheels_prior,
        dark: &dark,
        lasers: &tour.scenario.lasers,
        stream: &played.stream,
        stride_s: STRIDE_S,
        said: played.narration.get(&language).map_or(&[], Vec::as_slice),
        epsilon: if language == Language::False20 { FALSE_SHARE } else { 0.0 },
        vocabulary: tour.vocabulary.len(),
    };
    let at = posterior(&seen, &tour.hypotheses, &[], checkpoints_s)?;
    Ok(at.into_iter().map(|a| a.p).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use toponym_proto::merge::order_stamp;
    use toponym_proto::{Message, Stamp};
    use toponym_sim::Sentence;
    use toponym_sim::tours::Claim;

    fn said(text: &str, held: bool) -> Said {
        let sentence = Sentence { began_s: 3.0, ended_s: 4.0, text: text.into() };
        Said { sentence, claim: Some(Claim { name: "gym".into(), at: [0.0, 0.0], held, relations: 0 }) }
    }

    #[test]
    fn a_second_day_begins_where_the_robot_was_carried_and_is_told_of_in_order() {
        let tour = tour("start", 1, &[Language::Simple]).unwrap();
        let second_s = tours::tour("start", 1).unwrap().second_day_s.unwrap();
        let (before, after) = (tour.path.at(second_s - STEP_S), tour.path.at(second_s));
        assert!(before.distance_m(&after) > 2.0);
        assert!(after.distance_m(&tour.path.at(second_s + STEP_S)) < 0.1);
        assert!(tour.path.driven_m(second_s) - tour.path.driven_m(second_s - 1.0) < 2.0);
        let stamps: Vec<Stamp> =
            tour.case(Language::Simple).unwrap().messages.iter().map(order_stamp).collect();
        let say = |m: &Message| matches!(m, Message::Say(_));
        let messages = tour.case(Language::Simple).unwrap().messages;
        for k in (1..messages.len()).filter(|&k| say(&messages[k])) {
            assert!((stamps[k].seconds() - stamps[k - 1].seconds()).abs() < 1.0, "{:?}", messages[k]);
        }
    }

    #[test]
    fn only_what_is_said_outright_and_truly_is_a_name() {
        let expected = Named { t_s: 3.0, name: "gym".into() };
        assert_eq!(named(&said("This is the gym.", true)), Some(expected));
        assert_eq!(named(&said("This is the gym.", false)), None);
        assert_eq!(named(&said("The gym is down the hallway.", true)), None);
    }
}
