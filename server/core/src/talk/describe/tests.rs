use super::*;
use crate::config::Config;
use crate::effects::HeardStatus;
use crate::event::Utterance;
use crate::scan::place::Content;
use crate::scan::tests::seen;
use crate::smoothing::Factor;
use crate::track::places::{Chain, FrozenPlace, OpenPlace};
use nalgebra::{Matrix3, Vector3};

/// Two particles that know a gym and a kitchen, in the first 20 m and in the second 3 m apart, and the
/// log-weight of the second over that of the first once a sentence is said on the way.
fn weighed(sentence: &str) -> f64 {
    let (mut talk, mut filter) = (Talk::default(), Filter::new(Config::default()));
    let structure = Arc::make_mut(&mut filter.structure);
    for _ in 0..21 {
        let information = Matrix3::from_diagonal(&Vector3::new(100.0, 100.0, 1e6));
        structure.add_pose(Pose2::new(1.0, 0.0, 0.0), &information).unwrap();
    }
    let i_from_j = Pose2::new(3.0, 0.0, 0.0);
    let tie = structure.add_factor(Factor { i: 0, j: 20, i_from_j, information: Matrix3::identity() * 1e6 });
    structure.arrange();
    let mut apart = Particle::empty();
    let mut near = Particle::empty();
    near.belief.hold(tie.unwrap());
    for p in [&mut apart, &mut near] {
        p.update(structure).unwrap();
    }
    filter.particles = vec![apart, near];
    let path_m: Vec<f64> = (0..21).map(f64::from).collect();
    for (held, text) in [(0, "this is the gym"), (20, "this is the kitchen"), (10, sentence)] {
        let here = Here {
            held: Some(held),
            poses: &|p| p.belief.poses(),
            path_m: path_m.clone(),
            part: vec![],
            dark: vec![],
        };
        let u = Utterance { id: text.into(), text: text.into(), ..Utterance::default() };
        assert_eq!(talk.hear(&mut filter, &u, &here).0.status, HeardStatus::Understood);
    }
    let length_m = |p: &Particle| p.belief.pose(20).x_m;
    let (near, apart): (Vec<_>, Vec<_>) = filter.particles.iter().partition(|p| length_m(p) < 10.0);
    near[0].log_weight - apart[0].log_weight
}

/// A robot that drives along x, a metre a place, and says things on its way; the sentences' share of the weight of one
/// that it says at the end.
fn said_along(said: &[(usize, &str)]) -> (Talk, Filter) {
    let (mut talk, mut filter) = (Talk::default(), Filter::new(Config::default()));
    let structure = Arc::make_mut(&mut filter.structure);
    for _ in 0..61 {
        let information = Matrix3::from_diagonal(&Vector3::new(100.0, 100.0, 1e6));
        structure.add_pose(Pose2::new(1.0, 0.0, 0.0), &information).unwrap();
    }
    structure.arrange();
    let mut particle = Particle::empty();
    particle.update(structure).unwrap();
    filter.particles = vec![particle];
    let path_m: Vec<f64> = (0..61).map(f64::from).collect();
    for (n, (held, text)) in said.iter().enumerate() {
        let here = Here {
            held: Some(*held as Vertex),
            poses: &|p| p.belief.poses(),
            path_m: path_m.clone(),
            part: vec![],
            dark: vec![],
        };
        let u = Utterance { id: n.to_string(), text: (*text).into(), ..Utterance::default() };
        assert_eq!(talk.hear(&mut filter, &u, &here).0.status, HeardStatus::Understood);
    }
    (talk, filter)
}

#[test]
fn the_hallway_is_the_one_at_hand() {
    let spots = |hallway: usize| {
        let (talk, filter) =
            said_along(&[(hallway, "this is the hallway"), (4, "the library is down the hallway")]);
        let library = talk.ledger.label("library").unwrap();
        filter.best().labels.described(1, library).iter().map(|s| s.share).sum::<f64>()
    };
    // Where nobody named the one at hand, a far one is not meant for that.
    let (near, far) = (spots(2), spots(50));
    assert!(near > 0.3 && far < 0.3 * near, "{near} {far}");
}

#[test]
fn of_two_rooms_the_near_one_is_meant_and_one_alone_wherever_it_is() {
    let at = |said: &[(usize, &str)]| {
        let (talk, filter) = said_along(said);
        let lounge = talk.ledger.label("lounge").unwrap();
        let number = said.len() as u32 - 1;
        let spots = filter.best().labels.described(number, lounge).to_vec();
        let share = |of: std::ops::Range<Vertex>| {
            spots.iter().filter(|s| of.contains(&s.place)).map(|s| s.share).sum::<f64>()
        };
        [share(0..30), share(30..61)]
    };
    let next = "the lounge is next to the cafeteria";
    let [near, far] = at(&[(10, "this is the cafeteria"), (50, "this is a cafeteria"), (15, next)]);
    assert!(near > 4.0 * far, "{near} {far}");
    let [near, far] = at(&[(50, "this is the cafeteria"), (15, next)]);
    assert!(far > 0.2 && near < 0.05, "{near} {far}");
}

#[test]
fn a_sentence_speaks_for_the_map_in_which_it_is_true() {
    let nothing = weighed("the lounge is near the cafe");
    assert!(weighed("the kitchen is near the gym") > nothing + 0.5);
    assert!(weighed("the kitchen is twenty meters from the gym") < nothing - 1.0);
    assert!(weighed("this is where we started") > nothing + 1.0);
    assert!(weighed("this is not where we started") < nothing - 1.0);
    assert!(weighed("this is the same place as the gym") > nothing + 1.0);
}

#[test]
fn a_room_is_no_floor_of_a_hallway() {
    let along = |walls: &[[f64; 4]]| {
        let (talk, mut filter) =
            said_along(&[(2, "this is the hallway"), (4, "the library is down the hallway")]);
        let shares = |filter: &Filter| {
            let library = talk.ledger.label("library").unwrap();
            filter.best().labels.described(1, library).iter().map(|s| s.share).sum::<f64>()
        };
        let before = shares(&filter);
        for k in 0..61 {
            filter.graph.add(frozen(k, walls));
        }
        let mut talk = talk.clone();
        reground_all(&mut talk, &mut filter);
        shares(&filter) / before
    };
    let box_of = |long_m: f64, wide_m: f64| {
        let (x, y) = (long_m / 2.0, wide_m / 2.0);
        [[-x, -y, x, -y], [x, -y, x, y], [x, y, -x, y], [-x, y, -x, -y]]
    };
    let (hallway, room) = (along(&box_of(20.0, 2.0)), along(&box_of(5.0, 5.0)));
    assert!(hallway < 0.3 && room > 1.0, "{hallway} {room}");
}

/// The k-th place of a chain, within walls.
fn frozen(k: u32, walls: &[[f64; 4]]) -> FrozenPlace {
    let sweep = seen(walls, &Pose2::default());
    let chain = Chain {
        previous_from_this: Pose2::new(1.0, 0.0, 0.0),
        information: Matrix3::identity(),
        broken: false,
        unseen: false,
        failed: 0.0,
    };
    let front_from_place = Pose2::new(f64::from(k), 0.0, 0.0);
    let open = OpenPlace { id: k.into(), stamp_ns: 0, front_from_place, path_m: f64::from(k), chain };
    FrozenPlace { open, content: Content::new(&[(Pose2::default(), &sweep)]) }
}
