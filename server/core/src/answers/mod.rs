//! Answers: the posterior at one moment, and what it is asked.

pub mod areas;
pub mod around;
pub mod constraints;
pub mod described;
pub mod differences;
mod meaning;
pub mod named;
pub mod query;
pub mod snapshot;
pub mod spoken;
pub mod trajectory;
pub mod whereabouts;
