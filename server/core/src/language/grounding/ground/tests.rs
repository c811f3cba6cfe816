use super::*;
use crate::language::grounding::clause::Narrowing;
use proptest::prelude::*;

/// A clause with one reading and one landmark.
fn ground(
    relation: Relation,
    places: &[GroundPlace],
    speaker: usize,
    landmark: &[(usize, f64)],
    figure_prior: &[f64],
) -> Grounding {
    let landmarks =
        [LandmarkBelief { places: landmark, way: matches!(relation, Relation::Down | Relation::Along) }];
    let narrowing = Narrowing::default();
    let reading = Reading { weight: 1.0, relation, frame: None, narrowing, landmarks: &landmarks };
    ground_clause(&[reading], places, speaker, figure_prior)
}

/// A straight corridor along x, a place per metre from 0 to 40.
fn corridor() -> Vec<GroundPlace> {
    (0..=40)
        .map(|i| GroundPlace { x_m: f64::from(i), y_m: 0.0, yaw_rad: 0.0, path_m: f64::from(i) })
        .collect()
}

/// Places a metre apart along a route.
fn drive(route: &[(f64, f64)]) -> Vec<GroundPlace> {
    let mut places: Vec<GroundPlace> = Vec::new();
    for leg in route.windows(2) {
        let (dx, dy) = (leg[1].0 - leg[0].0, leg[1].1 - leg[0].1);
        let steps = dx.hypot(dy).round();
        for s in 0..steps as usize {
            let f = s as f64 / steps;
            let path_m = places.len() as f64;
            let (x_m, y_m) = (leg[0].0 + f * dx, leg[0].1 + f * dy);
            places.push(GroundPlace { x_m, y_m, yaw_rad: dy.atan2(dx), path_m });
        }
    }
    places
}

/// A hallway of 24 m with rooms 4 m deep at x = 4, 8, 12, 16, 20, first all on the left, back on the right.
fn floor() -> Vec<GroundPlace> {
    let mut route = vec![(0.0, 0.0)];
    for k in 1..=5 {
        let x = 4.0 * f64::from(k);
        route.extend([(x, 0.0), (x, 4.0), (x, 0.0)]);
    }
    route.push((24.0, 0.0));
    for k in (1..=5).rev() {
        let x = 4.0 * f64::from(k);
        route.extend([(x, 0.0), (x, -4.0), (x, 0.0)]);
    }
    route.push((0.0, 0.0));
    drive(&route)
}

/// Place nearest to a point.
fn place_at(places: &[GroundPlace], x: f64, y: f64) -> usize {
    let far_m = |p: &GroundPlace| (p.x_m - x).hypot(p.y_m - y);
    (0..places.len()).min_by(|&a, &b| far_m(&places[a]).total_cmp(&far_m(&places[b]))).unwrap()
}

/// The room (x of its door, side) with most of the probability, and its share among rooms.
fn best_room(places: &[GroundPlace], g: &Grounding) -> (i32, i32, f64) {
    let mut rooms = std::collections::BTreeMap::<(i32, i32), f64>::new();
    for (p, at) in g.p.iter().zip(places).filter(|(_, at)| at.y_m.abs() > 1.5) {
        *rooms.entry((at.x_m.round() as i32, at.y_m.signum() as i32)).or_default() += p;
    }
    let total: f64 = rooms.values().sum();
    let (room, p) = rooms.into_iter().max_by(|a, b| a.1.total_cmp(&b.1)).unwrap();
    (room.0, room.1, p / total)
}

fn say(
    relation: Relation,
    narrowing: Narrowing,
    landmarks: &[usize],
    way: bool,
    stand: (f64, f64),
) -> (i32, i32, f64) {
    let places = floor();
    let spots: Vec<[(usize, f64); 1]> = landmarks.iter().map(|&k| [(k, 1.0)]).collect();
    let landmarks: Vec<_> = spots.iter().map(|s| LandmarkBelief { places: s, way }).collect();
    let reading =
        Reading { weight: 1.0, relation, frame: Some(Frame::Hearer), narrowing, landmarks: &landmarks };
    // The speaker is on the way out, so ahead is +x.
    best_room(&places, &ground_clause(&[reading], &places, place_at(&places, stand.0, stand.1), &[]))
}

fn mass(g: &Grounding, range: std::ops::RangeInclusive<usize>) -> f64 {
    g.p[range].iter().sum()
}

#[test]
fn rooms_are_told_apart() {
    use Relation as R;
    let places = floor();
    let room = |x: f64, side: f64| place_at(&places, x, 4.0 * side);
    let plain = Narrowing::default();
    let (kitchen, stand) = (room(12.0, 1.0), (2.0, 0.0));
    let here = place_at(&places, 2.0, 0.0);
    let of = |relation, landmark| say(relation, plain, &[landmark], false, stand);
    assert_eq!((of(R::AcrossFrom, kitchen).0, of(R::AcrossFrom, kitchen).1), (12, -1));
    let (x, _, _) = of(R::Past, kitchen);
    assert!(x > 12, "past the kitchen: {x}");
    // Facing the kitchen, which is on the left, on goes to the right.
    assert_eq!((of(R::RightOf, kitchen).0, of(R::RightOf, kitchen).1), (16, 1));
    assert_eq!((of(R::LeftOf, kitchen).0, of(R::LeftOf, kitchen).1), (8, 1));
    let between = say(R::Between, plain, &[room(8.0, -1.0), room(16.0, -1.0)], false, stand);
    assert_eq!((between.0, between.1), (12, -1));
    let side = |relation| say(relation, plain, &[place_at(&places, 7.0, 0.0)], false, (7.0, 0.0));
    assert_eq!((side(R::LeftOf).1, side(R::RightOf).1), (1, -1), "on your left");
    let doors = |doors| say(R::LeftSide, Narrowing { doors: Some(doors), ..plain }, &[here], true, stand);
    assert_eq!((doors(1).0, doors(1).1, doors(3).0, doors(3).1), (4, 1, 12, 1));
    let down = |m| say(R::Down, Narrowing { distance_m: Some(m), ..plain }, &[here], true, stand);
    assert_eq!((down(6.0).0, down(14.0).0), (8, 16));
    assert_eq!(say(R::AtEndOf, plain, &[here], true, stand).0, 20);
}

#[test]
fn a_neighbour_is_on_the_same_side() {
    // Rooms 5 m apart, and one nearer, over the hallway.
    let route = [(0.0, 0.0), (4.0, 0.0), (4.0, 4.0), (4.0, 0.0), (9.0, 0.0), (9.0, 4.0), (9.0, 0.0)];
    let back = [(16.0, 0.0), (4.0, 0.0), (4.0, -4.0), (4.0, 0.0), (0.0, 0.0)];
    let places = drive(&route.into_iter().chain(back).collect::<Vec<_>>());
    let g = ground(Relation::NextTo, &places, 1, &[(place_at(&places, 4.0, 4.0), 1.0)], &[]);
    let (x, side, share) = best_room(&places, &g);
    assert!(x == 9 && side == 1 && share > 0.7, "{x} {side} {share}");
}

#[test]
fn through_a_room_is_what_lies_behind_it() {
    // Into a room at x = 8, from there into two others behind it, and on along the hallway.
    let route = [(0.0, 0.0), (8.0, 0.0), (8.0, 3.0), (5.0, 6.0), (8.0, 3.0), (11.0, 6.0), (8.0, 3.0)];
    let on = [(8.0, 0.0), (12.0, 0.0), (12.0, 4.0), (12.0, 0.0), (20.0, 0.0)];
    let places = drive(&route.into_iter().chain(on).collect::<Vec<_>>());
    // The landmark was named the second time one was there.
    let named = place_at(&places[12..], 8.0, 3.0) + 12;
    let g = ground(Relation::Through, &places, 2, &[(named, 1.0)], &[]);
    let behind: f64 = g.p.iter().zip(&places).filter(|(_, at)| at.y_m > 3.5).map(|(p, _)| p).sum();
    assert!(behind > 0.9 * g.p.iter().sum::<f64>() && behind > 0.1, "{behind} {:?}", g.p);
}

#[test]
fn doors_are_counted_rather_than_paced_off() {
    // Doors at 4, 8, …: the first beyond a long wall, and one so near that it can't be the second.
    let stand = (9.5, 0.0);
    let places = floor();
    let here = place_at(&places, stand.0, stand.1);
    let nth = |doors| {
        let narrowing = Narrowing { doors: Some(doors), ..Narrowing::default() };
        say(Relation::LeftSide, narrowing, &[here], true, stand)
    };
    for (doors, x) in [(1, 12), (2, 16), (3, 20)] {
        let (best, side, share) = nth(doors);
        assert!(best == x && side == 1 && share > 0.5, "{doors}: {best} {side} {share}");
    }
    let wall =
        drive(&[(0.0, 0.0), (17.0, 0.0), (17.0, 4.0), (17.0, 0.0), (20.0, 0.0), (20.0, 4.0), (20.0, 0.0)]);
    let narrowing = Narrowing { doors: Some(1), ..Narrowing::default() };
    let landmarks = [LandmarkBelief { places: &[(1, 1.0)], way: true }];
    let reading =
        Reading { weight: 1.0, relation: Relation::LeftSide, frame: None, narrowing, landmarks: &landmarks };
    assert_eq!(best_room(&wall, &ground_clause(&[reading], &wall, 1, &[])).0, 17);
}

#[test]
fn just_past_is_closer() {
    let places = floor();
    let kitchen = [(place_at(&places, 8.0, 4.0), 1.0)];
    let landmarks = [LandmarkBelief { places: &kitchen, way: false }];
    let far = |just| {
        let narrowing = Narrowing { just, ..Narrowing::default() };
        let reading =
            Reading { weight: 1.0, relation: Relation::Past, frame: None, narrowing, landmarks: &landmarks };
        let g = ground_clause(&[reading], &places, place_at(&places, 2.0, 0.0), &[]);
        let total: f64 = g.p.iter().sum();
        g.p.iter().zip(&places).map(|(p, at)| p * at.x_m).sum::<f64>() / total
    };
    assert!(far(true) < far(false) - 0.5, "{} {}", far(true), far(false));
}

#[test]
fn readings_are_summed_out() {
    let places = floor();
    let kitchen = [(place_at(&places, 12.0, 4.0), 1.0)];
    let landmarks = [LandmarkBelief { places: &kitchen, way: false }];
    let speaker = place_at(&places, 2.0, 0.0);
    let narrowing = Narrowing::default();
    let reading =
        |weight, relation, frame| Reading { weight, relation, frame, narrowing, landmarks: &landmarks };
    let p = |readings: &[Reading]| ground_clause(readings, &places, speaker, &[]).p;
    let across = p(&[reading(1.0, Relation::AcrossFrom, None)]);
    let near = p(&[reading(1.0, Relation::Near, None)]);
    let both = p(&[reading(0.5, Relation::AcrossFrom, None), reading(0.5, Relation::Near, None)]);
    let k = place_at(&places, 12.0, -4.0);
    assert!(both[k] < across[k] && both[k] > near[k]);
    // Without a frame, both sides of the kitchen are possible; the hearer's is likelier.
    let left = p(&[reading(1.0, Relation::LeftOf, None)]);
    let (seen, own) = (place_at(&places, 8.0, 4.0), place_at(&places, 16.0, 4.0));
    assert!(left[seen] > left[own] && left[own] > 0.1 * left[seen]);
    // What the weights lack says nothing.
    let elsewhere = |weight| {
        ground_clause(&[reading(weight, Relation::AcrossFrom, None)], &places, speaker, &[]).p_elsewhere
    };
    assert!(elsewhere(0.25) > elsewhere(0.5) + 0.1 && elsewhere(0.5) >= elsewhere(1.0));
}

#[test]
fn near_keeps_to_the_neighbourhood() {
    let g = ground(Relation::Near, &corridor(), 40, &[(20, 1.0)], &[]);
    let best = (0..41).max_by(|&a, &b| g.p[a].total_cmp(&g.p[b])).unwrap();
    assert!((18..=22).contains(&best) && best != 20, "beside the landmark, not the landmark: {best}");
    assert!(mass(&g, 8..=32) > 0.95 * g.p.iter().sum::<f64>());
    assert!(g.p[20] < 1e-12);
}

#[test]
fn away_from_grows_with_distance_at_first() {
    let g = ground(Relation::AwayFrom, &corridor(), 0, &[(0, 1.0)], &[]);
    assert!(g.p[2] < g.p[6]);
    assert!(g.p[15] > g.p[40], "nobody means the far end of the building");
}

#[test]
fn through_is_beyond_and_down_is_ahead() {
    let through = ground(Relation::Through, &corridor(), 5, &[(20, 1.0)], &[]);
    assert!(mass(&through, 21..=40) > 10.0 * mass(&through, 0..=18), "{:?}", through.p);
    let down = ground(Relation::Down, &corridor(), 5, &[(20, 1.0)], &[]);
    assert!(mass(&down, 6..=40) > 10.0 * mass(&down, 0..=4), "{:?}", down.p);
    // Seen from the other end, it is the other side.
    let back = ground(Relation::Through, &corridor(), 35, &[(20, 1.0)], &[]);
    assert!(mass(&back, 0..=19) > 10.0 * mass(&back, 22..=40));
}

#[test]
fn past_follows_the_path_round_a_bend() {
    // 20 m along x, then 20 m along y; straight on there is nothing.
    let bend = drive(&[(0.0, 0.0), (20.0, 0.0), (20.0, 20.0)]);
    let g = ground(Relation::Past, &bend, 5, &[(17, 1.0)], &[]);
    assert!(mass(&g, 21..=30) > 10.0 * mass(&g, 0..=12), "{:?}", g.p);
}

#[test]
fn a_figure_ahead_of_all_that_was_seen_is_elsewhere() {
    // At the corridor's far end, looking on: what is past this has not been visited.
    let g = ground(Relation::Past, &corridor(), 40, &[(40, 1.0)], &[]);
    assert!(g.p_elsewhere > 0.8, "{}", g.p_elsewhere);
    let g = ground(Relation::Near, &corridor(), 40, &[(40, 1.0)], &[]);
    assert!(g.p_elsewhere > 0.7, "{}", g.p_elsewhere);
    // On another floor.
    let g = ground(Relation::Above, &corridor(), 40, &[(40, 1.0)], &[]);
    assert!((g.p_elsewhere - 1.0).abs() < 1e-12);
}

#[test]
fn a_taught_name_is_told_apart_by_the_relation() {
    let mut prior = vec![0.02; 41];
    prior[5] = 0.9;
    prior[30] = 0.9;
    let g = ground(Relation::Near, &corridor(), 40, &[(28, 1.0)], &prior);
    assert!(g.p[30] > 0.8, "{}", g.p[30]);
    assert!(g.p[30] > 20.0 * g.p[5]);
    // Without a landmark to go by, both stay.
    let g = ground(Relation::Near, &corridor(), 40, &[], &prior);
    assert!((g.p[30] - g.p[5]).abs() < 1e-12 && g.p[5] > 0.2);
}

#[test]
fn nothing_known_says_nothing() {
    let g = ground(Relation::Down, &corridor(), 40, &[], &[0.5; 41]);
    assert!((g.p_elsewhere - 1.0).abs() < 1e-12);
    let g = ground(Relation::Down, &[], 0, &[(0, 1.0)], &[]);
    assert_eq!(g, Grounding { p: vec![], p_elsewhere: 1.0, floor: vec![] });
    assert_eq!(ground_clause(&[], &corridor(), 3, &[]).p, vec![0.0; 41]);
}

proptest! {
    #[test]
    fn probabilities_sum_to_one(
        points in prop::collection::vec((-60.0..60.0, -60.0..60.0, -3.2..3.2), 1..60),
        kinds in prop::collection::vec((0..Relation::ALL.len(), -0.2..1.5), 0..4),
        frame in prop::option::of(0..5usize),
        speaker in 0..70usize,
        landmark in prop::collection::vec((0..70usize, -0.1..1.0), 0..30),
        prior in prop::collection::vec(-0.2..1.2, 0..60),
        narrowing in (any::<bool>(), prop::option::of(prop::num::f64::ANY), prop::option::of(any::<u32>())),
        (same_length, way, broken) in any::<(bool, bool, bool)>(),
        together in 0..4usize,
    ) {
        let mut path_m = 0.0;
        let mut places: Vec<GroundPlace> = points.iter().map(|&(x_m, y_m, yaw_rad)| {
            path_m += 1.0;
            GroundPlace { x_m, y_m, yaw_rad, path_m }
        }).collect();
        for k in 1..together.min(places.len()) {
            places[k] = places[0];
        }
        if broken {
            places[0].x_m = f64::NAN;
        }
        let mut prior = prior;
        if same_length { prior.resize(places.len(), 0.3); }
        let frames = [Frame::Hearer, Frame::Speaker, Frame::Intrinsic, Frame::Path, Frame::Absolute];
        let belief = LandmarkBelief { places: &landmark, way };
        let landmarks = [belief, belief];
        let narrowing = Narrowing { just: narrowing.0, distance_m: narrowing.1, doors: narrowing.2 };
        let readings: Vec<Reading> = kinds.iter().map(|&(kind, weight)| {
            let relation = Relation::ALL[kind];
            let count = if relation == Relation::Between { 2 } else { 1 };
            let frame = frame.map(|k| frames[k]);
            Reading { weight, relation, frame, narrowing, landmarks: &landmarks[..count] }
        }).collect();
        let g = ground_clause(&readings, &places, speaker, &prior);
        prop_assert_eq!(g.p.len(), places.len());
        prop_assert!(g.p.iter().chain([&g.p_elsewhere]).all(|p| (0.0..=1.0).contains(p)));
        prop_assert!((g.p.iter().sum::<f64>() + g.p_elsewhere - 1.0).abs() < 1e-9);
    }
}
