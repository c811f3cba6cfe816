//! What the acts of a sentence do to every particle: its weight, by what was said before (4), and its
//! labels, eq. (12).

use crate::edge::Vertex;
use crate::filter::Filter;
use crate::filter::labels::{DIRECT, Evidence, LabelId, Labels, Source, tie};
use crate::language::act::{Content, Head, Locate, Parse, Phrase, Sameness};
use crate::talk::describe::{ground, reground_about};
use crate::talk::mend::{resolve, strike};
use crate::talk::predictive::{base_probability, log_denied, log_label};
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
}

/// Takes in all readings of a sentence said at the place `held`, each by its probability. What takes
/// something back does so by the likeliest reading alone.
pub(crate) fn take_in(
    talk: &mut Talk,
    filter: &mut Filter,
    (utterance, parse, held): (u32, &Parse, Vertex),
    here: &Here,
) {
    let mut saying = Saying { talk: &mut *talk, filter: &mut *filter, utterance, held, here };
    for (k, analysis) in parse.analyses.iter().enumerate() {
        for act in &analysis.acts {
            saying.take(&act.content, analysis.weight * act.certainty, k == 0);
        }
    }
    let log_ratios = ground(talk, filter, (utterance, parse, held), here.poses, &here.path_m);
    for (p, log_ratio) in filter.particles.iter_mut().zip(log_ratios) {
        p.weigh_by_words(utterance, log_ratio);
    }
    filter.rank();
}

impl Saying<'_> {
    fn take(&mut self, content: &Content, certainty: f64, likeliest: bool) {
        if self.filter.config.rules.by_paper() && !matches!(content, Content::Label { .. }) {
            return;
        }
        match content {
            Content::Label { at, what, sameness } => self.call(at, what, *sameness, certainty),
            Content::Alias { what, also } if likeliest => self.alias(what, also),
            Content::Same { what, like, same: true } => self.tie(what, like, certainty),
            Content::Negate(content) if likeliest => self.deny(content, certainty),
            Content::Correct { was, is } if likeliest => self.correct(was.as_deref(), is, certainty),
            // Located in `ground`, together and again later; the others say nothing of places.
            _ => {}
        }
    }

    /// "This is the gym."
    fn call(&mut self, at: &Phrase, what: &Phrase, sameness: Sameness, certainty: f64) {
        let (Some(place), Some(name)) = (self.place_meant(at), what.label()) else { return };
        let ledger = Arc::make_mut(&mut self.talk.ledger);
        let said = ledger.enter_name(&name);
        let label = ledger.meant(said);
        let p0 = self.base_probability(label);
        let source = if sameness == Sameness::Other { Source::DirectOther } else { Source::Direct };
        let Saying { utterance, here, .. } = *self;
        let evidence = Evidence { utterance, said, label, place, weight: DIRECT * certainty, source };
        for p in &mut self.filter.particles {
            let log = log_label(&p.labels, &(here.poses)(p), (place, label), sameness, p0);
            if !self.filter.config.rules.by_paper() {
                p.weigh_by_words(utterance, certainty * log);
            }
            p.labels.add(evidence);
        }
        self.filter.named_anew([place]);
        reground_about(self.talk, self.filter, label, self.here);
    }

    /// p₀ of a name: how often it was given among all names given.
    fn base_probability(&self, label: LabelId) -> f64 {
        let direct = |e: &&Evidence| matches!(e.source, Source::Direct | Source::DirectOther);
        let given = || self.filter.best().labels.evidence().iter().filter(direct);
        base_probability(given().filter(|e| e.label == label).count(), given().count())
    }

    /// "The gym is also called the arena"; "the last office on the left is Nick's" locates it.
    fn alias(&mut self, what: &Phrase, also: &Phrase) {
        let Some(other) = also.label() else { return };
        if !what.within.is_empty() {
            return;
        }
        if let (None, Some(_)) = (what.label(), self.place_meant(what)) {
            return self.call(what, also, Sameness::Open, 1.0);
        }
        let Some(name) = what.label() else { return };
        let ledger = Arc::make_mut(&mut self.talk.ledger);
        let (label, also) = (ledger.enter_name(&name), ledger.enter_name(&other));
        ledger.call(label, also, Some(self.utterance));
        resolve(self.talk, self.filter);
    }

    /// "We are back where we started."
    fn tie(&mut self, what: &Phrase, like: &Phrase, certainty: f64) {
        let (Some(a), Some(b)) = (self.place_meant(what), self.place_meant(like)) else {
            return;
        };
        let utterance = self.utterance;
        for p in &mut self.filter.particles {
            for place in [a, b] {
                p.labels.add(Evidence::new(
                    utterance,
                    tie(utterance),
                    place,
                    DIRECT * certainty,
                    Source::Tied,
                ));
            }
        }
        self.filter.named_anew([a, b]);
    }

    /// "This is not the kitchen."
    fn deny(&mut self, content: &Content, certainty: f64) {
        let Content::Label { at, what, .. } = content else { return };
        let (Some(place), Some(name)) = (self.place_meant(at), what.label()) else { return };
        let ledger = Arc::make_mut(&mut self.talk.ledger);
        let said = ledger.enter_name(&name);
        let label = ledger.meant(said);
        for p in &mut self.filter.particles {
            let poses = (self.here.poses)(p);
            let log = log_denied(&p.labels, &poses, (place, label));
            p.weigh_by_words(self.utterance, certainty * log);
            for place in called_so(&p.labels, label, |v| {
                v == place || poses[v as usize].distance_m(&poses[place as usize]) < DENIED_REACH_M
            }) {
                let (utterance, weight) = (self.utterance, -DIRECT * certainty);
                p.labels.add(Evidence { utterance, said, label, place, weight, source: Source::Denied });
            }
        }
    }

    /// "No, this is the gym, not the kitchen": the sentence that said so before is taken back; if
    /// there is none, it is denied.
    fn correct(&mut self, was: Option<&Content>, is: &Content, certainty: f64) {
        if let (Some(Content::Label { at, what: old, .. }), Content::Label { what: new, .. }) = (was, is)
            && at.head == Head::Any
        {
            return self.alias(new, old);
        }
        match self.said_before(was, is) {
            Some(number) => {
                strike(self.talk, self.filter, number);
            }
            None => was.into_iter().for_each(|was| self.deny(was, certainty)),
        }
        self.take(is, certainty, true);
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
