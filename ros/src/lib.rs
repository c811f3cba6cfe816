//! # toponym-ros
//!
//! Robots that speak ROS 2, and their bags. No ROS is needed.
//!
//! ```text
//! file ─ bag ─▶ topic, type, time, bytes ─ cdr, msg ─▶ LaserScan, TFMessage, … ─ plan ─▶ which of them are the robot
//!                                                                              ─ stream ─▶ Setup, Odom, Scan, Say
//! ```
//!
//! - [`msg`]: the messages used, in Rust; [`cdr`]: as bytes.
//! - [`bag`]: rosbag2 files and folders, MCAP or SQLite, compressed or not.
//! - [`frames`]: how a laser is mounted, and which transform is odometry.
//! - [`plan`]: what a stream of messages has to offer, and what of it is taken; [`stream`]: that as toponym's messages.
//! - [`wire`]: rmw_zenoh's keys, tokens and attachments; [`live`]: robots that speak it.
//! - [`shown`]: maps in messages that others show; [`definitions`]: what those look like, for files.
//! - [`log`]: a bag as a log, beside all other logs.

pub mod bag;
pub mod cdr;
pub mod definitions;
pub mod frames;
pub mod live;
pub mod log;
pub mod msg;
pub mod plan;
pub mod robot;
pub mod shown;
pub mod stream;
pub mod wire;
