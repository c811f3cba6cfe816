//! Doors along a hallway that the robot has gone through, to count them as guides do.

use crate::language::grounding::footprint::Footprint;
use crate::language::grounding::scene::{Scene, WAY_HALF_M};

/// Doors nearer each other along the hallway are one, entered again: less than two rooms' doors keep.
const SAME_M: f64 = 1.0;

/// A door so near where one stands is neither surely ahead nor surely not.
const ABEAM_M: f64 = 1.5;
/// Ahead and not are as likely so far ahead, and how fast that changes: a door that one stands in
/// front of is not counted, and positions are known to some decimetres.
const COUNTED_FROM_M: f64 = 0.5;
const UNSURE_M: f64 = 0.15;

/// Doors on one side of a hallway, ahead of where one stands.
pub struct Doors {
    /// Positions along the hallway, metres, ascending.
    known: Vec<f64>,
    /// Per place: where along the hallway the door is that it was reached by, metres, if by one.
    of_place: Vec<Option<f64>>,
    /// Where one stands.
    from_m: f64,
}

impl Doors {
    /// On the left of the way (`side` 1; −1 for the right), from a little behind `from_m` on it.
    pub fn new(scene: &Scene, way: &Footprint, along: (f64, f64), side: f64, from_m: f64) -> Self {
        let (mut known, mut of_place) = (Vec::new(), Vec::new());
        // The last place, if in the hallway; of places off it, where they left it.
        let (mut was, mut door_m) = (None, None);
        for place in 0..scene.places.len() {
            let (x_m, y_m) = scene.at(place);
            let (dx, dy) = (x_m - way.x_m, y_m - way.y_m);
            let (u, v) = (dx * along.0 + dy * along.1, dy * along.0 - dx * along.1);
            let is_in = v.abs() <= WAY_HALF_M && u.abs() <= way.half_length_m + WAY_HALF_M;
            if is_in {
                door_m = None;
            } else if let Some((last_u, last_v)) = was.filter(|_| v.abs() > WAY_HALF_M) {
                let share: f64 = (v.signum() * WAY_HALF_M - last_v) / (v - last_v);
                let at_m: f64 = last_u + share * (u - last_u);
                door_m = Some(at_m);
                known.extend(door_m.filter(|m| side * v > 0.0 && *m > from_m - ABEAM_M));
            }
            of_place.push(door_m);
            was = is_in.then_some((u, v));
        }
        known.sort_by(f64::total_cmp);
        known.dedup_by(|b, a| *b - *a < SAME_M);
        Self { known, of_place, from_m }
    }

    /// Where along the hallway a place is entered.
    pub fn of_place_m(&self, place: usize) -> Option<f64> {
        self.of_place.get(place).copied().flatten()
    }

    /// How well a point so far along the hallway fits if `before` doors come before its own: 1 if so
    /// many were gone through, `missed` less for each that was not, `miscounted` if it were more.
    pub fn fit(&self, at_m: f64, before: usize, missed: f64, miscounted: f64) -> f64 {
        let passed = self.known.partition_point(|d| *d < at_m - 0.5 * SAME_M);
        let fit = |passed: usize| match before.checked_sub(passed) {
            Some(more) => missed.powi(more as i32),
            None => miscounted,
        };
        // The first may be abeam, and not count.
        let ahead = |m: f64| 1.0 / (1.0 + (-(m - self.from_m - COUNTED_FROM_M) / UNSURE_M).exp());
        match self.known.first() {
            Some(&first) if passed > 0 => ahead(first) * fit(passed) + (1.0 - ahead(first)) * fit(passed - 1),
            Some(&first) if (first - at_m).abs() <= 0.5 * SAME_M => {
                ahead(first) * fit(0) + (1.0 - ahead(first)) * miscounted
            }
            _ => fit(passed),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::language::grounding::place::GroundPlace;
    use crate::language::grounding::scales::Scales;

    #[test]
    fn doors_are_those_gone_through() {
        // Along x, into rooms on the left at 5, 10 (twice) and 20, and on the right at 7.
        let route = [(0.0, 0.0), (5.0, 0.0), (5.0, 3.0), (5.0, 0.0), (7.0, 0.0), (7.0, -3.0), (7.0, 0.0)];
        let more =
            [(10.0, 0.0), (12.0, 4.0), (10.0, 0.0), (10.0, 3.0), (10.0, 0.0), (20.0, 0.0), (20.0, 3.0)];
        let route: Vec<(f64, f64)> =
            route.into_iter().chain(more).chain([(20.0, 0.0), (25.0, 0.0)]).collect();
        let mut places = Vec::new();
        for leg in route.windows(2) {
            let (dx, dy) = (leg[1].0 - leg[0].0, leg[1].1 - leg[0].1);
            let steps = dx.hypot(dy).ceil();
            for s in 0..steps as usize {
                let f = s as f64 / steps;
                let (x_m, y_m, path_m) = (leg[0].0 + f * dx, leg[0].1 + f * dy, places.len() as f64);
                places.push(GroundPlace { x_m, y_m, yaw_rad: dy.atan2(dx), path_m });
            }
        }
        let scene = Scene::new(&places, 1, Scales::FITTED).unwrap();
        let way = Footprint::strip((0.0, 0.0), (25.0, 0.0), WAY_HALF_M);
        let from = |x_m: f64| Doors::new(&scene, &way, (1.0, 0.0), 1.0, x_m - 12.5);
        let doors = from(1.0);
        assert_eq!(doors.known.len(), 3, "{:?}", doors.known);
        let inside = (0..places.len()).find(|&k| places[k].x_m > 11.0 && places[k].y_m > 3.0).unwrap();
        assert!(
            (doors.of_place_m(inside).unwrap() - (10.5 - 12.5)).abs() < 0.2,
            "by its door, not where it lies"
        );
        let fit = |doors: &Doors, x_m: f64, before| doors.fit(x_m - 12.5, before, 0.1, 0.01);
        assert!(fit(&doors, 10.0, 1) > 0.99 && fit(&doors, 20.0, 2) > 0.99);
        assert!((fit(&doors, 10.0, 2) - 0.1).abs() < 0.01, "one was not gone through");
        assert!(fit(&doors, 10.0, 0) < 0.02, "there is one before");
        // The door that one stands at may not count.
        let (at, past) = (from(4.5), from(6.0));
        assert!((fit(&at, 10.0, 0) - 0.5).abs() < 0.1 && (fit(&at, 10.0, 1) - 0.5).abs() < 0.1);
        assert!(fit(&past, 10.0, 0) > 0.98);
    }
}
