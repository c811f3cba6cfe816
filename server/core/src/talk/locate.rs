//! What a sentence locates: figures, relations and landmarks, out of all its readings.

use crate::language::act::{
    Analysis, Content, Distance, Head, Locate, Modifiers, Ordinal, Parse, Phrase, Restriction,
};
use crate::language::{Narrowing, Relation, pointed_to, seen_from_here};

/// What the readings of a text locate, each with the probability that it is said and meant.
pub(crate) fn located(parse: &Parse) -> Vec<(f64, Locate)> {
    let of = |a: &Analysis| located_by(a).into_iter().map(|(p, l)| (a.weight * p, l)).collect::<Vec<_>>();
    parse.analyses.iter().flat_map(of).collect()
}

/// What one reading locates, each with the probability that it is meant.
pub(crate) fn located_by(reading: &Analysis) -> Vec<(f64, Locate)> {
    let of = |content: &Content| match content {
        Content::Label { at, what, .. } if at.head == Head::There => Some(pointed_to(what)),
        Content::Locate(l) if l.figure.head == Head::Here => seen_from_here(l),
        Content::Locate(l) => Some(by_doors(l)),
        // "The last office on the left is Nick's".
        Content::Alias { what, also } => described(also, what),
        Content::Correct { is, .. } => match &**is {
            Content::Locate(l) => Some(by_doors(l)),
            _ => None,
        },
        _ => None,
    };
    let there = |l: &Locate| l.relation == Relation::At && l.landmarks.iter().any(|p| p.head == Head::There);
    let all = reading.acts.iter().filter_map(|act| Some((act.certainty, of(&act.content)?)));
    all.map(|(p, l)| (p, if there(&l) { pointed_to(&l.figure) } else { l })).collect()
}

/// "It is the second door on the left": what is at a described spot lies as that is described.
fn by_doors(l: &Locate) -> Locate {
    let is_counted = |p: &&Phrase| p.features.ordinal.is_some() || p.features.count.is_some();
    let spot = l.landmarks.first().filter(is_counted).filter(|_| l.relation == Relation::At);
    spot.and_then(|spot| described(&l.figure, spot)).unwrap_or_else(|| l.clone())
}

/// A figure that lies as a phrase says: "the second door *on the left*".
fn described(figure: &Phrase, as_said: &Phrase) -> Option<Locate> {
    let Restriction { relation, modifiers, landmarks } = as_said.within.first()?.clone();
    let modifiers = Modifiers { count: counted(as_said).or(modifiers.count), ..modifiers };
    Some(Locate { figure: figure.clone(), relation, modifiers, landmarks, frame: None, repaired: false })
}

/// "The second door", "two doors".
fn counted(phrase: &Phrase) -> Option<u32> {
    match phrase.features.ordinal {
        Some(Ordinal::Nth(n)) => Some(n),
        _ => phrase.features.count,
    }
}

/// "Just", "twenty meters", "the second door".
pub(crate) fn narrowing(modifiers: &Modifiers, landmark: Option<&Phrase>) -> Narrowing {
    let nth = landmark.and_then(counted);
    let distance_m = modifiers.distance.map(Distance::metres);
    Narrowing { just: modifiers.just, distance_m, doors: nth.or(modifiers.count) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::language::Name;
    use crate::language::grammar::parse::parse;

    #[test]
    fn a_door_counted_along_the_way_is_located_and_may_be_whose() {
        for (text, relation, count) in [
            ("the kitchen is the second door on the left", Relation::LeftSide, Some(2)),
            ("the second office on the left is Nick's", Relation::LeftSide, Some(2)),
            ("two doors down from here is the server room", Relation::Down, Some(2)),
            ("the last office on the right is Nick's", Relation::RightSide, None),
        ] {
            let parse = parse(text);
            let all = located(&parse);
            let (_, l) = all.first().unwrap_or_else(|| panic!("{text} {}", parse.notation()));
            assert_eq!((l.relation, l.modifiers.count), (relation, count), "{text}");
            assert!(l.figure.label().is_some(), "{text}");
        }
    }

    #[test]
    fn what_lies_there_or_here_is_located_from_here() {
        for (text, relation) in [
            ("that is the gym", Relation::Near),
            ("the gym is over there", Relation::Near),
            ("the room over there is the gym", Relation::Near),
            ("the gym is down the hall", Relation::Down),
            ("we are right outside the gym", Relation::NextTo),
        ] {
            let all = located(&parse(text));
            assert_eq!((all[0].1.figure.label(), all[0].1.relation), (Name::new("gym"), relation), "{text}");
        }
        assert!(located(&parse("this is the gym")).is_empty());
    }
}
