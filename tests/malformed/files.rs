//! Rows of records.

use crate::feed::{Came, Fed, feed};
use crate::seeds::{record, record_1, stream};
use crate::table::{Case, case};
use toponym_proto::frame;
use toponym_proto::record::{MAGIC, MAGIC_1, Origin};

/// A record of format 2 from its frames: number and payload.
fn framed(frames: &[(u64, &[u8])]) -> Vec<u8> {
    let mut bytes = MAGIC.to_vec();
    for (index, payload) in frames {
        frame::append(&mut bytes, 0, *index, payload);
    }
    bytes
}

/// Where the first message's frame begins.
fn first_at() -> usize {
    framed(&[(0, &serde_json::to_vec(&Origin::default()).unwrap())]).len()
}

/// A record in which these bytes stand at a place.
fn spoiled(at: usize, bytes: &[u8]) -> Vec<u8> {
    let mut whole = record(&stream(), &Origin::default());
    whole[at..at + bytes.len()].copy_from_slice(bytes);
    whole
}

/// The rows.
pub fn cases() -> Vec<Case> {
    let mut all = heads();
    all.extend(frames());
    all.extend(format_1());
    let named = |mut case: Case| {
        case.name = format!("record: {}", case.name);
        case
    };
    all.into_iter().map(named).collect()
}

fn heads() -> Vec<Case> {
    let origin = |json: &str| framed(&[(0, json.as_bytes())]);
    let deep = format!("{{\"map\": {}{}}}", "[".repeat(10_000), "]".repeat(10_000));
    let rows = [
        ("nothing", vec![], Came::NotARecord, ""),
        ("part of the first line", MAGIC[..16].to_vec(), Came::NotARecord, ""),
        ("the first line alone", MAGIC.to_vec(), Came::NotARecord, ""),
        ("format 3", b"toponym-record 3\n".to_vec(), Came::NotARecord, ""),
        ("another line break", b"toponym-record 2\r\n".to_vec(), Came::NotARecord, ""),
        ("a mark of byte order", [b"\xef\xbb\xbf", MAGIC].concat(), Came::NotARecord, ""),
        ("a journal", b"toponym-journal 2\n".to_vec(), Came::NotARecord, ""),
        ("half an origin", framed(&[(0, b"{}")])[..30].to_vec(), Came::NotARecord, ""),
        ("an origin that is no JSON", origin("origin"), Came::Damaged, "byte 17: its origin: expected value"),
        ("an origin of nothing", origin("{}"), Came::Damaged, "byte 17: its origin: missing field `first`"),
        (
            "an origin before the first",
            origin("{\"first\": -1}"),
            Came::Damaged,
            "byte 17: its origin: invalid value",
        ),
        (
            "an origin of 2^64",
            origin("{\"first\": 18446744073709551616}"),
            Came::Damaged,
            "byte 17: its origin",
        ),
        ("an origin 10 000 deep", origin(&deep), Came::Damaged, "byte 17: its origin"),
        (
            "an origin in no UTF-8",
            framed(&[(0, b"{\"map\": \"\xff\", \"first\": 1}")]),
            Came::Damaged,
            "byte 17: its origin",
        ),
        ("an origin alone", origin("{\"first\": 1}"), Came::Taken, "0 messages"),
    ];
    rows.into_iter().map(|(name, bytes, came, told)| case(name, Fed::Record(bytes), came, told)).collect()
}

fn frames() -> Vec<Case> {
    let at = first_at();
    let here = |why: &str| format!("byte {at}: {why}");
    let origin = br#"{"map":"","first":1}"#;
    let odom = stream()[1].to_bincode().unwrap();
    let whole = record(&stream(), &Origin::default());
    let with = |more: &[u8]| [whole.as_slice(), more].concat();
    let limit = (64_u32 << 20) + 1;
    let messages = |frames: &[(u64, &[u8])]| framed(&[&[(0, &origin[..])], frames].concat());
    let after = whole.len();
    let last = framed(&[(0, br#"{"first":18446744073709551615}"#), (u64::MAX, &odom)]);
    let rows = [
        ("a length of 2^32 - 1", spoiled(at, &[255; 4]), Came::Damaged, here("a length that no message has")),
        (
            "a length of 64 MiB and one",
            spoiled(at, &limit.to_le_bytes()),
            Came::Damaged,
            here("a length that no"),
        ),
        (
            "a length beyond its end",
            spoiled(at, &(1_u32 << 20).to_le_bytes()),
            Came::Taken,
            "0 messages, torn".into(),
        ),
        ("a length of 0", spoiled(at, &[0; 4]), Came::Damaged, here("a frame of length 0")),
        ("another checksum", spoiled(at + 4, &[0; 4]), Came::Damaged, here("a frame's checksum is another")),
        ("another number", spoiled(at + 8, &[9]), Came::Damaged, here("a frame's checksum is another")),
        ("a turned bit", spoiled(at + 16, &[0x81]), Came::Damaged, here("a frame's checksum is another")),
        // Nothing is left to count on with.
        ("the last number there is", last, Came::Damaged, "no number is left".into()),
        ("zeros behind it", with(&[0; 64]), Came::Damaged, format!("byte {after}: nothing stands here")),
        ("ones behind it", with(&[1; 64]), Came::Taken, "9 messages, torn".into()),
        ("a byte behind it", with(&[1]), Came::Taken, "9 messages, torn".into()),
        ("message 2 first", messages(&[(2, &odom)]), Came::Damaged, here("message 2 where 1 is expected")),
        (
            "message 1 twice",
            messages(&[(1, &odom), (1, &odom)]),
            Came::Damaged,
            "message 1 where 2 is expected".into(),
        ),
        (
            "a message of nonsense",
            messages(&[(1, b"odom")]),
            Came::BrokenMessage,
            format!("message 1 at byte {at}: version 111"),
        ),
        (
            "a message of type 9",
            messages(&[(1, &[1, 9, 0])]),
            Came::BrokenMessage,
            "unknown type id 9".into(),
        ),
        (
            "JSON",
            messages(&[(1, &stream()[1].to_json().unwrap())]),
            Came::BrokenMessage,
            "version 123".into(),
        ),
        (
            "more than a message",
            messages(&[(1, &[&odom[..], &[0]].concat())]),
            Came::BrokenMessage,
            "1 bytes too many".into(),
        ),
        (
            "a message that servers refuse",
            messages(&[(1, &bad_odom())]),
            Came::BrokenMessage,
            "odom_from_body.x_m".into(),
        ),
        ("all of it twice", with(&whole), Came::Damaged, format!("byte {after}")),
    ];
    rows.into_iter().map(|(name, bytes, came, told)| case(name, Fed::Record(bytes), came, &told)).collect()
}

fn bad_odom() -> Vec<u8> {
    let mut odom = crate::seeds::odom();
    odom.odom_from_body.x_m = f64::NAN;
    toponym_proto::Message::Odom(odom).to_bincode().unwrap()
}

fn format_1() -> Vec<Case> {
    let with = |length: u32, payload: &[u8]| [MAGIC_1, &length.to_le_bytes(), payload].concat();
    let odom = stream()[1].to_bincode().unwrap();
    let length = odom.len() as u32;
    let rows = [
        ("nothing", MAGIC_1.to_vec(), Came::Taken, "0 messages"),
        ("part of a length", [MAGIC_1, &[1, 2]].concat(), Came::Taken, "0 messages, torn"),
        (
            "a message of no bytes",
            with(0, &[]),
            Came::BrokenMessage,
            "message 0 at byte 17: 0 bytes are no message",
        ),
        (
            "a length of 2^32 - 1",
            with(u32::MAX, &odom),
            Came::Damaged,
            "byte 17: a length that no message has",
        ),
        ("a length too long by one", with(length + 1, &odom), Came::Taken, "0 messages, torn"),
        ("a length too short by one", with(length - 1, &odom), Came::BrokenMessage, "not the bincode"),
        (
            "a message that servers refuse",
            with(length, &bad_odom()),
            Came::BrokenMessage,
            "odom_from_body.x_m",
        ),
        (
            "frames",
            [MAGIC_1, &record(&stream(), &Origin::default())[17..]].concat(),
            Came::BrokenMessage,
            "message 0 at byte 17",
        ),
    ];
    let row = |(name, bytes, came, told)| case(format!("format 1: {name}"), Fed::Record(bytes), came, told);
    rows.into_iter().map(row).collect()
}

/// A record cut to each of its lengths is read up to there, or is none yet.
#[test]
fn a_record_that_breaks_off_lacks_only_what_is_cut() {
    let origin = first_at();
    for (whole, begin) in
        [(record(&stream(), &Origin::default()), origin), (record_1(&stream()), MAGIC_1.len())]
    {
        for length in 0..whole.len() {
            let got = feed(&Fed::Record(whole[..length].to_vec()));
            let want = if length < begin { Came::NotARecord } else { Came::Taken };
            assert_eq!(got.came, want, "cut to {length}: {got:?}");
        }
    }
}
