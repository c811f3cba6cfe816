//! What simulated drives, whose truth is known, say about the metric half of the filter.
//!
//! ```sh
//! toponym simulate drives/1 --plan PLAN.xml --lidar rplidar --people 4      # and so on
//! cargo run --release -p toponym-server --example drives -- chance drives/*
//! cargo run --release -p toponym-server --example drives -- coverage drives/*
//! cargo run --release -p toponym-server --example drives -- dark --seeds 20
//! cargo run --release -p toponym-server --example drives -- absence --seeds 20
//! cargo run --release -p toponym-server --example drives -- faults --seeds 200 --plans PLANS
//! cargo run --release -p toponym-server --example drives -- rooms --seeds 20 --plans PLANS
//! cargo run --release -p toponym-server --example drives -- enclosed --seeds 60 --plans PLANS
//! cargo run --release -p toponym-server --example drives -- described --seeds 200 --plans PLANS --out weights.rs
//! ```
//! `chance` learns how much likelier a true fit is than one by chance (`LOOKS` in the core's `chance.rs`), and
//! shows on buildings not learned from how often fits are true that are called so with some probability.
//! `coverage` shows how often the truth lies in the 95 % region of the front end's increments.
//! `dark` plays the simulator's tours itself and shows what the chain is worth over dark stretches; `absence` learns
//! by them how often places contradict each other in right maps and in wrong ones (`CONTRADICTED` in `absence.rs`).
//! `enclosed` counts in how far what is seen from places tells of one room (`IN_SIGHT_M` and `THROUGH_WALLS` in
//! `naming.rs`), and what their shape tells of ways (`WAY` in `enclosure.rs`).
//!
//! A drive is a folder with `sim.rec` and `truth.json`, as `toponym simulate` makes them. Any log will do:
//! `toponym-server serve --record` makes the one, `trajectory` rows `[t, x, y, yaw]` are the other.
#![allow(clippy::unwrap_used, reason = "a tool: a wrong file ends it")]

mod absence;
mod chance;
mod coverage;
mod dark;
mod described;
mod drive;
mod enclosed;
mod faults;
mod logistic;
mod rooms;

use clap::{Parser, Subcommand};
use drive::Drive;
use std::path::PathBuf;

#[derive(Parser)]
#[command(
    about = "Learns from simulated drives, and checks by them, what fits, increments and overlaps are worth"
)]
struct Args {
    #[command(subcommand)]
    what: What,
}

#[derive(Subcommand)]
enum What {
    /// How much likelier a true fit is than one by chance, and how well p(e = 1) is calibrated.
    Chance {
        /// Folders.
        #[arg(required = true)]
        drives: Vec<PathBuf>,
    },
    /// Share of increments of the front end whose 95 % region covers the truth.
    Coverage {
        /// Folders.
        #[arg(required = true)]
        drives: Vec<PathBuf>,
    },
    /// How places contradict each other in right maps and in wrong ones.
    Absence {
        /// How many seeds; the first is 1001.
        #[arg(long, default_value_t = 20)]
        seeds: u64,
    },
    /// Whether maps are right, or told, where something goes wrong with the robot's senses.
    Faults {
        /// Folder with floor plans (XML of the KTH campus data set); none: random offices.
        #[arg(long)]
        plans: Option<PathBuf>,
        /// The first seed.
        #[arg(long, default_value_t = 1)]
        from: u64,
        /// How many.
        #[arg(long, default_value_t = 200)]
        seeds: u64,
        /// Only this kind, as the list in the source has it.
        #[arg(long)]
        only: Option<String>,
        /// Nothing goes wrong: counts false alarms.
        #[arg(long)]
        clean: bool,
    },
    /// How regions of maps lie over rooms.
    Rooms {
        /// Folder with floor plans (XML of the KTH campus data set); none: random offices.
        #[arg(long)]
        plans: Option<PathBuf>,
        /// The first seed.
        #[arg(long, default_value_t = 1)]
        from: u64,
        /// How many.
        #[arg(long, default_value_t = 20)]
        seeds: u64,
    },
    /// Of how near places, with what is seen between them, how many are of one room; and what shape is a way's.
    Enclosed {
        /// Folder with floor plans (XML of the KTH campus data set); none: random offices.
        #[arg(long)]
        plans: Option<PathBuf>,
        /// The first seed.
        #[arg(long, default_value_t = 1)]
        from: u64,
        /// How many.
        #[arg(long, default_value_t = 60)]
        seeds: u64,
    },
    /// Which room is meant by "next to the kitchen": learns the weights and shows what they are worth elsewhere.
    Described {
        /// Folder with floor plans (XML of the KTH campus data set).
        #[arg(long)]
        plans: PathBuf,
        /// The first seed.
        #[arg(long, default_value_t = 1)]
        from: u64,
        /// How many.
        #[arg(long, default_value_t = 200)]
        seeds: u64,
        /// Where to write the weights.
        #[arg(long)]
        out: Option<PathBuf>,
    },
    /// Errors of the chain over dark stretches, and what it claims.
    Dark {
        /// Kinds of tours, or how they begin; none: all of them.
        kinds: Vec<String>,
        /// How many seeds.
        #[arg(long, default_value_t = 20)]
        seeds: u64,
        /// A line for each stretch, too.
        #[arg(long)]
        each: bool,
    },
}

fn main() {
    match Args::parse().what {
        What::Chance { drives } => {
            let drives: Vec<Drive> = drives.iter().map(|d| Drive::read(d)).collect();
            chance::report(&drives);
        }
        What::Coverage { drives } => drives.iter().for_each(|d| coverage::report(&Drive::read(d))),
        What::Faults { plans, from, seeds, only, clean } => {
            faults::report(plans.as_deref(), from..from + seeds, only.as_deref(), clean);
        }
        What::Rooms { plans, from, seeds } => rooms::report(plans.as_deref(), from..from + seeds),
        What::Enclosed { plans, from, seeds } => enclosed::report(plans.as_deref(), from..from + seeds),
        What::Described { plans, from, seeds, out } => {
            described::report(&plans, from..from + seeds, out.as_deref());
        }
        What::Absence { seeds } => absence::report(1001..1001 + seeds),
        What::Dark { kinds, seeds, each } => dark::report(&kinds, 1..seeds + 1, each),
    }
}
