//! `toponym simulate`.

use super::{OfficeStyle, Scenario, SimError, write};
use std::path::PathBuf;

/// Make a log of a simulated robot in a made-up building, with a narration and the truth.
///
/// Writes sim.clf, narration.jsonl, truth.json and questions.json into a folder; then try
/// `toponym-server map DIR/sim.clf --narration DIR/narration.jsonl --image map.png`.
#[derive(Clone, Debug, clap::Args)]
pub struct SimulateArgs {
    /// Folder to write to; made if need be.
    #[arg(value_name = "DIR")]
    pub folder: PathBuf,
    /// Seed of the building (unless it is the demo's), the wheels, the laser and the guide.
    #[arg(long, default_value_t = 1)]
    pub seed: u64,
    /// Which building.
    #[arg(long, value_enum, default_value = "demo")]
    pub building: Building,
    /// Rooms on the tour of a random office.
    #[arg(long, default_value_t = 14)]
    pub stops: usize,
}

/// Which building to simulate.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum Building {
    /// The demo's, always the same.
    Demo,
    /// An office drawn from the seed.
    Office,
}

/// A simulated log could not be made.
#[derive(Debug, thiserror::Error)]
pub enum SimulateError {
    /// The scenario can't be played.
    #[error(transparent)]
    Sim(#[from] SimError),
    /// The files can't be written.
    #[error("cannot write to {}: {source}; give a folder that you may write to", folder.display())]
    Write {
        /// The folder asked for.
        folder: PathBuf,
        /// Why.
        source: std::io::Error,
    },
}

/// Runs `toponym simulate`; the text says what was made.
pub fn run(args: &SimulateArgs) -> Result<String, SimulateError> {
    let scenario = match args.building {
        Building::Demo => Scenario::demo(args.seed),
        Building::Office => Scenario::office(&OfficeStyle::default(), args.stops, args.seed),
    };
    let recording = scenario.run()?;
    let folder = args.folder.clone();
    write::write_folder(&recording, &folder).map_err(|source| SimulateError::Write { folder, source })?;
    Ok(format!(
        "{}: {:.0} m driven, {} scans, {} rooms named",
        args.folder.join("sim.clf").display(),
        recording.truth.path_m,
        recording.truth.scans.len(),
        recording.truth.names.len()
    ))
}
