//! The narrated tour of a real building: a public laser log, with odometry as bad as a seed wants it.

use crate::tour::{Spoken, Tour, outright};
use crate::truth::{Hypothesis, Named, Outline, Path, Question};
use anyhow::{Context, Result, bail};
use serde::Deserialize;
use std::collections::BTreeMap;
use std::path::{Path as File, PathBuf};
use std::process::Command;
use toponym::log;
use toponym_core::Pose2;
use toponym_sim::tours::{Language, Said};
use toponym_sim::{self as sim, Draw};

/// The tour's name.
pub const NAME: &str = "stata";
/// Every so many sentences one is wrong.
const FALSE_EVERY: usize = 5;

#[derive(Debug, Deserialize)]
struct Truth {
    trajectory: Vec<[f64; 4]>,
    regions: BTreeMap<String, Outline>,
    utterances: Vec<Sentence>,
}

#[derive(Clone, Debug, PartialEq, Deserialize)]
struct Sentence {
    t: f64,
    text: String,
}

/// Why the tour can't be taken here; none if it can.
pub fn missing(shared: Option<&File>) -> Option<String> {
    let Some(shared) = shared else {
        return Some("it needs --shared DIR with DIR/data/stata and DIR/peers/stata_tour.py".into());
    };
    for part in ["data/stata/narration.jsonl", "data/stata/questions.json", "peers/stata_tour.py"] {
        if !shared.join(part).is_file() {
            return Some(format!("there is no {}", shared.join(part).display()));
        }
    }
    let python = Command::new("python3").arg("--version").output();
    (!python.is_ok_and(|o| o.status.success())).then(|| "it needs python3".into())
}

/// Makes and reads the tour.
pub fn tour(shared: &File, seed: u64) -> Result<Tour> {
    let folder = Folder::new(seed);
    make(shared, &folder.0, seed)?;
    let mut stream = Vec::new();
    for record in log::open(&folder.0.join("tour.clf.gz"), &log::Options::default())? {
        stream.push(record.message);
    }
    let truth: Truth = read(&folder.0.join("truth.json"))?;
    let questions: BTreeMap<String, Vec<String>> = read(&shared.join("data/stata/questions.json"))?;
    let rows = truth.trajectory.iter().map(|[t, x, y, yaw]| (*t, Pose2::new(*x, *y, *yaw)));
    let spoken = Language::ALL.map(|l| (l, truth.spoken(l, &questions, seed)));
    Ok(Tour {
        seed,
        robot: log::Options::default().robot,
        stream,
        path: Path::new(rows.collect()),
        hypotheses: vec![Hypothesis::truth("truth")],
        dark_s: Vec::new(),
        spoken: BTreeMap::from(spoken),
    })
}

/// A folder for what the script makes, gone when it was read.
struct Folder(PathBuf);

impl Folder {
    fn new(seed: u64) -> Self {
        Self(std::env::temp_dir().join(format!("toponym-tours-{}-{NAME}-{seed}", std::process::id())))
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        // Nothing of worth in it; if it can't go, the system will clear it away.
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

fn make(shared: &File, folder: &File, seed: u64) -> Result<()> {
    let data = shared.join("data/stata");
    let mut command = Command::new("python3");
    command.arg(shared.join("peers/stata_tour.py")).arg(&data).arg(data.join("narration.jsonl"));
    let made = command.arg(folder).args(["--seed", &seed.to_string()]).output().context("python3")?;
    if !made.status.success() {
        bail!("{}: {}", shared.join("peers/stata_tour.py").display(), String::from_utf8_lossy(&made.stderr));
    }
    Ok(())
}

fn read<T: serde::de::DeserializeOwned>(file: &File) -> Result<T> {
    let text = std::fs::read_to_string(file).with_context(|| file.display().to_string())?;
    serde_json::from_str(&text).with_context(|| file.display().to_string())
}

impl Truth {
    fn spoken(&self, language: Language, asked: &BTreeMap<String, Vec<String>>, seed: u64) -> Spoken {
        let said = said(&self.utterances, language, seed);
        let known = |text: &str| {
            let name = text.strip_prefix("where is the ").or_else(|| text.strip_prefix("where are the "));
            let name = name.or_else(|| text.strip_prefix("where is ")).unwrap_or(text);
            said.iter().any(|s| s.text.to_lowercase().contains(name))
        };
        let rooms = |text: &str, ids: &[String]| {
            let ids = if known(text) { ids } else { &[] };
            ids.iter().filter_map(|id| self.regions.get(id).cloned()).collect()
        };
        let question = |(text, ids): (&String, &Vec<String>)| Question {
            text: text.clone(),
            rooms: rooms(text, ids),
            relations: 0,
        };
        let truly = |s: &&Sentence| self.utterances.contains(s);
        let named = |s: &Sentence| Some(Named { t_s: s.t, name: outright(&s.text)?.to_lowercase() });
        Spoken {
            said: said.iter().map(spoken).collect(),
            named: said.iter().filter(truly).filter_map(named).collect(),
            questions: asked.iter().map(question).collect(),
            reference: None,
        }
    }
}

fn spoken(sentence: &Sentence) -> Said {
    let text = sentence.text.clone();
    Said { sentence: sim::Sentence { began_s: sentence.t, ended_s: sentence.t, text }, claim: None }
}

/// What is said of a narration in a language.
fn said(all: &[Sentence], language: Language, seed: u64) -> Vec<Sentence> {
    match language {
        Language::None => Vec::new(),
        Language::Simple => all.iter().filter(|s| outright(&s.text).is_some()).cloned().collect(),
        Language::Complex => all.to_vec(),
        Language::False20 => {
            let mut names: Vec<&str> = all.iter().filter_map(|s| outright(&s.text)).collect();
            names.sort_unstable();
            names.dedup();
            let wrong = |(k, s): (usize, &Sentence)| {
                if (k + 1).is_multiple_of(FALSE_EVERY) { swapped(s, &names, seed, k) } else { s.clone() }
            };
            all.iter().enumerate().map(wrong).collect()
        }
    }
}

/// A sentence with its first name exchanged for another.
fn swapped(sentence: &Sentence, names: &[&str], seed: u64, k: usize) -> Sentence {
    let held = outright(&sentence.text).or_else(|| names.iter().copied().find(|n| sentence.text.contains(n)));
    let Some(held) = held else { return sentence.clone() };
    let others: Vec<&str> = names.iter().copied().filter(|n| *n != held).collect();
    let other = others[Draw::new(seed, k as u64).below(others.len())];
    Sentence { t: sentence.t, text: sentence.text.replacen(held, other, 1) }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn narration() -> Vec<Sentence> {
        let texts = [
            "This is the lobby.",
            "And we're back in the lobby.",
            "The gym is down the hallway.",
            "We're in the hallway now.",
            "This is the gym.",
            "This is another lobby.",
        ];
        texts.iter().zip(1..).map(|(text, t)| Sentence { t: f64::from(t), text: (*text).into() }).collect()
    }

    #[test]
    fn languages_differ_in_what_is_said() {
        let count = |l| said(&narration(), l, 1).len();
        assert_eq!(Language::ALL.map(count), [0, 5, 6, 6]);
        let wrong = said(&narration(), Language::False20, 1);
        let changed: Vec<usize> = (0..6).filter(|&k| wrong[k] != narration()[k]).collect();
        assert_eq!(changed, [4], "every fifth");
        assert!(["This is the lobby.", "This is the hallway."].contains(&wrong[4].text.as_str()));
    }

    #[test]
    fn what_was_never_said_has_no_room_and_what_was_said_wrongly_is_no_name() {
        let regions = BTreeMap::from([("R1".to_owned(), vec![[0.0, 0.0], [1.0, 0.0], [1.0, 1.0]])]);
        let truth = Truth { trajectory: vec![], regions, utterances: narration() };
        let asked = BTreeMap::from([("where is the gym".to_owned(), vec!["R1".to_owned()])]);
        let spoken = |language| truth.spoken(language, &asked, 1);
        assert_eq!(spoken(Language::None).questions[0].rooms.len(), 0);
        assert_eq!(spoken(Language::Simple).questions[0].rooms.len(), 1);
        let named = |language| spoken(language).named.iter().map(|n| n.t_s).collect::<Vec<_>>();
        assert_eq!(named(Language::Complex), [1.0, 2.0, 4.0, 5.0, 6.0]);
        assert_eq!(named(Language::False20), [1.0, 2.0, 4.0, 6.0]);
    }

    #[test]
    fn without_its_data_it_says_what_it_needs() {
        assert!(missing(None).unwrap().contains("--shared"));
        assert!(missing(Some(File::new("no/such"))).unwrap().contains("no/such/data/stata/narration.jsonl"));
    }
}
