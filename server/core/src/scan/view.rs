//! What one of a place's own scans saw: does it see a surface, or through it?

use crate::geometry::Pose2;
use crate::scan::cloud::Point;
use crate::scan::sweep::RangeImage;
use serde::{Deserialize, Serialize};

/// One of a place's range images.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct View {
    /// The laser in the place's frame.
    pub place_from_laser: Pose2,
    /// What it saw.
    pub image: RangeImage,
}

/// How closely two places are compared.
#[derive(Clone, Copy, Debug)]
pub struct Closeness {
    /// Points of either place looked up, at most.
    pub points_max: usize,
    /// Range images of either place that they are looked up in, at most.
    pub views_max: usize,
    /// Ranges this near are the same surface …
    pub tolerance_m: f64,
    /// … plus so much per metre of range.
    pub tolerance_per_m: f64,
}

impl Closeness {
    /// At everything.
    pub const CLOSE: Self =
        Self { points_max: usize::MAX, views_max: usize::MAX, tolerance_m: 0.25, tolerance_per_m: 0.02 };
    /// At a little.
    pub const BRIEF: Self = Self { points_max: 60, views_max: 4, ..Self::CLOSE };
    /// At a little, under a transform known to a decimetre or two and a degree or two only.
    pub const ROUGH: Self = Self { tolerance_m: 0.4, tolerance_per_m: 0.03, ..Self::BRIEF };
}

/// For each of some points the views that saw it, less those that saw through where it would be.
pub fn votes(sample: &[Point], views: &[View], views_from_sample: &Pose2, look: &Closeness) -> Vec<i32> {
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
