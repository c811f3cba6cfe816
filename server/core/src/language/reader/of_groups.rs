//! What tells which groups say what a stretch says: the words in, around and between them.

use crate::language::act::{Content, Head};
use crate::language::reader::features::{Feature, Hash, Text, tag, word};
use crate::language::reader::groups::{Noun, Rel, Span};
use crate::language::reader::kind::{KINDS, Kind};
use crate::language::reader::lexicon::Class;
use crate::language::reader::of_kinds::History;
use crate::language::reader::propose::Proposal;
use crate::language::reader::tokens::Token;

/// A feature for one kind of those that share it.
fn own(feature: Feature, kind: Kind) -> Feature {
    Hash::text("")
        .num(kind as usize)
        .num(feature as usize)
        .num(feature as usize >> 8)
        .num(feature as usize >> 16)
        .num(feature as usize >> 24)
        .done()
}

/// What a phrase points at, in a word.
fn head_word(head: &Head) -> &'static str {
    match head {
        Head::Here => "here",
        Head::There => "there",
        Head::Previous => "before",
        Head::Path => "path",
        Head::Agent => "agent",
        Head::Speaker => "speaker",
        Head::It => "it",
        Head::Start => "start",
        Head::Place => "place",
        Head::Unknown => "x",
        Head::Named(_) | Head::Any | Head::Visited => "",
    }
}

impl Text<'_> {
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
        if let (_, Some(head)) = p.beside_groups() {
            let points = new("points").str(head_word(head)).num(usize::from(p.rel.is_some()));
            out.push(points.done());
            for t in tokens.iter().filter(|t| matches!(t.class, Class::Point | Class::Pron)) {
                out.push(points.str(&t.text).done());
            }
            out.push(points.str("").str(word(tokens.first())).str(word(tokens.get(1))).done());
        }
        if let Content::Generic { quantity, .. } = &p.content {
            for t in tokens.iter().filter(|t| t.class != Class::Open) {
                out.push(new("often").num(*quantity as usize).str(&t.text).done());
            }
            out.push(new("often").num(*quantity as usize).done());
        }
        out.sort_unstable();
        out.dedup();
        // All of them for the kind itself, too.
        for i in 0..out.len() {
            out.push(own(out[i], p.kind));
        }
    }

    /// Features of a proposal for being said after others, or first.
    pub fn next_groups(&self, p: &Proposal, history: &History) -> [Feature; 6] {
        let noun = p.noun.map(|n| self.groups.nouns[n].span);
        let other = p.other.map(|n| self.groups.nouns[n].span);
        let rel = p.rel.map(|r| self.groups.rels[r].span);
        // Where a group is: behind all that was said, a group of the last act, before, or nowhere.
        let place = |span: Option<Span>| match span {
            None => 0,
            Some(s) if s.from >= history.end => 1,
            Some(s) if history.rel == Some(s) || history.nouns[1] == Some(s) => 2,
            Some(s) if history.nouns[0] == Some(s) => 3,
            Some(_) => 4,
        };
        let last = history.last.map_or(KINDS, |k| k as usize);
        let new = |what: &str| Hash::new(p.kind, what);
        let all = new("after").num(place(noun)).num(place(other)).num(place(rel));
        // Names that are passed over.
        let first = [noun, rel].into_iter().flatten().map(|s| s.from).min().unwrap_or(history.end);
        let named = |n: &&Noun| {
            n.pointer.is_none() && n.begins && n.ends && n.span.from >= history.end && n.span.to <= first
        };
        let passed = self.groups.nouns.iter().filter(named).count().min(3);
        let rels = |r: &&Rel| r.longest && r.span.from >= history.end && r.span.to <= first;
        let passed_rels = self.groups.rels.iter().filter(rels).count().min(3);
        let skips = new("passed").num(passed).num(passed_rels).num(usize::from(history.last.is_some()));
        [
            all.done(),
            all.num(last).done(),
            skips.done(),
            own(all.done(), p.kind),
            own(skips.done(), p.kind),
            skips.num(place(noun)).done(),
        ]
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
            + 8 * usize::from(noun.has_verb)
            + 16 * noun.made as usize;
        out.push(new("shape").num(shape).done());
        out.push(new("shapelen").num(shape).num((to - from).min(5)).done());
        out.push(new("head").str(&head.text).done());
        out.push(new("headsense").str(head.sense.unwrap_or("")).num(usize::from(noun.begins)).done());
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
