//! Rows of messages in bincode.

use crate::feed::{Came, Fed};
use crate::seeds::{ROBOT, header, key_of, keys, mends, messages, odom, say, scan, setup};
use crate::table::{Case, case};
use crate::wire_bytes;
use toponym_proto::codec::ENCODING_BINCODE;
use toponym_proto::stream::Hearing;
use toponym_proto::{Header, Mend, Message, Odom, Say, Scan, Setup, Stamp};

/// A change of a message's number.
type Spoil = fn(f64) -> Message;

fn of_odom(change: impl FnOnce(&mut Odom)) -> Message {
    let mut m = odom();
    change(&mut m);
    Message::Odom(m)
}

fn of_setup(change: impl FnOnce(&mut Setup)) -> Message {
    let mut m = setup();
    change(&mut m);
    Message::Setup(m)
}

fn of_scan(change: impl FnOnce(&mut Scan)) -> Message {
    let mut m = scan();
    change(&mut m);
    Message::Scan(m)
}

fn of_say(change: impl FnOnce(&mut Say)) -> Message {
    let mut m = say();
    change(&mut m);
    Message::Say(m)
}

/// Every number that may be none, by the name that a refusal gives its field.
pub const NUMBERS: [(&str, Spoil); 14] = [
    ("odom_from_body.x_m", |v| of_odom(|m| m.odom_from_body.x_m = v)),
    ("odom_from_body.y_m", |v| of_odom(|m| m.odom_from_body.y_m = v)),
    ("odom_from_body.yaw_rad", |v| of_odom(|m| m.odom_from_body.yaw_rad = v)),
    ("lasers[0].x_m", |v| of_setup(|m| m.lasers[0].x_m = v)),
    ("lasers[0].y_m", |v| of_setup(|m| m.lasers[0].y_m = v)),
    ("lasers[0].yaw_rad", |v| of_setup(|m| m.lasers[0].yaw_rad = v)),
    ("lasers[0].range_min_m", |v| of_setup(|m| m.lasers[0].range_min_m = v)),
    ("lasers[0].range_max_m", |v| of_setup(|m| m.lasers[0].range_max_m = v)),
    ("lasers[0].ignored_rad", |v| of_setup(|m| m.lasers[0].ignored_rad[0].0 = v)),
    ("lasers[0].ignored_rad", |v| of_setup(|m| m.lasers[0].ignored_rad[0].1 = v)),
    ("angle_min_rad", |v| of_scan(|m| m.angle_min_rad = v)),
    ("angle_increment_rad", |v| of_scan(|m| m.angle_increment_rad = v)),
    ("time_increment_s", |v| of_scan(|m| m.time_increment_s = v)),
    ("alternatives[0].p", |v| of_say(|m| m.alternatives[0].p = v)),
];

/// What is no id.
pub const NO_IDS: [&str; 9] = ["", "R07", "r/7", "räum", "厨房", "r 7", "-r7", "r*", "r\u{0}7"];

/// A message's bytes.
pub fn bytes_of(message: &Message) -> Vec<u8> {
    message.to_bincode().unwrap()
}

/// Bytes on a key.
pub fn on(key: String, bytes: Vec<u8>) -> Fed {
    Fed::Wire(key, ENCODING_BINCODE, bytes)
}

/// A message on the key where its kind belongs.
fn sent(message: &Message) -> Fed {
    on(key_of(message), bytes_of(message))
}

/// The rows.
pub fn cases() -> Vec<Case> {
    let mut all = wire_bytes::cases();
    all.extend(numbers());
    all.extend(headers());
    all.extend(ids());
    all.extend(lists());
    all.extend(sentences());
    all.extend(on_the_wrong_key());
    let named = |mut case: Case| {
        case.name = format!("bincode: {}", case.name);
        case
    };
    all.into_iter().map(named).collect()
}

fn numbers() -> Vec<Case> {
    let mut rows = Vec::new();
    for (k, (field, spoil)) in NUMBERS.into_iter().enumerate() {
        for v in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 1e300] {
            rows.push(case(format!("number {k}, {field}, is {v:e}"), sent(&spoil(v)), Came::Invalid, field));
        }
    }
    let ranges = of_scan(|m| m.ranges_m = vec![f32::NAN, f32::INFINITY, f32::NEG_INFINITY, f32::MAX, -1.0]);
    rows.push(case("ranges that tell nothing", sent(&ranges), Came::Taken, "[NaN, inf, -inf"));
    for (name, message, field) in [
        ("a coordinate just too far", of_odom(|m| m.odom_from_body.x_m = 1_000_000.1), "odom_from_body.x_m"),
        ("a laser 101 m off", of_setup(|m| m.lasers[0].x_m = 101.0), "lasers[0].x_m"),
        ("ranges in millimetres", of_setup(|m| m.lasers[0].range_max_m = 30_000.0), "lasers[0].range_max_m"),
        ("ranges from below 0", of_setup(|m| m.lasers[0].range_min_m = -0.1), "lasers[0].range_min_m"),
        ("ranges from 30 to 30", of_setup(|m| m.lasers[0].range_min_m = 30.0), "lasers[0].range_max_m"),
        (
            "bearings backwards",
            of_setup(|m| m.lasers[0].ignored_rad = vec![(0.5, -0.5)]),
            "lasers[0].ignored_rad",
        ),
        ("rays that are all one", of_scan(|m| m.angle_increment_rad = 0.0), "angle_increment_rad"),
        ("rays that are all minus one", of_scan(|m| m.angle_increment_rad = -0.0), "angle_increment_rad"),
        ("rays in degrees", of_scan(|m| m.angle_increment_rad = 6.3), "angle_increment_rad"),
        ("rays back in time", of_scan(|m| m.time_increment_s = -1e-9), "time_increment_s"),
        ("rays 2 s apart", of_scan(|m| m.time_increment_s = 2.0), "time_increment_s"),
        ("a probability of 1.5", of_say(|m| m.alternatives[0].p = 1.5), "alternatives[0].p"),
        ("a probability of -0.1", of_say(|m| m.alternatives[0].p = -0.1), "alternatives[0].p"),
    ] {
        rows.push(case(name, sent(&message), Came::Invalid, field));
    }
    rows
}

fn headers() -> Vec<Case> {
    let with = |header: Header| sent(&of_odom(|m| m.header = header));
    let mut rows = Vec::new();
    for (name, n, came) in [
        ("2^46", 1_u64 << 46, Came::Taken),
        ("2^46 + 1", (1 << 46) + 1, Came::Invalid),
        ("2^53 - 1", (1 << 53) - 1, Came::Invalid),
        ("2^63", 1 << 63, Came::Invalid),
        ("2^64 - 1", u64::MAX, Came::Invalid),
    ] {
        let told = |field| if came == Came::Taken { "" } else { field };
        rows.push(case(format!("boot {name}"), with(Header { boot: n, ..header() }), came, told("boot")));
        rows.push(case(format!("seq {name}"), with(Header { seq: n, ..header() }), came, told("seq")));
    }
    let s = 1_000_000_000_i64;
    for (name, ns, came) in [
        ("1970", 0, Came::Taken),
        ("1969", -s, Came::Taken),
        ("4e18 ns", 4 * s * s, Came::Taken),
        ("4e18 ns and one", 4 * s * s + 1, Came::Invalid),
        ("-4e18 ns and one", -4 * s * s - 1, Came::Invalid),
        ("2100", 4_102_444_800 * s, Came::Invalid),
        ("2^32 s", (1 << 32) * s, Came::Invalid),
        ("the first there is", i64::MIN, Came::Invalid),
        ("the last there is", i64::MAX, Came::Invalid),
    ] {
        let stamp = Stamp { ns };
        let told = |field| if came == Came::Taken { "" } else { field };
        rows.push(case(format!("stamp {name}"), with(Header { stamp, ..header() }), came, told("stamp")));
        if came == Came::Invalid {
            let began = of_say(|m| m.began = Some(stamp));
            let ended = of_say(|m| m.ended = Some(stamp));
            rows.push(case(format!("began {name}"), sent(&began), came, "began"));
            rows.push(case(format!("ended {name}"), sent(&ended), came, "ended"));
        }
    }
    rows
}

fn ids() -> Vec<Case> {
    let long = "x".repeat(64);
    let bad = || NO_IDS.into_iter().chain([long.as_str()]);
    let mut rows = Vec::new();
    for id in bad() {
        for (field, message) in [
            ("robot", of_odom(|m| m.header.robot = id.into())),
            ("map", of_setup(|m| m.map = id.into())),
            ("lasers[0].id", of_setup(|m| m.lasers[0].id = id.into())),
            ("laser", of_scan(|m| m.laser = id.into())),
        ] {
            rows.push(case(format!("{field} is {id:?}"), sent(&message), Came::Invalid, field));
        }
        let said = of_say(|m| m.robot = Some(id.into()));
        rows.push(case(format!("said to {id:?}"), sent(&said), Came::Invalid, "robot"));
    }
    let any = of_odom(|m| m.header.robot = "any".into());
    rows.push(case("robot is any", sent(&any), Came::Invalid, "robot"));
    let robot = "x".repeat(63);
    let longest = of_odom(|m| m.header.robot.clone_from(&robot));
    rows.push(case(
        "a robot of 63 characters",
        on(keys().odom(&robot), bytes_of(&longest)),
        Came::Taken,
        &robot,
    ));
    rows
}

fn lists() -> Vec<Case> {
    let laser = setup().lasers.remove(0);
    let named = |k: usize| toponym_proto::Laser { id: format!("l{k}"), ..laser.clone() };
    let hearing = Hearing { text: "gem".into(), p: 0.01 };
    let cases = [
        ("8192 rays", of_scan(|m| m.ranges_m = vec![1.0; 8192]), Came::Taken, ""),
        ("8193 rays", of_scan(|m| m.ranges_m = vec![1.0; 8193]), Came::Invalid, "ranges_m"),
        ("no rays", of_scan(|m| m.ranges_m.clear()), Came::Taken, "ranges_m: []"),
        ("no lasers", of_setup(|m| m.lasers.clear()), Came::Invalid, "lasers"),
        ("8 lasers", of_setup(|m| m.lasers = (0..8).map(named).collect()), Came::Taken, ""),
        ("9 lasers", of_setup(|m| m.lasers = (0..9).map(named).collect()), Came::Invalid, "lasers"),
        ("a laser twice", of_setup(|m| m.lasers = vec![laser.clone(); 2]), Came::Invalid, "lasers[1].id"),
        (
            "64 ignored bearings",
            of_setup(|m| m.lasers[0].ignored_rad = vec![(0.0, 0.0); 64]),
            Came::Taken,
            "",
        ),
        (
            "65 of them",
            of_setup(|m| m.lasers[0].ignored_rad = vec![(0.0, 0.0); 65]),
            Came::Invalid,
            "lasers[0].ignored_rad",
        ),
        ("16 hearings", of_say(|m| m.alternatives = vec![hearing.clone(); 16]), Came::Taken, ""),
        (
            "17 hearings",
            of_say(|m| m.alternatives = vec![hearing.clone(); 17]),
            Came::Invalid,
            "alternatives",
        ),
    ];
    cases.map(|(name, message, came, told)| case(name, sent(&message), came, told)).into()
}

fn sentences() -> Vec<Case> {
    let mend = |mend| Fed::Message(bytes_of(&Message::Mend(mend)));
    let long = "a".repeat(1001);
    let cases = [
        ("1000 characters", of_say(|m| m.text = "厨".repeat(1000)), Came::Taken, ""),
        ("1001 characters", of_say(|m| m.text.clone_from(&long)), Came::Invalid, "text"),
        ("nothing said", of_say(|m| m.text.clear()), Came::Invalid, "text"),
        ("white space said", of_say(|m| m.text = " \t\n\u{2003}".into()), Came::Invalid, "text"),
        ("control characters said", of_say(|m| m.text = "gym\u{0}\u{1b}[2J".into()), Came::Taken, ""),
        (
            "a hearing of 1001",
            of_say(|m| m.alternatives[0].text.clone_from(&long)),
            Came::Invalid,
            "alternatives[0].text",
        ),
        (
            "a hearing of nothing",
            of_say(|m| m.alternatives[0].text.clear()),
            Came::Invalid,
            "alternatives[0].text",
        ),
        ("an id of 64 bytes", of_say(|m| m.id = "x".repeat(64)), Came::Taken, ""),
        ("an id of 65 bytes", of_say(|m| m.id = "x".repeat(65)), Came::Invalid, "id"),
        ("an id of 33 letters of two bytes", of_say(|m| m.id = "ä".repeat(33)), Came::Invalid, "id"),
        ("an id of nothing", of_say(|m| m.id.clear()), Came::Invalid, "id"),
        ("an id with a line break", of_say(|m| m.id = "a\nb".into()), Came::Invalid, "id"),
        ("a language with a tab", of_say(|m| m.lang = Some("e\tn".into())), Came::Invalid, "lang"),
        (
            "a speaker with an escape",
            of_say(|m| m.speaker = Some("\u{1b}[1m".into())),
            Came::Invalid,
            "speaker",
        ),
        ("takes back nothing", of_say(|m| m.retracts = Some(String::new())), Came::Invalid, "retracts"),
        (
            "answers what has a delete in it",
            of_say(|m| m.answers = Some("s\u{7f}".into())),
            Came::Invalid,
            "answers",
        ),
        (
            "ended before it began",
            of_say(|m| m.ended = Some(Stamp { ns: 4_999_999_999 })),
            Came::Invalid,
            "ended",
        ),
    ];
    let mut rows: Vec<Case> = cases.map(|(name, m, came, told)| case(name, sent(&m), came, told)).into();
    let (from, to) = ("jim".to_owned(), String::new());
    rows.extend([
        case("undo of 65 bytes", mend(Mend::Undo { id: Some("x".repeat(65)) }), Came::Invalid, "id"),
        case("rename to nothing", mend(Mend::Rename { from, to }), Came::Invalid, "to"),
        case(
            "rename from 1001",
            mend(Mend::Rename { from: long.clone(), to: "gym".into() }),
            Came::Invalid,
            "from",
        ),
        case("forget 1001 characters", mend(Mend::Forget { name: long }), Came::Invalid, "name"),
        case("mend of kind 5", Fed::Message(vec![1, 6, 5, 0, 0, 0]), Came::Malformed, "not the bincode"),
        case(
            "area of two corners",
            mend(area(vec![[0.0, 0.0], [1.0, 0.0]], true)),
            Came::Invalid,
            "polygon_m",
        ),
        case("area of 401", mend(area(vec![[0.0, 0.0]; 401], true)), Came::Invalid, "polygon_m"),
        case("area off the map", mend(area(vec![[f64::NAN, 0.0]; 3], true)), Came::Invalid, "polygon_m"),
        case("area of nothing", mend(area(vec![[0.0, 0.0]; 3], false)), Came::Invalid, "name"),
    ]);
    rows
}

fn area(polygon_m: Vec<[f64; 2]>, forbidden: bool) -> Mend {
    Mend::Area { id: "a".into(), polygon_m, name: None, instead: false, forbidden }
}

/// What does not belong on the key that it comes on.
fn on_the_wrong_key() -> Vec<Case> {
    let mut rows = Vec::new();
    let all = messages();
    for message in &all {
        for other in all.iter().filter(|other| other.type_id() != message.type_id()) {
            let (id, key) = (message.type_id(), key_of(other));
            let told = format!("type id {id} does not belong on this key");
            let name = format!("type {id} on the key of {}", other.type_id());
            rows.push(case(name, on(key, bytes_of(message)), Came::Malformed, &told));
        }
    }
    let [odom, scan, say] = [Message::Odom(odom()), Message::Scan(scan()), Message::Say(say())];
    let mend = bytes_of(&mends()[0]);
    rows.extend([
        case(
            "a mend on a stream",
            on(key_of(&say), mend),
            Came::Malformed,
            "type id 6 does not belong on this key",
        ),
        case("another robot's odometry", on(keys().odom("r08"), bytes_of(&odom)), Came::Invalid, "robot"),
        case("another laser's scan", on(keys().scan(ROBOT, "rear"), bytes_of(&scan)), Came::Invalid, "laser"),
        case("said to another", on(keys().say(Some("r08")), bytes_of(&say)), Came::Invalid, "robot"),
        case("said to any, for one", on(keys().say(None), bytes_of(&say)), Came::Taken, ""),
        case("any streams", on(keys().odom("any"), bytes_of(&odom)), Came::Invalid, "robot"),
    ]);
    rows
}
