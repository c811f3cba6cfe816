//! Users who come and go while the server runs: who is revoked is cut off at once, who stays goes on where they were.

use crate::drive::{Drive, PATIENCE, Server, connected};
use std::time::{Duration, Instant};
use toponym::Connection;

#[tokio::test(flavor = "multi_thread")]
async fn users_come_and_go() {
    let server = Server::new();
    let mut fleet = Connection::to(&server.endpoint);
    // As long as there are no users, this machine may do all.
    drop(connected(&fleet).await);
    let password = server.folder.join("password");
    std::fs::write(&password, "correct horse\n").unwrap();
    let add = ["add", "fleet", "--role", "trusted", "--password-file", password.to_str().unwrap()];
    server.user(&add);
    (fleet.user, fleet.password) = (Some("fleet".into()), Some("correct horse".into()));
    let mut drive = Drive::begin_as(&fleet).await;
    drive.go_for(Duration::from_secs(1)).await;
    server.user(&["add", "anna", "--role", "guide"]);
    drive.until_taken("somebody was let in").await;
    server.user(&["revoke", "fleet"]);
    let deadline = Instant::now() + PATIENCE;
    while fleet.open().await.is_ok() {
        assert!(Instant::now() < deadline, "who was revoked is let in still");
    }
    drive.go().await;
    let before = drive.acked;
    drive.go_for(Duration::from_millis(500)).await;
    assert_eq!(drive.acked, before, "who was revoked is heard still");
    // Without anybody nobody is let in, from this machine neither.
    server.user(&["revoke", "anna"]);
    drive.go_for(Duration::from_secs(3)).await;
    assert_eq!(drive.acked, before, "an empty policy lets somebody in");
    server.user(&add);
    drive.until_taken("they were let in again").await;
    drive.check(&server).await;
}
