//! A robot's clock, as the server hears it: which of its stamps it was at when a sentence was said.
//!
//! A guide need not know that clock: a sentence counts as said at the newest stamp that has arrived. One that is said
//! again after a cut was said a while ago, and belongs where the robot was then.

use std::collections::VecDeque;
use std::ops::RangeInclusive;
use std::time::Duration;
use toponym_proto::Stamp;
use toponym_proto::answer::{ErrorCode, Problem};
use toponym_proto::limits::SAID_OUTSIDE_S;

/// Stamps are noted no closer than this, and so many.
const NOTED: Duration = Duration::from_secs(1);
const NOTED_MAX: usize = 900;
/// Over so long a live stream keeps time with the server; one that catches up, or is played fast, tells nothing of
/// before.
const LIVE_OVER: Duration = Duration::from_secs(2);
const LIVE: RangeInclusive<f64> = 0.8..=1.25;

/// Stamps of a robot's newest boot.
#[derive(Debug, Default)]
pub struct RobotClock {
    /// The first that has arrived; not known of a robot of an earlier run.
    first: Option<Stamp>,
    newest: Option<Stamp>,
    /// When which was the newest, oldest first.
    noted: VecDeque<(Duration, Stamp)>,
}

impl RobotClock {
    /// Of an earlier run of the server.
    pub fn since(newest: Option<Stamp>) -> Self {
        Self { newest, ..Self::default() }
    }

    /// A new start of the robot.
    pub fn begin(&mut self, first: Stamp) {
        *self = Self { first: Some(first), ..Self::default() };
    }

    /// The newest stamp that has arrived.
    pub fn newest(&self) -> Option<Stamp> {
        self.newest
    }

    /// A stamp has arrived.
    pub fn note(&mut self, now: Duration, stamp: Stamp) {
        self.newest = self.newest.max(Some(stamp));
        if self.noted.back().is_none_or(|(at, _)| now.saturating_sub(*at) >= NOTED) {
            self.noted.extend(self.newest.map(|newest| (now, newest)));
            if self.noted.len() > NOTED_MAX {
                self.noted.pop_front();
            }
        }
    }

    /// The robot's time so long before `now`.
    ///
    /// # Errors
    /// If that was before the robot started, or is not known yet.
    pub fn before(&self, now: Duration, ago_s: f64) -> Result<Stamp, Problem> {
        let newest = self.newest.unwrap_or_default();
        if ago_s <= 0.0 {
            return Ok(newest);
        }
        let then_s = now.as_secs_f64() - ago_s;
        let until = self.noted.partition_point(|(at, _)| at.as_secs_f64() <= then_s);
        if let Some((at, stamp)) = until.checked_sub(1).and_then(|k| self.noted.get(k)) {
            // What the robot sent then may still be on its way: no reason to put it where the robot was before.
            return Ok(later(*stamp, then_s - at.as_secs_f64()).min(later(newest, SAID_OUTSIDE_S)));
        }
        let not_known =
            || Problem::new(ErrorCode::Busy, "the robot's clock is not known yet: say it again later");
        let (at, stamp) = self.noted.back().ok_or_else(not_known)?;
        let is_live = |(from, was): &(Duration, Stamp)| {
            LIVE.contains(&((stamp.seconds() - was.seconds()) / at.saturating_sub(*from).as_secs_f64()))
        };
        let from = self.noted.iter().rev().find(|(from, _)| at.saturating_sub(*from) >= LIVE_OVER);
        if !from.is_some_and(is_live) {
            return Err(not_known());
        }
        let then = later(*stamp, then_s - at.as_secs_f64());
        if self.first.is_some_and(|first| then < first) {
            return Err(Problem::new(
                ErrorCode::BadArgument,
                format!("said {ago_s:.0} s ago, before the robot started"),
            )
            .field("ago_s")
            .hint("say it again where it is true"));
        }
        Ok(then)
    }

    /// Whether a time that a guide tells can be one of this clock.
    ///
    /// # Errors
    /// If not.
    pub fn check(&self, began: Stamp) -> Result<(), Problem> {
        let off_s = |from: Stamp, to: Stamp| to.seconds() - from.seconds();
        let ahead_s = self.newest.map_or(0.0, |newest| off_s(newest, began));
        let before_s = self.first.map_or(0.0, |first| off_s(began, first));
        let (s, what) =
            if ahead_s > before_s { (ahead_s, "after the newest") } else { (before_s, "before the first") };
        if s <= SAID_OUTSIDE_S {
            return Ok(());
        }
        let message = format!("began is {s:.0} s {what} stamp of the robot: it is on another clock");
        Err(Problem::new(ErrorCode::BadArgument, message)
            .field("began")
            .hint("leave it out (then it was said now), or take the robot's time from the key time"))
    }
}

fn later(stamp: Stamp, by_s: f64) -> Stamp {
    Stamp { ns: stamp.ns.saturating_add((by_s * 1e9) as i64) }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn s(s: f64) -> Duration {
        Duration::from_secs_f64(s)
    }

    fn stamp(s: f64) -> Stamp {
        Stamp { ns: (s * 1e9) as i64 }
    }

    /// Hears a robot ten times a second, whose clock is 1000 s ahead and runs so many times as fast.
    fn hear(clock: &mut RobotClock, from_s: f64, to_s: f64, times: f64) {
        for k in 0..((to_s - from_s) * 10.0).round() as usize {
            let at_s = from_s + 0.1 * k as f64;
            clock.note(s(at_s), stamp(1000.0 + times * at_s));
        }
    }

    fn off_s(got: Stamp, expected_s: f64) -> f64 {
        (got.seconds() - expected_s).abs()
    }

    #[test]
    fn a_sentence_counts_where_it_was_said_whoever_was_cut_off_meanwhile() {
        let mut clock = RobotClock::default();
        clock.begin(stamp(1000.0));
        hear(&mut clock, 0.0, 10.0, 1.0);
        assert!(off_s(clock.before(s(10.0), 0.0).unwrap(), 1009.9) < 1e-9, "the newest");
        assert!(off_s(clock.before(s(10.0), 4.0).unwrap(), 1006.0) < 0.01);
        // The robot is cut off for a minute, too, and sends what it kept after the guide has spoken.
        assert!(off_s(clock.before(s(70.0), 39.0).unwrap(), 1031.0) < 0.01);
        for k in 0..600 {
            clock.note(s(70.0 + 0.001 * f64::from(k)), stamp(1010.0 + 0.1 * f64::from(k)));
        }
        assert!(off_s(clock.before(s(71.0), 40.0).unwrap(), 1031.0) < 0.01);
        assert!(off_s(clock.before(s(10.5), 0.4).unwrap(), 1010.1) < 0.01);
    }

    #[test]
    fn of_a_robot_that_is_silent_no_time_far_ahead_is_reckoned() {
        let mut clock = RobotClock::default();
        hear(&mut clock, 0.0, 10.0, 1.0);
        assert!(off_s(clock.before(s(5000.0), 1.0).unwrap(), 1009.9 + SAID_OUTSIDE_S) < 0.01);
    }

    #[test]
    fn a_stream_that_is_played_fast_tells_its_own_time() {
        let mut clock = RobotClock::default();
        hear(&mut clock, 0.0, 30.0, 20.0);
        assert!(off_s(clock.before(s(30.0), 10.0).unwrap(), 1400.0) < 1.0);
    }

    #[test]
    fn after_a_restart_of_the_server_it_is_reckoned_back_once_the_robot_keeps_time() {
        let mut clock = RobotClock::since(Some(stamp(900.0)));
        // What was kept comes in a burst.
        for k in 0..600 {
            clock.note(s(5.0 + 0.001 * f64::from(k)), stamp(950.0 + 0.1 * f64::from(k)));
        }
        assert_eq!(clock.before(s(5.6), 20.0).unwrap_err().code, ErrorCode::Busy);
        hear(&mut clock, 10.0, 14.0, 1.0);
        assert!(off_s(clock.before(s(14.0), 60.0).unwrap(), 954.0) < 0.01);
    }

    #[test]
    fn what_was_said_before_the_robot_started_is_refused() {
        let mut clock = RobotClock::default();
        clock.begin(stamp(1000.0));
        hear(&mut clock, 0.0, 10.0, 1.0);
        let problem = clock.before(s(10.0), 20.0).unwrap_err();
        assert_eq!((problem.code, problem.field.as_deref()), (ErrorCode::BadArgument, Some("ago_s")));
    }

    #[test]
    fn what_is_noted_is_bounded() {
        let mut clock = RobotClock::default();
        hear(&mut clock, 0.0, 2000.0, 1.0);
        assert_eq!(clock.noted.len(), NOTED_MAX);
    }
}
