//! # toponym-server
//!
//! The shell round `toponym-core`: everything with a clock, a file, a thread or a network in it.
//!
//! - [`serve`]: the mapping server over Zenoh; [`config`]: its settings; [`store`]: saved maps.
//! - [`convert`]: between the wire's types and the core's.

pub mod config;
pub mod convert;
pub mod serve;
pub mod store;
