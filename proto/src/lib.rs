//! # toponym-proto
//!
//! Keys, wire types, limits and validation of toponym: the only place that rejects input. The
//! normative text is `proto/PROTOCOL.md`. No I/O here.

pub mod stream;

pub use stream::{Clock, Header, Message, Odom, Pose, Say, Scan, Setup, Stamp};
