//! A CARMEN log as messages: setup first, then odometry and scans in the order of their lines.

use super::carmen::{self, Line, ScanLine};
use super::{LogError, LogRecord, Notes, Options, Records, check};
use std::collections::VecDeque;
use std::f64::consts::{PI, TAU};
use toponym_proto::stream::Laser;
use toponym_proto::{Clock, Header, Message, Odom, Pose, Scan, Setup, Stamp};

/// The only laser of these logs.
const LASER: &str = "front";
/// CARMEN writes 81.83, 81.91, … where a SICK saw nothing; no real return is that long.
const RANGE_MAX_M: f64 = 80.0;
/// Closer returns are dust on the window.
const RANGE_MIN_M: f64 = 0.02;
/// A larger distance of laser and robot is not a mounting.
const MOUNTING_MAX_M: f64 = 2.0;

/// Reader of CARMEN text.
#[derive(Debug)]
pub struct CarmenLog {
    text: Vec<u8>,
    /// Where the next line begins.
    at: usize,
    /// Lines read.
    line: usize,
    options: Options,
    range_max_m: f64,
    /// Field of view of sweeps that don't say.
    view_rad: f64,
    /// The log has `ODOM` lines: these are the trajectory's rows, not the scans'.
    has_odom: bool,
    last_odom: Option<(Pose, Stamp)>,
    seq: u64,
    ready: VecDeque<LogRecord>,
    notes: Notes,
}

impl CarmenLog {
    /// Looks through the text for what the setup has to say and stands before the first message.
    ///
    /// # Errors
    /// If there is no usable scan.
    pub fn new(text: Vec<u8>, options: &Options, notes: Notes) -> Result<Self, LogError> {
        let survey = Survey::of(&text).map_err(|(lines, why)| {
            let whys: Vec<String> = notes.remarks.iter().cloned().chain(why).collect();
            let detail = if whys.is_empty() { String::new() } else { format!("; {}", whys.join("; ")) };
            LogError::NoScan { file: notes.file.clone(), lines, detail }
        })?;
        let mut log = Self {
            text,
            at: 0,
            line: 0,
            options: options.clone(),
            range_max_m: survey.range_max_m,
            view_rad: survey.view_rad,
            has_odom: survey.has_odom,
            last_odom: None,
            seq: 0,
            ready: VecDeque::new(),
            notes,
        };
        let setup = Message::Setup(Setup {
            header: log.header(0, survey.first_stamp),
            map: options.map.clone(),
            lasers: vec![survey.laser],
        });
        check(&setup).map_err(|why| LogError::Setup { file: log.notes.file.clone(), why })?;
        log.emit(setup, false, survey.first_stamp_text);
        Ok(log)
    }

    /// The header of the next message but `ahead`.
    fn header(&self, ahead: u64, stamp: Stamp) -> Header {
        let (robot, boot) = (self.options.robot.clone(), self.options.boot);
        Header { robot, boot, seq: self.seq + ahead, stamp, clock: Clock::Log }
    }

    /// Hands out a message that is checked and has the next header.
    fn emit(&mut self, message: Message, odom_row: bool, stamp_text: String) {
        self.seq += 1;
        self.notes.count(&message);
        self.ready.push_back(LogRecord { message, line: self.line, odom_row, stamp_text });
    }

    fn odom(&mut self, odom_from_body: Pose, text: &str, odom_row: bool) -> Result<(), String> {
        let stamp = carmen::stamp(text)?;
        let message = Message::Odom(Odom { header: self.header(0, stamp), odom_from_body });
        check(&message)?;
        self.last_odom = Some((odom_from_body, stamp));
        self.emit(message, odom_row, text.to_owned());
        Ok(())
    }

    fn scan(&mut self, scan: ScanLine<'_>) -> Result<(), String> {
        let stamp = carmen::stamp(scan.stamp)?;
        let brings_odom = self.last_odom != Some((scan.odom_from_body, stamp));
        let (odom_from_body, text) = (scan.odom_from_body, scan.stamp);
        // First of all: of a bad line not even the odometry is taken.
        let message =
            sweep(scan, self.header(u64::from(brings_odom), stamp), self.range_max_m, self.view_rad)?;
        if brings_odom {
            self.odom(odom_from_body, text, !self.has_odom)?;
        }
        self.emit(message, false, text.to_owned());
        Ok(())
    }

    fn take(&mut self, line: Line<'_>) -> Result<(), String> {
        match line {
            Line::Odom { odom_from_body, stamp } => self.odom(odom_from_body, stamp, true),
            Line::Scan(scan) => self.scan(scan),
            Line::Param { .. } => Ok(()),
            Line::Other(kind) => {
                let of_a_type =
                    kind.bytes().all(|b| b.is_ascii_uppercase() || b.is_ascii_digit() || b == b'_');
                if of_a_type && !kind.is_empty() && kind != "PARAM" {
                    *self.notes.ignored.entry(kind.to_owned()).or_default() += 1;
                } else if !(of_a_type || kind.starts_with('#')) {
                    return Err("not a CARMEN message".into());
                }
                Ok(())
            }
        }
    }
}

/// A line's sweep, checked.
fn sweep(scan: ScanLine<'_>, header: Header, range_max_m: f64, view_rad: f64) -> Result<Message, String> {
    let (angle_min_rad, angle_increment_rad) =
        scan.bearings_rad.unwrap_or_else(|| carmen::bearings(scan.ranges_m.len(), view_rad));
    let beyond = range_max_m as f32;
    let mut ranges_m = scan.ranges_m;
    ranges_m.iter_mut().filter(|r| **r >= beyond).for_each(|r| *r = f32::INFINITY);
    let message = Message::Scan(Scan {
        header,
        laser: LASER.into(),
        angle_min_rad,
        angle_increment_rad,
        time_increment_s: 0.0,
        ranges_m,
    });
    check(&message)?;
    Ok(message)
}

impl Iterator for CarmenLog {
    type Item = LogRecord;

    fn next(&mut self) -> Option<LogRecord> {
        while self.ready.is_empty() {
            if self.at >= self.text.len() {
                return None;
            }
            // The text is lent out while a line of it is read.
            let text = std::mem::take(&mut self.text);
            let (line, whole, next) = line_at(&text, self.at);
            self.line += 1;
            self.at = next;
            match line.and_then(carmen::parse).and_then(|line| self.take(line)) {
                Ok(()) => {}
                Err(why) if whole => self.notes.bad(self.line, why),
                Err(why) => self.notes.remark(format!("line {}, the last, is truncated: {why}", self.line)),
            }
            self.text = text;
        }
        self.ready.pop_front()
    }
}

impl Records for CarmenLog {
    fn notes(&self) -> &Notes {
        &self.notes
    }

    fn progress(&self) -> (u64, u64) {
        (self.at as u64, self.text.len() as u64)
    }
}

/// The line that begins at `at`, whether it has its line break, and where the next one begins. Of
/// a line without a break the last field may be cut short without looking so: it is left out.
fn line_at(text: &[u8], at: usize) -> (Result<&str, String>, bool, usize) {
    let rest = &text[at.min(text.len())..];
    let end = rest.iter().position(|b| *b == b'\n');
    let line = std::str::from_utf8(&rest[..end.unwrap_or(rest.len())])
        .map_err(|e| format!("not text after {} bytes", e.valid_up_to()));
    let line = line.map(str::trim_ascii_start);
    match end {
        Some(end) => (line, true, at + end + 1),
        None => (line.map(|l| l.rsplit_once([' ', '\t']).map_or("", |(l, _)| l)), false, text.len()),
    }
}

/// What a look through the whole log tells before the first message.
struct Survey {
    first_stamp: Stamp,
    first_stamp_text: String,
    has_odom: bool,
    range_max_m: f64,
    view_rad: f64,
    laser: Laser,
}

impl Survey {
    /// Fails with the number of lines and the first thing wrong if there is no usable scan.
    fn of(text: &[u8]) -> Result<Self, (usize, Option<String>)> {
        let (mut at, mut lines, mut raw, mut has_odom, mut wrong) = (0, 0, 0, false, None);
        let (mut offset_m, mut param_max_m, mut view_rad, mut first_stamp) = (None, None, PI, None);
        let (mut first, mut last_at) = (None, None);
        while at < text.len() {
            let (line, _, next) = line_at(text, at);
            lines += 1;
            let line = line.unwrap_or("");
            raw += usize::from(line.starts_with("RAWLASER"));
            let is_scan = line.starts_with("FLASER") || line.starts_with("ROBOTLASER1");
            has_odom |= line.starts_with("ODOM");
            if is_scan && first.is_some() {
                last_at = Some(at);
            } else if is_scan || first_stamp.is_none() || line.starts_with("PARAM") {
                match carmen::parse(line) {
                    Ok(Line::Odom { stamp, .. }) => first_stamp = first_stamp.or(Some(stamp)),
                    Ok(Line::Scan(scan)) => match usable(&scan) {
                        Ok(()) => {
                            first_stamp = first_stamp.or(Some(scan.stamp));
                            first = Some(scan);
                        }
                        Err(why) => wrong = wrong.or(Some(format!("line {lines}: {why}"))),
                    },
                    Ok(Line::Param { name: "robot_frontlaser_offset", value }) => offset_m = Some(value),
                    Ok(Line::Param {
                        name: "robot_front_laser_max" | "laser_front_laser_max_range",
                        value,
                    }) => param_max_m = Some(param_max_m.map_or(value, |max: f64| max.min(value))),
                    Ok(Line::Param { name: "laser_front_laser_fov", value }) if value > 0.0 => {
                        // Written in degrees; a view is no more than a circle.
                        view_rad = if value > TAU { value.to_radians() } else { value }.min(TAU);
                    }
                    Ok(_) => {}
                    Err(why) => wrong = wrong.or(Some(format!("line {lines}: {why}"))),
                }
            }
            at = next;
        }
        let (Some(first), Some(stamp)) = (first, first_stamp) else {
            let told =
                format!("{raw} lines are RAWLASER: sweeps without the robot's pose, which are not read");
            return Err((lines, wrong.or((raw > 0).then_some(told))));
        };
        let last = last_at.and_then(|at| line_at(text, at).0.ok()).map(carmen::parse);
        let last = if let Some(Ok(Line::Scan(scan))) = &last { scan } else { &first };
        let mounting = offset_m.map_or_else(|| mounting(&first, last), |x_m| Pose { x_m, ..Pose::default() });
        let range_max_m = param_max_m.or(first.range_max_m).unwrap_or(RANGE_MAX_M).clamp(1.0, RANGE_MAX_M);
        let first_stamp = carmen::stamp(stamp).map_err(|why| (lines, Some(why)))?;
        Ok(Self {
            first_stamp,
            first_stamp_text: stamp.to_owned(),
            has_odom,
            range_max_m,
            view_rad,
            laser: laser(mounting, range_max_m),
        })
    }
}

/// Whether a scan would be taken.
fn usable(scan: &ScanLine<'_>) -> Result<(), String> {
    let Options { robot, boot, .. } = Options::default();
    let header = Header { robot, boot, seq: 1, stamp: carmen::stamp(scan.stamp)?, clock: Clock::Log };
    check(&Message::Odom(Odom { header: header.clone(), odom_from_body: scan.odom_from_body }))?;
    sweep(scan.clone(), header, RANGE_MAX_M, PI).map(drop)
}

fn laser(body_from_laser: Pose, range_max_m: f64) -> Laser {
    Laser {
        id: LASER.into(),
        x_m: body_from_laser.x_m,
        y_m: body_from_laser.y_m,
        yaw_rad: body_from_laser.yaw_rad,
        upside_down: false,
        range_min_m: RANGE_MIN_M,
        range_max_m,
        ignored_rad: Vec::new(),
    }
}

/// Laser in the body's frame, from the two poses of a scan line. In corrected logs the two have
/// different frames, so it must be a small one and hold for the last scan as for the first.
fn mounting(first: &ScanLine<'_>, last: &ScanLine<'_>) -> Pose {
    let [a, b] = [first, last].map(|s| between(&s.odom_from_body, &s.odom_from_laser));
    let same = (a.x_m - b.x_m).hypot(a.y_m - b.y_m) < 0.02 && wrap(a.yaw_rad - b.yaw_rad).abs() < 0.02;
    if same && a.x_m.hypot(a.y_m) <= MOUNTING_MAX_M { a } else { Pose::default() }
}

fn between(a: &Pose, b: &Pose) -> Pose {
    let (s, c) = a.yaw_rad.sin_cos();
    let (dx, dy) = (b.x_m - a.x_m, b.y_m - a.y_m);
    // Adding zero turns −0 into 0.
    Pose { x_m: c * dx + s * dy + 0.0, y_m: -s * dx + c * dy + 0.0, yaw_rad: wrap(b.yaw_rad - a.yaw_rad) }
}

fn wrap(angle_rad: f64) -> f64 {
    angle_rad.sin().atan2(angle_rad.cos())
}

#[cfg(test)]
#[path = "carmen_log_tests.rs"]
mod tests;
