//! What the judge learns: of what kind the next act is, and which proposal it is.

use crate::Sentence;
use std::collections::HashMap;
use toponym_core::language::reader::decide::Found;
use toponym_core::language::reader::features::{Feature, Text};
use toponym_core::language::reader::judge::{Row, Weights};
use toponym_core::language::reader::kind::{KINDS, Kind};
use toponym_core::language::reader::of_kinds::History;

/// Of the descent: step, decay of weights, rounds. Chosen by halves of the sentences.
const RATE: f32 = 0.05;
const DECAY: f32 = 1e-2;
const ROUNDS: usize = 10;
/// Features that fewer outcomes have are left out, for size: of six or ten as much is read.
const SEEN: u32 = 8;
/// Smaller slopes change nothing.
const LEAST: f32 = 1e-3;

/// Which kind is next; any of some is right.
struct KindChoice {
    weight: f32,
    features: Vec<u32>,
    right: [bool; KINDS],
}

/// Which proposal is next; any of some is right.
struct GroupChoice {
    weight: f32,
    outcomes: Vec<(Vec<u32>, bool)>,
}

/// Features as indices of weights.
#[derive(Default)]
struct Index {
    of: HashMap<Feature, u32>,
    seen: Vec<u32>,
}

impl Index {
    fn all(&mut self, features: &[Feature]) -> Vec<u32> {
        let index = |f: &Feature| {
            let next = self.of.len() as u32;
            let k = *self.of.entry(*f).or_insert(next);
            if k == next {
                self.seen.push(0);
            }
            self.seen[k as usize] += 1;
            k
        };
        features.iter().map(index).collect()
    }

    fn prune(&self, features: &mut Vec<u32>) {
        features.retain(|k| self.seen[*k as usize] >= SEEN);
    }
}

/// Multinomial logistic regressions by AdaGrad: of the outcomes some are right, −log of their sum is the loss.
pub fn train(sentences: &[&Sentence]) -> Weights {
    let (mut of_kinds, mut of_groups) = (Index::default(), Index::default());
    let (mut kinds, mut groups) = (Vec::new(), Vec::new());
    for s in sentences {
        choices(s, &mut of_kinds, &mut of_groups, &mut kinds, &mut groups);
    }
    for choice in &mut kinds {
        of_kinds.prune(&mut choice.features);
    }
    for (features, _) in groups.iter_mut().flat_map(|c: &mut GroupChoice| &mut c.outcomes) {
        of_groups.prune(features);
    }
    let rows = descend_kinds(&kinds, of_kinds.of.len());
    let weights = descend_groups(&groups, of_groups.of.len());
    Weights {
        kinds: of_kinds.of.into_iter().map(|(f, k)| (f, rows[k as usize])).collect(),
        groups: of_groups.of.into_iter().map(|(f, k)| (f, weights[k as usize])).collect(),
    }
}

/// All choices of a sentence: act by act, and that there is no more.
fn choices(
    s: &Sentence,
    of_kinds: &mut Index,
    of_groups: &mut Index,
    kinds: &mut Vec<KindChoice>,
    groups: &mut Vec<GroupChoice>,
) {
    let found = Found::new(&s.text);
    let text = Text::new(&found.tokens, &found.groups);
    let mut history = History::default();
    let Some(reading) = s.readings.first() else { return };
    let mut features = Vec::new();
    for n in 0..=reading.len() {
        let mut right = [false; KINDS];
        right[reading.get(n).map_or(Kind::Nothing, |a| a.kind) as usize] = true;
        if n == 0 {
            let firsts = s.readings.iter().map(|r| r.first().map_or(Kind::Nothing, |a| a.kind));
            firsts.for_each(|kind| right[kind as usize] = true);
        }
        kinds.push(KindChoice { weight: s.weight, features: of_kinds.all(&text.next_kind(&history)), right });
        let Some(act) = reading.get(n) else { break };
        // What can't be proposed tells of its kind alone, and nothing of what comes after it.
        let Some(&said) = act.right.iter().find(|p| !found.is_said(&history, **p)) else { break };
        let mut outcomes = Vec::new();
        for &p in act.proposals.iter().filter(|p| !found.is_said(&history, **p)) {
            let proposal = &found.proposals[p];
            text.features(proposal, &mut features);
            features.extend(text.next_groups(proposal, &history));
            outcomes.push((of_groups.all(&features), act.right.contains(&p)));
        }
        if outcomes.len() > 1 {
            groups.push(GroupChoice { weight: s.weight, outcomes });
        }
        history = found.after(&history, said);
    }
}

/// A die that falls alike each time.
fn shuffle<T>(all: &mut [T], seed: &mut u64) {
    for i in (1..all.len()).rev() {
        *seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        all.swap(i, ((*seed >> 33) as usize) % (i + 1));
    }
}

/// Slopes of −log Σ p(right) by the log-odds of the outcomes.
fn slopes(z: &[f32], right: impl Fn(usize) -> bool) -> Vec<f32> {
    let most = z.iter().copied().fold(f32::NEG_INFINITY, f32::max);
    let e: Vec<f32> = z.iter().map(|z| (z - most).exp()).collect();
    let sum: f32 = e.iter().sum();
    let sum_right: f32 = (0..e.len()).filter(|&o| right(o)).map(|o| e[o]).sum();
    let target = |o: usize| if right(o) { e[o] / sum_right.max(1e-20) } else { 0.0 };
    (0..e.len()).map(|o| e[o] / sum - target(o)).collect()
}

fn step(weight: &mut f32, square: &mut f32, slope: f32) {
    let g = slope + DECAY * *weight;
    *square += g * g;
    *weight -= RATE * g / square.sqrt();
}

fn descend_kinds(choices: &[KindChoice], n: usize) -> Vec<Row> {
    let (mut weights, mut squares) = (vec![[0.0_f32; KINDS]; n], vec![[0.1_f32; KINDS]; n]);
    let mut order: Vec<&KindChoice> = choices.iter().collect();
    let mut seed = 12345_u64;
    for _ in 0..ROUNDS {
        shuffle(&mut order, &mut seed);
        for c in &order {
            let mut z = [0.0_f32; KINDS];
            for &k in &c.features {
                z.iter_mut().zip(&weights[k as usize]).for_each(|(z, w)| *z += w);
            }
            for (kind, slope) in slopes(&z, |o| c.right[o]).into_iter().enumerate() {
                let slope = c.weight * slope;
                if slope.abs() >= LEAST {
                    for &k in &c.features {
                        step(&mut weights[k as usize][kind], &mut squares[k as usize][kind], slope);
                    }
                }
            }
        }
    }
    weights
}

fn descend_groups(choices: &[GroupChoice], n: usize) -> Vec<f32> {
    let (mut weights, mut squares) = (vec![0.0_f32; n], vec![0.1_f32; n]);
    let mut order: Vec<&GroupChoice> = choices.iter().collect();
    let mut seed = 54321_u64;
    for _ in 0..ROUNDS {
        shuffle(&mut order, &mut seed);
        for c in &order {
            let z: Vec<f32> =
                c.outcomes.iter().map(|(f, _)| f.iter().map(|&k| weights[k as usize]).sum()).collect();
            for ((features, _), slope) in c.outcomes.iter().zip(slopes(&z, |o| c.outcomes[o].1)) {
                let slope = c.weight * slope;
                if slope.abs() >= LEAST {
                    for &k in features {
                        step(&mut weights[k as usize], &mut squares[k as usize], slope);
                    }
                }
            }
        }
    }
    weights
}
