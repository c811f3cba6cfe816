//! One robot's streams, up to the places they make: odometry and scans in, frozen places out.
//!
//! ```text
//! Odom ─▶ odometry ─┬─▶ waiting scans, swept (scan/sweep) ─▶ front: registration to the local map
//! Scan ─────────────┘                                        │ wheels learns what odometry gets wrong
//!                                                            ▼ a place each metre, frozen when left
//! ```

pub mod front;
mod local;
pub mod odometry;
pub mod places;
mod wheels;

use crate::effects::{Effect, Effects};
use crate::event::{Laser, Odom, Scan, Setup, StampNs};
use crate::geometry::Pose2;
use crate::scan::sweep::sweep;
use crate::track::front::FrontEnd;
use crate::track::odometry::{Odometry, Step};
use crate::track::places::FrozenPlace;
use serde::{Deserialize, Serialize};
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
    lasers: BTreeMap<String, Laser>,
    odometry: Odometry,
    waiting: VecDeque<Scan>,
    scans: u64,
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
        }
    }

    /// Takes its lasers; comes before its first scan and may come again.
    pub fn set_up(&mut self, setup: Setup) {
        self.lasers = setup.lasers.into_iter().map(|l| (l.id.clone(), l)).collect();
    }

    /// Takes odometry. Where it breaks, a new segment begins.
    pub fn odom(&mut self, odom: &Odom, effects: &mut Effects) {
        if let Step::Broken(reason) = self.odometry.push(odom) {
            // What still waits belongs to the old segment, whose odometry is gone.
            for scan in self.waiting.drain(..) {
                let reason = "odometry broke before it covered the sweep".to_owned();
                effects.push(Effect::ScanDropped { stamp_ns: scan.stamp_ns, reason });
            }
            self.front.break_odometry();
            effects.push(Effect::SegmentBegan { stamp_ns: odom.stamp_ns, reason });
        }
    }

    /// Takes a scan, to wait for its odometry.
    pub fn scan(&mut self, scan: Scan, effects: &mut Effects) {
        if self.lasers.contains_key(&scan.laser) {
            self.waiting.push_back(scan);
        } else {
            let reason = format!("laser {:?} was never set up", scan.laser);
            effects.push(Effect::ScanDropped { stamp_ns: scan.stamp_ns, reason });
        }
    }

    /// The next scan that odometry brackets, or whose time is up. `now_ns` None: whichever is next.
    pub fn next_due(&mut self, now_ns: Option<StampNs>) -> Option<Scan> {
        let end_ns = sweep_end_ns(self.waiting.front()?);
        let bracketed = self.odometry.newest_ns().is_some_and(|newest| newest >= end_ns);
        let late = now_ns.is_none_or(|now| now.saturating_sub(end_ns) > WAIT_NS);
        if bracketed || late || self.waiting.len() > WAITING_MAX { self.waiting.pop_front() } else { None }
    }

    /// Registers a scan to the local map.
    pub fn place(&mut self, scan: &Scan, effects: &mut Effects) -> Option<Placed> {
        let stamp_ns = scan.stamp_ns;
        let Some(odom_from_body) = self.odometry.at(stamp_ns) else {
            effects.push(Effect::ScanDropped { stamp_ns, reason: "no odometry yet".to_owned() });
            return None;
        };
        let laser = self.lasers.get(&scan.laser)?;
        let odometry = &self.odometry;
        let motion = |dt_s: f64| {
            odometry
                .at(stamp_ns.saturating_add((dt_s * 1e9) as i64))
                .map_or(Pose2::default(), |p| odom_from_body.between(&p))
        };
        let placed = self.front.scan(stamp_ns, odom_from_body, sweep(scan, laser, motion));
        let (place, place_from_body) = (placed.place, placed.place_from_body);
        let scan = self.scans;
        effects.push(Effect::ScanPlaced { scan, stamp_ns, place, place_from_body, odom_from_body });
        self.scans += 1;
        if placed.began {
            effects.push(Effect::PlaceBegan { place, stamp_ns });
        }
        let places::Placed { began, frozen, new_from_old, .. } = placed;
        Some(Placed { began, frozen, odom_from_body, new_from_old })
    }
}

fn sweep_end_ns(scan: &Scan) -> StampNs {
    let beams = scan.ranges_m.len().saturating_sub(1) as f64;
    scan.stamp_ns.saturating_add((scan.time_increment_s.max(0.0) * beams * 1e9) as i64)
}
