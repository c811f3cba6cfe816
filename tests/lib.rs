//! End-to-end tests live in `end_to_end/`; here is what they and the programs share.

pub mod ros_robot;
