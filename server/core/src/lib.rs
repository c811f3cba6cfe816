//! # toponym-core
//!
//! The Rao-Blackwellized particle filter over semantic graphs of Walter et al. (RSS 2013), pure
//! and deterministic: no I/O, no clock, no global state; the same events, seed and build give
//! the same bits. See `server/ARCHITECTURE.md` for the paper ↔ module table.
//!
//! A [`Mapper`] owns one map. [`Mapper::step`] takes an [`Event`] and returns [`Effects`];
//! [`Mapper::answer`] answers a [`Query`] from the newest [`Snapshot`].
//!
//! Conventions (REP-103, REP-105): metres, radians, x forward, y left, yaw counter-clockwise in
//! (−π, π]. `a_from_b` maps coordinates in frame b to frame a. Every 3-vector and 3×3 matrix of
//! a pose is ordered x, y, yaw; covariances of poses are those of the right perturbation
//! `X·exp(δ)`, i.e. they live in the body's frame.

pub mod answers;
pub mod config;
pub mod edge;
pub mod effects;
pub mod event;
pub mod filter;
pub mod geometry;
pub mod graph;
pub mod language;
pub mod mapper;
pub mod random;
pub mod regions;
pub mod scan;
pub mod smoothing;
pub mod talk;
pub mod track;
pub mod trial;
mod wide;

pub use answers::query::{Answer, Query};
pub use answers::snapshot::Snapshot;
pub use config::Config;
pub use effects::{Effect, Effects};
pub use event::Event;
pub use geometry::Pose2;
pub use mapper::Mapper;
