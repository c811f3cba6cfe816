//! Scores the spatial clauses found in route texts against people's: `clauses FILE`, whose lines are
//! `{"text", "annotator", "sdcs": [{"spans": {"verb": [from, to], …}}]}`, spans in characters. Prints F1 over
//! all texts: relation and landmark spans exact; verb, relation and landmark spans exact; for the first
//! annotator against us and against the second. `--show N` prints the n-th text's clauses.

use std::collections::BTreeMap;
use toponym_core::language::{Clause, clauses};

type Span = Option<(u64, u64)>;
/// Verb, relation, landmark.
type Spans = (Span, Span, Span);

fn main() -> std::io::Result<()> {
    let mut arguments = std::env::args().skip(1);
    let file = arguments.next().unwrap_or_default();
    let shown: Option<usize> = arguments.nth(1).and_then(|n| n.parse().ok());
    let mut texts: BTreeMap<String, BTreeMap<String, (String, Vec<Spans>)>> = BTreeMap::new();
    let mut order = Vec::new();
    for line in std::fs::read_to_string(file)?.lines() {
        let line: serde_json::Value = serde_json::from_str(line)?;
        let field = |name: &str| line[name].as_str().unwrap_or("").to_owned();
        let spans = line["sdcs"].as_array().map_or(Vec::new(), |all| all.iter().map(gold).collect());
        order.push(field("annotator"));
        let key = format!("{}{}{}", field("text"), field("route"), field("subject"));
        texts.entry(key).or_default().insert(field("annotator"), (field("text"), spans));
    }
    let Some(first) = order.first().cloned() else { return Ok(()) };
    let mut ours = Score::default();
    let mut second = Score::default();
    for (n, annotators) in texts.values().enumerate() {
        let Some((text, gold)) = annotators.get(&first) else { continue };
        let found: Vec<Spans> = clauses(text).iter().map(found).collect();
        if shown == Some(n) {
            println!("{text}\n");
            for (who, spans) in [("gold", gold), ("ours", &found)] {
                for &(v, r, l) in spans {
                    println!("{who} {:?} | {:?} | {:?}", words(text, v), words(text, r), words(text, l));
                }
            }
        }
        ours.add(gold, &found);
        for (_, (_, other)) in annotators.iter().filter(|(name, _)| **name != first) {
            second.add(gold, other);
        }
    }
    println!("{first} against us:               {ours}");
    println!("{first} against the other person: {second}");
    Ok(())
}

fn gold(clause: &serde_json::Value) -> Spans {
    let span = |name: &str| {
        let span = clause["spans"][name].as_array()?;
        Some((span.first()?.as_u64()?, span.get(1)?.as_u64()?))
    };
    (span("verb"), span("spatialRelation"), span("landmark"))
}

fn found(clause: &Clause) -> Spans {
    let span = |s: &Option<std::ops::Range<usize>>| s.as_ref().map(|s| (s.start as u64, s.end as u64));
    (span(&clause.verb), span(&clause.relation), span(&clause.landmark))
}

fn words(text: &str, span: Span) -> String {
    span.map_or(String::new(), |(a, b)| text.chars().skip(a as usize).take((b - a) as usize).collect())
}

#[derive(Default)]
struct Score {
    relation: usize,
    full: usize,
    sum: usize,
}

impl Score {
    fn add(&mut self, gold: &[Spans], found: &[Spans]) {
        self.relation += common(gold.iter().map(|s| (s.1, s.2)), found.iter().map(|s| (s.1, s.2)));
        self.full += common(gold.iter().copied(), found.iter().copied());
        self.sum += gold.len() + found.len();
    }
}

impl std::fmt::Display for Score {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let f1 = |hits: usize| 2.0 * hits as f64 / self.sum.max(1) as f64;
        write!(f, "relation + landmark F1 {:.3}, full span F1 {:.3}", f1(self.relation), f1(self.full))
    }
}

/// How many items two lists share, each counted as often as in both.
fn common<T: Ord>(a: impl Iterator<Item = T>, b: impl Iterator<Item = T>) -> usize {
    let mut counts: BTreeMap<T, usize> = BTreeMap::new();
    for item in a {
        *counts.entry(item).or_default() += 1;
    }
    b.filter(|item| {
        counts.get_mut(item).is_some_and(|n| {
            if *n > 0 {
                *n -= 1;
                true
            } else {
                false
            }
        })
    })
    .count()
}
