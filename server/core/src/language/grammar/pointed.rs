//! "This is …", "that was …", "it is …": what is said of a place that one points at.

use crate::language::act::{Content, Head, Owner, Phrase, Sameness};
use crate::language::grammar::attribute::attribute;
use crate::language::grammar::build::{Readings, label, locate_all, one, shaped};
use crate::language::grammar::copula::Copula;
use crate::language::grammar::cursor::Cursor;
use crate::language::grammar::naming::{SPOT, called, named, plausible};
use crate::language::grammar::noun_phrase::{Determiner, NounPhrase};
use crate::language::grammar::relate::Related;
use crate::language::lexicon::names::{Kind, Name};
use crate::language::lexicon::normalise::COMMA;
use crate::language::relation::Relation as R;

/// "This is the gym", "that was not the lounge", "it's the second door on the right".
pub(crate) fn pointed(at: &mut Cursor) -> Option<Readings> {
    let spot = at.sees(SPOT);
    let head = subject(at)?;
    if head == Head::Here && at.eat_each(&["also|", "goes by|is known by", "the name of|the name|"]) {
        return named(at).filter(|p| spot || plausible(p)).map(|p| called(at, head, p, false));
    }
    let verb = at.copula()?;
    let head = match head {
        Head::There if verb.past => Head::Previous,
        Head::Here | Head::There | Head::It if verb.past => return None,
        head => head,
    };
    if verb.future {
        // "This will be the gym" is not the gym yet.
        return None;
    }
    predicate(at, head, spot, &verb).map(|readings| shaped(readings, &verb))
}

fn subject(at: &mut Cursor) -> Option<Head> {
    if at.just_left() {
        return Some(Head::Previous);
    }
    let spot = "place|room|area|space|spot|one|building|hallway|corridor|floor|part of the building";
    if at.eat_each(&[
        "the",
        spot,
        "that|which|",
        "we|you|i",
        "are",
        "now|currently|just|",
        "standing|all|",
        "in|at|entering|looking at",
        "now|right now|here|currently|",
    ]) || at.eat_each(&[
        "the",
        spot,
        "where|",
        "we|you|i",
        "are",
        "now|currently|",
        "standing|",
        "now|right now|",
    ]) {
        return Some(Head::Here);
    }
    let here = at.eat_any(
        "this thing here|this right here|this here|where we are standing|where we are now|where we are|\
         where you are standing|where you are|what you see here",
    );
    if here.is_some() || at.eat_any(SPOT).is_some() {
        return Some(Head::Here);
    }
    if at
        .eat_any(
            "that back there|that place over there|that place|that room over there|that room|that one over there|that one|\
        that right there|that over there|that there|those over there|the one over there|the room over there",
        )
        .is_some()
    {
        return Some(Head::There);
    }
    let word = at.eat_any("this|these|right here|here|those|that|it")?;
    Some(match word {
        "that" | "those" => Head::There,
        "it" => Head::It,
        _ => Head::Here,
    })
}

/// What is said of the place pointed at.
fn predicate(at: &mut Cursor, head: Head, spot: bool, verb: &Copula) -> Option<Readings> {
    let start = *at;
    if so_called(at) {
        // "This place is called Nirvana"; "this is called teamwork" is less clear.
        let name = named(at).filter(|p| spot || plausible(p))?;
        if head == Head::It {
            return Some(one(Content::Alias { what: Phrase::new(head), also: name.phrase }));
        }
        return Some(called(at, head, name, false));
    }
    if let Some(same) = same_place(at, &head) {
        return Some(one(same));
    }
    *at = start;
    if let Some(place) = where_kept(at) {
        return Some(one(label(head, place, Sameness::Open)));
    }
    *at = start;
    if let Some(owner) = at.owner_alone() {
        return Some(one(label(head, owned_room(owner)?, Sameness::Open)));
    }
    *at = start;
    let again = verb.again || at.eat_any("back").is_some();
    if again {
        at.eat_any("in|at");
    }
    if let Some(readings) = named_predicate(at, &head, again) {
        return Some(readings);
    }
    *at = start;
    if let Some(value) = attribute(at).filter(|_| head == Head::Here && at.at_break()) {
        return Some(one(Content::Attribute { what: Phrase::new(head), value }));
    }
    *at = start;
    related_predicate(at, head)
}

/// "What we call", "also known as", "a room that people call": a name follows.
pub(crate) fn so_called(at: &mut Cursor) -> bool {
    let by = "we|they|people|everyone|everybody|folks|students|i|you";
    let calls = "call|calls|refer to as|refers to as|know as|knows as|named";
    let called =
        "called|known as|named|referred to as|known to everyone as|nicknamed|labeled|labelled|dubbed";
    let thing =
        "what|the room|the place|the area|the space|the one|the so called|a room|a place|an area|a space";
    let often =
        "all|also|usually|like to|often|commonly|affectionately|generally|sometimes|better|otherwise|";
    at.eat_each(&[thing, "that|which|", by, often, calls])
        || at.eat_each(&[thing, "that is|which is|is|", often, called])
        || at.eat_each(&[often, called])
        || at.eat("the so called")
}

fn named_predicate(at: &mut Cursor, head: &Head, again: bool) -> Option<Readings> {
    let phrase = at.noun_phrase().filter(|p| p.determiner != Determiner::Demonstrative)?;
    if phrase.phrase.features.ordinal.is_some() {
        return in_a_row(at, head, &phrase);
    }
    if phrase.phrase.features.count.is_some() {
        // "Two doors past the kitchen" is a place in a row, not a name.
        return None;
    }
    if !matches!(phrase.kind, Kind::Place | Kind::Open | Kind::Vague)
        || (*head == Head::It && phrase.kind != Kind::Place)
    {
        return None;
    }
    let told = phrase.kind == Kind::Vague && phrase.determiner == Determiner::Definite;
    (plausible(&phrase) || told || phrase.phrase.features.owner.is_some())
        .then(|| called(at, head.clone(), phrase.clone(), again))
        .filter(|_| {
            phrase.kind != Kind::Vague
                || phrase.phrase.features.owner.is_some()
                || at.before() != last_word(&phrase)
        })
}

fn last_word(phrase: &NounPhrase) -> &str {
    match &phrase.phrase.head {
        Head::Named(name) => name.as_str().rsplit(' ').next().unwrap_or(""),
        _ => "",
    }
}

/// "The second door on the right".
fn in_a_row(at: &mut Cursor, head: &Head, phrase: &NounPhrase) -> Option<Readings> {
    if !matches!(phrase.kind, Kind::Place | Kind::Vague) {
        return None;
    }
    let chain = at.chain(true);
    if chain.is_empty() {
        return None;
    }
    let figure = Phrase::new(head.clone());
    let readings = chain.restrict(&phrase.phrase);
    let at_door = |p: &Phrase| Related::to(R::At, p.clone());
    let grounds = readings.into_iter().map(|(w, p)| (w, vec![at_door(&p)])).collect();
    Some(locate_all(&[vec![(1.0, figure)]], &grounds))
}

/// "Next to the gym", said of the place pointed at.
pub(crate) fn related_predicate(at: &mut Cursor, head: Head) -> Option<Readings> {
    let chain = at.chain(false);
    let first = chain.first()?;
    let counted = first.landmarks.iter().any(|l| l.features.count.is_some());
    let onward = matches!(first.relation, R::To | R::Contains);
    let pointless = onward
        || matches!(first.relation, R::To | R::In | R::On | R::At | R::Contains) && !chain.sure() && !counted;
    // "It is by the door" tells where some thing is.
    let vague = !counted && first.landmarks.iter().any(|l| l.label().is_some()) && !chain.sure();
    let door = first.landmarks.iter().all(|l| l.label().is_some_and(|n| n.as_str().ends_with("door")))
        && first.relation != R::Through
        && !counted;
    if head == Head::There || (vague && first.relation != R::Around) || pointless || door {
        return None;
    }
    // "This is on your left" says nothing of where this is.
    let mine = first
        .landmarks
        .iter()
        .any(|l| matches!(l.head, Head::Agent | Head::Speaker | Head::Path | Head::Here));
    if head == Head::Here && mine {
        return None;
    }
    Some(locate_all(&[vec![(1.0, Phrase::new(head))]], &chain.attach()))
}

/// "Where we started", "the same place as before", "somewhere we have been".
pub(crate) fn same_place(at: &mut Cursor, head: &Head) -> Option<Content> {
    let what = Phrase::new(head.clone());
    let start = *at;
    at.skip("back|right|exactly|just");
    if let Some(phrase) =
        at.pointer().filter(|p| matches!(p.head, Head::Start | Head::Previous | Head::Visited))
    {
        at.skip("again");
        return Some(Content::Same { what, like: phrase, same: true });
    }
    *at = start;
    if at.eat_any("a different place|another place|somewhere else|a different one|another one|a different spot|someplace else|a new place").is_some() {
        let like = if at.eat("from") { at.landmark()?.0 } else { Phrase::new(Head::Visited) };
        return Some(Content::Same { what, like, same: false });
    }
    at.eat_any("the very same|the exact same|the same")?;
    at.eat_any("place|one|room|spot|area|location")?;
    if at
        .eat_any(
            "where we started|that we started|we started from|we started in|we started at|we started|we came in|we began",
        )
        .is_some()
    {
        return Some(Content::Same { what, like: Phrase::new(Head::Start), same: true });
    }
    let like = if at.eat_any("as before|as earlier|as last time|again|as the one before|we saw before|we were in before|we were in earlier|as we were in before").is_some() || at.at_break() {
        Phrase::new(Head::Visited)
    } else {
        at.skip("that|as");
        at.landmark()?.0
    };
    Some(Content::Same { what, like, same: true })
}

/// "Where we keep the printers", "where people eat".
pub(crate) fn where_kept(at: &mut Cursor) -> Option<Phrase> {
    at.eat_any("the place where|the room where|where")?;
    let mut place = Phrase::new(Head::Place);
    let start = *at;
    if at.eat_any("all the|the|all").is_some() || at.at_break() {
        let thing = at.noun_phrase()?;
        if at.eat_any("are kept|is kept|are stored|is stored|are|is|live|lives|go|goes").is_some() {
            place.within.push(Related::to(R::Contains, thing.phrase).restriction());
            return Some(place);
        }
    }
    *at = start;
    if at.eat_any("we|they|you|people|students|everyone|everybody|i|one").is_none() {
        people(at)?;
    }
    at.skip("can|could|would|should|all|usually|always|often|normally|go to|like to|come to|get to|go|will|sometimes|mostly|\
        generally|typically");
    if at.eat_any("keep|store|have|put|find|see|get|stash|leave|hide").is_some() {
        at.skip("all|most of|some of|our|my|their");
        let thing = at.noun_phrase()?;
        let meal = ["lunch", "breakfast", "dinner", "meeting", "coffee", "class", "party"]
            .iter()
            .any(|w| thing.name().is_some_and(|n| n.as_str().ends_with(w)));
        if !meal {
            place.within.push(Related::to(R::Contains, thing.phrase).restriction());
            return at.at_break().then_some(place);
        }
        place.features.purpose = thing.name().map(|n| format!("have {n}"));
        return at.at_break().then_some(place);
    }
    let verb = base_form(at.eat_any(DOING)?);
    let rest = at.take_to_break();
    place.features.purpose = Some([&[verb], rest.as_slice()].concat().join(" "));
    (rest.len() <= 4).then_some(place)
}

/// "Work" of "works": in the list of verbs it comes next.
fn base_form(verb: &'static str) -> &'static str {
    let third_person = verb.split(' ').next().is_some_and(|w| w.ends_with('s'));
    let next = DOING.split('|').skip_while(|v| *v != verb).nth(1);
    next.filter(|_| third_person).unwrap_or(verb)
}

/// What people do at places; the base form of a verb comes after its form in -s.
const DOING: &str = "eats|eat|drinks|drink|meets|meet|works out|work out|works|work|sleeps|sleep|cooks|cook|parks|park|\
    prints|print|studies|study|relaxes|relax|rests|rest|hangs out|hang out|smokes|smoke|plays|play|exercises|exercise|\
    holds|hold|teaches|teach|has|have|takes|take|makes|make|washes|wash|waits|wait|gathers|gather|sits|sit|reads|read|\
    picks up|pick up|drops off|drop off|checks in|check in|checks out|check out|trains|train|builds|build|tests|test|\
    practices|practice|registers|register|signs in|sign in|gives|give|runs|run|does|do|recycle|charge|present|repair|\
    fix|record|rehearse|pray|nap|shower|change|vote|swim|stay|lives|live|line up|queue|order|pay|buy|get together";

/// "The grad students": who does something, before what is done.
fn people(at: &mut Cursor) -> Option<()> {
    let someone = at.word().is_some_and(|w| w.capital);
    if at.eat_any("all the|most of the|the|our|most|all|some|my").is_none() && !someone {
        return None;
    }
    for _ in 0..3 {
        at.word().filter(|w| w.text != COMMA)?;
        at.step();
        if at.sees(DOING) || at.sees("keep|store|put|can|usually|all|often|always|like to|go to|come to") {
            return Some(());
        }
    }
    None
}

fn owned_room(owner: Owner) -> Option<Phrase> {
    let mut room = Phrase::new(Head::Named(Name::new("room")?));
    room.features.owner = Some(owner);
    Some(room)
}
