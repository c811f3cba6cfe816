//! Where odometry lies in the map, for whoever navigates: `map` → `odom` on `/tf` (REP-105), and the pose.

use super::Shared;
use super::mouth::{Speaker, Writer};
use super::session::now_ns;
use crate::msg::{
    Header, PoseStamped, PoseWithCovariance, PoseWithCovarianceStamped, TFMessage, Time, Transform,
    TransformStamped, Vector3,
};
use crate::plan::kind;
use crate::shown::{about_z, posed};
use crate::wire::Qos;
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};
use tokio::time::MissedTickBehavior;
use toponym_proto::Pose;
use toponym_proto::answer::{Goal, PoseOut};
use tracing::{info, warn};

/// Another one who tells it is gone after so long.
const OTHERS_NS: i64 = 2_000_000_000;
/// Covariance of what is not measured.
const UNMEASURED: f64 = 1e6;

/// Until the session ends.
pub async fn broadcast(shared: Arc<Shared>, speaker: Arc<Speaker>) -> Result<(), String> {
    let why = |e: zenoh::Error| e.to_string();
    let mut plan = shared.plan.subscribe();
    plan.wait_for(Option::is_some).await.map_err(|e| e.to_string())?;
    let mut topic = shared.tf_topic.subscribe();
    let name = topic.borrow_and_update().clone();
    let mut transforms = speaker.topic(&name, kind::TF, Qos::Reliable(100)).await.map_err(why)?;
    let named = speaker.named("/toponym/pose");
    let poses = speaker.topic(&named, kind::POSE_WITH_COVARIANCE, Qos::Reliable(10)).await.map_err(why)?;
    let mut ticks = tokio::time::interval(Duration::from_secs_f64(shared.robot.transform_publish_period_s));
    ticks.set_missed_tick_behavior(MissedTickBehavior::Delay);
    let goals =
        speaker.topic(&speaker.named("/goal_pose"), kind::POSE, Qos::Reliable(10)).await.map_err(why)?;
    let (mut pose, mut goal_told) = (shared.pose.subscribe(), shared.goal.subscribe());
    let (mut newest_ns, mut was_silent) = (0, false);
    loop {
        tokio::select! {
            _ = ticks.tick() => {
                let others = now_ns() - shared.others_ns.load(Ordering::Relaxed) < OTHERS_NS;
                if others != was_silent {
                    was_silent = others;
                    tell_others(&shared, others);
                }
                // Until the next transform is there, whatever is stamped meanwhile must be before this one.
                let ahead_ns = shared.clock.borrow().in_ns(Instant::now(), shared.robot.transform_timeout_s);
                let Some(stamp_ns) = ahead_ns.filter(|_| !others) else { continue };
                // Not back by a little, where the clock was carried on too far; but anew with it.
                newest_ns = if newest_ns - stamp_ns < OTHERS_NS { newest_ns.max(stamp_ns) } else { stamp_ns };
                let Some(message) = map_from_odom(&shared, newest_ns) else { continue };
                transforms.write(&message).await?;
            }
            changed = topic.changed() => {
                changed.map_err(|e| e.to_string())?;
                let name = topic.borrow_and_update().clone();
                transforms = speaker.topic(&name, kind::TF, Qos::Reliable(100)).await.map_err(why)?;
            }
            changed = goal_told.changed() => {
                changed.map_err(|e| e.to_string())?;
                let told = goal_told.borrow_and_update().clone();
                if let Some(Goal { x_m, y_m, yaw_rad, .. }) = told {
                    goals.write(&goal(&shared, &Pose { x_m, y_m, yaw_rad })).await?;
                }
            }
            changed = pose.changed() => {
                changed.map_err(|e| e.to_string())?;
                let message = pose.borrow_and_update().as_ref().map(|pose| in_map(&shared, pose));
                write_some(&poses, message).await?;
            }
        }
    }
}

async fn write_some(poses: &Writer, message: Option<PoseWithCovarianceStamped>) -> Result<(), String> {
    match message {
        Some(message) => poses.write(&message).await,
        None => Ok(()),
    }
}

fn tell_others(shared: &Shared, others: bool) {
    let robot = &shared.robot.robot;
    if others {
        warn!(
            robot,
            "somebody else tells where odometry lies in a map (amcl, slam_toolbox?): stop one of the two; as long as that \
             speaks, this server does not"
        );
    } else {
        info!(robot, "nobody else tells any more where odometry lies in a map: now this server does");
    }
}

fn map_from_odom(shared: &Shared, stamp_ns: i64) -> Option<TFMessage> {
    let odom = shared.plan.borrow().as_ref()?.moving()?.parent.clone();
    let pose = shared.pose.borrow().as_ref()?.map_from_odom;
    let header = Header { stamp: Time::from(stamp_ns), frame_id: shared.robot.map_frame.clone() };
    let transform = Transform {
        translation: Vector3 { x: pose.x_m, y: pose.y_m, z: 0.0 },
        rotation: about_z(pose.yaw_rad),
    };
    Some(TFMessage { transforms: vec![TransformStamped { header, child_frame_id: odom, transform }] })
}

/// A goal in the map, now.
pub fn goal(shared: &Shared, pose: &Pose) -> PoseStamped {
    let stamp_ns = shared.clock.borrow().newest().map_or(0, |(ns, _)| ns);
    let header = Header { stamp: Time::from(stamp_ns), frame_id: shared.robot.map_frame.clone() };
    PoseStamped { header, pose: posed(pose) }
}

fn in_map(shared: &Shared, out: &PoseOut) -> PoseWithCovarianceStamped {
    let header = Header { stamp: Time::from(out.stamp.ns), frame_id: shared.robot.map_frame.clone() };
    // The server's is about the body's axes; ROS's about the map's.
    let (sin, cos) = out.map_from_body.yaw_rad.sin_cos();
    let turn = nalgebra::Matrix3::new(cos, -sin, 0.0, sin, cos, 0.0, 0.0, 0.0, 1.0);
    let in_map = turn * nalgebra::Matrix3::from_row_slice(&out.covariance) * turn.transpose();
    let mut covariance = [[0.0; 6]; 6];
    for (k, row) in covariance.iter_mut().enumerate().take(5).skip(2) {
        row[k] = UNMEASURED;
    }
    // x, y, z, about x, y, z.
    for (i, row) in [0, 1, 5].into_iter().enumerate() {
        for (j, column) in [0, 1, 5].into_iter().enumerate() {
            covariance[row][column] = in_map[(i, j)];
        }
    }
    PoseWithCovarianceStamped {
        header,
        pose: PoseWithCovariance { pose: posed(&out.map_from_body), covariance },
    }
}
