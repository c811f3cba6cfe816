//! Everything that a text's groups may say: acts, for the judge to weigh.

use crate::language::act::{
    About, Content, Head, Locate, Modifiers, Ordinal, Owner, Phrase, Quantity, Question, Sameness,
};
use crate::language::lexicon::names::Name;
use crate::language::lexicon::numbers::counted;
use crate::language::notation::phrase_notation;
use crate::language::reader::groups::{Groups, Made, Noun, Rel, Span, ordinal};
use crate::language::reader::kind::Kind;
use crate::language::reader::lexicon::{Class, Implied, Pointer};
use crate::language::reader::made::purpose;
use crate::language::reader::tokens::Token;
use crate::language::relation::Relation;

/// An act that may be said, and the groups that it is made of.
#[derive(Clone, Debug)]
pub struct Proposal {
    /// Its kind.
    pub kind: Kind,
    /// What would be said.
    pub content: Content,
    /// The name, or the figure.
    pub noun: Option<usize>,
    /// The landmark, or the other name.
    pub other: Option<usize>,
    /// The relation.
    pub rel: Option<usize>,
    /// Words that no other act may have.
    pub takes: Vec<Span>,
}

impl Proposal {
    /// What it says beside its groups: how often it holds of kinds, and what it points at.
    pub fn beside_groups(&self) -> (Option<Quantity>, Option<&Head>) {
        fn at(phrase: &Phrase) -> Option<&Head> {
            Some(&phrase.head).filter(|head| !matches!(head, Head::Named(_)))
        }
        fn of(content: &Content) -> (Option<Quantity>, Option<&Head>) {
            match content {
                Content::Generic { quantity, .. } => (Some(*quantity), None),
                Content::Locate(locate) => (None, locate.landmarks.first().and_then(at)),
                Content::Label { at: place, .. } => (None, at(place)),
                Content::Ask { about: About::Phrase(phrase), .. } => (None, at(phrase)),
                Content::Ask { about: About::Content(content), .. }
                | Content::Negate(content)
                | Content::Correct { is: content, .. }
                | Content::Route { then: Some(content), .. } => of(content),
                _ => (None, None),
            }
        }
        of(&self.content)
    }
}

/// A figure is at most so many words from its relation.
const FAR: usize = 14;
/// A text that may say more is not read, for its time: of two hundred sentences that people say one has more.
pub const PROPOSALS_MAX: usize = 8000;

/// All of them, or some more than [`PROPOSALS_MAX`].
pub fn propose(tokens: &[Token], groups: &Groups) -> Vec<Proposal> {
    let mut all = Vec::new();
    let way = steps(tokens, groups);
    let named = |n: &Noun| n.pointer.is_none();
    for (i, noun) in groups.nouns.iter().enumerate().filter(|(_, n)| named(n)) {
        of_name(tokens, i, noun, &way, &mut all);
    }
    for (i, a) in groups.nouns.iter().enumerate() {
        if all.len() > PROPOSALS_MAX {
            return all;
        }
        for (k, b) in groups.nouns.iter().enumerate().filter(|(_, b)| named(b)) {
            if i == k || a.pointer.is_some_and(|p| p != Pointer::It) {
                continue;
            }
            if b.span.from < a.span.from || a.span.gap(b.span).is_none_or(|gap| gap > FAR) {
                continue;
            }
            all.push(Proposal {
                kind: Kind::Alias,
                content: Content::Alias { what: a.phrase.clone(), also: b.phrase.clone() },
                noun: Some(i),
                other: Some(k),
                rel: None,
                takes: vec![a.span, b.span],
            });
        }
    }
    for (r, rel) in groups.rels.iter().enumerate() {
        for spot in spots(tokens, groups, r, rel) {
            if all.len() > PROPOSALS_MAX {
                return all;
            }
            located(groups, &spot, &way, &mut all);
        }
    }
    for (n, noun) in groups.nouns.iter().enumerate() {
        let relation = match () {
            () if is_floor(tokens, noun) => Relation::OnLevel,
            () if is_told_by(tokens, noun) => Relation::At,
            () => continue,
        };
        if all.len() > PROPOSALS_MAX {
            return all;
        }
        let landmarks = vec![noun.phrase.clone()];
        let spot = Spot { relation, rel: None, noun: Some(n), landmarks, takes: noun.span };
        located(groups, &spot, &way, &mut all);
    }
    owned(tokens, groups, &mut all);
    let whole = vec![Span { from: 0, to: tokens.len() }];
    let bare =
        |kind, content| Proposal { kind, content, noun: None, other: None, rel: None, takes: whole.clone() };
    let start = Content::Same { what: Phrase::new(Head::Here), like: Phrase::new(Head::Start), same: true };
    all.push(bare(Kind::Start, start));
    let used =
        Content::Label { at: Phrase::new(Head::Here), what: purpose(tokens), sameness: Sameness::Open };
    all.push(bare(Kind::Use, used));
    let ask = |kind, head| Content::Ask { kind, about: About::Phrase(Phrase::new(head)) };
    all.push(bare(Kind::What, ask(Question::What, Head::Unknown)));
    all.push(bare(Kind::WhatHere, ask(Question::What, Head::Here)));
    all.push(bare(Kind::What, ask(Question::What, Head::Previous)));
    all.push(bare(Kind::Route, ask(Question::Route, Head::Start)));
    all.push(bare(Kind::Way, Content::Route { steps: way, then: None }));
    all
}

fn locate(figure: Phrase, relation: Relation, landmarks: Vec<Phrase>) -> Content {
    let modifiers = Modifiers::default();
    Content::Locate(Locate { figure, relation, modifiers, landmarks, frame: None, repaired: false })
}

fn whether(content: Content) -> Content {
    Content::Ask { kind: Question::Whether, about: About::Content(Box::new(content)) }
}

fn of_name(tokens: &[Token], i: usize, noun: &Noun, way: &[String], all: &mut Vec<Proposal>) {
    let here = || Phrase::new(Head::Here);
    let label = |at: Phrase| Content::Label { at, what: noun.phrase.clone(), sameness: Sameness::Open };
    let same = |same| Content::Same { what: here(), like: noun.phrase.clone(), same };
    let ask = |kind| Content::Ask { kind, about: About::Phrase(noun.phrase.clone()) };
    let mend = |is| Content::Correct { was: None, is: Box::new(is) };
    let mut add = |kind, content| {
        all.push(Proposal { kind, content, noun: Some(i), other: None, rel: None, takes: vec![noun.span] });
    };
    add(Kind::Label, label(here()));
    add(Kind::Before, label(Phrase::new(Head::Previous)));
    add(Kind::NotLabel, Content::Negate(Box::new(label(here()))));
    add(Kind::MendLabel, mend(label(here())));
    add(Kind::MendBefore, mend(label(Phrase::new(Head::Previous))));
    add(Kind::Same, same(true));
    add(Kind::Other, same(false));
    add(Kind::NotSame, Content::Negate(Box::new(same(true))));
    add(Kind::Attribute, Content::Attribute { what: noun.phrase.clone(), value: value(tokens, noun.span) });
    let at = |relation, pointer| locate(noun.phrase.clone(), relation, vec![Phrase::new(pointer)]);
    for pointer in [Head::Here, Head::There] {
        let content = at(Relation::At, pointer);
        add(Kind::MendLocate, mend(content.clone()));
        add(Kind::NotLocate, Content::Negate(Box::new(content.clone())));
        add(Kind::IsLocated, whether(content.clone()));
        add(Kind::Locate, content);
    }
    let end = Box::new(at(Relation::AtEndOf, Head::Path));
    add(Kind::WayTo, Content::Route { steps: way.to_vec(), then: Some(end) });
    add(Kind::What, ask(Question::What));
    add(Kind::IsLabel, whether(label(Phrase::new(Head::There))));
    add(Kind::Where, ask(Question::Where));
    add(Kind::Route, ask(Question::Route));
    add(Kind::HowFar, ask(Question::HowFar));
    add(Kind::IsLabel, whether(label(here())));
}

/// "The third door": a place by where it is in a row, or "that door there", without a word that relates.
fn is_told_by(tokens: &[Token], noun: &Noun) -> bool {
    let f = &noun.phrase.features;
    let counted = tokens[noun.span.from].class == Class::Num && noun.span.to - noun.span.from > 1;
    noun.pointer.is_none()
        && noun.ends
        && (f.ordinal.is_some() || f.this || counted)
        && !noun.is_floor
        && noun.is_place
}

/// "The corner office is Priya's", "the third hut belongs to the pilots", "that room is mine".
fn owned(tokens: &[Token], groups: &Groups, all: &mut Vec<Proposal>) {
    for (i, a) in groups.nouns.iter().enumerate().filter(|(_, n)| n.pointer.is_none() && n.made == Made::Said)
    {
        for (k, w) in groups.nouns.iter().enumerate().filter(|(_, w)| w.span.from >= a.span.to) {
            let next = |k: usize| tokens.get(w.span.to + k);
            let before = w.span.from.checked_sub(1).map(|b| tokens[b].text.as_str());
            let owns = next(0).is_some_and(|t| t.class == Class::Owner)
                && next(1).is_none_or(|t| !t.class.names())
                || before.is_some_and(|b| matches!(b, "to" | "for" | "the"))
                    && tokens[a.span.to..w.span.from].iter().any(|t| t.text.starts_with("belong"));
            if w.pointer.is_some() || !owns || w.made != Made::Said || w.span.from - a.span.to > FAR {
                continue;
            }
            let mut also = a.phrase.clone();
            also.features.owner = w.phrase.full_name().map(|n| Owner::Named(n.as_str().to_owned()));
            let content = Content::Alias { what: a.phrase.clone(), also };
            let (noun, other) = (Some(i), Some(k));
            all.push(Proposal {
                kind: Kind::Alias,
                content,
                noun,
                other,
                rel: None,
                takes: vec![a.span, w.span],
            });
        }
    }
}

/// Where something may lie.
struct Spot {
    relation: Relation,
    rel: Option<usize>,
    /// The first of the landmarks, if it is a group.
    noun: Option<usize>,
    landmarks: Vec<Phrase>,
    /// Words of relation and landmarks.
    takes: Span,
}

/// All spots that a relation's words may tell.
fn spots(tokens: &[Token], groups: &Groups, r: usize, rel: &Rel) -> Vec<Spot> {
    let spot = |noun, landmarks, to, relation| Spot {
        relation,
        rel: Some(r),
        noun,
        landmarks,
        takes: Span { from: rel.span.from, to },
    };
    match rel.implied {
        Some(Implied::Pointer(p)) => {
            return vec![spot(None, vec![Phrase::new(p.head())], rel.span.to, rel.relation)];
        }
        Some(Implied::Corner) => {
            let corner = Name::new("corner").map(|n| Phrase::new(Head::Named(n)));
            return corner.map(|c| spot(None, vec![c], rel.span.to, rel.relation)).into_iter().collect();
        }
        None => {}
    }
    let mut all = Vec::new();
    let after = after_articles(tokens, rel.span.to);
    let begins = |n: &Noun| n.span.from == after || n.span.from == rel.span.to;
    for (k, n) in groups.nouns.iter().enumerate().filter(|(_, n)| begins(n)) {
        if rel.relation == Relation::Between {
            let and = tokens.get(n.span.to).is_some_and(|t| t.text == "and");
            let second = after_articles(tokens, n.span.to + 1);
            for m in groups.nouns.iter().filter(|m| and && m.span.from == second) {
                all.push(spot(Some(k), vec![n.phrase.clone(), m.phrase.clone()], m.span.to, rel.relation));
            }
            if !tokens[n.head].text.ends_with('s') {
                continue;
            }
        }
        let relation = match rel.relation {
            Relation::On | Relation::In | Relation::At if n.is_floor => Relation::OnLevel,
            relation => relation,
        };
        all.push(spot(Some(k), vec![n.phrase.clone()], n.span.to, relation));
    }
    // "On three", "on the fifth".
    let ends = |at: usize| tokens.get(at).is_none_or(|t| !t.class.names());
    let number = |t: &Token| {
        counted(&t.text).or(match ordinal(&t.text) {
            Some(Ordinal::Nth(n)) => Some(n),
            _ => None,
        })
    };
    let storey =
        tokens.get(after).filter(|_| rel.relation == Relation::On && ends(after + 1)).and_then(number);
    all.extend(storey.and_then(floor).map(|f| spot(None, vec![f], after + 1, Relation::OnLevel)));
    all
}

/// "Customer service, second floor": a floor that no word relates.
fn is_floor(tokens: &[Token], noun: &Noun) -> bool {
    let before = |k: usize| noun.span.from.checked_sub(k).map(|b| &tokens[b]);
    let told = |t: Option<&Token>| t.is_some_and(|t| t.class == Class::Prep);
    let in_relation = told(before(1)) || before(1).is_some_and(|t| t.class == Class::Det) && told(before(2));
    noun.is_floor && !in_relation && noun.phrase.features.ordinal.is_some()
}

fn floor(n: u32) -> Option<Phrase> {
    let mut phrase = Phrase::new(Head::Named(Name::new("floor")?));
    phrase.features.ordinal = Some(Ordinal::Nth(n));
    Some(phrase)
}

/// What may lie at a spot, and is said of it.
fn located(groups: &Groups, spot: &Spot, way: &[String], all: &mut Vec<Proposal>) {
    for (f, figure) in groups.nouns.iter().enumerate() {
        let Some(gap) = figure.span.gap(spot.takes) else { continue };
        if gap > FAR || figure.pointer == Some(Pointer::There) || spot.landmarks.contains(&figure.phrase) {
            continue;
        }
        let head = match figure.pointer {
            Some(Pointer::Agent | Pointer::Speaker) => Phrase::new(Head::Here),
            _ => figure.phrase.clone(),
        };
        let content = locate(head.clone(), spot.relation, spot.landmarks.clone());
        let boxed = || Box::new(content.clone());
        let mut add = |kind, content| {
            let (rel, other, takes) = (spot.rel, spot.noun, vec![spot.takes]);
            all.push(Proposal { kind, content, noun: Some(f), other, rel, takes });
        };
        add(Kind::NotLocate, Content::Negate(boxed()));
        add(Kind::MendLocate, Content::Correct { was: None, is: boxed() });
        add(Kind::WayTo, Content::Route { steps: way.to_vec(), then: Some(boxed()) });
        add(Kind::IsLocated, whether(content.clone()));
        if let [landmark] = &spot.landmarks[..] {
            for quantity in [Quantity::All, Quantity::Usually, Quantity::Sometimes, Quantity::Never] {
                let (figure, landmark) = (head.clone(), landmark.clone());
                add(Kind::Generic, Content::Generic { figure, relation: spot.relation, landmark, quantity });
            }
        }
        add(Kind::Locate, content);
    }
}

fn after_articles(tokens: &[Token], mut at: usize) -> usize {
    while tokens.get(at).is_some_and(|t| matches!(t.class, Class::Det | Class::Poss | Class::Point))
        && at + 1 < tokens.len()
    {
        at += 1;
    }
    at
}

/// A way, as the relations to landmarks that are said.
fn steps(tokens: &[Token], groups: &Groups) -> Vec<String> {
    let step = |r: &Rel| {
        let at = after_articles(tokens, r.span.to);
        let to = groups
            .nouns
            .iter()
            .filter(|n| n.span.from == at && n.pointer.is_none())
            .max_by_key(|n| n.span.to);
        to.map(|n| format!("{} {}", r.relation.notation(), phrase_notation(&n.phrase)))
    };
    let steps: Vec<String> =
        groups.rels.iter().filter(|r| r.longest && r.implied.is_none()).filter_map(step).collect();
    if steps.is_empty() { vec!["ahead".to_owned()] } else { steps }
}

/// What is said of a name: the words behind its verb.
fn value(tokens: &[Token], of: Span) -> String {
    let ends = |t: &Token| matches!(t.class, Class::Stop | Class::Comma | Class::Question | Class::Conj);
    let clause = tokens[of.to..].iter().take_while(|t| !ends(t));
    let skips =
        |t: &&Token| matches!(t.class, Class::Be | Class::Owner | Class::Adv | Class::Det | Class::Modal);
    let words: Vec<&str> = clause.skip_while(skips).take(5).map(|t| t.text.as_str()).collect();
    if words.is_empty() { "so".to_owned() } else { words.join(" ") }
}
