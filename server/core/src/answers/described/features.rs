//! What tells of a region whether it is the one that is described.
//!
//! | of a region R | by | |
//! |---|---|---|
//! | 0, 1 | the path driven (15) | ln of the most and of the mean density at its places, as shares of a room |
//! | 2, 3 | the landmark | length of the wall in common, nearness of outlines |
//! | 4, 6, 7 | | nearness of doorways; by that: facing each other, side by side |
//! | 5, 8, 18 | | one opens into the other; nearness of middles; two landmarks lie on either side |
//! | 9, 10, 11 | R | a corridor, where none is looked for; P(bears another name); ln of its area |
//! | 12, 13 | the sentence | first entered after it; soon after it |
//! | 14, 15, 16, 17 | the speaker | is in R; has its door ahead; near; on the side that is said |
//! | 19, 20 | R | ln of its places; the robot went in and came out by one way |
//!
//! Of "not in the map yet": 21 one; 22 ln of the way driven since; 23, 24 openings that were not entered, by the landmark and by the
//! speaker; 25 ln of the rooms without another name.

use crate::edge::Vertex;
use crate::geometry::{Pose2, wrap};
use crate::language::act::Frame;
use crate::language::{GroundPlace, LandmarkBelief, Narrowing, Reading, Relation, densities};
use crate::regions::{Region, Rooms, Shape};

/// Of a region, and behind them those of "not in the map yet".
pub const FEATURES: usize = 26;
/// Where the latter begin.
const NONE: usize = 21;
/// Outlines nearer than this have a wall in common.
const WALL_M: f64 = 0.8;
/// Between points of an outline that are looked at.
const STEP_M: f64 = 0.25;
/// Outlines further apart are no neighbours.
const APART_MAX_M: f64 = 8.0;
/// An opening so near to a landmark or to who speaks may lead to what is meant.
const OPENING_M: f64 = 10.0;
/// Who foretells something goes there within so much path.
const SOON_M: f64 = 40.0;
/// Turns a density per m² into a share of a room.
const ROOM_M2: f64 = 30.0;
const SHARE_MIN: f64 = 0.02;

/// Features by region, none where it can't be meant, and of "not in the map yet".
#[derive(Clone, Debug, PartialEq)]
pub struct Alternatives {
    /// By region.
    pub regions: Vec<Option<[f64; FEATURES]>>,
    /// Not in the map yet.
    pub none: [f64; FEATURES],
}

/// Where, when and on which way somebody spoke.
#[derive(Clone, Copy, Debug)]
pub struct Speaker {
    /// In the map; heading as the robot went.
    pub pose: Pose2,
    /// The place held.
    pub place: Vertex,
    /// Path travelled by then, metres.
    pub path_m: f64,
}

/// What is said of a figure, its landmarks known.
#[derive(Clone, Debug)]
pub struct Clause {
    /// How it lies.
    pub relation: Relation,
    /// Whose left is meant.
    pub frame: Option<Frame>,
    /// "Just", "the second door".
    pub narrowing: Narrowing,
    /// Regions of the landmarks; none: where who speaks is.
    pub landmarks: Vec<usize>,
    /// A landmark is one that one goes along.
    pub way: bool,
    /// Where it was said; none: nothing was.
    pub speaker: Option<Speaker>,
}

impl Clause {
    /// That says nothing.
    pub fn anywhere() -> Self {
        let (relation, narrowing) = (Relation::At, Narrowing::default());
        Self { relation, frame: None, narrowing, landmarks: Vec::new(), way: false, speaker: None }
    }
}

/// A map in which something is looked for.
pub struct Scene<'a> {
    rooms: &'a Rooms,
    places: &'a [GroundPlace],
    other: &'a [f64],
    way: bool,
    /// Regions that the robot went into and came out of by the way it had come: rooms, mostly.
    visited: Vec<bool>,
}

impl<'a> Scene<'a> {
    /// Of regions and places; by region, the probability that it bears another name; and whether what is looked for is
    /// one that one goes along.
    pub fn new(rooms: &'a Rooms, places: &'a [GroundPlace], other: &'a [f64], way: bool) -> Self {
        Self { rooms, places, other, way, visited: visited(rooms, places.len()) }
    }

    /// All that may be meant.
    pub fn alternatives(&self, clause: &Clause) -> Alternatives {
        let regions = &self.rooms.regions;
        let density = self.density(clause);
        let landmarks: Vec<usize> = match (clause.landmarks.as_slice(), &clause.speaker) {
            ([], Some(speaker)) => self.rooms.at(speaker.pose.x_m, speaker.pose.y_m).into_iter().collect(),
            (given, _) => given.to_vec(),
        };
        let may_contain =
            matches!(clause.relation, Relation::At | Relation::In | Relation::On | Relation::Contains);
        let of = |r: usize| {
            let is_landmark = landmarks.contains(&r) && clause.speaker.is_some() && !may_contain;
            (!is_landmark).then(|| self.of_region(clause, &landmarks, r, &density))
        };
        Alternatives { regions: (0..regions.len()).map(of).collect(), none: self.of_none(clause, &landmarks) }
    }

    /// Density of the figure at each place by the factors of the path driven (15), per m².
    fn density(&self, clause: &Clause) -> Vec<f64> {
        let Some(speaker) = &clause.speaker else { return vec![0.0; self.places.len()] };
        let places: Vec<[(usize, f64); 1]> = match clause.landmarks.as_slice() {
            [] => vec![[(speaker.place as usize, 1.0)]],
            given => given.iter().map(|&r| [(self.middle_place(r, speaker), 1.0)]).collect(),
        };
        let way = clause.way || clause.landmarks.is_empty();
        let landmarks: Vec<LandmarkBelief> =
            places.iter().map(|places| LandmarkBelief { places, way }).collect();
        let (relation, frame, narrowing) = (clause.relation, clause.frame, clause.narrowing);
        let reading = Reading { weight: 1.0, relation, frame, narrowing, landmarks: &landmarks };
        densities(&[reading], self.places, speaker.place as usize)
    }

    /// The place that stands for a region: the speaker's own, or the one nearest to its middle.
    fn middle_place(&self, region: usize, speaker: &Speaker) -> usize {
        let region = &self.rooms.regions[region];
        if region.places.contains(&speaker.place) {
            return speaker.place as usize;
        }
        let (x, y) = region.middle_m;
        let far_m = |v: &Vertex| {
            let p = &self.places[*v as usize];
            (p.x_m - x).hypot(p.y_m - y)
        };
        let nearest = region.places.iter().min_by(|a, b| far_m(a).total_cmp(&far_m(b)));
        nearest.map_or(0, |&v| v as usize)
    }

    fn of_region(&self, clause: &Clause, landmarks: &[usize], r: usize, density: &[f64]) -> [f64; FEATURES] {
        let (regions, region) = (&self.rooms.regions, &self.rooms.regions[r]);
        let mut f = [0.0; FEATURES];
        f[9] = f64::from(region.shape == Shape::Corridor && !self.way);
        f[10] = self.other[r];
        f[11] = (region.area_m2 / 12.0).ln().clamp(-2.0, 2.0);
        f[19] = (region.places.len() as f64).ln();
        f[20] = f64::from(self.visited[r]);
        let Some(speaker) = &clause.speaker else { return f };
        let at = region.places.iter().map(|&v| density[v as usize]);
        let (most, sum) = at.fold((0.0_f64, 0.0), |(most, sum), d| (most.max(d), sum + d));
        f[0] = (SHARE_MIN + ROOM_M2 * most).ln();
        f[1] = (SHARE_MIN + ROOM_M2 * sum / region.places.len().max(1) as f64).ln();
        let lies: Vec<Lies> = landmarks.iter().map(|&l| Lies::of(region, &regions[l], r, l)).collect();
        if let Some(first) = lies.first() {
            // Of two landmarks what holds of both.
            let both = |of: fn(&Lies) -> f64| lies.iter().map(of).fold(of(first), f64::min);
            f[2] = both(|l| l.shared_m.min(4.0) / 4.0);
            f[3] = both(|l| (-l.gap_m / 1.5).exp());
            f[4] = both(|l| (-l.doors_m / 3.0).exp());
            f[5] = both(|l| f64::from(l.opens));
            f[6] = both(|l| (-l.facing).max(0.0) * (-l.doors_m / 4.0).exp());
            f[7] = both(|l| l.facing.max(0.0) * (-l.doors_m / 6.0).exp());
            f[8] = both(|l| (-l.middles_m / 8.0).exp());
        }
        if let [a, b] = landmarks {
            let off = |l: &usize| direction(region.middle_m, regions[*l].middle_m);
            let (u, v) = (off(a), off(b));
            f[18] = -(u.0 * v.0 + u.1 * v.1);
        }
        let first_m = region.places.first().map_or(0.0, |&v| self.places[v as usize].path_m);
        let after_m = first_m - speaker.path_m;
        f[12] = f64::from(after_m > 0.0);
        f[13] = f64::from(after_m > 0.0 && after_m < SOON_M);
        f[14] = f64::from(self.rooms.at(speaker.pose.x_m, speaker.pose.y_m) == Some(r));
        let door = nearest_door(region, (speaker.pose.x_m, speaker.pose.y_m));
        let (x, y) = (door.0 - speaker.pose.x_m, door.1 - speaker.pose.y_m);
        let (off_rad, far_m) = (wrap(y.atan2(x) - speaker.pose.yaw_rad), x.hypot(y));
        f[15] = off_rad.cos() * (-far_m / 15.0).exp();
        f[16] = (-far_m / 8.0).exp();
        f[17] = match clause.relation {
            Relation::LeftSide | Relation::RightSide => {
                let inward = direction(door, region.middle_m);
                let left = inward.1 * speaker.pose.yaw_rad.cos() - inward.0 * speaker.pose.yaw_rad.sin();
                let side = if clause.relation == Relation::LeftSide { left } else { -left };
                side * (-far_m / 15.0).exp()
            }
            _ => 0.0,
        };
        f
    }

    fn of_none(&self, clause: &Clause, landmarks: &[usize]) -> [f64; FEATURES] {
        let mut f = [0.0; FEATURES];
        f[NONE] = 1.0;
        let Some(speaker) = &clause.speaker else { return f };
        let now_m = self.places.last().map_or(0.0, |p| p.path_m);
        f[NONE + 1] = (1.0 + (now_m - speaker.path_m).max(0.0) / 30.0).ln();
        let openings = |near: &dyn Fn((f64, f64)) -> bool| {
            self.rooms.unentered.iter().filter(|(_, at)| near(*at)).count().min(4) as f64 / 4.0
        };
        let of = |l: &usize| &self.rooms.regions[*l];
        let by_landmark = |at: (f64, f64)| {
            let near = |door: &(f64, f64)| (door.0 - at.0).hypot(door.1 - at.1) < OPENING_M;
            landmarks
                .iter()
                .any(|l| of(l).doorways.iter().map(|d| d.at_m).any(|d| near(&d)) || near(&of(l).middle_m))
        };
        f[NONE + 2] = openings(&by_landmark);
        let (x, y) = (speaker.pose.x_m, speaker.pose.y_m);
        f[NONE + 3] = openings(&|at| (at.0 - x).hypot(at.1 - y) < OPENING_M);
        // How many rooms there are that bear no other name: of few, one that is described is rather none.
        let free: f64 = (0..self.other.len())
            .filter(|&r| self.rooms.regions[r].shape != Shape::Corridor)
            .map(|r| 1.0 - self.other[r])
            .sum();
        f[NONE + 4] = (1.0 + free).ln();
        f
    }
}

/// By region, whether the path once went in from where it went out to.
fn visited(rooms: &Rooms, places: usize) -> Vec<bool> {
    let mut region_of = vec![None; places];
    for (r, region) in rooms.regions.iter().enumerate() {
        region.places.iter().for_each(|&v| region_of[v as usize] = Some(r));
    }
    let mut visited = vec![false; rooms.regions.len()];
    let mut runs: Vec<usize> = region_of.into_iter().flatten().collect();
    runs.dedup();
    for run in runs.windows(3).filter(|run| run[0] == run[2]) {
        visited[run[1]] = true;
    }
    visited
}

/// How one region lies to another.
#[derive(Clone, Copy, Debug)]
struct Lies {
    /// Between their outlines.
    gap_m: f64,
    /// Of the wall that they have in common.
    shared_m: f64,
    /// Between their nearest doorways.
    doors_m: f64,
    /// Cosine between the ways in, through these.
    facing: f64,
    /// Whether one opens into the other.
    opens: bool,
    /// Between their middles.
    middles_m: f64,
}

impl Lies {
    fn of(a: &Region, b: &Region, index_a: usize, index_b: usize) -> Self {
        let (gap_m, shared_m) = apart(a, b);
        let pairs = a.doorways.iter().flat_map(|d| b.doorways.iter().map(move |e| (d, e)));
        let doors = pairs
            .filter(|(d, e)| d.to != index_b && e.to != index_a)
            .map(|(d, e)| ((d.at_m.0 - e.at_m.0).hypot(d.at_m.1 - e.at_m.1), d.at_m, e.at_m))
            .min_by(|x, y| x.0.total_cmp(&y.0));
        let (doors_m, facing) = doors.map_or((f64::INFINITY, 0.0), |(m, d, e)| {
            let (u, v) = (direction(d, a.middle_m), direction(e, b.middle_m));
            (m, u.0 * v.0 + u.1 * v.1)
        });
        Self {
            gap_m,
            shared_m,
            doors_m,
            facing,
            opens: a.doorways.iter().any(|d| d.to == index_b),
            middles_m: (a.middle_m.0 - b.middle_m.0).hypot(a.middle_m.1 - b.middle_m.1),
        }
    }
}

/// Distance of two outlines, and how much of one runs along the other.
fn apart(a: &Region, b: &Region) -> (f64, f64) {
    let bounds = |line: &[(f64, f64)]| {
        line.iter().fold([f64::MAX, f64::MAX, f64::MIN, f64::MIN], |[x0, y0, x1, y1], p| {
            [x0.min(p.0), y0.min(p.1), x1.max(p.0), y1.max(p.1)]
        })
    };
    let [x0, y0, x1, y1] = bounds(&b.polygon_m);
    let box_m = |p: (f64, f64)| {
        let (dx, dy) = ((x0 - p.0).max(p.0 - x1).max(0.0), (y0 - p.1).max(p.1 - y1).max(0.0));
        dx.hypot(dy)
    };
    let (mut gap_m, mut shared_m) = (APART_MAX_M, 0.0);
    for p in along(&a.polygon_m) {
        if box_m(p) >= gap_m.max(WALL_M) {
            continue;
        }
        let far_m = edges(&b.polygon_m).map(|(c, d)| to_segment_m(p, c, d)).fold(f64::INFINITY, f64::min);
        gap_m = gap_m.min(far_m);
        if far_m <= WALL_M {
            shared_m += STEP_M;
        }
    }
    (gap_m, shared_m)
}

fn edges(line: &[(f64, f64)]) -> impl Iterator<Item = ((f64, f64), (f64, f64))> + '_ {
    (0..line.len()).map(|k| (line[k], line[(k + 1) % line.len()]))
}

/// Points of a closed line.
fn along(line: &[(f64, f64)]) -> impl Iterator<Item = (f64, f64)> + '_ {
    edges(line).flat_map(|(a, b)| {
        let steps = ((b.0 - a.0).hypot(b.1 - a.1) / STEP_M).ceil().max(1.0);
        (0..steps as usize).map(move |k| {
            let share = k as f64 / steps;
            (a.0 + share * (b.0 - a.0), a.1 + share * (b.1 - a.1))
        })
    })
}

fn to_segment_m(p: (f64, f64), a: (f64, f64), b: (f64, f64)) -> f64 {
    let (dx, dy) = (b.0 - a.0, b.1 - a.1);
    let length2 = dx * dx + dy * dy;
    let share =
        if length2 > 0.0 { (((p.0 - a.0) * dx + (p.1 - a.1) * dy) / length2).clamp(0.0, 1.0) } else { 0.0 };
    (p.0 - a.0 - share * dx).hypot(p.1 - a.1 - share * dy)
}

/// Where a region is entered by who comes from a point; its middle, if nobody knows.
fn nearest_door(region: &Region, from: (f64, f64)) -> (f64, f64) {
    let far_m = |at: &(f64, f64)| (at.0 - from.0).hypot(at.1 - from.1);
    let doors = region.doorways.iter().map(|d| d.at_m);
    doors.min_by(|a, b| far_m(a).total_cmp(&far_m(b))).unwrap_or(region.middle_m)
}

/// Unit vector to `b` from `a`; of one point none, so (0, 0).
fn direction(a: (f64, f64), b: (f64, f64)) -> (f64, f64) {
    let (dx, dy) = (b.0 - a.0, b.1 - a.1);
    let length_m = dx.hypot(dy);
    if length_m > 1e-6 { (dx / length_m, dy / length_m) } else { (0.0, 0.0) }
}
