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

impl From<i64> for Time {
    /// Of nanoseconds since its clock's zero.
    fn from(ns: i64) -> Self {
        let (sec, nanosec) = (ns.div_euclid(1_000_000_000), ns.rem_euclid(1_000_000_000));
        Self { sec: sec as i32, nanosec: nanosec as u32 }
    }
}

/// `std_msgs/msg/Header`
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
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

/// `nav_msgs/msg/MapMetaData`
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct MapMetaData {
    /// When it was made.
    pub map_load_time: Time,
    /// Metres a cell.
    pub resolution: f32,
    /// Cells.
    pub width: u32,
    /// Cells.
    pub height: u32,
    /// Of the lower left corner.
    pub origin: Pose,
}

/// `nav_msgs/msg/OccupancyGrid`
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct OccupancyGrid {
    /// When, and the map's frame.
    pub header: Header,
    /// Its size.
    pub info: MapMetaData,
    /// Rows from the lowest y: −1 unknown, 0 free … 100 occupied.
    pub data: Vec<i8>,
}

/// `geometry_msgs/msg/PoseStamped`
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct PoseStamped {
    /// When, and in which frame.
    pub header: Header,
    /// Where.
    pub pose: Pose,
}

/// `geometry_msgs/msg/PoseWithCovarianceStamped`
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct PoseWithCovarianceStamped {
    /// When, and in which frame.
    pub header: Header,
    /// Where.
    pub pose: PoseWithCovariance,
}

/// `nav_msgs/msg/Path`
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Path {
    /// When, and in which frame.
    pub header: Header,
    /// One after the other.
    pub poses: Vec<PoseStamped>,
}

/// `sensor_msgs/msg/PointField`
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct PointField {
    /// `x`
    pub name: String,
    /// Bytes from a point's start.
    pub offset: u32,
    /// 7: 32-bit floats.
    pub datatype: u8,
    /// How many.
    pub count: u32,
}

/// `sensor_msgs/msg/PointCloud2`
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[allow(missing_docs, reason = "a block of bytes, and how to read them")]
pub struct PointCloud2 {
    pub header: Header,
    pub height: u32,
    pub width: u32,
    pub fields: Vec<PointField>,
    pub is_bigendian: bool,
    pub point_step: u32,
    pub row_step: u32,
    pub data: Vec<u8>,
    pub is_dense: bool,
}

/// `std_msgs/msg/ColorRGBA`, each 0 to 1
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[allow(missing_docs, reason = "colours")]
pub struct Color {
    pub r: f32,
    pub g: f32,
    pub b: f32,
    pub a: f32,
}

/// `visualization_msgs/msg/Marker`; what is never used of it stays empty.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Marker {
    /// When, and in which frame.
    pub header: Header,
    /// Kind of thing; with `id` it names the marker.
    pub ns: String,
    /// See `ns`.
    pub id: i32,
    /// 4 line, 5 lines, 7 balls, 9 text.
    pub kind: i32,
    /// 0 put, 3 take all away.
    pub action: i32,
    /// Where.
    pub pose: Pose,
    /// Metres: width of lines in x, height of text in z.
    pub scale: Vector3,
    /// Of all of it.
    pub color: Color,
    /// Zero: for good.
    pub lifetime: Time,
    /// Whether it goes with its frame.
    pub frame_locked: bool,
    /// Of lines and balls.
    pub points: Vec<Vector3>,
    /// Of each point.
    pub colors: Vec<Color>,
    /// Unused.
    pub texture_resource: String,
    /// Unused.
    pub texture: CompressedImage,
    /// Unused.
    pub uv_coordinates: Vec<(f32, f32)>,
    /// What it says.
    pub text: String,
    /// Unused.
    pub mesh_resource: String,
    /// Unused.
    pub mesh_file: MeshFile,
    /// Unused.
    pub mesh_use_embedded_materials: bool,
}

/// `sensor_msgs/msg/CompressedImage`
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[allow(missing_docs, reason = "unused")]
pub struct CompressedImage {
    pub header: Header,
    pub format: String,
    pub data: Vec<u8>,
}

/// `visualization_msgs/msg/MeshFile`
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[allow(missing_docs, reason = "unused")]
pub struct MeshFile {
    pub filename: String,
    pub data: Vec<u8>,
}

/// `visualization_msgs/msg/MarkerArray`
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct MarkerArray {
    /// In the order in which they are drawn.
    pub markers: Vec<Marker>,
}

/// `std_srvs/srv/Trigger_Response`
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct TriggerResponse {
    /// Whether it went well.
    pub success: bool,
    /// For people.
    pub message: String,
}

/// `toponym_msgs/srv/Where_Request`
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct WhereRequest {
    /// What is looked for, or a question.
    pub name: String,
    /// Whose map; empty: that of the robot which asks.
    pub robot: String,
}

/// `toponym_msgs/srv/Where_Response`
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct WhereResponse {
    /// Whether it is rather somewhere than nowhere.
    pub found: bool,
    /// Of the likeliest.
    pub probability: f64,
    /// That it is nowhere in the map.
    pub p_none: f64,
    /// Where to go for it.
    pub pose: PoseStamped,
    /// For people.
    pub message: String,
}
