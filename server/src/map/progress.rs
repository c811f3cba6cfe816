//! How far a run has come: a bar on a terminal, a line now and then elsewhere. On stderr.

use indicatif::{ProgressBar, ProgressStyle};
use std::io::{IsTerminal, stderr};
use std::time::{Duration, Instant};
use toponym_core::Mapper;

/// How often the bar moves.
const BAR_EVERY: Duration = Duration::from_millis(250);
/// How often a line is written where there is no terminal.
const LINE_EVERY: Duration = Duration::from_secs(10);

/// Progress of one run.
pub struct Progress {
    bar: Option<ProgressBar>,
    began: Instant,
    shown: Instant,
}

impl Progress {
    /// A run over so many bytes.
    pub fn new(total_bytes: u64) -> Self {
        let now = Instant::now();
        let bar = stderr().is_terminal().then(|| {
            let bar = ProgressBar::new(total_bytes);
            if let Ok(style) = ProgressStyle::with_template("{bar:30} {percent:>3} %  {msg}") {
                bar.set_style(style);
            }
            bar
        });
        Self { bar, began: now, shown: now }
    }

    /// Shows where the run is, if it is time to. The snapshot is only taken then.
    pub fn show(&mut self, read_bytes: u64, log_s: f64, mapper: &Mapper) {
        let every = if self.bar.is_some() { BAR_EVERY } else { LINE_EVERY };
        if self.shown.elapsed() < every {
            return;
        }
        let graph = mapper.snapshot().graph();
        let speed = log_s / self.began.elapsed().as_secs_f64();
        let text = format!(
            "{log_s:.0} s of log, {} places, {} distinct graphs, {speed:.0}× its own time",
            graph.places.len(),
            graph.particles.len()
        );
        match &self.bar {
            Some(bar) => {
                bar.set_position(read_bytes);
                bar.set_message(text);
            }
            None => eprintln!("{text}"),
        }
        self.shown = Instant::now();
    }

    /// Removes the bar.
    pub fn finish(self) {
        if let Some(bar) = self.bar {
            bar.finish_and_clear();
        }
    }
}
