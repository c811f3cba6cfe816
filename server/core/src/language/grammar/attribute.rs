//! Adjectives said of places: "empty", "under construction".

use crate::language::grammar::cursor::Cursor;

/// Adjectives that guides say of places, of our own making.
const ADJECTIVES: &str = "under construction|under renovation|out of order|out of service|out of bounds|off limits|\
    for staff only|staff only|not in use|in use|air conditioned|wheelchair accessible|accessible|available|bigger|big|\
    bright|broken|busy|carpeted|clean|closed|cold|comfortable|cosy|cozy|cramped|crowded|dark|dirty|empty|flooded|\
    free|full|haunted|hot|huge|large|locked|long|loud|messy|narrow|new|noisy|occupied|old|open|private|quiet|\
    reserved|round|shared|shut|small|spacious|square|taken|tiny|unlocked|unoccupied|unused|vacant|warm|wide";
const DEGREES: &str = "very|quite|really|pretty|so|too|rather|usually|always|often|never|completely|totally|currently|\
    now|still|often|mostly|a bit|a little|extremely|all";

/// Reads an adjective with its degree: "very small" is `very_small` in writing.
pub(crate) fn attribute(at: &mut Cursor) -> Option<String> {
    let mut words = Vec::new();
    while let Some(degree) = at.eat_any(DEGREES) {
        if !matches!(degree, "now" | "currently" | "still" | "usually") {
            words.push(degree);
        }
    }
    words.push(at.eat_any(ADJECTIVES)?);
    if at.eat("and") {
        words.extend(["and", at.eat_any(ADJECTIVES)?]);
    }
    at.skip("now|today|right now|at the moment|at the weekend|at night|these days|on weekends");
    Some(words.join(" "))
}
