//! Words put in the place of others before a text is read: a language that is read by way of English, and what the
//! people of a site say. Both are lines of one kind, in files that who speaks so can mend.
//!
//! ```text
//! # what stands behind this sign says nothing
//! refectory|mensa = canteen             words, and what they mean; (x) may be left out, a|b is either
//! den|die|das * entlang = along the *   * is a name of one to five words, read by the same lines
//! -zimmer = room                        the end of a word: "krankenzimmer" is "kranken room"
//! name: Room to Grow; Bertha            names of places, spelled as they are to be shown
//! ```
//!
//! The longest words that stand in a text are taken, from left to right; of lines for the same words the first. What
//! no line knows stays as it is.

use crate::language::act::{Content, Head, Owner, Parse, Phrase};
use crate::language::lexicon::names::{Kind, Name};
use crate::language::lexicon::normalise::is_of_word;
use crate::language::notation::notation;
use crate::language::phrases::each_phrase;
use crate::language::reader::forms::expanded;
use crate::language::reader::lexicon::{Class, lexicon};
use crate::language::understand::parse_query;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Bytes of all lines.
pub const GLOSSARY_BYTES_MAX: usize = 256 << 10;
/// And of one: what it means may stand in a text a thousand times.
const LINE_BYTES_MAX: usize = 1000;
/// Ways to say one thing that a line may stand for, …
const EXPANDED_MAX: usize = 512;
/// … and all lines.
const GLOSSES_MAX: usize = 100_000;
/// Words that `*` stands for at most.
const ANY_MAX: usize = 5;
/// A word is longer than its known end by so many letters.
const STEM_MIN: usize = 2;

/// A line can't be used.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("line {line}: {what}")]
pub struct GlossaryError {
    /// Which, from 1; 0: all of them.
    pub line: usize,
    /// Why.
    pub what: &'static str,
}

/// Some words, and what is put in their place.
#[derive(Clone, Debug)]
struct Gloss {
    said: Vec<String>,
    meant: Vec<String>,
}

/// All lines of one file.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub struct Glossary {
    text: String,
    /// By their first word, longest first.
    glosses: BTreeMap<String, Vec<Gloss>>,
    /// Ends of words, longest first.
    ends: Vec<(String, Vec<String>)>,
    /// Names of places as they are shown.
    names: Vec<(Name, String)>,
    /// Names that may not be read as they are, by what stands for them while a text is read.
    stand_ins: BTreeMap<String, Name>,
}

impl PartialEq for Glossary {
    fn eq(&self, other: &Self) -> bool {
        self.text == other.text
    }
}

impl From<Glossary> for String {
    fn from(glossary: Glossary) -> Self {
        glossary.text
    }
}

impl TryFrom<String> for Glossary {
    type Error = GlossaryError;

    fn try_from(text: String) -> Result<Self, GlossaryError> {
        Self::read(&text)
    }
}

/// A word of a text with what stands before it.
struct Piece<'a> {
    gap: &'a str,
    word: &'a str,
    lower: String,
}

impl Glossary {
    /// From its lines.
    ///
    /// # Errors
    /// If a line is none of those that the module's description shows, or there are too many.
    pub fn read(text: &str) -> Result<Self, GlossaryError> {
        if text.len() > GLOSSARY_BYTES_MAX {
            return Err(GlossaryError { line: 0, what: "more than 256 KiB" });
        }
        let (mut all, mut ways) = (Self { text: text.to_owned(), ..Self::default() }, 0);
        for (k, line) in text.lines().enumerate() {
            let line = line.split('#').next().unwrap_or_default().trim();
            let is_bad = |what| GlossaryError { line: k + 1, what };
            if line.is_empty() {
                continue;
            }
            if line.len() > LINE_BYTES_MAX || ways > GLOSSES_MAX {
                return Err(is_bad(
                    "longer than 1000 bytes, or all lines stand for more than 100 000 ways to say things",
                ));
            }
            if let Some(names) = line.strip_prefix("name:") {
                for name in names.split(';').map(str::trim).filter(|name| !name.is_empty()) {
                    all.name(name).ok_or_else(|| is_bad("that is no name"))?;
                }
                continue;
            }
            let (said, meant) =
                line.split_once('=').ok_or_else(|| is_bad("neither \"name: …\" nor \"words = words\""))?;
            ways += all.gloss(said.trim(), meant.trim()).map_err(is_bad)?;
        }
        for glosses in all.glosses.values_mut() {
            glosses.sort_by_key(|g| std::cmp::Reverse(g.said.len()));
        }
        all.ends.sort_by_key(|(end, _)| std::cmp::Reverse(end.len()));
        Ok(all)
    }

    /// The lines that it was read from.
    pub fn text(&self) -> &str {
        &self.text
    }

    fn name(&mut self, shown: &str) -> Option<()> {
        let name = Name::new(shown)?;
        self.names.push((name.clone(), shown.to_owned()));
        if name.kind() == Kind::Place && parse_query(shown).as_ref() == Some(&name) {
            return Some(());
        }
        let stand_in = stand_in(self.stand_ins.len());
        let said: Vec<String> = pieces(shown).0.into_iter().map(|p| p.lower).collect();
        let first = said.first()?.clone();
        let meant = vec![stand_in.clone(), "room".to_owned()];
        self.glosses.entry(first).or_default().push(Gloss { said, meant });
        self.stand_ins.insert(stand_in, name);
        Some(())
    }

    /// Takes a line in; tells how many ways to say it there are.
    fn gloss(&mut self, said: &str, meant: &str) -> Result<usize, &'static str> {
        let words = |text: &str| text.split_whitespace().map(str::to_lowercase).collect::<Vec<_>>();
        let meant = words(meant);
        if let Some(end) = said.strip_prefix('-') {
            if end.is_empty() || !end.chars().all(is_of_word) || meant.contains(&"*".to_owned()) {
                return Err("an end of a word is letters");
            }
            self.ends.push((end.to_lowercase(), meant));
            return Ok(1);
        }
        let choices = |word: &str| word.split('|').count() + usize::from(word.starts_with('('));
        if said
            .split_whitespace()
            .map(choices)
            .try_fold(1, |n: usize, c| n.checked_mul(c))
            .is_none_or(|n| n > EXPANDED_MAX)
        {
            return Err("it stands for more than 512 ways to say it");
        }
        if said.split_whitespace().any(|w| w.starts_with('(') != w.ends_with(')')) {
            return Err("what may be left out is one word");
        }
        let all = expanded(&words(said).join(" "));
        let ways = all.len();
        for mut said in all {
            said.retain(|word| !word.is_empty());
            let stars = |words: &[String]| words.iter().filter(|w| *w == "*").count();
            match said.first() {
                None => return Err("no words stand before the ="),
                Some(first) if first == "*" => return Err("it begins with *"),
                _ if stars(&said) > 1 || stars(&meant) > stars(&said) => return Err("a * too many"),
                Some(first) => {
                    let meant = meant.clone();
                    self.glosses.entry(first.clone()).or_default().push(Gloss { said, meant });
                }
            }
        }
        Ok(ways)
    }

    /// A text with other words in the place of those that it knows.
    pub fn english(&self, text: &str) -> String {
        if self.glosses.is_empty() && self.ends.is_empty() {
            return text.to_owned();
        }
        let (pieces, rest) = pieces(text);
        let mut out = String::with_capacity(text.len());
        self.render(&pieces, true, &mut out);
        out + rest
    }

    /// `opens`: may hold words that `*` stands for.
    fn render(&self, pieces: &[Piece<'_>], opens: bool, out: &mut String) {
        let mut at = 0;
        while at < pieces.len() {
            let here = &pieces[at..];
            out.push_str(here[0].gap);
            if let Some((gloss, any, taken)) = self.longest(here, opens) {
                for (k, word) in gloss.meant.iter().enumerate() {
                    let spaced = k > 0 && !out.ends_with(' ');
                    out.push_str(if spaced { " " } else { "" });
                    if word == "*" {
                        let mut inner = String::new();
                        self.render(&here[any.0..any.1], false, &mut inner);
                        out.push_str(inner.trim());
                    } else {
                        out.push_str(word);
                    }
                }
                at += taken;
                continue;
            }
            let known = |(end, _): &&(String, Vec<String>)| {
                here[0].lower.strip_suffix(end.as_str()).is_some_and(|stem| stem.chars().count() >= STEM_MIN)
            };
            if let Some((end, meant)) = self.ends.iter().find(known) {
                let stem = &here[0].lower[..here[0].lower.len() - end.len()];
                out.extend([stem, " ", &meant.join(" ")]);
            } else {
                out.push_str(here[0].word);
            }
            at += 1;
        }
    }

    /// The gloss that takes most of the next words: it, the words that its `*` stands for, and how many it takes.
    fn longest(&self, here: &[Piece<'_>], opens: bool) -> Option<(&Gloss, (usize, usize), usize)> {
        let glosses = self.glosses.get(&here[0].lower)?.iter();
        let may_name = |word: &str, is_first: bool| opens && self.may_name(word, is_first);
        let fits = glosses.filter_map(|g| fit(&g.said, here, &may_name).map(|(any, taken)| (g, any, taken)));
        // Of those that take as many the one that says more of them, then the first.
        let mut best: Option<(&Gloss, (usize, usize), usize)> = None;
        for found in fits {
            if best.as_ref().is_none_or(|b| (found.2, found.0.said.len()) > (b.2, b.0.said.len())) {
                best = Some(found);
            }
        }
        best
    }

    /// Whether a word may be one of a name; an article or whose it is may come first.
    fn may_name(&self, word: &str, is_first: bool) -> bool {
        let own = self.glosses.get(word).and_then(|all| all.iter().find(|g| g.said.len() == 1));
        let meant = own.map_or(Some(word), |g| g.meant.first().map(String::as_str));
        let class = meant.map(|word| lexicon().class(word));
        class.is_none_or(|c| c.names() || is_first && matches!(c, Class::Det | Class::Poss))
    }

    /// How a name is spelled here.
    pub fn spelled(&self, name: &Name) -> Option<&str> {
        self.names
            .iter()
            .find(|(n, shown)| n == name && shown != name.as_str())
            .map(|(_, shown)| shown.as_str())
    }

    /// All names of this site's places.
    pub fn names(&self) -> impl Iterator<Item = &Name> {
        self.names.iter().map(|(name, _)| name)
    }

    /// Puts names in the place of what stood for them while the text was read.
    pub(super) fn restore(&self, parse: &mut Parse) {
        if self.stand_ins.is_empty() {
            return;
        }
        for reading in &mut parse.analyses {
            for act in &mut reading.acts {
                each_phrase(&mut act.content, &mut |phrase| self.restore_phrase(phrase));
                self.restore_told(&mut act.content);
            }
            reading.notation = notation(&reading.acts);
        }
    }

    fn restore_phrase(&self, phrase: &mut Phrase) {
        let Some(name) = phrase.full_name().and_then(|name| self.restored(&name)) else { return };
        if matches!(phrase.features.owner, Some(Owner::Named(_))) {
            phrase.features.owner = None;
        }
        phrase.features.name = None;
        phrase.features.qualities.clear();
        phrase.head = Head::Named(name);
    }

    /// In what is kept as it was told: ways, and what something is like.
    fn restore_told(&self, content: &mut Content) {
        let told = match content {
            Content::Route { steps, .. } => steps.as_mut_slice(),
            Content::Attribute { value, .. } => std::slice::from_mut(value),
            _ => return,
        };
        for text in told {
            for (stand_in, name) in &self.stand_ins {
                if !text.contains(stand_in) {
                    continue;
                }
                let written = name.as_str().replace(' ', "_");
                for room in ["_room", " room", ""] {
                    *text = text.replace(&format!("{stand_in}{room}"), &written);
                }
            }
        }
    }

    /// The name that one with a stand-in in it stands for.
    pub(super) fn restored(&self, name: &Name) -> Option<Name> {
        let words: Vec<&str> = name.as_str().split(' ').collect();
        let at = words.iter().position(|w| self.stand_ins.contains_key(*w))?;
        let meant = &self.stand_ins[words[at]];
        let behind = at + 1 + usize::from(words.get(at + 1) == Some(&"room"));
        let all = [&words[..at], &[meant.as_str()], words.get(behind..).unwrap_or_default()].concat();
        Name::new(&all.join(" ")).or_else(|| Some(meant.clone()))
    }
}

/// A word that nobody says.
fn stand_in(k: usize) -> String {
    const LETTERS: &[u8; 16] = b"bdfgjklmnprstvwz";
    let letters = [k / 256 % 16, k / 16 % 16, k % 16].map(|d| char::from(LETTERS[d]));
    let more = "q".repeat(k / 4096);
    format!("xq{more}{}", letters.iter().collect::<String>())
}

/// Words with what stands before each, and what stands behind all.
fn pieces(text: &str) -> (Vec<Piece<'_>>, &str) {
    let inside = |c: char| is_of_word(c) || matches!(c, '\'' | '’' | '&');
    let mut all = Vec::new();
    let mut rest = text;
    while let Some(from) = rest.find(is_of_word) {
        let word = &rest[from..];
        let to = word.find(|c| !inside(c)).unwrap_or(word.len());
        let word = word[..to].trim_end_matches(|c| !is_of_word(c));
        all.push(Piece { gap: &rest[..from], word, lower: word.to_lowercase().replace('’', "'") });
        rest = &rest[from + word.len()..];
    }
    (all, rest)
}

/// Whether some words begin so: the words that `*` stands for, the fewest that do, and how many are taken. `may_name`:
/// whether a word may be of a name, or be its first.
fn fit(
    said: &[String],
    here: &[Piece<'_>],
    may_name: &dyn Fn(&str, bool) -> bool,
) -> Option<((usize, usize), usize)> {
    let joined = |k: usize| {
        // "Im 1. Stock."
        let counts = |piece: &Piece<'_>| piece.lower.bytes().all(|b| b.is_ascii_digit());
        k == 0
            || here[k].gap.chars().all(|c| c.is_whitespace() || matches!(c, '-' | '&' | '/'))
            || here[k].gap == ". " && counts(&here[k - 1])
    };
    let same = |said: &[String], from: usize| {
        from + said.len() <= here.len()
            && said.iter().enumerate().all(|(k, w)| here[from + k].lower == *w && joined(from + k))
    };
    let Some(star) = said.iter().position(|w| w == "*") else {
        return same(said, 0).then_some(((0, 0), said.len()));
    };
    if !same(&said[..star], 0) {
        return None;
    }
    let behind = &said[star + 1..];
    let named =
        |to: usize| to <= here.len() && joined(to - 1) && may_name(&here[to - 1].lower, to == star + 1);
    let ends = (star + 1..=star + ANY_MAX).take_while(|&to| named(to));
    // What nothing follows takes all that it may.
    let to = if behind.is_empty() { ends.last() } else { ends.into_iter().find(|&to| same(behind, to)) }?;
    Some(((star, to), to + behind.len()))
}

#[cfg(test)]
mod tests;
