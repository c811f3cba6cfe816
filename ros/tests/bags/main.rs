//! Bags made here, of both kinds, whole and damaged.

#![allow(clippy::unwrap_used, reason = "what does not work fails the test")]

mod written;

use std::collections::BTreeMap;
use std::f64::consts::FRAC_1_SQRT_2;
use std::path::{Path, PathBuf};
use toponym::log::{LogRecord, Notes, Options};
use toponym_proto::Message;
use toponym_ros::msg::{
    Clock, Header, LaserScan, Odometry, Quaternion, StringMsg, TFMessage, Time, Transform, TransformStamped,
    Vector3,
};
use toponym_ros::plan::kind;
use toponym_ros::{cdr, log};

/// A folder of a test's own, gone at its end.
struct Folder(PathBuf);

impl Folder {
    fn new(name: &str) -> Self {
        let path = std::env::temp_dir().join(format!("toponym-bags-{}-{name}", std::process::id()));
        std::fs::create_dir_all(&path).unwrap();
        Self(path)
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        std::fs::remove_dir_all(&self.0).unwrap();
    }
}

/// Topic, type, time of reception in milliseconds, bytes.
type Sent = (&'static str, &'static str, i64, Vec<u8>);

/// When bags begin, seconds.
const BEGIN_S: i64 = 1_700_000_000;

fn time(ms: i64) -> Time {
    let ns = ms * 1_000_000;
    Time { sec: (ns / 1_000_000_000) as i32, nanosec: (ns % 1_000_000_000) as u32 }
}

fn header(ms: i64, frame: &str) -> Header {
    Header { stamp: time(BEGIN_S * 1000 + ms), frame_id: frame.into() }
}

fn transform(ms: i64, parent: &str, child: &str, x: f64, rotation: [f64; 4]) -> TransformStamped {
    let [x_, y_, z_, w_] = rotation;
    TransformStamped {
        header: header(ms, parent),
        child_frame_id: child.into(),
        transform: Transform {
            translation: Vector3 { x, y: 0.0, z: 0.0 },
            rotation: Quaternion { x: x_, y: y_, z: z_, w: w_ },
        },
    }
}

const NONE: [f64; 4] = [0.0, 0.0, 0.0, 1.0];

fn tf(transforms: Vec<TransformStamped>) -> Vec<u8> {
    cdr::write(&TFMessage { transforms }).unwrap()
}

fn scan(ms: i64, frame: &str) -> Vec<u8> {
    let scan = LaserScan {
        header: header(ms, frame),
        angle_min: -1.0,
        // One more than there are.
        angle_max: 1.1,
        angle_increment: 0.1,
        range_min: 0.1,
        range_max: 8.0,
        ranges: vec![2.0; 20],
        ..LaserScan::default()
    };
    cdr::write(&scan).unwrap()
}

fn text(text: &str) -> Vec<u8> {
    cdr::write(&StringMsg { data: text.into() }).unwrap()
}

/// A robot that drives ahead for so many tenths of a second, its scans received late, and a guide.
fn drive(tenths: i64) -> Vec<Sent> {
    let hanging = [FRAC_1_SQRT_2, FRAC_1_SQRT_2, 0.0, 0.0];
    let mut sent =
        vec![("/tf_static", kind::TF, 0, tf(vec![transform(0, "base_link", "laser", 0.2, hanging)]))];
    for k in 0..tenths {
        let ms = 100 * k;
        let moved = transform(ms, "odom", "base_link", 0.05 * k as f64, NONE);
        sent.push(("/tf", kind::TF, ms + 1, tf(vec![transform(ms, "base_link", "wheel", 0.0, NONE), moved])));
        sent.push(("/scan", kind::SCAN, ms + 105, scan(ms, "laser")));
        if k == 10 {
            sent.push(("/speech", kind::TEXT, ms + 50, text("this is the gym")));
            sent.push(("/rosout_text", kind::TEXT, ms + 50, text("motor 3 is warm")));
        }
    }
    sent
}

fn ns(ms: i64) -> i64 {
    BEGIN_S * 1_000_000_000 + ms * 1_000_000
}

fn mcap(file: &Path, sent: &[Sent], finish: bool) {
    let mut writer = mcap::WriteOptions::new()
        .profile("ros2")
        .chunk_size(Some(2000))
        .create(std::io::BufWriter::new(std::fs::File::create(file).unwrap()))
        .unwrap();
    let mut channels = BTreeMap::new();
    for (topic, kind, ms, data) in sent {
        let id = *channels.entry(*topic).or_insert_with(|| {
            let schema = writer.add_schema(kind, "ros2msg", b"").unwrap();
            writer.add_channel(schema, topic, "cdr", &BTreeMap::new()).unwrap()
        });
        let at = ns(*ms) as u64;
        let header =
            mcap::records::MessageHeader { channel_id: id, sequence: 0, log_time: at, publish_time: at };
        writer.write_to_known_channel(&header, data).unwrap();
    }
    if finish {
        writer.finish().unwrap();
    } else {
        writer.flush().unwrap();
        std::mem::forget(writer);
    }
}

/// `mode`: of its journal.
fn sqlite(file: &Path, sent: &[Sent], mode: &str) -> rusqlite::Connection {
    let db = rusqlite::Connection::open(file).unwrap();
    let journal = format!("PRAGMA journal_mode = {mode};");
    let tables = "CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT, type TEXT, serialization_format TEXT, \
                  offered_qos_profiles TEXT); CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER, \
                  timestamp INTEGER, data BLOB); CREATE INDEX timestamp_idx ON messages (timestamp ASC);";
    db.execute_batch(&(journal + tables)).unwrap();
    let mut ids: BTreeMap<&str, i64> = BTreeMap::new();
    for (topic, kind, ms, data) in sent {
        let next = ids.len() as i64 + 1;
        if *ids.entry(topic).or_insert(next) == next {
            db.execute("INSERT INTO topics VALUES (?1, ?2, ?3, 'cdr', '')", (next, topic, kind)).unwrap();
        }
        let row = (ids[topic], ns(*ms), data);
        db.execute("INSERT INTO messages(topic_id, timestamp, data) VALUES (?1, ?2, ?3)", row).unwrap();
    }
    db
}

fn read(path: &Path) -> (Vec<Message>, Notes) {
    let mut log = log::open(path, &Options::default(), &[]).unwrap();
    let messages = log.by_ref().map(|r: LogRecord| r.message).collect();
    (messages, log.notes().clone())
}

fn refused(path: &Path, topics: &[&str]) -> String {
    let topics: Vec<String> = topics.iter().map(|t| (*t).to_owned()).collect();
    log::open(path, &Options::default(), &topics).err().unwrap().to_string()
}

fn stamps_ms(messages: &[Message]) -> Vec<i64> {
    let stamp = |m: &Message| match m {
        Message::Say(say) => say.began.unwrap().ns,
        other => other.header().unwrap().stamp.ns,
    };
    messages.iter().map(|m| (stamp(m) - ns(0)) / 1_000_000).collect()
}

#[test]
fn a_bag_is_a_drive_whatever_its_files_are() {
    let folder = Folder::new("forms");
    let sent = drive(30);
    mcap(&folder.0.join("a.mcap"), &sent, true);
    let (messages, notes) = read(&folder.0.join("a.mcap"));
    let Message::Setup(setup) = &messages[0] else { panic!("{:?}", messages[0]) };
    let laser = &setup.lasers[0];
    assert_eq!(
        (laser.id.as_str(), laser.upside_down, laser.x_m, laser.range_max_m),
        ("scan", true, 0.2, 8.0)
    );
    assert!((laser.yaw_rad - std::f64::consts::FRAC_PI_2).abs() < 1e-6);
    assert_eq!((notes.odoms, notes.scans, notes.sentences, notes.bad_lines), (30, 30, 1, 0), "{notes:?}");
    assert_eq!(notes.ignored, BTreeMap::from([("/rosout_text".to_owned(), 1)]));
    assert!(stamps_ms(&messages).is_sorted());
    let seqs: Vec<u64> = messages.iter().filter_map(|m| Some(m.header()?.seq)).collect();
    assert!(seqs.iter().copied().eq(0..61));
    let said = messages.iter().position(|m| matches!(m, Message::Say(_))).unwrap();
    assert_eq!(stamps_ms(&messages)[said], 1050);

    drop(sqlite(&folder.0.join("b.db3"), &sent, "DELETE"));
    assert_eq!(read(&folder.0.join("b.db3")).0, messages);
    let bytes = std::fs::read(folder.0.join("b.db3")).unwrap();
    std::fs::write(folder.0.join("c.db3.zstd"), zstd::encode_all(bytes.as_slice(), 1).unwrap()).unwrap();
    assert_eq!(read(&folder.0.join("c.db3.zstd")).0, messages);
    let packed: Vec<Sent> =
        sent.iter().map(|s| (s.0, s.1, s.2, zstd::encode_all(s.3.as_slice(), 1).unwrap())).collect();
    drop(sqlite(&folder.0.join("d.db3"), &packed, "DELETE"));
    assert_eq!(read(&folder.0.join("d.db3")).0, messages);
    // Its recorder lives, and has all of it in the write-ahead log.
    let db = sqlite(&folder.0.join("e.db3"), &sent, "WAL");
    assert_eq!(read(&folder.0.join("e.db3")).0, messages);
    drop(db);

    let parts = Folder::new("parts");
    for (k, part) in sent.chunks(6).enumerate() {
        mcap(&parts.0.join(format!("bag_{k}.mcap")), part, true);
    }
    std::fs::write(parts.0.join("metadata.yaml"), "rosbag2_bagfile_information:\n").unwrap();
    assert!(sent.len() / 6 >= 10, "bag_10 comes after bag_9");
    assert_eq!(read(&parts.0).0, messages);
}

#[test]
fn what_is_damaged_is_read_up_to_there_and_told() {
    let folder = Folder::new("damaged");
    let sent = drive(60);
    mcap(&folder.0.join("killed.mcap"), &sent, false);
    let (messages, notes) = read(&folder.0.join("killed.mcap"));
    assert!(messages.len() > 60 && notes.remarks.iter().any(|r| r.contains("read up to there")), "{notes:?}");
    mcap(&folder.0.join("whole.mcap"), &sent, true);
    let bytes = std::fs::read(folder.0.join("whole.mcap")).unwrap();
    let file = folder.0.join("cut.mcap");
    for end in (0..bytes.len()).step_by(97) {
        std::fs::write(&file, &bytes[..end]).unwrap();
        match log::open(&file, &Options::default(), &[]) {
            Ok(log) => assert!(log.count() <= 122),
            Err(e) => assert!(e.to_string().contains("cut.mcap"), "{e}"),
        }
    }
    drop(sqlite(&folder.0.join("whole.db3"), &sent, "DELETE"));
    let bytes = std::fs::read(folder.0.join("whole.db3")).unwrap();
    let file = folder.0.join("cut.db3");
    for end in (0..bytes.len()).step_by(1500) {
        std::fs::write(&file, &bytes[..end]).unwrap();
        if let Ok(log) = log::open(&file, &Options::default(), &[]) {
            assert!(log.count() <= 122);
        }
    }
    let mut broken = sent.clone();
    let middle = broken.iter().rposition(|s| s.0 == "/scan").unwrap();
    broken[middle].3.truncate(40);
    mcap(&folder.0.join("broken.mcap"), &broken, true);
    let notes = read(&folder.0.join("broken.mcap")).1;
    assert_eq!((notes.scans, notes.bad_lines), (59, 1));
    assert!(notes.first_bad[0].1.starts_with("/scan: "), "{notes:?}");
}

#[test]
fn what_is_no_drive_is_refused_with_what_to_do() {
    let folder = Folder::new("refused");
    let file = folder.0.join("a.mcap");
    let only_text: Vec<Sent> = drive(12).into_iter().filter(|s| s.0 == "/speech").collect();
    mcap(&file, &only_text, true);
    let why = refused(&file, &[]);
    assert!(
        why.contains("no sensor_msgs/msg/LaserScan") && why.contains("/speech (1 std_msgs/msg/String)"),
        "{why}"
    );
    assert!(refused(&folder.0, &["/front"]).contains("on /front"));
    std::fs::remove_file(&file).unwrap();
    assert!(refused(&folder.0, &[]).contains("without a bag"));

    // Two robots with frames of the same names, in namespaces.
    let of_two = drive(12).into_iter().flat_map(|(topic, kind, ms, data)| {
        let names = match topic {
            "/scan" => ["/r1/scan", "/r2/scan"],
            "/tf" => ["/r1/tf", "/r2/tf"],
            "/tf_static" => ["/r1/tf_static", "/r2/tf_static"],
            _ => ["/r1/speech", "/r2/speech"],
        };
        names.map(|name| (name, kind, ms, data.clone()))
    });
    mcap(&file, &of_two.collect::<Vec<_>>(), true);
    let why = refused(&file, &[]);
    assert!(why.contains("2 robots") && why.contains("--topics /r1/scan"), "{why}");
    let wanted = ["/r2/scan".to_owned()];
    let mut log = log::open(&file, &Options::default(), &wanted).unwrap();
    assert_eq!(log.by_ref().filter(|r| matches!(r.message, Message::Odom(_))).count(), 12);
    assert_eq!(log.notes().scans, 12);
}

#[test]
fn what_is_missing_is_supposed_and_told() {
    let folder = Folder::new("missing");
    let file = folder.0.join("a.mcap");
    let without =
        |topics: &[&str]| -> Vec<Sent> { drive(12).into_iter().filter(|s| !topics.contains(&s.0)).collect() };
    let remarks = |sent: &[Sent]| {
        mcap(&file, sent, true);
        let (messages, notes) = read(&file);
        assert_eq!((notes.scans, notes.odoms), (12, 12), "{notes:?}");
        (messages, notes.remarks.join("\n"))
    };
    // A bag that was cut has no fixed transforms.
    let mut sent = without(&["/tf_static"]);
    assert!(remarks(&sent).1.contains("no /tf_static with it"));
    sent.retain(|s| s.0 != "/tf");
    assert!(remarks(&sent).1.contains("scans alone do"));
    for k in 0..12 {
        let mut message = Odometry { header: header(100 * k, "odom"), ..Odometry::default() };
        message.child_frame_id = "base_link".into();
        message.pose.pose.position.x = k as f64;
        sent.push(("/odom", kind::ODOMETRY, 100 * k, cdr::write(&message).unwrap()));
    }
    let (messages, told) = remarks(&sent);
    assert!(told.contains("odometry is taken from /odom"), "{told}");
    let last = messages.iter().rev().find_map(|m| match m {
        Message::Odom(odom) => Some(odom.odom_from_body.x_m),
        _ => None,
    });
    assert_eq!(last, Some(11.0));
    // Nobody set its stamps.
    let unstamped = |(topic, kind, ms, data): Sent| match topic {
        "/scan" => {
            let mut scan: LaserScan = cdr::read(&data).unwrap();
            (scan.header.stamp, scan.range_max) = (Time::default(), 0.0);
            (topic, kind, ms, cdr::write(&scan).unwrap())
        }
        _ => (topic, kind, ms, data),
    };
    let told = remarks(&drive(12).into_iter().map(unstamped).collect::<Vec<_>>()).1;
    assert!(told.contains("time of their reception") && told.contains("range_max of 0"), "{told}");
}

#[test]
fn a_sentence_is_on_the_clock_of_the_stamps() {
    let folder = Folder::new("clock");
    let simulated = |ms: i64| Time { sec: (ms / 1000) as i32, nanosec: (ms % 1000 * 1_000_000) as u32 };
    let mut sent = Vec::new();
    for (topic, kind, ms, data) in drive(20) {
        if topic == "/scan" {
            let mut scan: LaserScan = cdr::read(&data).unwrap();
            scan.header.stamp = simulated(ms - 105);
            sent.push((topic, kind, ms, cdr::write(&scan).unwrap()));
            sent.push(("/clock", kind::CLOCK, ms, cdr::write(&Clock { clock: simulated(ms) }).unwrap()));
        } else if topic == "/tf" {
            let mut message: TFMessage = cdr::read(&data).unwrap();
            message.transforms.iter_mut().take(2).for_each(|t| t.header.stamp = simulated(ms - 1));
            sent.push((topic, kind, ms, cdr::write(&message).unwrap()));
        } else {
            sent.push((topic, kind, ms, data));
        }
    }
    let began_ms = |sent: &[Sent]| {
        let file = folder.0.join("a.mcap");
        mcap(&file, sent, true);
        let say = read(&file).0.into_iter().find_map(|m| match m {
            Message::Say(say) => say.began,
            _ => None,
        });
        say.unwrap().ns / 1_000_000
    };
    assert_eq!(began_ms(&sent), 1105, "as the clock last said");
    sent.retain(|s| s.0 != "/clock");
    assert_eq!(began_ms(&sent), 1000, "the newest stamp");
}

#[test]
fn what_was_written_before_a_kill_is_read_up_to_the_last_chunk() {
    let folder = Folder::new("killed");
    let file = folder.0.join("a.mcap");
    let mut bag = toponym_ros::bag::BagWriter::new(std::fs::File::create(&file).unwrap()).unwrap();
    for k in 0..30_i64 {
        let text = StringMsg { data: format!("sentence {k}") };
        bag.write("/speech", kind::TEXT, k * 1_000_000_000, &text).unwrap();
        if k == 19 {
            bag.flush().unwrap();
        }
    }
    assert!(
        bag.write("/odom", kind::ODOMETRY, 0, &Odometry::default()).is_err(),
        "nobody could read its type"
    );
    // Never finished: the rest is lost with the process.
    std::mem::forget(bag);
    let mut bag = toponym_ros::bag::Bag::open(&file).unwrap();
    let mut texts = Vec::new();
    while let Some(raw) = bag.next() {
        assert_eq!((bag.topics()[raw.topic].kind.as_str(), raw.received_ns % 1_000_000_000), (kind::TEXT, 0));
        texts.push(cdr::read::<StringMsg>(&raw.data).unwrap().data);
    }
    assert_eq!((texts.len(), texts[19].as_str()), (20, "sentence 19"));
}
