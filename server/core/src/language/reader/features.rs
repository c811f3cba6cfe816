//! What tells whether a proposal is said: hashes of words around its groups and of the whole text.

use crate::language::act::Content;
use crate::language::reader::chunks::{Chunk, chunks};
use crate::language::reader::groups::{Groups, Noun, Span};
use crate::language::reader::kind::Kind;
use crate::language::reader::lexicon::{Class, lexicon};
use crate::language::reader::propose::Proposal;
use crate::language::reader::tokens::Token;

/// A feature.
pub type Feature = u32;

/// So many features of a whole text, the first, are of its shape.
const SHAPE: usize = 13;

/// FNV-1a over parts.
#[derive(Clone, Copy)]
struct Hash(u64);

impl Hash {
    fn new(kind: Kind, what: &str) -> Self {
        Self::text(what).num(kind.group() as usize)
    }

    fn text(what: &str) -> Self {
        Self(0xcbf2_9ce4_8422_2325).str(what)
    }

    fn byte(self, b: u8) -> Self {
        Self((self.0 ^ u64::from(b)).wrapping_mul(0x0100_0000_01b3))
    }

    fn str(self, s: &str) -> Self {
        s.bytes().fold(self, Self::byte).byte(0)
    }

    fn num(self, n: usize) -> Self {
        self.byte(n as u8).byte(1)
    }

    fn done(self) -> Feature {
        (self.0 ^ (self.0 >> 32)) as u32
    }
}

/// Each kind once.
pub fn distinct(kinds: &[Kind]) -> impl Iterator<Item = Kind> {
    kinds.iter().enumerate().filter(|(i, kind)| !kinds[..*i].contains(kind)).map(|(_, kind)| *kind)
}

/// A word of a closed class as it is, others by their class.
fn tag(token: Option<&Token>) -> &str {
    match token {
        None => "^",
        Some(t) if t.class.is_closed() => &t.text,
        Some(t) => t.class.tag(),
    }
}

/// As [`tag`], but verbs by themselves, too.
fn word(token: Option<&Token>) -> &str {
    match token {
        None => "^",
        Some(t) if t.class == Class::Open => "n",
        Some(t) => &t.text,
    }
}

/// All features of a text that its proposals share.
pub struct Text<'a> {
    tokens: &'a [Token],
    groups: &'a Groups,
    /// Named groups that are as long as they can be.
    runs: usize,
    longest: usize,
    /// The text as names, relations and what else is said.
    chunks: Vec<Chunk<'a>>,
}

impl<'a> Text<'a> {
    /// Of a text's words and groups.
    pub fn new(tokens: &'a [Token], groups: &'a Groups) -> Self {
        let runs = groups.nouns.iter().filter(|n| n.begins && n.ends && n.pointer.is_none()).count();
        let longest = groups.rels.iter().filter(|r| r.longest).count();
        Self { tokens, groups, runs, longest, chunks: chunks(tokens, groups) }
    }

    fn at(&self, i: usize, off: isize) -> Option<&Token> {
        i.checked_add_signed(off).and_then(|k| self.tokens.get(k))
    }

    /// Features of the whole text: what people say in such.
    pub fn whole(&self) -> Vec<Feature> {
        let new = |what: &str| Hash::text(what);
        let tokens = self.tokens;
        let count = |n: usize| n.min(5);
        let mut out = vec![
            new("").done(),
            new("runs").num(count(self.runs)).done(),
            new("rels").num(count(self.longest)).done(),
            new("both").num(count(self.runs)).num(count(self.longest)).done(),
            new("len").num(tokens.len().max(1).ilog2() as usize).done(),
        ];
        let stops = tokens.iter().filter(|t| t.class == Class::Stop).count();
        let commas = tokens.iter().filter(|t| t.class == Class::Comma).count();
        out.push(new("stops").num(count(stops)).done());
        out.push(new("commas").num(count(commas)).done());
        let at = |i: usize| tokens.get(i);
        out.push(new("1").str(word(at(0))).done());
        out.push(new("12").str(word(at(0))).str(word(at(1))).done());
        out.push(new("123").str(word(at(0))).str(word(at(1))).str(word(at(2))).done());
        out.push(new("t123").str(tag(at(0))).str(tag(at(1))).str(tag(at(2))).done());
        out.push(new("t1234").str(tag(at(0))).str(tag(at(1))).str(tag(at(2))).str(tag(at(3))).done());
        out.push(new("end").str(word(tokens.last())).done());
        let shape = std::mem::take(&mut out);
        for (i, t) in tokens.iter().enumerate() {
            let (before, next, after) = (i.checked_sub(1).and_then(at), at(i + 1), at(i + 2));
            out.push(new("w").str(&t.text).done());
            out.push(new("w2").str(word(Some(t))).str(word(next)).done());
            out.push(new("w3").str(word(Some(t))).str(word(next)).str(word(after)).done());
            out.push(new("t3").str(tag(before)).str(tag(Some(t))).str(tag(next)).done());
            out.push(new("x2").str(&t.text).str(next.map_or("^", |n| &n.text)).done());
            if t.class.names() && lexicon().is_head(&t.text) {
                out.push(new("place").str(tag(before)).str(tag(next)).done());
            }
        }
        let chunk = |i: usize| self.chunks.get(i).map_or("$", |c| c.is);
        for n in 0..self.chunks.len() {
            let first = if n == 0 { "^" } else { "" };
            let mut grams = new("chunks").str(first);
            for k in 0..5 {
                grams = grams.str(chunk(n + k));
                if k > 0 {
                    out.push(grams.done());
                }
                if n + k >= self.chunks.len() {
                    break;
                }
            }
        }
        let pattern =
            |take: usize| self.chunks.iter().take(take).fold(new("pattern"), |h, c| h.str(c.is)).done();
        out.push(pattern(8));
        out.push(pattern(3));
        for r in self.groups.rels.iter().filter(|r| r.longest) {
            out.push(new("rel").str(r.relation.notation()).num(usize::from(r.implied.is_some())).done());
        }
        out.sort_unstable();
        out.dedup();
        shape.into_iter().chain(out).collect()
    }

    /// Features of one proposal among those of its kind.
    pub fn features(&self, p: &Proposal, out: &mut Vec<Feature>) {
        out.clear();
        let tokens = self.tokens;
        let new = |what: &str| Hash::new(p.kind, what);
        let spans: Vec<Span> = [p.noun, p.other]
            .iter()
            .flatten()
            .map(|&n| self.groups.nouns[n].span)
            .chain(p.rel.map(|r| self.groups.rels[r].span))
            .collect();
        if let (Some(from), Some(to)) = (spans.iter().map(|s| s.from).min(), spans.iter().map(|s| s.to).max())
        {
            self.around(p.kind, from, to, out);
        }
        if let Some(n) = p.noun {
            self.noun(p.kind, "a", &self.groups.nouns[n], out);
        }
        if let Some(n) = p.other {
            self.noun(p.kind, "b", &self.groups.nouns[n], out);
        }
        if let Some(r) = p.rel {
            let rel = &self.groups.rels[r];
            out.push(new("rel").str(rel.relation.notation()).num(usize::from(rel.longest)).done());
            out.push(
                new("relword")
                    .str(&tokens[rel.span.from].text)
                    .num(usize::from(rel.longest))
                    .num(usize::from(rel.implied.is_some()))
                    .done(),
            );
            out.push(new("relprev").str(word(self.at(rel.span.from, -1))).done());
            out.push(
                new("relprev2")
                    .str(word(self.at(rel.span.from, -2)))
                    .str(word(self.at(rel.span.from, -1)))
                    .done(),
            );
        }
        if let (Some(n), Some(target)) = (p.noun, p.takes.last().copied()) {
            let a = self.groups.nouns[n].span;
            let target =
                if p.kind == Kind::Alias { self.groups.nouns[p.other.unwrap_or(n)].span } else { target };
            if !a.overlaps(target) {
                self.between(p, a, target, out);
            }
        }
        if let Content::Generic { quantity, .. } = &p.content {
            for t in tokens.iter().filter(|t| t.class != Class::Open) {
                out.push(new("often").num(*quantity as usize).str(&t.text).done());
            }
            out.push(new("often").num(*quantity as usize).done());
        }
        // All of them for the kind itself, too.
        let all = out.len();
        for i in 0..all {
            out.push(Self::of(out[i], 1000 + p.kind as usize));
        }
    }

    /// A feature for one of several outcomes.
    pub fn of(feature: Feature, outcome: usize) -> Feature {
        Hash(u64::from(feature) ^ 0x9e37_79b9_7f4a_7c15).num(outcome).byte((outcome >> 8) as u8).done()
    }

    /// Features of the whole text for kinds of acts together: for each kind, for how many they are, and of its shape
    /// for all of them, which are the nth that go together.
    pub fn of_kinds(whole: &[Feature], kinds: &[Kind], nth: usize) -> Vec<Feature> {
        let mut out = Vec::with_capacity(whole.len() * (kinds.len() + 2));
        for kind in distinct(kinds) {
            out.extend(Self::of_kind(whole, kind));
        }
        out.extend(Self::of_count(whole, kinds.len()));
        out.extend(Self::of_shape(whole, nth));
        out
    }

    /// Those for one kind.
    pub fn of_kind(whole: &[Feature], kind: Kind) -> impl Iterator<Item = Feature> {
        whole.iter().map(move |&f| Self::of(f, 2000 + kind as usize))
    }

    /// Those for so many acts.
    pub fn of_count(whole: &[Feature], count: usize) -> impl Iterator<Item = Feature> {
        whole.iter().map(move |&f| Self::of(f, 3000 + count))
    }

    /// Those for all kinds together.
    pub fn of_shape(whole: &[Feature], nth: usize) -> impl Iterator<Item = Feature> {
        whole.iter().take(SHAPE).map(move |&f| Self::of(f, nth))
    }

    /// What lies around all of it: three words to either side, and its clause.
    fn around(&self, kind: Kind, from: usize, to: usize, out: &mut Vec<Feature>) {
        let new = |what: &str| Hash::new(kind, what);
        let left = |k: isize| word(self.at(from, -k));
        let right = |k: isize| word(self.at(to, k));
        out.push(new("l1").str(left(1)).done());
        out.push(new("l2").str(left(2)).str(left(1)).done());
        out.push(new("l3").str(left(3)).str(left(2)).str(left(1)).done());
        out.push(new("r1").str(right(0)).done());
        out.push(new("r2").str(right(0)).str(right(1)).done());
        out.push(new("r3").str(right(0)).str(right(1)).str(right(2)).done());
        out.push(new("lr").str(left(1)).str(right(0)).done());
        let before = self.chunks.iter().rposition(|c| c.to <= from);
        let after = self.chunks.iter().position(|c| c.from >= to);
        let back = |k: usize| before.and_then(|b| b.checked_sub(k)).map_or("^", |b| self.chunks[b].is);
        let on = |k: usize| after.and_then(|a| self.chunks.get(a + k)).map_or("$", |c| c.is);
        out.push(new("kl1").str(back(0)).done());
        out.push(new("kl2").str(back(1)).str(back(0)).done());
        out.push(new("kl3").str(back(2)).str(back(1)).str(back(0)).done());
        out.push(new("kl4").str(back(3)).str(back(2)).str(back(1)).str(back(0)).done());
        out.push(new("kr1").str(on(0)).done());
        out.push(new("kr2").str(on(0)).str(on(1)).done());
        out.push(new("kr3").str(on(0)).str(on(1)).str(on(2)).done());
        out.push(new("klr").str(back(0)).str(on(0)).done());
        out.push(new("klr2").str(back(1)).str(back(0)).str(on(0)).done());
        out.push(new("klr3").str(back(1)).str(back(0)).str(on(0)).str(on(1)).done());
        let breaks =
            |t: &Token| matches!(t.class, Class::Stop | Class::Question | Class::Comma | Class::Conj);
        let begin = self.tokens[..from].iter().rposition(breaks).map_or(0, |b| b + 1);
        let end = self.tokens[to.min(self.tokens.len())..]
            .iter()
            .position(breaks)
            .map_or(self.tokens.len(), |e| to + e);
        for t in &self.tokens[begin..from] {
            out.push(new("cl").str(&t.text).done());
        }
        for t in &self.tokens[to.min(end)..end] {
            out.push(new("cr").str(&t.text).done());
        }
        out.push(new("cb").str(word(self.tokens.get(begin))).str(word(self.tokens.get(begin + 1))).done());
        out.push(new("rest").num((from - begin).min(6)).num((end - to.min(end)).min(6)).done());
        let before = self.tokens[..begin].iter().filter(|t| t.class.names()).count();
        out.push(new("before").num(before.min(3)).num(usize::from(end == self.tokens.len())).done());
    }

    fn noun(&self, kind: Kind, role: &str, noun: &Noun, out: &mut Vec<Feature>) {
        let new = |what: &str| Hash::new(kind, what).str(role);
        let Span { from, to } = noun.span;
        let head = &self.tokens[noun.head];
        if noun.pointer.is_some() {
            out.push(new("pointer").str(&head.text).str(word(self.at(to, 0))).done());
            out.push(new("pointer1").str(&head.text).done());
            return;
        }
        let shape = usize::from(noun.begins)
            + 2 * usize::from(noun.ends)
            + 4 * usize::from(noun.is_place)
            + 8 * usize::from(noun.has_verb);
        out.push(new("shape").num(shape).done());
        out.push(new("shapelen").num(shape).num((to - from).min(5)).done());
        out.push(new("head").str(&head.text).done());
        out.push(new("headclass").str(head.class.tag()).num(usize::from(noun.ends)).done());
        out.push(new("firstclass").str(self.tokens[from].class.tag()).num(usize::from(noun.begins)).done());
        out.push(
            new("capital").num(usize::from(self.tokens[from].capital)).num(usize::from(from == 0)).done(),
        );
        let (l1, l2) = (word(self.at(from, -1)), word(self.at(from, -2)));
        let (r1, r2) = (word(self.at(to, 0)), word(self.at(to, 1)));
        out.push(new("nl1").str(l1).done());
        out.push(new("nl2").str(l2).str(l1).done());
        out.push(new("nl3").str(word(self.at(from, -3))).str(l2).str(l1).done());
        out.push(new("nr1").str(r1).num(usize::from(noun.is_place)).done());
        out.push(new("nr2").str(r1).str(r2).done());
        out.push(new("lastnext").str(tag(self.at(to, -1))).str(r1).done());
        // The words of the run that the name leaves out.
        if !noun.begins {
            out.push(new("out1").str(l1).done());
        }
        if !noun.ends {
            out.push(new("out2").str(r1).str(self.tokens[to - 1].class.tag()).done());
        }
    }

    /// From the figure to the relation, or from one name to the other.
    fn between(&self, p: &Proposal, a: Span, b: Span, out: &mut Vec<Feature>) {
        let new = |what: &str| Hash::new(p.kind, what);
        let (order, from, to) = if a.to <= b.from { (0, a.to, b.from) } else { (1, b.to, a.from) };
        let gap = to - from;
        out.push(new("order").num(order).num(gap.min(8)).done());
        let words = &self.tokens[from..to];
        if gap <= 6 {
            let all = |by: fn(Option<&Token>) -> &str| {
                words.iter().fold(new("btw").num(order), |h, t| h.str(by(Some(t)))).done()
            };
            out.push(all(tag));
            out.push(all(word));
        }
        for t in words {
            out.push(new("bw").num(order).str(word(Some(t))).done());
        }
        let within: Vec<&str> =
            self.chunks.iter().filter(|c| c.from >= from && c.to <= to).map(|c| c.is).collect();
        if within.len() <= 7 {
            out.push(within.iter().fold(new("kb").num(order), |h, c| h.str(c)).done());
        }
        out.push(
            new("kb2").num(order).str(within.first().unwrap_or(&"")).str(within.last().unwrap_or(&"")).done(),
        );
        out.push(new("kbn").num(order).num(within.len().min(8)).done());
        let nouns = self
            .groups
            .nouns
            .iter()
            .filter(|n| n.pointer.is_none() && n.begins && n.ends && n.span.from >= from && n.span.to <= to)
            .count();
        out.push(new("bn").num(order).num(nouns.min(3)).done());
        let pointer = p.noun.and_then(|n| self.groups.nouns[n].pointer).is_some();
        out.push(
            new("bnp").num(order).num(nouns.min(3)).num(usize::from(pointer)).num(self.runs.min(4)).done(),
        );
    }
}
