//! Smoothing, graphs × particles: what one belief costs, and what more of them cost beyond that.
//!
//! `cargo bench -p toponym-core --bench smoothing`, with `-- --help` for its options. The graphs are
//! walks through made-up towns, see [`TOWNS`]. Times are CPU times of the one thread, of calls into the
//! smoother alone; ratios are of one run, so that they hardly depend on the machine. Without cargo's
//! `--bench`, as in `cargo test --all-targets`, it only shows that it runs.

use clap::{Parser, value_parser};
use cpu_time::ThreadTime;
use nalgebra::{Matrix3, Vector3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::collections::BTreeMap;
use std::f64::consts::FRAC_PI_2;
use std::hint::black_box;
use std::iter::{once, repeat_n};
use toponym_core::Pose2;
use toponym_core::smoothing::{Belief, Factor, FactorId, JointRoom, SmoothError, Structure};

/// Two sorts of town that the literature measures on, and one that is harder.
const TOWNS: [Town; 3] = [
    // As M3500: turns everywhere, a loop every other pose.
    Town { name: "grid", block_m: 3, blocks: 12, loops: 0.6, turn_rad: 0.01 },
    // As KITTI: long streets, seldom a loop.
    Town { name: "chain", block_m: 60, blocks: 3, loops: 0.05, turn_rad: 0.002 },
    // Every place seen again and again, each time tied to several visits.
    Town { name: "city", block_m: 2, blocks: 8, loops: 2.4, turn_rad: 0.01 },
];
/// Standard deviation of a measured shift, along each axis.
const SHIFT_M: f64 = 0.05;
/// Poses that a loop goes back at least.
const LOOP_AGE: usize = 20;
/// Probability with which a particle takes a loop.
const ACCEPT: f64 = 0.9;
/// Poses from one resampling, and catching up, to the next.
const RESAMPLE_EVERY: usize = 50;
/// Covariances are asked for every so many poses, with so many older ones, evenly spaced.
const JOINT_EVERY: usize = 25;
const JOINT_MANY: u32 = 20;
const CLONES: usize = 1000;
/// Runs of each filter. All do the same work, so that the least time of each step is nearest to its cost.
const RUNS: u32 = 3;

/// Smooths generated graphs one pose at a time and prints what that cost.
#[derive(Parser)]
struct Options {
    /// Poses of the grid, the long chain with few loops, the dense city; who gives fewer gets fewer
    #[arg(long, value_delimiter = ',', num_args = 1, default_value = "1500,3000,500")]
    poses: Vec<usize>,
    /// Numbers of particles
    #[arg(long, value_delimiter = ',', default_value = "1,10,50", value_parser = value_parser!(u32).range(1..))]
    particles: Vec<u32>,
    /// Of graphs, the particles' choices and weights
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// What cargo says to all benches
    #[arg(long, hide = true)]
    bench: bool,
}

fn main() -> Result<(), SmoothError> {
    let said = |flag: &str| std::env::args().any(|arg| arg == flag);
    let all = said("--bench") && !said("--test");
    let tiny = ["smoothing", "--poses=60,60,60", "--particles=1,3"];
    let Options { poses, particles, seed, .. } =
        if all { Options::parse() } else { Options::parse_from(tiny) };
    println!("one belief that holds every loop: ms, clone in µs; catch_up every {RESAMPLE_EVERY} poses");
    println!("graph  poses  edges | newest    p99     max |  update | catch_up | joint_20 joint_all | clone");
    let mut rows = Vec::new();
    for (town, poses) in TOWNS.iter().zip(poses) {
        let graph = town.walk(poses, seed);
        let costs = costs(&graph, &particles, seed)?;
        println!("{:5} {}", town.name, single_row(&graph, &costs[0], whole(&graph)?));
        for (particles, cost) in particles.iter().zip(&costs[1..]) {
            rows.push(format!("{:5} {particles:9} {}", town.name, many_row(graph.len(), cost, &costs[0])));
        }
    }
    println!("\nparticles that take each loop with P = {ACCEPT}: ratios to the one above");
    println!("graph particles distinct | total_s ratio | ms/belief ratio\n{}", rows.join("\n"));
    Ok(())
}

fn single_row(graph: &Graph, cost: &Cost, [update, joint, joint_all, clone_us]: [f64; 4]) -> String {
    let (poses, edges) = (graph.len(), graph.iter().map(Vec::len).sum::<usize>());
    let [mut ms, caught_up_ms] = cost.ms.clone();
    ms.sort_by(f64::total_cmp);
    let (newest, p99, max) = (mean(&ms), ms[poses * 99 / 100], ms[poses - 1]);
    let times = format!("{newest:6.3} {p99:6.3} {max:7.3} | {update:7.3} | {:8.3}", mean(&caught_up_ms));
    format!("{poses:6} {edges:6} | {times} | {joint:8.3} {joint_all:9.3} | {clone_us:5.2}")
}

fn many_row(poses: usize, cost: &Cost, single: &Cost) -> String {
    let distinct = cost.beliefs as f64 / poses as f64;
    let [ms, single_ms] = [cost, single].map(|of| of.ms.iter().flatten().sum::<f64>());
    let (total_s, ratio, each_ms) = (ms / 1e3, ms / single_ms, ms / cost.beliefs as f64);
    format!("{distinct:8.1} | {total_s:7.3} {ratio:5.1} | {each_ms:9.4} {:5.2}", ratio / distinct)
}

/// Streets a block apart, and what a robot measures that walks them, a pose a metre.
struct Town {
    name: &'static str,
    block_m: i32,
    /// On a side.
    blocks: i32,
    /// Loops per pose, with poses less than two metres off.
    loops: f64,
    /// Standard deviation of a measured turn.
    turn_rad: f64,
}

/// Metres, and quarter turns.
type Place = (i32, i32, i32);
/// Factors of each pose with older ones, the one it starts from first; of the first pose none.
type Graph = Vec<Vec<Factor>>;

impl Town {
    fn walk(&self, poses: usize, seed: u64) -> Graph {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let (mut places, mut graph) = (vec![(0, 0, 0)], vec![Vec::new()]);
        for j in 1..poses {
            let to = self.next(places[j - 1], &mut rng);
            let near = |&i: &usize| (places[i].0 - to.0).abs() < 2 && (places[i].1 - to.1).abs() < 2;
            let mut again: Vec<usize> = (0..j.saturating_sub(LOOP_AGE)).filter(near).collect();
            places.push(to);
            let mut factors = vec![self.measured(j - 1, j, &places, &mut rng)];
            for _ in 0..again.len().min((self.loops + rng.random::<f64>()) as usize) {
                let i = again.swap_remove(rng.random_range(0..again.len()));
                factors.push(self.measured(i, j, &places, &mut rng));
            }
            graph.push(factors);
        }
        graph
    }

    /// A metre on: ahead, or at a crossing left or right as well, as far as the town goes.
    fn next(&self, (x, y, heading): Place, rng: &mut ChaCha8Rng) -> Place {
        let crossing = x % self.block_m == 0 && y % self.block_m == 0;
        loop {
            let turn = if crossing { rng.random_range(-1..=1) } else { 0 };
            let heading = (heading + turn).rem_euclid(4);
            let (dx, dy) = [(1, 0), (0, 1), (-1, 0), (0, -1)][heading as usize];
            let inside = |v: i32| (0..=self.block_m * self.blocks).contains(&v);
            if inside(x + dx) && inside(y + dy) {
                return (x + dx, y + dy, heading);
            }
        }
    }

    fn measured(&self, i: usize, j: usize, places: &[Place], rng: &mut ChaCha8Rng) -> Factor {
        let pose = |(x, y, turns): Place| Pose2::new(x.into(), y.into(), f64::from(turns) * FRAC_PI_2);
        let sigma = Vector3::new(SHIFT_M, SHIFT_M, self.turn_rad);
        let noise = Pose2::exp(&sigma.map(|s| s * normal(rng)));
        let i_from_j = pose(places[i]).between(&pose(places[j])).compose(&noise);
        let information = Matrix3::from_diagonal(&sigma.map(|s| s.powi(-2)));
        Factor { i: i as u32, j: j as u32, i_from_j, information }
    }
}

/// What the beliefs of a filter cost.
#[derive(Default)]
struct Cost {
    /// Of each pose: arranging what all share, then copying and updating each distinct belief; and of
    /// catching up after each resampling.
    ms: [Vec<f64>; 2],
    /// Distinct ones, summed over the poses.
    beliefs: usize,
}

/// Of a belief that holds every loop, then of each number of particles; in turns, so that a slow spell of
/// the machine hits all alike.
fn costs(graph: &Graph, particles: &[u32], seed: u64) -> Result<Vec<Cost>, SmoothError> {
    let filters = || once((1, 1.0)).chain(particles.iter().map(|&n| (n, ACCEPT)));
    let turn = || filters().map(|(n, accept)| filter(graph, n, accept, seed)).collect::<Result<Vec<_>, _>>();
    let mut costs = turn()?;
    for _ in 1..RUNS {
        for (cost, again) in costs.iter_mut().zip(turn()?) {
            cost.ms.iter_mut().flatten().zip(again.ms.iter().flatten()).for_each(|(a, b)| *a = a.min(*b));
        }
    }
    Ok(costs)
}

/// Takes the graph in pose by pose, as a filter does: each particle takes each loop or not, and now and
/// then they are resampled.
fn filter(graph: &Graph, particles: u32, accept: f64, seed: u64) -> Result<Cost, SmoothError> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let (mut structure, mut cost) = (Structure::new(), Cost::default());
    let mut groups: Vec<Group> = vec![(Belief::new(), particles)];
    for (k, factors) in graph.iter().enumerate() {
        let loops = grow(&mut structure, factors)?;
        let splits = groups.iter().map(|group| split(group.1, &loops, accept, &mut rng)).collect();
        let (parts, ms) = timed(|| {
            structure.arrange();
            update(groups, splits, &structure)
        })?;
        groups = parts;
        cost.ms[0].push(ms);
        cost.beliefs += groups.len();
        if k > 0 && k.is_multiple_of(RESAMPLE_EVERY) {
            resample(&mut groups, particles, &mut rng);
            let ((), ms) = timed(|| {
                groups.retain(|group| group.1 > 0);
                groups.iter_mut().try_for_each(|group| group.0.catch_up(&structure).map(drop))
            })?;
            cost.ms[1].push(ms);
        }
    }
    Ok(cost)
}

/// Adds a pose with its factors; returns the loops, which a belief holds or not.
fn grow(structure: &mut Structure, factors: &[Factor]) -> Result<Vec<FactorId>, SmoothError> {
    let Some((start, loops)) = factors.split_first() else {
        return structure.add_pose(Pose2::default(), &Matrix3::identity()).map(|_| Vec::new());
    };
    structure.add_pose_from(start.clone())?;
    loops.iter().map(|factor| structure.add_factor(factor.clone())).collect()
}

/// Equal particles: one belief, and how many they are.
type Group = (Belief, u32);
/// How many of them take which loops.
type Split = BTreeMap<Vec<FactorId>, u32>;

fn split(count: u32, loops: &[FactorId], accept: f64, rng: &mut ChaCha8Rng) -> Split {
    let mut parts = Split::new();
    for _ in 0..count {
        *parts.entry(loops.iter().copied().filter(|_| rng.random_bool(accept)).collect()).or_insert(0) += 1;
    }
    parts
}

/// Groups come apart into those that take the same loops, and take the newest pose in.
fn update(groups: Vec<Group>, splits: Vec<Split>, structure: &Structure) -> Result<Vec<Group>, SmoothError> {
    let mut parts = Vec::with_capacity(splits.iter().map(Split::len).sum());
    for ((belief, _), split) in groups.into_iter().zip(splits) {
        // The last part goes on with the original: what only it needs is changed in place.
        for (mut belief, (taken, count)) in repeat_n(belief, split.len()).zip(split) {
            for id in taken {
                belief.hold(id);
            }
            belief.update_newest(structure)?;
            parts.push((belief, count));
        }
    }
    Ok(parts)
}

/// Gives each particle a random weight and draws as many again, systematically.
fn resample(groups: &mut [Group], particles: u32, rng: &mut ChaCha8Rng) {
    let weigh = |group: &Group| (0..group.1).map(|_| normal(rng).exp()).sum();
    let weights: Vec<f64> = groups.iter().map(weigh).collect();
    let per_mark = weights.iter().sum::<f64>() / f64::from(particles);
    // Marks lie one apart; how many are below the running sum?
    let (mut mark, mut sum) = (rng.random::<f64>(), 0.0);
    for (group, weight) in groups.iter_mut().zip(weights) {
        sum += weight / per_mark;
        group.1 = (sum - mark).ceil() as u32;
        mark += f64::from(group.1);
    }
}

/// Standard normal, nearly: of a sum of twelve uniform numbers.
fn normal(rng: &mut ChaCha8Rng) -> f64 {
    (0..12).map(|_| rng.random::<f64>()).sum::<f64>() - 6.0
}

/// Takes the graph in with all poses good after each, and asks for covariances now and then. Means of
/// an update, a joint covariance with some and with all poses, ms, and of a clone, µs.
fn whole(graph: &Graph) -> Result<[f64; 4], SmoothError> {
    let (mut structure, mut belief) = (Structure::new(), Belief::new());
    let (mut update_ms, mut joint_ms, mut joint_all_ms) = (Vec::new(), Vec::new(), Vec::new());
    let mut room = JointRoom::default();
    for (k, factors) in graph.iter().enumerate() {
        grow(&mut structure, factors)?.into_iter().for_each(|id| belief.hold(id));
        let (_, ms) = timed(|| {
            structure.arrange();
            belief.update(&structure)
        })?;
        update_ms.push(ms);
        if k > 0 && k.is_multiple_of(JOINT_EVERY) {
            let older: Vec<u32> = (1..=JOINT_MANY).map(|n| n * k as u32 / (JOINT_MANY + 1)).collect();
            joint_ms.push(timed(|| black_box(belief.joint(&structure, &older)))?.1);
            joint_all_ms.push(timed(|| black_box(belief.joint_all(&structure, &mut room)).map(|_| ()))?.1);
        }
    }
    let (clones, clones_ms) = timed(|| Ok(black_box(vec![belief; CLONES])))?;
    Ok([mean(&update_ms), mean(&joint_ms), mean(&joint_all_ms), clones_ms * 1e3 / clones.len() as f64])
}

/// What `work` returns, and the CPU time it took on this thread, ms.
fn timed<T>(work: impl FnOnce() -> Result<T, SmoothError>) -> Result<(T, f64), SmoothError> {
    let clock = ThreadTime::now();
    work().map(|result| (result, clock.elapsed().as_secs_f64() * 1e3))
}

/// The mean, NaN of nothing.
fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}
