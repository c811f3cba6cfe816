//! What goes wrong with a robot's senses: what happens, and when. What wheels make of it is in `fault/wheels.rs`, what
//! lasers do in `fault/senses.rs`.

pub(crate) mod senses;
pub(crate) mod wheels;

use super::SimError;
use super::body::STEP_S;
use super::geom::between;
use super::random::Draw;
use super::robot::Drive;
use std::fmt;
use std::str::FromStr;

/// A slipping robot's wheels turn it this fast.
const SLIP_RADPS: f64 = 1.2;
/// Slipping wheels roll this fast.
const SLIP_MPS: f64 = 0.8;
/// Silences take between these, seconds.
const SILENCE_S: (f64, f64) = (3.0, 20.0);
/// So does being carried, the laser covered.
const CARRIED_S: (f64, f64) = (5.0, 15.0);
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
    /// Somebody carries the robot on for some seconds: wheels stand still, scans are not sent.
    Carried,
    /// Somebody pushes it with its wheels off the floor: they stand still, the lasers see it all.
    Pushed {
        /// How far.
        way_m: f64,
    },
    /// Odometry is measured at each so-many-th message only, and repeated in between.
    Stale {
        /// At least 2.
        every: u32,
    },
    /// Wheels that never move.
    Constant,
    /// Odometry trembles, at rest, too.
    Jitter {
        /// Standard deviation of x and y; the heading's is a tenth of it in radians.
        metres: f64,
    },
    /// Distances are read so many times too long.
    Scale {
        /// 1: as they are.
        by: f64,
    },
    /// The wheels turn to the left as they roll.
    Bias {
        /// Per metre.
        rad_per_m: f64,
    },
    /// The lasers' clock is behind the wheels'.
    Clock {
        /// By so much; ahead if less than 0.
        behind_s: f64,
    },
    /// So many of the walls are of glass.
    Glass {
        /// Of one.
        share: f64,
    },
    /// So many of the walls send light back from near by only.
    Dark {
        /// Of one.
        share: f64,
    },
    /// People walk about, the first of them ahead of the robot.
    Crowd {
        /// How many.
        people: usize,
    },
    /// A driver repeats a scan, bit by bit.
    Frozen {
        /// For how long.
        lasts_s: f64,
    },
    /// Lasers hang head down, and setup does not say so.
    Mirrored,
    /// They look backwards, and setup does not say so.
    Backwards,
    /// Ranges are in millimetres.
    Millimetres,
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

impl Incident {
    /// Whether it is going on.
    pub(crate) fn at(&self, t_s: f64) -> bool {
        (self.from_s..self.to_s).contains(&t_s)
    }
}

impl fmt::Display for Fault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::SlipTurn { turn_rad } => write!(f, "slip:{}", turn_rad.to_degrees()),
            Self::SlipAhead { way_m } => write!(f, "slip:{way_m}m"),
            Self::Unsigned => write!(f, "unsigned"),
            Self::Break => write!(f, "break"),
            Self::Carried => write!(f, "carried"),
            Self::Pushed { way_m } => write!(f, "pushed:{way_m}"),
            Self::Stale { every } => write!(f, "stale:{every}"),
            Self::Constant => write!(f, "constant"),
            Self::Jitter { metres } => write!(f, "jitter:{metres}"),
            Self::Scale { by } => write!(f, "scale:{by}"),
            Self::Bias { rad_per_m } => write!(f, "bias:{}", rad_per_m.to_degrees()),
            Self::Clock { behind_s } => write!(f, "clock:{behind_s}"),
            Self::Glass { share } => write!(f, "glass:{share}"),
            Self::Dark { share } => write!(f, "dark:{share}"),
            Self::Crowd { people } => write!(f, "crowd:{people}"),
            Self::Frozen { lasts_s } => write!(f, "frozen:{lasts_s}"),
            Self::Mirrored => write!(f, "mirrored"),
            Self::Backwards => write!(f, "backwards"),
            Self::Millimetres => write!(f, "millimetres"),
        }
    }
}

impl FromStr for Fault {
    type Err = SimError;

    /// `slip:90` (degrees), `slip:3m` (metres), `unsigned`, …: [`Fault::NAMES`].
    fn from_str(text: &str) -> Result<Self, SimError> {
        let unknown = || SimError::NoSuchFault(text.to_owned(), Self::NAMES.to_owned());
        let (name, value) = text.split_once(':').map_or((text, None), |(name, value)| (name, Some(value)));
        let number = |usual: f64, may: std::ops::RangeInclusive<f64>| match value {
            None => Ok(usual),
            Some(value) => value.parse().ok().filter(|v| may.contains(v)).ok_or_else(unknown),
        };
        let one = 0.0..=1.0;
        Ok(match name {
            "slip" => match value.ok_or_else(unknown)?.strip_suffix('m') {
                Some(metres) => {
                    let way_m: f64 =
                        metres.parse().ok().filter(|m: &f64| m.is_finite()).ok_or_else(unknown)?;
                    Self::SlipAhead { way_m }
                }
                None => Self::SlipTurn { turn_rad: number(0.0, -1e4..=1e4)?.to_radians() },
            },
            "pushed" => Self::Pushed { way_m: number(2.0, 0.1..=100.0)? },
            "stale" => Self::Stale { every: number(5.0, 2.0..=1000.0)? as u32 },
            "jitter" => Self::Jitter { metres: number(0.005, 0.0..=1.0)? },
            "scale" => Self::Scale { by: number(0.9, -10.0..=10.0)? },
            "bias" => Self::Bias { rad_per_m: number(1.0, -90.0..=90.0)?.to_radians() },
            "clock" => Self::Clock { behind_s: number(3600.0, -1e6..=1e6)? },
            "glass" => Self::Glass { share: number(0.3, one)? },
            "dark" => Self::Dark { share: number(0.3, one)? },
            "crowd" => Self::Crowd { people: number(12.0, 1.0..=100.0)? as usize },
            "frozen" => Self::Frozen { lasts_s: number(20.0, 0.1..=1e4)? },
            _ if value.is_some() => return Err(unknown()),
            "unsigned" => Self::Unsigned,
            "break" => Self::Break,
            "carried" => Self::Carried,
            "constant" => Self::Constant,
            "mirrored" => Self::Mirrored,
            "backwards" => Self::Backwards,
            "millimetres" => Self::Millimetres,
            _ => return Err(unknown()),
        })
    }
}

impl Fault {
    /// How faults are written, with what they are worth where that may be left out.
    pub const NAMES: &str = "slip:DEGREES, slip:METRESm, unsigned, break, carried, pushed:METRES (2), stale:N (5), constant, \
        jitter:METRES (.005), scale:TIMES (.9), bias:DEGREES (1, per metre), clock:SECONDS (3600), glass:SHARE (.3), \
        dark:SHARE (.3), crowd:PEOPLE (12), frozen:SECONDS (20), mirrored, backwards, millimetres";

    /// How long it lasts once it begins at a time; none: all along.
    fn lasts_s(&self, from_s: f64, drive: &Drive, draw: &mut Draw) -> Option<f64> {
        Some(match *self {
            Self::SlipTurn { turn_rad } => turn_rad.abs() / SLIP_RADPS,
            Self::SlipAhead { way_m } => way_m.abs() / SLIP_MPS,
            Self::Break => draw.within(SILENCE_S),
            Self::Carried => draw.within(CARRIED_S),
            Self::Frozen { lasts_s } => lasts_s,
            Self::Pushed { way_m } => {
                let first = (from_s / STEP_S) as usize;
                let steps = drive.poses.windows(2).skip(first);
                let mut left_m = way_m;
                let pushed = steps.take_while(|w| {
                    let step = between(&w[0], &w[1]);
                    left_m -= step.x_m.hypot(step.y_m);
                    left_m > 0.0
                });
                pushed.count() as f64 * STEP_S
            }
            _ => return None,
        })
    }

    fn happens(&self, drive: &Drive, draw: &mut Draw) -> Incident {
        // Drawn before the time: recorded tours depend on the order of draws.
        let Some(lasts_s) = self.lasts_s(0.0, drive, draw) else {
            return Incident { fault: *self, from_s: 0.0, to_s: f64::INFINITY };
        };
        let mut from_s = 0.0;
        for _ in 0..50 {
            from_s = (draw.within(MIDST) * drive.duration_s() / STEP_S).round() * STEP_S;
            let ahead = between(&drive.at(from_s), &drive.at(from_s + 1.0));
            if ahead.x_m > 0.3 {
                break;
            }
        }
        let lasts_s = match self {
            Self::Pushed { .. } => self.lasts_s(from_s, drive, draw).unwrap_or(lasts_s),
            _ => lasts_s,
        };
        let steps = (lasts_s / STEP_S).round().max(1.0);
        Incident { fault: *self, from_s, to_s: from_s + steps * STEP_S }
    }
}

/// Draws when each fault happens: in the midst of the drive, with the robot under way.
pub(crate) fn incidents(faults: &[Fault], drive: &Drive, draw: &mut Draw) -> Vec<Incident> {
    let all_along = |i: Incident| Incident { to_s: i.to_s.min(drive.duration_s()), ..i };
    faults.iter().map(|fault| all_along(fault.happens(drive, draw))).collect()
}

/// Whether the robot sends nothing at a time.
pub(crate) fn silent(incidents: &[Incident], t_s: f64) -> bool {
    incidents.iter().any(|i| i.fault == Fault::Break && i.at(t_s))
}

#[cfg(test)]
mod tests {
    use super::wheels::misread;
    use super::*;
    use crate::geom::wrap;
    use toponym_proto::Pose;

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
        assert!(spot.yaw_rad.abs() < 1e-9 && (spot.x_m - 0.2).abs() < 1e-9, "{spot:?}");
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
        for name in [
            "slip:90",
            "slip:-45",
            "slip:3m",
            "unsigned",
            "break",
            "carried",
            "pushed:2",
            "stale:5",
            "constant",
            "jitter:0.005",
            "scale:0.9",
            "bias:1",
            "clock:3600",
            "clock:-2",
            "glass:0.3",
            "dark:0.3",
            "crowd:12",
            "frozen:20",
            "mirrored",
            "backwards",
            "millimetres",
        ] {
            assert_eq!(name.parse::<Fault>().unwrap().to_string(), name);
        }
        for name in
            ["slip", "slip:x", "slip:infm", "smoke", "break:3", "stale:1", "glass:2", "crowd:0", "bias:nan"]
        {
            assert!(name.parse::<Fault>().is_err(), "{name}");
        }
    }
}
