//! Local maps begun anew: when what is seen has no more to do with what was.

use crate::geometry::Pose2;
use crate::track::front::trust::Trust;
use crate::track::front::{FrontEnd, LOCAL_PATH_M};
use crate::track::mounting::{Remounted, mirrored, mirrored_covariance};
use crate::track::places::FrozenPlace;
use crate::track::wheels::Drift;
use nalgebra::{Matrix3, Vector3};

/// Slower wheels, metres or radians a second, do not drive it anywhere.
const STILL_M_S: f64 = 0.05;
/// People who carry it walk so many times as far as robots drive.
const WALK: f64 = 2.0;
/// Standard deviation of any heading.
const AROUND_RAD: f64 = 1.8;

impl FrontEnd {
    /// Leaves the local map behind: so far along the path that none of its places is taken for part
    /// of the new one.
    pub(super) fn clear_local(&mut self) {
        self.keys.clear();
        self.local = None;
        self.path_m += 2.0 * LOCAL_PATH_M;
        self.in_map = Drift::default();
        self.wheels.lift();
        self.contrast.lift();
        self.stride_from = self.front_from_body;
    }

    /// The link to what was is lost: a new local map, and a chain edge that says next to nothing.
    /// Whether the robot is still where it was is for the particles to find out: a scan that fits
    /// the old local map may be a look-alike that it was carried to.
    pub(super) fn start_over(&mut self) -> Vec<FrozenPlace> {
        let frozen = self.freeze(f64::INFINITY);
        self.fresh = true;
        self.clear_local();
        self.since_place = Drift::of(Matrix3::from_diagonal(&Vector3::new(2500.0, 2500.0, 9.0)));
        frozen
    }

    /// The laser turns out to be mounted otherwise: the body is where that has it. What was mapped in the mirror is
    /// mirrored back, as far as its places are still open, and the local map begun anew. The body as it is from as it
    /// was, in the front end's frame.
    pub(in crate::track) fn remount(&mut self, moved: &Remounted) -> Pose2 {
        let about = self.open.front().map_or(self.newest_place, |first| {
            first.front_from_place.compose(&first.chain.previous_from_this.inverse())
        });
        let in_map = moved.covariance(&self.in_map.covariance(&self.wheels));
        self.since_place = Drift::of(moved.covariance(&self.since_place()));
        let before = self.front_from_body;
        self.front_from_body = moved.body(&before, &about);
        self.stride_from = self.front_from_body;
        if moved.is_mirrored() {
            for place in &mut self.open {
                place.front_from_place = mirrored(&place.front_from_place, &about);
                place.chain.previous_from_this = mirrored(&place.chain.previous_from_this, &Pose2::default());
                place.chain.information = mirrored_covariance(&place.chain.information);
            }
            self.newest_place = mirrored(&self.newest_place, &about);
            self.keys.clear();
            self.local = None;
            self.in_map = Drift::default();
        } else {
            self.in_map = Drift::of(in_map);
        }
        (self.wheels, self.trust, self.contrast) = Default::default();
        self.front_from_body.compose(&before.inverse())
    }

    /// A new local map, for what is seen is not what was: somewhere near, as far as people walk.
    pub(super) fn start_near(&mut self, dt_s: f64) -> Vec<FrozenPlace> {
        let frozen = self.freeze(f64::INFINITY);
        let before = self.since_place();
        self.clear_local();
        let (d_m, turn_rad) = Trust::anything(dt_s);
        let near = Vector3::new(WALK * d_m, WALK * d_m, (WALK * turn_rad).min(AROUND_RAD));
        self.since_place = Drift::of(before + Matrix3::from_diagonal(&near.component_mul(&near)));
        frozen
    }
}

/// Whether wheels that turn would have moved it farther meanwhile.
pub(super) fn is_still(increment: &Pose2, dt_s: f64) -> bool {
    increment.x_m.hypot(increment.y_m) < STILL_M_S * dt_s && increment.yaw_rad.abs() < STILL_M_S * dt_s
}
