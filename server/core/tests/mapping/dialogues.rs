//! What is said over a minute: "it", "there", "the one we just left", corrections, ellipsis. Each script ends in a
//! state: which names lie where the robot was when they were said, and which are none.

use crate::tour::Tour;
use crate::where_is;
use toponym_core::effects::HeardStatus;
use toponym_core::geometry::Pose2;

/// A place is where it was said to be within this: a room.
const NEAR_M: f64 = 5.0;

/// What happens in a script.
enum Do<'a> {
    /// The guide says something.
    Say(&'a str),
    /// The robot drives on for so many seconds.
    Go(f64),
    /// This is called so later.
    Here(&'a str),
}

use Do::{Go, Here, Say};

/// Plays a script, and tells which names are not where it says or are not forgotten.
fn play(script: &[Do], gone: &[&str]) -> Vec<String> {
    let mut tour = Tour::begin();
    let mut expected: Vec<(&str, Pose2)> = Vec::new();
    let mut wrong = Vec::new();
    for event in script {
        match event {
            Say(text) => {
                let heard = tour.say(text);
                if heard.status == HeardStatus::Refused {
                    wrong.push(format!("refused: {text}"));
                }
            }
            Go(seconds) => tour.go(*seconds),
            Here(name) => expected.push((name, tour.mapper.snapshot().robot().expect("a pose"))),
        }
    }
    for (name, pose) in expected {
        let found = where_is(&tour.mapper, name);
        let is_there = |c: &&toponym_core::answers::query::Candidate| c.pose.distance_m(&pose) < NEAR_M;
        let p: f64 = found.candidates.iter().filter(is_there).map(|c| c.probability).sum();
        if p < 0.5 || found.via != "exact" {
            wrong.push(format!("{name}: {p:.2} there, {found:?}"));
        }
    }
    for name in gone {
        let found = where_is(&tour.mapper, name);
        let is_it = |c: &toponym_core::answers::query::Candidate| c.label == *name && c.p_is > 0.3;
        if found.candidates.iter().any(is_it) {
            wrong.push(format!("{name} is not gone"));
        }
    }
    wrong
}

#[track_caller]
fn ends_right(script: &[Do], gone: &[&str]) {
    let wrong = play(script, gone);
    assert!(wrong.is_empty(), "{wrong:#?}");
}

#[test]
fn it_is_called_something_else_too() {
    ends_right(
        &[
            Say("this is the cafeteria"),
            Here("cafeteria"),
            Say("we also call it the trough"),
            Here("trough"),
            Go(15.0),
        ],
        &[],
    );
}

#[test]
fn a_slip_of_the_tongue_is_mended_at_once() {
    ends_right(
        &[
            Say("ok so here we have the library"),
            Here("reading room"),
            Go(1.0),
            Say("no wait, the reading room"),
            Go(12.0),
        ],
        &["library"],
    );
}

#[test]
fn the_place_just_left_is_named_afterwards() {
    ends_right(
        &[
            Go(4.0),
            Here("print shop"),
            Go(7.0),
            Say("oh and the room we just left is the print shop"),
            Go(5.0),
        ],
        &[],
    );
}

#[test]
fn scratch_that_and_say_it_anew() {
    ends_right(
        &[
            Say("This is the chemistry lab."),
            Go(1.0),
            Say("Scratch that."),
            Say("It's the physics lab."),
            Here("physics lab"),
            Go(10.0),
        ],
        &["chemistry lab"],
    );
}

#[test]
fn i_said_one_and_meant_another() {
    ends_right(
        &[
            Say("we're in the boardroom now"),
            Here("break room"),
            Go(2.0),
            Say("sorry, I said boardroom, I meant break room"),
            Go(12.0),
        ],
        &["board room"],
    );
}

#[test]
fn two_sentences_in_one_breath() {
    ends_right(
        &[
            Say("This is the workshop. People also call it the shed."),
            Here("workshop"),
            Here("shed"),
            Go(20.0),
            Say("and this is the pantry"),
            Here("pantry"),
        ],
        &[],
    );
}

#[test]
fn back_again_and_not_another_one() {
    ends_right(
        &[
            Say("this is the atrium"),
            Here("atrium"),
            Go(10.0),
            Say("here's the gym"),
            Here("gym"),
            Go(8.0),
            Say("this isn't the gym any more, it's the changing room"),
            Here("changing room"),
        ],
        &[],
    );
}

#[test]
fn what_it_lies_next_to_is_told_later() {
    ends_right(
        &[
            Say("this is the canteen"),
            Here("canteen"),
            Say("the servery is down the hall, and the larder too"),
            Go(12.0),
            Say("right, this is the servery"),
            Here("servery"),
            Go(12.0),
            Say("this is the foundry"),
            Here("foundry"),
        ],
        &[],
    );
}

#[test]
fn a_yes_settles_what_was_misheard() {
    ends_right(
        &[
            Say("this is the sever room"),
            Here("server room"),
            Say("yeah"),
            Go(12.0),
            Say("and that's the end of the tour"),
        ],
        &["sever room"],
    );
}

#[test]
fn a_question_in_the_middle_changes_nothing() {
    ends_right(
        &[
            Say("So this here is the studio."),
            Here("studio"),
            Go(10.0),
            Say("where was the studio again?"),
            Say("right, and we're standing in the chapel"),
            Here("chapel"),
            Say("isn't it lovely?"),
        ],
        &[],
    );
}

#[test]
fn a_correction_after_a_while_takes_back_what_was_said_here() {
    ends_right(
        &[
            Say("that's the dining hall we're in"),
            Here("assembly hall"),
            Go(2.0),
            Say("hang on, not the dining hall, it's the assembly hall"),
            Go(10.0),
            Say("this one is the dining hall"),
            Here("dining hall"),
        ],
        &[],
    );
}

#[test]
fn undone_by_no_in_the_next_breath() {
    ends_right(
        &[
            Say("this must be the crypt"),
            Go(2.0),
            Say("actually no, this is not the crypt"),
            Go(8.0),
            Say("here we go, this is the crypt"),
            Here("crypt"),
        ],
        &[],
    );
}
#[test]
fn what_is_left_out_was_said_before() {
    let mut tour = Tour::begin();
    tour.say("the library is down the hall");
    let heard = tour.say("and the gym too");
    assert_eq!((heard.status, heard.parse.as_str()), (HeardStatus::Understood, "loc(gym,down,hallway)"));
}
