//! `toponym-server journal`.

use crate::drive::{Drive, Server};
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Duration;

fn journal(what: &str, folder: &Path) -> (bool, String) {
    let run = Command::new(env!("CARGO_BIN_EXE_toponym-server"))
        .args(["journal", what])
        .arg(folder)
        .output()
        .unwrap();
    let told = String::from_utf8(run.stdout).unwrap() + &String::from_utf8(run.stderr).unwrap();
    (run.status.success(), told)
}

/// The newest file of a kind in a map's folder.
fn newest(map: &Path, kind: &str) -> PathBuf {
    let files = std::fs::read_dir(map).unwrap().map(|e| e.unwrap().path());
    files.filter(|f| f.extension().is_some_and(|e| e == kind)).max().unwrap()
}

#[tokio::test(flavor = "multi_thread")]
async fn a_damaged_journal_is_told_and_recovered() {
    let mut server = Server::new();
    let mut drive = Drive::begin(&server.endpoint).await;
    drive.go_for(Duration::from_secs(1)).await;
    server.end();
    let data = server.folder.join("data");
    let map = data.join("main");
    let (good, told) = journal("verify", &data);
    assert!(good && told.contains("main: good."), "{told}");
    let (good, lines) = journal("dump", &map);
    assert!(good && lines.lines().count() as u64 > drive.acked, "{} lines", lines.lines().count());
    let first: serde_json::Value = serde_json::from_str(lines.lines().next().unwrap()).unwrap();
    assert_eq!(first["index"], 1);

    let segment = newest(&map, "journal");
    let mut bytes = std::fs::read(&segment).unwrap();
    bytes[9_000] ^= 4;
    std::fs::write(&segment, &bytes).unwrap();
    let (good, told) = journal("verify", &map);
    assert!(!good && told.contains("DAMAGED") && told.contains("damaged at byte"), "{told}");
    let (good, told) = journal("recover", &map);
    assert!(good && told.contains("main.damaged-1"), "{told}");
    let (good, told) = journal("verify", &data);
    assert!(good, "{told}");
    assert_eq!(std::fs::read(data.join("main.damaged-1").join(segment.file_name().unwrap())).unwrap(), bytes);
    let (good, told) = journal("verify", &server.folder.join("none"));
    assert!(!good && told.contains("none"), "{told}");
}
