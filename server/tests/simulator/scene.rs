//! What is sent, and the server's settings.

use std::time::Duration;
use toponym_core::Mapper;
use toponym_proto::sequence::Patience;
use toponym_proto::{Clock, Header, Message, Say, Stamp};
use toponym_server::fold::{Card, Fold};
use toponym_sim::hall::{self, PERIOD_NS};

/// Message `n` of the robot's.
pub fn message(n: u64) -> Message {
    let mut message = hall::message(n, "main", 61);
    let header = Header { robot: "r1".into(), boot: 1, seq: n, clock: Clock::Log, ..Header::default() };
    match &mut message {
        Message::Setup(m) => m.header = Header { stamp: m.header.stamp, ..header },
        Message::Odom(m) => m.header = Header { stamp: m.header.stamp, ..header },
        Message::Scan(m) => m.header = Header { stamp: m.header.stamp, ..header },
        _ => unreachable!("the hall has no others"),
    }
    message
}

/// Sentence `n` of the guide's.
pub fn say(n: u64) -> Say {
    let text = ["this is the kitchen", "this is the gym", "the lab is down the hall", "this is the lounge"];
    let began = Some(Stamp { ns: (n as i64 + 1) * 25 * PERIOD_NS });
    Say {
        id: format!("s{n}"),
        text: text[n as usize % 4].into(),
        began,
        robot: Some("r1".into()),
        ..Say::default()
    }
}

/// How long the server waits for what is missing.
pub fn patience() -> Patience {
    Patience { join_wait: Duration::from_secs(15), gap_wait: Duration::from_secs(30), window: 1024 }
}

/// A map that has taken in nothing yet.
pub fn newborn() -> Fold {
    let config = toponym_core::Config { particles: 2, ..Default::default() };
    let card = Card { uuid: "u".into(), robot: "r1".into(), ..Card::default() };
    Fold::new(Mapper::new(config), card, Duration::from_millis(200))
}
