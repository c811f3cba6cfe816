//! What the judge learns: which kinds of acts a text has, and which proposal each of them is.

use crate::Sentence;
use std::collections::{BTreeMap, HashMap};
use toponym_core::language::reader::decide::Kinds;
use toponym_core::language::reader::features::{Feature, Text};

/// Of the descent: step, decay of weights, rounds. Chosen by halves of the sentences.
const RATE: f32 = 0.05;
const DECAY: f32 = 1e-2;
const ROUNDS: usize = 10;

/// What is learned: kinds that go together, and weights.
pub struct Learned {
    pub kinds: Vec<Kinds>,
    pub weights: HashMap<Feature, f32>,
}

/// One choice among outcomes, each with its features; those that are right.
struct Choosing {
    weight: f32,
    outcomes: Vec<Vec<u32>>,
    right: Vec<usize>,
}

/// Multinomial logistic regression by AdaGrad: of the outcomes some are right, −log of their sum is the loss.
pub fn train(sentences: &[&Sentence]) -> Learned {
    let mut counts: BTreeMap<Kinds, usize> = BTreeMap::new();
    for s in sentences {
        for k in &s.kinds {
            *counts.entry(k.clone()).or_default() += 1;
        }
    }
    let kinds: Vec<Kinds> = counts.into_iter().filter(|(_, n)| *n >= 2).map(|(k, _)| k).take(250).collect();
    let mut index: HashMap<Feature, u32> = HashMap::new();
    let mut seen: HashMap<Feature, u32> = HashMap::new();
    for s in sentences {
        for f in s.whole.iter().chain(s.features.iter().flatten()) {
            *seen.entry(*f).or_default() += 1;
        }
    }
    let of = |f: Feature, n: u32, index: &mut HashMap<Feature, u32>| -> Option<u32> {
        let next = index.len() as u32;
        (n > 1).then(|| *index.entry(f).or_insert(next))
    };
    let mut choosing: Vec<Choosing> = Vec::new();
    for s in sentences {
        let right: Vec<usize> = (0..kinds.len()).filter(|&k| s.kinds.contains(&kinds[k])).collect();
        if !right.is_empty() {
            let outcomes = (0..kinds.len())
                .map(|k| {
                    // Rare words tell of one text only.
                    let known: Vec<Feature> = s.whole.iter().copied().filter(|f| seen[f] > 1).collect();
                    let all = Text::of_kinds(&known, &kinds[k], k);
                    all.into_iter().filter_map(|f| of(f, 2, &mut index)).collect()
                })
                .collect();
            choosing.push(Choosing { weight: s.weight, outcomes, right });
        }
        for (kind, right) in &s.groups {
            let all: Vec<usize> = (0..s.found.proposals.len())
                .filter(|&p| {
                    s.found.proposals[p].kind == *kind && (right.contains(&p) || !s.right.contains(&p))
                })
                .collect();
            if all.len() < 2 {
                continue;
            }
            let outcomes = all
                .iter()
                .map(|&p| s.features[p].iter().filter_map(|&f| of(f, seen[&f], &mut index)).collect())
                .collect();
            let right = (0..all.len()).filter(|&i| right.contains(&all[i])).collect();
            choosing.push(Choosing { weight: s.weight, outcomes, right });
        }
    }
    let weights = descend(&choosing, index.len());
    Learned { kinds, weights: index.into_iter().map(|(f, k)| (f, weights[k as usize])).collect() }
}

fn descend(choosing: &[Choosing], n: usize) -> Vec<f32> {
    let mut w = vec![0_f32; n];
    let mut squares = vec![0.1_f32; n];
    let mut order: Vec<usize> = (0..choosing.len()).collect();
    let mut seed = 12345_u64;
    for _ in 0..ROUNDS {
        for i in (1..order.len()).rev() {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            order.swap(i, ((seed >> 33) as usize) % (i + 1));
        }
        for &i in &order {
            let c = &choosing[i];
            let z: Vec<f32> = c.outcomes.iter().map(|o| o.iter().map(|&k| w[k as usize]).sum()).collect();
            let most = z.iter().copied().fold(f32::NEG_INFINITY, f32::max);
            let e: Vec<f32> = z.iter().map(|z| (z - most).exp()).collect();
            let sum: f32 = e.iter().sum();
            let right: f32 = c.right.iter().map(|&r| e[r]).sum();
            for (o, features) in c.outcomes.iter().enumerate() {
                let target = if c.right.contains(&o) { e[o] / right.max(1e-20) } else { 0.0 };
                let g = c.weight * (e[o] / sum - target);
                if g.abs() < 1e-3 {
                    continue;
                }
                for &k in features {
                    let k = k as usize;
                    let gk = g + DECAY * w[k];
                    squares[k] += gk * gk;
                    w[k] -= RATE * gk / squares[k].sqrt();
                }
            }
        }
    }
    w
}
