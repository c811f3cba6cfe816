//! Tours, languages and seeds spread over threads; results in order, whoever was first.

use crate::args::skipped;
use crate::run::{self, Settings};
use crate::score::{Outcome, Setting};
use crate::tour::Tour;
use crate::{plans, simulated, stata};
use anyhow::{Context, Result, bail};
use std::ops::Range;
use std::path::PathBuf;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Instant;
use toponym_server::map::Preset;
use toponym_sim::tours::Language;

/// What to run.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Suite {
    /// Names of tours.
    pub tours: Vec<String>,
    /// Each tour in each of these that it has.
    pub languages: Vec<Language>,
    /// And with so many particles.
    pub particles: Vec<u32>,
    /// Rules of all.
    pub preset: Preset,
    /// Seeds of world, wheels, laser, people, guide and filter.
    pub seeds: Range<u64>,
    /// Tours mapped at once.
    pub threads: usize,
    /// Where the recorded tour and the floor plans are.
    pub shared: Option<PathBuf>,
}

/// A tour in a language, with so many particles, over all seeds.
#[derive(Clone, Debug)]
pub struct Row {
    /// What was run.
    pub setting: Setting,
    /// By seed.
    pub outcomes: Vec<Outcome>,
}

/// One seed of a tour, in each language and with each number of particles.
type Mapped = Vec<((Language, u32), Outcome)>;

impl Suite {
    /// Runs all of it. Progress goes to stderr. Seeds of tours that could not be taken are left out, and told
    /// beside the rows: one of them must not cost the others.
    pub fn run(&self) -> (Vec<Row>, Vec<String>) {
        let tours: Vec<&String> = self.tours.iter().filter(|t| self.is_there(t)).collect();
        let jobs: Vec<(&String, u64)> =
            tours.iter().flat_map(|&tour| self.seeds.clone().map(move |seed| (tour, seed))).collect();
        let (began, done) = (Instant::now(), AtomicUsize::new(0));
        let mapped = spread(self.threads, &jobs, |(tour, seed)| {
            let mapped = self.map(tour, *seed).with_context(|| format!("{tour}, seed {seed}"));
            let count = done.fetch_add(1, Ordering::Relaxed) + 1;
            eprintln!("{:6.0} s  {count}/{}  {tour}, seed {seed}", began.elapsed().as_secs_f64(), jobs.len());
            mapped
        });
        let mut failed = Vec::new();
        let mapped: Vec<Mapped> = mapped
            .into_iter()
            .map(|m| {
                m.unwrap_or_else(|why| {
                    failed.push(format!("{why:#}"));
                    Mapped::new()
                })
            })
            .collect();
        let of_tour = mapped.chunks(self.seeds.clone().count().max(1));
        (tours.iter().zip(of_tour).flat_map(|(tour, seeds)| self.rows(tour, seeds)).collect(), failed)
    }

    /// The one tour and language to write.
    pub fn only(&self) -> Result<(&str, Language)> {
        match (self.tours.as_slice(), self.languages.as_slice()) {
            ([tour], [language]) => Ok((tour, *language)),
            _ => bail!("--write: give one --tour and one --language, a folder for each"),
        }
    }

    /// A tour of one seed.
    pub fn tour(&self, name: &str, seed: u64) -> Result<Tour> {
        match self.shared.as_deref() {
            Some(shared) if name == stata::NAME => stata::tour(shared, seed),
            Some(shared) if name == plans::NAME => plans::tour(shared, seed, &self.languages),
            _ => simulated::tour(name, seed, &self.languages),
        }
    }

    /// Whether a tour can be taken; if not, says why.
    pub fn is_there(&self, tour: &str) -> bool {
        let why = skipped(tour, self);
        if let Some(why) = &why {
            eprintln!("{tour}: skipped: {why}");
        }
        why.is_none()
    }

    fn map(&self, name: &str, seed: u64) -> Result<Mapped> {
        let tour = self.tour(name, seed)?;
        let mut mapped = Mapped::new();
        for &language in &self.languages {
            let Some(case) = tour.case(language) else { continue };
            for &particles in &self.particles {
                let settings = Settings { particles, preset: self.preset };
                let outcome =
                    Outcome::new(seed, &case.truth, &run::map(&case, settings)?, case.reference.clone());
                mapped.push(((language, particles), outcome));
            }
        }
        Ok(mapped)
    }

    fn rows(&self, tour: &str, seeds: &[Mapped]) -> Vec<Row> {
        let kinds = self.languages.iter().flat_map(|&l| self.particles.iter().map(move |&p| (l, p)));
        let row = |kind: (Language, u32)| {
            let outcomes: Vec<Outcome> =
                seeds.iter().flatten().filter(|m| m.0 == kind).map(|m| m.1.clone()).collect();
            let setting = Setting {
                tour: tour.into(),
                language: kind.0.to_string(),
                preset: self.preset.to_string(),
                particles: Some(kind.1),
            };
            (!outcomes.is_empty()).then_some(Row { setting, outcomes })
        };
        kinds.filter_map(row).collect()
    }
}

/// Does the work on all items, on some threads; what comes back is in the order of the items.
fn spread<T: Sync, R: Send>(threads: usize, items: &[T], work: impl Fn(&T) -> R + Sync) -> Vec<R> {
    let next = AtomicUsize::new(0);
    let results: Mutex<Vec<(usize, R)>> = Mutex::new(Vec::with_capacity(items.len()));
    std::thread::scope(|scope| {
        for _ in 0..threads.min(items.len()) {
            scope.spawn(|| {
                while let Some((k, item)) = items.iter().enumerate().nth(next.fetch_add(1, Ordering::Relaxed))
                {
                    let result = work(item);
                    results.lock().unwrap_or_else(std::sync::PoisonError::into_inner).push((k, result));
                }
            });
        }
    });
    let mut results = results.into_inner().unwrap_or_else(std::sync::PoisonError::into_inner);
    results.sort_by_key(|r| r.0);
    results.into_iter().map(|r| r.1).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tour::tests::short_walk;
    use toponym_server::map::Preset;

    #[test]
    fn results_are_in_the_order_of_the_items() {
        let items: Vec<u64> = (0..50).collect();
        assert_eq!(spread(3, &items, |k| k * k), items.iter().map(|k| k * k).collect::<Vec<_>>());
        assert!(spread(3, &[], |k: &u64| *k).is_empty());
    }

    #[test]
    fn the_figures_do_not_depend_on_the_threads_but_on_the_seed() {
        let settings = Settings { particles: 3, preset: Preset::Toponym };
        let outcomes = |threads| {
            spread(threads, &[1, 2], |seed| {
                let case = short_walk(*seed).case(Language::Simple).unwrap();
                let outcome = Outcome::new(*seed, &case.truth, &run::map(&case, settings).unwrap(), None);
                Outcome { cpu_ms_per_s: None, ..outcome }
            })
        };
        let one = outcomes(1);
        assert_eq!(one, outcomes(2));
        assert_ne!(one[0].ate_rmse_m, one[1].ate_rmse_m);
        assert!(one[0].ate_rmse_m < Some(0.3) && one[0].mass_true(3) > Some(0.99), "{:?}", one[0]);
    }

    #[test]
    fn a_simulated_tour_is_mapped_and_its_posterior_is_one() {
        let suite = |threads| Suite {
            tours: vec!["small".into()],
            languages: vec![Language::Simple],
            particles: vec![2],
            preset: Preset::Toponym,
            seeds: 1..3,
            threads,
            shared: None,
        };
        let run = |threads| {
            let mut row = suite(threads).run().0.remove(0);
            row.outcomes.iter_mut().for_each(|o| assert!(o.cpu_ms_per_s.take() > Some(0.0)));
            row.outcomes
        };
        let outcomes = run(1);
        assert_eq!(outcomes, run(2));
        assert_eq!(outcomes.iter().map(|o| o.seed).collect::<Vec<_>>(), [1, 2]);
        for outcome in outcomes {
            assert!(outcome.hypotheses.len() > 1 && outcome.answers.len() > 3 && outcome.labels.of > 3);
            let mass: f64 = outcome.reference.unwrap().mass[3].iter().sum();
            assert!((mass - 1.0).abs() < 1e-9, "{mass}");
            for graphs in outcome.checkpoints.iter().map(|c| &c.as_ref().unwrap().graphs) {
                let kept: f64 = graphs.iter().map(|g| g.0).sum();
                assert!(kept > 0.5 && kept < 1.0 + 1e-9, "the rest is unresolved");
            }
        }
    }

    #[test]
    fn rows_are_by_tour_language_and_particles() {
        let suite = Suite {
            tours: vec!["walk".into()],
            languages: vec![Language::None, Language::Simple],
            particles: vec![2, 1],
            preset: Preset::PaperGrounding,
            seeds: 4..6,
            threads: 1,
            shared: None,
        };
        let case = short_walk(4).case(Language::None).unwrap();
        let outcome = |seed| Outcome::new(seed, &case.truth, &crate::score::Mapped::default(), None);
        let seeds: Vec<Mapped> = (4..6)
            .map(|seed| vec![((Language::None, 1), outcome(seed)), ((Language::Simple, 1), outcome(seed))])
            .collect();
        let rows = suite.rows("walk", &seeds);
        assert_eq!(rows.iter().map(|r| r.setting.language.as_str()).collect::<Vec<_>>(), ["none", "simple"]);
        assert_eq!(rows[0].outcomes.iter().map(|o| o.seed).collect::<Vec<_>>(), [4, 5]);
        assert_eq!(
            (rows[0].setting.preset.as_str(), rows[0].setting.particles),
            ("paper-grounding", Some(1))
        );
    }
}
