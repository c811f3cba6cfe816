//! Words as data: what `server/core/lexicon` says of them.

use crate::language::act::Head;
use crate::language::lexicon::is_adverb;
use crate::language::reader::forms::{expanded, inflected};
use crate::language::reader::sound::sound;
use crate::language::relation::Relation;
use std::collections::{BTreeMap, HashMap, HashSet};
use std::sync::LazyLock;

const CLASSES: &str = include_str!("../../../lexicon/english/classes.txt");
const RELATIONS: &str = include_str!("../../../lexicon/english/relations.txt");
const HEADS: &str = include_str!("../../../lexicon/english/heads.txt");
const PLACES: &str = include_str!("../../../lexicon/english/places.txt");
const MISHEARD: &str = include_str!("../../../lexicon/english/misheard.txt");
const SENSES: &str = include_str!("../../../lexicon/english/senses.txt");
const CONTRACTIONS: &str = include_str!("../../../lexicon/english/contractions.txt");

/// What a word is, whatever stands beside it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Class {
    /// "Is", "are".
    Be,
    /// "'s".
    Owner,
    /// "Has".
    Have,
    /// "Does".
    Do,
    /// "Will", "should".
    Modal,
    /// "Not".
    Neg,
    /// "Where".
    Wh,
    /// "And".
    Conj,
    /// "The".
    Det,
    /// "This".
    Point,
    /// "My".
    Poss,
    /// "They".
    Pron,
    /// "By".
    Prep,
    /// "Now".
    Adv,
    /// "Two".
    Num,
    /// "Second".
    Ord,
    /// "Nurse".
    Person,
    /// "Minute".
    Time,
    /// "Big".
    Quality,
    /// "Keep".
    Verb,
    /// A pause.
    Comma,
    /// The end of a sentence.
    Stop,
    /// The end of a question.
    Question,
    /// Not in the lexicon, but for nouns of places.
    Open,
}

impl Class {
    /// A short name, as features have it.
    pub fn tag(self) -> &'static str {
        match self {
            Self::Be => "be",
            Self::Owner => "'s",
            Self::Have => "have",
            Self::Do => "do",
            Self::Modal => "modal",
            Self::Neg => "neg",
            Self::Wh => "wh",
            Self::Conj => "conj",
            Self::Det => "det",
            Self::Point => "point",
            Self::Poss => "poss",
            Self::Pron => "pron",
            Self::Prep => "prep",
            Self::Adv => "adv",
            Self::Num => "num",
            Self::Ord => "ord",
            Self::Person => "person",
            Self::Time => "time",
            Self::Quality => "qual",
            Self::Verb => "verb",
            Self::Comma => ",",
            Self::Stop => ".",
            Self::Question => "?",
            Self::Open => "n",
        }
    }

    /// Is it a number?
    pub fn is_number(self) -> bool {
        self == Self::Num
    }

    /// May stand within a name.
    pub fn names(self) -> bool {
        matches!(
            self,
            Self::Open | Self::Num | Self::Ord | Self::Person | Self::Time | Self::Quality | Self::Verb
        )
    }

    /// Its word itself tells, rather than its class.
    pub fn is_closed(self) -> bool {
        !matches!(self, Self::Open | Self::Num | Self::Person | Self::Verb | Self::Quality)
    }
}

/// What a relation's words say.
#[derive(Clone, Debug)]
pub struct Said {
    /// In lower case.
    pub words: Vec<String>,
    /// The relation.
    pub relation: Relation,
    /// The landmark that is meant, if none needs to be named.
    pub implied: Option<Implied>,
}

/// A landmark that needs no name.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Implied {
    /// Something pointed at.
    Pointer(Pointer),
    /// A corner.
    Corner,
}

/// A head that is no name.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Pointer {
    /// The place held.
    Here,
    /// Where the speaker points.
    There,
    /// Who is spoken to.
    Agent,
    /// Who speaks.
    Speaker,
    /// The way that one is going.
    Path,
    /// What was spoken of.
    It,
}

impl Pointer {
    /// As a phrase has it.
    pub fn head(self) -> Head {
        match self {
            Self::Here => Head::Here,
            Self::There => Head::There,
            Self::Agent => Head::Agent,
            Self::Speaker => Head::Speaker,
            Self::Path => Head::Path,
            Self::It => Head::It,
        }
    }
}

/// Words as they are heard, and as they were said.
type Misheard = (Vec<&'static str>, Vec<&'static str>);

/// All that is known of words.
#[derive(Debug)]
pub struct Lexicon {
    classes: HashMap<String, Class>,
    /// By their first word, longest first.
    relations: BTreeMap<String, Vec<Said>>,
    heads: HashSet<&'static str>,
    senses: HashMap<String, &'static str>,
    /// Words that stand in names of places, and by how they sound.
    of_places: HashSet<&'static str>,
    sounds: HashMap<String, &'static str>,
    contractions: HashMap<&'static str, &'static str>,
    /// By the first word of what is heard, longest first: what is heard, and what was said.
    misheard: BTreeMap<&'static str, Vec<Misheard>>,
}

/// The lexicon, read once.
pub fn lexicon() -> &'static Lexicon {
    static LEXICON: LazyLock<Lexicon> = LazyLock::new(Lexicon::read);
    &LEXICON
}

/// Lines that say something: their two sides of a sign.
fn entries(text: &'static str, sign: char) -> impl Iterator<Item = (&'static str, &'static str)> {
    let lines = text.lines().filter(|l| !l.starts_with('#'));
    lines.filter_map(move |l| l.split_once(sign)).map(|(a, b)| (a.trim(), b.trim()))
}

impl Lexicon {
    fn read() -> Self {
        let mut classes = HashMap::new();
        for (name, words) in entries(CLASSES, ':') {
            let (class, is_stem) = match name {
                "be" => (Class::Be, false),
                "have" => (Class::Have, false),
                "do" => (Class::Do, false),
                "modal" => (Class::Modal, false),
                "neg" => (Class::Neg, false),
                "wh" => (Class::Wh, false),
                "conj" => (Class::Conj, false),
                "det" => (Class::Det, false),
                "point" => (Class::Point, false),
                "poss" => (Class::Poss, false),
                "pron" => (Class::Pron, false),
                "prep" => (Class::Prep, false),
                "adv" => (Class::Adv, false),
                "num" => (Class::Num, false),
                "ord" => (Class::Ord, false),
                "person" => (Class::Person, false),
                "time" => (Class::Time, false),
                "quality" => (Class::Quality, false),
                "verb" => (Class::Verb, true),
                _ => (Class::Verb, false),
            };
            for word in words.split(' ').filter(|w| !w.is_empty()) {
                let all = if is_stem { inflected(word) } else { vec![word.to_owned()] };
                for form in all {
                    classes.entry(form).or_insert(class);
                }
            }
        }
        for (sign, class) in
            [("'s", Class::Owner), (",", Class::Comma), (".", Class::Stop), ("?", Class::Question)]
        {
            classes.insert(sign.to_owned(), class);
        }
        let mut relations: BTreeMap<String, Vec<Said>> = BTreeMap::new();
        for (pattern, said) in entries(RELATIONS, '=') {
            let mut words = said.split(' ');
            let name = words.next().unwrap_or_default();
            let Some(&relation) = Relation::ALL.iter().find(|r| r.notation() == name) else { continue };
            let implied = words.next().and_then(|w| {
                Some(Implied::Pointer(match w {
                    "here" => Pointer::Here,
                    "there" => Pointer::There,
                    "agent" => Pointer::Agent,
                    "speaker" => Pointer::Speaker,
                    "path" => Pointer::Path,
                    _ => return Some(Implied::Corner),
                }))
            });
            for words in expanded(pattern) {
                let Some(first) = words.first().cloned() else { continue };
                relations.entry(first).or_default().push(Said { words, relation, implied });
            }
        }
        for said in relations.values_mut() {
            said.sort_by_key(|s| std::cmp::Reverse(s.words.len()));
        }
        let heads = HEADS.lines().filter(|l| !l.starts_with('#')).flat_map(|l| l.split(' ')).collect();
        let heads: HashSet<&str> = heads;
        let named = PLACES.lines().filter(|l| !l.starts_with('#')).flat_map(|l| l.split([' ', ';']));
        let of_places: HashSet<&str> = heads.iter().copied().chain(named).filter(|w| w.len() > 2).collect();
        let mut of_sounds: Vec<&str> = of_places.iter().copied().collect();
        // The longest of those that sound alike, then the first.
        of_sounds.sort_by_key(|w| (std::cmp::Reverse(w.len()), *w));
        let mut sounds: HashMap<String, &str> = HashMap::new();
        for word in of_sounds {
            sounds.entry(sound(word)).or_insert(word);
        }
        let mut misheard: BTreeMap<&str, Vec<Misheard>> = BTreeMap::new();
        for (heard, said) in entries(MISHEARD, '=') {
            let [heard, said] = [heard, said].map(|words| words.split(' ').collect::<Vec<_>>());
            misheard.entry(heard[0]).or_default().push((heard, said));
        }
        for all in misheard.values_mut() {
            all.sort_by_key(|(heard, _)| std::cmp::Reverse(heard.len()));
        }
        let mut senses = HashMap::new();
        for (sense, words) in entries(SENSES, ':') {
            // Verbs' senses are named by a stroke at the end.
            let is_stem = sense.ends_with('-');
            for word in words.split(' ').filter(|w| !w.is_empty()) {
                let all = if is_stem { inflected(word) } else { vec![word.to_owned(), format!("{word}s")] };
                for form in all {
                    senses.entry(form).or_insert(sense);
                }
            }
        }
        Self {
            classes,
            relations,
            heads,
            senses,
            of_places,
            sounds,
            contractions: entries(CONTRACTIONS, '=').collect(),
            misheard,
        }
    }

    /// What a word is.
    pub fn class(&self, word: &str) -> Class {
        if let Some(&class) = self.classes.get(word) {
            return class;
        }
        match word.bytes().next() {
            Some(b) if b.is_ascii_digit() => Class::Num,
            _ if is_adverb(word) => Class::Adv,
            _ => Class::Open,
        }
    }

    /// Whether a noun names places by itself.
    pub fn is_head(&self, word: &str) -> bool {
        self.heads.contains(word) || crate::language::lexicon::is_place(word)
    }

    /// What words of its sense are called.
    pub fn sense(&self, word: &str) -> Option<&'static str> {
        self.senses.get(word).copied()
    }

    /// Whether a word stands in names of places.
    pub fn is_of_places(&self, word: &str) -> bool {
        self.of_places.contains(word) || self.is_head(word)
    }

    /// A word of names of places that sounds so.
    pub fn sounding(&self, sound: &str) -> Option<&'static str> {
        self.sounds.get(sound).copied()
    }

    /// What a word is short for.
    pub fn contraction(&self, word: &str) -> Option<&'static str> {
        self.contractions.get(word).copied()
    }

    /// What was said where a recogniser heard these words first: how many of them, and for what.
    pub fn misheard(&self, words: &[(String, bool)]) -> Option<(usize, &[&'static str])> {
        let all = self.misheard.get(words.first()?.0.as_str())?;
        let fits =
            |heard: &[&str]| heard.len() <= words.len() && heard.iter().zip(words).all(|(h, (w, _))| h == w);
        all.iter().find(|(heard, _)| fits(heard)).map(|(heard, said)| (heard.len(), said.as_slice()))
    }

    /// All relations, in a fixed order.
    pub fn all_relations(&self) -> Vec<&Said> {
        let mut all: Vec<&Said> = self.relations.values().flatten().collect();
        all.sort_by_key(|s| (&s.words, s.relation, s.implied.is_some()));
        all
    }

    /// Relations that may begin with a word, longest first.
    pub fn relations(&self, first: &str) -> &[Said] {
        self.relations.get(first).map_or(&[], Vec::as_slice)
    }
}
