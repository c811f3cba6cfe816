//! What the acts of a sentence do: they are kept as claims, which weigh graphs (see `fold`), and to every
//! particle's labels they add, eq. (12).

use crate::edge::Vertex;
use crate::filter::Filter;
use crate::filter::labels::{DIRECT, Evidence, LabelId, Labels, Source, tie};
use crate::language::act::{Analysis, Content, Head, Locate, Parse, Phrase, Sameness};
use crate::talk::claims::{Claim, Claims, Testimony};
use crate::talk::describe::{ground, reground_about};
use crate::talk::locate::located_by;
use crate::talk::mend::{resolve, strike};
use crate::talk::{Here, Talk};
use std::sync::Arc;

/// What is said not to be so is not so within this distance: a room.
const DENIED_REACH_M: f64 = 4.0;
/// "The room we just left" was so far back along the path, at least, and no farther.
const LEFT_PATH_M: (f64, f64) = (3.0, 40.0);

/// A sentence being taken in.
struct Saying<'a> {
    talk: &'a mut Talk,
    filter: &'a mut Filter,
    utterance: u32,
    held: Vertex,
    here: &'a Here<'a>,
    /// What the reading at hand claims.
    claims: Vec<(f64, Claim)>,
}

/// Takes in all readings of a sentence said at the place `held`, each by its probability. What takes
/// something back does so by the likeliest reading alone.
pub(crate) fn take_in(
    talk: &mut Talk,
    filter: &mut Filter,
    (utterance, parse, held): (u32, &Parse, Vertex),
    here: &Here,
) {
    let mut readings = Vec::new();
    let mut saying =
        Saying { talk: &mut *talk, filter: &mut *filter, utterance, held, here, claims: Vec::new() };
    for (k, analysis) in parse.analyses.iter().enumerate() {
        for act in &analysis.acts {
            saying.take(&act.content, (analysis.weight, act.certainty), k == 0);
        }
        saying.locate(analysis);
        readings.push(Claims { weight: analysis.weight, claims: std::mem::take(&mut saying.claims) });
    }
    // The paper's words weigh nothing.
    if !filter.config.rules.by_paper() {
        talk.testimonies.add(Testimony { utterance, readings }, filter.best(), here);
    }
    ground(talk, filter, (utterance, parse, held), here.poses, &here.path_m);
    filter.weigh_words(talk);
}

impl Saying<'_> {
    /// `p` of a reading, and within it of the act.
    fn take(&mut self, content: &Content, p: (f64, f64), likeliest: bool) {
        if self.filter.config.rules.by_paper() && !matches!(content, Content::Label { .. }) {
            return;
        }
        match content {
            Content::Label { at, what, sameness } => self.call(at, what, *sameness, p),
            Content::Alias { what, also } if likeliest => self.alias(what, also, p),
            Content::Same { what, like, same } => self.tie(what, like, *same, p),
            Content::Negate(content) if likeliest => self.deny(content, p),
            Content::Correct { was, is } if likeliest => self.correct(was.as_deref(), is, p),
            // Located in `ground`, together and again later; the others say nothing of places.
            _ => {}
        }
    }

    /// What a reading locates, in `ground`.
    fn locate(&mut self, reading: &Analysis) {
        for (certainty, l) in located_by(reading) {
            if let Some(name) = l.figure.label() {
                let said = Arc::make_mut(&mut self.talk.ledger).enter_name(&name);
                self.claims.push((certainty, Claim::Located { said }));
            }
        }
    }

    /// "This is the gym."
    fn call(&mut self, at: &Phrase, what: &Phrase, again: Sameness, (reading, certainty): (f64, f64)) {
        let (Some(place), Some(name)) = (self.place_meant(at), what.label()) else { return };
        let ledger = Arc::make_mut(&mut self.talk.ledger);
        let said = ledger.enter_name(&name);
        let label = ledger.meant(said);
        self.claims.push((certainty, Claim::Called { place, said, again }));
        let source = if again == Sameness::Other { Source::DirectOther } else { Source::Direct };
        let (utterance, weight) = (self.utterance, DIRECT * reading * certainty);
        self.add(Evidence { utterance, said, label, place, weight, source });
        self.filter.named_anew([place]);
        reground_about(self.talk, self.filter, label, self.here);
    }

    fn add(&mut self, evidence: Evidence) {
        self.filter.particles.iter_mut().for_each(|p| p.labels.add(evidence));
    }

    /// "The gym is also called the arena"; "the last office on the left is Nick's" locates it.
    fn alias(&mut self, what: &Phrase, also: &Phrase, p: (f64, f64)) {
        let Some(other) = also.label() else { return };
        if !what.within.is_empty() {
            return;
        }
        if let (None, Some(_)) = (what.label(), self.place_meant(what)) {
            return self.call(what, also, Sameness::Open, p);
        }
        let Some(name) = what.label() else { return };
        let ledger = Arc::make_mut(&mut self.talk.ledger);
        let (label, also) = (ledger.enter_name(&name), ledger.enter_name(&other));
        ledger.call(label, also, Some(self.utterance));
        resolve(self.talk, self.filter);
    }

    /// "We are back where we started", "we have not been here before", "this is the same place as the gym".
    fn tie(&mut self, what: &Phrase, like: &Phrase, same: bool, p: (f64, f64)) {
        // "The kitchen is where we started" names the start; "this is the same place as the kitchen" is back.
        let (what, like, again) = match self.place_meant(what) {
            Some(_) => (what, like, Sameness::Same),
            None => (like, what, Sameness::Open),
        };
        let Some(place) = self.place_meant(what) else { return };
        if like.label().is_some() {
            return if same { self.call(what, like, again, p) } else { self.not_called(place, like, p) };
        }
        if matches!(like.head, Head::Visited) {
            return self.claims.push((p.1, Claim::Visited { place, before: same }));
        }
        let Some(other) = self.place_meant(like) else { return };
        self.claims.push((p.1, Claim::One { a: place, b: other, same }));
        if same {
            let (utterance, weight) = (self.utterance, DIRECT * p.0 * p.1);
            for place in [place, other] {
                self.add(Evidence::new(utterance, tie(utterance), place, weight, Source::Tied));
            }
            self.filter.named_anew([place, other]);
        }
    }

    /// "This is not the kitchen."
    fn deny(&mut self, content: &Content, p: (f64, f64)) {
        match content {
            Content::Label { at, what, .. } => {
                if let Some(place) = self.place_meant(at) {
                    self.not_called(place, what, p);
                }
            }
            Content::Same { what, like, same } => self.tie(what, like, !same, p),
            _ => {}
        }
    }

    fn not_called(&mut self, place: Vertex, what: &Phrase, (reading, certainty): (f64, f64)) {
        let Some(name) = what.label() else { return };
        let ledger = Arc::make_mut(&mut self.talk.ledger);
        let said = ledger.enter_name(&name);
        let label = ledger.meant(said);
        self.claims.push((certainty, Claim::Denied { place, said }));
        let (utterance, weight) = (self.utterance, -DIRECT * reading * certainty);
        for p in &mut self.filter.particles {
            let poses = (self.here.poses)(p);
            for place in called_so(&p.labels, label, |v| {
                v == place || poses[v as usize].distance_m(&poses[place as usize]) < DENIED_REACH_M
            }) {
                p.labels.add(Evidence { utterance, said, label, place, weight, source: Source::Denied });
            }
        }
    }

    /// "No, this is the gym, not the kitchen": the sentence that said so before is taken back; if
    /// there is none, it is denied.
    fn correct(&mut self, was: Option<&Content>, is: &Content, p: (f64, f64)) {
        if let (Some(Content::Label { at, what: old, .. }), Content::Label { what: new, .. }) = (was, is)
            && at.head == Head::Any
        {
            return self.alias(new, old, p);
        }
        match self.said_before(was, is) {
            Some(number) => {
                strike(self.talk, self.filter, number);
            }
            None => was.into_iter().for_each(|was| self.deny(was, p)),
        }
        self.take(is, p, true);
    }

    /// The newest sentence that stands and says what is taken back: of that name near that place, or
    /// any of that place.
    fn said_before(&self, was: Option<&Content>, is: &Content) -> Option<u32> {
        let located = |l: &Locate| l.figure.label().and_then(|n| self.talk.ledger.label(n.as_str()));
        let (at, label) = match was.unwrap_or(is) {
            Content::Label { at, what, .. } => {
                (self.place_meant(at), what.label().map(|n| self.talk.ledger.label(n.as_str())))
            }
            Content::Locate(l) => (None, Some(located(l))),
            _ => return None,
        };
        // A name never said was never said of a place.
        let label = if was.is_some() { Some(label??) } else { None };
        let best = self.filter.best();
        let poses = (self.here.poses)(best);
        let near = |v: Vertex| {
            at.is_none_or(|at| poses[v as usize].distance_m(&poses[at as usize]) < 2.0 * DENIED_REACH_M)
        };
        let wanted = |e: &&Evidence| {
            e.utterance != self.utterance
                && label.is_none_or(|label| e.label == label)
                && (label.is_some() || e.source == Source::Direct)
                && (e.source == Source::Grounded || near(e.place))
        };
        best.labels.evidence().iter().filter(wanted).map(|e| e.utterance).max()
    }

    /// The place that a phrase points to from where it is said; none if it points to none.
    fn place_meant(&self, phrase: &Phrase) -> Option<Vertex> {
        match phrase.head {
            Head::Here | Head::It => Some(self.held),
            Head::Previous => Some(self.place_left()),
            Head::Start => Some(0),
            _ => None,
        }
    }

    /// The place left last: the newest that was given a name a little way back, or one there.
    fn place_left(&self) -> Vertex {
        let path_m = &self.here.path_m;
        let back_m = |v: Vertex| path_m[self.held as usize] - path_m[v as usize];
        let left = |v: Vertex| v < self.held && (LEFT_PATH_M.0..LEFT_PATH_M.1).contains(&back_m(v));
        let named = self.filter.best().labels.evidence().iter().rev();
        let named = named.filter(|e| e.source == Source::Direct).map(|e| e.place).find(|&v| left(v));
        named.or_else(|| (0..self.held).rev().find(|&v| left(v))).unwrap_or(0)
    }
}

/// Places with something that speaks for a name, among those wanted.
fn called_so(labels: &Labels, label: LabelId, wanted: impl Fn(Vertex) -> bool) -> Vec<Vertex> {
    let applies = labels.applies(label).into_iter();
    applies.filter(|&(v, p)| p > 0.0 && wanted(v)).map(|(v, _)| v).collect()
}
