//! "This is the gym", "we are back in the lobby": names given to places.

use crate::language::act::{Content, Head, Phrase, Sameness};
use crate::language::grammar::build::{Readings, negate, one};
use crate::language::grammar::copula::{EVEN, LIKELY};
use crate::language::grammar::cursor::Cursor;
use crate::language::grammar::naming::{SPOT, called, named, plausible};
use crate::language::grammar::noun_phrase::Determiner;
use crate::language::grammar::pointed::{pointed, related_predicate, same_place};
use crate::language::lexicon::names::Kind;

/// Reads a clause that names a place pointed at, or says where it lies.
pub(crate) fn label_clause(at: &mut Cursor) -> Option<Readings> {
    let start = *at;
    for form in [welcome, people_call, presented_here, passed, returned, pointed, we_are] {
        if let Some(readings) = form(at) {
            return Some(readings);
        }
        *at = start;
    }
    None
}

/// "Welcome to the lab".
fn welcome(at: &mut Cursor) -> Option<Readings> {
    let again = at.eat_any("welcome back to|welcome to")?.contains("back");
    let phrase = named(at).filter(|p| p.kind == Kind::Place)?;
    Some(called(at, Head::Here, phrase, again))
}

/// "They call this place the Z-center", "we call it the fishbowl".
fn people_call(at: &mut Cursor) -> Option<Readings> {
    let named_group = at.eat_any("the students|the staff|the faculty|the locals|the grad students|the undergrads|\
        some people|most people|some of us|most of us|lots of people|a lot of people|many people|folks around here|\
        people around here|people here|everyone here|everybody here|folks here");
    if named_group.is_none() {
        at.eat_any("we|they|people|everyone|everybody|students|folks|i|you can|you")?;
    }
    at.skip("all|also|usually|just|like to|always|sometimes|often|normally|would|could|tend to|generally");
    at.eat_any("call|calls|refer to|refers to|know|named|nicknamed|have named|have nicknamed|dubbed|christened|baptized")?;
    let spot = at.eat_any(SPOT).is_some();
    if spot || at.eat_any("this|these").is_some() {
        at.eat("as");
        let phrase = named(at).filter(|p| spot || plausible(p))?;
        return Some(called(at, Head::Here, phrase, false));
    }
    let what = if at.eat_any("it|that").is_some() {
        Phrase::new(Head::It)
    } else {
        let what =
            at.noun_phrase().filter(|p| p.kind == Kind::Place && p.determiner != Determiner::Indefinite)?;
        what.phrase
    };
    at.eat("as");
    let also = named(at).filter(|p| what.head != Head::It || plausible(p))?;
    Some(one(Content::Alias { what, also: also.phrase }))
}

/// "Here we have the kitchen", "we have reached the lobby".
fn presented_here(at: &mut Cursor) -> Option<Readings> {
    let named_so = at.eat_each(&["the", "name of|name for", SPOT_OR_IT, "is|would be"]);
    let shown = named_so
        || at.eat_each(&["over here|right here|here", "we|you", "have|can see|see|will find|will see|find"])
        || at.eat_each(&["over here", "is"])
        || at.eat_each(&["we|you", "have|are|just", SO_FAR, SO_FAR, ARRIVED])
        || at.eat_each(&["we|you|i", "are", SO_FAR, "looking at|seeing|facing here", "here|"])
        || at.eat_each(&[
            "what",
            "we|you|i",
            "are looking at|are seeing|are standing in|are in|see|have",
            "here|",
            "is",
        ]);
    let phrase = shown.then(|| named(at))?.filter(|p| named_so || plausible(p))?;
    Some(called(at, Head::Here, phrase, false))
}

/// What leaves a place behind one.
pub(crate) const LEFT_BEHIND: &str = "passed by|passed through|passed|left behind|left|come from|come out of|come through|\
    came from|came out of|came through|walked past|walked by|walked through|walked out of|went past|went by|\
    went through|gone past|gone by|gone through|exited|visited|saw|seen|in|at";
/// Adverbs between "we have" and what was done.
const SO_FAR: &str = "now|just|finally|already|all|at last|also|currently|";
/// What brings one into a place.
const ARRIVED: &str = "reached|entered|come to|come into|arrived at|arrived in|walked into|stepped into|made it to|\
    got to|gotten to|reaching|entering|coming into|walking into|stepping into|arriving at|arriving in|\
    passing through|walking through|moving through|walking down|walking along|crossing";
/// "This place", "it", as what has a name.
const SPOT_OR_IT: &str =
    "this place|this room|this area|this space|this spot|this building|this location|this one|this";

/// "We have returned to the lobby".
fn returned(at: &mut Cursor) -> Option<Readings> {
    at.eat_each(&["we|you", "have|are|", SO_FAR]).then_some(())?;
    at.eat_any(
        "returned to|made it back to|got back to|gotten back to|returning to|came back to|come back to|gone back to|\
         went back to|circled back to|looped back to|ended up back at|ended up back in|wound up back at|wound up back in|\
         come full circle to|come full circle back to|ended up at|ended up in",
    )?;
    if let Some(like) = at.pointer() {
        let start = like.head == Head::Start;
        return start.then(|| one(Content::Same { what: Phrase::new(Head::Here), like, same: true }));
    }
    let phrase = named(at).filter(plausible)?;
    Some(called(at, Head::Here, phrase, true))
}

/// "We just passed the library".
fn passed(at: &mut Cursor) -> Option<Readings> {
    let just = at.eat_each(&["we|you|i", "have just|just|were just", LEFT_BEHIND]);
    let phrase = just.then(|| named(at))?.filter(plausible)?;
    Some(called(at, Head::Previous, phrase, false))
}

/// "We are back in the gym", "we are next to the gym", "we have been here before".
fn we_are(at: &mut Cursor) -> Option<Readings> {
    if let Some(same) = been(at) {
        return Some(one(been_here(same)));
    }
    if at.eat_any("this is a new place|this is somewhere new").is_some() {
        return Some(one(been_here(false)));
    }
    let doubtful = at.eat_each(&["we|you", "might|may|could", "now|", "be"]).then_some(EVEN).or_else(|| {
        // "You should be at the door" is said of where the way will lead.
        let likely = at.eat_each(&["we", "must|should|seem to|appear to", "now|", "be"])
            || at.eat_each(&["looks like|it looks like|seems like", "we|you", "are"]);
        likely.then_some(LIKELY)
    });
    let who = at.eat_any(
        "here we are|now we are|and now we are|we are|you are|i am|we have arrived|we have now arrived|we have just arrived|\
         we just arrived|you have arrived|we have come|we have just come|we find ourselves|the robot is|we have ended up|we ended up",
    );
    let said_who = who.is_some() || doubtful.is_some();
    // "Back at the lobby" does without.
    if !said_who && at.peek(0) != "back" {
        return None;
    }
    let (mut back, mut inside, mut denied, mut unsure) = (false, false, false, false);
    loop {
        if at.eat_any("back|again|once again|still").is_some() {
            back = true;
        } else if at.eat_any("no longer|not").is_some() {
            denied = true;
        } else if at.eat_any("inside of|inside").is_some() {
            inside = true;
        } else if at.eat_any("probably|most likely|likely|maybe|perhaps|i think|i believe").is_some() {
            unsure = true;
        } else if at
            .eat_any("now|here|right|all|just|finally|currently|standing|sitting|located|already|at last|actually|really|definitely|basically|obviously")
            .is_none()
        {
            break;
        }
    }
    let start = *at;
    let alone = who == Some("i am");
    if let Some(same) = same_place(at, &Head::Here).filter(|_| !alone) {
        return Some(one(if denied { negate(same) } else { same }));
    }
    *at = start;
    let readings = inside_of(at, back, inside, said_who).or_else(|| {
        *at = start;
        (!alone && !inside).then(|| related_predicate(at, Head::Here)).flatten()
    })?;
    // "We aren't back at the lobby": not there, be it another lobby or none.
    let certainty = readings.certainty * doubtful.unwrap_or(1.0) * if unsure { LIKELY } else { 1.0 };
    let readings = Readings { certainty, ..readings };
    Some(if denied { readings.map(plain).map(negate) } else { readings })
}

/// "We have been here before" (true), "we have never been in this room" (false).
fn been(at: &mut Cursor) -> Option<bool> {
    let start = *at;
    let who = "we|you|i";
    let here = "here|in here|in this room|in this place|in this hallway|in this area|to this room|to this place|at this place|\
        through here|through this room|by here|past here|this way|down here|down this hallway|down this hall|on this floor";
    let before = "before|already|earlier|once before|once already|a minute ago|a moment ago|a while ago|a second ago|\
        a few minutes ago|just now|at the start|last time";
    let seen = "seen|visited|passed|passed by|been to";
    let spot = "this place|this room|this area|this hallway|this one|this spot|this";
    let said = at.eat_each(&[
        who,
        "have|were",
        "already|all|definitely|actually|",
        "been|come|walked|gone|passed|",
        here,
        before,
    ]) || at.eat_each(&[who, "were|have", "already|", "been|", here])
        && matches!(start.peek(2), "already")
        || at.eat_each(&[who, "have", "already|definitely|", seen, spot, before])
        || at.eat_each(&[
            who,
            "already",
            "passed|passed by|saw|visited|came past|came by|went past|went by",
            spot,
        ])
        || at.eat_each(&[
            who,
            "passed|passed by|saw|visited|came past|came by|went past|went by",
            spot,
            before,
        ])
        || at.eat_each(&[
            "this is",
            "somewhere|a place|a room",
            "that|",
            who,
            "have",
            "already|",
            "been|been to|been in|seen|visited",
            "before|already|",
        ]);
    if said {
        return Some(true);
    }
    *at = start;
    let never = at.eat_each(&[
        who,
        "have|were",
        "not|never",
        "yet|ever|actually|",
        "been|come|",
        here,
        "before|yet|until now|",
    ]) || at.eat_each(&[who, "have", "not|never", seen, spot, "before|yet|"]);
    never.then_some(false)
}

/// Without what is said of having been there before.
fn plain(content: Content) -> Content {
    match content {
        Content::Label { at, what, .. } => Content::Label { at, what, sameness: Sameness::Open },
        other => other,
    }
}

fn been_here(same: bool) -> Content {
    Content::Same { what: Phrase::new(Head::Here), like: Phrase::new(Head::Visited), same }
}

/// "In the gym", after "we are".
fn inside_of(at: &mut Cursor, back: bool, inside: bool, said_who: bool) -> Option<Readings> {
    at.eat_any("in the middle of|in the heart of|in the center of|right in the middle of")
        .filter(|_| at.sees("the|our|a"));
    let middle = at.before() == "of";
    let on = at.eat("on");
    if !(on || inside || middle || at.eat_any("in|at|by").is_some() || (back && said_who && at.eat("to"))) {
        return None;
    }
    // "On the terrace", but not "on the same page".
    let phrase = named(at).filter(|p| plausible(p) && (!on || p.kind == Kind::Place))?;
    Some(called(at, Head::Here, phrase, back))
}
