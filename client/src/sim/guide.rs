//! A guide who walks along and says what places are called.

use super::random::Draw;
use super::robot::Drive;
use super::world::{RoomKind, World};

/// A visit begins this far inside a room, metres.
const INSIDE_M: f64 = 0.8;
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
struct Visit {
    room: usize,
    from_s: f64,
    to_s: f64,
}

/// What the guide says along a drive, in order of time.
pub fn narrate(world: &World, drive: &Drive, style: &GuideStyle, draw: &mut Draw) -> Vec<Sentence> {
    let visits = visits(world, drive);
    // Decided per room before the walk: a room that stays unnamed stays so on every visit.
    let named: Vec<bool> = world
        .rooms
        .iter()
        .map(|r| {
            draw.chance(match r.kind {
                RoomKind::Room => style.named,
                RoomKind::Corridor => style.corridors,
            })
        })
        .collect();
    let mut seen = vec![false; world.rooms.len()];
    let mut announced = vec![false; world.rooms.len()];
    let mut sentences = Vec::new();
    for (k, visit) in visits.iter().enumerate() {
        let room = &world.rooms[visit.room];
        let corridor = room.kind == RoomKind::Corridor;
        if corridor && let Some(next) = foretold(world, &visits[k..], &seen, &named) {
            // The landmark is the corridor one stands in.
            if draw.chance(style.foretold) && !announced[next] {
                announced[next] = true;
                let text = format!("The {} is down the {}.", world.rooms[next].name, room.name);
                sentences.push(spoken(visit.from_s + 1.0, text));
                continue;
            }
        }
        let first = !seen[visit.room];
        let worth_a_word = if corridor {
            first && visit.to_s - visit.from_s >= WALK_S
        } else {
            first || draw.chance(style.revisits)
        };
        if !named[visit.room] || !worth_a_word {
            continue;
        }
        let namesake =
            (0..seen.len()).any(|o| o != visit.room && seen[o] && world.rooms[o].name == room.name);
        seen[visit.room] = true;
        let pause_s = if corridor { WALK_S / 2.0 } else { 0.5 };
        let text = phrase(&room.name, first, namesake && !corridor, draw);
        sentences.push(spoken(visit.from_s + pause_s, text));
    }
    sentences.sort_by(|a, b| a.began_s.total_cmp(&b.began_s));
    sentences
}

/// The next room ahead that gets its name only later.
fn foretold(world: &World, ahead: &[Visit], seen: &[bool], named: &[bool]) -> Option<usize> {
    let here = ahead.first()?;
    let next = ahead.iter().find(|v| world.rooms[v.room].kind == RoomKind::Room)?;
    let known = (0..seen.len()).any(|o| seen[o] && world.rooms[o].name == world.rooms[next.room].name);
    (!known && named[next.room] && next.from_s - here.from_s >= 2.0 * WALK_S).then_some(next.room)
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

fn spoken(began_s: f64, text: String) -> Sentence {
    // People speak some fifteen letters a second.
    Sentence { began_s, ended_s: began_s + text.len() as f64 / 15.0, text }
}

/// Stays in rooms, in order; rooms win over the corridors they may overlap.
fn visits(world: &World, drive: &Drive) -> Vec<Visit> {
    let mut visits: Vec<Visit> = Vec::new();
    let looks = (drive.duration_s() / LOOK_S) as usize;
    let mut held: Option<usize> = None;
    for k in 0..=looks {
        let t_s = k as f64 * LOOK_S;
        let pose = drive.at(t_s);
        let inside = |room: &usize| {
            let r = &world.rooms[*room];
            // In a corridor, too, one is soon in the middle: its walls are near on both sides.
            r.area.contains([pose.x_m, pose.y_m], INSIDE_M)
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
    use crate::sim::demo_building;
    use crate::sim::robot::{Motion, drive};

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
            let area = world.rooms[world.room(name).unwrap()].area;
            assert!(area.contains([pose.x_m, pose.y_m], 0.0), "{sentence:?}");
        }
    }

    #[test]
    fn what_lies_ahead_is_foretold_from_the_corridor() {
        let style = GuideStyle { named: 1.0, revisits: 0.0, foretold: 1.0, corridors: 0.0 };
        let world = demo_building();
        let tour = ["gym", "cafe"].map(|n| world.room(n).unwrap());
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
