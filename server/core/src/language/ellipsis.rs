//! Sentences that leave out what the one before said: "and the gym too", "so is the lounge", "same for the bar".

use crate::language::act::{Act, Analysis, Content, Head, Locate, Parse, Phrase};
use crate::language::grammar::cursor::Cursor;
use crate::language::lexicon::normalise::sentences;
use crate::language::notation::notation;

const BEFORE: &str = ",|and|oh|um|uh|er|well|ok|okay|yeah|yes|also|then";
const LIKEWISE: &str = "so is|so are|as is|as are|the same goes for|same goes for|the same for|same for|the same with|same with|ditto for|ditto";
const TOO: &str = "is too|are too|is as well|are as well|too|as well|also|likewise|is the same|the same";

/// What a text speaks of that leaves out what it says.
fn likewise(text: &str) -> Option<Phrase> {
    let sentences = sentences(text);
    let [only] = sentences.as_slice() else { return None };
    let mut at = Cursor::new(&only.words);
    at.skip(BEFORE);
    let opens = at.eat_any(LIKEWISE).is_some();
    let named = at.noun_phrase()?.name()?;
    let closes = at.eat_any(TOO).is_some();
    (at.at_end() && (opens || closes)).then(|| Phrase::new(Head::Named(named)))
}

/// What a text says that leaves it to what was `said` before where its place lies.
pub fn as_before(text: &str, said: &Parse) -> Option<Parse> {
    let figure = likewise(text)?;
    let analysis = said.analyses.iter().find_map(|a| {
        let last = a.acts.iter().rev().find_map(|act| match &act.content {
            Content::Locate(l) => Some((act.certainty, l)),
            _ => None,
        });
        let (certainty, l) = last?;
        let content = Content::Locate(Locate { figure: figure.clone(), repaired: false, ..l.clone() });
        let acts = vec![Act { content, certainty }];
        Some(Analysis { weight: a.weight, notation: notation(&acts), acts, hearing: 0 })
    })?;
    Some(Parse { analyses: vec![analysis] })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::language::understand::parse;

    #[test]
    fn what_was_left_out_is_taken_from_the_sentence_before() {
        let said = parse("the library is down the hall");
        for text in ["and the gym too", "so is the gym", "the gym as well", "same goes for the gym"] {
            let parse = as_before(text, &said).unwrap_or_else(|| panic!("{text}"));
            assert_eq!(parse.notation(), "loc(gym,down,hallway)", "{text}");
        }
        for text in ["the gym", "this is the gym too", "and the gym is upstairs", "me too"] {
            assert_eq!(as_before(text, &said), None, "{text}");
        }
        assert_eq!(as_before("and the gym too", &parse("this is the library")), None);
    }
}
