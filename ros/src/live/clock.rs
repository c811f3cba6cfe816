//! What time it is on a robot: by its newest stamp, and how fast its clock runs; a simulator's may run faster or slower.

use std::time::{Duration, Instant};

/// A robot that is silent for so long has stopped; its clock is not carried on.
const SILENT: Duration = Duration::from_secs(1);
/// Over so long its rate is measured.
const MEASURED: Duration = Duration::from_secs(1);
/// No clock is believed to run faster.
const RATE_MAX: f64 = 100.0;

/// A robot's clock as it is known.
#[derive(Clone, Copy, Debug)]
pub struct RobotClock {
    /// The newest stamp, and when it came.
    newest: Option<(i64, Instant)>,
    /// Since when the rate is measured.
    since: Option<(i64, Instant)>,
    /// Its seconds a second.
    rate: f64,
}

impl Default for RobotClock {
    fn default() -> Self {
        Self { newest: None, since: None, rate: 1.0 }
    }
}

impl RobotClock {
    /// Sees the newest stamp; whether that is another.
    pub fn see(&mut self, stamp_ns: i64, now: Instant) -> bool {
        if self.newest.is_some_and(|(known, _)| known == stamp_ns) {
            return false;
        }
        if self.newest.is_some_and(|(known, came)| stamp_ns < known || now - came > SILENT) {
            // It began anew, or stood.
            self.since = None;
        }
        self.newest = Some((stamp_ns, now));
        let (since_ns, since) = *self.since.get_or_insert((stamp_ns, now));
        let over = now - since;
        if over >= MEASURED {
            self.rate = ((stamp_ns - since_ns) as f64 * 1e-9 / over.as_secs_f64()).clamp(0.0, RATE_MAX);
            self.since = Some((stamp_ns, now));
        }
        true
    }

    /// The newest stamp, and when it came.
    pub fn newest(&self) -> Option<(i64, Instant)> {
        self.newest
    }

    /// What time it will be there so many of this machine's seconds from now, and at least as many of its own.
    pub fn in_ns(&self, now: Instant, ahead_s: f64) -> Option<i64> {
        // At zero, simulated time has not begun.
        let (stamp_ns, came) = self.newest.filter(|(ns, _)| *ns != 0)?;
        let since_s = now.saturating_duration_since(came).min(SILENT).as_secs_f64();
        Some(stamp_ns + ((since_s * self.rate + ahead_s * self.rate.max(1.0)) * 1e9) as i64)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_clock_goes_on_at_its_own_rate_until_its_robot_is_silent() {
        let (start, mut clock) = (Instant::now(), RobotClock::default());
        assert_eq!(clock.in_ns(start, 0.2), None);
        for k in 0..=30_u32 {
            // Ten times as fast.
            clock.see(1_000_000_000 * i64::from(k + 1), start + k * Duration::from_millis(100));
        }
        let now = start + Duration::from_secs(3);
        let at_s = |after_ms, ahead_s| {
            let ns = clock.in_ns(now + Duration::from_millis(after_ms), ahead_s).unwrap();
            ns as f64 * 1e-9
        };
        assert!((at_s(0, 0.0) - 31.0).abs() < 1e-6 && (at_s(500, 0.2) - 38.0).abs() < 1e-3);
        assert!((at_s(60_000, 0.0) - 41.0).abs() < 1e-3, "it has stopped");
        let mut again = clock;
        assert!(!again.see(31_000_000_000, now) && again.see(2_000_000_000, now));
        assert!((again.in_ns(now, 0.0).unwrap() - 2_000_000_000).abs() < 1_000, "it began anew");
    }
}
