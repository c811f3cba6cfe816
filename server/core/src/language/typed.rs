//! What the first parser reads, in the types of [`super::act`].

use super::act::{self, Analysis, Content, Features, Head, Modifiers, Phrase};
use super::words::words as old_words;
use super::{Act, Landmark, Name, Sameness, parse};

/// What a text says, or the likeliest other hearing that makes sense.
pub fn understand(text: &str, alternatives: &[(String, f64)]) -> act::Parse {
    let mut others: Vec<&(String, f64)> = alternatives.iter().collect();
    others.sort_by(|a, b| b.1.total_cmp(&a.1));
    let texts = std::iter::once(text).chain(others.into_iter().map(|(text, _)| text.as_str()));
    let parses = texts.map(parse).find(|p| !p.acts.is_empty());
    let Some(parse) = parses else { return act::Parse::default() };
    let acts = parse.acts.iter().map(|a| act::Act { content: typed(a), certainty: 1.0 }).collect();
    act::Parse { analyses: vec![Analysis { weight: 1.0, acts, notation: parse.notation }] }
}

/// In words, for the guide.
pub fn words(text: &str) -> String {
    old_words(&parse(text).acts, |_| true)
}

fn named(name: &Name) -> Phrase {
    Phrase { head: Head::Named(name.clone()), features: Features::default(), within: Vec::new() }
}

fn typed(act: &Act) -> Content {
    match act {
        Act::Label { name, again } => Content::Label {
            at: Phrase::new(Head::Here),
            what: named(name),
            sameness: match again {
                Sameness::Same => act::Sameness::Same,
                Sameness::Other => act::Sameness::Other,
                Sameness::Open => act::Sameness::Open,
            },
        },
        Act::Locate { figure, relation, landmark } => Content::Locate(act::Locate {
            figure: named(figure),
            relation: *relation,
            modifiers: Modifiers::default(),
            landmarks: vec![match landmark {
                Landmark::Name(name) => named(name),
                Landmark::Here => Phrase::new(Head::Here),
            }],
            frame: None,
            repaired: false,
        }),
        Act::AskWhere { name } => {
            Content::Ask { kind: act::Question::Where, about: act::About::Phrase(named(name)) }
        }
    }
}
