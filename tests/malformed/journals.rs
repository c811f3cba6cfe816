//! Rows of journals: entries, segments, checkpoints, and all of them together.

use crate::feed::{Came, Fed, feed};
use crate::medium::Medium;
use crate::seeds::{entries, identity, journal, messages};
use crate::table::{Case, case};
use toponym_journal::{Checkpoint, checkpoint, segment};
use toponym_proto::frame;

/// Where the identity, the two marks of what is durable, and the entries of a segment stand.
const HEAD_AT: usize = 64;
const SLOTS_AT: [usize; 2] = [3072, 3584];
const ENTRIES_AT: usize = 4096;

/// The rows.
pub fn cases() -> Vec<Case> {
    let mut all = single_entries();
    all.extend(segments());
    all.extend(checkpoints());
    all.extend(journals());
    all
}

fn single_entries() -> Vec<Case> {
    let entry = |kind: u8, body: &[u8]| [&7_u64.to_le_bytes()[..], &[kind], body].concat();
    let odom = messages()[1].to_bincode().unwrap();
    let boot = 3_u64.to_le_bytes();
    let rows = [
        ("nothing", vec![], Came::Short, "0"),
        ("a time alone", vec![0; 8], Came::Short, "8"),
        ("kind 0", entry(0, &[]), Came::UnknownKind, "0"),
        ("kind 7", entry(7, &[]), Came::UnknownKind, "7"),
        ("words that are no text", entry(6, &[1, 0, 0, 0, 0xff]), Came::Malformed, "no UTF-8"),
        ("words that break off", entry(6, &[2, 0, 0, 0, b'a']), Came::Short, ""),
        ("kind 255", entry(255, &[0; 40]), Came::UnknownKind, "255"),
        ("a message of nothing", entry(1, &[]), Came::Malformed, "0 bytes are no message"),
        ("a message of version 2", entry(1, &[2, 2]), Came::Malformed, "version 2"),
        ("a message of nonsense", entry(1, b"odom"), Came::Malformed, "version 111"),
        ("a message and more", entry(1, &[&odom[..], &[0]].concat()), Came::Malformed, "1 bytes too many"),
        ("a sentence without a boot", entry(2, &[0; 7]), Came::Short, "16"),
        ("a sentence that is odometry", entry(2, &[&boot[..], &odom].concat()), Came::UnknownKind, "2"),
        ("a sentence of nothing", entry(2, &boot), Came::Malformed, "0 bytes are no message"),
        ("a gap without an end", entry(3, &boot), Came::Short, "17"),
        ("time and more", entry(4, b"more"), Came::Malformed, "4 bytes too many"),
        ("a hold of no length", entry(5, &[1, 2, 3]), Came::Short, "12"),
    ];
    let row = |(name, bytes, came, told)| case(format!("entry: {name}"), Fed::Entry(bytes), came, told);
    rows.into_iter().map(row).collect()
}

/// Name and content of the segment that begins with entry 1, in which these bytes stand at a place.
fn segment_with(at: usize, bytes: &[u8]) -> Fed {
    let mut content = journal().remove(&segment::name(1)).unwrap();
    content[at..at + bytes.len()].copy_from_slice(bytes);
    Fed::Segment(segment::name(1), content)
}

/// A mark of what is durable as it is written, with its checksum.
/// The mark of slot 0.
fn mark(durable: u64) -> Vec<u8> {
    let mut bytes = durable.to_le_bytes().to_vec();
    let mut checksum = crc32fast::Hasher::new_with_initial(crc32fast::hash(identity().uuid.as_bytes()));
    checksum.update(b"slot");
    checksum.update(&[0]);
    checksum.update(&bytes);
    bytes.extend(checksum.finalize().to_le_bytes());
    bytes
}

fn segments() -> Vec<Case> {
    let whole = journal().remove(&segment::name(1)).unwrap();
    let of = |name: &str| Fed::Segment(name.into(), whole.clone());
    let cut = |length: usize| Fed::Segment(segment::name(1), whole[..length].to_vec());
    let both_slots = {
        let mut bytes = whole.clone();
        bytes[SLOTS_AT[0]..ENTRIES_AT].fill(0);
        Fed::Segment(segment::name(1), bytes)
    };
    let last_of_all = {
        let salt = crc32fast::hash(identity().uuid.as_bytes());
        let mut bytes = b"toponym-journal 2\n".to_vec();
        bytes.resize(HEAD_AT, 0);
        frame::append(&mut bytes, salt, u64::MAX, &serde_json::to_vec(&identity()).unwrap());
        bytes.resize(SLOTS_AT[0], 0);
        bytes.extend(mark(u64::MAX - 1));
        bytes.resize(ENTRIES_AT, 0);
        frame::append(&mut bytes, salt, u64::MAX, &entries()[4].to_bytes().unwrap());
        Fed::Segment(segment::name(u64::MAX), bytes)
    };
    let entries_at = format!("Some(({ENTRIES_AT}, \"a frame's checksum is another\")), 0 slots lost");
    let rows = [
        ("nothing", cut(0), Came::Damaged, "byte 0: it does not begin with \"toponym-journal 2\""),
        ("the first line alone", cut(HEAD_AT), Came::Damaged, "byte 64: breaks off before its head"),
        ("half a head", cut(HEAD_AT + 30), Came::Damaged, "byte 64: its head is longer than the file"),
        ("no marks", cut(SLOTS_AT[0]), Came::Damaged, "byte 3072: neither slot tells what is durable"),
        ("format 3", segment_with(16, b"3"), Came::Format, "format \"toponym-journal 3\""),
        ("a checkpoint's first line", segment_with(0, b"toponym-checkpoi"), Came::Damaged, "byte 0"),
        ("a name of nothing", of(""), Came::Damaged, "byte 0: its name is no segment's"),
        (
            "a name of 19 digits",
            of("0000000000000000001.journal"),
            Came::Damaged,
            "byte 0: its name is no segment's",
        ),
        (
            "a name of another",
            of(&segment::name(2)),
            Came::Damaged,
            "byte 64: its head is that of another file",
        ),
        (
            "a name of 2^64",
            of("18446744073709551616.journal"),
            Came::Damaged,
            "byte 0: its name is no segment's",
        ),
        (
            "a name of a path",
            of("../00000000000000000001.journal"),
            Came::Damaged,
            "byte 0: its name is no segment's",
        ),
        (
            "a head that never ends",
            segment_with(HEAD_AT, &[255; 4]),
            Came::Damaged,
            "byte 64: its head is longer",
        ),
        (
            "a head of nothing",
            segment_with(HEAD_AT, &[0; 4]),
            Came::Damaged,
            "byte 64: its head can't be read",
        ),
        (
            "a head that is no JSON",
            segment_with(HEAD_AT + 16, b"["),
            Came::Damaged,
            "byte 64: its head can't be read",
        ),
        (
            "another map's head",
            segment_with(HEAD_AT + 16 + 9, b"1"),
            Came::Damaged,
            "byte 64: its head's checksum is another",
        ),
        (
            "one mark lost",
            segment_with(SLOTS_AT[0], &[255; 12]),
            Came::Taken,
            "5 entries, None, 1 slots lost",
        ),
        (
            "a mark of the last entry there is",
            segment_with(SLOTS_AT[0], &mark(u64::MAX)),
            Came::Taken,
            "5 entries, None, 1 slots lost",
        ),
        ("the last entry there is", last_of_all, Came::Damaged, ""),
        ("both marks lost", both_slots, Came::Damaged, "byte 3072: neither slot tells what is durable"),
        (
            "a turned bit in an entry",
            segment_with(ENTRIES_AT + 16, &[0xff]),
            Came::Taken,
            entries_at.as_str(),
        ),
    ];
    rows.into_iter()
        .map(|(name, fed, came, told)| case(format!("segment: {name}"), fed, came, told))
        .collect()
}

fn checkpoints() -> Vec<Case> {
    let name = checkpoint::name(5);
    let whole = journal().remove(&name).unwrap();
    let read = |bytes: Vec<u8>| Fed::Checkpoint(name.clone(), bytes);
    let with = |at: usize, bytes: &[u8]| {
        let mut content = whole.clone();
        content[at..at + bytes.len()].copy_from_slice(bytes);
        read(content)
    };
    // Behind the head: the map's bytes in one frame, then how many these are.
    let salt = crc32fast::hash(identity().uuid.as_bytes());
    let end = whole.len() - (frame::HEAD + 8);
    let longer = {
        let mut bytes = whole[..end].to_vec();
        frame::append(&mut bytes, salt, 5, &14_u64.to_le_bytes());
        read(bytes)
    };
    let of_another = {
        let mut bytes = whole[..end].to_vec();
        frame::append(&mut bytes, salt, 6, &15_u64.to_le_bytes());
        read(bytes)
    };
    let broken = format!("byte {end}: a frame reaches beyond the end of the file");
    let rows = [
        ("nothing", read(vec![]), Came::Damaged, "byte 0: it does not begin with \"toponym-checkpoint 1\""),
        ("format 7", with(19, b"7"), Came::Format, "format \"toponym-checkpoint 7\""),
        (
            "half a head",
            read(whole[..80].to_vec()),
            Came::Damaged,
            "byte 64: its head is longer than the file",
        ),
        ("the end cut", read(whole[..end].to_vec()), Came::Damaged, "it is longer or shorter than it was"),
        ("the last byte cut", read(whole[..whole.len() - 1].to_vec()), Came::Damaged, broken.as_str()),
        ("zeros behind it", read([&whole[..], &[0; 512]].concat()), Came::Damaged, "breaks off"),
        ("ones behind it", read([&whole[..], &[1; 512]].concat()), Came::Damaged, "a frame reaches beyond"),
        ("all of it twice", read([&whole[..], &whole].concat()), Came::Damaged, ""),
        ("a map of another length", longer, Came::Damaged, "it is longer or shorter than it was"),
        ("a frame of another", of_another, Came::Damaged, "a frame of another checkpoint"),
        ("a turned bit in the map", with(end - 1, b"x"), Came::Damaged, "a frame's checksum is another"),
        (
            "a name of another",
            Fed::Checkpoint(checkpoint::name(6), whole.clone()),
            Came::Damaged,
            "another file",
        ),
    ];
    rows.into_iter()
        .map(|(name, fed, came, told)| case(format!("checkpoint: {name}"), fed, came, told))
        .collect()
}

fn journals() -> Vec<Case> {
    let without = |names: &[String]| {
        Fed::Journal(journal().into_iter().filter(|(name, _)| !names.contains(name)).collect())
    };
    let with = |name: String, at: usize, bytes: &[u8]| {
        let mut files = journal();
        files.get_mut(&name).unwrap()[at..at + bytes.len()].copy_from_slice(bytes);
        Fed::Journal(files.into_iter().collect())
    };
    let (old, new) = (checkpoint::name(0), checkpoint::name(5));
    let (first, last) = (segment::name(1), segment::name(6));
    let mut cut = journal();
    cut.get_mut(&last).unwrap().truncate(ENTRIES_AT + 10);
    let mut more = journal();
    more.get_mut(&last).unwrap().extend([1; 100]);
    // The older mark, in the newer one's place.
    let mut doubled = journal();
    let content = doubled.get_mut(&last).unwrap();
    let slot = content[SLOTS_AT[0]..SLOTS_AT[1]].to_vec();
    content.splice(SLOTS_AT[1]..SLOTS_AT[1], slot);
    let medium = Medium::with(journal());
    Checkpoint { identity: identity(), index: u64::MAX, map: vec![1] }.write(&medium).unwrap();
    let mut strangers = journal();
    strangers
        .extend(["new.journal", "5.checkpoint", ".journal", "notes.txt"].map(|n| (n.to_owned(), vec![1])));
    let mut foreign = journal();
    let another = foreign[&last].clone();
    foreign.insert(segment::name(9), another);
    let files =
        |files: std::collections::BTreeMap<String, Vec<u8>>| Fed::Journal(files.into_iter().collect());
    let rows = [
        ("nothing", Fed::Journal(vec![]), Came::Damaged, "checkpoint: damaged at byte 0: there is none"),
        ("no checkpoint", without(&[old.clone(), new.clone()]), Came::Damaged, "there is none"),
        (
            "no segment",
            without(&[first.clone(), last.clone()]),
            Came::Damaged,
            "the entries after 5 are missing",
        ),
        ("no last segment", without(std::slice::from_ref(&last)), Came::Taken, "5 and 0"),
        ("no first segment", without(std::slice::from_ref(&first)), Came::Taken, "5 and 4"),
        (
            "neither first segment nor checkpoint",
            without(&[first.clone(), new.clone()]),
            Came::Damaged,
            "the entries after 0 are missing",
        ),
        (
            "a bad newest checkpoint",
            with(new.clone(), 90, b"x"),
            Came::Taken,
            "0 and 9; 00000000000000000005.checkpoint",
        ),
        (
            "a bad durable entry",
            with(last.clone(), ENTRIES_AT + 20, &[255]),
            Came::Damaged,
            "where entry 6 to 9 was durable",
        ),
        ("a durable entry cut", files(cut), Came::Damaged, "where entry 6 to 9 was durable"),
        (
            "a sector that stands there twice",
            files(doubled),
            Came::Damaged,
            "more may have been durable than is left",
        ),
        (
            "ones behind the last",
            files(more),
            Came::Taken,
            "5 and 4; 00000000000000000006.journal: torn at byte",
        ),
        // It is no checkpoint of a journal: none is that long.
        ("a checkpoint of the last entry there is", files(medium.files()), Came::Taken, "5 and 4; "),
        ("files of others", files(strangers), Came::Taken, "5 and 4; "),
        ("a segment under another name", files(foreign), Came::Damaged, "its head is that of another file"),
        (
            "one mark lost",
            with(last, SLOTS_AT[0], &[255; 12]),
            Came::Damaged,
            "more may have been durable than is left",
        ),
    ];
    rows.into_iter()
        .map(|(name, fed, came, told)| case(format!("journal: {name}"), fed, came, told))
        .collect()
}

/// An entry cut to each of its lengths.
#[test]
fn an_entry_that_breaks_off_is_refused_wherever_it_does() {
    for entry in entries() {
        let whole = entry.to_bytes().unwrap();
        for length in 0..whole.len() {
            let got = feed(&Fed::Entry(whole[..length].to_vec()));
            assert!(matches!(got.came, Came::Short | Came::Malformed), "{entry:?} cut to {length}: {got:?}");
        }
    }
}
