//! Acts from what the clauses read.

use crate::language::act::{Content, Features, Frame, Head, Locate, Phrase, Sameness};
use crate::language::grammar::attach::Weighed;
use crate::language::grammar::copula::Copula;
use crate::language::grammar::relate::Related;
use crate::language::relation::Relation as R;

/// What a clause may say.
#[derive(Clone, Debug)]
pub(crate) struct Readings {
    /// Each reading with its weight, likeliest first; never empty.
    pub(crate) all: Weighed<Vec<Content>>,
    /// How sure the speaker is of it.
    pub(crate) certainty: f64,
}

impl Readings {
    pub(crate) fn new(mut all: Weighed<Vec<Content>>) -> Self {
        keep_best(&mut all);
        Self { all, certainty: 1.0 }
    }

    /// The likeliest reading.
    pub(crate) fn first(&self) -> &[Content] {
        self.all.first().map_or(&[], |(_, said)| said)
    }

    /// The same readings with other contents.
    pub(crate) fn map(self, change: impl Fn(Content) -> Content) -> Self {
        let all =
            self.all.into_iter().map(|(w, said)| (w, said.into_iter().map(&change).collect())).collect();
        Self { all, ..self }
    }
}

/// Readings of a clause that are kept.
const READINGS_MAX: usize = 4;

pub(crate) fn one(content: Content) -> Readings {
    Readings::new(vec![(1.0, vec![content])])
}

pub(crate) fn label(at: Head, what: Phrase, sameness: Sameness) -> Content {
    let mut what = what;
    // That it is another one is said of the place, not in its name.
    what.features.other = false;
    what.features.this = false;
    Content::Label { at: Phrase::new(at), what, sameness }
}

pub(crate) fn locate(figure: &Phrase, related: &Related) -> Content {
    Content::Locate(Locate {
        figure: figure.clone(),
        relation: related.relation,
        modifiers: related.modifiers,
        frame: frame(related),
        landmarks: related.landmarks.clone(),
        repaired: false,
    })
}

/// Every figure at every relation, for each reading of either.
pub(crate) fn locate_all(figures: &[Weighed<Phrase>], grounds: &Weighed<Vec<Related>>) -> Readings {
    let all = grounds
        .iter()
        .flat_map(|(w, related)| {
            figures.first().into_iter().flatten().enumerate().map(move |(i, (v, first))| {
                let rest = figures.iter().skip(1).filter_map(move |f| f.get(i).or_else(|| f.first()));
                let all = std::iter::once(first).chain(rest.map(|(_, f)| f));
                (w * v, all.flat_map(|f| related.iter().map(move |r| locate(f, r))).collect())
            })
        })
        .collect();
    Readings::new(all)
}

pub(crate) fn keep_best<T>(readings: &mut Weighed<T>) {
    readings.sort_by(|a, b| b.0.total_cmp(&a.0));
    readings.truncate(READINGS_MAX);
}

/// The statement as its verb shapes it: denied, doubted, said to correct.
pub(crate) fn shaped(readings: Readings, copula: &Copula) -> Readings {
    let denied = copula.negated ^ copula.former;
    let doubted = Readings { certainty: readings.certainty * copula.certainty, ..readings };
    if denied { doubted.map(negate) } else { doubted }
}

pub(crate) fn negate(content: Content) -> Content {
    match content {
        Content::Negate(inner) => *inner,
        // Not another lobby: the same; not the same: another.
        Content::Label { at, what, sameness: Sameness::Same } => {
            Content::Label { at, what, sameness: Sameness::Other }
        }
        Content::Label { at, what, sameness: Sameness::Other } => {
            Content::Label { at, what, sameness: Sameness::Same }
        }
        Content::Same { what, like, same } => Content::Same { what, like, same: !same },
        other => Content::Negate(Box::new(other)),
    }
}

/// Whose left, front or way a relation means.
fn frame(related: &Related) -> Option<Frame> {
    if matches!(related.relation, R::NorthOf | R::SouthOf | R::EastOf | R::WestOf) {
        return Some(Frame::Absolute);
    }
    let counted = |f: &Features| f.count.is_some() || f.ordinal.is_some();
    if related.relation == R::At && related.landmarks.iter().any(|l| counted(&l.features)) {
        return Some(Frame::Path);
    }
    related.landmarks.iter().find_map(frame_of)
}

fn frame_of(phrase: &Phrase) -> Option<Frame> {
    match phrase.head {
        Head::Agent => Some(Frame::Hearer),
        Head::Speaker => Some(Frame::Speaker),
        Head::Path => Some(Frame::Path),
        _ => phrase.within.iter().flat_map(|r| &r.landmarks).find_map(frame_of),
    }
}
