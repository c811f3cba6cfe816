//! All limits: of what one message may say, of what may wait, of how many there may be. At a limit something is refused,
//! counted ([`crate::answer::Info::reached`]) and logged; nothing that was acknowledged is lost.
//!
//! A map has limits of its own: 20 000 sentences and 2000 names (`toponym_core::talk`).

use crate::validate::Invalid;
use serde::{Deserialize, Serialize};

/// Upper bounds that settings may change; bytes and counts.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Limits {
    /// Bytes of one message.
    pub payload_bytes: usize,
    /// Rays of one sweep.
    pub beams: usize,
    /// Lasers of one robot.
    pub lasers: usize,
    /// Ignored bearing intervals of one laser.
    pub ignored_sectors: usize,
    /// Characters of a sentence.
    pub text_chars: usize,
    /// Other hearings of a sentence.
    pub alternatives: usize,
    /// Messages that may wait in memory, per robot and on the way in.
    pub queue_messages: usize,
    /// Bytes of them on the way in, of all robots and guides.
    pub queue_bytes: usize,
    /// Bytes of all robots' messages that wait for those before them, or for room in their maps; each robot may have its share.
    pub waiting_bytes: usize,
    /// Bytes on their way from a map's journal to its filter; what comes then waits with its robot, unacknowledged.
    pub backlog_bytes: usize,
    /// Robots that are kept account of.
    pub robots: usize,
    /// Maps that are kept at hand.
    pub maps: usize,
    /// Seconds without a message after which a map may make room for a new one. It stays on disk: its robot's next setup
    /// brings it back. One in which there is nothing yet may do so after [`EMPTY_IDLE_S`].
    pub map_idle_s: u64,
    /// Questions with short answers that are worked on at the same time; more get `busy`.
    pub short_queries: usize,
    /// The same of those with long answers, and of keys with wildcards.
    pub long_queries: usize,
    /// The same of commands, which wait for a map's filter.
    pub commands: usize,
    /// Connections of browsers and of all else that speaks HTTP; more are closed at once.
    pub connections: usize,
}

impl Limits {
    /// Those of what was validated before, maybe against raised limits: only a damaged length is to be told
    /// from a large message.
    pub const NONE: Self = Self {
        payload_bytes: 64 << 20,
        beams: usize::MAX,
        lasers: usize::MAX,
        ignored_sectors: usize::MAX,
        text_chars: usize::MAX,
        alternatives: usize::MAX,
        ..Self::DEFAULT
    };

    /// For a server of some robots.
    pub const DEFAULT: Self = Self {
        payload_bytes: 1 << 20,
        beams: 8192,
        lasers: 8,
        ignored_sectors: 64,
        text_chars: 1000,
        alternatives: 16,
        queue_messages: 20_000,
        queue_bytes: 64 << 20,
        waiting_bytes: 256 << 20,
        backlog_bytes: 32 << 20,
        robots: 64,
        maps: 16,
        map_idle_s: 86_400,
        short_queries: 64,
        long_queries: 2,
        commands: 2,
        connections: 256,
    };

    /// Checks that none is 0 or beyond what memory and journals can hold.
    ///
    /// # Errors
    /// The first that is, by its name in the settings.
    pub fn check(&self) -> Result<(), Invalid> {
        for (field, value, max) in [
            // A journal can't be read back with longer ones.
            ("limits.payload_bytes", self.payload_bytes, 4 << 20),
            ("limits.beams", self.beams, 1 << 20),
            ("limits.lasers", self.lasers, 1000),
            ("limits.text_chars", self.text_chars, 4096),
            ("limits.queue_messages", self.queue_messages, 10_000_000),
            ("limits.queue_bytes", self.queue_bytes, 1 << 40),
            ("limits.waiting_bytes", self.waiting_bytes, 1 << 40),
            ("limits.backlog_bytes", self.backlog_bytes, 1 << 40),
            ("limits.robots", self.robots, 1_000_000),
            ("limits.maps", self.maps, 1_000_000),
            ("limits.short_queries", self.short_queries, 10_000),
            ("limits.long_queries", self.long_queries, 10_000),
            ("limits.commands", self.commands, 10_000),
            ("limits.connections", self.connections, 10_000),
        ] {
            if !(1..=max).contains(&value) {
                return Err(Invalid::new(field, format!("is {value}, must be from 1 to {max}")));
            }
        }
        Ok(())
    }
}

impl Default for Limits {
    fn default() -> Self {
        Self::DEFAULT
    }
}

/// Largest boot: any Unix time in milliseconds, and far below 2^53, up to which integers in JSON are exact. One that is
/// far off would make all later starts of its robot look old.
pub const BOOT_MAX: u64 = 1 << 46;
/// See [`Limits::map_idle_s`].
pub const EMPTY_IDLE_S: u64 = 300;
/// Largest seq.
pub const SEQ_MAX: u64 = 1 << 46;
/// Times stay within this of the clock's zero, so that the difference of two is never too large.
pub const STAMP_MAX_NS: i64 = 4_000_000_000_000_000_000;
/// A sentence that began so long before or after all of its robot's stream, or of its log, is on another clock. A stream that
/// is played fast may be minutes behind its sentences.
pub const SAID_OUTSIDE_S: f64 = 900.0;
/// A sentence said longer ago than this is history.
pub const AGO_MAX_S: f64 = 7.0 * 86_400.0;
/// Coordinates stay within this of the origin: an odometry frame that is further off is broken.
pub const COORDINATE_MAX_M: f64 = 1e6;
/// Corners of an area that is drawn at a desk: as many as fit into a selector.
pub const AREA_CORNERS_MAX: usize = 400;
/// Longest range of any laser.
pub const RANGE_MAX_M: f64 = 1e4;
/// Longest time between two rays.
pub const TIME_INCREMENT_MAX_S: f64 = 1.0;
/// Angles may be unwrapped, but not absurd.
pub const ANGLE_MAX_RAD: f64 = 1e4;
/// Arguments of a query.
pub const ARGUMENTS_MAX_BYTES: usize = 8192;
/// A robot that is known keeps no more in flight than a few thousand messages: a seq further ahead is a mistake, or forged,
/// and waiting for all before it would shut the robot out.
pub const AHEAD_MAX: u64 = 1 << 20;
/// Sentences whose robot was never heard, and that wait for it.
pub const WAITING_SENTENCES_MAX: usize = 64;
/// Queries that wait to be told that there are too many.
pub const REFUSED_QUERIES_MAX: usize = 4096;
/// Sentences of a map that are known again when they come again. A guide repeats one for hours at most.
pub const KNOWN_SENTENCES_MAX: usize = 10_000;
