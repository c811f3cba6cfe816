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

use crate::language::act::{Act, Analysis, Content, Parse, Phrase};
use crate::language::grammar::attach::Weighed;
use crate::language::grammar::build::Readings;
use crate::language::grammar::correct::fold;
use crate::language::grammar::sentence::{Read, read};
use crate::language::lexicon::names::Kind;
use crate::language::lexicon::normalise::sentences;
use crate::language::notation::notation;

/// A text that is wholly read says what is read with this probability, its names being known places; the
/// rest is for what the grammar misreads. (All of the examples that it reads are read right; a tenth is
/// a guess on the side of care, and shapes only how hearings compare.)
pub const READ: f64 = 0.9;
/// What is left of it for each name that is no known kind of place: it may be misheard.
const UNKNOWN_NAME: f64 = 0.8;
/// Analyses of a text that are kept.
const ANALYSES_MAX: usize = 8;

/// What a text says; no analyses if it is not understood or longer than
/// [`MAX_TEXT_BYTES`](super::MAX_TEXT_BYTES). Linear in the text.
pub fn parse(text: &str) -> Parse {
    let mut clauses: Vec<Readings> = Vec::new();
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

/// The likeliest reading of all clauses, and those that differ from it in one clause. (Readings that
/// differ in several are less likely than either, and would make the work grow faster than the text.)
fn analyses(clauses: &[Readings]) -> Vec<Analysis> {
    let mut others: Weighed<(usize, usize)> = Vec::new();
    let mut best = 1.0;
    for (i, clause) in clauses.iter().enumerate() {
        let first = clause.all.first().map_or(1.0, |(w, _)| *w);
        best *= first;
        others.extend(clause.all.iter().enumerate().skip(1).map(|(k, (w, _))| (w / first, (i, k))));
    }
    others.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
    others.truncate(ANALYSES_MAX - 1);
    let choices = std::iter::once((1.0, (usize::MAX, 0))).chain(others);
    choices.map(|(ratio, (at, k))| analysis(clauses, best * ratio, at, k)).collect()
}

/// The analysis that takes reading `k` of clause `at`, and the first of all others.
fn analysis(clauses: &[Readings], weight: f64, at: usize, k: usize) -> Analysis {
    let mut acts = Vec::new();
    for (i, clause) in clauses.iter().enumerate() {
        let Some((_, said)) = clause.all.get(if i == at { k } else { 0 }) else { continue };
        acts.extend(said.iter().map(|c| Act { content: c.clone(), certainty: clause.certainty }));
    }
    let acts = fold(acts);
    let unknown = acts.iter().filter(|a| !names_known(&a.content)).count();
    let weight = weight * READ * UNKNOWN_NAME.powi(unknown.min(8) as i32);
    Analysis { weight, notation: notation(&acts), acts, hearing: 0 }
}

/// Are the names that an act gives those of known kinds of places?
fn names_known(content: &Content) -> bool {
    let known = |phrase: &Phrase| phrase.label().is_none_or(|n| n.kind() == Kind::Place);
    match content {
        Content::Label { what, .. } => known(what),
        Content::Locate(locate) => known(&locate.figure),
        Content::Alias { what, also } => known(what) && known(also),
        Content::Negate(inner) => names_known(inner),
        Content::Correct { is, .. } => names_known(is),
        _ => true,
    }
}
