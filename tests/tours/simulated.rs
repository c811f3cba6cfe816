//! Tours of the simulator.

use crate::tour::{Spoken, Tour, outright};
use crate::truth::{Hypothesis, Named, Path, Piece, Question};
use anyhow::Result;
use toponym_core::Pose2;
use toponym_proto::Pose;
use toponym_sim::tours::{self, Language, Played, Said};

/// Time between two rows of the true path.
const ROW_S: f64 = 0.1;

/// Their names.
pub fn names() -> &'static [&'static str] {
    tours::TOURS
}

/// Plays one.
pub fn tour(name: &str, seed: u64, languages: &[Language]) -> Result<Tour> {
    let tour = tours::tour(name, seed)?;
    let played = tour.play()?;
    let hypotheses: Vec<Hypothesis> = tour.hypotheses.iter().map(hypothesis).collect();
    let spoken = languages.iter().filter_map(|&language| {
        let mut spoken = spoken(&played, language)?;
        spoken.reference = reference(&tour, &played, language);
        Some((language, spoken))
    });
    Ok(Tour {
        seed,
        robot: tour.scenario.robot.clone(),
        path: path(&played),
        hypotheses,
        dark_s: tour.blind_s.clone(),
        spoken: spoken.collect(),
        stream: played.stream,
    })
}

/// A pose of the simulator's.
pub fn pose(p: &Pose) -> Pose2 {
    Pose2::new(p.x_m, p.y_m, p.yaw_rad)
}

fn path(played: &Played) -> Path {
    let rows = (played.drive.duration_s() / ROW_S) as usize;
    let times = (0..=rows).map(|k| k as f64 * ROW_S);
    Path::new(times.map(|t_s| (t_s, pose(&played.drive.at(t_s)))).collect())
}

fn hypothesis(h: &tours::Hypothesis) -> Hypothesis {
    let piece = |p: &tours::Piece| Piece { from_s: p.from_s, world_from_true: pose(&p.world_from_true) };
    Hypothesis { name: h.name.clone(), pieces: h.pieces.iter().map(piece).collect() }
}

fn spoken(played: &Played, language: Language) -> Option<Spoken> {
    let said = played.narration.get(&language)?.clone();
    let asked = played.questions.get(&language).into_iter().flatten();
    let questions = asked.map(|(text, rooms)| Question { text: text.clone(), rooms: rooms.clone() });
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

/// What an observer who knows the building may believe: by checkpoint and hypothesis.
fn reference(_tour: &tours::Tour, _played: &Played, _language: Language) -> Option<Vec<Vec<f64>>> {
    None
}

#[cfg(test)]
mod tests {
    use super::*;
    use toponym_sim::Sentence;
    use toponym_sim::tours::Claim;

    fn said(text: &str, held: bool) -> Said {
        let sentence = Sentence { began_s: 3.0, ended_s: 4.0, text: text.into() };
        Said { sentence, claim: Some(Claim { name: "gym".into(), at: [0.0, 0.0], held }) }
    }

    #[test]
    fn only_what_is_said_outright_and_truly_is_a_name() {
        let expected = Named { t_s: 3.0, name: "gym".into() };
        assert_eq!(named(&said("This is the gym.", true)), Some(expected));
        assert_eq!(named(&said("This is the gym.", false)), None);
        assert_eq!(named(&said("The gym is down the hallway.", true)), None);
    }
}
