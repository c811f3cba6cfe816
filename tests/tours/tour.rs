//! A tour of one seed in all its languages: played once, mapped in each.

use crate::run::Case;
use crate::truth::{Hypothesis, Named, Path, Question, Truth};
use std::collections::BTreeMap;
use toponym_proto::Message;
use toponym_sim::tours::{Language, Said, messages};

/// A tour that was played.
#[derive(Clone, Debug, Default)]
pub struct Tour {
    /// Its seed.
    pub seed: u64,
    /// Id of the robot.
    pub robot: String,
    /// What the robot sent.
    pub stream: Vec<Message>,
    /// Where it was.
    pub path: Path,
    /// What may be believed; the first is the truth.
    pub hypotheses: Vec<Hypothesis>,
    /// Stretches in which nothing is seen.
    pub dark_s: Vec<(f64, f64)>,
    /// By language.
    pub spoken: BTreeMap<Language, Spoken>,
}

/// A language's part of a tour.
#[derive(Clone, Debug, Default)]
pub struct Spoken {
    /// The sentences.
    pub said: Vec<Said>,
    /// Names said outright and truly.
    pub named: Vec<Named>,
    /// Asked at the end.
    pub questions: Vec<Question>,
    /// What a reference gives each hypothesis at each checkpoint.
    pub reference: Option<Vec<Vec<f64>>>,
}

impl Tour {
    /// The tour in a language, ready to be mapped; none if it has no such language.
    pub fn case(&self, language: Language) -> Option<Case> {
        let spoken = self.spoken.get(&language)?;
        let truth = Truth {
            path: self.path.clone(),
            hypotheses: self.hypotheses.clone(),
            dark_s: self.dark_s.clone(),
            checkpoints_s: Truth::checkpoints_s(self.path.span_s()),
            named: spoken.named.clone(),
            questions: spoken.questions.clone(),
        };
        let messages = messages(&self.stream, &spoken.said, &self.robot);
        Some(Case { seed: self.seed, messages, truth, reference: spoken.reference.clone() })
    }
}

/// How sentences begin that say where one is.
const OUTRIGHT: &[&str] = &[
    "this is",
    "here is",
    "here are",
    "here's",
    "you are in",
    "we are in",
    "we are at",
    "we're in",
    "we're at",
    "we are back in",
    "we are back at",
    "we're back in",
    "we're back at",
];
/// What stands before a name and is no part of it.
const ARTICLES: &[&str] = &["the", "another", "a different", "an", "a"];
/// What stands behind one.
const TAILS: &[&str] = &["again", "now"];

/// The name in a sentence that says where one is.
pub fn outright(text: &str) -> Option<&str> {
    let text = text.strip_prefix("And ").unwrap_or(text).trim_end_matches('.');
    let lower = text.to_lowercase();
    let begins = OUTRIGHT.iter().find(|o| lower.starts_with(&format!("{o} ")))?;
    let mut name = text.get(begins.len()..)?.trim();
    for article in ARTICLES {
        name = name.strip_prefix(&format!("{article} ")).unwrap_or(name);
    }
    for tail in TAILS {
        name = name.strip_suffix(&format!(" {tail}")).unwrap_or(name);
    }
    Some(name)
}

#[cfg(test)]
pub mod tests {
    use super::*;
    use crate::simulated::pose;
    use toponym_proto::Stamp;
    use toponym_proto::merge::order_stamp;
    use toponym_sim::{Scenario, Sentence};

    /// A short walk through the demo's building.
    pub fn short_walk(seed: u64) -> Tour {
        let mut scenario = Scenario::demo(seed);
        scenario.tour.truncate(3);
        let recording = scenario.run().unwrap();
        let (mut stream, mut said) = (Vec::new(), Vec::new());
        for message in recording.messages {
            let Message::Say(say) = message else {
                stream.push(message);
                continue;
            };
            let [began_s, ended_s] = [say.began, say.ended].map(|t| t.unwrap().seconds());
            said.push(Said { sentence: Sentence { began_s, ended_s, text: say.text }, claim: None });
        }
        let rows = recording.truth.scans.iter().map(|(stamp, p)| (stamp.seconds(), pose(p)));
        let gym = said.iter().map(|s| &s.sentence).find(|s| s.text.contains("gym")).unwrap();
        let room = recording.truth.names.iter().find(|n| n.0 == "gym").map(|n| n.1.clone());
        let spoken = Spoken {
            named: vec![Named { t_s: gym.began_s, name: "gym".into() }],
            questions: vec![
                Question { text: "where is the gym".into(), rooms: room.into_iter().collect(), relations: 0 },
                Question { text: "where is the pool".into(), rooms: vec![], relations: 0 },
            ],
            said,
            reference: None,
        };
        let silent = Spoken { said: vec![], named: vec![], ..spoken.clone() };
        Tour {
            seed,
            robot: scenario.robot,
            stream,
            path: Path::new(rows.collect()),
            hypotheses: vec![Hypothesis::truth("truth")],
            dark_s: Vec::new(),
            spoken: BTreeMap::from([(Language::None, silent), (Language::Simple, spoken)]),
        }
    }

    #[test]
    fn a_language_has_its_sentences_where_they_were_said() {
        let tour = short_walk(1);
        let said = |language| {
            let messages = tour.case(language).unwrap().messages;
            messages.iter().filter(|m| matches!(m, Message::Say(_))).count()
        };
        assert_eq!(said(Language::None), 0);
        assert_eq!(said(Language::Simple), tour.spoken[&Language::Simple].said.len());
        assert!(tour.case(Language::Complex).is_none());
        let messages = tour.case(Language::Simple).unwrap().messages;
        let stamps: Vec<Stamp> = messages.iter().map(order_stamp).collect();
        let say = messages.iter().position(|m| matches!(m, Message::Say(_))).unwrap();
        assert!(stamps[say - 1] <= stamps[say] && stamps[say] <= stamps[say + 1]);
    }

    #[test]
    fn names_said_outright_are_found() {
        for (text, name) in [
            ("Here are the drinking fountains.", Some("drinking fountains")),
            ("And we're back in the elevator lobby.", Some("elevator lobby")),
            ("This is another hall.", Some("hall")),
            ("We are in the gym again.", Some("gym")),
            ("The gym is down the hallway.", None),
        ] {
            assert_eq!(outright(text), name, "{text}");
        }
    }
}
