//! Step 3 of Algorithm 1, the sentences: what each says and what becomes of it.

use crate::edge::{PlaceId, Vertex};
use crate::effects::{Heard, HeardStatus};
use crate::event::{StampNs, Utterance};
use crate::filter::Filter;
use crate::filter::labels::Source;
use crate::language;
use crate::language::act::{Content, Head, Parse, Phrase};
use crate::talk::describe::located;
use crate::talk::ledger::{Entry, UTTERANCES_MAX};
use crate::talk::mend::undo;
use crate::talk::take_in::take_in;
use crate::talk::{Here, Talk};
use std::collections::BTreeMap;
use std::f64::consts::FRAC_PI_4;
use std::sync::Arc;

/// Groundings told to the guide.
const GROUNDED_TOLD: usize = 5;

/// "It" is what was spoken of no longer ago.
const TOPIC_NS: i64 = 60_000_000_000;
/// Less is "not seen yet".
const NOT_SEEN_MAX: f64 = 0.3;
/// A place that nobody can tell.
const WHICH: &str = " But I can't tell which place that is: say it when we are there.";
/// So near is "here".
const HERE_M: f64 = 2.0;
/// Directions from a robot's nose, by eighths to the left.
const SIDES: [&str; 8] = [
    "straight ahead",
    "ahead on the left",
    "on the left",
    "behind on the left",
    "behind",
    "behind on the right",
    "on the right",
    "ahead on the right",
];

/// Takes a sentence: parses it, weighs every particle by it and updates its labels.
pub(crate) fn hear(talk: &mut Talk, filter: &mut Filter, u: &Utterance, here: &Here) -> Heard {
    if !filter.config.language {
        let words = "Nobody listens: language is switched off.".to_owned();
        return heard(u, HeardStatus::Refused, &Parse::default(), words);
    }
    if talk.ledger.has(&u.id) {
        let parse = language::parse_hearings(&u.text, &u.alternatives);
        let words = format!("{} (I had heard that already.)", words(talk, &parse));
        return heard(u, HeardStatus::Understood, &parse, words);
    }
    let retracted = u
        .retracts
        .as_ref()
        .map(|id| undo(talk, filter, Some(id)).unwrap_or_else(|why| format!("But {why}.")));
    let mut heard = hear_anew(talk, filter, u, here);
    if let Some(retracted) = retracted {
        heard.words = format!("{retracted} {}", heard.words);
    }
    heard
}

fn hear_anew(talk: &mut Talk, filter: &mut Filter, u: &Utterance, here: &Here) -> Heard {
    let mut parse = language::parse_hearings(&u.text, &u.alternatives);
    language::resolve_it(&mut parse, topic(talk, u.began_ns));
    let words = words(talk, &parse);
    if parse.acts().iter().all(|act| matches!(act.content, Content::Ignored(_))) {
        return heard(u, HeardStatus::NotUnderstood, &parse, words);
    }
    if !parse.acts().iter().any(|act| act.content.asserts()) {
        return heard(u, HeardStatus::Understood, &parse, words);
    }
    let Some(held) = here.held else {
        let words = format!("{words} But I have seen nothing yet: say it again when I have moved.");
        return heard(u, HeardStatus::Refused, &parse, words);
    };
    if talk.ledger.is_full() {
        let words = format!("{words} But I can't keep more than {UTTERANCES_MAX} sentences.");
        return heard(u, HeardStatus::Refused, &parse, words);
    }
    let entry = Entry {
        id: u.id.clone(),
        stamp_ns: u.began_ns,
        text: u.text.clone(),
        parse: parse.clone(),
        held,
        stands: true,
    };
    let describes = !located(&parse).is_empty();
    let number = Arc::make_mut(&mut talk.ledger).enter(entry, describes);
    take_in(talk, filter, (number, &parse, held), here);
    let mut heard = heard(u, HeardStatus::Understood, &parse, words);
    heard.grounded = told(filter, number);
    heard.words += unplaced(&parse);
    if describes {
        heard.words += &put(filter, number, held, here);
    }
    heard
}

/// What the newest sentence spoke of, if that is not too long ago for "it".
fn topic(talk: &Talk, now_ns: StampNs) -> Option<&Phrase> {
    let newest = talk.ledger.entries().last().filter(|e| e.stands)?;
    let since_ns = now_ns.saturating_sub(newest.stamp_ns);
    (0..=TOPIC_NS).contains(&since_ns).then(|| language::topic(&newest.parse)).flatten()
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
    let side = SIDES[((bearing_rad / FRAC_PI_4).round() as i32).rem_euclid(8) as usize];
    format!(" I think that is some {distance_m:.0} m from here, {side}.")
}

fn words(talk: &Talk, parse: &Parse) -> String {
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

fn heard(u: &Utterance, status: HeardStatus, parse: &Parse, words: String) -> Heard {
    Heard {
        id: u.id.clone(),
        stamp_ns: u.began_ns,
        text: u.text.clone(),
        status,
        parse: parse.notation().to_owned(),
        grounded: Vec::new(),
        words,
    }
}
