//! ROS 2's messages, as far as they are used; fields are named and ordered as there.

use serde::{Deserialize, Serialize};

/// `builtin_interfaces/msg/Time`
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct Time {
    /// Seconds.
    pub sec: i32,
    /// Nanoseconds.
    pub nanosec: u32,
}

impl Time {
    /// Nanoseconds since its clock's zero.
    pub fn ns(self) -> i64 {
        i64::from(self.sec) * 1_000_000_000 + i64::from(self.nanosec)
    }
}

/// `std_msgs/msg/Header`
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Header {
    /// When.
    pub stamp: Time,
    /// In which frame.
    pub frame_id: String,
}

/// `sensor_msgs/msg/LaserScan`
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct LaserScan {
    /// Stamp of the first ray, frame of the laser.
    pub header: Header,
    /// Bearing of the first ray, radians.
    pub angle_min: f32,
    /// Often one step off: rays are counted by `ranges`.
    pub angle_max: f32,
    /// Radians; may be negative.
    pub angle_increment: f32,
    /// Seconds from ray to ray.
    pub time_increment: f32,
    /// Seconds from scan to scan.
    pub scan_time: f32,
    /// Metres.
    pub range_min: f32,
    /// Metres.
    pub range_max: f32,
    /// Metres.
    pub ranges: Vec<f32>,
    /// May be empty.
    pub intensities: Vec<f32>,
}

/// `geometry_msgs/msg/Vector3`, and `Point`
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[allow(missing_docs, reason = "axes")]
pub struct Vector3 {
    pub x: f64,
    pub y: f64,
    pub z: f64,
}

/// `geometry_msgs/msg/Quaternion`
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[allow(missing_docs, reason = "axes")]
pub struct Quaternion {
    pub x: f64,
    pub y: f64,
    pub z: f64,
    pub w: f64,
}

impl Default for Quaternion {
    fn default() -> Self {
        Self { x: 0.0, y: 0.0, z: 0.0, w: 1.0 }
    }
}

/// `geometry_msgs/msg/Pose`
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Pose {
    /// Metres.
    pub position: Vector3,
    /// Unit.
    pub orientation: Quaternion,
}

/// `geometry_msgs/msg/PoseWithCovariance`
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct PoseWithCovariance {
    /// Where.
    pub pose: Pose,
    /// x, y, z, about x, y, z; row by row.
    pub covariance: [[f64; 6]; 6],
}

/// `geometry_msgs/msg/TwistWithCovariance`
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct TwistWithCovariance {
    /// Metres a second.
    pub linear: Vector3,
    /// Radians a second.
    pub angular: Vector3,
    /// Row by row.
    pub covariance: [[f64; 6]; 6],
}

/// `nav_msgs/msg/Odometry`
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Odometry {
    /// Frame of the pose.
    pub header: Header,
    /// Frame of the twist: the body.
    pub child_frame_id: String,
    /// Of the child in the header's frame.
    pub pose: PoseWithCovariance,
    /// In the child's frame.
    pub twist: TwistWithCovariance,
}

/// `geometry_msgs/msg/Transform`
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Transform {
    /// Metres.
    pub translation: Vector3,
    /// Unit.
    pub rotation: Quaternion,
}

/// `geometry_msgs/msg/TransformStamped`
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct TransformStamped {
    /// When, and the parent.
    pub header: Header,
    /// The child.
    pub child_frame_id: String,
    /// Of the child in the parent.
    pub transform: Transform,
}

/// `tf2_msgs/msg/TFMessage`
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct TFMessage {
    /// One for each pair of frames.
    pub transforms: Vec<TransformStamped>,
}

/// `std_msgs/msg/String`
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct StringMsg {
    /// Text.
    pub data: String,
}

/// `rosgraph_msgs/msg/Clock`
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Clock {
    /// Simulated time.
    pub clock: Time,
}
