//! Phrases that point instead of naming: "here", "you", "where we started", "the room we just left".

use crate::language::act::{Head, Phrase};
use crate::language::grammar::cursor::Cursor;
use crate::language::grammar::label::LEFT_BEHIND;

/// The place held, as people point at it.
const SPOT: &str = "this place here|this place|this room here|this room|this area|this space|this spot|this location|\
    this part|this one here|this one|right here|here|where we are standing|where we are now|where we are|\
    where you are standing|where you are now|where you are|where i am standing|where i am|this point";
const START: &str = "where we started out|where we started from|where we started|where we began|where we set off|\
    where we came in|where the tour started|where the tour began|where we first came in|where we were at the start|\
    our starting point|the starting point|our starting place|the place we started from|the place we started|\
    the place where we started|the room where we started|the room we started in|the start of the tour|\
    the beginning of the tour|the spot where we started";
const PREVIOUS: &str = "where we just were|where we were just now|where we were before|where we were|\
    where we just came from|where we came from|the previous room|the previous place|the previous one|\
    the last room we were in|the last place we were in|the last room we saw|the last place|the last room|the last one|the room before this one|the one before this one|\
    the one before this|the room before this|the place before this one|the place before this";
const VISITED: &str = "a place we have seen|a place we have been to|somewhere we have been|a room we have been in|\
    a place we have been before|a place we have visited|a room we have seen";

impl Cursor<'_> {
    /// What the words here point at; none if they name something.
    pub(crate) fn pointer(&mut self) -> Option<Phrase> {
        let start = *self;
        if let Some(head) = self.pointed() {
            return Some(Phrase::new(head));
        }
        *self = start;
        None
    }

    fn pointed(&mut self) -> Option<Head> {
        if self.eat_any(START).is_some() {
            return Some(Head::Start);
        }
        if self.eat_any(VISITED).is_some() {
            return Some(Head::Visited);
        }
        if self.just_left() {
            return Some(Head::Previous);
        }
        if self.eat_any(SPOT).is_some() {
            return Some(Head::Here);
        }
        if self.eat_any("over there|there|that place|that spot").is_some() {
            return Some(Head::There);
        }
        if self.eat_any("you guys|you all|you|us").is_some() {
            return Some(Head::Agent);
        }
        if self.eat("me") {
            return Some(Head::Speaker);
        }
        // "It", but "that hallway".
        if self.eat("it") || self.eat_any("that room|that one").is_some() {
            return Some(Head::It);
        }
        let alone = matches!(self.peek(1), "" | "," | "and" | "is" | "was" | "are" | "you" | "there" | "on");
        (self.peek(0) == "that" && alone && self.eat("that")).then_some(Head::It)
    }

    /// "The room we just left", "where we just came from", "the previous room".
    pub(crate) fn just_left(&mut self) -> bool {
        let start = *self;
        let noun = self
            .eat_any("the last room|the last place|the room|the place|the one|the area|the space|the spot|that room|that place|what")
            .is_some();
        if noun {
            self.skip("that|which|where");
            let left = self.eat_any("we|you|i").is_some() && {
                self.skip("have|had|just|all|were just|were last|were|only just");
                self.eat_any(LEFT_BEHIND).is_some() || self.before() == "were"
            };
            if left {
                self.skip("just now|before|earlier|a moment ago|a minute ago|a second ago");
                return true;
            }
            *self = start;
        }
        let previous = self.eat_any(PREVIOUS).is_some() && !self.sees("on|before|to|in|at|past|after");
        if !previous {
            *self = start;
        }
        previous
    }
}
