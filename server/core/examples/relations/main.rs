//! Learns the factors of path relations from labelled paths, and says how well they hold on
//! landmarks not learned from.
//!
//! ```sh
//! bunzip2 -k spatial_relations/*.yaml.bz2
//! cargo run --release -p toponym-core --example relations -- spatial_relations/*.yaml \
//!     --write server/core/src/language/path_weights.rs
//! ```
//! Prints the area under the ROC curve per relation, by five-fold cross validation: no path and no
//! landmark of a setting tested on is learned from. Folds are drawn ten times; the worst of ten
//! stands beside the mean.
#![allow(clippy::unwrap_used, reason = "a tool: a wrong file ends it")]

mod data;
mod logistic;

use clap::Parser;
use data::Example;
use logistic::{Model, area_under_curve};
use rand::{SeedableRng, seq::SliceRandom};
use rand_chacha::ChaCha8Rng;
use std::fmt::Write;
use std::path::PathBuf;
use toponym_core::language::{FEATURES, Relation, path_features};

/// Settings are split into so many parts.
const FOLDS: usize = 5;
/// Ways to split them.
const DRAWS: u64 = 10;

#[derive(Parser)]
#[command(about = "Learns the factors of path relations")]
struct Args {
    /// Files of examples, decompressed.
    #[arg(required = true)]
    files: Vec<PathBuf>,
    /// Write the weights learned on all examples to this Rust file.
    #[arg(long)]
    write: Option<PathBuf>,
}

/// An example as it is learned from.
struct Row<'a> {
    phrase: &'a str,
    relation: Relation,
    correct: bool,
    features: [f64; FEATURES],
    settings: [Option<usize>; 2],
}

fn main() {
    let args = Args::parse();
    let texts: Vec<String> = args.files.iter().map(|f| std::fs::read_to_string(f).unwrap()).collect();
    let examples: Vec<Example> = texts.iter().flat_map(|text| data::read(text)).collect();
    let (count, settings) = data::settings(&examples);
    let row = |k: usize| {
        let (e, settings) = (&examples[k], &settings[k]);
        let relation = relation(&e.relation)?;
        let features = path_features(&e.path, &e.footprint());
        Some(Row { phrase: &e.relation, relation, correct: e.correct, features, settings: *settings })
    };
    let rows: Vec<Row> = (0..examples.len()).filter_map(row).collect();
    println!("{} examples in {count} settings, {} of known relations", examples.len(), rows.len());
    report(&rows, count);
    if let Some(file) = args.write {
        std::fs::write(file, table(&rows)).unwrap();
    }
}

/// The relation of a phrase. "Until" tells when to stop, which is "to" for a path.
fn relation(phrase: &str) -> Option<Relation> {
    match phrase {
        "until" => Some(Relation::To),
        "out" => Some(Relation::OutOf),
        _ => Relation::ALL.iter().copied().find(|r| r.notation().replace('_', " ") == phrase),
    }
}

fn report(rows: &[Row], settings: usize) {
    let mut phrases: Vec<&str> = rows.iter().filter(|r| r.correct).map(|r| r.phrase).collect();
    phrases.sort_unstable();
    phrases.dedup();
    let draws: Vec<Vec<usize>> = (0..DRAWS).map(|seed| folds(settings, seed)).collect();
    println!("{:<12} {:>6} {:>6} {:>8} {:>8}", "phrase", "true", "false", "AUC mean", "AUC low");
    let mut means = Vec::new();
    for phrase in phrases {
        let rows: Vec<&Row> = rows.iter().filter(|r| r.phrase == phrase).collect();
        let areas: Vec<f64> = draws.iter().map(|folds| validate(&rows, folds)).collect();
        let mean = areas.iter().sum::<f64>() / areas.len() as f64;
        let low = areas.iter().copied().fold(1.0, f64::min);
        let correct = rows.iter().filter(|r| r.correct).count();
        println!("{phrase:<12} {correct:>6} {:>6} {mean:>8.4} {low:>8.4}", rows.len() - correct);
        means.push(mean);
    }
    let worst = means.iter().copied().fold(1.0, f64::min);
    println!("mean {:.4}, worst {worst:.4}", means.iter().sum::<f64>() / means.len() as f64);
}

/// The fold of every setting.
fn folds(settings: usize, seed: u64) -> Vec<usize> {
    let mut folds: Vec<usize> = (0..settings).map(|k| k % FOLDS).collect();
    folds.shuffle(&mut ChaCha8Rng::seed_from_u64(seed));
    folds
}

/// Area under the curve of held-out scores of one relation.
fn validate(rows: &[&Row], folds: &[usize]) -> f64 {
    let mut scores = Vec::new();
    for fold in 0..FOLDS {
        let touches = |s: &Option<usize>| s.is_some_and(|s| folds[s] == fold);
        // Tested by its landmark's setting, or by its path's if the landmark has none.
        let tested = |r: &Row| touches(&r.settings[0].or(r.settings[1]));
        let train: Vec<_> = rows
            .iter()
            .filter(|r| !tested(r) && !r.settings.iter().any(touches))
            .map(|r| (&r.features, r.correct))
            .collect();
        let model = Model::fit(&train);
        scores.extend(rows.iter().filter(|r| tested(r)).map(|r| (model.logit(&r.features), r.correct)));
    }
    area_under_curve(&scores)
}

/// The weights, learned on everything, as Rust.
fn table(rows: &[Row]) -> String {
    let mut relations: Vec<Relation> = rows.iter().filter(|r| r.correct).map(|r| r.relation).collect();
    relations.sort_unstable();
    relations.dedup();
    let mut text =
        "//! Weights of path relations, as `examples/relations` writes them: change nothing by hand.\n\n\
        use super::Relation;\nuse super::path_features::FEATURES;\n\n\
        /// Relation, weight per feature, constant.\n#[rustfmt::skip]\n\
        pub(super) const PATH_WEIGHTS: &[(Relation, [f64; FEATURES], f64)] = &[\n"
            .to_owned();
    for relation in relations {
        let rows: Vec<_> =
            rows.iter().filter(|r| r.relation == relation).map(|r| (&r.features, r.correct)).collect();
        let model = Model::fit(&rows);
        writeln!(text, "    (Relation::{relation:?}, [").unwrap();
        for some in model.weights.chunks(7) {
            let some: Vec<String> = some.iter().map(|w| format!("{w:.3}")).collect();
            writeln!(text, "        {},", some.join(", ")).unwrap();
        }
        writeln!(text, "    ], {:.3}),", model.bias).unwrap();
    }
    text + "];\n"
}
