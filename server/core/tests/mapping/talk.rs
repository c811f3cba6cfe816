//! What is said, taken back, corrected and mended.

use crate::world::{drive, events, laser, say};
use crate::{run, where_is};
use toponym_core::config::Rules;
use toponym_core::effects::{Effect, HeardStatus};
use toponym_core::event::{Command, Event};
use toponym_core::{Config, Mapper};

/// A quarter of a lap with sentences (number of the scan, text, id of one taken back).
fn told_by(config: Config, said: &[(usize, &str, Option<&str>)]) -> Mapper {
    let mut all = events(&drive(1)[..120], &laser(), &[]);
    for (k, &(scan, text, retracts)) in said.iter().enumerate().rev() {
        let stamp_ns = scan as i64 * 200_000_000;
        let after = |e: &Event| matches!(e, Event::Scan(s) if s.stamp_ns > stamp_ns);
        let at = all.iter().position(after).unwrap_or(all.len());
        let mut said = say(&format!("u{k}"), text, stamp_ns);
        said.retracts = retracts.map(Into::into);
        all.insert(at, Event::Utterance(said));
    }
    let mut mapper = Mapper::new(config);
    run(&mut mapper, &all);
    mapper.step(Event::Flush);
    mapper
}

fn told(said: &[(usize, &str, Option<&str>)]) -> Mapper {
    told_by(Config::default(), said)
}

fn mend(mapper: &mut Mapper, command: Command) -> Result<String, String> {
    match mapper.step(Event::Command(command)).into_iter().next() {
        Some(Effect::Mended(done)) => done,
        other => panic!("{other:?}"),
    }
}

fn undo(mapper: &mut Mapper, id: Option<&str>) -> Result<String, String> {
    mend(mapper, Command::Undo { utterance: id.map(Into::into) })
}

fn p_is(mapper: &Mapper, name: &str) -> f64 {
    where_is(mapper, name).candidates.first().map_or(0.0, |c| c.p_is)
}

const KITCHEN: (usize, &str, Option<&str>) = (30, "this is the kitchen", None);

#[test]
fn what_was_taken_back_was_never_said() {
    let mut never = told(&[KITCHEN]);
    let mut mapper =
        told(&[KITCHEN, (60, "this is the gym", None), (90, "the lounge is near the gym", None)]);
    assert!(undo(&mut mapper, None).unwrap().contains("lounge"));
    assert!(undo(&mut mapper, Some("u1")).is_ok());
    let state = |m: &Mapper| (m.snapshot().labels(), m.snapshot().graph().places);
    assert_eq!(state(&mapper), state(&never));
    let weights = |m: &Mapper| m.snapshot().graph().particles.iter().map(|p| p.weight).collect::<Vec<_>>();
    let (got, want) = (weights(&mapper), weights(&never));
    assert!(got.len() == want.len() && got.iter().zip(&want).all(|(a, b)| (a - b).abs() < 1e-9));
    assert!((p_is(&mapper, "kitchen") - p_is(&never, "kitchen")).abs() < 1e-9);
    assert!(undo(&mut mapper, Some("u1")).unwrap_err().contains("before"));
    assert!(undo(&mut never, None).is_ok() && undo(&mut never, None).is_err());
}

#[test]
fn a_sentence_may_take_another_back() {
    let mapper = told(&[KITCHEN, (33, "this is the gym", Some("u0"))]);
    assert!(p_is(&mapper, "kitchen") < 0.01 && p_is(&mapper, "gym") > 0.8);
}

#[test]
fn a_renamed_place_is_found_by_either_name() {
    let mut mapper = told(&[(30, "this is the kitchen", None)]);
    let rename = |from: &str, to: &str| Command::Rename { from: from.into(), to: to.into() };
    assert!(mend(&mut mapper, rename("kitchen", "galley")).is_ok());
    assert!(p_is(&mapper, "galley") > 0.7 && p_is(&mapper, "kitchen") > 0.7);
    assert_eq!(where_is(&mapper, "kitchen").candidates[0].label, "galley");
    assert!(mend(&mut mapper, rename("nowhere", "galley")).is_err());
    assert!(mend(&mut mapper, rename("galley", "the galley")).is_err());
}

#[test]
fn a_forgotten_name_may_be_taught_again() {
    let mut mapper = told(&[KITCHEN]);
    assert!(mend(&mut mapper, Command::Forget { name: "kitchen".into() }).is_ok());
    assert!(where_is(&mapper, "kitchen").candidates.is_empty());
    mapper.step(Event::Utterance(say("again", "this is the kitchen", 20_000_000_000)));
    assert!(p_is(&mapper, "kitchen") > 0.8);
    assert!(mend(&mut mapper, Command::Forget { name: "attic".into() }).is_err());
}

#[test]
fn a_landmark_named_later_makes_sense_of_what_was_said_before() {
    let before = [(20, "the lounge is near the gym", None)];
    assert!(where_is(&told(&before), "lounge").candidates.is_empty());
    let later = told(&[before[0], (60, "this is the gym", None)]);
    let (lounge, gym) = (where_is(&later, "lounge"), where_is(&later, "gym"));
    assert!(lounge.candidates[0].pose.distance_m(&gym.candidates[0].pose) < 8.0);
}

#[test]
fn an_unknown_landmark_is_told_and_kept_for_later() {
    let mut mapper = told(&[KITCHEN]);
    let effects = mapper.step(Event::Utterance(say("new", "the lounge is near the gym", 20_000_000_000)));
    let Some(Effect::Heard(heard)) = effects.first() else { panic!("{effects:?}") };
    assert_eq!(heard.status, HeardStatus::Understood);
    assert!(heard.words.contains("I don't know of a gym yet"), "{}", heard.words);
}

#[test]
fn a_correction_takes_back_exactly_what_it_corrects() {
    let corrected = told(&[KITCHEN, (33, "no, this is the gym, not the kitchen", None)]);
    assert!(where_is(&corrected, "kitchen").candidates.is_empty());
    assert!(p_is(&corrected, "gym") > 0.7);
    // By the paper's rules nothing is taken back.
    let paper = Config { rules: Rules::Paper, ..Config::default() };
    let mapper = told_by(paper, &[KITCHEN, (33, "no, this is the gym, not the kitchen", None)]);
    assert!(p_is(&mapper, "kitchen") > 0.7);
}

#[test]
fn what_is_denied_is_not_so() {
    let denied = told(&[KITCHEN, (33, "this is not the kitchen", None)]);
    assert!(p_is(&denied, "kitchen") < 0.3, "{}", p_is(&denied, "kitchen"));
}

#[test]
fn doubt_makes_a_name_less_sure() {
    let sure = p_is(&told(&[KITCHEN]), "kitchen");
    let doubted = p_is(&told(&[(30, "I think this is the kitchen", None)]), "kitchen");
    assert!(0.2 < doubted && doubted < sure - 0.02, "{doubted} {sure}");
}

#[test]
fn another_name_of_a_place_is_understood() {
    let mapper = told(&[KITCHEN, (60, "the kitchen is also called the galley", None)]);
    assert!(p_is(&mapper, "galley") > 0.7);
}

#[test]
fn the_papers_rules_ground_once() {
    let said = [(20, "the lounge is near the gym", None), (60, "this is the gym", None)];
    let paper = Config { rules: Rules::Paper, ..Config::default() };
    assert!(where_is(&told_by(paper, &said), "lounge").candidates.is_empty());
}

/// Two laps in which only names propose loops, the same place called differently in each.
fn named_apart(rules: Rules, said: &[(usize, &str)]) -> Mapper {
    let mut mapper = Mapper::new(Config { gamma_per_m2: 1e9, rules, ..Config::default() });
    run(&mut mapper, &events(&drive(2), &laser(), said));
    mapper.step(Event::Flush);
    mapper
}

fn edges(mapper: &Mapper) -> usize {
    mapper.snapshot().graph().particles[0].edges.len()
}

#[test]
fn names_that_come_late_propose_the_edge_between_two_visits_long_past() {
    let lap = drive(2).len() / 2;
    let said = [(40, "this is the kitchen"), (lap + 40, "this is the bistro")];
    let late = (lap + 200, "the kitchen is also called the bistro");
    assert_eq!(edges(&named_apart(Rules::Toponym, &said)), 0);
    let mapper = named_apart(Rules::Toponym, &[said[0], said[1], late]);
    assert!(edges(&mapper) > 0);
    for rules in [Rules::Toponym, Rules::Paper] {
        let mut desk = named_apart(rules, &said);
        let rename = Command::Rename { from: "bistro".into(), to: "kitchen".into() };
        assert!(mend(&mut desk, rename).is_ok());
        desk.step(Event::Flush);
        assert_eq!(edges(&desk) > 0, rules == Rules::Toponym, "renamed at a desk");
    }
}

#[test]
fn what_can_be_put_nowhere_is_told() {
    let mut mapper = told(&[KITCHEN]);
    let later = |k: i64| (120 + k) * 200_000_000 + 100_000_000_000;
    let mut reply = |k, text: &str| {
        let effects = mapper.step(Event::Utterance(say(&format!("late{k}"), text, later(k))));
        let words = |e| if let Effect::Heard(h) = e { Some(h.words) } else { None };
        effects.into_iter().find_map(words).unwrap()
    };
    assert!(reply(0, "it is next to the gym").contains("name it"));
    assert!(reply(1, "this is where we keep the printers").contains("no name"));
    assert!(!reply(2, "the lounge is next to the kitchen").contains("But"));
    assert!(reply(3, "it is across from the gym").contains("the lounge is across from the gym"));
}
