//! `export`: a map in the forms of others.
//!
//! ```text
//! Snapshot ─┬─ nav2 ──▶ map.yaml, map.pgm        what Nav2's map server loads
//!           ├─ masks ─▶ keepout_mask, speed_mask  for Nav2's costmap filters; .yaml and .pgm
//!           ├─ route ─▶ route.geojson            what Nav2's route server plans on
//!           ├─ rooms ─▶ rooms.geojson            outlines, doorways, names; metres
//!           ├─ mcap ──▶ map.mcap                 ROS messages, for Foxglove, rerun and `ros2 bag play`
//!           ├─ g2o ───▶ graph.g2o                what pose graph smoothers read
//!           └─ json ──▶ map.json, map.schema.json   rooms, names, sentences
//! ```

mod g2o;
mod json;
mod masks;
mod mcap;
mod nav2;
mod rooms;
mod route;
#[cfg(test)]
mod tests;

use crate::map::load;
use anyhow::{Context, Result, bail};
use std::path::{Path, PathBuf};
use toponym_core::Snapshot;

/// Write a saved map in the forms that others read
#[derive(Clone, Debug, clap::Args)]
#[command(
    after_help = "MAP is a file that `map --save-map` wrote, a server's checkpoint, or a map's folder in a \
    server's data folder. Without any of --nav2 … --json all are written.\n\nExamples:\n  \
    toponym-server export tour.map out\n  toponym-server export toponym-data/main out --nav2 --route-graph\n  toponym-server export tour.map out \
    --nav2 --masks --keep-out lab --slow hallway=50"
)]
#[allow(clippy::struct_excessive_bools, reason = "one for each form")]
pub struct ExportArgs {
    /// A saved map
    map: PathBuf,
    /// Folder to write to; made if it isn't there
    folder: PathBuf,
    /// map.yaml and map.pgm, for Nav2's map server and slam_toolbox's users
    #[arg(long)]
    nav2: bool,
    /// keepout_mask.yaml and .pgm, for Nav2's costmap filters: areas drawn as forbidden, and those of --keep-out
    #[arg(long)]
    masks: bool,
    /// Robots keep out of the rooms of this name, in the masks
    #[arg(long, value_name = "NAME", requires = "masks")]
    keep_out: Vec<String>,
    /// Robots go at this share of their speed in the rooms of a name, percent: speed_mask.yaml and .pgm
    #[arg(long, value_name = "NAME=PERCENT", value_parser = masks::slow, requires = "masks")]
    slow: Vec<masks::Slow>,
    /// route.geojson, for Nav2's route server: places and doorways with names, ways that were driven
    #[arg(long)]
    route_graph: bool,
    /// rooms.geojson: outlines and doorways, in metres of the map
    #[arg(long)]
    geojson: bool,
    /// graph.g2o: poses and the best graph's transforms, for pose graph smoothers
    #[arg(long)]
    g2o: bool,
    /// map.mcap: map, markers, the way, what was seen and said, as ROS messages for Foxglove, rerun and `ros2 bag play`
    #[arg(long)]
    mcap: bool,
    /// map.json, with its JSON Schema beside it: rooms, names, sentences
    #[arg(long)]
    json: bool,
    /// Edge of a cell of map.pgm and map.mcap, metres
    #[arg(long, value_name = "M", default_value_t = 0.05, value_parser = resolution)]
    resolution_m: f64,
}

fn resolution(text: &str) -> Result<f64, String> {
    let wrong = || "give metres from 0.02 to 1".to_owned();
    text.parse().ok().filter(|m| (0.02..=1.0).contains(m)).ok_or_else(wrong)
}

/// A file's name and content.
type Content = (&'static str, Vec<u8>);

/// Runs `export`.
pub fn run(args: &ExportArgs) -> Result<()> {
    let snapshot = load(&args.map)?.snapshot();
    if snapshot.is_empty() {
        bail!("{}: the map has no place yet: there is nothing to write", args.map.display());
    }
    std::fs::create_dir_all(&args.folder).with_context(|| args.folder.display().to_string())?;
    for (name, content) in files(args, &snapshot)? {
        let file = args.folder.join(name);
        write(&file, &content)?;
        println!("{}", file.display());
    }
    Ok(())
}

/// A file is there whole or not at all.
fn write(file: &Path, content: &[u8]) -> Result<()> {
    let beside = file.with_extension("part");
    let written = std::fs::write(&beside, content).and_then(|()| std::fs::rename(&beside, file));
    written.with_context(|| file.display().to_string())
}

fn files(args: &ExportArgs, snapshot: &Snapshot) -> Result<Vec<Content>> {
    let all =
        !(args.nav2 || args.masks || args.route_graph || args.geojson || args.g2o || args.mcap || args.json);
    let mut files = Vec::new();
    if args.nav2 || all {
        files.extend(nav2::files(&snapshot.grid(args.resolution_m)));
    }
    if args.masks || all && snapshot.areas().iter().any(|area| area.forbidden) {
        files.extend(masks::files(snapshot, &snapshot.grid(args.resolution_m), &args.keep_out, &args.slow)?);
    }
    if args.route_graph || all {
        files.push(("route.geojson", serde_json::to_vec_pretty(&route::graph(snapshot))?));
    }
    if args.geojson || all {
        files.push(("rooms.geojson", serde_json::to_vec_pretty(&rooms::collection(snapshot))?));
    }
    if args.g2o || all {
        files.push(("graph.g2o", g2o::text(snapshot).into_bytes()));
    }
    if args.mcap || all {
        files.push(("map.mcap", mcap::file(snapshot, args.resolution_m)?));
    }
    if args.json || all {
        files.push(("map.json", serde_json::to_vec_pretty(&json::map(snapshot))?));
        files.push(("map.schema.json", serde_json::to_vec_pretty(&json::schema())?));
    }
    Ok(files)
}
