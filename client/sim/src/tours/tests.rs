//! Tours as a whole: what all of them promise.

use super::strain::{strain, unknown};
use super::*;
use crate::geom::between;
use crate::{Draw, Wheels};
use nalgebra::Vector3;
use toponym_proto::Limits;

/// Tours on which more than one hypothesis stands.
fn ambiguous() -> impl Iterator<Item = &'static str> {
    let plain = ["slip", "unsigned", "break", "clean"];
    TOURS.iter().copied().filter(move |name| !plain.contains(name))
}

fn text(played: &Played) -> String {
    format!("{:?} {:?} {:?}", played.stream, played.narration, played.truth)
}

#[test]
fn every_tour_plays_and_keeps_clear_of_walls() {
    for name in TOURS {
        for seed in 0..3 {
            let tour = tour(name, seed).unwrap();
            assert_eq!((tour.name, tour.seed), (*name, seed));
            assert!(tour.hypotheses[0].pieces.is_empty());
            assert!(tour.drive.poses.iter().step_by(10).all(|p| {
                let clearance_m = tour.scenario.world.clearance_m([p.x_m, p.y_m]);
                assert!(clearance_m > 0.18, "{name} {seed}: {clearance_m} m at {p:?}");
                true
            }));
            let path_m = tour.path_m();
            let longest_m = if *name == "large" { 1100.0 } else { 500.0 };
            assert!((80.0..longest_m).contains(&path_m), "{name} {seed}: {path_m} m");
            let played = tour.play().unwrap();
            for message in messages(&played.stream, &played.narration[&Language::Complex], "sim") {
                message.validate(&Limits::default()).unwrap();
            }
            assert_eq!(played.faults.len(), usize::from(["slip", "unsigned", "break"].contains(name)));
        }
    }
    assert!(matches!(tour("huge", 1), Err(SimError::NoSuchTour(..))));
}

#[test]
fn same_seed_same_bytes_and_another_seed_another_building() {
    for name in TOURS {
        let [first, again, other] = [1, 1, 2].map(|seed| tour(name, seed).unwrap());
        assert_eq!(text(&first.play().unwrap()), text(&again.play().unwrap()), "{name}");
        assert_ne!(first.scenario.world.walls, other.scenario.world.walls, "{name}");
    }
}

/// Way driven between two times.
fn way_m(tour: &Tour, from_s: f64, to_s: f64) -> f64 {
    let steps = [from_s, to_s].map(|t_s| (t_s / STEP_S).round() as usize);
    Drive { poses: tour.drive.poses[steps[0]..=steps[1]].to_vec() }.path_m()
}

#[test]
fn look_alikes_scan_alike_until_something_settles_it() {
    for name in ambiguous() {
        for seed in 0..3 {
            let tour = tour(name, seed).unwrap();
            assert!((2..=6).contains(&tour.hypotheses.len()), "{name}: {}", tour.hypotheses.len());
            // In the demo's building the second day shows more than what looks alike.
            let demo = name == "start" && tour.decisive_s.is_some();
            assert_eq!(tour.decisive_s.is_some() && !demo, name.ends_with("-decided"), "{name} {seed}");
            for hypothesis in &tour.hypotheses[1..] {
                let from_s = hypothesis.pieces[0].from_s;
                let refuted_s = tour.refuted_s(hypothesis);
                assert_eq!(
                    refuted_s.is_some(),
                    tour.decisive_s.is_some(),
                    "{name} {seed} {}",
                    hypothesis.name
                );
                let until_s = refuted_s.unwrap_or(tour.drive.duration_s());
                let shared_m = way_m(&tour, from_s, until_s);
                assert!(shared_m > 15.0 || demo, "{name} {seed}: {shared_m} m alike after the return");
                alike(&tour, hypothesis, from_s, until_s - 1.0);
            }
        }
    }
}

fn alike(tour: &Tour, hypothesis: &Hypothesis, from_s: f64, until_s: f64) {
    let (world, laser) = (&tour.scenario.world, &tour.scenario.lasers[0]);
    for k in 0..((until_s - from_s) / 0.7) as usize {
        let t_s = from_s + 0.7 * k as f64;
        if tour.blind_s.iter().any(|(from, to)| (*from..=*to).contains(&t_s)) {
            continue;
        }
        let here = tour.drive.at(t_s);
        let seen = laser.ranges_m(world, &here);
        let there = laser.ranges_m(world, &hypothesis.at(t_s, &here));
        let odd = seen.iter().zip(&there).filter(|(a, b)| match (a, b) {
            (Some(a), Some(b)) => (*a - *b).abs() > 1e-6,
            (a, b) => a.is_some() != b.is_some(),
        });
        // A ray that just grazes a corner may fall on either side of it.
        let odd = odd.count();
        assert!(odd <= 1, "{} {}: {odd} rays differ at {t_s} s", tour.name, tour.seed);
    }
}

/// Chances of the hypotheses for an observer without words who knows the world, and the wheels as
/// far as the laser let them be known: the truth's, then the greatest.
fn observed(tour: &Tour) -> (f64, f64) {
    let mut draw = Draw::new(tour.seed, 77);
    let prior = &tour.wheels_prior;
    let drawn = Vector3::from_fn(|_, _| draw.normal());
    let errors = unknown(&tour.drive, &tour.blind_s, prior) * drawn;
    let errors = Wheels {
        scale_error: errors.x,
        turn_error: errors.y,
        yaw_bias_rad_per_m: errors.z,
        ..tour.scenario.wheels
    };
    let measured = tour.drive.measured(&errors, &mut draw);
    let mut logs = vec![0.0; tour.hypotheses.len()];
    for &(from_s, to_s) in tour.blind_s.iter().filter(|s| design::is_crossing(&tour.drive, **s)) {
        for (log, h) in logs.iter_mut().zip(&tour.hypotheses) {
            let before = h.at(from_s - 0.1, &tour.drive.at(from_s));
            let end = between(&before, &h.at(to_s, &tour.drive.at(to_s)));
            *log -= strain(&measured, &tour.blind_s, (from_s, to_s), &end, prior).powi(2) / 2.0;
        }
    }
    let top = logs.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let sum: f64 = logs.iter().map(|l| (l - top).exp()).sum();
    ((logs[0] - top).exp() / sum, 1.0 / sum)
}

#[test]
fn wheels_cannot_tell_which_door_it_was() {
    for name in ["small", "autonomous", "twins", "ring", "rows"] {
        let mut seen: Vec<(f64, f64)> = (0..15).map(|seed| observed(&tour(name, seed).unwrap())).collect();
        let unsure = seen.iter().filter(|s| (0.3..0.8).contains(&s.1)).count();
        seen.sort_by(|a, b| a.0.total_cmp(&b.0));
        assert!(seen[7].0 < 0.75, "{name}: the truth has {:.2}", seen[7].0);
        assert!(unsure >= 9, "{name}: {unsure} of 15 are open");
    }
}

#[test]
fn the_truth_is_drawn_with_equal_chances() {
    let led = |seed| tour("rows", seed).unwrap().hypotheses[1].pieces[0].world_from_true;
    let shifts: BTreeSet<i64> = (0..8).map(|seed| (led(seed).x_m + led(seed).y_m).round() as i64).collect();
    assert!(shifts.iter().any(|s| *s > 0) && shifts.iter().any(|s| *s < 0), "{shifts:?}");
    let back = |seed| {
        let tour = tour("small", seed).unwrap();
        // Back by its own door, the robot names the gym again; else something else.
        let said = words::narrate(&tour, Language::Simple);
        said.iter().filter(|s| s.sentence.text.contains("gym")).count() == 2
    };
    let same = (0..12).filter(|&seed| back(seed)).count();
    assert!((3..=9).contains(&same), "{same} of 12");
}

#[test]
fn each_language_speaks_as_it_should() {
    for seed in 0..3 {
        let tour = tour("small", seed).unwrap();
        let played = tour.play().unwrap();
        let said = |l| &played.narration[&l];
        let texts = |l| said(l).iter().map(|s| s.sentence.text.as_str()).collect::<Vec<_>>();
        assert!(said(Language::None).is_empty());
        assert!(texts(Language::Simple).contains(&"This is the gym."));
        assert!(texts(Language::Simple).iter().all(|t| !t.contains("down") && !t.contains("next")));
        let complex = texts(Language::Complex);
        assert!(complex.contains(&"The gym is down the hallway."), "{complex:?}");
        assert!(!complex.contains(&"This is the gym."));
        let named = complex.iter().position(|t| *t == "This is the hallway.");
        assert!(named < complex.iter().position(|t| t.contains("down the hallway")), "{complex:?}");
        assert!(said(Language::Complex).iter().all(|s| s.claim.as_ref().unwrap().held));
        let lies: Vec<usize> = (0..said(Language::False20).len())
            .filter(|&k| !said(Language::False20)[k].claim.as_ref().unwrap().held)
            .collect();
        assert!(!lies.is_empty() && lies.windows(2).all(|w| w[1] - w[0] == 5) && lies[0] < 5, "{lies:?}");
        for s in said(Language::False20) {
            let claim = s.claim.as_ref().unwrap();
            let called = |r: &&crate::Room| r.area.contains(claim.at, 0.0) && r.name == claim.name;
            assert_eq!(tour.scenario.world.rooms.iter().any(|r| called(&r)), claim.held, "{s:?}");
            assert!(s.sentence.text.contains(&claim.name));
        }
    }
}

#[test]
fn names_come_late_after_a_return_where_it_is_hard() {
    for name in ["twins", "ring-decided", "rows", "start"] {
        for seed in 0..3 {
            let tour = tour(name, seed).unwrap();
            let back_s = tour.returns_s[0];
            let said = words::narrate(&tour, Language::Complex);
            let mut later = said.iter().map(|s| s.sentence.began_s).filter(|t| *t > back_s);
            let first_s = later.next().expect("words settle it");
            assert!(way_m(&tour, back_s, first_s) > 11.0, "{name} {seed}: {first_s} s after {back_s} s");
        }
    }
}

#[test]
fn what_was_never_said_has_no_place_and_what_was_has_all_rooms_so_called() {
    let played = tour("large", 1).unwrap().play().unwrap();
    let asked = &played.questions[&Language::Simple];
    assert!(asked["where is the sauna"].rooms.is_empty());
    assert!(asked["where is the hallway"].rooms.len() > 2);
    assert!(played.questions[&Language::None].values().all(|asked| asked.rooms.is_empty()));
    let said = played.narration[&Language::Simple].len();
    assert!((15..=30).contains(&said), "{said} descriptions");
}

#[test]
fn a_second_day_has_a_boot_of_its_own_and_odometry_from_nought() {
    let tour = tour("start", 1).unwrap();
    let played = tour.play().unwrap();
    let from = toponym_proto::Stamp::from_seconds(tour.second_day_s.unwrap());
    let mut first = None;
    for message in &played.stream {
        let header = message.header().unwrap();
        assert_eq!(header.boot, u64::from(header.stamp >= from && header.boot == 1));
        if header.boot == 1 && first.is_none() {
            assert!(matches!(message, Message::Setup(_)) && header.seq == 0 && header.stamp == from);
            first = Some(header.stamp);
        }
        if let (Message::Odom(odom), true) = (message, header.boot == 1 && header.stamp == from) {
            assert_eq!(odom.odom_from_body, Pose::default());
        }
    }
    assert!(first.is_some());
    let stamps: Vec<_> = played.truth.scans.iter().map(|s| s.0).collect();
    assert!(stamps.windows(2).all(|w| w[0] < w[1]));
}

#[test]
fn names_of_languages_are_read_back() {
    for language in Language::ALL {
        assert_eq!(language.to_string().parse::<Language>().unwrap(), language);
    }
    assert!("german".parse::<Language>().is_err());
}
