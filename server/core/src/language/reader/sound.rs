//! Words that sound alike: what recognisers write for a place's name ("chap all", "key osk").

use crate::language::reader::lexicon::lexicon;
use crate::language::reader::tokens::Token;

/// A name's word is heard as so many words at most.
const HEARD_AS: usize = 3;

/// How a word sounds, roughly: consonants by their class, vowels all alike, what is silent left out.
pub fn sound(word: &str) -> String {
    let mut word: String = word.chars().filter(char::is_ascii_alphabetic).collect();
    for (end, short) in [("es", "s"), ("ed", "d"), ("e", "")] {
        if word.len() > end.len() + 2 && word.ends_with(end) {
            word.truncate(word.len() - end.len());
            word.push_str(short);
            break;
        }
    }
    for (written, spoken) in [
        ("tch", "C"),
        ("ch", "C"),
        ("sh", "S"),
        ("tion", "San"),
        ("ssion", "San"),
        ("ph", "f"),
        ("gh", ""),
        ("wh", "w"),
        ("wr", "r"),
        ("kn", "n"),
        ("mb", "m"),
        ("ck", "k"),
        ("dg", "j"),
        ("ce", "se"),
        ("ci", "si"),
        ("cy", "sy"),
        ("ge", "je"),
        ("gy", "jy"),
        ("qu", "kw"),
        ("x", "ks"),
    ] {
        word = word.replace(written, spoken);
    }
    let mut out = String::new();
    for (i, c) in word.char_indices() {
        let next = word[i..].chars().nth(1);
        let vowel = |c: Option<char>| c.is_some_and(|c| "aeiouy".contains(c));
        let said = match c {
            'r' if out.ends_with('a') && !vowel(next) => continue,
            'a' | 'e' | 'i' | 'o' | 'u' | 'y' => 'a',
            'w' if out.ends_with('a') => continue,
            'h' if i > 0 => continue,
            'c' | 'q' => 'k',
            'z' => 's',
            'd' => 't',
            'b' => 'p',
            c => c,
        };
        if !out.ends_with(said) {
            out.push(said);
        }
    }
    out
}

/// Words of a run as they may have been said: those that name no place, as words of places that sound like them.
pub fn mended(words: &[Token]) -> Option<Vec<String>> {
    let mut out = Vec::new();
    let mut at = 0;
    let mut changed = false;
    'words: while at < words.len() {
        for n in (1..=HEARD_AS.min(words.len() - at)).rev() {
            let heard: String = words[at..at + n].iter().map(|t| t.text.as_str()).collect();
            if n == 1 && lexicon().is_of_places(&heard) {
                break;
            }
            if let Some(said) = lexicon().sounding(&sound(&heard)).filter(|s| **s != heard) {
                out.push(said.to_owned());
                at += n;
                changed = true;
                continue 'words;
            }
        }
        out.push(words[at].text.clone());
        at += 1;
    }
    changed.then_some(out)
}
