//! From proposals to readings: what kinds of acts a text has, by all of its words, and which groups are theirs.
//!
//! ```text
//! p(reading) = p(kinds | text) · Π p(groups | kind, text)
//! ```

use crate::language::reader::features::{Feature, Text, distinct};
use crate::language::reader::groups::{Groups, groups};
use crate::language::reader::kind::Kind;
use crate::language::reader::propose::{Proposal, propose};
use crate::language::reader::tokens::{Token, tokens};

/// Kinds that one text has, sorted.
pub type Kinds = Vec<Kind>;

/// Kinds that are filled in for a text.
const TRIED: usize = 8;

/// All that was found in a text.
#[derive(Clone, Debug, Default)]
pub struct Found {
    /// Its words.
    pub tokens: Vec<Token>,
    /// Groups of them.
    pub groups: Groups,
    /// All that they may say.
    pub proposals: Vec<Proposal>,
}

/// A reading: proposals in the order said.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Choice {
    /// p(reading | text).
    pub probability: f64,
    /// Indices of proposals.
    pub said: Vec<usize>,
}

impl Found {
    /// From a text.
    pub fn new(text: &str) -> Self {
        let tokens = tokens(text);
        let groups = groups(&tokens);
        let proposals = propose(&tokens, &groups);
        Self { tokens, groups, proposals }
    }

    /// Readings, likeliest first, by the weight of a feature.
    pub fn choices(&self, all_kinds: &[Kinds], weight: impl Fn(Feature) -> f64) -> Vec<Choice> {
        let text = Text::new(&self.tokens, &self.groups);
        let whole = text.whole();
        let kinds = likely_kinds(&whole, all_kinds, &weight);
        let mut tried: Vec<(f64, usize)> = kinds.iter().copied().zip(0..).collect();
        tried.sort_by(|a, b| b.0.total_cmp(&a.0));
        tried.truncate(TRIED);
        let mut ranked: Vec<(Kind, Vec<(f64, usize)>)> = Vec::new();
        let mut choices: Vec<Choice> = Vec::new();
        for (p_kinds, k) in tried {
            let mut choice = Choice { probability: p_kinds, said: Vec::new() };
            for kind in &all_kinds[k] {
                let at = ranked.iter().position(|(r, _)| r == kind).unwrap_or_else(|| {
                    ranked.push((*kind, self.ranked(&text, *kind, &weight)));
                    ranked.len() - 1
                });
                let free = |p: usize| choice.said.iter().all(|&s| !self.clash(s, p));
                match ranked[at].1.iter().find(|(_, p)| free(*p)) {
                    Some(&(q, p)) => {
                        choice.probability *= q;
                        choice.said.push(p);
                    }
                    None => choice.probability = 0.0,
                }
            }
            choice.said.sort_by_key(|&p| self.proposals[p].takes.first().map_or(0, |s| s.from));
            choices.push(choice);
        }
        choices.sort_by(|a, b| b.probability.total_cmp(&a.probability));
        choices
    }

    /// Proposals of a kind with their probabilities, likeliest first.
    fn ranked(&self, text: &Text, kind: Kind, weight: &impl Fn(Feature) -> f64) -> Vec<(f64, usize)> {
        let of_kind: Vec<usize> =
            (0..self.proposals.len()).filter(|&p| self.proposals[p].kind == kind).collect();
        let mut features = Vec::new();
        let log_odds = of_kind.iter().map(|&p| {
            text.features(&self.proposals[p], &mut features);
            features.sort_unstable();
            features.dedup();
            features.iter().map(|&f| weight(f)).sum::<f64>()
        });
        let p = normalised(&log_odds.collect::<Vec<_>>());
        let mut ranked: Vec<(f64, usize)> = p.into_iter().zip(of_kind).collect();
        ranked.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
        ranked
    }

    /// Whether two proposals can't both be said: they need the same words.
    pub fn clash(&self, a: usize, b: usize) -> bool {
        let (a, b) = (&self.proposals[a], &self.proposals[b]);
        a.takes.iter().any(|s| b.takes.iter().any(|t| s.overlaps(*t)))
    }
}

/// p(kinds | text), as [`Text::of_kinds`] has their features; what kinds have in common is summed once.
fn likely_kinds(whole: &[Feature], all_kinds: &[Kinds], weight: &impl Fn(Feature) -> f64) -> Vec<f64> {
    let of_kind = Kind::ALL.map(|kind| Text::of_kind(whole, kind).map(weight).sum::<f64>());
    let most = all_kinds.iter().map(Vec::len).max().unwrap_or(0);
    let of_count: Vec<f64> = (0..=most).map(|n| Text::of_count(whole, n).map(weight).sum()).collect();
    let log_odds = all_kinds.iter().enumerate().map(|(nth, kinds)| {
        let each: f64 = distinct(kinds).map(|kind| of_kind[kind as usize]).sum();
        each + of_count[kinds.len()] + Text::of_shape(whole, nth).map(weight).sum::<f64>()
    });
    normalised(&log_odds.collect::<Vec<_>>())
}

fn normalised(logs: &[f64]) -> Vec<f64> {
    let most = logs.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let all: Vec<f64> = logs.iter().map(|l| (l - most).exp()).collect();
    let sum: f64 = all.iter().sum();
    all.into_iter().map(|p| p / sum).collect()
}
