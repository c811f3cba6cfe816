//! How far the verbs and landmarks of route texts reach.

use crate::language::clauses::chunks::{MOTION, STARTS_CLAUSE, Token, eats, is_one_of};

/// After these, "to" goes on with the same phrase.
const BEFORE_TO: &str = "next|leading|close|opposite|door|doors|entrance|leads|adjacent";

/// One past the verb that begins at `start`, with its direction; `start` if none does.
pub(crate) fn verb_end(tokens: &[Token], start: usize) -> usize {
    let text = |i: usize| tokens.get(i).map_or("", |t| t.text.as_str());
    let mut at = start + usize::from(is_one_of(text(start), "immediately"));
    at += usize::from(at > start && text(at) == ",");
    if !is_one_of(text(at), MOTION) {
        return start;
    }
    let first = text(at).to_owned();
    at += 1;
    if is_one_of(&first, "look|looking") && text(at) == "for" {
        return at + 1;
    }
    if is_one_of(&first, "continue|keep|start|continuing|proceed") {
        at += usize::from(text(at) == "to" && is_one_of(text(at + 1), MOTION));
        at += usize::from(is_one_of(text(at), MOTION));
    }
    // "Take your first right", "turn left", "go straight ahead".
    let mut ahead = at;
    while is_one_of(
        text(ahead),
        "a|an|the|your|first|second|third|next|immediate|sharp|hard|to|on|at|slight|another",
    ) && ahead < at + 4
    {
        ahead += 1;
    }
    if is_one_of(text(ahead), "left|right") && !is_one_of(text(ahead + 1), "side|hand|of|door|hallway|corner")
    {
        let to = is_one_of(text(at), "to|on|at");
        if !(to && is_one_of(text(at + 1), "your|the") && !is_one_of(&first, "turn|turning|go|bear")) {
            ahead += 1;
            return ahead + usize::from(is_one_of(text(ahead), "turn|again"));
        }
    }
    while is_one_of(text(at), "straight|ahead|forward|forwards|slowly|directly|backwards|diagonally")
        && !(text(at) == "ahead" && text(at + 1) == "of")
    {
        at += 1;
    }
    if text(at) == "on" && is_one_of(text(at + 1), "through|straight|past|down") && at > start + 1 {
        return at;
    }
    at
}

pub(crate) fn ends_landmark(tokens: &[Token], start: usize, at: usize) -> bool {
    let token = &tokens[at];
    let text = |i: usize| tokens.get(i).map_or("", |t| t.text.as_str());
    if token.is_break() || is_one_of(&token.text, "and|or|then|but|so") {
        return true;
    }
    if at == start {
        return is_one_of(&token.text, STARTS_CLAUSE) || eats(&tokens[at..], "until|till|when you").is_some();
    }
    let last = text(at - 1);
    match token.text.as_str() {
        "to" => !tells_side(tokens, at + 1) && !is_one_of(last, BEFORE_TO),
        "from" => !is_one_of(last, "across|away|opposite|out"),
        "across" => text(at + 1) != "from",
        "on" => text(at + 1) == "through",
        "straight" => is_one_of(text(at + 1), "through|into|down|past|across|until|to"),
        "right" | "just" | "immediately" => is_one_of(text(at + 1), "past|after|before|through|into"),
        "turn" | "take" | "walk" | "go" | "make" | "continue" | "enter" | "exit" | "until" | "till"
        | "through" | "thru" | "into" | "past" | "towards" | "toward" | "when" | "at" | "onto" | "along"
        | "away" => true,
        "down" => is_one_of(text(at + 1), "the|that|this|a|to|hall|hallway"),
        "out" => is_one_of(text(at + 1), "of|the|into"),
        "all" => text(at + 1) == "the" && text(at + 2) == "way",
        "you" => !is_one_of(last, "of|behind|facing|from|left|that|when|as|to|have|room|area|door|doors"),
        _ => false,
    }
}

/// "(to) your left", "(to) the immediate right".
pub(crate) fn tells_side(tokens: &[Token], at: usize) -> bool {
    let text = |i: usize| tokens.get(i).map_or("", |t| t.text.as_str());
    let after = at + usize::from(is_one_of(text(at), "your|the"));
    is_one_of(text(after), "left|right") || (after > at && is_one_of(text(after), "very|immediate"))
}

pub(crate) fn clause_starts(tokens: &[Token], at: usize) -> bool {
    verb_end(tokens, at) > at || tokens.get(at).is_some_and(|t| is_one_of(&t.text, "then|you|,"))
}
