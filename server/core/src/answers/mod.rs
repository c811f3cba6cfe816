//! Answers: the posterior at one moment, and what it is asked.

pub mod differences;
pub mod grid;
pub mod query;
pub mod snapshot;
pub mod trajectory;
pub mod whereabouts;
