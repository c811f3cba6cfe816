//! How well a judge reads sentences that it did not learn from.

use crate::lenient::{Act, acts, equal, same};
use crate::train::train;
use crate::{Sentence, kind, proposed};
use std::collections::BTreeMap;
use toponym_core::language::parse_by;
use toponym_core::language::reader::decide::Found;
use toponym_core::language::reader::judge::Judge;
use toponym_core::language::reader::kind::Kind;

/// A name, what is learned from, and what is read.
type Fold<'a> = (String, Vec<&'a Sentence>, Vec<&'a Sentence>);

/// Halves of all files by turns, then whole files.
pub fn cross(sets: &[(String, Vec<Sentence>)], ours: &[Sentence], show: bool) {
    let halves: Vec<Fold> = (0..2)
        .map(|half| {
            let is_held = |i: usize| i / 2 % 2 == half;
            let part = |held: bool| {
                let of = move |s: &'_ (String, Vec<Sentence>)| -> Vec<usize> {
                    (0..s.1.len()).filter(|&i| is_held(i) == held).collect()
                };
                sets.iter().flat_map(move |s| of(s).into_iter().map(move |i| &s.1[i]))
            };
            ("halves".to_owned(), part(false).chain(ours).collect(), part(true).collect())
        })
        .collect();
    told(&halves, show, true);
    let writers: Vec<Fold> = sets
        .iter()
        .map(|(name, set)| {
            let rest = sets.iter().filter(|(n, _)| n != name).flat_map(|(_, s)| s);
            (name.clone(), rest.chain(ours).collect(), set.iter().collect())
        })
        .collect();
    told(&writers, false, false);
}

/// Learns and reads each fold, two at a time, and tells what is right; by kinds, if asked.
pub fn told(folds: &[Fold], show: bool, by_kinds: bool) {
    let (mut all, mut bins) = (BTreeMap::<String, Counts>::new(), Vec::new());
    for pair in folds.chunks(2) {
        let scores = std::thread::scope(|scope| {
            let mut threads = Vec::new();
            for (_, learn, held) in pair {
                threads.push(scope.spawn(move || {
                    let (mut by, mut bins) = (BTreeMap::new(), Vec::new());
                    let judge = Judge::read(&Judge::written(&train(learn)));
                    score(held, &judge, show, &mut by, &mut bins);
                    (by, bins)
                }));
            }
            threads.into_iter().map(|t| t.join().expect("a fold")).collect::<Vec<_>>()
        });
        for ((name, ..), (by, bins_of_fold)) in pair.iter().zip(scores) {
            if !by_kinds {
                tell(
                    &by.iter().filter(|(k, _)| k.contains("ALL")).map(|(k, c)| (k.clone(), *c)).collect(),
                    name,
                );
            }
            for (k, c) in by {
                let sum = all.entry(k).or_default();
                (0..4).for_each(|i| sum[i] += c[i]);
            }
            bins.extend(bins_of_fold);
        }
    }
    if !by_kinds {
        all.retain(|k, _| k.contains("ALL"));
    }
    tell(&all, "all");
    tell_certainty(bins);
}

/// Counts of right, missed, wrong, and of those that could be read.
type Counts = [usize; 4];

fn score(
    all: &[&Sentence],
    judge: &Judge,
    show: bool,
    by: &mut BTreeMap<String, Counts>,
    bins: &mut Vec<(f64, bool)>,
) {
    for s in all {
        let found = Found::new(&s.text);
        let (written, proposed) = proposed(&found);
        let choices = found.choices(judge);
        let best = choices.first().cloned().unwrap_or_default();
        let got: Vec<Act> = best.said.iter().map(|k| proposed[*k].clone()).collect();
        let silent = s.gold.iter().any(Vec::is_empty);
        let right = s.gold.iter().any(|g| same(g, &got)) || silent && got.is_empty();
        let part = |g: &Vec<Act>| got.len() < g.len() && got.iter().all(|a| g.iter().any(|e| equal(e, a)));
        let less = got.is_empty() || s.gold.iter().any(part);
        let what = if right {
            0
        } else if less {
            1
        } else {
            2
        };
        bins.push((best.probability, right));
        let sorted = |mut kinds: Vec<Kind>| {
            kinds.sort_unstable();
            kinds
        };
        let got_kinds = sorted(best.said.iter().map(|&k| found.proposals[k].kind).collect());
        let of = |g: &Vec<Act>| g.iter().map(kind).collect::<Option<Vec<Kind>>>().map(sorted);
        let kinds_right = s.gold.iter().any(|g| of(g).as_ref() == Some(&got_kinds));
        if !right && kinds_right {
            by.entry("groups".to_owned()).or_default()[what] += 1;
        } else if !right {
            by.entry("kinds".to_owned()).or_default()[what] += 1;
        }
        let could = silent || s.gold.iter().any(|g| g.iter().all(|e| proposed.iter().any(|a| equal(a, e))));
        // As the grammar and the reader are heard together.
        let parse = parse_by(&s.text, judge);
        let said = acts(parse.notation());
        let part = |g: &Vec<Act>| said.len() < g.len() && said.iter().all(|a| g.iter().any(|e| equal(e, a)));
        let heard = match () {
            () if s.gold.iter().any(|g| same(g, &said)) || silent && said.is_empty() => 0,
            () if said.is_empty() || s.gold.iter().any(part) => 1,
            () => 2,
        };
        let kinds = [s.kind.as_str(), "ALL"].map(|k| [(k.to_owned(), what), (format!("heard {k}"), heard)]);
        for (k, what) in kinds.into_iter().flatten() {
            let c = by.entry(k).or_default();
            c[what] += 1;
            c[3] += usize::from(could);
        }
        if show && what > 0 {
            let got: Vec<&str> = best.said.iter().map(|k| written[*k].as_str()).collect();
            let cannot = if could { "" } else { "CAN'T " };
            println!(
                "{} {cannot}{}{:?}\n     want {}\n     got  {} {:.2}",
                ["", "missed", "wrong"][what],
                if kinds_right { "GROUPS " } else { "KINDS " },
                s.text,
                s.first,
                got.join(" & "),
                best.probability
            );
        }
    }
}

fn tell(by: &BTreeMap<String, Counts>, name: &str) {
    for (k, c) in by {
        let n = (c[0] + c[1] + c[2]) as f64;
        let share = |x: usize| 100.0 * x as f64 / n;
        println!(
            "{name:18} {k:16} n {n:4}  right {:5.1}  missed {:5.1}  wrong {:5.1}  could {:5.1}",
            share(c[0]),
            share(c[1]),
            share(c[2]),
            share(c[3])
        );
    }
}

/// Means of probability and of right, in five bins of equal count.
fn tell_certainty(mut bins: Vec<(f64, bool)>) {
    bins.sort_by(|a, b| a.0.total_cmp(&b.0));
    for bin in bins.chunks(bins.len().div_ceil(5).max(1)) {
        let n = bin.len() as f64;
        let said = bin.iter().map(|b| b.0).sum::<f64>() / n;
        let right = bin.iter().filter(|b| b.1).count() as f64 / n;
        println!("certainty {said:.3}  right {right:.3}");
    }
}
