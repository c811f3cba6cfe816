//! The one model of names: whether a name applies, what will be said next, and who is called alike.
//!
//! A support (a place with what lies near it; a room once rooms are known) bears names with a Dirichlet
//! over an open vocabulary, eq. (12): what was said of it, over a base measure p₀ of total concentration
//! [`BASE`]. A sentence is false with probability ε = [`FALSE_TALK`]. One utterance is one unit of evidence.
//!
//! ```text
//! p(l | evidence)   = (α_l + α₀ p₀(l) f_l) / Σ_k (α_k + α₀ p₀(k) f_k)       Σ_l p = 1
//! p(λ | evidence)   = (1 − ε) p(l | evidence) + ε p₀(l)
//! P(l applies)      = α_l / (α_l + ε / (1 − ε))                             1 − ε after one utterance
//! ```
//!
//! α_l is what was said less what was denied. Where more was denied, α_l is 0 and f_l = P(denial is false)
//! is left of the name's share in the base; else f_l is 1.

use crate::geometry::Pose2;
use std::collections::BTreeMap;

/// Index of a name in the ledger.
pub type LabelId = u32;

/// ε: one sentence in ten is false, misheard, or put where it does not belong.
pub const FALSE_TALK: f64 = 0.1;
/// α₀: total concentration of the names not said: the paper's α. One utterance leaves one chance in six that the
/// next calls the place something else.
pub const BASE: f64 = 0.2;
/// Concentration against a name that was said: one utterance leaves ε of doubt.
const DOUBT: f64 = FALSE_TALK / (1.0 - FALSE_TALK);
/// Names people may use of a place before any was said: the size of the lexicon, about.
const NAMES: f64 = 150.0;
/// The same of ways: a hallway is called a hallway wherever it is.
const NAMES_OF_WAYS: f64 = 2.0;
/// How near two places are for what is said of one to be expected of the other: standard deviation
/// of a Gaussian kernel, the size of a room.
const JOINED_M: f64 = 3.0;
/// The same of places where nothing is seen: what is open so far that the laser finds no wall is one yard.
const DARK_M: f64 = 10.0;
/// Two such places whose floors nothing ties are of one yard so often, wherever they seem to lie: a building has
/// hardly more than one. Assumed.
const ONE_YARD: f64 = 0.5;

/// Over what a name holds: which sites share what is said of them.
pub trait Support {
    /// Calls `each` with every site that anything was said of and that is joined with `here`, itself too, and
    /// the share of what is said there that holds here, in (0, 1].
    fn joined(&self, here: usize, each: impl FnMut(usize, f64));
}

/// Share of what is said of a place that holds for another, so far away in a particle's map.
pub fn share(distance_m: f64) -> f64 {
    share_of_square(distance_m * distance_m)
}

fn share_of_square(distance_m2: f64) -> f64 {
    (distance_m2 * (-0.5 / (JOINED_M * JOINED_M))).exp()
}

/// Beyond, [`share`] is less than 4·10⁻⁶.
pub const REACH_M: f64 = 5.0 * JOINED_M;

/// A place that something is said of, in one particle's map.
#[derive(Clone, Copy, Debug)]
pub struct Site {
    /// Where it lies.
    pub pose: Pose2,
    /// Its floor: what nothing ties is no one room, else a fit would tie it.
    pub floor: usize,
    /// Whether nothing is seen there. No fit tells the dark from the dark, and it is wide.
    pub dark: bool,
    /// What vague stretches of path add up to before it, variance, m².
    pub drift_m2: f64,
}

/// Share of what is said of one place that holds for another, over where they may lie.
pub fn share_between(a: &Site, b: &Site) -> f64 {
    let distance_m2 = (b.pose.x_m - a.pose.x_m).powi(2) + (b.pose.y_m - a.pose.y_m).powi(2);
    if a.dark && b.dark {
        let within =
            |variance_m2: f64| DARK_M.powi(2) / variance_m2 * (-0.5 * distance_m2 / variance_m2).exp();
        if a.floor == b.floor {
            within(DARK_M.powi(2))
        } else {
            let drift_m2 = (a.drift_m2 - b.drift_m2).abs();
            ONE_YARD + (1.0 - ONE_YARD) * within(DARK_M.powi(2) + drift_m2)
        }
    } else if a.floor == b.floor {
        share_of_square(distance_m2)
    } else {
        0.0
    }
}

/// Places in one particle's map: what is said of one holds for what lies near, by [`share_between`].
pub struct Near {
    sites: Vec<Site>,
    /// Sites with anything said of them, by square of [`REACH_M`].
    cells: BTreeMap<(i64, i64), Vec<u32>>,
    /// Such as lie in the dark.
    dark: Vec<u32>,
}

impl Near {
    /// None of them has anything said of it yet.
    pub fn new(sites: Vec<Site>) -> Self {
        Self { sites, cells: BTreeMap::new(), dark: Vec::new() }
    }

    /// One of them.
    pub fn site(&self, site: usize) -> &Site {
        &self.sites[site]
    }

    /// From now on something is said of a site. Once for each.
    pub fn tell(&mut self, site: usize) {
        let Site { pose, dark, .. } = &self.sites[site];
        self.cells.entry(cell(pose)).or_default().push(site as u32);
        if *dark {
            self.dark.push(site as u32);
        }
    }
}

fn cell(pose: &Pose2) -> (i64, i64) {
    ((pose.x_m / REACH_M).floor() as i64, (pose.y_m / REACH_M).floor() as i64)
}

impl Support for Near {
    fn joined(&self, here: usize, mut each: impl FnMut(usize, f64)) {
        let at = &self.sites[here];
        let (x, y) = cell(&at.pose);
        let around = (-1..=1).flat_map(|dx| (-1..=1).map(move |dy| (x + dx, y + dy)));
        let near = around.filter_map(|c| self.cells.get(&c)).flatten();
        let is_near = |k: &&u32| {
            let to = &self.sites[**k as usize];
            !(at.dark && to.dark) && to.pose.distance_m(&at.pose) < REACH_M
        };
        for &k in near.filter(is_near).chain(self.dark.iter().filter(|_| at.dark)) {
            match share_between(at, &self.sites[k as usize]) {
                0.0 => {}
                share => each(k as usize, share),
            }
        }
    }
}

/// What was said for a name and against it, in utterances.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Tally {
    /// Said to be so.
    pub said: f64,
    /// Said not to be so.
    pub denied: f64,
}

impl Tally {
    /// α_l.
    pub fn concentration(self) -> f64 {
        (self.said - self.denied).max(0.0)
    }

    /// P(name applies), as α_l has it.
    pub fn applies(self) -> f64 {
        self.concentration() / (self.concentration() + DOUBT)
    }

    /// P(name applies) for who is told of it: what one utterance may have said is as likely as that it said so.
    pub fn told(self) -> f64 {
        self.concentration() / (self.concentration().max(1.0) + DOUBT)
    }

    /// f_l: what denial leaves of the name's share in the base measure.
    pub fn left(self) -> f64 {
        DOUBT / (DOUBT + (self.denied - self.said).max(0.0))
    }

    /// Adds a share of another.
    pub fn add(&mut self, other: Self, share: f64) {
        self.said += share * other.said;
        self.denied += share * other.denied;
    }
}

/// All that speaks for a name somewhere.
#[derive(Clone, Copy, Debug)]
pub struct Spoken {
    /// What was said of it outright.
    pub tally: Tally,
    /// Probability that no description means it: the Δα of one is a probability already, eq. (16).
    pub undescribed: f64,
}

impl Default for Spoken {
    fn default() -> Self {
        Self { tally: Tally::default(), undescribed: 1.0 }
    }
}

impl Spoken {
    /// Probability that a description means it; what was denied is not what was described.
    pub fn described(self) -> f64 {
        if self.tally.left() < 1.0 { 0.0 } else { 1.0 - self.undescribed }
    }

    /// P(name applies).
    pub fn applies(self) -> f64 {
        1.0 - (1.0 - self.tally.told()) * (1.0 - self.described())
    }
}

/// p₀: how often a name is said of anything of its class. Names of ways and of rooms are no rivals: who stands in
/// a door says either.
#[derive(Clone, Debug, Default)]
pub struct BaseMeasure {
    /// Utterances by name.
    times: Vec<f64>,
    /// Which names are those of ways.
    ways: Vec<bool>,
    /// Utterances of either class, and names said or that might be.
    all: [f64; 2],
    names: [f64; 2],
}

impl BaseMeasure {
    /// Of the names in the ledger, each of a way or not, none said yet.
    pub fn new(ways: Vec<bool>) -> Self {
        let of_ways = ways.iter().filter(|w| **w).count() as f64;
        let of_rooms = ways.len() as f64 - of_ways;
        let names = [NAMES.max(of_rooms + 1.0), NAMES_OF_WAYS.max(of_ways + 1.0)];
        Self { times: vec![0.0; ways.len()], ways, all: [0.0; 2], names }
    }

    /// Whether a name is that of a way.
    pub fn is_way(&self, label: LabelId) -> bool {
        self.ways.get(label as usize).copied().unwrap_or(false)
    }

    /// A name was said, with a probability.
    pub fn count(&mut self, label: LabelId, units: f64) {
        self.times[label as usize] += units;
        self.all[usize::from(self.is_way(label))] += units;
    }

    /// p₀(l) by all other sentences than one that said some names itself.
    pub fn probability(&self, label: LabelId, itself: &[(LabelId, f64)]) -> f64 {
        let is_way = self.is_way(label);
        let own = |of: &dyn Fn(LabelId) -> bool| itself.iter().filter(|o| of(o.0)).map(|o| o.1).sum::<f64>();
        let times = self.times.get(label as usize).copied().unwrap_or(0.0) - own(&|l| l == label);
        let class = usize::from(is_way);
        let all = self.all[class] - own(&|l| self.is_way(l) == is_way);
        (times.max(0.0) + 1.0) / (all.max(0.0) + self.names[class])
    }
}

/// (8–9): chance that two supports are called the same, by what was said of either: Σ_l α_l β_l, each over all
/// that was said there and the base. What base measures share is chance, and no evidence.
pub fn alike(of_a: f64, all_a: f64, of_b: f64, all_b: f64) -> f64 {
    of_a / (all_a + BASE) * (of_b / (all_b + BASE))
}

/// What a statement says for what makes it as probable as `ratio` times anything, when ε of talk is false.
pub fn unless_false(ratio: f64) -> f64 {
    (1.0 - FALSE_TALK) * ratio + FALSE_TALK
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_utterance_leaves_the_doubt_that_it_is_false_and_two_are_no_certainty() {
        let p = |said, denied| Tally { said, denied }.applies();
        assert!((p(1.0, 0.0) - 0.9).abs() < 1e-12);
        assert!(p(2.0, 0.0) > 0.9 && p(2.0, 0.0) < 0.96);
        assert_eq!((p(0.0, 0.0), p(1.0, 1.0), p(1.0, 2.0)), (0.0, 0.0, 0.0));
    }

    #[test]
    fn base_rates_sum_to_one_over_what_may_be_said() {
        let mut base = BaseMeasure::new(vec![false, false, false, true]);
        for (label, units) in [(0, 1.0), (0, 0.5), (2, 1.0), (3, 4.0)] {
            base.count(label, units);
        }
        for own in [&[][..], &[(0, 0.5)]] {
            // The other 147 names are as rare as one never said.
            let sum = (0..3).map(|l| base.probability(l, own)).sum::<f64>()
                + (NAMES - 3.0) * base.probability(99, own);
            assert!((sum - 1.0).abs() < 1e-12);
        }
        assert!(base.probability(3, &[]) > 0.5, "a hallway is called so");
    }
}
