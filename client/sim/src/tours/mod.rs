//! Tours on which one hypothesis is not enough: buildings with look-alikes, dark floor between
//! them, wheels that cannot tell which one it is, and guides who can.
//!
//! [`tour`] makes of a name and a seed everything but the noise: a building, a drive through it, a
//! guide, and what else might have happened as far as scans can tell ([`Tour::hypotheses`], the
//! truth first; which of them is the truth is drawn with equal chances). [`Tour::play`] adds the
//! noise: one stream of the robot's messages, and a narration in each [`Language`].
//!
//! ```no_run
//! use toponym_sim::tours::{Language, messages, tour};
//! let played = tour("small", 1)?.play()?;
//! let all = messages(&played.stream, &played.narration[&Language::Simple], "sim");
//! # Ok::<(), toponym_sim::SimError>(())
//! ```

mod court;
mod design;
mod layout;
mod plain;
mod related;
mod ring;
mod stamp;
pub mod statements;
mod strain;
#[cfg(test)]
mod tests;
mod unit;
mod words;

use crate::body::STEP_S;
use crate::geom::{Point, compose};
use crate::{Drive, FloorPlan, Incident, Scenario, Sentence, SimError, Stream, Truth, WheelsPrior};
use std::collections::{BTreeMap, BTreeSet};
use std::fmt;
use std::str::FromStr;
use toponym_proto::{Message, Pose, Stamp};

/// The name of a tour of a floor plan.
pub(crate) const PLANS: &str = "plans";

/// Sets the draws of the second day apart from the first.
const SECOND_DAY: u64 = 0x5ec0_0dda_0000_0000;

/// Names of the tours.
///
/// - `small`: lobby, hallway and gym, out to a dark court, and back in: by the same door or, as
///   likely, by its look-alike's.
/// - `large`: three buildings round a dark court, two of them with a look-alike beside them.
/// - `autonomous`: as `small`, with the guide walking ahead and names that many rooms bear.
/// - `twins`: two wings of one plan; `ring`: a square ring whose four sides are alike; `rows`:
///   equal offices door by door. With `-decided`, a room that is not alike settles it in the end.
/// - `slip`, `unsigned`, `break`: an office without look-alikes, and wheels at fault.
/// - `start`: a second day that starts anywhere, in a building that is its own half turn.
/// - `clean`: an office without look-alikes or faults.
pub const TOURS: &[&str] = &[
    "small",
    "large",
    "autonomous",
    "twins",
    "twins-decided",
    "ring",
    "ring-decided",
    "rows",
    "rows-decided",
    "slip",
    "unsigned",
    "break",
    "start",
    "clean",
];

/// How a guide speaks.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Language {
    /// Not at all.
    None,
    /// Says only what the place is called where they are: on the first visit and the second, or
    /// once before and once after a return.
    Simple,
    /// As simple, but some rooms are told of from elsewhere instead when they are new.
    Complex,
    /// As complex, with every fifth sentence false.
    False20,
}

impl Language {
    /// All of them.
    pub const ALL: [Self; 4] = [Self::None, Self::Simple, Self::Complex, Self::False20];
}

impl fmt::Display for Language {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::None => "none",
            Self::Simple => "simple",
            Self::Complex => "complex",
            Self::False20 => "false20",
        })
    }
}

impl FromStr for Language {
    type Err = SimError;

    fn from_str(text: &str) -> Result<Self, SimError> {
        let named = Self::ALL.into_iter().find(|l| l.to_string() == text);
        named.ok_or_else(|| SimError::NoSuchLanguage(text.to_owned()))
    }
}

/// From a time on, the robot elsewhere than it is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Piece {
    /// Seconds from the start of the drive.
    pub from_s: f64,
    /// The robot is at `world_from_true ∘ true pose`: a rigid motion of the world.
    pub world_from_true: Pose,
}

/// Something that might have happened, as far as scans can tell until something settles it.
#[derive(Clone, Debug, PartialEq)]
pub struct Hypothesis {
    /// What it is called: where the robot returned to.
    pub name: String,
    /// In order of time, each until the next; before the first, and without any, the truth.
    pub pieces: Vec<Piece>,
}

impl Hypothesis {
    /// Where the robot is by this hypothesis, world frame. On dark floor between two pieces it is
    /// on its way from one to the other: such poses say nothing.
    pub fn at(&self, t_s: f64, true_pose: &Pose) -> Pose {
        let piece = self.pieces.iter().rev().find(|p| p.from_s <= t_s);
        piece.map_or(*true_pose, |p| compose(&p.world_from_true, true_pose))
    }
}

/// What a sentence claims.
#[derive(Clone, Debug, PartialEq)]
pub struct Claim {
    /// The name said.
    pub name: String,
    /// Middle of the room spoken of, world frame.
    pub at: Point,
    /// Whether that room is called so; a false sentence gives it another one's name.
    pub held: bool,
    /// By how many relations it is told of; 0: from within.
    pub relations: usize,
}

/// A sentence of a narration.
#[derive(Clone, Debug, PartialEq)]
pub struct Said {
    /// When and what.
    pub sentence: Sentence,
    /// What it claims, if it is about a name.
    pub claim: Option<Claim>,
}

/// How a name was told.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub enum Told {
    /// Never: no place at all is right.
    #[default]
    Never,
    /// From within a room.
    Outright,
    /// By so many relations alone.
    Related(usize),
}

/// What is right to answer.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Asked {
    /// Corners of the rooms that are right, in order round them, world frame.
    pub rooms: Vec<Vec<Point>>,
    /// How their name was told.
    pub told: Told,
}

/// Questions with their answers.
pub type Questions = BTreeMap<String, Asked>;

/// A tour before any noise.
#[derive(Clone, Debug)]
pub struct Tour {
    /// One of [`TOURS`].
    pub name: &'static str,
    /// Seed of the world, the drive, the wheels, the laser, the people and the guide.
    pub seed: u64,
    /// World, wheels, lasers, people, faults. Its `tour` and `guide` are not used: the drive and
    /// the narration are the tour's own.
    pub scenario: Scenario,
    /// What [`Scenario::wheels`] were drawn from.
    pub wheels_prior: WheelsPrior,
    /// What really happens, and what looks the same: beforehand all equally likely.
    pub hypotheses: Vec<Hypothesis>,
    /// Names that may be said or asked for, in alphabetical order; some are never said.
    pub vocabulary: Vec<String>,
    /// True poses, world frame, from time 0 on.
    pub drive: Drive,
    /// Stretches on dark floor: from, to, seconds.
    pub blind_s: Vec<(f64, f64)>,
    /// When the robot came to where look-alikes part: out of a dark stretch, or switched on again.
    pub returns_s: Vec<f64>,
    /// The first scan by which all hypotheses but the truth are refuted, if any is.
    pub decisive_s: Option<f64>,
    /// When the robot starts anew with another boot, if it does.
    pub second_day_s: Option<f64>,
    /// The guide says nothing for so long after a return.
    late_m: f64,
}

/// A tour as it was played.
#[derive(Clone, Debug)]
pub struct Played {
    /// The robot's messages, without sentences: the same for every language.
    pub stream: Vec<Message>,
    /// True poses, world frame.
    pub drive: Drive,
    /// Where the robot was by its wheels, faults and all, odometry frame.
    pub odometry: Drive,
    /// What is said in each language.
    pub narration: BTreeMap<Language, Vec<Said>>,
    /// What really happened; names are those said in any language.
    pub truth: Truth,
    /// What may be asked after hearing each language.
    pub questions: BTreeMap<Language, Questions>,
    /// The first scan by which all hypotheses but the truth are refuted, if any is.
    pub decisive_s: Option<f64>,
    /// What went wrong, and when.
    pub faults: Vec<Incident>,
}

/// The tour of a name and a seed.
///
/// # Errors
/// If there is no tour of that name.
pub fn tour(name: &str, seed: u64) -> Result<Tour, SimError> {
    let unknown = || SimError::NoSuchTour(name.to_owned(), TOURS.join(", "));
    let name = *TOURS.iter().find(|n| **n == name).ok_or_else(unknown)?;
    let mut tour = match name {
        "large" => court::large(name, seed),
        "ring" | "ring-decided" => ring::ring(name, seed),
        "start" => plain::start(name, seed),
        "slip" | "unsigned" | "break" | "clean" => plain::office(name, seed),
        _ => court::row(name, seed),
    }?;
    if name.ends_with("-decided") || name == "start" {
        tour.decisive_s = design::decisive(&tour);
    }
    Ok(tour)
}

/// A tour of a floor plan, without look-alikes or faults.
///
/// # Errors
/// If fewer than two of its rooms are in reach of each other.
pub fn planned(plan: &FloorPlan, seed: u64) -> Result<Tour, SimError> {
    plain::plan(plan, seed)
}

impl Tour {
    /// Plays it: the same every time.
    pub fn play(&self) -> Result<Played, SimError> {
        let stream = self.stream()?;
        let narration: BTreeMap<Language, Vec<Said>> =
            Language::ALL.into_iter().map(|l| (l, words::narrate(self, l))).collect();
        let held = |s: &Said| s.claim.as_ref().filter(|c| c.held).map(|c| c.name.clone());
        let names: BTreeSet<String> = narration.values().flatten().filter_map(held).collect();
        let names = names
            .into_iter()
            .flat_map(|n| words::rooms_called(self, &n).into_iter().map(move |c| (n.clone(), c)))
            .collect();
        let truth = Truth {
            scans: stream.scans,
            names,
            start: self.drive.at(0.0),
            path_m: self.path_m(),
            faults: stream.incidents.clone(),
        };
        let questions = narration.iter().map(|(l, said)| (*l, words::questions(self, said))).collect();
        Ok(Played {
            stream: stream.messages,
            drive: self.drive.clone(),
            odometry: stream.odometry,
            narration,
            truth,
            questions,
            decisive_s: self.decisive_s,
            faults: stream.incidents,
        })
    }

    /// What the robot sends, each day with a boot of its own.
    fn stream(&self) -> Result<Stream, SimError> {
        let Some(second_s) = self.second_day_s else { return self.scenario.stream(&self.drive) };
        let (first, second) = self.drive.poses.split_at((second_s / STEP_S).round() as usize);
        let mut whole = self.scenario.stream(&Drive { poses: first.to_vec() })?;
        let scenario = Scenario { seed: self.seed ^ SECOND_DAY, ..self.scenario.clone() };
        let mut more = scenario.stream(&Drive { poses: second.to_vec() })?;
        // Only the last day ends the stream: whatever else was said would have to come before.
        whole.messages.retain(|m| !matches!(m, Message::End(_)));
        let later_ns = Stamp::from_seconds(second_s).ns;
        for header in more.messages.iter_mut().filter_map(crate::header_mut) {
            header.boot = 1;
            header.stamp.ns += later_ns;
        }
        for (stamp, _) in &mut more.scans {
            stamp.ns += later_ns;
        }
        whole.messages.extend(more.messages);
        whole.scans.extend(more.scans);
        whole.odometry.poses.extend(more.odometry.poses);
        Ok(whole)
    }

    /// Way driven, without the jump overnight.
    fn path_m(&self) -> f64 {
        let first = self.second_day_s.map_or(self.drive.poses.len(), |s| (s / STEP_S).round() as usize);
        let (first, second) = self.drive.poses.split_at(first);
        [first, second].map(|poses| Drive { poses: poses.to_vec() }.path_m()).iter().sum()
    }
}

/// A robot's stream with what was said to it, in the order in which a server gets them.
pub fn messages(stream: &[Message], said: &[Said], robot: &str) -> Vec<Message> {
    let sentences: Vec<Sentence> = said.iter().map(|s| s.sentence.clone()).collect();
    crate::interleave(stream.to_vec(), &sentences, robot)
}
