//! Robots that speak ROS 2, live.

use crate::site::{Folder, PATIENCE, Site, drive, settings};
use std::collections::BTreeMap;
use std::time::Duration;
use tokio::time::{interval, timeout};
use toponym_proto::answer::PoseOut;
use toponym_proto::{Message, Pose, Stamp};
use toponym_ros::bag::Bag;
use toponym_ros::cdr;
use toponym_ros::live::RosRobot as Settings;
use toponym_ros::msg::{
    Header, MarkerArray, OccupancyGrid, PoseStamped, PoseWithCovarianceStamped, Quaternion, StringMsg,
    TFMessage, Time, Transform, TransformStamped, TriggerResponse, Vector3, WhereRequest, WhereResponse,
};
use toponym_ros::plan::kind;
use toponym_ros::robot::{AsRos, Published};
use toponym_ros::wire::{Hashes, attached, attachment, key};
use toponym_tests::ros_robot::RosRobot;
use zenoh::query::QueryTarget;
use zenoh_ext::{AdvancedSubscriberBuilderExt, HistoryConfig};

/// The laser is turned by this about the upright axis.
const TURNED_RAD: f64 = 0.5;

fn transform(stamp: Stamp, parent: &str, child: &str, x: f64, yaw_rad: f64) -> TFMessage {
    let (z, w) = (0.5 * yaw_rad).sin_cos();
    let header = Header { stamp: Time::from(stamp.ns), frame_id: parent.into() };
    let transform = Transform {
        translation: Vector3 { x, ..Vector3::default() },
        rotation: Quaternion { x: 0.0, y: 0.0, z, w },
    };
    TFMessage { transforms: vec![TransformStamped { header, child_frame_id: child.into(), transform }] }
}

/// A message of a robot as a ROS robot sends it, its topics behind `space`, its laser turned.
async fn send(robot: &mut RosRobot, as_ros: &mut AsRos, space: &str, message: &Message) {
    let mut turned = message.clone();
    match &mut turned {
        Message::Setup(m) => m.lasers.iter_mut().for_each(|laser| laser.yaw_rad = TURNED_RAD),
        Message::Scan(m) => m.angle_min_rad -= TURNED_RAD,
        _ => {}
    }
    if let Some(Published { topic, kind, data }) = as_ros.of(&turned).unwrap() {
        robot.publish(&format!("{space}{topic}"), kind, data).await.unwrap();
    }
}

/// A robot, a server that maps for it, and the last stamp that the robot sent.
struct Scene {
    robot: RosRobot,
    site: Site,
    last: Stamp,
    folder: Folder,
}

fn hash(kind: &str) -> String {
    Hashes::OfTypes.of(kind)
}

/// The drive through the hall, sent by a robot in this namespace and domain; the mounting before the server was there.
async fn scene(space: &str, domain: u32, hashes: Hashes) -> Scene {
    let folder = Folder::new();
    let mut robot = RosRobot::start("tcp/127.0.0.1:0", domain, space, hashes).await.unwrap();
    let (drive, mut as_ros) = (drive("r1", "main"), AsRos::default());
    send(&mut robot, &mut as_ros, space, &drive[0]).await;
    let mut config = settings(&folder);
    config.mcap = Some(folder.0.join("tour.mcap"));
    config.ros.push(Settings {
        robot: "r1".into(),
        endpoint: robot.endpoint().into(),
        namespace: space.into(),
        domain,
        map_update_interval_s: 0.1,
        ..Settings::default()
    });
    let site = Site::start(config).await;
    timeout(PATIENCE, robot.wait_for_toponym()).await.unwrap().unwrap();
    for message in &drive[1..] {
        send(&mut robot, &mut as_ros, space, message).await;
    }
    let last = Stamp { ns: drive[80].header().unwrap().stamp.ns };
    Scene { robot, site, last, folder }
}

impl Scene {
    /// Goes on sending where it stands, as a robot does, until something is so.
    async fn until<T>(&mut self, space: &str, mut so: impl AsyncFnMut(&Site) -> Option<T>) -> T {
        let mut ticks = interval(Duration::from_millis(50));
        let wait = async {
            loop {
                if let Some(found) = so(&self.site).await {
                    return found;
                }
                ticks.tick().await;
                self.last.ns += 50_000_000;
                let pose = transform(self.last, "odom", "base_link", 9.3, 0.0);
                self.robot.write(&format!("{space}/tf"), kind::TF, &pose).await.unwrap();
            }
        };
        timeout(PATIENCE, wait).await.expect("it never became so")
    }

    /// The server's newest pose of the robot.
    async fn pose(site: &Site) -> Option<PoseOut> {
        let pose = site.ask(&site.keys.pose("r1"), "").await.ok()?;
        serde_json::from_value(pose).ok()
    }

    /// Stops both; what the server has written of it, by topic.
    async fn stop(self) -> BTreeMap<String, usize> {
        self.robot.stop().await.unwrap();
        self.site.stop().await;
        let mut bag = Bag::open(&self.folder.0.join("tour.mcap")).unwrap();
        let mut count = BTreeMap::new();
        while let Some(raw) = bag.next() {
            *count.entry(bag.topics()[raw.topic].name.clone()).or_default() += 1;
        }
        count
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_ros_robot_is_mapped_and_told_where_it_is() {
    for (space, domain, hashes) in
        [("", 0, Hashes::OfTypes), ("/r1", 7, Hashes::OfTypes), ("", 0, Hashes::None)]
    {
        let mut scene = scene(space, domain, hashes).await;
        let transforms = scene.robot.transforms(&format!("{space}/tf")).await.unwrap();
        // All 40 scans are in the map, where they were made.
        let pose = scene
            .until(space, async |site| Scene::pose(site).await.filter(|p| p.stamp.ns >= 5_000_000_000))
            .await;
        let Pose { x_m, y_m, yaw_rad } = pose.map_from_body;
        assert!((x_m - 7.8).abs() < 0.05 && y_m.abs() < 0.05 && yaw_rad.abs() < 0.01, "{pose:?}");
        let info: toponym_proto::answer::Info =
            serde_json::from_value(scene.site.ask(&scene.site.keys.info(), "").await.unwrap()).unwrap();
        let counts = info.robots[0].counts;
        assert!(counts.taken >= 81 && counts.lost + counts.refused + counts.unused == 0, "{counts:?}");
        // Its navigation finds its way from the map to its body at the newest stamp.
        // What was told before it had come to a stand is another's correction.
        let stamp_ns = scene.last.ns + 1_000_000_000;
        scene
            .until(space, async |site| {
                let told = Scene::pose(site).await?.map_from_odom;
                let [x_m, y_m, yaw_rad] = transforms.newest("map", "odom")?;
                let off = (x_m - told.x_m).abs() + (y_m - told.y_m).abs() + (yaw_rad - told.yaw_rad).abs();
                (off < 1e-6 && transforms.look_up("map", "odom", stamp_ns).is_some()).then_some(())
            })
            .await;
        assert!(scene.stop().await["/tf"] >= 40, "each pose is written");
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn whoever_comes_late_sees_map_and_markers() {
    let mut scene = scene("", 0, Hashes::OfTypes).await;
    scene.until("", async |site| Scene::pose(site).await).await;
    let mut latched = Vec::new();
    for (topic, of) in [("/map", kind::GRID), ("/toponym/markers", kind::MARKERS)] {
        let subscriber = scene.robot.node.declare_subscriber(key(0, topic, of, &hash(of)));
        let history = HistoryConfig::default().detect_late_publishers().max_samples(1);
        latched.push(subscriber.history(history).subscriber_detection().await.unwrap());
    }
    let grid = scene
        .until("", async |_| {
            let sample = latched[0].try_recv().ok().flatten()?;
            assert!(attached(&sample.attachment().unwrap().to_bytes()).is_some());
            Some(cdr::read::<OccupancyGrid>(&sample.payload().to_bytes()).unwrap())
        })
        .await;
    assert_eq!(
        (grid.header.frame_id.as_str(), grid.data.len()),
        ("map", (grid.info.width * grid.info.height) as usize)
    );
    assert!(grid.data.contains(&0) && grid.data.contains(&-1) && grid.data.iter().any(|c| *c > 65));
    let marked = scene
        .until("", async |_| {
            let sample = latched[1].try_recv().ok().flatten()?;
            Some(cdr::read::<MarkerArray>(&sample.payload().to_bytes()).unwrap())
        })
        .await;
    assert_eq!(marked.markers[0].action, 3, "those before are taken away");
    assert!(marked.markers.iter().any(|m| m.ns == "places" && !m.points.is_empty()));
    scene.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn what_is_said_and_asked_by_ros_is_heard_and_answered() {
    let mut scene = scene("", 0, Hashes::OfTypes).await;
    scene.until("", async |site| Scene::pose(site).await.filter(|p| p.stamp.ns >= 5_000_000_000)).await;
    let text = |topic: &str| key(0, topic, kind::TEXT, &hash(kind::TEXT));
    let heard = scene.robot.node.declare_subscriber(text("/toponym/heard")).await.unwrap();
    let goals = scene
        .robot
        .node
        .declare_subscriber(key(0, "/goal_pose", kind::POSE, &hash(kind::POSE)))
        .await
        .unwrap();
    let say = toponym_proto::Say { text: "this is the gym".into(), ..toponym_proto::Say::default() };
    send(&mut scene.robot, &mut AsRos::default(), "", &Message::Say(say)).await;
    scene.until("", async |_| heard.try_recv().ok().flatten()).await;
    // By a type of our own.
    let service = key(0, "/toponym/where_is", kind::WHERE, &hash(kind::WHERE));
    let request = cdr::write(&WhereRequest { name: "gym".into(), robot: String::new() }).unwrap();
    let replies = scene
        .robot
        .node
        .get(service)
        .payload(request)
        .attachment(&attachment(41, 5, &[9; 16])[..])
        .target(QueryTarget::AllComplete)
        .await
        .unwrap();
    let reply = timeout(PATIENCE, replies.recv_async()).await.unwrap().unwrap();
    let sample = reply.result().unwrap();
    assert_eq!(
        attached(&sample.attachment().unwrap().to_bytes()),
        Some((41, [9; 16])),
        "its client knows it by these"
    );
    let response: WhereResponse = cdr::read(&sample.payload().to_bytes()).unwrap();
    assert!(response.found && response.probability > 0.8 && response.message.contains("gym"), "{response:?}");
    assert_eq!(response.pose.header.frame_id, "map");
    // Without: what was asked for last.
    let service = key(0, "/toponym/where", kind::TRIGGER, &hash(kind::TRIGGER));
    let replies = scene
        .robot
        .node
        .get(service)
        .payload(vec![0, 1, 0, 0, 0])
        .attachment(&attachment(1, 5, &[9; 16])[..])
        .target(QueryTarget::AllComplete)
        .await
        .unwrap();
    let reply = timeout(PATIENCE, replies.recv_async()).await.unwrap().unwrap();
    let response: TriggerResponse = cdr::read(&reply.result().unwrap().payload().to_bytes()).unwrap();
    assert!(response.success && response.message.contains("gym"), "{response:?}");
    // And by topics alone.
    scene.robot.write("/toponym/go", kind::TEXT, &StringMsg { data: "gym".into() }).await.unwrap();
    let goal = timeout(PATIENCE, goals.recv_async()).await.unwrap().unwrap();
    let goal: PoseStamped = cdr::read(&goal.payload().to_bytes()).unwrap();
    assert_eq!(goal.header.frame_id, "map");
    // Where it is, as RViz tells it.
    let answers = scene.robot.node.declare_subscriber(text("/toponym/answer")).await.unwrap();
    let mut told = PoseWithCovarianceStamped::default();
    told.header.frame_id = "map".into();
    (told.pose.pose.position.x, told.pose.pose.orientation.w) = (7.8, 1.0);
    scene.robot.write("/initialpose", kind::POSE_WITH_COVARIANCE, &told).await.unwrap();
    // Where it is sent may be told as late.
    let mut data = "r1 is sent to gym".to_owned();
    while data.starts_with("r1 is sent to gym") {
        let answer = timeout(PATIENCE, answers.recv_async()).await.unwrap().unwrap();
        StringMsg { data } = cdr::read(&answer.payload().to_bytes()).unwrap();
    }
    assert!(data.starts_with("The map has the robot ") && data.ends_with("too."), "{data}");
    scene.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn who_tells_map_to_odom_already_is_not_talked_over() {
    let mut scene = scene("", 0, Hashes::OfTypes).await;
    let transforms = scene.robot.transforms("/tf").await.unwrap();
    let stamp_ns = scene.last.ns + 1_000_000_000;
    scene.until("", async |_| transforms.look_up("map", "odom", stamp_ns)).await;
    // Another speaks all the time: after a while ours does not.
    let mut ticks = interval(Duration::from_millis(50));
    let silent = async {
        let mut same = 0;
        while same < 10 {
            ticks.tick().await;
            let before = transforms.periods_s().len();
            let other = transform(scene.last, "map", "odom", 0.0, 0.0);
            scene.robot.write("/tf", kind::TF, &other).await.unwrap();
            ticks.tick().await;
            let heard = transforms.periods_s().len() - before;
            same = if heard <= 1 { same + 1 } else { 0 };
        }
    };
    timeout(PATIENCE, silent).await.expect("both speak");
    scene.stop().await;
}
