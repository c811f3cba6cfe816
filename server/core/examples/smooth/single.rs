//! One estimate, updated at every pose.

use crate::Options;
use crate::failure::Failure;
use crate::feed::{add_loop, add_pose, failed};
use crate::g2o::Graph;
use crate::report::{Progress, Stats, general, growth_mb, mean, memory_max_mb, memory_mb, round, timed};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde::Serialize;
use std::fmt::Write as _;
use std::fs::File;
use std::hint::black_box;
use std::io::Write as _;
use std::path::Path;
use toponym_core::Pose2;
use toponym_core::smoothing::{Factor, JointRoom, SmoothError, Smoother, Work};

/// Covariances with older poses are asked for after the first `JOINT_FROM` poses, every `JOINT_EVERY`,
/// with poses at least `JOINT_AGE` older.
const JOINT_FROM: usize = 100;
const JOINT_EVERY: usize = 25;
const JOINT_AGE: usize = 50;
const JOINT_MANY: usize = 20;
const COPIES: u32 = 200;
/// Updates at the end at most: each linearises a bounded number of poses anew.
const CATCH_UP_MAX: u32 = 300;

/// The line printed; its names are the peers'.
#[derive(Serialize)]
pub struct Report {
    peer: &'static str,
    ver: &'static str,
    pg: String,
    poses: usize,
    edges: usize,
    update: Option<Stats>,
    update_and_pose: Option<Stats>,
    #[serde(skip_serializing_if = "Option::is_none")]
    update_and_full: Option<Stats>,
    /// To bring all poses up to date at the end, before they are written.
    last_all_poses_ms: f64,
    build: f64,
    chi2: f64,
    #[serde(flatten)]
    settled: Option<Settled>,
    rss_mb: Option<f64>,
    reelim_mean: f64,
    relin_mean: f64,
    factors_mean: f64,
    #[serde(flatten)]
    covariances: Option<CovarianceReport>,
    #[serde(flatten)]
    copies: Option<Copies>,
}

/// What one pose cost.
struct Step {
    build_ms: f64,
    update_ms: f64,
    pose_ms: f64,
    /// 0 if not asked for.
    all_poses_ms: f64,
    work: Work,
}

/// Adds the graph to one smoother, pose by pose, and measures.
pub fn run(graph: &Graph, options: &Options) -> Result<Report, Failure> {
    // Opened first: a long run should not end with a file that cannot be written.
    let poses_out = options.poses_out.as_deref().map(Output::create).transpose()?;
    let steps_out = options.steps.as_deref().map(Output::create).transpose()?;
    let mut covariances = options.covariance.then(Covariances::new);
    let memory_before = memory_max_mb();
    let mut smoother = Smoother::new();
    let mut steps = Vec::with_capacity(graph.poses());
    let mut progress = Progress::new(graph.poses());
    for k in 0..graph.poses() {
        steps.push(step(&mut smoother, graph, k, options.all_poses)?);
        if let Some(covariances) = &mut covariances {
            covariances.ask(&smoother, k).map_err(failed(graph, k))?;
        }
        progress.tick(k, String::new);
    }
    drop(progress);
    let rss_mb = growth_mb(memory_before, memory_max_mb());
    let last = failed(graph, graph.poses() - 1);
    let last_ms = bring_up_to_date(&mut smoother).map_err(&last)?;
    let poses = smoother.poses();
    if let Some(out) = poses_out {
        out.write(&poses_text(&poses))?;
    }
    if let Some(out) = steps_out {
        out.write(&steps_text(&steps))?;
    }
    Ok(Report {
        peer: "toponym",
        ver: env!("CARGO_PKG_VERSION"),
        pg: graph.name(),
        poses: graph.poses(),
        edges: graph.edges.len(),
        update: Stats::of(steps.iter().map(|s| s.update_ms)),
        update_and_pose: Stats::of(steps.iter().map(|s| s.update_ms + s.pose_ms)),
        update_and_full: options
            .all_poses
            .then(|| Stats::of(steps.iter().map(|s| s.update_ms + s.pose_ms + s.all_poses_ms)))
            .flatten(),
        last_all_poses_ms: round(last_ms, 4),
        build: round(steps.iter().map(|s| s.build_ms).sum::<f64>() / 1e3, 4),
        chi2: graph.chi2(&poses, |_| true),
        settled: options.settle.then(|| settle(smoother.clone(), graph)).transpose().map_err(&last)?,
        rss_mb: rss_mb.map(|mb| round(mb, 1)),
        reelim_mean: round(mean(steps.iter().map(|s| f64::from(s.work.eliminated))), 1),
        relin_mean: round(mean(steps.iter().map(|s| f64::from(s.work.relinearised))), 1),
        factors_mean: round(mean(steps.iter().map(|s| f64::from(s.work.factors))), 1),
        covariances: covariances.map(CovarianceReport::from),
        copies: options.covariance.then(|| copies(&smoother, graph)).transpose().map_err(&last)?,
    })
}

/// Adds pose k with its edges, updates, and reads it.
fn step(smoother: &mut Smoother, graph: &Graph, k: usize, all_poses: bool) -> Result<Step, Failure> {
    let (built, build_ms) = timed(|| -> Result<(), Failure> {
        add_pose(smoother, graph, k)?;
        for edge in &graph.edges[graph.loops(k)] {
            add_loop(smoother, graph, edge)?;
        }
        Ok(())
    });
    built?;
    // Reading all poses, they are all brought up to date; else the newest, like the peer.
    let update = if all_poses { Smoother::update } else { Smoother::update_newest };
    let (work, update_ms) = timed(|| update(smoother));
    let work = work.map_err(failed(graph, k))?;
    let (_, pose_ms) = timed(|| black_box(smoother.pose(k as u32)));
    let all_poses_ms = if all_poses { timed(|| black_box(smoother.poses())).1 } else { 0.0 };
    Ok(Step { build_ms, update_ms, pose_ms, all_poses_ms, work })
}

/// Updates until no pose waits for its turn to be linearised anew; returns the time, ms.
fn bring_up_to_date(smoother: &mut Smoother) -> Result<f64, SmoothError> {
    let (done, ms) = timed(|| {
        smoother.update()?;
        for _ in 0..CATCH_UP_MAX {
            if !smoother.belief().pending() {
                break;
            }
            smoother.update()?;
        }
        Ok(())
    });
    done.map(|()| ms)
}

/// χ² once nothing is left to gain.
#[derive(Serialize)]
struct Settled {
    chi2_settled: f64,
    settle_ms: f64,
}

fn settle(mut smoother: Smoother, graph: &Graph) -> Result<Settled, SmoothError> {
    let (done, ms) = timed(|| smoother.settle());
    done?;
    Ok(Settled { chi2_settled: graph.chi2(&smoother.poses(), |_| true), settle_ms: round(ms, 4) })
}

/// Times of the questions asked about covariances, ms.
struct Covariances {
    rng: ChaCha8Rng,
    current: Vec<f64>,
    pair: Vec<f64>,
    twenty: Vec<f64>,
    all: Vec<f64>,
    room: JointRoom,
}

#[derive(Serialize)]
struct CovarianceReport {
    cov_current: Option<Stats>,
    joint_pair: Option<Stats>,
    joint_20_pairs: Option<Stats>,
    joint_all: Option<Stats>,
}

impl Covariances {
    fn new() -> Self {
        let rng = ChaCha8Rng::seed_from_u64(1);
        Self {
            rng,
            current: Vec::new(),
            pair: Vec::new(),
            twenty: Vec::new(),
            all: Vec::new(),
            room: JointRoom::default(),
        }
    }

    /// Asks what a particle filter asks once pose k is in.
    fn ask(&mut self, smoother: &Smoother, k: usize) -> Result<(), SmoothError> {
        self.current.push(timed(|| black_box(smoother.marginal(k as u32))).1);
        if k <= JOINT_FROM || !k.is_multiple_of(JOINT_EVERY) {
            return Ok(());
        }
        let older = (k - JOINT_AGE) as u32;
        let one = [self.rng.random_range(0..older)];
        let many: Vec<u32> = (0..JOINT_MANY).map(|_| self.rng.random_range(0..older)).collect();
        for (candidates, times) in [(&one[..], &mut self.pair), (&many, &mut self.twenty)] {
            let (joint, ms) = timed(|| black_box(smoother.joint(candidates)));
            joint?;
            times.push(ms);
        }
        let (joint, ms) = timed(|| black_box(smoother.joint_all(&mut self.room)).map(|_| ()));
        joint?;
        self.all.push(ms);
        Ok(())
    }
}

impl From<Covariances> for CovarianceReport {
    fn from(times: Covariances) -> Self {
        Self {
            cov_current: Stats::of(times.current),
            joint_pair: Stats::of(times.pair),
            joint_20_pairs: Stats::of(times.twenty),
            joint_all: Stats::of(times.all),
        }
    }
}

/// What a copy costs: to make, to change for the first time beyond what the same change costs the
/// original, and to keep after that.
#[derive(Serialize)]
struct Copies {
    #[serde(rename = "copy_ms")]
    made_ms: f64,
    #[serde(rename = "copy_first_step_ms")]
    first_step_ms: f64,
    #[serde(rename = "copy_mb")]
    kept_mb: Option<f64>,
}

/// A particle is a belief: the structure is all particles' own.
fn copies(smoother: &Smoother, graph: &Graph) -> Result<Copies, SmoothError> {
    let information = graph.edges[0].information;
    let (mut structure, mut original) = (smoother.structure().clone(), smoother.belief().clone());
    let mut extend = || {
        let j = structure.len() as u32;
        structure.add_pose_from(Factor { i: j - 1, j, i_from_j: Pose2::new(1.0, 0.0, 0.0), information })?;
        structure.arrange();
        Ok(structure.clone())
    };
    let mut original_ms = 0.0;
    for _ in 0..COPIES {
        let structure = extend()?;
        let (done, ms) = timed(|| original.update_newest(&structure));
        done?;
        original_ms += ms;
    }
    let structure = extend()?;
    let mut kept = Vec::with_capacity(COPIES as usize);
    let (mut made_ms, mut step_ms) = (0.0, 0.0);
    let memory_before = memory_mb();
    for _ in 0..COPIES {
        let (mut copy, ms) = timed(|| original.clone());
        made_ms += ms;
        let (done, ms) = timed(|| copy.update_newest(&structure));
        done?;
        step_ms += ms;
        kept.push(copy);
    }
    let kept_mb = growth_mb(memory_before, memory_mb()).map(|mb| round(mb / f64::from(COPIES), 4));
    let mean_ms = |total_ms: f64| round(total_ms / f64::from(COPIES), 5);
    Ok(Copies { made_ms: mean_ms(made_ms), first_step_ms: mean_ms(made_ms + step_ms - original_ms), kept_mb })
}

/// A file to be written at the end.
struct Output {
    name: String,
    file: File,
}

impl Output {
    fn create(path: &Path) -> Result<Self, Failure> {
        let name = path.display().to_string();
        match File::create(path) {
            Ok(file) => Ok(Self { name, file }),
            Err(source) => Err(Failure::Write { file: name, source }),
        }
    }

    fn write(mut self, text: &str) -> Result<(), Failure> {
        self.file.write_all(text.as_bytes()).map_err(|source| Failure::Write { file: self.name, source })
    }
}

fn poses_text(poses: &[Pose2]) -> String {
    let mut text = String::new();
    for p in poses {
        let [x, y, yaw] = [p.x_m, p.y_m, p.yaw_rad].map(|v| general(v, 9));
        let _ = writeln!(text, "{x} {y} {yaw}");
    }
    text
}

fn steps_text(steps: &[Step]) -> String {
    let mut text = String::from("update_ms,pose_ms,eliminated,relinearised,factors\n");
    for s in steps {
        let (update, pose, work) = (general(s.update_ms, 5), general(s.pose_ms, 5), &s.work);
        let _ = writeln!(text, "{update},{pose},{},{},{}", work.eliminated, work.relinearised, work.factors);
    }
    text
}
