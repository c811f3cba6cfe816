//! A tour written, mapped by the server's `map`, and scored, is the tour mapped here.

use super::*;
use crate::run::{Settings, map};
use crate::tour::tests::short_walk;
use clap::Parser;
use std::path::PathBuf;
use toponym_server::map::MapArgs;
use toponym_server::map::Preset;
use toponym_sim::tours::Language;

#[derive(Parser)]
struct Cli {
    #[command(flatten)]
    map: MapArgs,
}

struct Temporary(PathBuf);

impl Temporary {
    fn new(name: &str) -> Self {
        Self(std::env::temp_dir().join(format!("toponym-tours-{name}-{}", std::process::id())))
    }
}

impl Drop for Temporary {
    fn drop(&mut self) {
        std::fs::remove_dir_all(&self.0).unwrap();
    }
}

fn case() -> Case {
    let mut tour = short_walk(3);
    let world_from_true = Pose2::new(1.0, 2.0, 0.5);
    let other = Hypothesis { name: "other".into(), pieces: vec![Piece { from_s: 20.0, world_from_true }] };
    tour.hypotheses.push(other);
    tour.case(Language::Simple).unwrap()
}

#[test]
fn the_truth_comes_back_as_it_was_written() {
    let mut case = case();
    case.reference = Some(vec![vec![0.5, 0.5]; 4]);
    let (file, questions) = truth_files("walk", "simple", &case);
    let text = serde_json::to_string(&file).unwrap();
    let file: TruthFile = serde_json::from_str(&text).unwrap();
    let truth = file.truth(&questions);
    assert_eq!(file.reference, case.reference);
    assert_eq!((&truth.hypotheses, &truth.named), (&case.truth.hypotheses, &case.truth.named));
    let mut asked = case.truth.questions.clone();
    asked.sort_by(|a, b| a.text.cmp(&b.text));
    assert_eq!(truth.questions, asked);
    let t_s = case.truth.checkpoints_s[1];
    assert!(truth.path.at(t_s).distance_m(&case.truth.path.at(t_s)) < 1e-9);
}

#[test]
fn what_the_servers_map_makes_of_a_folder_scores_as_the_run_itself() {
    let (folder, case) = (Temporary::new("written"), case());
    let seed = folder.0.join("3");
    write_case(&seed, "walk", "simple", &case).unwrap();
    let file = |name: &str| seed.join(name).display().to_string();
    let asks = case.truth.questions.iter().flat_map(|q| ["--ask".to_owned(), q.text.clone()]);
    let options = ["map", &file("sim.rec"), "--narration", &file("narration.jsonl"), "--seed", "3"];
    let outputs =
        ["--report", &file("report.json"), "--trajectory", &file("trajectory.txt"), "--particles", "4"];
    let all = options.into_iter().chain(outputs).map(str::to_owned).chain(asks);
    toponym_server::map::run(&Cli::try_parse_from(all).unwrap().map).unwrap();

    let (setting, outcomes) = score(&folder.0).unwrap();
    assert_eq!((setting.tour.as_str(), setting.language.as_str()), ("walk", "simple"));
    let mapped = map(&case, Settings { particles: 4, preset: Preset::Toponym }).unwrap();
    let own = Outcome::new(case.seed, &case.truth, &mapped, None);
    // Weights told are less what is unresolved: their last bits differ.
    let rounded = |outcome: &Outcome| {
        let mut end = outcome.end().unwrap().clone();
        end.graphs.iter_mut().for_each(|(weight, _)| *weight = (*weight * 1e9).round());
        end
    };
    assert_eq!(rounded(&outcomes[0]), rounded(&own));
    let answered = |outcome: &Outcome| {
        let of = |a: &crate::score::Answered| (a.relations, a.is_in, (a.mass * 1e9).round());
        (outcome.labels, outcome.answers.iter().map(of).collect::<Vec<_>>())
    };
    assert_eq!(answered(&outcomes[0]), answered(&own));
    assert!((outcomes[0].ate_rmse_m.unwrap() - own.ate_rmse_m.unwrap()).abs() < 0.02);
    let mass = |outcome: &Outcome| (outcome.mass_true(3).unwrap() * 1e9).round();
    assert_eq!((outcomes[0].seed, mass(&outcomes[0])), (3, mass(&own)));
    assert_eq!(outcomes[0].mass_true(0), None, "no report of a quarter of the way");
    assert!(own.mass_true(0).is_some());
}

#[test]
fn a_folder_that_cannot_be_scored_says_what_is_missing() {
    let (folder, case) = (Temporary::new("missing"), case());
    std::fs::create_dir_all(&folder.0).unwrap();
    assert!(format!("{:#}", score(&folder.0).unwrap_err()).contains("no folder of a seed"));
    write_case(&folder.0.join("3"), "walk", "simple", &case).unwrap();
    assert!(format!("{:#}", score(&folder.0).unwrap_err()).contains("report.json"));
    std::fs::write(folder.0.join("3/report.json"), r#"{"places": [], "particles": []}"#).unwrap();
    std::fs::write(folder.0.join("3/trajectory.txt"), "# t x y yaw\n0 0 0\n").unwrap();
    assert!(format!("{:#}", score(&folder.0).unwrap_err()).contains("trajectory.txt:2"));
}
