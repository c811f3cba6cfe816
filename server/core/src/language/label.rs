//! "This is the gym": sentences that name the place held.

use super::names::Kind;
use super::noun_phrase::{Cursor, Determiner, NounPhrase};

/// The place held, as people point at it.
const SPOT: &str = "this place|this room|this area|this space|this spot|this building";

/// The phrase that names the place held, and whether the guide says "back" or "again".
pub(super) fn label(at: &mut Cursor) -> Option<(NounPhrase, bool)> {
    let start = *at;
    for form in [welcome, is_called, people_call] {
        if let Some(phrase) = form(at) {
            return Some((phrase, false));
        }
        *at = start;
    }
    if let Some(found) = this_is(at) {
        return Some(found);
    }
    *at = start;
    we_are_in(at)
}

/// "Welcome to the lab".
fn welcome(at: &mut Cursor) -> Option<NounPhrase> {
    at.eat_any("welcome to|welcome back to")?;
    named(at).filter(|p| p.kind == Kind::Place)
}

/// "This place is called Nirvana": a place's name, whatever it is; "this is called teamwork" is less
/// clear.
fn is_called(at: &mut Cursor) -> Option<NounPhrase> {
    let place = at.eat_any(SPOT).is_some() || !at.eat("this");
    at.eat_any("is called|is also called|is known as|is also known as|is named")?;
    named(at).filter(|p| place || plausible(p))
}

/// "They call this place the Z-center".
fn people_call(at: &mut Cursor) -> Option<NounPhrase> {
    at.eat_any("we|they|people|everyone|everybody|the students|i")?;
    at.skip("all|also|usually|just");
    at.eat_any("call|calls")?;
    let place = at.eat_any(SPOT).is_some();
    if !(place || at.eat("this")) {
        return None;
    }
    named(at).filter(|p| place || plausible(p))
}

/// "This is the gym", "here are the elevators".
fn this_is(at: &mut Cursor) -> Option<(NounPhrase, bool)> {
    at.eat_any(
        "this is|here is|here are|these are|this here is|here we have|here you have|over here we have|over here is|\
        this place is|this room is|this area is|we have reached|we have entered|we have just entered|\
        we just entered|we are entering|we are now entering|you are entering|you are now entering",
    )?;
    let back = at.eat_any("again|once again").is_some();
    at.skip("now");
    named(at).filter(plausible).map(|p| (p, back))
}

/// "We are back in the gym".
fn we_are_in(at: &mut Cursor) -> Option<(NounPhrase, bool)> {
    let who = at.eat_any(
        "here we are|now we are|we are|you are|i am|we have arrived|we have now arrived|we have just arrived|\
        we just arrived|you have arrived|we have come",
    );
    // "Back at the lobby" does without.
    if who.is_none() && at.peek(0) != "back" {
        return None;
    }
    let (mut back, mut inside) = (false, false);
    loop {
        if at.eat_any("back|again|once again|still").is_some() {
            back = true;
        } else if at.eat("inside") {
            inside = true;
        } else if at.eat_any("now|here|right|all|just|finally|currently|standing|already|at last").is_none() {
            break;
        }
    }
    let on = at.eat("on");
    if !(on || inside || at.eat_any("in|at|by").is_some() || (back && who.is_some() && at.eat("to"))) {
        return None;
    }
    // "On the terrace", but not "on the same page".
    named(at).filter(|p| plausible(p) && (!on || p.kind == Kind::Place)).map(|p| (p, back))
}

/// A noun phrase that may name the place held.
fn named(at: &mut Cursor) -> Option<NounPhrase> {
    at.noun_phrase().filter(|p| p.kind != Kind::No && p.determiner != Determiner::Demonstrative)
}

/// A known kind of place, or any definite single thing: unknown things ("a test", "the results") name
/// no place.
fn plausible(phrase: &NounPhrase) -> bool {
    phrase.kind == Kind::Place || (phrase.determiner == Determiner::Definite && !phrase.plural)
}

#[cfg(test)]
mod tests {
    use super::super::parse;

    fn label(text: &str) -> String {
        parse(text).notation
    }

    #[test]
    fn names_are_given_in_many_ways() {
        for (text, name) in [
            ("This is the kitchen.", "kitchen"),
            ("this is a kitchen", "kitchen"),
            ("Here’s the mail room", "mail_room"),
            ("here are the drinking fountains", "drinking_fountain"),
            ("We are at the back entrance.", "back_entrance"),
            ("We're in the lobby now.", "lobby"),
            ("So now you are in the main lobby, everyone", "main_lobby"),
            ("I'm in the copy room", "copy_room"),
            ("we are standing by the mural", "mural"),
            ("we have arrived at the loading dock", "loading_dock"),
            ("we're on the terrace", "terrace"),
            ("welcome to the Stata Center", "stata_center"),
            ("They call this place the Z-center.", "z_center"),
            ("we call this room the fishbowl", "fishbowl"),
            ("this place is called Nirvana", "nirvana"),
            ("This is lecture hall one twenty three.", "lecture_hall_one_twenty_three"),
            ("This is lecture hall 155", "lecture_hall_one_fifty_five"),
            ("this is Nick's office", "nick's_office"),
            ("this is our beautiful library", "library"),
            ("this is the information desk", "information_desk"),
            ("this is the kitchen, where we have lunch", "kitchen"),
            ("this is the elevator lobby on the first floor", "elevator_lobby"),
            ("we are at the entrance to the building", "entrance"),
        ] {
            assert_eq!(label(text), format!("label(here,{name})"), "{text}");
        }
    }

    #[test]
    fn sameness_is_heard() {
        for text in [
            "We're back in the lobby",
            "back at the lobby",
            "we have come back to the lobby",
            "this is the lobby again",
            "once again this is the lobby",
            "we are in the lobby once more",
            "this is the same lobby",
        ] {
            assert_eq!(label(text), "label(here,lobby)&same(here,lobby)", "{text}");
        }
        for text in ["This is another lobby.", "this is a different lobby", "we are in the other lobby now"] {
            assert_eq!(label(text), "label(here,lobby)&other(here,lobby)", "{text}");
        }
    }

    #[test]
    fn what_names_no_place_asserts_nothing() {
        for text in [
            "this is great",
            "this is my friend John",
            "this is John",
            "this is the famous Mister Jones",
            "this is Anna's sister",
            "we are in trouble",
            "we're in luck",
            "we are at war",
            "we are in the middle of the hallway",
            "we're in the clear",
            "I'm in the mood for coffee",
            "I'm in bed",
            "you are in charge",
            "here is the plan",
            "here's the thing",
            "here we go",
            "here we are",
            "here are some cookies",
            "this is the best",
            "this is the first time",
            "this is the end of the tour",
            "this is the weather forecast",
            "this is the kitchen table",
            "this is a test",
            "this is the wrong room",
            "this is a large room",
            "this is the next room",
            "this is the second floor",
            "this is the robot",
            "this is near the kitchen",
            "this is what I wanted",
            "this is one of the kitchens",
            "that is the kitchen",
            "welcome to the team",
            "welcome to the jungle",
            "they call me Bob",
            "we call this progress",
            "this is called teamwork",
            "we're on the same page",
            "we just left the kitchen",
            "you are in front of the stairs",
        ] {
            assert_eq!(label(text), "none", "{text}");
        }
    }
}
