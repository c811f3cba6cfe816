//! A text as words with classes, contractions taken apart.

use crate::language::lexicon::normalise::is_of_word;
use crate::language::reader::lexicon::{Class, lexicon};

/// A word, or what stands between words.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Token {
    /// In lower case, apostrophes straight.
    pub text: String,
    /// Written with a capital in a text that has small letters, too.
    pub capital: bool,
    /// What it is.
    pub class: Class,
    /// What words of its sense are called, if the lexicon tells.
    pub sense: Option<&'static str>,
}

/// Longer texts are not read: half of one may say the opposite of the whole.
pub const MAX_TOKENS: usize = 160;

/// All tokens of a text.
pub fn tokens(text: &str) -> Vec<Token> {
    let mixed = text.chars().any(char::is_lowercase);
    let chars: Vec<char> = text.chars().map(plain).collect();
    let mut words: Vec<(String, bool)> = Vec::new();
    let mut at = 0;
    while at < chars.len() {
        let c = chars[at];
        let next = chars.get(at + 1).copied().unwrap_or(' ');
        if c.is_alphanumeric() {
            let end = word_end(&chars, at);
            let word: String = chars[at..end].iter().collect();
            words.push((word, c.is_uppercase() && mixed));
            at = end;
            continue;
        }
        let before = at.checked_sub(1).map_or(' ', |b| chars[b]);
        match c {
            '?' | '!' | '.' | '…' | ';' | '\n' if !(c == '.' && next.is_alphanumeric()) => {
                words.push(((if c == '?' { "?" } else { "." }).into(), false));
            }
            ',' | ':' | '(' | ')' | '[' | ']' | '–' | '—' => words.push((",".into(), false)),
            '-' if !(before.is_alphanumeric() && next.is_alphanumeric()) => words.push((",".into(), false)),
            '&' => words.push(("and".into(), false)),
            _ => {}
        }
        at += 1;
    }
    for (word, _) in &mut words {
        *word = word.to_lowercase();
    }
    let mut out: Vec<Token> = Vec::new();
    let mut at = 0;
    while at < words.len() && out.len() <= MAX_TOKENS {
        if let Some((heard, said)) = lexicon().misheard(&words[at..]) {
            for word in said {
                apart(word, false, &mut out);
            }
            at += heard;
        } else {
            apart(&words[at].0, words[at].1, &mut out);
            at += 1;
        }
    }
    let repeated = |a: &Token, b: &Token| a.text == b.text && a.text != "that" && !a.class.is_number();
    out.dedup_by(|b, a| repeated(a, b));
    out.retain(|t| {
        !matches!(t.text.as_str(), "um" | "uh" | "er" | "erm" | "ehm" | "hmm" | "ah" | "eh" | "uhm")
    });
    out
}

/// One past the last character of a word: letters and digits, with apostrophes, ampersands and strokes inside.
fn word_end(chars: &[char], at: usize) -> usize {
    let mut end = at;
    while let Some(&c) = chars.get(end) {
        let inside =
            matches!(c, '\'' | '/' | '&' | '.') && chars.get(end + 1).is_some_and(|n| n.is_alphanumeric());
        if !(is_of_word(c) || inside) {
            break;
        }
        end += 1;
    }
    // "The students' lounge".
    let plural = end > at && chars[end - 1] == 's' && chars.get(end) == Some(&'\'');
    if plural && chars.get(end + 1) == Some(&' ') { end + 1 } else { end }
}

fn plain(c: char) -> char {
    match c {
        '‘' | '’' | 'ʼ' | '`' | '´' => '\'',
        '‐' | '‑' => '-',
        _ => c,
    }
}

/// One word as the tokens that it is short for.
fn apart(word: &str, capital: bool, out: &mut Vec<Token>) {
    let mut push = |text: &str, capital: bool| {
        let (class, sense) = (lexicon().class(text), lexicon().sense(text));
        out.push(Token { text: text.to_owned(), capital, class, sense });
    };
    if let Some(full) = lexicon().contraction(word) {
        full.split(' ').for_each(|w| push(w, false));
        return;
    }
    for (end, full) in
        [("n't", "not"), ("'re", "are"), ("'ve", "have"), ("'ll", "will"), ("'m", "am"), ("'d", "would")]
    {
        if let Some(stem) = word.strip_suffix(end).filter(|s| !s.is_empty()) {
            push(stem, capital);
            push(full, false);
            return;
        }
    }
    let owner = word.strip_suffix("'s").or_else(|| word.strip_suffix('\'').filter(|w| w.ends_with('s')));
    match owner {
        Some(stem) if !stem.is_empty() => {
            push(stem, capital);
            push("'s", false);
        }
        _ if word.contains('&') => push(&word.replace('&', "_and_"), capital),
        _ if word.contains('.') => {
            let plain: String = word.chars().filter(|c| *c != '.').collect();
            push(&plain, capital);
        }
        _ => push(word, capital),
    }
}
