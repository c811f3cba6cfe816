//! What becomes of a sentence that was understood, and what the guide is told of it.

use crate::edge::{PlaceId, Vertex};
use crate::effects::{Heard, HeardStatus};
use crate::event::Utterance;
use crate::filter::Filter;
use crate::filter::labels::Source;
use crate::geometry::side;
use crate::language::act::{Act, Content, Head, Parse, Phrase};
use crate::language::{self, names_in};
use crate::talk::ledger::{Entry, NAMES_MAX, UTTERANCES_MAX};
use crate::talk::locate::located;
use crate::talk::questions::Said;
use crate::talk::take_in::take_in;
use crate::talk::{Here, Talk};
use std::collections::BTreeMap;
use std::sync::Arc;

/// Groundings told to the guide.
const GROUNDED_TOLD: usize = 5;
/// Less is "not seen yet".
const NOT_SEEN_MAX: f64 = 0.3;
/// A place that nobody can tell.
const WHICH: &str = " But I can't tell which place that is: say it when we are there.";
/// So near is "here".
const HERE_M: f64 = 2.0;

/// Takes in what a sentence says, at the place held when it was said.
pub(crate) fn take(
    talk: &mut Talk,
    filter: &mut Filter,
    (u, said): (&Utterance, Said),
    here: &Here,
) -> (Heard, Vec<Content>) {
    let parse = said.parse;
    let words = words(talk, &parse);
    let asks = |act: &Act| matches!(act.content, Content::Ask { .. }).then(|| act.content.clone());
    let asks: Vec<Content> = parse.acts().iter().filter_map(asks).collect();
    if !parse.acts().iter().any(|act| act.content.asserts()) {
        return (heard(u, HeardStatus::Understood, &parse, words), asks);
    }
    if here.held.is_none() {
        let words = format!("{words} But I have seen nothing yet: say it again when I have moved.");
        return (heard(u, HeardStatus::Refused, &parse, words), asks);
    }
    if talk.ledger.is_full() {
        let words =
            format!("{words} But I can't keep more than {UTTERANCES_MAX} sentences or {NAMES_MAX} names.");
        return (heard(u, HeardStatus::Refused, &parse, words), asks);
    }
    let (held, stamp_ns) = (said.held, said.stamp_ns);
    spell(talk, u, &said.text, &parse);
    let entry =
        Entry { id: u.id.clone(), stamp_ns, text: said.text, parse: parse.clone(), held, stands: true };
    let describes = !located(&parse).is_empty();
    let number = Arc::make_mut(&mut talk.ledger).enter(entry, describes);
    take_in(talk, filter, (number, &parse, held), here);
    let mut heard = heard(u, HeardStatus::Understood, &parse, words);
    heard.grounded = told(filter, number);
    heard.words += unplaced(&parse);
    if describes {
        heard.words += &put(filter, number, held, here);
    }
    (heard, asks)
}

/// Remembers how the guide spells what is named.
fn spell(talk: &mut Talk, u: &Utterance, text: &str, parse: &Parse) {
    let Some(speech) = talk.speech(u) else { return };
    for name in parse.acts().iter().flat_map(|act| names_in(&act.content)) {
        if let Some(spelled) = speech.spelling(text, &name) {
            Arc::make_mut(&mut talk.ledger).spell(&name, spelled);
        }
    }
}

/// Where a description was put, in words.
fn put(filter: &Filter, utterance: u32, held: Vertex, here: &Here) -> String {
    let poses = (here.poses)(filter.best());
    let grounded = filter.best().labels.evidence().iter();
    let grounded: Vec<_> =
        grounded.filter(|e| e.utterance == utterance && e.source == Source::Grounded).collect();
    let seen: f64 = grounded.iter().map(|e| e.weight).sum();
    let likeliest = grounded.iter().max_by(|a, b| a.weight.total_cmp(&b.weight).then(b.place.cmp(&a.place)));
    let Some(likeliest) = likeliest.filter(|_| seen > NOT_SEEN_MAX) else {
        return " I think I have not seen it yet.".to_owned();
    };
    let off = poses[held as usize].between(&poses[likeliest.place as usize]);
    let (distance_m, bearing_rad) = (off.x_m.hypot(off.y_m), off.y_m.atan2(off.x_m));
    if distance_m < HERE_M {
        return " I think that is here.".to_owned();
    }
    format!(" I think that is some {distance_m:.0} m from here, {}.", side(bearing_rad))
}

pub(crate) fn words(talk: &Talk, parse: &Parse) -> String {
    language::words(parse.acts(), |name| talk.ledger.label(name.as_str()).is_some())
}

/// Where the best particle put an utterance, likeliest first.
fn told(filter: &Filter, utterance: u32) -> Vec<(PlaceId, f64)> {
    let mut sums: BTreeMap<Vertex, f64> = BTreeMap::new();
    for e in filter.best().labels.evidence() {
        if e.utterance == utterance && e.source != Source::Denied {
            *sums.entry(e.place).or_insert(0.0) += e.weight;
        }
    }
    let mut told: Vec<(PlaceId, f64)> =
        sums.into_iter().map(|(v, p)| (PlaceId::from(v), p.min(1.0))).collect();
    told.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
    told.truncate(GROUNDED_TOLD);
    told
}

/// What is told of an assertion that was understood, but of nothing that can be put anywhere.
fn unplaced(parse: &Parse) -> &'static str {
    let of = |content: &Content| match content {
        Content::Label { what, .. } if what.label().is_none() => Some(" But I can keep no name of that."),
        Content::Label { at: Phrase { head: Head::Any | Head::Visited | Head::Place, .. }, .. } => {
            Some(WHICH)
        }
        Content::Same { what, like, .. } if !can_be_compared(what, like) => Some(WHICH),
        Content::Locate(l) if l.figure.head == Head::It => {
            Some(" But I don't know what you speak of: name it.")
        }
        _ => None,
    };
    parse.acts().iter().find_map(|act| of(&act.content)).unwrap_or_default()
}

/// Whether two places said to be one, or not, can be told: one is pointed to, and the other too, or it has a name.
fn can_be_compared(what: &Phrase, like: &Phrase) -> bool {
    let pointed = |p: &Phrase| matches!(p.head, Head::Here | Head::It | Head::Previous | Head::Start);
    let known = |p: &Phrase| pointed(p) || p.head == Head::Visited || p.label().is_some();
    pointed(what) && known(like) || pointed(like) && known(what)
}

pub(crate) fn asked(u: &Utterance, parse: &Parse, question: String) -> Heard {
    Heard { question: Some(question.clone()), ..heard(u, HeardStatus::Asked, parse, question) }
}

pub(crate) fn heard(u: &Utterance, status: HeardStatus, parse: &Parse, words: String) -> Heard {
    Heard {
        id: u.id.clone(),
        stamp_ns: u.began_ns,
        text: u.text.clone(),
        status,
        parse: parse.notation().to_owned(),
        grounded: Vec::new(),
        words,
        question: None,
    }
}
