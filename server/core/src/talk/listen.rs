//! Step 3 of Algorithm 1, the sentences: what each says and what becomes of it.

use crate::effects::{Heard, HeardStatus};
use crate::event::{StampNs, Utterance};
use crate::filter::Filter;
use crate::language::act::{Act, Analysis, Content, Parse, Phrase};
use crate::language::{self, Name, Reply, Speech};
use crate::talk::accept::{asked, heard, take, words};
use crate::talk::doubts::doubted;
use crate::talk::ledger::Entry;
use crate::talk::mend::undo;
use crate::talk::questions::{Question, Said, Then};
use crate::talk::replied::{answered, undone};
use crate::talk::{Here, Talk};

/// How likely a guide means what was asked for and confirmed: "yes" may be misheard, too.
const CONFIRMED: f64 = 0.95;

/// What was named no longer ago is mended by what sounds like it, so likely.
const MENDED_NS: i64 = 20_000_000_000;
const MENDS: f64 = 0.8;

/// "It" is what was spoken of no longer ago.
const TOPIC_NS: i64 = 60_000_000_000;
/// Takes a sentence: parses it, weighs every particle by it and updates its labels. With it what is asked of the map.
pub(crate) fn hear(
    talk: &mut Talk,
    filter: &mut Filter,
    u: &Utterance,
    here: &Here,
) -> (Heard, Vec<Content>) {
    if !filter.config.language {
        let words = "Nobody listens: language is switched off.".to_owned();
        return (heard(u, HeardStatus::Refused, &Parse::default(), words), Vec::new());
    }
    if let Some(question) = talk.questions.about(&u.id) {
        return (asked(u, &Parse::default(), question.words.clone()), Vec::new());
    }
    let Some(speech) = talk.speech(u) else {
        let words = format!("I understand {} only.", Speech::known());
        return (heard(u, HeardStatus::NotUnderstood, &Parse::default(), words), Vec::new());
    };
    if talk.ledger.has(&u.id) {
        let parse = speech.parse_hearings(&u.text, &u.alternatives);
        let words = format!("{} (I had heard that already.)", words(talk, &parse));
        return (heard(u, HeardStatus::Understood, &parse, words), Vec::new());
    }
    let retracted = u
        .retracts
        .as_ref()
        .map(|id| undo(talk, filter, Some(id)).unwrap_or_else(|why| format!("But {why}.")));
    let (mut heard, asks) = match talk.questions.answered(u, &speech) {
        Some((question, then)) => answered(talk, filter, u, here, (&question, then)),
        None if speech.reply(&u.text) == Some(Reply::Undo) => (undone(talk, filter, u, here), Vec::new()),
        None => hear_anew(talk, filter, (u, &speech), here),
    };
    if let Some(retracted) = retracted {
        heard.words = format!("{retracted} {}", heard.words);
    }
    (heard, asks)
}

fn hear_anew(
    talk: &mut Talk,
    filter: &mut Filter,
    (u, speech): (&Utterance, &Speech),
    here: &Here,
) -> (Heard, Vec<Content>) {
    let mut parse = speech.parse_hearings(&u.text, &u.alternatives);
    language::resolve_it(&mut parse, topic(talk, u.began_ns));
    let said = |parse, held, instead_of| {
        let (text, stamp_ns) = (u.text.clone(), u.began_ns);
        Said { text, parse, stamp_ns, held, instead_of }
    };
    let newest = newest(talk, u.began_ns);
    if parse.acts().is_empty()
        && let Some(said_before) = newest.and_then(|e| speech.as_before(&u.text, &e.parse))
    {
        parse = said_before;
    }
    if parse.acts().is_empty()
        && let Some(mended) = newest.and_then(|e| mended((&u.text, speech), e, u.began_ns))
    {
        parse.analyses.push(mended);
    }
    if parse.acts().iter().all(|act| matches!(act.content, Content::Ignored(_))) {
        if let (Some(guess), Some(held)) = (speech.guess(&u.text), here.held) {
            let words = did_you_mean(&guess);
            let mut parse = Parse { analyses: vec![guess] };
            language::resolve_it(&mut parse, topic(talk, u.began_ns));
            let told = parse.clone();
            parse.analyses[0].weight = CONFIRMED;
            let then = [Then::Take(said(parse, held, None)), Then::Nothing];
            return (put_question(talk, u, &told, (words, then, [const { None }; 2])), Vec::new());
        }
        let words = words(talk, &parse);
        return (heard(u, HeardStatus::NotUnderstood, &parse, words), Vec::new());
    }
    let doubt = here.held.and_then(|held| Some((held, doubted(talk, filter, &parse, held, here)?)));
    let Some((held, doubt)) = doubt else {
        return take(talk, filter, (u, said(parse, here.held.unwrap_or_default(), None)), here);
    };
    let [yes, no] = [doubt.yes, doubt.no];
    let (mut heard, asks) = take(talk, filter, (u, said(doubt.meanwhile, held, None)), here);
    if heard.status == HeardStatus::Understood {
        let number = talk.ledger.standing(Some(&u.id));
        let then = [Then::Take(said(yes, held, number)), Then::Take(said(no, held, number))];
        let question = put_question(talk, u, &Parse::default(), (doubt.words, then, doubt.names));
        heard.status = HeardStatus::Asked;
        heard.words = question.words;
        heard.question = question.question;
    }
    (heard, asks)
}

/// Asks something of a sentence.
fn put_question(
    talk: &mut Talk,
    u: &Utterance,
    parse: &Parse,
    (words, then, names): (String, [Then; 2], [Option<Name>; 2]),
) -> Heard {
    let (id, stamp_ns) = (u.id.clone(), u.began_ns);
    talk.questions.ask(Question { id, stamp_ns, words: words.clone(), then, names });
    asked(u, parse, words)
}

/// The newest sentence that stands, if it is not too long ago to be spoken of.
fn newest(talk: &Talk, now_ns: StampNs) -> Option<&Entry> {
    let newest = talk.ledger.entries().iter().rev().find(|e| e.stands)?;
    let since_ns = now_ns.saturating_sub(newest.stamp_ns);
    (0..=TOPIC_NS).contains(&since_ns).then_some(newest)
}

/// What the newest sentence spoke of.
fn topic(talk: &Talk, now_ns: StampNs) -> Option<&Phrase> {
    language::topic(&newest(talk, now_ns)?.parse)
}

/// "No wait, the reading room": by itself it may say anything; just after a place was named it mends that.
fn mended((text, speech): (&str, &Speech), before: &Entry, now_ns: StampNs) -> Option<Analysis> {
    let is_label = |act: &Act| matches!(act.content, Content::Label { .. });
    let just_named =
        before.parse.acts().iter().any(is_label) && now_ns.saturating_sub(before.stamp_ns) <= MENDED_NS;
    let guess = speech.guess(text).filter(|_| just_named)?;
    let mends = |act: &Act| match &act.content {
        Content::Correct { is, .. } => matches!(**is, Content::Label { .. }),
        _ => false,
    };
    guess.acts.iter().all(mends).then(|| Analysis { weight: guess.weight.max(MENDS), ..guess })
}

fn did_you_mean(guess: &Analysis) -> String {
    let asks = matches!(guess.acts.last(), Some(Act { content: Content::Ask { .. }, .. }));
    let verb = if asks { "Did you ask" } else { "Did you mean that" };
    format!("I am not sure. {verb} {}?", language::statement(&guess.acts))
}
