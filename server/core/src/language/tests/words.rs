use crate::language::grammar::parse::parse;
use crate::language::lexicon::names::Name;
use crate::language::words::{NOT_UNDERSTOOD, words};

#[test]
fn the_guide_is_told_what_was_understood() {
    for (text, said) in [
        ("this is the gym", "I heard: you are in the gym."),
        ("We're back at the gym", "I heard: you are back in the gym."),
        ("this is another lecture hall", "I heard: you are in another lecture hall."),
        ("this is lecture hall 123", "I heard: you are in lecture hall one twenty three."),
        ("the lab is near the lobby", "I heard: the lab is near the lobby."),
        ("the gym is down the hall", "I heard: the gym is down the hallway. I don't know of a hallway yet."),
        (
            "the stairs are near the exit",
            "I heard: the stairs are near the exit. I don't know of an exit yet.",
        ),
        ("where is the gym", "I heard: where is the gym?"),
        (
            "this is the gym and the library is next door",
            "I heard: you are in the gym, and the library is next door.",
        ),
        ("I think this is the gym", "I heard: probably, you are in the gym."),
        ("this isn't the gym", "I heard: it is not so that you are in the gym."),
        (
            "no, this is the gym, not the lab",
            "I heard: you are in the gym, and it is not so that you are in the lab.",
        ),
        ("it's the second door on the right", "I heard: it is at the second door on the right."),
        ("kitchens are usually near lounges", "I heard: in general, the kitchen is usually near the lounge."),
        ("close the door", "I heard an order; I only make maps. Nothing was changed."),
        ("tralala", NOT_UNDERSTOOD),
    ] {
        let known = |name: &Name| matches!(name.as_str(), "lobby" | "door");
        assert_eq!(words(parse(text).acts(), known), said);
    }
}
