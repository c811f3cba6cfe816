//! What the reader makes of a text: analyses, likeliest first.

use crate::language::act::{Act, Analysis, Content};
use crate::language::notation::notation;
use crate::language::reader::decide::Found;
use crate::language::reader::judge::Judge;
use crate::language::reader::propose::PROPOSALS_MAX;
use crate::language::reader::tokens::MAX_TOKENS;

/// Analyses that are kept, each at least so likely.
const KEPT: usize = 3;
const KEPT_MIN: f64 = 0.05;
/// Words by which a speaker gives what is said no more than so much.
const DOUBTED: f64 = 0.7;
const DOUBTS: &[&str] =
    &["think", "believe", "maybe", "perhaps", "probably", "guess", "might", "suppose", "reckon"];

/// Sentences of one text that are read one by one.
const SENTENCES: usize = 8;

/// All that it may say, with probabilities; one without acts says nothing of places. Several sentences say what each
/// says, unless together they say something likelier.
pub fn analyses(text: &str, judge: &Judge) -> Vec<Analysis> {
    let mut all = of_whole(text, judge);
    let sentences: Vec<&str> =
        text.split_inclusive(['.', '?', '!']).filter(|s| s.chars().any(char::is_alphanumeric)).collect();
    if (2..=SENTENCES).contains(&sentences.len()) {
        let each: Vec<Analysis> =
            sentences.iter().filter_map(|s| of_whole(s, judge).into_iter().next()).collect();
        let weight = each.iter().map(|a| a.weight).product();
        let mends = |a: &Analysis| {
            a.acts.iter().any(|act| matches!(act.content, Content::Correct { .. } | Content::Negate(_)))
        };
        if !each.iter().any(mends) && all.first().is_none_or(|a| a.weight < weight) {
            let joined = analysis(weight, each.into_iter().flat_map(|a| a.acts).collect());
            all.retain(|a| a.notation != joined.notation);
            for other in &mut all {
                other.weight *= 1.0 - weight;
            }
            all.insert(0, joined);
            all.truncate(KEPT);
        }
    }
    all
}

fn of_whole(text: &str, judge: &Judge) -> Vec<Analysis> {
    let found = Found::new(text);
    if found.tokens.len() > MAX_TOKENS || found.proposals.len() > PROPOSALS_MAX {
        return Vec::new();
    }
    let words: Vec<&str> = found.tokens.iter().map(|t| t.text.as_str()).collect();
    // "Do you think" asks.
    let doubts = (0..words.len()).any(|i| DOUBTS.contains(&words[i]) && (i == 0 || words[i - 1] != "you"));
    let certainty = if doubts { DOUBTED } else { 1.0 };
    let choices = found.choices(judge).into_iter();
    let likely = choices.take(KEPT).filter(|c| c.probability >= KEPT_MIN);
    let acts = |said: Vec<usize>| -> Vec<Act> {
        said.iter().map(|&p| Act { content: found.proposals[p].content.clone(), certainty }).collect()
    };
    likely.map(|c| analysis(c.probability, acts(c.said))).collect()
}

fn analysis(weight: f64, acts: Vec<Act>) -> Analysis {
    Analysis { weight, notation: notation(&acts), acts, hearing: 0 }
}
