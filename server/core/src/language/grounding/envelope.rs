//! How far from a landmark a figure lies, before asking in which direction: falls off as
//! exp(−gap/scale) round the landmark's footprint. Its integral over the floor is known, so whatever
//! of it a relation keeps is a density that integrates to at most one.

use crate::language::grounding::footprint::Footprint;
use std::f64::consts::{FRAC_PI_2, TAU};

/// Gaps sampled, in scales: middles of equal quarters of exp(−gap/scale) up to the end, the last one's mean.
const GAPS: [f64; 4] = [0.13, 0.46, 0.95, 2.1];
/// Samples in the footprint, along and across.
const INSIDE: (usize, usize) = (12, 1);
/// Beyond so many scales there is nothing: 2 % of what is at the edge.
const END: f64 = 3.9;

/// exp(−gap/scale) round a footprint.
pub struct Envelope {
    footprint: Footprint,
    scale_m: f64,
    /// Radius, squared, of a circle round all that is not negligible.
    round_m2: f64,
}

impl Envelope {
    /// Round `footprint`, falling off with `scale_m`.
    pub fn new(footprint: Footprint, scale_m: f64) -> Self {
        let Footprint { half_length_m: a, half_width_m: b, .. } = footprint;
        let round_m2 = ((a * a + b * b).sqrt() + END * scale_m).powi(2);
        Self { footprint, scale_m, round_m2 }
    }

    /// Zero at a point, as a glance tells: most of a map is far from a landmark.
    pub fn is_far(&self, at: (f64, f64)) -> bool {
        let (dx, dy) = (at.0 - self.footprint.x_m, at.1 - self.footprint.y_m);
        dx * dx + dy * dy > self.round_m2
    }

    /// At a gap from the footprint, 1 at its edge; zero where it is negligible.
    pub fn at_gap(&self, gap_m: f64) -> f64 {
        let scales = gap_m.max(0.0) / self.scale_m;
        if scales < END { (-scales).exp() } else { 0.0 }
    }

    /// Integral over the floor: the footprint, four sides, four corners.
    pub fn area_m2(&self) -> f64 {
        let (side, corner) = (1.0 - (-END).exp(), 1.0 - (1.0 + END) * (-END).exp());
        let scale_m = self.scale_m;
        self.footprint.area_m2() + self.sides_m() * scale_m * side + TAU * scale_m * scale_m * corner
    }

    fn sides_m(&self) -> f64 {
        4.0 * (self.footprint.half_length_m + self.footprint.half_width_m)
    }

    /// Mean of `score` over the floor, weighed by the envelope; by so many samples `round` the footprint
    /// at each of [`GAPS`].
    pub fn mean(&self, round: usize, mut score: impl FnMut((f64, f64)) -> f64) -> f64 {
        let Footprint { half_length_m: a, half_width_m: b, .. } = self.footprint;
        let (mut sum, mut weight) = (0.0, 0.0);
        let mut add = |w: f64, (along_m, across_m): (f64, f64)| {
            sum += w * score(self.footprint.map(along_m, across_m));
            weight += w;
        };
        let inside = self.footprint.area_m2() / (INSIDE.0 * INSIDE.1) as f64;
        for i in 0..INSIDE.0 {
            for j in 0..INSIDE.1 {
                let middle = |k: usize, n: usize| (2 * k + 1) as f64 / n as f64 - 1.0;
                add(inside, (a * middle(i, INSIDE.0), b * middle(j, INSIDE.1)));
            }
        }
        for gap in GAPS {
            let gap_m = gap * self.scale_m;
            // Every gap stands for the same share of exp(−gap/scale), on a ring of this length.
            let ring_m = self.sides_m() + TAU * gap_m;
            let w = self.scale_m * ring_m / (GAPS.len() * round) as f64;
            for k in 0..round {
                add(w, ring_point(a, b, gap_m, ring_m * (k as f64 + 0.5) / round as f64));
            }
        }
        sum / weight
    }
}

/// The point `s_m` along the rounded rectangle at a gap from one of half sides `a` and `b`.
fn ring_point(a: f64, b: f64, gap_m: f64, mut s_m: f64) -> (f64, f64) {
    let corner_m = FRAC_PI_2 * gap_m;
    // Each side is followed by the corner at its end; the outward normal turns by 90° there.
    let sides = [(a, -b, 2.0 * b, (1.0, 0.0)), (a, b, 2.0 * a, (0.0, 1.0)), (-a, b, 2.0 * b, (-1.0, 0.0))];
    for (u, v, side_m, n) in sides.into_iter().chain([(-a, -b, 2.0 * a, (0.0, -1.0))]) {
        let ahead = (-n.1, n.0);
        if s_m <= side_m {
            return (u + s_m * ahead.0 + gap_m * n.0, v + s_m * ahead.1 + gap_m * n.1);
        }
        s_m -= side_m;
        if s_m <= corner_m {
            let (sin, cos) = (s_m / gap_m.max(1e-12)).sin_cos();
            let normal = (cos * n.0 + sin * ahead.0, cos * n.1 + sin * ahead.1);
            return (u + side_m * ahead.0 + gap_m * normal.0, v + side_m * ahead.1 + gap_m * normal.1);
        }
        s_m -= corner_m;
    }
    (a + gap_m, -b)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn integrals_are_those_of_a_fine_grid() {
        for footprint in [Footprint::spot(1.0, 2.0, 1.5), Footprint::strip((0.0, 0.0), (9.0, 9.0), 1.0)] {
            let envelope = Envelope::new(footprint, 3.0);
            let right = |(x, _): (f64, f64)| f64::from(x > 3.0);
            let (mut all, mut some) = (0.0, 0.0);
            for i in -400..400 {
                for j in -400..400 {
                    let (x, y) = (0.1 * f64::from(i), 0.1 * f64::from(j));
                    let gap_m = footprint.signed_distance_m(footprint.local(x, y));
                    all += 0.01 * envelope.at_gap(gap_m);
                    some += 0.01 * envelope.at_gap(gap_m) * right((x, y));
                }
            }
            assert!((all / envelope.area_m2() - 1.0).abs() < 0.02, "{all} {}", envelope.area_m2());
            assert!(
                (some / all - envelope.mean(12, right)).abs() < 0.05,
                "{} {}",
                some / all,
                envelope.mean(12, right)
            );
        }
    }

    #[test]
    fn rings_lie_at_their_gap() {
        let footprint = Footprint::strip((0.0, 0.0), (6.0, 0.0), 1.0);
        let (a, b, gap_m) = (footprint.half_length_m, footprint.half_width_m, 2.0);
        let ring_m = 4.0 * (a + b) + TAU * gap_m;
        let mut last = ring_point(a, b, gap_m, 0.0);
        for k in 1..=200 {
            let p = ring_point(a, b, gap_m, ring_m * f64::from(k) / 200.0);
            assert!((footprint.signed_distance_m(p) - gap_m).abs() < 1e-9, "{p:?}");
            assert!((p.0 - last.0).hypot(p.1 - last.1) <= ring_m / 200.0 + 1e-9, "no jump");
            last = p;
        }
    }
}
