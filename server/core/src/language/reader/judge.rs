//! The judge: weights of features that `--example reader -- train` learns from sentences with readings.

use crate::language::reader::decide::Kinds;
use crate::language::reader::features::Feature;
use crate::language::reader::kind::Kind;
use std::sync::LazyLock;

/// Kinds that go together: how many, then each as how many kinds and which; then feature and weight, 4 + 1 bytes
/// each, sorted by feature; a weight is in units of [`UNIT`].
const LEARNED: &[u8] = include_bytes!("../../../lexicon/english/judge.bin");
/// One step of a weight.
const UNIT: f32 = 1.0 / 32.0;

/// Smaller weights, in steps, are left out: half of all, and none is missed.
const LEAST: i8 = 2;

const BUCKET_BITS: u32 = 16;

/// What was learned.
#[derive(Clone, Debug, Default)]
pub struct Judge {
    kinds: Vec<Kinds>,
    features: Vec<Feature>,
    weights: Vec<i8>,
    /// Where features begin whose first [`BUCKET_BITS`] bits are so much: hashes are spread evenly.
    buckets: Vec<u32>,
}

impl Judge {
    /// That which was learned.
    pub fn learned() -> &'static Self {
        static JUDGE: LazyLock<Judge> = LazyLock::new(|| Judge::read(LEARNED));
        &JUDGE
    }

    /// From bytes, as [`Self::written`] has them.
    pub fn read(bytes: &[u8]) -> Self {
        let mut judge = Self::default();
        let mut bytes = bytes.iter().copied();
        let mut next = || bytes.next().unwrap_or(0);
        for _ in 0..next() {
            let n = next();
            judge.kinds.push((0..n).map(|_| Kind::ALL[usize::from(next()) % Kind::ALL.len()]).collect());
        }
        let rest: Vec<u8> = bytes.collect();
        for entry in rest.chunks_exact(5) {
            judge.features.push(u32::from_le_bytes([entry[0], entry[1], entry[2], entry[3]]));
            judge.weights.push(entry[4] as i8);
        }
        let begins =
            |bucket: u32| judge.features.partition_point(|f| f >> (32 - BUCKET_BITS) < bucket) as u32;
        judge.buckets = (0..=1 << BUCKET_BITS).map(begins).collect();
        judge
    }

    /// As a file.
    pub fn written(kinds: &[Kinds], weights: &[(Feature, f32)]) -> Vec<u8> {
        let mut out = vec![kinds.len() as u8];
        for all in kinds {
            out.push(all.len() as u8);
            out.extend(all.iter().map(|k| *k as u8));
        }
        let mut sorted: Vec<(Feature, i8)> = weights
            .iter()
            .map(|&(f, w)| (f, (w / UNIT).round().clamp(-127.0, 127.0) as i8))
            .filter(|(_, w)| w.abs() >= LEAST)
            .collect();
        sorted.sort_unstable();
        out.extend(sorted.iter().flat_map(|(f, w)| f.to_le_bytes().into_iter().chain([*w as u8])));
        out
    }

    /// Kinds of acts that texts have together.
    pub fn kinds(&self) -> &[Kinds] {
        &self.kinds
    }

    /// Weight of a feature.
    pub fn weight(&self, feature: Feature) -> f64 {
        let bucket = (feature >> (32 - BUCKET_BITS)) as usize;
        let [Some(&from), Some(&to)] = [bucket, bucket + 1].map(|b| self.buckets.get(b)) else { return 0.0 };
        let within = &self.features[from as usize..to as usize];
        let steps = within.iter().position(|f| *f == feature).map_or(0, |i| self.weights[from as usize + i]);
        f64::from(steps) * f64::from(UNIT)
    }
}
