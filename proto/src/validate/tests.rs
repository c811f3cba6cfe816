use super::*;
use crate::stream::{Hearing, Odom};

fn header() -> Header {
    Header { robot: "r07".into(), ..Default::default() }
}

fn laser() -> Laser {
    Laser {
        id: "front".into(),
        x_m: 0.1,
        y_m: 0.0,
        yaw_rad: 0.0,
        upside_down: false,
        range_min_m: 0.02,
        range_max_m: 30.0,
        ignored_rad: vec![(-0.1, 0.1)],
    }
}

fn setup() -> Setup {
    Setup { header: header(), map: "main".into(), lasers: vec![laser()] }
}

fn scan() -> Scan {
    Scan {
        header: header(),
        laser: "front".into(),
        angle_min_rad: -1.5,
        angle_increment_rad: -0.01,
        time_increment_s: 0.0,
        ranges_m: vec![f32::NAN, f32::INFINITY, 1.0],
    }
}

fn say() -> Say {
    Say { id: "01ABC".into(), text: "this is the gym".into(), ..Default::default() }
}

fn refused(message: &Message) -> String {
    message.validate(&Limits::default()).unwrap_err().field
}

#[test]
fn good_messages_pass() {
    let odom = Odom { header: header(), odom_from_body: Pose::default() };
    for m in [Message::Setup(setup()), Message::Scan(scan()), Message::Say(say()), Message::Odom(odom)] {
        m.validate(&Limits::default()).unwrap();
    }
}

#[test]
fn a_bad_header_is_named() {
    let odom = |header| Message::Odom(Odom { header, odom_from_body: Pose::default() });
    assert_eq!(refused(&odom(Header { robot: "R7".into(), ..header() })), "robot");
    assert_eq!(refused(&odom(Header { robot: ANY_ROBOT.into(), ..header() })), "robot");
    assert_eq!(refused(&odom(Header { boot: (1 << 53) - 1, ..header() })), "boot");
    assert_eq!(refused(&odom(Header { seq: (1 << 46) + 1, ..header() })), "seq");
}

#[test]
fn a_bad_pose_is_named() {
    for (x_m, yaw_rad, field) in [
        (f64::NAN, 0.0, "odom_from_body.x_m"),
        (2e6, 0.0, "odom_from_body.x_m"),
        (0.0, f64::INFINITY, "odom_from_body.yaw_rad"),
    ] {
        let odom_from_body = Pose { x_m, y_m: 0.0, yaw_rad };
        assert_eq!(refused(&Message::Odom(Odom { header: header(), odom_from_body })), field);
    }
}

#[test]
fn a_bad_setup_is_named() {
    let with = |change: &dyn Fn(&mut Setup)| {
        let mut s = setup();
        change(&mut s);
        refused(&Message::Setup(s))
    };
    assert_eq!(with(&|s| s.map = "A b".into()), "map");
    assert_eq!(with(&|s| s.lasers.clear()), "lasers");
    assert_eq!(with(&|s| s.lasers = vec![laser(); 9]), "lasers");
    assert_eq!(with(&|s| s.lasers = vec![laser(); 2]), "lasers[1].id");
    assert_eq!(with(&|s| s.lasers[0].range_max_m = 0.01), "lasers[0].range_max_m");
    assert_eq!(with(&|s| s.lasers[0].range_min_m = f64::NAN), "lasers[0].range_min_m");
    assert_eq!(with(&|s| s.lasers[0].x_m = 500.0), "lasers[0].x_m");
    assert_eq!(with(&|s| s.lasers[0].ignored_rad = vec![(0.2, 0.1)]), "lasers[0].ignored_rad");
}

#[test]
fn a_bad_scan_is_named() {
    let with = |change: &dyn Fn(&mut Scan)| {
        let mut s = scan();
        change(&mut s);
        refused(&Message::Scan(s))
    };
    assert_eq!(with(&|s| s.laser = String::new()), "laser");
    assert_eq!(with(&|s| s.angle_increment_rad = 0.0), "angle_increment_rad");
    assert_eq!(with(&|s| s.angle_min_rad = f64::NAN), "angle_min_rad");
    assert_eq!(with(&|s| s.time_increment_s = -1.0), "time_increment_s");
    assert_eq!(with(&|s| s.ranges_m = vec![1.0; 8193]), "ranges_m");
}

#[test]
fn a_bad_sentence_is_named() {
    let with = |change: &dyn Fn(&mut Say)| {
        let mut s = say();
        change(&mut s);
        refused(&Message::Say(s))
    };
    assert_eq!(with(&|s| s.id = String::new()), "id");
    assert_eq!(with(&|s| s.text = "  ".into()), "text");
    assert_eq!(with(&|s| s.text = "a".repeat(1001)), "text");
    assert_eq!(with(&|s| s.speaker = Some("a\nb".into())), "speaker");
    let hearing = |p| vec![Hearing { text: "gem".into(), p }];
    assert_eq!(with(&|s| s.alternatives = hearing(1.5)), "alternatives[0].p");
    assert_eq!(with(&|s| (s.began, s.ended) = (Some(Stamp { ns: 2 }), Some(Stamp { ns: 1 }))), "ended");
}

#[test]
fn times_whose_difference_would_overflow_are_named() {
    let odom = |ns| {
        let header = Header { stamp: Stamp { ns }, ..header() };
        Message::Odom(Odom { header, odom_from_body: Pose::default() })
    };
    for ns in [i64::MIN, i64::MAX, STAMP_MAX_NS + 1, -STAMP_MAX_NS - 1] {
        let stamp = Some(Stamp { ns });
        assert_eq!(refused(&odom(ns)), "stamp");
        assert_eq!(refused(&Message::Say(Say { began: stamp, ..say() })), "began");
        assert_eq!(refused(&Message::Say(Say { ended: stamp, ..say() })), "ended");
    }
    for ago_s in [-1.0, f64::NAN, f64::INFINITY, 1e9] {
        assert_eq!(refused(&Message::Say(Say { ago_s: Some(ago_s), ..say() })), "ago_s");
    }
    for ns in [STAMP_MAX_NS, -STAMP_MAX_NS] {
        odom(ns).validate(&Limits::default()).unwrap();
    }
}
