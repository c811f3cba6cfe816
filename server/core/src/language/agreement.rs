//! Whether two readings say the same: acts alike, names of one head. One may say more of whose side, how far and where
//! a landmark is.

use crate::language::act::{About, Act, Content, Head, Locate, Phrase, Question, Sameness};
use crate::language::relation::Relation;

/// Whether each act of either is like one of the other.
pub fn agree(a: &[Act], b: &[Act]) -> bool {
    says_all(a, b) && says_all(b, a)
}

/// Whether there is an act like each of those `said`.
pub fn says_all(all: &[Act], said: &[Act]) -> bool {
    said.iter().all(|x| all.iter().any(|y| alike(&x.content, &y.content) || alike(&y.content, &x.content)))
}

fn alike(a: &Content, b: &Content) -> bool {
    match (a, b) {
        (Content::Label { at, what, .. }, Content::Label { at: other_at, what: other, .. }) => {
            // "That is the gym", "those are the lifts": one and the other grammar of pointing.
            let near = |p: &Phrase| matches!(p.head, Head::Here | Head::There | Head::Any | Head::Previous);
            (one(at, other_at) || near(at) && near(other_at)) && one(what, other)
        }
        // "That is the gym": it is there.
        (Content::Label { at, what, .. }, Content::Locate(l)) => {
            at.head == Head::There
                && one(what, &l.figure)
                && matches!(l.landmarks.as_slice(), [p] if p.head == Head::There)
        }
        // "Back in the gym" names it, too.
        (Content::Label { at, what, sameness }, Content::Same { what: other_at, like, same }) => {
            let is_same = if *same { Sameness::Same } else { Sameness::Other };
            *sameness == is_same && one(at, other_at) && one(what, like)
        }
        (Content::Locate(a), Content::Locate(b)) => {
            one(&a.figure, &b.figure)
                && (put_alike((a.relation, &a.landmarks), (b.relation, &b.landmarks))
                    || put_alike(spot(a), spot(b)))
        }
        (Content::Alias { what, also }, Content::Alias { what: a, also: b }) => {
            one(what, a) && one(also, b) || one(what, b) && one(also, a)
        }
        (Content::Attribute { what, .. }, Content::Attribute { what: other, .. }) => one(what, other),
        // "No, this is the gym" says no more than what holds.
        (Content::Correct { was: None, is }, b) if !matches!(b, Content::Correct { .. }) => alike(is, b),
        (Content::Negate(a), Content::Negate(b))
        | (Content::Correct { is: a, .. }, Content::Correct { is: b, .. }) => alike(a, b),
        (Content::Same { what: a, like: b, same }, Content::Same { what: c, like: d, same: other }) => {
            same == other && one(a, c) && one(b, d)
        }
        (Content::Ask { kind, about }, Content::Ask { kind: other, about: other_about }) => {
            let is_here = |about: &About| matches!(about, About::Phrase(p) if p.head == Head::Here);
            match (about, other_about) {
                (About::Phrase(a), About::Phrase(b)) if kind == other => one(a, b),
                // "Why do you think this is the gym" asks whether it is, too.
                (About::Content(a), About::Content(b)) if kind == other || *kind == Question::Why => {
                    alike(a, b)
                }
                // "Where are we", "what is this".
                (a, b) => is_here(a) && is_here(b),
            }
        }
        (
            Content::Generic { figure, relation, landmark, .. },
            Content::Generic { figure: f, relation: r, landmark: l, .. },
        ) => relation == r && one(figure, f) && one(landmark, l),
        // "If you see the lifts you are near the gym."
        (Content::Generic { figure, relation, landmark, .. }, Content::Locate(l)) => {
            *relation == l.relation && one(figure, &l.figure) && l.landmarks.iter().all(|l| one(landmark, l))
        }
        (Content::Route { then: a, .. }, Content::Route { then: b, .. }) => match (a, b) {
            (Some(a), Some(b)) => alike(a, b),
            (None, None) => true,
            _ => false,
        },
        _ => false,
    }
}

/// Of one landmark by name they need not agree how a place lies to it: many words say either.
fn put_alike((a, of_a): (Relation, &[Phrase]), (b, of_b): (Relation, &[Phrase])) -> bool {
    let named = of_a.len() == 1 && of_a[0].label().is_some();
    let implied = |p: &Phrase| side_of(a) == side_of(b) && matches!(p.head, Head::Here | Head::Path);
    (named || side_of(a) == side_of(b)) && of_a.iter().zip(of_b).all(|(a, b)| one(a, b) || implied(b))
}

/// "On the left side of the hallway" is left of it, too.
fn side_of(relation: Relation) -> Relation {
    match relation {
        Relation::LeftSide => Relation::LeftOf,
        Relation::RightSide => Relation::RightOf,
        relation => relation,
    }
}

/// Where it is put: "at the place past the kitchen" is past the kitchen.
fn spot(l: &Locate) -> (Relation, &[Phrase]) {
    match &l.landmarks[..] {
        [place] if l.relation == Relation::At && place.within.len() == 1 => {
            (place.within[0].relation, &place.within[0].landmarks)
        }
        landmarks => (l.relation, landmarks),
    }
}

/// Whether phrases may mean one: pointers do alike, names with all words of one in the other.
fn one(a: &Phrase, b: &Phrase) -> bool {
    let (Head::Named(head_a), Head::Named(head_b)) = (&a.head, &b.head) else { return a.head == b.head };
    let words = |p: &Phrase, head: &crate::language::lexicon::names::Name| {
        let label = p.label().unwrap_or_else(|| head.clone());
        label.as_str().split(' ').map(|w| w.trim_end_matches("'s").to_owned()).collect::<Vec<_>>()
    };
    let (a, b) = (words(a, head_a), words(b, head_b));
    a.iter().all(|w| b.contains(w)) || b.iter().all(|w| a.contains(w))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::language::grammar::parse::parse;

    #[test]
    fn readings_agree_that_say_the_same_of_the_same() {
        let agrees = |a: &str, b: &str| agree(parse(a).acts(), parse(b).acts());
        for (a, b, so) in [
            ("this is the gym", "here is the big gym", true),
            ("this is the gym", "this is the lab", false),
            ("the gym is down the hall", "the gym is just down the hall", true),
            ("the gym is down the hall", "the gym is past the lab", false),
            ("this is the gym", "this is not the gym", false),
            ("this is the gym", "this is the gym and the lab is upstairs", false),
            ("where is the gym", "where is the gym?", true),
            ("the gym is also called the arena", "the arena is also called the gym", true),
        ] {
            assert_eq!(agrees(a, b), so, "{a} / {b}");
        }
    }
}
