//! What tells which kind of act is said next, if any: the words of the text, and of what is left of it.

use crate::language::reader::features::{Feature, Hash, Text, tag, word};
use crate::language::reader::groups::Span;
use crate::language::reader::kind::Kind;
use crate::language::reader::lexicon::{Class, lexicon};

/// What was said up to now.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct History {
    /// Indices of proposals, in the order said.
    pub said: Vec<usize>,
    /// The kind of the last of them.
    pub last: Option<Kind>,
    /// One past the last word of them.
    pub end: usize,
    /// Where the groups of the last one are.
    pub nouns: [Option<Span>; 2],
    /// Its relation.
    pub rel: Option<Span>,
}

impl Text<'_> {
    /// Features for the kind of the next act.
    pub fn next_kind(&self, history: &History) -> Vec<Feature> {
        let Some(last) = history.last else { return self.stretch("", 0) };
        let said = |what: &str| Hash::text(what).num(last as usize).num(history.said.len().min(3));
        let mut out = self.stretch("rest", history.end);
        let nouns = self.groups.nouns.iter().filter(|n| n.pointer.is_none() && n.begins && n.ends);
        let free = nouns.clone().filter(|n| {
            n.span.to <= history.end && history.nouns.iter().flatten().all(|s| !s.overlaps(n.span))
        });
        let (free, left) = (free.count(), nouns.filter(|n| n.span.from >= history.end).count());
        let rels = self.groups.rels.iter().filter(|r| r.longest && r.span.from >= history.end).count();
        out.push(said("last").done());
        out.push(Hash::text("nth").num(history.said.len().min(3)).done());
        out.push(said("free").num(free.min(2)).done());
        out.push(said("left").num(left.min(3)).num(rels.min(3)).done());
        let chunk = |i: usize| {
            let first = self.chunks.iter().position(|c| c.from >= history.end);
            first.and_then(|f| self.chunks.get(f + i)).map_or("$", |c| c.is)
        };
        let mut next = said("next");
        for i in 0..5 {
            next = next.str(chunk(i));
            out.push(next.done());
        }
        // A part of what was said may be said of something else, too: "the gym and the bar are upstairs".
        for t in &self.tokens[..history.end] {
            if matches!(t.class, Class::Conj | Class::Neg) {
                out.push(said("within").str(&t.text).num(free.min(2)).done());
            }
        }
        out
    }

    /// Features of the words from one on, and of their shape.
    fn stretch(&self, what: &str, from: usize) -> Vec<Feature> {
        let new = |kind: &str| Hash::text(kind).str(what);
        let tokens = &self.tokens[from.min(self.tokens.len())..];
        let count = |n: usize| n.min(5);
        let within = |s: Span| s.from >= from;
        let nouns = self.groups.nouns.iter();
        let runs = nouns.filter(|n| n.begins && n.ends && n.pointer.is_none() && within(n.span)).count();
        let rels = self.groups.rels.iter().filter(|r| r.longest && within(r.span));
        let of_class = |class: Class| tokens.iter().filter(|t| t.class == class).count();
        let at = |i: usize| tokens.get(i);
        let mut out = vec![
            new("").done(),
            new("runs").num(count(runs)).done(),
            new("rels").num(count(rels.clone().count())).done(),
            new("both").num(count(runs)).num(count(rels.clone().count())).done(),
            new("len").num(tokens.len().max(1).ilog2() as usize).done(),
            new("stops").num(count(of_class(Class::Stop))).done(),
            new("commas").num(count(of_class(Class::Comma))).done(),
            new("1").str(word(at(0))).done(),
            new("12").str(word(at(0))).str(word(at(1))).done(),
            new("123").str(word(at(0))).str(word(at(1))).str(word(at(2))).done(),
            new("t123").str(tag(at(0))).str(tag(at(1))).str(tag(at(2))).done(),
            new("t1234").str(tag(at(0))).str(tag(at(1))).str(tag(at(2))).str(tag(at(3))).done(),
            new("end").str(word(tokens.last())).done(),
        ];
        for (i, t) in tokens.iter().enumerate() {
            let (before, next, after) = (i.checked_sub(1).and_then(at), at(i + 1), at(i + 2));
            out.push(new("w").str(&t.text).done());
            out.push(new("w2").str(word(Some(t))).str(word(next)).done());
            out.push(new("w3").str(word(Some(t))).str(word(next)).str(word(after)).done());
            out.push(new("t3").str(tag(before)).str(tag(Some(t))).str(tag(next)).done());
            out.push(new("x2").str(&t.text).str(next.map_or("^", |n| &n.text)).done());
            if let Some(sense) = t.sense {
                out.push(new("s").str(sense).done());
            }
            if t.class.names() && lexicon().is_head(&t.text) {
                out.push(new("place").str(tag(before)).str(tag(next)).done());
            }
        }
        let first = self.chunks.iter().position(|c| c.from >= from).unwrap_or(self.chunks.len());
        let chunks = &self.chunks[first..];
        let chunk = |i: usize| chunks.get(i).map_or("$", |c| c.is);
        for n in 0..chunks.len() {
            let mut grams = new("chunks").str(if n == 0 { "^" } else { "" });
            for k in 0..5 {
                grams = grams.str(chunk(n + k));
                if k > 0 {
                    out.push(grams.done());
                }
                if n + k >= chunks.len() {
                    break;
                }
            }
        }
        let pattern = |take: usize| chunks.iter().take(take).fold(new("pattern"), |h, c| h.str(c.is)).done();
        out.extend([pattern(8), pattern(3)]);
        for r in rels {
            out.push(new("rel").str(r.relation.notation()).num(usize::from(r.implied.is_some())).done());
        }
        out.sort_unstable();
        out.dedup();
        out
    }
}
