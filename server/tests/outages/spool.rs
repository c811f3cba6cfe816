//! A robot whose server is away, and whose own program ends meanwhile: what it kept on disk is sent at its next start.

use crate::drive::{PATIENCE, Server, connected};
use std::time::Duration;
use toponym::{Connection, Planner, Robot, RobotConfig};
use toponym_proto::record::RecordReader;
use toponym_proto::{Clock, Message};
use toponym_sim::hall::message;

/// Messages sent before the server ends, and while it is away.
const SENT: [u64; 2] = [100, 400];

#[tokio::test(flavor = "multi_thread")]
async fn a_spool_is_bounded_while_the_server_is_away() {
    let mut server = Server::new();
    let to = Connection::to(&server.endpoint);
    let session = connected(&to).await;
    let config = RobotConfig {
        clock: Clock::Log,
        boot: 1,
        in_flight_max: 20,
        spool: Some(server.folder.join("spool")),
        spool_max_bytes: 1 << 16,
        patience: Duration::from_secs(1),
        ..RobotConfig::new("r1")
    };
    let mut robot = Robot::connect(&session, config).await.unwrap();
    robot.send(message(0, "main", 61)).await.unwrap();
    robot.settle().await.unwrap();
    server.end();
    let mut n = 1;
    // What finds no room is not sent: whoever sends is told.
    while robot.send(message(n, "main", 361)).await.is_ok() {
        n += 1;
        assert!(n < 1000, "more is kept than may be");
    }
    let files = std::fs::read_dir(server.folder.join("spool")).unwrap();
    let bytes: u64 = files.map(|file| file.unwrap().metadata().unwrap().len()).sum();
    assert!((1 << 16..1 << 17).contains(&bytes), "{bytes} bytes");
}

#[tokio::test(flavor = "multi_thread")]
async fn what_was_spooled_is_sent_at_the_next_start() {
    let mut server = Server::new();
    let to = Connection::to(&server.endpoint);
    let config = |boot| RobotConfig {
        clock: Clock::Log,
        boot,
        // So few that most of it waits on disk.
        in_flight_max: 20,
        spool: Some(server.folder.join("spool")),
        ..RobotConfig::new("r1")
    };
    let (first, second) = (config(1), config(2));
    let session = connected(&to).await;
    let mut robot = Robot::connect(&session, first).await.unwrap();
    for n in 0..SENT[0] {
        robot.send(message(n, "main", 61)).await.unwrap();
    }
    server.end();
    for n in SENT[0]..SENT[0] + SENT[1] {
        robot.send(message(n, "main", 61)).await.unwrap();
    }
    assert!(robot.in_flight() <= 20);
    drop(robot);
    session.close().await.unwrap();
    server.restart();
    let session = connected(&to).await;
    let mut robot = Robot::connect(&session, second).await.unwrap();
    robot.send(message(0, "main", 61)).await.unwrap();
    robot.settle().await.unwrap();
    assert_eq!(std::fs::read_dir(server.folder.join("spool")).unwrap().count(), 0, "nothing is left");
    Planner::new(&session, "default", "main", PATIENCE).unwrap().save().await.unwrap();
    let record = RecordReader::new(std::fs::File::open(server.folder.join("run.rec")).unwrap()).unwrap();
    let header = |m: Message| m.header().map(|h| (h.boot, h.seq));
    let entered: Vec<(u64, u64)> = record.filter_map(|m| header(m.unwrap().1)).collect();
    let all = (0..SENT[0] + SENT[1]).map(|seq| (1, seq)).chain([(2, 0)]);
    assert!(entered.iter().copied().eq(all), "{} entered", entered.len());
}
