//! `map` as its users run it, on a short simulated log.

use super::*;
use clap::Parser;
use serde_json::Value;
use std::path::PathBuf;
use toponym_sim::{Scenario, write::write_folder};

#[derive(Parser)]
struct Cli {
    #[command(flatten)]
    map: MapArgs,
}

/// A folder with a short simulated log, gone at the end of the test.
struct Folder(PathBuf);

impl Folder {
    fn new(name: &str) -> Self {
        Self::with_stops(name, 3)
    }

    /// The demo's tour up to a stop; the whole of it comes back to where it was.
    fn with_stops(name: &str, stops: usize) -> Self {
        let folder = std::env::temp_dir().join(format!("toponym-map-{name}-{}", std::process::id()));
        let mut scenario = Scenario::demo(1);
        scenario.tour.truncate(stops);
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
    assert!((weights.sum::<f64>() + report["unresolved"].as_f64().unwrap() - 1.0).abs() < 1e-9);
    let states = report["states"].as_array().unwrap();
    assert_eq!(states[0]["state"], "mapping");
    assert!(states.iter().all(|s| s["why"].is_string() && s["stamp_s"].is_f64()));
    assert!(report["differences"].is_array());
    poses_are_those_of_the_places(&report);
    let answer = &report["answers"][0];
    let mass = answer["candidates"].as_array().unwrap().iter().map(|c| c["probability"].as_f64().unwrap());
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

/// Each graph has a pose for every place, and the best one's are the places'.
fn poses_are_those_of_the_places(report: &Value) {
    let places = report["places"].as_array().unwrap();
    for particle in report["particles"].as_array().unwrap() {
        assert_eq!(particle["poses"].as_array().unwrap().len(), places.len());
    }
    for (place, pose) in places.iter().zip(report["particles"][0]["poses"].as_array().unwrap()) {
        assert_eq!([&place["x_m"], &place["y_m"], &place["yaw_rad"]], [&pose[0], &pose[1], &pose[2]]);
    }
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

#[test]
fn the_history_has_a_line_per_place_with_what_was_looked_at_and_why() {
    let folder = Folder::with_stops("history", usize::MAX);
    folder.map(&["--history", "@h.jsonl", "--report", "@r.json"]).unwrap();
    let text = std::fs::read_to_string(folder.0.join("h.jsonl")).unwrap();
    let lines: Vec<Value> = text.lines().map(|l| serde_json::from_str(l).unwrap()).collect();
    let report = folder.report("r.json");
    let ids = |v: &Value, key: &str| v[key].as_u64().unwrap();
    let told: Vec<u64> = lines.iter().map(|l| ids(l, "place")).collect();
    let places: Vec<u64> = report["places"].as_array().unwrap().iter().map(|p| ids(p, "id")).collect();
    assert_eq!(told, places);
    for line in &lines {
        let weights = line["weights"].as_array().unwrap();
        let kept: f64 = weights.iter().map(|w| w.as_f64().unwrap()).sum();
        assert!((kept + line["unresolved"].as_f64().unwrap() - 1.0).abs() < 1e-9);
        for edge in line["edges"].as_array().unwrap() {
            assert!(edge["reason"].as_str().unwrap().starts_with("edge "));
        }
    }
    let looked_at = |l: &Value| !l["proposed"].as_array().unwrap().is_empty();
    assert!(lines.iter().any(looked_at), "a tour that comes back looks at older places");
    let edges = |keep: fn(f64) -> bool| {
        let all = lines.iter().flat_map(|l| l["edges"].as_array().unwrap());
        all.filter(|e| keep(e["taken"].as_f64().unwrap())).count()
    };
    assert!(edges(|taken| taken > 0.0) > 0);
    assert!(edges(|taken| taken <= 0.0) > 0);
}

#[test]
fn without_loops_no_edge_is_tried_and_with_wrong_ones_the_map_holds() {
    let folder = Folder::with_stops("wrong", usize::MAX);
    folder.map(&["--report", "@clean.json"]).unwrap();
    folder.map(&["--no-loops", "--report", "@none.json"]).unwrap();
    let edges = |name| folder.report(name)["particles"][0]["edges"].as_array().unwrap().len();
    assert!(edges("clean.json") > 0);
    assert_eq!(edges("none.json"), 0);
    folder.map(&["--inject-loops", "0.5", "--report", "@wrong.json"]).unwrap();
    let at = |name| -> Vec<[f64; 2]> {
        let report = folder.report(name);
        let places = report["places"].as_array().unwrap().iter();
        places.map(|p| [p["x_m"].as_f64().unwrap(), p["y_m"].as_f64().unwrap()]).collect()
    };
    let apart = |(a, b): (&[f64; 2], &[f64; 2])| (a[0] - b[0]).hypot(a[1] - b[1]);
    let worst = at("clean.json").iter().zip(&at("wrong.json")).map(apart).fold(0.0, f64::max);
    assert!(worst < 0.3, "{worst}");
    assert!(folder.error(&["--inject-loops", "2"]).contains("share from 0 to 1"));
}

#[test]
fn a_closed_pipe_is_no_error() {
    use std::io::{Error, ErrorKind};
    assert!(super::said(Err(Error::from(ErrorKind::BrokenPipe))).is_ok());
    assert!(super::said(Err(Error::from(ErrorKind::StorageFull))).is_err());
}

#[derive(Parser)]
struct AskCli {
    #[command(flatten)]
    ask: AskArgs,
}

#[derive(Parser)]
struct ShowCli {
    #[command(flatten)]
    show: ShowArgs,
}

#[test]
fn a_saved_map_is_shown_and_asked_without_its_log() {
    let folder = Folder::new("shown");
    folder.map(&["--save-map", "@m", "--image", "@a.svg"]).unwrap();
    let path = |name: &str| folder.0.join(name).display().to_string();
    let ask = |question: &str| ask(&AskCli::parse_from(["ask", &path("m"), question]).ask).unwrap();
    assert_eq!((ask("gym"), ask("where is the pool")), (true, false));
    let show = |options: &[&str]| {
        let all = ["show".to_owned(), path("m")];
        let options = options.iter().map(|o| o.strip_prefix('@').map_or((*o).to_owned(), path));
        show(&ShowCli::parse_from(all.into_iter().chain(options)).show)
    };
    show(&["--image", "@b.svg", "--regions", "@r.json"]).unwrap();
    let text = std::fs::read_to_string(folder.0.join("b.svg")).unwrap();
    let picture = roxmltree::Document::parse(&text).unwrap();
    let words: Vec<&str> = picture
        .descendants()
        .filter(|n| n.has_tag_name("text"))
        .filter_map(|n| n.text())
        .map(str::trim)
        .collect();
    assert!(words.iter().any(|w| w.starts_with("gym")), "{words:?}");
    assert!(folder.report("r.json").as_array().is_some_and(|rooms| !rooms.is_empty()));
    assert!(show(&["--image", "@b.jpg"]).unwrap_err().to_string().contains("--image"));
    assert!(show(&["@m", "--image", "@b.png"]).is_err(), "one picture of two maps");
    assert!(folder.error(&["--image", "@a.gif"]).contains(".png or .svg"));
}
