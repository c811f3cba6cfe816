//! A place's matchable content: the scans of the last and next few metres, frozen when the robot
//! has left it.

use crate::geometry::Pose2;
use crate::scan::cloud::{Point, moved, thin};
use crate::scan::sweep::Sweep;
use crate::scan::view::{Closeness, View, votes};
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

/// A place with fewer points to look up shows nothing that could be matched.
const BARE_MAX: usize = 20;

impl Content {
    /// Whether there is nothing to match, as where the laser sees nothing.
    pub fn is_bare(&self) -> bool {
        self.sample.len() < BARE_MAX
    }

    /// From sweeps with their poses in the place's frame.
    pub fn new(sweeps: &[(Pose2, &Sweep)]) -> Self {
        let all: Vec<Point> = sweeps.iter().flat_map(|(pose, s)| moved(&s.points, pose)).collect();
        let mut cloud = thin(&all, VOXEL_M);
        let every = sweeps.len().div_ceil(VIEWS_MAX).max(1);
        let views: Vec<View> = sweeps
            .iter()
            .step_by(every)
            .map(|(pose, s)| View {
                place_from_laser: pose.compose(&s.image.body_from_laser),
                image: s.image.clone(),
            })
            .collect();
        // What most of the place's own scans saw through was somebody's legs, or a door being opened.
        let mut votes = votes(&cloud, &views, &Pose2::default(), &Closeness::CLOSE).into_iter();
        cloud.retain(|_| votes.next() >= Some(0));
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scan::tests::{ROOM, seen};

    #[test]
    fn legs_that_walked_through_are_no_part_of_a_place() {
        // How near a surface there is when a leg, 20 cm wide, stands a metre off in such directions in turn.
        let nearest_m = |bearings_rad: &[f64]| {
            let leg = |bearing: f64| {
                let (s, c) = bearing.sin_cos();
                [c + 0.1 * s, s - 0.1 * c, c - 0.1 * s, s + 0.1 * c]
            };
            let walls = |bearing| [&ROOM[..], &[leg(bearing)]].concat();
            let sweeps: Vec<Sweep> =
                bearings_rad.iter().map(|b| seen(&walls(*b), &Pose2::default())).collect();
            let placed: Vec<(Pose2, &Sweep)> = sweeps.iter().map(|s| (Pose2::default(), s)).collect();
            Content::new(&placed).cloud.iter().map(|p| p.x.hypot(p.y)).fold(f32::MAX, f32::min)
        };
        assert!(nearest_m(&[-1.0, -0.4, 0.2, 0.8, 1.4]) > 2.9, "{}", nearest_m(&[-1.0, -0.4, 0.2, 0.8, 1.4]));
        assert!(nearest_m(&[0.2; 5]) < 1.1, "what stands stays");
        assert!(nearest_m(&[0.2]) < 1.1, "nobody knows");
    }
}
