//! The roles against a router of the test's own, which answers as a server would.

use crate::session::ask;
use crate::{ClientError, Form, Guide, Planner, Robot, RobotConfig, open};
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;
use tokio::sync::mpsc::{UnboundedReceiver, unbounded_channel};
use toponym_proto::answer::{Ack, ErrorCode, ErrorReply, Heard, HeardStatus, Problem, RobotState};
use toponym_proto::stream::Laser;
use toponym_proto::{Header, Keys, Limits, Message, Pose, Scan, Setup, Stamp};
use zenoh::sample::Sample;
use zenoh::{Session, Wait};

const LONG: Duration = Duration::from_secs(20);

/// A router on a free port, and where it listens.
async fn router() -> (Session, String) {
    let mut config = zenoh::Config::default();
    for (key, value) in [
        ("mode", "\"router\""),
        ("listen/endpoints", "[\"tcp/127.0.0.1:0\"]"),
        ("scouting/multicast/enabled", "false"),
        ("scouting/gossip/enabled", "false"),
        ("scouting/delay", "0"),
    ] {
        config.insert_json5(key, value).unwrap();
    }
    let session = zenoh::open(config).await.unwrap();
    let locator = session.info().locators().await.first().unwrap().to_string();
    (session, locator)
}

fn keys() -> Keys {
    Keys::new("default").unwrap()
}

async fn arrivals(router: &Session, key: String) -> UnboundedReceiver<Sample> {
    let (sender, receiver) = unbounded_channel();
    let deliver = move |sample| drop(sender.send(sample));
    router.declare_subscriber(key).callback(deliver).background().await.unwrap();
    receiver
}

async fn put<T: serde::Serialize>(router: &Session, key: String, value: &T) {
    router.put(key, serde_json::to_vec(value).unwrap()).await.unwrap();
}

fn ack(boot: u64, seq: u64) -> Ack {
    Ack { v: 1, robot: "r07".into(), boot, seq, lost: 0 }
}

fn setup() -> Setup {
    let laser = Laser {
        id: "front".into(),
        x_m: 0.0,
        y_m: 0.0,
        yaw_rad: 0.0,
        upside_down: false,
        range_min_m: 0.1,
        range_max_m: 30.0,
        ignored_rad: Vec::new(),
    };
    Setup { header: Header::default(), map: "main".into(), lasers: vec![laser] }
}

fn scan() -> Scan {
    Scan {
        header: Header { stamp: Stamp { ns: 7 }, ..Header::default() },
        laser: "front".into(),
        angle_min_rad: -1.0,
        angle_increment_rad: 0.1,
        time_increment_s: 0.0,
        ranges_m: vec![1.0, f32::INFINITY],
    }
}

fn config(form: Form) -> RobotConfig {
    RobotConfig { form, boot: 3, ..RobotConfig::new("r07") }
}

fn decoded(sample: &Sample) -> Message {
    let (robot, input) = keys().input(sample.key_expr()).unwrap();
    assert_eq!(robot, "r07");
    let encoding = sample.encoding().to_string();
    Message::decode(&input, &encoding, &sample.payload().to_bytes(), &Limits::default()).unwrap()
}

#[tokio::test(flavor = "multi_thread")]
async fn nobody_listening_is_no_server_and_nonsense_is_invalid() {
    let (router, locator) = router().await;
    router.close().await.unwrap();
    let error = open(&locator).await.unwrap_err();
    assert!(matches!(&error, ClientError::NoServer { endpoint, .. } if *endpoint == locator), "{error}");
    assert!(matches!(open("nonsense").await.unwrap_err(), ClientError::Invalid(_)));
}

#[tokio::test(flavor = "multi_thread")]
async fn a_robots_streams_share_one_counter_and_settle_when_acknowledged() {
    let (router, locator) = router().await;
    for form in [Form::Bincode, Form::Json] {
        let mut arrivals = arrivals(&router, keys().all_inputs()).await;
        let session = open(&locator).await.unwrap();
        let mut robot = Robot::connect(&session, config(form)).await.unwrap();
        robot.setup(setup()).await.unwrap();
        robot.odom(Stamp { ns: 5 }, Pose::default()).await.unwrap();
        robot.scan(scan()).await.unwrap();
        assert_eq!(robot.end(Stamp { ns: 9 }).await.unwrap(), 3);
        assert_eq!(robot.in_flight(), 4);
        for seq in 0..4 {
            let message = decoded(&arrivals.recv().await.unwrap());
            let header = message.header().unwrap();
            assert_eq!((header.seq, header.boot, header.robot.as_str()), (seq, 3, "r07"));
            if let Message::Scan(got) = &message {
                assert_eq!(got.ranges_m, scan().ranges_m);
            }
        }
        // Another boot's watermark says nothing of this one.
        put(&router, keys().ack("r07"), &ack(2, 99)).await;
        put(&router, keys().ack("r07"), &ack(3, 3)).await;
        robot.settle().await.unwrap();
        assert_eq!((robot.in_flight(), robot.acked().unwrap().seq), (0, 3));
        session.close().await.unwrap();
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn what_is_above_the_watermark_is_sent_again() {
    let (router, locator) = router().await;
    let mut arrivals = arrivals(&router, keys().all_inputs()).await;
    let session = open(&locator).await.unwrap();
    let config = RobotConfig { resend_after: Duration::from_millis(20), ..config(Form::Bincode) };
    let mut robot = Robot::connect(&session, config).await.unwrap();
    robot.setup(setup()).await.unwrap();
    robot.odom(Stamp { ns: 5 }, Pose::default()).await.unwrap();
    let server = tokio::spawn(async move {
        let mut seen = Vec::new();
        put(&router, keys().ack("r07"), &ack(3, 0)).await;
        // The odometry "got lost": it is acknowledged the second time.
        while seen.iter().filter(|seq| **seq == 1).count() < 2 {
            seen.push(decoded(&arrivals.recv().await.unwrap()).header().unwrap().seq);
        }
        put(&router, keys().ack("r07"), &ack(3, 1)).await;
        router
    });
    robot.settle().await.unwrap();
    server.await.unwrap();
}

#[tokio::test(flavor = "multi_thread")]
async fn sending_waits_while_too_much_is_in_flight_but_not_forever() {
    let (router, locator) = router().await;
    let mut arrivals = arrivals(&router, keys().all_inputs()).await;
    let session = open(&locator).await.unwrap();
    let patience = Duration::from_millis(300);
    let config = RobotConfig { in_flight_max: 2, patience, ..config(Form::Bincode) };
    let mut robot = Robot::connect(&session, config).await.unwrap();
    robot.setup(setup()).await.unwrap();
    robot.odom(Stamp { ns: 5 }, Pose::default()).await.unwrap();
    let third = robot.odom(Stamp { ns: 6 }, Pose::default()).await.unwrap_err();
    assert!(matches!(third, ClientError::Timeout { .. }), "{third}");
    for _ in 0..2 {
        arrivals.recv().await.unwrap();
    }
    put(&router, keys().ack("r07"), &ack(3, 0)).await;
    assert_eq!(robot.odom(Stamp { ns: 6 }, Pose::default()).await.unwrap(), 2);
    assert_eq!(robot.in_flight(), 2);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_robot_that_is_refused_is_told_why() {
    let (router, locator) = router().await;
    let mut arrivals = arrivals(&router, keys().all_inputs()).await;
    let session = open(&locator).await.unwrap();
    let mut robot = Robot::connect(&session, config(Form::Bincode)).await.unwrap();
    robot.setup(setup()).await.unwrap();
    arrivals.recv().await.unwrap();
    let error = Some(Problem::new(ErrorCode::MapTaken, "it is r08's"));
    let state = RobotState { v: 1, robot: "r07".into(), boot: Some(3), error, ..RobotState::default() };
    put(&router, keys().state("r07"), &state).await;
    let error = robot.settle().await.unwrap_err();
    assert!(matches!(&error, ClientError::Refused(p) if p.code == ErrorCode::MapTaken), "{error}");
}

#[tokio::test(flavor = "multi_thread")]
async fn what_the_protocol_refuses_is_not_sent_and_takes_no_number() {
    let (_router, locator) = router().await;
    let session = open(&locator).await.unwrap();
    let mut robot = Robot::connect(&session, config(Form::Bincode)).await.unwrap();
    let far = Pose { x_m: f64::NAN, ..Pose::default() };
    assert!(matches!(robot.odom(Stamp::default(), far).await, Err(ClientError::Invalid(_))));
    assert!(matches!(
        robot.send(Message::Say(toponym_proto::Say::default())).await,
        Err(ClientError::Invalid(_))
    ));
    assert_eq!(robot.setup(setup()).await.unwrap(), 0);
}

fn heard(id: &str, status: HeardStatus, error: Option<Problem>) -> Heard {
    Heard {
        id: id.into(),
        status,
        durable: false,
        parse: String::new(),
        grounded: Vec::new(),
        words: "I heard".into(),
        question: None,
        error,
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_guide_hears_what_became_of_the_own_sentence() {
    let (router, locator) = router().await;
    let mut arrivals = arrivals(&router, keys().say(Some("*"))).await;
    let session = open(&locator).await.unwrap();
    let guide = Guide::connect(&session, "default", None).await.unwrap();
    let server = tokio::spawn(async move {
        let problem = Problem::new(ErrorCode::NoSuchRobot, "no robot");
        for (status, error) in [(HeardStatus::Understood, None), (HeardStatus::Refused, Some(problem))] {
            let sample = arrivals.recv().await.unwrap();
            assert_eq!(sample.key_expr().as_str(), keys().say(None));
            let say: toponym_proto::Say = serde_json::from_slice(&sample.payload().to_bytes()).unwrap();
            put(&router, keys().heard("r07"), &heard("another", HeardStatus::NotUnderstood, None)).await;
            put(&router, keys().heard("r07"), &heard(&say.id, status, error)).await;
        }
        router
    });
    assert_eq!(guide.say("this is the gym", LONG).await.unwrap().status, HeardStatus::Understood);
    let refused = guide.say("this is the gym", LONG).await.unwrap_err();
    assert!(matches!(&refused, ClientError::Refused(p) if p.code == ErrorCode::NoSuchRobot), "{refused}");
    let _router = server.await.unwrap();
    let late = guide.say("this is the gym", Duration::from_millis(50)).await.unwrap_err();
    assert!(matches!(late, ClientError::Timeout { .. }), "{late}");
    assert!(matches!(guide.say(" ", LONG).await, Err(ClientError::Invalid(_))));
}

#[tokio::test(flavor = "multi_thread")]
async fn a_planner_asks_again_while_the_server_is_busy_and_tells_refusals() {
    let (router, locator) = router().await;
    let asked = AtomicU64::new(0);
    let reply = move |query: zenoh::query::Query| {
        let n = asked.fetch_add(1, Ordering::SeqCst);
        assert_eq!(query.parameters().as_str(), "name=lecture%20hall");
        let code = if n == 0 { ErrorCode::Busy } else { ErrorCode::NoSuchMap };
        let error = ErrorReply { error: Problem::new(code, "sorry") };
        query.reply_err(serde_json::to_vec(&error).unwrap()).wait().unwrap();
    };
    router
        .declare_queryable("toponym/v1/default/map/main/ask/where")
        .callback(reply)
        .background()
        .await
        .unwrap();
    let session = open(&locator).await.unwrap();
    let planner = Planner::new(&session, "default", "main", LONG).unwrap();
    let error = planner.where_is("lecture hall").await.unwrap_err();
    assert!(matches!(&error, ClientError::Refused(p) if p.code == ErrorCode::NoSuchMap), "{error}");
}

#[tokio::test(flavor = "multi_thread")]
async fn a_question_nobody_answers_ends() {
    let (router, locator) = router().await;
    // Declared before the session opens: it may not hear of it in time otherwise.
    let (sender, _held) = unbounded_channel();
    let hold = move |query: zenoh::query::Query| drop(sender.send(query));
    router.declare_queryable("held").callback(hold).background().await.unwrap();
    let session = open(&locator).await.unwrap();
    let short = Duration::from_millis(200);
    // That nobody is there is known at once, and later where the machine is busy.
    let planner = Planner::new(&session, "elsewhere", "main", LONG).unwrap();
    let nobody = planner.labels().await.unwrap_err();
    assert!(matches!(nobody, ClientError::NoServer { .. }), "{nobody}");
    let late = ask::<Ack>(&session, "held", "", short).await.unwrap_err();
    assert!(matches!(late, ClientError::Timeout { .. }), "{late}");
}
