//! The floor that a landmark takes, as a rectangle: all that factors need to know of its shape.

// Inlined into loops over points, which run in wide registers.
#![allow(clippy::inline_always)]

/// An oriented rectangle in the map, the longer side along its axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Footprint {
    /// Middle.
    pub x_m: f64,
    /// Middle.
    pub y_m: f64,
    /// Unit vector along the longer side.
    pub axis: (f64, f64),
    /// Half of the longer side, at least [`HALF_MIN_M`].
    pub half_length_m: f64,
    /// Half of the shorter side, at least [`HALF_MIN_M`].
    pub half_width_m: f64,
}

/// No landmark is thinner: keeps what is divided by a side finite.
pub const HALF_MIN_M: f64 = 0.05;

impl Footprint {
    /// A disc's square: a landmark of which only the place is known.
    pub fn spot(x_m: f64, y_m: f64, half_m: f64) -> Self {
        let half_m = half_m.max(HALF_MIN_M);
        Self { x_m, y_m, axis: (1.0, 0.0), half_length_m: half_m, half_width_m: half_m }
    }

    /// A strip `half_width_m` to either side of the line from one point to another.
    pub fn strip(from: (f64, f64), to: (f64, f64), half_width_m: f64) -> Self {
        let (dx, dy) = (to.0 - from.0, to.1 - from.1);
        let length_m = dx.hypot(dy);
        let axis = if length_m > 1e-9 { (dx / length_m, dy / length_m) } else { (1.0, 0.0) };
        let half_width_m = half_width_m.max(HALF_MIN_M);
        Self {
            x_m: 0.5 * (from.0 + to.0),
            y_m: 0.5 * (from.1 + to.1),
            axis,
            half_length_m: (0.5 * length_m).max(HALF_MIN_M),
            half_width_m,
        }
        .longer_first()
    }

    /// The rectangle of least area round the points; none without points.
    ///
    /// It has a side along one of the convex hull's, so each pair of points that could be one is tried:
    /// cubic, for outlines of few points.
    pub fn around(points: &[(f64, f64)]) -> Option<Self> {
        let &first = points.first()?;
        let mut best = Self::aligned(points, (1.0, 0.0));
        for (k, a) in points.iter().enumerate() {
            for b in &points[k + 1..] {
                let (dx, dy) = (b.0 - a.0, b.1 - a.1);
                let length_m = dx.hypot(dy);
                // Only sides of the hull: all points on one side of the line.
                let side = |p: &(f64, f64)| (dx * (p.1 - a.1) - dy * (p.0 - a.0)) / length_m;
                if length_m < 1e-9
                    || points.iter().any(|p| side(p) > 1e-9) && points.iter().any(|p| side(p) < -1e-9)
                {
                    continue;
                }
                let other = Self::aligned(points, (dx / length_m, dy / length_m));
                if other.area_m2() < best.area_m2() {
                    best = other;
                }
            }
        }
        let finite = best.area_m2().is_finite() && best.x_m.is_finite() && best.y_m.is_finite();
        Some(if finite { best } else { Self::spot(first.0, first.1, HALF_MIN_M) })
    }

    /// The rectangle round the points with a side along `axis`.
    fn aligned(points: &[(f64, f64)], axis: (f64, f64)) -> Self {
        let (mut u, mut v) = ((f64::INFINITY, f64::NEG_INFINITY), (f64::INFINITY, f64::NEG_INFINITY));
        for p in points {
            let (a, b) = (p.0 * axis.0 + p.1 * axis.1, p.1 * axis.0 - p.0 * axis.1);
            (u, v) = ((u.0.min(a), u.1.max(a)), (v.0.min(b), v.1.max(b)));
        }
        let (mid_u, mid_v) = (0.5 * (u.0 + u.1), 0.5 * (v.0 + v.1));
        Self {
            x_m: mid_u * axis.0 - mid_v * axis.1,
            y_m: mid_u * axis.1 + mid_v * axis.0,
            axis,
            half_length_m: (0.5 * (u.1 - u.0)).max(HALF_MIN_M),
            half_width_m: (0.5 * (v.1 - v.0)).max(HALF_MIN_M),
        }
        .longer_first()
    }

    fn longer_first(self) -> Self {
        if self.half_length_m >= self.half_width_m {
            return self;
        }
        Self {
            axis: (-self.axis.1, self.axis.0),
            half_length_m: self.half_width_m,
            half_width_m: self.half_length_m,
            ..self
        }
    }

    /// With a margin all round.
    #[must_use]
    pub fn grown(self, margin_m: f64) -> Self {
        Self {
            half_length_m: self.half_length_m + margin_m,
            half_width_m: self.half_width_m + margin_m,
            ..self
        }
    }

    /// Area.
    pub fn area_m2(&self) -> f64 {
        4.0 * self.half_length_m * self.half_width_m
    }

    /// (along, across): a point in the rectangle's own frame.
    #[inline(always)]
    pub fn local(&self, x_m: f64, y_m: f64) -> (f64, f64) {
        let (dx, dy) = (x_m - self.x_m, y_m - self.y_m);
        (dx * self.axis.0 + dy * self.axis.1, dy * self.axis.0 - dx * self.axis.1)
    }

    /// A point of the rectangle's own frame in the map.
    pub fn map(&self, along_m: f64, across_m: f64) -> (f64, f64) {
        (
            self.x_m + along_m * self.axis.0 - across_m * self.axis.1,
            self.y_m + along_m * self.axis.1 + across_m * self.axis.0,
        )
    }

    /// Distance from the edge of a point given in the rectangle's frame; negative inside.
    #[inline(always)]
    pub fn signed_distance_m(&self, (along_m, across_m): (f64, f64)) -> f64 {
        let (dx, dy) = (along_m.abs() - self.half_length_m, across_m.abs() - self.half_width_m);
        // Comparisons that the compiler can do of many points at once.
        let (out_x, out_y) = (if dx > 0.0 { dx } else { 0.0 }, if dy > 0.0 { dy } else { 0.0 });
        let most = if dx > dy { dx } else { dy };
        (out_x * out_x + out_y * out_y).sqrt() + if most > 0.0 { 0.0 } else { most }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn a_turned_rectangle_is_found() {
        let turned = |x: f64, y: f64| {
            let (s, c) = 0.4_f64.sin_cos();
            (3.0 + c * x - s * y, -1.0 + s * x + c * y)
        };
        let corners = [turned(-1.0, -3.0), turned(1.0, -3.0), turned(1.0, 3.0), turned(-1.0, 3.0)];
        let f = Footprint::around(&corners).unwrap();
        assert!((f.half_length_m - 3.0).abs() < 1e-9 && (f.half_width_m - 1.0).abs() < 1e-9, "{f:?}");
        assert!((f.x_m - 3.0).abs() < 1e-9 && (f.y_m + 1.0).abs() < 1e-9);
        let (along, across) = f.local(turned(0.0, 5.0).0, turned(0.0, 5.0).1);
        assert!((along.abs() - 5.0).abs() < 1e-9 && across.abs() < 1e-9);
        assert!((f.signed_distance_m((along, across)) - 2.0).abs() < 1e-9);
        assert!((f.signed_distance_m((4.0, 2.0)) - 2.0_f64.sqrt()).abs() < 1e-9);
        assert!((f.signed_distance_m((0.0, 0.5)) + 0.5).abs() < 1e-9);
    }

    proptest! {
        #[test]
        fn all_points_lie_inside(points in prop::collection::vec((-9.0..9.0, -9.0..9.0), 1..12)) {
            let f = Footprint::around(&points).unwrap();
            for &(x, y) in &points {
                let (u, v) = f.local(x, y);
                prop_assert!(f.signed_distance_m((u, v)) < 1e-6);
                let (bx, by) = f.map(u, v);
                prop_assert!((bx - x).abs() < 1e-9 && (by - y).abs() < 1e-9);
            }
            prop_assert!(f.half_length_m >= f.half_width_m && f.half_width_m >= HALF_MIN_M);
        }
    }
}
