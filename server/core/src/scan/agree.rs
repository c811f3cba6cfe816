//! Do two places, laid over one another, see each other's walls, or through them?
//!
//! Registration only looks at what fits. This looks at what contradicts: a surface of one place
//! that the other's laser saw through, cannot be there. It is what tells look-alikes with
//! different surroundings apart.

use crate::geometry::Pose2;
use crate::scan::cloud::Point;
use crate::scan::place::Content;
use crate::scan::view::{Closeness, View, votes};

/// Agreeing points that a conflicting one outweighs; from the same pairs as the thresholds of
/// `scan/matching.rs`.
const CONFLICT_WEIGHT: f64 = 5.0;

/// How two contents compare under a transform.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Agreement {
    /// Points that the other place saw too.
    pub agree: u32,
    /// Points that the other place saw through.
    pub conflict: u32,
    /// All points looked up.
    pub points: u32,
}

impl Agreement {
    /// Points that the other place saw or saw through.
    pub fn compared(&self) -> u32 {
        self.agree + self.conflict
    }

    /// Share of the compared points that agree, in [0, 1]; 0 if nothing could be compared.
    pub fn score(&self) -> f64 {
        f64::from(self.agree) / f64::from(self.compared().max(1))
    }

    /// How much speaks for the two being one: what agrees less several times what conflicts, per
    /// point. By overlap alone, a corridor slid along itself would look better than a true fit
    /// that shows less of it.
    pub fn worth(&self) -> f64 {
        let sum = f64::from(self.agree) - CONFLICT_WEIGHT * f64::from(self.conflict);
        sum / f64::from(self.points.max(1))
    }

    /// Share of all points that the other place saw too.
    pub fn overlap(&self) -> f64 {
        f64::from(self.agree) / f64::from(self.points.max(1))
    }
}

/// Compares both ways.
pub fn agreement(a: &Content, b: &Content, a_from_b: &Pose2, look: &Closeness) -> Agreement {
    let mut sum = Agreement::default();
    look_up(&b.sample, &a.views, a_from_b, look, &mut sum);
    look_up(&a.sample, &b.views, &a_from_b.inverse(), look, &mut sum);
    sum
}

fn look_up(
    sample: &[Point],
    views: &[View],
    views_from_sample: &Pose2,
    look: &Closeness,
    sum: &mut Agreement,
) {
    let votes = votes(sample, views, views_from_sample, look);
    sum.points += votes.len() as u32;
    sum.agree += votes.iter().filter(|v| **v > 0).count() as u32;
    sum.conflict += votes.iter().filter(|v| **v < 0).count() as u32;
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scan::tests::{ROOM, content};

    /// How a wall that faces the origin at (x, 0) compares with what was seen of the room from its middle.
    fn wall_at(x: f32) -> Agreement {
        let room = content(&ROOM, &Pose2::default());
        let wall = Point { x, y: 0.0, nx: -1.0, ny: 0.0 };
        let mut sum = Agreement::default();
        look_up(&[wall], &room.views, &Pose2::default(), &Closeness::CLOSE, &mut sum);
        sum
    }

    #[test]
    fn a_wall_where_the_laser_saw_one_agrees_where_it_saw_through_it_does_not_and_behind_nobody_knows() {
        let compared = |x| (wall_at(x).agree, wall_at(x).conflict);
        assert_eq!(compared(5.1), (1, 0), "the room ends at 5 m");
        assert_eq!(compared(3.0), (0, 1), "free floor");
        assert_eq!(compared(7.0), (0, 0), "outside");
        assert_eq!(wall_at(7.0).points, 1);
    }
}
