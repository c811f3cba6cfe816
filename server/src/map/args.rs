//! Options of `map`.

use super::trajectory::Format;
use crate::picture;
use anyhow::{Context, Result, bail};
use clap::ValueEnum as _;
use std::fmt;
use std::path::{Path, PathBuf};
use toponym_core::config::Rules;
use toponym_core::trial::{ForcedLoop, Trial};
use toponym_core::{Config, Pose2};

/// Rules by which sentences are taken in.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, clap::ValueEnum)]
pub enum Preset {
    /// All that is understood, grounded again as the map grows
    #[default]
    Toponym,
    /// Sentences as in the paper: names and plain relations, grounded once by σ(−d / 30 m); all else as ever
    PaperGrounding,
    /// The paper's baseline: names are noted, but propose no edges and weigh nothing
    PaperNoLanguage,
}

/// Map a recorded log and answer questions about it.
#[derive(Clone, Debug, clap::Args)]
#[command(after_help = "Example:\n  toponym-server map tour.clf.gz --narration tour.jsonl \\\n    \
    --ask \"where is the kitchen\" --trajectory tour.txt --image tour.png")]
pub struct MapArgs {
    /// CARMEN log, table of t, x, y, yaw and ranges, or a file that `serve --record` wrote, gzipped or not; or a ROS 2
    /// bag: its folder, an .mcap or a .db3
    pub log: PathBuf,
    /// Scans, one line of t and ranges each: LOG is a trajectory, lines of t, x, y, yaw or of TUM's
    #[arg(long, value_name = "FILE")]
    pub scans: Option<PathBuf>,
    /// Of a bag take these topics alone, and transforms: lasers, odometry where no transform tells it, and texts that
    /// people said; without, what is there tells which they are
    #[arg(long, value_name = "TOPIC,…", value_delimiter = ',')]
    pub topics: Vec<String>,
    /// Sentences: one {"t": seconds, "text": "this is the gym"} a line
    #[arg(long, value_name = "FILE.jsonl")]
    pub narration: Option<PathBuf>,
    /// Words and names of the site, as `serve --lexicon` takes them
    #[arg(long, value_name = "FILE")]
    pub lexicon: Option<PathBuf>,
    /// Particles
    #[arg(long, value_name = "N", conflicts_with = "start_map", value_parser = clap::value_parser!(u32).range(1..=10_000))]
    pub particles: Option<u32>,
    /// Seed of every random draw
    #[arg(long, value_name = "S", conflicts_with = "start_map")]
    pub seed: Option<u64>,
    /// Threads; the result does not depend on them [default: one per core]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=256))]
    pub threads: Option<u16>,
    /// Do not listen to sentences
    #[arg(long, conflicts_with = "start_map")]
    pub no_language: bool,
    /// Whose rules sentences are taken in by
    #[arg(long, value_name = "RULES", value_enum, default_value_t, conflicts_with = "start_map")]
    pub preset: Preset,
    /// Names propose no loop edges
    #[arg(long, conflicts_with = "start_map")]
    pub no_semantic_edges: bool,
    /// Look at no older places: the front end alone, which drifts
    #[arg(long, conflicts_with = "start_map")]
    pub no_loops: bool,
    /// Replace this share of the matched loop transforms by random ones, to see the map survive it
    #[arg(long, value_name = "FRACTION", conflicts_with = "start_map", value_parser = share)]
    pub inject_loops: Option<f64>,
    /// Put a loop edge into every graph, to see it undone: newer place, older place, and where the newer lies
    /// from there in metres and degrees; may be given many times
    #[arg(long, value_name = "J,I,X,Y,DEGREES", conflicts_with = "start_map", value_parser = forced, allow_hyphen_values = true)]
    pub force_loop: Vec<ForcedLoop>,
    /// Ask the finished map; may be given many times
    #[arg(long, value_name = "QUESTION")]
    pub ask: Vec<String>,
    /// Write the robot's pose at every odometry line of the log
    #[arg(long, value_name = "FILE")]
    pub trajectory: Option<PathBuf>,
    /// How --trajectory is written
    #[arg(long, value_name = "FORMAT", value_enum, default_value_t)]
    pub trajectory_format: Format,
    /// Write a line of JSON per place: what was proposed, edges taken and refused and why, weights
    #[arg(long, value_name = "FILE.jsonl")]
    pub history: Option<PathBuf>,
    /// Write places, graphs, answers, sentences and timing
    #[arg(long, value_name = "FILE.json")]
    pub report: Option<PathBuf>,
    /// Write the map, to go on from with --start-map
    #[arg(long, value_name = "FILE")]
    pub save_map: Option<PathBuf>,
    /// Go on from a saved map; its settings come with it
    #[arg(long, value_name = "FILE")]
    pub start_map: Option<PathBuf>,
    /// Write rooms: outlines, doorways, names
    #[arg(long, value_name = "FILE.json")]
    pub regions: Option<PathBuf>,
    /// Draw rooms, trajectory, edges and names, as PNG or SVG by the name's end
    #[arg(long, value_name = "FILE")]
    pub image: Option<PathBuf>,
}

impl MapArgs {
    /// The files to write, by option.
    pub fn outputs(&self) -> [(&'static str, Option<&PathBuf>); 6] {
        [
            ("--trajectory", self.trajectory.as_ref()),
            ("--history", self.history.as_ref()),
            ("--report", self.report.as_ref()),
            ("--save-map", self.save_map.as_ref()),
            ("--regions", self.regions.as_ref()),
            ("--image", self.image.as_ref()),
        ]
    }

    /// The mapper's settings.
    pub fn config(&self) -> Config {
        let defaults = Config::default();
        self.preset.config(Config {
            particles: self.particles.unwrap_or(defaults.particles),
            seed: self.seed.unwrap_or(defaults.seed),
            language: !self.no_language,
            semantic_edges: !self.no_semantic_edges,
            loops: !self.no_loops,
            ..defaults
        })
    }

    /// What is spoilt on purpose.
    pub fn trial(&self) -> Trial {
        Trial {
            inject_loops: self.inject_loops.unwrap_or(0.0),
            seed: self.config().seed,
            force_loops: self.force_loop.clone(),
        }
    }

    /// A run may take minutes: a folder that is not there must not be found out afterwards.
    pub fn check(&self) -> Result<()> {
        for (option, file) in self.outputs() {
            let Some(file) = file else { continue };
            let folder = file.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
            if !folder.is_dir() {
                bail!("{option} {}: there is no folder {}; make it first", file.display(), folder.display());
            }
            if file.is_dir() {
                bail!("{option} {}: this is a folder; give a file's name", file.display());
            }
        }
        self.image.as_deref().map(picture::form).transpose().context("--image")?;
        Ok(())
    }
}

impl fmt::Display for Preset {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.to_possible_value().map_or(Ok(()), |value| f.write_str(value.get_name()))
    }
}

impl Preset {
    /// These settings with sentences taken in so.
    #[must_use]
    pub fn config(self, config: Config) -> Config {
        match self {
            Self::Toponym => config,
            Self::PaperGrounding => Config { rules: Rules::Paper, ..config },
            Self::PaperNoLanguage => Config { rules: Rules::Paper, semantic_edges: false, ..config },
        }
    }
}

/// A loop edge: "120,3,0.5,-2,90".
fn forced(text: &str) -> Result<ForcedLoop, String> {
    let wrong = || "give newer place, older place, x, y and degrees, as 120,3,0.5,-2,90".to_owned();
    let parts: Vec<&str> = text.split(',').map(str::trim).collect();
    let &[j, i, x, y, degrees] = parts.as_slice() else { return Err(wrong()) };
    let place = |text: &str| text.parse::<u32>().map_err(|_| wrong());
    let number = |text: &str| text.parse().ok().filter(|v: &f64| v.is_finite()).ok_or_else(wrong);
    let (i, j) = (place(i)?, place(j)?);
    if i >= j {
        return Err(format!("place {i} is not older than place {j}: give the newer one first"));
    }
    Ok(ForcedLoop { i, j, i_from_j: Pose2::new(number(x)?, number(y)?, number(degrees)?.to_radians()) })
}

/// A number from 0 to 1.
fn share(text: &str) -> Result<f64, String> {
    text.parse().ok().filter(|s| (0.0..=1.0).contains(s)).ok_or_else(|| "give a share from 0 to 1".into())
}
