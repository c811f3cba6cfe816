use super::*;
use crate::answers::named::Spot;
use crate::config::Config;
use crate::edge::EdgeKind;
use crate::filter::labels::{DIRECT, Evidence, Source};
use crate::filter::particle::Edge;
use crate::language::act::Parse;
use crate::talk::ledger::Entry;
use nalgebra::Matrix3;

/// Two graphs, and a quarter of the posterior is neither.
fn torn(state: TrackState) -> Snapshot {
    let edge = Edge {
        i: 7,
        j: 41,
        kind: EdgeKind::Distance,
        i_from_j: Pose2::default(),
        covariance: Matrix3::identity(),
        question: crate::edge::QuestionId::default(),
        log_looks: 0.0,
        factor: 0,
    };
    let mut filter = Filter::new(Config::default());
    let other = Particle { log_weight: 0.4_f64.ln(), ..Particle::empty() };
    let best = Particle { edges: Arc::new(vec![edge]), log_weight: 0.6_f64.ln(), ..Particle::empty() };
    filter.particles = vec![best, other];
    let now = Now { robot: Some(Pose2::default()), state, epoch: 0, rev: 0 };
    Snapshot {
        unresolved: 0.25,
        ..Snapshot::new(&filter, Arc::default(), Shared::default(), Vec::new(), now)
    }
}

#[test]
fn weights_sum_to_one_with_what_is_unresolved() {
    let graph = torn(TrackState::Mapping).graph();
    let weights: Vec<f64> = graph.particles.iter().map(|p| p.weight).collect();
    assert!((weights[0] - 0.45).abs() < 1e-12 && (weights[1] - 0.3).abs() < 1e-12, "{weights:?}");
    assert!((weights.iter().sum::<f64>() + graph.unresolved - 1.0).abs() < 1e-12);
    assert_eq!(graph.differences[0].words, "place 41 is place 7 again");
    assert!((graph.differences[1].weight - 0.3).abs() < 1e-12);
}

#[test]
fn an_answer_leaves_what_is_unresolved_to_nowhere() {
    let answer = torn(TrackState::Doubtful).where_is("gym", None);
    assert_eq!((answer.p_none, answer.unresolved), (1.0, 0.25));
}

#[test]
fn only_who_is_lost_is_nowhere() {
    for (state, known) in
        [(TrackState::Mapping, true), (TrackState::Doubtful, true), (TrackState::Lost, false)]
    {
        assert_eq!(torn(state).where_is("gym", None).robot.is_some(), known);
    }
}

#[test]
fn where_am_i_asks_for_the_robot_and_nothing_else_does() {
    for (text, of_robot) in [
        ("where am I", true),
        ("where are we?", true),
        ("where is the nearest gym?", true),
        ("where is the gym", false),
        ("gym", false),
        ("how do I get to the library from here", false),
    ] {
        assert_eq!(torn(TrackState::Lost).is_of_robot(text, None), of_robot, "{text}");
    }
}

#[test]
fn a_question_says_how_what_is_asked_for_lies() {
    let map = torn(TrackState::Mapping);
    for (text, name, within, nearest) in [
        ("gym", "gym", 0, false),
        ("where is the gym?", "gym", 0, false),
        ("where is the bathroom next to the lounge?", "bathroom", 1, false),
        ("the bathroom next to the lounge", "bathroom", 1, false),
        ("where is the nearest bathroom?", "bathroom", 0, true),
    ] {
        let asked = map.asked(text, None).unwrap();
        assert_eq!(
            (asked.name.as_str(), asked.within.len(), asked.nearest),
            (name, within, nearest),
            "{text}"
        );
    }
    assert!(map.asked("of the of", None).is_none());
}

#[test]
fn of_what_was_said_a_hundred_times_the_newest_sentences_are_reasons() {
    let mut ledger = Ledger::default();
    let mut map = torn(TrackState::Mapping);
    map.poses = vec![Pose2::default(), Pose2::new(100.0, 0.0, 0.0)];
    for k in 0..100 {
        let (id, text) = (format!("u{k}"), "this is the gym".to_owned());
        let entry = Entry { id, stamp_ns: k, text, parse: Parse::default(), held: 0, stands: true };
        let utterance = ledger.enter(entry, false);
        // Twice near, and the last elsewhere.
        for place in if k < 99 { [0, 0] } else { [1, 1] } {
            map.particles[0].labels.add(Evidence::new(utterance, 0, place, DIRECT, Source::Direct));
        }
    }
    map.ledger = Arc::new(ledger);
    let because = map.because(0, Spot::Place(0));
    assert_eq!((because.len(), because[0].as_str(), because[31].as_str()), (32, "u67", "u98"));
}
