//! Names that a recogniser misheard: "the kitten is down the hall". A guess, and marked as one: names are
//! never joined because they look alike.

use crate::language::act::{Content, Head, Phrase};
use crate::language::grammar::build::Readings;
use crate::language::lexicon::edits::edits;
use crate::language::lexicon::names::Name;
use crate::language::lexicon::places;
use crate::language::relation::Relation as R;

/// How likely a thing that no map holds, said to lie where only places are, is a name misheard. Below one
/// half, so that no such guess is ever the likeliest by itself.
const MISHEARD: f64 = 0.3;
/// Letters that may differ.
const EDITS_MAX: usize = 2;
/// Shorter words resemble too many others.
const LETTERS_MIN: usize = 5;

/// The one known place that a word nearly spells.
pub(crate) fn mended(phrase: &Phrase) -> Option<Phrase> {
    let label = phrase.label()?;
    let said = label.as_str();
    if said.len() < LETTERS_MIN || said.contains(' ') {
        return None;
    }
    let near = |place: &&str| place.len() >= LETTERS_MIN && place.as_bytes()[0] == said.as_bytes()[0];
    let mut found: Vec<(usize, &str)> =
        places().filter(near).map(|p| (edits(said, p), p)).filter(|(d, _)| *d <= EDITS_MAX).collect();
    found.sort_unstable();
    let unique = found.len() == 1 || matches!(found.as_slice(), [a, b, ..] if a.0 < b.0);
    let (_, place) = found.first().filter(|_| unique)?;
    Some(Phrase::new(Head::Named(Name::new(place)?)))
}

/// Marks what was read with a mended figure, if it lies where places are rather than things.
pub(crate) fn guessed(readings: Readings) -> Option<Readings> {
    let mut all = readings.all;
    for (weight, said) in &mut all {
        *weight *= MISHEARD;
        for content in said {
            let Content::Locate(locate) = content else { return None };
            locate.repaired = true;
            let way = matches!(
                locate.relation,
                R::Down
                    | R::Through
                    | R::Past
                    | R::Along
                    | R::Across
                    | R::AtEndOf
                    | R::LevelUp
                    | R::LevelDown
            );
            if !way {
                return None;
            }
        }
    }
    Some(Readings { all, certainty: readings.certainty })
}
