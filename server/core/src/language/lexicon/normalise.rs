//! From what a recogniser or a keyboard yields to sentences of plain words: case, curly quotes,
//! accents, contractions, punctuation. One pass, linear in the text.

/// Longer texts are not listened to.
pub const MAX_TEXT_BYTES: usize = 4096;

/// The token for a comma, colon, dash or bracket inside a sentence.
pub(crate) const COMMA: &str = ",";

/// A word of lower case, or [`COMMA`].
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Word {
    pub(crate) text: String,
    /// It was written with a capital in a text that has small letters, too.
    pub(crate) capital: bool,
}

/// A sentence as plain words.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct Sentence {
    /// Words; contractions are taken apart ("we're" is "we are"), a possessive keeps its 's.
    pub(crate) words: Vec<Word>,
    /// It ended in a question mark.
    pub(crate) question: bool,
}

/// Splits a text into sentences; nothing if it is longer than [`MAX_TEXT_BYTES`].
pub(crate) fn sentences(text: &str) -> Vec<Sentence> {
    let mut all = split(text);
    for sentence in &mut all {
        sentence.words = fluent(&expand(&sentence.words));
    }
    all
}

/// The words of a name's first sentence: what has 's is an owner there.
pub(crate) fn name_words(text: &str) -> Vec<Word> {
    split(text).into_iter().next().map_or_else(Vec::new, |s| s.words)
}

fn split(text: &str) -> Vec<Sentence> {
    if text.len() > MAX_TEXT_BYTES {
        return Vec::new();
    }
    let mixed = text.chars().any(char::is_lowercase);
    let (chars, upper): (Vec<char>, Vec<bool>) = text
        .chars()
        .flat_map(|c| c.to_lowercase().map(move |low| (plain(low), c.is_uppercase() && mixed)))
        .unzip();
    let mut done = Vec::new();
    let mut now = Sentence::default();
    let mut at = 0;
    while at < chars.len() {
        let c = chars[at];
        let next = chars.get(at + 1).copied();
        // A mark begins no word: what it stands on is missing.
        if c.is_alphanumeric() {
            let end = word_end(&chars, at);
            now.words.push(Word { text: chars[at..end].iter().collect(), capital: upper[at] });
            at = end;
            continue;
        }
        match c {
            '.' if ends_abbreviation(&now) || next.is_some_and(char::is_alphanumeric) => {}
            '?' | '!' | '.' | '…' | ';' | '\n' | '\r' => finish(&mut now, &mut done, c == '?'),
            ',' | ':' | '(' | ')' | '[' | ']' | '–' | '—' => push_comma(&mut now),
            '-' if next.is_none_or(|n| !n.is_alphanumeric()) => push_comma(&mut now),
            '&' => now.words.push(small("and")),
            _ => {}
        }
        at += 1;
    }
    finish(&mut now, &mut done, false);
    done
}

/// Whether a character is one of a word: letters, digits, and the marks that some scripts set on letters.
pub(crate) fn is_of_word(c: char) -> bool {
    let is_mark = matches!(c, '\u{300}'..='\u{36f}' | '\u{591}'..='\u{5c7}' | '\u{610}'..='\u{61a}' | '\u{64b}'..='\u{65f}'
        | '\u{900}'..='\u{903}' | '\u{93a}'..='\u{94f}' | '\u{e31}' | '\u{e34}'..='\u{e3a}' | '\u{e47}'..='\u{e4e}'
        | '\u{200c}' | '\u{200d}');
    c.is_alphanumeric() || is_mark
}

/// One past the last character of the word that begins at `at`: letters or digits, one kind at a
/// time but for ordinals ("2nd"), with apostrophes inside.
fn word_end(chars: &[char], at: usize) -> usize {
    let digits = at + chars[at..].iter().take_while(|c| c.is_ascii_digit()).count();
    if digits > at {
        let letters: String = chars[digits..].iter().take_while(|c| c.is_alphanumeric()).take(3).collect();
        let ordinal = matches!(letters.as_str(), "st" | "nd" | "rd" | "th");
        return if ordinal { digits + 2 } else { digits };
    }
    let mut end = at;
    while let Some(&c) = chars.get(end) {
        let inside = c == '\'' && chars.get(end + 1).is_some_and(|n| n.is_alphabetic());
        if c.is_ascii_digit() || !(is_of_word(c) || inside) {
            break;
        }
        end += 1;
    }
    // A character that is alphanumeric but neither kind still moves on.
    end.max(at + 1)
}

/// Curly quotes and the accents of Western Europe, made plain.
fn plain(c: char) -> char {
    match c {
        '‘' | '’' | 'ʼ' | '`' | '´' => '\'',
        '‐' | '‑' => '-',
        'à' | 'á' | 'â' | 'ã' | 'ä' | 'å' => 'a',
        'è' | 'é' | 'ê' | 'ë' => 'e',
        'ì' | 'í' | 'î' | 'ï' => 'i',
        'ò' | 'ó' | 'ô' | 'õ' | 'ö' => 'o',
        'ù' | 'ú' | 'û' | 'ü' => 'u',
        'ç' => 'c',
        'ñ' => 'n',
        _ => c,
    }
}

fn ends_abbreviation(now: &Sentence) -> bool {
    now.words.last().is_some_and(|w| matches!(w.text.as_str(), "dr" | "mr" | "mrs" | "ms" | "prof" | "st" | "no"))
        // "no." ends a sentence when it is all of it.
        && !(now.words.len() == 1 && now.words[0].text == "no")
}

fn push_comma(now: &mut Sentence) {
    if now.words.last().is_some_and(|w| w.text != COMMA) {
        now.words.push(small(COMMA));
    }
}

fn finish(now: &mut Sentence, done: &mut Vec<Sentence>, question: bool) {
    if now.words.last().is_some_and(|w| w.text == COMMA) {
        now.words.pop();
    }
    if !now.words.is_empty() {
        done.push(Sentence { words: std::mem::take(&mut now.words), question });
    }
}

fn small(text: &str) -> Word {
    Word { text: text.to_owned(), capital: false }
}

/// Takes contractions apart and mends what phones write.
fn expand(words: &[Word]) -> Vec<Word> {
    let mut out: Vec<Word> = Vec::with_capacity(words.len() + 4);
    for (at, word) in words.iter().enumerate() {
        let next = words.get(at + 1).map_or("", |w| w.text.as_str());
        let text = word.text.as_str();
        let stem = |stem: &str| Word { text: stem.to_owned(), capital: word.capital };
        if let Some(apart) = contraction(text) {
            out.extend(apart.split(' ').map(small));
        } else if text == "r" && at > 0 && starts_place_phrase(next) {
            out.push(small("are"));
        } else if text == "its" && (starts_place_phrase(next) || matches!(next, "the" | "a" | "an")) {
            out.extend(["it", "is"].map(small));
        } else if let Some(verb) = text.strip_suffix("n't") {
            out.extend([stem(verb), small("not")]);
        } else if let Some(verb) = text.strip_suffix("'ll") {
            out.extend([stem(verb), small("will")]);
        } else if let Some(noun) = text.strip_suffix("'s").filter(|_| starts_place_phrase(next)) {
            // "the kitchen's down the hall"
            out.extend([stem(noun), small("is")]);
        } else {
            out.push(word.clone());
        }
    }
    out
}

/// After a noun with 's, does this word make it "is" rather than "of"?
/// Words after which a hesitation is only that: "this is, um, the kitchen". After a name it may take the
/// name back ("the kitchen, um, the gym"), which is left to the grammar.
const UNFINISHED: &str = "is are was were the a an in at on to of by this that we you it and here our my your past near behind \
    down through called from with be like just";
/// What one says while one seeks a word.
const HESITATIONS: &str = "um uh er erm uhm hmm eh";
/// Words that speakers repeat while they seek the next.
const REPEATED: &str =
    "the a is are in at on to of we you it this by here and our past near behind down through";

fn among(list: &str, word: &str) -> bool {
    list.split(' ').any(|w| w == word)
}

/// Without hesitations and stutters: "this is, um, the the kitchen" is "this is the kitchen".
fn fluent(words: &[Word]) -> Vec<Word> {
    let mut out: Vec<Word> = Vec::with_capacity(words.len());
    let mut at = 0;
    while let Some(word) = words.get(at) {
        let text = |i: usize| words.get(i).map_or("", |w| w.text.as_str());
        let comma = word.text == COMMA;
        let said = out.last().map_or("", |w| w.text.as_str());
        let hesitates = among(UNFINISHED, said) && among(HESITATIONS, text(at + usize::from(comma)));
        if hesitates {
            at += 1 + usize::from(comma);
            at += usize::from(text(at) == COMMA);
            continue;
        }
        let repeated = text(at + usize::from(comma));
        if repeated == said && among(REPEATED, said) {
            at += 1 + usize::from(comma);
            continue;
        }
        // "This is, this is the kitchen".
        let pair = at + usize::from(comma);
        let twice = matches!(out.as_slice(), [.., a, b] if a.text == text(pair) && b.text == text(pair + 1)
            && among(REPEATED, &b.text) && among("this it we that here there", &a.text));
        if twice {
            at = pair + 2;
            continue;
        }
        out.push(word.clone());
        at += 1;
    }
    out
}

fn starts_place_phrase(word: &str) -> bool {
    const STARTS: &str = "a about above across adjacent after ahead along an around at away behind below beside \
        between beyond by close down downstairs far four in inside just located near next north not on one opposite \
        out outside over past right south straight the three through to two under up upstairs";
    !word.is_empty() && STARTS.split(' ').any(|w| w == word)
}

fn contraction(word: &str) -> Option<&'static str> {
    Some(match word {
        "i'm" | "im" => "i am",
        "we're" => "we are",
        "you're" | "youre" => "you are",
        "they're" => "they are",
        "it's" => "it is",
        "that's" | "thats" => "that is",
        "this's" => "this is",
        "he's" => "he is",
        "she's" => "she is",
        "who's" => "who is",
        "how's" => "how is",
        "here's" | "heres" => "here is",
        "here're" => "here are",
        "there's" | "theres" => "there is",
        "there're" => "there are",
        "where's" | "wheres" => "where is",
        "where're" => "where are",
        "what's" | "whats" => "what is",
        "let's" | "lets" => "let us",
        "we've" => "we have",
        "i've" => "i have",
        "you've" => "you have",
        "i'd" => "i would",
        "we'd" => "we would",
        "you'd" => "you would",
        "can't" | "cannot" | "cant" => "can not",
        "won't" | "wont" => "will not",
        "thru" => "through",
        "ur" => "your",
        "rite" => "right",
        "nxt" => "next",
        "flr" => "floor",
        "rm" => "room",
        "w/" => "with",
        "u" => "you",
        "isnt" | "ain't" => "is not",
        "arent" => "are not",
        "wasnt" => "was not",
        "dont" => "do not",
        "doesnt" => "does not",
        "didnt" => "did not",
        "nearby" => "near here",
        "gonna" => "going to",
        _ => return None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plain_words(text: &str) -> Vec<String> {
        sentences(text)
            .iter()
            .map(|s| {
                s.words.iter().map(|w| w.text.as_str()).collect::<Vec<_>>().join(" ")
                    + if s.question { "?" } else { "" }
            })
            .collect()
    }

    #[test]
    fn sentences_become_plain_words() {
        for (text, expected) in [
            ("And we’re back in the elevator lobby.", vec!["and we are back in the elevator lobby"]),
            ("HERE IS the Café!!  Where's the loo?", vec!["here is the cafe", "where is the loo?"]),
            ("Ok, so - this is it: gym", vec!["ok , so , this is it , gym"]),
            ("room 3.14, 32-G, 2nd floor", vec!["room 3 14 , 32 g , 2nd floor"]),
            ("Dr. Smith's office's down the hall. No.", vec!["dr smith's office is down the hall", "no"]),
            ("isn't; can't", vec!["is not", "can not"]),
            ("the Z-center", vec!["the z center"]),
            ("...!?", vec![]),
        ] {
            assert_eq!(plain_words(text), expected, "{text}");
        }
    }

    #[test]
    fn too_long_a_text_is_not_listened_to() {
        let long = "this is the gym. ".repeat(MAX_TEXT_BYTES / 17 + 1);
        assert!(sentences(&long).is_empty());
    }
}
