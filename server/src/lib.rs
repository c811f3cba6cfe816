//! # toponym-server
//!
//! The shell round `toponym-core`: everything with a clock, a file, a thread or a network in it.
//!
//! - [`serve`]: the mapping server over Zenoh; [`config`]: its settings; [`fold`]: a map as a fold of its journal;
//!   [`store`]: the journals; [`journals`]: their command line.
//! - [`map`]: recorded logs through the same core, offline; [`demo`]: all of it at once.
//! - [`picture`]: maps as PNG and SVG; [`export`]: in the forms of others.
//! - [`access`]: who may do what.
//! - [`convert`]: between the wire's types and the core's.

pub mod access;
pub mod config;
pub mod convert;
pub mod demo;
pub mod export;
pub mod fold;
pub mod journals;
pub mod map;
pub mod picture;
pub mod serve;
pub mod store;
pub mod web;
