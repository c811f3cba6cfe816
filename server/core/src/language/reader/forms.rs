//! Forms of words, and ways to say one thing, as the lexicon's files abbreviate them.

/// The forms of a verb: a stem ending in a single consonant after a single vowel doubles it.
pub fn inflected(stem: &str) -> Vec<String> {
    let bytes = stem.as_bytes();
    let is_vowel = |b: u8| matches!(b, b'a' | b'e' | b'i' | b'o' | b'u');
    let mut forms = vec![stem.to_owned()];
    let (last, before) = (bytes[bytes.len() - 1], bytes[bytes.len().saturating_sub(2)]);
    let root = match last {
        b'e' => stem[..stem.len() - 1].to_owned(),
        b'y' if !is_vowel(before) => format!("{}i", &stem[..stem.len() - 1]),
        _ => stem.to_owned(),
    };
    let ends_hissing = ["s", "x", "ch", "sh", "o"].iter().any(|e| stem.ends_with(e));
    forms.push(if ends_hissing || root.ends_with('i') { format!("{root}es") } else { format!("{stem}s") });
    let doubled = bytes.len() > 2
        && !is_vowel(last)
        && !matches!(last, b'w' | b'x' | b'y')
        && is_vowel(before)
        && !is_vowel(bytes[bytes.len() - 3]);
    let long = if doubled { format!("{stem}{}", last as char) } else { root.clone() };
    forms.push(format!("{long}ed"));
    forms.push(format!("{}ing", if last == b'y' { stem } else { &long }));
    if doubled {
        forms.push(format!("{stem}ed"));
        forms.push(format!("{stem}ing"));
    }
    forms
}

/// "a|b (c) d" as all that it stands for.
pub fn expanded(pattern: &str) -> Vec<Vec<String>> {
    let mut all: Vec<Vec<String>> = vec![vec![]];
    let spaced = pattern.replace("(a)round", "around|round");
    for part in spaced.split(' ') {
        let optional = part.starts_with('(');
        let choices: Vec<&str> = part.trim_matches(['(', ')']).split('|').collect();
        let mut next = Vec::new();
        for words in &all {
            if optional {
                next.push(words.clone());
            }
            for choice in &choices {
                let mut more = words.clone();
                more.push((*choice).to_owned());
                next.push(more);
            }
        }
        all = next;
    }
    all
}
