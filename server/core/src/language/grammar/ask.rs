//! Questions. They assert nothing.

use crate::language::act::{About, Content, Head, Phrase, Question, Sameness};
use crate::language::grammar::attach::Chain;
use crate::language::grammar::build::{Readings, label, one};
use crate::language::grammar::cursor::Cursor;
use crate::language::grammar::locate::locate_clause;
use crate::language::grammar::noun_phrase::{Determiner, NounPhrase};
use crate::language::grammar::pointed::same_place;
use crate::language::grammar::relate::Related;
use crate::language::lexicon::names::{Kind, Name};
use crate::language::relation::Relation;

/// Who asks, in the middle of a question.
const WHO: &str = "i|we|you|one|somebody|someone";
/// This place, as questions point at it.
const THIS: &str = "this place here|this place|this room here|this room|this area|this space|this spot|this building|\
    this part of the building|this one|this here|this|here|it";
const PLACE_WORD: &str = "room|place|area|space|floor|one|building|hallway|part of the building";

/// "Can you tell me where", "I would like to know where": the statement asked for follows.
fn wonders(at: &mut Cursor, what: &'static str) -> bool {
    let start = *at;
    let asked = at.eat_each(&["can|could|would|will|do|", "you|", "please|", "tell me|show me|remind me|happen to know|know|remember|see|explain", what])
        || at.eat_each(&["i|we", "would like to know|want to know|need to know|wonder|am wondering|are wondering|do not know|forgot|forget", what])
        || at.eat_each(&["do you have|have you got|have you", "any idea|an idea|a clue", what])
        || at.eat_each(&["any idea|any clue|any chance you know|i was wondering", what]);
    if !asked {
        *at = start;
    }
    asked
}

/// "Where is", "where can I find".
fn asks_where(at: &mut Cursor) -> bool {
    at.eat_each(&["where", "exactly|", "is|are|was|were"])
        || at.eat_each(&["where|how", "exactly|", "can|could|do|would|might|will|should|did|may", WHO, "go to find|find|go for|locate|look for|see|look to find"])
        || at.eat_each(&["i|we", "am|are", "looking for|trying to find|trying to locate|searching for|hunting for"])
        || at.eat_each(&["i|we", "need to|want to|have to|would like to|can not", "find|locate"])
        || at.eat_any("looking for|which way is|which way are|in which direction is|in what direction is|which direction is").is_some()
}

/// "How do I get to", "take me to".
fn asks_route(at: &mut Cursor) -> bool {
    let best = "best|fastest|quickest|shortest|easiest|right|";
    let to = "to|towards|into";
    let politely = "can|could|would|will|";
    at.eat_each(&[
        "how",
        "do|can|would|could|should|might|will|did|",
        WHO_MAYBE,
        "best|",
        "get|go|walk|find my way|find our way|find the way|make it|drive",
        "from here|back|",
        to,
    ]) || at.eat_each(&["how", "do|can|would|could|should", WHO, "reach"])
        || at.eat_each(&["how to", "get|go|walk", "from here|back|", to])
        || at.eat_each(&[
            "what is|which is|is this|where is|do you know|i need|",
            "the",
            best,
            "way|route|path|directions",
            "from here|back|",
            "to|for getting to",
        ])
        || at.eat_each(&["which way", "is it|do i go|should i go|do we go|", "to"])
        || at.eat_each(&[
            politely,
            "you|",
            "please|",
            "take|bring|lead|guide|walk|direct|point|drive|escort|show|send",
            "me|us",
            "the way|over|back|",
            to,
        ])
        || at.eat_each(&["point|direct|steer", "me|us", "in the direction of"])
        || at.eat_each(&[
            "can|could|would|will",
            "you",
            "please|",
            "point",
            "me|us",
            "in the direction of|towards",
        ])
        || at.eat_each(&[
            politely,
            "you|",
            "please|",
            "tell me|show me|explain|give me|do you know|know",
            "how to get|how i get|how we get|the way|directions|the directions",
            "from here|back|",
            to,
        ])
        || at.eat_each(&[
            "i|we",
            "need to|want to|have to|would like to|am trying to|are trying to",
            "get|go",
            "from here|back|",
            to,
        ])
        || at
            .eat_any("directions to|do you know the way to|do you know how to get to|is this the way to")
            .is_some()
}

const WHO_MAYBE: &str = "i|we|you|one|somebody|someone|";

/// Reads a question.
pub(crate) fn ask_clause(at: &mut Cursor, question: bool) -> Option<Readings> {
    let start = *at;
    for form in [ask_place, ask_what, ask_why, ask_far] {
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
    let start = *at;
    if at.eat_each(&["where", "exactly|", "are we|am i|are you|is this place|is here|is this"])
        || (wonders(at, "where") && at.eat_each(&["we are|i am|you are|this is|this place is"]))
    {
        at.skip("now|exactly|right now");
        return at.at_break().then(|| ask(Question::Where, Phrase::new(Head::Here)));
    }
    *at = start;
    if at
        .eat_any("where did we start out|where did we come in|where did we start|where did we begin|where did the tour start|where was the start")
        .is_some()
    {
        return Some(ask(Question::Where, Phrase::new(Head::Start)));
    }
    let route = asks_route(at);
    if !route {
        *at = start;
    }
    let indirect = !route && wonders(at, "where");
    let kind = match route {
        true => Question::Route,
        false if indirect || asks_where(at) => Question::Where,
        false => return None,
    };
    if kind == Question::Route
        && at.eat_any("where we started|the start|the beginning|the starting point").is_some()
    {
        return Some(ask(kind, Phrase::new(Head::Start)));
    }
    let asked = wanted(at)?;
    if indirect {
        at.eat_any("is|are|would be|might be|could be")?;
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
    let start = *at;
    if asks_what_here(at) {
        at.skip("now|here|again|right now|please|called|exactly");
        if at.at_break() {
            return Some(ask(Question::What, Phrase::new(Head::Here)));
        }
    }
    *at = start;
    if at.eat_each(&["what", "is|are", "that|those", "place|room|area|spot|", "over there|there|"])
        && at.at_break()
    {
        return Some(ask(Question::What, Phrase::new(Head::There)));
    }
    *at = start;
    let left = "leave|pass|come from|come out of|walk past|walk by|walk through|go past|go by|go through|see|visit|exit";
    if at.eat_each(&["what|which", PLACE_WORD, "did", "we|you|i", "just|", left])
        || at
            .eat_any("what was the room we just left|what was that room|what was that place|what was that")
            .is_some()
    {
        at.skip("back there|there|just now|we just left|we just passed|called");
        return at.at_break().then(|| ask(Question::What, Phrase::new(Head::Previous)));
    }
    *at = start;
    let mut x = Phrase::new(Head::Unknown);
    if at.eat_each(&["what", "else|", "do|can|will|would", "you|we|i", "see|find|have"])
        || at.eat_any("what else is|what is there|what is|what are|what lies|what would i find|what do you find|what will i find|what can i find|what do we have|what else is there").is_some() {
        // "What is the room next to the gym?"
        if let Some(noun) = at.noun_phrase().filter(|p| p.determiner == Determiner::Definite || at.sees("is")) {
            x = noun.phrase;
        }
    } else {
        at.eat_any("which|what")?;
        let noun = at.noun_phrase().filter(|p| p.determiner == Determiner::None)?;
        if at.eat_each(&["leads|lead|goes|go|takes you|takes me", "up|down|out|back|", "to|into"]) {
            x = noun.phrase;
            x.within.push(Related::to(Relation::To, at.landmark()?.0).restriction());
            return Some(ask(Question::What, x));
        }
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

/// "What room is this", "what do they call this place".
fn asks_what_here(at: &mut Cursor) -> bool {
    let start = *at;
    let people = "you|they|we|people|i|everyone|everybody|one";
    at.eat_each(&[
        "what is",
        "the name of|the name for",
        "this place|this room|this area|the place|the room|this spot|this building|this",
    ]) || at.eat_each(&["what|which", "kind of|type of|sort of|", PLACE_WORD, "is", THIS])
        || at.eat_each(&[
            "what|which",
            PLACE_WORD,
            "are we|am i|are you",
            "now|standing|currently|",
            "in|at|on|entering|looking at|standing in|",
        ])
        || at.eat_each(&["what", "do|would|does|should|did", people, "usually|normally|", "call", THIS])
        || at.eat_each(&["what is", THIS])
        || at.eat_each(&["what", "do you think|would you say", THIS, "is"])
        || at.eat_each(&["what", "are we|am i", "looking at|standing in|in"])
        || {
            *at = start;
            wonders(at, "what|which")
                && (at.eat_each(&["this place|this room|this area|this", "is"])
                    || at.eat_each(&[PLACE_WORD, "this is|we are in|i am in|it is"])
                    || at.eat_each(&["they|you|people|we", "call", THIS]))
        }
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
    at.skip("do you know if|do you know whether|can you tell me if|could you tell me if|do you think that|do you think|\
        are you sure that|are you sure|so");
    let past = at.eat_each(&[
        "did|have",
        "we|you|i",
        "just|",
        "pass|passed|leave|left|go past|gone past|walk past|walked past|go by|walk by|come from|come out of",
    ]);
    if past {
        let named = at.noun_phrase().filter(|p| p.kind == Kind::Place)?;
        let said = label(Head::Previous, named.phrase, Sameness::Open);
        return Some(Content::Ask { kind: Question::Whether, about: About::Content(Box::new(said)) });
    }
    if at.eat_any("does|do").is_some() {
        let way = at.noun_phrase().filter(|p| matches!(p.kind, Kind::Place | Kind::Vague))?;
        at.eat_any("lead|go|take you|take us|take me|run|open|connect")?;
        at.skip("up|down|back|out|straight");
        at.eat_any("to|into|onto")?;
        let (landmark, _) = at.landmark()?;
        let said = super::build::locate(&way.phrase, &Related::to(Relation::To, landmark));
        return Some(Content::Ask { kind: Question::Whether, about: About::Content(Box::new(said)) });
    }
    if at.eat_any("have we been here before|have we been here already|were we here before|have i been here before|have you been here before|have you been here|have we been here").is_some() {
        let seen = Content::Same { what: Phrase::new(Head::Here), like: Phrase::new(Head::Visited), same: true };
        return Some(Content::Ask { kind: Question::Whether, about: About::Content(Box::new(seen)) });
    }
    let said = asked_statement(at).or_else(|| if question { statement(at) } else { None })?;
    Some(Content::Ask { kind: Question::Whether, about: About::Content(Box::new(said)) })
}

/// A statement with its verb first: "is this the gym", "is the gym down the hall".
fn asked_statement(at: &mut Cursor) -> Option<Content> {
    let past = at.eat_any("is not|are not|is|are|am|was not|was")?.starts_with("was");
    if at.eat_any("there also|there|there any").is_some() {
        at.skip("any|another|a second");
        let asked = at.noun_phrase().filter(|p| p.kind == Kind::Place)?;
        let chain = at.chain(false);
        return located(&asked.phrase, &chain);
    }
    if at.eat_any("this place|this room|this area|this|these|here|it|that room|that").is_some() {
        let head = if matches!(at.before(), "it") {
            Head::It
        } else if at.before() == "that" || at.before() == "room" && past {
            if past { Head::Previous } else { Head::There }
        } else {
            Head::Here
        };
        at.skip("really|actually|still|also|again|called");
        let start = *at;
        if let Some(same) = same_place(at, &head) {
            return Some(same);
        }
        *at = start;
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

/// The name in a question for a place, its way or whether there is one: what a query asks for.
pub fn asked_name(content: &Content) -> Option<Name> {
    let Content::Ask { kind, about } = content else { return None };
    match (kind, about) {
        (Question::Where | Question::Route | Question::HowFar, About::Phrase(phrase)) => phrase.label(),
        (Question::Whether, About::Content(content)) => match &**content {
            Content::Locate(l) if l.landmarks.iter().all(|p| p.head == Head::Here) => l.figure.label(),
            _ => None,
        },
        _ => None,
    }
}
