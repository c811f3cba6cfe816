//! A robot's messages as a ROS robot sends them: scans, transforms, mountings, sentences.

use crate::cdr;
use crate::msg::{
    Header, LaserScan, Quaternion, StringMsg, TFMessage, Time, Transform, TransformStamped, Vector3,
};
use crate::plan::kind;
use serde::Serialize;
use std::collections::BTreeMap;
use toponym_proto::{Laser, Message, Pose, Scan, Stamp};

/// The frames of every robot here.
const ODOM: &str = "odom";
const BODY: &str = "base_link";

/// A message on its topic.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Published {
    /// `/scan`
    pub topic: String,
    /// `sensor_msgs/msg/LaserScan`
    pub kind: &'static str,
    /// CDR.
    pub data: Vec<u8>,
}

/// A robot that has told which lasers it has, or not yet.
#[derive(Clone, Debug, Default)]
pub struct AsRos {
    lasers: BTreeMap<String, Laser>,
    newest: Stamp,
}

impl AsRos {
    /// What a ROS robot would have sent; none of what only toponym says, or of a laser that was not told of.
    ///
    /// # Errors
    /// If it can't be written.
    pub fn of(&mut self, message: &Message) -> Result<Option<Published>, String> {
        if let Some(header) = message.header() {
            self.newest = header.stamp;
        }
        let published = match message {
            Message::Setup(m) => {
                self.lasers = m.lasers.iter().map(|laser| (laser.id.clone(), laser.clone())).collect();
                let transforms = m.lasers.iter().map(|laser| mounted(laser, self.newest)).collect();
                published("/tf_static", kind::TF, &TFMessage { transforms })?
            }
            Message::Odom(m) => {
                let transform = planar(&m.odom_from_body, false);
                let transforms = vec![stamped(self.newest, ODOM, BODY, transform)];
                published("/tf", kind::TF, &TFMessage { transforms })?
            }
            Message::Scan(m) => {
                let Some(laser) = self.lasers.get(&m.laser) else { return Ok(None) };
                let topic =
                    if self.lasers.len() == 1 { "/scan".into() } else { format!("/{}/scan", m.laser) };
                published(&topic, kind::SCAN, &scan(m, laser))?
            }
            Message::Say(m) => published("/speech", kind::TEXT, &StringMsg { data: m.text.clone() })?,
            Message::Mend(_) | Message::End(_) => return Ok(None),
        };
        Ok(Some(published))
    }

    /// Stamp of the newest message of the robot.
    pub fn newest(&self) -> Stamp {
        self.newest
    }
}

fn published<T: Serialize>(topic: &str, kind: &'static str, message: &T) -> Result<Published, String> {
    Ok(Published { topic: topic.into(), kind, data: cdr::write(message)? })
}

fn stamped(stamp: Stamp, parent: &str, child: &str, transform: Transform) -> TransformStamped {
    let header = Header { stamp: Time::from(stamp.ns), frame_id: parent.into() };
    TransformStamped { header, child_frame_id: child.into(), transform }
}

/// A pose in the plane; head down: then turned by half a circle about its own x axis.
fn planar(pose: &Pose, upside_down: bool) -> Transform {
    let (z, w) = (0.5 * pose.yaw_rad).sin_cos();
    let rotation = if upside_down {
        Quaternion { x: w, y: z, z: 0.0, w: 0.0 }
    } else {
        Quaternion { x: 0.0, y: 0.0, z, w }
    };
    Transform { translation: Vector3 { x: pose.x_m, y: pose.y_m, z: 0.0 }, rotation }
}

fn mounted(laser: &Laser, stamp: Stamp) -> TransformStamped {
    let &Laser { x_m, y_m, yaw_rad, upside_down, .. } = laser;
    stamped(stamp, BODY, &laser.id, planar(&Pose { x_m, y_m, yaw_rad }, upside_down))
}

fn scan(m: &Scan, laser: &Laser) -> LaserScan {
    let bearing = |k: usize| m.angle_min_rad + k as f64 * m.angle_increment_rad;
    let is_own = |k: usize| laser.ignored_rad.iter().any(|(from, to)| (*from..=*to).contains(&bearing(k)));
    let seen = |(k, range): (usize, &f32)| if is_own(k) { f32::NAN } else { *range };
    LaserScan {
        header: Header { stamp: Time::from(m.header.stamp.ns), frame_id: laser.id.clone() },
        angle_min: m.angle_min_rad as f32,
        angle_max: bearing(m.ranges_m.len().saturating_sub(1)) as f32,
        angle_increment: m.angle_increment_rad as f32,
        time_increment: m.time_increment_s as f32,
        scan_time: (m.time_increment_s * m.ranges_m.len() as f64) as f32,
        range_min: laser.range_min_m as f32,
        range_max: laser.range_max_m as f32,
        ranges: m.ranges_m.iter().enumerate().map(seen).collect(),
        intensities: Vec::new(),
    }
}
