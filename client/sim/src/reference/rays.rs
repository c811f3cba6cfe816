//! What the laser's scans in the light tell.
//!
//! Per ray with the measured range z and the range e that the walls would have under a hypothesis,
//!
//! ```text
//! log p = log(exp(−(z − e)²/(2σ²)) + MISMATCH)   both seen, relative to the Gaussian's peak
//!       = 0                                      both nothing seen
//!       = log MISMATCH                           one seen, the other not
//! ```
//!
//! The truth's e is computed by the simulator's own laser, and so is the hypothesis', from the
//! moved pose: mountings, posts, dark walls and glass are in both. Rays without information, and
//! those that something in front of the true wall sends back (legs), say the same under all.

use super::super::body::STEP_S;
use super::super::{Draw, Drive, LaserModel, People, Scene};
use super::{HAIR_S, Hypothesis, Seen, pose};
use toponym_proto::{Message, Scan};

/// Share of the rays that anything may have sent back, e⁻¹²: people who stand there under one
/// hypothesis only, edges that a ray just misses. It bounds what a single ray can say.
const MISMATCH: f64 = 6.144e-6;
/// A range shorter than the wall by more than this many standard deviations is no wall's.
const LEG_SIGMAS: f64 = 5.0;

/// For each scan in use, when it was taken and `log p(scan | h) − log p(scan | truth)`.
pub(super) fn ratios(seen: &Seen<'_>, hypothesis: &Hypothesis) -> Vec<(f64, f64)> {
    let Some(first) = hypothesis.pieces.first() else { return Vec::new() };
    let moved = moved(seen.drive, hypothesis);
    let mut ratios = Vec::new();
    for laser in seen.lasers {
        for (t_s, scan) in used(seen, laser) {
            if t_s + HAIR_S >= first.from_s {
                ratios.push((t_s, ratio(seen, laser, scan, t_s, &moved)));
            }
        }
    }
    ratios
}

/// The drive that the hypothesis believes in.
fn moved(drive: &Drive, hypothesis: &Hypothesis) -> Drive {
    let poses = (0..drive.poses.len()).map(|k| pose(hypothesis, drive, k as f64 * STEP_S)).collect();
    Drive { poses }
}

/// A laser's scans in the light, thinned out.
fn used<'a>(seen: &Seen<'a>, laser: &LaserModel) -> Vec<(f64, &'a Scan)> {
    let mut used: Vec<(f64, &Scan)> = Vec::new();
    for message in seen.stream {
        let Message::Scan(scan) = message else { continue };
        let t_s = scan.header.stamp.seconds();
        let soon = used.last().is_some_and(|(last_s, _)| t_s < last_s + seen.stride_s - HAIR_S);
        let dark = seen.dark.iter().any(|d| d.hides(t_s));
        if scan.laser == laser.mount.id && !soon && !dark {
            used.push((t_s, scan));
        }
    }
    used
}

fn ratio(seen: &Seen<'_>, laser: &LaserModel, scan: &Scan, t_s: f64, moved: &Drive) -> f64 {
    let beams = scan.ranges_m.len();
    let exact = LaserModel { beams: (beams, beams), noise_m: 0.0, dropouts: 0.0, ..laser.clone() };
    let people = People::default();
    let ranges = |drive: &Drive| {
        let scene = Scene { world: seen.world, drive, people: &people };
        exact.sweep(&scene, t_s, &mut Draw::new(0, 0)).ranges_m
    };
    let (truth, believed) = (ranges(seen.drive), ranges(moved));
    let of_ray = |((&z, &truth), &believed): ((&f32, &f32), &f32)| {
        let [z, truth, believed] = [z, truth, believed].map(f64::from);
        // Neither a leg nor NaN; nothing seen is infinitely far.
        let on_wall = z >= truth - LEG_SIGMAS * laser.noise_m;
        if on_wall { log_p(z, believed, laser.noise_m) - log_p(z, truth, laser.noise_m) } else { 0.0 }
    };
    scan.ranges_m.iter().zip(&truth).zip(&believed).map(of_ray).sum()
}

/// Log likelihood of one range, infinite where nothing was seen, relative to the most likely one.
fn log_p(z: f64, expected: f64, noise_m: f64) -> f64 {
    match (z.is_finite(), expected.is_finite()) {
        (false, false) => 0.0,
        (true, true) => {
            // A range has whole millimetres: an exact laser's, too, is only known to these.
            let u = (z - expected) / noise_m.max(1e-3);
            ((-u * u / 2.0).exp() + MISMATCH).ln()
        }
        _ => MISMATCH.ln(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ray_says_no_more_than_its_bound() {
        let seen = [(2.0, 2.0), (2.0, 2.02), (2.0, 9.0), (2.0, f64::INFINITY), (f64::INFINITY, 2.0)];
        let logs = seen.map(|(z, expected)| log_p(z, expected, 0.01));
        let want = [0.0, -2.0, -12.0, -12.0, -12.0];
        for (log, want) in logs.iter().zip(want) {
            assert!((log - want).abs() < 1e-4, "{logs:?}");
        }
        assert!(log_p(f64::INFINITY, f64::INFINITY, 0.01).abs() < 1e-9);
        assert!(log_p(2.0, 2.0004, 0.0) > -0.1, "whole millimetres");
    }
}
