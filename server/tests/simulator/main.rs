//! Robot, guide, network, server and medium in one thread and on one virtual clock, each failing as a seed says: messages
//! are late, lost, repeated and out of order, the medium refuses, the machine stops and forgets what was not synced.
//! Whatever happens, what was acknowledged is there again, each message and sentence enters the map once, and the map is the one
//! that its journal makes.
//!
//! `TOPONYM_SEEDS` sets how many (300), `TOPONYM_SEED` the first (1).

#![allow(clippy::unwrap_used)]

mod scene;
// The journal's own tests stop it at operations of their choice.
#[allow(dead_code)]
#[path = "../../journal/tests/medium/sim.rs"]
mod sim;
mod world;

use std::panic::{AssertUnwindSafe, catch_unwind};
use world::{Bug, Told, run};

fn setting(name: &str, default: u64) -> u64 {
    std::env::var(name).ok().map_or(default, |text| text.parse().unwrap())
}

#[test]
fn nothing_is_lost_whatever_fails() {
    let (first, seeds) = (setting("TOPONYM_SEED", 1), setting("TOPONYM_SEEDS", 300));
    let mut all = Told::default();
    for seed in first..first + seeds {
        match catch_unwind(AssertUnwindSafe(|| run(seed, None))) {
            Ok(told) => all.add(&told),
            Err(why) => {
                eprintln!("seed {seed}");
                std::panic::resume_unwind(why);
            }
        }
    }
    println!("{seeds} seeds: {all:?}");
    assert!(all.crashes > 0 && all.refusals > 0 && all.repeated > 0 && all.mended + all.refused_flips > 0);
}

/// Whether the simulation notices a bug in one of a few runs.
fn notices(bug: Bug) -> bool {
    // What it prints on the way is no failure.
    let hook = std::panic::take_hook();
    std::panic::set_hook(Box::new(|_| {}));
    let noticed = (1..=40).any(|seed| catch_unwind(AssertUnwindSafe(|| run(seed, Some(bug)))).is_err());
    std::panic::set_hook(hook);
    noticed
}

#[test]
fn planted_bugs_are_noticed() {
    for bug in [Bug::AcknowledgesBeforeSync, Bug::TakesInHashOrder] {
        assert!(notices(bug), "{bug:?}");
    }
}
