//! Learns which room is meant by "next to the kitchen": the weights of `answers/described` in the core, on floor plans of
//! every other building, and shows on the others how well they choose and whether they mean what they say.

use crate::faults::{Row, alignment, buildings};
use rayon::prelude::*;
use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use toponym_core::answers::described::features::{Alternatives, Clause, FEATURES, Scene, Speaker};
use toponym_core::answers::described::{Kind, Which};
use toponym_core::answers::snapshot::Snapshot;
use toponym_core::effects::Effect;
use toponym_core::language::act::{Content, Locate};
use toponym_core::language::{GroundPlace, Narrowing, parse};
use toponym_core::{Config, Event, Mapper, Pose2};
use toponym_proto::Message;
use toponym_server::convert::event;
use toponym_sim::geom::Area;
use toponym_sim::tours::statements::{Statement, statements};
use toponym_sim::tours::{Tour, planned};
use toponym_sim::{Draw, FloorPlan};

/// What the draws of a drive are for, among the simulator's.
const DESCRIBED: u64 = 7000;
/// Rooms that were entered are named outright, so often, where they are not spoken of.
const NAMED: f64 = 0.75;
/// How sure that is.
const SURE: f64 = 0.9;
/// Guides speak of rooms that the tour does not lead to, but rather of the others: so many of the former are kept.
const NEVER_ENTERED: f64 = 0.08;
/// Statements of a kind about one room in one map.
const PER_KIND: usize = 2;
/// Of statements about rooms that are not entered so soon after, so many are kept.
const SOON_S: f64 = 60.0;
const NOT_SOON: f64 = 0.5;
/// Points at which it is counted in which room a region lies.
const STEP_M: f64 = 0.3;
/// When maps are looked at, as shares of the drive.
const AT: [f64; 3] = [0.4, 0.7, 1.0];
/// Ridge on what a kind's weights differ from those of all, in examples; and on those.
const RIDGE: f64 = 3.0;
const RIDGE_OF_ALL: f64 = 1.0;
/// Steps of gradient descent, and how far each goes.
const STEPS: usize = 600;
const RATE: f64 = 0.05;

/// Something said of a map, and what was meant.
struct Example {
    kind: Kind,
    alternatives: Alternatives,
    /// Regions that lie in the room meant; none: it is not in the map yet.
    meant: Vec<usize>,
    /// Of a building that is not learned from.
    held: bool,
}

/// Learns and tells; writes the weights to a file if there is one.
pub fn report(plans: &Path, seeds: std::ops::Range<u64>, out: Option<&Path>) {
    let halves = halves(plans);
    let plans: Vec<PathBuf> = halves.keys().cloned().collect();
    let seeds: Vec<u64> = seeds.collect();
    let examples: Vec<Example> = seeds.par_iter().flat_map(|&seed| of_drive(&plans, &halves, seed)).collect();
    let learned: Vec<&Example> = examples.iter().filter(|e| !e.held).collect();
    let unseen = examples.iter().filter(|e| e.meant.is_empty()).count();
    println!(
        "{} statements, {} of them to learn from; {unseen} of rooms not seen yet",
        examples.len(),
        learned.len()
    );
    let said: Vec<&Example> = learned.iter().copied().filter(|e| e.kind != Kind::Anywhere).collect();
    let all = fit(&said, &[0.0; FEATURES], RIDGE_OF_ALL);
    let weights: Vec<[f64; FEATURES]> = Kind::ALL
        .into_iter()
        .map(|kind| {
            let of: Vec<&Example> = learned.iter().copied().filter(|e| e.kind == kind).collect();
            if kind == Kind::Anywhere { fit(&of, &[0.0; FEATURES], RIDGE) } else { fit(&of, &all, RIDGE) }
        })
        .collect();
    println!(
        "{:<10} {:>6} {:>6} {:>6} {:>6} {:>6}   held: the same",
        "kind", "n", "right", "mass", "-ln", "ece"
    );
    for (k, kind) in Kind::ALL.into_iter().enumerate() {
        let of = |held: bool| told(examples.iter().filter(|e| e.kind == kind && e.held == held), &weights[k]);
        println!("{:<10} {}   {}", format!("{kind:?}"), of(false), of(true));
    }
    if let Some(out) = out {
        std::fs::write(out, written(&weights)).unwrap();
    }
}

/// Plans, and whether they are of the buildings that are not learned from: every other one, by the folders' names.
fn halves(plans: &Path) -> BTreeMap<PathBuf, bool> {
    let folder =
        |file: &PathBuf| file.strip_prefix(plans).ok()?.components().next().map(|c| c.as_os_str().to_owned());
    let files = buildings(plans);
    let folders: BTreeSet<_> = files.iter().filter_map(folder).collect();
    let index = |file: &PathBuf| folders.iter().position(|f| Some(f) == folder(file).as_ref()).unwrap_or(0);
    files.iter().map(|file| (file.clone(), index(file) % 2 == 1)).collect()
}

fn written(weights: &[[f64; FEATURES]]) -> String {
    let mut text = String::from(
        "//! Weights of [`super::features`], by kind of relation: learned on floor plans, by\n\
         //! `cargo run --release -p toponym-server --example drives -- described --plans PLANS --out FILE`.\n\n\
         use super::Kind;\nuse super::features::FEATURES;\n\n\
         /// In the order of [`Kind::ALL`].\n#[rustfmt::skip]\n\
         pub const WEIGHTS: [[f64; FEATURES]; Kind::ALL.len()] = [\n",
    );
    for (kind, of) in Kind::ALL.iter().zip(weights) {
        let _ = writeln!(text, "    // {kind:?}");
        let _ = write!(text, "    [");
        for (k, w) in of.iter().enumerate() {
            let w = if w.abs() < 0.0005 { 0.0 } else { *w };
            let _ = write!(text, "{}{w:.3}", if k == 0 { "" } else { ", " });
        }
        let _ = writeln!(text, "],");
    }
    text + "];\n"
}

/// Gradient descent (Adam; Kingma and Ba 2015) from where the ridge pulls to.
fn fit(examples: &[&Example], from: &[f64; FEATURES], ridge: f64) -> [f64; FEATURES] {
    let (mut w, mut m, mut v) = (*from, [0.0; FEATURES], [0.0; FEATURES]);
    for step in 1..=STEPS {
        let of = |e: &&Example| {
            let which = Which::softmax(&e.alternatives, &w);
            let right = right(&which, &e.meant).max(1e-12);
            let mut g = [0.0; FEATURES];
            let mut add = |features: &[f64; FEATURES], p: f64, is_meant: bool| {
                let push = p / right * f64::from(is_meant) - p;
                g.iter_mut().zip(features).for_each(|(g, f)| *g += push * f);
            };
            for (r, features) in e.alternatives.regions.iter().enumerate() {
                if let Some(features) = features {
                    add(features, which.p[r], e.meant.contains(&r));
                }
            }
            add(&e.alternatives.none, which.p_none, e.meant.is_empty());
            g
        };
        let sum = |a: [f64; FEATURES], b: [f64; FEATURES]| std::array::from_fn(|k| a[k] + b[k]);
        let gradient = examples.par_iter().map(of).reduce(|| [0.0; FEATURES], sum);
        let n = examples.len().max(1) as f64;
        for k in 0..FEATURES {
            let g = (gradient[k] - ridge * (w[k] - from[k])) / n;
            m[k] = 0.9 * m[k] + 0.1 * g;
            v[k] = 0.999 * v[k] + 0.001 * g * g;
            let (mean, square) =
                (m[k] / (1.0 - 0.9_f64.powi(step as i32)), v[k] / (1.0 - 0.999_f64.powi(step as i32)));
            w[k] += RATE * mean / (square.sqrt() + 1e-8);
        }
    }
    w
}

fn right(which: &Which, meant: &[usize]) -> f64 {
    if meant.is_empty() { which.p_none } else { meant.iter().map(|&r| which.p[r]).sum() }
}

/// How many there are, share of which the likeliest alternative is right, median mass, mean −ln, calibration error.
fn told<'a>(examples: impl Iterator<Item = &'a Example>, weights: &[f64; FEATURES]) -> String {
    let (mut n, mut hits, mut masses, mut loss) = (0, 0, Vec::new(), 0.0);
    let mut bins = [(0_usize, 0.0, 0_usize); 10];
    for e in examples {
        let which = Which::softmax(&e.alternatives, weights);
        let best = (0..which.p.len()).max_by(|&a, &b| which.p[a].total_cmp(&which.p[b]));
        let best = best.filter(|&r| which.p[r] >= which.p_none);
        let hit = best.map_or(e.meant.is_empty(), |r| e.meant.contains(&r));
        let mass = right(&which, &e.meant);
        n += 1;
        hits += usize::from(hit);
        masses.push(mass);
        loss -= mass.max(1e-3).ln();
        let none = [(which.p_none, e.meant.is_empty())];
        let each =
            which.p.iter().enumerate().map(|(r, &p)| (p, e.meant.contains(&r))).filter(|c| c.0 >= 0.02);
        for (p, so) in each.chain(none) {
            let bin = &mut bins[((p * 10.0) as usize).min(9)];
            *bin = (bin.0 + 1, bin.1 + p, bin.2 + usize::from(so));
        }
    }
    masses.sort_by(f64::total_cmp);
    let claims: usize = bins.iter().map(|b| b.0).sum();
    let ece = bins.iter().map(|b| (b.1 - b.2 as f64).abs()).sum::<f64>() / claims.max(1) as f64;
    let share = |sum: f64| sum / f64::from(n.max(1));
    let median = masses.get(masses.len() / 2).copied().unwrap_or(0.0);
    format!("{n:>6} {:>6.3} {median:>6.3} {:>6.3} {ece:>6.3}", share(f64::from(hits as u32)), share(loss))
}

/// All that is true on a tour of a plan that is the seed's.
fn of_drive(plans: &[PathBuf], halves: &BTreeMap<PathBuf, bool>, seed: u64) -> Vec<Example> {
    let mut draw = Draw::new(seed, DESCRIBED);
    let file = &plans[draw.below(plans.len())];
    let tour = FloorPlan::read(file).ok().and_then(|plan| planned(&plan, seed).ok());
    let Some((tour, played)) = tour.and_then(|tour| Some((tour.clone(), tour.play().ok()?))) else {
        return Vec::new();
    };
    let held = halves.get(file).copied().unwrap_or(true);
    let is_entered = |room: usize| {
        let area = &tour.scenario.world.rooms[room].area;
        played.truth.scans.iter().any(|(_, p)| area.contains([p.x_m, p.y_m], 0.0))
    };
    let mut said = statements(&tour);
    let figures: BTreeSet<usize> = said.iter().map(|s| s.figure).collect();
    let kept: BTreeSet<usize> =
        figures.into_iter().filter(|&k| is_entered(k) || draw.chance(NEVER_ENTERED)).collect();
    said.retain(|s| kept.contains(&s.figure));
    let truth: BTreeMap<i64, Pose2> =
        played.truth.scans.iter().map(|(s, p)| (s.ns, Pose2::new(p.x_m, p.y_m, p.yaw_rad))).collect();
    let mut mapper = Mapper::new(Config { seed, ..Config::default() });
    let (mut placed, mut examples, mut next) = (Vec::new(), Vec::new(), 0);
    let end_s = tour.drive.duration_s();
    for message in &played.stream {
        let t_s = message.header().map_or(0.0, |h| h.stamp.ns as f64 * 1e-9);
        if next + 1 < AT.len() && t_s > AT[next] * end_s {
            next += 1;
            examples.extend(of_map(&mapper, &placed, (&tour, &said, &truth), (t_s, held), &mut draw));
        }
        let last = matches!(message, Message::End(_));
        for effect in mapper.step(event(message.clone())) {
            if let Effect::ScanPlaced { stamp_ns, place, place_from_body, .. } = effect {
                placed.push((stamp_ns, place, place_from_body));
            }
        }
        if last {
            mapper.step(Event::Flush);
        }
    }
    examples.extend(of_map(&mapper, &placed, (&tour, &said, &truth), (end_s, held), &mut draw));
    examples
}

type Placed = (i64, u64, Pose2);

fn of_map(
    mapper: &Mapper,
    placed: &[Placed],
    (tour, said, truth): (&Tour, &[Statement], &BTreeMap<i64, Pose2>),
    (now_s, held): (f64, bool),
    draw: &mut Draw,
) -> Vec<Example> {
    let snapshot = mapper.snapshot();
    let poses: BTreeMap<_, _> = snapshot.places().iter().map(|p| (p.id, p.pose)).collect();
    let frozen = mapper.graph().places();
    let places: Vec<GroundPlace> = frozen
        .iter()
        .map(|p| {
            let Pose2 { x_m, y_m, yaw_rad } = poses[&p.id];
            GroundPlace { x_m, y_m, yaw_rad, path_m: p.path_m }
        })
        .collect();
    let row = |(ns, place, from_body): &Placed| {
        Some(Row { made: poses.get(place)?.compose(from_body), truth: *truth.get(ns)?, told: false })
    };
    let rows: Vec<Row> = placed.iter().filter_map(row).collect();
    let rooms = in_rooms(&snapshot, tour, &alignment(&rows));
    let regions_of =
        |room: usize| -> Vec<usize> { (0..rooms.len()).filter(|&r| rooms[r] == Some(room)).collect() };
    // Who speaks: the place and the pose at that time.
    let speaker = |at_s: f64| {
        let (_, id, from_body) = placed.iter().take_while(|p| p.0 as f64 * 1e-9 <= at_s).last()?;
        let v = frozen.iter().position(|p| p.id == *id)?;
        Some(Speaker { pose: poses[id].compose(from_body), place: v as u32, path_m: places[v].path_m })
    };
    let figures: BTreeSet<usize> = said.iter().map(|s| s.figure).collect();
    let entered: BTreeSet<usize> = rooms.iter().flatten().copied().collect();
    let mut examples = Vec::new();
    for figure in figures {
        let named: BTreeSet<usize> =
            entered.iter().copied().filter(|&k| k != figure && draw.chance(NAMED)).collect();
        let mut left: Vec<&Statement> =
            said.iter().filter(|s| s.figure == figure && s.at_s < now_s).collect();
        let mut taken: BTreeMap<Kind, usize> = BTreeMap::new();
        let meant = regions_of(figure);
        while !left.is_empty() {
            let s = left.swap_remove(draw.below(left.len()));
            let Some((locate, speaker)) = located(&s.how).zip(speaker(s.at_s)) else { continue };
            let count = taken.entry(Kind::of(locate.relation)).or_default();
            let marks: Vec<usize> =
                s.landmarks.iter().filter_map(|&k| largest(&snapshot, &regions_of(k))).collect();
            if *count >= PER_KIND || marks.len() < s.landmarks.len() {
                continue;
            }
            // Guides speak of where they lead to.
            let entered_s = entered_s(tour, figure, s.at_s);
            if entered_s.is_none_or(|t_s| t_s - s.at_s > SOON_S) && !draw.chance(NOT_SOON) {
                continue;
            }
            *count += 1;
            // Landmarks bear their names.
            let is_named = |room: &Option<usize>| {
                room.is_some_and(|k| k != figure && (named.contains(&k) || s.landmarks.contains(&k)))
            };
            let is_room = |room: usize| tour.scenario.world.rooms[room].kind == toponym_sim::RoomKind::Room;
            let other: Vec<f64> = rooms
                .iter()
                .map(|room| if is_named(room) && room.is_some_and(is_room) { SURE } else { 0.0 })
                .collect();
            let scene = Scene::new(snapshot.rooms(), &places, &other, false);
            let way = s.landmarks.iter().any(|&k| !is_room(k));
            let clause = Clause {
                relation: locate.relation,
                frame: locate.frame,
                narrowing: Narrowing { just: locate.modifiers.just, ..Narrowing::default() },
                landmarks: marks,
                way,
                speaker: Some(speaker),
            };
            let of = |kind, clause: &Clause| {
                let alternatives = scene.alternatives(clause);
                Example { kind, alternatives, meant: meant.clone(), held }
            };
            examples.push(of(Kind::of(locate.relation), &clause));
            if draw.chance(0.3) {
                examples.push(of(Kind::Anywhere, &Clause::anywhere()));
            }
        }
    }
    examples
}

/// When a room is first entered after some time.
fn entered_s(tour: &Tour, room: usize, from_s: f64) -> Option<f64> {
    let area = &tour.scenario.world.rooms[room].area;
    let seconds = (0..=(tour.drive.duration_s() - from_s).max(0.0) as usize).map(|k| from_s + k as f64);
    seconds.into_iter().find(|&t_s| {
        let p = tour.drive.at(t_s);
        area.contains([p.x_m, p.y_m], 0.0)
    })
}

fn largest(snapshot: &Snapshot, regions: &[usize]) -> Option<usize> {
    let area_m2 = |r: &usize| snapshot.rooms().regions[*r].area_m2;
    regions.iter().copied().max_by(|a, b| area_m2(a).total_cmp(&area_m2(b)))
}

/// What the parser makes of it.
fn located(how: &str) -> Option<Locate> {
    let words = how.replace("{0}", "kitchen").replace("{1}", "library");
    let text = match how {
        "down the {0}" | "at the end of the {0}" => format!("The gym is {}.", how.replace("{0}", "hallway")),
        _ => format!("The gym is {words}."),
    };
    parse(&text).acts().iter().find_map(|act| match &act.content {
        Content::Locate(l) => Some(l.clone()),
        _ => None,
    })
}

/// The room in which each region lies, by most of its floor.
fn in_rooms(
    snapshot: &Snapshot,
    tour: &Tour,
    to_truth: &impl Fn(f64, f64) -> (f64, f64),
) -> Vec<Option<usize>> {
    let world = &tour.scenario.world;
    let of = |region: &toponym_core::regions::Region| {
        let area = Area { corners: region.polygon_m.iter().map(|p| [p.0, p.1]).collect() };
        let [low, high] = area.bounds();
        let mut floor: BTreeMap<usize, usize> = BTreeMap::new();
        let (columns, rows) = ((high[0] - low[0]) / STEP_M, (high[1] - low[1]) / STEP_M);
        for (i, j) in (0..=columns as usize).flat_map(|i| (0..=rows as usize).map(move |j| (i, j))) {
            let p = [low[0] + i as f64 * STEP_M, low[1] + j as f64 * STEP_M];
            if area.contains(p, 0.0) {
                let (x, y) = to_truth(p[0], p[1]);
                if let Some(room) = world.rooms.iter().position(|r| r.area.contains([x, y], 0.0)) {
                    *floor.entry(room).or_default() += 1;
                }
            }
        }
        floor.into_iter().max_by_key(|f| f.1).map(|f| f.0)
    };
    snapshot.rooms().regions.iter().map(of).collect()
}
