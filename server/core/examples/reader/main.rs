//! Teaches the reader's judge, and tells how well it reads.
//!
//! `reader train OUT FILE…` learns from our sentences and those of files, with their readings, and writes the judge.
//! `reader cross FILE…` learns without every other two sentences of the files, then without one file at a time, and
//! tells what is read right of those left out; `reader held FILE…` tells it of those of ours that are never learned
//! from; `reader lacks FILE…` tells of what is said and never proposed. `--show` shows each that is not read right.

mod lenient;
mod made;
mod score;
mod train;

use lenient::{Act, acts, equal, split};
use std::path::Path;
use toponym_core::language::reader::decide::Found;
use toponym_core::language::reader::judge::Judge;
use toponym_core::language::reader::kind::Kind;
use toponym_core::language::reader::of_kinds::History;
use train::train;

/// Each of our templates is filled so often, and counts for so much of a sentence that somebody said.
const MADE_TIMES: usize = 3;
const MADE_WEIGHT: f32 = 0.3;
/// What other people said counts for so many of ours.
const THEIRS: f32 = 3.0;
/// More acts in one sentence are not learned from.
const ACTS: usize = 4;

/// A sentence and all readings of it that count.
struct Sentence {
    text: String,
    kind: String,
    weight: f32,
    gold: Vec<Vec<Act>>,
    first: String,
    /// Readings to learn, by proposals of [`Found::new`]: those themselves would fill a machine's memory.
    readings: Vec<Vec<GoldAct>>,
}

/// An act that is said: its kind, all proposals of that kind, and those that are it.
struct GoldAct {
    kind: Kind,
    proposals: Vec<usize>,
    right: Vec<usize>,
}

/// Our sentences, and those of them that are never learned from.
const SAID: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/lexicon/english/said");
const HELD: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/lexicon/english/said/held");

/// Of a file: lines of JSON, `{"text": …, "kind": …, "parse": …, "also": […]}`.
fn load(path: &str) -> Vec<Sentence> {
    let text = std::fs::read_to_string(path).expect(path);
    let lines = text.lines().filter(|l| !l.trim().is_empty());
    lines
        .map(|l| {
            let v: serde_json::Value = serde_json::from_str(l).expect(l);
            let string = |v: &serde_json::Value| v.as_str().unwrap_or_default().to_owned();
            let also = v["also"].as_array().into_iter().flatten().map(string);
            let kind = v["kind"].as_str().unwrap_or("all");
            let all = std::iter::once(string(&v["parse"])).chain(also).collect();
            Sentence { weight: THEIRS, ..sentence(&string(&v["text"]), kind, all) }
        })
        .collect()
}

/// Of a folder of ours: lines of text, kind, reading and other readings that count, with tabs between.
fn said(folder: &str) -> Vec<Sentence> {
    let mut paths: Vec<_> = std::fs::read_dir(folder).expect(folder).flatten().map(|e| e.path()).collect();
    paths.sort();
    let files = paths.iter().filter(|p| p.extension().is_some_and(|e| e == "tsv"));
    let texts: Vec<String> = files.map(|p| std::fs::read_to_string(p).expect("a text")).collect();
    let lines = texts.iter().flat_map(|t| t.lines()).map(|l| l.split('\t').collect::<Vec<_>>());
    lines.map(|l| sentence(l[0], l[1], l[2..].iter().map(|r| (*r).to_owned()).collect())).collect()
}

/// All that we made: sentences, filled templates, and the grammar's examples.
fn ours() -> Vec<Sentence> {
    let golden = include_str!("../../src/language/golden.jsonl").lines().map(|l| {
        let v: serde_json::Value = serde_json::from_str(l).expect(l);
        (
            v["text"].as_str().unwrap_or_default().to_owned(),
            v["parse"].as_str().unwrap_or_default().to_owned(),
        )
    });
    let golden = golden.map(|(text, parse)| sentence(&text, "golden", vec![parse]));
    let templates = made::sentences(MADE_TIMES)
        .into_iter()
        .map(|(text, parse)| Sentence { weight: MADE_WEIGHT, ..sentence(&text, "made", vec![parse]) });
    said(SAID).into_iter().chain(golden).chain(templates).collect()
}

/// A sentence with its readings.
fn sentence(text: &str, kind: &str, raw: Vec<String>) -> Sentence {
    let gold: Vec<Vec<Act>> = raw.iter().map(|r| acts(r)).collect();
    let found = Found::new(text);
    let (written, all) = proposed(&found);
    // All readings that can be said whole; if none can, those whose kinds are known.
    let all_readings: Vec<Option<Vec<GoldAct>>> =
        gold.iter().zip(&raw).map(|(g, raw)| reading(g, raw, &found, &all, &written)).collect();
    let known = all_readings.into_iter().flatten().filter(|r| r.len() <= ACTS).collect::<Vec<_>>();
    let whole = |r: &Vec<GoldAct>| r.iter().all(|a| !a.right.is_empty());
    let some_whole = known.iter().any(whole);
    let mut readings: Vec<Vec<GoldAct>> = known.into_iter().filter(|r| !some_whole || whole(r)).collect();
    if !some_whole {
        readings.truncate(1);
    }
    // The shortest is learned from whole, the others for how they begin.
    readings.sort_by_key(Vec::len);
    for reading in &mut readings {
        let end = |a: &GoldAct| a.right.first().map_or(0, |&p| found.after(&History::default(), p).end);
        reading.sort_by_key(end);
    }
    let first = raw.into_iter().next().unwrap_or_default();
    let (text, kind) = (text.to_owned(), kind.to_owned());
    Sentence { text, kind, weight: 1.0, gold, first, readings }
}

/// All that is proposed, as written and as it is compared.
fn proposed(found: &Found) -> (Vec<String>, Vec<Act>) {
    let written: Vec<String> =
        found.proposals.iter().map(|p| toponym_core::language::written(&p.content)).collect();
    let all = written.iter().map(|w| acts(w).into_iter().next().unwrap_or(Act::Any)).collect();
    (written, all)
}

/// A reading as proposals; none if nothing proposes acts of some kind.
fn reading(gold: &[Act], raw: &str, found: &Found, all: &[Act], written: &[String]) -> Option<Vec<GoldAct>> {
    let right: Vec<Vec<usize>> =
        gold.iter().map(|g| (0..all.len()).filter(|&p| equal(g, &all[p])).collect()).collect();
    let raw = split(raw, "&");
    // Of those that are right those that say most of it: "ice machine", not "machine".
    let best = |i: usize| -> Vec<usize> {
        let alike = |p: &usize| lenient::alike(raw.get(i).map_or("", String::as_str), &written[*p]);
        let most = right[i].iter().map(alike).fold(0.0, f64::max);
        right[i].iter().copied().filter(|p| alike(p) >= most).collect()
    };
    let of = |(i, g): (usize, &Act)| {
        let kind = kind(g)?;
        let of_kind = (0..all.len()).filter(|&p| found.proposals[p].kind == kind);
        let mine: Vec<usize> = best(i).into_iter().filter(|&p| found.proposals[p].kind == kind).collect();
        let proposals = if mine.is_empty() { Vec::new() } else { of_kind.collect() };
        Some(GoldAct { kind, proposals, right: mine })
    };
    gold.iter().enumerate().map(of).collect()
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

fn main() {
    let mut args: Vec<String> = std::env::args().skip(1).collect();
    let show = args.iter().any(|a| a == "--show");
    args.retain(|a| a != "--show");
    let Some((mode, files)) = args.split_first() else {
        return eprintln!("train OUT FILE…, cross FILE…, held FILE… or lacks FILE…");
    };
    let (out, files) = if mode == "train" { files.split_at(1) } else { (&[][..], files) };
    let name =
        |f: &String| Path::new(f).file_stem().map_or(String::new(), |n| n.to_string_lossy().into_owned());
    let sets: Vec<(String, Vec<Sentence>)> = files.iter().map(|f| (name(f), load(f))).collect();
    let theirs = || sets.iter().flat_map(|(_, s)| s);
    match mode.as_str() {
        "train" => {
            let ours = ours();
            let all: Vec<&Sentence> = theirs().chain(&ours).collect();
            std::fs::write(&out[0], Judge::written(&train(&all))).expect("written");
        }
        "held" => {
            let ours = ours();
            let (learn, held) = (theirs().chain(&ours).collect::<Vec<_>>(), said(HELD));
            score::told(&[("held".to_owned(), learn, held.iter().collect())], show, true);
        }
        "cross" => score::cross(&sets, &ours(), show),
        "lacks" => theirs()
            .filter(|s| s.readings.iter().all(|r| r.iter().any(|a| a.right.is_empty())))
            .for_each(|s| println!("{}\n    {}", s.text, s.first)),
        _ => eprintln!("no such mode: {mode}"),
    }
}
