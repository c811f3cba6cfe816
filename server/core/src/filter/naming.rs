//! The one model of names: whether a name applies, what will be said next, and who is called alike.
//!
//! A support (a place with what is of one room with it, by what is seen from either) bears names with a Dirichlet
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
use crate::language::COMMON;
use crate::scan::enclosure::{Enclosure, of_one_room};

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
/// γ: concentration of p₀ over names not said yet. When ten rooms were told of, three in four of the next have a name
/// that was not said: assumed.
const NEW_NAMES: f64 = 30.0;
/// Discount: what each name said counts less, as rooms are named to be told apart (Pitman, Yor, 1997): assumed.
const DISCOUNT: [f64; 2] = [0.8, 0.0];
/// Share of rooms that bear one of the [`COMMON`] names: assumed.
const COMMON_SHARE: f64 = 0.5;
/// How near two places are for what is said of one to be expected of the other: standard deviation
/// of a Gaussian kernel, the size of a room.
const JOINED_M: f64 = 3.0;
/// The same of places that see each other with no door between, and what share of [`JOINED_M`] is left where they
/// do not: read off the table of `--example drives -- enclosed` of the server.
const IN_SIGHT_M: f64 = 12.0;
const THROUGH_WALLS: f64 = 0.1;
/// The same of places where nothing is seen: what is open so far that the laser finds no wall is one yard.
const DARK_M: f64 = 10.0;
/// Two such places whose floors nothing ties are of one yard so often, wherever they seem to lie: a building has
/// hardly more than one. Assumed.
const ONE_YARD: f64 = 0.5;

/// Over what a name holds: which sites share what is said of them.
pub trait Support {
    /// Every site that anything was said of and that is joined with `here`, itself too, and the share of what is said
    /// there that holds here, in (0, 1].
    fn joined(&mut self, here: usize) -> &[(u32, f64)];
}

/// Share of what is said of a place that holds for another, so far away in a particle's map.
pub fn share(distance_m: f64) -> f64 {
    share_of_square(distance_m * distance_m)
}

fn share_of_square(distance_m2: f64) -> f64 {
    (distance_m2 * (-0.5 / JOINED_M.powi(2))).exp()
}

/// Beyond, [`share`] is less than 4·10⁻⁶.
pub const REACH_M: f64 = 5.0 * JOINED_M;

/// A place that something is said of, in one particle's map.
#[derive(Clone, Copy, Debug)]
pub struct Site<'a> {
    /// Where it lies.
    pub pose: Pose2,
    /// Its floor: what nothing ties is no one room, else a fit would tie it.
    pub floor: usize,
    /// Whether nothing is seen there. No fit tells the dark from the dark, and it is wide.
    pub dark: bool,
    /// What vague stretches of path add up to before it, variance, m².
    pub drift_m2: f64,
    /// How far its room reaches, of a place that is in the graph by now.
    pub enclosure: Option<&'a Enclosure>,
}

/// Share of what is said of one place that holds for another, over where they may lie.
pub fn share_between(a: &Site<'_>, b: &Site<'_>) -> f64 {
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
    } else if a.floor == b.floor && distance_m2 < REACH_M * REACH_M {
        let near = share_of_square(distance_m2);
        let one = of_one_room(a.enclosure, b.enclosure, &a.pose.between(&b.pose));
        one.map_or(near, |one| {
            let in_sight = (distance_m2 * (-0.5 / IN_SIGHT_M.powi(2))).exp();
            one * in_sight + (1.0 - one) * THROUGH_WALLS * near
        })
    } else {
        0.0
    }
}

/// Places in one particle's map: what is said of one holds for others, by [`share_between`].
pub struct Near<'a> {
    sites: Vec<Site<'a>>,
    /// Sites with anything said of them, in the order told.
    told: Vec<u32>,
    /// By site, how many of those were looked at, and those that it is joined with: each pair is looked at once.
    joined: Vec<(usize, Vec<(u32, f64)>)>,
}

impl<'a> Near<'a> {
    /// None of them has anything said of it yet.
    pub fn new(sites: Vec<Site<'a>>) -> Self {
        let joined = vec![(0, Vec::new()); sites.len()];
        Self { sites, told: Vec::new(), joined }
    }

    /// From now on something is said of a site. Once for each.
    pub fn tell(&mut self, site: usize) {
        self.told.push(site as u32);
    }
}

impl Support for Near<'_> {
    fn joined(&mut self, here: usize) -> &[(u32, f64)] {
        let Self { sites, told, joined } = self;
        let (at, (looked_at, with)) = (&sites[here], &mut joined[here]);
        with.extend(told[*looked_at..].iter().filter_map(|&k| {
            let share = share_between(at, &sites[k as usize]);
            (share > 0.0).then_some((k, share))
        }));
        *looked_at = told.len();
        with
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

/// p₀: how often a name is said of anything of its class, (n_l − d)⁺ + (γ + Σ_k min(n_k, d)) s_l over n + γ with n_l
/// utterances, discount d, and shares s_l of names not said yet. Names of ways and of rooms are no rivals: who stands
/// in a door says either.
#[derive(Clone, Debug, Default)]
pub struct BaseMeasure {
    /// By name: how often it was said, of a way or not, and its share of what is said first.
    times: Vec<f64>,
    ways: Vec<bool>,
    shares: Vec<f64>,
    /// Such a share of a name that is none of these.
    other: f64,
    /// Utterances of either class, what is discounted of them, and γ.
    all: [f64; 2],
    discounted: [f64; 2],
    new: [f64; 2],
}

impl BaseMeasure {
    /// Of the names in the ledger, each of a way or not and common or not, none said yet.
    pub fn new(names: &[(bool, bool)]) -> Self {
        let of_ways = names.iter().filter(|name| name.0).count() as f64;
        let of_rooms = names.len() as f64 - of_ways;
        let ways = NAMES_OF_WAYS.max(of_ways + 1.0);
        let common = COMMON.len() as f64;
        let other = (1.0 - COMMON_SHARE) / (NAMES.max(of_rooms + common + 1.0) - common);
        let share = |&(is_way, is_common): &(bool, bool)| match (is_way, is_common) {
            (true, _) => 1.0 / ways,
            (false, true) => COMMON_SHARE / common,
            (false, false) => other,
        };
        Self {
            times: vec![0.0; names.len()],
            ways: names.iter().map(|name| name.0).collect(),
            shares: names.iter().map(share).collect(),
            other,
            all: [0.0; 2],
            discounted: [0.0; 2],
            new: [NEW_NAMES, ways],
        }
    }

    /// Whether a name is that of a way.
    pub fn is_way(&self, label: LabelId) -> bool {
        self.ways.get(label as usize).copied().unwrap_or(false)
    }

    /// A name was said, with a probability.
    pub fn count(&mut self, label: LabelId, units: f64) {
        let class = usize::from(self.is_way(label));
        let times = self.times[label as usize];
        self.discounted[class] += (times + units).min(DISCOUNT[class]) - times.min(DISCOUNT[class]);
        self.all[class] += units;
        self.times[label as usize] += units;
    }

    /// p₀(l) by all other sentences than one that said some names itself.
    pub fn probability(&self, label: LabelId, itself: &[(LabelId, f64)]) -> f64 {
        let class = usize::from(self.is_way(label));
        let times = |l: LabelId| self.times.get(l as usize).copied().unwrap_or(0.0);
        let (mut times_l, mut all, mut discounted) = (times(label), self.all[class], self.discounted[class]);
        for &(l, units) in itself.iter().filter(|own| usize::from(self.is_way(own.0)) == class) {
            let others = (times(l) - units).max(0.0);
            all -= units;
            discounted -= times(l).min(DISCOUNT[class]) - others.min(DISCOUNT[class]);
            if l == label {
                times_l = others;
            }
        }
        let share = self.shares.get(label as usize).copied().unwrap_or(self.other);
        let (new, said) = (self.new[class], (times_l - DISCOUNT[class]).max(0.0));
        (said + (new + discounted) * share) / (all.max(0.0) + new)
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
    use crate::scan::place::Content;
    use crate::scan::tests::seen;

    #[test]
    fn one_utterance_leaves_the_doubt_that_it_is_false_and_two_are_no_certainty() {
        let p = |said, denied| Tally { said, denied }.applies();
        assert!((p(1.0, 0.0) - 0.9).abs() < 1e-12);
        assert!(p(2.0, 0.0) > 0.9 && p(2.0, 0.0) < 0.96);
        assert_eq!((p(0.0, 0.0), p(1.0, 1.0), p(1.0, 2.0)), (0.0, 0.0, 0.0));
    }

    #[test]
    fn base_rates_sum_to_one_over_what_may_be_said() {
        let (way, common, other) = ((true, false), (false, true), (false, false));
        let mut names = vec![other, other, way];
        names.extend([common; COMMON.len()]);
        let mut base = BaseMeasure::new(&names);
        for (label, units) in [(0, 1.0), (0, 0.5), (3, 1.0), (2, 4.0)] {
            base.count(label, units);
        }
        for own in [&[][..], &[(0, 0.5)]] {
            let said = (0..names.len() as LabelId).filter(|l| *l != 2).map(|l| base.probability(l, own));
            let unsaid = NAMES - COMMON.len() as f64 - 2.0;
            let sum = said.sum::<f64>() + unsaid * base.probability(9999, own);
            assert!((sum - 1.0).abs() < 1e-12);
        }
        assert!(base.probability(2, &[]) > 0.5, "a hallway is called so");
        assert!(base.probability(4, &[]) > 2.0 * base.probability(1, &[]), "many rooms are offices");
    }

    /// Of a place within four walls, so far off.
    fn walled(wall_m: f64) -> Enclosure {
        let [near, far] = [-wall_m, wall_m];
        let walls =
            [[near, near, far, near], [far, near, far, far], [far, far, near, far], [near, far, near, near]];
        let sweep = seen(&walls, &Pose2::default());
        Enclosure::of(&Content::new(&[(Pose2::default(), &sweep)]))
    }

    #[test]
    fn what_is_said_holds_as_far_as_its_room_reaches() {
        let (hall, closet) = (walled(5.0), walled(1.5));
        let site = |x_m: f64, enclosure| Site {
            pose: Pose2::new(x_m, 0.0, 0.0),
            floor: 0,
            dark: false,
            drift_m2: 0.0,
            enclosure,
        };
        let share = |a, b| share_between(&site(0.0, a), &site(3.0, b));
        assert!(share(Some(&hall), Some(&hall)) > 0.9, "no wall between");
        assert!(share(Some(&closet), Some(&closet)) < 0.1, "a wall between");
        let unknown = share(None, None);
        assert!((unknown - super::share(3.0)).abs() < 1e-12, "nobody knows");
        assert!(share(Some(&closet), None) < unknown && unknown < share(Some(&hall), None));
        // Farther off, nothing holds that nobody sees.
        assert!(share_between(&site(0.0, Some(&closet)), &site(9.0, Some(&closet))) < 2e-3);
    }
}
