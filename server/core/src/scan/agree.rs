//! Do two places, laid over one another, see each other's walls, or through them?
//!
//! Registration only looks at what fits. This looks at what contradicts: a surface of one place
//! that the other's laser saw through, cannot be there. It is what tells look-alikes with
//! different surroundings apart.

use crate::geometry::Pose2;
use crate::scan::cloud::Point;
use crate::scan::place::{Content, View};

/// Agreeing points that a conflicting one outweighs; from the same pairs as the thresholds of
/// `scan/matching.rs`.
const CONFLICT_WEIGHT: f64 = 5.0;

/// How closely two places are compared.
#[derive(Clone, Copy, Debug)]
pub struct Look {
    /// Points of either place looked up, at most.
    pub points_max: usize,
    /// Range images of either place that they are looked up in, at most.
    pub views_max: usize,
    /// Ranges this near are the same surface …
    pub tolerance_m: f64,
    /// … plus so much per metre of range.
    pub tolerance_per_m: f64,
}

impl Look {
    /// At everything.
    pub const CLOSE: Self =
        Self { points_max: usize::MAX, views_max: usize::MAX, tolerance_m: 0.25, tolerance_per_m: 0.02 };
    /// At a little.
    pub const BRIEF: Self = Self { points_max: 60, views_max: 4, ..Self::CLOSE };
    /// At a little, under a transform known to a decimetre or two and a degree or two only.
    pub const ROUGH: Self = Self { tolerance_m: 0.4, tolerance_per_m: 0.03, ..Self::BRIEF };
}

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
    /// Share of the compared points that agree, in [0, 1]; 0 if nothing could be compared.
    pub fn score(&self) -> f64 {
        f64::from(self.agree) / f64::from((self.agree + self.conflict).max(1))
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
pub fn agreement(a: &Content, b: &Content, a_from_b: &Pose2, look: &Look) -> Agreement {
    let mut sum = Agreement::default();
    look_up(&b.sample, &a.views, a_from_b, look, &mut sum);
    look_up(&a.sample, &b.views, &a_from_b.inverse(), look, &mut sum);
    sum
}

fn look_up(sample: &[Point], views: &[View], views_from_sample: &Pose2, look: &Look, sum: &mut Agreement) {
    let votes = votes(sample, views, views_from_sample, look);
    sum.points += votes.len() as u32;
    sum.agree += votes.iter().filter(|v| **v > 0).count() as u32;
    sum.conflict += votes.iter().filter(|v| **v < 0).count() as u32;
}

/// For each of some points the views that saw it, less those that saw through where it would be.
pub fn votes(sample: &[Point], views: &[View], views_from_sample: &Pose2, look: &Look) -> Vec<i32> {
    let every = |n: usize, most: usize| n.div_ceil(most).max(1);
    let points: Vec<&Point> = sample.iter().step_by(every(sample.len(), look.points_max)).collect();
    let mut votes = vec![0i32; points.len()];
    for view in views.iter().step_by(every(views.len(), look.views_max)) {
        let laser_from_sample = view.place_from_laser.inverse().compose(views_from_sample);
        let (s, c) = laser_from_sample.yaw_rad.sin_cos();
        for (vote, p) in votes.iter_mut().zip(&points) {
            let (nx, ny) = (f64::from(p.nx), f64::from(p.ny));
            let (x, y) = (f64::from(p.x), f64::from(p.y));
            let (x, y) = (laser_from_sample.x_m + c * x - s * y, laser_from_sample.y_m + s * x + c * y);
            let range_m = (x * x + y * y).sqrt();
            // A surface can only be seen from its front.
            if (c * nx - s * ny) * x + (s * nx + c * ny) * y > -0.1 * range_m {
                continue;
            }
            let Some((near_m, far_m)) = view.image.at(f64::from((y as f32).atan2(x as f32))) else {
                continue;
            };
            let tolerance_m = look.tolerance_m + look.tolerance_per_m * range_m;
            if range_m < near_m - tolerance_m {
                *vote -= 1;
            } else if range_m <= far_m + tolerance_m {
                *vote += 1;
            }
        }
    }
    votes
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scan::rooms::{ROOM, content};

    /// How a wall that faces the origin at (x, 0) compares with what was seen of the room from its middle.
    fn wall_at(x: f32) -> Agreement {
        let room = content(&ROOM, &Pose2::default());
        let wall = Point { x, y: 0.0, nx: -1.0, ny: 0.0 };
        let mut sum = Agreement::default();
        look_up(&[wall], &room.views, &Pose2::default(), &Look::CLOSE, &mut sum);
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
