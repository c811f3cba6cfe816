//! Sentences: clauses with what comes before, between and after them. A sentence counts only if all of
//! it is read: one unread word and it says nothing to us, since half a sentence may say the opposite of
//! the whole.

use crate::language::act::{About, Content, Head, Question, Reason, Sameness};
use crate::language::grammar::aside::{idiom, order};
use crate::language::grammar::ask::ask_clause;
use crate::language::grammar::build::{Readings, negate, one};
use crate::language::grammar::correct::{corrected, eat_mark, mend, renaming};
use crate::language::grammar::cursor::Cursor;
use crate::language::grammar::generic::generic_clause;
use crate::language::grammar::label::label_clause;
use crate::language::grammar::locate::{locate_clause, said_further};
use crate::language::grammar::route::route_clause;
use crate::language::lexicon::normalise::Sentence;

/// Said before a clause; changes nothing.
pub(crate) const FILLERS: &str = ",|and|so|ok|okay|now|um|uh|er|erm|hmm|well|alright|all right|oh|ah|hey|hi|hello|yes|yeah|\
    then|also|next ,|finally|anyway|please|look|listen|as you can see|as you see|you see|you know|by the way|\
    excuse me|at last|robot|everyone|everybody|ladies and gentlemen|folks|guys|good ,|great ,|right ,|like|but|\
    remember that|remember|note that|notice that|i know that|i know|i am sure that|i am sure|in this building|\
    on this floor ,|let us see|as i said|like i said|as we said|as i told you|of course|turns out|it turns out that|as you come in|as you walk in|as you enter ,|when you come in|when you walk in|if you come in|\
    from here|from where we are|earlier|before|\
    it turns out|see|and here|if you look|that said";
/// Said after a clause; changes nothing (a map is one level).
pub(crate) const TAGS: &str = "now|right now|here|right here|over here|today|too|as well|also|then|everyone|everybody|guys|\
    folks|ladies and gentlemen|please|by the way|of course|as you can see|you see|at last|finally|from here|\
    of the building|of this building|in this building|in the building|to the building|to this building|\
    on this floor|on our floor|on the ground floor|on the first floor|on the second floor|on the third floor|\
    on the top floor|actually|though|you know|after all|instead|okay|ok|already|robot|together|anymore";
/// Says that the place is one seen before.
const AGAIN: &str = "again|once again|once more";

/// What is made of a sentence.
pub(crate) enum Read {
    Said(Vec<Readings>),
    /// "No." or "I was wrong.": what comes next corrects.
    Marked,
    Aside(Option<Reason>),
}

/// Reads a sentence; `marked` if what it says takes back what was said before.
pub(crate) fn read(sentence: &Sentence, marked: bool) -> Read {
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
fn clauses(sentence: &Sentence, mut marked: bool) -> Option<(Vec<Readings>, bool)> {
    let mut at = Cursor::new(&sentence.words);
    let mut said: Vec<Readings> = Vec::new();
    loop {
        let last = said.last().and_then(|c| c.first().last()).cloned();
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
        // At the end of a way one is not here.
        let led = matches!(last, Some(Content::Route { .. }));
        if led && readings.first().iter().any(is_here) {
            return None;
        }
        finish(&mut at, &mut readings, &mut lead)?;
        // What says itself what it corrects needs no mark.
        marked &= !readings.first().iter().any(|c| matches!(c, Content::Correct { .. }));
        let certainty = readings.certainty * lead.certainty;
        said.push(Readings { certainty, ..readings.map(|c| lead.shape(c, marked)) });
        marked = false;
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
/// Does it say what or where the place held is?
fn is_here(said: &Content) -> bool {
    match said {
        Content::Label { at, .. } => at.head == Head::Here,
        Content::Locate(locate) => locate.figure.head == Head::Here,
        _ => false,
    }
}

fn mends(at: &Cursor) -> bool {
    at.sees("not|no|sorry|i mean|or rather|rather|make that")
}

/// "This is the gym?" asks whether it is.
fn asked(said: Vec<Readings>) -> Option<Vec<Readings>> {
    if !said.iter().any(|c| c.all.iter().any(|(_, all)| all.iter().any(Content::asserts))) {
        return Some(said);
    }
    let [only] = said.as_slice() else { return None };
    let content = only.first().first()?.clone();
    Some(vec![one(Content::Ask { kind: Question::Whether, about: About::Content(Box::new(content)) })])
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
            // "Everyone calls it …", "folks here call it …" are subjects.
            let group = matches!(at.peek(0), "everyone" | "everybody" | "folks");
            if group
                && matches!(
                    at.peek(1),
                    "calls" | "call" | "just" | "also" | "here" | "around" | "usually" | "refers" | "knows"
                )
            {
                return;
            }
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
        let content = match content {
            Content::Label { at, what, sameness: Sameness::Open } if self.again => {
                Content::Label { at, what, sameness: Sameness::Same }
            }
            other => other,
        };
        let content = if self.denied { negate(content) } else { content };
        if marked { corrected(content) } else { content }
    }
}

/// A way to read a clause.
type Form<'f> = &'f dyn Fn(&mut Cursor) -> Option<Readings>;

fn clause(at: &mut Cursor, question: bool) -> Option<Readings> {
    let start = *at;
    let forms: [Form; 6] = [
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
    if at.eat_any("where|, where").is_some() && matches!(readings.first().first()?, Content::Label { .. }) {
        // "…, where we have lunch" says more about the place, nothing that we use.
        while !at.at_end() {
            at.step();
        }
        return Some(());
    }
    *at = before;
    if at.eat_any(", which|which|, also|, or|, and").is_some() {
        let more = said_further(at, readings.first().first()?);
        match more {
            Some(more) => {
                for (_, said) in &mut readings.all {
                    said.extend(more.first().iter().cloned());
                }
                at.skip(TAGS);
            }
            None => *at = before,
        }
    }
    Some(())
}
