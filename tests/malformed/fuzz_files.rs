//! Targets: records, logs and narrations.

use crate::fuzz::is_sound;
use crate::mutate::{Mutator, fuzz};
use crate::seeds::{CARMEN, NARRATION, record, record_1, stream};
use rand::RngExt as _;
use toponym::log::{CarmenLog, LogRecord, Narration, Notes, Options, RecordedLog, Records, carmen, merged};
use toponym_proto::frame::{self, HEAD};
use toponym_proto::record::{MAGIC, Origin, RecordReader};
use toponym_proto::{Limits, Message, Stamp};

/// Makes the checksums of a record's frames right again, as far as its lengths lead.
fn seal(bytes: &mut Vec<u8>) {
    let mut sealed = MAGIC.to_vec();
    let mut at = MAGIC.len();
    while let (Some(length), Some(index)) = (frame::u32_at(bytes, at), frame::u64_at(bytes, at + 8)) {
        let Some(payload) = bytes.get(at + HEAD..at + HEAD + length as usize) else { break };
        frame::append(&mut sealed, 0, index, payload);
        at += HEAD + length as usize;
    }
    sealed.extend(bytes.get(at..).unwrap_or_default());
    *bytes = sealed;
}

#[test]
fn fuzz_records() {
    let origin = Origin { map: "0192-aa".into(), first: 41 };
    let seeds = vec![record(&stream(), &Origin::default()), record(&stream(), &origin), record_1(&stream())];
    let mutator =
        Mutator { seeds, ..Mutator::of_texts(&[], r#"{ } " "first": 18446744073709551615 -1 null"#) };
    fuzz(
        "records",
        1,
        |random| mutator.input(random),
        |bytes, random| {
            let mut bytes = bytes.to_vec();
            if bytes.starts_with(MAGIC) && random.random_bool(0.5) {
                seal(&mut bytes);
            }
            let Ok(mut reader) = RecordReader::new(bytes.as_slice()) else { return false };
            let origin = reader.origin().cloned().unwrap_or_default();
            let (mut messages, mut ended_at) = (Vec::new(), 0);
            for read in reader.by_ref() {
                let Ok((at, message)) = read else { break };
                assert!(at >= ended_at && at < bytes.len() as u64);
                ended_at = at + 1;
                is_sound(&message, &Limits::NONE);
                messages.push(message);
            }
            assert!(reader.next().is_none(), "a reader that has ended has ended");
            let again = record(&messages, &origin);
            let reader = RecordReader::new(again.as_slice()).unwrap();
            let read: Vec<Message> = reader.map(|read| read.unwrap().1).collect();
            assert_eq!(record(&read, &origin), again);
            if let Ok(mut log) = RecordedLog::new(bytes, Notes::default()) {
                assert_eq!(log.by_ref().count(), messages.len());
            }
            !messages.is_empty()
        },
    );
}

/// Setup first, numbered on, and all of it is what a server takes.
fn log_is_sound(records: &[LogRecord]) {
    assert!(matches!(records[0].message, Message::Setup(_)));
    for (seq, record) in (0..).zip(records) {
        is_sound(&record.message, &Limits::default());
        let header = record.message.header().unwrap();
        assert_eq!((header.seq, carmen::stamp(&record.stamp_text)), (seq, Ok(header.stamp)));
    }
}

#[test]
fn fuzz_carmen_logs() {
    let scans = "FLASER 1 1 0 0 0 0 0 0 10.25 h 1\nFLASER 1 1 0 0 0 1 0 0 11.000001 h 1\n";
    let mutator = Mutator::of_texts(
        &[CARMEN, scans],
        "\n \r \t ODOM FLASER ROBOTLASER1 PARAM robot_front_laser_max # nan inf -inf 1e300 1e400 -1 0 00 81.91 9000000000 \
         4294967296 9223372036.854775807 -9223372036.9 1e9 16384 99999999999999999999 \0 ü",
    );
    fuzz(
        "carmen",
        1,
        |random| mutator.input(random),
        |bytes, _| {
            let text = String::from_utf8_lossy(bytes);
            for line in text.lines() {
                let _ = carmen::parse(line);
            }
            let Ok(mut log) = CarmenLog::new(bytes.to_vec(), &Options::default(), Notes::default()) else {
                return false;
            };
            let records: Vec<LogRecord> = log.by_ref().collect();
            log_is_sound(&records);
            let notes = log.notes();
            assert_eq!(records.len() as u64, 1 + notes.odoms + notes.scans);
            assert_eq!(log.progress(), (bytes.len() as u64, bytes.len() as u64));
            assert!(notes.warnings().len() < 100);
            true
        },
    );
}

#[test]
fn fuzz_narrations() {
    let mutator = Mutator::of_texts(
        &[NARRATION],
        r#"{ } [ ] , : " \ \n "t": "t_rel": "text": "id": "alternatives": "p": null NaN 1e300 -1 0 9e9 8999999999.9999999
            1732233600000 4294967296 "" \u0000 \ud800 ü"#,
    );
    let first = Stamp { ns: 1_000_000_000 };
    let log = || CarmenLog::new(CARMEN.into(), &Options::default(), Notes::default()).unwrap();
    fuzz(
        "narrations",
        1,
        |random| mutator.input(random),
        |bytes, _| {
            let text = String::from_utf8_lossy(bytes);
            let Ok(narration) = Narration::parse(&text) else { return false };
            let lines =
                text.trim_start_matches('\u{feff}').lines().filter(|line| !line.trim().is_empty()).count();
            assert_eq!((narration.len(), narration.is_empty()), (lines, lines == 0));
            let says = narration.says("r07", first);
            for message in says.iter().cloned().map(Message::Say) {
                // What lies too far behind the log's first stamp may be refused later.
                if message.validate(&Limits::default()).is_ok() {
                    is_sound(&message, &Limits::default());
                }
            }
            let said = |r: &LogRecord| matches!(r.message, Message::Say(_));
            let (in_log, alone): (Vec<LogRecord>, Vec<LogRecord>) =
                merged(Box::new(log()), &narration).partition(said);
            let alone: Vec<Message> = alone.into_iter().map(|r| r.message).collect();
            assert_eq!(alone, log().map(|r| r.message).collect::<Vec<_>>());
            let mut ids: Vec<_> = says.iter().map(|say| (say.began, say.id.clone())).collect();
            ids.sort();
            ids.dedup();
            // Of two at one time with one id the latter counts.
            assert_eq!(in_log.len(), ids.len());
            true
        },
    );
}
