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
    look_up(&b.sample, &a.views, a_from_b, TOLERANCE_M, TOLERANCE_PER_M, &mut sum);
    look_up(&a.sample, &b.views, &a_from_b.inverse(), TOLERANCE_M, TOLERANCE_PER_M, &mut sum);
    sum
}

pub fn quick(a: &Content, b: &Content, a_from_b: &Pose2, points: usize, views: usize, tol: f64, per: f64) -> Agreement {
    let mut sum = Agreement::default();
    let few = |c: &Content| -> (Vec<Point>, Vec<View>) {
        (c.sample.iter().step_by(c.sample.len().div_ceil(points).max(1)).copied().collect(),
         c.views.iter().step_by(c.views.len().div_ceil(views).max(1)).cloned().collect())
    };
    let (ap, av) = few(a);
    let (bp, bv) = few(b);
    look_up(&bp, &av, a_from_b, tol, per, &mut sum);
    look_up(&ap, &bv, &a_from_b.inverse(), tol, per, &mut sum);
    sum
}

fn look_up(sample: &[Point], views: &[View], views_from_sample: &Pose2, tol: f64, per: f64, sum: &mut Agreement) {
    let (mut seen, mut through) = (vec![0u16; sample.len()], vec![0u16; sample.len()]);
    for view in views {
        let x = view.place_from_laser.inverse().compose(views_from_sample);
        let (s, c) = x.yaw_rad.sin_cos();
        for (k, p) in sample.iter().enumerate() {
            let (px, py, nx, ny) = (f64::from(p.x), f64::from(p.y), f64::from(p.nx), f64::from(p.ny));
            let (qx, qy) = (x.x_m + c * px - s * py, x.y_m + s * px + c * py);
            let range_m = (qx * qx + qy * qy).sqrt();
            // A surface can only be seen from its front.
            if (c * nx - s * ny) * qx + (s * nx + c * ny) * qy > -0.1 * range_m {
                continue;
            }
            let Some((near_m, far_m)) = view.image.at(qy.atan2(qx)) else { continue };
            let tolerance_m = tol + per * range_m;
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
