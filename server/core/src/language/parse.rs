//! From a text to weighed analyses, by a hand-written grammar over plain words. A sentence counts only
//! if all of it is read: one unread word and it says nothing to us, since half a sentence may say the
//! opposite of the whole.
//!
//! ```text
//! sentence  = {mark | filler | hedge} clause {("," | "and" | "but") clause}
//! clause    = (ask | renaming | route | label | locate | generic | mend) tag* [", which is" predicate]
//! label     = pointer copula (NAME | relation | adjective | owner) | "we are in" NAME | "we call it" NAME | …
//! locate    = subjects copula (chain | NAME | adjective | owner) | chain copula NAME | "there is" NAME chain
//! chain     = relation {[","] relation}                      attachments: `attach.rs`
//! relation  = {adverb | distance} preposition landmark | "on your left" | "two doors down" | …
//! landmark  = pointer | NAME [chain]
//! mark      = "no" | "actually" | "sorry" | …                takes back what was said
//! mend      = ["not" | "but" | "I mean"] (NAME | chain)      after a clause
//! ```
//!
//! Names are an open vocabulary, so what counts as one is judged with care (`names.rs`): "this is
//! the mural" gives a name, "this is the plan" or "this is great" gives none.

use super::act::{Act, Analysis, Content, Parse, Question, Reason};
use super::aside::{idiom, order};
use super::ask::{ask_clause, asked_name};
use super::attach::Weighed;
use super::build::Readings;
use super::correct::{corrected, eat_mark, fold, mend, renaming};
use super::cursor::Cursor;
use super::generic::generic_clause;
use super::label::label_clause;
use super::locate::{locate_clause, said_further};
use super::names::{Kind, Name};
use super::normalise::{Sentence, sentences};
use super::notation::notation;
use super::route::route_clause;

/// A text that is wholly read says what is read with this probability, its names being known places; the
/// rest is for what the grammar misreads. (All of the examples that it reads are read right; a tenth is
/// a guess on the side of care, and shapes only how hearings compare.)
const READ: f64 = 0.9;
/// What is left of it for each name that is no known kind of place: it may be misheard.
const UNKNOWN_NAME: f64 = 0.8;
/// Analyses of a text that are kept.
const ANALYSES_MAX: usize = 8;

/// Said before a clause; changes nothing.
const FILLERS: &str = ",|and|so|ok|okay|now|um|uh|er|erm|hmm|well|alright|all right|oh|ah|hey|hi|hello|yes|yeah|\
    then|also|next ,|finally|anyway|please|look|listen|as you can see|as you see|you see|you know|by the way|\
    excuse me|at last|robot|everyone|everybody|ladies and gentlemen|folks|guys|good ,|great ,|right ,|like|but|\
    remember that|remember|note that|notice that|i know that|i know|i am sure that|i am sure|in this building|\
    on this floor ,|let us see|as i said|like i said|as we said|as i told you|of course|turns out|it turns out that|\
    it turns out|see|and here|if you look|that said";
/// Said after a clause; changes nothing (a map is one level).
const TAGS: &str = "now|right now|here|right here|over here|today|too|as well|also|then|everyone|everybody|guys|\
    folks|ladies and gentlemen|please|by the way|of course|as you can see|you see|at last|finally|from here|\
    of the building|of this building|in this building|in the building|to the building|to this building|\
    on this floor|on our floor|on the ground floor|on the first floor|on the second floor|on the third floor|\
    on the top floor|actually|though|you know|after all|instead|okay|ok|already|robot|together|anymore";
/// Says that the place is one seen before.
const AGAIN: &str = "again|once again|once more";

/// What a text says; no analyses if it is not understood or longer than
/// [`MAX_TEXT_BYTES`](super::MAX_TEXT_BYTES). Linear in the text.
pub fn parse(text: &str) -> Parse {
    let mut clauses: Vec<Clause> = Vec::new();
    let mut aside = None;
    let mut marked = false;
    for sentence in &sentences(text) {
        match read(sentence, marked) {
            Read::Said(said) => clauses.extend(said),
            Read::Marked => {
                marked = true;
                continue;
            }
            Read::Aside(reason) => aside = aside.or(reason),
        }
        marked = false;
    }
    let analyses = match (clauses.is_empty(), aside) {
        (true, None) => Vec::new(),
        (true, Some(reason)) => {
            let acts = vec![Act { content: Content::Ignored(reason), certainty: 1.0 }];
            vec![Analysis { weight: READ, notation: notation(&acts), acts, hearing: 0 }]
        }
        (false, _) => analyses(&clauses),
    };
    Parse { analyses }
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

/// The name asked for by a question ("where is the gym?") or a bare name ("gym").
pub fn parse_query(text: &str) -> Option<Name> {
    for act in parse(text).acts() {
        if let Some(name) = asked_name(&act.content) {
            return Some(name);
        }
    }
    let sentences = sentences(text);
    let [only] = sentences.as_slice() else { return None };
    let mut at = Cursor::new(&only.words);
    at.skip(FILLERS);
    let asked = at.noun_phrase()?;
    at.skip(TAGS);
    at.at_end().then(|| asked.name()).flatten()
}

/// One clause: its readings, and how sure the speaker is of it.
struct Clause {
    readings: Readings,
    certainty: f64,
}

enum Read {
    Said(Vec<Clause>),
    /// "No." or "I was wrong.": what comes next corrects.
    Marked,
    Aside(Option<Reason>),
}

fn read(sentence: &Sentence, marked: bool) -> Read {
    if let Some(reason) = idiom(&sentence.words) {
        return Read::Aside(Some(reason));
    }
    match clauses(sentence, marked) {
        Some((said, only_mark)) if said.is_empty() => {
            if only_mark {
                Read::Marked
            } else {
                Read::Aside(None)
            }
        }
        Some((said, _)) => Read::Said(said),
        None => Read::Aside(order(&sentence.words)),
    }
}

/// All clauses of one sentence, or none if any part of it is not understood; and whether it has words
/// that take something back.
fn clauses(sentence: &Sentence, mut marked: bool) -> Option<(Vec<Clause>, bool)> {
    let mut at = Cursor::new(&sentence.words);
    let mut said: Vec<Clause> = Vec::new();
    loop {
        let last = said.last().and_then(|c| c.readings.first()).and_then(|(_, all)| all.last()).cloned();
        let before = at;
        let mut lead = Lead { certainty: 1.0, ..Lead::default() };
        lead.read(&mut at);
        marked |= lead.marked;
        if at.at_end() {
            break;
        }
        let mut next = clause(&mut at, sentence.question);
        if next.is_none()
            && let Some(last) = &last
        {
            at = before;
            next = mend(&mut at, last);
        }
        let mut readings = next?;
        finish(&mut at, &mut readings, &mut lead)?;
        for (_, all) in &mut readings {
            *all = std::mem::take(all).into_iter().map(|c| lead.shape(c, marked)).collect();
        }
        marked = false;
        said.push(Clause { readings, certainty: lead.certainty });
        if !(at.at_end() || at.eat_any(",|and|but|so|because").is_some() || mends(&at)) {
            return None;
        }
    }
    if sentence.question {
        said = asked(said)?;
    }
    Some((said, marked))
}

/// A correction may follow without a pause: "this is the kitchen not the gym".
fn mends(at: &Cursor) -> bool {
    at.sees("not|no|sorry|i mean|or rather|rather|make that")
}

/// "This is the gym?" asks whether it is.
fn asked(said: Vec<Clause>) -> Option<Vec<Clause>> {
    let asserts = |c: &Clause| c.readings.iter().any(|(_, all)| all.iter().any(Content::asserts));
    if !said.iter().any(asserts) {
        return Some(said);
    }
    let [only] = <[Clause; 1]>::try_from(said).ok()?;
    let (_, all) = only.readings.into_iter().next()?;
    let content = all.into_iter().next()?;
    let about = super::act::About::Content(Box::new(content));
    let readings = vec![(1.0, vec![Content::Ask { kind: Question::Whether, about }])];
    Some(vec![Clause { readings, certainty: 1.0 }])
}

/// What comes before a clause and shapes it.
#[derive(Default)]
struct Lead {
    marked: bool,
    again: bool,
    denied: bool,
    certainty: f64,
}

impl Lead {
    fn read(&mut self, at: &mut Cursor) {
        loop {
            if at.eat_any(AGAIN).is_some() {
                self.again = true;
            } else if eat_mark(at) {
                self.marked = true;
            } else if let Some((sure, denied)) = at.hedge() {
                self.certainty *= sure;
                self.denied ^= denied;
            } else if at.eat_any(FILLERS).is_none() {
                return;
            }
        }
    }

    /// The content as the words before it shape it.
    fn shape(&self, content: Content, marked: bool) -> Content {
        use super::act::Sameness;
        let content = match content {
            Content::Label { at, what, sameness: Sameness::Open } if self.again => {
                Content::Label { at, what, sameness: Sameness::Same }
            }
            other => other,
        };
        let content = if self.denied { super::build::negate(content) } else { content };
        if marked { corrected(content) } else { content }
    }
}

fn clause(at: &mut Cursor, question: bool) -> Option<Readings> {
    let start = *at;
    let forms: [&dyn Fn(&mut Cursor) -> Option<Readings>; 6] = [
        &|at| ask_clause(at, question),
        &renaming,
        &label_clause,
        &locate_clause,
        &generic_clause,
        &route_clause,
    ];
    for form in forms {
        let mut next = start;
        // A clause that stops short of its end was some other kind of clause.
        if let Some(readings) = form(&mut next).filter(|_| ends(next)) {
            *at = next;
            return Some(readings);
        }
    }
    None
}

/// Does a clause end here?
fn ends(mut at: Cursor) -> bool {
    while at.eat_any(TAGS).is_some() || at.eat_any(AGAIN).is_some() || at.late_hedge().is_some() {}
    at.at_break() || at.sees("and|but|so|which|where|because") || mends(&at)
}

/// Reads what comes after a clause and changes or adds to it.
fn finish(at: &mut Cursor, readings: &mut Readings, lead: &mut Lead) -> Option<()> {
    loop {
        if at.eat_any(AGAIN).is_some() {
            lead.again = true;
        } else if let Some(sure) = at.late_hedge() {
            lead.certainty *= sure;
        } else if at.eat_any(TAGS).is_none() {
            break;
        }
    }
    let before = *at;
    if at.eat_any("where|, where").is_some() && matches!(first(readings)?, Content::Label { .. }) {
        // "…, where we have lunch" says more about the place, nothing that we use.
        while !at.at_end() {
            at.step();
        }
        return Some(());
    }
    *at = before;
    if at.eat_any(", which|which|, also|, or|, and").is_some() {
        let more = said_further(at, first(readings)?);
        match more {
            Some(more) => {
                let (_, all) = more.into_iter().next()?;
                for (_, said) in readings {
                    said.extend(all.iter().cloned());
                }
                at.skip(TAGS);
            }
            None => *at = before,
        }
    }
    Some(())
}

fn first(readings: &Readings) -> Option<&Content> {
    readings.first().and_then(|(_, all)| all.first())
}

/// The likeliest reading of all clauses, and those that differ from it in one clause. (Readings that
/// differ in several are less likely than either, and would make the work grow faster than the text.)
fn analyses(clauses: &[Clause]) -> Vec<Analysis> {
    let mut others: Weighed<(usize, usize)> = Vec::new();
    let mut best = 1.0;
    for (i, clause) in clauses.iter().enumerate() {
        let first = clause.readings.first().map_or(1.0, |(w, _)| *w);
        best *= first;
        others.extend(clause.readings.iter().enumerate().skip(1).map(|(k, (w, _))| (w / first, (i, k))));
    }
    others.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
    others.truncate(ANALYSES_MAX - 1);
    let choices = std::iter::once((1.0, (usize::MAX, 0))).chain(others);
    choices.map(|(ratio, (at, k))| analysis(clauses, best * ratio, at, k)).collect()
}

/// The analysis that takes reading `k` of clause `at`, and the first of all others.
fn analysis(clauses: &[Clause], weight: f64, at: usize, k: usize) -> Analysis {
    let mut acts = Vec::new();
    for (i, clause) in clauses.iter().enumerate() {
        let Some((_, said)) = clause.readings.get(if i == at { k } else { 0 }) else { continue };
        acts.extend(said.iter().map(|c| Act { content: c.clone(), certainty: clause.certainty }));
    }
    let acts = fold(acts);
    let unknown = acts.iter().filter(|a| !names_known(&a.content)).count();
    let weight = weight * READ * UNKNOWN_NAME.powi(unknown.min(8) as i32);
    Analysis { weight, notation: notation(&acts), acts, hearing: 0 }
}

/// Are the names that an act gives those of known kinds of places?
fn names_known(content: &Content) -> bool {
    let known = |phrase: &super::act::Phrase| phrase.label().is_none_or(|n| n.kind() == Kind::Place);
    match content {
        Content::Label { what, .. } => known(what),
        Content::Locate(locate) => known(&locate.figure),
        Content::Alias { what, also } => known(what) && known(also),
        Content::Negate(inner) => names_known(inner),
        Content::Correct { is, .. } => names_known(is),
        _ => true,
    }
}
