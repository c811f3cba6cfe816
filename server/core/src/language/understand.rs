//! What a text says: the grammar reads sentences word by word, the reader those that nobody foresaw.
//!
//! A sentence that the grammar reads whole says what it reads, unless the reader is sure of something else. Others
//! say what the reader makes of them if that is likely enough: half understood is not understood.

use crate::language::act::{About, Act, Analysis, Content, Head, Parse, Phrase, Reason};
use crate::language::agreement::{agree, says_all};
use crate::language::grammar::ask::asked_name;
use crate::language::grammar::cursor::Cursor;
use crate::language::grammar::parse;
use crate::language::grammar::sentence::{FILLERS, TAGS};
use crate::language::lexicon::names::Name;
use crate::language::lexicon::normalise::{MAX_TEXT_BYTES, sentences};
use crate::language::notation::notation;
use crate::language::reader::judge::Judge;
use crate::language::reader::lexicon::{Class, lexicon};
use crate::language::reader::read::analyses;
use crate::language::reader::tokens::tokens;

/// Analyses of a text that are kept.
const ANALYSES_MAX: usize = 8;
/// What the reader makes of a text is heard from so likely on; what is less likely is asked.
pub const HEARD: f64 = 0.55;
/// From so likely on it is worth asking whether that was meant.
const ASKED: f64 = 0.25;
/// What names a person, a time or an event is believed from so likely on.
const ODD: f64 = 0.9;
/// What the grammar reads is heard if the reader holds it for no less likely.
const AGREED: f64 = 0.2;

/// What a text says; no analyses if it is not understood or longer than
/// [`MAX_TEXT_BYTES`](super::MAX_TEXT_BYTES). Linear in the text.
pub fn parse(text: &str) -> Parse {
    parse_by(text, Judge::learned())
}

/// As [`parse`], by another judge.
pub fn parse_by(text: &str, judge: &Judge) -> Parse {
    let mut read = read_by(text, judge);
    if says_no_longer(text) {
        read.analyses.iter_mut().for_each(left_behind);
    }
    read
}

fn read_by(text: &str, judge: &Judge) -> Parse {
    let mut exact = parse::parse(text);
    exact.analyses.iter_mut().for_each(it_is_here);
    if text.len() > MAX_TEXT_BYTES {
        return exact;
    }
    let read = analyses(text, judge);
    let Some(best) = read.first() else { return exact };
    let Some(first) = exact.best() else { return said(text, read) };
    let agreed = read.iter().find(|a| agree(&first.acts, &a.acts)).map_or(0.0, |a| a.weight);
    // Two that agree are seldom both wrong. Silence overrules nothing: the judge is silent on names that it never met.
    if agreed >= AGREED || best.acts.is_empty() || is_known(&first.acts) {
        return exact;
    }
    // Of one sentence it is believed that says more, or that speaks alone; of several the grammar says too much.
    let is_one = text.trim_end().trim_end_matches(['.', '?', '!']).split(['.', '?', '!']).count() < 2;
    if is_one && says_all(&first.acts, &best.acts) {
        return exact;
    }
    // Where the reader is not sure of the whole, it may be of each part.
    let likely = |act: &Act| {
        let with = |a: &&Analysis| says_all(&a.acts, std::slice::from_ref(act));
        read.iter().filter(with).map(|a| a.weight).sum::<f64>() >= AGREED
    };
    let stands = is_one && first.acts.len() == 1 || first.acts.iter().all(likely);
    let heard = said(text, read);
    if heard.analyses.is_empty() && stands { exact } else { heard }
}

/// "It is the gym", where nothing was spoken of before, is said of here.
fn it_is_here(reading: &mut Analysis) {
    fn of(content: &mut Content) {
        match content {
            Content::Label { at, .. } if at.head == Head::It => at.head = Head::Here,
            Content::Negate(inner) => of(inner),
            Content::Correct { was, is } => was.iter_mut().chain([is]).for_each(|content| of(content)),
            _ => {}
        }
    }
    if let Some(first) = reading.acts.first_mut() {
        of(&mut first.content);
        reading.notation = notation(&reading.acts);
    }
}

/// What the judge knows nothing of: figures of speech, names that were misheard, distances and counts, where one
/// started or was before, places told by where they are.
fn is_known(acts: &[Act]) -> bool {
    acts.iter().any(|act| is_only_read_exactly(&act.content))
}

fn is_only_read_exactly(content: &Content) -> bool {
    let is_known = |p: &Phrase| matches!(p.head, Head::Start | Head::Visited) || !p.within.is_empty();
    match content {
        Content::Ignored(reason) => *reason == Reason::Idiom,
        Content::Locate(l) => {
            l.repaired || l.modifiers.distance.is_some() || l.modifiers.count.is_some() || is_known(&l.figure)
        }
        Content::Label { at: a, what: b, .. }
        | Content::Alias { what: a, also: b }
        | Content::Same { what: a, like: b, .. } => is_known(a) || is_known(b),
        Content::Negate(inner) | Content::Ask { about: About::Content(inner), .. } => {
            is_only_read_exactly(inner)
        }
        Content::Ask { about: About::Phrase(p), .. } => matches!(p.head, Head::Here | Head::There),
        _ => false,
    }
}

/// What is likely enough to be heard.
fn said(text: &str, read: Vec<Analysis>) -> Parse {
    let foretold = foretells(text);
    let enough = |a: &Analysis| {
        let any = |is: fn(&Content) -> bool| a.acts.iter().any(|act| is(&act.content));
        let least = match () {
            () if foretold && any(is_of_here) => f64::INFINITY,
            () if any(is_odd) => ODD,
            () => HEARD,
        };
        !a.acts.is_empty() && a.weight >= least
    };
    let heard = read.first().is_some_and(enough);
    Parse {
        analyses: if heard { read.into_iter().filter(|a| !a.acts.is_empty()).collect() } else { Vec::new() },
    }
}

/// What a text may say of which nothing is likely enough to be heard: worth asking.
pub fn guess(text: &str) -> Option<Analysis> {
    let likely = |a: &Analysis| !a.acts.is_empty() && a.weight >= ASKED;
    let best = analyses(text, Judge::learned()).into_iter().find(likely)?;
    let is_of_now = |act: &Act| is_of_here(&act.content) && foretells(text);
    let is_sane = !best.acts.iter().any(|act| is_odd(&act.content) || is_of_now(act));
    is_sane.then_some(best)
}

/// "This isn't the gym any more": it was, and what was said of it holds.
fn says_no_longer(text: &str) -> bool {
    let words = tokens(text);
    let is = |at: usize, word: &str| words.get(at).is_some_and(|t| t.text == word);
    (0..words.len()).any(|at| {
        is(at, "anymore") || is(at, "any") && is(at + 1, "more") || is(at, "no") && is(at + 1, "longer")
    })
}

/// What is called something else by now corrects nothing.
fn left_behind(reading: &mut Analysis) {
    for act in &mut reading.acts {
        if let Content::Correct { was, is } = &act.content
            && was.as_deref().is_none_or(is_of_here)
            && is_of_here(is)
        {
            act.content = (**is).clone();
        }
    }
    reading.notation = notation(&reading.acts);
}

/// Whether it says what will be: that is nothing of here and now.
fn foretells(text: &str) -> bool {
    let words = tokens(text);
    let is = |at: usize, word: &str| words.get(at).is_some_and(|t| t.text == word);
    let be = |at: usize| is(at, "be") || is(at + 1, "be") && words[at].class == Class::Adv;
    (0..words.len())
        .any(|at| is(at, "will") && be(at + 1) || is(at, "going") && is(at + 1, "to") && be(at + 2))
}

fn is_of_here(content: &Content) -> bool {
    matches!(content, Content::Label { at, .. } if at.head == Head::Here)
}

/// Whether what is named is hardly a place: a person, a time, an event, or nothing that tells it from others.
fn is_odd(content: &Content) -> bool {
    let is_none = |phrase: &Phrase| phrase.full_name().is_some_and(|name| !may_be_a_place(&name));
    match content {
        Content::Label { what, .. } => is_none(what),
        Content::Same { like, .. } => is_none(like),
        Content::Locate(locate) => is_none(&locate.figure),
        Content::Correct { is, .. } => is_odd(is),
        _ => false,
    }
}

fn may_be_a_place(name: &Name) -> bool {
    let is_none = |word: &str| {
        matches!(lexicon().class(word), Class::Person | Class::Time)
            || lexicon()
                .sense(word)
                .is_some_and(|s| matches!(s, "person" | "time" | "event" | "animal" | "abstract"))
    };
    !name.is_vague() && !name.head().is_some_and(is_none)
}

/// What is said, over all hearings of a recogniser: the text and its alternatives, each with its
/// probability. The text is the likeliest hearing; analyses of several hearings that agree are one.
pub fn parse_hearings(text: &str, alternatives: &[(String, f64)]) -> Parse {
    let others: Vec<f64> =
        alternatives.iter().map(|(_, p)| if p.is_finite() { p.clamp(0.0, 1.0) } else { 0.0 }).collect();
    let most = others.iter().copied().fold(0.0, f64::max);
    let first = (1.0 - others.iter().sum::<f64>()).max(most).max(f64::MIN_POSITIVE);
    let sum = first + others.iter().sum::<f64>();
    let hearings =
        std::iter::once((text, first)).chain(alternatives.iter().map(|(t, _)| t.as_str()).zip(others));
    let mut all: Vec<Analysis> = Vec::new();
    for (k, (heard, p)) in hearings.enumerate() {
        for mut analysis in parse(heard).analyses {
            analysis.weight *= p / sum;
            analysis.hearing = k;
            match all.iter_mut().find(|a| a.notation == analysis.notation) {
                Some(same) => same.weight += analysis.weight,
                None => all.push(analysis),
            }
        }
    }
    // An order or a figure of speech says nothing: it yields to what says something.
    let says = |a: &Analysis| !a.acts.iter().all(|act| matches!(act.content, Content::Ignored(_)));
    all.sort_by(|a, b| {
        says(b).cmp(&says(a)).then(b.weight.total_cmp(&a.weight)).then(a.hearing.cmp(&b.hearing))
    });
    all.truncate(ANALYSES_MAX);
    Parse { analyses: all }
}

/// The name asked for by a question ("where is the gym?") or a bare name ("gym"), which needs no judge.
pub fn parse_query(text: &str) -> Option<Name> {
    bare_name(text).or_else(|| parse(text).acts().iter().find_map(|act| asked_name(&act.content)))
}

/// The name that is all of a text.
fn bare_name(text: &str) -> Option<Name> {
    let sentences = sentences(text);
    let [only] = sentences.as_slice() else { return None };
    let mut at = Cursor::new(&only.words);
    at.skip(FILLERS);
    let asked = at.noun_phrase()?;
    at.skip(TAGS);
    at.at_end().then(|| asked.name()).flatten()
}
