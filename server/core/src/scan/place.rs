//! A place's matchable content: the scans of the last and next few metres, frozen when the robot
//! has left it.

use super::agree::{Look, votes};
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
        let mut votes = votes(&cloud, &views, &Pose2::default(), &Look::CLOSE).into_iter();
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
    use crate::event::{Laser, Scan};
    use crate::scan::sweep::sweep;
    use std::f64::consts::TAU;

    /// What is seen of a round room of 4 m in its middle; a leg stands at 1 m, `leg_deg` round, if at all.
    fn seen(leg_deg: Option<usize>) -> Sweep {
        let hidden = |k: usize| leg_deg.is_some_and(|leg| k.abs_diff(leg) < 8);
        let range = |k: usize| if hidden(k) { 1.0 } else { 4.0 };
        let scan = Scan {
            robot: "r".into(),
            laser: "l".into(),
            stamp_ns: 0,
            angle_min_rad: -TAU / 2.0,
            angle_increment_rad: TAU / 360.0,
            time_increment_s: 0.0,
            ranges_m: (0..360).map(range).collect(),
        };
        let laser = Laser {
            id: "l".into(),
            body_from_laser: Pose2::default(),
            upside_down: false,
            range_min_m: 0.05,
            range_max_m: 80.0,
            ignored_rad: vec![],
        };
        sweep(&scan, &laser, |_| Pose2::default())
    }

    #[test]
    fn legs_that_walked_through_are_no_part_of_a_place() {
        let nearest_m = |legs: &[Option<usize>]| {
            let sweeps: Vec<Sweep> = legs.iter().map(|leg| seen(*leg)).collect();
            let placed: Vec<(Pose2, &Sweep)> = sweeps.iter().map(|s| (Pose2::default(), s)).collect();
            Content::new(&placed).cloud.iter().map(|p| p.x.hypot(p.y)).fold(f32::MAX, f32::min)
        };
        let walking: Vec<Option<usize>> = (0..5).map(|k| Some(100 + 30 * k)).collect();
        assert!(nearest_m(&walking) > 3.9, "{}", nearest_m(&walking));
        assert!(nearest_m(&[Some(180); 5]) < 1.1, "what stands stays");
        assert!(nearest_m(&[None]) > 3.9);
    }
}
