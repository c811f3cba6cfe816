//! # toponym-proto
//!
//! Keys, wire types, limits and validation of toponym: the only place that rejects input. The
//! normative text is `proto/PROTOCOL.md`. No network and no clock here; [`record`] reads and
//! writes what implements `std::io`.
//!
//! - [`stream`]: what robots and guides send; [`codec`] turns it into bytes and back,
//!   [`validate`] refuses what is wrong with it.
//! - [`answer`] and [`feedback`]: what the server says; [`selector`]: the arguments of a question.
//! - [`limits`]: all of them.
//! - [`keys`]: where all of it is on the network.
//! - [`sequence`] and [`merge`]: into which order a robot's streams and a guide's sentences are
//!   brought, on the network and offline alike; [`record`]: that order in a file.

pub mod answer;
pub mod codec;
pub mod feedback;
pub mod frame;
pub mod grid;
pub mod keys;
pub mod limits;
pub mod merge;
pub mod record;
pub mod regions;
pub mod selector;
pub mod sequence;
pub mod stream;
pub mod validate;
mod wire;

pub use codec::Refused;
pub use keys::Keys;
pub use limits::Limits;
pub use stream::{Clock, End, Header, Hearing, Laser, Mend, Message, Odom, Pose, Say, Scan, Setup, Stamp};
pub use validate::Invalid;
