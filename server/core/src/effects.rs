//! What an event brought about: the one source of reports, feedback and debugging.

use crate::edge::{EdgeKind, PlaceId, Proposal};
use crate::event::StampNs;
use crate::geometry::Pose2;
use nalgebra::Matrix3;
use serde::{Deserialize, Serialize};

/// What one [`crate::Mapper::step`] brought about, in order.
pub type Effects = Vec<Effect>;

/// How well the robot knows where it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum TrackState {
    /// The map grows.
    Mapping,
    /// The map is kept, the robot found in it.
    Localised,
    /// The pose told may be wrong: less than 95 % of the posterior is within 1 m and 10° of it.
    Doubtful,
    /// It more likely is: less than half of the posterior is.
    Lost,
}

/// What may be wrong with a robot's senses.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Suspicion {
    /// A laser's stamps are of another clock than odometry's.
    Clocks,
    /// A laser repeats one scan while the robot moves.
    Frozen,
    /// A laser's ranges are taken for millimetres.
    Millimetres,
    /// A laser has seen nothing within its range for some metres.
    Blind,
    /// Odometry repeats each pose until there is a newer one.
    Stale,
    /// Odometry stands still while scans move.
    Still,
    /// A laser is taken for mounted otherwise than setup says.
    Mounting,
    /// Scans and wheels contradict each other in the long run.
    Contradiction,
}

/// What became of a sentence.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum HeardStatus {
    /// It changed the map, or would have, were it not a repetition.
    Understood,
    /// The guide is asked first, see [`Heard::question`].
    Asked,
    /// Nothing changed.
    NotUnderstood,
    /// It was understood but can't be used (no place yet, a full ledger, language off).
    Refused,
}

/// What became of a sentence, for the guide and for the report.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Heard {
    /// The utterance's id.
    pub id: String,
    /// When it began.
    pub stamp_ns: StampNs,
    /// What was said.
    pub text: String,
    /// What became of it.
    pub status: HeardStatus,
    /// The analysis, in the notation of `language/notation.rs`; empty if there is none.
    pub parse: String,
    /// Where it was put in the best particle: place and probability, best first.
    pub grounded: Vec<(PlaceId, f64)>,
    /// In words, for the guide.
    pub words: String,
    /// What the guide is asked: yes or no. It is said in the words, too.
    pub question: Option<String>,
}

/// One consequence of an event.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Effect {
    /// A scan found its pose relative to a place; final (only the place still moves).
    ScanPlaced {
        /// Scans of this map so far, counted from 0 in the order of their events.
        scan: u64,
        /// The scan's stamp.
        stamp_ns: StampNs,
        /// The place held.
        place: PlaceId,
        /// The body in that place's frame.
        place_from_body: Pose2,
        /// Odometry at the scan.
        odom_from_body: Pose2,
    },
    /// The robot's pose in the best particle, after every scan.
    Tracked {
        /// The scan's stamp.
        stamp_ns: StampNs,
        /// Pose in the map.
        map_from_body: Pose2,
        /// Correction of odometry (REP-105).
        map_from_odom: Pose2,
        /// Covariance of `map_from_body`.
        covariance: Matrix3<f64>,
        /// Whether to believe it.
        state: TrackState,
    },
    /// A new place began.
    PlaceBegan {
        /// Its id.
        place: PlaceId,
        /// Stamp of its first scan.
        stamp_ns: StampNs,
    },
    /// A scan was dropped, and why.
    ScanDropped {
        /// Its stamp.
        stamp_ns: StampNs,
        /// Why.
        reason: String,
    },
    /// An edge entered the graph of `weight` of the posterior.
    EdgeAccepted {
        /// Older place.
        i: PlaceId,
        /// Newer place.
        j: PlaceId,
        /// How it was proposed.
        kind: EdgeKind,
        /// Posterior weight of the particles that took it.
        weight: f64,
        /// The figures behind it.
        reason: String,
    },
    /// An edge was looked at and refused by every particle.
    EdgeRefused {
        /// Older place.
        i: PlaceId,
        /// Newer place.
        j: PlaceId,
        /// How it was proposed.
        kind: EdgeKind,
        /// "edge 41–7 refused: score .31 < .45".
        reason: String,
    },
    /// A sentence was dealt with.
    Heard(Heard),
    /// An operator's command was carried out, or why not: in words.
    Mended(Result<String, String>),
    /// A place is in the graph of every particle: the last effect of its step.
    Weighed {
        /// The place.
        place: PlaceId,
        /// Stamp of its first scan.
        stamp_ns: StampNs,
        /// The older places that were proposed, each with the largest probability that a particle gives
        /// it; of many the likeliest are matched, and the others wait.
        proposed: Vec<Proposal>,
        /// Weight of each distinct graph, best first; with `unresolved` they sum to one.
        weights: Vec<f64>,
        /// Posterior mass of graphs that were dropped.
        unresolved: f64,
        /// Effective sample size among those kept.
        effective_sample_size: f64,
    },
    /// How well the robot knows where it is has changed. Comes with the first scan, too.
    StateChanged {
        /// Stamp of the newest scan.
        stamp_ns: StampNs,
        /// From now on.
        state: TrackState,
        /// In words.
        why: String,
    },
    /// The map's coordinates jumped: the robot's own pose in the map is another one without a motion.
    Jumped {
        /// `epoch` after the jump.
        epoch: u64,
        /// New map frame from old, through the robot's current pose.
        new_from_old: Pose2,
    },
    /// Something is wrong with the robot's senses, or they contradict each other. Told once of each kind.
    Suspected {
        /// Stamp of the scan with which it showed.
        stamp_ns: StampNs,
        /// Of which kind.
        what: Suspicion,
        /// In words.
        why: String,
    },
    /// The robot's odometry jumped or restarted: a new segment began.
    SegmentBegan {
        /// Stamp of the first odometry of the segment.
        stamp_ns: StampNs,
        /// Why.
        reason: String,
    },
}
