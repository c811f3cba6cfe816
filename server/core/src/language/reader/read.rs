//! What the reader makes of a text: analyses, likeliest first.

use crate::language::act::{Act, Analysis, Content};
use crate::language::notation::notation;
use crate::language::reader::decide::Found;
use crate::language::reader::judge::Judge;
use crate::language::reader::tokens::MAX_TOKENS;

/// Analyses that are kept, each at least so likely.
const KEPT: usize = 3;
const KEPT_MIN: f64 = 0.05;
/// Sentences of one text that are read one by one.
const SENTENCES: usize = 8;
/// Words by which a speaker gives what is said no more than so much.
const DOUBTED: f64 = 0.7;
const DOUBTS: &[&str] =
    &["think", "believe", "maybe", "perhaps", "probably", "guess", "might", "suppose", "reckon"];

/// All that it may say, with probabilities; one without acts says nothing of places.
pub fn analyses(text: &str) -> Vec<Analysis> {
    let mut all = of_whole(text);
    // Several sentences say what each says, unless together they say it likelier.
    let sentences: Vec<&str> =
        text.split_inclusive(['.', '?', '!']).filter(|s| s.chars().any(char::is_alphanumeric)).collect();
    if (2..=SENTENCES).contains(&sentences.len()) {
        let each: Vec<Analysis> = sentences.iter().filter_map(|s| of_whole(s).into_iter().next()).collect();
        let weight = each.iter().map(|a| a.weight).product();
        if all.first().is_none_or(|a| a.weight < weight) {
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

fn of_whole(text: &str) -> Vec<Analysis> {
    let found = Found::new(text);
    if found.tokens.len() > MAX_TOKENS {
        return Vec::new();
    }
    let judge = Judge::learned();
    let doubts = found.tokens.iter().any(|t| DOUBTS.contains(&t.text.as_str()));
    let certainty = if doubts { DOUBTED } else { 1.0 };
    let choices = found.choices(judge.kinds(), |f| judge.weight(f)).into_iter();
    let likely = choices.take(KEPT).filter(|c| c.probability >= KEPT_MIN);
    let acts = |said: Vec<usize>| -> Vec<Act> {
        said.iter().map(|&p| Act { content: found.proposals[p].content.clone(), certainty }).collect()
    };
    likely.map(|c| analysis(c.probability, acts(c.said))).collect()
}

fn analysis(weight: f64, acts: Vec<Act>) -> Analysis {
    Analysis { weight, notation: notation(&acts), acts, hearing: 0 }
}

/// Whether some acts are of kinds that others are of, too.
pub fn agree(exact: &[Act], read: &[Act]) -> bool {
    let kind = |act: &Act| std::mem::discriminant::<Content>(&act.content);
    !read.is_empty() && read.iter().all(|r| exact.iter().any(|e| kind(e) == kind(r)))
}
