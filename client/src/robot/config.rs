//! Settings of a robot's streams.

use std::path::PathBuf;
use std::time::{Duration, SystemTime, UNIX_EPOCH};
use toponym_proto::Clock;
use toponym_proto::keys::DEFAULT_SITE;

/// Form of the payloads.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Form {
    /// Short and quick.
    #[default]
    Bincode,
    /// Readable.
    Json,
}

/// Settings of a [`super::Robot`].
#[derive(Clone, Debug)]
pub struct RobotConfig {
    /// Site.
    pub site: String,
    /// Robot id.
    pub robot: String,
    /// Grows with each start; the Unix time of now in seconds.
    pub boot: u64,
    /// Which clock the stamps are of.
    pub clock: Clock,
    /// Form of the payloads.
    pub form: Form,
    /// Messages kept until they are acknowledged; sending waits while there are so many. No more
    /// than the server's `gap_window` (1024 by default): then a message that got lost can never be
    /// given up because too many came after it, only after `gap_wait_s`, and it is sent again
    /// sooner.
    pub in_flight_max: usize,
    /// A watermark that stands still so long means that something got lost: what is above it is
    /// sent again, the next time after twice as long.
    pub resend_after: Duration,
    /// How long the watermark may stand still before sending fails.
    pub patience: Duration,
    /// Folder for what the server does not have yet. With it sending does not wait while there is room on disk, and what
    /// is left when the program ends is sent at its next start.
    pub spool: Option<PathBuf>,
    /// Bytes on disk.
    pub spool_max_bytes: u64,
}

impl RobotConfig {
    /// The defaults for a robot.
    pub fn new(robot: &str) -> Self {
        let since_1970 = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
        Self {
            site: DEFAULT_SITE.into(),
            robot: robot.into(),
            boot: since_1970.as_secs(),
            clock: Clock::Unix,
            form: Form::Bincode,
            in_flight_max: 1000,
            resend_after: Duration::from_secs(2),
            patience: Duration::from_secs(3600),
            spool: None,
            spool_max_bytes: 1 << 30,
        }
    }
}
