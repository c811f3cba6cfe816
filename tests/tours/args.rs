//! The command line.

use crate::suite::Suite;
use crate::{plans, simulated, stata, suite};
use anyhow::{Result, bail};
use std::path::PathBuf;
use toponym_server::map::Preset;
use toponym_sim::tours::Language;

/// Whatever there is of a kind.
const ALL: &str = "all";

/// Map tours whose truth is known and on which one hypothesis is not enough, and score the posterior
#[derive(Clone, Debug, clap::Parser)]
#[command(
    name = "tours",
    after_help = "A seed is a seed of world, wheels, laser, people, guide and filter. \
    Keys and definitions: tests/README.md.\n\nExamples:\n  \
    tours --tour small --language simple --seeds 1 --particles 4   the shortest\n  \
    tours --tour all --language all --json > figures.jsonl         everything\n  \
    tours --tour stata --language complex --shared ../shared       a real building\n  \
    tours --tour small --language simple --write drives            to map with something else, and then\n  \
    tours --score drives\n  \
    tours --results tests/RESULTS.md --shared ../shared            the table of this repository"
)]
pub struct Args {
    /// Which tour; `all` for every one
    #[arg(long, value_name = "NAME", required_unless_present_any = ["score", "results"])]
    pub tour: Option<String>,
    /// What people say: none, simple, complex, false20; `all` for every one
    #[arg(long, value_name = "NAME", required_unless_present_any = ["score", "results"])]
    pub language: Option<String>,
    /// Whose rules sentences are taken in by
    #[arg(long, value_name = "RULES", value_enum, default_value_t)]
    pub preset: Preset,
    /// Particles
    #[arg(long, value_name = "N", default_value_t = 30, value_parser = clap::value_parser!(u32).range(1..=10_000))]
    pub particles: u32,
    /// Threads; the figures do not depend on them [default: one per core]
    #[arg(long, value_name = "N")]
    pub threads: Option<usize>,
    /// How many seeds
    #[arg(long, value_name = "N", default_value_t = 10, value_parser = clap::value_parser!(u64).range(1..))]
    pub seeds: u64,
    /// The first of them
    #[arg(long, value_name = "S", default_value_t = 1)]
    pub first_seed: u64,
    /// Where `data/stata` and `peers/stata_tour.py` are, for the tour `stata`, and `data/floorplans`, for `plans`
    #[arg(long, value_name = "DIR")]
    pub shared: Option<PathBuf>,
    /// One JSON object a line for each tour and language
    #[arg(long)]
    pub json: bool,
    /// Besides, write each seed's log, narration, truth and questions into DIR/SEED
    #[arg(long, value_name = "DIR", conflicts_with_all = ["score", "results"])]
    pub write: Option<PathBuf>,
    /// Score the `report.json` and `trajectory.txt` that were put beside what --write wrote
    #[arg(long, value_name = "DIR", conflicts_with_all = ["tour", "language", "results"])]
    pub score: Option<PathBuf>,
    /// Run every tour in every language with 30 particles and with one, and write the table
    #[arg(long, value_name = "FILE.md", conflicts_with_all = ["tour", "language", "particles", "json"])]
    pub results: Option<PathBuf>,
}

impl Args {
    /// What to run.
    pub fn suite(&self) -> Result<Suite> {
        let cores = std::thread::available_parallelism().map_or(1, usize::from);
        Ok(Suite {
            tours: self.tours()?,
            languages: self.languages()?,
            particles: if self.results.is_some() { vec![30, 1] } else { vec![self.particles] },
            preset: self.preset,
            seeds: self.first_seed..self.first_seed.saturating_add(self.seeds),
            threads: self.threads.unwrap_or(cores).max(1),
            shared: self.shared.clone(),
        })
    }

    fn tours(&self) -> Result<Vec<String>> {
        let known: Vec<&str> = simulated::names().iter().copied().chain([plans::NAME, stata::NAME]).collect();
        match self.tour.as_deref() {
            None | Some(ALL) => Ok(known.iter().map(|&n| n.to_owned()).collect()),
            Some(name) if known.contains(&name) => Ok(vec![name.to_owned()]),
            Some(name) => {
                bail!("--tour {name}: there is none of that name; give {ALL} or one of {}", known.join(", "))
            }
        }
    }

    fn languages(&self) -> Result<Vec<Language>> {
        match self.language.as_deref() {
            None | Some(ALL) => Ok(Language::ALL.to_vec()),
            Some(name) => match name.parse() {
                Ok(language) => Ok(vec![language]),
                Err(why) => bail!("--language: {why}; or {ALL}"),
            },
        }
    }
}

/// Why a tour is left out.
pub fn skipped(tour: &str, suite: &suite::Suite) -> Option<String> {
    let shared = suite.shared.as_deref();
    match tour {
        stata::NAME => stata::missing(shared),
        plans::NAME => plans::missing(shared),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::{CommandFactory, Parser};

    fn suite(options: &[&str]) -> Result<Suite, String> {
        let args = Args::try_parse_from([&["tours"], options].concat()).map_err(|e| e.to_string())?;
        args.suite().map_err(|e| e.to_string())
    }

    #[test]
    fn all_means_all_and_a_wrong_name_is_told_the_right_ones() {
        Args::command().debug_assert();
        let all = suite(&["--tour", "all", "--language", "all"]).unwrap();
        assert_eq!(all.languages, Language::ALL);
        assert!(all.tours.contains(&"stata".to_owned()) && all.tours.len() == simulated::names().len() + 2);
        assert!(suite(&["--tour", "x", "--language", "all"]).unwrap_err().contains("stata"));
        assert!(suite(&["--tour", "all", "--language", "x"]).unwrap_err().contains("false20"));
        assert!(suite(&["--tour", "all"]).unwrap_err().contains("--language"));
    }

    #[test]
    fn seeds_count_from_the_first_and_results_have_one_particle_too() {
        let suite = suite(&["--results", "r.md", "--first-seed", "5", "--seeds", "3"]).unwrap();
        assert_eq!((suite.seeds, suite.particles), (5..8, vec![30, 1]));
    }

    #[test]
    fn one_tour_in_one_language_is_written() {
        let only = |tour| {
            let suite = suite(&["--tour", tour, "--language", "none", "--write", "d"]).unwrap();
            suite.only().map(|(tour, language)| (tour.to_owned(), language))
        };
        assert!(only("all").is_err());
        assert_eq!(only("stata").unwrap(), ("stata".to_owned(), Language::None));
    }
}
