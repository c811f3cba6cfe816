//! How a path lies to a landmark, as numbers: what the factors of path relations are learned on.

use super::footprint::Footprint;
use std::f64::consts::{PI, TAU};

/// Numbers that describe a path beside a landmark.
pub const FEATURES: usize = 36;
/// Points, equally far apart on the path, that it is seen by.
const SAMPLES: usize = 12;
/// Where ratios are cut: a path that much longer than the landmark is simply long, and few examples
/// would tell how long. Likewise for the logarithms of lengths, and for turns (of 180°).
const RATIO_MAX: f64 = 1.2;
const LOG_RANGE: (f64, f64) = (-2.0, 2.5);
const TURNS_MAX: f64 = 1.5;

/// A path seen at equal steps, in the landmark's frame.
struct Samples {
    at: [(f64, f64); SAMPLES],
    length_m: f64,
}

impl Samples {
    /// None if the path is no path: no points, or not finite.
    fn new(path: &[(f64, f64)], landmark: &Footprint) -> Option<Self> {
        let step_m = |w: &[(f64, f64)]| norm(difference(w[1], w[0]));
        let length_m: f64 = path.windows(2).map(step_m).sum();
        let &first = path.first()?;
        if !(length_m.is_finite() && first.0.is_finite() && first.1.is_finite()) {
            return None;
        }
        let mut at = [landmark.local(first.0, first.1); SAMPLES];
        let (mut k, mut walked_m) = (0, 0.0);
        for (s, point) in at.iter_mut().enumerate().skip(1) {
            let want_m = length_m * s as f64 / (SAMPLES - 1) as f64;
            let (mut here_m, mut f) = (0.0, 0.0);
            while k + 1 < path.len() {
                here_m = step_m(&path[k..k + 2]);
                f = if here_m > 0.0 { ((want_m - walked_m) / here_m).clamp(0.0, 1.0) } else { 0.0 };
                if walked_m + here_m >= want_m || k + 2 == path.len() {
                    break;
                }
                walked_m += here_m;
                k += 1;
            }
            let (a, b) = (path[k], *path.get(k + 1).unwrap_or(&path[k]));
            let f = if here_m > 0.0 { f } else { 0.0 };
            *point = landmark.local(a.0 + f * (b.0 - a.0), a.1 + f * (b.1 - a.1));
        }
        Some(Self { at, length_m: length_m.max(1e-3) })
    }
}

/// What is summed up over the samples of a path.
struct Totals {
    inside: f64,
    gap_min_m: f64,
    gap_mean_m: f64,
    centre_min_m: f64,
    centre_min_at: f64,
    within_length: f64,
    within_width: f64,
    across_mean_m: f64,
    turned_rad: f64,
    round_rad: f64,
}

impl Totals {
    fn new(path: &Samples, landmark: &Footprint) -> Self {
        let share = 1.0 / SAMPLES as f64;
        let mut t = Self {
            inside: 0.0,
            gap_min_m: f64::INFINITY,
            gap_mean_m: 0.0,
            centre_min_m: f64::INFINITY,
            centre_min_at: 0.0,
            within_length: 0.0,
            within_width: 0.0,
            across_mean_m: 0.0,
            turned_rad: 0.0,
            round_rad: 0.0,
        };
        for (k, &(u, v)) in path.at.iter().enumerate() {
            let signed_m = landmark.signed_distance_m((u, v));
            let gap_m = signed_m.max(0.0);
            t.inside += share * f64::from(signed_m <= 0.0);
            t.gap_min_m = t.gap_min_m.min(gap_m);
            t.gap_mean_m += share * gap_m;
            let centre_m = norm((u, v));
            if centre_m < t.centre_min_m {
                (t.centre_min_m, t.centre_min_at) = (centre_m, k as f64 / (SAMPLES - 1) as f64);
            }
            t.within_length += share * f64::from(u.abs() < landmark.half_length_m);
            t.within_width += share * f64::from(v.abs() < landmark.half_width_m);
            t.across_mean_m += share * v.abs();
        }
        // Turns between vectors, by one cross and one dot product each: no angle jumps.
        let turn = |a: (f64, f64), b: (f64, f64)| angle(a.0 * b.1 - a.1 * b.0, a.0 * b.0 + a.1 * b.1);
        for w in path.at.windows(2) {
            t.round_rad += turn(w[0], w[1]);
        }
        for w in path.at.windows(3) {
            t.turned_rad += turn(difference(w[1], w[0]), difference(w[2], w[1])).abs();
        }
        t
    }
}

/// Describes a path, from its start, beside a landmark; all zero if it is no path.
///
/// Lengths are divided by the landmark's or the path's, or saturate, so that a factor learned on
/// chairs and hallways holds for both.
pub fn path_features(path: &[(f64, f64)], landmark: &Footprint) -> [f64; FEATURES] {
    let Some(path) = Samples::new(path, landmark) else { return [0.0; FEATURES] };
    let t = Totals::new(&path, landmark);
    let (a, b) = (landmark.half_length_m, landmark.half_width_m);
    let (size_m, reach_m) = (2.0 * (a * b).sqrt(), norm((a, b)));
    let (start, end) = (path.at[0], path.at[SAMPLES - 1]);
    let (start_m, end_m) = (landmark.signed_distance_m(start), landmark.signed_distance_m(end));
    let (start_out_m, end_out_m) = (start_m.max(0.0), end_m.max(0.0));
    let (from_m, to_m) = (norm(start), norm(end));
    let moved = difference(end, start);
    let chord_m = norm(moved);
    let length_m = path.length_m;
    // Where on the chord the landmark's middle lies, 0 at the start and 1 at the end.
    let passed = (-(start.0 * moved.0 + start.1 * moved.1) / (chord_m * chord_m).max(1e-6)).clamp(-1.0, 2.0);
    let offset_m = (moved.0 * start.1 - moved.1 * start.0).abs() / chord_m.max(1e-3);
    let leaving = difference(path.at[2], start);
    let arriving = difference(end, path.at[SAMPLES - 3]);
    [
        f64::from(start_m <= 0.0),
        f64::from(end_m <= 0.0),
        t.inside,
        share(start_out_m, 1.0),
        share(end_out_m, 1.0),
        share(t.gap_min_m, 1.0),
        share(start_out_m, size_m),
        share(end_out_m, size_m),
        share(t.gap_min_m, size_m),
        share(t.gap_mean_m, size_m),
        share((-start_m).max(0.0), size_m / 4.0),
        share((-end_m).max(0.0), size_m / 4.0),
        t.centre_min_at,
        ((start_m - end_m) / length_m).clamp(-1.0, 1.0),
        ((from_m - to_m) / length_m).clamp(-1.0, 1.0),
        ((to_m - t.centre_min_m) / length_m).min(1.0),
        ((from_m - t.centre_min_m) / length_m).min(1.0),
        (chord_m / length_m).min(1.0),
        (moved.0.abs() / (2.0 * a)).min(RATIO_MAX),
        (moved.1.abs() / (2.0 * b)).min(RATIO_MAX),
        moved.0.abs() / chord_m.max(1e-3),
        (t.turned_rad / PI).min(TURNS_MAX),
        (t.round_rad.abs() / TAU).min(1.0),
        t.within_length,
        t.within_width,
        share(t.across_mean_m, b),
        opposite(start.0, end.0, a),
        opposite(start.1, end.1, b),
        opposite(start.0, end.0, a).max(opposite(start.1, end.1, b)),
        (passed - 0.5).abs().min(1.0),
        share(offset_m, reach_m),
        cosine(arriving, (-end.0, -end.1)),
        cosine(leaving, (-start.0, -start.1)),
        (length_m / reach_m).ln().clamp(LOG_RANGE.0, LOG_RANGE.1),
        (length_m / (2.0 * b)).ln().clamp(LOG_RANGE.0, LOG_RANGE.1),
        (a / b).ln().min(LOG_RANGE.1 * 2.0),
    ]
}

fn difference(a: (f64, f64), b: (f64, f64)) -> (f64, f64) {
    (a.0 - b.0, a.1 - b.1)
}

/// Length of a vector. (`hypot` guards against overflow, which metres don't, and takes ten times longer.)
fn norm(a: (f64, f64)) -> f64 {
    (a.0 * a.0 + a.1 * a.1).sqrt()
}

/// `atan2` to 0.3°, which no feature needs better: it is most of what a path costs.
fn angle(y: f64, x: f64) -> f64 {
    let (low, high) = (y.abs().min(x.abs()), y.abs().max(x.abs()));
    let t = if high > 0.0 { low / high } else { 0.0 };
    // Odd polynomial on 0…1, Hastings (1955).
    let s = t * t;
    let first = t * (0.995_354 + s * (-0.288_679 + s * 0.079_331));
    let half = if y.abs() > x.abs() { PI / 2.0 - first } else { first };
    let whole = if x < 0.0 { PI - half } else { half };
    if y < 0.0 { -whole } else { whole }
}

/// A length against a scale, from 0 to 1.
fn share(x_m: f64, scale_m: f64) -> f64 {
    x_m / (x_m + scale_m)
}

/// How clearly two coordinates lie on opposite sides of zero (to 1) or on the same (to −1).
fn opposite(start_m: f64, end_m: f64, half_m: f64) -> f64 {
    let product = start_m * end_m;
    -product.signum() * share(product.abs().sqrt(), half_m)
}

fn cosine(a: (f64, f64), b: (f64, f64)) -> f64 {
    (a.0 * b.0 + a.1 * b.1) / (norm(a) * norm(b)).max(1e-9)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn a_path_through_the_middle() {
        let landmark = Footprint::strip((-2.0, 0.0), (2.0, 0.0), 1.0);
        let f = path_features(&[(-6.0, 0.0), (0.0, 0.0), (6.0, 0.0)], &landmark);
        assert!((f[0], f[1]) == (0.0, 0.0) && (f[2] - 1.0 / 3.0).abs() < 0.05, "{f:?}");
        assert!((f[3] - 0.8).abs() < 1e-9 && f[5] == 0.0, "4 m away, then inside");
        assert!((f[17] - 1.0).abs() < 1e-9 && (f[18] - 1.2).abs() < 1e-9 && f[19] == 0.0);
        assert!(f[26] > 0.7 && f[29] < 1e-9, "opposite ends, the middle half way");
    }

    #[test]
    fn angles_are_good_enough() {
        for k in -180..180 {
            let (sin, cos) = f64::from(k).to_radians().sin_cos();
            assert!((angle(sin, cos) - sin.atan2(cos)).abs() < 0.006, "{k}°");
        }
    }

    #[test]
    fn a_path_round_it_is_one_turn() {
        let landmark = Footprint::spot(5.0, 5.0, 0.5);
        let ring: Vec<(f64, f64)> = (0..=40)
            .map(|k| (TAU * f64::from(k) / 40.0).sin_cos())
            .map(|(s, c)| (5.0 + 2.0 * c, 5.0 + 2.0 * s))
            .collect();
        let f = path_features(&ring, &landmark);
        assert!((f[22] - 1.0).abs() < 0.02 && f[17] < 1e-9, "{f:?}");
    }

    proptest! {
        #[test]
        fn always_finite_and_free_of_the_frame(
            path in prop::collection::vec((-30.0..30.0, -30.0..30.0), 0..9),
            repeat in 1..3usize,
            (x, y, yaw) in (-9.0..9.0, -9.0..9.0, -3.0..3.0f64),
            (long, wide) in (0.0..9.0, 0.0..2.0),
        ) {
            // Points said twice are no trouble.
            let path: Vec<(f64, f64)> = path.iter().flat_map(|p| vec![*p; repeat]).collect();
            let turned = |p: &(f64, f64)| (x + yaw.cos() * p.0 - yaw.sin() * p.1, y + yaw.sin() * p.0 + yaw.cos() * p.1);
            let here = Footprint::strip((0.0, 0.0), (long, 0.0), wide);
            let there = Footprint::strip((x, y), turned(&(long, 0.0)), wide);
            let f = path_features(&path, &here);
            prop_assert!(f.iter().all(|v| v.is_finite() && v.abs() <= 5.0), "{:?}", f);
            if path.len() > 2 * repeat && long > 0.1 && (long - 2.0 * wide).abs() > 0.01 {
                let g = path_features(&path.iter().map(turned).collect::<Vec<_>>(), &there);
                let off = f.iter().zip(&g).filter(|(a, b)| (*a - *b).abs() > 1e-3).count();
                prop_assert!(off <= 4, "{:?} {:?}", f, g);
            }
        }

        #[test]
        fn any_numbers_are_taken(
            path in prop::collection::vec((prop::num::f64::ANY, prop::num::f64::ANY), 0..5),
        ) {
            let f = path_features(&path, &Footprint::spot(0.0, 0.0, 1.0));
            prop_assert!(f.iter().all(|v| !v.is_infinite()));
        }
    }
}
