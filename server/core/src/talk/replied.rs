//! Replies: "yes" to what was asked, and "scratch that".

use crate::effects::{Heard, HeardStatus};
use crate::event::Utterance;
use crate::filter::Filter;
use crate::language::act::{Content, Parse};
use crate::talk::accept::{asked, heard, take};
use crate::talk::ledger::Entry;
use crate::talk::mend::strike;
use crate::talk::questions::{Question, Then};
use crate::talk::{Here, Talk};
use std::sync::Arc;

const MINUTE_NS: i64 = 60_000_000_000;
/// What was said longer ago is not taken back without a question.
const UNDONE_NS: i64 = 2 * MINUTE_NS;

/// "Yes": what was asked about is done.
pub(crate) fn answered(
    talk: &mut Talk,
    filter: &mut Filter,
    u: &Utterance,
    here: &Here,
    (question, then): (&Question, Then),
) -> (Heard, Vec<Content>) {
    let nothing = Parse::default();
    match then {
        Then::Nothing => {
            note(talk, u, here);
            let words = if question.then[1] == Then::Nothing && question.names == [None, None] {
                "All right, I keep nothing of it. Say it in other words, if you like."
            } else {
                "All right: it stays as it is."
            };
            (heard(u, HeardStatus::Understood, &nothing, words.to_owned()), Vec::new())
        }
        Then::TakeBack(number) => {
            note(talk, u, here);
            let words = take_back(talk, filter, number);
            (heard(u, HeardStatus::Understood, &nothing, words), Vec::new())
        }
        Then::Take(said) => {
            if let Some(number) = said.instead_of {
                strike(talk, filter, number);
            }
            take(talk, filter, (u, said), here)
        }
    }
}

/// "Scratch that": the newest sentence is taken back, but not one of long ago without a question.
pub(crate) fn undone(talk: &mut Talk, filter: &mut Filter, u: &Utterance, here: &Here) -> Heard {
    let nothing = Parse::default();
    let Some(number) = talk.ledger.standing(None) else {
        let words = "There is nothing left to take back.".to_owned();
        return heard(u, HeardStatus::NotUnderstood, &nothing, words);
    };
    let entry = &talk.ledger.entries()[number as usize];
    let since_ns = u.began_ns.saturating_sub(entry.stamp_ns);
    if since_ns > UNDONE_NS {
        let minutes = (since_ns as f64 / MINUTE_NS as f64).round().max(1.0);
        let ago = if minutes < 2.0 { "a minute".to_owned() } else { format!("{minutes} minutes") };
        let words = format!("Shall I take back \"{}\", which you said {ago} ago?", entry.text);
        let question = Question {
            id: u.id.clone(),
            stamp_ns: u.began_ns,
            words: words.clone(),
            then: [Then::TakeBack(number), Then::Nothing],
            names: [const { None }; 2],
        };
        talk.questions.ask(question);
        return asked(u, &nothing, words);
    }
    note(talk, u, here);
    let words = take_back(talk, filter, number);
    heard(u, HeardStatus::Understood, &nothing, words)
}

fn take_back(talk: &mut Talk, filter: &mut Filter, number: u32) -> String {
    if !talk.ledger.entries()[number as usize].stands {
        return "That was taken back before.".to_owned();
    }
    strike(talk, filter, number);
    format!("I took back: \"{}\".", talk.ledger.entries()[number as usize].text)
}

/// Remembers that a sentence was dealt with that says nothing of the map: said again, it changes nothing.
fn note(talk: &mut Talk, u: &Utterance, here: &Here) {
    if !talk.ledger.is_full() {
        let (id, text, stamp_ns) = (u.id.clone(), u.text.clone(), u.began_ns);
        let (parse, held) = (Parse::default(), here.held.unwrap_or_default());
        let entry = Entry { id, stamp_ns, text, parse, held, stands: false };
        Arc::make_mut(&mut talk.ledger).enter(entry, false);
    }
}
