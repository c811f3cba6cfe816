//! Where prepositional phrases attach: in "the office near the lounge by the stairs", are the stairs by
//! the lounge or by the office? Both readings are kept, weighed by what usually holds; grounding
//! decides.

use crate::language::act::{Head, Phrase};
use crate::language::grammar::cursor::Cursor;
use crate::language::grammar::relate::Related;
use crate::language::lexicon::is_way;
use crate::language::relation::Relation as R;

/// Readings with their weights, likeliest first; the weights sum to one before the least are dropped.
pub(crate) type Weighed<T> = Vec<(f64, T)>;

/// Phrases in a row that are read.
const CHAIN_MAX: usize = 4;
/// Readings of a row that are kept.
const READINGS_MAX: usize = 4;

/// Prepositional phrases in a row.
#[derive(Clone, Debug, Default)]
pub(crate) struct Chain {
    /// The first landmark is one that the listener knows: "the lobby", "here".
    pub(crate) definite: bool,
    /// Each with whether a comma or "and" sets it off from the one before.
    links: Vec<(Related, bool)>,
}

impl Cursor<'_> {
    /// Reads a row of prepositional phrases; empty if none stands here.
    pub(crate) fn chain(&mut self, contains: bool) -> Chain {
        self.read_chain(contains, false)
    }

    /// Reads the row that begins a clause: "down the hall and to the right is the gym".
    pub(crate) fn leading_chain(&mut self) -> Chain {
        self.read_chain(false, true)
    }

    fn read_chain(&mut self, contains: bool, leading: bool) -> Chain {
        let mut chain = Chain { definite: true, links: Vec::new() };
        while chain.links.len() < CHAIN_MAX {
            let start = *self;
            let apart = !chain.links.is_empty()
                && self.eat_any(", and then|, and|and then|and|, then|,|then").is_some();
            if chain.links.is_empty() {
                // "The kitchen that is next to the lab".
                self.eat_any("that is|which is|that are|which are|located|situated");
            }
            match self.related() {
                // "With" says what a place has, not where it lies.
                Some(r)
                    if (contains || r.relation != R::Contains)
                        && (leading || !apart || !self.sees(COPULA)) =>
                {
                    chain.definite &= r.definite;
                    chain.links.push((r, apart));
                }
                _ => {
                    *self = start;
                    break;
                }
            }
        }
        chain
    }
}

/// "…, and on the right is the gym" begins a new clause.
const COPULA: &str = "is|are|you|there|we";

impl Chain {
    /// "Here".
    pub(crate) fn here() -> Self {
        Self { definite: true, links: vec![(Related::to(R::At, Phrase::new(Head::Here)), false)] }
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.links.is_empty()
    }

    /// Does a landmark, or the chain's relation to itself, surely speak of places?
    pub(crate) fn sure(&self) -> bool {
        self.links.iter().any(|(r, _)| r.sure)
    }

    pub(crate) fn landmarks(&self) -> impl Iterator<Item = &Phrase> {
        self.links.iter().flat_map(|(r, _)| &r.landmarks)
    }

    pub(crate) fn first(&self) -> Option<&Related> {
        self.links.first().map(|(r, _)| r)
    }

    /// What the head of the row may be related to: per reading, the links that are its own, the others
    /// being part of their landmarks.
    pub(crate) fn attach(&self) -> Weighed<Vec<Related>> {
        let mut readings: Weighed<Vec<usize>> = vec![(1.0, Vec::new())];
        for i in 0..self.links.len() {
            readings = readings.into_iter().flat_map(|(w, parents)| self.extend(w, &parents, i)).collect();
        }
        readings.sort_by(|a, b| b.0.total_cmp(&a.0));
        readings.truncate(READINGS_MAX);
        readings.into_iter().map(|(w, parents)| (w, self.tree(&parents))).collect()
    }

    /// The row as what tells `phrase` from others.
    pub(crate) fn restrict(&self, phrase: &Phrase) -> Weighed<Phrase> {
        let told = |links: Vec<Related>| {
            let mut told = phrase.clone();
            told.within.extend(links.iter().map(Related::restriction));
            told
        };
        self.attach().into_iter().map(|(w, links)| (w, told(links))).collect()
    }

    /// Ways to attach link `i`: to the head (0) or to an earlier link's landmark (its number from one)
    /// that is still open.
    fn extend(&self, weight: f64, parents: &[usize], i: usize) -> Weighed<Vec<usize>> {
        let mut open = Vec::new();
        let mut node = i;
        while node > 0 {
            open.push(node);
            node = parents[node - 1];
        }
        let mut left = weight;
        let mut out = Vec::new();
        let (link, apart) = &self.links[i];
        for node in open {
            let low = if *apart { 0.0 } else { p_low(&self.links[node - 1].0, link) };
            if low > 0.0 {
                out.push((left * low, [parents, &[node]].concat()));
                left *= 1.0 - low;
            }
        }
        out.push((left, [parents, &[0]].concat()));
        out
    }

    fn tree(&self, parents: &[usize]) -> Vec<Related> {
        let mut links: Vec<Related> = self.links.iter().map(|(r, _)| r.clone()).collect();
        // A link comes after what it attaches to: from the last on, each is complete.
        let own: Vec<usize> =
            links.iter().map(|l| l.landmarks.last().map_or(0, |p| p.within.len())).collect();
        for i in (0..links.len()).rev() {
            if parents[i] > 0 {
                let host = parents[i] - 1;
                let link = links[i].restriction();
                if let Some(landmark) = links[host].landmarks.last_mut() {
                    landmark.within.insert(own[host], link);
                }
            }
        }
        links.into_iter().zip(parents).filter(|(_, p)| **p == 0).map(|(r, _)| r).collect()
    }
}

/// Probability that `link` tells where the landmark of `host` is rather than what the host tells of.
/// Hand-set from English usage: a static relation mostly goes with the nearest noun, a way ("down the
/// hall") with what lies at its end; one is told the side of a door, but not of a hallway.
fn p_low(host: &Related, link: &Related) -> f64 {
    let Some(Head::Named(name)) = host.landmarks.last().map(|l| &l.head) else { return 0.0 };
    if name.as_str() == "floor" {
        return 0.0;
    }
    let way = is_way(name.as_str());
    let door = name.as_str().ends_with("door") || name.as_str().ends_with("doors");
    match link.relation {
        R::To | R::Contains => 0.8,
        R::LeftOf | R::RightOf | R::LeftSide | R::RightSide if door => 0.75,
        _ if way => 0.25,
        R::LeftOf | R::RightOf | R::LeftSide | R::RightSide | R::AheadOf | R::OnLevel => 0.4,
        R::Down | R::Along | R::Through | R::Past | R::Across | R::Around | R::Towards | R::AwayFrom => 0.3,
        _ => 0.65,
    }
}
