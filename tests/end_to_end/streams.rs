//! What robots send, in whatever order and state it arrives.

use crate::site::{Folder, Site, connect, drive, header, odom, recorded, saved_map, say, settings, setup};
use toponym_core::Mapper;
use toponym_proto::answer::{ErrorCode, HeardStatus};
use toponym_proto::merge::{Sentences, order_stamp};
use toponym_proto::{Message, Stamp};
use toponym_server::convert;

#[tokio::test(flavor = "multi_thread")]
async fn garbage_on_a_key_is_told_and_the_stream_goes_on() {
    let folder = Folder::new();
    let site = Site::start(settings(&folder)).await;
    let (acks, states) = (site.acks("r1").await, site.states("r1").await);
    site.send(&setup("r1", "main")).await;
    site.put(&site.keys.odom("r1"), "zenoh/bytes", vec![0xde, 0xad, 0xbe, 0xef]).await;
    let state = states.state(|s| s.counts.refused == 1).await;
    let error = state.error.unwrap();
    assert_eq!(error.code, ErrorCode::BadArgument);
    assert!(error.message.contains("robot/r1/in/odom") && error.message.contains("version 222"), "{error:?}");
    for message in drive("r1", "main").iter().skip(1) {
        site.send(message).await;
    }
    assert_eq!(acks.ack_of(81).await.lost, 0);
    site.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn json_takes_the_same_way_as_bincode() {
    let folder = Folder::new();
    let record = folder.0.join("run.rec");
    let site = Site::start_recording(settings(&folder), Some(&record)).await;
    let acks = site.acks("r1").await;
    let stream = drive("r1", "main");
    for message in &stream {
        site.send_json(message).await;
    }
    acks.ack_of(81).await;
    site.stop().await;
    let (scan, taken) = (&stream[2], &recorded(&record)[2]);
    assert_eq!(format!("{taken:?}"), format!("{scan:?}"));
}

#[tokio::test(flavor = "multi_thread")]
async fn overtaken_and_repeated_messages_come_out_in_order() {
    let folder = Folder::new();
    let record = folder.0.join("run.rec");
    let site = Site::start_recording(settings(&folder), Some(&record)).await;
    let (acks, states) = (site.acks("r1").await, site.states("r1").await);
    let stream = drive("r1", "main");
    for chunk in stream.chunks(4) {
        for message in chunk.iter().rev().chain(chunk.first()) {
            site.send(message).await;
        }
    }
    let ack = acks.ack_of(81).await;
    assert_eq!(ack.lost, 0);
    let repeated = stream.chunks(4).count() as u64;
    states.state(|s| s.counts.repeated == repeated && s.counts.lost == 0).await;
    site.stop().await;
    assert_eq!(recorded(&record), stream);
}

#[tokio::test(flavor = "multi_thread")]
async fn what_never_comes_is_waited_for_then_told() {
    let folder = Folder::new();
    let site = Site::start(settings(&folder)).await;
    let (acks, states) = (site.acks("r1").await, site.states("r1").await);
    for message in drive("r1", "main").iter().filter(|m| !matches!(m.header().unwrap().seq, 7..10)) {
        site.send(message).await;
    }
    assert_eq!(acks.ack_of(81).await.lost, 3);
    states.state(|s| s.counts.lost == 3).await;
    site.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_second_robot_on_a_map_is_refused() {
    let folder = Folder::new();
    let site = Site::start(settings(&folder)).await;
    let (acks, states) = (site.acks("r1").await, site.states("r2").await);
    site.send(&setup("r1", "main")).await;
    acks.ack_of(0).await;
    site.send(&setup("r2", "main")).await;
    site.send(&odom("r2", 1, 0.0)).await;
    let state = states.state(|s| s.counts.refused == 2).await;
    let error = state.error.unwrap();
    assert_eq!((state.map, error.code), (None, ErrorCode::MapTaken));
    assert!(error.message.contains("r1") && error.hint.is_some());
    // With a map of its own it is welcome.
    let Message::Setup(mut again) = setup("r2", "annex") else { unreachable!() };
    again.header.seq = 2;
    site.send(&Message::Setup(again)).await;
    let state = states.state(|s| s.map.is_some()).await;
    assert_eq!((state.map.as_deref(), state.error), (Some("annex"), None));
    site.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_robot_that_never_presented_itself_is_told_so() {
    let folder = Folder::new();
    let site = Site::start(settings(&folder)).await;
    let states = site.states("r1").await;
    site.send(&odom("r1", 0, 0.0)).await;
    let state = states.state(|s| s.counts.refused == 1).await;
    assert_eq!(state.error.unwrap().field.as_deref(), Some("setup"));
    site.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn too_long_a_payload_is_refused() {
    let folder = Folder::new();
    let mut config = settings(&folder);
    config.limits.payload_bytes = 1000;
    let site = Site::start(config).await;
    let states = site.states("r1").await;
    site.put(&site.keys.odom("r1"), "", vec![b'{'; 1001]).await;
    let state = states.state(|s| s.error.is_some()).await;
    assert_eq!(state.error.unwrap().code, ErrorCode::TooLarge);
    site.stop().await;
}

/// The networked run is the offline one: sentences from another connection find their places, and
/// what was recorded makes the same map, bit for bit.
#[tokio::test(flavor = "multi_thread")]
async fn a_recorded_run_replays_to_the_same_map() {
    let folder = Folder::new();
    let record = folder.0.join("run.rec");
    let mut config = settings(&folder);
    // The stream is sent before the first sentence: all of it must still be held then.
    config.hold_back_s = 2.0;
    let site = Site::start_recording(config.clone(), Some(&record)).await;
    let guide = connect(&site.server).await;
    let (acks, heard) = (site.acks("r1").await, site.listen(site.keys.heard("r1")).await);
    let stream = drive("r1", "main");
    let at = |seq: u64| Some(Stamp { ns: header("r1", seq).stamp.ns + 1 });
    let says = [
        say(Some("r1"), "b", "this is the kitchen", at(60)),
        say(Some("r1"), "a", "this is the gym", at(20)),
    ];
    for message in &stream {
        site.send(message).await;
    }
    for say in &says {
        let bytes = Message::Say(say.clone()).to_json().unwrap();
        guide.put(site.keys.say(Some("r1")), bytes).await.unwrap();
    }
    heard.heard("a").await;
    assert!(heard.heard("b").await.durable);
    assert!(acks.until(|ack: &toponym_proto::answer::Ack| ack.seq == 81).await.lost == 0);
    site.stop().await;

    let mut sentences = Sentences::default();
    for say in says {
        sentences.push(say, Stamp::default());
    }
    let mut offline = Vec::new();
    for message in stream {
        offline.extend(std::iter::from_fn(|| sentences.pop_before(order_stamp(&message))).map(Message::Say));
        offline.push(message);
    }
    let recorded = recorded(&record);
    assert_eq!(recorded, offline);

    let mut mapper = Mapper::new(config.mapper);
    for message in recorded {
        mapper.step(convert::event(message));
    }
    assert!(mapper.snapshot().graph().places.len() > 3);
    assert!(mapper.save().unwrap() == saved_map(&folder, "main"));
}

#[tokio::test(flavor = "multi_thread")]
async fn sentences_that_cannot_be_used_are_answered() {
    let folder = Folder::new();
    let site = Site::start(settings(&folder)).await;
    let (acks, heard) = (site.acks("r1").await, site.listen(site.keys.heard("*")).await);
    // Nobody there, and nobody comes.
    site.send_json(&Message::Say(say(Some("r7"), "s1", "this is the gym", None))).await;
    let refusal = heard.heard("s1").await;
    assert_eq!((refusal.status, refusal.error.unwrap().code), (HeardStatus::Refused, ErrorCode::NoSuchRobot));

    for message in drive("r1", "main").iter().take(9) {
        site.send(message).await;
    }
    acks.ack_of(8).await;
    // The only robot need not be named.
    site.send_json(&Message::Say(say(None, "s2", "this is the gym", None))).await;
    assert_ne!(heard.heard("s2").await.status, HeardStatus::Refused);
    let mut back = say(Some("r1"), "s3", "this is the lounge", None);
    back.retracts = Some("s2".into());
    site.send_json(&Message::Say(back)).await;
    assert!(heard.heard("s3").await.words.contains("I took back: \"this is the gym\""));

    let acks = site.acks("r2").await;
    site.send(&setup("r2", "annex")).await;
    acks.ack_of(0).await;
    site.send_json(&Message::Say(say(None, "s4", "this is the gym", None))).await;
    let error = heard.heard("s4").await.error.unwrap();
    assert_eq!(error.code, ErrorCode::RobotAmbiguous);
    assert!(error.hint.unwrap().contains("r1, r2"));
    // Not even a sentence.
    site.put(&site.keys.say(Some("r1")), "", b"{\"txt\": 1}".to_vec()).await;
    assert_eq!(heard.heard("").await.error.unwrap().code, ErrorCode::BadArgument);
    site.stop().await;
}
