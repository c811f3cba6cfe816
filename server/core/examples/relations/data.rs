//! Reads labelled examples of path relations: YAML as one emitter writes it, line by line.

use std::collections::BTreeMap;
use toponym_core::language::Footprint;

/// A path, a landmark, and whether a phrase is true of them.
pub struct Example {
    /// The phrase up to the landmark's article: "away from".
    pub relation: String,
    /// Whether people call it that.
    pub correct: bool,
    /// Waypoints in order, metres.
    pub path: Vec<(f64, f64)>,
    /// The landmark's outline, metres.
    pub outline: Vec<(f64, f64)>,
}

impl Example {
    /// The rectangle round the landmark.
    pub fn footprint(&self) -> Footprint {
        Footprint::around(&self.outline).expect("outlines without points are not read")
    }
}

/// What the lines read last belong to.
#[derive(Clone, Copy, PartialEq)]
enum Part {
    Other,
    Command,
    Groundings,
    Path,
    Landmark,
    Outline,
}

/// Examples of one file. Each item of the list begins with `- agent:`; of it we read `command`, the
/// first of `groundingIsCorrect`, and of `objectGroundings` the path and the outline.
pub fn read(text: &str) -> Vec<Example> {
    let mut examples: Vec<Example> = Vec::new();
    let mut part = Part::Other;
    for line in text.lines() {
        let words = line.trim();
        if line.starts_with("- agent:") {
            let (relation, path, outline) = (String::new(), Vec::new(), Vec::new());
            examples.push(Example { relation, correct: false, path, outline });
            part = Part::Other;
        }
        let Some(last) = examples.last_mut() else { continue };
        if let Some(flags) = words.strip_prefix("groundingIsCorrect: [") {
            last.correct = flags.starts_with("true");
        }
        part = match words {
            "command:" => Part::Command,
            "objectGroundings:" => Part::Groundings,
            _ if part == Part::Command => {
                let phrase = words.trim_start_matches(['-', ' ']);
                phrase.split(" the ").next().unwrap_or_default().clone_into(&mut last.relation);
                Part::Other
            }
            _ if part == Part::Other => part,
            _ if words.ends_with("- Path") => Part::Path,
            _ if words.ends_with("- PhysicalObject") => Part::Landmark,
            "points:" if part == Part::Landmark => Part::Outline,
            _ => part,
        };
        match (part, point(words)) {
            (Part::Path, Some(p)) => last.path.push(p),
            (Part::Outline, Some(p)) => last.outline.push(p),
            _ => {}
        }
    }
    examples.retain(|e| !e.path.is_empty() && !e.outline.is_empty());
    examples
}

/// The first two numbers of `- [1.0, 2.0, …]`.
fn point(words: &str) -> Option<(f64, f64)> {
    let (_, list) = words.split_once("- [")?;
    let mut numbers = list.trim_end_matches(']').split(", ").map(str::parse);
    Some((numbers.next()?.ok()?, numbers.next()?.ok()?))
}

/// For every example the settings it belongs to: that of its landmark and that of its path, if any.
///
/// A setting is a landmark with paths drawn for it; false examples join the path of one setting to
/// the landmark of another, or to one without a setting.
pub fn settings(examples: &[Example]) -> (usize, Vec<[Option<usize>; 2]>) {
    // In millimetres: files round differently.
    let key = |points: &[(f64, f64)]| -> Vec<i64> {
        points.iter().flat_map(|p| [p.0, p.1]).map(|m| (m * 1e3).round() as i64).collect()
    };
    let (mut landmarks, mut paths) = (BTreeMap::new(), BTreeMap::new());
    for e in examples.iter().filter(|e| e.correct) {
        let next = landmarks.len();
        let setting = *landmarks.entry(key(&e.outline)).or_insert(next);
        paths.insert(key(&e.path), setting);
    }
    for e in examples {
        if let Some(&setting) = landmarks.get(&key(&e.outline)) {
            paths.entry(key(&e.path)).or_insert(setting);
        }
    }
    let of = |e: &Example| [landmarks.get(&key(&e.outline)).copied(), paths.get(&key(&e.path)).copied()];
    (landmarks.len(), examples.iter().map(of).collect())
}
