//! Acts in writing, for reports, and in words, for the guide.
//!
//! ```text
//! notation = act {"&" act} | "none"
//! act      = "label(here," NAME ")" ["&same(here," NAME ")" | "&other(here," NAME ")"]
//!          | "loc(" NAME "," RELATION "," (NAME | "here") ")" | "ask(where," NAME ")"
//! RELATION = "through" | "down" | "away_from" | "near"
//! NAME     = the canonical name with "_" for spaces
//! ```

use super::{Act, Landmark, Name, Sameness};

/// What the guide is told when nothing was understood.
pub const NOT_UNDERSTOOD: &str = "I did not understand; nothing was changed. Try: this is the kitchen.";

/// The acts in writing; `none` if there is none.
pub(super) fn notation(acts: &[Act]) -> String {
    if acts.is_empty() {
        return "none".to_owned();
    }
    acts.iter().map(act_notation).collect::<Vec<_>>().join("&")
}

fn act_notation(act: &Act) -> String {
    let written = |name: &Name| name.as_str().replace(' ', "_");
    match act {
        Act::Label { name, again } => {
            let name = written(name);
            match again {
                Sameness::Same => format!("label(here,{name})&same(here,{name})"),
                Sameness::Other => format!("label(here,{name})&other(here,{name})"),
                Sameness::Open => format!("label(here,{name})"),
            }
        }
        Act::Locate { figure, relation, landmark } => {
            let relation = relation.notation();
            let landmark = match landmark {
                Landmark::Name(name) => written(name),
                Landmark::Here => "here".to_owned(),
            };
            format!("loc({},{relation},{landmark})", written(figure))
        }
        Act::AskWhere { name } => format!("ask(where,{})", written(name)),
    }
}

/// The acts in words: "I heard: the gym is down the hallway. I don't know of a hallway yet."
/// `known` tells whether a landmark's name has been taught; it is asked about no other name.
pub fn words(acts: &[Act], known: impl Fn(&Name) -> bool) -> String {
    if acts.is_empty() {
        return NOT_UNDERSTOOD.to_owned();
    }
    let heard: Vec<String> = acts.iter().map(clause).collect();
    let question = matches!(acts.last(), Some(Act::AskWhere { .. }));
    let mut text = format!("I heard: {}{}", heard.join(", and "), if question { "?" } else { "." });
    let mut missing: Vec<&Name> = Vec::new();
    for act in acts {
        if let Act::Locate { landmark: Landmark::Name(name), .. } = act
            && !missing.contains(&name)
            && !known(name)
        {
            missing.push(name);
            text.extend([" I don't know of ", &with_indefinite(name), " yet."]);
        }
    }
    text
}

fn clause(act: &Act) -> String {
    match act {
        Act::Label { name, again: Sameness::Open } => format!("you are in {}", name.with_article()),
        Act::Label { name, again: Sameness::Same } => format!("you are back in {}", name.with_article()),
        Act::Label { name, again: Sameness::Other } => format!("you are in another {name}"),
        Act::Locate { figure, relation, landmark } => {
            let relation = relation.words();
            let verb = if is_plural_only(figure) { "are" } else { "is" };
            let landmark = match landmark {
                Landmark::Name(name) => name.with_article(),
                Landmark::Here => "here".to_owned(),
            };
            format!("{} {verb} {relation} {landmark}", figure.with_article())
        }
        Act::AskWhere { name } => {
            format!("where {} {}", if is_plural_only(name) { "are" } else { "is" }, name.with_article())
        }
    }
}

fn is_plural_only(name: &Name) -> bool {
    name.as_str().ends_with("stairs")
}

/// "a hallway", "an elevator", "lecture hall five".
fn with_indefinite(name: &Name) -> String {
    let text = name.as_str();
    if !name.with_article().starts_with("the ") {
        return text.to_owned();
    }
    if is_plural_only(name) {
        return format!("any {text}");
    }
    format!("{} {text}", if text.starts_with(['a', 'e', 'i', 'o', 'u']) { "an" } else { "a" })
}

#[cfg(test)]
mod tests {
    use super::super::parse;
    use super::*;

    #[test]
    fn the_guide_is_told_what_was_understood() {
        for (text, said) in [
            ("this is the gym", "I heard: you are in the gym."),
            ("We're back at the gym", "I heard: you are back in the gym."),
            ("this is another lecture hall", "I heard: you are in another lecture hall."),
            ("this is lecture hall 123", "I heard: you are in lecture hall one twenty three."),
            ("the lab is near the lobby", "I heard: the lab is near the lobby."),
            (
                "the gym is down the hall",
                "I heard: the gym is down the hallway. I don't know of a hallway yet.",
            ),
            (
                "the stairs are near the exit",
                "I heard: the stairs are near the exit. I don't know of an exit yet.",
            ),
            ("where is the gym", "I heard: where is the gym?"),
            (
                "this is the kitchen and the lounge is next door",
                "I heard: you are in the kitchen, and the lounge is near here.",
            ),
            ("tralala", NOT_UNDERSTOOD),
        ] {
            assert_eq!(words(&parse(text).acts, |name| name.as_str() == "lobby"), said);
        }
    }
}
