//! A simulator of buildings, robots and guides: whatever a real robot and a real guide send, with
//! the truth beside it. Same scenario, same bytes.
//!
//! ```no_run
//! let recording = toponym_sim::Scenario::demo(1).run()?;
//! println!("{} messages", recording.messages.len());
//! # Ok::<(), toponym_sim::SimError>(())
//! ```

pub mod args;
mod body;
mod building;
mod calibration;
mod cast;
mod doors;
mod fault;
mod floor;
mod floorplan;
mod follow;
pub mod geom;
mod guide;
pub mod hall;
mod laser;
mod names;
mod people;
mod random;
pub mod reference;
mod robot;
mod scenarios;
mod storey;
pub mod tours;
mod wheels;
mod world;
pub mod write;

pub use body::{Motion, STEP_S};
pub use building::{OfficeStyle, demo_building, random_office};
pub use cast::Strike;
pub use fault::{Fault, Incident};
pub use floorplan::{Edge, FloorPlan, PlanError, Space};
pub use guide::{GuideStyle, Sentence};
pub use laser::{LaserModel, Post, Scene, Sweep};
pub use people::People;
pub use random::Draw;
pub use robot::Drive;
pub use storey::Storey;
pub use wheels::{Wheels, WheelsPrior};
pub use world::{Plan, Room, RoomKind, Surface, World};

use fault::senses;
use fault::wheels::misread;
use geom::Point;
use toponym_proto::merge::{Sentences, order_stamp};
use toponym_proto::{Clock, End, Header, Message, Odom, Pose, Say, Scan, Setup, Stamp};

/// Purpose of the people's draws, far from those of the lasers, which are counted.
const PEOPLE: u64 = 1000;
/// Purpose of the draws of when faults happen.
const FAULTS: u64 = 1001;
/// Of which walls are of glass, or dark.
const SURFACES: u64 = 1002;
/// Of how odometry trembles.
const JITTER: u64 = 1003;

/// A scenario that can't be played.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SimError {
    /// The tour names no room at all.
    #[error("the tour is empty: give at least one room")]
    NoTour,
    /// The tour leads to a room that is not there.
    #[error("the tour leads to room {0}, which the building does not have")]
    NoSuchRoom(usize),
    /// A floor plan has nothing to tour.
    #[error("a tour needs 2 rooms, the largest part that doors join has {0}: do portals face each other?")]
    TooSmall(usize),
    /// A fault of that name is not known.
    #[error("{0:?} is no fault: give {1}")]
    NoSuchFault(String, String),
    /// A tour of that name is not known.
    #[error("there is no tour {0:?}: give one of {1}")]
    NoSuchTour(String, String),
    /// A language of that name is not known.
    #[error("{0:?} is no language: give none, simple, complex or false20")]
    NoSuchLanguage(String),
    /// Two rooms are not joined by doors.
    #[error("there is no way from room {0} to room {1}")]
    NoWay(usize, usize),
}

/// Everything that a simulated tour depends on.
#[derive(Clone, Debug)]
pub struct Scenario {
    /// The building.
    pub world: World,
    /// Rooms in the order of the tour, as indices into [`World::rooms`].
    pub tour: Vec<usize>,
    /// How the robot moves.
    pub motion: Motion,
    /// What its wheels get wrong.
    pub wheels: Wheels,
    /// Odometry messages per second.
    pub odom_rate_hz: f64,
    /// Its lasers.
    pub lasers: Vec<LaserModel>,
    /// People walking about, the guide among them; 0: they leave no trace in the scans.
    pub people: usize,
    /// What goes wrong.
    pub faults: Vec<Fault>,
    /// What the guide says.
    pub guide: GuideStyle,
    /// Robot id in the messages.
    pub robot: String,
    /// Map id in the messages.
    pub map: String,
    /// Seed of every draw.
    pub seed: u64,
}

impl Scenario {
    /// A tour of a building with every setting on its default.
    pub fn new(world: World, tour: Vec<usize>, seed: u64) -> Self {
        Self {
            world,
            tour,
            motion: Motion::default(),
            wheels: Wheels::default(),
            odom_rate_hz: 10.0,
            lasers: vec![LaserModel::default()],
            people: 0,
            faults: Vec::new(),
            guide: GuideStyle::default(),
            robot: "sim".into(),
            map: "main".into(),
            seed,
        }
    }

    /// Plays the scenario.
    pub fn run(&self) -> Result<Recording, SimError> {
        let drive = robot::drive(&self.world, &self.tour, &self.motion, &mut self.draw(0))?;
        let said = guide::narrate(&self.world, &drive, &self.guide, &mut self.draw(2));
        let stream = self.stream(&drive)?;
        let messages = interleave(stream.messages, &said, &self.robot);
        let truth = Truth {
            scans: stream.scans,
            names: self.names(&said),
            start: drive.at(0.0),
            path_m: drive.path_m(),
            faults: stream.incidents,
        };
        Ok(Recording { messages, truth })
    }

    fn draw(&self, purpose: u64) -> Draw {
        Draw::new(self.seed, 16 + purpose)
    }

    /// What the robot sends along a drive.
    pub(crate) fn stream(&self, drive: &Drive) -> Result<Stream, SimError> {
        let incidents = fault::incidents(&self.faults, drive, &mut self.draw(FAULTS));
        let odometry = drive.measured(&self.wheels, &mut self.draw(1));
        let odometry = misread(&incidents, drive, &odometry);
        let world = senses::building(&self.world, &self.faults, &mut self.draw(SURFACES));
        let people = senses::people(&self.faults, self.people);
        let people = People::walking(&self.world, drive, people, &mut self.draw(PEOPLE))?;
        let scene = Scene { world: &world, drive, people: &people };
        let told = |t_s: &f64| !fault::silent(&incidents, *t_s);
        let mut timed = vec![(0.0, self.setup())];
        let mut trembles = self.draw(JITTER);
        for (k, t_s) in ticks(drive.duration_s(), self.odom_rate_hz).enumerate() {
            let pose = fault::wheels::told(&incidents, &odometry, k, self.odom_rate_hz, &mut trembles);
            if told(&t_s) {
                timed.push((t_s, Message::Odom(Odom { header: self.header(t_s), odom_from_body: pose })));
            }
        }
        let mut scans = Vec::new();
        for (laser, purpose) in self.lasers.iter().zip(3..) {
            let mut draw = self.draw(purpose);
            let (sees, mut last) = (senses::mounted(&self.faults, laser), None);
            for t_s in ticks(drive.duration_s() - laser.sweep_s, laser.rate_hz).filter(told) {
                let sweep = sees.sweep(&scene, t_s, &mut draw);
                if senses::covered(&incidents, t_s) {
                    continue;
                }
                let sweep = senses::sent(&incidents, t_s, sweep, last.as_ref());
                // A sweep is sent when it is complete.
                timed.push((t_s + laser.sweep_s, self.scan(t_s, laser, &sweep)));
                last = Some(sweep);
                scans.push((senses::stamped(&self.faults, Stamp::from_seconds(t_s)), drive.at(t_s)));
            }
        }
        scans.sort_by_key(|s| s.0);
        timed.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut messages: Vec<Message> = timed.into_iter().map(|(_, message)| message).collect();
        messages.push(Message::End(End { header: self.header(drive.duration_s()) }));
        number(&mut messages);
        Ok(Stream { messages, odometry, scans, incidents })
    }

    fn header(&self, t_s: f64) -> Header {
        let stamp = Stamp::from_seconds(t_s);
        Header { robot: self.robot.clone(), boot: 0, seq: 0, stamp, clock: Clock::Sim }
    }

    fn setup(&self) -> Message {
        let lasers = self.lasers.iter().map(|l| l.mount.clone()).collect();
        Message::Setup(Setup { header: self.header(0.0), map: self.map.clone(), lasers })
    }

    fn scan(&self, t_s: f64, laser: &LaserModel, sweep: &Sweep) -> Message {
        let header = self.header(t_s);
        Message::Scan(Scan {
            header: Header { stamp: senses::stamped(&self.faults, header.stamp), ..header },
            laser: laser.mount.id.clone(),
            angle_min_rad: laser.angle_min_rad(),
            angle_increment_rad: sweep.angle_increment_rad,
            time_increment_s: sweep.time_increment_s,
            ranges_m: sweep.ranges_m.clone(),
        })
    }

    /// The rooms that were spoken of.
    fn names(&self, said: &[Sentence]) -> Vec<(String, Vec<Point>)> {
        let spoken = |name: &str| !name.is_empty() && said.iter().any(|s| s.text.contains(name));
        let rooms = self.world.rooms.iter().filter(|r| spoken(&r.name));
        rooms.map(|r| (r.name.clone(), r.area.corners.clone())).collect()
    }
}

/// What a robot sent along a drive.
pub(crate) struct Stream {
    pub(crate) messages: Vec<Message>,
    /// As the wheels told it, faults and all.
    pub(crate) odometry: Drive,
    pub(crate) scans: Vec<(Stamp, Pose)>,
    pub(crate) incidents: Vec<Incident>,
}

/// A robot's stream with what was said to it, each sentence before what came later.
pub(crate) fn interleave(stream: Vec<Message>, said: &[Sentence], robot: &str) -> Vec<Message> {
    let mut messages = Vec::with_capacity(stream.len() + said.len());
    let mut waiting = Sentences::default();
    for (k, sentence) in said.iter().enumerate() {
        waiting.push(say(k, sentence, robot), Stamp::default());
    }
    for message in stream {
        while let Some(say) = waiting.pop_before(order_stamp(&message)) {
            messages.push(Message::Say(say));
        }
        messages.push(message);
    }
    messages
}

fn say(k: usize, sentence: &Sentence, robot: &str) -> Say {
    let began = Stamp::from_seconds(sentence.began_s);
    Say {
        id: ulid::Ulid::from_parts((began.ns / 1_000_000) as u64, k as u128).to_string(),
        robot: Some(robot.to_owned()),
        text: sentence.text.clone(),
        alternatives: Vec::new(),
        lang: Some("en".into()),
        speaker: Some("guide".into()),
        began: Some(began),
        ended: Some(Stamp::from_seconds(sentence.ended_s)),
        ago_s: None,
        retracts: None,
        answers: None,
    }
}

/// What a scenario brought forth.
#[derive(Clone, Debug)]
pub struct Recording {
    /// All messages in the order in which a server gets them.
    pub messages: Vec<Message>,
    /// What really happened.
    pub truth: Truth,
}

/// What really happened, world frame.
#[derive(Clone, Debug, PartialEq)]
pub struct Truth {
    /// The body's pose at each scan's stamp, in order of stamps.
    pub scans: Vec<(Stamp, Pose)>,
    /// Every name spoken, with the corners of each room that bears it, in order round it.
    pub names: Vec<(String, Vec<Point>)>,
    /// Pose at the start: the origin of the odometry frame.
    pub start: Pose,
    /// Way driven, metres.
    pub path_m: f64,
    /// What went wrong, and when.
    pub faults: Vec<Incident>,
}

fn ticks(duration_s: f64, rate_hz: f64) -> impl Iterator<Item = f64> {
    let n = if rate_hz > 0.0 && duration_s >= 0.0 { (duration_s * rate_hz) as usize + 1 } else { 0 };
    (0..n).map(move |k| k as f64 / rate_hz)
}

pub(crate) fn header_mut(message: &mut Message) -> Option<&mut Header> {
    match message {
        Message::Setup(m) => Some(&mut m.header),
        Message::Odom(m) => Some(&mut m.header),
        Message::Scan(m) => Some(&mut m.header),
        Message::End(m) => Some(&mut m.header),
        Message::Say(_) | Message::Mend(_) => None,
    }
}

/// One counter over all streams of the robot.
fn number(messages: &mut [Message]) {
    for (header, seq) in messages.iter_mut().filter_map(header_mut).zip(0..) {
        header.seq = seq;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn same_scenario_same_bytes_and_another_seed_others() {
        let bytes = |seed| {
            let mut scenario = Scenario::demo(seed);
            scenario.tour.truncate(3);
            format!("{:?}", scenario.run().unwrap().messages)
        };
        assert_eq!(bytes(1), bytes(1));
        assert_ne!(bytes(1), bytes(2));
    }

    #[test]
    fn the_demo_visits_every_room_and_comes_back() {
        let recording = Scenario::demo(1).run().unwrap();
        let names: Vec<&str> = recording.truth.names.iter().map(|n| n.0.as_str()).collect();
        for name in ["gym", "kitchen", "library", "cafe", "lecture hall", "mail room", "workshop"] {
            assert!(names.contains(&name), "{name} in {names:?}");
        }
        assert_eq!(names.iter().filter(|n| **n == "elevator lobby").count(), 2);
        let path_m = recording.truth.path_m;
        assert!((150.0..350.0).contains(&path_m), "{path_m} m");
    }

    #[test]
    fn messages_are_numbered_and_sentences_stand_before_what_came_later() {
        let recording = Scenario::office(&OfficeStyle::default(), 6, 5).run().unwrap();
        let mut seq = 0;
        let mut newest = None;
        for (k, message) in recording.messages.iter().enumerate() {
            if let Some(header) = message.header() {
                assert_eq!(header.seq, seq);
                seq += 1;
                newest = newest.max(Some(header.stamp));
            } else if let Message::Say(say) = message {
                assert!(newest <= say.began, "{say:?} comes too late");
                let next = recording.messages[k + 1..].iter().map(order_stamp).next();
                assert!(next > say.began, "{say:?} comes too early");
            }
        }
        assert!(matches!(recording.messages.last(), Some(Message::End(_))));
        assert!(recording.messages.iter().any(|m| matches!(m, Message::Say(_))));
    }

    #[test]
    fn a_swept_scan_comes_after_its_last_ray() {
        let mut scenario = Scenario::demo(1);
        scenario.tour.truncate(2);
        scenario.lasers[0].sweep_s = 0.15;
        let recording = scenario.run().unwrap();
        let mut newest_odom = None;
        for message in &recording.messages {
            match message {
                Message::Odom(o) => newest_odom = Some(o.header.stamp),
                Message::Scan(s) => assert!(newest_odom >= Some(s.header.stamp), "{:?}", s.header),
                _ => {}
            }
        }
    }

    #[test]
    fn a_tour_to_nowhere_is_an_error() {
        let mut scenario = Scenario::demo(1);
        scenario.tour = vec![99];
        assert_eq!(scenario.run().unwrap_err(), SimError::NoSuchRoom(99));
        scenario.tour.clear();
        assert_eq!(scenario.run().unwrap_err(), SimError::NoTour);
    }
}
