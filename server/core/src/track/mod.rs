//! One robot's streams, up to the places they make: odometry and scans in, frozen places out.
//!
//! ```text
//! Odom ─▶ odometry ─┬─▶ waiting scans, swept (scan/sweep) ─▶ front: registration to the local map
//! Scan ─────────────┘                                        │ wheels learns what odometry gets wrong
//!                                                            ▼ a place each metre, frozen when left
//! ```

pub mod front;
mod local;
mod looks;
mod mounting;
pub mod odometry;
pub mod places;
mod wheels;

use crate::effects::{Effect, Effects, Suspicion};
use crate::event::{Laser, Odom, Scan, Setup, StampNs};
use crate::geometry::Pose2;
use crate::scan::sweep::{Sweep, sweep};
use crate::track::front::FrontEnd;
use crate::track::looks::Looks;
use crate::track::mounting::Mounted;
use crate::track::odometry::{Odometry, Step};
use crate::track::places::FrozenPlace;
use serde::{Deserialize, Serialize};
use std::collections::btree_map::Entry;
use std::collections::{BTreeMap, VecDeque};

/// Scans that wait for odometry to bracket their sweep.
const WAITING_MAX: usize = 64;
/// A scan waits for odometry no longer than this, in stamps of the odometry or of later scans.
const WAIT_NS: i64 = 500_000_000;

/// The robot's streams, up to the places they make.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Track {
    /// Its local map and the places not left yet.
    pub front: FrontEnd,
    lasers: BTreeMap<String, Mounted>,
    odometry: Odometry,
    waiting: VecDeque<Waiting>,
    scans: u64,
    /// Of each laser.
    looks: BTreeMap<String, Looks>,
    /// What was told of its senses.
    suspected: BTreeMap<Suspicion, String>,
}

/// A scan that waits for odometry.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Waiting {
    /// As it came.
    pub scan: Scan,
    /// When it was taken, by odometry's clock.
    taken_ns: StampNs,
}

/// What came of a scan that found its pose.
pub struct Placed {
    /// Whether a new place began with it.
    pub began: bool,
    /// Places left for good by it.
    pub frozen: Vec<FrozenPlace>,
    /// Odometry at the scan.
    pub odom_from_body: Pose2,
    /// How the body's pose in the front end's frame was corrected without a motion, if it was.
    pub new_from_old: Option<Pose2>,
}

impl Track {
    /// A robot that has not moved yet; its places come `place_spacing_m` apart.
    pub fn new(place_spacing_m: f64) -> Self {
        Self {
            front: FrontEnd::new(place_spacing_m),
            lasers: BTreeMap::new(),
            odometry: Odometry::default(),
            waiting: VecDeque::new(),
            scans: 0,
            looks: BTreeMap::new(),
            suspected: BTreeMap::new(),
        }
    }

    /// Takes its lasers; comes before its first scan and may come again.
    pub fn set_up(&mut self, setup: Setup) {
        let before = std::mem::take(&mut self.lasers);
        let mounted = |said: Laser| (said.id.clone(), Mounted::new(said.clone(), before.get(&said.id)));
        self.lasers = setup.lasers.into_iter().map(mounted).collect();
    }

    /// Takes odometry. Where it breaks, a new segment begins.
    pub fn odom(&mut self, odom: &Odom, effects: &mut Effects) {
        if let Step::Broken(reason) = self.odometry.push(odom) {
            // What still waits belongs to the old segment, whose odometry is gone.
            for Waiting { scan, .. } in self.waiting.drain(..) {
                let reason = "odometry broke before it covered the sweep".to_owned();
                effects.push(Effect::ScanDropped { stamp_ns: scan.stamp_ns, reason });
            }
            self.front.break_odometry();
            effects.push(Effect::SegmentBegan { stamp_ns: odom.stamp_ns, reason });
        }
    }

    /// Takes a scan, to wait for its odometry.
    pub fn scan(&mut self, mut scan: Scan, effects: &mut Effects) {
        if let Some(laser) = self.lasers.get(&scan.laser).map(Mounted::laser) {
            let looks = self.looks.entry(scan.laser.clone()).or_default();
            if looks.sends_millimetres(&scan, laser.range_min_m, laser.range_max_m) {
                scan.ranges_m.iter_mut().for_each(|range| *range /= 1000.0);
                self.suspect(scan.stamp_ns, Suspicion::Millimetres, effects, || {
                    format!(
                        "ranges of laser {:?} are far beyond its reach: they are taken for millimetres",
                        scan.laser
                    )
                });
            }
            let looks = self.looks.entry(scan.laser.clone()).or_default();
            let (taken_ns, apart_ns) = looks.taken_ns(&scan, self.odometry.arrived_ns());
            if let Some(apart_ns) = apart_ns {
                let (s, laser) = (apart_ns as f64 * 1e-9, &scan.laser);
                let side = if s > 0.0 { "behind" } else { "ahead of" };
                self.suspect(scan.stamp_ns, Suspicion::Clocks, effects, || {
                    let s = s.abs();
                    format!("stamps of laser {laser:?} are {s:.1} s {side} odometry's: the newest odometry is used")
                });
            }
            self.waiting.push_back(Waiting { scan, taken_ns });
        } else {
            let reason = format!("laser {:?} was never set up", scan.laser);
            effects.push(Effect::ScanDropped { stamp_ns: scan.stamp_ns, reason });
        }
    }

    /// The next scan that odometry brackets, or whose time is up. `now_ns` None: whichever is next.
    pub fn next_due(&mut self, now_ns: Option<StampNs>) -> Option<Waiting> {
        let end_ns = sweep_end_ns(self.waiting.front()?);
        let bracketed = self.odometry.newest_ns().is_some_and(|newest| newest >= end_ns);
        let wait_ns = WAIT_NS.max((1.5e9 * self.odometry.period_s()) as i64);
        let late = now_ns.is_none_or(|now| now.saturating_sub(end_ns) > wait_ns);
        if bracketed || late || self.waiting.len() > WAITING_MAX { self.waiting.pop_front() } else { None }
    }

    /// Registers a scan to the local map.
    pub fn place(&mut self, waiting: &Waiting, effects: &mut Effects) -> Option<Placed> {
        let Waiting { scan, taken_ns } = waiting;
        let stamp_ns = scan.stamp_ns;
        let Some(odom_from_body) = self.odometry.at(*taken_ns) else {
            effects.push(Effect::ScanDropped { stamp_ns, reason: "no odometry yet".to_owned() });
            return None;
        };
        let laser = self.lasers.get(&scan.laser)?.laser();
        let odometry = &self.odometry;
        let motion = |dt_s: f64| {
            odometry
                .at(taken_ns.saturating_add((dt_s * 1e9) as i64))
                .map_or(Pose2::default(), |p| odom_from_body.between(&p))
        };
        let mut seen = sweep(scan, laser, motion);
        let range_max_m = laser.range_max_m;
        self.look(scan, range_max_m, &odom_from_body, &mut seen, effects);
        let placed = self.front.scan(stamp_ns, odom_from_body, seen);
        let remounted = self.compare(stamp_ns, effects);
        let (place, place_from_body) = (placed.place, placed.place_from_body);
        let scan = self.scans;
        effects.push(Effect::ScanPlaced { scan, stamp_ns, place, place_from_body, odom_from_body });
        self.scans += 1;
        if placed.began {
            effects.push(Effect::PlaceBegan { place, stamp_ns });
        }
        let places::Placed { began, frozen, new_from_old, .. } = placed;
        let new_from_old = remounted.map(|r| r.compose(&new_from_old.unwrap_or_default())).or(new_from_old);
        Some(Placed { began, frozen, odom_from_body, new_from_old })
    }

    /// Looks whether a scan is a look at anything; one that is not shows nothing.
    fn look(&mut self, scan: &Scan, range_max_m: f64, odom: &Pose2, seen: &mut Sweep, effects: &mut Effects) {
        let laser = &scan.laser;
        let looks = self.looks.entry(laser.clone()).or_default();
        // Of nothing at all there is only one picture.
        let is_frozen = looks.is_frozen(scan, odom) && !seen.points.is_empty();
        let is_blind = looks.is_blind(seen.points.len(), odom);
        if is_frozen {
            seen.points.clear();
            self.suspect(scan.stamp_ns, Suspicion::Frozen, effects, || {
                format!("laser {laser:?} repeats one scan, bit by bit, while the robot drives")
            });
        } else if is_blind {
            self.suspect(scan.stamp_ns, Suspicion::Blind, effects, || {
                let finite = scan.ranges_m.iter().copied().filter(|r| r.is_finite());
                let nearest_m = finite.fold(f32::INFINITY, f32::min);
                let units = if nearest_m.is_finite() && f64::from(nearest_m) > 2.0 * range_max_m {
                    format!("; the nearest is at {nearest_m:.0} m: are they millimetres?")
                } else {
                    String::new()
                };
                format!("laser {laser:?} sees nothing within its range of {range_max_m} m{units}")
            });
        }
    }

    /// Whether scans and wheels agree in the long run. How the pose in the front end's frame jumps if they do once a
    /// laser is taken for mounted otherwise.
    fn compare(&mut self, stamp_ns: StampNs, effects: &mut Effects) -> Option<Pose2> {
        let mut jump = None;
        if self.odometry.is_stale() {
            let s = self.odometry.period_s();
            self.suspect(stamp_ns, Suspicion::Stale, effects, || {
                format!("odometry repeats each pose for {s:.1} s: what is between is interpolated")
            });
        }
        if let Some(mismounted) = self.front.mismounted()
            // Of several nobody knows which.
            && let [(laser, mounted)] = &mut self.lasers.iter_mut().collect::<Vec<_>>()[..]
            && let Some(moved) = mounted.mend(&mismounted)
        {
            jump = Some(self.front.remount(&moved));
            let why = format!("{} Laser {laser:?} is taken for that", mismounted.why());
            // Told again each time: what it is taken for is another mounting now.
            self.suspected.remove(&Suspicion::Mounting);
            self.suspect(stamp_ns, Suspicion::Mounting, effects, || why);
        } else if self.front.wheels_stand_still() {
            self.suspect(stamp_ns, Suspicion::Still, effects, || {
                "odometry stands still while scans move: they alone tell the way".to_owned()
            });
        } else if let Some(why) = self.front.contradiction() {
            self.suspect(stamp_ns, Suspicion::Contradiction, effects, || why);
        }
        jump
    }

    /// Tells of each kind once.
    fn suspect(
        &mut self,
        stamp_ns: StampNs,
        what: Suspicion,
        effects: &mut Effects,
        why: impl FnOnce() -> String,
    ) {
        if let Entry::Vacant(entry) = self.suspected.entry(what) {
            let why = entry.insert(why()).clone();
            effects.push(Effect::Suspected { stamp_ns, what, why });
        }
    }

    /// What was told of the robot's senses.
    pub fn suspicions(&self) -> impl Iterator<Item = &str> {
        self.suspected.values().map(String::as_str)
    }
}

fn sweep_end_ns(Waiting { scan, taken_ns }: &Waiting) -> StampNs {
    taken_ns.saturating_add((scan.takes_s() * 1e9) as i64)
}
