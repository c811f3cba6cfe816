//! Places as the front end hands them on: seen still, or left behind; and the chain between them.

use crate::edge::PlaceId;
use crate::event::StampNs;
use crate::geometry::Pose2;
use crate::scan::place::Content;
use nalgebra::Matrix3;
use serde::{Deserialize, Serialize};

/// A place whose surroundings are still being seen.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct OpenPlace {
    /// Its id.
    pub id: PlaceId,
    /// Stamp of its first scan.
    pub stamp_ns: StampNs,
    /// Its frame in the front end's.
    pub front_from_place: Pose2,
    /// Path travelled when it began.
    pub path_m: f64,
    /// The chain edge from the place before.
    pub chain: Chain,
}

/// The edge from a place to the next.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Chain {
    /// The next place in the frame of the one before.
    pub previous_from_this: Pose2,
    /// Its information, right perturbation.
    pub information: Matrix3<f64>,
    /// Whether odometry broke between the two: they are tied by next to nothing.
    pub broken: bool,
    /// Whether no scan ties the two, but odometry alone.
    pub unseen: bool,
    /// φ: probability that it says something else than what happened.
    pub failed: f64,
}

/// A place that is left behind: it may now be matched.
#[derive(Clone, Debug)]
pub struct FrozenPlace {
    /// Id, stamp, frame, chain.
    pub open: OpenPlace,
    /// What it looks like.
    pub content: Content,
}

/// What became of a scan.
#[derive(Clone, Debug)]
pub struct Placed {
    /// The place held.
    pub place: PlaceId,
    /// The body in its frame.
    pub place_from_body: Pose2,
    /// Whether the place began with this scan.
    pub began: bool,
    /// Places that this scan froze, oldest first.
    pub frozen: Vec<FrozenPlace>,
    /// How the body's pose in the front end's frame was corrected without a motion, if it was: a blind
    /// stretch was bridged.
    pub new_from_old: Option<Pose2>,
}
