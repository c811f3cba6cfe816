//! Phones that watch a map grow, for long: what they load, how long their scripts run, and what it costs the server.

use crate::cdp::{Browser, Page};
use crate::world::World;
use crate::{guide, look};
use std::fmt::Write as _;
use std::thread;
use std::time::{Duration, Instant};

/// How long, and how many.
#[derive(Clone, Copy, Debug)]
pub struct Watched {
    /// Phones that watch.
    pub phones: usize,
    /// For so long, seconds.
    pub seconds: f64,
    /// A sentence each so many seconds; none: nobody talks.
    pub talk_each_s: Option<f64>,
}

/// Watches, and tells what it saw.
///
/// # Errors
/// If a page fails, or a sentence is lost.
pub fn watch(browser: &Browser, world: &World, how: Watched) -> anyhow::Result<String> {
    let talker = how.talk_each_s.map(|_| browser.page(390, 844)).transpose()?;
    if let Some(talker) = &talker {
        guide::open(talker, &world.host)?;
    }
    let phones: Vec<Page> = (0..how.phones).map(|_| browser.page(390, 844)).collect::<anyhow::Result<_>>()?;
    let mut first_s = Vec::new();
    for phone in &phones {
        let begin = Instant::now();
        look::open(phone, &world.host)?;
        first_s.push(begin.elapsed().as_secs_f64());
    }
    let scripts = |pages: &[Page]| pages.iter().map(Page::script_s).collect::<anyhow::Result<Vec<f64>>>();
    let updates = |page: &Page| page.traffic().map(|t| t.events as f64);
    let (script_begin, cpu_begin, begin) = (scripts(&phones)?, world.cpu_s(), Instant::now());
    let updates_begin: Vec<f64> = phones.iter().map(updates).collect::<anyhow::Result<_>>()?;
    let (mut heard_s, mut placed_s) = (Vec::new(), Vec::new());
    while begin.elapsed().as_secs_f64() < how.seconds {
        let turn = Instant::now();
        if let Some(talker) = &talker {
            let (heard, placed) = guide::types(talker, &format!("This is room {}.", 100 + heard_s.len()))?;
            heard_s.push(heard);
            placed_s.push(placed);
        }
        // What the browser tells meanwhile is read, or it would pile up.
        for phone in &phones {
            phone.traffic()?;
        }
        let pause = Duration::from_secs_f64(how.talk_each_s.unwrap_or(5.0));
        thread::sleep(pause.saturating_sub(turn.elapsed()));
    }
    let took_s = begin.elapsed().as_secs_f64();
    let cpu = (world.cpu_s() - cpu_begin) / took_s;
    let script_end = scripts(&phones)?;
    let mut told =
        format!("{} phones, {took_s:.0} s: first picture {}", how.phones, spread(&mut first_s, 1.0, "s"));
    let mut per_update = Vec::new();
    let mut bytes = Vec::new();
    for (k, phone) in phones.iter().enumerate() {
        let n = updates(phone)? - updates_begin[k];
        per_update.push((script_end[k] - script_begin[k]) / n.max(1.0));
        bytes.push(phone.traffic()?.bytes as f64 * 1e-6);
    }
    let events = updates(&phones[0])? - updates_begin[0];
    let _ = write!(
        told,
        "; each {events:.0} updates, {} of script each, {} in all; server {:.0} % of a core",
        spread(&mut per_update, 1e3, "ms"),
        spread(&mut bytes, 1.0, "MB"),
        100.0 * cpu
    );
    if talker.is_some() {
        let _ = write!(
            told,
            "; {} sentences: heard after {}, in the map after {}",
            heard_s.len(),
            spread(&mut heard_s, 1e3, "ms"),
            spread(&mut placed_s, 1e3, "ms")
        );
    }
    Ok(told)
}

/// Median and worst.
fn spread(values: &mut [f64], scale: f64, unit: &str) -> String {
    values.sort_by(f64::total_cmp);
    let at = |k: usize| values.get(k).copied().unwrap_or(f64::NAN) * scale;
    format!("{:.2} {unit} (worst {:.2})", at(values.len() / 2), at(values.len().saturating_sub(1)))
}
