//! Taking back: what a guide corrects in words and an operator at a desk.

use crate::edge::Vertex;
use crate::event::Command;
use crate::filter::Filter;
use crate::filter::particle::Particle;
use crate::language::Name;
use crate::talk::Talk;
use std::collections::BTreeSet;
use std::sync::Arc;

/// Does what an operator asks, and tells what was done or why not.
pub(crate) fn mend(talk: &mut Talk, filter: &mut Filter, command: &Command) -> Result<String, String> {
    match command {
        Command::Undo { utterance } => undo(talk, filter, utterance.as_deref()),
        Command::Rename { from, to } => rename(talk, filter, from, to),
        Command::Forget { name } => forget_name(talk, filter, name),
        // These come with where the robot is: see [`Talk::tell`] and [`Talk::draw`].
        Command::Pose(_) | Command::Area(_) => Err("that is told of a map with a robot".to_owned()),
    }
}

/// Takes back a sentence, the newest that stands if none is named: labels and weights are as if it
/// had never been said.
pub(crate) fn undo(talk: &mut Talk, filter: &mut Filter, id: Option<&str>) -> Result<String, String> {
    let Some(number) = talk.ledger.standing(id) else {
        return Err(match id {
            Some(id) if talk.ledger.has(id) => format!("sentence {id:?} was taken back before"),
            Some(id) => format!("no sentence with id {id:?} changed this map"),
            None => "there is no sentence left to take back".to_owned(),
        });
    };
    strike(talk, filter, number);
    Ok(format!("I took back: \"{}\".", talk.ledger.entries()[number as usize].text))
}

/// The same by the sentence's number in the ledger.
pub(crate) fn strike(talk: &mut Talk, filter: &mut Filter, number: u32) {
    Arc::make_mut(&mut talk.ledger).strike(number);
    for p in &mut filter.particles {
        p.labels.revoke(number);
    }
    resolve(talk, filter);
    filter.weigh_words(talk);
}

fn rename(talk: &mut Talk, filter: &mut Filter, from: &str, to: &str) -> Result<String, String> {
    let (old, new) = (named(from)?, named(to)?);
    let Some(label) = talk.ledger.label(old.as_str()) else {
        return Err(format!("nobody named {} yet", old.with_article()));
    };
    if old == new {
        return Err(format!("both are spelt {new:?} on the map", new = new.as_str()));
    }
    let ledger = Arc::make_mut(&mut talk.ledger);
    let to = ledger.enter_name(&new);
    // What meant something else so far is itself from now on.
    ledger.call_itself(to);
    ledger.call(to, label, None);
    resolve(talk, filter);
    Ok(format!("What was {} is {} now.", old.with_article(), new.with_article()))
}

fn forget_name(talk: &mut Talk, filter: &mut Filter, name: &str) -> Result<String, String> {
    let name = named(name)?;
    let Some(label) = talk.ledger.label(name.as_str()) else {
        return Err(format!("nobody named {} yet", name.with_article()));
    };
    Arc::make_mut(&mut talk.ledger).forget(label);
    for p in &mut filter.particles {
        p.labels.forget(label);
    }
    Ok(format!("I know of no {name} any more."))
}

/// Looks up anew what the names mean, in every particle.
pub(crate) fn resolve(talk: &Talk, filter: &mut Filter) {
    let ledger = &talk.ledger;
    let resolve = |p: &mut Particle| p.labels.resolve(|said| ledger.meant(said));
    let others: BTreeSet<Vertex> = filter.particles.iter_mut().flat_map(resolve).collect();
    filter.named_anew(others);
}

fn named(text: &str) -> Result<Name, String> {
    Name::new(text).ok_or_else(|| format!("{text:?} is no name"))
}
