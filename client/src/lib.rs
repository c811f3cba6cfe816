//! # toponym
//!
//! Client library of the toponym mapping server.

pub mod log;
pub mod sim;
