//! True statements, "room relation landmark", by the order of doors along a hallway, its sides and
//! walls in common: nothing that factors look at. Factors see places driven, not walls or doors.
//!
//! `along` is metres up the hallway, as the speaker goes; a statement is kept if it is true of one or
//! two rooms, as guides say what helps.

use crate::plan::{Hallway, Room, apart_m};
use toponym_core::language::{Frame, Narrowing, Relation};

/// A statement and the rooms that it is true of.
pub struct Statement {
    /// What it is counted under.
    pub kind: &'static str,
    /// As said.
    pub relation: Relation,
    /// As said.
    pub frame: Option<Frame>,
    /// As said.
    pub narrowing: Narrowing,
    /// What it is said of; none: the speaker, or the hallway he stands in.
    pub landmarks: Vec<usize>,
    /// The rooms for which it holds.
    pub figures: Vec<usize>,
}

/// A speaker in a hallway.
pub struct Speaker<'a> {
    /// Where.
    pub hall: &'a Hallway,
    /// x of where he stands.
    pub x_m: f64,
    /// 1 if he goes along x, −1 if against it.
    pub direction: f64,
}

impl Speaker<'_> {
    fn along_m(&self, room: usize) -> f64 {
        self.direction * (self.hall.rooms[room].door.0 - self.x_m)
    }

    /// 1 on the left, −1 on the right, 0 at an end of the hallway.
    fn side(&self, room: usize) -> i32 {
        let room = &self.hall.rooms[room];
        let at_end = room.middle.0.abs() > self.hall.half_length_m;
        if at_end { 0 } else { (self.direction * room.door.1).signum() as i32 }
    }

    fn rooms(&self) -> impl Iterator<Item = usize> + Clone {
        (0..self.hall.rooms.len()).filter(|&k| self.hall.rooms[k].through.is_none())
    }

    fn neighbours(&self, a: usize, b: usize) -> bool {
        let (room, other): (&Room, &Room) = (&self.hall.rooms[a], &self.hall.rooms[b]);
        self.side(a) == self.side(b) && apart_m(&room.outline, &other.outline) < 0.6
    }

    /// All statements that this speaker could make with `landmark`.
    pub fn of_landmark(&self, landmark: usize) -> Vec<Statement> {
        let mut said = Vec::new();
        if self.hall.rooms[landmark].through.is_some() {
            return said;
        }
        let (l, side) = (self.along_m(landmark), self.side(landmark));
        let beyond = |k: usize| self.along_m(k) - l;
        let others = self.rooms().filter(|&k| k != landmark);
        let mut say = |kind, relation, frame, just, figures: Vec<usize>| {
            let narrowing = Narrowing { just, ..Narrowing::default() };
            said.push(Statement { kind, relation, frame, narrowing, landmarks: vec![landmark], figures });
        };
        let of = |f: &dyn Fn(usize) -> bool| others.clone().filter(|&k| f(k)).collect::<Vec<_>>();
        say("near", Relation::Near, None, false, of(&|k| beyond(k).abs() <= 3.0));
        let beside = of(&|k| side != 0 && self.neighbours(k, landmark));
        say("next to", Relation::NextTo, None, false, beside.clone());
        let facing = of(&|k| side != 0 && self.side(k) == -side && beyond(k).abs() <= 1.5);
        say("across from", Relation::AcrossFrom, None, false, facing);
        // Who looks at a room on the left has what lies further on to the right.
        let onward = |right: bool| {
            beside
                .iter()
                .copied()
                .filter(|&k| (f64::from(side) * beyond(k) > 0.0) == right)
                .collect::<Vec<_>>()
        };
        say("left of", Relation::LeftOf, Some(Frame::Hearer), false, onward(false));
        say("right of", Relation::RightOf, Some(Frame::Hearer), false, onward(true));
        if l > 3.0 {
            say("past", Relation::Past, None, false, of(&|k| (0.5..=5.0).contains(&beyond(k))));
            let first = others.clone().map(beyond).filter(|b| *b > 0.5).fold(4.0, f64::min);
            let just = of(&|k| beyond(k) > 0.5 && beyond(k) <= first + 0.5);
            say("just past", Relation::Past, None, true, just);
        }
        let inner = |k: &usize| self.hall.rooms[*k].through == Some(landmark);
        say("through", Relation::Through, None, false, (0..self.hall.rooms.len()).filter(inner).collect());
        for &k in &beside {
            let far =
                others.clone().find(|&f| f != k && self.neighbours(k, f) && beyond(f) * beyond(k) > 0.0);
            if let Some(far) = far.filter(|_| beyond(k) > 0.0) {
                let landmarks = vec![landmark, far];
                let (relation, narrowing) = (Relation::Between, Narrowing::default());
                said.push(Statement {
                    kind: "between",
                    relation,
                    frame: None,
                    narrowing,
                    landmarks,
                    figures: vec![k],
                });
            }
        }
        useful(said)
    }

    /// All statements that this speaker could make with himself, or the hallway he stands in.
    pub fn of_hallway(&self) -> Vec<Statement> {
        let mut said = Vec::new();
        let mut say = |kind, relation, narrowing, figures: Vec<usize>| {
            let frame = Some(Frame::Hearer);
            said.push(Statement { kind, relation, frame, narrowing, landmarks: Vec::new(), figures });
        };
        let rooms = self.rooms();
        let of = |f: &dyn Fn(usize) -> bool| rooms.clone().filter(|&k| f(k)).collect::<Vec<_>>();
        let plain = Narrowing::default();
        for (kind, here, on, relation, side) in [
            ("on the left", Relation::LeftOf, "nth on the left", Relation::LeftSide, 1),
            ("on the right", Relation::RightOf, "nth on the right", Relation::RightSide, -1),
        ] {
            say(kind, here, plain, of(&|k| self.side(k) == side && self.along_m(k).abs() <= 1.5));
            let mut ahead = of(&|k| self.side(k) == side && self.along_m(k) > 0.5);
            ahead.sort_by(|a, b| self.along_m(*a).total_cmp(&self.along_m(*b)));
            for (n, &k) in ahead.iter().take(3).enumerate() {
                say(on, relation, Narrowing { doors: Some(n as u32 + 1), ..plain }, vec![k]);
            }
        }
        for tens in 1..6 {
            let distance_m = 5.0 * f64::from(tens);
            let there = of(&|k| (self.along_m(k) - distance_m).abs() <= 2.5);
            say("so far down", Relation::Down, Narrowing { distance_m: Some(distance_m), ..plain }, there);
        }
        let end_m = self.hall.half_length_m - self.direction * self.x_m;
        if end_m > 6.0 {
            say("at the end of", Relation::AtEndOf, plain, of(&|k| self.along_m(k) > end_m - 3.0));
        }
        useful(said)
    }
}

fn useful(said: Vec<Statement>) -> Vec<Statement> {
    said.into_iter().filter(|s| (1..=2).contains(&s.figures.len())).collect()
}
