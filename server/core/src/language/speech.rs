//! How a sentence is read that may be in another language, or with a site's own words: by what its words mean in English.

use crate::language::act::{Analysis, Parse};
use crate::language::glossary::Glossary;
use crate::language::lexicon::names::Name;
use crate::language::reply::{self, Reply};
use crate::language::{ellipsis, spelling, understand};
use std::sync::{Arc, LazyLock};

/// A language that is read by way of English.
struct Language {
    /// The first part of its BCP 47 tag.
    tag: &'static str,
    name: &'static str,
    words: Glossary,
}

/// All of them: a folder of the lexicon each.
static LANGUAGES: LazyLock<Vec<Language>> = LazyLock::new(|| {
    let folders = [("de", "German", include_str!("../../lexicon/german/glossary.txt"))];
    let read = |(tag, name, lines)| Language { tag, name, words: Glossary::read(lines).unwrap_or_default() };
    folders.map(read).into()
});

/// In what a sentence is said; by default in English without any words of the site's own.
#[derive(Clone, Default)]
pub struct Speech {
    language: Option<&'static Glossary>,
    site: Arc<Glossary>,
}

impl Speech {
    /// Of a language, by its tag (BCP 47; none is English), and with a site's words. None if nobody here knows it.
    pub fn new(tag: Option<&str>, site: Arc<Glossary>) -> Option<Self> {
        let first = tag.unwrap_or("en").split('-').next().unwrap_or_default().to_lowercase();
        let language = match first.as_str() {
            "en" | "und" | "" => None,
            other => Some(&LANGUAGES.iter().find(|l| l.tag == other)?.words),
        };
        Some(Self { language, site })
    }

    /// Whether sentences in a language can be read.
    pub fn knows(tag: Option<&str>) -> bool {
        Self::new(tag, Arc::default()).is_some()
    }

    /// The languages that can be read: "English or German".
    pub fn known() -> String {
        let others = LANGUAGES.iter().map(|l| l.name);
        std::iter::once("English").chain(others).collect::<Vec<_>>().join(" or ")
    }

    /// What a text says, in English as far as its words are known. Nouns have a capital in some languages: there it
    /// tells nothing, and goes.
    pub(super) fn english(&self, text: &str) -> String {
        let text = self.site.english(text);
        match self.language {
            Some(words) => words.english(&text.to_lowercase()),
            None => text,
        }
    }

    fn restored(&self, mut parse: Parse) -> Parse {
        self.site.restore(&mut parse);
        parse
    }

    /// What a text says, see [`understand::parse`].
    pub fn parse(&self, text: &str) -> Parse {
        self.restored(understand::parse(&self.english(text)))
    }

    /// What is said, over all hearings of a recogniser, see [`understand::parse_hearings`].
    pub fn parse_hearings(&self, text: &str, alternatives: &[(String, f64)]) -> Parse {
        let others: Vec<(String, f64)> =
            alternatives.iter().map(|(text, p)| (self.english(text), *p)).collect();
        self.restored(understand::parse_hearings(&self.english(text), &others))
    }

    /// What a text may say of which nothing is likely enough to be heard.
    pub fn guess(&self, text: &str) -> Option<Analysis> {
        let guess = understand::guess(&self.english(text))?;
        self.restored(Parse { analyses: vec![guess] }).analyses.pop()
    }

    /// The name that is asked for.
    pub fn parse_query(&self, text: &str) -> Option<Name> {
        let name = understand::parse_query(&self.english(text))?;
        Some(self.site.restored(&name).unwrap_or(name))
    }

    /// What a text replies.
    pub fn reply(&self, text: &str) -> Option<Reply> {
        reply::reply(&self.english(text))
    }

    /// What a text says that leaves out what was said before.
    pub fn as_before(&self, text: &str, said: &Parse) -> Option<Parse> {
        ellipsis::as_before(&self.english(text), said).map(|parse| self.restored(parse))
    }

    /// How a name is spelled: as the site has it, else as it stands in a text.
    pub fn spelling(&self, text: &str, name: &Name) -> Option<String> {
        let read = |words: &str| {
            let name = Name::new(&self.english(words))?;
            Some(self.site.restored(&name).unwrap_or(name))
        };
        let spelled = || spelling::spelling(text, name, self.language.is_some(), read);
        self.site.spelled(name).map(str::to_owned).or_else(spelled)
    }
}
