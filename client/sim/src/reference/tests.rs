use super::super::calibration::Systematic;
use super::super::geom::{Rect, between, compose};
use super::super::{Draw, People, Plan, Scene, Sentence, Wheels};
use super::wheels::Link;
use super::*;
use nalgebra::Matrix3;
use std::f64::consts::FRAC_PI_2;
use toponym_proto::{Clock, Header, Scan, Stamp};

/// From stall to stall along the hall.
const PITCH_M: f64 = 1.2;

/// Two stalls side by side off a hall, as wide as each other; a pillar may stand in the second.
fn stalls(pillar: bool) -> World {
    let mut plan = Plan::default();
    plan.corridor("hall", Rect::new([0.0, -1.0], [30.0, 1.0]));
    for (name, x_m) in [("left", 20.0), ("right", 20.0 + PITCH_M)] {
        plan.room(name, Rect::new([x_m - 0.5, 1.2], [x_m + 0.5, 5.0]));
        plan.door([x_m, 1.0], [x_m, 1.2], 0.8);
    }
    if pillar {
        plan.block([20.0 + PITCH_M, 4.5], [0.2, 0.2], 0.0);
    }
    plan.build()
}

/// Straight legs at 1 m/s, each followed by a turn on the spot at 0.5 rad/s.
fn driven(start: Pose, legs: &[(f64, f64)]) -> Drive {
    let mut poses = vec![start];
    for &(way_m, turn_rad) in legs {
        let (ways, turns) = ((way_m / STEP_S).round(), (turn_rad.abs() / 0.5 / STEP_S).ceil());
        let way = Pose { x_m: way_m / ways.max(1.0), ..Pose::default() };
        let turn = Pose { yaw_rad: turn_rad / turns.max(1.0), ..Pose::default() };
        for step in [vec![way; ways as usize], vec![turn; turns as usize]].concat() {
            poses.push(compose(&poses[poses.len() - 1], &step));
        }
    }
    Drive { poses }
}

/// Round a lit square of 2 m, then through the dark hall into a stall, 1 m of which is lit; when
/// it was dark.
fn tour(right: bool) -> (Drive, Vec<Stretch>) {
    let along_m = if right { 15.0 + PITCH_M } else { 15.0 };
    let square = [(2.0, FRAC_PI_2); 4];
    let start = Pose { x_m: 5.0, ..Pose::default() };
    let from_s = driven(start, &square).duration_s();
    let legs = [&square[..], &[(along_m, FRAC_PI_2), (3.0, 0.0), (1.0, 0.0)]].concat();
    let drive = driven(start, &legs);
    let dark = vec![Stretch::dark((from_s, drive.duration_s() - 1.0))];
    (drive, dark)
}

fn moved(name: &str, pieces: &[(f64, f64)]) -> Hypothesis {
    let piece =
        |&(from_s, x_m): &(f64, f64)| Piece { from_s, world_from_true: Pose { x_m, ..Pose::default() } };
    Hypothesis { name: name.into(), pieces: pieces.iter().map(piece).collect() }
}

/// Fair wheels that count metres badly, `noise_m` off after the first.
fn prior(noise_m: f64) -> WheelsPrior {
    WheelsPrior {
        scale: 0.05,
        turn: 0.05,
        yaw_bias_rad_per_m: 0.005,
        noise_m,
        yaw_noise_rad: 0.012,
        turn_noise_rad: 0.02,
    }
}

/// What a robot with nothing but wheels sees.
fn seen<'a>(
    world: &'a World,
    (drive, dark): &'a (Drive, Vec<Stretch>),
    odometry: &'a Drive,
    prior: &'a WheelsPrior,
) -> Seen<'a> {
    Seen {
        world,
        drive,
        odometry,
        prior,
        dark,
        lasers: &[],
        stream: &[],
        stride_s: 1.0,
        said: &[],
        epsilon: 0.02,
        vocabulary: 10,
    }
}

fn last(seen: &Seen<'_>, hypotheses: &[Hypothesis]) -> Posterior {
    posterior(seen, hypotheses, &[], &[seen.drive.duration_s()]).unwrap().remove(0)
}

#[test]
fn errors_in_the_dark_spread_as_predicted() {
    // A curve, and a stretch long enough for heading errors to turn into metres.
    let lit = driven(Pose::default(), &[(2.0, 1.0); 3]);
    let drive =
        driven(Pose::default(), &[&[(2.0, 1.0); 3][..], &[(4.0, -1.5), (5.0, 0.7), (3.0, 0.0)]].concat());
    let stretch = Stretch::dark((lit.duration_s(), drive.duration_s()));
    let rel = between(&drive.at(stretch.from_s), &drive.at(stretch.to_s));
    let (prior, n) = (prior(0.05), 2000);
    let (mut sample, mut predicted) = (Matrix3::zeros(), Matrix3::zeros());
    for seed in 0..n {
        let mut draw = Draw::new(seed, 0);
        let wheels = prior.draw(&mut draw);
        let odometry = drive.measured(&wheels, &mut draw);
        let learned = Systematic::learn(&drive, &odometry, &prior, 0..lit.poses.len() - 1);
        let link = Link::new(&drive, &odometry, &prior, &learned.mean, &stretch);
        let e = link.residual(&rel);
        sample += e * e.transpose() / n as f64;
        predicted += (link.noise + plane::through(&link.by_systematic, &learned.covariance)) / n as f64;
    }
    for i in 0..3 {
        for j in 0..3 {
            let scale = (predicted[(i, i)] * predicted[(j, j)]).sqrt();
            let off = (sample[(i, j)] - predicted[(i, j)]) / scale;
            assert!(off.abs() < 0.1, "[{i}][{j}] off by {off}: {sample:?}, not {predicted:?}");
        }
    }
}

#[test]
fn who_claims_a_probability_is_right_as_often() {
    let (world, prior) = (stalls(false), prior(0.12));
    let tours = [tour(false), tour(true)];
    let mut claims = Vec::new();
    for seed in 0..200 {
        let mut draw = Draw::new(seed, 1);
        let right = draw.chance(0.5);
        let tour = &tours[usize::from(right)];
        let wheels = prior.draw(&mut draw);
        let odometry = tour.0.measured(&wheels, &mut draw);
        let other = if right { -PITCH_M } else { PITCH_M };
        let hypotheses = [truth(), moved("other", &[(tour.1[0].to_s, other)])];
        let p = last(&seen(&world, tour, &odometry, &prior), &hypotheses).p;
        claims.push((p[0].max(p[1]), p[0] > p[1]));
    }
    for (low, high) in [(0.5, 0.8), (0.8, 0.95), (0.95, 1.1), (0.5, 1.1)] {
        let bin: Vec<_> = claims.iter().filter(|c| low <= c.0 && c.0 < high).collect();
        let claimed: f64 = bin.iter().map(|c| c.0).sum();
        let spread = bin.iter().map(|c| c.0 * (1.0 - c.0)).sum::<f64>().sqrt();
        let right = bin.iter().filter(|c| c.1).count() as f64;
        assert!(bin.len() >= 20, "{} between {low} and {high}", bin.len());
        assert!((right - claimed).abs() < 2.5 * spread, "{right} right, {claimed} claimed, ±{spread}");
    }
}

#[test]
fn the_light_teaches_systematic_errors_and_sharpens_the_dark() {
    let drive = driven(Pose::default(), &[(24.0, 0.0)]);
    let (world, known) = (stalls(false), prior(0.01));
    let wheels = Wheels { scale_error: 0.06, ..Wheels::default() };
    let odometry = drive.measured(&wheels, &mut Draw::new(1, 0));
    let hypotheses = [truth(), moved("other", &[(24.0, PITCH_M)])];
    let dark_from = |from_s| {
        let tour = (drive.clone(), vec![Stretch::dark((from_s, 24.0))]);
        last(&seen(&world, &tour, &odometry, &known), &hypotheses).p[0]
    };
    assert!(dark_from(8.0) > 0.99, "{}", dark_from(8.0));
    assert!(dark_from(0.0) < 0.6, "6 % of 24 m look like {PITCH_M} m more: {}", dark_from(0.0));
    let learned = Systematic::learn(&drive, &odometry, &known, 0..400);
    assert!((learned.mean[0] - 0.06).abs() < 0.015, "{learned:?}");
    assert!(learned.covariance[(0, 0)].sqrt() < 0.01, "{learned:?}");
}

#[test]
fn nothing_counts_before_it_is_light_again() {
    let (world, tour, prior) = (stalls(false), tour(false), prior(0.01));
    let wheels = Wheels::default();
    let odometry = tour.0.measured(&wheels, &mut Draw::new(1, 0));
    let other = moved("other", &[(tour.1[0].from_s + 1.0, PITCH_M)]);
    let seen = seen(&world, &tour, &odometry, &prior);
    let at_s = [0.0, tour.1[0].to_s - 0.1, tour.1[0].to_s];
    let beliefs = posterior(&seen, &[truth(), other], &[1.0, 3.0], &at_s).unwrap();
    assert_eq!((&beliefs[0].p, &beliefs[1].p), (&vec![0.25, 0.75], &vec![0.25, 0.75]));
    assert!(beliefs[2].terms[1].wheels < -5.0, "{:?}", beliefs[2]);
}

#[test]
fn look_alikes_with_the_same_way_between_them_are_even() {
    let (world, (drive, mut dark), prior) = (stalls(false), tour(false), prior(0.01));
    // Carried by nobody knows how much, its odometry at 0 again, and then the same way in the dark.
    dark.insert(0, Stretch::restart(1.2));
    let mut odometry = drive.measured(&Wheels::default(), &mut Draw::new(1, 0));
    let restart = odometry.poses[60];
    for pose in &mut odometry.poses[60..] {
        *pose = between(&restart, pose);
    }
    let (to_s, tour) = (dark[1].to_s, (drive, dark));
    let seen = seen(&world, &tour, &odometry, &prior);
    let hypotheses = [truth(), moved("carried", &[(1.2, PITCH_M)]), moved("drove", &[(to_s, PITCH_M)])];
    let belief = last(&seen, &hypotheses);
    assert!((belief.p[0] - belief.p[1]).abs() < 1e-9, "{belief:?}");
    assert!(belief.p[2] < 1e-6, "the jump of the odometry is no step: {belief:?}");
    assert_eq!(last(&seen, &[truth(), truth()]).p, [0.5, 0.5]);
}

#[test]
fn stretches_share_their_systematic_errors() {
    let drive = driven(Pose::default(), &[(20.0, 0.0)]);
    let tour = (drive, vec![Stretch::dark((0.0, 10.0)), Stretch::dark((10.0, 20.0))]);
    let (world, prior) = (stalls(false), WheelsPrior { turn: 0.0, yaw_bias_rad_per_m: 0.0, ..prior(0.01) });
    let odometry = tour.0.measured(&Wheels::perfect(), &mut Draw::new(1, 0));
    // Each way is off by half a metre, once by the same scale, once by opposite ones.
    let alike = moved("alike", &[(9.0, 0.5), (19.0, 1.0)]);
    let opposite = moved("opposite", &[(9.0, 0.5), (19.0, 0.0)]);
    let belief = last(&seen(&world, &tour, &odometry, &prior), &[alike, opposite]);
    assert!(belief.p[0] > 0.999, "{belief:?}");
    assert!((belief.terms[0].wheels + 0.5).abs() < 0.01, "one standard deviation: {belief:?}");
}

fn scan(ranges_m: Vec<f32>, t_s: f64, laser: &LaserModel) -> Message {
    let stamp = Stamp::from_seconds(t_s);
    let header = Header { robot: "r".into(), boot: 0, seq: 0, stamp, clock: Clock::Sim };
    Message::Scan(Scan {
        header,
        laser: laser.mount.id.clone(),
        angle_min_rad: laser.angle_min_rad(),
        angle_increment_rad: laser.fov_rad / 180.0,
        time_increment_s: 0.0,
        ranges_m,
    })
}

fn scanned(world: &World, drive: &Drive, laser: &LaserModel, t_s: f64) -> Message {
    let scene = Scene { world, drive, people: &People::default() };
    scan(laser.sweep(&scene, t_s, &mut Draw::new(1, 7)).ranges_m, t_s, laser)
}

#[test]
fn a_room_that_differs_is_told_by_the_first_scan() {
    let (tour, prior, laser) = (tour(false), prior(0.12), [LaserModel::default()]);
    let to_s = tour.1[0].to_s;
    let hypotheses = [truth(), moved("other", &[(to_s, PITCH_M)])];
    for pillar in [true, false] {
        let world = stalls(pillar);
        let stream = [0.4, 0.0].map(|before_s| scanned(&world, &tour.0, &laser[0], to_s - before_s));
        let seen = Seen { lasers: &laser, stream: &stream, ..seen(&world, &tour, &tour.0, &prior) };
        let belief = &posterior(&seen, &hypotheses, &[], &[to_s]).unwrap()[0];
        if pillar {
            assert!(belief.p[0] > 0.9999 && belief.terms[1].laser < -50.0, "{belief:?}");
        } else {
            assert!(belief.terms[1].laser.abs() < 1e-6, "stalls alike: {belief:?}");
        }
    }
}

#[test]
fn scans_in_the_dark_too_soon_after_another_or_on_legs_say_nothing() {
    let (world, tour, prior, laser) = (stalls(true), tour(false), prior(0.12), [LaserModel::default()]);
    let to_s = tour.1[0].to_s;
    let hypothesis = moved("other", &[(to_s, PITCH_M)]);
    let told = |stream: &[Message], stride_s: f64| {
        let seen = seen(&world, &tour, &tour.0, &prior);
        let ratios = rays::ratios(&Seen { lasers: &laser, stream, stride_s, ..seen }, &hypothesis);
        ratios.into_iter().map(|(at_s, log_ratio)| (at_s - to_s, log_ratio)).collect::<Vec<_>>()
    };
    let at = |t_s: f64| scanned(&world, &tour.0, &laser[0], to_s + t_s);
    let stream = [at(-0.5), at(0.0), at(0.4), at(0.5), at(0.9)];
    let used: Vec<f64> = told(&stream, 0.5).iter().map(|r| (r.0 * 10.0).round() / 10.0).collect();
    assert_eq!(used, [0.0, 0.5]);
    // Someone stands where the other stall has its pillar.
    let elsewhere =
        Drive { poses: tour.0.poses.iter().map(|p| Pose { x_m: p.x_m + PITCH_M, ..*p }).collect() };
    let legs = [scanned(&world, &elsewhere, &LaserModel { noise_m: 0.0, ..laser[0].clone() }, to_s)];
    let legs = told(&legs, 1.0);
    assert!(legs[0].1.abs() < 1e-6, "{legs:?}");
}

#[test]
fn words_decide_and_can_be_outvoted() {
    let (world, tour, prior) = (stalls(false), tour(false), prior(0.12));
    let to_s = tour.1[0].to_s;
    let hypotheses = [truth(), moved("other", &[(to_s, PITCH_M)])];
    let said: Vec<Said> = ["right", "left", "left", "attic"]
        .iter()
        .zip(1..)
        .map(|(name, k)| {
            let began_s = to_s + f64::from(k) / 10.0;
            let sentence = Sentence { began_s, ended_s: began_s + 2.0, text: String::new() };
            let claim = Claim { name: (*name).into(), at: [20.0, 4.0], held: *name == "left", relations: 0 };
            Said { sentence, claim: Some(claim) }
        })
        .collect();
    let seen = Seen { said: &said, epsilon: 0.2, vocabulary: 4, ..seen(&world, &tour, &tour.0, &prior) };
    let at_s = [0.0, 0.1, 0.2, 0.3, 0.4].map(|s| to_s + s);
    let beliefs = posterior(&seen, &hypotheses, &[], &at_s).unwrap();
    // A name that fits is (0.8 + 0.05) / 0.05 = 17 times as likely as one that does not.
    for (belief, want) in beliefs.iter().zip([0.0, 1.0, 0.0, -1.0, -1.0]) {
        assert!((belief.terms[1].words - want * 17f64.ln()).abs() < 1e-9, "{belief:?}");
    }
    assert!(beliefs[1].p[1] > beliefs[0].p[1] && beliefs[3].p[1] < beliefs[0].p[1]);
    let never_false = Seen { epsilon: 0.0, ..seen };
    let belief = &posterior(&never_false, &hypotheses, &[], &at_s[1..2]).unwrap()[0];
    assert!(belief.p[1] > 0.999_999, "{belief:?}");
}

#[test]
fn a_jump_in_the_light_is_an_error() {
    let (world, tour, prior) = (stalls(false), tour(false), prior(0.05));
    let seen = seen(&world, &tour, &tour.0, &prior);
    let jump = moved("jump", &[(tour.1[0].from_s, 1.0)]);
    let error = posterior(&seen, &[jump], &[], &[1.0]).unwrap_err();
    assert_eq!(error, ReferenceError::LitJump { hypothesis: "jump".into(), from_s: tour.1[0].from_s });
}
