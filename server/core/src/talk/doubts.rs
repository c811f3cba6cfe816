//! What is doubtful of a sentence that was read: names that were never said here and sound like others, and other
//! names of what is near. Until the guide is asked, it is taken in both ways.

use crate::edge::Vertex;
use crate::filter::Filter;
use crate::filter::labels::LabelId;
use crate::language::act::{Act, Analysis, Content, Head, Parse, Phrase};
use crate::language::{Name, misheard, names_in, place_names, renamed, statement, synonyms};
use crate::talk::ledger::Ledger;
use crate::talk::{Here, Talk};
use std::collections::BTreeSet;

/// A place that nobody named here is as likely meant by what sounds like it, over one that somebody did.
const UNNAMED: f64 = 0.75;
/// Names of places so near may be names of one.
const NEAR_M: f64 = 10.0;
/// Less likely it is not worth asking.
const ASKED_MIN: f64 = 0.3;

/// A question about what was read.
pub struct Doubt {
    /// What is asked.
    pub words: String,
    /// What is taken in until it is answered, …
    pub meanwhile: Parse,
    /// … then, …
    pub yes: Parse,
    /// … and if the answer is no.
    pub no: Parse,
    /// Names that answer it.
    pub names: [Option<Name>; 2],
}

/// What is doubtful first.
pub fn doubted(talk: &Talk, filter: &Filter, parse: &Parse, held: Vertex, here: &Here) -> Option<Doubt> {
    let acts = || parse.acts().iter().filter(|act| act.content.asserts());
    let known = known(filter);
    let is_known = |name: &Name| talk.ledger.said(name.as_str()).is_some_and(|id| known.contains(&id));
    let new: Vec<Name> = acts().flat_map(|act| names_in(&act.content)).filter(|n| !is_known(n)).collect();
    let heard = new.iter().find_map(|name| sounding(&talk.ledger, &known, parse, name));
    heard.or_else(|| {
        let of_here = acts().filter_map(|act| named_here(&act.content)).filter(|name| !is_known(name));
        of_here.into_iter().find_map(|name| called_else(talk, filter, parse, &name, held, here))
    })
}

/// Names that something speaks for.
fn known(filter: &Filter) -> BTreeSet<LabelId> {
    let evidence = filter.best().labels.evidence().iter().filter(|e| e.weight > 0.0);
    evidence.flat_map(|e| [e.said, e.label]).collect()
}

/// "The sever room": sounds like a name that is known here, or like what places are called.
fn sounding(ledger: &Ledger, known: &BTreeSet<LabelId>, parse: &Parse, said: &Name) -> Option<Doubt> {
    let here = known.iter().map(|&id| (1.0, ledger.name(id)));
    let of_site = ledger.glossary.names().map(|name| (1.0, name.as_str()));
    if ledger.glossary.names().any(|name| name == said) {
        return None;
    }
    let all = here.chain(of_site).chain(place_names().map(|name| (UNNAMED, name)));
    let likely = all.map(|(p, name)| (p * misheard(said.as_str(), name), name));
    let (p, name) = likely.filter(|(p, _)| *p >= ASKED_MIN).max_by(|a, b| a.0.total_cmp(&b.0))?;
    let meant = Name::new(name)?;
    let mut meanwhile = Parse::default();
    let mut yes = Parse::default();
    for reading in &parse.analyses {
        let mended = renamed(reading, said, &meant);
        if mended == *reading {
            meanwhile.analyses.push(reading.clone());
        } else {
            let by = |reading: &Analysis, p: f64| Analysis { weight: reading.weight * p, ..reading.clone() };
            meanwhile.analyses.extend([by(&mended, p), by(reading, 1.0 - p)]);
        }
        yes.analyses.push(mended);
    }
    let words = format!("I heard \"{said}\". Did you mean {}?", meant.with_article());
    Some(Doubt { words, meanwhile, yes, no: parse.clone(), names: [Some(meant), Some(said.clone())] })
}

fn named_here(content: &Content) -> Option<Name> {
    match content {
        Content::Label { at, what, .. } if at.head == Head::Here => what.label(),
        _ => None,
    }
}

/// "This is the foyer", where a lobby is near.
fn called_else(
    talk: &Talk,
    filter: &Filter,
    parse: &Parse,
    said: &Name,
    held: Vertex,
    here: &Here,
) -> Option<Doubt> {
    let best = filter.best();
    let poses = (here.poses)(best);
    let near =
        |v: &Vertex| poses.get(*v as usize).is_some_and(|p| p.distance_m(&poses[held as usize]) < NEAR_M);
    let near: Vec<(LabelId, f64)> =
        (0..poses.len() as Vertex).filter(near).flat_map(|v| best.labels.names(v)).collect();
    let likely = near.into_iter().filter(|(_, applies)| *applies >= 0.5);
    let likely = likely.map(|(id, _)| talk.ledger.name(id)).map(|n| (synonyms(said.as_str(), n), n));
    let (_, name) = likely.filter(|(p, _)| *p >= ASKED_MIN).max_by(|a, b| a.0.total_cmp(&b.0))?;
    let other = Name::new(name)?;
    let phrase = |name: &Name| Phrase::new(Head::Named(name.clone()));
    let one = Act { content: Content::Alias { what: phrase(&other), also: phrase(said) }, certainty: 1.0 };
    let mut yes = parse.clone();
    yes.analyses.iter_mut().for_each(|reading| reading.acts.push(one.clone()));
    let heard = statement(parse.acts());
    let words = format!("I heard: {heard}. Is that the same place as {}?", other.with_article());
    let names = [Some(other), Some(said.clone())];
    Some(Doubt { words, meanwhile: parse.clone(), yes, no: parse.clone(), names })
}
