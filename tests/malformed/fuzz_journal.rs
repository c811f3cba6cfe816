//! Targets: the files of a journal. As a medium damages them, all that was durable is there, or it is said to be
//! damaged; as somebody forges them who knows the checksums, nothing panics, and what opens goes on.

use crate::fuzz::is_sound;
use crate::medium::Medium;
use crate::mutate::{Mutator, fuzz};
use crate::seeds::{entries, identity, journal};
use rand::RngExt as _;
use std::collections::BTreeMap;
use toponym_journal::recover::rescue;
use toponym_journal::{Checkpoint, Entry, Event, Identity, Journal, Opened, prune, segment};
use toponym_proto::frame::{self, HEAD};
use toponym_proto::{Limits, Message};

type Files = BTreeMap<String, Vec<u8>>;

/// Where the identity, the marks of what is durable, and the entries stand.
const HEAD_AT: usize = 64;
const SLOTS_AT: [usize; 2] = [3072, 3584];
const ENTRIES_AT: usize = 4096;

/// Makes the checksums of a file right again, as far as its lengths lead.
fn seal(name: &str, bytes: &mut [u8]) {
    let of_identity = |json: &[u8]| serde_json::from_slice::<Identity>(json).map(|identity| identity.uuid);
    let length = frame::u32_at(bytes, HEAD_AT).unwrap_or_default() as usize;
    let json = bytes.get(HEAD_AT + HEAD..HEAD_AT + HEAD + length).unwrap_or_default();
    let salt = crc32fast::hash(of_identity(json).unwrap_or(identity().uuid).as_bytes());
    let after_head = seal_frames(bytes, HEAD_AT, 1, salt);
    if name.ends_with("journal") {
        seal_frames(bytes, ENTRIES_AT, usize::MAX, salt);
        for at in SLOTS_AT {
            let Some(mark) = frame::u64_at(bytes, at) else { continue };
            let mut checksum = crc32fast::Hasher::new_with_initial(salt);
            checksum.update(b"slot");
            checksum.update(&mark.to_le_bytes());
            if let Some(place) = bytes.get_mut(at + 8..at + 12) {
                place.copy_from_slice(&checksum.finalize().to_le_bytes());
            }
        }
    } else {
        seal_frames(bytes, after_head, usize::MAX, salt);
    }
}

fn seal_frames(bytes: &mut [u8], mut at: usize, frames: usize, salt: u32) -> usize {
    for _ in 0..frames {
        let (Some(length), Some(index)) = (frame::u32_at(bytes, at), frame::u64_at(bytes, at + 8)) else {
            break;
        };
        let end = at + HEAD + length as usize;
        let Some(payload) = bytes.get(at + HEAD..end).filter(|payload| !payload.is_empty()) else { break };
        let mut sealed = Vec::new();
        frame::append(&mut sealed, salt, index, payload);
        bytes[at..end].copy_from_slice(&sealed);
        at = end;
    }
    at
}

fn opened(files: Files) -> Option<(Opened<Medium>, Medium)> {
    let medium = Medium::with(files);
    Some((Journal::open(medium.clone()).ok()?, medium))
}

/// Entry by entry, in bytes: NaN is not itself.
fn written(tail: &[(u64, Entry)]) -> Vec<(u64, Vec<u8>)> {
    tail.iter().map(|(index, entry)| (*index, entry.to_bytes().unwrap())).collect()
}

/// Entries follow the checkpoint without a gap, are valid, and are read again as they are written.
fn tail_is_sound(checkpoint: &Checkpoint, tail: &[(u64, Entry)]) {
    for (next, (index, entry)) in (checkpoint.index + 1..).zip(tail) {
        assert_eq!(*index, next);
        let bytes = entry.to_bytes().unwrap();
        assert_eq!(Entry::from_bytes(&bytes).unwrap().to_bytes().unwrap(), bytes);
        match &entry.event {
            Event::Message(message) => is_sound(message, &Limits::NONE),
            Event::Say { say, .. } => is_sound(&Message::Say(say.clone()), &Limits::NONE),
            Event::Gap { .. } | Event::Tick | Event::Hold(_) | Event::Glossary(_) => {}
        }
    }
}

/// What was opened takes an entry more, and is opened with it again.
fn goes_on(opened: Opened<Medium>, medium: &Medium) {
    let Opened { mut journal, checkpoint, mut tail, .. } = opened;
    let entry = Entry { at_ns: 1, event: Event::Tick };
    let index = journal.append(&entry.to_bytes().unwrap());
    assert_eq!(journal.commit().unwrap(), index);
    tail.push((index, entry));
    let again = Journal::open(medium.clone()).unwrap();
    assert_eq!((&again.checkpoint, written(&again.tail)), (&checkpoint, written(&tail)));
    prune(medium).unwrap();
    assert_eq!(Journal::open(medium.clone()).unwrap().checkpoint, checkpoint);
}

/// What can still be read is what was written, and makes a journal of its own.
fn is_rescued(files: Files) -> Option<Vec<(u64, Vec<u8>)>> {
    let saved = rescue(&Medium::with(files)).ok()?;
    tail_is_sound(&saved.checkpoint, &saved.tail);
    let medium = Medium::default();
    saved.write(medium.clone()).unwrap();
    let again = Journal::open(medium).unwrap();
    assert_eq!(again.checkpoint.map, saved.checkpoint.map);
    assert_eq!(again.tail.len(), saved.tail.len());
    Some(written(&saved.tail))
}

/// The files of a journal as inputs: which of them, then what is in it.
fn mutator(files: &Files) -> Mutator {
    let seeds = (0..).zip(files.values()).map(|(k, content)| [&[k], content.as_slice()].concat()).collect();
    let tokens = r#"{ } " "uuid": 0192-aa toponym-journal toponym-checkpoint r07"#;
    Mutator { seeds, ..Mutator::of_texts(&[], tokens) }
}

/// A journal in which one file is the input's, and that file's name.
fn with_input(mut files: Files, input: &[u8]) -> Option<(Files, String)> {
    let (which, content) = input.split_first()?;
    let name = files.keys().nth(usize::from(*which) % files.len())?.clone();
    files.insert(name.clone(), content.to_vec());
    Some((files, name))
}

#[test]
fn fuzz_damaged_journals() {
    let all = written(&(1..).zip(entries()).collect::<Vec<_>>());
    let mutator = mutator(&journal());
    fuzz(
        "damaged journals",
        1,
        |random| mutator.damaged(random),
        |input, _| {
            let Some((files, name)) = with_input(journal(), input) else { return false };
            if let Some(saved) = is_rescued(files.clone()) {
                assert!(saved.iter().all(|entry| all.contains(entry)), "what is rescued is what was written");
            }
            let Some((opened, medium)) = opened(files) else {
                assert!(input[1..] != journal()[&name], "{name} is as it was");
                return false;
            };
            let index = opened.checkpoint.index as usize;
            let (left, durable) = (written(&opened.tail), &all[index..]);
            if opened.mended.iter().any(|told| told.contains("marks of what is durable is lost;")) {
                // A mark and, by a second damage, all of the last entries: no file tells that from a stop before them.
                assert!(durable.starts_with(&left), "{name}: what is left is what was durable");
            } else {
                assert_eq!(left, durable, "{name}: what was durable is there");
            }
            goes_on(opened, &medium);
            true
        },
    );
}

#[test]
fn fuzz_forged_journals() {
    let mutator = mutator(&journal());
    fuzz(
        "forged journals",
        1,
        |random| mutator.input(random),
        |input, random| {
            let Some((mut files, name)) = with_input(journal(), input) else { return false };
            let content = files.get_mut(&name).unwrap();
            if random.random_bool(0.7) {
                seal(&name, content);
            }
            if let Ok(checkpoint) = Checkpoint::read(&name, content) {
                let medium = Medium::default();
                checkpoint.write(&medium).unwrap();
                let (name, bytes) = medium.files().pop_first().unwrap();
                assert_eq!(Checkpoint::read(&name, &bytes).unwrap(), checkpoint);
            }
            if let Ok(segment) = segment::read(&name, content) {
                assert!(
                    segment
                        .entries
                        .iter()
                        .all(|entry| entry.start <= entry.end && entry.end <= content.len())
                );
            }
            let _ = is_rescued(files.clone());
            let Some((opened, medium)) = opened(files) else { return false };
            tail_is_sound(&opened.checkpoint, &opened.tail);
            goes_on(opened, &medium);
            true
        },
    );
}
