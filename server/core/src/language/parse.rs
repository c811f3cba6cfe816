//! From a text to acts, by a small grammar over plain words. A sentence counts only if all of it is
//! read: one unread word ("I think", "not", "usually") and it says nothing to us.
//!
//! ```text
//! sentence = clause { ("," | "and" | "but") clause }
//! clause   = filler* (ask | label | locate) tag*
//! label    = ("this is" | "we are in" | "they call this" | "welcome to" | …) NAME ["where …"]
//! locate   = NAME {"and" NAME} ("is" | "are") relation | relation ("is" | "you will find") NAME
//!          | ("there is" | "you can find") NAME relation
//! relation = adverb* ("through" | "down" | "away from" | "near" | …) (NAME | "here")
//! ask      = ("where is" | "how do i get to" | "take me to" | …) NAME
//! ```
//!
//! Names are an open vocabulary, so what counts as one is judged with care (`names.rs`): "this is
//! the mural" gives a name, "this is the plan" or "this is great" gives none.

use super::label::label;
use super::locate::locate;
use super::names::{Kind, Name};
use super::normalise::{Sentence, sentences};
use super::noun_phrase::{Cursor, Determiner};
use super::words::notation;
use super::{Act, Parse, Sameness};

/// Said before a clause; changes nothing.
const FILLERS: &str = ",|and|so|ok|okay|now|um|uh|er|erm|hmm|well|alright|all right|oh|ah|hey|hi|hello|yes|yeah|\
    then|also|next ,|finally|anyway|please|look|listen|as you can see|as you see|you see|you know|by the way|\
    excuse me|at last|robot|everyone|everybody|ladies and gentlemen|folks|guys|sorry|actually|good ,|great ,|right ,";

/// Said after a clause; changes nothing (a map is one level).
const TAGS: &str = "now|right now|here|right here|over here|today|too|as well|also|then|everyone|everybody|guys|\
    folks|ladies and gentlemen|please|by the way|of course|as you can see|you see|at last|finally|from here|\
    of the building|of this building|in this building|in the building|to the building|to this building|\
    on this floor|on our floor|on the ground floor|on the first floor|on the second floor|on the third floor|\
    on the top floor";

/// Says that the place is one seen before.
const AGAIN: &str = "again|once again|once more";

/// Words that may turn a sentence into its opposite.
const NEGATIONS: [&str; 8] = ["not", "no", "never", "nor", "nothing", "nobody", "none", "without"];

/// What a text says; no acts if it is not understood or longer than
/// [`MAX_TEXT_BYTES`](super::MAX_TEXT_BYTES). Linear in the text.
pub fn parse(text: &str) -> Parse {
    let acts: Vec<Act> = sentences(text).iter().filter_map(sentence).flatten().collect();
    let notation = notation(&acts);
    Parse { acts, notation }
}

/// The name asked for by a question ("where is the gym?") or a bare name ("gym").
pub fn parse_query(text: &str) -> Option<Name> {
    for act in parse(text).acts {
        if let Act::AskWhere { name } = act {
            return Some(name);
        }
    }
    let sentences = sentences(text);
    let [only] = sentences.as_slice() else { return None };
    let mut at = Cursor::new(&only.words);
    at.skip(FILLERS);
    let asked = at.noun_phrase()?;
    at.skip(TAGS);
    at.at_end().then_some(asked.name)
}

/// All acts of one sentence, or none if any part of it is not understood.
fn sentence(sentence: &Sentence) -> Option<Vec<Act>> {
    if sentence.words.iter().any(|w| NEGATIONS.contains(&w.as_str())) {
        return None;
    }
    let mut at = Cursor::new(&sentence.words);
    let mut acts = Vec::new();
    loop {
        let mut again = false;
        while at.eat_any(FILLERS).is_some() || eat_again(&mut at, &mut again) {}
        if at.at_end() {
            break;
        }
        clause(&mut at, again, &mut acts)?;
        if !(at.at_end() || at.eat_any(",|and|but").is_some()) {
            return None;
        }
    }
    // "This is the gym?" asks; it asserts nothing.
    let asserts = acts.iter().any(|act| !matches!(act, Act::AskWhere { .. }));
    (!(sentence.question && asserts)).then_some(acts)
}

fn eat_again(at: &mut Cursor, again: &mut bool) -> bool {
    let eaten = at.eat_any(AGAIN).is_some();
    *again |= eaten;
    eaten
}

/// Reads one clause with its tags; none if none stands here.
fn clause(at: &mut Cursor, mut again: bool, acts: &mut Vec<Act>) -> Option<()> {
    let start = *at;
    if let Some(name) = ask(at) {
        acts.push(Act::AskWhere { name });
        at.skip(TAGS);
        return Some(());
    }
    *at = start;
    if let Some((phrase, back)) = label(at) {
        again |= back;
        while at.eat_any(TAGS).is_some() || eat_again(at, &mut again) {}
        if phrase.kind == Kind::Place && at.eat_any("where|, where|, which").is_some() {
            // "…, where we have lunch" says more about the place, nothing that we use.
            at.skip_to_end();
        }
        let again = if again && phrase.again == Sameness::Open { Sameness::Same } else { phrase.again };
        acts.push(Act::Label { name: phrase.name, again });
        return Some(());
    }
    *at = start;
    acts.extend(locate(at)?);
    at.skip(TAGS);
    Some(())
}

/// "Where is the gym": the name asked for.
fn ask(at: &mut Cursor) -> Option<Name> {
    const INDIRECT: &str = "do you know where|can you tell me where|could you tell me where|tell me where|\
        show me where|can you show me where|could you show me where";
    // A phrase that begins another comes after it.
    const DIRECT: &str = "where is|where are|where can i find|where can we find|where do i find|where do we find|\
        how do i get from here to|how do i get to|how do we get to|how can i get to|how can we get to|how do i find|\
        how to get to|what is the way to|which way is it to|which way is|which way are|which way to|take me to|\
        take us to|bring me to|bring us to|lead me to|guide me to|show me the way to|show me to|directions to|\
        i am looking for|we are looking for|looking for|do you know the way to|can you take me to|\
        could you take me to|can you show me the way to|could you show me the way to|can you tell me the way to";
    let indirect = at.eat_any(INDIRECT).is_some();
    if !indirect {
        at.eat_any(DIRECT)?;
    }
    let asked = at.noun_phrase()?;
    if indirect {
        at.eat_any("is|are")?;
    }
    at.skip("at|located|again");
    // "Where is this gym" asks nothing.
    (asked.determiner != Determiner::Demonstrative).then_some(asked.name)
}

#[cfg(test)]
mod tests {
    use super::super::MAX_TEXT_BYTES;
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn questions_are_understood() {
        for (text, name) in [
            ("Where is the gym?", "gym"),
            ("where’s the nearest restroom please", "bathroom"),
            ("where are the lifts", "elevator"),
            ("How do I get to the library from here?", "library"),
            ("take me to Lecture Hall 123", "lecture hall one twenty three"),
            ("which way is it to the exit?", "exit"),
            ("excuse me, do you know where the kitchen is?", "kitchen"),
            ("I'm looking for the mail room", "mail room"),
            ("where can I find a zorbing parlor", "zorbing parlor"),
        ] {
            assert_eq!(parse(text).notation, format!("ask(where,{})", name.replace(' ', "_")), "{text}");
            assert_eq!(parse_query(text), Name::new(name), "{text}");
        }
        for text in
            ["where are you", "where is he?", "where", "which way", "what room is this?", "where is this?"]
        {
            assert_eq!(parse(text).notation, "none", "{text}");
            assert_eq!(parse_query(text), None, "{text}");
        }
    }

    #[test]
    fn a_bare_name_asks_but_does_not_tell() {
        for text in ["Kitchen", "the kitchen", "kitchens", "ok, the kitchen please"] {
            assert_eq!(parse_query(text), Name::new("kitchen"), "{text}");
            assert!(parse(text).acts.is_empty(), "{text}");
        }
        assert_eq!(parse_query("the kitchen, the gym"), None);
        assert_eq!(parse_query("this is the kitchen"), None);
        assert_eq!(parse_query(""), None);
    }

    #[test]
    fn sentences_may_hold_several_clauses() {
        for (text, notation) in [
            ("Ok. This is the gym! It is big.", "label(here,gym)"),
            ("This is the kitchen and the lounge is next door.", "label(here,kitchen)&loc(lounge,near,here)"),
            (
                "The cafe is near the library, and the gym is down the hall",
                "loc(cafe,near,library)&loc(gym,down,hallway)",
            ),
            ("Again we are in the hallway, everyone", "label(here,hallway)&same(here,hallway)"),
            // One part not understood, and the whole sentence says nothing.
            ("This is the kitchen and it smells", "none"),
            ("Go down the hall, and the gym is near the lobby", "none"),
            ("If you see the gym, the lobby is down the hall", "none"),
        ] {
            assert_eq!(parse(text).notation, notation, "{text}");
        }
    }

    #[test]
    fn doubt_denial_and_questions_assert_nothing() {
        for text in [
            "this is not the gym",
            "This isn’t the gym.",
            "No, this is the gym, not the kitchen.",
            "this is the gym?",
            "is this the gym",
            "I think this is the gym",
            "maybe this is the gym",
            "this might be the gym",
            "this was the gym",
            "this will be the gym",
            "the gym is not down the hall",
            "the gym is probably down the hall",
            "is the gym down the hall?",
            "when you are in the gym turn left",
            "there's never a lab near the lobby",
        ] {
            assert_eq!(parse(text).notation, "none", "{text}");
        }
    }

    #[test]
    fn a_long_sentence_is_read_in_linear_steps() {
        // As many clauses as fit: quadratic reading would show in the count of acts only by a hang.
        let text = "this is the gym and ".repeat(MAX_TEXT_BYTES / 20);
        assert_eq!(parse(&text).acts.len(), MAX_TEXT_BYTES / 20);
    }

    proptest! {
        #[test]
        fn any_text_is_taken(text in "\\PC{0,200}") {
            let parse = parse(&text);
            prop_assert_eq!(parse.acts.is_empty(), parse.notation == "none");
            let _ = parse_query(&text);
        }

        #[test]
        fn any_words_in_any_order_are_taken(
            words in prop::collection::vec(prop::sample::select(vec![
                "this", "is", "the", "gym", "we", "are", "in", "at", ",", ".", "?", "and", "down", "near", "hall", "of",
                "another", "a", "here", "there", "where", "back", "again", "call", "next", "to", "one", "hundred", "oh",
                "23", "ß", "'s", "n't", "through", "not", "you", "find", "is called", "é", "🙂", "it's",
            ]), 0..60),
        ) {
            let text = words.join(" ");
            let parse = parse(&text);
            for act in &parse.acts {
                if let Act::Label { name, .. } | Act::AskWhere { name } = act {
                    prop_assert_eq!(Name::new(name.as_str()), Some(name.clone()), "labels are canonical");
                }
            }
        }

        #[test]
        fn case_punctuation_and_fillers_do_not_matter(
            filler in prop::sample::select(vec!["", "and ", "So, ", "OK... ", "um, well, ", "now "]),
            end in prop::sample::select(vec!["", ".", "!", " now.", ", everyone", " …"]),
            upper: bool,
        ) {
            let text = format!("{filler}we’re in the elevator lobby{end}");
            let text = if upper { text.to_uppercase() } else { text };
            prop_assert_eq!(parse(&text).notation, "label(here,elevator_lobby)");
        }
    }
}
