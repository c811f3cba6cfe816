//! Rows of logs, narrations and sentences.

use crate::feed::{Came, Fed};
use crate::seeds::CARMEN;
use crate::table::{Case, case};

/// A scan at 1 s, and one at 2 s.
const FIRST: &str = "FLASER 2 1 3 0 0 0 0 0 0 1 host 1\n";
const LAST: &str = "FLASER 2 1 3 0 0 0 1 0 0 2 host 2\n";

/// The rows.
pub fn cases() -> Vec<Case> {
    let mut all = lines();
    all.extend(whole_logs());
    all.extend(opened());
    all.extend(narrations());
    all.extend(sentences());
    all
}

/// A bad line between two good ones: it costs that line only, and is told.
fn lines() -> Vec<Case> {
    let wide = format!("FLASER 8193{} 0 0 0 0 0 0 1 h 1", " 1".repeat(8193));
    let wider = format!("FLASER 16385{} 0 0 0 0 0 0 1 h 1", " 1".repeat(16_385));
    let long = format!("ODOM {} 0 0 0 0 0 1 h 1", "9".repeat(100_000));
    let robotlaser =
        |head: &str, tail: &str| format!("ROBOTLASER1 0 {head} 0.01 0 2 1 1 {tail} 0 0 0 0 0 1 h 1");
    // No remissions, and two poses.
    let poses = "0 0 0 0 0 0 0";
    let rows = [
        ("a type alone", "ODOM".to_owned(), "the line ends before its pose"),
        ("odometry cut", "ODOM 1 2 3 0 0".into(), "the line ends before its velocities"),
        ("odometry without a stamp", "ODOM 1 2 3 0 0 0".into(), "the line ends before its stamp"),
        ("a word in a pose", "ODOM 1 two 3 0 0 0 1 h 1".into(), "\"two\" is not a number"),
        ("NaN in a pose", "ODOM 1 NaN 3 0 0 0 1 h 1".into(), "not finite"),
        ("infinity in a pose", "ODOM 1 -inf 3 0 0 0 1 h 1".into(), "not finite"),
        ("1e400 in a pose", "ODOM 1 1e400 3 0 0 0 1 h 1".into(), "not finite"),
        ("1e300 in a pose", "ODOM 1 1e300 3 0 0 0 1 h 1".into(), "odom_from_body.y_m: is 1000"),
        ("100 000 digits", long, "not finite"),
        ("a comma in a number", "ODOM 1 2,5 3 0 0 0 1 h 1".into(), "\"2,5\" is not a number"),
        ("no beams", "FLASER 0 0 0 0 0 0 0 1 h 1".into(), "a scan of no beams"),
        ("-1 beams", "FLASER -1 0 0 0 0 0 0 1 h 1".into(), "\"-1\" is not a number"),
        ("2.5 beams", "FLASER 2.5 1 1 0 0 0 0 0 0 1 h 1".into(), "\"2.5\" is not a number"),
        ("more beams than ranges", "FLASER 9 1 1 0 0 0 0 0 0 1 h 1".into(), "is not a number"),
        ("8193 beams", wide, "ranges_m: has 8193 entries"),
        ("16 385 beams", wider, "16385 is more than 16384"),
        ("2^64 beams", "FLASER 18446744073709551616 1".into(), "is not a number"),
        ("a word in the ranges", "FLASER 2 1 far 0 0 0 0 0 0 1 h 1".into(), "\"far\" is not a number"),
        (
            "a stamp that is a word",
            "FLASER 1 1 0 0 0 0 0 0 later h 1".into(),
            "stamp \"later\" is not a number",
        ),
        ("a stamp of NaN", "ODOM 1 2 3 0 0 0 nan h 1".into(), "stamp nan is out of range"),
        ("a stamp of 1e300", "ODOM 1 2 3 0 0 0 1e300 h 1".into(), "stamp 1e300 is out of range"),
        (
            "a stamp of 2^32 s",
            "ODOM 1 2 3 0 0 0 4294967296.5 h 1".into(),
            "stamp 4294967296.5 is out of range",
        ),
        ("a stamp of 2^63 ns", "ODOM 1 2 3 0 0 0 9223372036.854775808 h 1".into(), "is out of range"),
        ("a stamp with two minus signs", "ODOM 1 2 3 0 0 0 --5 h 1".into(), "is not a number"),
        ("rays that are all one", robotlaser("-1 3 0 80", poses), "angle_increment_rad: is 0"),
        ("a first bearing of NaN", robotlaser("nan 3 0.1 80", poses), "start angle: NaN is not finite"),
        ("a step of infinity", robotlaser("-1 3 inf 80", poses), "angular resolution: inf is not finite"),
        ("a longest range of NaN", robotlaser("-1 3 0.1 nan", poses), "maximum range: NaN is not finite"),
        ("-1 remissions", robotlaser("-1 3 0.1 80", "-1 0 0 0 0 0 0"), "number of remissions"),
        ("10^9 remissions", robotlaser("-1 3 0.1 80", "1000000000 0 0 0 0 0 0"), "is more than 16384"),
        ("no message", "\u{1}\u{2} garbage".into(), "not a CARMEN message"),
        ("a type in small letters", "flaser 1 1 0 0 0 0 0 0 1 h 1".into(), "not a CARMEN message"),
        ("a type with a colon", "ODOM: 1 2 3 0 0 0 1 h 1".into(), "not a CARMEN message"),
        ("XML", "<scan ranges=\"1 2 3\"/>".into(), "not a CARMEN message"),
    ];
    let case = |(name, line, why): (&str, String, &str)| {
        let fed = Fed::Carmen(format!("{FIRST}{line}\n{LAST}").into());
        case(
            format!("carmen: {name}"),
            fed,
            Came::Taken,
            &format!("5 messages, 2 scans; :2: skipped … {why}"),
        )
    };
    let mut all: Vec<Case> = rows.into_iter().map(case).collect();
    let bytes = [FIRST.as_bytes(), b"ODOM 1 2 \xff\n", LAST.as_bytes()].concat();
    all.push(crate::table::case(
        "carmen: no UTF-8",
        Fed::Carmen(bytes),
        Came::Taken,
        "not text after 9 bytes",
    ));
    all
}

fn whole_logs() -> Vec<Case> {
    let cut = |bytes: usize| CARMEN[..CARMEN.len() - bytes].to_owned();
    let rows = [
        ("nothing", String::new(), Came::NoScan, "no usable scan in 0 lines"),
        ("line breaks alone", "\n\n\n".into(), Came::NoScan, "no usable scan in 3 lines"),
        ("odometry alone", "ODOM 0 0 0 0 0 0 1 h 1\n".into(), Came::NoScan, "no usable scan in 1 lines"),
        ("raw lasers alone", "RAWLASER1 0 0 0 0 0 0 0 1 1 0 1 h 1\n".into(), Came::NoScan, ""),
        ("bad scans alone", "FLASER 2 1\nFLASER x\n".into(), Came::NoScan, "line 1: the line ends before"),
        (
            "a first stamp of 2^32 s",
            FIRST.replace(" 1 host", " 4294967296 host"),
            Came::NoScan,
            "line 1: stamp 4294967296 is out of range",
        ),
        (
            "a laser 500 m off",
            format!("PARAM robot_frontlaser_offset 500 1 h 1\n{FIRST}"),
            Came::RefusedSetup,
            "lasers[0].x_m: is 500",
        ),
        // What is wrong with one line must not decide over the log.
        (
            "a stamp of 2^32 s before good ones",
            format!("ODOM 0 0 0 0 0 0 4294967296 h 1\n{FIRST}{LAST}"),
            Came::Taken,
            "5 messages, 2 scans",
        ),
        (
            "a longest range of NaN",
            format!("PARAM robot_front_laser_max nan 1 h 1\n{FIRST}"),
            Came::Taken,
            "3 messages, 1 scans",
        ),
        (
            "lines that are indented",
            format!(" ODOM 0 0 0 0 0 0 1 h 1\n {FIRST}"),
            Came::Taken,
            "3 messages, 1 scans",
        ),
        (
            "no scan that servers take",
            format!("FLASER 8193{} 0 0 0 0 0 0 1 h 1\n", " 1".repeat(8193)),
            Came::NoScan,
            "line 1: ranges_m: has 8193 entries",
        ),
        ("a last line that breaks off", cut(30), Came::Taken, "line 7, the last, is truncated"),
        ("line breaks of another system", FIRST.replace('\n', "\r\n"), Came::Taken, "3 messages, 1 scans; "),
        ("one line of a MiB", " ".repeat(1 << 20) + FIRST, Came::Taken, "3 messages, 1 scans"),
        (
            "10 000 bad lines",
            format!("{FIRST}{}", "ODOM x\n".repeat(10_000)),
            Came::Taken,
            "9995 more lines skipped",
        ),
    ];
    let case = |(name, text, came, told): (&str, String, Came, &str)| {
        case(format!("log: {name}"), Fed::Carmen(text.into()), came, told)
    };
    rows.into_iter().map(case).collect()
}

fn opened() -> Vec<Case> {
    let rows: [(&str, Vec<u8>, Came, &str); 6] = [
        ("nothing", vec![], Came::NoScan, ""),
        ("zeros", vec![0; 1000], Came::NotALog, "binary"),
        ("a scan and a zero", [FIRST.as_bytes(), b"\0"].concat(), Came::NotALog, "binary"),
        ("the head of a gzip", vec![0x1f, 0x8b, 8, 0, 0], Came::NotALog, "damaged gzip"),
        ("a gzip of nonsense", [&[0x1f, 0x8b][..], &[0xff; 100]].concat(), Came::NotALog, "damaged gzip"),
        ("a picture", b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR".to_vec(), Came::NotALog, "binary"),
    ];
    rows.into_iter()
        .map(|(name, bytes, came, told)| case(format!("file: {name}"), Fed::Log(bytes), came, told))
        .collect()
}

fn narrations() -> Vec<Case> {
    let said = |more: &str| format!("{{\"t\": 1, \"text\": \"gym\"{more}}}");
    let deep = format!("{{\"t\": 1, \"text\": {}{}}}", "[".repeat(10_000), "]".repeat(10_000));
    let deep_unknown = said(&format!(", \"x\": {}{}", "[".repeat(10_000), "]".repeat(10_000)));
    let rows = [
        ("nothing", String::new(), Came::Taken, "[]"),
        ("what is no JSON", "this is the gym".into(), Came::BadLine, "1: expected"),
        ("a list", "[1, \"gym\"]".into(), Came::BadLine, "1: "),
        ("no time", "{\"text\": \"gym\"}".into(), Came::BadLine, "1: says neither t nor t_rel"),
        ("two times", said(", \"t_rel\": 1"), Came::BadLine, "1: says both t and t_rel"),
        ("a time twice", said(", \"t\": 1"), Came::BadLine, "1: duplicate field `t`"),
        ("no text", "{\"t\": 1}".into(), Came::BadLine, "1: missing field `text`"),
        ("an empty text", "{\"t\": 1, \"text\": \" \"}".into(), Came::BadLine, "1: text: is empty"),
        (
            "a time in a string",
            "{\"t\": \"1\", \"text\": \"gym\"}".into(),
            Came::BadLine,
            "1: invalid type: string",
        ),
        ("a time of NaN", "{\"t\": NaN, \"text\": \"gym\"}".into(), Came::BadLine, "1: expected value"),
        (
            "a time of 1e300",
            "{\"t\": 1e300, \"text\": \"gym\"}".into(),
            Came::BadLine,
            "1: its time is out of range",
        ),
        (
            "a time in milliseconds",
            "{\"t\": 1732233600000, \"text\": \"gym\"}".into(),
            Came::BadLine,
            "1: its time is out of range",
        ),
        (
            "a time of -1e10",
            "{\"t_rel\": -1e10, \"text\": \"gym\"}".into(),
            Came::BadLine,
            "1: its time is out of range",
        ),
        (
            "hearings that are none",
            said(", \"alternatives\": [\"jim\"]"),
            Came::BadLine,
            "1: invalid type: string",
        ),
        (
            "a hearing of what chance",
            said(", \"alternatives\": [{\"text\": \"jim\"}]"),
            Came::BadLine,
            "1: missing field `p`",
        ),
        ("two sentences in a line", format!("{0} {0}", said("")), Came::BadLine, "1: trailing characters"),
        ("the third line", format!("{0}\n\n{{", said("")), Came::BadLine, "3: EOF"),
        ("what is not known", said(", \"region\": [\"R2\"]"), Came::Taken, "gym"),
        ("a text 10 000 deep", deep, Came::BadLine, "1: "),
        // What a server refuses is not taken offline either.
        ("an id of 65 bytes", said(&format!(", \"id\": \"{}\"", "x".repeat(65))), Came::BadLine, "1: id"),
        (
            "a chance of 7",
            said(", \"alternatives\": [{\"text\": \"jim\", \"p\": 7}]"),
            Came::BadLine,
            "1: alternatives[0].p",
        ),
        ("a text of 1001 characters", said("").replace("gym", &"a".repeat(1001)), Came::BadLine, "1: text"),
        ("a time of 2^32 s", "{\"t\": 4294967296, \"text\": \"gym\"}".into(), Came::BadLine, "1: began"),
        // As editors of other systems write it.
        ("a mark of byte order", format!("\u{feff}{}", said("")), Came::Taken, "gym"),
        ("what is not known, 10 000 deep", deep_unknown, Came::Taken, "gym"),
    ];
    let case = |(name, text, came, told): (&str, String, Came, &str)| {
        case(format!("narration: {name}"), Fed::Narration(text.into()), came, told)
    };
    let mut all: Vec<Case> = rows.into_iter().map(case).collect();
    let bytes = b"{\"t\": 1, \"text\": \"\xff\"}".to_vec();
    all.push(crate::table::case("narration: no UTF-8", Fed::Narration(bytes), Came::NoFile, "UTF-8"));
    all
}

/// What nobody understands says nothing, and what is absurdly long is not listened to.
fn sentences() -> Vec<Case> {
    let rows = [
        ("nothing", String::new()),
        ("stops alone", "...!?".into()),
        ("zeros", "\u{0}".repeat(1000)),
        ("an escape", "\u{1b}[2J\u{1b}[1;1H".into()),
        // What joins the parts of pictures, and accents without a letter, are no names.
        ("a picture", "🏋️‍♀️".into()),
        ("marks on nothing", "\u{301}".repeat(20)),
        ("commas", ",".repeat(1000)),
        ("apostrophes", "'".repeat(1000)),
        ("what is too long", "this is the gym. ".repeat(300)),
        // It would stand on every map and in every answer.
        ("one word of 1000 letters", "a".repeat(1000)),
        ("4000 digits", "9".repeat(4000)),
    ];
    let case = |(name, text): (&str, String)| {
        case(format!("sentence: {name}"), Fed::Sentence(text), Came::NotUnderstood, "")
    };
    rows.into_iter().map(case).collect()
}
