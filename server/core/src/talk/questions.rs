//! Questions to the guide, yes or no: what is not sure enough to be kept as said, and what is asked before it is
//! taken back.

use crate::edge::Vertex;
use crate::event::{StampNs, Utterance};
use crate::language::act::Parse;
use crate::language::{Name, Reply, Speech};
use serde::{Deserialize, Serialize};
use std::collections::VecDeque;

/// Questions that wait for an answer; the oldest is given up.
const WAITING_MAX: usize = 8;
/// A "yes" that names no question answers one asked no longer ago.
const ANSWERED_NS: StampNs = 60_000_000_000;

/// A question and what becomes of the answer.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Question {
    /// Id of the sentence that it asks of.
    pub id: String,
    /// When that was said.
    pub stamp_ns: StampNs,
    /// What is asked.
    pub words: String,
    /// What is done on "yes", and on "no".
    pub then: [Then; 2],
    /// Names that say yes, or no.
    pub names: [Option<Name>; 2],
}

/// What an answer does.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Then {
    /// Nothing changes.
    Nothing,
    /// This was said.
    Take(Said),
    /// The entry of this number in the ledger is taken back.
    TakeBack(u32),
}

/// A sentence as it was meant.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Said {
    /// As it was said.
    pub text: String,
    /// What it says.
    pub parse: Parse,
    /// When it began.
    pub stamp_ns: StampNs,
    /// The place held then.
    pub held: Vertex,
    /// The entry in the ledger that it takes the place of.
    pub instead_of: Option<u32>,
}

/// Those that wait.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct Questions(VecDeque<Question>);

impl Questions {
    /// Asks one.
    pub fn ask(&mut self, question: Question) {
        self.0.push_back(question);
        if self.0.len() > WAITING_MAX {
            self.0.pop_front();
        }
    }

    /// The question that waits about a sentence.
    pub fn about(&self, id: &str) -> Option<&Question> {
        self.0.iter().find(|q| q.id == id)
    }

    /// The question that a sentence answers, with what the answer does; it waits no longer. None if the sentence
    /// answers none: what it speaks of instead is not asked of any more.
    pub fn answered(&mut self, u: &Utterance, speech: &Speech) -> Option<(Question, Then)> {
        let at = if let Some(id) = &u.answers {
            self.0.iter().position(|q| q.id == *id)
        } else {
            let since_ns = |q: &Question| u.began_ns.saturating_sub(q.stamp_ns);
            self.0.iter().rposition(|q| (0..=ANSWERED_NS).contains(&since_ns(q)))
        };
        let question = self.0.get(at?)?;
        let named = speech.parse_query(&u.text);
        let is_named = |k: usize| named.is_some() && question.names[k] == named;
        let answer = match speech.reply(&u.text) {
            Some(Reply::Yes) => 0,
            Some(Reply::No) => 1,
            _ if is_named(0) => 0,
            _ if is_named(1) => 1,
            _ => {
                if u.answers.is_some() {
                    self.0.remove(at?);
                }
                return None;
            }
        };
        let question = self.0.remove(at?)?;
        let then = question.then[answer].clone();
        Some((question, then))
    }
}
