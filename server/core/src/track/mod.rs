//! One robot's streams, up to the places they make.

pub mod front;
mod local;
pub mod odometry;
mod wheels;
