//! What wheels count of a drive on which something goes wrong.

use super::{Fault, Incident};
use crate::body::STEP_S;
use crate::geom::{between, compose};
use crate::random::Draw;
use crate::robot::Drive;
use toponym_proto::Pose;

/// Distance of the wheels, metres.
const TRACK_M: f64 = 0.4;
/// A trembling heading, radians per metre of a trembling place.
const JITTER_RAD_PER_M: f64 = 0.1;

/// What `read` (what the wheels measured of the motion `drive`) becomes by the faults.
pub(crate) fn misread(incidents: &[Incident], drive: &Drive, read: &Drive) -> Drive {
    let mut at = Pose::default();
    let mut poses = vec![at];
    for (k, (moved, read)) in drive.poses.windows(2).zip(read.poses.windows(2)).enumerate() {
        let mut step = between(&read[0], &read[1]);
        for incident in incidents {
            let [first, end] = [incident.from_s, incident.to_s].map(|t_s| (t_s / STEP_S).round() as usize);
            let now = (first..end).contains(&k);
            let share = if now { 1.0 / (end - first) as f64 } else { 0.0 };
            match incident.fault {
                Fault::SlipTurn { turn_rad } => step.yaw_rad += share * turn_rad,
                Fault::SlipAhead { way_m } => step.x_m += share * way_m,
                Fault::Unsigned => step = unsigned(&step, &between(&moved[0], &moved[1])),
                Fault::Carried | Fault::Pushed { .. } if now => step = Pose::default(),
                Fault::Constant => step = Pose::default(),
                Fault::Scale { by } => (step.x_m, step.y_m) = (step.x_m * by, step.y_m * by),
                Fault::Bias { rad_per_m } => step.yaw_rad += rad_per_m * step.x_m.hypot(step.y_m),
                Fault::Break if k == end => at = Pose::default(),
                _ => {}
            }
        }
        at = compose(&at, &step);
        poses.push(at);
    }
    Drive { poses }
}

/// A step as wheels count it that know no sign.
fn unsigned(read: &Pose, moved: &Pose) -> Pose {
    let wheels = |step: &Pose| [-1.0, 1.0].map(|side| step.x_m + side * step.yaw_rad * TRACK_M / 2.0);
    let (read, moved) = (wheels(read), wheels(moved));
    let [left, right] = [0, 1].map(|k| if moved[k] < 0.0 { -read[k] } else { read[k] });
    Pose { x_m: f64::midpoint(left, right), y_m: 0.0, yaw_rad: (right - left) / TRACK_M }
}

/// The pose that the `k`-th of so many messages a second tells.
pub(crate) fn told(
    incidents: &[Incident],
    odometry: &Drive,
    k: usize,
    rate_hz: f64,
    draw: &mut Draw,
) -> Pose {
    let (mut measured, mut trembles_m) = (k, 0.0);
    for incident in incidents {
        match incident.fault {
            Fault::Stale { every } => measured = k - k % every.max(1) as usize,
            Fault::Jitter { metres } => trembles_m = metres,
            _ => {}
        }
    }
    let mut pose = odometry.at(measured as f64 / rate_hz);
    if trembles_m > 0.0 {
        pose.x_m += trembles_m * draw.normal();
        pose.y_m += trembles_m * draw.normal();
        pose.yaw_rad += trembles_m * JITTER_RAD_PER_M * draw.normal();
    }
    pose
}
