//! Arguments of a query: `name=lecture%20hall;robot=r07`, or the same as a JSON object.

use crate::limits::ARGUMENTS_MAX_BYTES;
use crate::validate::Invalid;
use serde::de::{Deserialize, Deserializer, MapAccess, Visitor};
use std::collections::BTreeMap;
use std::fmt::Formatter;

/// Arguments by name.
pub type Arguments = BTreeMap<String, String>;

/// Writes arguments, percent-encoded, for the part of a selector after `?`.
pub fn encode<'a>(arguments: impl IntoIterator<Item = (&'a str, &'a str)>) -> String {
    let pairs: Vec<String> =
        arguments.into_iter().map(|(k, v)| format!("{}={}", escape(k), escape(v))).collect();
    pairs.join(";")
}

fn escape(text: &str) -> String {
    let plain = |b: u8| b.is_ascii_alphanumeric() || matches!(b, b'-' | b'_' | b'.' | b'~');
    text.bytes().map(|b| if plain(b) { char::from(b).to_string() } else { format!("%{b:02X}") }).collect()
}

/// Reads percent-encoding.
///
/// # Errors
/// If it is none, or not of UTF-8.
pub fn unescape(text: &str) -> Result<String, Invalid> {
    let bad = || Invalid::new("selector", format!("{text:?} is not percent-encoded UTF-8"));
    let mut bytes = Vec::with_capacity(text.len());
    let mut rest = text.as_bytes();
    while let Some((&b, tail)) = rest.split_first() {
        rest = tail;
        if b != b'%' {
            bytes.push(b);
            continue;
        }
        let (hex, tail) = tail.split_at_checked(2).ok_or_else(bad)?;
        let digit = |d: u8| char::from(d).to_digit(16).ok_or_else(bad);
        bytes.push((digit(hex[0])? * 16 + digit(hex[1])?) as u8);
        rest = tail;
    }
    String::from_utf8(bytes).map_err(|_| bad())
}

/// Reads the arguments of a query: from the selector and, if there is one, from a payload, a flat
/// JSON object of strings, numbers and booleans. None may come twice.
pub fn decode(selector: &str, payload: &[u8]) -> Result<Arguments, Invalid> {
    if selector.len() + payload.len() > ARGUMENTS_MAX_BYTES {
        return Err(Invalid::new("selector", format!("is longer than {ARGUMENTS_MAX_BYTES} bytes")));
    }
    let mut arguments = Arguments::new();
    let mut add = |name: String, value: String| match arguments.insert(name.clone(), value) {
        None => Ok(()),
        Some(_) => Err(Invalid::new(&name, "comes twice")),
    };
    for pair in selector.split(';').filter(|p| !p.is_empty()) {
        let (name, value) = pair.split_once('=').unwrap_or((pair, ""));
        add(unescape(name)?, unescape(value)?)?;
    }
    if payload.iter().all(u8::is_ascii_whitespace) {
        return Ok(arguments);
    }
    let Pairs(pairs) = serde_json::from_slice(payload)
        .map_err(|e| Invalid::new("payload", format!("is not a JSON object: {e}")))?;
    for (name, value) in pairs {
        let text = match value {
            serde_json::Value::String(text) => text,
            serde_json::Value::Number(number) => number.to_string(),
            serde_json::Value::Bool(flag) => flag.to_string(),
            _ => return Err(Invalid::new(&name, "must be a string, a number or a boolean")),
        };
        add(name, text)?;
    }
    Ok(arguments)
}

/// A JSON object as it is written: a map would keep the last of two values with one name.
struct Pairs(Vec<(String, serde_json::Value)>);

impl<'de> Deserialize<'de> for Pairs {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_map(Self(Vec::new()))
    }
}

impl<'de> Visitor<'de> for Pairs {
    type Value = Self;

    fn expecting(&self, f: &mut Formatter<'_>) -> std::fmt::Result {
        f.write_str("an object")
    }

    fn visit_map<A: MapAccess<'de>>(mut self, mut map: A) -> Result<Self, A::Error> {
        while let Some(pair) = map.next_entry()? {
            self.0.push(pair);
        }
        Ok(self)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn any_text_survives(name in ".{1,9}", value in ".{0,20}") {
            let text = encode([(name.as_str(), value.as_str())]);
            prop_assert!(text.is_ascii());
            prop_assert_eq!(decode(&text, b"").unwrap(), Arguments::from([(name, value)]));
        }

        #[test]
        fn any_selector_is_read_or_refused(text in ".{0,40}") {
            let _ = decode(&text, b"");
        }
    }

    #[test]
    fn selector_and_payload_are_one() {
        let got = decode("name=lecture%20hall", br#"{"robot": "r07", "resolution_m": 0.1}"#).unwrap();
        let want = [("name", "lecture hall"), ("robot", "r07"), ("resolution_m", "0.1")];
        assert_eq!(got, want.map(|(k, v)| (k.to_string(), v.to_string())).into());
    }

    #[test]
    fn bad_arguments_are_named() {
        for (selector, payload, field) in [
            ("name=%", "", "selector"),
            ("name=%ff", "", "selector"),
            ("name=a;name=b", "", "name"),
            ("name=a", r#"{"name": "b"}"#, "name"),
            ("", r#"{"name": ["b"]}"#, "name"),
            ("", r#"{"name": "#, "payload"),
        ] {
            assert_eq!(
                decode(selector, payload.as_bytes()).unwrap_err().field,
                field,
                "{selector} {payload}"
            );
        }
    }
}
