//! Floors: "upstairs", "one floor up", "on the second floor", "in the same place on the floor below".

use crate::language::act::{Features, Head, Modifiers, Ordinal, Phrase};
use crate::language::grammar::cursor::Cursor;
use crate::language::grammar::relate::Related;
use crate::language::lexicon::names::Name;
use crate::language::relation::Relation;

impl Cursor<'_> {
    /// Reads on which floor something is.
    pub(crate) fn level(&mut self) -> Option<Related> {
        let here = || Phrase::new(Head::Here);
        if let Some(way) =
            self.eat_any("up the stairs|down the stairs|up the staircase|up the steps|down the steps")
        {
            return Some(by_levels(way.starts_with("up"), None, here()));
        }
        self.skip("just|located|right|directly|all the way|up on|down on");
        let on = matches!(self.before(), "on");
        if !self.sees("upstairs from|downstairs from")
            && let Some(way) = self.eat_any("upstairs|downstairs|up there on the next floor")
        {
            return Some(by_levels(way.starts_with("up"), None, here()));
        }
        let start = *self;
        if let Some(found) = self.levels_away() {
            return Some(found);
        }
        *self = start;
        if !(on || self.eat("on")) {
            return None;
        }
        self.floor().map(|floor| Related::to(Relation::OnLevel, floor))
    }

    /// "Two floors up", "one level below the lobby".
    fn levels_away(&mut self) -> Option<Related> {
        let first = if self.sees("up the|down the") { None } else { self.eat_any("up|down") };
        let (n, words) = self.number()?;
        self.advance(words);
        self.skip("more");
        self.eat_any("floors|floor|levels|level|flights of stairs|flight of stairs|flights|flight|stories|storey|story")?;
        // "One floor up", "up one floor".
        let way = match first {
            Some(way) => way,
            None => self.eat_any("further up|further down|up|down|above|below|higher|lower")?,
        };
        let up = matches!(way, "up" | "above" | "higher" | "further up");
        self.skip("from");
        let from = self.landmark().map_or_else(|| Phrase::new(Head::Here), |(phrase, _)| phrase);
        let me = matches!(from.head, Head::Agent | Head::Speaker);
        let from = if me { Phrase::new(Head::Here) } else { from };
        let count = (n > 1.0).then_some(n as u32);
        Some(by_levels(up, count, from))
    }

    /// "The second floor", "this floor", "the floor below", "floor five".
    pub(crate) fn floor(&mut self) -> Option<Phrase> {
        let mut floor = Phrase::new(Head::Named(Name::new("floor")?));
        let f = &mut floor.features;
        if self.eat_any("this|the same|that").is_some() {
            f.this = true;
        } else if self.eat_any("floor|level").is_some() {
            let (n, words) = self.number()?;
            self.advance(words);
            f.ordinal = Some(Ordinal::Nth(n as u32));
            return Some(floor);
        } else {
            self.eat_any("the|our")?;
            *f = self.which_floor()?;
        }
        self.eat_any("floor|level|storey|story")?;
        if f.level.is_none() && *f == Features::default() {
            f.level = Some(match self.eat_any("above|below|beneath|under|over")? {
                "above" | "over" => 1,
                _ => -1,
            });
            self.skip("us|this one|this|here");
        }
        self.skip("of this building|of the building|in this building|in the building");
        Some(floor)
    }

    fn which_floor(&mut self) -> Option<Features> {
        const NTH: [&str; 10] =
            ["first", "second", "third", "fourth", "fifth", "sixth", "seventh", "eighth", "ninth", "tenth"];
        const SHORT: [&str; 10] = ["1st", "2nd", "3rd", "4th", "5th", "6th", "7th", "8th", "9th", "10th"];
        let word = self.peek(0);
        let mut f = Features::default();
        if let Some(i) = (0..10).find(|&i| word == NTH[i] || word == SHORT[i]) {
            f.ordinal = Some(Ordinal::Nth(i as u32 + 1));
        } else if matches!(word, "next") {
            f.level = Some(1);
        } else if matches!(word, "ground" | "top" | "upper" | "lower" | "main" | "bottom" | "basement") {
            f.qualities.push(word.to_owned());
        } else if matches!(word, "floor" | "level") {
            return Some(f);
        } else {
            return None;
        }
        self.step();
        Some(f)
    }

    /// "In the same place as the kitchen on the floor below": above that kitchen.
    pub(crate) fn same_spot(&mut self) -> Option<Related> {
        self.skip("exactly|right");
        self.eat_any(
            "in the exact same place as|in the same place as|in the same spot as|in the same position as|\
            at the same place as|in the same location as|in the same corner as",
        )?;
        let (mut landmark, sure) = self.landmark()?;
        let level = if self.eat_any("on|of").is_some() { Some(self.floor()?) } else { None };
        let relation = match level.as_ref().and_then(|f| f.features.level) {
            Some(l) if l < 0 => Relation::Above,
            Some(_) => Relation::Below,
            None => Relation::At,
        };
        landmark.within.extend(level.map(|f| Related::to(Relation::OnLevel, f).restriction()));
        Some(Related { sure, ..Related::to(relation, landmark) })
    }
}

fn by_levels(up: bool, count: Option<u32>, from: Phrase) -> Related {
    let relation = if up { Relation::LevelUp } else { Relation::LevelDown };
    Related { modifiers: Modifiers { count, ..Modifiers::default() }, ..Related::to(relation, from) }
}
