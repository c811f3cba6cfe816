//! Bags and payloads that others made, where `../shared` is there.

#![allow(clippy::unwrap_used, reason = "what does not work fails the test")]

use std::path::{Path, PathBuf};
use toponym::log::{Notes, Options};
use toponym_proto::Message;
use toponym_ros::msg::{Clock, LaserScan, Odometry, StringMsg, TFMessage};
use toponym_ros::plan::kind;
use toponym_ros::{cdr, log};

fn read(path: &Path) -> (Vec<Message>, Notes) {
    let mut log = log::open(path, &Options::default(), &[]).unwrap();
    let messages = log.by_ref().map(|r| r.message).collect();
    assert_eq!(log.progress().0, log.progress().1, "all of it is read");
    (messages, log.notes().clone())
}

/// Where what is not in the repository is; tests that need it tell that they were skipped.
fn shared(part: &str) -> Option<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/data/ros2").join(part);
    if !folder.exists() {
        eprintln!("SKIPPED: {} is not there", folder.display());
    }
    folder.exists().then_some(folder)
}

/// Read and written.
fn again<T: serde::Serialize + serde::de::DeserializeOwned>(bytes: &[u8]) -> Vec<u8> {
    cdr::write(&cdr::read::<T>(bytes).unwrap()).unwrap()
}

#[test]
fn payloads_of_others_are_read_and_written_back_byte_by_byte() {
    let Some(folder) = shared("cdr") else { return };
    let table: serde_json::Value =
        serde_json::from_slice(&std::fs::read(folder.join("values.json")).unwrap()).unwrap();
    let mut count = 0;
    for (name, entry) in table.as_object().unwrap() {
        let bytes = |end: &str| std::fs::read(folder.join(format!("{name}{end}")));
        let little = bytes(".bin").unwrap();
        let kind = entry["type"].as_str().unwrap();
        let write = match kind {
            kind::SCAN => again::<LaserScan>,
            kind::ODOMETRY => again::<Odometry>,
            kind::TF => again::<TFMessage>,
            kind::TEXT => again::<StringMsg>,
            kind::CLOCK => again::<Clock>,
            _ => continue,
        };
        count += 1;
        assert_eq!(write(&little), little, "{name}");
        if let Ok(big) = bytes(".be.bin") {
            assert_eq!(write(&big), little, "{name}, big-endian");
        }
    }
    assert!(count >= 25, "{count}");
}

#[test]
fn bags_of_others_use_every_scan_and_are_one_drive_in_all_forms() {
    let (Some(mcap), Some(db), Some(harsh)) =
        (shared("drive_jazzy_mcap"), shared("drive_jazzy_sqlite3"), shared("harsh_jazzy_mcap"))
    else {
        return;
    };
    let (messages, notes) = read(&mcap);
    assert_eq!((notes.scans, notes.odoms, notes.sentences, notes.bad_lines), (701, 1401, 5, 0));
    assert!(notes.remarks.is_empty(), "{notes:?}");
    // Ranges that are no numbers equal nothing.
    assert!(format!("{:?}", read(&db).0) == format!("{messages:?}"), "the forms differ");
    let (_, notes) = read(&harsh);
    assert_eq!((notes.scans, notes.bad_lines, notes.remarks.len()), (150, 0, 0), "{notes:?}");
}
