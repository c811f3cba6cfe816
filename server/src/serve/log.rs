//! Logs to stderr: what concerns an operator, and not more of it than one can read.

use clap::ValueEnum;
use std::collections::HashMap;
use std::io::IsTerminal;
use std::sync::Mutex;
use std::time::Instant;
use tracing::callsite::Identifier;
use tracing::{Event, Subscriber, warn};
use tracing_subscriber::layer::{Context, SubscriberExt as _};
use tracing_subscriber::util::SubscriberInitExt as _;
use tracing_subscriber::{EnvFilter, Layer};

use super::board::lock;

/// What is logged by default. Zenoh tells of every connection that fails, and anybody can make them fail as often as they
/// like.
const LOGGED: &str = "info,zenoh=error,zenoh_transport=off,zenoh_link=off";
/// Lines of one kind that may come at once …
const BURST: f64 = 100.0;
/// … and from then on per second.
const PER_S: f64 = 2.0;

/// How logs are written to stderr.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum LogFormat {
    /// Lines for people.
    #[default]
    Text,
    /// One JSON object a line.
    Json,
}

/// Logs to stderr from here on; `RUST_LOG` selects.
pub fn init_logging(format: LogFormat) {
    let filter = EnvFilter::try_from_default_env().unwrap_or_else(|_| EnvFilter::new(LOGGED));
    let registry = tracing_subscriber::registry().with(filter).with(Sparing::default());
    let lines = tracing_subscriber::fmt::layer()
        .with_writer(std::io::stderr)
        .with_ansi(std::io::stderr().is_terminal());
    // An error means that somebody logs already.
    let _ = match format {
        LogFormat::Text => registry.with(lines).try_init(),
        LogFormat::Json => registry.with(lines.json()).try_init(),
    };
}

/// Leaves lines out that come too fast: whoever can make the server write a line must not fill the disk with them. Each place in
/// the source has its own measure, and says how many were left out.
#[derive(Default)]
struct Sparing {
    kinds: Mutex<HashMap<Identifier, Measure>>,
}

/// How many lines of a kind may be written now.
#[derive(Debug)]
struct Measure {
    left: f64,
    at: Instant,
    left_out: u64,
}

impl Measure {
    fn new(now: Instant) -> Self {
        Self { left: BURST, at: now, left_out: 0 }
    }

    /// Whether one more may be written, and how many were left out since the last.
    fn take(&mut self, now: Instant) -> Option<u64> {
        let since = now.saturating_duration_since(self.at);
        self.left = (self.left + PER_S * since.as_secs_f64()).min(BURST);
        self.at = now;
        if self.left < 1.0 {
            self.left_out += 1;
            return None;
        }
        self.left -= 1.0;
        Some(std::mem::take(&mut self.left_out))
    }
}

impl<S: Subscriber> Layer<S> for Sparing {
    fn event_enabled(&self, event: &Event<'_>, _: Context<'_, S>) -> bool {
        let now = Instant::now();
        let left_out = {
            let mut kinds = lock(&self.kinds);
            let kind = kinds.entry(event.metadata().callsite()).or_insert_with(|| Measure::new(now));
            kind.take(now)
        };
        if let Some(left_out @ 1..) = left_out {
            warn!(target: "toponym_server::log", left_out, "lines like the next were left out: they came too fast");
        }
        left_out.is_some()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::Duration;

    #[test]
    fn lines_of_a_kind_are_measured() {
        let began = Instant::now();
        let mut kind = Measure::new(began);
        let written = (0..1000).filter(|_| kind.take(began).is_some()).count();
        assert_eq!(written, BURST as usize);
        assert_eq!(kind.take(began + Duration::from_secs(1)), Some(1000 - written as u64));
        assert_eq!(kind.take(began + Duration::from_secs(1)), Some(0));
        assert_eq!(kind.take(began + Duration::from_secs(1)), None);
    }
}
