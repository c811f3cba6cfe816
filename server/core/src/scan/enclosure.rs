//! What is of one room with a place: the floor that its scans show short of walls, and of narrowings no wider than a
//! door.

use crate::geometry::{Pose2, is_near};
use crate::scan::place::Content;
use serde::{Deserialize, Serialize};
use std::f64::consts::TAU;

/// Directions.
const RAYS: usize = 96;
/// Farther off, nobody asks.
const FAR_M: f64 = 12.0;
/// A step of what is kept.
const STEP_M: f64 = 0.05;
/// Where nothing is seen.
const UNSEEN: u8 = u8::MAX;
/// Openings up to so wide are doors, and no wider than such a share of where one stands: a narrow hallway is none.
const DOOR_MAX_M: f64 = 1.6;
const NARROWING: f64 = 0.8;
/// Who stands so near the line between two posts stands in the door.
const SILL_M: f64 = 0.4;
/// A robot's half width, and somebody's before it.
const DRIVEN_M: f64 = 0.35;
/// How sharp its edge is: what places and doors are off by.
const EDGE_M: f64 = 0.3;
/// As many times as long as wide, every second is a way's, and how steeply: read off the table of
/// `--example drives -- enclosed` of the server.
const WAY: (f64, f64) = (2.6, 1.0);

/// The floor around a place as far as its room reaches.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Enclosure {
    /// By direction from 0 on, counter-clockwise, in steps.
    reach: Vec<u8>,
    elongation: f32,
}

/// Of what is seen in a direction the nearest: how far off, and where.
type Posts = [Option<(f64, (f64, f64))>; RAYS];

impl Enclosure {
    /// Of what a place looks like.
    pub fn of(content: &Content) -> Self {
        let posts = posts(content);
        let narrow_m = (NARROWING * width_m(&posts)).min(DOOR_MAX_M);
        let mut reach_m = posts.map(|post| post.map_or(FAR_M, |(m, _)| m));
        for (first, a) in posts.iter().enumerate().filter_map(|(k, post)| Some((k, post.as_ref()?.1))) {
            for width in 2..RAYS / 2 {
                if let Some((_, b)) = posts[(first + width) % RAYS] {
                    close(&mut reach_m, (first, width), (a, b), narrow_m);
                }
            }
        }
        let steps = |m: f64| if m < FAR_M { (m / STEP_M).round() as u8 } else { UNSEEN };
        Self { reach: reach_m.map(steps).to_vec(), elongation: elongation(&reach_m) as f32 }
    }

    /// How surely a point in the place's frame, metres, is of its room by what is seen from there; none: nothing is
    /// seen that way.
    pub fn holds(&self, x_m: f64, y_m: f64) -> Option<f64> {
        let reach = *self.reach.get(ray(x_m, y_m))?;
        let reach_m = f64::from(reach) * STEP_M;
        (reach != UNSEEN).then(|| 1.0 / (1.0 + ((x_m.hypot(y_m) - reach_m) / EDGE_M).exp()))
    }

    /// Length over width of what is enclosed, by its second moments; 1 where nothing is seen.
    pub fn elongation(&self) -> f64 {
        self.elongation.into()
    }

    /// How likely it is a way's by its shape, where as much floor is of ways as of rooms.
    pub fn way(&self) -> f64 {
        1.0 / (1.0 + ((WAY.0 - self.elongation()) * WAY.1).exp())
    }
}

/// Whether two places are of one room by what is seen from either; none: nothing is.
pub fn of_one_room(a: Option<&Enclosure>, b: Option<&Enclosure>, a_from_b: &Pose2) -> Option<f64> {
    let b_from_a = a_from_b.inverse();
    let of_a = a.and_then(|a| a.holds(a_from_b.x_m, a_from_b.y_m));
    let of_b = b.and_then(|b| b.holds(b_from_a.x_m, b_from_a.y_m));
    match (of_a, of_b) {
        (Some(a), Some(b)) => Some(a.midpoint(b)),
        (one, other) => one.or(other),
    }
}

fn posts(Content { cloud, views, .. }: &Content) -> Posts {
    let driven: Vec<(f64, f64)> =
        views.iter().map(|v| (v.place_from_laser.x_m, v.place_from_laser.y_m)).collect();
    let mut posts = [None; RAYS];
    for p in cloud {
        let (x, y) = (f64::from(p.x), f64::from(p.y));
        // Nothing stands where the robot drove: who leads it walks there.
        if driven.windows(2).any(|leg| is_near(leg, (x, y), DRIVEN_M)) {
            continue;
        }
        let (m, nearest) = (x.hypot(y), &mut posts[ray(x, y)]);
        if m < FAR_M && nearest.is_none_or(|(before, _)| m < before) {
            *nearest = Some((m, (x, y)));
        }
    }
    posts
}

/// How wide it is where one stands: the shortest way across.
fn width_m(posts: &Posts) -> f64 {
    let across = |k: usize| Some(posts[k]?.0 + posts[k + RAYS / 2]?.0);
    (0..RAYS / 2).filter_map(across).fold(f64::INFINITY, f64::min)
}

/// Cuts what lies behind the line between two posts, if they are those of a door.
fn close(
    reach_m: &mut [f64; RAYS],
    (first, width): (usize, usize),
    (a, b): ((f64, f64), (f64, f64)),
    narrow_m: f64,
) {
    let (dx, dy) = (b.0 - a.0, b.1 - a.1);
    let across_m = dx.hypot(dy);
    if across_m > narrow_m || (a.0 * dy - a.1 * dx) / across_m < SILL_M {
        return;
    }
    for k in first + 1..first + width {
        let (s, c) = bearing_rad(k % RAYS).sin_cos();
        // Where the ray meets the line.
        let at_m = (a.0 * dy - a.1 * dx) / (c * dy - s * dx);
        if at_m > 0.0 {
            reach_m[k % RAYS] = reach_m[k % RAYS].min(at_m);
        }
    }
}

fn elongation(reach_m: &[f64; RAYS]) -> f64 {
    let mut sums = [0.0; 6];
    for (k, r) in reach_m.iter().enumerate().filter(|(_, m)| **m < FAR_M) {
        let (s, c) = bearing_rad(k).sin_cos();
        // Moments of a sector, per radian.
        let [area, first, second] = [r * r / 2.0, r.powi(3) / 3.0, r.powi(4) / 4.0];
        let terms = [area, first * c, first * s, second * c * c, second * s * s, second * c * s];
        for (sum, term) in sums.iter_mut().zip(terms) {
            *sum += term;
        }
    }
    let [area, x, y, xx, yy, xy] = sums;
    let (x, y) = (x / area, y / area);
    let (xx, yy, xy) = (xx / area - x * x, yy / area - y * y, xy / area - x * y);
    let (mean, off) = (xx.midpoint(yy), ((xx - yy) / 2.0).hypot(xy));
    let ratio = ((mean + off) / (mean - off)).sqrt();
    if ratio.is_finite() { ratio } else { 1.0 }
}

fn bearing_rad(ray: usize) -> f64 {
    (ray as f64 + 0.5) * TAU / RAYS as f64
}

fn ray(x_m: f64, y_m: f64) -> usize {
    let turns = y_m.atan2(x_m) / TAU;
    (((turns + if turns < 0.0 { 1.0 } else { 0.0 }) * RAYS as f64) as usize).min(RAYS - 1)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scan::sweep::Sweep;
    use crate::scan::tests::seen;

    /// A hallway of 2 m along x, with a room of 5 by 4 m to its left behind a door of 1 m.
    const FLAT: [[f64; 4]; 10] = [
        [-6.0, -1.0, 8.0, -1.0],
        [-6.0, -1.0, -6.0, 1.0],
        [8.0, -1.0, 8.0, 1.0],
        [-6.0, 1.0, -0.5, 1.0],
        [0.5, 1.0, 8.0, 1.0],
        [-2.5, 1.0, -2.5, 5.0],
        [2.5, 1.0, 2.5, 5.0],
        [-2.5, 5.0, 2.5, 5.0],
        [-2.5, 1.1, -0.5, 1.1],
        [0.5, 1.1, 2.5, 1.1],
    ];

    fn enclosure(x_m: f64, y_m: f64) -> (Pose2, Enclosure) {
        let at = Pose2::new(x_m, y_m, 0.3);
        let sweep: Sweep = seen(&FLAT, &at);
        (at, Enclosure::of(&Content::new(&[(Pose2::default(), &sweep)])))
    }

    fn one(a: (f64, f64), b: (f64, f64)) -> f64 {
        let [(at_a, a), (at_b, b)] = [a, b].map(|p| enclosure(p.0, p.1));
        of_one_room(Some(&a), Some(&b), &at_a.between(&at_b)).unwrap()
    }

    #[test]
    fn a_door_parts_what_is_seen_through_it() {
        assert!(one((-3.0, 0.0), (4.0, 0.2)) > 0.9, "along the hallway");
        assert!(one((-1.5, 3.0), (1.5, 4.0)) > 0.9, "within the room");
        assert!(one((0.0, -0.2), (0.0, 2.4)) < 0.1, "through the door");
        assert!(one((-2.0, 0.0), (-1.5, 2.0)) < 0.1, "through the wall");
    }

    #[test]
    fn a_hallway_is_longer_than_wide() {
        let [hallway, room] = [(0.9, 0.0), (0.3, 3.2)].map(|p| enclosure(p.0, p.1).1);
        assert!(hallway.way() > 0.8, "{}", hallway.elongation());
        assert!(room.way() < 0.3, "{}", room.elongation());
    }

    #[test]
    fn who_walks_ahead_of_a_robot_encloses_nothing() {
        let follow = |guide_m: f64| {
            let sweeps: Vec<(Pose2, Sweep)> = (0..4)
                .map(|k| {
                    let at = Pose2::new(f64::from(k) * 0.8, 0.0, 0.0);
                    let x_m = at.x_m + guide_m;
                    let legs = [x_m, -0.2, x_m, 0.2];
                    (at, seen(&[&FLAT[..], &[legs]].concat(), &at))
                })
                .collect();
            let placed: Vec<(Pose2, &Sweep)> = sweeps.iter().map(|(at, s)| (*at, s)).collect();
            Enclosure::of(&Content::new(&placed)).holds(2.2, 0.0)
        };
        assert!(follow(0.8) > Some(0.5));
    }

    #[test]
    fn where_nothing_is_seen_nobody_knows() {
        let nothing = Enclosure::of(&Content { cloud: vec![], views: vec![], sample: vec![] });
        assert_eq!(nothing.holds(1.0, 0.0), None);
        assert_eq!(of_one_room(Some(&nothing), None, &Pose2::new(1.0, 0.0, 0.0)), None);
    }
}
