//! Reads sentences from standard input, one a line, and prints what each says, as JSON:
//! `{"text": "this is the gym", "parse": "label(here,gym)", "words": "I heard: …", "analyses": [[0.9, …]]}`.
//!
//! `--lang TAG` reads another language, `--lexicon FILE` with a site's own words. `--score FILE` reads lines `{"level": 1, "text": …, "parse": …}` instead, prints each that is read
//! otherwise, and the share read exactly per level.

use std::collections::BTreeMap;
use std::io::{self, BufRead, Write};
use std::sync::Arc;
use toponym_core::language::{Glossary, Speech, parse, words};

fn main() -> io::Result<()> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let of = |name: &str| arguments.iter().position(|a| a == name).and_then(|at| arguments.get(at + 1));
    if let Some(file) = of("--score") {
        return score(&std::fs::read_to_string(file)?);
    }
    let lines = of("--lexicon").map_or(Ok(String::new()), std::fs::read_to_string)?;
    let site = Glossary::read(&lines).map_err(io::Error::other)?;
    let speech = Speech::new(of("--lang").map(String::as_str), Arc::new(site));
    read(&speech.ok_or_else(|| io::Error::other(format!("--lang: give {}", Speech::known())))?)
}

fn read(speech: &Speech) -> io::Result<()> {
    let mut out = io::stdout().lock();
    for line in io::stdin().lock().lines() {
        let text = line?;
        let parse = speech.parse(&text);
        let others: Vec<(f64, &str)> =
            parse.analyses.iter().map(|a| (a.weight, a.notation.as_str())).collect();
        writeln!(
            out,
            "{}",
            serde_json::json!({
                "text": text,
                "parse": parse.notation(),
                "words": words(parse.acts(), |_| true),
                "analyses": others,
            })
        )?;
    }
    Ok(())
}

fn score(lines: &str) -> io::Result<()> {
    let mut out = io::stdout().lock();
    let mut levels: BTreeMap<u64, (u32, u32)> = BTreeMap::new();
    for line in lines.lines() {
        let gold: serde_json::Value = serde_json::from_str(line)?;
        let (text, expected) = (gold["text"].as_str().unwrap_or(""), gold["parse"].as_str().unwrap_or(""));
        let parse = parse(text);
        let level = levels.entry(gold["level"].as_u64().unwrap_or(0)).or_default();
        level.1 += 1;
        if parse.notation() == expected {
            level.0 += 1;
        } else {
            writeln!(out, "{text}\n  expected {expected}\n  read     {}", parse.notation())?;
        }
    }
    for (level, (right, all)) in levels {
        let percent = 100.0 * f64::from(right) / f64::from(all);
        writeln!(out, "level {level}: {right} of {all} exact, {percent:.0} %")?;
    }
    Ok(())
}
