//! The only place that rejects.

use crate::limits::{
    AGO_MAX_S, ANGLE_MAX_RAD, AREA_CORNERS_MAX, BOOT_MAX, COORDINATE_MAX_M, Limits, RANGE_MAX_M, SEQ_MAX,
    STAMP_MAX_NS, TIME_INCREMENT_MAX_S,
};
use crate::stream::{Header, Laser, Mend, Message, Pose, Say, Scan, Setup, Stamp};
use std::f64::consts::PI;

/// Nobody points at where a robot is more exactly, metres or radians, …
const SIGMA_MIN: f64 = 0.01;
/// … or says anything by less.
const SIGMA_MAX_M: f64 = 1000.0;

/// Stands for "the one robot there is" in the key of a sentence; no robot may bear it.
pub const ANY_ROBOT: &str = "any";

/// Why a value is refused.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{field}: {reason}")]
pub struct Invalid {
    /// Name of the field, as in `PROTOCOL.md`.
    pub field: String,
    /// The bad value and what it should be.
    pub reason: String,
}

impl Invalid {
    /// A refusal.
    pub fn new(field: &str, reason: impl Into<String>) -> Self {
        Self { field: field.into(), reason: reason.into() }
    }
}

impl Message {
    /// Checks every field; names the first bad one.
    pub fn validate(&self, limits: &Limits) -> Result<(), Invalid> {
        if let Some(header) = self.header() {
            check_header(header)?;
        }
        match self {
            Self::Setup(m) => check_setup(m, limits),
            Self::Odom(m) => check_pose("odom_from_body", &m.odom_from_body),
            Self::Scan(m) => check_scan(m, limits),
            Self::Say(m) => check_say(m, limits),
            Self::End(_) => Ok(()),
            Self::Mend(m) => check_mend(m, limits),
        }
    }
}

fn check_header(h: &Header) -> Result<(), Invalid> {
    check_id("robot", &h.robot)?;
    if h.robot == ANY_ROBOT {
        return Err(Invalid::new("robot", format!("\"{ANY_ROBOT}\" is reserved")));
    }
    for (field, value, max) in [("boot", h.boot, BOOT_MAX), ("seq", h.seq, SEQ_MAX)] {
        if value > max {
            return Err(Invalid::new(field, format!("is {value}, must be at most 2^46 ({max})")));
        }
    }
    check_stamp("stamp", h.stamp)
}

fn check_stamp(field: &str, stamp: Stamp) -> Result<(), Invalid> {
    if (-STAMP_MAX_NS..=STAMP_MAX_NS).contains(&stamp.ns) {
        return Ok(());
    }
    Err(Invalid::new(field, format!("is {} ns, must be within 4e18 ns of 0", stamp.ns)))
}

fn check_number(field: &str, value: f64, min: f64, max: f64) -> Result<(), Invalid> {
    if value >= min && value <= max {
        return Ok(());
    }
    Err(Invalid::new(field, format!("is {value}, must be from {min} to {max}")))
}

fn check_count(field: &str, count: usize, max: usize) -> Result<(), Invalid> {
    if count <= max {
        return Ok(());
    }
    Err(Invalid::new(field, format!("has {count} entries, at most {max} are taken")))
}

fn check_pose(field: &str, pose: &Pose) -> Result<(), Invalid> {
    check_number(&format!("{field}.x_m"), pose.x_m, -COORDINATE_MAX_M, COORDINATE_MAX_M)?;
    check_number(&format!("{field}.y_m"), pose.y_m, -COORDINATE_MAX_M, COORDINATE_MAX_M)?;
    check_number(&format!("{field}.yaw_rad"), pose.yaw_rad, -ANGLE_MAX_RAD, ANGLE_MAX_RAD)
}

fn check_setup(setup: &Setup, limits: &Limits) -> Result<(), Invalid> {
    check_id("map", &setup.map)?;
    check_count("lasers", setup.lasers.len(), limits.lasers)?;
    if setup.lasers.is_empty() {
        return Err(Invalid::new("lasers", "is empty, must name at least one"));
    }
    for (i, laser) in setup.lasers.iter().enumerate() {
        check_laser(i, laser, limits)?;
        if setup.lasers.iter().take(i).any(|other| other.id == laser.id) {
            return Err(Invalid::new(&format!("lasers[{i}].id"), format!("{:?} comes twice", laser.id)));
        }
    }
    Ok(())
}

fn check_laser(i: usize, laser: &Laser, limits: &Limits) -> Result<(), Invalid> {
    let field = |name: &str| format!("lasers[{i}].{name}");
    check_id(&field("id"), &laser.id)?;
    // A laser that is hundreds of metres off its robot is a mistake of units.
    check_number(&field("x_m"), laser.x_m, -100.0, 100.0)?;
    check_number(&field("y_m"), laser.y_m, -100.0, 100.0)?;
    check_number(&field("yaw_rad"), laser.yaw_rad, -ANGLE_MAX_RAD, ANGLE_MAX_RAD)?;
    check_number(&field("range_min_m"), laser.range_min_m, 0.0, RANGE_MAX_M)?;
    check_number(&field("range_max_m"), laser.range_max_m, 0.0, RANGE_MAX_M)?;
    if laser.range_min_m >= laser.range_max_m {
        let reason = format!("is {}, not above range_min_m {}", laser.range_max_m, laser.range_min_m);
        return Err(Invalid::new(&field("range_max_m"), reason));
    }
    check_count(&field("ignored_rad"), laser.ignored_rad.len(), limits.ignored_sectors)?;
    for (from, to) in &laser.ignored_rad {
        check_number(&field("ignored_rad"), *from, -ANGLE_MAX_RAD, ANGLE_MAX_RAD)?;
        check_number(&field("ignored_rad"), *to, *from, ANGLE_MAX_RAD)?;
    }
    Ok(())
}

fn check_scan(scan: &Scan, limits: &Limits) -> Result<(), Invalid> {
    check_id("laser", &scan.laser)?;
    check_number("angle_min_rad", scan.angle_min_rad, -ANGLE_MAX_RAD, ANGLE_MAX_RAD)?;
    let turn = std::f64::consts::TAU;
    check_number("angle_increment_rad", scan.angle_increment_rad, -turn, turn)?;
    if scan.angle_increment_rad == 0.0 {
        return Err(Invalid::new("angle_increment_rad", "is 0: all rays would be one"));
    }
    check_number("time_increment_s", scan.time_increment_s, 0.0, TIME_INCREMENT_MAX_S)?;
    check_count("ranges_m", scan.ranges_m.len(), limits.beams)
}

fn check_say(say: &Say, limits: &Limits) -> Result<(), Invalid> {
    check_token("id", &say.id)?;
    if let Some(robot) = &say.robot {
        check_id("robot", robot)?;
    }
    check_text("text", &say.text, limits)?;
    check_count("alternatives", say.alternatives.len(), limits.alternatives)?;
    for (i, hearing) in say.alternatives.iter().enumerate() {
        check_text(&format!("alternatives[{i}].text"), &hearing.text, limits)?;
        check_number(&format!("alternatives[{i}].p"), hearing.p, 0.0, 1.0)?;
    }
    let tokens = [
        ("lang", &say.lang),
        ("speaker", &say.speaker),
        ("retracts", &say.retracts),
        ("answers", &say.answers),
    ];
    for (field, token) in tokens {
        if let Some(token) = token {
            check_token(field, token)?;
        }
    }
    if let Some(ago_s) = say.ago_s {
        check_number("ago_s", ago_s, 0.0, AGO_MAX_S)?;
    }
    for (field, stamp) in [("began", say.began), ("ended", say.ended)] {
        if let Some(stamp) = stamp {
            check_stamp(field, stamp)?;
        }
    }
    if let (Some(began), Some(ended)) = (say.began, say.ended)
        && ended < began
    {
        return Err(Invalid::new("ended", "is before began"));
    }
    Ok(())
}

fn check_mend(mend: &Mend, limits: &Limits) -> Result<(), Invalid> {
    match mend {
        Mend::Undo { id } => id.iter().try_for_each(|id| check_token("id", id)),
        Mend::Rename { from, to } => {
            check_text("from", from, limits)?;
            check_text("to", to, limits)
        }
        Mend::Forget { name } => check_text("name", name, limits),
        Mend::Pose { id, map_from_body, sigma_m, sigma_rad } => {
            check_token("id", id)?;
            check_pose("map_from_body", map_from_body)?;
            check_number("sigma_m", *sigma_m, SIGMA_MIN, SIGMA_MAX_M)?;
            check_number("sigma_rad", *sigma_rad, SIGMA_MIN, PI)
        }
        Mend::Area { id, polygon_m, name, instead, forbidden } => {
            check_token("id", id)?;
            check_polygon("polygon_m", polygon_m)?;
            match name {
                Some(name) => check_text("name", name, limits),
                None if *forbidden && !instead => Ok(()),
                None => Err(Invalid::new("name", "is missing: an area has one, or is forbidden alone")),
            }
        }
    }
}

fn check_polygon(field: &str, corners: &[[f64; 2]]) -> Result<(), Invalid> {
    if !(3..=AREA_CORNERS_MAX).contains(&corners.len()) {
        let reason = format!("has {} corners, must have 3 to {AREA_CORNERS_MAX}", corners.len());
        return Err(Invalid::new(field, reason));
    }
    for &coordinate in corners.iter().flatten() {
        check_number(field, coordinate, -COORDINATE_MAX_M, COORDINATE_MAX_M)?;
    }
    Ok(())
}

fn check_token(field: &str, token: &str) -> Result<(), Invalid> {
    if token.is_empty() || token.len() > 64 || token.chars().any(char::is_control) {
        return Err(Invalid::new(field, "must have 1 to 64 bytes and no control characters"));
    }
    Ok(())
}

fn check_text(field: &str, text: &str, limits: &Limits) -> Result<(), Invalid> {
    if text.trim().is_empty() {
        return Err(Invalid::new(field, "is empty"));
    }
    let chars = text.chars().count();
    if chars > limits.text_chars {
        let reason = format!("has {chars} characters, at most {} are taken", limits.text_chars);
        return Err(Invalid::new(field, reason));
    }
    Ok(())
}

/// Checks an endpoint's kind of link. `tls/` is refused: Zenoh reads and writes one TLS stream from two threads at once, which
/// breaks links and can break memory (<https://github.com/eclipse-zenoh/zenoh/issues/2557>).
pub fn check_link(field: &str, endpoint: &str) -> Result<(), Invalid> {
    match endpoint.strip_prefix("tls/") {
        Some(rest) => Err(Invalid::new(field, format!("Zenoh's tls/ breaks under load: use quic/{rest}"))),
        None => Ok(()),
    }
}

/// Checks an id: `[a-z0-9][a-z0-9_-]{0,62}`.
pub fn check_id(field: &str, id: &str) -> Result<(), Invalid> {
    let word = |c: u8| c.is_ascii_lowercase() || c.is_ascii_digit();
    let ok = match id.as_bytes() {
        [first, rest @ ..] => {
            word(*first) && rest.len() <= 62 && rest.iter().all(|c| word(*c) || matches!(c, b'_' | b'-'))
        }
        [] => false,
    };
    if ok {
        return Ok(());
    }
    let shown: String = id.chars().take(80).collect();
    Err(Invalid::new(field, format!("{shown:?} is no id: [a-z0-9][a-z0-9_-]{{0,62}}")))
}

#[cfg(test)]
mod tests;
