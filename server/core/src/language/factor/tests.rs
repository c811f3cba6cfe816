use super::*;

/// Along x, into a room at x = 12 and out again, on to 30.
fn drive() -> Vec<GroundPlace> {
    let corners = [(0.0, 0.0), (12.0, 0.0), (12.0, 5.0), (12.0, 0.0), (30.0, 0.0)];
    let mut places = Vec::new();
    for leg in corners.windows(2) {
        let (dx, dy): (f64, f64) = (leg[1].0 - leg[0].0, leg[1].1 - leg[0].1);
        let steps = dx.hypot(dy) as usize;
        places.extend((0..steps).map(|s| {
            let f = s as f64 / steps as f64;
            GroundPlace { x_m: leg[0].0 + f * dx, y_m: leg[0].1 + f * dy, yaw_rad: dy.atan2(dx), path_m: 0.0 }
        }));
    }
    for (k, p) in places.iter_mut().enumerate() {
        p.path_m = k as f64;
    }
    places
}

#[test]
fn factors_integrate_to_at_most_one() {
    let places = drive();
    let mut path = Vec::new();
    for (speaker, place) in [(4, 17), (20, 8), (26, 26)] {
        let scene = Scene::new(&places, speaker).unwrap();
        for &relation in Relation::ALL {
            for (way, frame) in [(false, Frame::Hearer), (true, Frame::Intrinsic), (false, Frame::Path)] {
                let target = Target { place, way, other: Some(3) };
                let narrowing = Narrowing::default();
                let factor = Factor::new(&scene, relation, frame, narrowing, target, &mut path);
                let Some(factor) = factor else { continue };
                let mut total = 0.0;
                for i in -70..70 {
                    for j in -70..70 {
                        let step_m = |k: i32| 0.53 * f64::from(k);
                        let at = (factor.footprint.x_m + step_m(i), factor.footprint.y_m + step_m(j));
                        let spot = factor.straight(at, &mut path);
                        total += step_m(1).powi(2) * factor.density_at(&spot, &mut path);
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
    let scene = Scene::new(&places, 4).unwrap();
    let target = Target { place: 8, way: false, other: None };
    for relation in [Relation::Above, Relation::LevelDown] {
        let narrowing = Narrowing::default();
        assert!(Factor::new(&scene, relation, Frame::Hearer, narrowing, target, &mut Vec::new()).is_none());
    }
}
