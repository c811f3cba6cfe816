use super::*;
use crate::language::grounding::place::GroundPlace;
use proptest::prelude::*;

/// Along x, into a room at x = 12 and out again, on to 30.
fn drive() -> Vec<GroundPlace> {
    walk(&[(0.0, 0.0), (12.0, 0.0), (12.0, 5.0), (12.0, 0.0), (30.0, 0.0)])
}

#[test]
fn factors_integrate_to_at_most_one() {
    let places = drive();
    for (speaker, place) in [(4, 17), (20, 8), (26, 26)] {
        let scene = Scene::new(&places, speaker, Scales::FITTED).unwrap();
        for &relation in Relation::ALL {
            for (way, frame) in [(false, Frame::Hearer), (true, Frame::Intrinsic), (false, Frame::Path)] {
                let target = Target { place, way, other: Some(3) };
                let narrowing = Narrowing::default();
                let factor = Factor::new(&scene, relation, frame, narrowing, target);
                let Some(factor) = factor else { continue };
                let mut total = 0.0;
                for i in -70..70 {
                    for j in -70..70 {
                        let step_m = |k: i32| 0.53 * f64::from(k);
                        let at = (factor.footprint.x_m + step_m(i), factor.footprint.y_m + step_m(j));
                        let distance = factor.distance_score(at, || scene.straight_m(at));
                        let score = factor.envelope.at_gap(factor.gap_m(at)) * distance * factor.score(at);
                        total += step_m(1).powi(2) * score * factor.scale_per_m2;
                    }
                }
                // The integral is known from some sixty samples; what is seen is capped at one anyway.
                assert!(total < 1.4, "{relation:?} {way} {frame:?} from {speaker} to {place}: {total}");
            }
        }
    }
}

#[test]
fn other_floors_are_not_this_one() {
    let places = drive();
    let scene = Scene::new(&places, 4, Scales::FITTED).unwrap();
    let target = Target { place: 8, way: false, other: None };
    for relation in [Relation::Above, Relation::LevelDown] {
        let narrowing = Narrowing::default();
        assert!(Factor::new(&scene, relation, Frame::Hearer, narrowing, target).is_none());
    }
}

/// The density at a place by the definition: its whole way, cut where it first comes near.
fn density_by_definition(factor: &Factor, way: &[Step]) -> f64 {
    let at = way[way.len() - 1].at;
    let score = match &factor.shape {
        Shape::Path(path) => {
            let mut near = (1..way.len()).filter_map(|k| {
                let (from, to) = (way[k - 1], way[k]);
                Some((path.start(from, path.before_m(from.at), to, path.before_m(to.at))?, k))
            });
            let onset = way.iter().find(|s| unit_off(s.at, way[0].at)).map_or(at, |s| s.at);
            near.next().map_or(0.0, |(start, k)| path.p(start, &way[k..]) * factor.onward(onset))
        }
        _ => factor.score(at),
    };
    let distance = factor.distance_score(at, || way[way.len() - 1].walk_m);
    factor.envelope.at_gap(factor.gap_m(at)) * score * distance * factor.scale_per_m2
}

fn unit_off(a: (f64, f64), b: (f64, f64)) -> bool {
    (a.0 - b.0).hypot(a.1 - b.1) > 2.0
}

proptest! {
    #[test]
    fn shared_ways_change_nothing(
        corners in prop::collection::vec((-12.0..12.0, -12.0..12.0), 2..9),
        kind in 0..Relation::ALL.len(),
        (speaker, place, other) in (0..40usize, 0..40usize, 0..40usize),
        (way, just) in any::<(bool, bool)>(),
        distance_m in prop::option::of(0.0..30.0),
    ) {
        let places = walk(&corners);
        prop_assume!(speaker.max(place).max(other) < places.len());
        let scene = Scene::new(&places, speaker, Scales::FITTED).unwrap();
        let target = Target { place, way, other: Some(other) };
        let narrowing = Narrowing { just, distance_m, doors: None };
        if let Some(factor) = Factor::new(&scene, Relation::ALL[kind], Frame::Hearer, narrowing, target) {
            let (mut sums, mut seen) = (vec![0.0; places.len()], 0);
            factor.add_densities(0.5, &mut sums);
            scene.ways().visit(&places, |k, way| {
                let right = 0.5 * density_by_definition(&factor, way);
                assert!((sums[k] - right).abs() <= 1e-12 * right, "{k}: {} {right}", sums[k]);
                seen += 1;
            });
            // Corners are less far apart than what is taken for a gap: there is a way to each place.
            prop_assert!(seen == places.len() || scene.ways().walk_m(places.len() - 1).is_none());
        }
    }
}

/// Places along some corners, a metre apart.
fn walk(corners: &[(f64, f64)]) -> Vec<GroundPlace> {
    let mut places = Vec::new();
    for leg in corners.windows(2) {
        let (dx, dy): (f64, f64) = (leg[1].0 - leg[0].0, leg[1].1 - leg[0].1);
        let steps = dx.hypot(dy).ceil();
        places.extend((0..steps as usize).map(|s| {
            let f = s as f64 / steps;
            GroundPlace { x_m: leg[0].0 + f * dx, y_m: leg[0].1 + f * dy, yaw_rad: dy.atan2(dx), path_m: 0.0 }
        }));
    }
    for (k, p) in places.iter_mut().enumerate() {
        p.path_m = k as f64;
    }
    places
}
