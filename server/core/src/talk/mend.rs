//! Taking back: what a guide corrects in words and an operator at a desk.

use crate::edge::Vertex;
use crate::event::Command;
use crate::filter::Filter;
use crate::filter::particle::Particle;
use crate::filter::resample::normalise;
use crate::language::Name;
use std::collections::BTreeSet;
use std::sync::Arc;

impl Filter {
    /// Does what an operator asks, and tells what was done or why not.
    pub fn mend(&mut self, command: &Command) -> Result<String, String> {
        match command {
            Command::Undo { utterance } => self.undo(utterance.as_deref()),
            Command::Rename { from, to } => self.rename(from, to),
            Command::Forget { name } => self.forget_name(name),
        }
    }

    /// Takes back a sentence, the newest that stands if none is named: labels and weights are as if it
    /// had never been said. Edges that it led to are judged again.
    pub(crate) fn undo(&mut self, id: Option<&str>) -> Result<String, String> {
        let Some(number) = self.ledger.standing(id) else {
            return Err(match id {
                Some(id) if self.ledger.has(id) => format!("sentence {id:?} was taken back before"),
                Some(id) => format!("no sentence with id {id:?} changed this map"),
                None => "there is no sentence left to take back".to_owned(),
            });
        };
        let given_up = self.strike(number);
        let text = &self.ledger.entries()[number as usize].text;
        let loops = match given_up {
            0 => String::new(),
            1 => " A loop that it had led to is given up.".to_owned(),
            n => format!(" {n} loops that it had led to are given up."),
        };
        Ok(format!("I took back: \"{text}\".{loops}"))
    }

    /// The same by the sentence's number in the ledger. Returns how many loops were given up with it.
    pub(crate) fn strike(&mut self, number: u32) -> usize {
        let led = self.led_by_names();
        Arc::make_mut(&mut self.ledger).strike(number);
        for p in &mut self.particles {
            p.revoke(number);
        }
        self.resolve();
        let given_up = self.judge_again(led);
        self.rank();
        given_up
    }

    fn rename(&mut self, from: &str, to: &str) -> Result<String, String> {
        let (old, new) = (named(from)?, named(to)?);
        let Some(label) = self.ledger.label(old.as_str()) else {
            return Err(format!("nobody named {} yet", old.with_article()));
        };
        if old == new {
            return Err(format!("both are spelt {new:?} on the map", new = new.as_str()));
        }
        let ledger = Arc::make_mut(&mut self.ledger);
        let to = ledger.enter_name(&new);
        // What meant something else so far is itself from now on.
        ledger.call_itself(to);
        ledger.call(to, label, None);
        self.resolve();
        Ok(format!("What was {} is {} now.", old.with_article(), new.with_article()))
    }

    fn forget_name(&mut self, name: &str) -> Result<String, String> {
        let name = named(name)?;
        let Some(label) = self.ledger.label(name.as_str()) else {
            return Err(format!("nobody named {} yet", name.with_article()));
        };
        Arc::make_mut(&mut self.ledger).forget(label);
        for p in &mut self.particles {
            p.labels.forget(label);
        }
        Ok(format!("I know of no {name} any more."))
    }

    /// Weights that sum to one, the best particle first.
    pub(crate) fn rank(&mut self) {
        normalise(&mut self.particles);
        self.particles.sort_by(|a, b| b.log_weight.total_cmp(&a.log_weight));
    }

    /// Looks up anew what the names mean, in every particle.
    pub(crate) fn resolve(&mut self) {
        let ledger = &self.ledger;
        let resolve = |p: &mut Particle| p.labels.resolve(|said| ledger.meant(said));
        let others: BTreeSet<Vertex> = self.particles.iter_mut().flat_map(resolve).collect();
        self.named_anew(others);
    }
}

fn named(text: &str) -> Result<Name, String> {
    Name::new(text).ok_or_else(|| format!("{text:?} is no name"))
}
