//! Start, stop, and what outlives them.

use crate::site::{Folder, Site, drive, header, saved_map, settings, setup};
use toponym_proto::answer::{ErrorCode, GraphReply, Info};
use toponym_proto::keys::Ask;
use toponym_proto::{Header, Limits, Message, Setup};
use toponym_server::config::ServerConfig;
use toponym_server::serve::{Server, serve};
use toponym_sim::hall;

#[tokio::test(flavor = "multi_thread")]
async fn a_map_outlives_the_server() {
    let folder = Folder::new();
    let stream = drive("r1", "main");
    let site = Site::start(settings(&folder)).await;
    let acks = site.acks("r1").await;
    for message in stream.iter().take(41) {
        site.send(message).await;
    }
    acks.ack_of(40).await;
    let info: Info = serde_json::from_value(site.ask(&site.keys.info(), "").await.unwrap()).unwrap();
    site.stop().await;

    // The robot doesn't know how much of it was taken, and sends all of it again.
    let site = Site::start(settings(&folder)).await;
    let (acks, states) = (site.acks("r1").await, site.states("r1").await);
    for message in &stream {
        site.send(message).await;
    }
    assert_eq!(acks.ack_of(81).await.lost, 0);
    states.state(|s| s.counts.repeated == 41).await;
    let again: Info = serde_json::from_value(site.ask(&site.keys.info(), "").await.unwrap()).unwrap();
    assert_eq!(again.maps[0].uuid, info.maps[0].uuid);
    site.stop().await;

    // The map is the one of a run that was never interrupted.
    let whole = Folder::new();
    let site = Site::start(settings(&whole)).await;
    let acks = site.acks("r1").await;
    for message in &stream {
        site.send(message).await;
    }
    acks.ack_of(81).await;
    site.stop().await;
    assert!(saved_map(&folder, "main") == saved_map(&whole, "main"));
}

#[tokio::test(flavor = "multi_thread")]
async fn an_idle_map_makes_room_and_is_brought_back() {
    let folder = Folder::new();
    let mut config = settings(&folder);
    (config.limits.maps, config.limits.map_idle_s) = (1, 0);
    let site = Site::start(config.clone()).await;
    let graphs = site.listen(site.keys.graph("zoo")).await;
    let acks = site.acks("r1").await;
    for message in drive("r1", "zoo").iter().take(81) {
        site.send(message).await;
    }
    acks.ack_of(80).await;
    site.settle().await;
    graphs.until(|graph: &GraphReply| graph.places.len() > 3).await;
    let info: Info = serde_json::from_value(site.ask(&site.keys.info(), "").await.unwrap()).unwrap();
    let (acks, states) = (site.acks("r2").await, site.states("r1").await);
    for message in drive("r2", "annex").iter().take(41) {
        site.send(message).await;
    }
    acks.ack_of(40).await;
    let gone = site.ask(&site.keys.ask("zoo", Ask::Labels), "").await.unwrap_err();
    assert!(gone.code == ErrorCode::NoSuchMap && gone.message.contains("made room"), "{gone:?}");

    // It says its setup again, and goes on where it was.
    states.state(|state| state.map.is_none()).await;
    site.send(&hall::setup(header("r1", 81), "zoo")).await;
    states.state(|state| state.map.as_deref() == Some("zoo")).await;
    let back: Info = serde_json::from_value(site.ask(&site.keys.info(), "").await.unwrap()).unwrap();
    assert_eq!((&back.maps[0].uuid, back.maps.len()), (&info.maps[0].uuid, 1));
    site.stop().await;
    // Of those on disk the one is at hand that was written to last, and its robot is known.
    let site = Site::start(config).await;
    let info: Info = serde_json::from_value(site.ask(&site.keys.info(), "").await.unwrap()).unwrap();
    assert_eq!(info.maps.iter().map(|map| map.id.as_str()).collect::<Vec<_>>(), ["zoo"]);
    let acks = site.acks("r2").await;
    site.send(&hall::setup(header("r2", 41), "annex")).await;
    assert_eq!(acks.ack_of(41).await.lost, 0, "it goes on behind what it sent before");
    site.stop().await;
    assert!(!toponym_core::Mapper::load(&saved_map(&folder, "zoo")).unwrap().snapshot().is_empty());
}

#[tokio::test(flavor = "multi_thread")]
async fn do_save_writes_the_map() {
    let folder = Folder::new();
    let site = Site::start(settings(&folder)).await;
    let graphs = site.listen(site.keys.graph("main")).await;
    for message in &drive("r1", "main") {
        site.send(message).await;
    }
    graphs.until(|graph: &GraphReply| graph.places.len() > 3).await;
    let done = site.ask(&site.keys.command("save"), "").await.unwrap();
    assert_eq!(done["maps"][0], "main");
    let saved = saved_map(&folder, "main");
    assert!(toponym_core::Mapper::load(&saved).unwrap().snapshot().graph().places.len() > 3);
    site.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_port_in_use_is_named() {
    let (folder, other) = (Folder::new(), Folder::new());
    let site = Site::start(settings(&folder)).await;
    let mut config = settings(&other);
    config.listen = site.server.endpoints().to_vec();
    let error = Server::start(config.clone(), None).await.err().expect("an error").to_string();
    assert!(error.contains(&config.listen[0]) && error.contains("in use"), "{error}");
    site.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_data_folder_in_use_is_named() {
    let folder = Folder::new();
    let site = Site::start(settings(&folder)).await;
    let error = Server::start(settings(&folder), None).await.err().expect("an error").to_string();
    assert!(error.contains("another server uses this data folder"), "{error}");
    site.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_record_is_never_overwritten() {
    let folder = Folder::new();
    let record = folder.0.join("run.rec");
    std::fs::write(&record, b"the only one").unwrap();
    let error =
        Server::start(settings(&folder), Some(record.clone())).await.err().expect("an error").to_string();
    assert!(error.contains("run.rec") && error.contains("move it away"), "{error}");
    assert_eq!(std::fs::read(&record).unwrap(), b"the only one");
}

#[tokio::test(flavor = "multi_thread")]
async fn a_record_that_cannot_be_written_is_told_at_the_start() {
    let folder = Folder::new();
    let record = folder.0.join("no_such_folder/run.rec");
    let error = Server::start(settings(&folder), Some(record)).await.err().expect("an error").to_string();
    assert!(error.contains("no_such_folder/run.rec"), "{error}");
}

#[tokio::test(flavor = "multi_thread")]
async fn a_start_that_fails_leaves_no_record() {
    let (folder, other) = (Folder::new(), Folder::new());
    let site = Site::start(settings(&folder)).await;
    let mut config = settings(&other);
    config.listen = site.server.endpoints().to_vec();
    let record = other.0.join("run.rec");
    assert!(Server::start(config, Some(record.clone())).await.is_err());
    assert!(!record.exists());
    site.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_map_that_cannot_be_saved_is_an_error_of_the_stop() {
    let folder = Folder::new();
    let site = Site::start(settings(&folder)).await;
    let acks = site.acks("r1").await;
    for message in drive("r1", "main").iter().take(3) {
        site.send(message).await;
    }
    acks.ack_of(2).await;
    // A folder stands where the map is to be written.
    std::fs::create_dir(folder.0.join("data/main/new.checkpoint")).unwrap();
    let error = site.server.stop().await.unwrap_err().to_string();
    assert!(error.contains("map main could not be saved") && error.contains(".checkpoint"), "{error}");
}

#[tokio::test(flavor = "multi_thread")]
async fn a_broken_map_stops_only_itself() {
    let folder = Folder::new();
    let site = Site::start(settings(&folder)).await;
    for map in ["main", "annex"] {
        let robot = format!("r-{map}");
        let acks = site.acks(&robot).await;
        for message in drive(&robot, map).iter().take(9) {
            site.send(message).await;
        }
        acks.ack_of(8).await;
    }
    site.stop().await;
    let path = folder.0.join("data/main/00000000000000000000.checkpoint");
    let files = std::fs::read_dir(path.parent().unwrap()).unwrap().map(|e| e.unwrap().path());
    files
        .filter(|f| f.extension().is_some_and(|e| e == "checkpoint"))
        .for_each(|f| std::fs::remove_file(f).unwrap());
    std::fs::write(&path, b"no map").unwrap();

    let site = Site::start(settings(&folder)).await;
    let problem = site.ask(&site.keys.ask("main", Ask::Labels), "").await.unwrap_err();
    assert!(problem.message.contains("checkpoint: damaged at byte 0"), "{problem}");
    site.ask(&site.keys.ask("annex", Ask::Labels), "").await.unwrap();
    let states = site.states("r-main").await;
    site.send(&setup("r-main", "main")).await;
    states.state(|s| s.error.as_ref().is_some_and(|e| e.message.contains("can't be loaded"))).await;
    site.stop().await;
    assert_eq!(std::fs::read(&path).unwrap(), b"no map");
}

#[tokio::test(flavor = "multi_thread")]
async fn serving_ends_when_asked_to() {
    let folder = Folder::new();
    serve(settings(&folder), None, std::future::ready(())).await.unwrap();
}

#[tokio::test(flavor = "multi_thread")]
async fn a_deleted_map_makes_room_and_is_kept() {
    let folder = Folder::new();
    let config = ServerConfig { limits: Limits { maps: 1, ..Limits::default() }, ..settings(&folder) };
    let site = Site::start(config).await;
    let (acks, states) = (site.acks("r1").await, site.states("*").await);
    for message in drive("r1", "main").iter().take(9) {
        site.send(message).await;
    }
    acks.ack_of(8).await;
    site.send(&setup("r2", "annex")).await;
    states.state(|s| s.robot == "r2" && s.error.is_some()).await;
    let delete = |map: &str| format!("{}?map={map}", site.keys.command("delete"));
    assert_eq!(site.ask(&delete("attic"), "").await.unwrap_err().code, ErrorCode::NoSuchMap);
    site.ask(&delete("main"), "").await.unwrap();
    assert!(folder.0.join("data/main.deleted-1").is_dir() && !folder.0.join("data/main").exists());
    let lost = states.state(|s| s.robot == "r1" && s.map.is_none()).await;
    assert!(lost.error.unwrap().message.contains("was deleted"));
    // There is room for the other one's map now.
    let acks = site.acks("r2").await;
    let again = |message: &Message| match message.clone() {
        Message::Setup(m) => Message::Setup(Setup { header: Header { boot: 2, ..m.header }, ..m }),
        other => other,
    };
    site.send(&again(&setup("r2", "annex"))).await;
    acks.ack_of(0).await;
    site.stop().await;
}
