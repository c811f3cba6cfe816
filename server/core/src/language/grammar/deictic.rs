//! Where something is told by who speaks and where: "on your left", "straight ahead", "two doors down",
//! "next door".

use crate::language::act::{Features, Head, Modifiers, Phrase};
use crate::language::grammar::cursor::Cursor;
use crate::language::grammar::relate::Related;
use crate::language::lexicon::is_way;
use crate::language::lexicon::names::Name;
use crate::language::relation::Relation as R;

impl Cursor<'_> {
    /// "On your left", "to the right of the stairs", "on the left side of the hallway".
    pub(crate) fn side(&mut self) -> Option<Related> {
        self.skip("off|over|up|immediately|down and|up and|back and|around and|along and");
        if let Some(way) = self.eat_any("to the north|to the south|to the east|to the west") {
            let relation = match way {
                "to the north" => R::NorthOf,
                "to the south" => R::SouthOf,
                "to the east" => R::EastOf,
                _ => R::WestOf,
            };
            return (self.peek(0) != "of").then(|| Related::to(relation, Phrase::new(Head::Here)));
        }
        self.eat_any("on|to|at")?;
        let whose = self.eat_any("the|your|my|our|its")?;
        self.skip("immediate|very|far|near");
        let left = self.eat_any("left|right")? == "left";
        self.skip("hand|side");
        let (of, along) = if left { (R::LeftOf, R::LeftSide) } else { (R::RightOf, R::RightSide) };
        if self.eat("of") {
            let (landmark, sure) = self.landmark()?;
            // Stairs have a left of their own, a hallway only sides.
            let way =
                matches!(&landmark.head, Head::Named(n) if is_way(n.as_str()) && n.as_str() != "stairs");
            return Some(Related { sure, ..Related::to(if way { along } else { of }, landmark) });
        }
        if self.sees("as you|when you|if you|once you") {
            // "… as you come in" tells which way one goes; the side is of that way.
            self.take_to_break();
        }
        Some(match whose {
            "the" => Related::to(along, Phrase::new(Head::Path)),
            "my" => Related::to(of, Phrase::new(Head::Speaker)),
            "its" => Related::to(of, Phrase::new(Head::It)),
            _ => Related::to(of, Phrase::new(Head::Agent)),
        })
    }

    /// "… not the right": a side without its preposition.
    pub(crate) fn other_side(&mut self) -> Option<Related> {
        let whose = self.eat_any("the|your|my")?;
        let left = self.eat_any("left|right")? == "left";
        let (of, along) = if left { (R::LeftOf, R::LeftSide) } else { (R::RightOf, R::RightSide) };
        Some(match whose {
            "the" => Related::to(along, Phrase::new(Head::Path)),
            "my" => Related::to(of, Phrase::new(Head::Speaker)),
            _ => Related::to(of, Phrase::new(Head::Agent)),
        })
    }

    /// "Straight ahead", "in front of you".
    pub(crate) fn ahead(&mut self) -> Option<Related> {
        self.skip("just|right|directly|straight|dead|up");
        if self.eat_any("in front").is_some() {
            let of = self.eat_any("of you|of us|of me").unwrap_or("");
            if of.is_empty() && self.peek(0) == "of" {
                return None;
            }
            return Some(Related::to(R::InFrontOf, Phrase::new(one_of(of))));
        }
        let straight = matches!(self.before(), "straight" | "dead");
        if self.eat("ahead") || (straight && self.eat_any("on|forward").is_some()) {
            let of = self.eat_any("of you|of us|of me").unwrap_or("");
            return (self.peek(0) != "of").then(|| Related::to(R::AheadOf, Phrase::new(one_of(of))));
        }
        None
    }

    /// "Next door", "around here", "over there", "around the corner".
    pub(crate) fn elsewhere(&mut self) -> Option<Related> {
        let here = || Phrase::new(Head::Here);
        self.skip("just|right|very|only|pretty|really");
        let just = self.before() == "just";
        if self.peek(0) == "next" && self.peek(1) == "door" && self.peek(2) != "to" {
            self.eat("next door");
            return Some(Related::to(R::NextTo, here()));
        }
        // "The fifth door down".
        let counted = matches!(self.before(), "door" | "room" | "office" | "one");
        if counted && matches!(self.peek(1), "is" | "was" | "" | ",") && self.eat("down") {
            return Some(Related::to(R::Down, here()));
        }
        if self
            .eat_any(
                "around here|close by|near by|near here|close to here|not far from here|not far away|not far",
            )
            .is_some()
        {
            return Some(Related::to(R::Near, here()));
        }
        if self
            .eat_any("down the hall from here|down the hallway from here|down the corridor from here|up the hall from here")
            .is_some()
        {
            return Some(Related::to(R::Down, Phrase::new(Head::Named(Name::new("hallway")?))));
        }
        if self.peek(0) == "close" && matches!(self.peek(1), "" | ",") {
            self.step();
            return Some(Related::to(R::Near, here()));
        }
        if self.eat_any("far away|far from here|a long way off").is_some() && self.at_break() {
            return Some(Related::to(R::AwayFrom, here()));
        }
        if !self.sees("there is|there are|there will|there should")
            && self.eat_any("over there|there|that way|over that way|down that way|back that way").is_some()
        {
            return Some(Related::to(R::At, Phrase::new(Head::There)));
        }
        if self.eat_any("around the corner|round the corner|around that corner|around this corner").is_some()
            && self.peek(0) != "from"
        {
            let corner = Phrase::new(Head::Named(Name::new("corner")?));
            let modifiers = Modifiers { just, ..Modifiers::default() };
            return Some(Related { modifiers, ..Related::to(R::Around, corner) });
        }
        None
    }

    /// "At the end", "on the other side".
    pub(crate) fn far_side(&mut self) -> Option<Related> {
        if self.eat_any("at the very end|at the end|at the far end").is_some() {
            return (self.peek(0) != "of").then(|| Related::to(R::AtEndOf, Phrase::new(Head::Path)));
        }
        self.eat_any("on the other side|across the way")?;
        (self.peek(0) != "of").then(|| Related::to(R::Across, Phrase::new(Head::Here)))
    }

    /// "Two doors down from here": the place at the second door.
    pub(crate) fn doors(&mut self) -> Option<Related> {
        self.skip("about|just|only");
        let count = if self.eat_any("a few|several").is_some() {
            None
        } else if self.eat_any("a couple of|a couple|a pair of").is_some() {
            Some(2)
        } else {
            let (n, words) = self.number()?;
            self.advance(words);
            Some(n as u32)
        };
        let noun = match self.eat_any("doors|door|rooms|room|offices|office|buildings|building")? {
            "door" | "doors" => "door",
            "room" | "rooms" => "room",
            "building" | "buildings" => "building",
            _ => "office",
        };
        self.skip("further|farther|more");
        let from = if self.eat_any("down from|up from|over from|away from|along from|from").is_some() {
            Related { relation: R::Down, ..Related::to(R::Down, self.landmark()?.0) }
        } else if self.sees("down the|up the|along the|past|to the left of|to the right of|to the left|to the right|on the left of|before")
        {
            self.related()?
        } else {
            self.eat_any("down|up|over|along|away|on")?;
            self.skip("this way|that way");
            Related::to(R::Down, Phrase::new(Head::Here))
        };
        let mut door = Phrase::new(Head::Named(Name::new(noun)?));
        door.features = Features { count, ..Features::default() };
        door.within.push(from.restriction());
        Some(Related::to(R::At, door))
    }
}

fn one_of(of: &str) -> Head {
    if of == "of me" { Head::Speaker } else { Head::Agent }
}
