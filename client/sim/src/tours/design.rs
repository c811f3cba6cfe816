//! From a building, a way through it and its look-alikes to a tour.

use super::strain::strain;
use super::{Hypothesis, Piece, Tour};
use crate::body::STEP_S;
use crate::geom::{Point, between};
use crate::laser::LaserModel;
use crate::random::Draw;
use crate::robot::drive_legs;
use crate::world::{RoomKind, World};
use crate::{Drive, Fault, Motion, Scenario, SimError, WheelsPrior};
use std::f64::consts::TAU;
use toponym_proto::Pose;

/// Longer stretches on dark floor are crossings: where one comes out must be told by other means.
const CROSSING_M: f64 = 5.0;
/// One is in a corridor from this far off its walls on: those of suites are narrow.
const CORRIDOR_M: f64 = 0.4;
/// Hypotheses are no more than these.
const HYPOTHESES_MAX: usize = 6;
/// Wheels of a roughness beyond 1, which is that of [`crate::Wheels::rough`], slip on what lies outdoors: by
/// up to a quarter more.
const ROUGHEST: f64 = 1.25;
/// So much beyond the aim is near enough.
const AIM_SLACK: f64 = 1.1;
/// Rays differ if they differ by this.
const RAY_M: f64 = 0.1;
/// A scan is told from another by this many rays.
const RAYS: usize = 4;

/// A drive through a world, as legs between stops.
pub(super) struct Walk<'a> {
    world: &'a World,
    at: usize,
    pub start: Point,
    pub legs: Vec<Vec<Point>>,
}

impl<'a> Walk<'a> {
    /// From the middle of a room on.
    pub fn from_room(world: &'a World, room: usize) -> Result<Self, SimError> {
        let spot = world.rooms.get(room).ok_or(SimError::NoSuchRoom(room))?.spot;
        Ok(Self::from_waypoint(world, spot))
    }

    /// From a waypoint on.
    pub fn from_waypoint(world: &'a World, at: usize) -> Self {
        Self { world, at, start: world.waypoints[at], legs: Vec::new() }
    }

    fn route(&self, to: usize) -> Result<Vec<Point>, SimError> {
        self.world.route(self.at, to).ok_or(SimError::NoWay(self.at, to))
    }

    /// On to a room, and a rest there.
    pub fn to(&mut self, room: usize) -> Result<(), SimError> {
        let spot = self.world.rooms.get(room).ok_or(SimError::NoSuchRoom(room))?.spot;
        if spot != self.at {
            self.legs.push(self.route(spot)?);
            self.at = spot;
        }
        Ok(())
    }

    /// Out by the waypoint nearest to one point, over open floor, and in again by another's, to a
    /// room.
    pub fn across(&mut self, out: Point, open: &[Point], back: Point, room: usize) -> Result<(), SimError> {
        let mut leg = self.route(self.world.waypoint_near(out))?;
        leg.extend(open);
        self.at = self.world.waypoint_near(back);
        let spot = self.world.rooms.get(room).ok_or(SimError::NoSuchRoom(room))?.spot;
        leg.extend(self.route(spot)?);
        self.at = spot;
        self.legs.push(leg);
        Ok(())
    }
}

/// What a crossing may have led to: names and rigid motions of the world, what really happened
/// first, with no motion. Only that: nothing looks like it.
pub(super) type Return = Vec<(String, Pose)>;

/// A tour on the drawing board.
pub(super) struct Design {
    pub world: World,
    /// Start and legs of each day.
    pub days: Vec<(Point, Vec<Vec<Point>>)>,
    /// What each crossing, or the start of the second day, may have led to.
    pub returns: Vec<Return>,
    /// After a return the guide says nothing for so long.
    pub late_m: f64,
    /// σ of the wheels' turn error, if not the usual one.
    pub turn: Option<f64>,
    /// Distance of look-alikes to aim at, in standard deviations of the wheels.
    pub aim: f64,
    pub people: usize,
    pub faults: Vec<Fault>,
}

impl Design {
    /// A plain drive through a world.
    pub fn plain(world: World, start: Point, legs: Vec<Vec<Point>>) -> Self {
        Self {
            world,
            days: vec![(start, legs)],
            returns: Vec::new(),
            late_m: 0.0,
            turn: None,
            aim: 1.0,
            people: 0,
            faults: Vec::new(),
        }
    }

    /// Drives it and finds out what the wheels should be like. Beside the tour: how far the
    /// look-alikes then are at least, in standard deviations.
    pub fn tour(mut self, name: &'static str, seed: u64) -> (Tour, f64) {
        for corridor in self.world.rooms.iter_mut().filter(|r| r.kind == RoomKind::Corridor) {
            corridor.inside_m = corridor.inside_m.min(CORRIDOR_M);
        }
        let mut draw = Draw::new(seed, 8);
        let motion = Motion { speed_mps: (0.8, 1.0), ..Motion::default() };
        let (drive, second_day_s) = driven(&self.world, &self.days, &motion, &mut draw);
        let blind_s = blind(&self.world, &drive);
        let mut starts_s: Vec<(f64, f64)> =
            blind_s.iter().copied().filter(|s| is_crossing(&drive, *s)).collect();
        starts_s.extend(second_day_s.map(|t_s| (t_s, t_s)));
        let hypotheses = hypotheses(&self.returns, &starts_s);
        let look = |roughness: f64| {
            let mut prior = WheelsPrior::between(roughness);
            prior.turn = self.turn.unwrap_or(prior.turn);
            let strain = nearest(&drive, &blind_s, &starts_s, &self.returns, &prior);
            (prior, strain)
        };
        let (wheels_prior, strain) = fitted(look, self.aim, &mut draw);
        let mut scenario = Scenario::new(self.world, Vec::new(), seed);
        scenario.motion = motion;
        scenario.wheels = wheels_prior.draw(&mut draw);
        scenario.lasers = vec![laser(&mut draw)];
        scenario.people = self.people;
        scenario.faults = self.faults;
        let ambiguous = self.returns.iter().zip(&starts_s).filter(|(r, _)| r.len() > 1);
        let returns_s: Vec<f64> = ambiguous.map(|(_, s)| s.1).collect();
        let mut vocabulary: Vec<String> =
            scenario.world.rooms.iter().map(|r| r.name.clone()).filter(|n| !n.is_empty()).collect();
        vocabulary.extend(super::words::NEVER.map(str::to_owned));
        vocabulary.sort();
        vocabulary.dedup();
        let tour = Tour {
            name,
            seed,
            scenario,
            wheels_prior,
            hypotheses,
            vocabulary,
            drive,
            blind_s,
            returns_s,
            decisive_s: None,
            second_day_s,
            late_m: self.late_m,
        };
        (tour, strain)
    }
}

/// The tour of the first design on which wheels lose their way as aimed at; if there is none, of the one
/// that comes nearest.
pub(super) fn first_that_fits(
    name: &'static str,
    seed: u64,
    designs: impl Iterator<Item = Result<Design, SimError>>,
) -> Result<Tour, SimError> {
    let mut best: Option<(Tour, f64)> = None;
    for design in designs {
        let design = design?;
        let enough = design.aim * AIM_SLACK;
        let (tour, strain) = design.tour(name, seed);
        let fits = strain <= enough;
        if best.as_ref().is_none_or(|(_, least)| strain < *least) {
            best = Some((tour, strain));
        }
        if fits {
            break;
        }
    }
    best.map(|(tour, _)| tour).ok_or(SimError::NoTour)
}

/// One drive of all days, with a jump between them, and when the second one starts.
fn driven(
    world: &World,
    days: &[(Point, Vec<Vec<Point>>)],
    motion: &Motion,
    draw: &mut Draw,
) -> (Drive, Option<f64>) {
    let mut poses = Vec::new();
    let mut second = None;
    for (start, legs) in days {
        if !poses.is_empty() {
            second = Some(poses.len() as f64 * STEP_S);
        }
        poses.extend(drive_legs(world, *start, legs, motion, draw).poses);
    }
    (Drive { poses }, second)
}

/// Stretches of a drive on dark floor.
fn blind(world: &World, drive: &Drive) -> Vec<(f64, f64)> {
    let mut stretches: Vec<(f64, f64)> = Vec::new();
    let mut open = false;
    for (k, pose) in drive.poses.iter().enumerate() {
        let (t_s, dark) = (k as f64 * STEP_S, world.is_dark([pose.x_m, pose.y_m]));
        match stretches.last_mut() {
            Some(last) if open => last.1 = t_s,
            _ if dark => stretches.push((t_s, t_s)),
            _ => {}
        }
        open = dark;
    }
    stretches
}

/// Whether a dark stretch is more than a doorway.
pub(super) fn is_crossing(drive: &Drive, (from_s, to_s): (f64, f64)) -> bool {
    let steps = [from_s, to_s].map(|t_s| (t_s / STEP_S).round() as usize);
    let poses = drive.poses[steps[0]..=steps[1]].to_vec();
    Drive { poses }.path_m() > CROSSING_M
}

/// Every combination of what the returns may have led to, the truth first.
fn hypotheses(returns: &[Return], starts_s: &[(f64, f64)]) -> Vec<Hypothesis> {
    let mut all = vec![Hypothesis { name: String::new(), pieces: Vec::new() }];
    for (led, (_, from_s)) in returns.iter().zip(starts_s) {
        let further = |(name, world_from_true): &(String, Pose)| {
            let piece = Piece { from_s: *from_s, world_from_true: *world_from_true };
            all.iter()
                .map(move |h| {
                    let name = if h.name.is_empty() { name.clone() } else { format!("{}, {name}", h.name) };
                    let mut pieces = h.pieces.clone();
                    // As long as all is as it was, there is nothing to tell.
                    if !(pieces.is_empty() && piece.world_from_true == Pose::default()) {
                        pieces.push(piece);
                    }
                    Hypothesis { name: if led.len() > 1 { name } else { h.name.clone() }, pieces }
                })
                .collect::<Vec<_>>()
        };
        all = led.iter().flat_map(further).collect();
    }
    all.truncate(HYPOTHESES_MAX);
    if let [only] = all.as_mut_slice() {
        only.name = "the truth".into();
    }
    all
}

/// How far the nearest look-alike is, on average over the returns, in standard deviations.
fn nearest(
    drive: &Drive,
    blind_s: &[(f64, f64)],
    starts_s: &[(f64, f64)],
    returns: &[Return],
    prior: &WheelsPrior,
) -> f64 {
    let (mut sum, mut count) = (0.0, 0.0);
    for (led, &(from_s, to_s)) in returns.iter().zip(starts_s).filter(|(r, s)| r.len() > 1 && s.1 > s.0) {
        let (from, to) = (drive.at(from_s), drive.at(to_s));
        let strains = led[1..].iter().map(|(_, moved)| {
            let end = between(&from, &crate::geom::compose(moved, &to));
            strain(drive, blind_s, (from_s, to_s), &end, prior)
        });
        sum += strains.fold(f64::INFINITY, f64::min);
        count += 1.0;
    }
    if count > 0.0 { sum / count } else { 0.0 }
}

/// Wheels of such a roughness that look-alikes are as far as aimed at, as far as there are such;
/// without look-alikes any.
fn fitted(look: impl Fn(f64) -> (WheelsPrior, f64), aim: f64, draw: &mut Draw) -> (WheelsPrior, f64) {
    let (rough, nearest) = look(ROUGHEST);
    if nearest <= 0.0 {
        return look(draw.unit());
    }
    if nearest >= aim {
        return (rough, nearest);
    }
    let (mut low, mut high) = (0.0, ROUGHEST);
    for _ in 0..8 {
        let middle = f64::midpoint(low, high);
        if look(middle).1 > aim { low = middle } else { high = middle }
    }
    look(high)
}

/// Half a circle ahead or a whole one, reaching more or less far.
fn laser(draw: &mut Draw) -> LaserModel {
    let mut laser = LaserModel::default();
    if draw.chance(0.5) {
        laser.fov_rad = TAU;
        laser.beams = (360, 360);
        laser.mount.range_max_m = draw.within((10.0, 20.0)).round();
    }
    laser
}

/// The first scan by which every look-alike is refuted.
pub(super) fn decisive(tour: &Tour) -> Option<f64> {
    let mut latest_s: Option<f64> = None;
    for hypothesis in &tour.hypotheses[1..] {
        let at_s = tour.refuted_s(hypothesis)?;
        latest_s = Some(latest_s.map_or(at_s, |l: f64| l.max(at_s)));
    }
    latest_s
}

impl Tour {
    /// The first scan that would not be what it is if a hypothesis were true; none: nothing tells
    /// them apart but wheels and words.
    pub fn refuted_s(&self, hypothesis: &Hypothesis) -> Option<f64> {
        let first_s = hypothesis.pieces.first()?.from_s;
        let laser = self.scenario.lasers.first()?;
        let scans = crate::ticks(self.drive.duration_s(), laser.rate_hz).skip_while(|t_s| *t_s < first_s);
        let mut lit = scans.filter(|t_s| !self.blind_s.iter().any(|(from, to)| (*from..=*to).contains(t_s)));
        lit.find(|&t_s| {
            let here = self.drive.at(t_s);
            let seen = laser.ranges_m(&self.scenario.world, &here);
            let there = laser.ranges_m(&self.scenario.world, &hypothesis.at(t_s, &here));
            let differ = |a: &Option<f64>, b: &Option<f64>| match (a, b) {
                (Some(a), Some(b)) => (a - b).abs() > RAY_M,
                (None, None) => false,
                _ => true,
            };
            seen.iter().zip(&there).filter(|(a, b)| differ(a, b)).count() >= RAYS
        })
    }
}
