//! Drives on which something goes wrong: is the map right, and if not, is that told?
//!
//! A drive is right if its trajectory, aligned to the truth, is off by [`RIGHT_M`] at most, root mean square. It is told
//! if the robot was doubtful or lost at half of the scans that are off by more, or is so at the end, or something
//! was suspected of its senses. What is neither is assured and wrong.

use nalgebra::{Matrix2, Vector2};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use toponym_core::answers::query::{Answer, Query};
use toponym_core::effects::TrackState;
use toponym_core::{Config, Effect, Event, Mapper, Pose2};
use toponym_proto::Message;
use toponym_server::convert::event;
use toponym_sim::{Draw, Fault, FloorPlan, LaserModel, OfficeStyle, Recording, Scenario, Wheels};

const RIGHT_M: f64 = 0.2;
/// What the draws of a drive's kind are for, among the simulator's.
const KIND: u64 = 5000;

/// One after the other; a value between two bounds, of either sign where the first is negative.
const KINDS: [(&str, f64, f64); 19] = [
    ("slip:", -180.0, 180.0),
    ("slip:m", -4.0, 4.0),
    ("unsigned", 0.0, 0.0),
    ("break", 0.0, 0.0),
    ("carried", 0.0, 0.0),
    ("pushed:", 0.5, 5.0),
    ("stale:", 2.0, 20.0),
    ("constant", 0.0, 0.0),
    ("jitter:", 0.001, 0.01),
    ("scale:", 0.7, 1.4),
    ("bias:", -3.0, 3.0),
    ("clock:", -100.0, 4000.0),
    ("glass:", 0.1, 0.6),
    ("dark:", 0.1, 0.6),
    ("crowd:", 4.0, 20.0),
    ("frozen:", 2.0, 30.0),
    ("mirrored", 0.0, 0.0),
    ("backwards", 0.0, 0.0),
    ("millimetres", 0.0, 0.0),
];

/// How a drive came out.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Outcome {
    rms_m: f64,
    /// Share of the scans that are off by more than is right, and of them the share with the robot doubtful or lost.
    wrong: f64,
    wrong_told: f64,
    ever_told: bool,
    told_at_end: bool,
    suspected: bool,
}

impl Outcome {
    fn verdict(&self) -> &'static str {
        match self {
            o if o.rms_m <= RIGHT_M => "right",
            o if o.told_at_end || o.wrong_told >= 0.5 => "told",
            o if o.suspected => "suspected",
            _ => "assured and wrong",
        }
    }
}

/// A line for each drive and the sums by kind; what is told on the way if it is one alone; without a fault, how often anything is told.
pub fn report(plans: Option<&Path>, seeds: std::ops::Range<u64>, only: Option<&str>, clean: bool) {
    let each = seeds.end == seeds.start + 1;
    let plans = plans.map(buildings).unwrap_or_default();
    let mut sums: BTreeMap<(&str, &str), u32> = BTreeMap::new();
    let mut alarms = 0;
    for seed in seeds {
        let (scenario, kind, building) = scenario(&plans, seed, only, clean);
        let Ok(recording) = scenario.run() else { continue };
        let outcome = played(&recording, each);
        let faults: Vec<String> = scenario.faults.iter().map(ToString::to_string).collect();
        println!(
            "{seed} {building} {} {}: {:.0} m driven, {:.3} m, {:.0} % wrong, {:.0} % of it told{}{}: {}",
            faults.join(" "),
            scenario.lasers[0].mount.id,
            recording.truth.path_m,
            outcome.rms_m,
            100.0 * outcome.wrong,
            100.0 * outcome.wrong_told,
            if outcome.ever_told { ", doubtful or lost" } else { "" },
            if outcome.suspected { ", senses suspected" } else { "" },
            outcome.verdict()
        );
        *sums.entry((kind, outcome.verdict())).or_default() += 1;
        *sums.entry(("all", outcome.verdict())).or_default() += 1;
        alarms += u32::from(outcome.ever_told || outcome.suspected);
    }
    for ((kind, verdict), n) in &sums {
        println!("{kind}: {n} {verdict}");
    }
    if clean {
        println!("doubtful, lost or suspected at any time: {alarms}");
    }
}

/// Floor plans below a folder, in the order of their names.
pub fn buildings(folder: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    let mut folders = vec![folder.to_owned()];
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|e| e == "xml") {
                found.push(path);
            }
        }
    }
    found.sort();
    found
}

fn scenario(
    plans: &[PathBuf],
    seed: u64,
    only: Option<&str>,
    clean: bool,
) -> (Scenario, &'static str, String) {
    let mut draw = Draw::new(seed, KIND);
    let stops = 5 + draw.below(5);
    let plan = (!plans.is_empty()).then(|| &plans[draw.below(plans.len())]);
    let toured = plan.and_then(|p| Scenario::floor_plan(&FloorPlan::read(p).ok()?, stops, seed).ok());
    let building = plan.filter(|_| toured.is_some()).and_then(|p| p.file_stem()?.to_str());
    let building = building.unwrap_or("office").to_owned();
    let mut scenario = toured.unwrap_or_else(|| Scenario::office(&OfficeStyle::default(), stops, seed));
    if draw.chance(0.5) {
        scenario.lasers = vec![LaserModel::rplidar()];
        scenario.odom_rate_hz = 20.0;
    }
    if draw.chance(0.5) {
        scenario.wheels = Wheels::rough();
    }
    scenario.people = draw.below(3);
    let kinds: Vec<_> = KINDS.iter().filter(|k| only.is_none_or(|o| k.0 == o)).collect();
    let (name, from, to) = kinds[seed as usize % kinds.len()];
    let value = draw.within((*from, *to));
    let whole = ["stale:", "crowd:"].contains(name);
    let value = if whole { value.round() } else { (value * 1000.0).round() / 1000.0 };
    let text = match name.split_once(':') {
        Some((kind, unit)) => format!("{kind}:{value}{unit}"),
        None => (*name).to_owned(),
    };
    if !clean {
        scenario.faults = vec![text.parse::<Fault>().unwrap()];
    }
    (scenario, name, building)
}

fn played(recording: &Recording, each: bool) -> Outcome {
    if each {
        println!("{:?}", recording.truth.faults);
    }
    let truth: BTreeMap<i64, Pose2> =
        recording.truth.scans.iter().map(|(s, p)| (s.ns, Pose2::new(p.x_m, p.y_m, p.yaw_rad))).collect();
    let mut mapper = Mapper::new(Config::default());
    let mut placed = Vec::new();
    let (mut state, mut outcome) = (TrackState::Mapping, Outcome::default());
    for message in &recording.messages {
        if matches!(message, Message::Say(_)) {
            continue;
        }
        for effect in mapper.step(event(message.clone())) {
            if each
                && let Effect::StateChanged { .. }
                | Effect::SegmentBegan { .. }
                | Effect::EdgeAccepted { .. }
                | Effect::Suspected { .. } = &effect
            {
                println!("{effect:?}");
            }
            match effect {
                Effect::ScanPlaced { stamp_ns, place, place_from_body, .. } => {
                    placed.push((stamp_ns, place, place_from_body, state != TrackState::Mapping));
                }
                Effect::StateChanged { state: now, .. } => {
                    state = now;
                    outcome.ever_told |= state != TrackState::Mapping;
                }
                Effect::Suspected { .. } => outcome.suspected = true,
                _ => {}
            }
        }
    }
    mapper.step(Event::Flush);
    outcome.told_at_end = state != TrackState::Mapping;
    let Answer::Graph(graph) = mapper.answer(&Query::Graph) else { return outcome };
    let places: BTreeMap<_, _> = graph.places.iter().map(|p| (p.id, p.pose)).collect();
    let row = |(ns, place, from_body, told): &(i64, _, Pose2, bool)| {
        Some(Row { made: places.get(place)?.compose(from_body), truth: *truth.get(ns)?, told: *told })
    };
    let rows: Vec<Row> = placed.iter().filter_map(row).collect();
    let off_m = errors_m(&rows);
    outcome.rms_m = (off_m.iter().map(|e| e * e).sum::<f64>() / off_m.len().max(1) as f64).sqrt();
    let wrong: Vec<bool> =
        off_m.iter().zip(&rows).filter(|(e, _)| **e > RIGHT_M).map(|(_, r)| r.told).collect();
    outcome.wrong = wrong.len() as f64 / off_m.len().max(1) as f64;
    outcome.wrong_told = wrong.iter().filter(|t| **t).count() as f64 / wrong.len().max(1) as f64;
    if rows.len() < recording.truth.scans.len() / 4 {
        // Hardly anything was mapped at all.
        outcome.rms_m = f64::INFINITY;
    }
    outcome
}

/// A scan's pose as it was mapped and in truth, and whether the robot was doubtful or lost then.
pub struct Row {
    pub made: Pose2,
    pub truth: Pose2,
    pub told: bool,
}

/// How far each is from its truth after the best rigid alignment.
fn errors_m(rows: &[Row]) -> Vec<f64> {
    let to_truth = alignment(rows);
    let off = |r: &Row| {
        let (x_m, y_m) = to_truth(r.made.x_m, r.made.y_m);
        (x_m - r.truth.x_m).hypot(y_m - r.truth.y_m)
    };
    rows.iter().map(off).collect()
}

/// Takes points as they were mapped to where they are, by the best rigid alignment (Horn 1987, in the plane).
pub fn alignment(rows: &[Row]) -> impl Fn(f64, f64) -> (f64, f64) + use<> {
    let n = rows.len().max(1) as f64;
    let at = |p: &Pose2| Vector2::new(p.x_m, p.y_m);
    let made = rows.iter().map(|r| at(&r.made)).sum::<Vector2<f64>>() / n;
    let truth = rows.iter().map(|r| at(&r.truth)).sum::<Vector2<f64>>() / n;
    let h: Matrix2<f64> =
        rows.iter().map(|r| (at(&r.made) - made) * (at(&r.truth) - truth).transpose()).sum();
    let (s, c) = (h[(0, 1)] - h[(1, 0)]).atan2(h[(0, 0)] + h[(1, 1)]).sin_cos();
    let turn = Matrix2::new(c, -s, s, c);
    move |x_m, y_m| {
        let to = turn * (Vector2::new(x_m, y_m) - made) + truth;
        (to.x, to.y)
    }
}
