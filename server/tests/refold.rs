//! Real logs through the journal's fold: whole, and as a checkpoint and the rest, on one thread and on two, they make the same
//! map to the bit. Skipped where there are no logs.
//!
//! `TOPONYM_REFOLD` sets how many messages of each log (1500) and `TOPONYM_SEEDS` with how many seeds (3).

#![allow(clippy::unwrap_used)]

use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;
use std::path::{Path, PathBuf};
use std::time::Duration;
use toponym::log::{self, Options};
use toponym_core::Mapper;
use toponym_journal::{Entry, Event};
use toponym_proto::Say;
use toponym_server::fold::{Card, Fold};

const LOGS: [&str; 5] = [
    "lidar/intel.clf.gz",
    "lidar/mit-csail.clf.gz",
    "stata/tour/tour.clf.gz",
    "cases/demo-building-odometry-break/b_pause3.clf.gz",
    "cases/hall-look-alike-corners/min_hall.rec.gz",
];

fn setting(name: &str, default: u64) -> u64 {
    std::env::var(name).ok().map_or(default, |text| text.parse().unwrap())
}

/// What the server would have on disk of a log, told a sentence now and then.
fn entries(log: &Path, messages: usize) -> Vec<Entry> {
    let options = Options { robot: "r1".into(), map: "main".into(), boot: 1 };
    let mut entries: Vec<Entry> = Vec::new();
    for record in log::open(log, &options).unwrap().take(messages) {
        let message = record.message;
        let at_ns = entries.last().map_or(0, |entry| entry.at_ns) + 20_000_000;
        let began = message.header().map(|header| header.stamp);
        entries.push(Entry { at_ns, event: Event::Message(message) });
        if entries.len().is_multiple_of(400) {
            let n = entries.len() / 400;
            let text =
                if n.is_multiple_of(2) { format!("this is room {n}") } else { "this is the kitchen".into() };
            let say = Say { id: format!("s{n}"), text, began, robot: Some("r1".into()), ..Say::default() };
            entries.push(Entry { at_ns, event: Event::Say { boot: 1, say } });
        }
    }
    entries
}

fn newborn(seed: u64) -> Fold {
    let config = toponym_core::Config { particles: 5, seed, ..Default::default() };
    let card = Card { uuid: "u".into(), robot: "r1".into(), ..Card::default() };
    Fold::new(Mapper::new(config), card, Duration::from_millis(500))
}

/// The map after more entries, as bytes.
fn folded(mut fold: Fold, entries: &[Entry], threads: usize) -> Vec<u8> {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
    pool.install(|| {
        for entry in entries {
            fold.take(entry.clone(), &mut |_| {});
        }
        fold.save().unwrap()
    })
}

#[test]
fn real_logs_refold_to_the_bit() {
    let folder: PathBuf = [env!("CARGO_MANIFEST_DIR"), "../../shared/data"].iter().collect();
    let messages = setting("TOPONYM_REFOLD", 1500) as usize;
    for name in LOGS {
        let log = folder.join(name);
        if !log.exists() {
            println!("skipped: {} is not there", log.display());
            continue;
        }
        let entries = entries(&log, messages);
        for seed in 1..=setting("TOPONYM_SEEDS", 3) {
            let whole = folded(newborn(seed), &entries, 1);
            assert!(
                whole == folded(newborn(seed), &entries, 2),
                "{name}, seed {seed}: two threads make another map"
            );
            let cut = ChaCha8Rng::seed_from_u64(seed).random_range(0..entries.len());
            let (before, after) = entries.split_at(cut);
            let checkpoint = folded(newborn(seed), before, 2);
            let rest = folded(Fold::load(&checkpoint).unwrap(), after, 1);
            assert!(whole == rest, "{name}, seed {seed}: a checkpoint after {cut} entries makes another map");
        }
        println!("{name}: {} entries", entries.len());
    }
}
