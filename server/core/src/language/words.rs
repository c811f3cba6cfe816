//! Acts in words, for the guide: what was understood.

use crate::language::act::{
    About, Act, Content, Head, Locate, Ordinal, Owner, Phrase, Quantity, Question, Reason, Restriction,
    Sameness, Unit,
};
use crate::language::lexicon::names::Name;
use crate::language::relation::Relation;

/// What the guide is told when nothing was understood.
pub const NOT_UNDERSTOOD: &str = "I did not understand; nothing was changed. Try: this is the kitchen.";

/// The acts in words: "I heard: the gym is down the hallway. I don't know of a hallway yet."
/// `known` tells whether a landmark's name has been taught; it is asked about no other name.
pub fn words(acts: &[Act], known: impl Fn(&Name) -> bool) -> String {
    match acts {
        [] => return NOT_UNDERSTOOD.to_owned(),
        [Act { content: Content::Ignored(reason), .. }] => return ignored(*reason).to_owned(),
        _ => {}
    }
    let question = matches!(acts.last(), Some(Act { content: Content::Ask { .. }, .. }));
    let mut text = format!("I heard: {}{}", statement(acts), if question { "?" } else { "." });
    let mut missing: Vec<Name> = Vec::new();
    for act in acts {
        let Content::Locate(locate) = &act.content else { continue };
        for name in locate.landmarks.iter().filter_map(Phrase::label) {
            if !missing.contains(&name) && !known(&name) {
                text.extend([" I don't know of ", &with_indefinite(&name), " yet."]);
                missing.push(name);
            }
        }
    }
    text
}

/// What the acts say, without a full stop: "the gym is down the hallway".
pub fn statement(acts: &[Act]) -> String {
    let said: Vec<String> =
        acts.iter().map(|a| format!("{}{}", doubt(a.certainty), clause(&a.content))).collect();
    said.join(", and ")
}

fn ignored(reason: Reason) -> &'static str {
    match reason {
        Reason::Command => "I heard an order; I only make maps. Nothing was changed.",
        Reason::Idiom => "I heard a figure of speech; nothing was changed.",
        Reason::Chatter => NOT_UNDERSTOOD,
    }
}

fn doubt(certainty: f64) -> &'static str {
    match certainty {
        c if c >= 1.0 => "",
        c if c > 0.6 => "probably, ",
        _ => "maybe, ",
    }
}

fn clause(content: &Content) -> String {
    match content {
        Content::Label { at, what, sameness } => label(at, what, *sameness),
        Content::Locate(locate) => located(locate),
        Content::Alias { what, also } => format!("{} is also called {}", said(what), said(also)),
        Content::Attribute { what, value } => format!("{} {} {value}", said(what), verb(what)),
        Content::Negate(inner) => format!("it is not so that {}", clause(inner)),
        Content::Correct { was: None, is } => format!("{}, whatever was said before", clause(is)),
        Content::Correct { was: Some(was), is } => {
            format!("{}, and it is not so that {}", clause(is), clause(was))
        }
        Content::Same { what, like, same } => {
            let how = if *same { "the same place as" } else { "another place than" };
            format!("{} {} {how} {}", said(what), verb(what), said(like))
        }
        Content::Ask { kind, about } => asked(*kind, about),
        Content::Generic { figure, relation, landmark, quantity } => {
            let often = match quantity {
                Quantity::All => "always",
                Quantity::Usually => "usually",
                Quantity::Sometimes => "sometimes",
                Quantity::Never => "never",
            };
            format!("in general, {} is {often} {} {}", said(figure), relation.words(), said(landmark))
        }
        Content::Route { then: None, .. } => "directions, which I do not follow".to_owned(),
        Content::Route { then: Some(then), .. } => format!("directions, at whose end {}", clause(then)),
        Content::Ignored(_) => "something that says nothing of places".to_owned(),
    }
}

fn label(at: &Phrase, what: &Phrase, sameness: Sameness) -> String {
    if at.head == Head::Here {
        return match sameness {
            Sameness::Open => format!("you are in {}", said(what)),
            Sameness::Same => format!("you are back in {}", said(what)),
            Sameness::Other => format!("you are in another {}", said(what).trim_start_matches("the ")),
        };
    }
    format!("{} is called {}", said(at), said(what))
}

fn located(locate: &Locate) -> String {
    let place = related(&Restriction {
        relation: locate.relation,
        modifiers: locate.modifiers,
        landmarks: locate.landmarks.clone(),
    });
    if locate.figure.head == Head::Here {
        return format!("you are {place}");
    }
    let guess = if locate.repaired { ", if I heard the name right" } else { "" };
    format!("{} {} {place}{guess}", said(&locate.figure), verb(&locate.figure))
}

fn related(r: &Restriction) -> String {
    let mut words = Vec::new();
    if r.modifiers.just {
        words.push("just".to_owned());
    }
    if let Some(d) = r.modifiers.distance {
        let unit = match d.unit {
            Unit::Metre => "metres",
            Unit::Foot => "feet",
            Unit::Yard => "yards",
            Unit::Step => "steps",
        };
        words.push(format!("{} {unit}", d.value));
    }
    if let Some(n) = r.modifiers.count {
        words.push(format!("{n} floors"));
    }
    let landmarks: Vec<String> = r.landmarks.iter().map(said).collect();
    words.push(fixed(r).unwrap_or_else(|| format!("{} {}", r.relation.words(), landmarks.join(" and "))));
    words.join(" ")
}

/// Relations that are said without "the landmark"; who was spoken to is now the one who speaks.
fn fixed(r: &Restriction) -> Option<String> {
    let head = &r.landmarks.first()?.head;
    let text = match (r.relation, head) {
        (Relation::LeftSide, Head::Path) => "on the left",
        (Relation::RightSide, Head::Path) => "on the right",
        (Relation::LeftOf, Head::Agent) => "on my left",
        (Relation::RightOf, Head::Agent) => "on my right",
        (Relation::LeftOf, Head::Speaker) => "on your left",
        (Relation::RightOf, Head::Speaker) => "on your right",
        (Relation::AheadOf, Head::Agent) => "straight ahead",
        (Relation::LevelUp, Head::Here) if r.modifiers.count.is_some() => "up",
        (Relation::LevelDown, Head::Here) if r.modifiers.count.is_some() => "down",
        (Relation::LevelUp, Head::Here) => "upstairs",
        (Relation::LevelDown, Head::Here) => "downstairs",
        (Relation::NextTo, Head::Here) => "next door",
        (Relation::At, Head::There) => "there",
        (Relation::At, Head::Here) => "here",
        _ => return None,
    };
    Some(text.to_owned())
}

fn asked(kind: Question, about: &About) -> String {
    match (kind, about) {
        (Question::Where, About::Phrase(p)) => format!("where {} {}", verb(p), said(p)),
        (Question::What, About::Phrase(p)) => format!("what {} {}", verb(p), said(p)),
        (Question::Route, About::Phrase(p)) => format!("how do you get to {}", said(p)),
        (Question::HowFar, About::Phrase(p)) => format!("how far {} {}", verb(p), said(p)),
        (Question::Why, About::Content(c)) => format!("why do I think that {}", clause(c)),
        (_, About::Content(c)) => format!("is it so that {}", clause(c)),
        (_, About::Phrase(p)) => format!("what of {}", said(p)),
    }
}

/// A phrase as one says it: "the second door on the right".
fn said(phrase: &Phrase) -> String {
    let f = &phrase.features;
    let mut text = match (&phrase.head, phrase.label()) {
        (_, Some(name)) if f.ordinal.is_none() && f.count.is_none() && f.owner.is_none() => {
            name.with_article()
        }
        (Head::Named(kind), label) => {
            let owner = match &f.owner {
                Some(Owner::Speaker) => "your ",
                Some(Owner::Named(_)) => "",
                None => "the ",
            };
            let nth = match f.ordinal {
                Some(which) => ordinal(which) + " ",
                None => f.count.map_or_else(String::new, |n| format!("{} ", nth(n))),
            };
            let name = label.as_ref().map_or(kind.as_str(), Name::as_str);
            format!("{owner}{nth}{name}")
        }
        (Head::Place, _) if f.purpose.is_some() => {
            format!("the place where people {}", f.purpose.as_deref().unwrap_or_default())
        }
        (Head::Place, _) => {
            let nth = f.ordinal.map_or(String::new(), |o| ordinal(o) + " ");
            format!("the {nth}{}", if nth.is_empty() { "place" } else { "one" })
        }
        (head, _) => pointer(head).to_owned(),
    };
    for r in &phrase.within {
        text.extend([" ", &related(r)]);
    }
    text
}

fn ordinal(which: Ordinal) -> String {
    match which {
        Ordinal::Nth(n) => nth(n),
        Ordinal::Last => "last".to_owned(),
        Ordinal::Next => "next".to_owned(),
    }
}

fn nth(n: u32) -> String {
    const NTH: [&str; 11] =
        ["", "first", "second", "third", "fourth", "fifth", "sixth", "seventh", "eighth", "ninth", "tenth"];
    NTH.get(n as usize).filter(|w| !w.is_empty()).map_or_else(|| format!("{n}th"), |w| (*w).to_owned())
}

fn pointer(head: &Head) -> &'static str {
    match head {
        Head::Here => "here",
        Head::There => "that place",
        Head::It => "it",
        Head::Agent => "me",
        Head::Speaker => "you",
        Head::Path => "the way",
        Head::Previous => "the place we just left",
        Head::Start => "where we started",
        Head::Unknown => "the place",
        Head::Visited => "a place seen before",
        Head::Any | Head::Place | Head::Named(_) => "some place",
    }
}

fn verb(phrase: &Phrase) -> &'static str {
    let stairs = phrase.label().is_some_and(|n| n.as_str().ends_with("stairs"));
    if stairs { "are" } else { "is" }
}

/// "a hallway", "an elevator", "lecture hall five".
fn with_indefinite(name: &Name) -> String {
    let text = name.as_str();
    if !name.with_article().starts_with("the ") {
        return text.to_owned();
    }
    if text.ends_with("stairs") {
        return format!("any {text}");
    }
    format!("{} {text}", if text.starts_with(['a', 'e', 'i', 'o', 'u']) { "an" } else { "a" })
}
