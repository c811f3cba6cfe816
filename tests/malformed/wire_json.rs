//! Rows of messages in JSON.

use crate::feed::{Came, Fed};
use crate::seeds::{LASER, ROBOT, key_of, keys, messages, odom, say, scan};
use crate::table::{Case, case};
use crate::wire_bincode::NUMBERS;
use toponym_proto::Message;
use toponym_proto::codec::{ENCODING_BINCODE, ENCODING_JSON};

/// A value that no other field has.
const MARKED: f64 = 0.123_456_789;

fn text(message: &Message) -> String {
    String::from_utf8(message.to_json().unwrap()).unwrap()
}

fn on(key: String, text: impl Into<Vec<u8>>) -> Fed {
    Fed::Wire(key, ENCODING_JSON, text.into())
}

/// A message in whose text something is another.
fn with(message: &Message, from: &str, to: &str) -> Fed {
    let text = text(message);
    assert!(text.contains(from), "{from} is not in {text}");
    on(key_of(message), text.replacen(from, to, 1))
}

fn odom_with(from: &str, to: &str) -> Fed {
    with(&Message::Odom(odom()), from, to)
}

fn scan_with(from: &str, to: &str) -> Fed {
    with(&Message::Scan(scan()), from, to)
}

fn say_with(from: &str, to: &str) -> Fed {
    with(&Message::Say(say()), from, to)
}

/// The rows.
pub fn cases() -> Vec<Case> {
    let mut all = numbers();
    all.extend(headers());
    all.extend(texts());
    all.extend(fields());
    all.extend(shapes());
    all.extend(encodings());
    let named = |mut case: Case| {
        case.name = format!("json: {}", case.name);
        case
    };
    all.into_iter().map(named).collect()
}

fn numbers() -> Vec<Case> {
    let mut rows = Vec::new();
    for (k, (field, spoil)) in NUMBERS.into_iter().enumerate() {
        for (literal, came, told) in [
            ("1e300", Came::Invalid, field),
            ("1e400", Came::Malformed, "number out of range"),
            ("NaN", Came::Malformed, "JSON knows neither NaN nor Infinity"),
            ("-Infinity", Came::Malformed, "JSON knows neither NaN nor Infinity"),
            ("null", Came::Malformed, "invalid type: null"),
            ("\"1\"", Came::Malformed, "invalid type: string"),
        ] {
            let fed = with(&spoil(MARKED), &MARKED.to_string(), literal);
            rows.push(case(format!("number {k}, {field}, is {literal}"), fed, came, told));
        }
    }
    rows.extend([
        case("a range of 1e300", scan_with("[1.5", "[1e300"), Came::Taken, "[inf"),
        case("a range of null", scan_with("[1.5", "[null"), Came::Taken, "[NaN"),
        case("a range of 1e400", scan_with("[1.5", "[1e400"), Came::Malformed, "number out of range"),
        case("a range of NaN", scan_with("[1.5", "[NaN"), Came::Malformed, "send null"),
        case("a range in a string", scan_with("[1.5", "[\"1.5\""), Came::Malformed, "invalid type: string"),
        case("a range that is true", scan_with("[1.5", "[true"), Came::Malformed, "invalid type: boolean"),
        case("a number with a plus", odom_with("1.5", "+1.5"), Came::Malformed, "expected value"),
        case("a number from a zero on", odom_with("1.5", "01.5"), Came::Malformed, "invalid number"),
        case("a hexadecimal number", odom_with("1.5", "0x15"), Came::Malformed, "expected `,` or `}`"),
        case("a number with a comma", odom_with("1.5", "1,5"), Came::Malformed, "key must be a string"),
        case(
            "8193 rays",
            scan_with("[1.5", &format!("[{}1.5", "1,".repeat(8189))),
            Came::Invalid,
            "ranges_m",
        ),
    ]);
    rows
}

fn headers() -> Vec<Case> {
    let mut rows = Vec::new();
    for (name, from) in [("boot", "\"boot\":3"), ("seq", "\"seq\":12")] {
        for (n, came, told) in [
            ("70368744177664", Came::Taken, ""),
            ("70368744177665", Came::Invalid, name),
            ("9007199254740991", Came::Invalid, name),
            ("9223372036854775808", Came::Invalid, name),
            ("18446744073709551615", Came::Invalid, name),
            ("18446744073709551616", Came::Malformed, "invalid type: floating point"),
            ("-1", Came::Malformed, "invalid value: integer `-1`"),
            ("1.5", Came::Malformed, "invalid type: floating point"),
            ("1e3", Came::Malformed, "invalid type: floating point"),
            ("null", Came::Malformed, "invalid type: null"),
            ("\"3\"", Came::Malformed, "invalid type: string"),
        ] {
            let fed = odom_with(from, &format!("\"{name}\":{n}"));
            rows.push(case(format!("{name} {n}"), fed, came, told));
        }
    }
    let stamp = "{\"sec\":1700000000,\"nanosec\":5}";
    for (at, came, told) in [
        ("{\"sec\":0,\"nanosec\":0}", Came::Taken, ""),
        ("{\"sec\":-1,\"nanosec\":999999999}", Came::Taken, "ns: -1"),
        ("{\"sec\":1,\"nanosec\":1000000000}", Came::Malformed, "must be below 1000000000"),
        ("{\"sec\":1,\"nanosec\":-1}", Came::Malformed, "invalid value: integer `-1`"),
        ("{\"sec\":1,\"nanosec\":4294967296}", Came::Malformed, "invalid value: integer `4294967296`"),
        ("{\"sec\":1.5,\"nanosec\":0}", Came::Malformed, "invalid type: floating point"),
        ("{\"sec\":4102444800,\"nanosec\":0}", Came::Invalid, "stamp"),
        ("{\"sec\":4294967296,\"nanosec\":0}", Came::Invalid, "stamp"),
        ("{\"sec\":9223372036,\"nanosec\":854775807}", Came::Invalid, "stamp"),
        ("{\"sec\":9223372036,\"nanosec\":854775808}", Came::Malformed, "is out of range"),
        ("{\"sec\":9223372036854775807,\"nanosec\":0}", Came::Malformed, "is out of range"),
        ("{\"sec\":-9223372036854775808,\"nanosec\":0}", Came::Malformed, "is out of range"),
        ("{\"sec\":1}", Came::Malformed, "missing field `nanosec`"),
        ("{\"sec\":1,\"nsec\":0}", Came::Malformed, "unknown field `nsec`"),
        ("{}", Came::Malformed, "missing field `sec`"),
        ("1700000000.5", Came::Malformed, "invalid type: floating point"),
        ("null", Came::Malformed, "invalid type: null"),
        ("\"now\"", Came::Malformed, "invalid type: string"),
    ] {
        rows.push(case(format!("stamp {at}"), odom_with(stamp, at), came, told));
    }
    for clock in ["\"wall\"", "\"Unix\"", "null", "0"] {
        rows.push(case(format!("clock {clock}"), odom_with("\"log\"", clock), Came::Malformed, ""));
    }
    rows
}

fn texts() -> Vec<Case> {
    let robot = format!("\"{ROBOT}\"");
    let robot_of = |to: &str| odom_with(&robot, to);
    let long = format!("\"{}\"", "x".repeat(64));
    let said = "this is the gym";
    let mut cut = text(&Message::Say(say())).into_bytes();
    let at = cut.windows(said.len()).position(|w| w == said.as_bytes()).unwrap();
    cut[at] = 0xff;
    vec![
        case("robot in capitals", robot_of("\"R07\""), Came::Invalid, "robot"),
        case("robot with an escaped zero", robot_of("\"r\\u0000\""), Came::Invalid, "robot"),
        case("robot with a slash", robot_of("\"r\\/7\""), Came::Invalid, "robot"),
        case("robot of 64 characters", robot_of(&long), Came::Invalid, "robot"),
        case("robot of nothing", robot_of("\"\""), Came::Invalid, "robot"),
        case("robot is any", robot_of("\"any\""), Came::Invalid, "robot"),
        case("robot is a number", robot_of("7"), Came::Malformed, "invalid type: integer"),
        case("another robot's", robot_of("\"r08\""), Came::Invalid, "robot"),
        case("another laser's", scan_with(LASER, "rear"), Came::Invalid, "laser"),
        case("half a surrogate", say_with(said, "\\ud800"), Came::Malformed, "escape"),
        case("a surrogate's other half", say_with(said, "\\udc00 gym"), Came::Malformed, "surrogate"),
        case("no UTF-8", on(keys().say(Some(ROBOT)), cut), Came::Malformed, "invalid unicode"),
        case("a bare line break", say_with(said, "a\nb"), Came::Malformed, "control character"),
        case("an unknown escape", say_with(said, "\\x41"), Came::Malformed, "invalid escape"),
        case("1001 characters", say_with(said, &"a".repeat(1001)), Came::Invalid, "text"),
        case("1001 escaped characters", say_with(said, &"\\u0061".repeat(1001)), Came::Invalid, "text"),
        case("nothing said", say_with(said, " \\t "), Came::Invalid, "text"),
        case("an id with a control character", say_with("01J9", "\\u0007"), Came::Invalid, "id"),
        case("a speaker of 65 bytes", say_with("anna", &"a".repeat(65)), Came::Invalid, "speaker"),
        case("ended before it began", say_with("\"sec\":6", "\"sec\":4"), Came::Invalid, "ended"),
        case("said at the end of time", say_with("\"sec\":5", "\"sec\":9223372036"), Came::Invalid, "began"),
        case("text is null", say_with(&format!("\"{said}\""), "null"), Came::Malformed, "invalid type: null"),
    ]
}

fn fields() -> Vec<Case> {
    let first = |more: &str| odom_with("{", &format!("{{{more},"));
    vec![
        case("a field of no kind", first("\"speed\":1"), Came::Malformed, "unknown field `speed`"),
        case("a type", first("\"type\":\"odom\""), Came::Malformed, "unknown field `type`"),
        case("a version", first("\"v\":1"), Came::Malformed, "unknown field `v`"),
        case(
            "a field in capitals",
            odom_with("\"boot\"", "\"Boot\""),
            Came::Malformed,
            "unknown field `Boot`",
        ),
        case(
            "a misspelt option",
            scan_with("time_increment_s", "time_incr_s"),
            Came::Malformed,
            "unknown field",
        ),
        case(
            "a pose with a z",
            odom_with("{\"x_m\"", "{\"z_m\":0,\"x_m\""),
            Came::Malformed,
            "unknown field `z_m`",
        ),
        case(
            "a hearing with more",
            say_with("\"p\":", "\"q\":1,\"p\":"),
            Came::Malformed,
            "unknown field `q`",
        ),
        case("boot twice", first("\"boot\":3"), Came::Malformed, "duplicate field `boot`"),
        case("robot twice", first("\"robot\":\"r07\""), Came::Malformed, "duplicate field `robot`"),
        case(
            "x twice",
            odom_with("\"x_m\":1.5", "\"x_m\":1.5,\"x_m\":2"),
            Came::Malformed,
            "duplicate field `x_m`",
        ),
        case(
            "seconds twice",
            odom_with("\"sec\":", "\"sec\":1,\"sec\":"),
            Came::Malformed,
            "duplicate field `sec`",
        ),
        case("no boot", odom_with("\"boot\":3,", ""), Came::Malformed, "missing field `boot`"),
        case("no yaw", odom_with(",\"yaw_rad\":0.25", ""), Came::Malformed, "missing field `yaw_rad`"),
        case(
            "no ranges",
            scan_with(",\"ranges_m\":[1.5,3.4028235e+38,null,2.0]", ""),
            Came::Malformed,
            "missing field",
        ),
        case("no clock", odom_with("\"clock\":\"log\",", ""), Came::Taken, "clock: Unix"),
        case("a hearing without p", say_with(",\"p\":0.25", ""), Came::Malformed, "missing field `p`"),
        case(
            "a scan as odometry",
            on(keys().odom(ROBOT), text(&Message::Scan(scan()))),
            Came::Malformed,
            "unknown field",
        ),
        case(
            "odometry as a scan",
            on(keys().scan(ROBOT, LASER), text(&Message::Odom(odom()))),
            Came::Malformed,
            "unknown field",
        ),
        case(
            "odometry as an end",
            on(keys().end(ROBOT), text(&Message::Odom(odom()))),
            Came::Malformed,
            "unknown field",
        ),
        case(
            "odometry as a sentence",
            on(keys().say(Some(ROBOT)), text(&Message::Odom(odom()))),
            Came::Malformed,
            "unknown field",
        ),
    ]
}

fn shapes() -> Vec<Case> {
    let odom_key = || keys().odom(ROBOT);
    let whole = text(&Message::Odom(odom()));
    let deep = |open: &str, close: &str| format!("{}{}", open.repeat(10_000), close.repeat(10_000));
    let pose = "{\"x_m\":1.5,\"y_m\":-2.0,\"yaw_rad\":0.25}";
    let after = |more: &str| on(odom_key(), format!("{whole}{more}"));
    let ranges = "[1.5,3.4028235e+38,null,2.0]";
    let stamp = "{\"sec\":1700000000,\"nanosec\":5}";
    let list = format!("[\"{ROBOT}\",3,12,{stamp},\"log\",{pose}]");
    vec![
        case("an empty object", on(odom_key(), "{}"), Came::Malformed, "missing field `robot`"),
        case("null", on(odom_key(), "null"), Came::Malformed, "invalid type: null"),
        case("a string", on(odom_key(), "\"odom\""), Came::Malformed, "invalid type: string"),
        case("a number", on(odom_key(), "1"), Came::Malformed, "invalid type: integer"),
        case(
            "a list of messages",
            on(odom_key(), format!("[{whole}]")),
            Came::Malformed,
            "invalid type: map",
        ),
        case("lists 10 000 deep", on(odom_key(), deep("[", "]")), Came::Malformed, ""),
        case(
            "objects 10 000 deep",
            on(odom_key(), deep("{\"a\":", "}")),
            Came::Malformed,
            "unknown field `a`",
        ),
        case("a pose 10 000 deep", odom_with(pose, &deep("[", "]")), Came::Malformed, ""),
        case("ranges 10 000 deep", scan_with(ranges, &deep("[", "]")), Came::Malformed, ""),
        case(
            "a text 10 000 deep",
            say_with("\"this is the gym\"", &deep("[", "]")),
            Came::Malformed,
            "invalid type: sequence",
        ),
        // Lists in the place of objects are read field by field, as the protocol says.
        case("a pose that is a list", odom_with(pose, "[1.5,-2.0,0.25]"), Came::Taken, "Odom"),
        case(
            "a pose that is a list of two",
            odom_with(pose, "[1.5,-2.0]"),
            Came::Malformed,
            "invalid length 2",
        ),
        case("a stamp that is a list", odom_with(stamp, "[1,5]"), Came::Taken, "Odom"),
        case("a message that is a list", on(odom_key(), list), Came::Taken, "Odom"),
        case("lists that never close", on(odom_key(), "[".repeat(100_000)), Came::Malformed, ""),
        case("two at once", after(&whole), Came::Malformed, "trailing characters"),
        case("a brace too many", after("}"), Came::Malformed, "trailing characters"),
        case("a zero behind it", after("\u{0}"), Came::Malformed, "trailing characters"),
        case("white space behind it", after(" \n"), Came::Taken, ""),
        case("a comma at the end", odom_with("0.25}}", "0.25},}"), Came::Malformed, "trailing comma"),
        case("a comment", odom_with("{", "{/* odom */"), Came::Malformed, "key must be a string"),
        case("single quotes", odom_with("\"robot\"", "'robot'"), Came::Malformed, "key must be a string"),
        case(
            "a mark of byte order",
            on(odom_key(), format!("\u{feff}{whole}")),
            Came::Malformed,
            "expected value",
        ),
        case("a MiB of spaces", on(odom_key(), " ".repeat(1 << 20)), Came::Malformed, "EOF"),
        case(
            "a MiB of spaces before it",
            on(odom_key(), " ".repeat(1 << 20) + &whole),
            Came::TooLarge,
            "at most 1048576",
        ),
    ]
}

/// What an encoding says that the payload is not, or nothing says at all.
fn encodings() -> Vec<Case> {
    let odom = Message::Odom(odom());
    let (json, bincode) = (odom.to_json().unwrap(), odom.to_bincode().unwrap());
    let spaced = [b" \r\n\t", json.as_slice()].concat();
    let fed = |encoding, bytes: &[u8]| Fed::Wire(keys().odom(ROBOT), encoding, bytes.to_vec());
    vec![
        case("JSON said to be bincode", fed(ENCODING_BINCODE, &json), Came::Malformed, "version 123"),
        case(
            "bincode said to be JSON",
            fed(ENCODING_JSON, &bincode),
            Came::Malformed,
            "JSON: expected value",
        ),
        case("bincode said to be text", fed("text/plain", &bincode), Came::Malformed, "JSON: expected value"),
        case("nothing said to be JSON", fed(ENCODING_JSON, &[]), Came::Malformed, "JSON: EOF"),
        case("nothing of no encoding", fed("", &[]), Came::Malformed, "0 bytes are no message"),
        case("JSON of no encoding", fed("", &json), Came::Taken, ""),
        case("JSON behind white space, of no encoding", fed("", &spaced), Came::Taken, ""),
        case("JSON said to be an image", fed("image/png", &json), Came::Taken, ""),
        case("bincode said to be an image", fed("image/png", &bincode), Came::Taken, ""),
        case(
            "bincode of another version's encoding",
            fed("application/x-toponym;2", &bincode),
            Came::Taken,
            "",
        ),
        case(
            "JSON of an encoding with parameters",
            fed("application/json;charset=utf-8", &json),
            Came::Taken,
            "",
        ),
        case("a list of no encoding", fed("", b"[1,2]"), Came::Malformed, "version 91"),
        case("a word of no encoding", fed("zenoh/bytes", b"odom"), Came::Malformed, "version 111"),
        case("an encoding of 1 MiB", fed(LONG.as_str(), &bincode), Came::Taken, ""),
    ]
}

static LONG: std::sync::LazyLock<String> = std::sync::LazyLock::new(|| "x".repeat(1 << 20));

/// Each message, cut to each of its lengths.
#[test]
fn a_message_that_breaks_off_is_refused_wherever_it_does() {
    for message in &messages() {
        let whole = text(message);
        for length in 0..whole.len() {
            let fed = crate::feed::feed(&on(key_of(message), &whole[..length]));
            assert_eq!(fed.came, Came::Malformed, "{} cut: {fed:?}", &whole[..length]);
        }
    }
}
