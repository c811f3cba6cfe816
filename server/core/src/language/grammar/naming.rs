//! What a name may be where one is given, and what comes after it: "the kitchen, as before".

use crate::language::act::{Content, Head, Phrase, Sameness};
use crate::language::grammar::build::{Readings, label, locate_all};
use crate::language::grammar::cursor::Cursor;
use crate::language::grammar::noun_phrase::{Determiner, NounPhrase};
use crate::language::lexicon::names::Kind;

/// The place held, as people point at it.
pub(crate) const SPOT: &str = "this place here|this over here|this one over here|this place|this room here|this room|this area|this space|this spot|this building|\
    this location|this one here|this one";
/// "As before": the place so called is one seen before.
const AS_BEFORE: &str = "as before|as earlier|as last time|from before|from earlier|where we were before|\
    where we were earlier|from last time|again|once again|once more|as the last time|as the one before";

/// "As before", "that we walked down earlier".
fn as_before(at: &mut Cursor) -> bool {
    let did = "saw|see|seen|were in|were at|in|been in|been at|been to|visited|passed by|passed|passed through|came through|\
        came down|came by|walked through|walked down|walked past|walked along|went through|went down|went past|looked at|\
        stopped at|stopped in|were|went to|came across";
    let when = "before|earlier|already|last time|a minute ago|a moment ago|a while ago|just now|previously|at first|a while back|\
        a few minutes ago";
    at.eat_any(AS_BEFORE).is_some()
        || at.eat_each(&["that|which|as|where|", "we|you|i", "have|had|", "just|already|", did, when])
}
/// Says nothing of where the place is (a map is one level).
const ON_FLOOR: &str = "of the building|of this building|in this building|in the building|to the building|to this building|\
    on this floor|on our floor|on the ground floor|on the first floor|on the second floor|on the third floor|\
    on the fourth floor|on the fifth floor|on the top floor";

/// A noun phrase that may name a place.
pub(crate) fn named(at: &mut Cursor) -> Option<NounPhrase> {
    at.noun_phrase()
        .filter(|p| matches!(p.kind, Kind::Place | Kind::Open) && p.determiner != Determiner::Demonstrative)
}

/// "The door" names no place, "the front door" does.
fn just_a_door(phrase: &NounPhrase) -> bool {
    !phrase.is_told() && phrase.name().is_some_and(|n| matches!(n.as_str(), "door" | "doorway" | "opening"))
}

/// A known kind of place, or any definite single thing: unknown things ("a test", "the results") name
/// no place.
pub(crate) fn plausible(phrase: &NounPhrase) -> bool {
    (phrase.kind == Kind::Place && !just_a_door(phrase))
        || (phrase.kind == Kind::Open && phrase.determiner == Determiner::Definite && !phrase.is_plural())
}

/// The place is called `phrase`, with what comes after the name.
pub(crate) fn called(at: &mut Cursor, head: Head, phrase: NounPhrase, mut again: bool) -> Readings {
    at.skip(ON_FLOOR);
    if head == Head::Previous {
        at.skip("back there|there");
    }
    let mut start = false;
    while !at.at_end() {
        let before = *at;
        at.eat(",");
        if as_before(at) {
            again = true;
        } else if at.eat_each(&[
            "that|which|where|",
            "we|you|i",
            "first|",
            "started|began|set off|set out|started out|came in",
            "in|from|at|through|",
        ]) || at.pointer().is_some_and(|p| p.head == Head::Start)
        {
            start = true;
        } else {
            *at = before;
            break;
        }
    }
    let sameness = if again && phrase.sameness == Sameness::Open { Sameness::Same } else { phrase.sameness };
    if start {
        let same =
            Content::Same { what: Phrase::new(head.clone()), like: Phrase::new(Head::Start), same: true };
        return Readings::new(vec![(1.0, vec![label(head, phrase.phrase, Sameness::Open), same])]);
    }
    let chain = at.chain(true);
    let mine = |h: &Head| matches!(h, Head::Agent | Head::Speaker | Head::Path | Head::There);
    if matches!(head, Head::Here | Head::There)
        && chain.first().is_some_and(|r| r.landmarks.iter().any(|l| mine(&l.head)))
    {
        // "Here is the kitchen on your left" locates it.
        return locate_all(&[vec![(1.0, phrase.phrase)]], &chain.attach());
    }
    let all = chain
        .restrict(&phrase.phrase)
        .into_iter()
        .map(|(w, what)| (w, vec![label(head.clone(), what, sameness)]))
        .collect();
    Readings::new(all)
}
