//! All phrases of what was said: which names it has, and one name put in another's place.

use crate::language::act::{About, Analysis, Content, Head, Phrase};
use crate::language::lexicon::names::Name;
use crate::language::notation::notation;

/// Does something to each phrase, landmarks of landmarks included.
pub(super) fn each_phrase(content: &mut Content, of: &mut impl FnMut(&mut Phrase)) {
    match content {
        Content::Label { at: a, what: b, .. }
        | Content::Alias { what: a, also: b }
        | Content::Same { what: a, like: b, .. }
        | Content::Generic { figure: a, landmark: b, .. } => {
            each_within(a, of);
            each_within(b, of);
        }
        Content::Locate(l) => {
            each_within(&mut l.figure, of);
            l.landmarks.iter_mut().for_each(|p| each_within(p, of));
        }
        Content::Attribute { what, .. } | Content::Ask { about: About::Phrase(what), .. } => {
            each_within(what, of);
        }
        Content::Negate(inner) | Content::Ask { about: About::Content(inner), .. } => each_phrase(inner, of),
        Content::Correct { was, is } => {
            was.iter_mut().chain([is]).for_each(|content| each_phrase(content, of));
        }
        Content::Route { then, .. } => then.iter_mut().for_each(|content| each_phrase(content, of)),
        Content::Ignored(_) => {}
    }
}

fn each_within(phrase: &mut Phrase, of: &mut impl FnMut(&mut Phrase)) {
    of(phrase);
    let landmarks = phrase.within.iter_mut().flat_map(|r| &mut r.landmarks);
    landmarks.for_each(|p| each_within(p, of));
}

/// The names in it, each once, in the order said.
pub fn names_in(content: &Content) -> Vec<Name> {
    let mut names = Vec::new();
    each_phrase(&mut content.clone(), &mut |phrase| {
        names.extend(phrase.label().filter(|name| !names.contains(name)));
    });
    names
}

/// The same reading with another name in the place of one.
pub fn renamed(reading: &Analysis, from: &Name, to: &Name) -> Analysis {
    let mut reading = reading.clone();
    for act in &mut reading.acts {
        each_phrase(&mut act.content, &mut |phrase| {
            if phrase.label().as_ref() == Some(from) {
                let (owner, name) = (phrase.features.owner.take(), phrase.features.name.take());
                phrase.features.qualities.clear();
                phrase.head = Head::Named(to.clone());
                // Whose it is stays, if the new name does not tell.
                if phrase.label().as_ref() != Some(to) {
                    (phrase.features.owner, phrase.features.name) = (owner, name);
                }
            }
        });
    }
    reading.notation = notation(&reading.acts);
    reading
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::language::understand::parse;

    #[test]
    fn a_name_is_put_in_anothers_place_wherever_it_stands() {
        let [jim, gym] = ["jim", "gym"].map(|n| Name::new(n).unwrap());
        for (said, meant) in [
            ("this is the jim", "label(here,gym)"),
            ("the lounge is next to the jim", "loc(lounge,next_to,gym)"),
            ("this is not the jim", "neg(label(here,gym))"),
        ] {
            let parse = parse(said);
            assert!(names_in(&parse.acts()[0].content).contains(&jim), "{said}");
            assert_eq!(renamed(parse.best().unwrap(), &jim, &gym).notation, meant);
        }
    }
}
