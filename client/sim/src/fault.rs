//! What wheels get wrong beyond noise, and what their reader does.

use super::SimError;
use super::body::STEP_S;
use super::geom::{between, compose};
use super::random::Draw;
use super::robot::Drive;
use std::fmt;
use std::str::FromStr;
use toponym_proto::Pose;

/// A slipping robot's wheels turn it this fast.
const SLIP_RADPS: f64 = 1.2;
/// Slipping wheels roll this fast.
const SLIP_MPS: f64 = 0.8;
/// Silences take between these, seconds.
const SILENCE_S: (f64, f64) = (3.0, 20.0);
/// Distance of the wheels, metres.
const TRACK_M: f64 = 0.4;
/// Faults begin in this part of the drive.
const MIDST: (f64, f64) = (0.25, 0.75);

/// Something that goes wrong once, or all along.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Fault {
    /// The wheels count a turn that the robot does not make.
    SlipTurn {
        /// To the left.
        turn_rad: f64,
    },
    /// The wheels count a way that the robot does not go.
    SlipAhead {
        /// Ahead.
        way_m: f64,
    },
    /// Encoders without sign: each wheel's travel counts as forward. Turning on the spot reads as
    /// driving straight on.
    Unsigned,
    /// Nothing is sent for some seconds while the robot drives on, then the odometry restarts at 0;
    /// same boot.
    Break,
}

/// A fault and when it happened.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Incident {
    /// What happened.
    pub fault: Fault,
    /// From then, seconds from the start of the drive,
    pub from_s: f64,
    /// until then.
    pub to_s: f64,
}

impl fmt::Display for Fault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::SlipTurn { turn_rad } => write!(f, "slip:{}", turn_rad.to_degrees()),
            Self::SlipAhead { way_m } => write!(f, "slip:{way_m}m"),
            Self::Unsigned => write!(f, "unsigned"),
            Self::Break => write!(f, "break"),
        }
    }
}

impl FromStr for Fault {
    type Err = SimError;

    /// `slip:90` (degrees), `slip:3m` (metres), `unsigned`, `break`.
    fn from_str(text: &str) -> Result<Self, SimError> {
        let unknown = || SimError::NoSuchFault(text.to_owned());
        let finite = |v: &str| v.parse::<f64>().ok().filter(|v| v.is_finite()).ok_or_else(unknown);
        match text.split_once(':') {
            None if text == "unsigned" => Ok(Self::Unsigned),
            None if text == "break" => Ok(Self::Break),
            Some(("slip", value)) => match value.strip_suffix('m') {
                Some(metres) => Ok(Self::SlipAhead { way_m: finite(metres)? }),
                None => Ok(Self::SlipTurn { turn_rad: finite(value)?.to_radians() }),
            },
            _ => Err(unknown()),
        }
    }
}

/// Draws when each fault happens: in the midst of the drive, with the robot under way.
pub(crate) fn incidents(faults: &[Fault], drive: &Drive, draw: &mut Draw) -> Vec<Incident> {
    let mut happen = |fault: &Fault| {
        let lasts_s = match fault {
            Fault::SlipTurn { turn_rad } => turn_rad.abs() / SLIP_RADPS,
            Fault::SlipAhead { way_m } => way_m.abs() / SLIP_MPS,
            Fault::Unsigned => {
                return Incident { fault: *fault, from_s: 0.0, to_s: drive.duration_s() };
            }
            Fault::Break => draw.within(SILENCE_S),
        };
        let steps = (lasts_s / STEP_S).round().max(1.0);
        let mut from_s = 0.0;
        for _ in 0..50 {
            from_s = (draw.within(MIDST) * drive.duration_s() / STEP_S).round() * STEP_S;
            let ahead = between(&drive.at(from_s), &drive.at(from_s + 1.0));
            if ahead.x_m > 0.3 {
                break;
            }
        }
        Incident { fault: *fault, from_s, to_s: from_s + steps * STEP_S }
    };
    faults.iter().map(&mut happen).collect()
}

/// Whether the robot sends nothing at a time.
pub(crate) fn silent(incidents: &[Incident], t_s: f64) -> bool {
    incidents.iter().any(|i| i.fault == Fault::Break && (i.from_s..i.to_s).contains(&t_s))
}

/// What `read` (what the wheels measured of the motion `drive`) becomes by the faults.
pub(crate) fn misread(incidents: &[Incident], drive: &Drive, read: &Drive) -> Drive {
    let mut at = Pose::default();
    let mut poses = vec![at];
    for (k, (moved, read)) in drive.poses.windows(2).zip(read.poses.windows(2)).enumerate() {
        let mut step = between(&read[0], &read[1]);
        for incident in incidents {
            let [first, end] = [incident.from_s, incident.to_s].map(|t_s| (t_s / STEP_S).round() as usize);
            let share = if (first..end).contains(&k) { 1.0 / (end - first) as f64 } else { 0.0 };
            match incident.fault {
                Fault::SlipTurn { turn_rad } => step.yaw_rad += share * turn_rad,
                Fault::SlipAhead { way_m } => step.x_m += share * way_m,
                Fault::Unsigned => step = unsigned(&step, &between(&moved[0], &moved[1])),
                Fault::Break if k == end => at = Pose::default(),
                Fault::Break => {}
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geom::wrap;

    /// 40 s ahead at 1 m/s, with a turn of a radian on the spot in the end.
    fn drive() -> Drive {
        let mut poses: Vec<Pose> =
            (0..=2000).map(|k| Pose { x_m: 0.02 * f64::from(k), ..Pose::default() }).collect();
        poses.extend((1..=50).map(|k| Pose { x_m: 40.0, y_m: 0.0, yaw_rad: 0.02 * f64::from(k) }));
        Drive { poses }
    }

    fn end(fault: Fault) -> (Incident, Drive) {
        let drive = drive();
        let happened = incidents(&[fault], &drive, &mut Draw::new(1, 0));
        let read = misread(&happened, &drive, &drive);
        (happened[0], read)
    }

    #[test]
    fn a_slip_is_counted_and_not_made() {
        let (when, read) = end("slip:90".parse().unwrap());
        let turned = between(&read.at(when.from_s), &read.at(when.to_s));
        assert!((turned.yaw_rad - 90f64.to_radians()).abs() < 1e-6, "{turned:?}");
        assert!((10.0..31.0).contains(&when.from_s));
        let (_, read) = end("slip:3m".parse().unwrap());
        assert!((read.path_m() - 43.0).abs() < 1e-6, "{}", read.path_m());
    }

    #[test]
    fn without_sign_a_turn_on_the_spot_reads_as_straight_on() {
        let (_, read) = end(Fault::Unsigned);
        let spot = between(&read.at(40.0), &read.at(41.0));
        assert!(spot.yaw_rad.abs() < 1e-9 && (spot.x_m - TRACK_M / 2.0).abs() < 1e-9, "{spot:?}");
        assert!((read.at(40.0).x_m - 40.0).abs() < 1e-9, "ahead is ahead");
    }

    #[test]
    fn after_a_break_the_odometry_starts_anew() {
        let (when, read) = end(Fault::Break);
        let lasts_s = when.to_s - when.from_s;
        assert!((SILENCE_S.0 - 0.1..SILENCE_S.1 + 0.1).contains(&lasts_s));
        assert!(silent(&[when], when.from_s) && !silent(&[when], when.to_s));
        let after = read.at(when.to_s + 1.0);
        assert!((after.x_m - 1.0).abs() < 0.05 && wrap(after.yaw_rad).abs() < 1e-9, "{after:?}");
    }

    #[test]
    fn names_are_read_and_others_refused() {
        for name in ["slip:90", "slip:-45", "slip:3m", "unsigned", "break"] {
            assert_eq!(name.parse::<Fault>().unwrap().to_string(), name);
        }
        for name in ["slip", "slip:x", "slip:infm", "smoke", "break:3"] {
            assert!(name.parse::<Fault>().is_err(), "{name}");
        }
    }
}
