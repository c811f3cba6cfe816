//! ROS's messages as toponym's, in the order of their stamps.

use crate::bag::Topic;
use crate::cdr;
use crate::frames::{isometry, moving, on_floor};
use crate::msg::{Clock as ClockMsg, LaserScan, Odometry, StringMsg, TFMessage, Time, Transform};
use crate::plan::{Plan, Source, kind};
use std::collections::{BTreeMap, VecDeque};
use toponym::log::Options;
use toponym_proto::{Clock, Header, Limits, Message, Odom, Pose, Say, Scan, Setup, Stamp};

/// So long a message is kept for streams that are behind: a scan is sent when it is whole, a tenth of a second after
/// odometry of its stamp, and odometry may come late over the air.
const WINDOW_NS: i64 = 2_000_000_000;
/// A stamp so much earlier than the newest of its stream is of a clock that began anew.
const BACK_NS: i64 = 1_000_000_000;
/// Stamps and times of reception that differ by less are of one clock.
const ONE_CLOCK_NS: i64 = 5_000_000_000;

/// One robot's messages on their way.
pub struct Stream {
    plan: Plan,
    options: Options,
    seq: u64,
    began: bool,
    /// By stamp and order of arrival.
    waiting: BTreeMap<(i64, u64), Message>,
    ready: VecDeque<Message>,
    arrived: u64,
    newest_ns: i64,
    /// How many in a row were far back.
    back: u32,
    /// Newest stamp of each topic, and of odometry (empty name), that was taken.
    taken_ns: BTreeMap<String, i64>,
    /// By how much reception is later than stamps.
    lag_ns: Option<i64>,
    /// Simulated time.
    clock_ns: Option<i64>,
    said: u64,
}

/// What became of a message.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Taken {
    /// It is part of the stream.
    Used,
    /// Nothing of it is needed.
    Unused,
}

impl Stream {
    /// Before its first message.
    pub fn new(plan: Plan, options: Options) -> Self {
        Self {
            plan,
            options,
            seq: 0,
            began: false,
            waiting: BTreeMap::new(),
            ready: VecDeque::new(),
            arrived: 0,
            newest_ns: i64::MIN,
            back: 0,
            taken_ns: BTreeMap::new(),
            lag_ns: None,
            clock_ns: None,
            said: 0,
        }
    }

    /// Takes a message that was received at a time, nanoseconds.
    ///
    /// # Errors
    /// What is wrong with it; nothing of it is taken then.
    pub fn take(&mut self, topic: &Topic, received_ns: i64, data: &[u8]) -> Result<Taken, String> {
        if !topic.is_cdr {
            return Ok(Taken::Unused);
        }
        match (topic.kind.as_str(), &self.plan.odometry) {
            (kind::SCAN, _) if self.plan.lasers.contains_key(&topic.name) => {
                self.scan(&topic.name, received_ns, cdr::read(data)?)?;
            }
            (kind::TF, Source::Tf { topic: of, .. }) if *of == topic.name => {
                self.transforms(received_ns, &cdr::read(data)?)?;
            }
            (kind::ODOMETRY, Source::Topic { topic: of, .. }) if *of == topic.name => {
                let message: Odometry = cdr::read(data)?;
                let pose = message.pose.pose;
                let transform = Transform { translation: pose.position, rotation: pose.orientation };
                self.odom(message.header.stamp, received_ns, &transform)?;
            }
            (kind::TEXT, _) if self.plan.is_speech(&topic.name) => {
                self.say(received_ns, cdr::read::<StringMsg>(data)?.data)?;
            }
            // The plan has them.
            (kind::TF, _) if topic.name.ends_with("_static") => {}
            (kind::CLOCK, _) => self.clock_ns = Some(cdr::read::<ClockMsg>(data)?.clock.ns()),
            _ => return Ok(Taken::Unused),
        }
        Ok(Taken::Used)
    }

    /// The next message, if it is not to be waited for any more.
    pub fn pop(&mut self) -> Option<Message> {
        self.ready.pop_front()
    }

    /// Sentences that wait for what was seen before them; whoever puts them in order himself need not wait for more.
    pub fn said(&mut self) -> Vec<Message> {
        let is_said = |(_, message): &(&(i64, u64), &Message)| matches!(message, Message::Say(_));
        let of: Vec<(i64, u64)> = self.waiting.iter().filter(is_said).map(|(&at, _)| at).collect();
        of.iter().filter_map(|at| self.waiting.remove(at)).collect()
    }

    /// Nothing is waited for any more.
    pub fn finish(&mut self) {
        self.release(i64::MAX);
    }

    /// The stamp of a message of a stream within the robot's.
    ///
    /// # Errors
    /// If it is not later than the last.
    fn stamp(&mut self, stream: &str, stamp: Time, received_ns: i64) -> Result<i64, String> {
        let stamp_ns = if self.plan.by_reception { received_ns } else { stamp.ns() };
        match self.taken_ns.get(stream) {
            Some(last) if stamp_ns == *last => return Err("the same stamp again".into()),
            Some(last) if stamp_ns < *last => {
                self.back += u32::from(last - stamp_ns > BACK_NS);
                let back_s = (last - stamp_ns) as f64 * 1e-9;
                return Err(format!("its stamp is {back_s:.3} s before that of the one before"));
            }
            _ => {}
        }
        self.lag_ns = Some(received_ns.saturating_sub(stamp_ns));
        Ok(stamp_ns)
    }

    fn header(&self, stamp_ns: i64) -> Header {
        let Options { robot, boot, .. } = self.options.clone();
        Header { robot, boot, seq: 0, stamp: Stamp { ns: stamp_ns }, clock: Clock::Log }
    }

    fn scan(&mut self, topic: &str, received_ns: i64, scan: LaserScan) -> Result<(), String> {
        let stamp_ns = self.stamp(topic, scan.header.stamp, received_ns)?;
        if self.plan.odometry == Source::None {
            let odom = Odom { header: self.header(stamp_ns), odom_from_body: Pose::default() };
            self.enter(stamp_ns, "", Message::Odom(odom))?;
        }
        let message = Message::Scan(Scan {
            header: self.header(stamp_ns),
            laser: self.plan.lasers.get(topic).map(|laser| laser.id.clone()).unwrap_or_default(),
            angle_min_rad: scan.angle_min.into(),
            angle_increment_rad: scan.angle_increment.into(),
            time_increment_s: f64::from(scan.time_increment).max(0.0),
            ranges_m: scan.ranges,
        });
        self.enter(stamp_ns, topic, message)
    }

    fn transforms(&mut self, received_ns: i64, message: &TFMessage) -> Result<(), String> {
        for t in &message.transforms {
            let Source::Tf { moving: wanted, .. } = &self.plan.odometry else { return Ok(()) };
            if moving(t) == *wanted {
                self.odom(t.header.stamp, received_ns, &t.transform)?;
            }
        }
        Ok(())
    }

    fn odom(&mut self, stamp: Time, received_ns: i64, pose: &Transform) -> Result<(), String> {
        let stamp_ns = self.stamp("", stamp, received_ns)?;
        let odom_from_body = on_floor(&isometry(pose)).ok_or("its pose is no number")?;
        let odom = Message::Odom(Odom { header: self.header(stamp_ns), odom_from_body });
        self.enter(stamp_ns, "", odom)
    }

    fn say(&mut self, received_ns: i64, text: String) -> Result<(), String> {
        // A text has no stamp: when it came it was said, on whatever clock stamps are.
        let is_one_clock = self.lag_ns.is_none_or(|lag| lag.abs() < ONE_CLOCK_NS);
        let began_ns = match self.clock_ns {
            Some(clock_ns) => clock_ns,
            None if is_one_clock => received_ns,
            None => self.newest_ns,
        };
        self.said += 1;
        let say = Message::Say(Say {
            id: ulid::Ulid::from_parts((began_ns.max(0) / 1_000_000) as u64, self.said.into()).to_string(),
            robot: Some(self.options.robot.clone()),
            text,
            began: Some(Stamp { ns: began_ns }),
            ..Say::default()
        });
        say.validate(&Limits::default()).map_err(|e| e.to_string())?;
        self.wait(began_ns, say);
        Ok(())
    }

    /// Takes a message that is checked.
    fn enter(&mut self, stamp_ns: i64, stream: &str, message: Message) -> Result<(), String> {
        message.validate(&Limits::default()).map_err(|e| e.to_string())?;
        self.taken_ns.insert(stream.to_owned(), stamp_ns);
        self.newest_ns = self.newest_ns.max(stamp_ns);
        self.back = 0;
        self.wait(stamp_ns, message);
        self.release(self.settled_ns());
        Ok(())
    }

    /// Nothing earlier is waited for: all streams have come so far, or are too far behind.
    fn settled_ns(&self) -> i64 {
        let odometry = (self.plan.odometry != Source::None).then_some("");
        let streams = self.plan.lasers.keys().map(String::as_str).chain(odometry);
        let slowest_ns = streams.map(|of| self.taken_ns.get(of).copied().unwrap_or(i64::MIN)).min();
        slowest_ns.unwrap_or(i64::MIN).max(self.newest_ns.saturating_sub(WINDOW_NS))
    }

    /// The newest stamp.
    pub fn newest_ns(&self) -> i64 {
        self.newest_ns
    }

    /// How many messages in a row came from long before the newest: the clock began anew.
    pub fn back(&self) -> u32 {
        self.back
    }

    fn wait(&mut self, stamp_ns: i64, message: Message) {
        self.arrived += 1;
        self.waiting.insert((stamp_ns, self.arrived), message);
    }

    /// Hands out what is no later than a stamp, numbered, the setup first.
    fn release(&mut self, until_ns: i64) {
        while let Some(entry) = self.waiting.first_entry().filter(|e| e.key().0 <= until_ns) {
            let ((stamp_ns, _), mut message) = entry.remove_entry();
            if !self.began {
                self.began = true;
                let header = self.numbered(stamp_ns);
                let lasers = self.plan.lasers.values().cloned().collect();
                self.ready.push_back(Message::Setup(Setup { header, map: self.options.map.clone(), lasers }));
            }
            match &mut message {
                Message::Odom(m) => m.header = self.numbered(stamp_ns),
                Message::Scan(m) => m.header = self.numbered(stamp_ns),
                _ => {}
            }
            self.ready.push_back(message);
        }
    }

    fn numbered(&mut self, stamp_ns: i64) -> Header {
        self.seq += 1;
        Header { seq: self.seq - 1, ..self.header(stamp_ns) }
    }
}
