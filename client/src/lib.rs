//! # toponym
//!
//! Client library of the toponym mapping server.

pub mod sim;
