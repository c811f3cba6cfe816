//! Rows of keys and selectors.

use crate::feed::{Came, Fed};
use crate::table::{Case, case};
use std::fmt::Write as _;

/// The rows.
pub fn cases() -> Vec<Case> {
    let mut all = keys();
    all.extend(selectors());
    all.extend(payloads());
    all
}

fn keys() -> Vec<Case> {
    let long = "x".repeat(64);
    let longer = "a/".repeat(50_000);
    let robot_long = format!("robot/{long}/in/odom");
    let rows = [
        ("robot/r07/in/odom", Came::Taken, "r07, Odom"),
        ("robot/any/say", Came::Taken, "any, Say"),
        ("robot/any/in/odom", Came::Invalid, "robot"),
        ("robot/any/in/scan/front", Came::Invalid, "robot"),
        ("robot/R07/in/odom", Came::Invalid, "robot"),
        ("robot/räum/in/odom", Came::Invalid, "robot"),
        ("robot/*/in/odom", Came::Invalid, "robot"),
        ("robot/**/in/odom", Came::Invalid, "robot"),
        ("robot/r$*/in/odom", Came::Invalid, "robot"),
        ("robot/../in/odom", Came::Invalid, "robot"),
        ("robot//in/odom", Came::Invalid, "robot"),
        ("robot/r 7/say", Came::Invalid, "robot"),
        ("robot/r\u{0}/say", Came::Invalid, "robot"),
        (robot_long.as_str(), Came::Invalid, "robot"),
        ("robot/r07/in/scan/", Came::Invalid, "laser"),
        ("robot/r07/in/scan/FRONT", Came::Invalid, "laser"),
        ("robot/r07/in/scan/*", Came::Invalid, "laser"),
        ("robot/R07/in/scan/A", Came::Invalid, "laser"),
        ("robot/r07/in/scan", Came::Invalid, "key"),
        ("robot/r07/in/scan/a/b", Came::Invalid, "key"),
        ("robot/r07/in", Came::Invalid, "key"),
        ("robot/r07/in/", Came::Invalid, "key"),
        ("robot/r07/in/**", Came::Invalid, "key"),
        ("robot/r07/in/pose", Came::Invalid, "key"),
        ("robot/r07/out/ack", Came::Invalid, "key"),
        ("robot/r07/in/odom/", Came::Invalid, "key"),
        ("robot/r07/in/odom/@adv/pub/1/_", Came::Invalid, "key"),
        ("robot/r07/say/x", Came::Invalid, "key"),
        ("robot/r07", Came::Invalid, "key"),
        ("map/main/ask/where", Came::Invalid, "key"),
        ("", Came::Invalid, "key"),
        (longer.as_str(), Came::Invalid, "key"),
    ];
    let named = |key: &str| format!("key {:.60}", format!("{key:?}"));
    let mut all: Vec<Case> = rows
        .into_iter()
        .map(|(rest, came, told)| case(named(rest), Fed::Key(format!("toponym/v1/lab/{rest}")), came, told))
        .collect();
    for key in [
        "toponym/v1/labor/robot/r07/say",
        "toponym/v1/lab",
        "toponym/v1/*/robot/r07/say",
        "toponym/v2/lab/robot/r07/say",
        "toponym/v1/robot/r07/say",
        "/toponym/v1/lab/robot/r07/say",
        " toponym/v1/lab/robot/r07/say",
        "TOPONYM/v1/lab/robot/r07/say",
        "another/application",
    ] {
        all.push(case(named(key), Fed::Key(key.into()), Came::Invalid, "key"));
    }
    all
}

fn selectors() -> Vec<Case> {
    let numbered = (0..1000).fold(String::new(), |mut text, k| {
        let _ = write!(text, "a{k}=;");
        text
    });
    let longest = format!("name={}", "a".repeat(8192 - 5));
    let rows = [
        ("nothing", "", Came::Taken, "{}"),
        ("separators alone", ";;;;", Came::Taken, "{}"),
        ("a name alone", "name", Came::Taken, "{\"name\": \"\"}"),
        ("a value alone", "=gym", Came::Taken, "{\"\": \"gym\"}"),
        ("two equals", "name=a=b", Came::Taken, "a=b"),
        ("an ampersand", "name=a&robot=b", Came::Taken, "{\"name\": \"a&robot=b\"}"),
        ("an escaped zero", "name=%00", Came::Taken, "\\0"),
        ("an escaped separator", "name=a%3Bb%3Dc", Came::Taken, "a;b=c"),
        ("a percent", "name=%", Came::Invalid, "selector"),
        ("a percent and a digit", "name=%4", Came::Invalid, "selector"),
        ("a percent at the end", "name=gym%", Came::Invalid, "selector"),
        ("no hexadecimal", "name=%zz", Came::Invalid, "selector"),
        ("a signed one", "name=%+1", Came::Invalid, "selector"),
        ("a percent before a letter of two bytes", "name=%ä", Came::Invalid, "selector"),
        ("half a letter", "name=%C3", Came::Invalid, "selector"),
        ("a byte that is no letter", "name=%FF", Came::Invalid, "selector"),
        ("half a surrogate", "name=%ED%A0%80", Came::Invalid, "selector"),
        ("a zero in two bytes", "name=%C0%80", Came::Invalid, "selector"),
        ("a bad name", "%=gym", Came::Invalid, "selector"),
        ("twice", "name=a;name=b", Came::Invalid, "name"),
        ("twice the same", "name=a;name=a", Came::Invalid, "name"),
        ("twice, once escaped", "name=a;n%61me=b", Came::Invalid, "name"),
        ("no name twice", "=a;=b", Came::Invalid, ""),
        ("1000 of them", numbered.as_str(), Came::Taken, "a999"),
        ("1000 twice", &format!("{numbered}a0="), Came::Invalid, "a0"),
        ("8 KiB", longest.as_str(), Came::Taken, ""),
        ("8 KiB and a byte", &format!("{longest}a"), Came::Invalid, "selector"),
        ("a MiB of percents", &"%".repeat(1 << 20), Came::Invalid, "selector"),
    ];
    let case = |(name, text, came, told): (&str, &str, Came, &str)| {
        case(format!("selector: {name}"), Fed::Selector(text.into(), Vec::new()), came, told)
    };
    rows.into_iter().map(case).collect()
}

fn payloads() -> Vec<Case> {
    let deep = format!("{{\"name\":{}{}}}", "[".repeat(3000), "]".repeat(3000));
    let long = format!("{{\"name\":\"{}\"}}", "a".repeat(8192));
    let rows: [(&str, &str, &[u8], Came, &str); 17] = [
        ("white space", "", b" \n", Came::Taken, "{}"),
        ("a number", "", b"{\"resolution_m\": 0.1}", Came::Taken, "0.1"),
        ("a flag", "", b"{\"name\": true}", Came::Taken, "true"),
        ("another's name", "name=a", b"{\"name\": \"b\"}", Came::Invalid, "name"),
        ("a name twice", "", b"{\"name\": \"a\", \"name\": \"b\"}", Came::Invalid, "name"),
        ("null", "", b"{\"name\": null}", Came::Invalid, "name"),
        ("a list", "", b"{\"name\": [\"a\"]}", Came::Invalid, "name"),
        ("an object", "", b"{\"name\": {}}", Came::Invalid, "name"),
        ("no object", "", b"[\"name\"]", Came::Invalid, "payload"),
        ("a string", "", b"\"name\"", Came::Invalid, "payload"),
        ("half an object", "", b"{\"name\": ", Came::Invalid, "payload"),
        ("two objects", "", b"{}{}", Came::Invalid, "payload"),
        ("no UTF-8", "", b"{\"name\": \"\xff\"}", Came::Invalid, "payload"),
        ("NaN", "", b"{\"resolution_m\": NaN}", Came::Invalid, "payload"),
        ("a number too large", "", b"{\"resolution_m\": 1e400}", Came::Invalid, "payload"),
        ("3000 deep", "", deep.as_bytes(), Came::Invalid, "payload"),
        ("more than 8 KiB", "", long.as_bytes(), Came::Invalid, "selector"),
    ];
    let case = |(name, text, payload, came, told): (&str, &str, &[u8], Came, &str)| {
        case(format!("payload: {name}"), Fed::Selector(text.into(), payload.to_vec()), came, told)
    };
    rows.into_iter().map(case).collect()
}
