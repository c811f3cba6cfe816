//! How long things took: the only part of a report that may differ from run to run.

use serde::Serialize;
use std::time::Duration;

/// What an event is accounted to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stage {
    /// A scan that found its pose and nothing more.
    Scan,
    /// A scan that began a place or had edges judged.
    Place,
    /// A sentence.
    Utterance,
    /// A question.
    Answer,
}

/// Fewer durations say nothing of their tail.
const TENTH_MIN: usize = 20;

/// Durations by stage.
#[derive(Clone, Debug, Default)]
pub struct Stopwatch {
    taken_ms: [Vec<f64>; 4],
}

impl Stopwatch {
    /// Accounts one event.
    pub fn add(&mut self, stage: Stage, took: Duration) {
        self.taken_ms[stage as usize].push(took.as_secs_f64() * 1e3);
    }

    /// Percentiles of a stage.
    pub fn spread(&self, stage: Stage) -> Spread {
        let taken_ms = &self.taken_ms[stage as usize];
        let at = |share| percentile(taken_ms, share);
        Spread { count: taken_ms.len(), p50_ms: at(0.5), p99_ms: at(0.99), max_ms: at(1.0) }
    }

    /// p99 of a stage's last tenth over that of its third tenth: what a growing map costs. None of a
    /// short run.
    pub fn growth(&self, stage: Stage) -> Option<f64> {
        let taken_ms = &self.taken_ms[stage as usize];
        let tenth = taken_ms.len() / 10;
        let p99_ms = |from: usize| percentile(&taken_ms[from..from + tenth], 0.99);
        (tenth >= TENTH_MIN).then(|| p99_ms(taken_ms.len() - tenth) / p99_ms(2 * tenth))
    }
}

/// The nearest rank's; 0 of nothing.
fn percentile(values: &[f64], share: f64) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let rank = (share * sorted.len() as f64).ceil() as usize;
    sorted.get(rank.saturating_sub(1)).copied().unwrap_or(0.0)
}

/// Percentiles (nearest rank) of a stage's durations.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Spread {
    /// Events.
    pub count: usize,
    /// Half of them took no longer.
    pub p50_ms: f64,
    /// 99 % took no longer.
    pub p99_ms: f64,
    /// The longest.
    pub max_ms: f64,
}

/// `timing` of a report.
#[derive(Clone, Debug, Serialize)]
pub struct Timing {
    /// From the first event to the last answer.
    pub wall_s: f64,
    /// CPU time of the process, all threads; none where the system does not tell.
    pub cpu_s: Option<f64>,
    /// Between the log's smallest and largest stamp.
    pub log_s: f64,
    /// `log_s / wall_s`.
    pub speed: f64,
    /// Threads.
    pub threads: usize,
    /// Scans without more.
    pub scan: Spread,
    /// Scans that began a place or had edges judged.
    pub place: Spread,
    /// p99 of the last tenth of `place` over that of the third tenth; none of a short run.
    pub place_growth: Option<f64>,
    /// Sentences.
    pub utterance: Spread,
    /// Questions.
    pub answer: Spread,
    /// Largest resident memory, 10⁶ bytes; none where the system does not tell.
    pub peak_mb: Option<f64>,
}

/// CPU time of this process so far, seconds.
pub fn cpu_s() -> Option<f64> {
    // Fields 14 and 15, user and system time; the second, the program's name, may hold anything
    // but ends with the last parenthesis. Linux counts them in hundredths of a second.
    let stat = std::fs::read_to_string("/proc/self/stat").ok()?;
    let mut fields = stat.rsplit_once(')')?.1.split_whitespace().skip(11);
    let ticks = fields.next()?.parse::<f64>().ok()? + fields.next()?.parse::<f64>().ok()?;
    Some(ticks / 100.0)
}

/// Largest resident memory of this process so far, 10⁶ bytes.
pub fn peak_mb() -> Option<f64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|l| l.strip_prefix("VmHWM:"))?;
    let kib = line.split_whitespace().next()?.parse::<f64>().ok()?;
    Some(kib * 1024.0 / 1e6)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn percentiles_are_nearest_ranks() {
        let mut watch = Stopwatch::default();
        for ms in (1..=200).rev() {
            watch.add(Stage::Scan, Duration::from_millis(ms));
        }
        watch.add(Stage::Answer, Duration::from_millis(7));
        let spread = watch.spread(Stage::Scan);
        assert_eq!(spread, Spread { count: 200, p50_ms: 100.0, p99_ms: 198.0, max_ms: 200.0 });
        assert_eq!(watch.spread(Stage::Answer).count, 1);
        assert_eq!(watch.spread(Stage::Place), Spread { count: 0, p50_ms: 0.0, p99_ms: 0.0, max_ms: 0.0 });
    }

    #[test]
    fn growth_compares_the_last_tenth_with_the_third() {
        let mut watch = Stopwatch::default();
        for k in 0..400 {
            watch.add(Stage::Place, Duration::from_millis(if k < 360 { 10 } else { 15 }));
        }
        assert!(watch.growth(Stage::Place).is_some_and(|g| (g - 1.5).abs() < 1e-9));
        assert_eq!(watch.growth(Stage::Scan), None);
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn the_system_tells_cpu_and_memory() {
        let work: u64 = (0..200_000_000_u64).fold(0, |a, k| a ^ k.rotate_left(7));
        assert!(cpu_s().is_some_and(|s| s > 0.0), "{work}");
        assert!(peak_mb().is_some_and(|mb| mb > 1.0));
    }
}
