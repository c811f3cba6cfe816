//! Over a blind stretch: the local map before it, and the one begun after it.
//!
//! When the laser sees again, the pose in the old local map is vague, and a scan laid on it there
//! would be taken for the truth. So a new local map begins, and for its first metres it is matched
//! with the old one as a whole, as places are. That is only done over a gap so short that nothing else can
//! fit within what odometry allows; beyond, a look-alike might, and it takes loops, which weigh their rivals,
//! to find out. What fits corrects the places of the dark like a smoother: with cumulative covariance `P_i` of the i-th, `P_n` of the
//! first in the light, and `F_i` from the one's perturbation to the other's,
//!
//! ```text
//! δ_i = P_i F_iᵀ (P_n + R)⁻¹ e,    e = log(predicted⁻¹ · found)
//! ```
//!
//! Edges of the chain add up as if each were off by itself. Wheels' systematic errors θ are the same in all of
//! them: over a stretch they put the end off by G θ, whose covariance is more than the sum of each
//! edge's own (or less, there and back). So each edge of n gets its noise and a share of that, carried back to
//! it: composed, the chain then has the covariance of its end as it is. Shares grow along the stretch as what
//! they stand for does, with the square of the path.

use crate::edge::PlaceId;
use crate::geometry::Pose2;
use crate::scan::cloud::{Index, Surfaces};
use crate::scan::matching::{Mode, index, refine};
use crate::scan::place::Content;
use crate::track::front::{FrontEnd, content};
use crate::track::places::{Chain, OpenPlace};
use crate::track::wheels::{Drift, Step};
use nalgebra::{Matrix3, Vector3};
use serde::{Deserialize, Serialize};

/// A prediction off by more, one standard deviation in any direction, is tied to nothing: rooms that are alike
/// stand 3 m apart, and what is allowed reaches 3.4 standard deviations to either side.
const TIE_M: f64 = 0.45;
const TIE_RAD: f64 = 0.2;
/// The new local map is matched with the old one while it is no longer than this.
const TRY_PATH_M: f64 = 8.0;
/// Fits below are no fits.
const BRIDGE_SCORE_MIN: f64 = 0.75;
/// Share of the points that both local maps must see.
const OVERLAP_MIN: f64 = 0.15;
/// 99 % of three degrees of freedom: what odometry does not allow is a look-alike.
const ALLOWED: f64 = 11.3;
/// A second fit of such a share of the best one's quality leaves it open which is true.
const RIVAL: f64 = 0.8;
/// Fits as near as this are one.
const SAME_M: f64 = 0.3;
const SAME_RAD: f64 = 0.1;
/// Guesses are spread over so many standard deviations, in so many steps to either side …
const SPREAD: f64 = 2.8;
const LATTICE: i32 = 6;
/// … those are followed up that lay most of so many points on a surface.
const GUESSES: usize = 12;
const LOOKED_UP: usize = 100;
const LAID_ON_M: f32 = 0.4;
/// More places are not held back.
const HELD_BACK_MAX: usize = 1000;

/// A blind stretch that is not dealt with yet: its places are held back.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Dark {
    /// The last place before it.
    pub(super) last: PlaceId,
    front_from_last: Pose2,
    /// What the pose relative to it is off by.
    pub(super) drift: Drift,
    /// Covariance by noise of each edge from there on, up to the first place in the light.
    edges: Vec<Matrix3<f64>>,
    /// Once the laser sees again.
    landed: Option<Landed>,
}

/// The first place after a blind stretch, and what was seen before it.
#[derive(Clone, Debug, Serialize, Deserialize)]
struct Landed {
    place: PlaceId,
    /// The local map before, in the frame in which this place was predicted.
    shore: Content,
}

impl FrontEnd {
    /// The laser has seen nothing for a while: places from here on are held back.
    pub(crate) fn go_dark(&mut self) {
        self.dark = self.open.back().filter(|_| !self.keys.is_empty()).map(|last| Dark {
            last: last.id,
            front_from_last: last.front_from_place,
            drift: self.since_place,
            edges: Vec::new(),
            landed: None,
        });
    }

    /// Whether the laser has seen nothing since a blind stretch began.
    pub(crate) fn is_dark(&self) -> bool {
        self.dark.as_ref().is_some_and(|d| d.landed.is_none())
    }

    /// Whether a place that begins is one of the dark, or the first in the light.
    pub(crate) fn ends_in_the_dark(&self, place: PlaceId) -> bool {
        self.dark.as_ref().is_some_and(|d| d.landed.as_ref().is_none_or(|l| l.place == place))
    }

    /// The robot drives on.
    pub(crate) fn drive_dark(&mut self, step: &Step) {
        if let Some(dark) = self.dark.as_mut().filter(|d| d.landed.is_none()) {
            dark.drift.drive(step);
        }
    }

    /// Another place began, at the end of an edge with such noise: deals out what the systematic errors
    /// make of the whole stretch.
    pub(crate) fn deal_out(&mut self, noise: Matrix3<f64>) {
        let Some(dark) = &mut self.dark else { return };
        dark.edges.push(noise);
        let systematic = dark.drift.systematic(&self.wheels);
        let (last, here, n) = (dark.last, self.front_from_body, dark.edges.len() as f64);
        for place in self.open.iter_mut().filter(|p| p.id > last) {
            let k = place.id - last;
            let Some(noise) = dark.edges.get(k as usize - 1) else { continue };
            let share = (2.0 * k as f64 - 1.0) / (n * n);
            let back = place.front_from_place.between(&here).adjoint();
            let covariance = noise + back * systematic * back.transpose() * share;
            if let Some(information) = covariance.try_inverse() {
                place.chain.information = (information + information.transpose()) * 0.5;
            }
        }
    }

    /// Whether a place must not be frozen yet.
    pub(crate) fn is_held_back(&self, place: PlaceId) -> bool {
        self.open.len() < HELD_BACK_MAX && self.dark.as_ref().is_some_and(|d| place > d.last)
    }

    /// The laser sees again: the local map is kept as the shore that was left. The next place begins
    /// here.
    pub(crate) fn land(&mut self) {
        if self.dark.is_none() {
            self.go_dark();
        }
        let here = self.front_from_body;
        let shore = content(self.keys.iter(), &here);
        let place = self.next_place;
        if let Some(dark) = &mut self.dark {
            dark.landed = Some(Landed { place, shore });
        }
    }

    /// Tries to tie the new local map to the old one.
    pub(crate) fn bridge(&mut self) {
        let Some(Dark { last, front_from_last, landed: Some(landed), .. }) = &self.dark else { return };
        let (last, n) = (*last, landed.place);
        let held: Vec<&OpenPlace> = self.open.iter().filter(|p| p.id > last && p.id <= n).collect();
        let Some(first) = held.last().filter(|p| p.id == n) else {
            self.dark = None;
            return;
        };
        let covariances = cumulative(&held);
        let Some(p_n) = covariances.last() else { return };
        if !is_short(p_n) {
            self.dark = None;
            return;
        }
        let found = tie(&landed.shore, &content(self.keys.iter(), &first.front_from_place), p_n);
        if let Some(mode) = found {
            let corrected = smooth(&held, &covariances, p_n, &mode);
            if let Some((poses, share)) = corrected {
                let from = *front_from_last;
                self.correct_dark(last, n, from, &poses, share);
            }
            self.dark = None;
        } else if self.path_m - first.path_m > TRY_PATH_M {
            self.dark = None;
        }
    }

    /// Moves the places of the dark to `poses`, the last of which is the first in the light, and all
    /// that came after along with that one.
    fn correct_dark(&mut self, last: PlaceId, n: PlaceId, from: Pose2, poses: &[Pose2], share: f64) {
        let Some(old) = self.open.iter().find(|p| p.id == n).map(|p| p.front_from_place) else { return };
        let Some(new) = poses.last() else { return };
        let shifted = |pose: &Pose2| new.compose(&old.between(pose));
        let mut before = from;
        let mut poses_left = poses.iter();
        for place in self.open.iter_mut().filter(|p| p.id > last) {
            place.front_from_place = match poses_left.next() {
                Some(pose) => {
                    let Chain { previous_from_this, information, .. } = &mut place.chain;
                    *previous_from_this = before.between(pose);
                    *information /= share;
                    *pose
                }
                None => shifted(&place.front_from_place),
            };
            before = place.front_from_place;
        }
        for key in &mut self.keys {
            key.front_from_body = shifted(&key.front_from_body);
        }
        self.front_from_body = shifted(&self.front_from_body);
        self.newest_place = shifted(&self.newest_place);
        self.local = None;
        self.wheels.lift();
    }
}

/// Covariances of places, right perturbation, given the place before the first.
fn cumulative(places: &[&OpenPlace]) -> Vec<Matrix3<f64>> {
    let mut p = Matrix3::zeros();
    places
        .iter()
        .map(|place| {
            let f = place.chain.previous_from_this.inverse().adjoint();
            p = f * p * f.transpose() + place.chain.information.try_inverse().unwrap_or_else(Matrix3::zeros);
            p
        })
        .collect()
}

/// Whether a prediction with such a covariance leaves room for one fit only.
fn is_short(covariance: &Matrix3<f64>) -> bool {
    let far = covariance.fixed_view::<2, 2>(0, 0).symmetric_eigenvalues().max();
    far < TIE_M.powi(2) && covariance[(2, 2)] < TIE_RAD.powi(2)
}

/// Where the new local map fits the old one, both in the predicted frame of the first place in the
/// light; `covariance` is that of the prediction.
fn tie(shore: &Content, here: &Content, covariance: &Matrix3<f64>) -> Option<Mode> {
    let allowed = |m: &Mode| {
        let e = m.i_from_j.log();
        (covariance + m.covariance).try_inverse().is_some_and(|s| e.dot(&(s * e)) < ALLOWED)
    };
    let good = |m: &Mode| m.score >= BRIDGE_SCORE_MIN && m.overlap >= OVERLAP_MIN;
    let target = index(shore);
    let mut fits: Vec<Mode> = guesses(shore, here, covariance)
        .iter()
        .filter_map(|guess| refine(shore, &target, here, guess))
        .filter(|m| allowed(m) && good(m))
        .collect();
    let quality = |m: &Mode| m.score * m.overlap;
    fits.sort_by(|a, b| quality(b).total_cmp(&quality(a)));
    let best = *fits.first()?;
    let other = |m: &&Mode| {
        let off = best.i_from_j.between(&m.i_from_j);
        off.x_m.hypot(off.y_m) > SAME_M || off.yaw_rad.abs() > SAME_RAD
    };
    let rival = fits.iter().find(other).map_or(0.0, quality);
    (rival < RIVAL * quality(&best)).then_some(best)
}

/// Where in the prediction's spread the new local map lies most on the old one's surfaces.
fn guesses(shore: &Content, here: &Content, covariance: &Matrix3<f64>) -> Vec<Pose2> {
    let Some(root) = covariance.cholesky().map(|c| c.l()) else { return Vec::new() };
    let index = Index::new(&shore.cloud, LAID_ON_M);
    let stride = here.sample.len().div_ceil(LOOKED_UP).max(1);
    let laid_on = |guess: &Pose2| {
        let points = here.sample.iter().step_by(stride);
        points.filter(|p| index.nearest(&p.moved(guess), LAID_ON_M).is_some()).count()
    };
    let axis = || (-LATTICE..=LATTICE).map(|k| f64::from(k) * (SPREAD / f64::from(LATTICE)));
    let mut tried: Vec<(usize, Pose2)> = axis()
        .flat_map(|a| axis().flat_map(move |b| axis().map(move |c| Vector3::new(a, b, c))))
        .filter(|u| u.norm() <= SPREAD)
        .map(|u| Pose2::exp(&(root * u)))
        .map(|guess| (laid_on(&guess), guess))
        .collect();
    tried.sort_by_key(|t| std::cmp::Reverse(t.0));
    tried.truncate(GUESSES);
    tried.into_iter().map(|t| t.1).collect()
}

/// Poses of the places of the dark and of the first in the light given the fit of the latter, and
/// the largest share of the prediction's variance that is left.
fn smooth(
    held: &[&OpenPlace],
    covariances: &[Matrix3<f64>],
    p_n: &Matrix3<f64>,
    found: &Mode,
) -> Option<(Vec<Pose2>, f64)> {
    let weighing = (p_n + found.covariance).try_inverse()?;
    let pull: Vector3<f64> = weighing * found.i_from_j.log();
    let last = held.last()?.front_from_place;
    let poses = held
        .iter()
        .zip(covariances)
        .map(|(place, p)| {
            let f = last.between(&place.front_from_place).adjoint();
            place.front_from_place.compose(&Pose2::exp(&(p * f.transpose() * pull)))
        })
        .collect();
    // 1 − λ_min(Lᵀ (P + R)⁻¹ L), P = L Lᵀ: all directions keep at least their share.
    let l = p_n.cholesky()?.l();
    let gained = (l.transpose() * weighing * l).symmetric_eigenvalues().min();
    Some((poses, (1.0 - gained).clamp(1e-4, 1.0)))
}
