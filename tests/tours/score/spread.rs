//! Medians, worst deciles, calibration.

use serde::Serialize;
use toponym_sim::Draw;

/// Edges of the bins of calibration.
const BINS: usize = 10;
/// Seeds drawn anew so many times.
const REDRAWN: usize = 1000;
/// Weights below this are told apart: a filter that is sure in easy moments hides by them how it doubts.
const SURE: f64 = 0.95;

/// Which way is bad.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Bad {
    /// Small values are: a mass, a share of right ones.
    Low,
    /// Large values are: an error.
    High,
}

/// Middle and bad end of a figure over the seeds.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Spread {
    /// Half of the seeds are better.
    pub median: f64,
    /// Nine in ten are better.
    pub worst_decile: f64,
}

impl Spread {
    /// Of no value there is none.
    pub fn of(values: &[f64], bad: Bad) -> Option<Self> {
        let worst = match bad {
            Bad::Low => 0.1,
            Bad::High => 0.9,
        };
        Some(Self { median: quantile(values, 0.5)?, worst_decile: quantile(values, worst)? })
    }
}

/// The value below which a share of the values lies, blended between neighbours.
pub fn quantile(values: &[f64], share: f64) -> Option<f64> {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let at = share * sorted.len().checked_sub(1)? as f64;
    let below = sorted[at as usize];
    let above = sorted[(at.ceil() as usize).min(sorted.len() - 1)];
    Some(below + (at - at.floor()) * (above - below))
}

/// The middle value.
pub fn median(values: &[f64]) -> Option<f64> {
    quantile(values, 0.5)
}

/// What was claimed with which probability, and whether it was so.
pub type Claim = (f64, bool);

/// How well claims are calibrated.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Calibration {
    /// Claims.
    pub count: usize,
    /// Mean over the bins, weighted by their claims, of |mean claimed − share true|.
    pub ece: f64,
    /// 95 % of it, by drawing seeds anew.
    pub ece_95: [f64; 2],
    /// By what was claimed, from 0 to 1 in tenths; empty ones are left out.
    pub bins: Vec<Bin>,
}

/// Claims of about the same probability.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Bin {
    /// Claims of at least this; the bin is a tenth wide.
    pub from: f64,
    /// How many.
    pub count: usize,
    /// Their mean.
    pub claimed: f64,
    /// The share of them that was so.
    pub right: f64,
}

impl Calibration {
    /// Of claims by seed; none without claims.
    pub fn of(seeds: &[Vec<Claim>]) -> Option<Self> {
        let all: Vec<Claim> = seeds.concat();
        let bins = bins(&all);
        let ece = error(&bins)?;
        let mut draw = Draw::new(1, 0);
        let redrawn: Vec<f64> = (0..REDRAWN)
            .filter_map(|_| {
                let drawn: Vec<Claim> =
                    (0..seeds.len()).flat_map(|_| seeds[draw.below(seeds.len())].clone()).collect();
                error(&self::bins(&drawn))
            })
            .collect();
        let ece_95 = [0.025, 0.975].map(|share| quantile(&redrawn, share).unwrap_or(ece));
        Some(Self { count: all.len(), ece, ece_95, bins })
    }

    /// Of the claims that are not all but sure.
    pub fn of_unsure(seeds: &[Vec<Claim>]) -> Option<Self> {
        let unsure = |claims: &Vec<Claim>| claims.iter().copied().filter(|c| c.0 < SURE).collect();
        Self::of(&seeds.iter().map(unsure).collect::<Vec<_>>())
    }
}

fn bins(claims: &[Claim]) -> Vec<Bin> {
    let mut sums = [(0_usize, 0.0, 0_usize); BINS];
    for (claimed, so) in claims {
        let sum = &mut sums[((claimed * BINS as f64) as usize).min(BINS - 1)];
        *sum = (sum.0 + 1, sum.1 + claimed, sum.2 + usize::from(*so));
    }
    let filled = sums.iter().enumerate().filter(|(_, s)| s.0 > 0);
    filled
        .map(|(k, &(count, claimed, so))| Bin {
            from: k as f64 / BINS as f64,
            count,
            claimed: claimed / count as f64,
            right: so as f64 / count as f64,
        })
        .collect()
}

fn error(bins: &[Bin]) -> Option<f64> {
    let count: usize = bins.iter().map(|b| b.count).sum();
    let sum: f64 = bins.iter().map(|b| b.count as f64 * (b.claimed - b.right).abs()).sum();
    (count > 0).then(|| sum / count as f64)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_worst_decile_is_on_the_bad_side() {
        let values: Vec<f64> = (0..=10).rev().map(f64::from).collect();
        assert_eq!(Spread::of(&values, Bad::Low), Some(Spread { median: 5.0, worst_decile: 1.0 }));
        assert_eq!(Spread::of(&values, Bad::High), Some(Spread { median: 5.0, worst_decile: 9.0 }));
        assert_eq!(Spread::of(&[], Bad::High), None);
        assert_eq!(median(&[1.0, 2.0]), Some(1.5));
    }

    #[test]
    fn calibration_is_the_gap_between_claimed_and_true_by_bin() {
        // 0.8 claimed and four of five so: no gap. 0.6 claimed and none so: a gap of 0.6 for two of seven.
        let seeds = vec![
            vec![(0.8, true), (0.8, true), (0.8, true)],
            vec![(0.8, true), (0.8, false), (0.6, false), (0.6, false)],
        ];
        let calibration = Calibration::of(&seeds).unwrap();
        assert_eq!(calibration.count, 7);
        assert!((calibration.ece - 0.6 * 2.0 / 7.0).abs() < 1e-12);
        assert_eq!(
            calibration.bins.iter().map(|b| (b.from, b.count)).collect::<Vec<_>>(),
            [(0.6, 2), (0.8, 5)]
        );
        assert_eq!(Calibration::of(&[vec![]]), None);
    }

    #[test]
    fn sure_claims_are_told_apart() {
        let seeds = vec![vec![(1.0, true), (0.95, true), (0.94, false)]];
        assert_eq!(Calibration::of_unsure(&seeds).unwrap().count, 1);
        assert!((Calibration::of_unsure(&seeds).unwrap().ece - 0.94).abs() < 1e-12);
        assert_eq!(Calibration::of(&seeds).unwrap().bins.last().unwrap().count, 3, "1.0 is in the last bin");
    }

    #[test]
    fn the_interval_is_that_of_drawing_seeds_anew() {
        // Of two seeds, one all right and one all wrong: redrawn, both, or one of them twice.
        let seeds = vec![vec![(1.0, true); 4], vec![(1.0, false); 4]];
        let calibration = Calibration::of(&seeds).unwrap();
        assert!((calibration.ece - 0.5).abs() < 1e-12);
        let is = |[low, high]: [f64; 2], want: [f64; 2]| {
            (low - want[0]).abs() < 1e-12 && (high - want[1]).abs() < 1e-12
        };
        assert!(is(calibration.ece_95, [0.0, 1.0]));
        // Of seeds that are alike there is nothing to draw.
        assert!(is(Calibration::of(&vec![vec![(0.9, true)]; 5]).unwrap().ece_95, [0.1, 0.1]));
        assert_eq!(Calibration::of(&seeds), Calibration::of(&seeds));
    }
}
