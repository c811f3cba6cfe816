//! A robot's log written as a bag.

use crate::{Folder, drive, mcap, read};
use toponym_proto::Message;
use toponym_ros::bag::BagWriter;
use toponym_ros::robot::AsRos;

#[test]
fn a_drive_written_as_a_bag_is_read_back_the_same() {
    let folder = Folder::new("written");
    let (first, second) = (folder.0.join("a.mcap"), folder.0.join("b.mcap"));
    mcap(&first, &drive(30), true);
    let (messages, _) = read(&first);
    let mut bag = BagWriter::new(std::fs::File::create(&second).unwrap()).unwrap();
    let mut as_ros = AsRos::default();
    for message in &messages {
        let Some(published) = as_ros.of(message).unwrap() else { continue };
        let at = if let Message::Say(say) = message { say.began.unwrap() } else { as_ros.newest() };
        bag.put(&published.topic, published.kind, at.ns, &published.data).unwrap();
    }
    bag.finish().unwrap();
    let (again, notes) = read(&second);
    assert_eq!(notes.bad_lines, 0, "{notes:?}");
    let (Message::Setup(before), Message::Setup(after)) = (&messages[0], &again[0]) else {
        panic!("{again:?}")
    };
    assert!((before.lasers[0].yaw_rad - after.lasers[0].yaw_rad).abs() < 1e-9);
    assert!(after.lasers[0].upside_down);
    assert_eq!(again[1..], messages[1..]);
}
