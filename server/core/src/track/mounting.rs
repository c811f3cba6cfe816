//! Lasers as they are mounted, which may be otherwise than setup says: turned, or upside down.
//!
//! With `B` the laser in the body frame as it was taken for and `B'` as it is, a body at `X` was at
//!
//! ```text
//! X' = X B B'⁻¹,      upside down    X' = F σ(F⁻¹ X B) B'⁻¹,     σ(x, y, yaw) = (x, −y, −yaw)
//! ```
//!
//! for who took a laser upside down for upright mapped a mirrored world: it is mirrored back about the axis ahead of a
//! frame F. What is off by `e` then is off by `Ad(B') σ Ad(B⁻¹) e`.

use crate::event::Laser;
use crate::geometry::Pose2;
use nalgebra::{Matrix3, Vector3};
use serde::{Deserialize, Serialize};

/// Wheels that contradict a laser again and again are wrong themselves.
const MENDED_MAX: u32 = 4;

/// How a laser is mounted otherwise than it was taken to be.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Mismounted {
    /// To the left.
    pub turned_rad: f64,
    /// It is if it was taken for upright, and the other way round.
    pub upside_down: bool,
}

impl Mismounted {
    /// What shows it.
    pub fn why(&self) -> String {
        if self.upside_down {
            "scans turn the other way than wheels: is the laser mounted upside down?".to_owned()
        } else {
            let degrees = self.turned_rad.to_degrees();
            format!(
                "scans see it go elsewhere than wheels: is the laser mounted {degrees:.0}° aside of what setup says?"
            )
        }
    }

    /// A laser mounted so.
    fn mend(&self, laser: &Laser) -> Laser {
        Laser {
            body_from_laser: laser.body_from_laser.compose(&Pose2::new(0.0, 0.0, self.turned_rad)),
            upside_down: laser.upside_down ^ self.upside_down,
            ..laser.clone()
        }
    }
}

/// A laser as setup says that it is mounted, and as it is taken to be.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Mounted {
    said: Laser,
    taken: Laser,
    mended: u32,
}

impl Mounted {
    /// As setup says; if it says what it said `before`, as that was taken.
    pub fn new(said: Laser, before: Option<&Self>) -> Self {
        match before.filter(|b| b.said == said) {
            Some(before) => before.clone(),
            None => Self { taken: said.clone(), said, mended: 0 },
        }
    }

    /// As it is taken to be mounted.
    pub fn laser(&self) -> &Laser {
        &self.taken
    }

    /// Takes it for mounted otherwise: how bodies move by that; none if it was otherwise too often.
    pub fn mend(&mut self, mismounted: &Mismounted) -> Option<Remounted> {
        (self.mended < MENDED_MAX).then(|| {
            self.mended += 1;
            let now = mismounted.mend(&self.taken);
            let before = std::mem::replace(&mut self.taken, now);
            Remounted {
                body_from_laser: before.body_from_laser,
                laser_from_body: self.taken.body_from_laser.inverse(),
                mirrored: mismounted.upside_down,
            }
        })
    }
}

/// How a body moves whose laser turns out to be mounted otherwise.
pub struct Remounted {
    /// B.
    body_from_laser: Pose2,
    /// B'⁻¹.
    laser_from_body: Pose2,
    mirrored: bool,
}

impl Remounted {
    /// Whether the world was mapped in the mirror.
    pub fn is_mirrored(&self) -> bool {
        self.mirrored
    }

    /// X', mirrored about the axis ahead of `about`, F.
    pub fn body(&self, body: &Pose2, about: &Pose2) -> Pose2 {
        let laser = body.compose(&self.body_from_laser);
        let laser = if self.mirrored { mirrored(&laser, about) } else { laser };
        laser.compose(&self.laser_from_body)
    }

    /// Covariance of the body relative to what is not mounted on it, right perturbation.
    pub fn covariance(&self, covariance: &Matrix3<f64>) -> Matrix3<f64> {
        let before = self.body_from_laser.inverse().adjoint();
        let of_laser = before * covariance * before.transpose();
        let of_laser = if self.mirrored { mirrored_covariance(&of_laser) } else { of_laser };
        let after = self.laser_from_body.inverse().adjoint();
        after * of_laser * after.transpose()
    }
}

/// F σ(F⁻¹ X).
pub fn mirrored(pose: &Pose2, about: &Pose2) -> Pose2 {
    let seen = about.between(pose);
    about.compose(&Pose2::new(seen.x_m, -seen.y_m, -seen.yaw_rad))
}

/// What a covariance or an information is in the mirror.
pub fn mirrored_covariance(covariance: &Matrix3<f64>) -> Matrix3<f64> {
    let sides = Matrix3::from_diagonal(&Vector3::new(1.0, -1.0, -1.0));
    sides * covariance * sides
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::f64::consts::PI;

    fn laser(body_from_laser: Pose2) -> Laser {
        Laser {
            id: "front".into(),
            body_from_laser,
            upside_down: false,
            range_min_m: 0.02,
            range_max_m: 30.0,
            ignored_rad: vec![],
        }
    }

    fn pose() -> impl Strategy<Value = Pose2> {
        (-3.0..3.0, -3.0..3.0, -3.0..3.0).prop_map(|(x, y, yaw): (f64, f64, f64)| Pose2::new(x, y, yaw))
    }

    proptest! {
        /// A point that the laser sees is where it was, or opposite it in the mirror; and errors move along.
        #[test]
        fn what_is_seen_stays_where_it_is(
            mount in pose(), body in pose(), about in pose(), turned_rad in -PI..PI, upside_down: bool,
            (range_m, bearing_rad) in (0.5..9.0, -PI..PI), e in pose(),
        ) {
            let mut mounted = Mounted::new(laser(mount), None);
            let seen = |laser: &Laser| {
                let (s, c) = f64::sin_cos(bearing_rad);
                let side: f64 = if laser.upside_down { -1.0 } else { 1.0 };
                laser.body_from_laser.apply(range_m * c, side * range_m * s)
            };
            let before = seen(mounted.laser());
            let moved = mounted.mend(&Mismounted { turned_rad, upside_down }).unwrap();
            let after = seen(mounted.laser());
            let in_frame = |body: &Pose2, p: (f64, f64)| {
                let (x_m, y_m) = body.apply(p.0, p.1);
                about.inverse().apply(x_m, y_m)
            };
            let (was, is) = (in_frame(&body, before), in_frame(&moved.body(&body, &about), after));
            let side = if upside_down { -1.0 } else { 1.0 };
            prop_assert!((was.0 - is.0).abs() < 1e-9 && (was.1 - side * is.1).abs() < 1e-9);

            let small = Pose2::exp(&(e.log() * 1e-6));
            let off = moved.body(&body, &about).between(&moved.body(&body.compose(&small), &about)).log();
            let (made, said) = (off * off.transpose(), moved.covariance(&(small.log() * small.log().transpose())));
            prop_assert!((made - said).norm() < 1e-4 * made.norm() + 1e-18, "{made} {said}");
        }
    }

    #[test]
    fn what_was_mended_stays_until_setup_says_otherwise() {
        let said = laser(Pose2::new(0.2, 0.0, 0.0));
        let mut mounted = Mounted::new(said.clone(), None);
        let backwards = Mismounted { turned_rad: PI, upside_down: false };
        assert!(mounted.mend(&backwards).is_some());
        let again = Mounted::new(said.clone(), Some(&mounted));
        assert!((again.laser().body_from_laser.yaw_rad.abs() - PI).abs() < 1e-9);
        let other = laser(Pose2::new(0.3, 0.0, 0.0));
        assert_eq!(Mounted::new(other.clone(), Some(&mounted)).laser(), &other);
        assert_eq!((0..9).filter(|_| mounted.mend(&backwards).is_some()).count(), 3, "it gives up");
    }
}
