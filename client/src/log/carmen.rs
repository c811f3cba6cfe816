//! CARMEN log lines: `FLASER`, `ROBOTLASER1`, `ODOM` and `PARAM`, parsed one by one. Units are the
//! format's own: metres, radians, seconds.

use std::str::FromStr;
use toponym_proto::limits::STAMP_MAX_NS;
use toponym_proto::{Pose, Stamp};

/// More beams than any planar laser has: a damaged count must not reserve memory.
const BEAMS_MAX: usize = 16_384;

/// One line.
#[derive(Clone, Debug, PartialEq)]
pub enum Line<'a> {
    /// Wheel odometry.
    Odom {
        /// Pose of the body in the odometry frame.
        odom_from_body: Pose,
        /// The stamp as written: the field before the host name.
        stamp: &'a str,
    },
    /// A sweep.
    Scan(ScanLine<'a>),
    /// A parameter with a numeric value.
    Param {
        /// Its name.
        name: &'a str,
        /// Its value.
        value: f64,
    },
    /// Blank, a comment, a message of another type or a parameter that is no number.
    Other(&'a str),
}

/// A sweep and the poses that its line carries.
#[derive(Clone, Debug, PartialEq)]
pub struct ScanLine<'a> {
    /// Bearing of the first beam, laser frame, and from beam to beam, radians; none: the line does not say.
    pub bearings_rad: Option<(f64, f64)>,
    /// The longest range the line itself says the laser can see.
    pub range_max_m: Option<f64>,
    /// As written.
    pub ranges_m: Vec<f32>,
    /// The laser's pose as the log has it: the odometry frame, unless the log was corrected.
    pub odom_from_laser: Pose,
    /// Pose of the body in the odometry frame.
    pub odom_from_body: Pose,
    /// The stamp as written.
    pub stamp: &'a str,
}

/// Parses one line without its line break. The error says what is wrong, not where.
pub fn parse(line: &str) -> Result<Line<'_>, String> {
    let mut fields = Fields(line.split_ascii_whitespace());
    match fields.0.next() {
        Some("ODOM") => {
            let odom_from_body = fields.pose()?;
            fields.skip(3, "velocities")?;
            Ok(Line::Odom { odom_from_body, stamp: fields.stamp()? })
        }
        Some("FLASER") => flaser(fields),
        Some("ROBOTLASER1") => robotlaser(fields),
        Some("PARAM") => Ok(match (fields.0.next(), fields.0.next().map(f64::from_str)) {
            (Some(name), Some(Ok(value))) if value.is_finite() => Line::Param { name, value },
            _ => Line::Other("PARAM"),
        }),
        other => Ok(Line::Other(other.unwrap_or(""))),
    }
}

fn flaser(mut fields: Fields<'_>) -> Result<Line<'_>, String> {
    Ok(Line::Scan(ScanLine {
        bearings_rad: None,
        range_max_m: None,
        ranges_m: fields.ranges()?,
        odom_from_laser: fields.pose()?,
        odom_from_body: fields.pose()?,
        stamp: fields.stamp()?,
    }))
}

fn robotlaser(mut fields: Fields<'_>) -> Result<Line<'_>, String> {
    fields.skip(1, "laser type")?;
    let angle_min_rad = fields.finite("start angle")?;
    fields.skip(1, "field of view")?;
    let angle_increment_rad = fields.finite("angular resolution")?;
    let range_max_m = fields.finite("maximum range")?;
    fields.skip(2, "accuracy and remission mode")?;
    let ranges_m = fields.ranges()?;
    let remissions = fields.count("number of remissions")?;
    fields.skip(remissions, "remissions")?;
    let (odom_from_laser, odom_from_body) = (fields.pose()?, fields.pose()?);
    fields.skip(5, "velocities and safety distances")?;
    Ok(Line::Scan(ScanLine {
        bearings_rad: Some((angle_min_rad, angle_increment_rad)),
        range_max_m: (range_max_m > 0.0).then_some(range_max_m),
        ranges_m,
        odom_from_laser,
        odom_from_body,
        stamp: fields.stamp()?,
    }))
}

/// First bearing and step of a sweep that doesn't say, over a field of view symmetric ahead. The last ray is at its end or,
/// where that makes the rounder step, one short of it: SICK's 180 and 360 beams over half a circle leave it out.
pub fn bearings(beams: usize, view_rad: f64) -> (f64, f64) {
    let view_deg = view_rad.to_degrees();
    let step_deg = |gaps: usize| view_deg / gaps.max(1) as f64;
    let is_round = |deg: f64| (8.0 * deg - (8.0 * deg).round()).abs() < 1e-6;
    let full = step_deg(beams.saturating_sub(1));
    let short = step_deg(beams);
    let step = if is_round(short) && !is_round(full) { short } else { full };
    (-0.5 * view_rad, step.to_radians())
}

/// The exact nanoseconds of a decimal number of seconds; a double would lose some 100 ns of a
/// stamp of this century.
pub fn stamp(text: &str) -> Result<Stamp, String> {
    let mut ns = exact_ns(text);
    if ns.is_none() {
        let s = f64::from_str(text).map_err(|_| format!("stamp {text:?} is not a number"))?;
        ns = (s.abs() < 9e9).then(|| Stamp::from_seconds(s).ns);
    }
    match ns.filter(|ns| ns.unsigned_abs() <= STAMP_MAX_NS.unsigned_abs()) {
        Some(ns) => Ok(Stamp { ns }),
        None => Err(format!("stamp {text} is out of range")),
    }
}

fn exact_ns(text: &str) -> Option<i64> {
    let (negative, digits) = text.strip_prefix('-').map_or((false, text), |t| (true, t));
    let (whole, fraction) = digits.split_once('.').unwrap_or((digits, ""));
    let digits_only = |s: &str| s.bytes().all(|b| b.is_ascii_digit());
    if whole.is_empty() || !digits_only(whole) || !digits_only(fraction) || fraction.len() > 9 {
        return None;
    }
    let fraction_ns = format!("{fraction:0<9}").parse::<i64>().ok()?;
    let ns = whole.parse::<i64>().ok()?.checked_mul(1_000_000_000)?.checked_add(fraction_ns)?;
    Some(if negative { -ns } else { ns })
}

/// The rest of a line, field by field.
struct Fields<'a>(std::str::SplitAsciiWhitespace<'a>);

impl<'a> Fields<'a> {
    fn next(&mut self, what: &str) -> Result<&'a str, String> {
        self.0.next().ok_or_else(|| format!("the line ends before its {what}"))
    }

    fn skip(&mut self, n: usize, what: &str) -> Result<(), String> {
        (0..n).try_for_each(|_| self.next(what).map(drop))
    }

    fn number<T: FromStr>(&mut self, what: &str) -> Result<T, String> {
        let text = self.next(what)?;
        text.parse().map_err(|_| format!("{what}: {text:?} is not a number"))
    }

    fn finite(&mut self, what: &str) -> Result<f64, String> {
        let v: f64 = self.number(what)?;
        if v.is_finite() { Ok(v) } else { Err(format!("{what}: {v} is not finite")) }
    }

    fn count(&mut self, what: &str) -> Result<usize, String> {
        let n: usize = self.number(what)?;
        if n <= BEAMS_MAX { Ok(n) } else { Err(format!("{what}: {n} is more than {BEAMS_MAX}")) }
    }

    fn ranges(&mut self) -> Result<Vec<f32>, String> {
        let n = self.count("number of beams")?;
        if n == 0 {
            return Err("a scan of no beams".into());
        }
        (0..n).map(|_| self.number("ranges")).collect()
    }

    fn pose(&mut self) -> Result<Pose, String> {
        Ok(Pose { x_m: self.finite("pose")?, y_m: self.finite("pose")?, yaw_rad: self.finite("pose")? })
    }

    fn stamp(&mut self) -> Result<&'a str, String> {
        let text = self.next("stamp")?;
        stamp(text).map(|_| text)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::f64::consts::PI;

    fn scan(line: &str) -> ScanLine<'_> {
        match parse(line).unwrap() {
            Line::Scan(scan) => scan,
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn odom_stamp_is_the_field_before_the_host() {
        let line = parse("ODOM 1.5 -2 0.25 0.1 0.2 0.3 100.25 robot 3.5").unwrap();
        let odom_from_body = Pose { x_m: 1.5, y_m: -2.0, yaw_rad: 0.25 };
        assert_eq!(line, Line::Odom { odom_from_body, stamp: "100.25" });
    }

    #[test]
    fn flaser_has_the_laser_before_the_robot() {
        let s = scan("FLASER 3 1 2 81.9 0.3 0 0 0.1 0.2 0.3 7.125 robot 8");
        assert_eq!(s.ranges_m, [1.0, 2.0, 81.9]);
        assert_eq!(s.odom_from_laser, Pose { x_m: 0.3, y_m: 0.0, yaw_rad: 0.0 });
        assert_eq!(s.odom_from_body, Pose { x_m: 0.1, y_m: 0.2, yaw_rad: 0.3 });
        assert_eq!(s.stamp, "7.125");
        assert_eq!(s.bearings_rad, None);
    }

    #[test]
    fn beam_counts_tell_the_bearings() {
        let half = -std::f64::consts::FRAC_PI_2;
        for (beams, step_deg) in [(180, 1.0), (181, 1.0), (360, 0.5), (361, 0.5), (91, 2.0)] {
            let (first, step) = bearings(beams, PI);
            assert!((first - half).abs() < 1e-12 && (step.to_degrees() - step_deg).abs() < 1e-12);
        }
        for beams in [1080, 1081] {
            let (first, step) = bearings(beams, 1.5 * PI);
            assert!((first + 0.75 * PI).abs() < 1e-12 && (step.to_degrees() - 0.25).abs() < 1e-12);
        }
        assert!(bearings(1, PI).1.is_finite());
    }

    #[test]
    fn robotlaser_says_its_own_geometry_and_may_have_remissions() {
        let head = "ROBOTLASER1 0 -2.0 4.0 0.1 5.6 0.01 0 2 1.5 2.5";
        for remissions in ["0", "2 10 20"] {
            let line = format!("{head} {remissions} 1 2 0.5 0.8 2 0.5 0.1 0.2 1 1 0 42.5 robot 43");
            let s = scan(&line);
            assert_eq!((s.bearings_rad, s.range_max_m), (Some((-2.0, 0.1)), Some(5.6)));
            assert_eq!(s.odom_from_laser, Pose { x_m: 1.0, y_m: 2.0, yaw_rad: 0.5 });
            assert_eq!(s.odom_from_body, Pose { x_m: 0.8, y_m: 2.0, yaw_rad: 0.5 });
            assert_eq!(s.stamp, "42.5");
        }
    }

    #[test]
    fn what_is_wrong_is_said() {
        for (line, says) in [
            ("ODOM 1 2", "ends before its pose"),
            ("ODOM 1 2 x 0 0 0 1 h 1", "\"x\" is not a number"),
            ("ODOM 1 2 nan 0 0 0 1 h 1", "not finite"),
            ("FLASER 4 1 2 3", "ends before its ranges"),
            ("FLASER 0 0 0 0 0 0 0 1 h 1", "no beams"),
            ("FLASER 99999999 1", "more than"),
            ("FLASER 1 1 0 0 0 0 0 0 later h 1", "stamp \"later\" is not a number"),
        ] {
            let why = parse(line).unwrap_err();
            assert!(why.contains(says), "{line}: {why}");
        }
    }

    #[test]
    fn other_lines_are_told_by_type() {
        assert_eq!(parse("# FLASER"), Ok(Line::Other("#")));
        assert_eq!(parse("TRUEPOS 1 2 3"), Ok(Line::Other("TRUEPOS")));
        assert_eq!(parse("PARAM robot_use_laser on"), Ok(Line::Other("PARAM")));
        assert_eq!(
            parse("PARAM robot_frontlaser_offset 0.27 1 h 1"),
            Ok(Line::Param { name: "robot_frontlaser_offset", value: 0.27 })
        );
    }

    #[test]
    fn stamps_are_exact_and_bounded() {
        assert_eq!(stamp("976052857.337546").unwrap().ns, 976_052_857_337_546_000);
        assert_eq!(stamp("-1.5").unwrap().ns, -1_500_000_000);
        assert_eq!(stamp("1e3").unwrap().ns, 1_000_000_000_000);
        assert!(stamp("1e30").is_err() && stamp("nan").is_err() && stamp("").is_err());
    }

    proptest! {
        #[test]
        fn any_text_is_parsed_or_refused(line in ".{0,80}") {
            let _ = parse(&line);
        }

        #[test]
        fn microsecond_stamps_survive(us in 0..4_000_000_000_000_000_i64) {
            let text = format!("{}.{:06}", us / 1_000_000, us % 1_000_000);
            prop_assert_eq!(stamp(&text).unwrap().ns, us * 1000);
        }
    }
}
