//! `tours`: a bench on which one hypothesis is not enough.
//!
//! Buildings repeat, and wheels drift: on these tours it takes several graphs at once, or a sentence, to
//! know where one is. Each tour lists what may be believed, so that not only the best graph can be scored
//! but how the whole posterior is spread over what is possible. See `tests/README.md`.

mod args;
mod folder;
mod graph;
mod plans;
mod results;
mod run;
mod score;
mod simulated;
mod stata;
mod suite;
mod table;
mod tour;
mod truth;

use anyhow::{Context, Result, bail};
use args::Args;
use clap::Parser;
use score::Summary;
use std::path::Path;
use suite::Suite;

fn main() -> Result<()> {
    let args = Args::parse();
    if let Some(folder) = &args.score {
        let (setting, outcomes) = folder::score(folder)?;
        return print(&Summary::new(setting, &outcomes), args.json);
    }
    let suite = args.suite()?;
    if let Some(folder) = &args.write {
        write(folder, &suite)?;
    }
    let (rows, failed) = suite.run();
    if let Some(file) = &args.results {
        let text = results::text(&rows, suite.seeds.clone().count(), args.preset);
        std::fs::write(file, text).with_context(|| format!("--results {}", file.display()))?;
    } else {
        for row in rows {
            print(&Summary::new(row.setting, &row.outcomes), args.json)?;
        }
    }
    if !failed.is_empty() {
        bail!("left out, since they could not be taken: {}", failed.join("; "));
    }
    Ok(())
}

fn print(summary: &Summary, json: bool) -> Result<()> {
    if json {
        println!("{}", serde_json::to_string(summary)?);
    } else {
        println!("{}", table::text(summary));
    }
    Ok(())
}

fn write(folder: &Path, suite: &Suite) -> Result<()> {
    let (name, language) = suite.only()?;
    if !suite.is_there(name) {
        return Ok(());
    }
    for seed in suite.seeds.clone() {
        let tour = suite.tour(name, seed)?;
        let case = tour.case(language).with_context(|| format!("{name} is not told in {language}"))?;
        let folder = folder.join(seed.to_string());
        folder::write_case(&folder, name, &language.to_string(), &case)
            .with_context(|| format!("--write {}", folder.display()))?;
        eprintln!("wrote {}", folder.display());
    }
    Ok(())
}
