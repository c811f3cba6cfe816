//! Tours as folders, for whoever maps them with something else, and what comes back.

use crate::graph::{Graphs, Report};
use crate::run::Case;
use crate::score::{Mapped, Moment, Outcome, Setting};
use crate::truth::{Hypothesis, Named, Outline, Path, Piece, Question, Truth};
use anyhow::{Context, Result, bail};
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::fs::File;
use std::path::Path as FilePath;
use toponym_core::Pose2;
use toponym_sim::write;

/// Reports at the checkpoints; only the last must be there.
const REPORTS: [&str; 4] = ["report_25.json", "report_50.json", "report_75.json", "report.json"];

/// `truth.json`.
#[derive(Debug, Serialize, Deserialize)]
struct TruthFile {
    tour: String,
    language: String,
    seed: u64,
    /// `[t, x, y, yaw]`.
    trajectory: Vec<[f64; 4]>,
    regions: BTreeMap<String, Outline>,
    hypotheses: Vec<HypothesisFile>,
    dark_s: Vec<(f64, f64)>,
    checkpoints_s: Vec<f64>,
    names: Vec<NameFile>,
    /// Of the questions whose name was told by relations alone, by how many.
    #[serde(default)]
    relations: BTreeMap<String, usize>,
    reference: Option<Vec<Vec<f64>>>,
}

#[derive(Debug, Serialize, Deserialize)]
struct HypothesisFile {
    name: String,
    pieces: Vec<PieceFile>,
}

#[derive(Debug, Serialize, Deserialize)]
struct PieceFile {
    from_s: f64,
    /// `[x, y, yaw]`.
    world_from_true: [f64; 3],
}

#[derive(Debug, Serialize, Deserialize)]
struct NameFile {
    t_s: f64,
    name: String,
}

/// Writes a tour in a language: `sim.rec`, `narration.jsonl`, `truth.json`, `questions.json`.
pub fn write_case(folder: &FilePath, tour: &str, language: &str, case: &Case) -> Result<()> {
    std::fs::create_dir_all(folder).with_context(|| folder.display().to_string())?;
    let file = |name: &str| folder.join(name);
    write::record(&case.messages, File::create(file(write::RECORD))?)?;
    std::fs::write(file("narration.jsonl"), write::narration(&case.messages))?;
    let (truth, questions) = truth_files(tour, language, case);
    std::fs::write(file("truth.json"), serde_json::to_string(&truth)? + "\n")?;
    std::fs::write(file("questions.json"), serde_json::to_string_pretty(&questions)? + "\n")?;
    Ok(())
}

/// Outlines get ids, one each.
fn truth_files(tour: &str, language: &str, case: &Case) -> (TruthFile, BTreeMap<String, Vec<String>>) {
    let Truth { path, hypotheses, dark_s, checkpoints_s, named, questions } = &case.truth;
    let mut outlines: Vec<&Outline> = Vec::new();
    let mut id = |room| {
        let known = outlines.iter().position(|o| *o == room).unwrap_or(outlines.len());
        if known == outlines.len() {
            outlines.push(room);
        }
        format!("R{}", known + 1)
    };
    let asked = questions.iter().map(|q| (q.text.clone(), q.rooms.iter().map(&mut id).collect())).collect();
    let row = |p: &Pose2| [p.x_m, p.y_m, p.yaw_rad];
    let piece = |p: &Piece| PieceFile { from_s: p.from_s, world_from_true: row(&p.world_from_true) };
    let hypothesis = |h: &Hypothesis| HypothesisFile {
        name: h.name.clone(),
        pieces: h.pieces.iter().map(piece).collect(),
    };
    let regions = outlines.iter().enumerate().map(|(k, o)| (format!("R{}", k + 1), (*o).clone()));
    let truth = TruthFile {
        tour: tour.into(),
        language: language.into(),
        seed: case.seed,
        trajectory: path.rows().iter().map(|(t, p)| [*t, p.x_m, p.y_m, p.yaw_rad]).collect(),
        regions: regions.collect(),
        hypotheses: hypotheses.iter().map(hypothesis).collect(),
        dark_s: dark_s.clone(),
        checkpoints_s: checkpoints_s.clone(),
        names: named.iter().map(|n| NameFile { t_s: n.t_s, name: n.name.clone() }).collect(),
        relations: questions
            .iter()
            .filter(|q| q.relations > 0)
            .map(|q| (q.text.clone(), q.relations))
            .collect(),
        reference: case.reference.clone(),
    };
    (truth, asked)
}

impl TruthFile {
    fn truth(&self, questions: &BTreeMap<String, Vec<String>>) -> Truth {
        let pose = |[x, y, yaw]: [f64; 3]| Pose2::new(x, y, yaw);
        let piece = |p: &PieceFile| Piece { from_s: p.from_s, world_from_true: pose(p.world_from_true) };
        let hypothesis = |h: &HypothesisFile| Hypothesis {
            name: h.name.clone(),
            pieces: h.pieces.iter().map(piece).collect(),
        };
        let question = |(text, ids): (&String, &Vec<String>)| Question {
            text: text.clone(),
            rooms: ids.iter().filter_map(|id| self.regions.get(id).cloned()).collect(),
            relations: self.relations.get(text).copied().unwrap_or(0),
        };
        Truth {
            path: Path::new(
                self.trajectory.iter().map(|[t, x, y, yaw]| (*t, pose([*x, *y, *yaw]))).collect(),
            ),
            hypotheses: self.hypotheses.iter().map(hypothesis).collect(),
            dark_s: self.dark_s.clone(),
            checkpoints_s: self.checkpoints_s.clone(),
            named: self.names.iter().map(|n| Named { t_s: n.t_s, name: n.name.clone() }).collect(),
            questions: questions.iter().map(question).collect(),
        }
    }
}

/// Scores all seeds of a folder, in order.
pub fn score(folder: &FilePath) -> Result<(Setting, Vec<Outcome>)> {
    let mut seeds: Vec<u64> = Vec::new();
    for entry in std::fs::read_dir(folder).with_context(|| folder.display().to_string())? {
        seeds.extend(entry?.file_name().to_str().and_then(|name| name.parse::<u64>().ok()));
    }
    seeds.sort_unstable();
    let mut setting = None;
    let mut outcomes = Vec::new();
    for seed in seeds {
        let (told, outcome) = score_seed(&folder.join(seed.to_string()))?;
        if setting.as_ref().is_some_and(|s| *s != told) {
            bail!("{}: its seeds are of several tours or languages; one folder each", folder.display());
        }
        setting = Some(told);
        outcomes.push(outcome);
    }
    let setting = setting.with_context(|| format!("{}: no folder of a seed in it", folder.display()))?;
    Ok((setting, outcomes))
}

fn score_seed(folder: &FilePath) -> Result<(Setting, Outcome)> {
    let file: TruthFile = read(&folder.join("truth.json"))?;
    let truth = file.truth(&read(&folder.join("questions.json"))?);
    let mut checkpoints = Vec::new();
    for name in REPORTS {
        let path = folder.join(name);
        checkpoints.push(if path.is_file() { Some(graphs(&path)?) } else { None });
    }
    let report: Report = read(&folder.join("report.json"))?;
    let moments = checkpoints.iter().flatten().filter_map(|g| Moment::of(g, &truth)).collect();
    let mapped = Mapped {
        checkpoints,
        moments,
        trajectory: trajectory(&folder.join("trajectory.txt"))?,
        answers: report.answers(),
        unresolved: report.unresolved(),
        cpu_ms_per_s: report.cpu_ms_per_s(),
    };
    let setting =
        Setting { tour: file.tour, language: file.language, preset: "scored".into(), particles: None };
    Ok((setting, Outcome::new(file.seed, &truth, &mapped, file.reference)))
}

fn graphs(file: &FilePath) -> Result<Graphs> {
    let report: Report = read(file)?;
    report.graphs().map_err(|why| anyhow::anyhow!("{}: {why}", file.display()))
}

fn read<T: DeserializeOwned>(file: &FilePath) -> Result<T> {
    let text = std::fs::read_to_string(file).with_context(|| file.display().to_string())?;
    serde_json::from_str(&text).with_context(|| file.display().to_string())
}

/// Rows `t x y yaw`; lines that begin with # are remarks.
fn trajectory(file: &FilePath) -> Result<Vec<(f64, Pose2)>> {
    let text = std::fs::read_to_string(file).with_context(|| file.display().to_string())?;
    let mut rows = Vec::new();
    for (k, line) in text.lines().enumerate().filter(|(_, l)| !l.trim().is_empty() && !l.starts_with('#')) {
        let numbers: Vec<f64> = line.split_whitespace().map_while(|w| w.parse().ok()).collect();
        let [t, x, y, yaw, ..] = numbers[..] else {
            bail!("{}:{}: want `t x y yaw`", file.display(), k + 1);
        };
        rows.push((t, Pose2::new(x, y, yaw)));
    }
    Ok(rows)
}

#[cfg(test)]
mod tests;
