//! How much of a count of place words the lexicon covers: `vocabulary FILE`, a JSON object of lists
//! `[[word, count], …]`. Prints, per list, the share of mentions whose word is a concept of the lexicon or
//! ends in one, and the most frequent words that are none.

use toponym_core::language::Name;

fn main() -> std::io::Result<()> {
    let file = std::env::args().nth(1).unwrap_or_default();
    let lists: serde_json::Value = serde_json::from_str(&std::fs::read_to_string(file)?)?;
    for (list, words) in lists.as_object().into_iter().flatten() {
        let (mut known, mut all, mut unknown) = (0, 0, Vec::new());
        for word in words.as_array().into_iter().flatten() {
            let (said, count) = (word[0].as_str().unwrap_or(""), word[1].as_u64().unwrap_or(0));
            all += count;
            if Name::new(said).is_some_and(|name| name.hypernym().is_some()) {
                known += count;
            } else if unknown.len() < 30 {
                unknown.push(format!("{said} {count}"));
            }
        }
        println!("{list}: {known} of {all} mentions, {:.1} %", 100.0 * known as f64 / all.max(1) as f64);
        println!("  without: {}", unknown.join(", "));
    }
    Ok(())
}
