//! The journal on a medium that fails: what was acknowledged is there, what was not may be, and damage is refused.

#![allow(clippy::unwrap_used)]

mod sim;

use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;
use sim::{CRASHES, Fault, SimDisk};
use std::collections::BTreeMap;
use toponym_journal::{Checkpoint, Entry, Event, Identity, Journal, JournalError, prune};

fn identity() -> Identity {
    Identity { uuid: "0190".into(), build: "test".into(), config: 1, seed: 2 }
}

fn entry(n: u64) -> Entry {
    Entry { at_ns: n, event: Event::Gap { boot: 7, to: n } }
}

fn bytes(n: u64) -> Vec<u8> {
    entry(n).to_bytes().unwrap()
}

/// The map of these tests: the numbers of all its entries.
fn map(upto: u64) -> Vec<u8> {
    (1..=upto).flat_map(u64::to_le_bytes).collect()
}

/// All entries that a medium still has, as folded; an error if it refuses.
fn recovered(disk: &SimDisk) -> Result<(Vec<u64>, Vec<String>), JournalError> {
    let opened = Journal::open(disk.clone())?;
    assert_eq!(opened.checkpoint.map, map(opened.checkpoint.index));
    let mut all: Vec<u64> = (1..=opened.checkpoint.index).collect();
    for (index, read) in opened.tail {
        assert_eq!(read, entry(index));
        all.push(index);
    }
    assert_eq!(opened.journal.durable(), all.len() as u64);
    Ok((all, opened.mended))
}

/// Entries in batches, with checkpoints in between; tells the number of the last that was acknowledged.
fn script(disk: &SimDisk, entries: u64) -> u64 {
    let mut acknowledged = 0;
    let Ok(journal) = Journal::create(disk.clone(), identity(), map(0)) else { return 0 };
    let mut journal = journal.with_segments_of(4096 + 700);
    for n in 1..=entries {
        journal.append(&bytes(n));
        if n % 3 == 0 || n == entries {
            let Ok(durable) = journal.commit() else { return acknowledged };
            acknowledged = durable;
        }
        if n % 36 == 0 {
            let checkpoint =
                Checkpoint { identity: identity(), index: journal.durable(), map: map(journal.durable()) };
            if checkpoint.write(disk).and_then(|()| prune(disk)).is_err() {
                return acknowledged;
            }
        }
    }
    acknowledged
}

fn whole(entries: u64) -> BTreeMap<String, Vec<u8>> {
    let disk = SimDisk::default();
    assert_eq!(script(&disk, entries), entries);
    disk.files()
}

#[test]
fn what_was_acknowledged_survives_a_stop_in_every_operation() {
    let disk = SimDisk::default();
    script(&disk, 300);
    let operations = disk.operations();
    for at in 0..operations {
        let disk = SimDisk::default();
        disk.stop_at(at);
        let acknowledged = script(&disk, 300);
        for crash in CRASHES {
            for seed in 0..3 {
                let mut random = ChaCha8Rng::seed_from_u64(seed * 100_000 + at as u64);
                let image = disk.after(crash, &mut random);
                let what = format!("stopped in operation {at}, {crash:?}, seed {seed}");
                match recovered(&image) {
                    Ok((all, _)) => {
                        assert!(all.iter().copied().eq(1..=all.len() as u64), "{what}");
                        assert!(all.len() as u64 >= acknowledged, "{what}: {} < {acknowledged}", all.len());
                    }
                    // It was stopped while it was made: there was no journal yet.
                    Err(e) => {
                        let is_begun = image.files().keys().any(|name| !name.starts_with("new."));
                        assert!(acknowledged == 0 && !is_begun, "{what}: {e}");
                    }
                }
            }
        }
    }
}

#[test]
fn what_goes_on_after_a_stop_is_as_safe() {
    for seed in 0..200 {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let mut disk = SimDisk::default();
        assert_eq!(script(&disk, 30), 30);
        let mut acknowledged = 30;
        for _ in 0..5 {
            let crash = CRASHES[random.random_range(0..CRASHES.len())];
            disk = disk.after(crash, &mut random);
            let opened = Journal::open(disk.clone()).unwrap_or_else(|e| panic!("seed {seed}: {e}"));
            let mut journal = opened.journal.with_segments_of(4096 + 700);
            assert!(journal.durable() >= acknowledged, "seed {seed}");
            disk.stop_at(disk.operations() + random.random_range(0..40));
            loop {
                let next = journal.durable() + 1;
                for n in next..next + random.random_range(1..5) {
                    journal.append(&bytes(n));
                }
                let Ok(durable) = journal.commit() else { break };
                acknowledged = durable;
                if random.random_bool(0.1) {
                    let checkpoint = Checkpoint { identity: identity(), index: durable, map: map(durable) };
                    if checkpoint.write(&disk).and_then(|()| prune(&disk)).is_err() {
                        break;
                    }
                }
            }
        }
        let (all, _) = recovered(&disk.after(CRASHES[0], &mut random)).unwrap();
        assert!(
            all.iter().copied().eq(1..=all.len() as u64) && all.len() as u64 >= acknowledged,
            "seed {seed}"
        );
    }
}

#[test]
fn a_medium_that_refuses_for_a_while_loses_nothing() {
    for fault in [Fault::ShortWrite, Fault::Full, Fault::Sync] {
        let disk = SimDisk::default();
        let mut journal = Journal::create(disk.clone(), identity(), map(0)).unwrap();
        let mut random = ChaCha8Rng::seed_from_u64(1);
        for n in 1..=60 {
            journal.append(&bytes(n));
            disk.set_fault((n % 10 > 5).then_some(fault));
            match journal.commit() {
                Ok(durable) => assert_eq!(durable, n),
                Err(e) => assert!(matches!(e, JournalError::Io { .. }), "{e}"),
            }
            let acknowledged = journal.durable();
            for crash in CRASHES {
                let (all, _) = recovered(&disk.after(crash, &mut random)).unwrap();
                assert!(
                    all.len() as u64 >= acknowledged && all.len() as u64 <= n,
                    "{fault:?} at {n}, {crash:?}"
                );
            }
        }
        assert_eq!(journal.durable(), 60);
    }
}

#[test]
fn an_acknowledgement_before_the_sync_is_caught() {
    let disk = SimDisk::default();
    let mut journal = Journal::create(disk.clone(), identity(), map(0)).unwrap();
    disk.set_fault(Some(Fault::Lie));
    let mut random = ChaCha8Rng::seed_from_u64(1);
    let mut caught = 0;
    for n in 1..=20 {
        journal.append(&bytes(n));
        let acknowledged = journal.commit().unwrap();
        let lost = |image| recovered(&image).map_or(true, |(all, _)| (all.len() as u64) < acknowledged);
        caught += CRASHES.iter().filter(|crash| lost(disk.after(**crash, &mut random))).count();
    }
    assert!(caught > 20, "{caught}");
}

#[test]
fn no_flipped_bit_changes_what_is_recovered() {
    let files = whole(100);
    let names: Vec<&String> = files.keys().collect();
    assert!(names.iter().filter(|n| n.ends_with(".journal")).count() > 2, "{names:?}");
    let (mut refused, mut mended, mut harmless) = (0, 0, 0);
    for (name, content) in &files {
        // Each byte that was written, and some of those that were not.
        for at in (0..content.len()).filter(|at| content[*at] != 0 || at % 16 == 0) {
            let bit = (at * 7 + 3) % 8;
            let mut turned = files.clone();
            turned.get_mut(name).unwrap()[at] ^= 1 << bit;
            match recovered(&SimDisk::with(turned)) {
                Ok((all, notes)) => {
                    assert_eq!(all.len(), 100, "{name} bit {bit} of byte {at}");
                    if notes.is_empty() { harmless += 1 } else { mended += 1 }
                }
                Err(JournalError::Damaged { .. }) => refused += 1,
                // The version in the first line: it is told as that of another build.
                Err(JournalError::Format { .. }) => assert!(at < 32, "{name} byte {at}"),
                Err(e) => panic!("{name} byte {at}: {e}"),
            }
        }
    }
    assert!(refused > 500 && mended > 10 && harmless > 500, "{refused} {mended} {harmless}");
}

/// `TOPONYM_DAMAGES` sets how often (3000), `TOPONYM_SEED` which.
#[test]
fn no_damage_changes_what_is_recovered() {
    let setting =
        |name: &str, default| std::env::var(name).ok().map_or(default, |text| text.parse().unwrap());
    let (damages, seed): (u64, u64) = (setting("TOPONYM_DAMAGES", 3000), setting("TOPONYM_SEED", 1));
    let files = whole(40);
    let names: Vec<&String> = files.keys().collect();
    let (mut random, mut refused, mut whole) = (ChaCha8Rng::seed_from_u64(seed), 0, 0);
    for damage in 0..damages {
        let mut damaged = files.clone();
        for _ in 0..random.random_range(1..4) {
            let name = names[random.random_range(0..names.len())];
            let content = damaged.get_mut(name).unwrap();
            let at = random.random_range(0..content.len());
            let end = (at + random.random_range(1..600)).min(content.len());
            match random.random_range(0..4) {
                0 => content[at] ^= 1 << random.random_range(0..8),
                1 => content[at..end].fill(0),
                2 => content[at..end].iter_mut().for_each(|byte| *byte = random.random()),
                // Something of the file in another place of it.
                _ => {
                    let to = random.random_range(0..=content.len() - (end - at));
                    content.copy_within(at..end, to);
                }
            }
        }
        match recovered(&SimDisk::with(damaged)) {
            Ok((all, _)) => {
                assert_eq!(all.len(), 40, "damage {damage} of seed {seed}");
                whole += 1;
            }
            Err(_) => refused += 1,
        }
    }
    println!("{damages} damages: {refused} refused, {whole} mended or harmless");
    assert!(refused > 0 && whole > 0);
}

#[test]
fn no_block_of_zeros_changes_what_is_recovered() {
    let files = whole(100);
    for (name, content) in &files {
        for block in [16, 512, 4096] {
            for at in (0..content.len()).step_by(block) {
                let mut zeroed = files.clone();
                let end = (at + block).min(content.len());
                zeroed.get_mut(name).unwrap()[at..end].fill(0);
                match recovered(&SimDisk::with(zeroed)) {
                    Ok((all, _)) => assert_eq!(all.len(), 100, "{name}: {block} zeros at {at}"),
                    Err(e) => assert!(matches!(e, JournalError::Damaged { .. }), "{e}"),
                }
            }
        }
    }
}

#[test]
fn a_cut_file_is_refused() {
    let files = whole(50);
    for (name, content) in &files {
        for cut in (0..content.len()).step_by(37) {
            let mut short = files.clone();
            short.get_mut(name).unwrap().truncate(cut);
            if let Ok((all, _)) = recovered(&SimDisk::with(short)) {
                assert_eq!(all.len(), 50, "{name} cut to {cut}");
            }
        }
    }
}

#[test]
fn a_damage_is_told_with_its_file_and_offset() {
    let mut files = whole(5);
    let name = "00000000000000000001.journal";
    files.get_mut(name).unwrap()[4096 + 60] ^= 1;
    let error = Journal::open(SimDisk::with(files)).err().unwrap().to_string();
    assert!(error.contains(name) && error.contains("byte 4137") && error.contains("entry 2 to 5"), "{error}");
}

#[test]
fn what_is_left_of_a_damaged_journal_can_be_rescued() {
    let mut files = whole(5);
    files.get_mut("00000000000000000001.journal").unwrap()[4096 + 41 * 3] ^= 1;
    let rescued = toponym_journal::recover::rescue(&SimDisk::with(files)).unwrap();
    assert_eq!((rescued.tail.len(), rescued.losses.len()), (3, 1), "{:?}", rescued.losses);
    let disk = SimDisk::default();
    rescued.write(disk.clone()).unwrap();
    assert_eq!(recovered(&disk).unwrap().0, [1, 2, 3]);
}

#[test]
fn files_of_another_map_are_not_taken() {
    let (mut files, other) = (whole(5), SimDisk::default());
    let mut journal =
        Journal::create(other.clone(), Identity { uuid: "other".into(), ..identity() }, map(0)).unwrap();
    for n in 1..=5 {
        journal.append(&bytes(n));
    }
    journal.commit().unwrap();
    let name = "00000000000000000001.journal".to_owned();
    files.insert(name.clone(), other.files()[&name].clone());
    let error = Journal::open(SimDisk::with(files)).err().unwrap().to_string();
    assert!(error.contains("another map"), "{error}");
}

/// Five entries as they were written before slots told their place.
#[test]
fn a_journal_of_the_format_before_is_read_and_goes_on_in_this_one() {
    let mut segment = include_bytes!("format-1/00000000000000000001.journal").to_vec();
    segment.resize(4796, 0);
    let checkpoint = include_bytes!("format-1/00000000000000000000.checkpoint").to_vec();
    let files = BTreeMap::from([
        ("00000000000000000001.journal".to_owned(), segment),
        ("00000000000000000000.checkpoint".to_owned(), checkpoint),
    ]);
    let disk = SimDisk::with(files);
    let mut journal = Journal::open(disk.clone()).unwrap().journal;
    journal.append(&bytes(6));
    assert_eq!(journal.commit().unwrap(), 6);
    assert_eq!(recovered(&disk).unwrap(), (vec![1, 2, 3, 4, 5, 6], Vec::new()));
    assert!(disk.files()["00000000000000000006.journal"].starts_with(b"toponym-journal 2\n"));
}

#[test]
fn a_slot_in_the_other_ones_place_is_not_believed() {
    let mut files = whole(5);
    let segment = files.get_mut("00000000000000000001.journal").unwrap();
    let slots = [segment[3072..3084].to_vec(), segment[3584..3596].to_vec()];
    for (at, slot) in [(3072, &slots[1]), (3584, &slots[0])] {
        let mut files = files.clone();
        files.get_mut("00000000000000000001.journal").unwrap()[at..at + 12].copy_from_slice(slot);
        // One slot is lost: as long as all entries are there nothing else is.
        if let Ok((all, _)) = recovered(&SimDisk::with(files)) {
            assert_eq!(all, [1, 2, 3, 4, 5]);
        }
    }
}
