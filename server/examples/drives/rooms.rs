//! How regions of maps lie over rooms, as ROSE² scores them (Luperto et al. 2022): for each room that was entered the
//! region of largest overlap, and the reverse.

use crate::faults::{Row, alignment, buildings};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use toponym_core::effects::Effect;
use toponym_core::regions::Region;
use toponym_core::{Config, Event, Mapper, Pose2};
use toponym_proto::Message;
use toponym_server::convert::event;
use toponym_sim::{Draw, FloorPlan, LaserModel, OfficeStyle, Recording, Room, Scenario};

/// Between the points at which areas are counted.
const STEP_M: f64 = 0.1;
/// What the draws of a drive are for, among the simulator's.
const ROOMS: u64 = 6000;

pub type Polygon = Vec<(f64, f64)>;
/// A room and a region that share some floor.
type Overlap = (Option<usize>, Option<usize>);

/// What one map scores.
#[derive(Clone, Copy, Debug, Default)]
struct Score {
    rooms: usize,
    regions: usize,
    room_to_region: f64,
    region_to_room: f64,
    precision: f64,
    recall: f64,
    rand: f64,
}

/// A line for each drive, and the means.
pub fn report(plans: Option<&Path>, seeds: std::ops::Range<u64>) {
    let plans = plans.map(buildings).unwrap_or_default();
    let mut all = Vec::new();
    for seed in seeds {
        let (name, scenario) = drawn(&plans, seed);
        let Ok(recording) = scenario.run() else { continue };
        let rooms = rooms(&scenario);
        let Some(score) = played(&recording, &rooms) else { continue };
        println!(
            "{seed} {name}: {} rooms, {} regions, IoU {:.3} and {:.3}, precision {:.3}, recall {:.3}, ARI {:.3}",
            score.rooms,
            score.regions,
            score.room_to_region,
            score.region_to_room,
            score.precision,
            score.recall,
            score.rand
        );
        all.push(score);
    }
    let mean = |of: fn(&Score) -> f64| all.iter().map(of).sum::<f64>() / all.len().max(1) as f64;
    println!(
        "{} maps: IoU room → region {:.3}, region → room {:.3}; precision {:.3}, recall {:.3}; ARI {:.3}",
        all.len(),
        mean(|s| s.room_to_region),
        mean(|s| s.region_to_room),
        mean(|s| s.precision),
        mean(|s| s.recall),
        mean(|s| s.rand)
    );
}

/// A tour of one of these buildings, or of a random office, and its name.
pub fn drawn(plans: &[PathBuf], seed: u64) -> (&str, Scenario) {
    let mut draw = Draw::new(seed, ROOMS);
    let stops = 6 + draw.below(10);
    let plan = (!plans.is_empty()).then(|| &plans[draw.below(plans.len())]);
    let toured = plan.and_then(|p| Scenario::floor_plan(&FloorPlan::read(p).ok()?, stops, seed).ok());
    let name = plan.filter(|_| toured.is_some()).and_then(|p| p.file_stem()?.to_str()).unwrap_or("office");
    let mut scenario = toured.unwrap_or_else(|| Scenario::office(&OfficeStyle::default(), stops, seed));
    if draw.chance(0.5) {
        scenario.lasers = vec![LaserModel::rplidar()];
    }
    scenario.people = draw.below(3);
    (name, scenario)
}

/// Outlines of its rooms.
pub fn rooms(scenario: &Scenario) -> Vec<Polygon> {
    let outline = |r: &Room| r.area.corners.iter().map(|p| (p[0], p[1])).collect();
    scenario.world.rooms.iter().map(outline).collect()
}

fn played(recording: &Recording, rooms: &[Polygon]) -> Option<Score> {
    let truth: BTreeMap<i64, Pose2> =
        recording.truth.scans.iter().map(|(s, p)| (s.ns, Pose2::new(p.x_m, p.y_m, p.yaw_rad))).collect();
    let mut mapper = Mapper::new(Config::default());
    let mut placed = Vec::new();
    let mut feed = |event: Event| {
        for effect in mapper.step(event) {
            if let Effect::ScanPlaced { stamp_ns, place, place_from_body, .. } = effect {
                placed.push((stamp_ns, place, place_from_body));
            }
        }
    };
    for message in recording.messages.iter().filter(|m| !matches!(m, Message::Say(_))) {
        feed(event(message.clone()));
    }
    feed(Event::Flush);
    let snapshot = mapper.snapshot();
    let places: BTreeMap<_, _> = snapshot.graph().places.iter().map(|p| (p.id, p.pose)).collect();
    let row = |(ns, place, from_body): &(i64, _, Pose2)| {
        Some(Row { made: places.get(place)?.compose(from_body), truth: *truth.get(ns)?, told: false })
    };
    let rows: Vec<Row> = placed.iter().filter_map(row).collect();
    let to_truth = alignment(&rows);
    let entered = |room: &&Polygon| truth.values().any(|p| contains(room, p.x_m, p.y_m));
    let rooms: Vec<Polygon> = rooms.iter().filter(entered).cloned().collect();
    let regions = &snapshot.rooms().regions;
    (!rooms.is_empty() && !regions.is_empty()).then(|| scored(&rooms, regions, &to_truth))
}

fn scored(rooms: &[Polygon], regions: &[Region], to_truth: &dyn Fn(f64, f64) -> (f64, f64)) -> Score {
    let moved = |line: &Polygon| line.iter().map(|p| to_truth(p.0, p.1)).collect::<Polygon>();
    let regions: Vec<(Polygon, Vec<Polygon>)> =
        regions.iter().map(|r| (moved(&r.polygon_m), r.holes_m.iter().map(moved).collect())).collect();
    let all = || rooms.iter().chain(regions.iter().map(|r| &r.0)).flatten();
    let low = all().fold((f64::MAX, f64::MAX), |l, p| (l.0.min(p.0), l.1.min(p.1)));
    let high = all().fold((f64::MIN, f64::MIN), |h, p| (h.0.max(p.0), h.1.max(p.1)));
    let mut shared: BTreeMap<Overlap, f64> = BTreeMap::new();
    for row in 0..((high.1 - low.1) / STEP_M) as usize {
        for column in 0..((high.0 - low.0) / STEP_M) as usize {
            let (x, y) = (low.0 + column as f64 * STEP_M, low.1 + row as f64 * STEP_M);
            let room = rooms.iter().position(|room| contains(room, x, y));
            let in_region = |r: &(Polygon, Vec<Polygon>)| {
                contains(&r.0, x, y) && !r.1.iter().any(|hole| contains(hole, x, y))
            };
            let region = regions.iter().position(in_region);
            *shared.entry((room, region)).or_default() += STEP_M * STEP_M;
        }
    }
    let of = |room: Option<usize>, region: Option<usize>| shared.get(&(room, region)).copied().unwrap_or(0.0);
    let sum =
        |fits: &dyn Fn(&Overlap) -> bool| shared.iter().filter(|(k, _)| fits(k)).map(|(_, a)| a).sum::<f64>();
    let room_m2: Vec<f64> = (0..rooms.len()).map(|k| sum(&|key| key.0 == Some(k))).collect();
    let region_m2: Vec<f64> = (0..regions.len()).map(|k| sum(&|key| key.1 == Some(k))).collect();
    let iou = |k: usize, r: usize| {
        let both = of(Some(k), Some(r));
        both / (room_m2[k] + region_m2[r] - both).max(1e-9)
    };
    let best = |values: &mut dyn Iterator<Item = f64>| values.fold(0.0, f64::max);
    let largest = |k: usize| {
        (0..regions.len()).max_by(|&a, &b| of(Some(k), Some(a)).total_cmp(&of(Some(k), Some(b)))).unwrap_or(0)
    };
    let reverse = |r: usize| {
        (0..rooms.len()).max_by(|&a, &b| of(Some(a), Some(r)).total_cmp(&of(Some(b), Some(r)))).unwrap_or(0)
    };
    let mean = |sum: f64, n: usize| sum / n.max(1) as f64;
    let covered: f64 =
        (0..regions.len()).map(|r| best(&mut (0..rooms.len()).map(|k| of(Some(k), Some(r))))).sum();
    let found: f64 = (0..rooms.len()).map(|k| of(Some(k), Some(largest(k)))).sum();
    Score {
        rooms: rooms.len(),
        regions: regions.len(),
        room_to_region: mean((0..rooms.len()).map(|k| iou(k, largest(k))).sum(), rooms.len()),
        region_to_room: mean((0..regions.len()).map(|r| iou(reverse(r), r)).sum(), regions.len()),
        precision: covered / region_m2.iter().sum::<f64>().max(1e-9),
        recall: found / room_m2.iter().sum::<f64>().max(1e-9),
        rand: rand(&shared),
    }
}

/// Adjusted Rand index over what is in a room and in a region (Hubert and Arabie 1985), by area.
fn rand(shared: &BTreeMap<Overlap, f64>) -> f64 {
    let both = shared.iter().filter_map(|(&(room, region), &a)| Some((room?, region?, a)));
    let both: Vec<(usize, usize, f64)> = both.collect();
    let total: f64 = both.iter().map(|b| b.2).sum();
    let squares = |of: fn(&(usize, usize, f64)) -> usize| {
        let mut sums: BTreeMap<usize, f64> = BTreeMap::new();
        for b in &both {
            *sums.entry(of(b)).or_default() += b.2;
        }
        sums.values().map(|a| a * a).sum::<f64>()
    };
    let (rooms, regions) = (squares(|b| b.0), squares(|b| b.1));
    let index: f64 = both.iter().map(|b| b.2 * b.2).sum();
    let expected = rooms * regions / (total * total).max(1e-9);
    (index - expected) / (0.5 * (rooms + regions) - expected).max(1e-9)
}

/// Whether a point is inside: crossings of a ray along x.
pub fn contains(line: &[(f64, f64)], x: f64, y: f64) -> bool {
    let pairs = (0..line.len()).map(|k| (line[k], line[(k + 1) % line.len()]));
    let crosses = |(a, b): &((f64, f64), (f64, f64))| {
        (a.1 > y) != (b.1 > y) && x < a.0 + (y - a.1) / (b.1 - a.1) * (b.0 - a.0)
    };
    pairs.filter(crosses).count() % 2 == 1
}
