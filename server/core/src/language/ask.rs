//! Questions. They assert nothing.

use super::act::{About, Content, Head, Phrase, Question, Sameness};
use super::attach::Chain;
use super::build::{Readings, label, one};
use super::cursor::Cursor;
use super::locate::locate_clause;
use super::names::{Kind, Name};
use super::noun_phrase::{Determiner, NounPhrase};

// A phrase that begins another comes after it.
const WHERE_INDIRECT: &str = "do you know where|i would like to know where|i want to know where|can you tell me where|could you tell me where|tell me where|\
    show me where|can you show me where|could you show me where|i wonder where|do you remember where|any idea where";
const WHERE: &str = "where exactly is|where exactly are|where is|where are|where can i find|where can we find|\
    where can you find|where do i find|where do we find|where would i find|where might i find|where will i find|where was";
const ROUTE: &str = "how do i get from here to|how do we get from here to|how do you get from here to|how do i get to|\
    how do we get to|how do you get to|how would i get to|how would you get to|how can i get to|how can we get to|\
    how can i find|how do i find|how do we find|how to get to|how do i reach|how do i go to|how do you go to|\
    what is the way to|what is the best way to|what is the fastest way to|what is the quickest way to|which way is it to|\
    which way to|take me to|take us to|bring me to|bring us to|lead me to|guide me to|show me the way to|show me to|\
    directions to|do you know the way to|do you know how to get to|can you take me to|could you take me to|\
    can you show me the way to|could you show me the way to|can you tell me the way to|can you tell me how to get to|\
    could you tell me how to get to|give me directions to|can you guide me to|is this the way to";
const WANTED: &str = "i am looking for|we are looking for|looking for|which way is|which way are";

/// Reads a question.
pub(super) fn ask_clause(at: &mut Cursor, question: bool) -> Option<Readings> {
    let start = *at;
    for form in [ask_what, ask_place, ask_why, ask_far] {
        if let Some(asked) = form(at) {
            return Some(one(asked));
        }
        *at = start;
    }
    let asked = ask_whether(at, question);
    if asked.is_none() {
        *at = start;
    }
    asked.map(one)
}

fn ask(kind: Question, about: Phrase) -> Content {
    Content::Ask { kind, about: About::Phrase(about) }
}

/// "Where is the gym", "how do I get to the gym".
fn ask_place(at: &mut Cursor) -> Option<Content> {
    if at
        .eat_any("where are we now|where are we|where am i now|where am i|where is this place|where is here")
        .is_some()
    {
        at.skip("now|exactly|right now");
        return at.at_break().then(|| ask(Question::Where, Phrase::new(Head::Here)));
    }
    if at
        .eat_any("where did we start|where did we begin|where did the tour start|where was the start")
        .is_some()
    {
        return Some(ask(Question::Where, Phrase::new(Head::Start)));
    }
    let indirect = at.eat_any(WHERE_INDIRECT).is_some();
    let kind = if indirect || at.eat_any(WHERE).is_some() {
        Question::Where
    } else if at.eat_any(ROUTE).is_some() {
        Question::Route
    } else {
        at.eat_any(WANTED)?;
        Question::Where
    };
    if kind == Question::Route
        && at.eat_any("where we started|the start|the beginning|the starting point").is_some()
    {
        return Some(ask(kind, Phrase::new(Head::Start)));
    }
    let asked = wanted(at)?;
    if indirect {
        at.eat_any("is|are")?;
    }
    at.skip("at|located|again|exactly|from here|from there|in this building|around here");
    let chain = at.chain(true);
    let (_, phrase) = chain.restrict(&asked.phrase).into_iter().next()?;
    Some(ask(kind, phrase))
}

/// What may be asked for; "where is this gym" asks nothing.
fn wanted(at: &mut Cursor) -> Option<NounPhrase> {
    at.noun_phrase().filter(|p| p.determiner != Determiner::Demonstrative)
}

/// "What room is this", "what is next to the gym", "which room is down the hall".
fn ask_what(at: &mut Cursor) -> Option<Content> {
    let this = at.eat_any(
        "what is this place called|what is this room called|what is this called|what is this place|what is this room|\
         what is this area|what is this space|what is this|what place is this|which place is this|what room is this|\
         which room is this|what room are we in|which room are we in|what room am i in|which room am i in|\
         what kind of room is this|what kind of place is this|what part of the building is this|what area is this|\
         what floor is this|what floor are we on|what do you call this place|what do you call this room|\
         what do you call this|what do they call this place|what do they call this|what do we call this place|\
         what do people call this place|what is the name of this place|what is the name of this room|\
         what is the name of the place|what place are we in|which one is this|what is here",
    );
    if this.is_some() {
        at.skip("now|here|again|right now|please");
        return at.at_break().then(|| ask(Question::What, Phrase::new(Head::Here)));
    }
    if at.eat_any("what was the room we just left|what was that room|what room did we just leave|what was that place|what was that").is_some() {
        return at.at_break().then(|| ask(Question::What, Phrase::new(Head::Previous)));
    }
    let mut x = Phrase::new(Head::Unknown);
    if at.eat_any("what else is|what is there|what is|what are|what lies|what would i find|what do you find|what will i find|what can i find|what do we have|what else is there").is_none() {
        at.eat_any("which|what")?;
        let noun = at.noun_phrase().filter(|p| p.determiner == Determiner::None)?;
        at.eat_any("is|are|lies")?;
        x = noun.phrase;
    }
    let chain = at.chain(false);
    if chain.is_empty() {
        return None;
    }
    let (_, asked) = chain.restrict(&x).into_iter().next()?;
    Some(ask(Question::What, asked))
}

/// "Why do you think the kitchen is over there?"
fn ask_why(at: &mut Cursor) -> Option<Content> {
    if at.eat_each(&["what", "makes|made", "you", "think|believe|say|so sure", "that|"])
        || at.eat_each(&["how", "do|did|can|could", "you", "know|tell|be sure", "that|"])
    {
        let said = statement(at)?;
        return Some(Content::Ask { kind: Question::Why, about: About::Content(Box::new(said)) });
    }
    at.eat_any("why|how come")?;
    if at.eat_any("do you think that|do you think|did you think that|did you think|do you believe|do you say|did you say|do you say that|would you think|are you sure").is_some() {
        let said = statement(at)?;
        return Some(Content::Ask { kind: Question::Why, about: About::Content(Box::new(said)) });
    }
    let said = asked_statement(at)?;
    Some(Content::Ask { kind: Question::Why, about: About::Content(Box::new(said)) })
}

/// The likeliest reading of a statement.
fn statement(at: &mut Cursor) -> Option<Content> {
    let readings = super::label::label_clause(at).or_else(|| locate_clause(at))?;
    readings.first().first().cloned()
}

/// "How far is the gym?"
fn ask_far(at: &mut Cursor) -> Option<Content> {
    at.eat_any("how far is it to|how far is it from here to|how far away is|how far away are|how far is|how far are|how far")?;
    let asked = wanted(at)?;
    at.skip("from here|away|from there");
    Some(ask(Question::HowFar, asked.phrase))
}

/// "Is this the gym?", "is there a bathroom near here?", "are we in the lobby?"
fn ask_whether(at: &mut Cursor, question: bool) -> Option<Content> {
    at.skip("do you know if|do you know whether|can you tell me if|do you think|are you sure|so");
    if at.eat_any("have we been here before|have we been here already|were we here before|have i been here before|have you been here before|have you been here|have we been here").is_some() {
        let seen = Content::Same { what: Phrase::new(Head::Here), like: Phrase::new(Head::Visited), same: true };
        return Some(Content::Ask { kind: Question::Whether, about: About::Content(Box::new(seen)) });
    }
    let said = asked_statement(at).or_else(|| if question { statement(at) } else { None })?;
    Some(Content::Ask { kind: Question::Whether, about: About::Content(Box::new(said)) })
}

/// A statement with its verb first: "is this the gym", "is the gym down the hall".
fn asked_statement(at: &mut Cursor) -> Option<Content> {
    at.eat_any("is not|are not|is|are|am|was")?;
    if at.eat_any("there also|there|there any").is_some() {
        at.skip("any|another|a second");
        let asked = at.noun_phrase().filter(|p| p.kind == Kind::Place)?;
        let chain = at.chain(false);
        return located(&asked.phrase, &chain);
    }
    if at.eat_any("this place|this room|this area|this|these|here|it|that room|that").is_some() {
        let head = if matches!(at.before(), "it") {
            Head::It
        } else if at.before() == "that" {
            Head::There
        } else {
            Head::Here
        };
        at.skip("really|actually|still|also|again|called");
        let named = at.noun_phrase().filter(|p| matches!(p.kind, Kind::Place | Kind::Open));
        return named.map(|p| label(head, p.phrase, Sameness::Open));
    }
    if at.eat_any("we|you|i").is_some() {
        at.skip("now|back|still|already|again|really|inside");
        at.eat_any("in|at|on")?;
        let named = at.noun_phrase().filter(|p| p.kind == Kind::Place)?;
        return Some(label(Head::Here, named.phrase, Sameness::Open));
    }
    let figure = wanted(at).filter(|p| matches!(p.kind, Kind::Place | Kind::Open))?;
    let chain = at.chain(false);
    located(&figure.phrase, &chain)
}

/// The figure where the likeliest reading of the chain says first.
fn located(figure: &Phrase, chain: &Chain) -> Option<Content> {
    let (_, related) = chain.attach().into_iter().next()?;
    related.first().map(|first| super::build::locate(figure, first))
}

/// The name in a question for a place: what a query asks for.
pub(super) fn asked_name(content: &Content) -> Option<Name> {
    match content {
        Content::Ask { kind: Question::Where | Question::Route, about: About::Phrase(phrase) } => {
            phrase.label()
        }
        _ => None,
    }
}
