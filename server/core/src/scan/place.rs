//! A place's matchable content: the scans of the last and next few metres, frozen when the robot
//! has left it.

use super::cloud::{Point, moved, thin};
use super::sweep::{RangeImage, Sweep};
use crate::geometry::Pose2;
use serde::{Deserialize, Serialize};

/// Thinning of a place's cloud.
pub const VOXEL_M: f32 = 0.05;
/// Range images kept of a place.
const VIEWS_MAX: usize = 10;

/// What a place looks like, in its own frame.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Content {
    /// Its surfaces.
    pub cloud: Vec<Point>,
    /// From where how far was seen.
    pub views: Vec<View>,
    /// A thinned sample of the cloud, to be looked up one by one.
    pub sample: Vec<Point>,
}

/// One of a place's range images.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct View {
    /// The laser in the place's frame.
    pub place_from_laser: Pose2,
    /// What it saw.
    pub image: RangeImage,
}

impl Content {
    /// From sweeps with their poses in the place's frame.
    pub fn new(sweeps: &[(Pose2, &Sweep)]) -> Self {
        let all: Vec<Point> = sweeps.iter().flat_map(|(pose, s)| moved(&s.points, pose)).collect();
        let cloud = thin(&all, VOXEL_M);
        let every = sweeps.len().div_ceil(VIEWS_MAX).max(1);
        let views = sweeps
            .iter()
            .step_by(every)
            .map(|(pose, s)| View {
                place_from_laser: pose.compose(&s.image.body_from_laser),
                image: s.image.clone(),
            })
            .collect();
        let sample = spread(&cloud, 300);
        Self { cloud, views, sample }
    }
}

/// At most `n` points, spread evenly over the surfaces.
pub fn spread(cloud: &[Point], n: usize) -> Vec<Point> {
    let flat: Vec<Point> = cloud.iter().copied().filter(Point::has_normal).collect();
    let mut voxel_m = 0.1;
    let mut out = flat;
    while out.len() > n && voxel_m < 5.0 {
        out = thin(&out, voxel_m);
        voxel_m *= 1.3;
    }
    out
}
