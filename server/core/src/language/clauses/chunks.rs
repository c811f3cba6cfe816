//! Tokens of a route text with their spans, and the word classes that `clauses` reads them by.

use std::ops::Range;

/// A word or a mark, lower case, with its span in characters of the text.
#[derive(Clone, Debug)]
pub(crate) struct Token {
    pub(crate) text: String,
    pub(crate) span: Range<usize>,
}

impl Token {
    pub(crate) fn ends_sentence(&self) -> bool {
        matches!(self.text.as_str(), "." | ";" | "!" | "?")
    }

    /// Does a phrase end before it?
    pub(crate) fn is_break(&self) -> bool {
        matches!(self.text.as_str(), "," | ":" | "-" | "--") || self.ends_sentence()
    }

    /// Change of the depth of brackets.
    pub(crate) fn depth(&self) -> i32 {
        match self.text.as_str() {
            "(" => 1,
            ")" => -1,
            _ => 0,
        }
    }
}

/// Words and marks of a text.
pub(crate) fn tokens(text: &str) -> Vec<Token> {
    let chars: Vec<char> = text.chars().collect();
    let mut out = Vec::new();
    let mut at = 0;
    while at < chars.len() {
        let c = chars[at];
        let inside = |i: usize| {
            chars.get(i).is_some_and(|c| c.is_alphanumeric())
                || (matches!(chars.get(i), Some('\'' | '’' | '-' | '/' | '.'))
                    && chars.get(i + 1).is_some_and(|c| c.is_alphanumeric())
                    && i > at)
        };
        let mut end = at;
        while inside(end) {
            end += 1;
        }
        if end == at && (c.is_whitespace() || matches!(c, '"' | '“' | '”')) {
            at += 1;
            continue;
        }
        end = end.max(at + 1);
        push(&chars, at..end, &mut out);
        at = end;
    }
    out
}

/// Pronouns and their verbs are two words: "you're".
fn push(chars: &[char], span: Range<usize>, out: &mut Vec<Token>) {
    let text: String = chars[span.clone()]
        .iter()
        .flat_map(|c| c.to_lowercase())
        .map(|c| if c == '’' { '\'' } else { c })
        .collect();
    for stem in ["you", "it", "that", "we", "there", "i"] {
        let rest = text.strip_prefix(stem).filter(|rest| rest.starts_with('\''));
        if let Some(rest) = rest {
            let middle = span.start + stem.len();
            out.push(Token { text: stem.to_owned(), span: span.start..middle });
            out.push(Token { text: rest.to_owned(), span: middle..span.end });
            return;
        }
    }
    out.push(Token { text, span });
}

/// Is it one of the words of a list separated by `|`?
pub(crate) fn is_one_of(word: &str, list: &str) -> bool {
    list.split('|').any(|w| w == word)
}

/// How many tokens the first of these phrases takes that stands at the front.
pub(crate) fn eats(tokens: &[Token], phrases: &str) -> Option<usize> {
    phrases.split('|').find_map(|phrase| {
        let words = phrase.split(' ').count();
        let here = tokens.len() >= words && phrase.split(' ').zip(tokens).all(|(w, t)| t.text == w);
        here.then_some(words)
    })
}

/// Relations that need no landmark.
pub(crate) fn relation_alone(word: &str) -> bool {
    is_one_of(word, "on|to|in|straight|at|behind")
}

/// Verbs of directions.
pub(crate) const MOTION: &str = "go|walk|continue|turn|take|make|follow|exit|enter|pass|head|proceed|travel|face|start|stop|\
    leave|cross|stand|keep|look|orient|bear|veer|round|move|hang|open|going|walking|turning|facing|passing|continuing|\
    heading|taking|making|entering|exiting|leaving|starting|following|rounding|crossing|notice|find|looking|stay|get|\
    come|coming|step|pull|push|return|begin|beginning|ignore|locate|goes|traverse|reach";
/// Words between clauses.
pub(crate) const CONNECTIVES: &str =
    ",|and|then|or|but|so|also|:|-|--|(|)|finally|next|now|once|that|which|where|as|if|please";
/// Verbs that say where a figure is.
pub(crate) const COPULAS: &str = "is|are|was|will|should|'s|'re|'ll|can|be";
/// Words no landmark begins with.
pub(crate) const STARTS_CLAUSE: &str = "until|till|when|then|and|or|straight|immediately";
/// Relations; what begins another comes after it.
pub(crate) const RELATIONS: &str = "with your back to|with back to|all the way through|all the way down|all the way to|\
    all the way until|all the way till|when you reach|when you get to|when you come to|when you see|when you encounter|\
    when you are at|once you reach|once you get to|once you pass|on your left hand side|on your right hand side|\
    on the left hand side of|on the right hand side of|on the left hand side|on the right hand side|on the left side of|\
    on the right side of|on the left of|on the right of|to the left of|to the right of|to your left|to your right|\
    to right of|to left of|on your left|on your right|on the left|on the right|to the left|to the right|on left|\
    on right|to your back|at your back|in front of|in between|out into|out of|out to|out through|out|on through|away from|\
    across from|across|around to|around|through to|through|thru|down to|down|past|passed|into|inside|towards|toward|until|till|\
    before|after|onto|along|near|next to|opposite|parallel to|ahead of|straight ahead|behind|beyond|beside|by|between|via|under|outside|\
    up|from|over|on|at|in|to";
/// Verbs of what "you" do at a place.
pub(crate) const SEEING: &str = "see|reach|reached|get|come|enter|encounter|find|hit|pass|leave|are|'re|'ll|will|should|can|be|arrive|\
    exit|approach|facing|have|seeing|notice|must|want|need";
