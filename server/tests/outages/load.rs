//! Many who ask, and those who do not listen: they slow no one else down.
//!
//! `TOPONYM_LOAD_S` sets how long (2).

use crate::cut::{Line, Proxy};
use crate::drive::{Drive, PATIENCE, Server, connected, setting};
use std::process::{Command, Stdio};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};
use toponym::Connection;
use toponym_sim::hall::PERIOD_NS;
use zenoh::Session;

/// Questions a second.
const ASKED_PER_S: u64 = 2000;
/// Who ask them.
const ASKERS: u64 = 8;

fn time() -> Duration {
    Duration::from_secs(setting("TOPONYM_LOAD_S", 2))
}

/// Of times in their order.
fn quantile(times: &[Duration], q: f64) -> Duration {
    times[((times.len() - 1) as f64 * q) as usize]
}

/// When poses came.
async fn poses(session: &Session) -> Arc<Mutex<Vec<Instant>>> {
    let came = Arc::new(Mutex::new(Vec::new()));
    let note = came.clone();
    session
        .declare_subscriber("toponym/v1/default/robot/r1/out/pose")
        .callback(move |_| note.lock().unwrap().push(Instant::now()))
        .background()
        .await
        .unwrap();
    came
}

/// The longest time without a pose.
fn silence(came: &Mutex<Vec<Instant>>, began: Instant) -> Duration {
    let came = came.lock().unwrap();
    let times: Vec<Instant> = std::iter::once(began)
        .chain(came.iter().copied().filter(|t| *t > began))
        .chain([Instant::now()])
        .collect();
    times.windows(2).map(|w| w[1] - w[0]).max().unwrap()
}

#[tokio::test(flavor = "multi_thread")]
async fn many_questions_lose_nothing() {
    let server = Server::new();
    let mut drive = Drive::begin(&server.endpoint).await;
    drive.go_for(Duration::from_secs(1)).await;
    let (answered, busy) = (Arc::new(AtomicU64::new(0)), Arc::new(AtomicU64::new(0)));
    let times = Arc::new(Mutex::new(Vec::new()));
    let mut askers = Vec::new();
    for _ in 0..ASKERS {
        let session = connected(&Connection::to(&server.endpoint)).await;
        let (answered, busy, times) = (answered.clone(), busy.clone(), times.clone());
        askers.push(tokio::spawn(async move {
            let mut tick = tokio::time::interval(Duration::from_secs(1) / (ASKED_PER_S / ASKERS) as u32);
            let until = Instant::now() + time();
            while Instant::now() < until {
                tick.tick().await;
                let (asked, answered, busy, times) =
                    (Instant::now(), answered.clone(), busy.clone(), times.clone());
                let reply = move |reply: zenoh::query::Reply| {
                    times.lock().unwrap().push(asked.elapsed());
                    let count = if reply.result().is_ok() { &answered } else { &busy };
                    count.fetch_add(1, Ordering::Relaxed);
                };
                let selector = "toponym/v1/default/map/main/ask/where?name=workshop";
                session.get(selector).timeout(PATIENCE).callback(reply).await.unwrap();
            }
            // Until the last is answered.
            drop(session.get("toponym/v1/default/time").await.unwrap().recv_async().await);
        }));
    }
    while askers.iter().any(|asker| !asker.is_finished()) {
        drive.go().await;
    }
    let mut times = std::mem::take(&mut *times.lock().unwrap());
    times.sort_unstable();
    println!(
        "{} answered, {} busy in {:?}; p50 {:?}, p99 {:?}",
        answered.load(Ordering::Relaxed),
        busy.load(Ordering::Relaxed),
        time(),
        quantile(&times, 0.5),
        quantile(&times, 0.99)
    );
    assert!(answered.load(Ordering::Relaxed) > 0);
    drive.check(&server).await;
}

/// Where the process is to connect that subscribes and asks.
const ASKS_AT: &str = "TOPONYM_ASKS_AT";

/// Not a test, but the one who subscribes to all and asks for more than is read: in a process of its own, for sessions of one
/// process share the threads that send and receive.
#[tokio::test(flavor = "multi_thread")]
#[ignore = "run by the others"]
async fn asks_a_lot() {
    let Ok(endpoint) = std::env::var(ASKS_AT) else { return };
    let session = connected(&Connection::to(&endpoint)).await;
    for key in ["toponym/v1/default/robot/*/out/**", "toponym/v1/default/map/*/out/**"] {
        session.declare_subscriber(key).callback(|_| {}).background().await.unwrap();
    }
    loop {
        for key in ["where?name=workshop", "graph", "grid"] {
            let selector = format!("toponym/v1/default/map/main/ask/{key}");
            let _ = session.get(selector).timeout(PATIENCE).callback(|_| {}).await;
        }
        tokio::time::sleep(Duration::from_millis(1)).await;
    }
}

/// What others see while the robot drives for a while: the longest time without a pose, and how long one in two and one in
/// a hundred of the questions of a planner who asks 20 a second takes.
async fn seen(
    drive: &mut Drive,
    follower: &Session,
    came: &Mutex<Vec<Instant>>,
    time: Duration,
) -> (Duration, [Duration; 2]) {
    let (began, times) = (Instant::now(), Arc::new(Mutex::new(Vec::new())));
    let (session, kept) = (follower.clone(), times.clone());
    let asks = tokio::spawn(async move {
        let mut tick = tokio::time::interval(Duration::from_millis(50));
        loop {
            tick.tick().await;
            let (asked, kept) = (Instant::now(), kept.clone());
            let note = move |_| kept.lock().unwrap().push(asked.elapsed());
            let selector = "toponym/v1/default/map/main/ask/where?name=workshop";
            let _ = session.get(selector).timeout(PATIENCE).callback(note).await;
        }
    });
    drive.go_for(time).await;
    asks.abort();
    let mut times = std::mem::take(&mut *times.lock().unwrap());
    times.sort_unstable();
    (silence(came, began), [0.5, 0.99].map(|q| quantile(&times, q)))
}

#[tokio::test(flavor = "multi_thread")]
async fn who_does_not_listen_slows_no_one_else() {
    let server = Server::new();
    let mut drive = Drive::begin(&server.endpoint).await;
    // As fast as robots are, a pose each 50 ms: else the map is another one from phase to phase.
    drive.period = Duration::from_nanos(PERIOD_NS as u64);
    let follower = connected(&Connection::to(&server.endpoint)).await;
    let came = poses(&follower).await;
    drive.go_for(Duration::from_secs(1)).await;
    let alone = seen(&mut drive, &follower, &came, time()).await;
    let proxy = Proxy::to(&server.endpoint).await;
    let mut other = Command::new(std::env::current_exe().unwrap())
        .args(["load::asks_a_lot", "--exact", "--ignored"])
        .env(ASKS_AT, &proxy.endpoint)
        .stdout(Stdio::null())
        .spawn()
        .unwrap();
    let asked = seen(&mut drive, &follower, &came, time()).await;
    proxy.line.send_replace(Line::Deaf);
    // Longer than Zenoh waits for those of whom nothing is heard.
    let deaf = seen(&mut drive, &follower, &came, time() + Duration::from_secs(12)).await;
    let _ = other.kill();
    let _ = other.wait();
    drive.go_for(Duration::from_secs(1)).await;
    let again = seen(&mut drive, &follower, &came, time()).await;
    println!(
        "longest silence, where's p50 and p99:\nalone {alone:?}\nbeside one who asks a lot {asked:?}\n\
              when they do not listen {deaf:?}\nalone again {again:?}"
    );
    // It was ten; how short it is now is for eyes, as machines differ.
    assert!(deaf.0 < Duration::from_secs(5), "poses stop for {:?}", deaf.0);
    drive.check(&server).await;
}
