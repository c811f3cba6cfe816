//! Rooms told of by how they lie to others: of a floor plan's a sixth by one relation, a sixth by two, and the rest
//! outright.

use super::Tour;
use super::layout::{Layout, Lies};
use super::words::{Form, Thought};
use crate::guide::Visit;
use crate::random::Draw;
use crate::world::RoomKind;
use std::collections::BTreeSet;

/// Share of the rooms told of by one relation; by two.
const BY_ONE: f64 = 1.0 / 6.0;
const BY_TWO: f64 = 1.0 / 6.0;
/// So long after entering a room, and after naming what is spoken of, something else is said.
const PAUSE_S: f64 = 2.3;

/// Something to say of a room, when, and by how many relations.
type Told = (f64, String, usize);

/// Has some rooms told of by relations rather than where they are.
pub(super) fn related(tour: &Tour, stays: &[Visit], thoughts: &mut Vec<Thought>, draw: &mut Draw) {
    let rooms = &tour.scenario.world.rooms;
    let of_rooms = |t: &&Thought| rooms[t.room].kind == RoomKind::Room && !rooms[t.room].name.is_empty();
    let named: BTreeSet<usize> = thoughts.iter().filter(of_rooms).map(|t| t.room).collect();
    let named: Vec<usize> = named.into_iter().collect();
    let layout = Layout::new(&tour.scenario.world, &named);
    // What a name may be told by: there is one of it.
    let unique = |k: &usize| rooms.iter().filter(|r| r.name == rooms[*k].name).count() == 1;
    let mut outright: Vec<usize> = named.iter().copied().filter(unique).collect();
    let mut landmarks: BTreeSet<usize> = BTreeSet::new();
    let mut left = outright.clone();
    while !left.is_empty() {
        let room = left.swap_remove(draw.below(left.len()));
        let drawn = draw.unit();
        let wanted = if drawn < BY_TWO { 2 } else { usize::from(drawn < BY_TWO + BY_ONE) };
        if wanted == 0 || landmarks.contains(&room) {
            continue;
        }
        let mut lies = layout.of(room, &outright);
        let mut chosen: Vec<Lies> = Vec::new();
        while chosen.len() < wanted && !lies.is_empty() {
            let lie = lies.swap_remove(draw.below(lies.len()));
            lies.retain(|l| !l.landmarks().any(|k| lie.landmarks().any(|o| o == k)));
            chosen.push(lie);
        }
        let told = told(tour, stays, thoughts, (&layout, room, &chosen, wanted), draw);
        if told.is_empty() {
            continue;
        }
        landmarks.extend(chosen.iter().flat_map(|l| l.landmarks()));
        outright.retain(|&k| k != room);
        thoughts.retain(|t| t.room != room);
        let lies =
            |(at_s, words, relations)| Thought { at_s, visit: 0, room, form: Form::Lies(words, relations) };
        thoughts.extend(told.into_iter().map(lies));
    }
}

/// What is said of a room, and when; nothing where there is no time for it.
fn told(
    tour: &Tour,
    stays: &[Visit],
    thoughts: &[Thought],
    (layout, room, chosen, wanted): (&Layout, usize, &[Lies], usize),
    draw: &mut Draw,
) -> Vec<Told> {
    let world = &tour.scenario.world;
    let named_s =
        |k: usize| thoughts.iter().filter(|t| t.room == k).map(|t| t.at_s).fold(f64::INFINITY, f64::min);
    let mut taken: Vec<f64> = thoughts.iter().map(|t| t.at_s).collect();
    let mut say = |lies: &[Lies], draw: &mut Draw| -> Option<Told> {
        let marks: Vec<usize> = lies.iter().flat_map(|l| l.landmarks()).collect();
        let from_s = marks.iter().map(|&k| named_s(k)).fold(0.0, f64::max) + PAUSE_S;
        let mut times: Vec<f64> = stays
            .iter()
            .filter(|stay| marks.contains(&stay.room))
            .map(|stay| ((stay.from_s + PAUSE_S).max(from_s), stay.to_s))
            .filter(|(at_s, to_s)| at_s < to_s && taken.iter().all(|t| (t - at_s).abs() >= PAUSE_S))
            .map(|(at_s, _)| at_s)
            .collect();
        let at_s = (!times.is_empty()).then(|| times.swap_remove(draw.below(times.len())))?;
        taken.push(at_s);
        let words: Vec<String> = lies.iter().map(|l| l.words(world)).collect();
        Some((at_s, words.join(" and "), lies.len()))
    };
    let together = draw.chance(0.5);
    let mut told: Vec<Told> = if together || chosen.len() == 1 {
        say(chosen, draw).into_iter().collect()
    } else {
        chosen.iter().filter_map(|&lies| say(&[lies], draw)).collect()
    };
    // "Down the hallway", from the hallway: where there is not as much else to say, and now and then instead.
    let instead = wanted == 1 && draw.chance(0.3);
    if chosen.len() < wanted || instead {
        let ahead = stays.iter().find_map(|stay| {
            let corridor = &world.rooms[stay.room];
            let at_s = stay.from_s + PAUSE_S;
            let fits = corridor.kind == RoomKind::Corridor
                && !corridor.name.is_empty()
                && at_s < stay.to_s
                && taken.iter().all(|t| (t - at_s).abs() >= PAUSE_S)
                && layout.is_down(room, stay.room, &tour.drive.at(at_s));
            fits.then(|| (at_s, format!("down the {}", corridor.name), 1))
        });
        if let Some(ahead) = ahead {
            told.retain(|_| !instead);
            told.push(ahead);
        }
    }
    told
}
