//! A guide at their page: types, talks, asks, takes back, and goes on where there is no connection.

use crate::cdp::Page;
use crate::world::{ROBOT, World};
use anyhow::{Context, ensure};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde_json::Value;
use std::collections::BTreeMap;
use std::thread;
use std::time::{Duration, Instant};

/// No robot stays in a room for so long.
const STANDS: Duration = Duration::from_secs(120);

/// The item of a sentence.
fn item(text: &str) -> String {
    format!(
        "[...document.querySelectorAll('#sentences li')].filter(li => li.querySelector('.said').textContent === {text:?}).at(-1)"
    )
}

/// Waits until a sentence is in that state.
fn until(page: &Page, text: &str, state: &str) -> anyhow::Result<()> {
    page.until(&format!("{}?.classList.contains({state:?})", item(text)), &format!("{text:?} {state}"))
}

/// Opens the page, once the robot is there to be talked to.
///
/// # Errors
/// If that does not happen.
pub fn open(page: &Page, host: &str) -> anyhow::Result<()> {
    page.open(&format!("http://{host}/guide"))?;
    page.until("document.getElementById('connection').textContent === 'connected'", "connected")?;
    page.until(&format!("document.getElementById('robot').value === {ROBOT:?}"), "the robot")
}

/// Types a sentence; tells how long it took until it was heard, and until it was in the map, seconds.
///
/// # Errors
/// If it is not understood.
pub fn types(page: &Page, text: &str) -> anyhow::Result<(f64, f64)> {
    let begin = Instant::now();
    page.enter("#text", text)?;
    page.until(&format!("{}?.matches('.read, .understood')", item(text)), &format!("{text:?} heard"))?;
    let heard_s = begin.elapsed().as_secs_f64();
    until(page, text, "understood")?;
    Ok((heard_s, begin.elapsed().as_secs_f64()))
}

/// Waits until the robot is so far from where it is now, metres: in another room.
///
/// # Errors
/// If it does not drive.
pub fn is_driven(page: &Page, metres: f64) -> anyhow::Result<()> {
    let at = |page: &Page| -> anyhow::Result<[f64; 2]> {
        let pose = page.eval(&format!("fetch('/robot/{ROBOT}/out/pose').then(r => r.json())"))?;
        let of = |axis: &str| pose["map_from_body"][axis].as_f64().context("no pose");
        Ok([of("x_m")?, of("y_m")?])
    };
    let ([x_m, y_m], begin) = (at(page)?, Instant::now());
    loop {
        let [x, y] = at(page)?;
        if (x - x_m).hypot(y - y_m) > metres {
            return Ok(());
        }
        ensure!(begin.elapsed() < STANDS, "the robot stands");
        thread::sleep(Duration::from_millis(200));
    }
}

/// Holds the button and talks; the recogniser, ours, guesses.
///
/// # Errors
/// If the likeliest guess is not understood.
pub fn talks(page: &Page, guesses: &[(&str, f64)]) -> anyhow::Result<()> {
    page.eval(&format!("toBeHeard.push({})", serde_json::to_string(guesses)?))?;
    page.mouse("#talk", "mousePressed")?;
    let words = guesses[0].0;
    page.until(&format!("document.getElementById('sofar').textContent === {words:?}"), "words so far")?;
    page.mouse("#talk", "mouseReleased")?;
    until(page, words, "understood")
}

/// Takes back a sentence.
///
/// # Errors
/// If it can't be.
pub fn takes_back(page: &Page, text: &str) -> anyhow::Result<()> {
    let button =
        format!("[...{}.querySelectorAll('button')].find(b => b.textContent === 'Not that')", item(text));
    page.until(&button, "a button to take it back")?;
    page.eval(&format!("{button}.click()"))?;
    until(page, text, "undone")
}

/// Asks where something is; tells the words of the answer.
///
/// # Errors
/// If there is none.
pub fn asks(page: &Page, question: &str) -> anyhow::Result<String> {
    page.enter("#text", question)?;
    let words = format!("{}?.querySelector('.words')?.textContent", item(question));
    page.until(&words, "an answer")?;
    Ok(page.eval(&words)?.as_str().unwrap_or_default().to_owned())
}

/// What goes away for a while.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Away {
    Network,
    Server,
}

/// Says `count` sentences while network and server go away for up to `cut_s` seconds, and the page is loaded anew; all are
/// to be there in the end, in their order, and once each.
///
/// # Errors
/// If they are not.
pub fn is_cut_off(
    page: &Page,
    world: &mut World,
    count: usize,
    cut_s: f64,
    seed: u64,
) -> anyhow::Result<String> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut away: BTreeMap<Away, Instant> = BTreeMap::new();
    let mut times = [0; 3];
    let said: Vec<String> = (0..count).map(|k| format!("This is room {}.", 100 + k)).collect();
    for (k, text) in said.iter().enumerate() {
        let due: Vec<Away> =
            away.iter().filter(|(_, at)| **at <= Instant::now()).map(|(what, _)| *what).collect();
        for what in due {
            back(page, world, what)?;
            away.remove(&what);
        }
        // The first three sentences meet each kind, the others each tenth.
        let kind = if k < 3 { k } else { random.random_range(0..30) };
        let until = Instant::now() + Duration::from_secs_f64(random.random_range(cut_s.min(2.0)..=cut_s));
        match kind {
            0 if !away.contains_key(&Away::Network) => {
                page.offline(true)?;
                away.insert(Away::Network, until);
            }
            1 if !away.contains_key(&Away::Server) => {
                world.kill();
                away.insert(Away::Server, until);
            }
            2 => page.reload()?,
            _ => {}
        }
        if kind < 3 {
            times[kind] += 1;
        }
        page.enter("#text", text)?;
        thread::sleep(Duration::from_millis(random.random_range(50..600)));
    }
    for what in away.into_keys() {
        back(page, world, what)?;
    }
    let begin = Instant::now();
    page.until(
        "![...document.querySelectorAll('#sentences li')].some(li => li.matches('.waiting, .read'))",
        "all done",
    )?;
    let settled_s = begin.elapsed().as_secs_f64();
    let kept = kept(page)?;
    let ours: Vec<&String> = kept.iter().filter(|text| said.contains(text)).collect();
    let lost = said.iter().filter(|text| !ours.contains(text)).count();
    let doubled = ours.len() + lost - said.len();
    ensure!(lost == 0 && doubled == 0, "{lost} sentences lost, {doubled} doubled");
    ensure!(ours.iter().zip(&said).all(|(a, b)| *a == b), "out of order: {ours:?}");
    let [network, server, loads] = times;
    Ok(format!(
        "{count} sentences, {network} cuts of the network, {server} kills, {loads} loads: 0 lost, 0 doubled, in order; all \
         done {settled_s:.1} s after the last"
    ))
}

fn back(page: &Page, world: &mut World, what: Away) -> anyhow::Result<()> {
    match what {
        Away::Network => page.offline(false),
        Away::Server => world.start_again(),
    }
}

/// All that the map has heard, in its order.
fn kept(page: &Page) -> anyhow::Result<Vec<String>> {
    let reply: Value = page.eval("fetch('/map/main/sentences').then(r => r.json())")?;
    let all = reply["sentences"].as_array().context("no sentences")?;
    Ok(all.iter().map(|s| s["text"].as_str().unwrap_or_default().to_owned()).collect())
}
