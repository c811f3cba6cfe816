//! What the guide of a tour says.

use super::related::related;
use super::{Asked, Claim, Language, PLANS, Questions, Said, Told, Tour};
use crate::building::NAMES;
use crate::geom::Point;
use crate::guide::{Visit, spoken, visits};
use crate::random::Draw;
use crate::world::RoomKind;
use std::collections::BTreeSet;

/// Names that no room bears and nobody says.
pub(super) const NEVER: [&str; 3] = ["greenhouse", "observatory", "sauna"];
/// Names kept for rooms of particular tours.
const KEPT: [&str; 2] = ["gym", "lounge"];
/// What a gym's look-alike is, and an elevator lobby's.
const DECOYS: [[&str; 4]; 2] = [
    ["dance hall", "assembly hall", "sports hall", "playroom"],
    ["atrium", "foyer", "reception hall", "waiting room"],
];
/// Shorter visits are not worth a word.
const STAY_S: f64 = 2.0;
/// Every so many sentences, one is false.
const FALSE_EACH: usize = 5;

/// Names of rooms in a random order, each once.
pub(super) struct Names {
    left: Vec<&'static str>,
}

impl Names {
    pub fn new(draw: &mut Draw) -> Self {
        let mut free: Vec<&'static str> = NAMES.into_iter().filter(|n| !KEPT.contains(n)).collect();
        let mut left = Vec::new();
        while !free.is_empty() {
            left.push(free.swap_remove(draw.below(free.len())));
        }
        Self { left }
    }

    /// The next one; any, once there are no more.
    pub fn next(&mut self) -> &'static str {
        self.left.pop().unwrap_or("storage room")
    }

    /// What the look-alikes of a gym and of an elevator lobby are.
    pub fn decoy(draw: &mut Draw) -> (String, String) {
        let pick = |names: [&str; 4], draw: &mut Draw| names[draw.below(4)].to_owned();
        (pick(DECOYS[0], draw), pick(DECOYS[1], draw))
    }
}

/// How something is said.
#[derive(Clone, Debug)]
pub(super) enum Form {
    This,
    Another,
    Again,
    /// So, by so many relations.
    Lies(String, usize),
}

/// A sentence before it is words.
#[derive(Clone, Debug)]
pub(super) struct Thought {
    pub at_s: f64,
    pub visit: usize,
    pub room: usize,
    pub form: Form,
}

impl Form {
    fn words(&self, name: &str) -> String {
        match self {
            Self::This => format!("This is the {name}."),
            Self::Another => format!("This is another {name}."),
            Self::Again => format!("We are in the {name} again."),
            Self::Lies(how, _) => format!("The {name} is {how}."),
        }
    }

    /// By how many relations it tells of a room; 0: where it is.
    fn relations(&self) -> usize {
        match self {
            Self::This | Self::Another | Self::Again => 0,
            Self::Lies(_, relations) => *relations,
        }
    }
}

/// What is said along a tour.
pub(super) fn narrate(tour: &Tour, language: Language) -> Vec<Said> {
    if language == Language::None {
        return Vec::new();
    }
    let stays = visits(&tour.scenario.world, &tour.drive);
    let mut thoughts = here(tour, &stays);
    let mut draw = Draw::new(tour.seed, 9);
    match (language, tour.name) {
        (Language::Simple, _) => {}
        (_, PLANS) => related(tour, &stays, &mut thoughts, &mut draw),
        _ => elsewhere(tour, &stays, &mut thoughts, &mut draw),
    }
    thoughts.sort_by(|a, b| a.at_s.total_cmp(&b.at_s));
    let phase = draw.below(FALSE_EACH);
    let rooms = &tour.scenario.world.rooms;
    let say = |(k, thought): (usize, &Thought)| {
        let name = &rooms[thought.room].name;
        let held = language != Language::False20 || k % FALSE_EACH != phase;
        let others: Vec<&String> = tour.vocabulary.iter().filter(|n| *n != name).collect();
        let other = others[draw.below(others.len())];
        let name = if held { name } else { other };
        let sentence = spoken(thought.at_s, thought.form.words(name));
        let (at, relations) = (rooms[thought.room].area.centre(), thought.form.relations());
        Said { sentence, claim: Some(Claim { name: name.clone(), at, held, relations }) }
    };
    thoughts.iter().enumerate().map(say).collect()
}

/// Where they are: each room on its first visit and the second; on a tour with returns once
/// between them.
fn here(tour: &Tour, stays: &[Visit]) -> Vec<Thought> {
    let rooms = &tour.scenario.world.rooms;
    let quiet = quiet_s(tour);
    let mut named: Vec<Vec<usize>> = vec![Vec::new(); rooms.len()];
    let mut thoughts = Vec::new();
    for (visit, stay) in stays.iter().enumerate() {
        let mut at_s = stay.from_s + 0.5;
        if let Some(&(_, until_s)) = quiet.iter().find(|(from, to)| (*from..*to).contains(&at_s)) {
            at_s = until_s + 0.5;
        }
        let epoch = tour.returns_s.iter().filter(|r| **r <= at_s).count();
        // Corridors of one name are one to whoever walks them.
        let corridor = rooms[stay.room].kind == RoomKind::Corridor;
        let same = |k: usize| {
            corridor && rooms[k].kind == RoomKind::Corridor && rooms[k].name == rooms[stay.room].name
        };
        let one = (0..rooms.len()).find(|&k| same(k)).unwrap_or(stay.room);
        let before = &named[one];
        let due = if tour.returns_s.is_empty() { before.len() < 2 } else { !before.contains(&epoch) };
        let name = &rooms[stay.room].name;
        if !due || name.is_empty() || at_s > stay.to_s - 0.5 || stay.to_s - stay.from_s < STAY_S {
            continue;
        }
        let namesake =
            (0..rooms.len()).any(|k| k != stay.room && rooms[k].name == *name && !named[k].is_empty());
        let form = match (before.is_empty(), namesake) {
            (false, _) => Form::Again,
            (true, true) if rooms[stay.room].kind == RoomKind::Room => Form::Another,
            (true, _) => Form::This,
        };
        named[one].push(epoch);
        thoughts.push(Thought { at_s, visit, room: stay.room, form });
    }
    thoughts
}

/// From each return until the robot has gone some way.
fn quiet_s(tour: &Tour) -> Vec<(f64, f64)> {
    let until_s = |from_s: f64| {
        let (mut gone_m, mut t_s, mut last) = (0.0, from_s, tour.drive.at(from_s));
        while gone_m < tour.late_m && t_s < tour.drive.duration_s() {
            t_s += 0.1;
            let next = tour.drive.at(t_s);
            gone_m += (next.x_m - last.x_m).hypot(next.y_m - last.y_m);
            last = next;
        }
        t_s
    };
    tour.returns_s.iter().map(|&from_s| (from_s, until_s(from_s))).collect()
}

/// Has some rooms told of from the room before or the next one, rather than when first entered.
fn elsewhere(tour: &Tour, stays: &[Visit], thoughts: &mut [Thought], draw: &mut Draw) {
    let rooms = &tour.scenario.world.rooms;
    let quiet = quiet_s(tour);
    // Landmarks must be named where they are.
    let mut landmarks: BTreeSet<usize> = BTreeSet::new();
    let mut moved: BTreeSet<usize> = BTreeSet::new();
    for k in 0..thoughts.len() {
        let thought = thoughts[k].clone();
        let room = &rooms[thought.room];
        let always = tour.name == "small" && room.name == "gym";
        let chosen = draw.chance(0.5);
        let ahead = draw.chance(0.5);
        let first = matches!(thought.form, Form::This | Form::Another) && room.kind == RoomKind::Room;
        if !first || !(always || chosen) || landmarks.contains(&thought.room) || room.name == "courtyard" {
            continue;
        }
        // The gym is told of from the hallway, be it some rooms before.
        let order: &[isize] = match (always, ahead) {
            (true, _) => &[-1, -2, -3, -4],
            (_, true) => &[-1, 1],
            _ => &[1, -1],
        };
        let told = order.iter().find_map(|&way| {
            let stay = stays.get(thought.visit.checked_add_signed(way)?)?;
            let mark = &rooms[stay.room];
            let named_s =
                thoughts.iter().filter(|t| t.room == stay.room).map(|t| t.at_s).fold(f64::INFINITY, f64::min);
            let at_s = (stay.from_s + 2.8).max(named_s + 2.3);
            let fit = stay.room != thought.room
                && (!always || mark.kind == RoomKind::Corridor)
                && mark.name != room.name
                && mark.name != "courtyard"
                && !moved.contains(&stay.room)
                && at_s < stay.to_s
                && !quiet.iter().any(|(from, to)| (*from..*to).contains(&at_s));
            let form = match mark.kind {
                RoomKind::Corridor => Form::Lies(format!("down the {}", mark.name), 1),
                RoomKind::Room => Form::Lies(format!("next to the {}", mark.name), 1),
            };
            fit.then_some((at_s, form, stay.room))
        });
        if let Some((at_s, form, mark)) = told {
            landmarks.insert(mark);
            moved.insert(thought.room);
            thoughts[k] = Thought { at_s, form, ..thought };
        }
    }
}

/// What may be asked after hearing that. Names only ever said of the wrong room have no answer that
/// is fair, and are left out.
pub(super) fn questions(tour: &Tour, said: &[Said]) -> Questions {
    let mut questions = Questions::new();
    for name in &tour.vocabulary {
        let claims = || said.iter().filter_map(|s| s.claim.as_ref()).filter(|c| c.name == *name);
        let held: Vec<usize> = claims().filter(|c| c.held).map(|c| c.relations).collect();
        let told = match (claims().next(), held.as_slice()) {
            (None, _) => Told::Never,
            (Some(_), []) => continue,
            (_, held) if held.contains(&0) => Told::Outright,
            (_, held) => Told::Related(held.iter().sum()),
        };
        let rooms = if told == Told::Never { Vec::new() } else { rooms_called(tour, name) };
        questions.insert(format!("where is the {name}"), Asked { rooms, told });
    }
    questions
}

/// Corners of every room of that name.
pub(super) fn rooms_called(tour: &Tour, name: &str) -> Vec<Vec<Point>> {
    let rooms = tour.scenario.world.rooms.iter().filter(|r| r.name == name);
    rooms.map(|r| r.area.corners.clone()).collect()
}
