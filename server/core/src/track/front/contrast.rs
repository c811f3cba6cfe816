//! What wheels say of motions that scans saw, in the long run: a laser that is mounted otherwise than setup says, wheels
//! that stand still or count in other units.
//!
//! ```text
//! ratio = |Σ odom · seen*| / Σ |seen|²,   angle = arg Σ odom* · seen     of windows; ways as complex numbers, turns as
//!                                                                       real ones; the older ones forgotten
//! ```

use crate::geometry::{Pose2, wrap};
use crate::track::mounting::Mismounted;
use nalgebra::Vector2;
use serde::{Deserialize, Serialize};
use std::f64::consts::FRAC_PI_2;

/// Motion seen in a window, metres of way plus radians turned.
const WINDOW: f64 = 0.5;
/// A way on which it turns more says little of the direction ahead.
const STRAIGHT_RAD: f64 = 0.2;
/// So much seen is enough, m² or rad²: ways of 2 m, half a radian, for who maps a corner in the mirror maps it wrong.
const LEAST_M2: f64 = 1.0;
const LEAST_RAD2: f64 = 0.15;
/// Per window so much is forgotten.
const FORGETS: f64 = 0.02;
/// Ratios of wheels that are merely badly calibrated.
const SANE: std::ops::RangeInclusive<f64> = 0.4..=2.5;
/// Below this share of what was seen, wheels stand still.
const STILL: f64 = 0.1;
/// A laser that looks so far aside is mounted otherwise than setup says …
const ASIDE_RAD: f64 = 0.35;
/// … at a right angle, if it is so near to one …
const NEARLY_RAD: f64 = 0.17;
/// … if wheels and scans agree on all but that: squared correlation.
const ALIKE: f64 = 0.8;

/// The sums of ways, or of turns.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
struct Sums {
    /// Along, and across to the left.
    both: Vector2<f64>,
    seen: f64,
    odom: f64,
    least: f64,
}

impl Sums {
    fn new(least: f64) -> Self {
        Self { both: Vector2::zeros(), seen: 0.0, odom: 0.0, least }
    }

    fn add(&mut self, odom: Vector2<f64>, seen: Vector2<f64>) {
        let keeps = 1.0 - FORGETS;
        self.both = self.both * keeps + Vector2::new(odom.dot(&seen), odom.perp(&seen));
        self.seen = self.seen * keeps + seen.norm_squared();
        self.odom = self.odom * keeps + odom.norm_squared();
    }

    fn is_enough(&self) -> bool {
        self.seen > self.least
    }

    /// What wheels say of a unit of motion, whatever its direction.
    fn ratio(&self) -> f64 {
        self.both.norm() / self.seen
    }

    /// From where wheels say that it goes to where scans see it go.
    fn angle_rad(&self) -> f64 {
        self.both.y.atan2(self.both.x)
    }

    fn stands_still(&self) -> bool {
        self.is_enough() && self.odom < STILL * STILL * self.seen
    }

    /// Whether wheels and scans tell the same motion, in some direction and some unit.
    fn is_alike(&self) -> bool {
        self.is_enough() && self.both.norm_squared() > ALIKE * self.odom * self.seen
    }
}

/// Wheels and scans, side by side.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Contrast {
    /// Where the window began, and odometry's way and turn since: summed up, for composed a wrong turn would spoil
    /// the way.
    from: Option<Pose2>,
    way: Vector2<f64>,
    turn_rad: f64,
    ways: Sums,
    turns: Sums,
}

impl Default for Contrast {
    fn default() -> Self {
        let (ways, turns) = (Sums::new(LEAST_M2), Sums::new(LEAST_RAD2));
        Self { from: None, way: Vector2::zeros(), turn_rad: 0.0, ways, turns }
    }
}

impl Contrast {
    /// Wheels moved.
    pub fn drive(&mut self, increment: &Pose2) {
        self.way += Vector2::new(increment.x_m, increment.y_m);
        self.turn_rad += wrap(increment.yaw_rad);
    }

    /// Scans told the pose.
    pub fn saw(&mut self, front_from_body: &Pose2) {
        let from = *self.from.get_or_insert(*front_from_body);
        let seen = from.between(front_from_body).log();
        if seen.xy().norm() + seen.z.abs() >= WINDOW {
            if seen.z.abs() < STRAIGHT_RAD {
                self.ways.add(self.way, seen.xy());
            }
            self.turns.add(Vector2::new(self.turn_rad, 0.0), Vector2::new(seen.z, 0.0));
            self.lift();
            self.from = Some(*front_from_body);
        }
    }

    /// The pose has no more to do with the one before.
    pub fn lift(&mut self) {
        (self.from, self.way, self.turn_rad) = (None, Vector2::zeros(), 0.0);
    }

    /// Whether wheels say nothing.
    pub fn stands_still(&self) -> bool {
        self.ways.stands_still()
    }

    /// How the laser is mounted, if wheels and scans agree once it is taken for mounted so.
    pub fn mismounted(&self) -> Option<Mismounted> {
        if self.turns.is_alike() && self.turns.both.x < 0.0 {
            return Some(Mismounted { turned_rad: 0.0, upside_down: true });
        }
        let aside_rad = -self.ways.angle_rad();
        let right_rad = (aside_rad / FRAC_PI_2).round() * FRAC_PI_2;
        let turned_rad = if (aside_rad - right_rad).abs() < NEARLY_RAD { right_rad } else { aside_rad };
        (self.ways.is_alike() && turned_rad.abs() > ASIDE_RAD)
            .then_some(Mismounted { turned_rad, upside_down: false })
    }

    /// How wheels and scans contradict each other; none if they do not.
    pub fn contradiction(&self) -> Option<String> {
        if let Some(mismounted) = self.mismounted() {
            return Some(mismounted.why());
        }
        let odd = |s: &Sums| s.is_enough() && !s.stands_still() && !SANE.contains(&s.ratio());
        if odd(&self.ways) {
            Some(format!("wheels say {:.2} m of each metre that scans see", self.ways.ratio()))
        } else if odd(&self.turns) {
            Some(format!("wheels say {:.2} rad of each radian that scans see", self.turns.ratio()))
        } else {
            None
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::PI;

    /// Straight on and round corners.
    fn driven(odom: impl Fn(&Pose2) -> Pose2, seen: impl Fn(&Pose2) -> Pose2) -> Contrast {
        let (mut contrast, mut pose) = (Contrast::default(), Pose2::default());
        contrast.saw(&pose);
        for k in 0..400 {
            let turns = k % 40 >= 30;
            let step = if turns { Pose2::new(0.0, 0.0, 0.1) } else { Pose2::new(0.1, 0.0, 0.0) };
            pose = pose.compose(&seen(&step));
            contrast.drive(&odom(&step));
            contrast.saw(&pose);
        }
        contrast
    }

    #[test]
    fn what_contradicts_is_told_and_what_is_merely_off_is_not() {
        type Of = fn(&Pose2) -> Pose2;
        let cases: [(Of, Option<&str>); 7] = [
            (|p| *p, None),
            (|p| Pose2::new(0.8 * p.x_m, 0.0, 1.2 * p.yaw_rad), None),
            (|p| Pose2::new(-p.x_m, 0.0, p.yaw_rad), Some("180°")),
            (|p| Pose2::new(p.x_m, 0.0, -p.yaw_rad), Some("upside down")),
            (|p| Pose2::new(1000.0 * p.x_m, 0.0, p.yaw_rad), Some("m of each metre")),
            (|p| Pose2::new(p.x_m, 0.0, 0.2 * p.yaw_rad), Some("rad of each radian")),
            (|_| Pose2::default(), None),
        ];
        for (odom, says) in cases {
            let told = driven(odom, |p| *p).contradiction();
            assert_eq!(told.is_some(), says.is_some(), "{told:?}");
            assert!(told.as_ref().is_none_or(|t| t.contains(says.unwrap_or_default())), "{told:?}");
        }
        assert!(driven(|_| Pose2::default(), |p| *p).stands_still());
        assert!(!driven(|p| *p, |p| *p).stands_still());
    }

    #[test]
    fn a_laser_that_looks_aside_shows_by_where_it_sees_the_robot_go() {
        for (aside_rad, taken_rad) in
            [(0.1, None), (0.5, Some(0.5)), (-1.5, Some(-FRAC_PI_2)), (3.1, Some(PI))]
        {
            // What goes ahead goes to the right of a laser turned to the left.
            let seen = |p: &Pose2| {
                let turned = Pose2::new(0.0, 0.0, aside_rad);
                turned.inverse().compose(p).compose(&turned)
            };
            let mismounted = driven(|p| *p, seen).mismounted();
            assert_eq!(mismounted.is_some(), taken_rad.is_some(), "{aside_rad}");
            assert!(mismounted.is_none_or(|m| (m.turned_rad - taken_rad.unwrap_or_default()).abs() < 0.02));
        }
    }
}
