//! What "it" and "there" speak of: what was named last, and a place near by that the speaker points to.

use crate::language::act::{Content, Head, Locate, Modifiers, Parse, Phrase};
use crate::language::relation::Relation;

/// Puts in the place of each "it" what the acts before spoke of, or `before` them the last sentence.
/// Without either, "it" stays.
pub fn resolve_it(parse: &mut Parse, before: Option<&Phrase>) {
    for analysis in &mut parse.analyses {
        let (mut of_before, mut of_text) = (before.cloned(), None);
        for act in &mut analysis.acts {
            if let Some(topic) = of_text.as_ref().or(of_before.as_ref()) {
                name_it(&mut act.content, topic, of_text.is_some());
            }
            if let Some(subject) = subject(&act.content) {
                (of_before, of_text) = (None, Some(subject.clone()));
            }
        }
    }
}

/// What a text speaks of at its end.
pub fn topic(parse: &Parse) -> Option<&Phrase> {
    parse.acts().iter().rev().find_map(|act| subject(&act.content))
}

fn subject(content: &Content) -> Option<&Phrase> {
    match content {
        Content::Label { what, .. } | Content::Alias { what, .. } => Some(what),
        Content::Locate(l) => Some(&l.figure),
        Content::Correct { is, .. } => subject(is),
        _ => None,
    }
    .filter(|phrase| phrase.label().is_some())
}

fn name_it(content: &mut Content, topic: &Phrase, same_text: bool) {
    match content {
        Content::Locate(l) => {
            for phrase in std::iter::once(&mut l.figure).chain(&mut l.landmarks) {
                if phrase.head == Head::It {
                    *phrase = topic.clone();
                }
            }
        }
        Content::Alias { what, .. } if what.head == Head::It => *what = topic.clone(),
        // "It is called the bistro": what was just spoken of, wherever that is. Said by itself it is
        // said of where one stands.
        Content::Label { at, what, .. } if at.head == Head::It && same_text && what.label().is_some() => {
            *content = Content::Alias { what: topic.clone(), also: what.clone() };
        }
        _ => {}
    }
}

/// "That is the gym", "the gym is over there": near who speaks. Nobody told where the finger points.
pub fn pointed_to(figure: &Phrase) -> Locate {
    Locate {
        figure: figure.clone(),
        relation: Relation::Near,
        modifiers: Modifiers::default(),
        landmarks: vec![Phrase::new(Head::Here)],
        frame: None,
        repaired: false,
    }
}

/// "We are next to the gym" says where the gym is: as the place held lies to it, so it lies to that.
pub fn seen_from_here(l: &Locate) -> Option<Locate> {
    let relation = match l.relation {
        Relation::NextTo | Relation::OutOf | Relation::InFrontOf => Relation::NextTo,
        Relation::Near | Relation::Past | Relation::Behind | Relation::LeftOf | Relation::RightOf => {
            Relation::Near
        }
        Relation::AcrossFrom => Relation::AcrossFrom,
        Relation::AwayFrom => Relation::AwayFrom,
        _ => return None,
    };
    let [landmark] = &l.landmarks[..] else { return None };
    Some(Locate {
        figure: landmark.clone(),
        relation,
        landmarks: vec![l.figure.clone()],
        frame: None,
        ..l.clone()
    })
}
