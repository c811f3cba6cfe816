//! Taking back: what a guide corrects in words and an operator at a desk.

use crate::event::Command;
use crate::filter::Filter;
use crate::language::Name;
use crate::resample::normalise;
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
    /// had never been said. Edges that it proposed stay, for they stand on scans.
    pub(crate) fn undo(&mut self, id: Option<&str>) -> Result<String, String> {
        let Some(number) = self.ledger.standing(id) else {
            return Err(match id {
                Some(id) if self.ledger.has(id) => format!("sentence {id:?} was taken back before"),
                Some(id) => format!("no sentence with id {id:?} changed this map"),
                None => "there is no sentence left to take back".to_owned(),
            });
        };
        self.strike(number);
        let text = &self.ledger.entries()[number as usize].text;
        Ok(format!("I took back: \"{text}\"."))
    }

    /// The same by the sentence's number in the ledger.
    pub(crate) fn strike(&mut self, number: u32) {
        Arc::make_mut(&mut self.ledger).strike(number);
        for p in &mut self.particles {
            p.revoke(number);
        }
        self.resolve();
        self.rank();
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
        for p in &mut self.particles {
            p.labels.resolve(|said| ledger.meant(said));
        }
    }
}

fn named(text: &str) -> Result<Name, String> {
    Name::new(text).ok_or_else(|| format!("{text:?} is no name"))
}
