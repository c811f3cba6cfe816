//! The little plane geometry that a simulator needs. Metres, radians, REP-103.

use std::f64::consts::{PI, TAU};
use toponym_proto::Pose;

/// A point of the floor, metres.
pub type Point = [f64; 2];

/// Wraps an angle to (−π, π].
pub fn wrap(angle_rad: f64) -> f64 {
    let a = angle_rad.rem_euclid(TAU);
    if a > PI { a - TAU } else { a }
}

/// The point `p` of the body's frame in the outer frame.
pub fn apply(pose: &Pose, p: Point) -> Point {
    let (s, c) = pose.yaw_rad.sin_cos();
    [pose.x_m + c * p[0] - s * p[1], pose.y_m + s * p[0] + c * p[1]]
}

/// `a ∘ b`.
pub fn compose(a: &Pose, b: &Pose) -> Pose {
    let [x_m, y_m] = apply(a, [b.x_m, b.y_m]);
    Pose { x_m, y_m, yaw_rad: wrap(a.yaw_rad + b.yaw_rad) }
}

/// `a⁻¹ ∘ b`: b in the frame of a.
pub fn between(a: &Pose, b: &Pose) -> Pose {
    let (s, c) = a.yaw_rad.sin_cos();
    let (dx, dy) = (b.x_m - a.x_m, b.y_m - a.y_m);
    Pose { x_m: c * dx + s * dy, y_m: -s * dx + c * dy, yaw_rad: wrap(b.yaw_rad - a.yaw_rad) }
}

/// `a⁻¹`.
pub fn inverse(a: &Pose) -> Pose {
    between(a, &Pose::default())
}

/// The pose a share `f` of the way from `a` to `b`.
pub fn blend(a: &Pose, b: &Pose, f: f64) -> Pose {
    Pose {
        x_m: a.x_m + f * (b.x_m - a.x_m),
        y_m: a.y_m + f * (b.y_m - a.y_m),
        yaw_rad: wrap(a.yaw_rad + f * wrap(b.yaw_rad - a.yaw_rad)),
    }
}

/// Distance of two points.
pub fn distance_m(a: Point, b: Point) -> f64 {
    (a[0] - b[0]).hypot(a[1] - b[1])
}

/// A straight piece of wall.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Segment {
    /// One end.
    pub a: Point,
    /// The other end.
    pub b: Point,
}

impl Segment {
    /// Distance of a point to the segment.
    pub fn distance_m(&self, p: Point) -> f64 {
        let d = [self.b[0] - self.a[0], self.b[1] - self.a[1]];
        let length2 = d[0] * d[0] + d[1] * d[1];
        let along = if length2 > 0.0 {
            (((p[0] - self.a[0]) * d[0] + (p[1] - self.a[1]) * d[1]) / length2).clamp(0.0, 1.0)
        } else {
            0.0
        };
        distance_m(p, [self.a[0] + along * d[0], self.a[1] + along * d[1]])
    }

    /// Angle between a direction and the segment's normal, 0 to π/2.
    pub fn incidence_rad(&self, direction_rad: f64) -> f64 {
        let along_rad = (self.b[1] - self.a[1]).atan2(self.b[0] - self.a[0]);
        (direction_rad - along_rad).sin().abs().min(1.0).acos()
    }

    /// Smallest distance between two segments; 0 where they cross.
    pub fn gap_m(&self, other: &Self) -> f64 {
        let direction = [other.b[0] - other.a[0], other.b[1] - other.a[1]];
        if self.hit(other.a, direction).is_some_and(|t| t <= 1.0) {
            return 0.0;
        }
        let ends = [self.distance_m(other.a), self.distance_m(other.b)];
        let mine = [other.distance_m(self.a), other.distance_m(self.b)];
        ends.into_iter().chain(mine).fold(f64::INFINITY, f64::min)
    }

    /// Where the ray `origin + t·direction`, t ≥ 0, meets the segment; none if it misses or runs
    /// parallel.
    pub fn hit(&self, origin: Point, direction: Point) -> Option<f64> {
        let e = [self.b[0] - self.a[0], self.b[1] - self.a[1]];
        let det = direction[0] * e[1] - direction[1] * e[0];
        if det.abs() < 1e-12 {
            return None;
        }
        let w = [self.a[0] - origin[0], self.a[1] - origin[1]];
        let t = (w[0] * e[1] - w[1] * e[0]) / det;
        let u = (w[0] * direction[1] - w[1] * direction[0]) / det;
        (t >= 0.0 && (0.0..=1.0).contains(&u)).then_some(t)
    }
}

/// An upright rectangle: x0 < x1, y0 < y1, metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rect {
    /// Left.
    pub x0_m: f64,
    /// Lower.
    pub y0_m: f64,
    /// Right.
    pub x1_m: f64,
    /// Upper.
    pub y1_m: f64,
}

impl Rect {
    /// From two opposite corners in any order.
    pub fn new(a: Point, b: Point) -> Self {
        Self { x0_m: a[0].min(b[0]), y0_m: a[1].min(b[1]), x1_m: a[0].max(b[0]), y1_m: a[1].max(b[1]) }
    }

    /// Its middle.
    pub fn centre(&self) -> Point {
        [f64::midpoint(self.x0_m, self.x1_m), f64::midpoint(self.y0_m, self.y1_m)]
    }

    /// Whether a point lies at least `margin_m` inside.
    pub fn contains(&self, p: Point, margin_m: f64) -> bool {
        p[0] >= self.x0_m + margin_m
            && p[0] <= self.x1_m - margin_m
            && p[1] >= self.y0_m + margin_m
            && p[1] <= self.y1_m - margin_m
    }

    /// Where the ray `origin + t·direction`, t ≥ 0, enters it; 0 from within, none if it misses.
    pub fn entry_m(&self, origin: Point, direction: Point) -> Option<f64> {
        let (mut enters, mut leaves) = (0.0_f64, f64::INFINITY);
        for (k, (low, high)) in [(self.x0_m, self.x1_m), (self.y0_m, self.y1_m)].into_iter().enumerate() {
            if direction[k].abs() < 1e-12 {
                if origin[k] < low || origin[k] > high {
                    return None;
                }
                continue;
            }
            let (a, b) = ((low - origin[k]) / direction[k], (high - origin[k]) / direction[k]);
            enters = enters.max(a.min(b));
            leaves = leaves.min(a.max(b));
        }
        (enters <= leaves).then_some(enters)
    }

    /// Corners, counter-clockwise from the lower left.
    pub fn corners(&self) -> [Point; 4] {
        [[self.x0_m, self.y0_m], [self.x1_m, self.y0_m], [self.x1_m, self.y1_m], [self.x0_m, self.y1_m]]
    }
}

/// A part of the floor: its corners in order round it, at least three, metres.
#[derive(Clone, Debug, PartialEq)]
pub struct Area {
    /// Corners; the last joins the first.
    pub corners: Vec<Point>,
}

impl From<Rect> for Area {
    fn from(rect: Rect) -> Self {
        Self { corners: rect.corners().into() }
    }
}

impl Area {
    /// Its edges.
    pub fn edges(&self) -> impl Iterator<Item = Segment> + '_ {
        let next = self.corners.iter().cycle().skip(1);
        self.corners.iter().zip(next).map(|(&a, &b)| Segment { a, b })
    }

    /// Lower left and upper right corner of the upright box round it.
    pub fn bounds(&self) -> [Point; 2] {
        let nothing = [[f64::INFINITY; 2], [f64::NEG_INFINITY; 2]];
        self.corners.iter().fold(nothing, |[low, high], c| {
            [[low[0].min(c[0]), low[1].min(c[1])], [high[0].max(c[0]), high[1].max(c[1])]]
        })
    }

    /// Middle of the upright box round it.
    pub fn centre(&self) -> Point {
        let [low, high] = self.bounds();
        [f64::midpoint(low[0], high[0]), f64::midpoint(low[1], high[1])]
    }

    /// Whether a point lies at least `margin_m` inside.
    pub fn contains(&self, p: Point, margin_m: f64) -> bool {
        let crossings = self.edges().filter(|e| crossing_x(e, p[1]).is_some_and(|x| x > p[0])).count();
        crossings % 2 == 1 && (margin_m <= 0.0 || self.edges().all(|e| e.distance_m(p) >= margin_m))
    }
}

/// Where a segment crosses the level `y`; its lower end belongs to it, its upper end does not.
pub fn crossing_x(segment: &Segment, y: f64) -> Option<f64> {
    let (a, b) = (segment.a, segment.b);
    ((a[1] <= y) != (b[1] <= y)).then(|| a[0] + (y - a[1]) / (b[1] - a[1]) * (b[0] - a[0]))
}

/// The walls round a floor that is the union of rectangles: the edges of each that no other one
/// continues.
pub fn outline(free: &[Rect]) -> Vec<Segment> {
    let mut walls = Vec::new();
    for r in free {
        for (at, outward, vertical) in
            [(r.x0_m, -1.0, true), (r.x1_m, 1.0, true), (r.y0_m, -1.0, false), (r.y1_m, 1.0, false)]
        {
            let (from, to) = if vertical { (r.y0_m, r.y1_m) } else { (r.x0_m, r.x1_m) };
            let beyond = at + outward * 1e-6;
            let covered = free.iter().filter_map(|o| {
                let (across, along) = if vertical {
                    ((o.x0_m, o.x1_m), (o.y0_m, o.y1_m))
                } else {
                    ((o.y0_m, o.y1_m), (o.x0_m, o.x1_m))
                };
                (across.0 < beyond && beyond < across.1).then_some(along)
            });
            for (a, b) in uncovered(from, to, covered.collect()) {
                walls.push(if vertical {
                    Segment { a: [at, a], b: [at, b] }
                } else {
                    Segment { a: [a, at], b: [b, at] }
                });
            }
        }
    }
    walls
}

/// The pieces of `[from, to]` outside all intervals.
pub(crate) fn uncovered(from: f64, to: f64, mut intervals: Vec<(f64, f64)>) -> Vec<(f64, f64)> {
    intervals.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut pieces = Vec::new();
    let mut start = from;
    for (a, b) in intervals {
        if a.min(to) > start {
            pieces.push((start, a.min(to)));
        }
        start = start.max(b);
    }
    if start < to {
        pieces.push((start, to));
    }
    pieces
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_outline_of_two_rooms_and_a_door_has_jambs_and_no_wall_across_the_door() {
        let free = [
            Rect::new([0.0, 0.0], [4.0, 4.0]),
            Rect::new([4.2, 0.0], [8.0, 4.0]),
            Rect::new([4.0, 1.0], [4.2, 2.0]),
        ];
        let walls = outline(&free);
        let total: f64 = walls.iter().map(|s| distance_m(s.a, s.b)).sum();
        // Two outlines, less two door widths, and two jambs as deep as the wall.
        assert!((total - (16.0 + 15.6 - 2.0 + 0.4)).abs() < 1e-9, "{total}");
        assert!(walls.iter().all(|w| w.hit([2.0, 1.5], [1.0, 0.0]).is_none_or(|t| t > 4.2)));
    }

    #[test]
    fn crossing_segments_have_no_gap_and_parallel_ones_their_distance() {
        let s = Segment { a: [0.0, 0.0], b: [2.0, 0.0] };
        assert!(s.gap_m(&Segment { a: [1.0, -1.0], b: [1.0, 1.0] }) < 1e-12);
        assert!((s.gap_m(&Segment { a: [0.0, 0.5], b: [2.0, 0.5] }) - 0.5).abs() < 1e-12);
    }

    #[test]
    fn an_area_with_a_bay_contains_what_lies_in_it() {
        let l =
            Area { corners: vec![[0.0, 0.0], [4.0, 0.0], [4.0, 1.0], [1.0, 1.0], [1.0, 3.0], [0.0, 3.0]] };
        for (p, margin_m, inside) in [
            ([0.5, 2.5], 0.0, true),
            ([2.0, 2.0], 0.0, false),
            ([3.0, 0.5], 0.4, true),
            ([3.0, 0.5], 0.6, false),
            ([-1.0, 0.5], 0.0, false),
        ] {
            assert_eq!(l.contains(p, margin_m), inside, "{p:?} by {margin_m} m");
        }
        assert!(distance_m(l.centre(), [2.0, 1.5]) < 1e-12);
    }

    #[test]
    fn between_undoes_compose() {
        let a = Pose { x_m: 1.0, y_m: -2.0, yaw_rad: 2.5 };
        let b = Pose { x_m: 0.3, y_m: 0.7, yaw_rad: 1.5 };
        let c = between(&a, &compose(&a, &b));
        assert!((c.x_m - b.x_m).abs() < 1e-12 && (c.yaw_rad - b.yaw_rad).abs() < 1e-12);
    }
}
