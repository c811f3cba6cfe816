//! Features are hashes of what stands where in a text: `of_kinds.rs` has those that tell what a stretch says,
//! `of_groups.rs` those that tell which groups say it.

use crate::language::reader::chunks::{Chunk, chunks};
use crate::language::reader::groups::Groups;
use crate::language::reader::kind::Kind;
use crate::language::reader::lexicon::Class;
use crate::language::reader::tokens::Token;

/// A feature, of [`FEATURE_BITS`] bits: few of those that are learned share one.
pub type Feature = u32;

/// Bits of a feature.
pub const FEATURE_BITS: u32 = 26;

/// FNV-1a over parts.
#[derive(Clone, Copy)]
pub(super) struct Hash(u64);

impl Hash {
    pub(super) fn new(kind: Kind, what: &str) -> Self {
        Self::text(what).num(kind.group() as usize)
    }

    pub(super) fn text(what: &str) -> Self {
        Self(0xcbf2_9ce4_8422_2325).str(what)
    }

    pub(super) fn byte(self, b: u8) -> Self {
        Self((self.0 ^ u64::from(b)).wrapping_mul(0x0100_0000_01b3))
    }

    pub(super) fn str(self, s: &str) -> Self {
        s.bytes().fold(self, Self::byte).byte(0)
    }

    pub(super) fn num(self, n: usize) -> Self {
        self.byte(n as u8).byte(1)
    }

    pub(super) fn done(self) -> Feature {
        (self.0 ^ (self.0 >> 32)) as u32 >> (32 - FEATURE_BITS)
    }
}

/// A word of a closed class as it is, others by their sense or class.
pub(super) fn tag(token: Option<&Token>) -> &str {
    match token {
        None => "^",
        Some(t) if t.class.is_closed() => &t.text,
        Some(t) => t.sense.unwrap_or(t.class.tag()),
    }
}

/// As [`tag`], but verbs by themselves, too.
pub(super) fn word(token: Option<&Token>) -> &str {
    match token {
        None => "^",
        Some(t) if t.class == Class::Open => "n",
        Some(t) => &t.text,
    }
}

/// A text, as its features see it.
pub struct Text<'a> {
    pub(super) tokens: &'a [Token],
    pub(super) groups: &'a Groups,
    /// Named groups that are as long as they can be.
    pub(super) runs: usize,
    /// The text as names, relations and what else is said.
    pub(super) chunks: Vec<Chunk<'a>>,
}

impl<'a> Text<'a> {
    /// Of a text's words and groups.
    pub fn new(tokens: &'a [Token], groups: &'a Groups) -> Self {
        let runs = groups.nouns.iter().filter(|n| n.begins && n.ends && n.pointer.is_none()).count();
        Self { tokens, groups, runs, chunks: chunks(tokens, groups) }
    }

    pub(super) fn at(&self, i: usize, off: isize) -> Option<&Token> {
        i.checked_add_signed(off).and_then(|k| self.tokens.get(k))
    }
}
