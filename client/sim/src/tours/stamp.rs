//! The same plan in several places: look-alikes to the last bit of furniture.

use crate::geom::{Point, Rect, Segment};
use crate::world::Plan;
use std::f64::consts::FRAC_PI_2;
use toponym_proto::Pose;

/// A rigid motion by quarter turns, never mirrored: first the turns, then the shift.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Quarter {
    /// Quarter turns to the left.
    pub turns: u8,
    /// Shift.
    pub by_m: Point,
}

impl Quarter {
    pub fn shift(by_m: Point) -> Self {
        Self { turns: 0, by_m }
    }

    pub fn turn(turns: u8) -> Self {
        Self { turns, by_m: [0.0, 0.0] }
    }

    /// A point, exactly: no sines.
    pub fn point(&self, [x, y]: Point) -> Point {
        let [x, y] = match self.turns % 4 {
            0 => [x, y],
            1 => [-y, x],
            2 => [-x, -y],
            _ => [y, -x],
        };
        [x + self.by_m[0], y + self.by_m[1]]
    }

    fn rect(&self, rect: &Rect) -> Rect {
        Rect::new(self.point([rect.x0_m, rect.y0_m]), self.point([rect.x1_m, rect.y1_m]))
    }

    /// As a pose: the frame that the motion takes the origin to.
    pub fn pose(&self) -> Pose {
        let yaw_rad = crate::geom::wrap(f64::from(self.turns % 4) * FRAC_PI_2);
        Pose { x_m: self.by_m[0], y_m: self.by_m[1], yaw_rad }
    }

    /// `self ∘ other`.
    pub fn after(&self, other: &Self) -> Self {
        Self { turns: (self.turns + other.turns) % 4, by_m: self.point(other.by_m) }
    }

    /// The motion that undoes this one.
    pub fn inverse(&self) -> Self {
        let back = Self::turn((4 - self.turns % 4) % 4);
        let [x, y] = back.point(self.by_m);
        Self { turns: back.turns, by_m: [-x, -y] }
    }
}

impl Plan {
    /// Adds a copy of another plan; rooms get their names from `name_of` by their index in it.
    /// Answers the index of its first room here.
    pub(super) fn stamp(&mut self, plan: &Plan, at: &Quarter, name_of: impl Fn(usize) -> String) -> usize {
        let first = self.rooms.len();
        self.floor.extend(plan.floor.iter().map(|r| at.rect(r)));
        self.dark.extend(plan.dark.iter().map(|r| at.rect(r)));
        let moved = |s: &Segment| Segment { a: at.point(s.a), b: at.point(s.b) };
        self.furniture.extend(plan.furniture.iter().map(moved));
        self.waypoints.extend(plan.waypoints.iter().map(|&p| at.point(p)));
        let rooms = plan.rooms.iter().enumerate();
        self.rooms.extend(
            rooms.map(|(k, (_, area, kind, spot))| (name_of(k), at.rect(area), *kind, at.point(*spot))),
        );
        first
    }
}

/// A point moved by a pose, for tests and questions.
#[cfg(test)]
pub(super) fn agree(quarter: &Quarter, p: Point) -> f64 {
    crate::geom::distance_m(quarter.point(p), crate::geom::apply(&quarter.pose(), p))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geom::distance_m;

    #[test]
    fn quarters_are_poses_and_undo_each_other() {
        for turns in 0..4 {
            let q = Quarter { turns, by_m: [3.0, -2.0] };
            assert!(agree(&q, [1.5, 0.25]) < 1e-12);
            let there_and_back = q.inverse().after(&q);
            assert!(distance_m(there_and_back.point([1.5, 0.25]), [1.5, 0.25]) < 1e-12);
        }
    }
}
