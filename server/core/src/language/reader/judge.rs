//! The judge: weights of features that `--example reader -- train` learns from sentences with readings.

use crate::language::reader::features::{FEATURE_BITS, Feature};
use crate::language::reader::kind::KINDS;
use std::sync::LazyLock;

/// A weight of each kind.
pub type Row = [f32; KINDS];

/// Weights of features for kinds and for groups; see [`Judge::written`].
const LEARNED: &[u8] = include_bytes!("../../../lexicon/english/judge.bin");
/// One step of a weight.
const UNIT: f32 = 1.0 / 32.0;
/// Smaller weights, in steps, are left out, for size: of kinds and of groups.
const LEAST: [i8; 2] = [3, 2];
const BUCKET_BITS: u32 = 16;

/// Values by feature, sorted.
#[derive(Clone, Debug, Default)]
struct Table<T> {
    features: Vec<Feature>,
    values: Vec<T>,
    /// Where features begin whose first [`BUCKET_BITS`] bits are so much: hashes are spread evenly.
    buckets: Vec<u32>,
}

impl<T> Table<T> {
    fn new(features: Vec<Feature>, values: Vec<T>) -> Self {
        let begins =
            |bucket: u32| features.partition_point(|f| f >> (FEATURE_BITS - BUCKET_BITS) < bucket) as u32;
        let buckets = (0..=1 << BUCKET_BITS).map(begins).collect();
        Self { features, values, buckets }
    }

    fn get(&self, feature: Feature) -> Option<&T> {
        let bucket = (feature >> (FEATURE_BITS - BUCKET_BITS)) as usize;
        let [from, to] = [self.buckets.get(bucket)?, self.buckets.get(bucket + 1)?].map(|b| *b as usize);
        let within = self.features[from..to].iter().position(|f| *f == feature)?;
        self.values.get(from + within)
    }
}

/// What was learned.
#[derive(Clone, Debug, Default)]
pub struct Judge {
    kinds: Table<[i8; KINDS]>,
    groups: Table<i8>,
}

/// Weights as they are learned.
#[derive(Clone, Debug, Default)]
pub struct Weights {
    /// Of features of texts, by kind.
    pub kinds: Vec<(Feature, Row)>,
    /// Of features of proposals.
    pub groups: Vec<(Feature, f32)>,
}

impl Judge {
    /// That which was learned.
    pub fn learned() -> &'static Self {
        static JUDGE: LazyLock<Judge> = LazyLock::new(|| Judge::read(LEARNED));
        &JUDGE
    }

    /// From bytes, as [`Self::written`] has them; what they lack weighs nothing.
    pub fn read(bytes: &[u8]) -> Self {
        let mut bytes = bytes.iter().copied();
        let next = &mut || bytes.next().unwrap_or(0);
        let mut feature = 0;
        let (mut features, mut rows) = (Vec::new(), Vec::new());
        for _ in 0..number(next) {
            feature = number(next).wrapping_add(feature);
            let mut row = [0_i8; KINDS];
            for _ in 0..next() {
                let kind = usize::from(next()) % KINDS;
                row[kind] = next() as i8;
            }
            features.push(feature);
            rows.push(row);
        }
        let kinds = Table::new(features, rows);
        let mut feature = 0;
        let (mut features, mut weights) = (Vec::new(), Vec::new());
        for _ in 0..number(next) {
            feature = number(next).wrapping_add(feature);
            features.push(feature);
            weights.push(next() as i8);
        }
        Self { kinds, groups: Table::new(features, weights) }
    }

    /// As a file: how many features for kinds, each as what it is more than the one before, with how many weights
    /// and these, each behind its kind; how many features for groups, each with its weight. Numbers are in groups of
    /// seven bits, the least first, all but the last with the eighth bit set.
    pub fn written(weights: &Weights) -> Vec<u8> {
        let steps = |w: f32| (w / UNIT).round().clamp(-127.0, 127.0) as i8;
        let mut out: Vec<u8> = Vec::new();
        let mut kinds: Vec<(Feature, Vec<u8>)> = Vec::new();
        for (feature, row) in &weights.kinds {
            let kept = row.iter().map(|w| steps(*w)).enumerate().filter(|(_, w)| w.abs() >= LEAST[0]);
            let kept: Vec<u8> = kept.flat_map(|(k, w)| [k as u8, w as u8]).collect();
            if !kept.is_empty() {
                kinds.push((*feature, kept));
            }
        }
        kinds.sort_unstable();
        push(kinds.len() as u32, &mut out);
        let mut before = 0;
        for (feature, kept) in kinds {
            push(feature - before, &mut out);
            before = feature;
            out.push((kept.len() / 2) as u8);
            out.extend(kept);
        }
        let mut groups: Vec<(Feature, i8)> =
            weights.groups.iter().map(|&(f, w)| (f, steps(w))).filter(|(_, w)| w.abs() >= LEAST[1]).collect();
        groups.sort_unstable();
        push(groups.len() as u32, &mut out);
        let mut before = 0;
        for (feature, weight) in groups {
            push(feature - before, &mut out);
            before = feature;
            out.push(weight as u8);
        }
        out
    }

    /// Adds a feature's weights for all kinds.
    pub fn add(&self, feature: Feature, sums: &mut Row) {
        if let Some(row) = self.kinds.get(feature) {
            sums.iter_mut().zip(row).for_each(|(sum, w)| *sum += f32::from(*w) * UNIT);
        }
    }

    /// A feature's weight for a proposal.
    pub fn weight(&self, feature: Feature) -> f32 {
        self.groups.get(feature).map_or(0.0, |w| f32::from(*w) * UNIT)
    }
}

/// A number, as [`push`] writes it; no more than fits.
fn number(next: &mut impl FnMut() -> u8) -> u32 {
    let mut number = 0;
    for shift in (0..32).step_by(7) {
        let byte = next();
        number |= u32::from(byte & 127) << shift;
        if byte < 128 {
            break;
        }
    }
    number
}

fn push(mut number: u32, out: &mut Vec<u8>) {
    while number >= 128 {
        out.push(number as u8 | 128);
        number >>= 7;
    }
    out.push(number as u8);
}
