//! A robot's messages as they come, as toponym's: looked through until it is known what they are, then as a bag's.

use crate::bag::Topic;
use crate::plan::{Plan, Survey, kind};
use crate::stream::{Stream, Taken};
use std::collections::VecDeque;
use toponym::log::Options;
use toponym_proto::Message;

/// All lasers and transforms of a robot have been heard after so long by its stamps.
const LOOK_NS: i64 = 300_000_000;
/// What is not known after so long is supposed.
const LOOK_MAX_NS: i64 = 8_000_000_000;
/// Kept until it is known what they are, bytes.
const KEPT_MAX_BYTES: usize = 64 << 20;
/// What a message takes beside its content, about.
const ENTRY_BYTES: usize = 200;
/// So many messages in a row from before the newest, and the robot's clock began anew.
const BACK_MAX: u32 = 20;

/// What comes from one robot.
pub struct Feed {
    options: Options,
    survey: Survey,
    /// What came before it was known what it is.
    kept: VecDeque<(Topic, i64, Vec<u8>)>,
    kept_bytes: usize,
    first_ns: Option<i64>,
    stream: Option<(Plan, Stream)>,
    /// Why there is no plan yet, if one was tried.
    problem: Option<String>,
}

/// What there is to send.
#[derive(Clone, Debug, PartialEq)]
pub enum Fed {
    /// From now on it is a stream of its own, as planned.
    Begins(Plan),
    /// The next message.
    Message(Message),
}

impl Feed {
    /// Of nothing yet; of these topics and all transforms, or of all.
    pub fn new(options: Options, wanted: &[String]) -> Self {
        Self {
            options,
            survey: Survey::new(wanted),
            kept: VecDeque::new(),
            kept_bytes: 0,
            first_ns: None,
            stream: None,
            problem: None,
        }
    }

    /// What is known so far.
    pub fn survey(&self) -> &Survey {
        &self.survey
    }

    /// Why there is no plan yet, if one was tried.
    pub fn problem(&self) -> Option<&str> {
        self.problem.as_deref()
    }

    /// Takes a message that was received at a time, nanoseconds; what is to be sent by that is added to `out`.
    ///
    /// # Errors
    /// What is wrong with it; nothing of it is taken then.
    pub fn take(
        &mut self,
        topic: &Topic,
        received_ns: i64,
        data: Vec<u8>,
        out: &mut Vec<Fed>,
    ) -> Result<(), String> {
        if self.stream.is_some() {
            return self.stream_on(topic, received_ns, &data, out);
        }
        self.survey.take(topic, &data)?;
        self.kept_bytes += data.len() + ENTRY_BYTES;
        self.kept.push_back((topic.clone(), received_ns, data));
        while self.kept_bytes > KEPT_MAX_BYTES
            && let Some((.., oldest)) = self.kept.pop_front()
        {
            self.kept_bytes -= oldest.len() + ENTRY_BYTES;
        }
        // Not from when nothing but the floor plan of its frames was there.
        if topic.kind != kind::SCAN && self.first_ns.is_none() {
            return Ok(());
        }
        let looked_ns = received_ns.saturating_sub(*self.first_ns.get_or_insert(received_ns));
        let is_looked_at = self.survey.scanned_ns() >= LOOK_NS && self.survey.is_complete();
        if is_looked_at || looked_ns >= LOOK_MAX_NS {
            self.begin(out);
        }
        Ok(())
    }

    fn begin(&mut self, out: &mut Vec<Fed>) {
        let plan = match self.survey.plan() {
            Ok(plan) => plan,
            Err(why) => {
                self.problem = Some(why);
                return;
            }
        };
        self.problem = None;
        self.open(plan, out);
        self.kept_bytes = 0;
        for (topic, received_ns, data) in std::mem::take(&mut self.kept) {
            // It was looked at before; what is wrong with it now is its stamp.
            let _ = self.stream_on(&topic, received_ns, &data, out);
        }
    }

    fn open(&mut self, plan: Plan, out: &mut Vec<Fed>) {
        out.push(Fed::Begins(plan.clone()));
        self.stream = Some((plan.clone(), Stream::new(plan, self.options.clone())));
    }

    fn stream_on(
        &mut self,
        topic: &Topic,
        received_ns: i64,
        data: &[u8],
        out: &mut Vec<Fed>,
    ) -> Result<(), String> {
        // What was not heard when it began may be now: how a laser is mounted, or another laser.
        let is_news = match topic.kind.as_str() {
            kind::TF => topic.name.ends_with("_static"),
            kind::SCAN => {
                self.stream.as_ref().is_some_and(|(plan, _)| !plan.lasers.contains_key(&topic.name))
            }
            _ => false,
        };
        if is_news {
            self.survey.take(topic, data)?;
            let old = self.stream.as_ref().map(|(plan, _)| plan);
            if let Some(plan) = self.survey.plan().ok().filter(|new| old.is_none_or(|old| !old.is_as(new))) {
                self.finish(out);
                self.open(plan, out);
            }
        }
        let Some((plan, stream)) = &mut self.stream else { return Ok(()) };
        let taken = stream.take(topic, received_ns, data);
        if stream.back() >= BACK_MAX {
            let plan = plan.clone();
            self.finish(out);
            self.open(plan, out);
        } else {
            out.extend(stream.said().into_iter().map(Fed::Message));
            out.extend(std::iter::from_fn(|| stream.pop()).map(Fed::Message));
        }
        taken.map(|_: Taken| ())
    }

    /// What is still waited for is not.
    pub fn finish(&mut self, out: &mut Vec<Fed>) {
        if let Some((_, stream)) = &mut self.stream {
            stream.finish();
            out.extend(std::iter::from_fn(|| stream.pop()).map(Fed::Message));
        }
    }

    /// The newest stamp of the robot's clock.
    pub fn newest_ns(&self) -> Option<i64> {
        self.stream.as_ref().map(|(_, stream)| stream.newest_ns()).filter(|&ns| ns != i64::MIN)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cdr;
    use crate::msg::{Header, LaserScan, TFMessage, Time, Transform, TransformStamped};

    const TENTH_NS: i64 = 100_000_000;

    /// A robot as it comes.
    struct Robot {
        feed: Feed,
        out: Vec<Fed>,
    }

    impl Robot {
        fn new() -> Self {
            Self { feed: Feed::new(Options::default(), &[]), out: Vec::new() }
        }

        fn take(&mut self, name: &str, kind: &str, data: Vec<u8>) -> Result<(), String> {
            let topic = Topic { name: name.into(), kind: kind.into(), is_cdr: true };
            self.feed.take(&topic, 0, data, &mut self.out)
        }

        fn transform(&mut self, topic: &str, ns: i64, parent: &str, child: &str) {
            let header = Header { stamp: Time::from(ns), frame_id: parent.into() };
            let transform =
                TransformStamped { header, child_frame_id: child.into(), transform: Transform::default() };
            let data = cdr::write(&TFMessage { transforms: vec![transform] }).unwrap();
            let _ = self.take(topic, kind::TF, data);
        }

        fn scan(&mut self, topic: &str, ns: i64) {
            let header = Header { stamp: Time::from(ns), frame_id: "laser".into() };
            let ranges = vec![1.0; 8];
            let scan =
                LaserScan { header, range_max: 9.0, angle_increment: 0.1, ranges, ..LaserScan::default() };
            let _ = self.take(topic, kind::SCAN, cdr::write(&scan).unwrap());
        }

        /// Some seconds of it.
        fn drive(&mut self, from_ns: i64, lasers: &[&str]) {
            for k in 0..30 {
                let ns = from_ns + k * TENTH_NS;
                self.transform("/tf", ns, "odom", "base");
                for topic in lasers {
                    self.scan(topic, ns);
                }
            }
        }

        fn plans(&self) -> Vec<&Plan> {
            self.out
                .iter()
                .filter_map(|fed| if let Fed::Begins(plan) = fed { Some(plan) } else { None })
                .collect()
        }

        fn scans(&self) -> usize {
            self.out.iter().filter(|fed| matches!(fed, Fed::Message(Message::Scan(_)))).count()
        }
    }

    #[test]
    fn what_comes_before_it_is_known_what_it_is_is_not_lost() {
        let mut robot = Robot::new();
        robot.transform("/tf_static", 0, "base", "laser");
        robot.drive(1_000_000_000, &["/scan"]);
        assert_eq!((robot.plans().len(), robot.scans()), (1, 30));
    }

    #[test]
    fn a_laser_or_a_mounting_that_comes_later_begins_a_stream_anew() {
        let mut robot = Robot::new();
        robot.transform("/tf_static", 0, "base", "laser");
        robot.drive(1_000_000_000, &["/front"]);
        robot.drive(4_000_000_000, &["/front", "/back"]);
        let lasers: Vec<usize> = robot.plans().iter().map(|plan| plan.lasers.len()).collect();
        assert_eq!(lasers, [1, 2]);
        assert_eq!(robot.scans(), 90);
    }

    #[test]
    fn a_clock_that_steps_back_begins_a_stream_anew() {
        let mut robot = Robot::new();
        robot.transform("/tf_static", 0, "base", "laser");
        robot.drive(50_000_000_000, &["/scan"]);
        robot.drive(1_000_000_000, &["/scan"]);
        assert_eq!(robot.plans().len(), 2);
        // Those by which it was noticed are lost.
        assert!(robot.scans() >= 30 + 30 - BACK_MAX as usize, "{}", robot.scans());
    }
}
