//! "Go down the hall until you reach the elevators, then turn left": heard and set aside, but what lies
//! at its end is located.

use crate::language::act::{Content, Head};
use crate::language::grammar::attach::Weighed;
use crate::language::grammar::build::Readings;
use crate::language::grammar::cursor::Cursor;
use crate::language::grammar::locate::locate_clause;
use crate::language::grammar::relate::Related;
use crate::language::notation::{phrase_notation, relation_notation};
use crate::language::relation::Relation as R;

/// Steps of one route that are read.
const STEPS_MAX: usize = 24;
/// Prepositional phrases of one step.
const PHRASES_MAX: usize = 4;
const GO: &str = "keep going|keep walking|keep on going|keep on|go|walk|continue|head|proceed|move|run|carry on|travel|come|step|keep";
const TURN: &str = "turn to the|turn to your|turn|make a sharp|make a|take a sharp|take a|take your|take the next|take the first|\
    take the second|take the third|hang a|bear|veer|go to the|go|make the next|make the first|make your next|swing|then";
const UNTIL: &str = "until you reach|until you get to|until you come to|until you see|until you are at|until you hit|\
    until you find|until you arrive at|until you come across|until you are in|until we reach|until you pass|until|\
    till you reach|till you get to|till you see|as far as|all the way to|up to|to";
const WHEN: &str = "when you reach|when you get to|when you come to|when you see|once you reach|once you get to|\
    once you are at|when you are at|at|after|past|before|onto|into|by|once you pass|after you pass";

/// Reads directions, and what is at their end.
pub(crate) fn route_clause(at: &mut Cursor) -> Option<Readings> {
    let mut steps = Vec::new();
    if at.eat_any("to get to|in order to get to|to go to|to reach|to find").is_some() {
        at.landmark()?;
        at.eat(",");
    }
    loop {
        let start = *at;
        if !steps.is_empty()
            && at.eat_any(", and then|and then|, then|then|, and|, after that|, next|and|,").is_none()
        {
            break;
        }
        at.skip("please|just|first|then|if you|as you|when you|once you|after you|you have to|you need to|you should|\
             you can|you want to|you will want to|you|immediately");
        let Some(step) = step(at).filter(|_| steps.len() < STEPS_MAX) else {
            *at = start;
            break;
        };
        steps.push(step);
    }
    if steps.is_empty() {
        return None;
    }
    let start = *at;
    at.skip(",|and|then|so|where");
    let ends = end(at).unwrap_or_else(|| {
        *at = start;
        vec![(1.0, None)]
    });
    let route = |then: Option<Content>| Content::Route { steps: steps.clone(), then: then.map(Box::new) };
    Some(Readings::new(ends.into_iter().map(|(w, then)| (w, vec![route(then)])).collect()))
}

/// "… and the kitchen is on the right".
fn end(at: &mut Cursor) -> Option<Weighed<Option<Content>>> {
    if at.sees("that|this|these|here") {
        return None;
    }
    let readings = locate_clause(at).or_else(|| super::label::label_clause(at))?;
    let located = |all: Vec<Content>| {
        all.into_iter().next().filter(|c| {
            // Where one is then is not here.
            matches!(c, Content::Locate(locate) if locate.figure.head != Head::Here)
        })
    };
    readings.all.into_iter().map(|(w, all)| located(all).map(|c| (w, Some(c)))).collect()
}

fn step(at: &mut Cursor) -> Option<String> {
    let start = *at;
    for form in [fork, when, turn, go, visit] {
        if let Some(step) = form(at) {
            return Some(step);
        }
        *at = start;
    }
    None
}

/// "If the hallway forks go left".
fn fork(at: &mut Cursor) -> Option<String> {
    at.eat_any("if|when|where|once")?;
    at.noun_phrase()?;
    let place = match at.eat_any("forks|splits|branches|divides|ends|stops|turns")? {
        "ends" | "stops" => "end",
        "turns" => "corner",
        _ => "fork",
    };
    at.skip(",|then");
    turn(at).or_else(|| go(at)).map(|next| format!("at {place} {next}"))
}

/// "When you reach the elevators, turn left".
fn when(at: &mut Cursor) -> Option<String> {
    let words = at.eat_any(WHEN)?;
    let (landmark, _) = at.landmark()?;
    at.skip(",|then");
    let place = phrase_notation(&landmark);
    turn(at).or_else(|| go(at)).map(|next| format!("{} {place} {next}", place_word(words)))
}

fn place_word(words: &str) -> &str {
    match words {
        "after" | "past" | "once you pass" | "after you pass" => "past",
        "before" => "before",
        "into" | "onto" => "into",
        _ => "at",
    }
}

/// "Turn left at the lobby", "take the second right".
fn turn(at: &mut Cursor) -> Option<String> {
    let words = at.eat_any(TURN)?;
    let nth = ["first", "second", "third"]
        .iter()
        .find(|n| words.contains(**n))
        .map_or(String::new(), |n| format!(" {n}"));
    let way = at.eat_any("left|right|around|back around")?;
    if at.sees("the corner|the") {
        return None;
    }
    at.skip("turn|again|immediately");
    let mut said = format!("turn{nth} {}", way.trim_start_matches("back "));
    if let Some(related) = at.related() {
        said = format!("{} {said}", relation_notation(&related.restriction()));
    } else if let Some(words) = at.eat_any(WHEN) {
        let (landmark, _) = at.landmark()?;
        said = format!("{} {} {said}", place_word(words), phrase_notation(&landmark));
    }
    Some(said)
}

/// "Go straight down the hall until you reach the elevators".
fn go(at: &mut Cursor) -> Option<String> {
    at.eat_any(GO)?;
    let mut said = Vec::new();
    for _ in 0..PHRASES_MAX {
        if at.sees(UNTIL) && !at.sees("to the left|to the right|to your left|to your right") {
            break;
        }
        if at.eat_any("straight ahead|straight|forward|forwards|ahead|back|on").is_some() {
            said.push("straight".to_owned());
            continue;
        }
        at.skip("all the way|out|further");
        let before = *at;
        if at.eat("and")
            && at.sees("turn|take|make|go|walk|you|the|it|continue|head|then|keep|enter|exit|bear")
        {
            *at = before;
            break;
        }
        // "Go past the gym, through the doors".
        let listed = !said.is_empty() && at.eat_any(", then|, and|,|then").is_some();
        let onward = |r: &Related| {
            matches!(r.relation, R::Through | R::Past | R::Down | R::Along | R::Across | R::Around | R::OutOf)
        };
        let Some(related) = at.related().filter(|r| !listed || onward(r) && !at.sees("is|are")) else {
            *at = before;
            break;
        };
        said.push(relation_notation(&related.restriction()));
    }
    if at.eat_any(UNTIL).is_some() {
        let end = at.eat_any("the very end|the end").is_some();
        let of = end && at.eat("of");
        let place = if end && !of { "end".to_owned() } else { phrase_notation(&at.landmark()?.0) };
        said.push(format!("until at {}{place}", if of { "end " } else { "" }));
    }
    said.dedup();
    (!said.is_empty()).then(|| said.join(" "))
}

/// "Enter the lobby", "follow the hallway", "take the stairs up".
fn visit(at: &mut Cursor) -> Option<String> {
    let verb =
        at.eat_any("follow|enter|exit|leave|pass|cross|take|stop at|stop in|wait in|wait at|use|climb")?;
    let (landmark, _) = at.landmark()?;
    if matches!(landmark.head, Head::Speaker | Head::Agent | Head::It) {
        // "Follow me" is an order.
        return None;
    }
    let verb = verb.split(' ').next().unwrap_or(verb);
    let mut said = format!("{verb} {}", phrase_notation(&landmark));
    if let Some(way) = at.eat_any("upstairs|downstairs|up|down") {
        said = format!("{said} {way}");
    }
    for _ in 0..PHRASES_MAX {
        if at.eat_any(UNTIL).is_some() {
            said = format!("{said} until at {}", phrase_notation(&at.landmark()?.0));
        } else if let Some(related) = at.related() {
            said = format!("{said} {}", relation_notation(&related.restriction()));
        } else {
            break;
        }
    }
    Some(said)
}
