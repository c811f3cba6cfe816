//! Rows of bincode that is none: versions, types, lengths that lie, what breaks off.

use crate::feed::{Came, Fed, feed};
use crate::seeds::{LASER, ROBOT, key_of, keys, mends, messages, odom, say, scan, setup};
use crate::table::{Case, case};
use crate::wire_bincode::{bytes_of, on};
use toponym_proto::Message;

/// Where the header's fields stand: version, type, then the robot's name with its length.
const ROBOT_AT: usize = 2;
const CLOCK_AT: usize = ROBOT_AT + 8 + ROBOT.len() + 3 * 8;
const BODY_AT: usize = CLOCK_AT + 4;

/// The rows.
pub fn cases() -> Vec<Case> {
    let mut all = bytes();
    all.extend(lengths());
    all
}

/// Odometry's bytes with these at a place.
fn odom_with(at: usize, bytes: &[u8]) -> Fed {
    spoiled(&Message::Odom(odom()), at, bytes)
}

fn spoiled(message: &Message, at: usize, bytes: &[u8]) -> Fed {
    let mut whole = bytes_of(message);
    whole[at..at + bytes.len()].copy_from_slice(bytes);
    on(key_of(message), whole)
}

fn bytes() -> Vec<Case> {
    let claim = "not the bincode that its type byte claims";
    let odom_key = || keys().odom(ROBOT);
    let odom = Message::Odom(odom());
    let mut longer = bytes_of(&odom);
    longer.extend([0; 7]);
    let mut twice = bytes_of(&odom);
    twice.extend(bytes_of(&odom));
    let scan_as_odom = {
        let mut bytes = bytes_of(&Message::Scan(scan()));
        bytes[1] = 2;
        bytes
    };
    let say = Message::Say(say());
    // The sentence's id, then whether it names its robot.
    let robot_tag = 2 + 8 + 26;
    vec![
        case("nothing", on(odom_key(), vec![]), Came::Malformed, "0 bytes are no message"),
        case("a version alone", on(odom_key(), vec![1]), Came::Malformed, "1 bytes are no message"),
        case("a head alone", on(odom_key(), vec![1, 2]), Came::Malformed, claim),
        case("version 0", odom_with(0, &[0]), Came::Malformed, "version 0, this build reads 1"),
        case("version 2", odom_with(0, &[2]), Came::Malformed, "version 2, this build reads 1"),
        case("version 255", odom_with(0, &[255]), Came::Malformed, "version 255, this build reads 1"),
        case("type 0", odom_with(1, &[0]), Came::Malformed, "unknown type id 0"),
        case("type 7", odom_with(1, &[7]), Came::Malformed, "unknown type id 7"),
        case("type 255", odom_with(1, &[255]), Came::Malformed, "unknown type id 255"),
        case("odometry of type scan", odom_with(1, &[3]), Came::Malformed, claim),
        case(
            "a scan of type odometry",
            on(odom_key(), scan_as_odom),
            Came::Malformed,
            "bytes too many at the end",
        ),
        case("zeros behind it", on(odom_key(), longer), Came::Malformed, "7 bytes too many at the end"),
        case("two at once", on(odom_key(), twice), Came::Malformed, "bytes too many at the end"),
        case("a clock of no kind", odom_with(CLOCK_AT, &[3]), Came::Malformed, claim),
        case("a robot in no UTF-8", odom_with(ROBOT_AT + 8, &[0xff]), Came::Malformed, claim),
        case(
            "a bool that is 2",
            spoiled(&Message::Setup(setup()), upside_down_at(), &[2]),
            Came::Malformed,
            claim,
        ),
        case("an option that is 2", spoiled(&say, robot_tag, &[2]), Came::Malformed, claim),
        case("all ones", on(odom_key(), vec![255; 100]), Came::Malformed, "version 255"),
        case("all zeros", on(odom_key(), vec![0; 100]), Came::Malformed, "version 0"),
        case("a MiB and a byte", on(odom_key(), vec![1; (1 << 20) + 1]), Came::TooLarge, "1048577 bytes"),
        case(
            "a MiB of type odometry",
            on(odom_key(), [vec![1, 2], vec![0; (1 << 20) - 2]].concat()),
            Came::Malformed,
            "too many",
        ),
    ]
}

/// Behind the map's name, the number of lasers, the laser's name and its place.
fn upside_down_at() -> usize {
    BODY_AT + (8 + 4) + 8 + (8 + LASER.len()) + 3 * 8
}

/// Lengths that lie: nothing may be reserved for what they claim.
fn lengths() -> Vec<Case> {
    let claim = "not the bincode that its type byte claims";
    let setup = Message::Setup(setup());
    let (lasers_at, ignored_at) = (BODY_AT + 8 + 4, upside_down_at() + 1 + 2 * 8);
    let scan = Message::Scan(scan());
    let ranges_at = BODY_AT + 8 + LASER.len() + 3 * 8;
    let say = Message::Say(say());
    let text_at = 2 + 8 + 26 + 1 + 8 + ROBOT.len();
    let alternatives_at = text_at + 8 + "this is the gym".len();
    let places = [
        ("a robot's name", Message::Odom(odom()), ROBOT_AT),
        ("lasers", setup.clone(), lasers_at),
        ("ignored bearings", setup, ignored_at),
        ("ranges", scan, ranges_at),
        ("a sentence", say.clone(), text_at),
        ("alternatives", say, alternatives_at),
    ];
    let lies = [("2^32", 1_u64 << 32), ("2^62", 1 << 62), ("2^64 - 1", u64::MAX)];
    let rows = places.into_iter().flat_map(|(what, message, at)| {
        lies.map(|(length, n)| {
            let fed = spoiled(&message, at, &n.to_le_bytes());
            case(format!("{what} of length {length}"), fed, Came::Malformed, claim)
        })
    });
    rows.collect()
}

/// Each message, cut to each of its lengths.
#[test]
fn a_message_that_breaks_off_is_refused_wherever_it_does() {
    let mut cuts = 0;
    for message in messages().iter().chain(&mends()) {
        let whole = bytes_of(message);
        for length in 0..whole.len() {
            let fed = feed(&on(key_of(message), whole[..length].to_vec()));
            assert_eq!(fed.came, Came::Malformed, "type {} cut to {length}: {fed:?}", message.type_id());
            cuts += 1;
        }
    }
    println!("{cuts} cuts");
}
