//! Tables of numbers: `t, x, y, yaw` and ranges in each line, or a trajectory (that, or TUM's
//! `t x y z qx qy qz qw`) with a file of `t` and ranges beside it. Seconds, metres, radians.
//!
//! Fields are parted by commas, semicolons or blanks; a first line of words is passed over. Lines that begin with `#` may say
//! `name = number`: `angle_min_rad`, `angle_increment_rad`, `range_min_m`, `range_max_m`, `laser_x_m`, `laser_y_m`,
//! `laser_yaw_rad`.

use super::carmen::{bearings, stamp};
use super::{LogError, LogRecord, Notes, Options, Records, check};
use std::collections::{BTreeMap, VecDeque};
use std::f64::consts::PI;
use toponym_proto::stream::Laser;
use toponym_proto::{Clock, Header, Message, Odom, Pose, Scan, Setup, Stamp};

/// The only laser of these logs.
const LASER: &str = "front";
/// Names of numbers, and what they are where nobody says.
const SAID: [(&str, f64); 7] = [
    ("angle_min_rad", f64::NAN),
    ("angle_increment_rad", f64::NAN),
    ("range_min_m", 0.02),
    ("range_max_m", 80.0),
    ("laser_x_m", 0.0),
    ("laser_y_m", 0.0),
    ("laser_yaw_rad", 0.0),
];
/// Fields of `t, x, y, yaw`, and of TUM's lines.
const POSE: usize = 4;
const TUM: usize = 8;

/// What a table's lines are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Form {
    /// `t, x, y, yaw`, and ranges if there are more.
    Poses,
    /// `t x y z qx qy qz qw`
    Tum,
    /// `t`, and ranges.
    Ranges,
}

/// A line.
#[derive(Clone, Debug, PartialEq)]
struct Row {
    stamp: Stamp,
    text: String,
    pose: Option<Pose>,
    ranges_m: Vec<f32>,
}

/// Reader of tables.
pub struct CsvLog {
    text: Vec<u8>,
    /// Where the next line begins.
    at: usize,
    /// Lines read.
    line: usize,
    form: Form,
    /// Bearing of the first ray and step, by number of rays, where the table doesn't say.
    said_rad: Option<(f64, f64)>,
    /// Of the trajectory beside it, those that are not handed out yet.
    poses: VecDeque<Row>,
    options: Options,
    seq: u64,
    ready: VecDeque<LogRecord>,
    notes: Notes,
}

/// Whether a file looks like a table of numbers.
pub fn is_table(text: &[u8]) -> bool {
    let mut lines = lines_of(text).filter(|line| !line.is_empty() && !line.starts_with('#')).take(2);
    let is_numbers = |line: &str| fields(line).len() >= POSE && stamp(fields(line)[0]).is_ok();
    match lines.next() {
        Some(first) if is_numbers(first) => true,
        Some(first) => {
            let starts = first.to_lowercase();
            let is_head = ["t", "stamp", "time"].iter().any(|word| starts.starts_with(word));
            is_head && first.contains([',', ';']) && lines.next().is_some_and(is_numbers)
        }
        None => false,
    }
}

fn lines_of(text: &[u8]) -> impl Iterator<Item = &str> {
    text.split(|b| *b == b'\n').map(|line| std::str::from_utf8(line).unwrap_or("\0").trim())
}

fn fields(line: &str) -> Vec<&str> {
    if line.contains([',', ';']) {
        line.split([',', ';']).map(str::trim).collect()
    } else {
        line.split_ascii_whitespace().collect()
    }
}

impl CsvLog {
    /// Of a table with poses in it. Looks through it and stands before the first message.
    ///
    /// # Errors
    /// If there is no usable scan.
    pub fn new(text: Vec<u8>, options: &Options, notes: Notes) -> Result<Self, LogError> {
        Self::stand(text, Form::Poses, VecDeque::new(), options, notes)
    }

    /// Of a trajectory, and a table of scans beside it.
    ///
    /// # Errors
    /// If there is no usable scan, or no pose.
    pub fn with_scans(
        trajectory: &[u8],
        scans: Vec<u8>,
        options: &Options,
        notes: Notes,
    ) -> Result<Self, LogError> {
        let mut poses = VecDeque::new();
        for line in lines_of(trajectory).filter(|line| !line.starts_with('#')) {
            let form = if fields(line).len() == TUM { Form::Tum } else { Form::Poses };
            poses.extend(row(line, form).ok());
        }
        if poses.is_empty() {
            let why = "it has no line of t, x, y, yaw or of t x y z qx qy qz qw".into();
            return Err(LogError::NotALog { file: notes.file, why });
        }
        Self::stand(scans, Form::Ranges, poses, options, notes)
    }

    fn stand(
        text: Vec<u8>,
        form: Form,
        poses: VecDeque<Row>,
        options: &Options,
        notes: Notes,
    ) -> Result<Self, LogError> {
        let (mut lines, mut first) = (0, None);
        let mut said: BTreeMap<&'static str, f64> = SAID.into();
        for line in lines_of(&text) {
            lines += 1;
            if let Some(words) = line.strip_prefix('#') {
                say(words, &mut said);
            } else if first.is_none() {
                first = row(line, form).ok().filter(|row| !row.ranges_m.is_empty());
            }
        }
        let Some(first) = first else {
            let detail =
                "; a scan is t, x, y, yaw and its ranges, or with a trajectory beside it t and ranges".into();
            return Err(LogError::NoScan { file: notes.file, lines, detail });
        };
        let said_rad = (said["angle_min_rad"], said["angle_increment_rad"]);
        let said_rad = (said_rad.0.is_finite() && said_rad.1.is_finite()).then_some(said_rad);
        let mut log = Self {
            text,
            at: 0,
            line: 0,
            form,
            said_rad,
            poses,
            options: options.clone(),
            seq: 0,
            ready: VecDeque::new(),
            notes,
        };
        if said_rad.is_none() {
            let rays = first.ranges_m.len();
            log.notes.remark(format!(
                "nothing says where its {rays} rays look: they are taken to fan over 180°, the first to the right; a line \
                 \"# angle_min_rad = …, angle_increment_rad = …\" says it"
            ));
        }
        let start = log.poses.front().map_or(first.stamp, |pose| pose.stamp.min(first.stamp));
        let setup = Message::Setup(Setup {
            header: log.header(start),
            map: options.map.clone(),
            lasers: vec![laser(&said)],
        });
        check(&setup).map_err(|why| LogError::Setup { file: log.notes.file.clone(), why })?;
        log.emit(setup, false, first.text);
        Ok(log)
    }

    fn header(&self, stamp: Stamp) -> Header {
        let (robot, boot) = (self.options.robot.clone(), self.options.boot);
        Header { robot, boot, seq: self.seq, stamp, clock: Clock::Log }
    }

    fn emit(&mut self, message: Message, odom_row: bool, stamp_text: String) {
        self.seq += 1;
        self.notes.count(&message);
        self.ready.push_back(LogRecord { message, line: self.line, odom_row, stamp_text });
    }

    fn take(&mut self, row: Row) -> Result<(), String> {
        while self.poses.front().is_some_and(|pose| pose.stamp <= row.stamp) {
            let pose = self.poses.pop_front();
            pose.map_or(Ok(()), |pose| self.take(pose))?;
        }
        let scan = Message::Scan(Scan {
            header: self.header(row.stamp),
            laser: LASER.into(),
            angle_min_rad: self.fan(row.ranges_m.len()).0,
            angle_increment_rad: self.fan(row.ranges_m.len()).1,
            time_increment_s: 0.0,
            ranges_m: row.ranges_m,
        });
        let Message::Scan(Scan { ranges_m, .. }) = &scan else { return Ok(()) };
        let has_scan = !ranges_m.is_empty();
        // First of all: of a bad line not even the pose is taken.
        if has_scan {
            check(&scan)?;
        }
        if let Some(odom_from_body) = row.pose {
            let odom = Message::Odom(Odom { header: self.header(row.stamp), odom_from_body });
            check(&odom)?;
            self.emit(odom, true, row.text.clone());
        }
        if let (true, Message::Scan(scan)) = (has_scan, scan) {
            let header = self.header(row.stamp);
            self.emit(Message::Scan(Scan { header, ..scan }), false, row.text);
        }
        Ok(())
    }

    fn fan(&self, rays: usize) -> (f64, f64) {
        self.said_rad.unwrap_or_else(|| bearings(rays, PI))
    }
}

fn laser(said: &BTreeMap<&str, f64>) -> Laser {
    Laser {
        id: LASER.into(),
        x_m: said["laser_x_m"],
        y_m: said["laser_y_m"],
        yaw_rad: said["laser_yaw_rad"],
        upside_down: false,
        range_min_m: said["range_min_m"],
        range_max_m: said["range_max_m"],
        ignored_rad: Vec::new(),
    }
}

/// Takes what a remark says: `angle_min_rad = -1.57, range_max_m = 30`.
fn say(words: &str, said: &mut BTreeMap<&'static str, f64>) {
    for pair in words.split([',', ';']) {
        let Some((name, number)) = pair.split_once(['=', ':']) else { continue };
        if let (Some(value), Ok(number)) = (said.get_mut(name.trim()), number.trim().parse()) {
            *value = number;
        }
    }
}

fn row(line: &str, form: Form) -> Result<Row, String> {
    let fields = fields(line);
    let number = |k: usize| -> Result<f64, String> {
        let text = fields.get(k).ok_or_else(|| format!("{} fields are too few", fields.len()))?;
        text.parse().map_err(|_| format!("field {}, {text:?}, is not a number", k + 1))
    };
    // Nothing, or a word, is a ray that tells nothing.
    let range = |text: &&str| text.parse().unwrap_or(f32::NAN);
    let text = (*fields.first().unwrap_or(&"")).to_owned();
    let (pose, first_range) = match form {
        Form::Poses => (Some(Pose { x_m: number(1)?, y_m: number(2)?, yaw_rad: number(3)? }), POSE),
        Form::Tum => {
            let [x, y, z, w] = [number(4)?, number(5)?, number(6)?, number(7)?];
            let yaw_rad = (2.0 * (w * z + x * y)).atan2(1.0 - 2.0 * (y * y + z * z));
            (Some(Pose { x_m: number(1)?, y_m: number(2)?, yaw_rad }), TUM)
        }
        Form::Ranges => (None, 1),
    };
    let ranges_m = fields.get(first_range..).unwrap_or_default().iter().map(range).collect();
    Ok(Row { stamp: stamp(&text)?, text, pose, ranges_m })
}

impl Iterator for CsvLog {
    type Item = LogRecord;

    fn next(&mut self) -> Option<LogRecord> {
        while self.ready.is_empty() {
            if self.at >= self.text.len() {
                let last = self.poses.pop_front()?;
                // One that a server would not take either.
                let _ = self.take(last);
                continue;
            }
            let rest = &self.text[self.at..];
            let end = rest.iter().position(|b| *b == b'\n').unwrap_or(rest.len());
            let line = std::str::from_utf8(&rest[..end]).map_err(|_| "not text".to_owned()).map(str::trim);
            let row = match line {
                Ok(line) if line.is_empty() || line.starts_with('#') => None,
                // Words may stand above the numbers.
                Ok(line) if self.line == 0 && stamp(fields(line)[0]).is_err() => None,
                line => Some(line.and_then(|line| row(line, self.form))),
            };
            self.at += end + 1;
            self.line += 1;
            if let Some(Err(why)) = row.map(|row| row.and_then(|row| self.take(row))) {
                self.notes.bad(self.line, why);
            }
        }
        self.ready.pop_front()
    }
}

impl Records for CsvLog {
    fn notes(&self) -> &Notes {
        &self.notes
    }

    fn progress(&self) -> (u64, u64) {
        (self.at.min(self.text.len()) as u64, self.text.len() as u64)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(log: Result<CsvLog, LogError>) -> (Vec<Message>, Notes) {
        let mut log = log.unwrap();
        let messages = log.by_ref().map(|r| r.message).collect();
        (messages, log.notes)
    }

    fn table(text: &str) -> (Vec<Message>, Notes) {
        assert!(is_table(text.as_bytes()), "{text}");
        read(CsvLog::new(text.into(), &Options::default(), Notes::default()))
    }

    #[test]
    fn a_line_is_a_pose_and_what_was_seen_there() {
        let text = "t,x,y,yaw,r0,r1,r2\n# angle_min_rad = -0.5, angle_increment_rad = 0.5\n# range_max_m: 9; laser_x_m = 0.2\n\
                    1.5,0,0,0,2,,nan\n1.75,0.1,0,0.05\n2.0,0.2,0,0.1,2,3,4\n";
        let (messages, notes) = table(text);
        assert_eq!(
            (notes.odoms, notes.scans, notes.bad_lines, notes.remarks.len()),
            (3, 2, 0, 0),
            "{notes:?}"
        );
        let Message::Setup(setup) = &messages[0] else { panic!("{messages:?}") };
        assert!(
            (setup.lasers[0].x_m - 0.2).abs() < 1e-12 && (setup.lasers[0].range_max_m - 9.0).abs() < 1e-12
        );
        let Message::Scan(scan) = &messages[2] else { panic!("{messages:?}") };
        assert!((scan.angle_min_rad + 0.5).abs() < 1e-12 && (scan.angle_increment_rad - 0.5).abs() < 1e-12);
        assert!(
            (scan.ranges_m[0] - 2.0).abs() < 1e-6 && scan.ranges_m[1].is_nan() && scan.ranges_m[2].is_nan()
        );
        assert_eq!(scan.header.stamp.ns, 1_500_000_000);
        let seqs: Vec<u64> = messages.iter().map(|m| m.header().unwrap().seq).collect();
        assert_eq!(seqs, [0, 1, 2, 3, 4, 5]);
    }

    #[test]
    fn blanks_part_fields_too_and_what_nobody_says_is_told() {
        let (messages, notes) = table("0 0 0 0 1 1 1\n0.1 0 0 x 1 1 1\n0.2 0 0 0 1 1 1\n");
        assert_eq!((messages.len(), notes.bad_lines), (5, 1));
        assert!(notes.first_bad[0].1.contains("field 4") && notes.remarks[0].contains("3 rays"), "{notes:?}");
        let Message::Scan(scan) = &messages[2] else { panic!("{messages:?}") };
        assert!((scan.angle_min_rad + PI / 2.0).abs() < 1e-12);
    }

    #[test]
    fn a_trajectory_and_scans_are_brought_together_by_their_stamps() {
        let tum = b"# t x y z qx qy qz qw\n1 0 0 0 0 0 0 1\n1.1 0.1 0 0 0 0 0.0998334 0.9950042\n1.3 0.2 0 0 0 0 0 1\n";
        let scans = "1.05,1,1,1\n1.2,2,2,2\n";
        let (messages, notes) =
            read(CsvLog::with_scans(tum, scans.into(), &Options::default(), Notes::default()));
        let stamps: Vec<i64> = messages.iter().map(|m| m.header().unwrap().stamp.ns / 1_000_000).collect();
        assert_eq!(stamps, [1000, 1000, 1050, 1100, 1200, 1300]);
        assert_eq!((notes.odoms, notes.scans), (3, 2));
        let Message::Odom(turned) = &messages[3] else { panic!("{messages:?}") };
        assert!((turned.odom_from_body.yaw_rad - 0.2).abs() < 1e-5);
        let none = CsvLog::with_scans(b"a b", scans.into(), &Options::default(), Notes::default());
        assert!(none.err().unwrap().to_string().contains("no line of"));
    }

    #[test]
    fn other_texts_are_no_tables() {
        for text in [
            "FLASER 1 1 0 0 0 0 0 0 1 h 1\n",
            "",
            "# t\n",
            "1 2 3\n",
            "time flies, they say\n",
            "{\"t\": 1}\n",
        ] {
            assert!(!is_table(text.as_bytes()), "{text}");
        }
        let none = CsvLog::new("0,0,0,0\n".into(), &Options::default(), Notes::default());
        assert!(none.err().unwrap().to_string().contains("a scan is"));
    }
}
