//! "The gym is down the hall": a figure, one of the four relations, a landmark.

use super::names::Kind;
use super::noun_phrase::{Cursor, Determiner, NounPhrase};
use super::{Act, Landmark, Relation};

/// Figures of one clause ("the kitchen and the lounge are …").
const MAX_FIGURES: usize = 4;
/// Shows something that the listener need not know.
const PRESENT: &str = "there is also|there is|there are|we have|you have|you will find|you can find|you find|\
    you will see|you can see|we find";
const FOUND: &str = "can be found|is|are";

/// The acts of one clause, one per figure; none if it is no such clause.
pub(super) fn locate(at: &mut Cursor) -> Option<Vec<Act>> {
    let start = *at;
    if at.eat_any(PRESENT).is_some() {
        let figure = figure(at, true)?;
        return located(vec![figure], &ground(at)?);
    }
    if let Some(ground) = ground(at) {
        at.skip(",");
        at.eat_any(FOUND).or_else(|| at.eat_any(PRESENT))?;
        return located(vec![figure(at, true)?], &ground);
    }
    *at = start;
    let mut figures = vec![figure(at, false)?];
    while figures.len() < MAX_FIGURES && at.eat("and") {
        figures.push(figure(at, false)?);
    }
    at.eat_any(FOUND)?;
    located(figures, &ground(at)?)
}

/// What a clause may locate: no pronoun, no bare plural ("kitchens are near lounges" is generic), no
/// door, and an indefinite one only where the sentence presents it ("there is a lab …").
fn figure(at: &mut Cursor, presented: bool) -> Option<NounPhrase> {
    let phrase = at.noun_phrase()?;
    let fits = match phrase.determiner {
        Determiner::Definite => phrase.kind != Kind::No,
        Determiner::Indefinite => phrase.kind == Kind::Place && presented,
        Determiner::None => phrase.kind == Kind::Place && (presented || !phrase.plural),
        Determiner::Possessive => phrase.kind == Kind::Place,
        Determiner::Demonstrative => false,
    };
    let door = ["door", "doorway"].iter().any(|d| phrase.name.as_str().ends_with(d));
    (fits && !door).then_some(phrase)
}

/// What a figure is located by.
struct Ground {
    relation: Relation,
    landmark: Landmark,
    /// The landmark is surely a place.
    known_kind: bool,
}

fn ground(at: &mut Cursor) -> Option<Ground> {
    const RELATIONS: [(&str, Relation); 4] = [
        ("through", Relation::Through),
        ("down|along", Relation::Down),
        ("far away from|away from|far from", Relation::AwayFrom),
        ("next door to|near to|near|close to|next to|beside|by|adjacent to|around", Relation::Near),
    ];
    at.skip("both|all|located|situated|just|right|directly|back|also|over|very");
    let relation = RELATIONS.iter().find(|(phrases, _)| at.eat_any(phrases).is_some()).map(|(_, r)| *r);
    let Some(relation) = relation else {
        return at.eat("next door").then_some(Ground {
            relation: Relation::Near,
            landmark: Landmark::Here,
            known_kind: false,
        });
    };
    if at.eat_any("here|this place|this spot").is_some() {
        // One is near or away from here; "down here" says nothing of the kind.
        let metric = matches!(relation, Relation::Near | Relation::AwayFrom);
        return metric.then_some(Ground { relation, landmark: Landmark::Here, known_kind: false });
    }
    let phrase = at.noun_phrase().filter(|p| p.kind != Kind::No)?;
    // "Through the roof" is said of prices, not of rooms.
    let idiom = relation == Relation::Through && phrase.name.as_str() == "roof";
    let bare_plural = phrase.plural && phrase.determiner == Determiner::None;
    let known_kind = phrase.kind == Kind::Place;
    if idiom || bare_plural || !(known_kind || phrase.determiner == Determiner::Definite) {
        return None;
    }
    skip_side(at);
    Some(Ground { relation, landmark: Landmark::Name(phrase.name), known_kind })
}

/// "… on your left": the relation before it stands without.
fn skip_side(at: &mut Cursor) {
    let start = *at;
    at.skip(",");
    let side = at.eat_any("on|to").is_some()
        && at.eat_any("the|your|our").is_some()
        && at.eat_any("left|right").is_some();
    if side {
        at.skip("hand side|side");
    } else {
        *at = start;
    }
}

/// The acts, if the figures or the landmark surely are places.
fn located(figures: Vec<NounPhrase>, ground: &Ground) -> Option<Vec<Act>> {
    let sure = ground.known_kind || figures.iter().all(|f| f.kind == Kind::Place);
    let itself = figures.iter().any(|f| ground.landmark == Landmark::Name(f.name.clone()));
    let act = |f: NounPhrase| Act::Locate {
        figure: f.name,
        relation: ground.relation,
        landmark: ground.landmark.clone(),
    };
    (sure && !itself).then(|| figures.into_iter().map(act).collect())
}

#[cfg(test)]
mod tests {
    use super::super::parse;

    #[test]
    fn the_four_relations_are_understood() {
        for (text, notation) in [
            ("The gym is down the hallway.", "loc(gym,down,hallway)"),
            ("The gym's down the hall", "loc(gym,down,hallway)"),
            ("the mural is along the corridor", "loc(mural,down,hallway)"),
            ("The children's center is through the hallway.", "loc(children's_center,through,hallway)"),
            ("the lab is through the double doors on your left", "loc(lab,through,double_door)"),
            ("The library is near the cafe.", "loc(library,near,cafe)"),
            ("the library is located right next to the cafe", "loc(library,near,cafe)"),
            ("our lab is close to the stairs", "loc(lab,near,stairs)"),
            ("the information desk is by the main entrance", "loc(information_desk,near,main_entrance)"),
            ("the lounge is away from the hallway", "loc(lounge,away_from,hallway)"),
            ("the cafe is far from here", "loc(cafe,away_from,here)"),
            ("the kitchen is near here", "loc(kitchen,near,here)"),
            ("there's a kitchen nearby", "loc(kitchen,near,here)"),
            ("the lounge is next door", "loc(lounge,near,here)"),
            ("lecture hall 123 is down this hallway", "loc(lecture_hall_one_twenty_three,down,hallway)"),
            ("down the hall is the gym", "loc(gym,down,hallway)"),
            ("Near the elevators, you'll find a vending machine.", "loc(vending_machine,near,elevator)"),
            ("you can find the copier next to the mail room", "loc(copier,near,mail_room)"),
            ("there are restrooms near the stairs", "loc(bathroom,near,stairs)"),
            (
                "The kitchen and the lounge are both down this hallway.",
                "loc(kitchen,down,hallway)&loc(lounge,down,hallway)",
            ),
        ] {
            assert_eq!(parse(text).notation, notation, "{text}");
        }
    }

    #[test]
    fn other_relations_and_other_things_are_not() {
        for text in [
            "the restroom is past the stairs",
            "the kitchen is on your left",
            "the lab is about twenty meters down this hallway",
            "the lounge is upstairs",
            "it is down the hall",
            "he is near the kitchen",
            "kitchens are near lounges",
            "kitchens are usually near lounges",
            "the end is near",
            "the end is near here",
            "the kitchen is down",
            "the sun is down",
            "the kitten is down the hall",
            "the chair is next to the table",
            "this window is next to the bed",
            "the door is next to the bathroom",
            "the man is next to the elevator",
            "sales are through the roof",
            "the truth is far from here",
            "the party is next door",
            "the gym is down here",
            "the gym is near the gym",
            "he is down in the dumps past the point of caring",
        ] {
            assert_eq!(parse(text).notation, "none", "{text}");
        }
    }
}
