//! Frames: a forest in which each has one parent, tied for good (`/tf_static`) or by motion (`/tf`).

use crate::msg::{TFMessage, Transform, TransformStamped};
use nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion, Vector3};
use std::collections::{BTreeMap, BTreeSet};
use toponym_proto::Pose;

/// No chain of frames is longer.
const CHAIN_MAX: usize = 64;
/// No robot has more.
const FRAMES_MAX: usize = 10_000;
/// A laser's axis is upright or hanging if its cosine is so large; otherwise it does not scan a plane of the floor.
const UPRIGHT: f64 = 0.9;

/// What is known of frames.
#[derive(Clone, Debug, Default)]
pub struct Frames {
    /// Parent and pose in it, by child.
    fixed: BTreeMap<String, (String, Isometry3<f64>)>,
    /// Parents, by child.
    moving: BTreeMap<String, BTreeSet<String>>,
}

/// A transform that moves: `odom` → `base_footprint`.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Moving {
    /// The frame it moves in.
    pub parent: String,
    /// What moves.
    pub child: String,
}

/// How a laser is mounted, in the plane of the floor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mounting {
    /// In the body's frame.
    pub body_from_laser: Pose,
    /// It hangs head down.
    pub upside_down: bool,
}

impl Frames {
    /// Takes transforms that stay.
    pub fn fix(&mut self, message: &TFMessage) {
        for t in &message.transforms {
            if self.fixed.len() < FRAMES_MAX {
                self.fixed
                    .insert(name(&t.child_frame_id), (name(&t.header.frame_id), isometry(&t.transform)));
            }
        }
    }

    /// Takes transforms that move.
    pub fn see(&mut self, message: &TFMessage) {
        for t in &message.transforms {
            let Moving { parent, child } = moving(t);
            if self.moving.len() < FRAMES_MAX {
                self.moving.entry(child).or_default().insert(parent);
            }
        }
    }

    /// Upwards from a frame: the transforms that move on the way, each with the pose of the frame in what moves.
    fn upwards(&self, frame: &str) -> Vec<(Moving, Isometry3<f64>)> {
        let (mut at, mut pose, mut found) = (name(frame), Isometry3::identity(), Vec::new());
        for _ in 0..CHAIN_MAX {
            if let Some((parent, in_parent)) = self.fixed.get(&at) {
                (pose, at) = (in_parent * pose, parent.clone());
            } else if let Some(parents) = self.moving.get(&at) {
                // Of two who publish one child the odometry is meant.
                let Some(parent) = parents.iter().find(|p| is_odom(p)).or_else(|| parents.first()) else {
                    break;
                };
                let child = std::mem::replace(&mut at, parent.clone());
                found.push((Moving { parent: parent.clone(), child }, std::mem::take(&mut pose)));
            } else {
                break;
            }
        }
        found
    }

    /// The transform that is the odometry of what carries a frame, and the pose of the frame on that: the one whose
    /// parent is called so, or else the lowest.
    pub fn odometry_of(&self, frame: &str) -> Option<(Moving, Isometry3<f64>)> {
        let chain = self.upwards(frame);
        chain.iter().find(|(m, _)| is_odom(&m.parent)).or_else(|| chain.first()).cloned()
    }

    /// The pose of a frame in another above it, by what stays.
    pub fn fixed_in(&self, frame: &str, above: &str) -> Option<Isometry3<f64>> {
        let (mut at, mut pose, above) = (name(frame), Isometry3::identity(), name(above));
        for _ in 0..CHAIN_MAX {
            if at == above {
                return Some(pose);
            }
            let (parent, in_parent) = self.fixed.get(&at)?;
            (pose, at) = (in_parent * pose, parent.clone());
        }
        None
    }
}

/// Frames are called `base_link` and, by older nodes, `/base_link`.
pub fn name(frame: &str) -> String {
    frame.trim_start_matches('/').to_owned()
}

/// The frames of a transform.
pub fn moving(t: &TransformStamped) -> Moving {
    Moving { parent: name(&t.header.frame_id), child: name(&t.child_frame_id) }
}

fn is_odom(frame: &str) -> bool {
    frame.rsplit('/').next().is_some_and(|last| last.contains("odom"))
}

/// Zero where its numbers are none.
pub fn isometry(t: &Transform) -> Isometry3<f64> {
    let (p, q) = (t.translation, t.rotation);
    let rotation = UnitQuaternion::try_new(Quaternion::new(q.w, q.x, q.y, q.z), 1e-6);
    Isometry3::from_parts(Translation3::new(p.x, p.y, p.z), rotation.unwrap_or_default())
}

/// A pose on the floor; none if its numbers are none.
pub fn on_floor(pose: &Isometry3<f64>) -> Option<Pose> {
    let ahead = pose.rotation * Vector3::x();
    let (x_m, y_m) = (pose.translation.x, pose.translation.y);
    let pose = Pose { x_m, y_m, yaw_rad: ahead.y.atan2(ahead.x) };
    (pose.x_m.is_finite() && pose.y_m.is_finite() && pose.yaw_rad.is_finite()).then_some(pose)
}

/// How a laser at this pose in the body is mounted.
///
/// # Errors
/// If it does not look along the floor.
pub fn mounting(body_from_laser: &Isometry3<f64>) -> Result<Mounting, String> {
    let up = (body_from_laser.rotation * Vector3::z()).z;
    let pose = on_floor(body_from_laser).filter(|_| up.abs() >= UPRIGHT);
    let body_from_laser = pose.ok_or_else(|| {
        let degrees = up.clamp(-1.0, 1.0).acos().to_degrees();
        format!("the laser is tilted by {degrees:.0}°: it must look along the floor, upright or head down")
    })?;
    Ok(Mounting { body_from_laser, upside_down: up < 0.0 })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::msg::{Header, Quaternion, Vector3};
    use std::f64::consts::{FRAC_1_SQRT_2, FRAC_PI_2};

    fn transform(parent: &str, child: &str, p: [f64; 3], q: [f64; 4]) -> TransformStamped {
        TransformStamped {
            header: Header { frame_id: parent.into(), ..Header::default() },
            child_frame_id: child.into(),
            transform: Transform {
                translation: Vector3 { x: p[0], y: p[1], z: p[2] },
                rotation: Quaternion { x: q[0], y: q[1], z: q[2], w: q[3] },
            },
        }
    }

    fn frames(fixed: Vec<TransformStamped>, moving: Vec<TransformStamped>) -> Frames {
        let mut frames = Frames::default();
        frames.fix(&TFMessage { transforms: fixed });
        frames.see(&TFMessage { transforms: moving });
        frames
    }

    const NONE: [f64; 4] = [0.0, 0.0, 0.0, 1.0];
    const LEFT: [f64; 4] = [0.0, 0.0, FRAC_1_SQRT_2, FRAC_1_SQRT_2];

    #[test]
    fn the_odometry_of_a_laser_is_found_through_its_mounting() {
        let fixed = vec![
            transform("base_link", "laser", [0.08, -0.03, 0.18], LEFT),
            transform("/base_footprint", "/base_link", [0.0, 0.0, 0.06], NONE),
        ];
        let moving = vec![
            transform("map", "odom", [1.0, 0.0, 0.0], NONE),
            transform("odom", "base_footprint", [0.0; 3], NONE),
            transform("base_link", "wheel", [0.0; 3], NONE),
        ];
        let frames = frames(fixed, moving);
        let (odometry, pose) = frames.odometry_of("laser").unwrap();
        assert_eq!((odometry.parent.as_str(), odometry.child.as_str()), ("odom", "base_footprint"));
        let Mounting { body_from_laser: p, upside_down } = mounting(&pose).unwrap();
        assert!((p.x_m - 0.08).abs() + (p.y_m + 0.03).abs() + (p.yaw_rad - FRAC_PI_2).abs() < 1e-4);
        assert!(!upside_down);
        assert!(frames.fixed_in("laser", "base_footprint").is_some());
        assert!(frames.fixed_in("laser", "odom").is_none() && frames.odometry_of("camera").is_none());
    }

    #[test]
    fn a_laser_on_a_turret_is_carried_by_what_odometry_moves() {
        let moving = vec![
            transform("base_link", "turret", [0.0; 3], NONE),
            transform("odom", "base_link", [0.0; 3], NONE),
        ];
        let frames = frames(vec![transform("turret", "laser", [0.0; 3], NONE)], moving);
        assert_eq!(frames.odometry_of("laser").unwrap().0.child, "base_link");
    }

    #[test]
    fn frames_that_bite_their_tails_end() {
        let circle = vec![transform("a", "b", [0.0; 3], NONE), transform("b", "a", [0.0; 3], NONE)];
        assert_eq!(frames(circle.clone(), vec![]).odometry_of("a"), None);
        assert!(frames(vec![], circle).odometry_of("a").is_some());
    }

    #[test]
    fn a_laser_hangs_or_stands_but_does_not_lie() {
        // About z by 90° after about x by 180°.
        let pose = |q| isometry(&transform("b", "l", [0.1, 0.0, 0.3], q).transform);
        let hanging = mounting(&pose([FRAC_1_SQRT_2, FRAC_1_SQRT_2, 0.0, 0.0])).unwrap();
        assert!(hanging.upside_down && (hanging.body_from_laser.yaw_rad - FRAC_PI_2).abs() < 1e-4);
        assert!(mounting(&pose([FRAC_1_SQRT_2, 0.0, 0.0, FRAC_1_SQRT_2])).unwrap_err().contains("90°"));
        assert!(mounting(&pose([0.0; 4])).is_ok(), "no rotation at all is none");
        assert!(mounting(&isometry(&transform("b", "l", [f64::NAN, 0.0, 0.0], NONE).transform)).is_err());
    }
}
