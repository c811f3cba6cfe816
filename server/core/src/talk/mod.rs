//! What sentences do to the posterior: step 3 of Algorithm 1, and the words' share of step 4.
//!
//! ```text
//! sentence ─ listen ─▶ language ─▶ take_in ─▶ ledger, claims, labels
//!                         locate ─▶ describe ─▶ labels: grounded when said, and again as the map grows
//!            └ doubts ─▶ questions ─▶ "yes": taken in
//! "no, …", undo ─ mend ─▶ the same taken back
//! where the robot is, pointed out ─ told ─▶ ledger, claims
//! an area, drawn ─ areas ─▶ ledger, labels
//! ledger, claims, one particle's map ─ fold ─▶ p(λ | G)
//! ```

mod accept;
mod areas;
pub mod claims;
pub(crate) mod describe;
mod doubts;
mod fold;
pub mod ledger;
mod listen;
pub(crate) mod locate;
mod mend;
pub mod questions;
mod replied;
mod take_in;
mod told;

use crate::edge::Vertex;
use crate::effects::Heard;
use crate::event::{Area, Command, StampNs, Told, Utterance};
use crate::filter::Filter;
use crate::filter::particle::Particle;
use crate::filter::words::Words;
use crate::geometry::Pose2;
use crate::graph::Graph;
use crate::language::{Content, Glossary, Speech};
use claims::Testimonies;
use ledger::Ledger;
use questions::Questions;
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// Where the robot is while it listens.
pub struct Here<'a> {
    /// The place held when the sentence began; none before the first scan.
    pub held: Option<Vertex>,
    /// For one particle: the poses of all places, those not frozen yet included.
    pub poses: &'a (dyn Fn(&Particle) -> Vec<Pose2> + Sync),
    /// Path travelled up to each place, metres.
    pub path_m: Vec<f64>,
    /// Of each place, which part of the map it is in, see [`crate::graph::stretches::part`].
    pub part: Vec<usize>,
    /// Of each place, whether the robot sees nothing there, or soon after.
    pub dark: Vec<bool>,
}

/// All that was said of one map.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct Talk {
    /// What was said.
    pub ledger: Arc<Ledger>,
    /// What of it is likelier in some graphs than in others.
    pub testimonies: Testimonies,
    /// What guides were asked and did not answer yet.
    pub questions: Questions,
}

impl Words for Talk {
    fn log_likelihood(&self, graph: &Graph, particle: &Particle) -> f64 {
        fold::log_likelihood(self, graph, particle)
    }
}

impl Talk {
    /// Takes a sentence: parses it, weighs every particle by it and updates its labels. With it come the questions
    /// in it, to be answered from the map.
    pub fn hear(&mut self, filter: &mut Filter, u: &Utterance, here: &Here) -> (Heard, Vec<Content>) {
        listen::hear(self, filter, u, here)
    }

    /// What a sentence is said in; none if nobody here knows that language.
    fn speech(&self, u: &Utterance) -> Option<Speech> {
        Speech::new(u.lang.as_deref(), self.ledger.glossary.clone())
    }

    /// Takes the site's own words, in the place of those before; what was heard before stays as it was understood.
    pub fn learn(&mut self, lines: &str) {
        if let Ok(glossary) = Glossary::read(lines) {
            Arc::make_mut(&mut self.ledger).glossary = Arc::new(glossary);
        }
    }

    /// Does what an operator asks, and tells what was done or why not.
    pub fn mend(&mut self, filter: &mut Filter, command: &Command) -> Result<String, String> {
        let done = mend::mend(self, filter, command);
        filter.weigh_words(self);
        done
    }

    /// Takes in where somebody sees the robot, and tells how the map has it so far, or why it can't be taken in.
    pub fn tell(
        &mut self,
        filter: &mut Filter,
        told: (&Told, StampNs),
        body_from_place: &Pose2,
        here: &Here,
    ) -> Result<String, String> {
        told::tell(self, filter, told, body_from_place, here)
    }

    /// Takes in an area, and tells what that comes to, or why it can't be taken in.
    pub fn draw(
        &mut self,
        filter: &mut Filter,
        area: (&Area, StampNs),
        here: &Here,
    ) -> Result<String, String> {
        areas::draw(self, filter, area, here)
    }

    /// Grounds some descriptions again, one after the other in turn, in the map as it is now.
    pub fn reground(&mut self, filter: &mut Filter) {
        describe::reground(self, filter);
        filter.weigh_words(self);
    }

    /// Grounds all descriptions again.
    pub fn reground_all(&mut self, filter: &mut Filter) {
        describe::reground_all(self, filter);
        filter.weigh_words(self);
    }
}
