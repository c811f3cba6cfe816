//! Floods: whoever is let in sends too much, of each kind. The server keeps within its memory, and an honest robot is
//! served meanwhile.
//!
//! `TOPONYM_FLOOD_S` sets how long each flood lasts (2).

use crate::drive::{Drive, PATIENCE, Server, connected, setting};
use std::time::{Duration, Instant};
use tokio::task::JoinHandle;
use toponym::Connection;
use toponym_proto::{Clock, Header, Message, Say};
use toponym_sim::hall;
use zenoh::Session;
use zenoh::qos::CongestionControl;

/// What the server may need with all its queues full, beside its maps: bytes that wait at the door (64 MB), in gaps (256 MB),
/// and for their maps (64 MB each), and what Zenoh has received by then.
const MEMORY_MAX_BYTES: u64 = 1 << 30;

/// Lines that it may log of a flood.
const LINES_MAX: usize = 2000;

/// How the robot fared.
struct Fared {
    memory_bytes: u64,
    silence: Duration,
}

/// An honest robot, and meanwhile somebody else.
async fn meanwhile(name: &str, attack: impl FnOnce(Session, Instant) -> JoinHandle<u64>) {
    meanwhile_at(name, |session, _, until| attack(session, until)).await;
}

/// The same for somebody who needs to know where the server is.
async fn meanwhile_at(name: &str, attack: impl FnOnce(Session, String, Instant) -> JoinHandle<u64>) {
    let server = Server::new();
    let mut drive = Drive::begin(&server.endpoint).await;
    drive.until_taken("its start").await;
    let stranger = connected(&Connection::to(&server.endpoint)).await;
    let until = Instant::now() + Duration::from_secs(setting("TOPONYM_FLOOD_S", 2));
    let attack = attack(stranger, server.endpoint.clone(), until);
    let (mut fared, mut last) =
        (Fared { memory_bytes: 0, silence: Duration::ZERO }, (drive.acked, Instant::now()));
    while !attack.is_finished() {
        drive.go().await;
        if drive.acked > last.0 {
            last = (drive.acked, Instant::now());
        }
        fared.silence = fared.silence.max(last.1.elapsed());
        fared.memory_bytes = fared.memory_bytes.max(server.memory_bytes());
        assert!(fared.silence < PATIENCE, "{name}: nothing is acknowledged any more");
    }
    let sent = attack.await.unwrap();
    drive.until_taken(name).await;
    println!(
        "{name}: {sent} sent; {} MB, longest silence {:.2} s, {} lines logged",
        fared.memory_bytes >> 20,
        fared.silence.as_secs_f64(),
        server.logged()
    );
    // Those who come then are served, too.
    let came = Instant::now();
    drop(connected(&Connection::to(&server.endpoint)).await);
    println!("{name}: a new client is let in after {:.2} s", came.elapsed().as_secs_f64());
    assert!(server.logged() < LINES_MAX, "{name}: {} lines in the log", server.logged());
    assert!(fared.memory_bytes <= MEMORY_MAX_BYTES, "{name}: {} MB", fared.memory_bytes >> 20);
    assert_eq!(drive.robot.acked().unwrap().lost, 0);
}

/// Puts payloads made by number until the time is over.
fn put_all(
    session: Session,
    until: Instant,
    make: impl Fn(u64) -> (String, Vec<u8>) + Send + 'static,
) -> JoinHandle<u64> {
    tokio::spawn(async move {
        let mut sent = 0;
        while Instant::now() < until {
            let (key, payload) = make(sent);
            let _ = session.put(&key, payload).congestion_control(CongestionControl::Block).await;
            sent += 1;
        }
        sent
    })
}

fn key(robot: &str, rest: &str) -> String {
    format!("toponym/v1/default/robot/{robot}/{rest}")
}

/// A message of a robot's as it would send it.
fn bytes(robot: &str, seq: u64, mut message: Message) -> Vec<u8> {
    let header = Header { robot: robot.into(), boot: 1, seq, clock: Clock::Log, ..Header::default() };
    match &mut message {
        Message::Setup(setup) => setup.header = header,
        Message::Odom(odom) => odom.header = header,
        Message::Scan(scan) => scan.header = header,
        _ => unreachable!("no robot's message"),
    }
    message.to_json().unwrap()
}

#[tokio::test(flavor = "multi_thread")]
async fn large_messages() {
    meanwhile("1 MiB messages", |session, until| {
        put_all(session, until, |n| (key(&format!("x{}", n % 7), "in/odom"), vec![b' '; 1 << 20]))
    })
    .await;
}

#[tokio::test(flavor = "multi_thread")]
async fn many_robots() {
    meanwhile("robots with maps of their own", |session, until| {
        put_all(session, until, |n| {
            let robot = format!("x{}", n % 1000);
            let setup = bytes(&robot, 0, hall::setup(Header::default(), &format!("map{}", n % 1000)));
            (key(&robot, "in/setup"), setup)
        })
    })
    .await;
}

#[tokio::test(flavor = "multi_thread")]
async fn many_gaps() {
    meanwhile("robots that leave gaps", |session, until| {
        put_all(session, until, |n| {
            let robot = format!("x{}", n % 200);
            let scan = bytes(&robot, 2 + n / 200, hall::message(2, "main", 1081));
            (key(&robot, "in/scan/front"), scan)
        })
    })
    .await;
}

#[tokio::test(flavor = "multi_thread")]
async fn many_sentences() {
    meanwhile("sentences", |session, until| {
        put_all(session, until, |n| {
            let text =
                format!("this is room {} and the kitchen is next to the lab of professor {n}", n % 977);
            let say = Say { id: format!("{n}"), robot: Some("r1".into()), text, ..Say::default() };
            (key("r1", "say"), Message::Say(say).to_json().unwrap())
        })
    })
    .await;
}

#[tokio::test(flavor = "multi_thread")]
async fn many_keys() {
    meanwhile("keys", |session, until| {
        put_all(session, until, |n| (key(&format!("x{n}"), "in/odom"), b"nothing".to_vec()))
    })
    .await;
}

#[tokio::test(flavor = "multi_thread")]
async fn nasty_keys() {
    meanwhile("nasty keys", |session, until| {
        let keys = [
            format!("toponym/v1/default/map/{}*/ask/where", "$*a".repeat(200)),
            "toponym/v1/default/**/map/**/ask/**/where".into(),
            format!("toponym/v1/default/{}**", "*/**/".repeat(50)),
            format!("toponym/v1/default/map/{}/ask/where", "x".repeat(60_000)),
            "toponym/v1/*/map/*/ask/grid".into(),
            "**".into(),
        ];
        tokio::spawn(async move {
            let mut sent = 0;
            while Instant::now() < until {
                for key in &keys {
                    if let Ok(replies) = session.get(key).timeout(Duration::from_millis(500)).await {
                        drop(replies.recv_async().await);
                    }
                    let _ = session.put(key, "x").await;
                    sent += 1;
                }
            }
            sent
        })
    })
    .await;
}

#[tokio::test(flavor = "multi_thread")]
async fn silent_connections() {
    meanwhile_at("silent connections", |_, endpoint, until| {
        tokio::spawn(async move {
            let address = endpoint.strip_prefix("tcp/").unwrap().to_owned();
            let mut all = Vec::new();
            while Instant::now() < until {
                match tokio::net::TcpStream::connect(&address).await {
                    Ok(stream) if all.len() < 1000 => all.push(stream),
                    _ => tokio::time::sleep(Duration::from_millis(10)).await,
                }
            }
            // They stay: who comes then is to be let in all the same.
            let count = all.len() as u64;
            tokio::spawn(async move {
                tokio::time::sleep(PATIENCE).await;
                drop(all);
            });
            count
        })
    })
    .await;
}
