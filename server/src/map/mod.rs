//! `map`: a recorded log through the same core as the server's, as fast as it goes.

mod args;
mod history;
mod play;
mod progress;
mod report;
mod saved;
mod summary;
mod timing;
mod trajectory;

pub use args::{MapArgs, Preset};
pub use report::build;
pub use saved::{AskArgs, ShowArgs, ask, show};

use crate::config::words_of;
use crate::convert::regions_reply;
use crate::fold::{Fold, saved_map};
use crate::picture::{self, Drawn, Sketch};
use anyhow::{Context, Result, anyhow};
use history::History;
use play::Played;
use progress::Progress;
use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::Path;
use std::time::Instant;
use timing::{Stage, Timing};
use toponym::log::{self, Narration, Notes, Records};
use toponym_core::answers::query::{GraphAnswer, WhereAnswer};
use toponym_core::{Answer, Event, Mapper, Pose2, Query, Snapshot};
use toponym_journal::{Checkpoint, Folder, Journal, Opened};
use toponym_proto::answer::MapIdentity;

/// Runs `map`.
pub fn run(args: &MapArgs) -> Result<()> {
    args.check()?;
    let log = match &args.scans {
        Some(scans) => log::with_scans(&args.log, scans, &log::Options::default())?,
        None => toponym_ros::log::open(&args.log, &log::Options::default(), &args.topics)?,
    };
    let log = match &args.narration {
        Some(file) => log::merged(log, &Narration::read(file)?),
        None => log,
    };
    let mut mapper = match &args.start_map {
        Some(file) => load(file).context("--start-map")?,
        None => Mapper::on_trial(args.config(), args.trial()),
    };
    if let Some(file) = &args.lexicon {
        mapper.step(Event::Glossary(words_of(file)?));
    }
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(args.threads.unwrap_or(0).into())
        .build()
        .context("--threads: the threads could not be started; give a smaller number")?;
    let finished = pool.install(|| play(log, mapper, args))?;
    finished.notes.warnings().iter().for_each(|w| eprintln!("warning: {w}"));
    finished.played.suspicions.iter().for_each(|(_, _, why)| eprintln!("warning: {why}"));
    let checked = finished.notes.check();
    finished.write(args)?;
    Ok(checked?)
}

/// A saved map: as a file, as a server's checkpoint, or as the folder of a map in a server's data folder, which is
/// left as it is.
pub fn load(file: &Path) -> Result<Mapper> {
    if file.is_dir() {
        let Opened { checkpoint, tail, .. } =
            Journal::open(Folder(file.into())).with_context(|| file.display().to_string())?;
        let mut fold = Fold::load(&checkpoint.map).with_context(|| file.display().to_string())?;
        for (_, entry) in tail {
            fold.take(entry, &mut |_| {});
        }
        return Ok(fold.mapper);
    }
    let bytes = std::fs::read(file).with_context(|| file.display().to_string())?;
    let name = file.file_name().unwrap_or_default().to_string_lossy();
    let map = if Checkpoint::is_one(&bytes) {
        let checkpoint = Checkpoint::read(&name, &bytes)?;
        saved_map(&checkpoint.map).unwrap_or_default().to_vec()
    } else {
        bytes
    };
    Mapper::load(&map).with_context(|| {
        format!(
            "{}: give a file that --save-map wrote, a server's checkpoint, or a map's folder in its data folder",
            file.display()
        )
    })
}

/// A log that was played to its end.
struct Finished {
    played: Played,
    /// The map as it was when the log ended, for --save-map.
    saved: Option<Vec<u8>>,
    graph: GraphAnswer,
    trajectory: Vec<Pose2>,
    answers: Vec<WhereAnswer>,
    notes: Notes,
    robot: String,
    timing: Timing,
}

fn play(mut log: Box<dyn Records>, mapper: Mapper, args: &MapArgs) -> Result<Finished> {
    let began = Instant::now();
    let mut played = Played::new(mapper);
    played.history = args.history.as_deref().map(History::create).transpose()?;
    let mut progress = Progress::new(log.progress().1);
    let mut robot = None;
    while let Some(record) = log.next() {
        robot = robot.or_else(|| record.message.header().map(|h| h.robot.clone()));
        let line = record.line;
        played.feed(record).map_err(|e| anyhow!("{}:{line}: {e}", log.notes().file.display()))?;
        progress.show(log.progress().0, played.log_s(), &played.mapper);
    }
    // Saved before the flush: what goes on from it equals a run without a pause.
    let saved = args.save_map.as_ref().map(|_| played.mapper.save()).transpose().context("--save-map")?;
    played.flush();
    played.history.take().map_or(Ok(()), History::finish)?;
    progress.finish();
    let answers = args.ask.iter().filter_map(|text| asked(&mut played, text)).collect();
    let graph = played.mapper.snapshot().graph();
    let trajectory = played.trajectory(&graph);
    let wall_s = began.elapsed().as_secs_f64();
    let spread = |stage| played.stopwatch.spread(stage);
    let timing = Timing {
        wall_s,
        cpu_s: timing::cpu_s(),
        log_s: played.log_s(),
        speed: played.log_s() / wall_s,
        threads: rayon::current_num_threads(),
        scan: spread(Stage::Scan),
        place: spread(Stage::Place),
        place_growth: played.stopwatch.growth(Stage::Place),
        utterance: spread(Stage::Utterance),
        answer: spread(Stage::Answer),
        peak_mb: timing::peak_mb(),
    };
    let (notes, robot) = (log.notes().clone(), robot.unwrap_or_default());
    Ok(Finished { played, saved, graph, trajectory, answers, notes, robot, timing })
}

fn asked(played: &mut Played, text: &str) -> Option<WhereAnswer> {
    let began = Instant::now();
    let answer = played.mapper.answer(&Query::Where { text: text.into(), lang: None });
    played.stopwatch.add(Stage::Answer, began.elapsed());
    match answer {
        Answer::Where(answer) => Some(answer),
        _ => None,
    }
}

impl Finished {
    fn write(self, args: &MapArgs) -> Result<()> {
        if let Some(file) = &args.trajectory {
            let text = trajectory::text(args.trajectory_format, &self.played.row_stamps, &self.trajectory);
            std::fs::write(file, text).with_context(|| format!("--trajectory {}", file.display()))?;
        }
        if let (Some(file), Some(bytes)) = (&args.save_map, &self.saved) {
            std::fs::write(file, bytes).with_context(|| format!("--save-map {}", file.display()))?;
        }
        if let Some(file) = &args.regions {
            let reply = regions_reply(&self.played.mapper.snapshot(), MapIdentity::default());
            write_json(&reply.regions, file).with_context(|| format!("--regions {}", file.display()))?;
        }
        if let Some(file) = &args.image {
            let title = args.log.display().to_string();
            drawn(&self.played.mapper.snapshot(), &self.trajectory).write(file, &title).context("--image")?;
        }
        said(std::io::stdout().write_all(summary::text(args, &self).as_bytes()))?;
        let Some(file) = &args.report else { return Ok(()) };
        let Self { played, graph, answers, notes, robot, timing, .. } = self;
        let report = report::report(&played, &graph, answers, &notes, &robot, timing);
        write_json(&report, file).with_context(|| format!("--report {}", file.display()))
    }
}

/// Whoever closes the pipe has read enough.
fn said(written: std::io::Result<()>) -> Result<()> {
    match written {
        Err(e) if e.kind() == std::io::ErrorKind::BrokenPipe => Ok(()),
        other => other.context("the summary could not be written"),
    }
}

fn write_json<T: serde::Serialize>(value: &T, file: &Path) -> Result<()> {
    let mut out = BufWriter::new(File::create(file)?);
    serde_json::to_writer_pretty(&mut out, value)?;
    out.write_all(b"\n")?;
    Ok(out.flush()?)
}

/// The picture of a map.
fn drawn(snapshot: &Snapshot, trajectory: &[Pose2]) -> Sketch {
    let graph = snapshot.graph();
    let poses = || trajectory.iter().chain(graph.places.iter().map(|p| &p.pose));
    let span = |f: fn(&Pose2) -> f64| {
        let (low, high) =
            poses().map(f).fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| (a.min(v), b.max(v)));
        (high - low).max(0.0)
    };
    let extent_m = span(|p| p.x_m).max(span(|p| p.y_m));
    let grid = snapshot.grid(picture::resolution_m(extent_m));
    let regions = regions_reply(snapshot, MapIdentity::default()).regions;
    let robot = snapshot.robot();
    picture::draw(&Drawn { grid: &grid, graph: &graph, trajectory, regions: &regions, robot })
}

#[cfg(test)]
mod tests;
