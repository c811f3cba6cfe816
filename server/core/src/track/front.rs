//! The front end: every scan against the recent ones, shared by all particles.
//!
//! An iterated Kalman filter on the body's pose in a local map: odometry predicts, registration
//! to the scans of the last metres of path corrects. Its frame drifts; only its increments are
//! used: the chain edges between successive places and each scan's pose in its place. Odometry is
//! calibrated meanwhile (`track/wheels.rs`), and carries the robot over stretches where the laser
//! sees nothing; the local maps on both sides are then tied as a whole (`front/bridge.rs`).

use self::anew::is_still;
use self::bridge::Dark;
use self::contrast::Contrast;
use self::registration::Stood;
use self::trust::Trust;
use crate::edge::PlaceId;
use crate::event::StampNs;
use crate::geometry::Pose2;
use crate::scan::align::SIGMA_M;
use crate::scan::place::Content;
use crate::scan::sweep::Sweep;
use crate::track::local::LocalMap;
use crate::track::mounting::Mismounted;
use crate::track::places::{Chain, FrozenPlace, OpenPlace, Placed};
use crate::track::wheels::{Drift, Step, Wheels};
use nalgebra::{Matrix3, Vector3};
use serde::{Deserialize, Serialize};
use std::collections::VecDeque;

/// The local map reaches back so far along the path; nearer places are no loop candidates.
pub const LOCAL_PATH_M: f64 = 10.0;
/// A place's content reaches so far to either side along the path.
const CONTENT_REACH_M: f64 = 2.5;
/// A break of odometry longer than this may hide that the robot was carried off.
const CARRIED_NS: i64 = 3_000_000_000;
/// Path is counted in strides: what jitters at rest goes nowhere.
const STRIDE_M: f64 = 0.05;
/// A scan of fewer points sees nothing.
const SEEN_MIN: usize = 10;
/// So much path without a look at anything is a blind stretch.
const DARK_PATH_M: f64 = 3.0;
/// After so much path in the dark, a pose known no better than this must not be registered to the
/// local map: a fit would be taken for the truth.
const VAGUE_PATH_M: f64 = 2.0;
const VAGUE_M: f64 = 0.15;
const VAGUE_RAD: f64 = 0.07;
/// Of an edge's path so much without a look at anything makes it one of the dark.
const UNSEEN_SHARE: f64 = 0.5;
/// What each end of an increment, and the slow bend of the local map, add to it per root metre of
/// path, as a multiple of the roughness. From simulated offices, where this is three to five times too wide
/// (example `drives` of the server), and a real log, where it just covers: clutter errs more than noise does.
const BEND: Vector3<f64> = Vector3::new(0.2, 0.2, 0.05);

/// How fast the usual time from scan to scan is learned; longer ones are gaps.
const PERIOD_GAIN: f64 = 0.05;
const PERIOD_MAX_S: f64 = 2.0;
/// φ of a stretch of which nothing speaks: one in ten kilometres.
const FAILED_MIN: f64 = 1e-4;

/// A scan in the local map.
#[derive(Clone, Debug, Serialize, Deserialize)]
struct Key {
    front_from_body: Pose2,
    path_m: f64,
    sweep: Sweep,
}

/// State of the front end.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct FrontEnd {
    spacing_m: f64,
    next_place: PlaceId,
    /// Frame of the newest place, open or frozen.
    newest_place: Pose2,
    front_from_body: Pose2,
    odom_from_body: Option<Pose2>,
    /// Of the newest scan.
    stamp_ns: StampNs,
    /// Usual time from scan to scan.
    period_s: f64,
    path_m: f64,
    /// Where the last stride ended.
    stride_from: Pose2,
    wheels: Wheels,
    trust: Trust,
    contrast: Contrast,
    /// Distance of what is seen from the local map's surfaces, root mean square.
    rough_m: f64,
    /// Share of a scan's points that usually lie on known surfaces.
    usual_share: f64,
    /// What the pose in the local map is off by.
    in_map: Drift,
    /// What the pose relative to the last place is off by.
    since_place: Drift,
    /// φ of the path since the last place.
    failed: f64,
    /// Odometry broke: the next scan begins a new local map.
    broken: bool,
    /// The local map was begun anew: the next place is tied to the last by next to nothing.
    fresh: bool,
    keys: VecDeque<Key>,
    open: VecDeque<OpenPlace>,
    /// A blind stretch that is not dealt with yet.
    dark: Option<Dark>,
    /// The local map; a function of `keys`.
    #[serde(skip)]
    local: Option<LocalMap>,
}

impl FrontEnd {
    /// An empty track; a place each `spacing_m` of path.
    pub fn new(spacing_m: f64) -> Self {
        Self {
            spacing_m,
            next_place: 0,
            newest_place: Pose2::default(),
            front_from_body: Pose2::default(),
            odom_from_body: None,
            stamp_ns: 0,
            period_s: 0.0,
            path_m: 0.0,
            stride_from: Pose2::default(),
            wheels: Wheels::default(),
            trust: Trust::default(),
            contrast: Contrast::default(),
            rough_m: SIGMA_M,
            usual_share: 1.0,
            in_map: Drift::default(),
            since_place: Drift::default(),
            failed: FAILED_MIN,
            broken: false,
            fresh: false,
            keys: VecDeque::new(),
            open: VecDeque::new(),
            dark: None,
            local: None,
        }
    }

    /// What happened since the last place may be something else than what is said of it, with a probability.
    pub(crate) fn doubt(&mut self, failed: f64) {
        self.failed = self.failed.max(failed);
    }

    /// Odometry restarted or jumped: the next increment means nothing.
    pub fn break_odometry(&mut self) {
        self.broken = self.odom_from_body.is_some();
    }

    /// Places not yet frozen, oldest first.
    pub fn open_places(&self) -> impl Iterator<Item = &OpenPlace> {
        self.open.iter()
    }

    /// The body in the front end's frame.
    pub fn front_from_body(&self) -> Pose2 {
        self.front_from_body
    }

    /// Covariance of the body relative to the place held.
    pub fn since_place(&self) -> Matrix3<f64> {
        self.since_place.covariance(&self.wheels)
    }

    /// Stamp of the newest scan; none before the first.
    pub fn newest_ns(&self) -> Option<StampNs> {
        self.odom_from_body.map(|_| self.stamp_ns)
    }

    /// Path since the scans last told the pose.
    pub fn unseen_m(&self) -> f64 {
        self.wheels.unseen_m()
    }

    /// Whether odometry stands still while scans move.
    pub fn wheels_stand_still(&self) -> bool {
        self.contrast.stands_still()
    }

    /// How the laser is mounted, by what wheels and scans say in the long run; none if as it is taken to be, or as long
    /// as nobody knows where the robot is.
    pub fn mismounted(&self) -> Option<Mismounted> {
        self.contrast.mismounted().filter(|_| self.dark.is_none() && !self.broken)
    }

    /// How wheels and scans contradict each other in the long run; none if they do not.
    pub fn contradiction(&self) -> Option<String> {
        self.contrast.contradiction()
    }

    /// Whether the newest motion is odometry's alone, too far to be a scan or two that failed.
    pub fn sees_nothing(&self) -> bool {
        self.unseen_m() > UNSEEN_SHARE * self.spacing_m
    }

    /// Takes a scan with the odometry at its stamp.
    pub fn scan(&mut self, stamp_ns: StampNs, odom_from_body: Pose2, sweep: Sweep) -> Placed {
        let mut frozen = Vec::new();
        let blind = sweep.points.len() < SEEN_MIN;
        if std::mem::take(&mut self.broken) {
            let carried = stamp_ns.saturating_sub(self.stamp_ns).saturating_abs() > CARRIED_NS;
            let dt_s = self.since_s(stamp_ns);
            let stood = self.stands(dt_s);
            if carried || !self.resume(&sweep, &stood) {
                frozen = self.start_over();
            }
        } else if let Some(before) = self.odom_from_body {
            let dt_s = self.since_s(stamp_ns);
            let increment = before.between(&odom_from_body);
            let stood = self.predict(&increment, dt_s);
            // Nothing was seen for a while in which wheels stood still: they stand still, too, when somebody carries it.
            let carried = stamp_ns.saturating_sub(self.stamp_ns) > CARRIED_NS && is_still(&increment, dt_s);
            if !blind && self.trust.is_adrift() {
                if !self.resume(&sweep, &Stood { dt_s: self.trust.unseen_s(), ..stood }) {
                    frozen = self.start_over();
                }
                self.trust.settle();
            } else if !blind && (self.is_dark() || self.is_vague()) {
                self.land();
                frozen = self.freeze(self.path_m);
                self.clear_local();
            } else if !carried || blind {
                self.correct(&sweep, &stood);
            } else if !self.resume(&sweep, &stood) {
                frozen = self.start_near(dt_s);
            }
        }
        (self.odom_from_body, self.stamp_ns) = (Some(odom_from_body), stamp_ns);
        self.stride();
        // In the dark, places begin only after some path: until then one edge spans it, and what the
        // next scan says of it is exactly what it is worth.
        let hold = blind && !self.open.is_empty() && self.wheels.unseen_m() < DARK_PATH_M;
        if blind && !hold && !self.is_dark() {
            self.go_dark();
        }
        let began = !hold && self.keep_place(stamp_ns, &self.wheels.blur(&sweep.moved));
        if !blind {
            self.keep_key(sweep);
        }
        let old = self.front_from_body;
        if began {
            self.bridge();
        }
        let new = self.front_from_body;
        if new != old {
            self.stride_from = new;
        }
        let new_from_old = (new != old).then(|| new.compose(&old.inverse()));
        frozen.extend(self.freeze(self.path_m - CONTENT_REACH_M));
        let (place, place_from_body) = self
            .open
            .back()
            .map_or((0, Pose2::default()), |p| (p.id, p.front_from_place.between(&self.front_from_body)));
        Placed { place, place_from_body, began, frozen, new_from_old }
    }

    /// Freezes every place that began at or before a point of the path.
    pub fn freeze(&mut self, path_m: f64) -> Vec<FrozenPlace> {
        let mut frozen = Vec::new();
        let all = path_m == f64::INFINITY;
        // The place held must stay, to hold the next scans.
        let may = |front: &Self, p: &OpenPlace| {
            p.path_m <= path_m && front.open.len() > 1 && !front.is_held_back(p.id)
        };
        while self.open.front().is_some_and(|p| all || may(self, p)) {
            let Some(open) = self.open.pop_front() else { break };
            let near = |k: &&Key| (k.path_m - open.path_m).abs() <= CONTENT_REACH_M;
            let content = content(self.keys.iter().filter(near), &open.front_from_place);
            frozen.push(FrozenPlace { open, content });
        }
        if all {
            self.dark = None;
        }
        frozen
    }

    /// Moves the body as wheels say, or if these are not believed as scans last saw it move.
    fn predict(&mut self, increment: &Pose2, dt_s: f64) -> Stood {
        let mut step = self.wheels.drive(increment, dt_s);
        self.contrast.drive(increment);
        let front_from_body = self.front_from_body;
        let mut in_map = self.in_map;
        in_map.drive(&step);
        let stood = Stood {
            by_wheels: front_from_body.compose(&step.motion),
            spread: in_map.covariance(&self.wheels),
            ..self.stands(dt_s)
        };
        let (motion, noise) = self.trust.pass(dt_s, *increment != Pose2::default());
        if self.trust.is_lost() {
            step = Step::guess(motion, noise);
        }
        self.in_map.drive(&step);
        self.since_place.drive(&step);
        self.drive_dark(&step);
        self.front_from_body = front_from_body.compose(&step.motion);
        stood
    }

    /// Where the body is, with the next scan so much later.
    fn stands(&self, dt_s: f64) -> Stood {
        let known = self.in_map.covariance(&self.wheels);
        let front_from_body = self.front_from_body;
        Stood { front_from_body, dt_s, by_wheels: front_from_body, spread: known, known }
    }

    /// Time since the scan before, never much less than usual: stamps jitter.
    fn since_s(&mut self, stamp_ns: StampNs) -> f64 {
        let dt_s = stamp_ns.saturating_sub(self.stamp_ns).max(0) as f64 * 1e-9;
        self.period_s += PERIOD_GAIN * (dt_s.min(PERIOD_MAX_S) - self.period_s);
        dt_s.max(0.5 * self.period_s)
    }

    fn stride(&mut self) {
        let stride_m = self.stride_from.distance_m(&self.front_from_body);
        if stride_m >= STRIDE_M {
            self.path_m += stride_m;
            self.stride_from = self.front_from_body;
        }
    }

    /// Whether the robot drove on blindly until its pose in the local map was too uncertain for a
    /// fit there to be believed.
    fn is_vague(&self) -> bool {
        let covariance = self.in_map.covariance(&self.wheels);
        let (d2, yaw2) = (covariance[(0, 0)].max(covariance[(1, 1)]), covariance[(2, 2)]);
        self.wheels.unseen_m() > VAGUE_PATH_M && (d2 > VAGUE_M.powi(2) || yaw2 > VAGUE_RAD.powi(2))
    }

    /// Begins a place where the last one is far enough behind; its frame is off by the `blur` of the scan that it begins
    /// with.
    fn keep_place(&mut self, stamp_ns: StampNs, blur: &Matrix3<f64>) -> bool {
        let last = self.open.back();
        if last.is_some_and(|p| self.path_m - p.path_m < self.spacing_m) {
            return false;
        }
        let broken = std::mem::take(&mut self.fresh);
        let previous_from_this = self.newest_place.between(&self.front_from_body);
        self.newest_place = self.front_from_body;
        let d_m = last.map_or(0.0, |p| self.path_m - p.path_m);
        let unseen = self.unseen_m() > UNSEEN_SHARE * d_m;
        let bend = Matrix3::from_diagonal(&BEND.component_mul(&BEND)) * ((1.0 + d_m) * self.rough_m.powi(2));
        let in_the_dark = self.ends_in_the_dark(self.next_place);
        // Systematic errors in the dark add up over all of it, and are dealt out once it is over.
        let driven = if in_the_dark { self.since_place.noise } else { self.since_place() };
        let information = (driven + bend).try_inverse().unwrap_or_else(Matrix3::identity);
        let chain = Chain {
            previous_from_this,
            information,
            broken,
            unseen,
            failed: std::mem::replace(&mut self.failed, FAILED_MIN),
        };
        self.open.push_back(OpenPlace {
            id: self.next_place,
            stamp_ns,
            front_from_place: self.front_from_body,
            path_m: self.path_m,
            chain,
        });
        self.next_place += 1;
        self.since_place = Drift::of(Matrix3::from_diagonal(&Vector3::new(1e-6, 1e-6, 1e-7)) + blur);
        if in_the_dark {
            self.deal_out(driven + bend);
        }
        true
    }
}

/// What some scans show, in a frame.
fn content<'a>(keys: impl Iterator<Item = &'a Key>, front_from_frame: &Pose2) -> Content {
    let sweeps: Vec<_> = keys.map(|k| (front_from_frame.between(&k.front_from_body), &k.sweep)).collect();
    Content::new(&sweeps)
}

mod anew;
mod bridge;
mod contrast;
mod keys;
mod registration;
mod search;
#[cfg(test)]
mod tests;
mod trust;
