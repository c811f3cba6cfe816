//! The thread's clock, the process's memory, statistics as the peers' scripts give them, and formats.

use cpu_time::ThreadTime;
use serde::Serialize;
use std::io::{IsTerminal, Write};
use std::time::{Duration, Instant};

const REPORT_EVERY: Duration = Duration::from_secs(2);

/// What `work` returns, and the CPU time it took on this thread, ms.
pub fn timed<T>(work: impl FnOnce() -> T) -> (T, f64) {
    let clock = ThreadTime::now();
    let result = work();
    (result, clock.elapsed().as_secs_f64() * 1e3)
}

/// Forgets the largest resident memory so far, so that what was only needed before does not hide growth;
/// without effect where the system cannot.
pub fn forget_memory_max() {
    let _ = std::fs::write("/proc/self/clear_refs", "5");
}

/// Largest resident memory so far, MB; None where the system does not say.
pub fn memory_max_mb() -> Option<f64> {
    status_mb("VmHWM:")
}

/// Resident memory, MB; None where the system does not say.
pub fn memory_mb() -> Option<f64> {
    status_mb("VmRSS:")
}

fn status_mb(key: &str) -> Option<f64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let kib = status.lines().find_map(|line| line.strip_prefix(key))?;
    kib.trim().strip_suffix("kB")?.trim().parse::<f64>().ok().map(|kib| kib / 1024.0)
}

/// The growth since `before` by a reading of the same kind.
pub fn growth_mb(before: Option<f64>, now: Option<f64>) -> Option<f64> {
    Some(now? - before?)
}

/// Times of a step, over all steps.
#[derive(Serialize)]
pub struct Stats {
    total_s: f64,
    mean_ms: f64,
    p50_ms: f64,
    p99_ms: f64,
    max_ms: f64,
}

impl Stats {
    /// None of no times at all.
    pub fn of(times_ms: impl IntoIterator<Item = f64>) -> Option<Self> {
        let mut v: Vec<f64> = times_ms.into_iter().collect();
        v.sort_by(f64::total_cmp);
        let n = v.len();
        let max_ms = round(*v.last()?, 4);
        let total_ms: f64 = v.iter().sum();
        Some(Self {
            total_s: round(total_ms / 1e3, 4),
            mean_ms: round(total_ms / n as f64, 4),
            p50_ms: round(v[n / 2], 4),
            p99_ms: round(v[(n - 1).min((n as f64 * 0.99) as usize)], 4),
            max_ms,
        })
    }
}

/// The mean, 0 of nothing.
pub fn mean(values: impl IntoIterator<Item = f64>) -> f64 {
    let (sum, n) = values.into_iter().fold((0.0, 0.0), |(sum, n), v| (sum + v, n + 1.0));
    sum / f64::max(n, 1.0)
}

/// To so many decimals.
pub fn round(x: f64, decimals: i32) -> f64 {
    let scale = 10f64.powi(decimals);
    (x * scale).round() / scale
}

/// C's `%.{digits}g`, in which the peers write their files.
pub fn general(x: f64, digits: usize) -> String {
    let scientific = format!("{x:.*e}", digits - 1);
    let Some((mantissa, exponent)) = scientific.split_once('e') else {
        return scientific; // NaN, infinity
    };
    let exponent: i32 = exponent.parse().unwrap_or(0);
    if exponent < -4 || exponent >= digits as i32 {
        let sign = if exponent < 0 { '-' } else { '+' };
        return format!("{}e{sign}{:02}", trimmed(mantissa), exponent.abs());
    }
    trimmed(&format!("{x:.*}", (digits as i32 - 1 - exponent) as usize)).to_owned()
}

/// Without zeros at the end of its decimals.
fn trimmed(number: &str) -> &str {
    if number.contains('.') { number.trim_end_matches('0').trim_end_matches('.') } else { number }
}

/// Says now and then on standard error how far a long run is, if someone sits there.
pub struct Progress {
    total: usize,
    seen: bool,
    last: Instant,
}

impl Progress {
    pub fn new(total: usize) -> Self {
        Self { total, seen: std::io::stderr().is_terminal(), last: Instant::now() }
    }

    /// Pose k is in; `more` says what else is worth knowing.
    pub fn tick(&mut self, k: usize, more: impl FnOnce() -> String) {
        if self.seen && self.last.elapsed() >= REPORT_EVERY {
            self.last = Instant::now();
            let mut err = std::io::stderr();
            // Who cannot be told is not told.
            let _ = write!(err, "\r\x1b[Kpose {} of {}{}", k + 1, self.total, more());
            let _ = err.flush();
        }
    }
}

impl Drop for Progress {
    /// Clears its line, also before an error message.
    fn drop(&mut self) {
        if self.seen {
            eprint!("\r\x1b[K");
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn general_is_that_of_c() {
        for (x, want) in [
            (0.0, "0"),
            (1.0, "1"),
            (-12.345_678_912, "-12.3456789"),
            (0.000_123_456_789_12, "0.000123456789"),
            (1e-5, "1e-05"),
            (-1.234e-7, "-1.234e-07"),
            (999_999_999.6, "1e+09"),
            (123_456_789.0, "123456789"),
        ] {
            assert_eq!(general(x, 9), want);
        }
    }

    #[test]
    fn stats_are_those_of_the_peers() {
        let s = Stats::of((0..200).rev().map(f64::from)).unwrap();
        let got = [s.total_s, s.mean_ms, s.p50_ms, s.p99_ms, s.max_ms];
        for (got, want) in got.into_iter().zip([19.9, 99.5, 100.0, 198.0, 199.0]) {
            assert!((got - want).abs() < 1e-9, "{got} {want}");
        }
        assert!(Stats::of([]).is_none());
    }
}
