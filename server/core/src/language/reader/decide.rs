//! From proposals to readings, act by act: of what kind the next is, if there is one, and which groups are its.
//!
//! ```text
//! p(reading | text) = Π p(kind | text, said before) · p(groups | kind, text, said before)
//! ```

use crate::language::reader::features::Text;
use crate::language::reader::groups::{Groups, groups};
use crate::language::reader::judge::Judge;
use crate::language::reader::kind::{KINDS, Kind};
use crate::language::reader::of_kinds::History;
use crate::language::reader::propose::{Proposal, propose};
use crate::language::reader::tokens::{Token, tokens};

/// Beginnings of readings that are followed.
const FOLLOWED: usize = 16;
/// A kind, a proposal or a beginning that is less likely is not followed.
const LEAST: f64 = 0.004;
/// Proposals of a kind that are followed.
const OPTIONS: usize = 5;
/// More acts are not read.
const ACTS: usize = 6;

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

    /// Readings, likeliest first.
    pub fn choices(&self, judge: &Judge) -> Vec<Choice> {
        let text = Text::new(&self.tokens, &self.groups);
        let mut weighed = Weighed { found: self, text: &text, judge, of_kind: vec![None; KINDS] };
        let mut choices: Vec<(f64, Choice)> = Vec::new();
        let mut open = vec![(1.0, History::default())];
        while !open.is_empty() {
            let mut longer: Vec<(f64, History)> = Vec::new();
            for (p, history) in open {
                for (kind, p_kind) in Kind::ALL.into_iter().zip(weighed.kinds(&history)) {
                    let p = p * p_kind;
                    if kind == Kind::Nothing {
                        self.close(p, &history, &mut choices);
                    } else if p > LEAST && history.said.len() < ACTS {
                        let options = weighed.options(&history, kind).into_iter();
                        let likely = options.map(|(q, next)| (p * q, next)).filter(|(p, _)| *p > LEAST);
                        longer.extend(likely.take(OPTIONS).map(|(p, next)| (p, self.after(&history, next))));
                    }
                }
            }
            longer.sort_by(|a, b| b.0.total_cmp(&a.0).then_with(|| a.1.said.cmp(&b.1.said)));
            longer.truncate(FOLLOWED);
            open = longer;
        }
        let mut choices: Vec<Choice> = choices.into_iter().map(|(_, c)| c).collect();
        choices.sort_by(|a, b| b.probability.total_cmp(&a.probability).then_with(|| a.said.cmp(&b.said)));
        choices
    }

    /// A reading that ends; those that say the same are one, as the likeliest has it.
    fn close(&self, probability: f64, history: &History, choices: &mut Vec<(f64, Choice)>) {
        let same = choices.iter_mut().find(|(_, c)| self.say_the_same(&c.said, &history.said));
        match same {
            Some((most, same)) => {
                same.probability += probability;
                if probability > *most {
                    (*most, same.said) = (probability, history.said.clone());
                }
            }
            None => choices.push((probability, Choice { probability, said: history.said.clone() })),
        }
    }

    /// What is said once one more is.
    pub fn after(&self, history: &History, next: usize) -> History {
        let p = &self.proposals[next];
        let nouns = [p.noun, p.other].map(|n| n.map(|n| self.groups.nouns[n].span));
        let rel = p.rel.map(|r| self.groups.rels[r].span);
        let ends = nouns.iter().flatten().chain(&rel).chain(&p.takes).map(|s| s.to);
        History {
            said: history.said.iter().copied().chain([next]).collect(),
            last: Some(p.kind),
            end: ends.max().unwrap_or(0).max(history.end),
            nouns,
            rel,
        }
    }

    /// Whether a proposal can't be said any more: its words were said, but for what lies at one place.
    pub fn is_said(&self, history: &History, next: usize) -> bool {
        let b = &self.proposals[next];
        history.said.iter().map(|&a| &self.proposals[a]).any(|a| {
            let apart = a.rel.is_some() && b.rel.is_some() && a.noun != b.noun;
            let overlap = a.takes.iter().any(|s| b.takes.iter().any(|t| s.overlaps(*t)));
            !apart && overlap || a.content == b.content
        })
    }

    /// Whether readings differ by no more than how many words their names have: "the new gym", "the gym".
    fn say_the_same(&self, a: &[usize], b: &[usize]) -> bool {
        let head = |n: Option<usize>| n.map(|n| self.groups.nouns[n].head);
        let same = |(a, b): (&usize, &usize)| {
            let (a, b) = (&self.proposals[*a], &self.proposals[*b]);
            let alike = a.kind == b.kind && a.rel == b.rel && a.beside_groups() == b.beside_groups();
            a.content == b.content || alike && head(a.noun) == head(b.noun) && head(a.other) == head(b.other)
        };
        a.len() == b.len() && a.iter().zip(b).all(same)
    }
}

/// Proposals with their weights, as far as they were asked for.
struct Weighed<'a> {
    found: &'a Found,
    text: &'a Text<'a>,
    judge: &'a Judge,
    of_kind: Vec<Option<Vec<(f32, usize)>>>,
}

impl Weighed<'_> {
    /// p(kind of the next act), [`Kind::Nothing`] if there is none.
    fn kinds(&self, history: &History) -> Vec<f64> {
        let mut sums = [0.0; KINDS];
        self.text.next_kind(history).into_iter().for_each(|f| self.judge.add(f, &mut sums));
        normalised(&sums.map(f64::from))
    }

    /// Proposals of a kind with their probabilities, likeliest first.
    fn options(&mut self, history: &History, kind: Kind) -> Vec<(f64, usize)> {
        let (found, text, judge) = (self.found, self.text, self.judge);
        let of_kind = self.of_kind[kind as usize].get_or_insert_with(|| {
            let mut features = Vec::new();
            let all = found.proposals.iter().enumerate().filter(|(_, p)| p.kind == kind);
            all.map(|(i, p)| {
                text.features(p, &mut features);
                (features.iter().map(|&f| judge.weight(f)).sum(), i)
            })
            .collect()
        });
        let free: Vec<(f64, usize)> = of_kind
            .iter()
            .filter(|(_, p)| !found.is_said(history, *p))
            .map(|&(w, p)| {
                let next = text.next_groups(&found.proposals[p], history);
                (f64::from(w + next.iter().map(|&f| judge.weight(f)).sum::<f32>()), p)
            })
            .collect();
        let p = normalised(&free.iter().map(|(w, _)| *w).collect::<Vec<_>>());
        let mut ranked: Vec<(f64, usize)> = p.into_iter().zip(free.into_iter().map(|(_, p)| p)).collect();
        ranked.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
        ranked
    }
}

fn normalised(logs: &[f64]) -> Vec<f64> {
    let most = logs.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let all: Vec<f64> = logs.iter().map(|l| (l - most).exp()).collect();
    let sum: f64 = all.iter().sum();
    all.into_iter().map(|p| p / sum).collect()
}
