//! The client library's roles against the real server.

use crate::site::{Folder, PATIENCE, Site, drive, saved_map, settings};
use std::time::Duration;
use toponym::{Guide, Planner, Robot, RobotConfig};
use toponym_proto::answer::{ErrorCode, HeardStatus};
use toponym_server::serve::Server;

fn robot_config() -> RobotConfig {
    let resend_after = Duration::from_millis(300);
    RobotConfig { boot: 1, clock: toponym_proto::Clock::Log, resend_after, ..RobotConfig::new("r1") }
}

#[tokio::test(flavor = "multi_thread")]
async fn robot_guide_and_planner_work_together() {
    let folder = Folder::new();
    let site = Site::start(settings(&folder)).await;
    let session = toponym::open(&site.server.endpoints()[0]).await.unwrap();
    let mut robot = Robot::connect(&session, robot_config()).await.unwrap();
    let stream = drive("r1", "main");
    for message in stream.iter().take(81) {
        robot.send(message.clone()).await.unwrap();
    }
    robot.settle().await.unwrap();
    let guide = Guide::connect(&session, "default", None).await.unwrap();
    let heard = guide.say("this is the gym", PATIENCE).await.unwrap();
    assert_eq!(heard.status, HeardStatus::Understood);
    let planner = Planner::new(&session, "default", "main", PATIENCE).unwrap();
    let answer = planner.where_is("gym").await.unwrap();
    assert_eq!(answer.candidates[0].because, [heard.id]);
    assert!(planner.where_is("harbour").await.unwrap().candidates.is_empty());
    site.stop().await;
}

/// The server is stopped and started again while a robot drives: the map is the one of a drive
/// without a stop.
#[tokio::test(flavor = "multi_thread")]
async fn a_restart_of_the_server_loses_nothing() {
    let (folder, whole) = (Folder::new(), Folder::new());
    let stream = drive("r1", "main");
    for (folder, stops) in [(&folder, true), (&whole, false)] {
        let mut config = settings(folder);
        // The robot sends again what is missing, however long this machine takes over it.
        config.gap_wait_s = 60.0;
        let running = Server::start(config.clone(), None).await.unwrap();
        config.listen = running.endpoints().to_vec();
        let mut server = Some(running);
        let session = toponym::open(&config.listen[0]).await.unwrap();
        let mut robot = Robot::connect(&session, robot_config()).await.unwrap();
        for (k, message) in stream.iter().enumerate() {
            match server.take() {
                Some(running) if stops && k == 30 => running.stop().await.unwrap(),
                None if k == 50 => server = Some(Server::start(config.clone(), None).await.unwrap()),
                unchanged => server = unchanged,
            }
            robot.send(message.clone()).await.unwrap();
        }
        robot.settle().await.unwrap();
        assert_eq!(robot.acked().unwrap().lost, 0);
        Planner::new(&session, "default", "main", PATIENCE).unwrap().save().await.unwrap();
        server.unwrap().stop().await.unwrap();
    }
    assert!(saved_map(&folder, "main") == saved_map(&whole, "main"));
}

#[tokio::test(flavor = "multi_thread")]
async fn strangers_do_not_crowd_out_a_robot() {
    let folder = Folder::new();
    let mut config = settings(&folder);
    config.limits.robots = 1;
    let site = Site::start(config).await;
    let (states, acks) = (site.states("*").await, site.acks("r1").await);
    site.put(&site.keys.odom("stranger"), "", b"hello".to_vec()).await;
    states.state(|s| s.robot == "stranger").await;
    site.send(&drive("r1", "main")[0]).await;
    acks.ack_of(0).await;
    // Now there is no room for others any more, and the robot stays.
    site.put(&site.keys.odom("stranger"), "", b"hello".to_vec()).await;
    site.send(&drive("r1", "main")[1]).await;
    acks.ack_of(1).await;
    assert_eq!(site.ask(&site.keys.state("stranger"), "").await.unwrap_err().code, ErrorCode::NoSuchQuery);
    site.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn strangers_with_gaps_do_not_keep_a_robot_out() {
    let folder = Folder::new();
    let mut config = settings(&folder);
    (config.limits.robots, config.join_wait_s) = (4, 60.0);
    let site = Site::start(config).await;
    let acks = site.acks("r1").await;
    // What comes before their first message never comes.
    for k in 0..9 {
        site.send(&crate::site::odom(&format!("stranger{k}"), 5, 0.0)).await;
    }
    for message in drive("r1", "main").iter().take(5) {
        site.send(message).await;
    }
    acks.ack_of(4).await;
    site.stop().await;
}
