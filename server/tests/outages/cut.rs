//! A network that is cut, stalls, and comes back: nothing is lost.
//!
//! `TOPONYM_CUT_S` sets how long it is away (2), `TOPONYM_SCENES` how many scenes are drawn (1), by `TOPONYM_SEED`.

use crate::drive::{Drive, Server, setting};
use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;
use std::net::SocketAddr;
use std::time::Duration;
use tokio::io::{AsyncReadExt as _, AsyncWriteExt as _};
use tokio::net::{TcpListener, TcpStream};
use tokio::sync::watch;

/// What becomes of what is sent.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Line {
    /// It arrives.
    Open,
    /// What the server sends waits: its client does not listen.
    Deaf,
    /// So many of a hundred segments are lost, and sent again by TCP after a while.
    Lossy(u32),
    /// It waits: neither side is told.
    Stalled,
    /// Connections end, and new ones are refused.
    Cut,
}

/// TCP's shortest wait before it sends a segment again.
const RETRANSMITTED: Duration = Duration::from_millis(200);

impl Line {
    fn segment_bytes(self) -> usize {
        if matches!(self, Self::Lossy(_)) { 1448 } else { 1 << 14 }
    }
}

/// A line between robot and server.
pub struct Proxy {
    pub line: watch::Sender<Line>,
    pub endpoint: String,
}

impl Proxy {
    pub async fn to(server: &str) -> Self {
        let server: SocketAddr = server.strip_prefix("tcp/").unwrap().parse().unwrap();
        let listener = TcpListener::bind("127.0.0.1:0").await.unwrap();
        let endpoint = format!("tcp/{}", listener.local_addr().unwrap());
        let (line, state) = watch::channel(Line::Open);
        tokio::spawn(async move {
            while let Ok((client, _)) = listener.accept().await {
                if *state.borrow() != Line::Cut
                    && let Ok(server) = TcpStream::connect(server).await
                {
                    let (from, to) = (client.into_split(), server.into_split());
                    tokio::spawn(carry(from.0, to.1, state.clone(), false));
                    tokio::spawn(carry(to.0, from.1, state.clone(), true));
                }
            }
        });
        Self { line, endpoint }
    }
}

/// Carries bytes one way, as the line is.
async fn carry(
    mut from: tokio::net::tcp::OwnedReadHalf,
    mut to: tokio::net::tcp::OwnedWriteHalf,
    mut line: watch::Receiver<Line>,
    is_to_client: bool,
) {
    let mut bytes = vec![0; 1 << 14];
    let mut random = ChaCha8Rng::seed_from_u64(u64::from(is_to_client));
    loop {
        let state = *line.borrow_and_update();
        let read = match state {
            Line::Cut => return,
            Line::Stalled | Line::Deaf if state == Line::Stalled || is_to_client => {
                if line.changed().await.is_err() {
                    return;
                }
                continue;
            }
            Line::Open | Line::Deaf | Line::Stalled | Line::Lossy(_) => tokio::select! {
                read = from.read(&mut bytes[..state.segment_bytes()]) => read,
                changed = line.changed() => if changed.is_ok() { continue } else { return },
            },
        };
        if let Line::Lossy(percent) = state {
            // Waits twice as long each time the same segment is lost again.
            let mut wait = RETRANSMITTED;
            while random.random_range(0..100) < percent {
                tokio::time::sleep(wait).await;
                wait *= 2;
            }
        }
        match read {
            Ok(count @ 1..) if to.write_all(&bytes[..count]).await.is_ok() => {}
            _ => return,
        }
    }
}

fn away() -> Duration {
    Duration::from_secs(setting("TOPONYM_CUT_S", 2))
}

/// Robot and guide go on while the line does this, one after the other.
async fn nothing_is_lost(scene: &[(Line, Duration)]) {
    let server = Server::new();
    // The server listens before anybody is let through.
    drop(crate::drive::connected(&toponym::Connection::to(&server.endpoint)).await);
    let proxy = Proxy::to(&server.endpoint).await;
    let mut drive = Drive::begin(&proxy.endpoint).await;
    drive.go_for(Duration::from_millis(500)).await;
    let (line, scene) = (proxy.line.clone(), scene.to_vec());
    let scene = tokio::spawn(async move {
        for (state, time) in scene {
            line.send_replace(state);
            tokio::time::sleep(time).await;
        }
        line.send_replace(Line::Open);
    });
    // The robot waits while too much is in flight.
    while !scene.is_finished() {
        drive.go().await;
    }
    drive.until_taken("a cut").await;
    drive.check(&server).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_cut_loses_nothing() {
    nothing_is_lost(&[(Line::Cut, away())]).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn cuts_in_a_row_lose_nothing() {
    let (cut, open) = ((Line::Cut, Duration::from_millis(300)), (Line::Open, Duration::from_millis(400)));
    nothing_is_lost(&[cut, open, cut, open, cut, open, cut]).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_stall_loses_nothing() {
    nothing_is_lost(&[(Line::Stalled, away())]).await;
}

/// Longer than Zenoh's lease of 10 s: both sides give the connection up, at different times.
#[tokio::test(flavor = "multi_thread")]
async fn a_half_open_connection_loses_nothing() {
    nothing_is_lost(&[(Line::Stalled, Duration::from_secs(12))]).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_lossy_line_loses_nothing() {
    nothing_is_lost(&[(Line::Lossy(1), away()), (Line::Lossy(10), away()), (Line::Lossy(30), away())]).await;
}

/// Up to four stretches of any kind, each up to twice as long as a cut.
fn drawn(random: &mut ChaCha8Rng) -> Vec<(Line, Duration)> {
    let stretch = |random: &mut ChaCha8Rng| {
        let line = match random.random_range(0..6) {
            0 => Line::Cut,
            1 => Line::Stalled,
            2 => Line::Deaf,
            3 => Line::Open,
            _ => Line::Lossy([1, 10, 30][random.random_range(0..3)]),
        };
        (line, away().mul_f64(random.random_range(0.05..2.0)))
    };
    (0..random.random_range(1..=4)).map(|_| stretch(random)).collect()
}

#[tokio::test(flavor = "multi_thread")]
async fn drawn_scenes_lose_nothing() {
    for k in 0..setting("TOPONYM_SCENES", 1) {
        let seed = setting("TOPONYM_SEED", 1) + k;
        let scene = drawn(&mut ChaCha8Rng::seed_from_u64(seed));
        println!("scene {seed}: {scene:?}");
        nothing_is_lost(&scene).await;
    }
}
