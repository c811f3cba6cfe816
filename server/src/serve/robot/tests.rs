use super::*;
use crate::fold::Card;
use std::sync::mpsc::{Receiver, sync_channel};
use toponym_core::Mapper;
use toponym_proto::{Header, Odom, Pose, Stamp};

const START: Duration = Duration::from_secs(100);

fn map(id: &str) -> (Arc<MapView>, Receiver<Work>) {
    let (work, queue) = sync_channel(100);
    let mapper = Mapper::new(ServerConfig::default().mapper);
    let card = Card { uuid: "u".into(), robot: "r1".into(), ..Card::default() };
    (Arc::new(MapView::new(id, &card, None, mapper.snapshot(), work)), queue)
}

fn header(seq: u64) -> Header {
    Header { robot: "r1".into(), boot: 1, seq, ..Header::default() }
}

fn setup(seq: u64, map: &str) -> Message {
    Message::Setup(Setup { header: header(seq), map: map.into(), lasers: vec![] })
}

fn odom(seq: u64) -> Message {
    Message::Odom(Odom { header: header(seq), odom_from_body: Pose::default() })
}

fn robot() -> Robot {
    Robot::new("r1", &ServerConfig::default(), None)
}

/// What a map was handed is on disk now.
fn write_down(map: &MapView, queue: &Receiver<Work>) -> usize {
    let mut taken = 0;
    for work in queue.try_iter() {
        if let Work::Take(event) = work {
            let at = toponym_journal::Entry { at_ns: 0, event }.watermark();
            *lock(&map.durable) = at;
            taken += 1;
        }
    }
    taken
}

#[test]
fn nothing_is_acknowledged_before_it_is_on_disk() {
    let (view, queue) = map("main");
    let mut robot = robot();
    for message in [setup(0, "main"), odom(1)] {
        robot.push(START, message);
    }
    let mut find = |_: &Setup| Ok(view.clone());
    robot.advance(START, false, &mut find);
    assert_eq!((robot.ack(), robot.is_settled()), (None, false));
    assert_eq!(write_down(&view, &queue), 2);
    robot.advance(START, false, &mut find);
    assert_eq!((robot.ack().unwrap().seq, robot.is_settled()), (1, true));
}

#[test]
fn a_stop_leaves_what_is_behind_a_gap_to_be_sent_again() {
    let (view, queue) = map("main");
    let mut robot = robot();
    for message in [setup(0, "main"), odom(1), odom(3)] {
        robot.push(START, message);
    }
    robot.advance(START, true, &mut |_| Ok(view.clone()));
    assert_eq!(write_down(&view, &queue), 2);
    robot.advance(START, true, &mut |_| Ok(view.clone()));
    let ack = robot.ack().unwrap();
    assert_eq!((ack.seq, ack.lost), (1, 0));
    assert!(robot.is_settled());
}

#[test]
fn a_robot_leaves_a_map_that_has_ended() {
    let ((old, _queue), (new, taken)) = (map("old"), map("new"));
    let mut robot = robot();
    for message in [setup(0, "old"), odom(1), setup(2, "new")] {
        robot.push(START, message);
    }
    let mut find = |setup: &Setup| Ok(if setup.map == "new" { new.clone() } else { old.clone() });
    robot.advance(START, false, &mut find);
    assert!(!robot.is_settled(), "what went to the old map is not on disk");
    old.ended.store(true, Ordering::Release);
    robot.advance(START, false, &mut find);
    assert_eq!((robot.map().map(|map| map.id.as_str()), write_down(&new, &taken)), (Some("new"), 1));
}

#[test]
fn what_was_refused_leaves_no_gap() {
    let (view, queue) = map("main");
    let mut robot = robot();
    robot.push(START, setup(0, "main"));
    robot.push(START, odom(2));
    let problem = Problem::new(ErrorCode::BadArgument, "yaw_rad is NaN");
    robot.refuse(START, Some((1, 1)), problem);
    robot.advance(START, false, &mut |_| Ok(view.clone()));
    write_down(&view, &queue);
    robot.advance(START, false, &mut |_| Ok(view.clone()));
    let counts = robot.state().counts;
    assert_eq!((robot.ack().map(|a| a.seq), counts.lost, counts.refused), (Some(2), 0, 1));
}

#[test]
fn a_map_that_can_not_keep_up_lets_its_robot_wait() {
    let (view, queue) = map("main");
    let mut robot = robot();
    robot.push(START, setup(0, "main"));
    (1..200).for_each(|seq| robot.push(START, odom(seq)));
    let mut find = |_: &Setup| Ok(view.clone());
    robot.advance(START, false, &mut find);
    assert_eq!(write_down(&view, &queue), 100);
    robot.advance(START, false, &mut find);
    assert_eq!((write_down(&view, &queue), robot.state().counts.taken), (100, 200));
    robot.advance(START, false, &mut find);
    assert_eq!(robot.ack().map(|ack| ack.seq), Some(199));
}

#[test]
fn a_sentence_without_a_time_is_of_the_newest_stamp_that_has_arrived() {
    let (view, queue) = map("main");
    let mut robot = robot();
    robot.push(START, setup(0, "main"));
    let late = Header { stamp: Stamp { ns: 9_000 }, ..header(7) };
    robot.push(START, Message::Odom(Odom { header: late, odom_from_body: Pose::default() }));
    robot.advance(START, false, &mut |_| Ok(view.clone()));
    robot.push_say(START, Say { id: "s".into(), ..Say::default() }).unwrap();
    let said = queue.try_iter().find_map(|work| match work {
        Work::Take(Event::Say { boot, say }) => Some((boot, say.began)),
        _ => None,
    });
    assert_eq!(said, Some((1, Some(Stamp { ns: 9_000 }))));
}

#[test]
fn a_robot_whose_map_has_stopped_gets_another() {
    let ((broken, queue), (healthy, taken)) = (map("broken"), map("main"));
    drop(queue);
    let mut robot = robot();
    for message in [setup(0, "broken"), odom(1), odom(2)] {
        robot.push(START, message);
    }
    let mut find = |setup: &Setup| Ok(if setup.map == "main" { healthy.clone() } else { broken.clone() });
    robot.advance(START, false, &mut find);
    let later = START * 2;
    assert_eq!((robot.map().is_none(), robot.state().counts.refused), (true, 3));
    robot.push(later, setup(3, "main"));
    robot.advance(later, false, &mut find);
    assert_eq!(write_down(&healthy, &taken), 1);
    robot.advance(later * 2, false, &mut find);
    assert_eq!(robot.ack().map(|ack| ack.seq), Some(3));
}

#[test]
fn a_sentence_of_another_clock_is_refused() {
    let (view, _queue) = map("main");
    let mut robot = robot();
    let at = |seq: u64, s: i64| Header { stamp: Stamp { ns: s * 1_000_000_000 }, ..header(seq) };
    let start = Setup { header: at(0, 5_000), map: "main".into(), lasers: vec![] };
    robot.push(START, Message::Setup(start));
    robot.push(START, Message::Odom(Odom { header: at(1, 5_100), odom_from_body: Pose::default() }));
    robot.advance(START, false, &mut |_| Ok(view.clone()));
    let say = |s: i64| {
        let began = Some(Stamp { ns: s * 1_000_000_000 });
        Say { id: "s".into(), text: "this is the gym".into(), began, ..Say::default() }
    };
    for (s, words) in [(1_790_000_000, "after the newest"), (100, "before the first")] {
        let problem = robot.push_say(START, say(s)).unwrap_err();
        assert!(problem.message.contains(words) && problem.field.as_deref() == Some("began"), "{problem}");
    }
    for s in [5_000, 5_101, 4_990] {
        robot.push_say(START, say(s)).unwrap();
    }
}

#[test]
fn a_robot_that_starts_again_under_the_same_boot_is_told_so() {
    let (view, queue) = map("main");
    let mut robot = robot();
    let setup_at = |ns| {
        Message::Setup(Setup {
            header: Header { stamp: Stamp { ns }, ..header(0) },
            map: "main".into(),
            lasers: vec![],
        })
    };
    robot.push(START, setup_at(10));
    robot.push(START, odom(1));
    robot.advance(START, false, &mut |_| Ok(view.clone()));
    write_down(&view, &queue);
    // The same again is a repetition.
    robot.push(START, setup_at(10));
    assert_eq!(robot.state().error, None);
    robot.push(START, setup_at(2_000));
    let error = robot.state().error.unwrap();
    assert!(
        error.message.contains("boot 1 was used before") && error.field.as_deref() == Some("boot"),
        "{error}"
    );
}
