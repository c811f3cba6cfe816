//! What a guide is asked, what is answered, and what boredal sentences say together.

use crate::tour::{SECOND_NS, Tour};
use crate::where_is;
use crate::world::say;
use toponym_core::effects::HeardStatus;

#[test]
fn a_name_that_sounds_like_another_is_asked_about() {
    for (reply, board, bored) in [("yes", true, false), ("no", false, true), ("the board room", true, false)]
    {
        let mut tour = Tour::begin();
        let asked = tour.say("this is the bored room");
        assert_eq!(asked.status, HeardStatus::Asked, "{asked:?}");
        assert!(asked.question.as_ref().unwrap().contains("Did you mean the board room?"), "{asked:?}");
        // Until then it is taken in as what it may be.
        let (board_p, bored_p) = (tour.p("board room"), tour.p("bored room"));
        assert!((board_p - 0.7).abs() < 0.15 && (bored_p - 0.25).abs() < 0.15, "{board_p} {bored_p}");
        let answered = tour.answer(&asked, reply);
        assert_eq!(answered.status, HeardStatus::Understood, "{answered:?}");
        assert_eq!((tour.p("board room") > 0.8, tour.p("bored room") > 0.8), (board, bored), "{reply}");
        assert_eq!((tour.p("board room") < 0.1, tour.p("bored room") < 0.1), (bored, board), "{reply}");
    }
}

#[test]
fn what_is_known_here_is_not_asked_about_again() {
    let mut tour = Tour::begin();
    let asked = tour.say("this is the bored room");
    tour.say("no");
    assert_eq!(tour.say("this is the bored room").status, HeardStatus::Understood);
    // The same sentence again asks no second time.
    let again = tour.send(say(&asked.id, "this is the bored room", tour.now_ns));
    assert_eq!(again.status, HeardStatus::Understood, "{again:?}");
}

#[test]
fn another_name_for_what_is_near_is_asked_about() {
    let mut tour = Tour::begin();
    tour.say("this is the lobby");
    let asked = tour.say("this is the foyer");
    assert!(asked.words.contains("the same place as the lobby"), "{asked:?}");
    tour.say("yes it is");
    assert_eq!(where_is(&tour.mapper, "foyer").label.as_deref(), Some("foyer"));
    assert_eq!(where_is(&tour.mapper, "foyer").candidates[0].label, "lobby");
}

#[test]
fn undo_takes_back_what_was_just_said_and_asks_if_that_is_long_ago() {
    let mut tour = Tour::begin();
    tour.say("this is the kitchen");
    tour.go(5.0);
    assert!(tour.say("scratch that").words.contains("I took back: \"this is the kitchen\""));
    assert!(tour.p("kitchen") < 0.01);
    assert_eq!(tour.say("undo").status, HeardStatus::NotUnderstood);
    tour.say("this is the gym");
    tour.now_ns += 200 * SECOND_NS;
    let asked = tour.say("undo that");
    assert!(asked.status == HeardStatus::Asked && asked.words.contains("3 minutes ago"), "{asked:?}");
    assert!(tour.p("gym") > 0.8);
    tour.answer(&asked, "no");
    assert!(tour.p("gym") > 0.8);
    let asked = tour.say("undo that");
    tour.answer(&asked, "yes please");
    assert!(tour.p("gym") < 0.01);
}

#[test]
fn a_yes_to_nothing_changes_nothing() {
    let mut tour = Tour::begin();
    assert_eq!(tour.say("yes").status, HeardStatus::NotUnderstood);
    let asked = tour.say("this is the bored room");
    tour.now_ns += 120 * SECOND_NS;
    assert_eq!(tour.say("yes").status, HeardStatus::NotUnderstood, "too late without an id");
    assert_eq!(tour.answer(&asked, "yes").status, HeardStatus::Understood);
}

#[test]
fn a_guide_who_asks_gets_an_answer_from_the_map() {
    let mut tour = Tour::begin();
    tour.say("this is Anna's Office");
    assert!(
        tour.say("where am I?").words.contains("This is Anna's Office"),
        "{}",
        tour.say("where am I?").words
    );
    assert!(tour.say("is this anna's office").words.starts_with("Yes"));
    tour.go(20.0);
    let told = tour.say("where is Anna's office?").words;
    assert!(told.starts_with("Anna's Office is some ") && told.contains(" m from here, "), "{told}");
    assert!(tour.say("is this anna's office?").words.starts_with("Not that I know"));
    assert!(tour.say("where is the gym?").words.contains("Nobody told me of the gym"));
    let far = tour.say("how far is it to anna's office").words;
    assert!(far.contains(" m from here"), "{far}");
}

#[test]
fn names_are_found_by_their_kind_with_less_certainty() {
    let mut tour = Tour::begin();
    tour.say("this is the old archive");
    let (own, kind) = (where_is(&tour.mapper, "old archive"), where_is(&tour.mapper, "archive"));
    assert_eq!((own.via.as_str(), kind.via.as_str()), ("exact", "kind"));
    assert!(
        kind.candidates[0].probability < own.candidates[0].probability
            && kind.candidates[0].probability > 0.5
    );
    let sum = kind.p_none + kind.candidates.iter().map(|c| c.probability).sum::<f64>();
    assert!((sum - 1.0).abs() < 1e-9);
    assert_eq!(where_is(&tour.mapper, "old archives").via, "exact");
    assert_eq!(where_is(&tour.mapper, "attic").via, "unknown");
}
