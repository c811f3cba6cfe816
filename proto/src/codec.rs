//! Bytes to messages and back: JSON, or bincode behind a version and a type byte.

use crate::keys::Input;
use crate::limits::{BOOT_MAX, Limits, SEQ_MAX};
use crate::stream::{End, Message, Odom, Say, Scan, Setup};
use crate::validate::Invalid;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

/// Zenoh encoding of JSON payloads.
pub const ENCODING_JSON: &str = "application/json";
/// A picture.
pub const ENCODING_PNG: &str = "image/png";
/// Zenoh encoding of bincode payloads.
pub const ENCODING_BINCODE: &str = "application/x-toponym";
/// First byte of a bincode payload.
pub const VERSION: u8 = 1;

/// bincode: little-endian, fixed-width integers, 64-bit lengths.
const FORMAT: bincode::config::Configuration<bincode::config::LittleEndian, bincode::config::Fixint> =
    bincode::config::standard().with_fixed_int_encoding();
/// The decoder never allocates more than this, whatever lengths a payload claims.
const ALLOCATION_MAX_BYTES: usize = 16 << 20;

/// Why a payload is refused.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Refused {
    /// Longer than the limit.
    #[error("payload of {bytes} bytes, at most {max} are taken")]
    TooLarge {
        /// Its length.
        bytes: usize,
        /// The limit.
        max: usize,
    },
    /// Not what it claims to be.
    #[error("{0}")]
    Malformed(String),
    /// A value out of its range.
    #[error(transparent)]
    Invalid(#[from] Invalid),
}

impl Message {
    /// Type byte of the bincode form; a type that changes gets a new one.
    pub fn type_id(&self) -> u8 {
        match self {
            Self::Setup(_) => 1,
            Self::Odom(_) => 2,
            Self::Scan(_) => 3,
            Self::Say(_) => 4,
            Self::End(_) => 5,
            Self::Mend(_) => 6,
        }
    }

    /// The bincode form: version byte, type byte, fields.
    pub fn to_bincode(&self) -> Result<Vec<u8>, Refused> {
        let mut bytes = vec![VERSION, self.type_id()];
        match self {
            Self::Setup(m) => append(&mut bytes, m),
            Self::Odom(m) => append(&mut bytes, m),
            Self::Scan(m) => append(&mut bytes, m),
            Self::Say(m) => append(&mut bytes, m),
            Self::End(m) => append(&mut bytes, m),
            Self::Mend(m) => append(&mut bytes, m),
        }?;
        Ok(bytes)
    }

    /// The JSON form, as published: without a `type`, which the key tells.
    pub fn to_json(&self) -> Result<Vec<u8>, Refused> {
        match self {
            Self::Setup(m) => serde_json::to_vec(m),
            Self::Odom(m) => serde_json::to_vec(m),
            Self::Scan(m) => serde_json::to_vec(m),
            Self::Say(m) => serde_json::to_vec(m),
            Self::End(m) => serde_json::to_vec(m),
            Self::Mend(m) => serde_json::to_vec(m),
        }
        .map_err(|e| Refused::Malformed(e.to_string()))
    }

    /// Reads the bincode form and validates it.
    pub fn from_bincode(bytes: &[u8], limits: &Limits) -> Result<Self, Refused> {
        check_size(bytes, limits)?;
        let message = match bytes {
            [VERSION, 1, body @ ..] => Self::Setup(parse(body)?),
            [VERSION, 2, body @ ..] => Self::Odom(parse(body)?),
            [VERSION, 3, body @ ..] => Self::Scan(parse(body)?),
            [VERSION, 4, body @ ..] => Self::Say(parse(body)?),
            [VERSION, 5, body @ ..] => Self::End(parse(body)?),
            [VERSION, 6, body @ ..] => Self::Mend(parse(body)?),
            [VERSION, id, ..] => return Err(Refused::Malformed(format!("unknown type id {id}"))),
            [version, _, ..] => {
                return Err(Refused::Malformed(format!("version {version}, this build reads {VERSION}")));
            }
            _ => return Err(Refused::Malformed(format!("{} bytes are no message", bytes.len()))),
        };
        message.validate(limits)?;
        Ok(message)
    }

    /// Reads what came on a key and validates it. `encoding` is Zenoh's: JSON if it says so, or
    /// if it says nothing and the payload begins with a brace; else bincode.
    pub fn decode(input: &Input, encoding: &str, bytes: &[u8], limits: &Limits) -> Result<Self, Refused> {
        check_size(bytes, limits)?;
        if !is_json(encoding, bytes) {
            let message = Self::from_bincode(bytes, limits)?;
            return if message.fits(input) {
                Ok(message)
            } else {
                Err(Refused::Malformed(format!("type id {} does not belong on this key", message.type_id())))
            };
        }
        let message = match input {
            Input::Setup => Self::Setup(parse_json::<Setup>(bytes)?),
            Input::Odom => Self::Odom(parse_json::<Odom>(bytes)?),
            Input::Scan { .. } => Self::Scan(parse_json::<Scan>(bytes)?),
            Input::Say => Self::Say(parse_json::<Say>(bytes)?),
            Input::End => Self::End(parse_json::<End>(bytes)?),
        };
        message.validate(limits)?;
        Ok(message)
    }

    fn fits(&self, input: &Input) -> bool {
        matches!(
            (input, self),
            (Input::Setup, Self::Setup(_))
                | (Input::Odom, Self::Odom(_))
                | (Input::Scan { .. }, Self::Scan(_))
                | (Input::Say, Self::Say(_))
                | (Input::End, Self::End(_))
        )
    }
}

/// Place in its robot's stream, (boot, seq), of a message that could not be read otherwise; none if that can't be
/// read either.
pub fn place_of(encoding: &str, bytes: &[u8]) -> Option<(u64, u64)> {
    #[derive(Deserialize)]
    struct Place {
        boot: u64,
        seq: u64,
    }
    let (boot, seq) = if is_json(encoding, bytes) {
        let place: Place = serde_json::from_slice(bytes).ok()?;
        (place.boot, place.seq)
    } else {
        let [VERSION, _, body @ ..] = bytes else { return None };
        let format = FORMAT.with_limit::<ALLOCATION_MAX_BYTES>();
        let read = bincode::serde::decode_from_slice::<(String, u64, u64), _>(body, format);
        let ((_, boot, seq), _) = read.ok()?;
        (boot, seq)
    };
    (boot <= BOOT_MAX && seq <= SEQ_MAX).then_some((boot, seq))
}

fn check_size(bytes: &[u8], limits: &Limits) -> Result<(), Refused> {
    if bytes.len() > limits.payload_bytes {
        return Err(Refused::TooLarge { bytes: bytes.len(), max: limits.payload_bytes });
    }
    Ok(())
}

fn is_json(encoding: &str, bytes: &[u8]) -> bool {
    if encoding.starts_with(ENCODING_JSON) || encoding.starts_with("text/") {
        return true;
    }
    encoding != ENCODING_BINCODE && bytes.iter().find(|b| !b.is_ascii_whitespace()) == Some(&b'{')
}

fn append<T: Serialize>(bytes: &mut Vec<u8>, body: &T) -> Result<(), Refused> {
    let body = bincode::serde::encode_to_vec(body, FORMAT).map_err(|e| Refused::Malformed(e.to_string()))?;
    bytes.extend(body);
    Ok(())
}

fn parse<T: DeserializeOwned>(body: &[u8]) -> Result<T, Refused> {
    let format = FORMAT.with_limit::<ALLOCATION_MAX_BYTES>();
    let (value, read) = bincode::serde::decode_from_slice(body, format)
        .map_err(|e| Refused::Malformed(format!("not the bincode that its type byte claims: {e}")))?;
    if read != body.len() {
        return Err(Refused::Malformed(format!("{} bytes too many at the end", body.len() - read)));
    }
    Ok(value)
}

fn parse_json<T: DeserializeOwned>(bytes: &[u8]) -> Result<T, Refused> {
    serde_json::from_slice(bytes).map_err(|e| {
        let non_finite = bytes.windows(3).any(|w| w == b"NaN" || w == b"Inf");
        let hint = if e.is_syntax() && non_finite {
            "; JSON knows neither NaN nor Infinity: send null for no information, and any number at or \
             above range_max_m for nothing seen"
        } else {
            ""
        };
        Refused::Malformed(format!("JSON: {e}{hint}"))
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stream::{Clock, Header, Laser, Pose, Stamp};
    use proptest::prelude::*;

    /// Any time is within this of 0.
    const STAMP_NS: i64 = 4_000_000_000_000_000_000;

    fn header() -> impl Strategy<Value = Header> {
        ("[a-z0-9][a-z0-9_-]{0,8}", 0..BOOT_MAX, 0..SEQ_MAX, -STAMP_NS..STAMP_NS).prop_map(
            |(robot, boot, seq, ns)| Header {
                robot: format!("r{robot}"),
                boot,
                seq,
                stamp: Stamp { ns },
                clock: Clock::Log,
            },
        )
    }

    fn message() -> impl Strategy<Value = Message> {
        let range = prop_oneof![Just(f32::INFINITY), Just(f32::NEG_INFINITY), 0.0_f32..100.0];
        let lasers = vec![Laser {
            id: "front".into(),
            x_m: 0.1,
            y_m: -0.2,
            yaw_rad: 3.0,
            upside_down: true,
            range_min_m: 0.0,
            range_max_m: 80.0,
            ignored_rad: vec![(-0.5, 0.5)],
        }];
        prop_oneof![
            header().prop_map(move |header| Message::Setup(Setup {
                header,
                map: "main".into(),
                lasers: lasers.clone()
            })),
            // Sixteenths: the JSON reader may be off by one unit in the last place otherwise.
            (header(), any::<i16>(), -64..64_i16).prop_map(|(header, x, yaw)| {
                let (x_m, yaw_rad) = (f64::from(x) / 16.0, f64::from(yaw) / 16.0);
                Message::Odom(Odom { header, odom_from_body: Pose { x_m, y_m: -x_m, yaw_rad } })
            }),
            (header(), prop::collection::vec(range, 0..20)).prop_map(|(header, ranges_m)| Message::Scan(
                Scan {
                    header,
                    laser: "front".into(),
                    angle_min_rad: -1.0,
                    angle_increment_rad: 0.01,
                    time_increment_s: 0.0,
                    ranges_m
                }
            )),
            header().prop_map(|header| Message::End(End { header })),
            (".{0,9}x", prop::option::of(-STAMP_NS..STAMP_NS)).prop_map(|(text, ns)| Message::Say(Say {
                id: "01J".into(),
                text,
                began: ns.map(|ns| Stamp { ns }),
                ..Default::default()
            })),
        ]
    }

    fn input_of(m: &Message) -> Input {
        match m {
            Message::Setup(_) => Input::Setup,
            Message::Odom(_) => Input::Odom,
            Message::Scan(s) => Input::Scan { laser: s.laser.clone() },
            Message::Say(_) => Input::Say,
            Message::End(_) => Input::End,
            Message::Mend(_) => unreachable!("has no key"),
        }
    }

    proptest! {
        #[test]
        fn both_forms_survive(m in message()) {
            let limits = Limits::default();
            let bytes = m.to_bincode().unwrap();
            prop_assert_eq!(&Message::decode(&input_of(&m), ENCODING_BINCODE, &bytes, &limits).unwrap(), &m);
            prop_assert_eq!(&Message::decode(&input_of(&m), "zenoh/bytes", &bytes, &limits).unwrap(), &m);
            let json = m.to_json().unwrap();
            prop_assert_eq!(&Message::decode(&input_of(&m), ENCODING_JSON, &json, &limits).unwrap(), &m);
            prop_assert_eq!(&Message::decode(&input_of(&m), "zenoh/bytes", &json, &limits).unwrap(), &m);
        }

        #[test]
        fn what_is_mended_survives_a_record(text in "[a-z ]{0,9}x", how in 0..4) {
            use crate::stream::Mend;
            let polygon_m = vec![[0.0, 0.0], [4.0, 0.0], [4.0, -1e6]];
            let m = Message::Mend(match how {
                0 => Mend::Undo { id: Some(text) },
                1 => Mend::Rename { from: text, to: "gym".into() },
                2 => Mend::Area { id: text, polygon_m, name: None, instead: false, forbidden: true },
                _ => Mend::Forget { name: text },
            });
            let bytes = m.to_bincode().unwrap();
            prop_assert_eq!(&Message::from_bincode(&bytes, &Limits::default()).unwrap(), &m);
            // It comes by a query, on no stream's key.
            prop_assert!(Message::decode(&Input::Say, ENCODING_BINCODE, &bytes, &Limits::default()).is_err());
        }

        #[test]
        fn garbage_is_refused_and_never_panics(bytes in prop::collection::vec(any::<u8>(), 0..200)) {
            let _ = Message::from_bincode(&bytes, &Limits::default());
            let claimed: Vec<u8> = [VERSION, 3].into_iter().chain(bytes).collect();
            let _ = Message::from_bincode(&claimed, &Limits::default());
        }

        #[test]
        fn a_cut_or_lengthened_message_is_refused(m in message(), cut in 1_usize..10) {
            let mut bytes = m.to_bincode().unwrap();
            let keep = bytes.len().saturating_sub(cut);
            prop_assert!(Message::from_bincode(&bytes[..keep], &Limits::default()).is_err());
            bytes.push(0);
            prop_assert!(Message::from_bincode(&bytes, &Limits::default()).is_err());
        }
    }

    #[test]
    fn a_length_that_lies_does_not_allocate() {
        // Robot name of 2^62 bytes.
        let bytes: Vec<u8> = [VERSION, 2].into_iter().chain((1_u64 << 62).to_le_bytes()).collect();
        assert!(matches!(Message::from_bincode(&bytes, &Limits::default()), Err(Refused::Malformed(_))));
    }

    #[test]
    fn json_is_flat_and_null_is_no_information() {
        let text = br#"{"robot":"r1","boot":0,"seq":3,"stamp":{"sec":1,"nanosec":5},"laser":"a",
            "angle_min_rad":0,"angle_increment_rad":0.1,"ranges_m":[1.5,null,1e39]}"#;
        let input = Input::Scan { laser: "a".into() };
        let Message::Scan(scan) = Message::decode(&input, "", text, &Limits::default()).unwrap() else {
            panic!("not a scan")
        };
        assert_eq!((scan.header.seq, scan.header.stamp.ns), (3, 1_000_000_005));
        assert_eq!((scan.ranges_m[0], scan.ranges_m[2]), (1.5, f32::INFINITY));
        assert!(scan.ranges_m[1].is_nan());
    }

    #[test]
    fn refusals_say_why() {
        let why = |text: &str| {
            Message::decode(&Input::Odom, ENCODING_JSON, text.as_bytes(), &Limits::default())
                .unwrap_err()
                .to_string()
        };
        let odom = |pose: &str| {
            format!(
                r#"{{"robot":"r1","boot":0,"seq":0,"stamp":{{"sec":1,"nanosec":5}},"odom_from_body":{pose}}}"#
            )
        };
        assert!(why(&odom(r#"{"x_m":NaN,"y_m":0,"yaw_rad":0}"#)).contains("send null"));
        assert!(why(&odom(r#"{"x_m":0,"y_m":0,"yaw":0}"#)).contains("unknown field `yaw`"));
        assert!(why(&odom(r#"{"x_m":1e7,"y_m":0,"yaw_rad":0}"#)).contains("odom_from_body.x_m"));
        let small = Limits { payload_bytes: 4, ..Limits::default() };
        let refused = Message::decode(&Input::Odom, "", b"12345", &small).unwrap_err();
        assert_eq!(refused, Refused::TooLarge { bytes: 5, max: 4 });
    }

    #[test]
    fn the_place_of_a_bad_message_is_read() {
        let json = br#"{"robot": "R", "boot": 7, "seq": 9, "stamp": "now", "odom": []}"#;
        assert_eq!(place_of(ENCODING_JSON, json), Some((7, 9)));
        let mut bytes = vec![VERSION, 3];
        append(&mut bytes, &("R 1", 7_u64, 9_u64, "what is this")).unwrap();
        assert_eq!(place_of(ENCODING_BINCODE, &bytes), Some((7, 9)));
        for bad in [&b"{"[..], b"", &[VERSION, 3, 1], br#"{"boot": 9007199254740991, "seq": 1}"#] {
            assert_eq!(place_of("", bad), None);
        }
    }

    #[test]
    fn how_long_ago_it_was_said_is_told_in_json_alone() {
        let said =
            Message::Say(Say { id: "1".into(), text: "hi".into(), ago_s: Some(2.5), ..Default::default() });
        let decoded = |encoding, bytes: Vec<u8>| {
            let Message::Say(say) =
                Message::decode(&Input::Say, encoding, &bytes, &Limits::default()).unwrap()
            else {
                panic!("a sentence")
            };
            say.ago_s
        };
        assert_eq!(decoded(ENCODING_JSON, said.to_json().unwrap()), Some(2.5));
        assert_eq!(decoded(ENCODING_BINCODE, said.to_bincode().unwrap()), None);
    }

    #[test]
    fn a_type_on_the_wrong_key_is_refused() {
        let m = Message::Say(Say { id: "1".into(), text: "hi".into(), ..Default::default() });
        let bytes = m.to_bincode().unwrap();
        assert!(Message::decode(&Input::Odom, ENCODING_BINCODE, &bytes, &Limits::default()).is_err());
    }
}
