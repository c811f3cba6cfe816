//! Bags and payloads that others made, where `../shared` is there.

#![allow(clippy::unwrap_used, reason = "what does not work fails the test")]

use std::path::{Path, PathBuf};
use toponym::log::{Notes, Options};
use toponym_proto::Message;
use toponym_ros::msg::{
    Clock, LaserScan, MapMetaData, MarkerArray, OccupancyGrid, Odometry, PointCloud2, PoseStamped,
    PoseWithCovarianceStamped, StringMsg, TFMessage, TriggerResponse, WhereRequest, WhereResponse,
};
use toponym_ros::plan::kind;
use toponym_ros::wire::{Hashes, Node, Qos, Role, attached, attachment, gid, key, publisher_of};
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

/// Reads and writes.
type Again = fn(&[u8]) -> Vec<u8>;

/// That for a type that is used.
fn writer(kind: &str) -> Option<Again> {
    Some(match kind {
        kind::SCAN => again::<LaserScan>,
        kind::ODOMETRY => again::<Odometry>,
        kind::TF => again::<TFMessage>,
        kind::TEXT => again::<StringMsg>,
        kind::CLOCK => again::<Clock>,
        kind::GRID => again::<OccupancyGrid>,
        kind::GRID_METADATA => again::<MapMetaData>,
        kind::POSE => again::<PoseStamped>,
        kind::POSE_WITH_COVARIANCE => again::<PoseWithCovarianceStamped>,
        kind::PATH => again::<toponym_ros::msg::Path>,
        kind::POINTS => again::<PointCloud2>,
        kind::MARKERS => again::<MarkerArray>,
        "std_srvs/srv/Trigger_Response" => again::<TriggerResponse>,
        "toponym_msgs/srv/Where_Request" => again::<WhereRequest>,
        "toponym_msgs/srv/Where_Response" => again::<WhereResponse>,
        _ => return None,
    })
}

#[test]
fn random_values_of_others_are_read_and_written_back_byte_by_byte() {
    let Ok(file) = std::env::var("TOPONYM_CDR") else {
        eprintln!("SKIPPED: TOPONYM_CDR names no file that random_values.py wrote");
        return;
    };
    let (bytes, mut count) = (std::fs::read(file).unwrap(), 0);
    let mut rest = &bytes[..];
    let mut part = || {
        let (length, after) = rest.split_first_chunk::<4>()?;
        let (part, after) = after.split_at(u32::from_le_bytes(*length) as usize);
        rest = after;
        Some(part)
    };
    while let (Some(kind), Some(either), Some(little)) = (part(), part(), part()) {
        let kind = std::str::from_utf8(kind).unwrap();
        assert_eq!(writer(kind).unwrap()(either), little, "{count}: {kind}");
        count += 1;
    }
    eprintln!("{count} messages");
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
        let Some(write) = writer(kind) else { continue };
        count += 1;
        assert_eq!(write(&little), little, "{name}");
        if let Ok(big) = bytes(".be.bin") {
            assert_eq!(write(&big), little, "{name}, big-endian");
        }
    }
    assert!(count >= 32, "{count}");
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

#[test]
fn keys_tokens_and_attachments_are_those_of_others() {
    let Some(file) = shared("wire.json") else { return };
    let table: serde_json::Value = serde_json::from_slice(&std::fs::read(file).unwrap()).unwrap();
    for entry in table.as_array().unwrap() {
        let text = |field: &str| entry[field].as_str().unwrap_or_default().to_owned();
        let number = |field: &str| entry[field].as_u64().unwrap() as u32;
        let node = Node {
            domain: number("domain"),
            hashes: Hashes::in_key(&text("key")),
            zid: text("zid"),
            id: number("node_id"),
            namespace: text("namespace"),
            name: text("node"),
        };
        let token = text("liveliness");
        let own = gid(&token).map(|byte| format!("{byte:02x}")).concat();
        assert_eq!(own, text("gid"), "{token}");
        let role = match text("kind").as_str() {
            "MP" => Role::Publisher,
            "MS" => Role::Subscriber,
            "SS" => Role::Server,
            "SC" => Role::Client,
            _ => {
                assert_eq!(node.token(), token);
                continue;
            }
        };
        let (name, kind) = (text("name"), text("type"));
        let hash = text("type_hash");
        assert_eq!(key(node.domain, &name, &kind, &hash), text("key"));
        let known = node.hashes.of(&kind);
        let qos = match text("qos_text").as_str() {
            "2::,5:,:,:,," => Qos::BestEffort(5),
            ":1:,1:,:,:,," => Qos::Latched,
            "::,100:,:,:,," => Qos::Reliable(100),
            _ => Qos::Reliable(10),
        };
        let built = node.token_of_entity(number("entity_id"), role, &name, &kind, qos);
        // What is never written has no hash here, and one has the usual depth.
        if known == hash && !text("qos_text").starts_with("::,:") {
            assert_eq!(built, token);
        }
        if role == Role::Publisher {
            let told = publisher_of(&token).unwrap();
            assert_eq!((told.topic, told.kind), (name, kind));
        }
        let Some(of_it) = entry["attachment"].as_object() else { continue };
        let (seq, sent_ns) = (of_it["seq"].as_i64().unwrap(), of_it["stamp_ns"].as_i64().unwrap());
        let bytes = attachment(seq, sent_ns, &gid(&token));
        let hex = bytes.map(|byte| format!("{byte:02x}")).concat();
        assert_eq!(hex, of_it["hex"].as_str().unwrap());
        let before = of_it["hex_before_2025_04"].as_str().unwrap();
        let before: Vec<u8> = (0..before.len() / 2)
            .map(|k| u8::from_str_radix(&before[2 * k..2 * k + 2], 16).unwrap())
            .collect();
        assert_eq!(attached(&before), Some((seq, gid(&token))));
        assert_eq!(attached(&bytes), Some((seq, gid(&token))));
    }
}
