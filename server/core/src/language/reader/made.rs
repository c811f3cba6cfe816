//! Names that are not said as they are: heard otherwise, meant by "mine" and "one", told by what is done there.

use crate::language::act::{Head, Phrase};
use crate::language::lexicon::names::Name;
use crate::language::reader::groups::{Made, NAME_MAX, Noun, Span};
use crate::language::reader::lexicon::{Class, lexicon};
use crate::language::reader::sound;
use crate::language::reader::tokens::Token;

/// Names that sound like a run of words, with short words in and behind it: "print her", "key osk".
pub fn heard(tokens: &[Token], all: &mut Vec<Noun>) {
    let names = |i: usize| tokens.get(i).is_some_and(|t| t.class.names());
    for from in (0..tokens.len()).filter(|&i| names(i) && (i == 0 || !names(i - 1))) {
        let mut end = from;
        while names(end) || (end > from && tokens.get(end).is_some_and(may_be_heard)) {
            end += 1;
        }
        for to in (from + 1..=end).filter(|to| to - from <= NAME_MAX) {
            let Some(said) = sound::mended(&tokens[from..to]) else { continue };
            let Some(name) =
                said.last().filter(|w| lexicon().is_head(w)).and_then(|_| Name::new(&said.join(" ")))
            else {
                continue;
            };
            let span = Span { from, to };
            let mut noun = made(span, Phrase::new(Head::Named(name)), Made::Heard);
            (noun.is_place, noun.ends) = (true, to == end);
            all.push(noun);
        }
    }
}

fn may_be_heard(token: &Token) -> bool {
    !matches!(token.class, Class::Be | Class::Comma | Class::Stop | Class::Question | Class::Owner)
        && !matches!(token.text.as_str(), "the" | "a" | "an")
        && lexicon().relations(&token.text).is_empty()
}

/// "Mine", "the big one": of the kind that was named before.
pub fn meant(tokens: &[Token], all: &mut Vec<Noun>) {
    for (at, token) in tokens.iter().enumerate() {
        let of_kind = matches!(token.text.as_str(), "one" | "ones");
        let owned = matches!(token.text.as_str(), "mine" | "yours" | "ours" | "hers" | "theirs" | "his")
            && !tokens.get(at + 1).is_some_and(|t| t.class.names());
        if !of_kind && !owned {
            continue;
        }
        let mut from = at;
        while from > 0 && at - from < 3 && tokens[from - 1].class.names() {
            from -= 1;
        }
        let whose = from > 1 && tokens[from - 1].class == Class::Owner;
        if of_kind && from == at && !whose {
            continue;
        }
        let before = |n: &&Noun| n.pointer.is_none() && n.ends && n.span.to <= from && n.is_place;
        let Some(Head::Named(kind)) =
            all.iter().filter(before).max_by_key(|n| n.span.to).map(|n| n.phrase.head.clone())
        else {
            continue;
        };
        let kind = kind.as_str().rsplit(' ').next().unwrap_or_default().to_owned();
        let qualities = tokens[from..at].iter().map(|t| t.text.as_str());
        let words: Vec<&str> = qualities.chain([kind.as_str()]).collect();
        if let Some(name) = Name::new(&words.join(" ")) {
            all.push(made(Span { from, to: at + 1 }, Phrase::new(Head::Named(name)), Made::Meant));
        }
    }
}

/// "Where the interns sit": a place told by what is done there.
pub fn told(tokens: &[Token], all: &mut Vec<Noun>) {
    for at in (1..tokens.len()).filter(|&i| tokens[i].text == "where") {
        all.push(made(Span { from: at, to: at + 1 }, purpose(&tokens[at..]), Made::Told));
    }
}

/// Some place, told by what is done there: the words behind "where", "to" or "for".
pub fn purpose(tokens: &[Token]) -> Phrase {
    let mut place = Phrase::new(Head::Place);
    let tells = |t: &Token| matches!(t.text.as_str(), "where" | "for");
    if let Some(at) = tokens.iter().position(tells) {
        let is_word = |t: &&Token| !matches!(t.class, Class::Stop | Class::Comma | Class::Question);
        let said: Vec<&str> = tokens[at + 1..].iter().take_while(is_word).map(|t| t.text.as_str()).collect();
        place.features.purpose = (!said.is_empty()).then(|| said.join(" "));
    }
    place
}

fn made(span: Span, phrase: Phrase, made: Made) -> Noun {
    Noun {
        span,
        head: span.to - 1,
        pointer: None,
        phrase,
        is_place: false,
        begins: true,
        ends: true,
        has_verb: false,
        is_floor: false,
        made,
    }
}
