//! How a guide spells a name: "Anna's Office", "R&D lab". The map knows names by one plain spelling, people by theirs.

use crate::language::lexicon::names::{MAX_NAME_WORDS, Name};

/// Words before a name that are none of it.
const BEFORE: [&str; 9] = ["the", "a", "an", "our", "my", "your", "his", "her", "their"];

/// A name as it stands in a text; none if it is spelled there as the map spells it, or is written in capitals
/// throughout, as some recognisers do. `nouns`: whether nouns have a capital wherever they stand; `read`: the name that
/// some words are.
pub fn spelling(text: &str, name: &Name, nouns: bool, read: impl Fn(&str) -> Option<Name>) -> Option<String> {
    if !text.chars().any(char::is_lowercase) && text.is_ascii() {
        return None;
    }
    let words: Vec<&str> = text.split_whitespace().collect();
    let is_it = |of: &[&str]| {
        !BEFORE.contains(&of[0].to_lowercase().as_str()) && read(&trimmed(of)).as_ref() == Some(name)
    };
    let found = (1..=MAX_NAME_WORDS).flat_map(|n| words.windows(n)).find(|w| is_it(w))?;
    let mut spelled = trimmed(found);
    // A sentence begins with a capital, which is none of the name's unless that has others or tells whose it is.
    let begins = found.as_ptr() == words.as_ptr();
    let others = spelled.chars().skip(1).any(char::is_uppercase) || spelled.contains(['\'', '’']);
    if begins && !others && !nouns {
        spelled = spelled.to_lowercase();
    }
    (spelled != name.as_str()).then_some(spelled)
}

/// Words without what surrounds them.
fn trimmed(words: &[&str]) -> String {
    words.join(" ").trim_matches(|c: char| !c.is_alphanumeric()).to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_shown_as_they_were_spelled() {
        for (text, name, shown) in [
            ("This is Anna's Office.", "anna's office", Some("Anna's Office")),
            ("the R&D lab is down the hall", "r&d lab", Some("R&D lab")),
            ("here is the Café Müller", "cafe muller", Some("Café Müller")),
            ("this is the kitchen", "kitchen", None),
            ("Kitchen!", "kitchen", None),
            ("THIS IS THE GYM", "gym", None),
            ("Nick's office is over there", "nick's office", Some("Nick's office")),
            ("we call it 厨房", "厨房", None),
            ("this is lecture hall 123", "lecture hall one twenty three", Some("lecture hall 123")),
            ("the restrooms are here", "bathroom", Some("restrooms")),
            ("this is the gym", "lounge", None),
        ] {
            let name = Name::new(name).unwrap();
            assert_eq!(spelling(text, &name, false, Name::new).as_deref(), shown, "{text}");
        }
    }
}
