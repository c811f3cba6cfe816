//! Good inputs, made by the library's own encoders: cases spoil them, targets mutate them.

use crate::medium::Medium;
use std::collections::BTreeMap;
use toponym_journal::{Checkpoint, Entry, Event, Identity, Journal};
use toponym_proto::record::{MAGIC_1, Origin, RecordWriter};
use toponym_proto::{
    Clock, End, Header, Hearing, Keys, Laser, Mend, Message, Odom, Pose, Say, Scan, Setup, Stamp,
};

/// The only robot.
pub const ROBOT: &str = "r07";
/// Its only laser.
pub const LASER: &str = "front";

/// The keys of a site.
pub fn keys() -> Keys {
    Keys::new("lab").unwrap()
}

/// A good header.
pub fn header() -> Header {
    let stamp = Stamp { ns: 1_700_000_000_000_000_005 };
    Header { robot: ROBOT.into(), boot: 3, seq: 12, stamp, clock: Clock::Log }
}

/// A good setup.
pub fn setup() -> Setup {
    let laser = Laser {
        id: LASER.into(),
        x_m: 0.1,
        y_m: -0.2,
        yaw_rad: 3.0,
        upside_down: true,
        range_min_m: 0.02,
        range_max_m: 30.0,
        ignored_rad: vec![(-0.5, 0.5)],
    };
    Setup { header: header(), map: "main".into(), lasers: vec![laser] }
}

/// Good odometry.
pub fn odom() -> Odom {
    Odom { header: header(), odom_from_body: Pose { x_m: 1.5, y_m: -2.0, yaw_rad: 0.25 } }
}

/// A good sweep.
pub fn scan() -> Scan {
    Scan {
        header: header(),
        laser: LASER.into(),
        angle_min_rad: -1.5,
        angle_increment_rad: 0.01,
        time_increment_s: 0.001,
        ranges_m: vec![1.5, f32::INFINITY, f32::NAN, 2.0],
    }
}

/// A good sentence with all that it may have.
pub fn say() -> Say {
    Say {
        id: "01J9ZZZZZZZZZZZZZZZZZZZZZZ".into(),
        robot: Some(ROBOT.into()),
        text: "this is the gym".into(),
        alternatives: vec![Hearing { text: "this is the gem".into(), p: 0.25 }],
        lang: Some("en".into()),
        speaker: Some("anna".into()),
        began: Some(Stamp { ns: 5_000_000_000 }),
        ended: Some(Stamp { ns: 6_500_000_000 }),
        ago_s: None,
        retracts: Some("s1".into()),
        answers: Some("s2".into()),
    }
}

/// One of each kind that robots and guides send.
pub fn messages() -> [Message; 5] {
    [
        Message::Setup(setup()),
        Message::Odom(odom()),
        Message::Scan(scan()),
        Message::Say(say()),
        Message::End(End { header: header() }),
    ]
}

/// One of each that an operator mends.
pub fn mends() -> [Message; 4] {
    let (from, to) = ("jim".to_owned(), "gym".to_owned());
    [
        Mend::Undo { id: Some("s1".into()) },
        Mend::Rename { from, to },
        Mend::Forget { name: "printer room".into() },
        Mend::Area {
            id: "a1".into(),
            polygon_m: vec![[0.0, 0.0], [4.0, 0.0], [4.0, 3.0]],
            name: None,
            instead: false,
            forbidden: true,
        },
    ]
    .map(Message::Mend)
}

/// The key on which the seed of this kind comes.
pub fn key_of(message: &Message) -> String {
    match message {
        Message::Setup(_) => keys().setup(ROBOT),
        Message::Odom(_) => keys().odom(ROBOT),
        Message::Scan(_) => keys().scan(ROBOT, LASER),
        Message::End(_) => keys().end(ROBOT),
        Message::Say(_) | Message::Mend(_) => keys().say(Some(ROBOT)),
    }
}

/// The messages of a record: a short drive in order.
pub fn stream() -> Vec<Message> {
    let mut all: Vec<Message> = messages().into_iter().chain(mends()).collect();
    for (seq, message) in (0..).zip(&mut all) {
        let header = match message {
            Message::Setup(m) => &mut m.header,
            Message::Odom(m) => &mut m.header,
            Message::Scan(m) => &mut m.header,
            Message::End(m) => &mut m.header,
            Message::Say(_) | Message::Mend(_) => continue,
        };
        header.seq = seq;
    }
    all
}

/// A record of messages.
pub fn record(messages: &[Message], origin: &Origin) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut writer = RecordWriter::new(&mut bytes, origin).unwrap();
    for message in messages {
        writer.write(message).unwrap();
    }
    writer.flush().unwrap();
    drop(writer);
    bytes
}

/// The same in format 1.
pub fn record_1(messages: &[Message]) -> Vec<u8> {
    let mut bytes = MAGIC_1.to_vec();
    for message in messages {
        let payload = message.to_bincode().unwrap();
        bytes.extend((payload.len() as u32).to_le_bytes());
        bytes.extend(payload);
    }
    bytes
}

/// Lines of a CARMEN log, each kind that is read.
pub const CARMEN: &str = "\
# a short log
PARAM robot_frontlaser_offset 0.27 0.5 host 0.5
PARAM robot_front_laser_max 50.0 0.5 host 0.5
ODOM 0 0 0 0 0 0 1 host 1
FLASER 3 1 2 81.91 0.27 0 0 0 0 0 1.000001 host 1
ODOM 0.5 -0.25 0.1 0.1 0.2 0.3 100.25 host 1.5
ROBOTLASER1 0 -2.0 4.0 0.1 5.6 0.01 0 2 1.5 2.5 1 10 1 2 0.5 0.8 2 0.5 0.1 0.2 1 1 0 102.5 host 2
NEFF 3 1 host 1
";

/// Lines of a narration with all that one may have.
pub const NARRATION: &str = r#"{"t": 1.5, "text": "this is the lobby"}
{"t_rel": 12.25, "text": "the gym is down the hallway", "speaker": "anna", "id": "n2", "lang": "en"}
{"t": 100, "text": "no, the other way", "alternatives": [{"text": "another way", "p": 0.5}], "retracts": "n2", "answers": null}
"#;

/// Whose journal it is.
pub fn identity() -> Identity {
    Identity { uuid: "0192-aa".into(), build: "1".into(), config: 7, seed: 1 }
}

/// One entry of each kind.
pub fn entries() -> Vec<Entry> {
    let events = [
        Event::Message(Message::Setup(setup())),
        Event::Message(Message::Scan(Scan { ranges_m: vec![1.5, f32::INFINITY, 2.0], ..scan() })),
        Event::Say { boot: 3, say: say() },
        Event::Gap { boot: 3, to: 12 },
        Event::Tick,
        Event::Hold(500_000_000),
        Event::Glossary("mensa = canteen\nname: Bertha\n".into()),
        Event::Message(Message::Mend(Mend::Undo { id: None })),
        Event::Message(Message::Odom(odom())),
    ];
    (100..).zip(events).map(|(at_ns, event)| Entry { at_ns, event }).collect()
}

/// The files of a journal of these [`entries`]: two checkpoints, and two segments, of which the last is being written to.
pub fn journal() -> BTreeMap<String, Vec<u8>> {
    let medium = Medium::default();
    let map = |index: u64| format!("the map after {index}").into_bytes();
    let mut journal = Journal::create(medium.clone(), identity(), map(0)).unwrap();
    for (k, entry) in entries().iter().enumerate() {
        journal.append(&entry.to_bytes().unwrap());
        if k == 4 {
            journal.commit().unwrap();
            Checkpoint { identity: identity(), index: 5, map: map(5) }.write(&medium).unwrap();
            journal = journal.with_segments_of(1);
        }
    }
    journal.commit().unwrap();
    medium.files()
}
