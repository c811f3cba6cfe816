//! "The gym is down the hall", "on your left you'll see the lab": a figure and where it lies; and what
//! else is said of a place by name.

use crate::language::act::{Content, Head, Locate, Owner, Phrase, Sameness};
use crate::language::grammar::attach::{Chain, Weighed};
use crate::language::grammar::attribute::attribute;
use crate::language::grammar::build::{Readings, label, locate_all, negate, one, shaped};
use crate::language::grammar::copula::{Copula, LIKELY};
use crate::language::grammar::cursor::Cursor;
use crate::language::grammar::figures::{MAX_FIGURES, figures, fits, is_door};
use crate::language::grammar::leads::{at_fork, leads};
use crate::language::grammar::naming::{named, plausible};
use crate::language::grammar::noun_phrase::{Determiner, NounPhrase};
use crate::language::grammar::pointed::where_kept;
use crate::language::grammar::presents::presents;
use crate::language::grammar::relate::Related;
use crate::language::grammar::repair::{guessed, mended};
use crate::language::lexicon::names::Kind;
use crate::language::relation::Relation as R;

/// Reads a clause that locates something.
pub(crate) fn locate_clause(at: &mut Cursor) -> Option<Readings> {
    let start = *at;
    for form in [wanted, presented, at_fork, inverted, said_of_places] {
        if let Some(readings) = form(at) {
            return Some(readings);
        }
        *at = start;
    }
    None
}

/// "If you are looking for the library, it's down the hall".
fn wanted(at: &mut Cursor) -> Option<Readings> {
    at.eat_any(
        "if you are looking for|if you need to find|if you need to get to|if you need to go to|if you ever need|\
         if you need|if you want to find|if you want to get to|if you want to go to|if you want|if you are going to|\
         if you have to go to|if you are trying to find|if you are trying to get to|as for|for",
    )?;
    let figures = figures(at, true)?;
    at.skip(",|then");
    at.eat_any("it is|they are|that is|that would be|that will be|you can find it|you will find it|you can find them|\
        you will find them|you can find one|you will find one|there is one|there are some|there are a few|\
        there is a pair|there are several|we have one|we keep them|we keep it|go|look|try")?;
    located(&figures, &at.chain(false))
}

/// "There is a lab next to the gym", "you can find the copier in the mail room".
fn presented(at: &mut Cursor) -> Option<Readings> {
    let (certainty, former) = presents(at)?;
    at.skip("actually|also|even|only|just|all|our|the rest of");
    let doubt = at.eat_any("probably|most likely|maybe|perhaps|likely").is_some();
    let none = at.eat_any("no|not a|not any|no other").is_some();
    let figures = figures(at, true)?;
    let here = at.eat_any("right here|in here|here|in this room").is_some() && at.at_break();
    let chain = if here { Chain::here() } else { at.chain(false) };
    // "You have a kitchen" says nothing; "there is a room" neither.
    let readings = located(&figures, &chain)?;
    let certainty = readings.certainty * certainty * if doubt { LIKELY } else { 1.0 };
    let readings = Readings { certainty, ..readings };
    Some(if none ^ former { readings.map(negate) } else { readings })
}

/// "Just past the entrance is the reception desk".
fn inverted(at: &mut Cursor) -> Option<Readings> {
    at.skip("here|over here|up here|down here|coming up|next up|if you look|when you look|look|looking");
    let chain = at.leading_chain();
    chain.first()?;
    let comma = at.eat(",");
    if comma {
        // "On your right, that's the lab".
        at.eat_any("that|it|this").filter(|_| at.sees("is"));
    }
    let verb = if presents(at).is_some() { None } else { Some(at.copula()?) };
    let figures = figures(at, true)?;
    let readings = located(&figures, &chain)?;
    Some(match verb {
        Some(verb) => shaped(readings, &verb),
        None => readings,
    })
}

/// "The kitchen and the lounge are down the hall", "the last office on the left is Nick's".
fn said_of_places(at: &mut Cursor) -> Option<Readings> {
    let neither = at.eat("neither");
    let (subjects, told) = subjects(at)?;
    let start = *at;
    if let [subject] = subjects.as_slice()
        && let Some(readings) = leads(at, subject)
    {
        return Some(readings);
    }
    *at = start;
    if let ([subject], [readings]) = (subjects.as_slice(), told.as_slice())
        && at.eat_any("belongs to|belong to").is_some()
    {
        return belongs(at, subject, readings);
    }
    *at = start;
    // "The gym you'll find next to the lab"; "the gym, it's down the hall".
    let found = at.eat_each(&["you", "will|can", "find|see|reach"]);
    if at.before() == "," {
        at.eat_any("it|they|that").filter(|_| at.sees("is|are"));
    }
    let verb = if found { super::copula::PLAIN } else { at.copula()? };
    if verb.quantity.is_some() {
        return None;
    }
    let readings = predicate(at, &subjects, &told, &verb)?;
    let readings = shaped(readings, &verb);
    Some(if neither { readings.map(negate) } else { readings })
}

/// The subjects with what tells them, each with its readings.
fn subjects(at: &mut Cursor) -> Option<(Vec<NounPhrase>, Vec<Weighed<Phrase>>)> {
    let mut plain = Vec::new();
    let mut told = Vec::new();
    at.skip("both");
    loop {
        let mut subject = at.noun_phrase()?;
        at.eat_each(&[
            "that|which|",
            "we|you|i",
            "are looking for|are after|want|need|asked about|asked for|mentioned|\
            are going to|were asking about|told you about|are heading to|are heading for",
        ]);
        let relative = at.eat_any(", which is|, which are|, located|, situated").is_some();
        let chain = at.chain(true);
        if relative && (chain.is_empty() || at.at_end()) {
            return None;
        }
        at.skip(",");
        let readings = chain.restrict(&subject.phrase);
        subject.phrase = readings.first().map_or(subject.phrase, |(_, p)| p.clone());
        plain.push(subject);
        told.push(readings);
        let more = at.eat_any("and also|as well as|and|nor|along with|together with").is_some()
            || (at.before() == "," && at.lists());
        if plain.len() >= MAX_FIGURES || !more {
            return Some((plain, told));
        }
    }
}

/// What is said of named places.
fn predicate(
    at: &mut Cursor,
    subjects: &[NounPhrase],
    told: &[Weighed<Phrase>],
    verb: &Copula,
) -> Option<Readings> {
    let start = *at;
    let chain = at.chain(false);
    if !chain.is_empty() && !verb.past {
        let kinds = subjects.iter().any(|s| s.determiner == Determiner::Indefinite) && !chain.definite;
        if subjects.iter().all(|s| fits(s, false)) && !kinds {
            return located_told(subjects, told, &chain);
        }
        let [subject] = subjects else { return None };
        let plain =
            subject.kind == Kind::No && subject.determiner == Determiner::Definite && !subject.is_told();
        let figure = mended(&subject.phrase).filter(|_| plain && chain.sure())?;
        let meant = NounPhrase { phrase: figure, kind: Kind::Place, ..subject.clone() };
        return located(&[meant], &chain).and_then(guessed);
    }
    *at = start;
    if at.eat_any("right here|here").is_some() && (at.at_break() || at.sees("and|but")) {
        // "The kitchen is here" names the place held.
        let fit = subjects.iter().all(|s| fits(s, false) && s.determiner != Determiner::None);
        let here = |s: &NounPhrase| label(Head::Here, s.phrase.clone(), Sameness::Open);
        return fit.then(|| Readings::new(vec![(1.0, subjects.iter().map(here).collect())]));
    }
    *at = start;
    let ([subject], [readings]) = (subjects, told) else { return None };
    if !matches!(subject.kind, Kind::Place | Kind::Vague | Kind::Open)
        || subject.determiner == Determiner::Indefinite
        || (subject.kind != Kind::Place && !subject.is_told() && !subject.phrase.features.this)
        || (subject.kind == Kind::Open && subject.determiner != Determiner::Definite)
    {
        return None;
    }
    let made = |make: &dyn Fn(Phrase) -> Vec<Content>| -> Option<Readings> {
        Some(Readings::new(readings.iter().map(|(w, p)| (*w, make(p.clone()))).collect()))
    };
    if at
        .eat_any(
            "also called|also known as|also named|called|known as|named|referred to as|known to everyone as",
        )
        .is_some()
    {
        let also = named(at)?.phrase;
        return made(&|what| vec![Content::Alias { what, also: also.clone() }]);
    }
    if let Some(owner) = at.owner_alone() {
        return made(&|what| vec![Content::Alias { also: owned(&what, &owner), what }]);
    }
    *at = start;
    if let Some(like) = at.pointer().filter(|p| matches!(p.head, Head::Start | Head::Previous)) {
        return made(&|what| vec![Content::Same { what, like: like.clone(), same: true }]);
    }
    *at = start;
    if let Some(also) = where_kept(at) {
        return made(&|what| vec![Content::Alias { what, also: also.clone() }]);
    }
    *at = start;
    if at
        .eat_any("the same place as|the same room as|the same as|the same thing as|the same one as")
        .is_some()
    {
        let (like, _) = at.landmark()?;
        return made(&|what| vec![Content::Same { what, like: like.clone(), same: true }]);
    }
    if let Some(value) = attribute(at).filter(|_| at.at_break() || at.sees("and|but")) {
        let door = !subject.is_told() && is_door(&subject.phrase);
        return if door {
            None
        } else {
            made(&|what| vec![Content::Attribute { what, value: value.clone() }])
        };
    }
    *at = start;
    identified(at, subject, readings, verb)
}

/// "The last office on the left is the lab", "the lab is the second door on the right", "the lobby is
/// really the atrium".
fn identified(
    at: &mut Cursor,
    subject: &NounPhrase,
    readings: &Weighed<Phrase>,
    verb: &Copula,
) -> Option<Readings> {
    let other = at
        .noun_phrase()
        .filter(|p| p.determiner != Determiner::Demonstrative && !matches!(p.kind, Kind::No | Kind::Thing))?;
    let chain = at.chain(true);
    let pairs = |make: &dyn Fn(&Phrase, &Phrase) -> Vec<Content>| {
        let others = chain.restrict(&other.phrase);
        let all = readings
            .iter()
            .flat_map(|(w, a)| others.iter().map(move |(v, b)| (w * v, a, b)))
            .map(|(w, a, b)| (w, make(a, b)))
            .collect();
        Some(Readings::new(all))
    };
    let at_place = |figure: &Phrase, place: &Phrase| {
        vec![super::build::locate(figure, &Related::to(R::At, place.clone()))]
    };
    if is_door(&subject.phrase) && !subject.is_told() {
        return None;
    }
    let tells = !chain.is_empty() || other.phrase.features.ordinal.is_some();
    if tells
        && (other.kind == Kind::Vague || is_door(&other.phrase))
        && matches!(subject.kind, Kind::Place | Kind::Open)
    {
        return pairs(&at_place);
    }
    let names = other.kind == Kind::Place || (other.kind == Kind::Open && plausible(&other));
    if !names || other.determiner == Determiner::Indefinite {
        return None;
    }
    if subject.is_told() && is_door(&subject.phrase) {
        return pairs(&|door, figure| at_place(figure, door));
    }
    if subject.is_told() {
        return pairs(&|what, also| vec![Content::Alias { what: what.clone(), also: also.clone() }]);
    }
    if !verb.corrects {
        return None;
    }
    pairs(&|was, is| renamed(was.clone(), is.clone()))
}

/// The name `was` was wrong for what is `is`.
pub(crate) fn renamed(was: Phrase, is: Phrase) -> Vec<Content> {
    let any = |what: &Phrase| Box::new(label(Head::Any, what.clone(), Sameness::Open));
    vec![Content::Correct { was: Some(any(&was)), is: any(&is) }, Content::Alias { what: was, also: is }]
}

fn owned(what: &Phrase, owner: &Owner) -> Phrase {
    let mut owned = Phrase::new(what.head.clone());
    owned.features.owner = Some(owner.clone());
    owned
}

/// "The office by the window belongs to Anna".
fn belongs(at: &mut Cursor, subject: &NounPhrase, readings: &Weighed<Phrase>) -> Option<Readings> {
    let owner = if at.eat("me") { Owner::Speaker } else { Owner::Named(at.person()?) };
    let place = subject.kind == Kind::Place || (subject.kind == Kind::Vague && subject.is_told());
    let all =
        readings.iter().map(|(w, p)| (*w, vec![Content::Alias { also: owned(p, &owner), what: p.clone() }]));
    place.then(|| Readings::new(all.collect()))
}

/// The figures where the chain says, if either surely are places.
pub(crate) fn located(figures: &[NounPhrase], chain: &Chain) -> Option<Readings> {
    let plain: Vec<Weighed<Phrase>> = figures.iter().map(|f| vec![(1.0, f.phrase.clone())]).collect();
    located_told(figures, &plain, chain)
}

fn located_told(figures: &[NounPhrase], told: &[Weighed<Phrase>], chain: &Chain) -> Option<Readings> {
    let first = chain.first()?;
    let sure = chain.sure() || figures.iter().all(|f| matches!(f.kind, Kind::Place));
    let landmarks = || chain.landmarks();
    let itself = figures.iter().any(|f| f.name().is_some() && landmarks().any(|l| *l == f.phrase));
    // "Kitchens are near lounges" is said of kinds.
    let kinds = figures.iter().any(|f| f.determiner == Determiner::None && f.is_plural())
        && !landmarks()
            .all(|l| matches!(l.head, Head::Here | Head::Path | Head::Agent | Head::There) || chain.definite);
    // "Through the roof" is said of prices.
    let roof =
        first.relation == R::Through && landmarks().any(|l| l.label().is_some_and(|n| n.as_str() == "roof"));
    let pointless = first.relation == R::To;
    (sure && !itself && !kinds && !roof && !pointless).then(|| locate_all(told, &chain.attach()))
}

/// After a clause, ", which is next to the gym", ", also known as the galley": more of what it named.
pub(crate) fn said_further(at: &mut Cursor, first: &Content) -> Option<Readings> {
    let phrase = match first {
        Content::Label { what, .. } => what.clone(),
        // "The office is next to the lab, which is past the kitchen": the lab is.
        Content::Locate(Locate { figure, landmarks, .. }) => {
            landmarks.last().filter(|l| matches!(l.head, Head::Named(_))).unwrap_or(figure).clone()
        }
        _ => return None,
    };
    let subject = NounPhrase {
        determiner: Determiner::Definite,
        sameness: Sameness::Open,
        kind: Kind::Place,
        phrase: phrase.clone(),
    };
    let told = [vec![(1.0, phrase.clone())]];
    if at.eat_any("we call it|people call it|everyone calls it|some people call it|they call it|we also call|people call|we call|everybody calls it").is_some() {
        let also = named(at)?.phrase;
        return Some(one(Content::Alias { what: phrase, also }));
    }
    let aka = at.sees("called|known as|also known as|also called");
    let verb = if aka { super::copula::PLAIN } else { at.copula()? };
    Some(shaped(predicate(at, &[subject], &told, &verb)?, &verb))
}
