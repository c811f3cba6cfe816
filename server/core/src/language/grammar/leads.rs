//! What ways do: "this hallway leads to the gym", "the right branch is a dead end".

use crate::language::act::{Head, Phrase};
use crate::language::grammar::attach::Weighed;
use crate::language::grammar::build::{Readings, locate_all, one};
use crate::language::grammar::cursor::Cursor;
use crate::language::grammar::figures::figures;
use crate::language::grammar::noun_phrase::{Determiner, NounPhrase};
use crate::language::grammar::relate::Related;
use crate::language::lexicon::names::{Kind, Name};
use crate::language::relation::Relation as R;

/// "This hallway leads to the gym".
pub(crate) fn leads(at: &mut Cursor, subject: &NounPhrase) -> Option<Readings> {
    let definite = matches!(subject.determiner, Determiner::Definite | Determiner::Demonstrative);
    let way = matches!(subject.kind, Kind::Place | Kind::Vague) && definite;
    at.skip("also|then|here|directly|just|right");
    let relation = lead(at)?;
    let (landmark, sure) = at.landmark()?;
    (way && sure).then(|| one(super::build::locate(&subject.phrase, &Related::to(relation, landmark))))
}

/// "Leads to", "takes you back into", "faces": how what the subject is lies to what follows.
fn lead(at: &mut Cursor) -> Option<R> {
    at.eat_any("will|would|can");
    let goes = "leads|lead|goes|go|takes|take|brings|bring|runs|run|opens out|opens|open|connects|connect|gets|get|continues";
    let way = "up|down|out|back|straight|right|directly|over|all the way|";
    if at.eat_each(&[goes, "you|us|one|people|", way, way, "to|into|onto"]) {
        return Some(R::To);
    }
    if at.eat_each(&["goes|go|runs|run|leads|lead|takes you", way, "past|by"]) {
        return Some(R::Past);
    }
    if at.eat_each(&["goes|go|runs|run", "along|alongside"]) {
        return Some(R::Along);
    }
    if at.eat_any("adjoins|adjoin|borders|abuts").is_some() {
        return Some(R::NextTo);
    }
    at.eat_any("faces|face|looks onto|is facing")?;
    Some(R::AcrossFrom)
}

/// "The right branch is a dead end": what lies on that side of the fork.
pub(crate) fn at_fork(at: &mut Cursor) -> Option<Readings> {
    at.eat("the").then_some(())?;
    let side = at.eat_any("left|right")?;
    at.eat_any("branch|fork|side of the fork|path")?;
    at.copula().filter(|c| !c.negated && !c.past)?;
    let figures = figures(at, true)?;
    let fork = Phrase::new(Head::Named(Name::new("fork")?));
    let relation = if side == "left" { R::LeftSide } else { R::RightSide };
    let plain: Vec<Weighed<Phrase>> = figures.iter().map(|f| vec![(1.0, f.phrase.clone())]).collect();
    Some(locate_all(&plain, &vec![(1.0, vec![Related::to(relation, fork)])]))
}
