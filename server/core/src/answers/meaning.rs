//! Which taught names somebody may mean who asks for one: itself, those of its kind, synonyms, what sounds like it.

use crate::filter::labels::LabelId;
use crate::language::{Name, edits, is_number, is_of_kind, misheard, synonyms};
use crate::talk::ledger::Ledger;

/// P(one of them is meant) where a kind is asked for that nobody named by itself: "the archive" for the old archive.
const OF_KIND: f64 = 0.8;
/// Who asks for any restroom takes what is so likely one.
const SYNONYM_MIN: f64 = 0.5;
/// Names offered in place of an unknown one.
const SUGGESTED: usize = 3;
/// Letters that may differ in these.
const EDITS_MAX: usize = 2;

/// What a name asked for means.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Meaning {
    /// `exact`, `kind`, `synonym`, `sound` or `unknown`.
    pub via: &'static str,
    /// P(one of the names is meant).
    pub p: f64,
    /// These, all as likely.
    pub labels: Vec<LabelId>,
    /// Where none is: names that look like it, or are of its kind.
    pub suggestions: Vec<LabelId>,
}

/// What a name means among those that something speaks for: whether one is, and all of them, which takes longer.
pub(crate) fn meaning(
    name: &Name,
    ledger: &Ledger,
    is_known: &dyn Fn(LabelId) -> bool,
    known: &dyn Fn() -> Vec<LabelId>,
) -> Meaning {
    let of = |via, p, labels| Meaning { via, p, labels, suggestions: Vec::new() };
    let exact = ledger.label(name.as_str()).or_else(|| ledger.spelled_so(name.as_str()));
    if let Some(label) = exact.filter(|&label| is_known(label)) {
        return of("exact", 1.0, vec![label]);
    }
    let (asked, known) = (name.as_str(), known());
    let kinds: Vec<LabelId> =
        known.iter().copied().filter(|&id| is_of_kind(ledger.name(id), asked)).collect();
    if !kinds.is_empty() {
        return of("kind", OF_KIND, kinds);
    }
    let likeliest = |p: fn(&str, &str) -> f64| {
        let all = known.iter().map(|&id| (p(asked, ledger.name(id)), id)).filter(|(p, _)| *p > 0.0);
        all.max_by(|a, b| a.0.total_cmp(&b.0).then(b.1.cmp(&a.1)))
    };
    if let Some((p, id)) = likeliest(synonyms) {
        return of("synonym", p, vec![id]);
    }
    if let Some((p, id)) = likeliest(misheard) {
        return of("sound", p, vec![id]);
    }
    let via = if exact.is_some() { "exact" } else { "unknown" };
    Meaning { suggestions: like(asked, ledger, &known), ..of(via, 0.0, Vec::new()) }
}

/// Known names that are one asked for, of its kind, or mean the same.
pub(crate) fn alike(asked: &str, ledger: &Ledger, known: &[LabelId]) -> Vec<LabelId> {
    let exact = ledger.label(asked).or_else(|| ledger.spelled_so(asked));
    let is_alike = |&id: &LabelId| {
        let name = ledger.name(id);
        Some(id) == exact || is_of_kind(name, asked) || synonyms(asked, name) >= SYNONYM_MIN
    };
    known.iter().copied().filter(is_alike).collect()
}

/// Names that look like one: by letters, or of the same kind.
fn like(asked: &str, ledger: &Ledger, known: &[LabelId]) -> Vec<LabelId> {
    let unnumbered = |name: &str| name.split(' ').rfind(|w| !is_number(w) && w.len() > 1).map(str::to_owned);
    let far = |id: LabelId| {
        let name = ledger.name(id);
        let differ = edits(asked, name);
        let letters = differ <= EDITS_MAX && asked.len() > 2 * EDITS_MAX;
        let kind = unnumbered(name) == unnumbered(asked) && asked.contains(' ');
        (letters || kind).then_some((usize::from(!letters), differ, id))
    };
    let mut all: Vec<_> = known.iter().filter_map(|&id| far(id)).collect();
    all.sort_unstable();
    all.into_iter().take(SUGGESTED).map(|(.., id)| id).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn who_asks_may_mean_a_name_that_was_never_said_so() {
        let mut ledger = Ledger::default();
        for name in
            ["old archive", "lecture hall three", "lecture hall five", "lobby", "server room", "kitchen"]
        {
            ledger.enter_name(&Name::new(name).unwrap());
        }
        let known: Vec<LabelId> = (0..6).collect();
        let asked = |name: &str| {
            meaning(&Name::new(name).unwrap(), &ledger, &|id| known.contains(&id), &|| known.clone())
        };
        for (name, via, labels) in [
            ("kitchen", "exact", vec![5]),
            ("archive", "kind", vec![0]),
            ("lecture hall", "kind", vec![1, 2]),
            ("foyer", "synonym", vec![3]),
            ("sever room", "sound", vec![4]),
            ("attic", "unknown", vec![]),
        ] {
            assert_eq!((asked(name).via, asked(name).labels), (via, labels), "{name}");
        }
        assert_eq!(alike("lecture hall", &ledger, &known), [1, 2]);
        assert_eq!(alike("foyer", &ledger, &known), [3]);
        assert_eq!(asked("kitschen").suggestions, [5]);
        assert_eq!(asked("lecture hall four").suggestions, [2, 1]);
        assert_eq!(meaning(&Name::new("lobby").unwrap(), &ledger, &|id| id == 0, &|| vec![0]).via, "exact");
    }
}
