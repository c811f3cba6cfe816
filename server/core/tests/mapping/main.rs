//! The core from events to answers, on a simulated ring corridor.

mod alike;
mod areas;
mod asked;
mod dialogues;
mod mounted;
mod standing;
mod talk;
mod tour;
mod world;

use toponym_core::answers::query::{Answer, EdgeView, Query, WhereAnswer};
use toponym_core::edge::EdgeKind;
use toponym_core::effects::{Effect, Effects, HeardStatus, TrackState};
use toponym_core::event::{Event, Odom, Scan};
use toponym_core::geometry::Pose2;
use toponym_core::mapper::SaveError;
use toponym_core::trial::{ForcedLoop, Trial};
use toponym_core::{Config, Mapper};
use world::{drive, events, laser, say};

fn run(mapper: &mut Mapper, events: &[Event]) -> Effects {
    events.iter().flat_map(|e| mapper.step(e.clone())).collect()
}

fn mapped(laps: usize, said: &[(usize, &str)]) -> (Mapper, Effects, Vec<Pose2>) {
    let poses = drive(laps);
    let mut mapper = Mapper::new(Config::default());
    let mut effects = run(&mut mapper, &events(&poses, &laser(), said));
    effects.extend(mapper.step(Event::Flush));
    (mapper, effects, poses)
}

/// Largest distance of any scan's pose from the truth, in the frame of the first.
fn worst_error_m(mapper: &Mapper, effects: &Effects, poses: &[Pose2]) -> f64 {
    let graph = mapper.snapshot().graph();
    effects
        .iter()
        .filter_map(|e| match e {
            Effect::ScanPlaced { scan, place, place_from_body, .. } => {
                let place = graph.places.iter().find(|p| p.id == *place)?;
                let truth = poses[0].between(&poses[*scan as usize]);
                Some(place.pose.compose(place_from_body).distance_m(&truth))
            }
            _ => None,
        })
        .fold(0.0, f64::max)
}

fn where_is(mapper: &Mapper, text: &str) -> WhereAnswer {
    match mapper.answer(&Query::Where { text: text.into(), lang: None }) {
        Answer::Where(answer) => answer,
        other => panic!("{other:?}"),
    }
}

#[test]
fn a_second_lap_closes_the_loop_that_odometry_leaves_open() {
    let (mapper, effects, poses) = mapped(2, &[]);
    let odometry =
        poses.windows(2).fold(Pose2::default(), |o, w| o.compose(&world::worn(&w[0].between(&w[1]))));
    let truth = poses[0].between(poses.last().unwrap());
    assert!(odometry.distance_m(&truth) > 3.0, "the odometry of this test is bad");
    assert!(!mapper.snapshot().graph().particles[0].edges.is_empty());
    let worst_m = worst_error_m(&mapper, &effects, &poses);
    assert!(worst_m < 0.15, "{worst_m}");
}

#[test]
fn uncertainty_grows_along_the_first_lap_and_shrinks_where_it_closes() {
    let (_, effects, poses) = mapped(2, &[]);
    let sigma_m: Vec<f64> = effects
        .iter()
        .filter_map(|e| match e {
            Effect::Tracked { covariance, .. } => Some(covariance[(0, 0)].max(covariance[(1, 1)]).sqrt()),
            _ => None,
        })
        .collect();
    let lap = poses.len() / 2;
    // Where the second lap begins, the loop may have closed a few places before.
    let most_m = sigma_m[..lap].iter().copied().fold(0.0, f64::max);
    assert!(sigma_m[20] < sigma_m[lap / 4] && sigma_m[lap / 4] < most_m, "{most_m}");
    assert!(sigma_m[lap + 60] < 0.5 * most_m, "{most_m} {}", sigma_m[lap + 60]);
}

#[test]
fn save_in_the_middle_load_and_go_on_is_the_same() {
    let all =
        events(&drive(2), &laser(), &[(30, "this is the kitchen"), (220, "the gym is near the kitchen")]);
    let (before, after) = all.split_at(700);
    let mut whole = Mapper::new(Config::default());
    run(&mut whole, before);
    let mut loaded = Mapper::load(&whole.save().unwrap()).unwrap();
    assert_eq!(run(&mut whole, after), run(&mut loaded, after));
    assert_eq!(whole.step(Event::Flush), loaded.step(Event::Flush));
    assert_eq!(whole.save().unwrap(), loaded.save().unwrap());
}

#[test]
fn threads_change_nothing() {
    let all = events(&drive(1), &laser(), &[(30, "this is the kitchen")]);
    let on = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let mut mapper = Mapper::new(Config::default());
            (run(&mut mapper, &all), mapper.save().unwrap())
        })
    };
    assert!(on(1) == on(3));
}

#[test]
fn rubbish_is_no_map() {
    assert!(Mapper::load(b"rubbish").is_err());
    let bytes = Mapper::new(Config::default()).save().unwrap();
    assert!(Mapper::load(&bytes[..bytes.len() - 1]).is_err());
}

#[test]
fn a_map_of_an_older_format_is_told_from_rubbish() {
    let mut bytes = Mapper::new(Config::default()).save().unwrap();
    let number = bytes.iter().position(u8::is_ascii_digit).unwrap();
    bytes[number] += 1;
    let error = Mapper::load(&bytes).unwrap_err();
    assert!(matches!(error, SaveError::Format { .. }), "{error}");
}

#[test]
fn the_mounting_of_the_laser_does_not_matter() {
    let mut hung = laser();
    hung.body_from_laser = Pose2::new(-0.15, 0.1, std::f64::consts::PI);
    hung.upside_down = true;
    let poses = drive(2);
    let mut mapper = Mapper::new(Config::default());
    let mut effects = run(&mut mapper, &events(&poses, &hung, &[]));
    effects.extend(mapper.step(Event::Flush));
    let worst_m = worst_error_m(&mapper, &effects, &poses);
    assert!(worst_m < 0.15, "{worst_m}");
}

#[test]
fn names_are_found_where_they_were_given() {
    let (mapper, effects, poses) =
        mapped(1, &[(60, "this is the kitchen"), (150, "nobody knows how long that takes")]);
    let heard: Vec<_> = effects
        .iter()
        .filter_map(|e| match e {
            Effect::Heard(h) => Some(h),
            _ => None,
        })
        .collect();
    assert_eq!(heard[0].status, HeardStatus::Understood);
    assert_eq!((heard[1].status, &heard[1].grounded), (HeardStatus::NotUnderstood, &vec![]));
    let answer = where_is(&mapper, "where is the kitchen");
    let best = &answer.candidates[0];
    assert!(best.pose.distance_m(&poses[0].between(&poses[60])) < 1.2, "{best:?}");
    assert_eq!(best.because, ["u0"]);
    let sum: f64 = answer.candidates.iter().map(|c| c.probability).sum::<f64>() + answer.p_none;
    assert!((sum - 1.0).abs() < 1e-9);
    let unknown = where_is(&mapper, "where is the swimming pool");
    assert_eq!((unknown.p_none, unknown.candidates.len()), (1.0, 0));
}

#[test]
fn a_name_is_known_before_its_place_is_left() {
    let all = events(&drive(1), &laser(), &[(3, "this is the kitchen")]);
    let mut mapper = Mapper::new(Config::default());
    run(&mut mapper, &all[..12]);
    assert_eq!(where_is(&mapper, "kitchen").candidates.len(), 1);
}

#[test]
fn a_name_said_twice_before_its_place_is_left_is_no_loop() {
    // The second place is not frozen when the first proposes.
    let all = events(&drive(1)[..60], &laser(), &[(20, "this is the gym"), (26, "this is the gym")]);
    let mut mapper = Mapper::new(Config::default());
    run(&mut mapper, &all);
    mapper.step(Event::Flush);
    assert!(mapper.snapshot().graph().particles[0].edges.is_empty());
}

#[test]
fn a_resent_sentence_changes_nothing() {
    let all = events(&drive(1)[..60], &laser(), &[(30, "this is the kitchen")]);
    let mut mapper = Mapper::new(Config::default());
    run(&mut mapper, &all);
    let before = where_is(&mapper, "kitchen");
    mapper.step(Event::Utterance(say("u0", "this is the kitchen", 6_000_000_000)));
    assert_eq!(where_is(&mapper, "kitchen"), before);
}

#[test]
fn words_close_the_loop_where_nearness_proposes_nothing() {
    let poses = drive(2);
    let lap = poses.len() / 2;
    let said = [(40, "this is the kitchen"), (lap + 40, "this is the kitchen again")];
    // γ so large that no distance proposes an edge.
    let off_m = |config: Config| {
        let mut mapper = Mapper::new(Config { gamma_per_m2: 1e9, ..config });
        let mut effects = run(&mut mapper, &events(&poses, &laser(), &said));
        effects.extend(mapper.step(Event::Flush));
        worst_error_m(&mapper, &effects, &poses)
    };
    let with = off_m(Config::default());
    let without = [
        Config { semantic_edges: false, ..Config::default() },
        Config { language: false, ..Config::default() },
    ];
    for config in without {
        let without = off_m(config);
        assert!(with < 0.5 * without, "{with} m with words, {without} m without");
    }
}

#[test]
fn a_forced_loop_that_everything_contradicts_is_undone() {
    let i_from_j = Pose2::new(1.0, 2.0, 0.5);
    let trial = Trial { force_loops: vec![ForcedLoop { i: 2, j: 9, i_from_j }], ..Trial::default() };
    let mut mapper = Mapper::on_trial(Config::default(), trial);
    run(&mut mapper, &events(&drive(1)[..90], &laser(), &[]));
    mapper.step(Event::Flush);
    let graph = mapper.snapshot().graph();
    let forced = |e: &EdgeView| (e.i, e.j) == (2, 9) && e.i_from_j == i_from_j;
    assert!(!graph.particles[0].edges.iter().any(forced));
    assert!(graph.particles[0].poses[9].distance_m(&graph.particles[0].poses[2]) > 3.0);
}

#[test]
fn odometry_that_restarts_on_the_spot_is_no_motion() {
    let poses = drive(1);
    let mut all = events(&poses, &laser(), &[]);
    // From the middle on, another boot whose odometry begins elsewhere.
    for e in all.iter_mut().skip(300) {
        if let Event::Odom(o) = e {
            o.boot = 1;
            o.odom_from_body = Pose2::new(40.0, -7.0, 2.0).compose(&o.odom_from_body);
        }
    }
    let mut mapper = Mapper::new(Config::default());
    let mut effects = run(&mut mapper, &all);
    effects.extend(mapper.step(Event::Flush));
    assert!(effects.iter().any(|e| matches!(e, Effect::SegmentBegan { .. })));
    let worst_m = worst_error_m(&mapper, &effects, &poses);
    assert!(worst_m < 0.3, "{worst_m}");
}

#[test]
#[ignore = "who is carried to a half of a building much like the other stays lost: neither half has half of the mass"]
fn a_carried_robot_finds_itself_again() {
    // Two laps; after the first the robot is carried half-way round.
    let lap = drive(1);
    let poses: Vec<Pose2> =
        lap.iter().chain(&lap[lap.len() / 2..]).chain(&lap[..lap.len() / 2]).copied().collect();
    let mut all = events(&poses[..lap.len()], &laser(), &[]);
    for (k, e) in events(&poses[lap.len()..], &laser(), &[]).into_iter().enumerate().skip(1) {
        let shift = (lap.len() as i64) * 200_000_000 + 60_000_000_000;
        all.push(match e {
            Event::Odom(o) => Event::Odom(Odom { boot: 1, stamp_ns: o.stamp_ns + shift, ..o }),
            Event::Scan(s) => Event::Scan(Scan { stamp_ns: s.stamp_ns + shift, ..s }),
            other => panic!("{k}: {other:?}"),
        });
    }
    let mut mapper = Mapper::new(Config::default());
    let mut effects = run(&mut mapper, &all);
    effects.extend(mapper.step(Event::Flush));
    let states: Vec<TrackState> = effects
        .iter()
        .filter_map(|e| match e {
            Effect::Tracked { state, .. } => Some(*state),
            _ => None,
        })
        .collect();
    assert_eq!(states[lap.len() - 1], TrackState::Mapping);
    assert_eq!(states[lap.len() + 10], TrackState::Lost);
    assert_ne!(states.last(), Some(&TrackState::Lost));
    let edges = mapper.snapshot().graph().particles[0].edges.clone();
    assert!(edges.iter().any(|e| e.kind == EdgeKind::Relocalisation), "{}", edges.len());
    let worst_m = worst_error_m(&mapper, &effects, &poses);
    assert!(worst_m < 0.3, "{worst_m}");
}

#[test]
fn bad_scans_are_dropped_or_harmless() {
    let mut mapper = Mapper::new(Config::default());
    let poses = drive(1);
    let mut all = events(&poses[..80], &laser(), &[]);
    let mut beams = [181usize, 1, 0, 45, 720].into_iter().cycle();
    for e in &mut all {
        if let Event::Scan(s) = e {
            let n = beams.next().unwrap();
            *s = world::scan(
                &world::walls(),
                &laser(),
                &poses[(s.stamp_ns / 200_000_000) as usize],
                s.stamp_ns,
                n.max(2),
            );
            s.ranges_m.truncate(n);
            if n == 45 {
                s.ranges_m.iter_mut().step_by(3).for_each(|r| *r = f32::NAN);
                s.ranges_m.iter_mut().step_by(5).for_each(|r| *r = -1.0);
            }
            if s.stamp_ns % 7 == 0 {
                s.laser = "unknown".into();
            }
        }
    }
    // Stamps that repeat and step back.
    for e in all.iter_mut().step_by(9) {
        if let Event::Odom(o) = e {
            o.stamp_ns -= 400_000_000;
        }
    }
    let effects = run(&mut mapper, &all);
    let placed = effects.iter().filter(|e| matches!(e, Effect::ScanPlaced { .. })).count();
    let dropped = effects.iter().filter(|e| matches!(e, Effect::ScanDropped { .. })).count();
    assert_eq!(placed + dropped, 80, "every scan is accounted for");
    mapper.step(Event::Flush);
    let last = mapper.snapshot().graph().places.last().unwrap().pose;
    let truth = poses[0].between(&poses[79]);
    assert!(last.distance_m(&truth) < 1.5, "{last:?} {truth:?}");
}

#[test]
fn the_grid_shows_walls_and_floor() {
    let (mapper, _, poses) = mapped(1, &[]);
    let Answer::Grid(grid) = mapper.answer(&Query::Grid { resolution_m: 0.1 }) else { panic!() };
    assert_eq!(mapper.snapshot().plan(), grid, "the same by what rooms are counted from");
    let at = |x: f64, y: f64| {
        let p = poses[0].inverse().apply(x, y);
        let (gx, gy) = ((p.0 - grid.map_from_grid.x_m) / 0.1, (p.1 - grid.map_from_grid.y_m) / 0.1);
        grid.cells[gy as usize * grid.width + gx as usize]
    };
    assert!((0..20).all(|k| at(3.0 + 0.5 * f64::from(k), 1.5) < 40), "the corridor is free");
    let wall = (0..10).filter(|k| (-2..=2).any(|d| at(10.0 + 0.5 * f64::from(*k), 0.1 * f64::from(d)) > 60));
    assert!(wall.count() >= 8, "the outer wall stands");
    assert_eq!(at(10.0, 7.0), -1, "behind walls nothing is known");
}
