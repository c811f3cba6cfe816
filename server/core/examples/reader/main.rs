//! Teaches the reader's judge, and tells how well it reads.
//!
//! `reader train OUT FILE…` learns from sentences with readings and writes the judge; `reader cross FILE…` leaves
//! out every other two sentences, then one file at a time, and tells what is read right; `reader lacks FILE…` tells
//! of what is said and never proposed. `--show` shows each that is not read right.

mod lenient;
mod made;
mod train;

use lenient::{Act, acts, equal, same};
use std::collections::BTreeMap;
use std::path::Path;
use toponym_core::language::HEARD;
use toponym_core::language::reader::decide::{Found, Kinds};
use toponym_core::language::reader::features::{Feature, Text};
use toponym_core::language::reader::judge::Judge;
use toponym_core::language::reader::kind::Kind;
use train::{Learned, train};

/// Each of our templates is filled so often, and counts for so much of a sentence that somebody said.
const MADE_TIMES: usize = 4;
const MADE_WEIGHT: f32 = 0.3;
/// A sentence and all readings of it that count.
struct Sentence {
    text: String,
    kind: String,
    weight: f32,
    gold: Vec<Vec<Act>>,
    first: String,
    found: Found,
    acts: Vec<Act>,
    features: Vec<Vec<Feature>>,
    whole: Vec<Feature>,
    /// Kinds of the acts said.
    kinds: Vec<Kinds>,
    /// Of each act said, its kind and the proposals that are it.
    groups: Vec<(Kind, Vec<usize>)>,
    /// All proposals that are any of them.
    right: Vec<usize>,
}

fn load(path: &str) -> Vec<Sentence> {
    let lines = std::fs::read_to_string(path).expect(path);
    lines
        .lines()
        .filter(|l| !l.trim().is_empty())
        .map(|l| sentence(&serde_json::from_str(l).expect(l)))
        .collect()
}

/// Those of our own making, and the grammar's examples.
fn made() -> Vec<Sentence> {
    let golden = include_str!("../../src/language/golden.jsonl").lines();
    let golden = golden.map(|l| sentence(&serde_json::from_str(l).expect(l)));
    let filled = made::sentences(MADE_TIMES);
    let filled =
        filled.iter().map(|(text, parse)| sentence(&serde_json::json!({"text": text, "parse": parse})));
    golden.chain(filled).map(|s| Sentence { weight: MADE_WEIGHT, ..s }).collect()
}

fn sentence(v: &serde_json::Value) -> Sentence {
    let text = v["text"].as_str().unwrap_or_default().to_owned();
    let first = v["parse"].as_str().unwrap_or("none").to_owned();
    let mut gold = vec![acts(&first)];
    gold.extend(v["also"].as_array().into_iter().flatten().filter_map(|a| a.as_str()).map(acts));
    let found = Found::new(&text);
    let all: Vec<Act> = found
        .proposals
        .iter()
        .map(|p| acts(&toponym_core::language::written(&p.content)).into_iter().next().unwrap_or(Act::Any))
        .collect();
    let can = |reading: &Vec<Act>| reading.iter().filter(|g| all.iter().any(|a| equal(g, a))).count();
    // The reading that can be said whole, with the fewest acts; else the first.
    let whole = gold.iter().enumerate().filter(|(_, r)| can(r) == r.len()).min_by_key(|(i, r)| (r.len(), *i));
    let best = whole.or_else(|| gold.iter().enumerate().max_by_key(|(i, r)| (can(r), std::cmp::Reverse(*i))));
    let best = best.map(|(_, r)| r.clone()).unwrap_or_default();
    let mut groups: Vec<(Kind, Vec<usize>)> = Vec::new();
    for g in &best {
        let right: Vec<usize> = (0..all.len()).filter(|&p| equal(g, &all[p])).collect();
        if let Some(&first) = right.first() {
            groups.push((found.proposals[first].kind, right));
        }
    }
    // All readings that can be said whole are right; if none can, the first is.
    let of = |g: &Vec<Act>| {
        let mut kinds = g.iter().map(kind).collect::<Option<Kinds>>()?;
        kinds.sort_unstable();
        Some(kinds)
    };
    let mut kinds: Vec<Kinds> = gold.iter().filter(|g| can(g) == g.len()).filter_map(of).collect();
    if kinds.is_empty() {
        kinds.extend(of(&best));
    }
    kinds.sort();
    kinds.dedup();
    let right = groups.iter().flat_map(|(_, r)| r).copied().collect();
    let reader = Text::new(&found.tokens, &found.groups);
    let features = found
        .proposals
        .iter()
        .map(|p| {
            let mut f = Vec::new();
            reader.features(p, &mut f);
            f.sort_unstable();
            f.dedup();
            f
        })
        .collect();
    let whole = reader.whole();
    let group = v["kind"].as_str().map_or_else(|| "all".to_owned(), str::to_owned);
    Sentence {
        text,
        kind: group,
        weight: 1.0,
        gold,
        first,
        found,
        acts: all,
        features,
        whole,
        kinds,
        groups,
        right,
    }
}

/// The kind of an act; none if nothing proposes such.
fn kind(act: &Act) -> Option<Kind> {
    let is = |h: &lenient::Head, what: &str| h.iter().any(|x| x == what);
    Some(match act {
        Act::Two("label", at, _) if is(at, "prev_place") => Kind::Before,
        Act::Two("label", _, what) if is(what, "place") => Kind::Use,
        Act::Two("label", ..) => Kind::Label,
        Act::Two("same", a, b) if is(a, "start") || is(b, "start") => Kind::Start,
        Act::Two("same", ..) => Kind::Same,
        Act::Two("other", ..) => Kind::Other,
        Act::Two("alias", ..) => Kind::Alias,
        Act::Located(..) => Kind::Locate,
        Act::Attribute(_) => Kind::Attribute,
        Act::Not(inner) => match &**inner {
            Act::Located(..) => Kind::NotLocate,
            Act::Two("same", ..) => Kind::NotSame,
            Act::Two("label", ..) => Kind::NotLabel,
            _ => return None,
        },
        Act::Mend(_, is_so) => match kind(is_so)? {
            Kind::Before => Kind::MendBefore,
            Kind::Label => Kind::MendLabel,
            Kind::Locate => Kind::MendLocate,
            _ => return None,
        },
        Act::Ask(k, about) => match (k.as_str(), about) {
            ("where", Ok(_)) => Kind::Where,
            ("what", Ok(h)) if is(h, "here") => Kind::WhatHere,
            ("what", Ok(_)) => Kind::What,
            ("route", Ok(_)) => Kind::Route,
            ("how_far", Ok(_)) => Kind::HowFar,
            ("whether", Err(a)) if matches!(**a, Act::Located(..)) => Kind::IsLocated,
            ("whether", Err(_)) => Kind::IsLabel,
            _ => return None,
        },
        Act::Generic(..) => Kind::Generic,
        Act::Route(None) => Kind::Way,
        Act::Route(Some(_)) => Kind::WayTo,
        _ => return None,
    })
}

/// Counts of right, missed, wrong, and of those that could be read.
type Counts = [usize; 4];

fn score(
    all: &[&Sentence],
    learned: &Learned,
    show: bool,
    by: &mut BTreeMap<String, Counts>,
    bins: &mut Vec<(f64, bool)>,
) {
    for s in all {
        let choices =
            s.found.choices(&learned.kinds, |f| f64::from(*learned.weights.get(&f).unwrap_or(&0.0)));
        let best = choices.first().cloned().unwrap_or_default();
        let got: Vec<Act> = best.said.iter().map(|k| s.acts[*k].clone()).collect();
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
        let mut got_kinds: Kinds = best.said.iter().map(|&k| s.found.proposals[k].kind).collect();
        got_kinds.sort_unstable();
        let of = |g: &Vec<Act>| {
            g.iter().map(kind).collect::<Option<Kinds>>().map(|mut k| {
                k.sort_unstable();
                k
            })
        };
        let kinds_right = s.gold.iter().any(|g| of(g).as_ref() == Some(&got_kinds));
        if !right && kinds_right {
            by.entry("groups".to_owned()).or_default()[what] += 1;
        } else if !right {
            by.entry("kinds".to_owned()).or_default()[what] += 1;
        }
        let could = silent || s.gold.iter().any(|g| g.iter().all(|e| s.acts.iter().any(|a| equal(a, e))));
        // As the reader is heard: not at all if it is not likely enough.
        let heard = if best.probability < HEARD || got.is_empty() { usize::from(!silent) } else { what };
        let kinds = [s.kind.as_str(), "ALL"].map(|k| [(k.to_owned(), what), (format!("heard {k}"), heard)]);
        for (k, what) in kinds.into_iter().flatten() {
            let c = by.entry(k).or_default();
            c[what] += 1;
            c[3] += usize::from(could);
        }
        if show && what > 0 {
            let written = |k: &usize| toponym_core::language::written(&s.found.proposals[*k].content);
            let got: Vec<String> = best.said.iter().map(written).collect();
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

fn main() {
    let mut args: Vec<String> = std::env::args().skip(1).collect();
    let show = args.iter().any(|a| a == "--show");
    args.retain(|a| a != "--show");
    let Some((mode, files)) = args.split_first() else {
        return eprintln!("train OUT FILE…, cross FILE… or lacks FILE…");
    };
    let (out, files) = if mode == "train" { files.split_at(1) } else { (&[][..], files) };
    let short =
        |f: &str| Path::new(f).file_stem().map_or(String::new(), |n| n.to_string_lossy().into_owned());
    let sets: Vec<(String, Vec<Sentence>)> = files.iter().map(|f| (short(f), load(f))).collect();
    let made = made();
    match mode.as_str() {
        "train" => {
            let all: Vec<&Sentence> = sets.iter().flat_map(|(_, s)| s).chain(&made).collect();
            let learned = train(&all);
            let weights: Vec<(Feature, f32)> = learned.weights.into_iter().collect();
            std::fs::write(&out[0], Judge::written(&learned.kinds, &weights)).expect("written");
        }
        "lacks" => {
            for s in sets.iter().flat_map(|(_, s)| s) {
                let can = |g: &Vec<Act>| g.iter().all(|e| s.acts.iter().any(|a| equal(a, e)));
                if !s.gold.iter().any(|g| g.is_empty() || can(g)) {
                    let never = s.gold[0].iter().filter(|e| !s.acts.iter().any(|a| equal(a, e)));
                    println!("{}\n    {}\n    {:?}", s.text, s.first, never.collect::<Vec<_>>());
                }
            }
        }
        "cross" => {
            // Halves of each file by turns, as those that are held; then whole files.
            let (mut by, mut bins) = (BTreeMap::new(), Vec::new());
            for fold in 0..2 {
                let is_part = |i: usize, want: bool| (i / 2 % 2 == fold) == want;
                let part = |want: bool| {
                    let of = |s: &'_ (String, Vec<Sentence>)| -> Vec<usize> {
                        (0..s.1.len()).filter(|&i| is_part(i, want)).collect()
                    };
                    sets.iter()
                        .flat_map(|s| of(s).into_iter().map(|i| &s.1[i]).collect::<Vec<_>>())
                        .collect::<Vec<_>>()
                };
                let learn: Vec<&Sentence> = part(false).into_iter().chain(&made).collect();
                score(&part(true), &train(&learn), show, &mut by, &mut bins);
            }
            tell(&by, "halves");
            tell_certainty(bins);
            let (mut all, mut bins) = (BTreeMap::new(), Vec::new());
            for (i, (name, set)) in sets.iter().enumerate().filter(|(_, (n, _))| n.contains("dev")) {
                let rest = sets
                    .iter()
                    .enumerate()
                    .filter(|(k, _)| *k != i)
                    .flat_map(|(_, (_, s))| s)
                    .chain(&made)
                    .collect::<Vec<_>>();
                let mut by = BTreeMap::new();
                let learned = train(&rest);
                score(&set.iter().collect::<Vec<_>>(), &learned, false, &mut by, &mut bins);
                tell(&by, name);
                let sum: Counts = by["ALL"];
                let c: &mut Counts = all.entry("ALL".to_owned()).or_default();
                (0..4).for_each(|k| c[k] += sum[k]);
            }
            tell(&all, "writers");
            tell_certainty(bins);
        }
        _ => println!("no such mode"),
    }
}
