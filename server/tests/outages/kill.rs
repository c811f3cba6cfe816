//! `kill -9` of the real server, again and again: nothing that was acknowledged is lost, nothing counts twice, and robot
//! and guide go on by themselves.
//!
//! `TOPONYM_KILLS` sets how often (3), `TOPONYM_SEED` when.

use crate::drive::{Drive, Server, setting};
use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;
use std::time::Duration;

#[tokio::test(flavor = "multi_thread")]
async fn what_was_acknowledged_survives_kill_9() {
    let (kills, seed) = (setting("TOPONYM_KILLS", 3), setting("TOPONYM_SEED", 1));
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut server = Server::new();
    let mut drive = Drive::begin(&server.endpoint).await;
    let mut progressed = 0;
    for kill in 0..kills {
        let (after, before) = (Duration::from_millis(random.random_range(0..1500)), drive.acked);
        while server.began.elapsed() < after {
            drive.go().await;
        }
        server.restart();
        progressed += u64::from(drive.acked > before);
        // Every other time the robot has to be taken again before the next kill.
        if kill % 2 == 1 {
            drive.until_taken(&format!("kill {kill}, seed {seed}")).await;
        }
    }
    println!("{kills} kills, {progressed} with progress: {} messages, {} sentences", drive.sent, drive.said);
    drive.check(&server).await;
}

#[cfg(unix)]
#[tokio::test(flavor = "multi_thread")]
async fn a_stop_loses_nothing() {
    let mut server = Server::new();
    let mut drive = Drive::begin(&server.endpoint).await;
    drive.go_for(Duration::from_secs(1)).await;
    server.signal("HUP");
    drive.go_for(Duration::from_millis(300)).await;
    server.signal("TERM");
    assert!(server.ended(), "a stop says that all went well");
    server.restart();
    drive.until_taken("a stop").await;
    drive.check(&server).await;
}
