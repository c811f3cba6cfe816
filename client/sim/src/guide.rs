//! A guide who walks along and says what places are called.

use super::random::Draw;
use super::robot::Drive;
use super::world::{RoomKind, World};

/// Time step at which the guide looks where they are.
const LOOK_S: f64 = 0.2;
/// A walk along a corridor shorter than this is not worth a word.
const WALK_S: f64 = 5.0;

/// What the guide talks about.
#[derive(Clone, Debug, PartialEq)]
pub struct GuideStyle {
    /// Share of the rooms that get named when first entered.
    pub named: f64,
    /// Share of the later visits to a named room that get a word.
    pub revisits: f64,
    /// Share of the first visits foretold from the corridor: "the gym is down the hallway".
    pub foretold: f64,
    /// Share of the corridors that get named.
    pub corridors: f64,
}

impl Default for GuideStyle {
    fn default() -> Self {
        Self { named: 1.0, revisits: 0.8, foretold: 0.3, corridors: 0.5 }
    }
}

/// A sentence and when it was said.
#[derive(Clone, Debug, PartialEq)]
pub struct Sentence {
    /// Seconds from the start of the drive.
    pub began_s: f64,
    /// Seconds from the start of the drive.
    pub ended_s: f64,
    /// The words.
    pub text: String,
}

/// A stay in a room, seconds from the start of the drive.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Visit {
    pub(crate) room: usize,
    pub(crate) from_s: f64,
    pub(crate) to_s: f64,
}

/// What the guide says along a drive, in order of time.
pub fn narrate(world: &World, drive: &Drive, style: &GuideStyle, draw: &mut Draw) -> Vec<Sentence> {
    let visits = visits(world, drive);
    let mut tour = Tour::new(world, style, draw);
    let mut sentences = Vec::new();
    for (k, visit) in visits.iter().enumerate() {
        let sentence = tour.foretell(&visits[k..], draw).or_else(|| tour.name(visit, draw));
        sentences.extend(sentence);
    }
    sentences.sort_by(|a, b| a.began_s.total_cmp(&b.began_s));
    sentences
}

/// What was said so far.
struct Tour<'a> {
    world: &'a World,
    style: &'a GuideStyle,
    /// Rooms that have a name for this guide. Decided before the walk: one that stays unnamed
    /// stays so on every visit.
    named: Vec<bool>,
    /// Rooms that were named already.
    told: Vec<bool>,
    /// Rooms that were foretold already.
    announced: Vec<bool>,
}

impl<'a> Tour<'a> {
    fn new(world: &'a World, style: &'a GuideStyle, draw: &mut Draw) -> Self {
        let share = |kind| match kind {
            RoomKind::Room => style.named,
            RoomKind::Corridor => style.corridors,
        };
        let named = world.rooms.iter().map(|r| draw.chance(share(r.kind)) && !r.name.is_empty()).collect();
        let none = vec![false; world.rooms.len()];
        Self { world, style, named, told: none.clone(), announced: none }
    }

    /// Whether a room of that name, other than `except`, was named already.
    fn is_told(&self, name: &str, except: Option<usize>) -> bool {
        let rooms = self.world.rooms.iter().zip(&self.told).enumerate();
        rooms.into_iter().any(|(k, (r, told))| *told && r.name == name && Some(k) != except)
    }

    /// On entering a corridor that the listener knows by name: what lies down there.
    fn foretell(&mut self, ahead: &[Visit], draw: &mut Draw) -> Option<Sentence> {
        let here = ahead.first()?;
        let corridor = &self.world.rooms[here.room];
        let next = ahead.iter().find(|v| self.world.rooms[v.room].kind == RoomKind::Room)?;
        let room = &self.world.rooms[next.room];
        let new = self.named[next.room] && !self.announced[next.room] && !self.is_told(&room.name, None);
        let far = next.from_s - here.from_s >= 2.0 * WALK_S;
        let placed = corridor.kind == RoomKind::Corridor && self.is_told(&corridor.name, None);
        if !(new && far && placed && draw.chance(self.style.foretold)) {
            return None;
        }
        self.announced[next.room] = true;
        Some(spoken(here.from_s + 1.0, format!("The {} is down the {}.", room.name, corridor.name)))
    }

    /// The name of where they are.
    fn name(&mut self, visit: &Visit, draw: &mut Draw) -> Option<Sentence> {
        let room = &self.world.rooms[visit.room];
        let (first, corridor) = (!self.told[visit.room], room.kind == RoomKind::Corridor);
        let worth_a_word = if corridor {
            first && visit.to_s - visit.from_s >= WALK_S
        } else {
            first || draw.chance(self.style.revisits)
        };
        if !self.named[visit.room] || !worth_a_word {
            return None;
        }
        let namesake = !corridor && self.is_told(&room.name, Some(visit.room));
        self.told[visit.room] = true;
        let pause_s = if corridor { WALK_S / 2.0 } else { 0.5 };
        Some(spoken(visit.from_s + pause_s, phrase(&room.name, first, namesake, draw)))
    }
}

fn phrase(name: &str, first: bool, namesake: bool, draw: &mut Draw) -> String {
    if !first {
        return ["We're back in the {}.", "We are in the {} again."][draw.below(2)].replace("{}", name);
    }
    if namesake {
        return format!("This is another {name}.");
    }
    let known = ["This is the {}.", "We are in the {} now.", "Here is the {}.", "You are in the {}."];
    known[draw.below(known.len())].replace("{}", name)
}

pub(crate) fn spoken(began_s: f64, text: String) -> Sentence {
    // People speak some fifteen letters a second.
    Sentence { began_s, ended_s: began_s + text.len() as f64 / 15.0, text }
}

/// Stays in rooms, in order; rooms win over the corridors they may overlap.
pub(crate) fn visits(world: &World, drive: &Drive) -> Vec<Visit> {
    let mut visits: Vec<Visit> = Vec::new();
    let looks = (drive.duration_s() / LOOK_S) as usize;
    let mut held: Option<usize> = None;
    for k in 0..=looks {
        let t_s = k as f64 * LOOK_S;
        let pose = drive.at(t_s);
        let inside = |room: &usize| {
            let r = &world.rooms[*room];
            // In a corridor, too, one is soon in the middle: its walls are near on both sides.
            r.area.contains([pose.x_m, pose.y_m], r.inside_m)
        };
        let kind =
            |wanted: RoomKind| (0..world.rooms.len()).filter(inside).find(|&r| world.rooms[r].kind == wanted);
        let room =
            held.filter(|r| inside(r)).or_else(|| kind(RoomKind::Room)).or_else(|| kind(RoomKind::Corridor));
        match (room, visits.last_mut()) {
            (Some(room), Some(last)) if held == Some(room) => last.to_s = t_s,
            (Some(room), _) => visits.push(Visit { room, from_s: t_s, to_s: t_s }),
            (None, _) => {}
        }
        held = room.or(held.filter(|_| room.is_some()));
    }
    visits
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::body::Motion;
    use crate::demo_building;
    use crate::robot::drive;

    fn told(style: &GuideStyle) -> (World, Drive, Vec<Sentence>) {
        let world = demo_building();
        let tour: Vec<usize> = ["gym", "kitchen", "gym"].iter().map(|n| world.room(n).unwrap()).collect();
        let drive = drive(&world, &tour, &Motion::default(), &mut Draw::new(1, 0)).unwrap();
        let sentences = narrate(&world, &drive, style, &mut Draw::new(1, 1));
        (world, drive, sentences)
    }

    #[test]
    fn rooms_are_named_on_entering_and_greeted_again() {
        let style = GuideStyle { named: 1.0, revisits: 1.0, foretold: 0.0, corridors: 0.0 };
        let (world, drive, said) = told(&style);
        assert_eq!(said.len(), 3, "{said:?}");
        assert!(said[0].text.contains("gym") && said[1].text.contains("kitchen"));
        assert!(
            said[2].text.contains("gym") && (said[2].text.contains("back") || said[2].text.contains("again"))
        );
        for (sentence, name) in said.iter().zip(["gym", "kitchen", "gym"]) {
            let pose = drive.at(sentence.began_s);
            let area = &world.rooms[world.room(name).unwrap()].area;
            assert!(area.contains([pose.x_m, pose.y_m], 0.0), "{sentence:?}");
        }
    }

    #[test]
    fn what_lies_ahead_is_foretold_from_the_corridor() {
        let style = GuideStyle { named: 1.0, revisits: 0.0, foretold: 1.0, corridors: 1.0 };
        let world = demo_building();
        let tour = ["elevator lobby", "gym", "cafe"].map(|n| world.room(n).unwrap());
        let drive = drive(&world, &tour, &Motion::default(), &mut Draw::new(1, 0)).unwrap();
        let said = narrate(&world, &drive, &style, &mut Draw::new(1, 1));
        assert!(said.iter().any(|s| s.text == "The cafe is down the hallway."), "{said:?}");
    }

    #[test]
    fn a_silent_guide_says_nothing() {
        let style = GuideStyle { named: 0.0, revisits: 1.0, foretold: 1.0, corridors: 0.0 };
        assert!(told(&style).2.is_empty());
    }
}
