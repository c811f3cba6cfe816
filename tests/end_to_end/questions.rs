//! Every query gets a reply, whatever is asked and whenever.

use crate::site::{Folder, Site, drive, recorded, saved_map, say, settings};
use toponym_core::Mapper;
use toponym_proto::answer::{
    Clocks, ErrorCode, GraphReply, GridReply, Info, LabelsReply, Mended, PoseOut, PoseState, Reachable, Sent,
    WhatReply, WhereReply,
};
use toponym_proto::keys::Ask;
use toponym_proto::regions::RegionsReply;
use toponym_proto::{Header, Message, Pose};
use toponym_server::convert;

async fn mapped(folder: &Folder) -> Site {
    let site = Site::start(settings(folder)).await;
    let (acks, graphs) = (site.acks("r1").await, site.listen(site.keys.graph("main")).await);
    for message in &drive("r1", "main") {
        site.send(message).await;
    }
    acks.ack_of(81).await;
    graphs.until(|graph: &GraphReply| graph.places.len() > 3).await;
    site
}

#[tokio::test(flavor = "multi_thread")]
async fn a_map_answers() {
    let folder = Folder::new();
    let site = mapped(&folder).await;
    let heard = site.listen(site.keys.heard("r1")).await;
    let say = toponym_proto::Message::Say(crate::site::say(None, "s1", "this is the gym", None));
    site.send_json(&say).await;
    heard.heard("s1").await;

    let ask = |what: Ask, arguments: &str| format!("{}?{arguments}", site.keys.ask("main", what));
    let json = site.ask(&ask(Ask::Where, "name=gym"), "").await.unwrap();
    let reply: WhereReply = serde_json::from_value(json).unwrap();
    assert_eq!(reply.resolved.label.as_deref(), Some("gym"));
    assert!(!reply.candidates.is_empty() && reply.candidates[0].from_robot.is_some());
    let total: f64 = reply.p_none + reply.candidates.iter().map(|c| c.probability).sum::<f64>();
    assert!((total - 1.0).abs() < 1e-6, "{reply:?}");
    // The same as a JSON payload.
    let json = site.ask(&ask(Ask::Where, ""), r#"{"text": "where is the gym"}"#).await.unwrap();
    let question: WhereReply = serde_json::from_value(json).unwrap();
    assert_eq!(question.candidates, reply.candidates);

    // It is the room, and one can go there.
    let best = &reply.candidates[0];
    assert!(best.polygon_m.len() >= 4 && best.goal.as_ref().unwrap().reachable == Reachable::Yes, "{best:?}");
    let json = site.ask(&ask(Ask::What, ""), "").await.unwrap();
    let here: WhatReply = serde_json::from_value(json).unwrap();
    assert_eq!((here.names[0].label.as_str(), here.region), ("gym", Some(best.region)));
    let json = site.ask(&ask(Ask::What, "x_m=900;y_m=0"), "").await.unwrap();
    let nowhere: WhatReply = serde_json::from_value(json).unwrap();
    assert_eq!((nowhere.names.len(), nowhere.region), (0, None));
    let json = site.ask(&ask(Ask::Nearest, "name=gym"), "").await.unwrap();
    let nearest: WhereReply = serde_json::from_value(json).unwrap();
    assert!(nearest.candidates[0].walk_m.is_some_and(|m| m < 12.0), "{nearest:?}");
    for wrong in
        [ask(Ask::What, "x_m=1"), ask(Ask::What, "x_m=a;y_m=2"), ask(Ask::Where, "text=of%20the%20of")]
    {
        assert_eq!(site.ask(&wrong, "").await.unwrap_err().code, ErrorCode::BadArgument, "{wrong}");
    }

    // It can be sent there, and whatever drives it hears of it.
    let goals = site.listen(site.keys.goal("r1")).await;
    let go = |arguments: &str| format!("{}?{arguments}", site.keys.command("go"));
    let sent: Sent = serde_json::from_value(site.ask(&go("name=gym"), "").await.unwrap()).unwrap();
    assert_eq!((sent.robot.as_str(), &sent.goal), ("r1", &best.goal), "{sent:?}");
    goals.until(|told: &Sent| *told == sent).await;
    let json = site.ask(&go("name=swimming%20pool;robot=r1"), "").await.unwrap();
    assert_eq!(serde_json::from_value::<Sent>(json).unwrap().goal, None);
    assert_eq!(site.ask(&go("name=gym;robot=r9"), "").await.unwrap_err().code, ErrorCode::NoSuchRobot);

    // Somebody sees it where it is, and somewhere else.
    let told = |arguments: &str| format!("{}?{arguments}", site.keys.command("initial_pose"));
    let pose: PoseOut = serde_json::from_value(site.ask(&site.keys.pose("r1"), "").await.unwrap()).unwrap();
    let Pose { x_m, y_m, yaw_rad } = pose.map_from_body;
    for (x_m, words) in [(x_m, "too."), (x_m + 30.0, "I look for it there.")] {
        let there = told(&format!("x_m={x_m};y_m={y_m};yaw_rad={yaw_rad}"));
        let mended: Mended = serde_json::from_value(site.ask(&there, "").await.unwrap()).unwrap();
        assert!(mended.words.ends_with(words), "{mended:?}");
    }
    let json = site.ask(&site.keys.command("undo"), "").await.unwrap();
    let mended: Mended = serde_json::from_value(json).unwrap();
    assert!(mended.words.starts_with("I took back: \"the robot is at x 3"), "{mended:?}");
    for wrong in [told("x_m=1"), told("x_m=1;y_m=2;yaw_rad=north"), told("x_m=1;y_m=2;yaw_rad=0;sigma_m=0")] {
        assert_eq!(site.ask(&wrong, "").await.unwrap_err().code, ErrorCode::BadArgument, "{wrong}");
    }

    // An unknown place is an answer.
    let json = site.ask(&ask(Ask::Where, "name=swimming%20pool"), "").await.unwrap();
    let reply: WhereReply = serde_json::from_value(json).unwrap();
    assert_eq!((reply.p_none, reply.candidates.len()), (1.0, 0));

    let json = site.ask(&ask(Ask::Labels, ""), "").await.unwrap();
    let labels: LabelsReply = serde_json::from_value(json).unwrap();
    assert_eq!(labels.labels[0].label, "gym");
    let json = site.ask(&ask(Ask::Regions, ""), "").await.unwrap();
    let rooms: RegionsReply = serde_json::from_value(json).unwrap();
    // The hall of 12 m by 6 m is one room, and the gym is in it.
    assert_eq!(rooms.regions.len(), 1, "{rooms:?}");
    assert!((50.0..75.0).contains(&rooms.regions[0].area_m2) && rooms.regions[0].names[0].label == "gym");
    let json = site.ask(&ask(Ask::Grid, "resolution_m=0.2"), "").await.unwrap();
    let grid: GridReply = serde_json::from_value(json).unwrap();
    let cells = grid.cells().unwrap();
    assert!(cells.len() == grid.width * grid.height && cells.contains(&0), "{grid:?}");
    let edges = [&cells[..grid.width], &cells[cells.len() - grid.width..]];
    assert!(edges.iter().all(|row| row.iter().any(|&cell| cell >= 0)), "cropped to what is known");
    site.stop().await;
}

/// The same from the robot's next start, long after: it may have been carried anywhere.
fn restarted(message: &Message) -> Message {
    let again = |h: &Header| {
        let stamp = toponym_proto::Stamp { ns: h.stamp.ns + 100_000_000_000 };
        Header { boot: 2, stamp, ..h.clone() }
    };
    match message.clone() {
        Message::Setup(m) => Message::Setup(toponym_proto::Setup { header: again(&m.header), ..m }),
        Message::Odom(m) => Message::Odom(toponym_proto::Odom { header: again(&m.header), ..m }),
        Message::Scan(m) => Message::Scan(toponym_proto::Scan { header: again(&m.header), ..m }),
        other => other,
    }
}

/// Somebody at a desk knows what a part of the map is called, and that robots keep out of it.
#[tokio::test(flavor = "multi_thread")]
async fn an_area_is_called_and_forbidden() {
    let folder = Folder::new();
    let site = mapped(&folder).await;
    let pose: PoseOut = serde_json::from_value(site.ask(&site.keys.pose("r1"), "").await.unwrap()).unwrap();
    let Pose { x_m, y_m, .. } = pose.map_from_body;
    let drawn = |rest: &str| {
        let (left, right, low, high) = (x_m - 30.0, x_m + 30.0, y_m - 30.0, y_m + 30.0);
        let corners = format!("{left},{low},{right},{low},{right},{high},{left},{high}");
        format!("{}?polygon_m={corners};{rest}", site.keys.command("area"))
    };
    for told in ["id=a1;name=den", "id=a2;forbidden=true"] {
        let mended: Mended = serde_json::from_value(site.ask(&drawn(told), "").await.unwrap()).unwrap();
        assert!(mended.words.starts_with("the area about x"), "{mended:?}");
    }
    let json = site.ask(&site.keys.ask("main", Ask::Regions), "").await.unwrap();
    let rooms: RegionsReply = serde_json::from_value(json).unwrap();
    assert_eq!(
        rooms.areas.iter().map(|a| (a.name.as_deref(), a.forbidden)).collect::<Vec<_>>(),
        [(Some("den"), false), (None, true)]
    );
    assert!(rooms.regions[0].names.iter().any(|n| n.label == "den"), "{rooms:?}");
    let sent: Sent =
        serde_json::from_value(site.ask(&format!("{}?name=den", site.keys.command("go")), "").await.unwrap())
            .unwrap();
    assert_eq!(sent.goal, None, "robots keep out: {sent:?}");
    for id in ["a2", "a1"] {
        site.ask(&format!("{}?id={id}", site.keys.command("undo")), "").await.unwrap();
    }
    for wrong in [
        "",
        "polygon_m=0,0,4,0,4;name=x",
        "polygon_m=0,0,4,0,4,4",
        "polygon_m=0,0,4,0,4,4;name=x;forbidden=1",
    ] {
        let wrong = format!("{}?{wrong}", site.keys.command("area"));
        assert_eq!(site.ask(&wrong, "").await.unwrap_err().code, ErrorCode::BadArgument, "{wrong}");
    }
    site.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn who_is_lost_is_asked_where_things_are_but_not_how_far() {
    let folder = Folder::new();
    let site = mapped(&folder).await;
    let (heard, poses) = (site.listen(site.keys.heard("r1")).await, site.listen(site.keys.pose("r1")).await);
    site.send_json(&Message::Say(say(None, "s1", "this is the gym", None))).await;
    heard.heard("s1").await;
    let ask = |arguments: &str| format!("{}?{arguments}", site.keys.ask("main", Ask::Where));
    let of_robot = ["name=gym;robot=r1", "text=where%20am%20I"];
    for arguments in of_robot {
        site.ask(&ask(arguments), "").await.unwrap();
    }
    for message in &drive("r1", "main")[..9] {
        site.send(&restarted(message)).await;
    }
    poses.until(|pose: &PoseOut| pose.state == PoseState::Lost).await;
    for arguments in of_robot {
        assert_eq!(site.ask(&ask(arguments), "").await.unwrap_err().code, ErrorCode::NotLocalised);
    }
    let json = site.ask(&ask("name=gym"), "").await.unwrap();
    assert_eq!(json["candidates"][0]["from_robot"], serde_json::Value::Null);
    let reply: WhereReply = serde_json::from_value(json).unwrap();
    assert!(reply.candidates[0].x_m > 1.0 && reply.candidates[0].goal.is_some(), "{reply:?}");
    for of_robot in ["nearest?name=gym", "what"] {
        let key = site.keys.ask("main", Ask::What).replace("what", of_robot);
        assert_eq!(site.ask(&key, "").await.unwrap_err().code, ErrorCode::NotLocalised, "{key}");
    }
    for other in [Ask::Graph, Ask::Labels, Ask::Grid, Ask::Regions] {
        site.ask(&site.keys.ask("main", other), "").await.unwrap();
    }
    site.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn what_was_said_is_mended_and_a_replay_mends_it_too() {
    let folder = Folder::new();
    let record = folder.0.join("record");
    let config = settings(&folder);
    let site = Site::start_recording(config.clone(), Some(&record)).await;
    let (acks, heard) = (site.acks("r1").await, site.listen(site.keys.heard("r1")).await);
    for message in &drive("r1", "main") {
        site.send(message).await;
    }
    acks.ack_of(81).await;
    for (id, text) in [("s1", "this is the jim"), ("s2", "this is the lounge"), ("s3", "this is the kitchen")]
    {
        site.send_json(&Message::Say(say(None, id, text, None))).await;
        heard.heard(id).await;
    }
    for (command, arguments, words) in [
        ("undo", "", "I took back: \"this is the kitchen\"."),
        ("undo", "id=s2;map=main", "I took back: \"this is the lounge\"."),
        ("rename", "from=jim;to=gym", "What was the jim is the gym now."),
    ] {
        let selector = format!("{}?{arguments}", site.keys.command(command));
        let mended: Mended = serde_json::from_value(site.ask(&selector, "").await.unwrap()).unwrap();
        assert_eq!((mended.words.as_str(), mended.durable), (words, true));
    }
    let nothing = site.ask(&format!("{}?name=attic", site.keys.command("forget")), "").await.unwrap_err();
    assert_eq!(nothing.code, ErrorCode::NothingToMend);
    let json = site.ask(&site.keys.ask("main", Ask::Labels), "").await.unwrap();
    let labels: LabelsReply = serde_json::from_value(json).unwrap();
    assert_eq!(labels.labels.iter().map(|l| l.label.as_str()).collect::<Vec<_>>(), ["gym"]);
    site.stop().await;

    let mut mapper = Mapper::new(config.mapper);
    for message in recorded(&record) {
        mapper.step(convert::event(message));
    }
    assert!(mapper.save().unwrap() == saved_map(&folder, "main"));
}

#[tokio::test(flavor = "multi_thread")]
async fn who_comes_late_gets_the_newest() {
    let folder = Folder::new();
    let site = mapped(&folder).await;
    let pose: PoseOut = serde_json::from_value(site.ask(&site.keys.pose("r1"), "").await.unwrap()).unwrap();
    assert_eq!((pose.robot.as_str(), pose.map.id.as_str()), ("r1", "main"));
    let graph: GraphReply =
        serde_json::from_value(site.ask(&site.keys.graph("main"), "").await.unwrap()).unwrap();
    let weight: f64 = graph.particles.iter().map(|p| p.weight).sum();
    assert!((weight + graph.unresolved - 1.0).abs() < 1e-6);
    assert_eq!(site.ask(&site.keys.ack("r1"), "").await.unwrap()["seq"], 81);
    let info: Info = serde_json::from_value(site.ask(&site.keys.info(), "").await.unwrap()).unwrap();
    assert_eq!((info.maps.len(), info.robots.len(), info.overrun), (1, 1, 0));
    let tokens = site.session.liveliness().get(site.keys.alive("*")).await.unwrap();
    assert!(tokens.recv_async().await.is_ok());
    // Who doesn't know the map's name asks all.
    let json = site.ask(&site.keys.ask("*", Ask::Labels), "").await.unwrap();
    assert_eq!(json["query"], "labels");
    site.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn every_wrong_question_gets_an_error() {
    let folder = Folder::new();
    let site = mapped(&folder).await;
    let keys = &site.keys;
    let wrong = [
        (keys.ask("attic", Ask::Labels), "", ErrorCode::NoSuchMap, "map"),
        (keys.ask("main", Ask::Where), "", ErrorCode::BadArgument, "name"),
        (keys.ask("main", Ask::Where), "{\"name\": ", ErrorCode::BadArgument, "payload"),
        (keys.ask("main", Ask::Where), "[1]", ErrorCode::BadArgument, "payload"),
        (keys.ask("main", Ask::Where) + "?name=%zz", "", ErrorCode::BadArgument, "selector"),
        (keys.ask("main", Ask::Where) + "?name=", "", ErrorCode::BadArgument, "name"),
        (keys.ask("main", Ask::Where) + "?nmae=gym", "", ErrorCode::BadArgument, "nmae"),
        (keys.ask("main", Ask::Where) + "?name=gym;robot=r9", "", ErrorCode::NoSuchRobot, "robot"),
        (keys.ask("main", Ask::Grid) + "?resolution_m=0", "", ErrorCode::BadArgument, "resolution_m"),
        (keys.command("explode"), "", ErrorCode::Unsupported, "key"),
        (keys.command("save") + "?map=attic", "", ErrorCode::NoSuchMap, "map"),
        (keys.command("undo") + "?map=attic", "", ErrorCode::NoSuchMap, "map"),
        (keys.command("rename") + "?from=gym", "", ErrorCode::BadArgument, "to"),
        (keys.command("forget") + "?name=", "", ErrorCode::BadArgument, "name"),
        ("toponym/v1/default/map/main/ask/why".into(), "", ErrorCode::NoSuchQuery, "key"),
        ("toponym/v1/default/nothing/*".into(), "", ErrorCode::NoSuchQuery, "key"),
    ];
    for (selector, payload, code, field) in wrong {
        let problem = site.ask(&selector, payload).await.unwrap_err();
        assert_eq!((problem.code, problem.field.as_deref()), (code, Some(field)), "{selector} {payload}");
        assert!(!problem.message.is_empty());
    }
    site.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn the_time_is_told_here_and_on_each_robots_clock() {
    let folder = Folder::new();
    let site = mapped(&folder).await;
    let reply = site.ask(&site.keys.time(), "").await.unwrap();
    let clocks: Clocks = serde_json::from_value(reply).unwrap();
    assert!(clocks.now.ns > 1_790_000_000_000_000_000);
    assert_eq!(clocks.robots.get("r1"), Some(&crate::site::header("r1", 81).stamp));
    site.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_key_that_would_take_for_ever_to_match_is_refused() {
    let folder = Folder::new();
    let site = mapped(&folder).await;
    let chunk = "$*a".repeat(30) + "b";
    let nasty = format!("toponym/v1/default/{chunk}");
    assert_eq!(site.ask(&nasty, "").await.unwrap_err().code, ErrorCode::BadArgument);
    site.ask(&site.keys.info(), "").await.unwrap();
    site.stop().await;
}
