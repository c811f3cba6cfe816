//! The text as a row of names, relations and other words.

use crate::language::reader::groups::Groups;
use crate::language::reader::lexicon::{Class, lexicon};
use crate::language::reader::tokens::Token;

/// Words that are one to the eye: a name, a relation, or a word.
pub(super) struct Chunk<'a> {
    pub(super) from: usize,
    pub(super) to: usize,
    /// `N`, `P` with a kind of place, `R`, `I` without a landmark, or the word.
    pub(super) is: &'a str,
}

/// The text as chunks, articles left out.
pub(super) fn chunks<'a>(tokens: &'a [Token], groups: &Groups) -> Vec<Chunk<'a>> {
    let mut all = Vec::new();
    let mut at = 0;
    while at < tokens.len() {
        let from = at;
        let rel = groups.rels.iter().filter(|r| r.longest && r.span.from == at).max_by_key(|r| r.span.to);
        if let Some(r) = rel {
            at = r.span.to;
            all.push(Chunk { from, to: at, is: if r.implied.is_some() { "I" } else { "R" } });
            continue;
        }
        if tokens[at].class.names() && tokens[at].class != Class::Verb {
            while at < tokens.len()
                && tokens[at].class.names()
                && (tokens[at].class != Class::Verb
                    || tokens.get(at + 1).is_some_and(|t| t.class == Class::Open))
            {
                at += 1;
            }
            let place = tokens[from..at].iter().any(|t| lexicon().is_head(&t.text));
            all.push(Chunk { from, to: at, is: if place { "P" } else { "N" } });
            continue;
        }
        at += 1;
        if !matches!(tokens[from].class, Class::Det | Class::Poss) {
            all.push(Chunk { from, to: at, is: &tokens[from].text });
        }
    }
    all
}
