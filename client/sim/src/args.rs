//! `toponym simulate`.

use super::tours::{Language, Tour, tour};
use super::{
    Fault, FloorPlan, LaserModel, OfficeStyle, PlanError, Recording, Scenario, SimError, Wheels, tours, write,
};
use std::path::PathBuf;

/// Make a log of a simulated robot in a building, with a narration and the truth.
///
/// Writes into a folder: sim.rec (the robot's streams, as `serve --record` writes them), sim.clf
/// (the same as CARMEN text, only with the front laser upright: others don't fit the format),
/// narration.jsonl, truth.json (pose at the start of each scan, regions by name) and
/// questions.json. Then try `toponym-server map DIR/sim.rec --narration DIR/narration.jsonl
/// --image map.png`.
#[derive(Clone, Debug, clap::Args)]
pub struct SimulateArgs {
    /// Folder to write to; made if need be.
    #[arg(value_name = "DIR")]
    pub folder: PathBuf,
    /// Seed of the building (unless it is the demo's or a plan), the tour, the wheels, the laser,
    /// the people and the guide.
    #[arg(long, default_value_t = 1)]
    pub seed: u64,
    /// Which building.
    #[arg(long, value_enum, default_value = "demo")]
    pub building: Building,
    /// Instead, a floor plan in the XML format of the KTH campus data set.
    ///
    /// Portals that face each other are open doors, all else is wall. The tour keeps to the
    /// largest part that open doors join.
    #[arg(long, value_name = "FILE.xml", conflicts_with = "building")]
    pub plan: Option<PathBuf>,
    /// Instead, a tour on which more than one place looks the same: small, large, autonomous, twins,
    /// twins-decided, ring, ring-decided, rows, rows-decided, slip, unsigned, break, start, clean.
    ///
    /// It brings its own building, wheels, lasers, people and faults; truth.json tells the
    /// hypotheses, what really happened first.
    #[arg(long, value_name = "NAME", conflicts_with_all = ["building", "plan", "stops", "lidar", "fov",
          "beams", "reach", "yaw", "upside_down", "wheels", "people", "faults"])]
    pub tour: Option<String>,
    /// How the guide of a tour speaks: none, simple, complex, false20.
    #[arg(long, default_value = "simple", requires = "tour")]
    pub language: Language,
    /// Rooms on the tour of a random office or a plan.
    #[arg(long, default_value_t = 14)]
    pub stops: usize,
    /// Which laser.
    #[arg(long, value_enum, default_value = "front")]
    pub lidar: Lidar,
    /// Its field of view instead, degrees, centred on where it looks: 10 to 360.
    #[arg(long, value_name = "DEGREES", value_parser = clap::value_parser!(u16).range(10..=360))]
    pub fov: Option<u16>,
    /// Its rays per sweep instead: 20 to 4000.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(20..=4000))]
    pub beams: Option<u16>,
    /// How far it sees instead, metres: 1 to 200.
    #[arg(long, value_name = "METRES", value_parser = clap::value_parser!(u16).range(1..=200))]
    pub reach: Option<u16>,
    /// Where it looks, degrees to the left of the robot's nose.
    #[arg(long, value_name = "DEGREES", allow_negative_numbers = true,
          value_parser = clap::value_parser!(i16).range(-180..=180))]
    pub yaw: Option<i16>,
    /// The laser hangs head down: its bearings run clockwise.
    #[arg(long)]
    pub upside_down: bool,
    /// How well the wheels measure.
    #[arg(long, value_enum, default_value = "fair")]
    pub wheels: WheelsKind,
    /// People walking about, whose legs the laser sees; the first is the guide, ahead of the robot.
    #[arg(long, default_value_t = 0, value_name = "N")]
    pub people: usize,
    /// What goes wrong; may be given more than once, and truth.json tells when it happened.
    ///
    /// Wheels: slip:DEGREES or slip:METRESm (they count a turn or a way that the robot does not make), unsigned (encoders
    /// without sign), constant, scale:TIMES, bias:DEGREES (per metre), jitter:METRES, stale:N (measured at each N-th
    /// message only), pushed:METRES (they stand still meanwhile), carried (scans stop, too), break (silence, then
    /// odometry restarts at 0). Lasers: clock:SECONDS (behind), frozen:SECONDS, mirrored and backwards (mounted so, and not
    /// declared), millimetres. The building: glass:SHARE, dark:SHARE (of the walls), crowd:PEOPLE.
    #[arg(long = "fault", value_name = "FAULT")]
    pub faults: Vec<Fault>,
}

/// Which building to simulate.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum Building {
    /// The demo's, always the same.
    Demo,
    /// An office drawn from the seed.
    Office,
}

/// Which laser to simulate.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum Lidar {
    /// Half a circle ahead in whole degrees, at once, 20 m.
    Front,
    /// A full circle in 715 to 725 rays, swept ten times a second, 12 m, mounted backwards, with a
    /// post of the robot in its way.
    Rplidar,
}

/// How well the wheels measure.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum WheelsKind {
    /// 1 % too far, 1 % too wide, noise of 0.7° after a metre.
    Fair,
    /// Noise of 5 % and 2° after a metre, of 5 % after a radian, and 0.25° per metre to the left.
    Rough,
}

/// A simulated log could not be made.
#[derive(Debug, thiserror::Error)]
pub enum SimulateError {
    /// The floor plan is not usable.
    #[error(transparent)]
    Plan(#[from] PlanError),
    /// There is no tour of the floor plan.
    #[error("{}: {source}", file.display())]
    Tour {
        /// The plan.
        file: PathBuf,
        /// Why.
        source: SimError,
    },
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

/// Odometry messages per second beside a laser that sweeps: the server deskews by them.
const SWEPT_ODOM_RATE_HZ: f64 = 20.0;

/// A laser as asked for.
fn fit(laser: &mut LaserModel, args: &SimulateArgs) {
    laser.mount.upside_down = args.upside_down;
    if let Some(degrees) = args.fov {
        laser.fov_rad = f64::from(degrees).to_radians();
    }
    if let Some(beams) = args.beams {
        laser.beams = (beams.into(), beams.into());
    }
    if let Some(reach_m) = args.reach {
        laser.mount.range_max_m = reach_m.into();
    }
    if let Some(degrees) = args.yaw {
        laser.mount.yaw_rad = f64::from(degrees).to_radians();
    }
}

/// The scenario asked for.
fn scenario(args: &SimulateArgs) -> Result<Scenario, SimulateError> {
    let mut scenario = match (&args.plan, args.building) {
        (Some(file), _) => Scenario::floor_plan(&FloorPlan::read(file)?, args.stops, args.seed)
            .map_err(|source| SimulateError::Tour { file: file.clone(), source })?,
        (None, Building::Demo) => Scenario::demo(args.seed),
        (None, Building::Office) => Scenario::office(&OfficeStyle::default(), args.stops, args.seed),
    };
    if args.lidar == Lidar::Rplidar {
        scenario.lasers = vec![LaserModel::rplidar()];
        scenario.odom_rate_hz = SWEPT_ODOM_RATE_HZ;
    }
    for laser in &mut scenario.lasers {
        fit(laser, args);
    }
    if args.wheels == WheelsKind::Rough {
        scenario.wheels = Wheels::rough();
    }
    scenario.people = args.people;
    scenario.faults.clone_from(&args.faults);
    Ok(scenario)
}

/// Runs `toponym simulate`; the text says what was made.
pub fn run(args: &SimulateArgs) -> Result<String, SimulateError> {
    let toured = args.tour.as_deref().map(|name| tour(name, args.seed)).transpose()?;
    let recording = match &toured {
        Some(tour) => recorded(tour, args.language)?,
        None => scenario(args)?.run()?,
    };
    let hypotheses = toured.as_ref().map_or(&[][..], |tour| &tour.hypotheses);
    let folder = args.folder.clone();
    let log = write::write_hypotheses(&recording, hypotheses, &folder)
        .map_err(|source| SimulateError::Write { folder, source })?;
    let minutes = recording.truth.scans.last().map_or(0.0, |(stamp, _)| stamp.seconds() / 60.0);
    Ok(format!(
        "{}: {:.0} m driven in {minutes:.0} min, {} scans, {} rooms named",
        args.folder.join(log).display(),
        recording.truth.path_m,
        recording.truth.scans.len(),
        recording.truth.names.len()
    ))
}

/// A tour as one of its languages tells it; the truth's names are those said in it.
fn recorded(tour: &Tour, language: Language) -> Result<Recording, SimError> {
    let played = tour.play()?;
    let said = &played.narration[&language];
    let messages = tours::messages(&played.stream, said, &tour.scenario.robot);
    let mut truth = played.truth;
    let held = |name: &str| said.iter().filter_map(|s| s.claim.as_ref()).any(|c| c.held && c.name == name);
    truth.names.retain(|(name, _)| held(name));
    Ok(Recording { messages, truth })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::storey::tests::{ROW, TWO_ROOMS};
    use clap::Parser;
    use std::f64::consts::PI;

    #[derive(Parser)]
    struct Cli {
        #[command(flatten)]
        simulate: SimulateArgs,
    }

    /// Runs with a plan in a folder of its own, gone at the end.
    fn ran(name: &str, plan: &str, options: &str) -> Result<String, String> {
        let folder = std::env::temp_dir().join(format!("toponym-sim-{name}-{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        let (file, out) = (folder.join("plan.xml"), folder.join("out"));
        std::fs::write(&file, plan).unwrap();
        let (file, out) = (file.display().to_string(), out.display().to_string());
        let args = ["simulate", out.as_str(), "--plan", file.as_str(), "--stops", "3"];
        let cli = Cli::try_parse_from(args.into_iter().chain(options.split_whitespace())).unwrap();
        let done = run(&cli.simulate).map_err(|e| e.to_string());
        std::fs::remove_dir_all(&folder).unwrap();
        done
    }

    #[test]
    fn the_last_word_names_the_log_to_map() {
        for (options, log) in [
            ("", "sim.clf"),
            ("--lidar rplidar --wheels rough", "sim.rec"),
            ("--upside-down", "sim.rec"),
            ("--yaw -90", "sim.rec"),
        ] {
            let said = ran("last", ROW, options).unwrap();
            assert!(said.contains(&format!("{log}: ")), "{options}: {said}");
        }
    }

    #[test]
    fn a_laser_is_as_asked_for() {
        let args = ["simulate", "out", "--fov", "270", "--beams", "90", "--reach", "8", "--yaw", "-90"];
        let scenario = scenario(&Cli::try_parse_from(args).unwrap().simulate).unwrap();
        let laser = &scenario.lasers[0];
        assert_eq!((laser.beams, laser.mount.range_max_m), ((90, 90), 8.0));
        assert!((laser.fov_rad - 1.5 * PI).abs() < 1e-12 && (laser.mount.yaw_rad + 0.5 * PI).abs() < 1e-12);
        assert!(Cli::try_parse_from(["simulate", "out", "--beams", "1"]).is_err());
    }

    #[test]
    fn faults_are_told_in_the_truth() {
        let args = ["simulate", "out", "--fault", "slip:90", "--fault", "break"];
        let mut scenario = scenario(&Cli::try_parse_from(args).unwrap().simulate).unwrap();
        scenario.tour.truncate(3);
        let (truth, _) = write::truth(&scenario.run().unwrap());
        assert_eq!(truth["faults"][0]["fault"], "slip:90");
        let [from_s, to_s] = ["from_s", "to_s"].map(|k| truth["faults"][1][k].as_f64().unwrap());
        let silent = |t_s: &f64| *t_s > from_s && *t_s < to_s;
        let scans = truth["trajectory"].as_array().unwrap();
        assert!(to_s > from_s + 2.9 && !scans.iter().any(|s| silent(&s[0].as_f64().unwrap())));
        assert!(Cli::try_parse_from(["simulate", "out", "--fault", "smoke"]).is_err());
    }

    #[test]
    fn a_tour_is_written_with_its_hypotheses() {
        let folder = std::env::temp_dir().join(format!("toponym-sim-tour-{}", std::process::id()));
        let out = folder.display().to_string();
        let args = ["simulate", out.as_str(), "--tour", "twins", "--language", "complex", "--seed", "2"];
        run(&Cli::try_parse_from(args).unwrap().simulate).unwrap();
        let truth = std::fs::read_to_string(folder.join("truth.json")).unwrap();
        std::fs::remove_dir_all(&folder).unwrap();
        let truth: serde_json::Value = serde_json::from_str(&truth).unwrap();
        assert!(truth["hypotheses"][0]["pieces"].as_array().unwrap().is_empty());
        assert!(truth["hypotheses"][1]["pieces"][0]["from_s"].as_f64().unwrap() > 10.0);
        let refused =
            |options: &[&str]| Cli::try_parse_from(["simulate", "out"].iter().chain(options)).is_err();
        assert!(refused(&["--tour", "twins", "--building", "office"]) && refused(&["--language", "simple"]));
        let huge = Cli::try_parse_from(["simulate", "out", "--tour", "huge"]).unwrap();
        assert!(run(&huge.simulate).unwrap_err().to_string().contains("ring-decided"));
    }

    #[test]
    fn a_plan_without_a_tour_is_named() {
        let error = ran("none", TWO_ROOMS, "").unwrap_err();
        assert!(error.contains("plan.xml: ") && error.contains("2 rooms"), "{error}");
    }
}
