//! Do two places, laid over one another, see each other's walls, or through them?
//!
//! Registration only looks at what fits. This looks at what contradicts: a surface of one place
//! that the other's laser saw through, cannot be there. It is what tells look-alikes with
//! different surroundings apart.

use super::cloud::Point;
use super::place::{Content, View};
use crate::geometry::Pose2;

/// Ranges this near are the same surface.
const TOLERANCE_M: f64 = 0.25;
/// Plus so much per metre of range.
const TOLERANCE_PER_M: f64 = 0.02;

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

    /// Share of all points that the other place saw too.
    pub fn overlap(&self) -> f64 {
        f64::from(self.agree) / f64::from(self.points.max(1))
    }
}

/// Compares both ways.
pub fn agreement(a: &Content, b: &Content, a_from_b: &Pose2) -> Agreement {
    let mut sum = Agreement::default();
    look_up(&b.sample, &a.views, a_from_b, &mut sum);
    look_up(&a.sample, &b.views, &a_from_b.inverse(), &mut sum);
    sum
}

fn look_up(sample: &[Point], views: &[View], views_from_sample: &Pose2, sum: &mut Agreement) {
    let moved: Vec<Point> = sample.iter().map(|p| p.moved(views_from_sample)).collect();
    let (mut seen, mut through) = (vec![0u16; moved.len()], vec![0u16; moved.len()]);
    for view in views {
        let laser_from_place = view.place_from_laser.inverse();
        for (k, p) in moved.iter().enumerate() {
            let q = p.moved(&laser_from_place);
            let (x, y) = (f64::from(q.x), f64::from(q.y));
            let range_m = x.hypot(y);
            // A surface can only be seen from its front.
            if f64::from(q.nx) * x + f64::from(q.ny) * y > -0.1 * range_m {
                continue;
            }
            let Some((near_m, far_m)) = view.image.at(y.atan2(x)) else { continue };
            let tolerance_m = TOLERANCE_M + TOLERANCE_PER_M * range_m;
            if range_m < near_m - tolerance_m {
                through[k] += 1;
            } else if range_m <= far_m + tolerance_m {
                seen[k] += 1;
            }
        }
    }
    for (s, t) in seen.iter().zip(&through) {
        sum.points += 1;
        if s > t {
            sum.agree += 1;
        } else if t > s {
            sum.conflict += 1;
        }
    }
}
