//! How values look on the wire where that differs from Rust: times, ranges, flat headers.

use serde::{Deserialize, Deserializer, Serialize, Serializer};

const NS_PER_S: i64 = 1_000_000_000;

/// A time: nanoseconds, on the wire `{"sec", "nanosec"}` in JSON and a bare i64 in bincode.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Stamp {
    /// Nanoseconds since the clock's own zero.
    pub ns: i64,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct RosTime {
    sec: i64,
    nanosec: u32,
}

impl Stamp {
    /// From seconds; rounds to nanoseconds, saturates beyond ± 292 years.
    pub fn from_seconds(s: f64) -> Self {
        let whole = s.floor();
        let fraction_ns = ((s - whole) * 1e9).round() as i64;
        Self { ns: (whole as i64).saturating_mul(NS_PER_S).saturating_add(fraction_ns) }
    }

    /// Seconds.
    pub fn seconds(self) -> f64 {
        self.ns.div_euclid(NS_PER_S) as f64 + self.ns.rem_euclid(NS_PER_S) as f64 / 1e9
    }
}

impl Serialize for Stamp {
    fn serialize<S: Serializer>(&self, s: S) -> Result<S::Ok, S::Error> {
        if !s.is_human_readable() {
            return self.ns.serialize(s);
        }
        RosTime { sec: self.ns.div_euclid(NS_PER_S), nanosec: self.ns.rem_euclid(NS_PER_S) as u32 }
            .serialize(s)
    }
}

impl<'de> Deserialize<'de> for Stamp {
    fn deserialize<D: Deserializer<'de>>(d: D) -> Result<Self, D::Error> {
        if !d.is_human_readable() {
            return Ok(Self { ns: i64::deserialize(d)? });
        }
        let t = RosTime::deserialize(d)?;
        if i64::from(t.nanosec) >= NS_PER_S {
            return Err(serde::de::Error::custom(format!(
                "nanosec is {}, must be below 1000000000",
                t.nanosec
            )));
        }
        t.sec
            .checked_mul(NS_PER_S)
            .and_then(|s| s.checked_add(i64::from(t.nanosec)))
            .map(|ns| Self { ns })
            .ok_or_else(|| serde::de::Error::custom(format!("sec {} is out of range", t.sec)))
    }
}

/// Ranges: f32 in bincode; in JSON `null` stands for NaN, and ±`f32::MAX` for ±infinity, which
/// JSON can't write.
pub(crate) mod ranges {
    use serde::{Deserialize, Deserializer, Serializer};

    pub fn serialize<S: Serializer>(ranges_m: &impl AsRef<[f32]>, s: S) -> Result<S::Ok, S::Error> {
        let ranges_m = ranges_m.as_ref();
        if !s.is_human_readable() {
            return s.collect_seq(ranges_m);
        }
        s.collect_seq(ranges_m.iter().map(|r| (!r.is_nan()).then(|| r.clamp(f32::MIN, f32::MAX))))
    }

    pub fn deserialize<'de, D: Deserializer<'de>>(d: D) -> Result<Vec<f32>, D::Error> {
        if !d.is_human_readable() {
            return Vec::deserialize(d);
        }
        Ok(Vec::<Option<f32>>::deserialize(d)?
            .into_iter()
            .map(|r| match r {
                None => f32::NAN,
                Some(r) if r >= f32::MAX => f32::INFINITY,
                Some(r) if r <= f32::MIN => f32::NEG_INFINITY,
                Some(r) => r,
            })
            .collect())
    }
}

/// Declares a message with a [`crate::Header`]: `header` in Rust, its fields side by side with
/// the message's own on the wire. (serde's `flatten` would do so for JSON, but neither works with
/// bincode nor refuses unknown fields.)
macro_rules! with_header {
    (
        $(#[$meta:meta])*
        $name:ident { $($(#[$doc:meta])* $field:ident: $type:ty $([$serde:meta])?,)* }
    ) => {
        $(#[$meta])*
        #[derive(Clone, Debug, PartialEq)]
        pub struct $name {
            /// Who, when, in which order.
            pub header: $crate::stream::Header,
            $($(#[$doc])* pub $field: $type,)*
        }

        const _: () = {
            use serde::{Deserialize, Deserializer, Serialize, Serializer};

            #[derive(Serialize)]
            struct Written<'a> {
                robot: &'a str,
                boot: u64,
                seq: u64,
                stamp: $crate::stream::Stamp,
                clock: $crate::stream::Clock,
                $($(#[$serde])? $field: &'a $type,)*
            }

            #[derive(Deserialize)]
            #[serde(deny_unknown_fields)]
            struct Read {
                robot: String,
                boot: u64,
                seq: u64,
                stamp: $crate::stream::Stamp,
                #[serde(default)]
                clock: $crate::stream::Clock,
                $($(#[$serde])? $field: $type,)*
            }

            impl Serialize for $name {
                fn serialize<S: Serializer>(&self, s: S) -> Result<S::Ok, S::Error> {
                    Written {
                        robot: &self.header.robot,
                        boot: self.header.boot,
                        seq: self.header.seq,
                        stamp: self.header.stamp,
                        clock: self.header.clock,
                        $($field: &self.$field,)*
                    }
                    .serialize(s)
                }
            }

            impl<'de> Deserialize<'de> for $name {
                fn deserialize<D: Deserializer<'de>>(d: D) -> Result<Self, D::Error> {
                    let read = Read::deserialize(d)?;
                    Ok(Self {
                        header: $crate::stream::Header {
                            robot: read.robot,
                            boot: read.boot,
                            seq: read.seq,
                            stamp: read.stamp,
                            clock: read.clock,
                        },
                        $($field: read.$field,)*
                    })
                }
            }
        };
    };
}
pub(crate) use with_header;

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn a_stamp_survives_json(ns in any::<i64>()) {
            let text = serde_json::to_string(&Stamp { ns }).unwrap();
            prop_assert_eq!(serde_json::from_str::<Stamp>(&text).unwrap(), Stamp { ns });
        }

        #[test]
        fn seconds_round_to_nanoseconds(ms in -1_000_000_000_000_i64..1_000_000_000_000) {
            let s = Stamp { ns: ms * 1_000_000 };
            prop_assert!((Stamp::from_seconds(s.seconds()).ns - s.ns).abs() < 1_000);
        }
    }

    #[test]
    fn a_stamp_refuses_what_is_no_time() {
        assert!(serde_json::from_str::<Stamp>(r#"{"sec": 1, "nanosec": 1000000000}"#).is_err());
        assert!(serde_json::from_str::<Stamp>(r#"{"sec": 9223372036854775807, "nanosec": 0}"#).is_err());
        assert_eq!(Stamp::from_seconds(1e300).ns, i64::MAX);
    }
}
