//! Smooths a pose graph one pose at a time, as a robot would meet it, and prints what that cost:
//! the same protocol, the same χ² and the same field names as GTSAM's iSAM2 is measured with.
//!
//! - `g2o`: the graph, read from EDGE_SE2 lines, and its χ²
//! - `feed`: one pose and its edges into a smoother or a structure
//! - `single`: one estimate; its covariances and copies
//! - `particles`: many estimates that differ in the loop edges they hold; `draws`: their decisions
//! - `report`: thread clock, memory, statistics, number formats

mod draws;
mod failure;
mod feed;
mod g2o;
mod particles;
mod report;
mod single;

use clap::{Args, Parser};
use draws::Plan;
use failure::Failure;
use g2o::Graph;
use std::path::PathBuf;
use std::process::ExitCode;

/// As in the server.
#[global_allocator]
static ALLOCATOR: mimalloc::MiMalloc = mimalloc::MiMalloc;

const MORE: &str = "\
Examples (smooth is: cargo run --release -p toponym-core --example smooth --):
  smooth m3500.g2o.gz                              one estimate, one update a pose
  smooth m3500.g2o.gz --all-poses                  the same, reading every pose after every update
  smooth m3500.g2o.gz --covariance                 the same, with covariances and copies
  smooth m3500.g2o.gz --particles 1000             1000 particles that share what they have in common
  smooth m3500.g2o.gz --particles 100 --independent    100 that share nothing

What is timed: only calls into the smoother, in CPU time of the one thread that makes them, so that
other work on the machine does not count. update, step and the like are statistics with one entry a
pose: {total_s, mean_ms, p50_ms, p99_ms, max_ms}.

  update            making the estimate good again after a pose was added with its edges
  update_and_pose   the same and reading the newest pose; update_and_full: reading all too
  build             seconds, in all, for adding the poses and edges themselves
  chi2              sum of e'Ie over the edges, e = z^-1 * (xi^-1 * xj) as (x, y, yaw)
  rss_mb            growth of the largest resident memory since the graph was read
  reelim_mean       poses eliminated anew in an update, on average; relin_mean: relinearised;
                    factors_mean: factors computed again

With --covariance:

  cov_current       covariance of the newest pose
  joint_pair        joint covariance of it and a random older one, every 25 poses after the first 100;
                    joint_20_pairs: with 20, in one call; joint_all: with every pose
  copy_ms           copying the estimate as it is in the end; copy_first_step_ms: copying and adding
                    a pose, beyond what adding it to the original costs; copy_mb: memory kept by then

With --particles:

  total_s           structure_s, adding and arranging what all share (with --independent: adding
                    alone), and beliefs_s, copying, updating, reading and dropping each one's own
  step              the same time for each pose
  distinct_trees    estimates that differ, mean over the steps; distinct_trees_end: in the end
  shared_clique_fraction   share of the trees' cliques that need no memory of their own, in the end
  chi2_mean         over the particles, each with the edges it holds";

/// Smooths a pose graph one pose at a time and prints what that cost, as one line of JSON.
///
/// Edges come in the order of their newer pose, as a robot meets them. A pose starts from the first
/// edge to an older one; its other edges are loop closures. The oldest pose is the origin.
#[derive(Parser)]
#[command(name = "smooth", version, after_long_help = MORE, after_help = "--help explains the output.")]
struct Options {
    /// Pose graph: the EDGE_SE2 lines of a g2o file, plain or gzip; other lines are ignored
    #[arg(value_name = "FILE.g2o[.gz]")]
    file: PathBuf,

    /// Reads all poses after every update, and times that too
    #[arg(long, conflicts_with = "particles")]
    all_poses: bool,

    /// Times covariances (of the newest pose; of it with 1, with 20 and with all others) and copies
    #[arg(long, conflicts_with = "particles")]
    covariance: bool,

    /// Settles the estimate at the end, and reports χ² after that too
    #[arg(long, conflicts_with = "particles")]
    settle: bool,

    /// Writes the last poses, a line each: x y yaw, metres and radians
    #[arg(long, value_name = "FILE", conflicts_with = "particles")]
    poses_out: Option<PathBuf>,

    /// Writes a line of CSV for each pose: times and work of its update
    #[arg(long, value_name = "FILE.csv", conflicts_with = "particles")]
    steps: Option<PathBuf>,

    #[command(flatten)]
    many: ManyOptions,
}

/// What makes it many estimates.
#[derive(Args)]
#[command(next_help_heading = "Particles")]
struct ManyOptions {
    /// Keeps N estimates, each of which decides by itself which loop edges it takes
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    particles: Option<u32>,

    /// Probability with which a particle takes a loop edge
    #[arg(long, value_name = "P", default_value_t = 0.9, value_parser = probability, requires = "particles")]
    accept: f64,

    /// Poses from one resampling to the next, by random weights
    #[arg(
        long,
        value_name = "K",
        default_value_t = 50,
        value_parser = clap::value_parser!(u32).range(1..),
        requires = "particles",
        conflicts_with = "independent"
    )]
    resample_every: u32,

    /// Of the particles' decisions and weights: the same seed gives the same run
    #[arg(long, value_name = "S", default_value_t = 1, requires = "particles")]
    seed: u64,

    /// Shares nothing: each particle has its own smoother, and there is no resampling
    #[arg(long, requires = "particles")]
    independent: bool,
}

fn probability(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(p) if (0.0..=1.0).contains(&p) => Ok(p),
        _ => Err("give a probability from 0 to 1".into()),
    }
}

fn main() -> ExitCode {
    match run(&Options::parse()) {
        Ok(json) => {
            println!("{json}");
            ExitCode::SUCCESS
        }
        Err(failure) => {
            eprintln!("smooth: {failure}");
            ExitCode::FAILURE
        }
    }
}

fn run(options: &Options) -> Result<String, Failure> {
    let graph = Graph::read(&options.file)?;
    report::forget_memory_max();
    for id in graph.detached() {
        eprintln!(
            "smooth: warning: pose {id} has no edge to an older pose: it starts at the origin, \
             uncertain by {} m and half a turn",
            feed::VAGUE_M
        );
    }
    let many = &options.many;
    let report = match many.particles {
        None => serde_json::to_string(&single::run(&graph, options)?),
        Some(particles) => {
            let plan = Plan {
                particles,
                accept: many.accept,
                resample_every: many.resample_every as usize,
                seed: many.seed,
            };
            let run = if many.independent { particles::run_independent } else { particles::run_shared };
            serde_json::to_string(&run(&graph, &plan)?)
        }
    };
    report.map_err(Failure::Report)
}
