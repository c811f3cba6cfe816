//! `map`: a recorded log through the same core as the server's, as fast as it goes.

mod canvas;
pub mod image;
mod play;
mod progress;
mod report;
mod summary;
mod timing;
mod trajectory;

pub use canvas::Canvas;
pub use report::build;

use anyhow::{Context, Result, anyhow, bail};
use play::Played;
use progress::Progress;
use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};
use std::time::Instant;
use timing::{Stage, Timing};
use toponym::log::{self, Narration, Notes, Records};
use toponym_core::query::{GraphAnswer, WhereAnswer};
use toponym_core::{Answer, Config, Mapper, Pose2, Query};

/// Map a recorded log and answer questions about it.
#[derive(Clone, Debug, clap::Args)]
#[command(after_help = "Example:\n  toponym-server map tour.clf.gz --narration tour.jsonl \\\n    \
    --ask \"where is the kitchen\" --trajectory tour.txt --image tour.png")]
pub struct MapArgs {
    /// CARMEN log or a file that `serve --record` wrote, gzipped or not
    pub log: PathBuf,
    /// Sentences: one {"t": seconds, "text": "this is the gym"} a line
    #[arg(long, value_name = "FILE.jsonl")]
    pub narration: Option<PathBuf>,
    /// Particles
    #[arg(long, value_name = "N", conflicts_with = "start_map", value_parser = clap::value_parser!(u32).range(1..=10_000))]
    pub particles: Option<u32>,
    /// Seed of every random draw
    #[arg(long, value_name = "S", conflicts_with = "start_map")]
    pub seed: Option<u64>,
    /// Threads; the result does not depend on them [default: one per core]
    #[arg(long, value_name = "N")]
    pub threads: Option<usize>,
    /// Do not listen to sentences
    #[arg(long, conflicts_with = "start_map")]
    pub no_language: bool,
    /// Names propose no loop edges
    #[arg(long, conflicts_with = "start_map")]
    pub no_semantic_edges: bool,
    /// Ask the finished map; may be given many times
    #[arg(long, value_name = "QUESTION")]
    pub ask: Vec<String>,
    /// Write `t x y theta` for every odometry line of the log
    #[arg(long, value_name = "FILE")]
    pub trajectory: Option<PathBuf>,
    /// Write places, graphs, answers, sentences and timing
    #[arg(long, value_name = "FILE.json")]
    pub report: Option<PathBuf>,
    /// Write the map, to go on from with --start-map
    #[arg(long, value_name = "FILE")]
    pub save_map: Option<PathBuf>,
    /// Go on from a saved map; its settings come with it
    #[arg(long, value_name = "FILE")]
    pub start_map: Option<PathBuf>,
    /// Draw grid, trajectory, edges and names
    #[arg(long, value_name = "FILE.png")]
    pub image: Option<PathBuf>,
}

impl MapArgs {
    /// The files to write, by option.
    fn outputs(&self) -> [(&'static str, Option<&PathBuf>); 4] {
        [
            ("--trajectory", self.trajectory.as_ref()),
            ("--report", self.report.as_ref()),
            ("--save-map", self.save_map.as_ref()),
            ("--image", self.image.as_ref()),
        ]
    }
}

/// Runs `map`.
pub fn run(args: &MapArgs) -> Result<()> {
    check_outputs(args)?;
    let log = log::open(&args.log, &log::Options::default())?;
    let log = match &args.narration {
        Some(file) => log::merged(log, &Narration::read(file)?),
        None => log,
    };
    let mapper = match &args.start_map {
        Some(file) => load(file)?,
        None => Mapper::new(config(args)),
    };
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(args.threads.unwrap_or(0))
        .build()
        .context("--threads: the threads could not be started; give a smaller number")?;
    let finished = pool.install(|| play(log, mapper, args))?;
    finished.notes.warnings().iter().for_each(|w| eprintln!("warning: {w}"));
    finished.write(args)
}

fn config(args: &MapArgs) -> Config {
    let defaults = Config::default();
    Config {
        particles: args.particles.unwrap_or(defaults.particles),
        seed: args.seed.unwrap_or(defaults.seed),
        language: !args.no_language,
        semantic_edges: !args.no_semantic_edges,
        ..defaults
    }
}

/// A run may take minutes: a folder that is not there must not be found out afterwards.
fn check_outputs(args: &MapArgs) -> Result<()> {
    for (option, file) in args.outputs() {
        let Some(file) = file else { continue };
        let folder = file.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
        if !folder.is_dir() {
            bail!("{option} {}: there is no folder {}; make it first", file.display(), folder.display());
        }
        if file.is_dir() {
            bail!("{option} {}: this is a folder; give a file's name", file.display());
        }
    }
    Ok(())
}

fn load(file: &Path) -> Result<Mapper> {
    let bytes = std::fs::read(file).with_context(|| format!("--start-map {}", file.display()))?;
    Mapper::load(&bytes)
        .with_context(|| format!("--start-map {}: give a file that --save-map wrote", file.display()))
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
    progress.finish();
    let answers = args.ask.iter().filter_map(|text| ask(&mut played, text)).collect();
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
        utterance: spread(Stage::Utterance),
        answer: spread(Stage::Answer),
        peak_mb: timing::peak_mb(),
    };
    let (notes, robot) = (log.notes().clone(), robot.unwrap_or_default());
    Ok(Finished { played, saved, graph, trajectory, answers, notes, robot, timing })
}

fn ask(played: &mut Played, text: &str) -> Option<WhereAnswer> {
    let began = Instant::now();
    let answer = played.mapper.answer(&Query::Where { text: text.into() });
    played.stopwatch.add(Stage::Answer, began.elapsed());
    match answer {
        Answer::Where(answer) => Some(answer),
        _ => None,
    }
}

impl Finished {
    fn write(self, args: &MapArgs) -> Result<()> {
        if let Some(file) = &args.trajectory {
            let text = trajectory::text(&self.played.row_stamps, &self.trajectory);
            std::fs::write(file, text).with_context(|| format!("--trajectory {}", file.display()))?;
        }
        if let (Some(file), Some(bytes)) = (&args.save_map, &self.saved) {
            std::fs::write(file, bytes).with_context(|| format!("--save-map {}", file.display()))?;
        }
        if let Some(file) = &args.image {
            draw(&self.played.mapper, &self.trajectory, file)
                .with_context(|| format!("--image {}", file.display()))?;
        }
        print!("{}", summary::text(args, &self));
        let Some(file) = &args.report else { return Ok(()) };
        let Self { played, graph, answers, notes, robot, timing, .. } = self;
        let report = report::report(&played, &graph, answers, &notes, &robot, timing);
        write_json(&report, file).with_context(|| format!("--report {}", file.display()))
    }
}

fn write_json(report: &report::Report, file: &Path) -> Result<()> {
    let mut out = BufWriter::new(File::create(file)?);
    serde_json::to_writer_pretty(&mut out, report)?;
    out.write_all(b"\n")?;
    Ok(out.flush()?)
}

/// Draws a mapper's map into a PNG.
fn draw(mapper: &Mapper, trajectory: &[Pose2], file: &Path) -> Result<()> {
    let snapshot = mapper.snapshot();
    let graph = snapshot.graph();
    let poses = || trajectory.iter().chain(graph.places.iter().map(|p| &p.pose));
    let span = |f: fn(&Pose2) -> f64| {
        let (low, high) =
            poses().map(f).fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| (a.min(v), b.max(v)));
        (high - low).max(0.0)
    };
    let extent_m = span(|p| p.x_m).max(span(|p| p.y_m));
    let query = Query::Grid { resolution_m: image::resolution_m(extent_m) };
    let Answer::Grid(grid) = snapshot.answer(&query) else { bail!("the map has no grid to draw") };
    let mut out = BufWriter::new(File::create(file)?);
    image::draw(&grid, &graph, trajectory).write_png(&mut out)?;
    Ok(out.flush()?)
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::Parser;
    use serde_json::Value;
    use toponym::sim::{Scenario, write::write_folder};

    #[derive(Parser)]
    struct Cli {
        #[command(flatten)]
        map: MapArgs,
    }

    /// A folder with a short simulated log, gone at the end of the test.
    struct Folder(PathBuf);

    impl Folder {
        fn new(name: &str) -> Self {
            let folder = std::env::temp_dir().join(format!("toponym-map-{name}-{}", std::process::id()));
            let mut scenario = Scenario::demo(1);
            scenario.tour.truncate(3);
            write_folder(&scenario.run().unwrap(), &folder).unwrap();
            Self(folder)
        }

        fn map(&self, options: &[&str]) -> Result<()> {
            let path = |name: &str| self.0.join(name).display().to_string();
            let here = |o: &&str| o.strip_prefix('@').map_or((*o).to_owned(), path);
            let all = ["map", "@sim.clf", "--narration", "@narration.jsonl"];
            let cli = Cli::try_parse_from(all.iter().chain(options).map(here)).map_err(|e| anyhow!("{e}"))?;
            run(&cli.map)
        }

        fn error(&self, options: &[&str]) -> String {
            format!("{:#}", self.map(options).unwrap_err())
        }

        fn report(&self, name: &str) -> Value {
            let text = std::fs::read_to_string(self.0.join(name)).unwrap();
            serde_json::from_str(&text).unwrap()
        }
    }

    impl Drop for Folder {
        fn drop(&mut self) {
            std::fs::remove_dir_all(&self.0).unwrap();
        }
    }

    #[test]
    fn the_report_does_not_depend_on_the_threads_but_on_the_seed() {
        let folder = Folder::new("threads");
        for (seed, threads, file) in [("4", "1", "@a"), ("4", "2", "@b"), ("5", "2", "@c")] {
            let ask = ["--ask", "where is the gym", "--report", file, "--seed", seed, "--threads", threads];
            folder.map(&ask).unwrap();
        }
        let [a, b, c] = ["a", "b", "c"].map(|name| {
            let mut report = folder.report(name);
            assert!(report["timing"]["wall_s"].as_f64() > Some(0.0));
            report["timing"].take();
            report.to_string()
        });
        assert_eq!(a, b);
        assert_ne!(a, c);
    }

    #[test]
    fn the_report_has_what_it_should() {
        let folder = Folder::new("report");
        let files = ["--report", "@r.json", "--trajectory", "@t.txt", "--image", "@m.png"];
        folder.map(&[&files[..], &["--ask", "where is the gym"]].concat()).unwrap();
        let report = folder.report("r.json");
        let weights = report["particles"].as_array().unwrap().iter().map(|p| p["weight"].as_f64().unwrap());
        assert!((weights.sum::<f64>() - 1.0).abs() < 1e-9);
        let answer = &report["answers"][0];
        let mass =
            answer["candidates"].as_array().unwrap().iter().map(|c| c["probability"].as_f64().unwrap());
        assert!((mass.sum::<f64>() + answer["p_none"].as_f64().unwrap() - 1.0).abs() < 1e-9);
        assert_eq!(answer["question"], "where is the gym");
        let said = std::fs::read_to_string(folder.0.join("narration.jsonl")).unwrap().lines().count();
        assert_eq!(report["utterances"].as_array().unwrap().len(), said);
        assert!(report["places"].as_array().unwrap().iter().all(|p| p["labels"].is_object()));
        // Every odometry line has its row, in order, with its own stamp.
        let log = std::fs::read_to_string(folder.0.join("sim.clf")).unwrap();
        let odometry = log.lines().filter(|l| l.starts_with("ODOM"));
        let stamps: Vec<&str> = odometry.filter_map(|l| l.split(' ').nth(7)).collect();
        let rows = std::fs::read_to_string(folder.0.join("t.txt")).unwrap();
        let told: Vec<&str> = rows.lines().filter_map(|l| l.split(' ').next()).collect();
        assert_eq!(told, stamps);
        assert!(std::fs::read(folder.0.join("m.png")).unwrap().starts_with(b"\x89PNG"));
    }

    #[test]
    fn a_saved_map_goes_on() {
        let folder = Folder::new("saved");
        folder.map(&["--save-map", "@m.bin", "--report", "@1.json"]).unwrap();
        folder.map(&["--start-map", "@m.bin", "--report", "@2.json"]).unwrap();
        let places = |name| folder.report(name)["places"].as_array().unwrap().len();
        assert!(places("2.json") > places("1.json"));
        assert!(folder.error(&["--start-map", "@m.bin", "--seed", "3"]).contains("--start-map"));
        assert!(folder.error(&["--start-map", "@sim.clf"]).contains("give a file that --save-map wrote"));
        assert!(folder.error(&["--start-map", "@none"]).contains("--start-map"));
    }

    #[test]
    fn two_halves_are_the_whole() {
        let folder = Folder::new("halves");
        // No sentences: those of one half would be out of place in the other.
        std::fs::write(folder.0.join("narration.jsonl"), "").unwrap();
        folder.map(&["--report", "@whole.json"]).unwrap();
        let log = std::fs::read_to_string(folder.0.join("sim.clf")).unwrap();
        let head: Vec<&str> = log.lines().filter(|l| l.starts_with(['#', 'P'])).collect();
        let body: Vec<&str> = log.lines().filter(|l| !l.starts_with(['#', 'P'])).collect();
        let write = |name: &str, part: &[&str]| {
            let lines = [head.as_slice(), part].concat().join("\n") + "\n";
            std::fs::write(folder.0.join(name), lines).unwrap();
        };
        write("sim.clf", &body[..body.len() / 2]);
        folder.map(&["--save-map", "@half.bin"]).unwrap();
        write("sim.clf", &body[body.len() / 2..]);
        folder.map(&["--start-map", "@half.bin", "--report", "@halves.json"]).unwrap();
        for part in ["places", "particles"] {
            assert_eq!(folder.report("whole.json")[part], folder.report("halves.json")[part], "{part}");
        }
    }

    #[test]
    fn errors_come_before_the_work_and_name_option_and_file() {
        let folder = Folder::new("errors");
        let error = folder.error(&["--report", "@nowhere/r.json"]);
        assert!(error.contains("--report") && error.contains("nowhere") && error.contains("make it first"));
        assert!(folder.error(&["--image", "@."]).contains("give a file's name"));
        assert!(folder.error(&["--particles", "0"]).contains("--particles"));
        std::fs::write(folder.0.join("narration.jsonl"), "{\"t\": 1}\n").unwrap();
        assert!(folder.error(&[]).contains("narration.jsonl:1"));
    }

    #[test]
    fn who_does_not_listen_learns_no_names() {
        let folder = Folder::new("deaf");
        folder.map(&["--no-language", "--report", "@r.json"]).unwrap();
        let report = folder.report("r.json");
        assert!(report["places"].as_array().unwrap().iter().all(|p| p["labels"] == serde_json::json!({})));
        assert_eq!(report["run"]["config"]["language"], false);
    }
}
