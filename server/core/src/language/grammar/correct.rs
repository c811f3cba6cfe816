//! "No, this is the gym, not the kitchen": what is taken back and what holds.

use crate::language::act::{Act, Content, Head, Locate, Phrase, Sameness};
use crate::language::grammar::build::{Readings, label, locate_all, negate, one};
use crate::language::grammar::cursor::Cursor;
use crate::language::grammar::locate::{located, renamed};
use crate::language::grammar::naming::{named, plausible};
use crate::language::lexicon::is_function_word;

/// Said before a clause: what was said before was wrong.
const MARKS: &str = "no , no|no wait|no|nope|sorry|my bad|my mistake|my apologies|forget what i said|forget that|never mind that|never mind|i was wrong about that|i was wrong|i was mistaken|\
    i am wrong|that was wrong|that is wrong|that is not right|that is not correct|that is incorrect|wrong|correction|\
    scratch that|i made a mistake|i misspoke|let me correct myself|let me correct that|i take that back|actually|\
    in fact|i meant to say|i meant|i mean|oops|wait no|wait|hold on|hang on|i should say|rather|or rather|to be precise|i stand corrected|\
    not really|that was not right|strike that";
/// Said between what is taken back and what holds.
const MENDS: &str = "no wait|no , wait|wait , no|wait no|i mean|i meant to say|i meant|sorry|or rather|rather|make that|correction|\
    no|scratch that|i should say|well actually|actually|oops|excuse me|pardon|my mistake|i am sorry|er|um|uh";

/// Steps over words that take something back; false if there are none.
pub(crate) fn eat_mark(at: &mut Cursor) -> bool {
    if at.sees("no longer|no one|sorry to|actually ,") && at.peek(1) != "," {
        return false;
    }
    // "No office has a sink" denies of all.
    if at.peek(0) == "no"
        && !is_function_word(at.peek(1))
        && !matches!(at.peek(1), "" | "," | "wait" | "sorry")
    {
        return false;
    }
    at.eat_any(MARKS).is_some()
}

/// "The thing I called the lobby is really the atrium", "I called this the lobby but it's the atrium".
pub(crate) fn renaming(at: &mut Cursor) -> Option<Readings> {
    let start = *at;
    if let Some(renamed) = thing_called(at) {
        return Some(renamed);
    }
    *at = start;
    if let Some(said) = not_but(at) {
        return Some(said);
    }
    *at = start;
    if let Some(said) = meant(at) {
        return Some(said);
    }
    *at = start;
    if let Some(said) = wrong_about(at) {
        return Some(said);
    }
    *at = start;
    at.eat_any(
        "i called this place|i called this room|i called this|i said this is|i said this was|i said this place was|\
         i said this room was|i said that this was|i said it was|i told you this was|i told you that this was|\
         i said we were in|i said we were at|i thought this was|i thought we were in|i thought it was")?;
    let was = named(at)?;
    at.skip(",|earlier|before|just now|a minute ago|a moment ago");
    at.eat_any("but actually|but|and|yet|although|though")?;
    at.skip("actually|really|in fact");
    at.eat_any("it is|this is|we are in|that is|it was")?;
    at.skip("actually|really|in fact");
    let is = named(at).filter(plausible)?;
    let said = |what: Phrase| Box::new(label(Head::Here, what, Sameness::Open));
    Some(one(Content::Correct { was: Some(said(was.phrase)), is: said(is.phrase) }))
}

/// "(I was wrong) about the kitchen, it's the lounge".
fn wrong_about(at: &mut Cursor) -> Option<Readings> {
    if !matches!(at.before(), "wrong" | "mistaken") || !at.eat("about") {
        return None;
    }
    let was = named(at)?;
    at.skip(",|and|but");
    at.eat_any("it is|that is|that was")?;
    at.skip("actually|really|in fact");
    let is = named(at).filter(plausible)?;
    Some(Readings::new(vec![(1.0, renamed(was.phrase, is.phrase))]))
}

/// "Not the kitchen, the gym".
fn not_but(at: &mut Cursor) -> Option<Readings> {
    at.eat_any("not")?;
    let was = named(at).filter(plausible)?;
    at.eat_any(",|but")?;
    at.skip("but|it is|this is|rather|we are in");
    let is = named(at).filter(plausible)?;
    let said = |what: Phrase| Box::new(label(Head::Here, what, Sameness::Open));
    Some(one(Content::Correct { was: Some(said(was.phrase)), is: said(is.phrase) }))
}

/// "I meant the gym, not the kitchen".
fn meant(at: &mut Cursor) -> Option<Readings> {
    if !matches!(at.before(), "mean" | "meant") {
        return None;
    }
    let said = |what: Phrase| Box::new(label(Head::Here, what, Sameness::Open));
    let is = named(at).filter(plausible)?;
    let was = match at.eat_any(", not|not|, and not") {
        Some(_) => Some(said(named(at).filter(plausible)?.phrase)),
        None => None,
    };
    let is = said(is.phrase);
    at.at_end().then(|| one(Content::Correct { was, is }))
}

fn thing_called(at: &mut Cursor) -> Option<Readings> {
    at.eat_any("the thing|the place|the room|the one|the area|the space|what")?;
    at.skip("that|which");
    at.eat_any("i|we|you")?;
    at.skip("have|had|just|earlier");
    at.eat_any("called|call|named|labelled|labeled|said was|said is|referred to as|told you was|introduced as|described as")?;
    let was = named(at)?;
    at.skip("earlier|before|just now");
    at.copula().filter(|c| !c.negated)?;
    let is = named(at)?;
    Some(Readings::new(vec![(1.0, renamed(was.phrase, is.phrase))]))
}

/// After a clause that said `last`: "…, not the kitchen", "…, sorry, the gym", "… but the gym".
pub(crate) fn mend(at: &mut Cursor, last: &Content) -> Option<Readings> {
    // What corrects may itself be mended.
    let last = match last {
        Content::Correct { is, .. } => is,
        other => other,
    };
    at.skip(",");
    if let Some(said) = gapped(at, last) {
        return Some(said);
    }
    if at.eat_any("and not|but not|not").is_some() {
        return instead(at, last).map(|readings| readings.map(negate));
    }
    if let Content::Negate(denied) = last {
        at.skip("but|rather|instead|no|it is|this is|that is|it was|that was|,");
        return instead(at, denied);
    }
    at.eat_any(MENDS)?;
    at.skip(MENDS);
    at.skip(",");
    let start = *at;
    let again = at.eat_any("this is|it is|that is|we are in|we are at|in|at|not").is_some();
    let readings = instead(at, last).or_else(|| {
        *at = start;
        if again { None } else { instead(at, last) }
    })?;
    let corrected = |is: Content| Content::Correct { was: Some(Box::new(last.clone())), is: Box::new(is) };
    Some(readings.map(corrected))
}

/// "… and the lounge on the right": another figure at another place, without a verb.
fn gapped(at: &mut Cursor, last: &Content) -> Option<Readings> {
    let start = *at;
    let read = matches!(last, Content::Locate(_)).then(|| {
        at.skip(",|and|but");
        let figure = at.noun_phrase()?;
        at.eat(",");
        located(&[figure], &at.chain(false))
    });
    let said = read.flatten();
    if said.is_none() {
        *at = start;
    }
    said
}

/// What the words here say in the place of `said`: another name, another relation.
fn instead(at: &mut Cursor, said: &Content) -> Option<Readings> {
    match said {
        Content::Label { at: place, .. } => {
            let what = named(at).filter(plausible)?;
            Some(one(label(place.head.clone(), what.phrase, what.sameness)))
        }
        Content::Locate(Locate { figure, .. }) => {
            let chain = at.chain(false);
            let links = if chain.is_empty() { vec![(1.0, vec![at.other_side()?])] } else { chain.attach() };
            Some(locate_all(&[vec![(1.0, figure.clone())]], &links))
        }
        _ => None,
    }
}

/// Joins a denial and what holds instead, and takes what was said before back if the guide says so.
pub(crate) fn fold(acts: Vec<Act>) -> Vec<Act> {
    let mut out: Vec<Act> = Vec::with_capacity(acts.len());
    for act in acts {
        let joined = out.last().and_then(|last| join(&last.content, &act.content));
        match joined {
            Some(content) => {
                let certainty = act.certainty.min(out.last().map_or(1.0, |l| l.certainty));
                out.pop();
                out.push(Act { content, certainty });
            }
            None => out.push(act),
        }
    }
    out
}

fn join(first: &Content, second: &Content) -> Option<Content> {
    let corrected = |was: &Content, is: &Content| {
        alternatives(was, is)
            .map(|is| Content::Correct { was: Some(Box::new(was.clone())), is: Box::new(is) })
    };
    match (first, second) {
        (Content::Negate(was), is) => corrected(was, is),
        (Content::Correct { was: None, is }, Content::Negate(was)) => corrected(was, is),
        (Content::Correct { was: Some(_), is }, again) if **is == *again => Some(first.clone()),
        // "This is the kitchen, I mean the gym": the kitchen is taken back, not said.
        (said, Content::Correct { was: Some(was), .. }) if **was == *said => Some(second.clone()),
        // "This is the kitchen. No, this is the gym."
        (was, Content::Correct { was: None, is }) => corrected(was, is),
        (is, Content::Negate(was)) => corrected(was, is),
        _ => None,
    }
}

/// `is`, if it says something else of what `was` is said of ("it" is what was spoken of).
fn alternatives(was: &Content, is: &Content) -> Option<Content> {
    match (was, is) {
        (Content::Label { at: a, what: x, .. }, Content::Label { at: b, what: y, sameness }) => {
            let fits = a.head == b.head || b.head == Head::It || a.head == Head::It;
            let place = if a.head == Head::It { b } else { a };
            let is = Content::Label { at: place.clone(), what: y.clone(), sameness: *sameness };
            (fits && x != y).then_some(is)
        }
        (Content::Locate(a), Content::Locate(b)) => {
            let fits = a.figure == b.figure || b.figure.head == Head::It;
            let is = Content::Locate(Locate { figure: a.figure.clone(), ..b.clone() });
            (fits && Content::Locate(a.clone()) != is).then_some(is)
        }
        _ => None,
    }
}

/// Marks what is said as a correction of whatever was said before.
pub(crate) fn corrected(content: Content) -> Content {
    match content {
        Content::Label { .. } | Content::Locate(_) | Content::Alias { .. } | Content::Attribute { .. } => {
            Content::Correct { was: None, is: Box::new(content) }
        }
        other => other,
    }
}
