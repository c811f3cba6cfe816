//! How a path lies to a landmark, as numbers: what the factors of path relations are learned on.

// Inlined, loops over points run in wide registers. Indices, since iterators' closures are calls.
#![allow(clippy::inline_always, clippy::needless_range_loop)]

use crate::language::grounding::footprint::Footprint;
use crate::language::grounding::ways::Step;
use crate::wide::wide;
use std::f64::consts::{PI, TAU};

/// Numbers that describe a path beside a landmark.
pub const FEATURES: usize = 36;
/// The one that is zero if the path comes into the landmark.
pub(crate) const GAP_MIN: usize = 5;
/// Points, equally far apart on the path, that it is seen by.
const SAMPLES: usize = 12;
/// Where ratios are cut: a path that much longer than the landmark is simply long, and few examples
/// would tell how long. Likewise for the logarithms of lengths, and for turns (of 180°).
const RATIO_MAX: f64 = 1.2;
const LOG_RANGE: (f64, f64) = (-2.0, 2.5);
const TURNS_MAX: f64 = 1.5;

/// A path seen at equal steps, in the landmark's frame: coordinates along and across it, metres.
struct Samples {
    along: [f64; SAMPLES],
    across: [f64; SAMPLES],
    length_m: f64,
}

impl Samples {
    /// None if the path is not finite.
    #[inline(always)]
    fn new(start: Step, rest: &[Step], landmark: &Footprint) -> Option<Self> {
        let length_m = rest.last().map_or(start.walk_m, |s| s.walk_m) - start.walk_m;
        if !(length_m.is_finite() && start.at.0.is_finite() && start.at.1.is_finite()) {
            return None;
        }
        let mut samples = Self { along: [0.0; SAMPLES], across: [0.0; SAMPLES], length_m };
        for s in 0..SAMPLES {
            let share = s as f64 / (SAMPLES - 1) as f64;
            let (x_m, y_m) = point_at(start, rest, share * length_m, (share * rest.len() as f64) as usize);
            (samples.along[s], samples.across[s]) = landmark.local(x_m, y_m);
        }
        samples.length_m = length_m.max(1e-3);
        Some(samples)
    }

    #[inline(always)]
    fn at(&self, k: usize) -> (f64, f64) {
        (self.along[k], self.across[k])
    }
}

/// The point so far along a path, which is looked for from a step of `rest` on, guessed to be near.
#[inline(always)]
fn point_at(start: Step, rest: &[Step], from_start_m: f64, guess: usize) -> (f64, f64) {
    let Some(last) = rest.len().checked_sub(1) else { return start.at };
    let (walk_m, mut k) = (start.walk_m + from_start_m, guess.min(last));
    while k < last && rest[k].walk_m < walk_m {
        k += 1;
    }
    while k > 0 && rest[k - 1].walk_m >= walk_m {
        k -= 1;
    }
    let (a, b) = (if k > 0 { rest[k - 1] } else { start }, rest[k]);
    let step_m = b.walk_m - a.walk_m;
    let f = if step_m > 0.0 { ((walk_m - a.walk_m) / step_m).clamp(0.0, 1.0) } else { 0.0 };
    (a.at.0 + f * (b.at.0 - a.at.0), a.at.1 + f * (b.at.1 - a.at.1))
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
    #[inline(always)]
    fn new(path: &Samples, landmark: &Footprint) -> Self {
        let (u, v) = (&path.along, &path.across);
        let (a, b) = (landmark.half_length_m, landmark.half_width_m);
        let (mut gap_m, mut centre_m2, mut across_m) = ([0.0; SAMPLES], [0.0; SAMPLES], [0.0; SAMPLES]);
        let (mut inside, mut within_a, mut within_b) = ([0.0; SAMPLES], [0.0; SAMPLES], [0.0; SAMPLES]);
        for k in 0..SAMPLES {
            let signed_m = landmark.signed_distance_m((u[k], v[k]));
            gap_m[k] = if signed_m > 0.0 { signed_m } else { 0.0 };
            centre_m2[k] = u[k] * u[k] + v[k] * v[k];
            across_m[k] = v[k].abs();
            inside[k] = f64::from(signed_m <= 0.0);
            within_a[k] = f64::from(u[k].abs() < a);
            within_b[k] = f64::from(v[k].abs() < b);
        }
        let share = 1.0 / SAMPLES as f64;
        let centre_min_m2 = least(&centre_m2);
        let nearest = centre_m2.iter().position(|m2| *m2 <= centre_min_m2).unwrap_or(0);
        Self {
            inside: share * sum(&inside),
            gap_min_m: least(&gap_m),
            gap_mean_m: share * sum(&gap_m),
            centre_min_m: centre_min_m2.sqrt(),
            centre_min_at: nearest as f64 / (SAMPLES - 1) as f64,
            within_length: share * sum(&within_a),
            within_width: share * sum(&within_b),
            across_mean_m: share * sum(&across_m),
            turned_rad: turned_rad(u, v),
            round_rad: round_rad(u, v),
        }
    }
}

/// Four sums at once: one after the other, each would wait for the last.
#[inline(always)]
fn sum(of: &[f64; SAMPLES]) -> f64 {
    let mut sums = [0.0; 4];
    for four in of.as_chunks::<4>().0 {
        for k in 0..4 {
            sums[k] += four[k];
        }
    }
    (sums[0] + sums[1]) + (sums[2] + sums[3])
}

/// The least of some numbers. (`min` looks for NaN, which takes as long again.)
#[inline(always)]
fn least(of: &[f64; SAMPLES]) -> f64 {
    let mut least = [f64::INFINITY; 4];
    for four in of.as_chunks::<4>().0 {
        for k in 0..4 {
            least[k] = if four[k] < least[k] { four[k] } else { least[k] };
        }
    }
    least.into_iter().fold(f64::INFINITY, |least, m| if m < least { m } else { least })
}

/// Turns from step to step, all counted as positive; by one cross and one dot product each.
#[inline(always)]
fn turned_rad(u: &[f64; SAMPLES], v: &[f64; SAMPLES]) -> f64 {
    // One step less than points, one turn less than steps: the last ones are none.
    let (mut du, mut dv) = ([0.0; SAMPLES + 1], [0.0; SAMPLES + 1]);
    for k in 0..SAMPLES - 1 {
        (du[k], dv[k]) = (u[k + 1] - u[k], v[k + 1] - v[k]);
    }
    let mut turns = [0.0; SAMPLES];
    for k in 0..SAMPLES {
        let cross = du[k] * dv[k + 1] - dv[k] * du[k + 1];
        turns[k] = angle(cross, du[k] * du[k + 1] + dv[k] * dv[k + 1]).abs();
    }
    sum(&turns)
}

/// The angle that a path sweeps round the landmark's middle, in all: that from its start to its end,
/// and whole turns, which are counted where it crosses the ray opposite the start.
#[inline(always)]
fn round_rad(u: &[f64; SAMPLES], v: &[f64; SAMPLES]) -> f64 {
    let mut off_m2 = [0.0; SAMPLES];
    for k in 0..SAMPLES {
        off_m2[k] = u[0] * v[k] - v[0] * u[k];
    }
    let mut turns = [0.0; SAMPLES];
    for k in 0..SAMPLES - 1 {
        let leftward = u[k] * v[k + 1] - v[k] * u[k + 1];
        let (was_left, is_left) = (off_m2[k] >= 0.0, off_m2[k + 1] >= 0.0);
        // From left to right against the clock, or the other way round: behind the middle.
        let left = f64::from(was_left && !is_left && leftward > 0.0);
        turns[k] = left - f64::from(!was_left && is_left && leftward < 0.0);
    }
    let last = SAMPLES - 1;
    angle(off_m2[last], u[0] * u[last] + v[0] * v[last]) + TAU * sum(&turns)
}

/// Describes a path, from its start, beside a landmark; all zero if it is no path.
///
/// Lengths are divided by the landmark's or the path's, or saturate, so that a factor learned on
/// chairs and hallways holds for both.
pub fn path_features(path: &[(f64, f64)], landmark: &Footprint) -> [f64; FEATURES] {
    let Some(&at) = path.first() else { return [0.0; FEATURES] };
    let start = Step { at, walk_m: 0.0 };
    let walk = |last: &mut Step, &at: &(f64, f64)| {
        *last = last.to(at);
        Some(*last)
    };
    let rest: Vec<Step> = path[1..].iter().scan(start, walk).collect();
    features_of_steps(start, &rest, landmark)
}

/// Describes the path from `start` over `rest`.
pub(crate) fn features_of_steps(start: Step, rest: &[Step], landmark: &Footprint) -> [f64; FEATURES] {
    wide(
        #[inline(always)]
        || features(start, rest, landmark),
    )
}

#[inline(always)]
fn features(start: Step, rest: &[Step], landmark: &Footprint) -> [f64; FEATURES] {
    let Some(path) = Samples::new(start, rest, landmark) else { return [0.0; FEATURES] };
    let t = Totals::new(&path, landmark);
    let (a, b) = (landmark.half_length_m, landmark.half_width_m);
    let (size_m, reach_m) = (2.0 * (a * b).sqrt(), norm((a, b)));
    let (start, end) = (path.at(0), path.at(SAMPLES - 1));
    let (start_m, end_m) = (landmark.signed_distance_m(start), landmark.signed_distance_m(end));
    let (start_out_m, end_out_m) = (start_m.max(0.0), end_m.max(0.0));
    let (from_m, to_m) = (norm(start), norm(end));
    let moved = difference(end, start);
    let chord_m = norm(moved);
    let length_m = path.length_m;
    // Where on the chord the landmark's middle lies, 0 at the start and 1 at the end.
    let passed = (-(start.0 * moved.0 + start.1 * moved.1) / (chord_m * chord_m).max(1e-6)).clamp(-1.0, 2.0);
    let offset_m = (moved.0 * start.1 - moved.1 * start.0).abs() / chord_m.max(1e-3);
    let leaving = difference(path.at(2), start);
    let arriving = difference(end, path.at(SAMPLES - 3));
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

#[inline(always)]
fn difference(a: (f64, f64), b: (f64, f64)) -> (f64, f64) {
    (a.0 - b.0, a.1 - b.1)
}

/// Length of a vector. (`hypot` guards against overflow, which metres don't, and takes ten times longer.)
#[inline(always)]
fn norm(a: (f64, f64)) -> f64 {
    (a.0 * a.0 + a.1 * a.1).sqrt()
}

/// `atan2` to 0.3°, which no feature needs better: it is most of what a path costs.
#[inline(always)]
fn angle(y: f64, x: f64) -> f64 {
    let steep = y.abs() > x.abs();
    let (low, high) = if steep { (x.abs(), y.abs()) } else { (y.abs(), x.abs()) };
    let t = if high > 0.0 { low / high } else { 0.0 };
    // Odd polynomial on 0…1, Hastings (1955).
    let s = t * t;
    let first = t * (0.995_354 + s * (-0.288_679 + s * 0.079_331));
    let half = if steep { PI / 2.0 - first } else { first };
    let whole = if x < 0.0 { PI - half } else { half };
    if y < 0.0 { -whole } else { whole }
}

/// A length against a scale, from 0 to 1.
#[inline(always)]
fn share(x_m: f64, scale_m: f64) -> f64 {
    x_m / (x_m + scale_m)
}

/// How clearly two coordinates lie on opposite sides of zero (to 1) or on the same (to −1).
#[inline(always)]
fn opposite(start_m: f64, end_m: f64, half_m: f64) -> f64 {
    let product = start_m * end_m;
    -product.signum() * share(product.abs().sqrt(), half_m)
}

#[inline(always)]
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

    proptest! {
        #[test]
        fn totals_are_those_of_one_point_after_the_other(
            path in prop::collection::vec((-9.0..9.0, -9.0..9.0), 2..9), long in 0.1..9.0, wide in 0.1..3.0,
        ) {
            let landmark = Footprint::strip((-1.0, 0.0), (long, 2.0), wide);
            let start = Step { at: path[0], walk_m: 0.0 };
            let rest: Vec<Step> =
                path[1..].iter().scan(start, |s, &at| { *s = s.to(at); Some(*s) }).collect();
            let samples = Samples::new(start, &rest, &landmark).unwrap();
            let t = Totals::new(&samples, &landmark);
            let at: Vec<(f64, f64)> = (0..SAMPLES).map(|k| samples.at(k)).collect();
            let turn = |a: (f64, f64), b: (f64, f64)| (a.0 * b.1 - a.1 * b.0).atan2(a.0 * b.0 + a.1 * b.1);
            let round: f64 = at.windows(2).map(|w| turn(w[0], w[1])).sum();
            let moved: Vec<_> = at.windows(2).map(|w| difference(w[1], w[0])).collect();
            let turned: f64 = moved.windows(2).map(|w| turn(w[0], w[1]).abs()).sum();
            prop_assert!((t.round_rad - round).abs() < 0.01, "{} {round}", t.round_rad);
            prop_assert!((t.turned_rad - turned).abs() < 0.06, "{} {turned}", t.turned_rad);
            let gaps_m = || at.iter().map(|p| landmark.signed_distance_m(*p).max(0.0));
            prop_assert!((t.gap_mean_m * SAMPLES as f64 - gaps_m().sum::<f64>()).abs() < 1e-9);
            prop_assert!((t.gap_min_m - gaps_m().fold(f64::INFINITY, f64::min)).abs() < 1e-12);
            let inside = gaps_m().filter(|m| *m <= 0.0).count() as f64;
            prop_assert!((t.inside * SAMPLES as f64 - inside).abs() < 1e-9);
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
