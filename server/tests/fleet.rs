//! Two servers behind a Zenoh router with the settings in `deploy/fleet`: asked across both, and streamed to through it.
#![allow(clippy::unwrap_used)]

use std::path::{Path, PathBuf};
use std::time::Duration;
use toponym::{Connection, Guide, Planner, Robot, RobotConfig};
use toponym_proto::Clock;
use toponym_server::access::{Policy, Role, User};
use toponym_server::config::ServerConfig;
use toponym_server::serve::Server;
use toponym_sim::hall::message;
use zenoh::query::{ConsolidationMode, QueryTarget};

const PATIENCE: Duration = Duration::from_secs(60);

async fn server(folder: &Path, site: &str) -> (Server, PathBuf) {
    let data = folder.join(site);
    std::fs::create_dir_all(&data).unwrap();
    let router = User { role: Role::Trusted, robots: vec![], password: Some("change me".into()) };
    let policy = Policy { local: false, users: [("router".to_owned(), router)].into() };
    policy.write(&data.join("policy.toml")).unwrap();
    let config = ServerConfig {
        http: None,
        site: site.into(),
        listen: vec!["tcp/127.0.0.1:0".into()],
        data: data.clone(),
        ..ServerConfig::default()
    };
    (Server::start(config, None).await.unwrap(), data)
}

#[tokio::test(flavor = "multi_thread")]
async fn a_router_asks_all_buildings() {
    let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(format!("fleet-{}", std::process::id()));
    let (north, south) = (server(&folder, "north").await.0, server(&folder, "south").await.0);
    let endpoints: Vec<&str> = [&north, &south].iter().map(|s| s.endpoints()[0].as_str()).collect();

    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../deploy/fleet/router.json5");
    let mut settings = zenoh::Config::from_file(file).unwrap();
    let list = |endpoints: &[&str]| format!("{endpoints:?}");
    settings.insert_json5("connect/endpoints", &list(&endpoints)).unwrap();
    settings.insert_json5("listen/endpoints", &list(&["tcp/127.0.0.1:0"])).unwrap();
    let users = folder.join("router-users");
    std::fs::write(&users, "planner:word\n").unwrap();
    settings.insert_json5("transport/auth/usrpwd/dictionary_file", &format!("{users:?}")).unwrap();
    let router = zenoh::open(settings).await.unwrap();
    let mut to = Connection::to(router.info().locators().await[0].as_str());
    (to.user, to.password) = (Some("planner".into()), Some("word".into()));

    for (site, name) in [("north", "kitchen"), ("south", "gym")] {
        let session = to.open().await.unwrap();
        let config = RobotConfig { site: site.into(), clock: Clock::Log, boot: 1, ..RobotConfig::new("r1") };
        let mut robot = Robot::connect(&session, config).await.unwrap();
        for n in 0..40 {
            robot.send(message(n, "main", 61)).await.unwrap();
        }
        robot.settle().await.unwrap();
        let guide = Guide::connect(&session, site, Some("r1")).await.unwrap();
        guide.send(&guide.sentence(&format!("this is the {name}")), PATIENCE).await.unwrap();
        Planner::new(&session, site, "main", PATIENCE).unwrap().save().await.unwrap();
    }

    let planner = to.open().await.unwrap();
    let replies = planner
        .get("toponym/v1/*/map/*/ask/where?name=gym")
        .target(QueryTarget::All)
        .consolidation(ConsolidationMode::None)
        .timeout(PATIENCE)
        .await
        .unwrap();
    let mut answers = Vec::new();
    while let Ok(reply) = replies.recv_async().await {
        let sample = reply.into_result().unwrap();
        let answer: serde_json::Value = serde_json::from_slice(&sample.payload().to_bytes()).unwrap();
        answers.push((sample.key_expr().to_string(), answer["candidates"].as_array().unwrap().len()));
    }
    answers.sort();
    let of = |site: &str, found| (format!("toponym/v1/{site}/map/main/ask/where"), found);
    assert_eq!(answers, [of("north", 0), of("south", 1)]);
    for server in [north, south] {
        server.stop().await.unwrap();
    }
    std::fs::remove_dir_all(folder).unwrap();
}
