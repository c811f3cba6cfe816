//! `show` and `ask`: a saved map without the log that it was made of.

use super::summary::{dropped, edges, told};
use super::{drawn, load, report, said, write_json};
use crate::convert::regions_reply;
use crate::picture;
use anyhow::{Context, Result};
use std::fmt::Write as _;
use std::io::Write as _;
use std::path::{Path, PathBuf};
use toponym_core::answers::differences::sentence;
use toponym_core::answers::query::WhereAnswer;
use toponym_core::{Answer, Pose2, Query, Snapshot};
use toponym_proto::answer::MapIdentity;

/// Less likely names are not told in text.
const CALLED_MIN: f64 = 0.3;

/// Look at saved maps
#[derive(Clone, Debug, clap::Args)]
#[command(
    after_help = "MAP is a file that `map --save-map` wrote, a server's checkpoint, or a map's folder in a \
    server's data folder.\n\nExamples:\n  toponym-server show tour.map --image tour.svg\n  \
    toponym-server show toponym-data/main toponym-data/floor2"
)]
pub struct ShowArgs {
    /// Saved maps
    #[arg(required = true, value_name = "MAP")]
    maps: Vec<PathBuf>,
    /// Draw it, as PNG or SVG by the name's end; of one map
    #[arg(long, value_name = "FILE")]
    image: Option<PathBuf>,
    /// Write rooms: outlines, doorways, names; of one map
    #[arg(long, value_name = "FILE.json")]
    regions: Option<PathBuf>,
}

/// Ask a saved map where things are
#[derive(Clone, Debug, clap::Args)]
#[command(
    after_help = "Examples:\n  toponym-server ask tour.map kitchen \"where is the nearest restroom\"\n  \
    toponym-server ask toponym-data/main Küche --lang de --json\n\nExit code 1 if one of them is rather nowhere in \
    the map."
)]
pub struct AskArgs {
    /// A file that `map --save-map` wrote, a server's checkpoint, or a map's folder in a server's data folder
    map: PathBuf,
    /// Names, or whole questions
    #[arg(required = true, value_name = "QUESTION")]
    questions: Vec<String>,
    /// In which language (en, de)
    #[arg(long, value_name = "TAG")]
    lang: Option<String>,
    /// Print answers as in a report of `map`
    #[arg(long)]
    json: bool,
}

/// Runs `show`.
pub fn show(args: &ShowArgs) -> Result<()> {
    if args.maps.len() > 1 && (args.image.is_some() || args.regions.is_some()) {
        anyhow::bail!("--image and --regions are of one map: give one, or run it for each");
    }
    if let Some(file) = &args.image {
        picture::form(file).context("--image")?;
    }
    for file in &args.maps {
        let mapper = load(file)?;
        let snapshot = mapper.snapshot();
        said(std::io::stdout().write_all(words(file, &snapshot).as_bytes()))?;
        if let Some(file) = &args.regions {
            let rooms = regions_reply(&snapshot, MapIdentity::default()).regions;
            write_json(&rooms, file).with_context(|| format!("--regions {}", file.display()))?;
        }
        if let Some(file) = &args.image {
            // Where it drove between its places nobody kept.
            let track: Vec<Pose2> = snapshot.places().iter().map(|p| p.pose).collect();
            drawn(&snapshot, &track).write(file, "map").context("--image")?;
        }
    }
    Ok(())
}

/// Runs `ask`; whether all that was asked for is rather somewhere than nowhere.
pub fn ask(args: &AskArgs) -> Result<bool> {
    let mapper = load(&args.map)?;
    let answer =
        |text: &String| match mapper.answer(&Query::Where { text: text.clone(), lang: args.lang.clone() }) {
            Answer::Where(answer) => Some(answer),
            _ => None,
        };
    let answers: Vec<WhereAnswer> = args.questions.iter().filter_map(answer).collect();
    let all_found = answers.iter().all(is_found);
    let text = if args.json {
        let answers: Vec<_> = answers.into_iter().map(|a| report::answer(a, "")).collect();
        serde_json::to_string_pretty(&answers)? + "\n"
    } else {
        answers.iter().map(told).collect()
    };
    said(std::io::stdout().write_all(text.as_bytes()))?;
    Ok(all_found)
}

/// Whether it is rather somewhere than nowhere.
fn is_found(answer: &WhereAnswer) -> bool {
    answer.candidates.first().is_some_and(|c| c.probability >= answer.p_none)
}

fn words(file: &Path, snapshot: &Snapshot) -> String {
    let graph = snapshot.graph();
    let mut text = format!("{}: ", file.display());
    let best = graph.particles.first();
    // Writing to a string cannot fail.
    let _ = writeln!(
        text,
        "{} places; loop edges: {}; best of {} graphs, weight {:.2}{}",
        graph.places.len(),
        edges(&graph),
        graph.particles.len(),
        best.map_or(0.0, |p| p.weight),
        dropped(graph.unresolved),
    );
    if let Some(ways) = sentence(&graph.differences) {
        let _ = writeln!(text, "{:<10} {ways}", "open");
    }
    for room in regions_reply(snapshot, MapIdentity::default()).regions {
        let likely = room.names.iter().filter(|n| n.p >= CALLED_MIN);
        let names: Vec<String> = likely.map(|n| format!("{} ({:.2})", n.label, n.p)).collect();
        if !names.is_empty() {
            let _ = writeln!(text, "{:<10} {:6.1} m²  {}", room.kind, room.area_m2, names.join(", "));
        }
    }
    text
}
