//! "This is the gym", "we are back in the lobby", "the room we just left was the lounge": what a place
//! that one points at is called.

use super::act::{Content, Head, Owner, Phrase, Sameness};
use super::build::{Readings, denied, label, locate_all, one};
use super::copula::Copula;
use super::cursor::Cursor;
use super::describe::attribute;
use super::names::{Kind, Name};
use super::noun_phrase::{Determiner, NounPhrase};
use super::relation::Relation as R;

/// The place held, as people point at it.
const SPOT: &str = "this place here|this place|this room here|this room|this area|this space|this spot|this building|\
    this location|this one here|this one";
/// "As before": the place so called is one seen before.
const AS_BEFORE: &str = "as before|as earlier|as last time|from before|from earlier|we saw before|we saw earlier|\
    we were in before|we were in earlier|that we saw before|that we were in before|we have seen before|as we saw before|\
    we visited before|we visited earlier|where we were before|where we were earlier|we passed before|we passed earlier|\
    we came through before|we were at before|again|once again|once more";
/// Says nothing of where the place is (a map is one level).
const ON_FLOOR: &str = "of the building|of this building|in this building|in the building|to the building|to this building|\
    on this floor|on our floor|on the ground floor|on the first floor|on the second floor|on the third floor|\
    on the fourth floor|on the fifth floor|on the top floor";

/// Reads a clause that names a place pointed at, or says where it lies.
pub(super) fn label_clause(at: &mut Cursor) -> Option<Readings> {
    let start = *at;
    for form in [welcome, people_call, presented_here, pointed, we_are] {
        if let Some(readings) = form(at) {
            return Some(readings);
        }
        *at = start;
    }
    None
}

/// "Welcome to the lab".
fn welcome(at: &mut Cursor) -> Option<Readings> {
    at.eat_any("welcome back to|welcome to")?;
    let again = at.before() == "to" && false;
    let phrase = named(at).filter(|p| p.kind == Kind::Place)?;
    Some(called(at, Head::Here, phrase, again))
}

/// "They call this place the Z-center", "we call it the fishbowl".
fn people_call(at: &mut Cursor) -> Option<Readings> {
    at.eat_any("we|they|people|everyone|everybody|the students|students|i|most people|some people|you can")?;
    at.skip("all|also|usually|just|like to|always|sometimes|often|normally");
    at.eat_any("call|calls|refer to")?;
    let spot = at.eat_any(SPOT).is_some();
    if spot || at.eat_any("this|these").is_some() {
        at.eat("as");
        let phrase = named(at).filter(|p| spot || plausible(p))?;
        return Some(called(at, Head::Here, phrase, false));
    }
    let what = if at.eat_any("it|that").is_some() {
        Phrase::new(Head::It)
    } else {
        let what =
            at.noun_phrase().filter(|p| p.kind == Kind::Place && p.determiner != Determiner::Indefinite)?;
        what.phrase
    };
    at.eat("as");
    let also = named(at).filter(|p| what.head != Head::It || plausible(p))?;
    Some(one(Content::Alias { what, also: also.phrase }))
}

/// "Here we have the kitchen", "we have reached the lobby".
fn presented_here(at: &mut Cursor) -> Option<Readings> {
    at.eat_any(
        "over here we have|here we have|here you have|here you can see|here you see|here you will find|over here is|\
         we have reached|we have now reached|we have entered|we have just entered|we just entered|we are entering|\
         we are now entering|you are entering|you are now entering|we just reached|we have just reached|\
         we just walked into|we have come to|we have arrived at|we have arrived in|you have reached|\
         you have just entered|we have made it to|we are now coming into|we are coming into|\
         what you see here is|what you are looking at is|what we have here is",
    )?;
    let phrase = named(at).filter(plausible)?;
    Some(called(at, Head::Here, phrase, false))
}

/// "This is the gym", "that was not the lounge", "it's the second door on the right".
fn pointed(at: &mut Cursor) -> Option<Readings> {
    let head = subject(at)?;
    let verb = at.copula()?;
    let head = match head {
        Head::There if verb.past => Head::Previous,
        Head::Here | Head::There | Head::It if verb.past => return None,
        head => head,
    };
    predicate(at, head, &verb).map(|readings| denied(readings, &verb))
}

fn subject(at: &mut Cursor) -> Option<Head> {
    if at.just_left() {
        return Some(Head::Previous);
    }
    let here = at.eat_any(
        "this thing here|this right here|this here|where we are standing|where we are now|where we are|\
         the place we are in|the room we are in now|the room we are in|the room you are in|the place where we are|\
         the room where we are|what you see here",
    );
    if here.is_some() || at.eat_any(SPOT).is_some() {
        return Some(Head::Here);
    }
    if at.eat_any("that place|that room over there|that room|that one|that over there").is_some() {
        return Some(Head::There);
    }
    let word = at.eat_any("this|these|here|that|it")?;
    Some(match word {
        "that" => Head::There,
        "it" => Head::It,
        _ => Head::Here,
    })
}

/// What is said of the place pointed at.
fn predicate(at: &mut Cursor, head: Head, verb: &Copula) -> Option<Readings> {
    let start = *at;
    if at
        .eat_any(
            "also called|also known as|also named|called|known as|named|referred to as|known to everyone as",
        )
        .is_some()
    {
        return named(at).map(|p| called(at, head, p, false));
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
    at.eat_any("in|at").filter(|_| again);
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

fn named_predicate(at: &mut Cursor, head: &Head, again: bool) -> Option<Readings> {
    let phrase = at.noun_phrase().filter(|p| p.determiner != Determiner::Demonstrative)?;
    if phrase.phrase.features.ordinal.is_some() {
        return in_a_row(at, head, &phrase);
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
    let at_door = |p: &Phrase| super::relate::Related::to(R::At, p.clone());
    let grounds = readings.into_iter().map(|(w, p)| (w, vec![at_door(&p)])).collect();
    Some(locate_all(&[vec![(1.0, figure)]], &grounds))
}

/// "Next to the gym", said of the place pointed at.
fn related_predicate(at: &mut Cursor, head: Head) -> Option<Readings> {
    let chain = at.chain(false);
    let first = chain.first()?;
    let pointless = matches!(first.relation, R::To | R::In | R::On | R::At | R::Contains) && !chain.sure();
    // "It is by the door" tells where some thing is.
    let vague = first.landmarks.iter().any(|l| l.label().is_some()) && !chain.sure();
    let door = first.landmarks.iter().all(|l| l.label().is_some_and(|n| n.as_str().ends_with("door")))
        && first.relation != R::Through;
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
fn same_place(at: &mut Cursor, head: &Head) -> Option<Content> {
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
    let like = if at.eat_any("as before|as earlier|as last time|again|as the one before|we saw before|we were in before|we were in earlier|as we were in before").is_some() || at.at_break() {
        Phrase::new(Head::Visited)
    } else {
        at.skip("that|as");
        at.landmark()?.0
    };
    Some(Content::Same { what, like, same: true })
}

/// "Where we keep the printers", "where people eat".
fn where_kept(at: &mut Cursor) -> Option<Phrase> {
    at.eat_any("the place where|the room where|where")?;
    let mut place = Phrase::new(Head::Place);
    if at.eat_any("all the|the|all").is_some() || at.at_break() {
        let thing = at.noun_phrase()?;
        at.eat_any("are kept|is kept|are stored|are|is|live|lives|go|goes")?;
        place.within.push(super::relate::Related::to(R::Contains, thing.phrase).restriction());
        return Some(place);
    }
    at.eat_any("we|they|you|people|students|everyone|everybody|i|the students|the staff|you can|we all|one")?;
    at.skip("can|all|usually|always|often|normally|go to|like to|come to|will|sometimes|mostly");
    if at.eat_any("keep|store|have|put|find|get|stash|leave|hide").is_some() {
        at.skip("all|most of|some of|our|my|their");
        let thing = at.noun_phrase()?;
        let meal = ["lunch", "breakfast", "dinner", "meeting", "coffee", "class", "party"]
            .iter()
            .any(|w| thing.name().is_some_and(|n| n.as_str().ends_with(w)));
        if !meal {
            place.within.push(super::relate::Related::to(R::Contains, thing.phrase).restriction());
            return at.at_break().then_some(place);
        }
        place.features.purpose = thing.name().map(|n| format!("have {n}"));
        return at.at_break().then_some(place);
    }
    let verb = at.eat_any(
        "eat|drink|meet|work|sleep|cook|park|print|study|relax|rest|hang out|smoke|play|exercise|work out|hold|teach|\
         have|take|make|wash|wait|gather|sit|read|pick up|drop off",
    )?;
    let rest = at.to_break();
    place.features.purpose = Some([&[verb], rest.as_slice()].concat().join(" "));
    (rest.len() <= 4).then_some(place)
}

fn owned_room(owner: Owner) -> Option<Phrase> {
    let mut room = Phrase::new(Head::Named(Name::new("room")?));
    room.features.owner = Some(owner);
    Some(room)
}

/// "We are back in the gym", "we are next to the gym", "we have been here before".
fn we_are(at: &mut Cursor) -> Option<Readings> {
    if at.eat_any("we have been here before|we have been here already|we have already been here|we were here before|\
        we were here earlier|we were here already|we were already here|i have been here before|you have been here before|\
        we have seen this place before|we have seen this before|we have seen this room before|we have been in this room before|\
        we have been in here before|we have visited this place before")
        .is_some()
    {
        return Some(one(been_here(true)));
    }
    if at.eat_any("we have not been here before|we have never been here before|we have never been here|\
        we have not been here yet|we have not been here|we were not here before|this is a new place|this is somewhere new|\
        you have not been here before|you have never been here before|you have never been here")
        .is_some()
    {
        return Some(one(been_here(false)));
    }
    let who = at.eat_any(
        "here we are|now we are|and now we are|we are|you are|i am|we have arrived|we have now arrived|we have just arrived|\
         we just arrived|you have arrived|we have come|we have just come|we might be|we may be|we should be|we could be|\
         we must be|we seem to be|you should be|you might be|we will be",
    );
    // "Back at the lobby" does without.
    if who.is_none() && at.peek(0) != "back" {
        return None;
    }
    let (mut back, mut inside, mut denied) = (false, false, false);
    loop {
        if at.eat_any("back|again|once again|still").is_some() {
            back = true;
        } else if at.eat_any("no longer|not").is_some() {
            denied = true;
        } else if at.eat_any("inside of|inside").is_some() {
            inside = true;
        } else if at
            .eat_any("now|here|right|all|just|finally|currently|standing|already|at last|probably|actually|really|definitely")
            .is_none()
        {
            break;
        }
    }
    let start = *at;
    let alone = who == Some("i am");
    if let Some(same) = same_place(at, &Head::Here).filter(|_| !alone) {
        return Some(one(if denied { super::build::negate(same) } else { same }));
    }
    *at = start;
    let readings = inside_of(at, back, inside, who.is_some()).or_else(|| {
        *at = start;
        (!alone && !inside).then(|| related_predicate(at, Head::Here)).flatten()
    })?;
    if denied {
        return Some(
            readings
                .into_iter()
                .map(|(w, all)| (w, all.into_iter().map(super::build::negate).collect()))
                .collect(),
        );
    }
    Some(readings)
}

fn been_here(same: bool) -> Content {
    Content::Same { what: Phrase::new(Head::Here), like: Phrase::new(Head::Visited), same }
}

/// "In the gym", after "we are".
fn inside_of(at: &mut Cursor, back: bool, inside: bool, said_who: bool) -> Option<Readings> {
    let on = at.eat("on");
    if !(on || inside || at.eat_any("in|at|by").is_some() || (back && said_who && at.eat("to"))) {
        return None;
    }
    // "On the terrace", but not "on the same page".
    let phrase = named(at).filter(|p| plausible(p) && (!on || p.kind == Kind::Place))?;
    Some(called(at, Head::Here, phrase, back))
}

/// A noun phrase that may name a place.
pub(super) fn named(at: &mut Cursor) -> Option<NounPhrase> {
    at.noun_phrase()
        .filter(|p| matches!(p.kind, Kind::Place | Kind::Open) && p.determiner != Determiner::Demonstrative)
}

/// A known kind of place, or any definite single thing: unknown things ("a test", "the results") name
/// no place.
pub(super) fn plausible(phrase: &NounPhrase) -> bool {
    phrase.kind == Kind::Place
        || (phrase.kind == Kind::Open && phrase.determiner == Determiner::Definite && !phrase.is_plural())
}

/// The place is called `phrase`, with what comes after the name.
fn called(at: &mut Cursor, head: Head, phrase: NounPhrase, mut again: bool) -> Readings {
    at.skip(ON_FLOOR);
    let mut start = false;
    while !at.at_end() {
        let before = *at;
        at.eat(",");
        if at.eat_any(AS_BEFORE).is_some() {
            again = true;
        } else if at.pointer().is_some_and(|p| p.head == Head::Start) {
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
        return vec![(1.0, vec![label(head, phrase.phrase, Sameness::Open), same])];
    }
    let chain = at.chain(true);
    let mine = |h: &Head| matches!(h, Head::Agent | Head::Speaker | Head::Path);
    if head == Head::Here && chain.first().is_some_and(|r| r.landmarks.iter().any(|l| mine(&l.head))) {
        // "Here is the kitchen on your left" locates it.
        return locate_all(&[vec![(1.0, phrase.phrase)]], &chain.attach());
    }
    chain
        .restrict(&phrase.phrase)
        .into_iter()
        .map(|(w, what)| (w, vec![label(head.clone(), what, sameness)]))
        .collect()
}
