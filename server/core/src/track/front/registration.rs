//! A scan laid on the local map, and what that is worth.

use crate::geometry::Pose2;
use crate::scan::align::{Alignment, CORRELATED_BEAMS, Prior, SIGMA_M, align};
use crate::scan::cloud::{Point, thin};
use crate::scan::place::VOXEL_M;
use crate::scan::sweep::Sweep;
use crate::track::front::FrontEnd;
use crate::track::front::search::laid_on_surfaces;
use crate::track::wheels::Drift;
use nalgebra::{Matrix3, Vector3};

/// Largest distance between a point and its surface when registration begins.
pub(super) const GATE_M: f32 = 0.6;
/// Headings farther from where it begins are not found.
pub(super) const LEAP_RAD: f64 = 0.35;
/// What no robot among people exceeds: what seems to is a look-alike.
const SPEED_MAX_M_S: f64 = 3.0;
const TURN_MAX_RAD_S: f64 = 4.0;
/// Share of a scan's points on known surfaces below which the fit is looked at twice.
const SHARE_SURE: f64 = 0.6;
/// Below it the scan says nothing about the pose.
const SHARE_MIN: f64 = 0.25;
/// … and if nothing else does, below this.
const SHARE_LEAST: f64 = 0.15;
/// A fit of so much less than usual is suspected to be held where wheels want it.
pub(super) const LESS: f64 = 0.05;
/// Where nothing else says that it is near, a fit of so much less is none.
const FAR_LESS: f64 = 0.15;
/// How fast what is usual is learned, per scan.
const USUAL_GAIN: f64 = 0.05;
/// Wheels err with a bias (a scale, a bent axle), and fused at each scan a bias adds up: odometry
/// decides only where the scans say next to nothing.
const ODOMETRY_TRUST: f64 = 0.02;
/// There it counts for more: in a bare corridor the legs of a guide who walks ahead may be all that
/// the scans show along it, and they say that the robot stands still. More mends simulated corridors
/// and harms real tours with a range of 8 m.
const ODOMETRY_TRUST_ALONE: f64 = 0.2;
/// What the local map itself may be wrong by where surfaces are [`SIGMA_M`] rough.
const MAP_SIGMAS: Vector3<f64> = Vector3::new(0.005, 0.005, 0.002);
/// How fast the roughness of what is seen is learned, per scan.
const ROUGH_GAIN: f64 = 0.02;
/// Along a surface, errors within so much are one.
const LOOK_M: f64 = 0.4;
/// Scans from nearly the same spot err alike: one independent look takes so much path.
const LOOK_PATH_M: f64 = 2.0;
/// … and a turn of a radian as much as so much path.
const LOOK_PATH_PER_RAD_M: f64 = 2.0;

/// φ of a stretch over which scans alone say where the robot is after its odometry broke: what was next to it
/// may look like what it was carried to.
const RESUMED: f64 = 0.2;
/// φ where they say that it stayed where it was, to so much, metres and radians.
const STAYED: f64 = 0.04;
const STAYED_M: f64 = 0.1;
/// φ where a scan that shows something is laid on nothing, or hardly.
const UNREGISTERED: f64 = 0.03;
const HARDLY_REGISTERED: f64 = 0.003;
/// φ where wheels are not believed besides.
const NEITHER: f64 = 0.2;
/// φ where scans and wheels part by so much, distance².
const PARTED: [(f64, f64); 2] = [(36.0, 0.003), (100.0, 0.02)];

/// Where the body was at the scan before, so long ago, and where wheels say that it is now.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Stood {
    pub front_from_body: Pose2,
    pub dt_s: f64,
    pub by_wheels: Pose2,
    /// Covariance of that.
    pub spread: Matrix3<f64>,
    /// Covariance of where it was.
    pub known: Matrix3<f64>,
}

impl Stood {
    /// Whether a robot may have come there since.
    pub(super) fn reaches(&self, front_from_body: &Pose2) -> bool {
        let step = self.front_from_body.between(front_from_body);
        step.x_m.hypot(step.y_m) < f64::from(GATE_M) + SPEED_MAX_M_S * self.dt_s
            && step.yaw_rad.abs() < LEAP_RAD + TURN_MAX_RAD_S * self.dt_s
    }
}

impl FrontEnd {
    /// Registers the scan to the local map around the prediction, or where the body may be since it `stood` if wheels
    /// moved it that nothing fits there; what it says is fused.
    pub(crate) fn correct(&mut self, sweep: &Sweep, stood: &Stood) {
        let predicted = self.in_map.covariance(&self.wheels);
        let Some(information) = predicted.try_inverse() else { return };
        let prior = Prior {
            target_from_source: self.front_from_body,
            information: information * ODOMETRY_TRUST,
            where_weak: ODOMETRY_TRUST_ALONE / ODOMETRY_TRUST,
        };
        let points = thin(&sweep.points, VOXEL_M);
        let mut moved_m = self.wheels.unseen_m() + LOOK_PATH_PER_RAD_M * self.wheels.unseen_rad();
        let is_lost = self.trust.is_lost();
        let per_point = looks_per_point(sweep, &points);
        let (found, is_rivalled) = if is_lost {
            (self.search(&points, stood, per_point).filter(|f| f.inlier_share >= SHARE_LEAST), false)
        } else {
            self.near_wheels(&points, &prior, stood, per_point)
        };
        let Some(found) = found else {
            self.doubt(if is_lost { NEITHER } else { UNREGISTERED });
            return;
        };
        if found.inlier_share < SHARE_SURE {
            self.doubt(if is_lost { UNREGISTERED } else { HARDLY_REGISTERED });
        } else if is_lost {
            self.doubt(HARDLY_REGISTERED);
        }
        let parted = self.front_from_body.between(&found.target_from_source).log();
        self.doubt(failed_by(parted.dot(&(information * parted))));
        self.front_from_body = found.target_from_source;
        self.usual_share += USUAL_GAIN * (found.inlier_share - self.usual_share);
        self.rough_m += ROUGH_GAIN * (found.residual_m - self.rough_m);
        let rough = (self.rough_m / SIGMA_M).powi(2);
        let blur = self.wheels.blur(&sweep.moved);
        let look = blurred(found.information * (CORRELATED_BEAMS * per_point / rough), &blur);
        let map = Matrix3::from_diagonal(&MAP_SIGMAS.component_mul(&MAP_SIGMAS)) * rough;
        let moved = stood.front_from_body.between(&found.target_from_source);
        if is_lost {
            moved_m = moved_m.max(moved.x_m.hypot(moved.y_m) + LOOK_PATH_PER_RAD_M * moved.yaw_rad.abs());
        }
        let said = look + Matrix3::identity();
        // Who is held where wheels want it says nothing for them.
        if !is_rivalled && let Some(told) = said.try_inverse() {
            let parted = stood.by_wheels.between(&found.target_from_source).log();
            self.trust.saw(&moved, &parted, &(stood.spread + told + map));
        }
        let fuse = |p: &Matrix3<f64>, look: Matrix3<f64>| -> Option<Matrix3<f64>> {
            (p.try_inverse()? + look).try_inverse().map(|m| (m + m.transpose()) * 0.5)
        };
        let in_map = fuse(&predicted, look).map_or(predicted, |m| m + map);
        self.in_map = Drift::of(in_map);
        let news = (moved_m / LOOK_PATH_M).min(1.0);
        let since_place = self.since_place();
        self.since_place = Drift::of(fuse(&since_place, look * news).unwrap_or(since_place));
        self.contrast.saw(&self.front_from_body);
        if self.trust.is_lost() {
            self.wheels.lift();
        } else {
            self.wheels.told(&self.front_from_body, &in_map);
        }
    }

    /// Where the points fit near what wheels say; or where they may fit at all, if wheels leapt or are less believed than
    /// that by now. Whether there was a rival that is not believed, either.
    fn near_wheels(
        &mut self,
        points: &[Point],
        prior: &Prior,
        stood: &Stood,
        per_point: f64,
    ) -> (Option<Alignment>, bool) {
        let found = self.register(points, prior);
        let leapt = leaps(&stood.front_from_body.between(&self.front_from_body));
        if !leapt && found.is_some_and(|f| f.inlier_share >= self.usual_share - LESS) {
            return (found, false);
        }
        let rival = self.search(points, stood, per_point).filter(|r| r.inlier_share >= SHARE_SURE);
        let (Some(near), Some(far)) = (found, rival) else { return (rival.or(found), false) };
        if leapt {
            return (Some(if far.inlier_share >= near.inlier_share { far } else { near }), false);
        }
        let local = self.local();
        let laid = |at: Alignment| laid_on_surfaces(points, local, &at.target_from_source);
        let more = laid(far) - laid(near);
        self.trust.rivalled(per_point * more);
        if self.trust.is_lost() { (rival, false) } else { (found, true) }
    }

    fn register(&mut self, points: &[Point], prior: &Prior) -> Option<Alignment> {
        let guess = prior.target_from_source;
        let local = self.local();
        local.all_stands = false;
        let mut best = align(points, local, &guess, Some(prior), GATE_M);
        if best.is_none_or(|b| b.inlier_share < SHARE_SURE) {
            // A fast turn or a slip: start from other headings too.
            for turn_rad in [-0.1, 0.1, -0.2, 0.2, -0.35, 0.35] {
                let turned = guess.compose(&Pose2::new(0.0, 0.0, turn_rad));
                let other = align(points, local, &turned, Some(prior), GATE_M);
                if let Some(o) = other
                    && best.is_none_or(|b| o.inlier_share > b.inlier_share + 0.05)
                {
                    best = other;
                }
            }
        }
        best.filter(|b| b.inlier_share >= SHARE_MIN)
    }

    /// After a break too short for the robot to have been carried off, or after some seconds without wheels and scans:
    /// where in the local map is it now, whatever its odometry says?
    pub(crate) fn resume(&mut self, sweep: &Sweep, stood: &Stood) -> bool {
        let points = thin(&sweep.points, VOXEL_M);
        let found = self.search(&points, stood, looks_per_point(sweep, &points));
        let sure = SHARE_SURE.max(self.usual_share - FAR_LESS);
        let Some(found) = found.filter(|f| f.inlier_share >= sure) else { return false };
        self.front_from_body = found.target_from_source;
        self.stride_from = self.front_from_body;
        self.wheels.lift();
        self.contrast.lift();
        let moved = stood.front_from_body.between(&found.target_from_source);
        let stayed = moved.x_m.hypot(moved.y_m) < STAYED_M && moved.yaw_rad.abs() < STAYED_M;
        self.doubt(if stayed { STAYED } else { RESUMED });
        true
    }
}

/// Whether a step of the wheels is more than a registration from its end sees through.
fn leaps(step: &Pose2) -> bool {
    step.yaw_rad.abs() > LEAP_RAD || step.x_m.hypot(step.y_m) > f64::from(GATE_M)
}

/// φ by how far scans and wheels part, distance²: of what a few standard deviations explain, nothing.
fn failed_by(distance2: f64) -> f64 {
    PARTED.iter().rev().find(|(least, _)| distance2 >= *least).map_or(0.0, |(_, failed)| *failed)
}

/// Information of what is known with one and off by what has a covariance besides, (L⁻¹ + B)⁻¹, L singular in corridors.
fn blurred(look: Matrix3<f64>, blur: &Matrix3<f64>) -> Matrix3<f64> {
    let sharp = blur.try_inverse().and_then(|b| (look + b).try_inverse());
    sharp.map_or(look, |s| look - look * s * look)
}

/// Independent looks at surfaces that a point stands for, however dense the beams.
fn looks_per_point(sweep: &Sweep, points: &[Point]) -> f64 {
    surfaces_m(sweep) / LOOK_M / points.len() as f64
}

/// Length of the surfaces that a sweep shows, metres: a point stands for no more than [`LOOK_M`].
fn surfaces_m(sweep: &Sweep) -> f64 {
    let gap = |p: &[Point]| f64::from((p[0].x - p[1].x).powi(2) + (p[0].y - p[1].y).powi(2)).sqrt();
    sweep.points.windows(2).map(|p| gap(p).min(LOOK_M)).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_blurs_a_look_adds_to_its_covariance_and_says_nothing_where_it_says_nothing() {
        let blur = Matrix3::from_diagonal(&Vector3::new(4e-4, 4e-4, 1e-4));
        let look = Matrix3::new(9e3, 1e2, 0.0, 1e2, 4e4, 3e3, 0.0, 3e3, 2e5);
        let dense = (look.try_inverse().unwrap() + blur).try_inverse().unwrap();
        assert!((blurred(look, &blur) - dense).norm() < 1e-9 * dense.norm());
        let across = Matrix3::from_diagonal(&Vector3::new(0.0, 4e4, 2e5));
        let along = blurred(across, &blur)[(0, 0)];
        assert!(along.abs() < 1e-9, "{along}");
        assert_eq!(blurred(look, &Matrix3::zeros()), look, "who stands sees sharply");
    }
}
