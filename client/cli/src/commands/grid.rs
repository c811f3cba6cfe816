//! `toponym grid`.

use super::{Failure, exit};
use std::io::Write as _;
use std::path::PathBuf;
use std::time::Duration;
use toponym::{ClientError, Connection, Planner};
use toponym_proto::Invalid;

/// Arguments of `grid`.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  toponym grid map.png
  toponym grid coarse.png --resolution-m 0.2 --map floor2

White is free, black is occupied, what is unknown is transparent. The text chunk `toponym` of the picture tells where \
its lower left corner lies in the map, and how large a pixel is. Exit code 1 if the map has seen nothing yet.")]
pub struct GridArgs {
    /// Picture to write, PNG.
    file: PathBuf,
    /// Edge of a pixel, metres.
    #[arg(long, value_name = "M", default_value_t = 0.05)]
    resolution_m: f64,
    /// Which map.
    #[arg(long, default_value = "main")]
    map: String,
    /// How long to wait for it.
    #[arg(long, value_name = "S", default_value = "30", value_parser = super::seconds)]
    timeout: Duration,
}

pub async fn grid(to: &Connection, site: &str, args: &GridArgs) -> Result<u8, Failure> {
    let session = to.open().await?;
    let planner = Planner::new(&session, site, &args.map, args.timeout)?;
    let reply = planner.grid(args.resolution_m).await?;
    if reply.png.is_empty() {
        eprintln!("map {} has seen nothing yet", args.map);
        return Ok(exit::NOT_KNOWN);
    }
    let written = std::fs::write(&args.file, reply.picture().map_err(ClientError::Invalid)?);
    written
        .map_err(|e| Invalid::new("file", format!("{}: {e}", args.file.display())))
        .map_err(ClientError::Invalid)?;
    let (r, corner) = (reply.resolution_m, reply.map_from_grid);
    writeln!(
        std::io::stdout(),
        "{}: {:.1} m by {:.1} m in pixels of {r} m, lower left corner at x {:.2} m, y {:.2} m",
        args.file.display(),
        reply.width as f64 * r,
        reply.height as f64 * r,
        corner.x_m,
        corner.y_m
    )?;
    Ok(exit::FOUND)
}
