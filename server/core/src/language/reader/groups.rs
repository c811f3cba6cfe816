//! Groups of words: what may be a name, what may relate, what points.

use crate::language::act::{Features, Head, Ordinal, Owner, Phrase};
use crate::language::lexicon::names::Name;
use crate::language::lexicon::numbers::counted;
use crate::language::reader::lexicon::{Class, Implied, Pointer, lexicon};
use crate::language::reader::made;
use crate::language::reader::tokens::Token;
use crate::language::relation::Relation;

/// Words `from..to`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Span {
    /// The first word.
    pub from: usize,
    /// One past the last.
    pub to: usize,
}

impl Span {
    /// Words between them; none if they share one.
    pub fn gap(self, other: Self) -> Option<usize> {
        self.from.checked_sub(other.to).or_else(|| other.from.checked_sub(self.to))
    }

    /// Whether they share a word.
    pub fn overlaps(self, other: Self) -> bool {
        self.from < other.to && other.from < self.to
    }
}

/// Something named, by all words that may belong to the name, or something pointed at.
#[derive(Clone, Debug)]
// Each is a question that the judge's features ask.
#[allow(clippy::struct_excessive_bools)]
pub struct Noun {
    /// Its words, articles left out.
    pub span: Span,
    /// The last word of its head.
    pub head: usize,
    /// What it points at, if it has no name.
    pub pointer: Option<Pointer>,
    /// What it says.
    pub phrase: Phrase,
    /// Its head names places by itself.
    pub is_place: bool,
    /// It begins where its run of words does …
    pub begins: bool,
    /// … and ends there.
    pub ends: bool,
    /// A word of it may be a verb.
    pub has_verb: bool,
    /// A floor, by number.
    pub is_floor: bool,
    /// How it was made of its words.
    pub made: Made,
}

/// How a name was made of words.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Made {
    /// As said.
    Said,
    /// Of words that sound like it.
    Heard,
    /// Of what was named before: "mine", "the big one".
    Meant,
    /// Of what is done there: "where we eat".
    Told,
}

/// Words that relate.
#[derive(Clone, Debug)]
pub struct Rel {
    /// Its words.
    pub span: Span,
    /// How.
    pub relation: Relation,
    /// The landmark that is meant, if none needs to be named.
    pub implied: Option<Implied>,
    /// No longer relation begins before and ends behind it.
    pub longest: bool,
}

/// All groups of a text.
#[derive(Clone, Debug, Default)]
pub struct Groups {
    /// Names and pointers.
    pub nouns: Vec<Noun>,
    /// Relations.
    pub rels: Vec<Rel>,
}

/// A name has no more words.
pub(super) const NAME_MAX: usize = 7;
/// All parts of shorter runs of words may be names.
const RUN_SHORT: usize = 5;

/// Finds them.
pub fn groups(tokens: &[Token]) -> Groups {
    Groups { nouns: nouns(tokens), rels: rels(tokens) }
}

fn nouns(tokens: &[Token]) -> Vec<Noun> {
    let mut all = Vec::new();
    let names = |i: usize| tokens.get(i).is_some_and(|t| t.class.names());
    let mut at = 0;
    while at < tokens.len() {
        if let Some(pointer) = pointed(&tokens[at]) {
            all.push(Noun {
                span: Span { from: at, to: at + 1 },
                head: at,
                pointer: Some(pointer),
                phrase: Phrase::new(pointer.head()),
                is_place: false,
                begins: true,
                ends: true,
                has_verb: false,
                is_floor: false,
                made: Made::Said,
            });
        }
        if !names(at) || at > 0 && names(at - 1) {
            at += 1;
            continue;
        }
        let mut end = at;
        while names(end) {
            end += 1;
        }
        of_run(tokens, Span { from: at, to: end }, &mut all);
        at = end;
    }
    made::heard(tokens, &mut all);
    made::meant(tokens, &mut all);
    made::told(tokens, &mut all);
    all
}

/// Names within one run of words that may be in names, with what "of" and "'s" add.
fn of_run(tokens: &[Token], run: Span, all: &mut Vec<Noun>) {
    let verb = |i: usize| tokens[i].class == Class::Verb;
    let short = run.to - run.from <= RUN_SHORT;
    let mut starts: Vec<usize> = vec![run.from];
    starts.extend((run.from + 1..run.to).filter(|&i| {
        let before = tokens[i - 1].class;
        short
            || lexicon().is_head(&tokens[i - 1].text)
            || matches!(
                before,
                Class::Verb | Class::Ord | Class::Num | Class::Quality | Class::Person | Class::Time
            )
    }));
    let mut ends: Vec<usize> = vec![run.to];
    ends.extend((run.from + 1..run.to).filter(|&i| {
        verb(i)
            || short
            || lexicon().is_head(&tokens[i - 1].text)
            || matches!(tokens[i].class, Class::Num | Class::Ord | Class::Quality)
    }));
    for &from in &starts {
        for &to in ends.iter().filter(|&&to| to > from && to - from <= NAME_MAX) {
            let span = Span { from, to };
            push(tokens, run, span, to - 1, all);
            if to != run.to {
                continue;
            }
            // "Department of physics", "students' lounge": words that join two runs.
            let join = tokens.get(to).map_or("", |t| t.text.as_str());
            if !matches!(join, "of" | "'s" | "and") {
                continue;
            }
            let skip = usize::from(
                join == "of"
                    && tokens.get(to + 1).is_some_and(|t| matches!(t.class, Class::Det | Class::Poss)),
            );
            let next = to + 1 + skip;
            let mut end = next;
            while tokens.get(end).is_some_and(|t| t.class.names()) && end - from <= NAME_MAX {
                end += 1;
                let is_end = tokens.get(end).is_none_or(|t| !t.class.names())
                    || lexicon().is_head(&tokens[end - 1].text)
                    || tokens[end].class == Class::Verb;
                if is_end && (end - from) <= NAME_MAX {
                    let head = if join == "of" { to - 1 } else { end - 1 };
                    push(tokens, Span { from: run.from, to: end }, Span { from, to: end }, head, all);
                }
            }
        }
    }
}

fn push(tokens: &[Token], run: Span, span: Span, head: usize, all: &mut Vec<Noun>) {
    let words = &tokens[span.from..span.to];
    // A name ends in a noun or a number.
    let last = &tokens[head];
    if matches!(last.class, Class::Quality | Class::Ord) && words.len() == 1 && last.class != Class::Quality {
        return;
    }
    let Some(phrase) = phrase(tokens, span, head) else { return };
    let mut core = head;
    while core > span.from && (tokens[core].class == Class::Num || tokens[core].text.len() == 1) {
        core -= 1;
    }
    let is_floor =
        matches!(tokens[core].text.as_str(), "floor" | "level" | "storey" | "floors" | "levels" | "deck");
    all.push(Noun {
        span,
        head,
        pointer: None,
        phrase,
        is_place: lexicon().is_head(&tokens[core].text),
        begins: span.from == run.from,
        ends: span.to == run.to,
        has_verb: words.iter().any(|t| t.class == Class::Verb),
        is_floor,
        made: Made::Said,
    });
}

/// What words point at.
fn pointed(token: &Token) -> Option<Pointer> {
    Some(match token.text.as_str() {
        "here" | "this" | "we" | "us" => Pointer::Here,
        "there" => Pointer::There,
        "you" => Pointer::Agent,
        "me" | "i" => Pointer::Speaker,
        "it" | "they" | "that" | "them" | "one" | "those" | "these" => Pointer::It,
        _ => return None,
    })
}

/// The phrase of a name's words.
fn phrase(tokens: &[Token], span: Span, head: usize) -> Option<Phrase> {
    let mut from = span.from;
    let mut features = Features::default();
    while from < head {
        match ordinal(&tokens[from].text) {
            Some(nth) => features.ordinal = Some(nth),
            None if tokens[from].text == "other" => features.other = true,
            None => break,
        }
        from += 1;
    }
    let before = span.from.checked_sub(1).map(|b| &tokens[b]);
    if before.is_some_and(|t| t.class == Class::Point) {
        features.this = true;
    }
    if before.is_some_and(|t| t.text == "my") {
        features.owner = Some(Owner::Speaker);
    }
    // "The laboratory of chemistry" is a chemistry laboratory, if it is no title.
    let mut to = span.to;
    if tokens.get(head + 1).is_some_and(|t| t.text == "of") && head + 1 < to && !tokens[to - 1].capital {
        let of = tokens[head + 2..to].iter().filter(|t| t.class.names()).map(|t| t.text.as_str());
        features.qualities.push(of.collect::<Vec<_>>().join(" "));
        to = head + 1;
    }
    let mut text = String::new();
    for token in &tokens[from..to] {
        if token.text == "'s" {
            text.push_str("'s");
            continue;
        }
        if !text.is_empty() {
            text.push(' ');
        }
        text.push_str(&token.text.replace("_and_", " and "));
    }
    // A floor is told by its number.
    let is_floor = from + 2 == span.to && matches!(tokens[from].text.as_str(), "floor" | "level");
    if let Some(n) = counted(&tokens[span.to - 1].text).filter(|_| is_floor) {
        features.ordinal = Some(Ordinal::Nth(n));
        text = "floor".into();
    }
    let name = Name::new(&text)?;
    Some(Phrase { head: Head::Named(name), features, within: Vec::new() })
}

/// A place in a row.
pub fn ordinal(word: &str) -> Option<Ordinal> {
    const NTH: [&str; 12] = [
        "first", "second", "third", "fourth", "fifth", "sixth", "seventh", "eighth", "ninth", "tenth",
        "eleventh", "twelfth",
    ];
    match word {
        "last" | "final" => Some(Ordinal::Last),
        "next" => Some(Ordinal::Next),
        _ => {
            let digits =
                ["st", "nd", "rd", "th"].iter().find_map(|end| word.strip_suffix(end)).unwrap_or(word);
            let nth = NTH.iter().position(|n| *n == word).map(|n| n as u32 + 1);
            nth.or_else(|| if digits.len() < word.len() { digits.parse().ok() } else { None })
                .map(Ordinal::Nth)
        }
    }
}

fn rels(tokens: &[Token]) -> Vec<Rel> {
    let mut all: Vec<Rel> = Vec::new();
    for at in 0..tokens.len() {
        let fits = |words: &[String]| {
            words.iter().enumerate().all(|(k, w)| tokens.get(at + k).is_some_and(|t| t.text == *w))
        };
        let mut longest_span = 0;
        for said in lexicon().relations(&tokens[at].text) {
            if !fits(&said.words) {
                continue;
            }
            let span = Span { from: at, to: at + said.words.len() };
            let within = all.iter().any(|r| r.span.from < at && r.span.to >= span.to && r.longest);
            if all.iter().any(|r| r.span == span && r.relation == said.relation && r.implied == said.implied)
            {
                continue;
            }
            all.push(Rel {
                span,
                relation: said.relation,
                implied: said.implied,
                longest: span.to >= longest_span && !within,
            });
            longest_span = longest_span.max(span.to);
        }
    }
    all
}
