use super::*;
use crate::filter::labels::Spot;
use crate::filter::naming::FALSE_TALK;
use crate::geometry::Pose2;
use crate::language::Name;
use crate::language::act::Parse;
use crate::smoothing::Structure;
use crate::talk::Here;
use crate::talk::ledger::Entry;
use nalgebra::Matrix3;
use proptest::prelude::*;
use std::sync::Arc;

/// A particle whose places lie where told, metres along x.
fn map(x_m: &[f64]) -> Particle {
    let mut structure = Structure::new();
    let mut before_m = x_m[0];
    for &x_m in x_m {
        structure.add_pose(Pose2::new(x_m - before_m, 0.0, 0.0), &(Matrix3::identity() * 1e4)).unwrap();
        before_m = x_m;
    }
    structure.arrange();
    let mut particle = Particle::empty();
    particle.update(&structure).unwrap();
    particle
}

impl Talk {
    /// Enters an utterance of one sure reading.
    fn claim(&mut self, best: &Particle, claims: &[Claim]) -> u32 {
        self.claim_by(best, vec![(1.0, claims.iter().map(|&c| (1.0, c)).collect())])
    }

    fn claim_from(&mut self, best: &Particle, held: Vertex, claims: &[Claim]) -> u32 {
        self.claim_at(best, held, vec![(1.0, claims.iter().map(|&c| (1.0, c)).collect())])
    }

    fn claim_by(&mut self, best: &Particle, readings: Vec<(f64, Vec<(f64, Claim)>)>) -> u32 {
        self.claim_at(best, 0, readings)
    }

    fn claim_at(&mut self, best: &Particle, held: Vertex, readings: Vec<(f64, Vec<(f64, Claim)>)>) -> u32 {
        let number = self.ledger.entries().len() as u32;
        let entry = Entry {
            id: number.to_string(),
            stamp_ns: 0,
            text: String::new(),
            parse: Parse::default(),
            held,
            stands: true,
        };
        Arc::make_mut(&mut self.ledger).enter(entry, false);
        let readings = readings.into_iter().map(|(weight, claims)| Claims { weight, claims }).collect();
        let here =
            Here { held: None, poses: &|p| p.belief.poses(), path_m: vec![], part: vec![], dark: vec![] };
        self.testimonies.add(Testimony { utterance: number, readings }, best, &here);
        number
    }

    fn name(&mut self, k: u32) -> LabelId {
        Arc::make_mut(&mut self.ledger).enter_name(&Name::new(&format!("room {k}")).unwrap())
    }
}

fn called(place: Vertex, said: LabelId) -> Claim {
    Claim::Called { place, said, again: Sameness::Open }
}

/// The gym at place 0, the kitchen 50 m on, and what a third claim says of place 2 at `x_m`.
fn third(x_m: f64, claim: Claim) -> f64 {
    let (mut talk, map) = (Talk::default(), map(&[0.0, 50.0, x_m]));
    let (gym, kitchen) = (talk.name(0), talk.name(1));
    talk.claim(&map, &[called(0, gym)]);
    talk.claim(&map, &[called(1, kitchen)]);
    let before = log_likelihood(&talk, &Graph::default(), &map);
    assert!(before.abs() < 1e-12, "new places are called anything");
    talk.claim(&map, &[claim]);
    log_likelihood(&talk, &Graph::default(), &map)
}

fn gym(x_m: f64, again: Sameness) -> f64 {
    third(x_m, Claim::Called { place: 2, said: 0, again })
}

#[test]
fn a_name_speaks_for_the_map_in_which_it_was_said_nearby() {
    let there = gym(1.0, Sameness::Open);
    assert!((3.5..4.9).contains(&there), "{there}");
    assert!(gym(25.0, Sameness::Open).abs() < 1e-6);
    assert!(gym(50.0, Sameness::Open) < -0.4, "that is the kitchen");
    assert!(gym(50.0, Sameness::Open) > FALSE_TALK.ln(), "talk may be false");
}

#[test]
fn where_somebody_sees_the_robot_speaks_for_the_maps_that_have_it_there() {
    let at = |off_m: f64| {
        let map_from_place = Pose2::new(25.0 + off_m, 0.0, 0.0);
        third(25.0, Claim::At { place: 2, map_from_place, sigma: [0.5, 0.26] })
    };
    // One place in so many of a building's floor, and of its headings.
    let peak = SITE_M2 / (TAU * 0.25) * TAU.sqrt() / 0.26;
    assert!((at(0.0) - unless_false(peak).ln()).abs() < 1e-9);
    assert!((at(0.5) - unless_false(peak * (-0.5_f64).exp()).ln()).abs() < 1e-9);
    assert!((at(20.0) - FALSE_TALK.ln()).abs() < 1e-9, "the finger may err");
}

#[test]
fn the_same_again_and_another_one_say_opposite_things() {
    assert!(gym(1.0, Sameness::Same) > 3.0);
    // Another of its kind may be meant.
    assert!((FALSE_TALK.ln()..-0.5).contains(&gym(25.0, Sameness::Same)));
    assert!(gym(1.0, Sameness::Other) < -1.0 && gym(25.0, Sameness::Other).abs() < 1e-6);
    assert!(gym(50.0, Sameness::Other) < -1.0 && gym(1.0, Sameness::Same) > gym(1.0, Sameness::Open) + 0.3);
}

#[test]
fn denial_speaks_against_the_map_in_which_it_was_said_nearby() {
    assert!(third(1.0, Claim::Denied { place: 2, said: 0 }) < -1.0);
    assert!(third(1.0, Claim::Denied { place: 2, said: 1 }).abs() < 1e-6);
}

#[test]
fn what_is_said_of_sameness_speaks_for_the_maps_in_which_it_is_so() {
    let started = |x_m, same| third(x_m, Claim::One { a: 2, b: 0, same });
    assert!(started(1.0, true) > 3.0 && (started(25.0, true) - FALSE_TALK.ln()).abs() < 1e-3);
    assert!(started(1.0, false) < -1.5 && started(25.0, false).abs() < 0.05);
}

#[test]
fn been_here_before_speaks_for_the_maps_that_come_back() {
    let claims = |back_m: f64, before: bool| {
        let mut x_m: Vec<f64> = (0..60).map(f64::from).collect();
        x_m.extend((0..30).map(|k| back_m + f64::from(k)));
        let (mut talk, map) = (Talk::default(), map(&x_m));
        talk.claim(&map, &[Claim::Visited { place: 89, before }]);
        log_likelihood(&talk, &Graph::default(), &map)
    };
    assert!(claims(10.0, true) > 1.0 && claims(10.0, false) < -2.0);
    assert!(claims(200.0, true) < -2.0 && claims(200.0, false) > 0.2);
}

#[test]
fn who_comes_back_over_known_floor_introduces_less() {
    let after = |back_m: f64, spoken: Vertex| {
        let mut x_m: Vec<f64> = (0..60).map(f64::from).collect();
        x_m.extend((0..30).map(|k| back_m + f64::from(k)));
        let (mut talk, map) = (Talk::default(), map(&x_m));
        let names = [0, 1, 2].map(|k| talk.name(k));
        talk.claim_from(&map, spoken, &[called(0, names[0])]);
        let before = log_likelihood(&talk, &Graph::default(), &map);
        // Said of a place that nobody spoke of, then again.
        talk.claim_from(&map, 89, &[called(89, names[1])]);
        let once = log_likelihood(&talk, &Graph::default(), &map);
        talk.claim_from(&map, 89, &[called(89, names[1])]);
        (once - before, log_likelihood(&talk, &Graph::default(), &map) - once)
    };
    let (known, new, silent) = (after(10.0, 39), after(200.0, 39), after(10.0, 0));
    assert!((known.0 - new.0 - INTRODUCED_AGAIN.ln()).abs() < 0.05, "{known:?} {new:?}");
    assert!((known.1 - new.1).abs() < 1e-9, "by then it is introduced");
    assert!((silent.0 - new.0).abs() < 0.01, "nobody spoke there");
}

#[test]
fn words_said_before_an_edge_count_for_it() {
    // The gym, and the gym again after 40 m, in a map where that is so and in one where it is where it began.
    let (apart, closed) = (map(&[0.0, 20.0, 40.0]), map(&[0.0, 20.0, 0.5]));
    let mut talk = Talk::default();
    let gym = talk.name(0);
    talk.claim(&apart, &[called(0, gym)]);
    talk.claim(&apart, &[called(2, gym)]);
    let gain =
        log_likelihood(&talk, &Graph::default(), &closed) - log_likelihood(&talk, &Graph::default(), &apart);
    assert!(gain > 3.0, "{gain}");
}

#[test]
fn a_place_spoken_of_ahead_of_the_graph_lies_where_it_will() {
    let (early, late) = (map(&[0.0, 20.0]), map(&[0.0, 20.0, 1.0]));
    let mut talk = Talk::default();
    let gym = talk.name(0);
    let poses = |p: &Particle| {
        let mut poses = p.belief.poses();
        poses.push(poses[1].compose(&Pose2::new(-19.0, 0.0, 0.0)));
        poses
    };
    for (utterance, place) in [(0, 0), (1, 2)] {
        talk.claim(&early, &[]);
        let readings = vec![Claims { weight: 1.0, claims: vec![(1.0, called(place, gym))] }];
        let here = Here { held: Some(2), poses: &poses, path_m: vec![], part: vec![], dark: vec![] };
        talk.testimonies.add(Testimony { utterance, readings }, &early, &here);
    }
    let (before, after) =
        (log_likelihood(&talk, &Graph::default(), &early), log_likelihood(&talk, &Graph::default(), &late));
    assert!(before > 3.0 && (before - after).abs() < 1e-9, "{before} {after}");
    // The same before there is any graph.
    let mut talk = Talk::default();
    talk.name(0);
    let none = Particle::empty();
    let all = |_: &Particle| [0.0, 20.0, 1.0].map(|x_m| Pose2::new(x_m, 0.0, 0.0)).to_vec();
    for (utterance, place) in [(0, 0), (1, 2)] {
        talk.claim(&none, &[]);
        let readings = vec![Claims { weight: 1.0, claims: vec![(1.0, called(place, gym))] }];
        let here = Here { held: Some(2), poses: &all, path_m: vec![], part: vec![], dark: vec![] };
        talk.testimonies.add(Testimony { utterance, readings }, &none, &here);
    }
    for map in [&none, &map(&[0.0]), &late] {
        assert!((log_likelihood(&talk, &Graph::default(), map) - after).abs() < 1e-9);
    }
}

#[test]
fn readings_are_summed_inside() {
    let map = map(&[0.0, 50.0, 1.0]);
    let of = |readings: Vec<(f64, Vec<(f64, Claim)>)>| {
        let mut talk = Talk::default();
        let gym = talk.name(0);
        talk.name(1);
        talk.claim(&map, &[called(0, gym)]);
        let before = log_likelihood(&talk, &Graph::default(), &map);
        talk.claim_by(&map, readings);
        (log_likelihood(&talk, &Graph::default(), &map) - before).exp()
    };
    let (is, not) = (called(2, 0), Claim::Denied { place: 2, said: 0 });
    let sure = of(vec![(1.0, vec![(1.0, is)])]);
    assert!((of(vec![(0.5, vec![(0.6, is)])]) - (0.3 * sure + 0.7)).abs() < 1.0, "less sure, a rarer name");
    let other = of(vec![(1.0, vec![(1.0, not)])]);
    let both = of(vec![(0.4, vec![(1.0, not)]), (0.6, vec![])]);
    assert!((both - (0.4 * other + 0.6)).abs() < 1e-12);
}

#[test]
fn what_is_taken_back_was_never_said_and_may_be_said_again() {
    let map = map(&[0.0, 50.0, 1.0]);
    let mut talk = Talk::default();
    let gym = talk.name(0);
    talk.claim(&map, &[called(0, gym)]);
    let before = log_likelihood(&talk, &Graph::default(), &map);
    let number = talk.claim(&map, &[called(2, gym)]);
    let after = log_likelihood(&talk, &Graph::default(), &map);
    Arc::make_mut(&mut talk.ledger).strike(number);
    assert!((log_likelihood(&talk, &Graph::default(), &map) - before).abs() < 1e-12 && after - before > 3.0);
    talk.claim(&map, &[called(2, gym)]);
    assert!((log_likelihood(&talk, &Graph::default(), &map) - after).abs() < 1e-12);
}

#[test]
fn another_name_counts_as_the_one_it_means_and_a_forgotten_one_not() {
    let map = map(&[0.0, 50.0, 1.0]);
    let mut talk = Talk::default();
    let (gym, arena) = (talk.name(0), talk.name(1));
    talk.claim(&map, &[called(0, gym)]);
    talk.claim(&map, &[called(2, arena)]);
    assert!(log_likelihood(&talk, &Graph::default(), &map) < 0.0);
    Arc::make_mut(&mut talk.ledger).call(gym, arena, None);
    assert!(log_likelihood(&talk, &Graph::default(), &map) > 3.0);
    Arc::make_mut(&mut talk.ledger).forget(gym);
    assert!(log_likelihood(&talk, &Graph::default(), &map).abs() < 1e-12);
}

#[test]
fn a_description_weighs_by_what_is_called_how_where_it_puts_its_figure() {
    let located = |names: &[u32], spots: &[Spot]| {
        let mut map = map(&[0.0, 50.0, 100.0]);
        let mut talk = Talk::default();
        let gym = talk.name(0);
        for (place, &name) in (0..).zip(names) {
            let name = talk.name(name);
            talk.claim(&map, &[called(place, name)]);
        }
        let before = log_likelihood(&talk, &Graph::default(), &map);
        let number = talk.claim(&map, &[Claim::Located { said: gym }]);
        map.labels.describe(number, gym, spots.to_vec());
        (log_likelihood(&talk, &Graph::default(), &map) - before).exp()
    };
    let at = |place, share| Spot { place, share };
    let nothing = [at(2, 1.0)];
    assert!((located(&[], &[]) - 1.0).abs() < 1e-12, "nobody knows the floor");
    assert!((located(&[], &nothing) - 1.0).abs() < 1e-12, "nothing is called anything there");
    assert!(located(&[0], &[at(0, 0.5)]) > 10.0, "it lies where it is called so");
    assert!(located(&[0], &[at(0, 0.5)]) < located(&[0], &[at(0, 1.0)]));
    assert!(located(&[0, 1], &[at(1, 1.0)]) < 0.3, "what is there is called otherwise");
    let rest = located(&[2, 1], &[at(1, 0.5)]);
    assert!((0.5..0.7).contains(&rest), "floor not seen yet may be called anything: {rest}");
    assert!(located(&[0, 1], &[at(1, 0.5)]) < 0.3, "but the gym is known");
    // "The gym is down the hall", and then it is there, or something else is.
    let then = |name: u32| {
        let mut map = map(&[0.0, 50.0, 100.0]);
        let mut talk = Talk::default();
        let gym = talk.name(0);
        let number = talk.claim(&map, &[Claim::Located { said: gym }]);
        map.labels.describe(number, gym, vec![at(1, 0.8)]);
        let before = log_likelihood(&talk, &Graph::default(), &map);
        let name = talk.name(name);
        talk.claim(&map, &[called(1, name)]);
        (log_likelihood(&talk, &Graph::default(), &map) - before).exp()
    };
    assert!(then(0) > 10.0 && then(1) < 0.5);
}

#[test]
fn what_may_be_anywhere_takes_no_place_from_others() {
    let also = |share: f64| {
        let mut map = map(&[0.0, 50.0, 100.0]);
        let mut talk = Talk::default();
        let (gym, office) = (talk.name(0), talk.name(1));
        let number = talk.claim(&map, &[Claim::Located { said: gym }]);
        map.labels.describe(number, gym, vec![Spot { place: 1, share }]);
        let before = log_likelihood(&talk, &Graph::default(), &map);
        talk.claim(&map, &[called(1, office)]);
        (log_likelihood(&talk, &Graph::default(), &map) - before).exp()
    };
    // One chance in ten that the gym is there: one in ten less for another name, and not most of it.
    assert!((also(0.1) - 1.0).abs() < 0.1, "{}", also(0.1));
    assert!(also(1.0) < 0.35 && also(0.5) > also(1.0) && also(0.1) > also(0.5));
}

proptest! {
    /// Groups of sentences far from one another may be said in any order.
    #[test]
    fn independent_sentences_may_be_said_in_any_order(
        said in prop::collection::vec((0_u32..4, 0_u32..3, any::<bool>()), 1..12), turn in 0_usize..12,
    ) {
        let x_m: Vec<f64> = (0..8).map(|v| f64::from(v / 2) * 100.0 + f64::from(v % 2) * 2.0).collect();
        let map = map(&x_m);
        let fold = |said: &[(u32, u32, bool)]| {
            let mut talk = Talk::default();
            (0..3).for_each(|k| { talk.name(k); });
            for &(group, name, second) in said {
                talk.claim(&map, &[called(2 * group + u32::from(second), name)]);
            }
            log_likelihood(&talk, &Graph::default(), &map)
        };
        // By groups, in whatever order these, and within each as said.
        let mut by_group = said.clone();
        by_group.sort_by_key(|(group, ..)| (*group as usize + turn) % 4);
        prop_assert!((fold(&said) - fold(&by_group)).abs() < 1e-6);
    }

    /// What may be said next of a place is a distribution over all names, said, denied or never said.
    #[test]
    fn what_is_said_next_is_a_distribution(
        said in prop::collection::vec((0_u32..12, 0_u32..6, any::<bool>()), 1..30), at in 0_usize..30,
    ) {
        let map = map(&(0..12).map(|v| 1.5 * f64::from(v)).collect::<Vec<_>>());
        let mut talk = Talk::default();
        (0..7).for_each(|k| { talk.name(k); });
        for &(place, said, so) in &said {
            talk.claim(&map, &[if so { called(place, said) } else { Claim::Denied { place, said } }]);
        }
        let (graph, standing) = (&Graph::default(), talk.standing());
        let mut fold = Fold::new(&talk, graph, &map, &standing);
        for (testimony, units) in &standing {
            fold.hear(testimony, units);
        }
        let place = said[at % said.len()].0;
        let mut p = |said| {
            let open = fold.called(u32::MAX, (place, said), Sameness::Open, &[]);
            let again = (1.0 - FALSE_TALK) * (1.0 - UNMARKED) * fold.predicted(place, said, &[]).known;
            (open + again) * fold.base.probability(said, &[])
        };
        // Name 6 is one of 118 that nobody has said; common ones are as many as 124 of these.
        let sum = (0..6).map(&mut p).sum::<f64>() + 242.0 * p(6);
        prop_assert!((sum - 1.0).abs() < 1e-9, "{sum}");
    }

    /// Assertion and denial of one name in one room weigh the same whichever comes first.
    #[test]
    fn a_denial_may_come_before_what_it_denies(x_m in 0.0..30.0_f64) {
        let map = map(&[0.0, x_m]);
        let fold = |turn: bool| {
            let mut talk = Talk::default();
            let gym = talk.name(0);
            let claims = [called(0, gym), Claim::Denied { place: 1, said: gym }];
            for k in if turn { [1, 0] } else { [0, 1] } {
                talk.claim(&map, &[claims[k]]);
            }
            log_likelihood(&talk, &Graph::default(), &map)
        };
        prop_assert!((fold(false) - fold(true)).abs() < 0.02);
    }

    /// No sentence says less than ε, or more than a rare name where all call it so.
    #[test]
    fn what_one_sentence_says_is_bounded(
        said in prop::collection::vec((0_u32..20, 0_u32..5), 1..40), name in 0_u32..5,
        again in prop::sample::select(vec![Sameness::Open, Sameness::Same, Sameness::Other]),
    ) {
        let map = map(&(0..20).map(f64::from).collect::<Vec<_>>());
        let mut talk = Talk::default();
        (0..5).for_each(|k| { talk.name(k); });
        for &(place, name) in &said {
            talk.claim(&map, &[called(place, name)]);
        }
        let before = log_likelihood(&talk, &Graph::default(), &map);
        // What others call so is rarer by one's own: all weigh anew, but none by more than the bounds.
        talk.claim(&map, &[Claim::Called { place: 3, said: name, again }]);
        let gain = log_likelihood(&talk, &Graph::default(), &map) - before;
        prop_assert!(gain > FALSE_TALK.ln() - 1.5 - 0.05 * said.len() as f64 && gain < 5.5, "{gain}");
    }
}
