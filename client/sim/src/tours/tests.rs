//! Tours as a whole.

use super::strain::{calibrated, strain};
use super::*;
use crate::geom::between;
use crate::{Draw, Wheels};

/// Chances of the hypotheses at a tour's returns for an observer without words who knows the
/// world, and the wheels as far as the laser let them be known: the truth's, then the greatest.
fn observed(tour: &Tour, noise: u64) -> (f64, f64) {
    let mut draw = Draw::new(noise, 77);
    let prior = &tour.wheels_prior;
    let known = calibrated(&tour.drive, &tour.blind_s, prior);
    let [a, b, c] = known.turn_bias;
    let (u, v) = (draw.normal(), draw.normal());
    let wheels = Wheels {
        scale_error: known.scale * draw.normal(),
        turn_error: a * u,
        yaw_bias_rad_per_m: b * u + c * v,
        noise_m: prior.noise_m,
        yaw_noise_rad: prior.yaw_noise_rad,
        turn_noise_rad: prior.turn_noise_rad,
    };
    let measured = tour.drive.measured(&wheels, &mut draw);
    let mut logs = vec![0.0; tour.hypotheses.len()];
    for &(from_s, to_s) in tour.blind_s.iter().filter(|s| design::is_crossing(&tour.drive, **s)) {
        for (log, h) in logs.iter_mut().zip(&tour.hypotheses) {
            let before = h.at(from_s - 0.1, &tour.drive.at(from_s));
            let end = between(&before, &h.at(to_s, &tour.drive.at(to_s)));
            *log -= strain(&measured, &tour.blind_s, (from_s, to_s), &end, prior).powi(2) / 2.0;
        }
    }
    let top = logs.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let sum: f64 = logs.iter().map(|l| (l - top).exp()).sum();
    ((logs[0] - top).exp() / sum, 1.0 / sum)
}

#[test]
fn survey() {
    for name in [
        "small",
        "large",
        "autonomous",
        "twins",
        "twins-decided",
        "ring",
        "ring-decided",
        "rows",
        "rows-decided",
    ] {
        let (mut truth, mut best) = (Vec::new(), Vec::new());
        let mut early = 0;
        let mut path = Vec::new();
        let mut margin: Vec<f64> = Vec::new();
        let mut rough = Vec::new();
        for seed in 0..10 {
            let tour = tour(name, seed).unwrap();
            let (t, b) = observed(&tour, seed);
            truth.push(t);
            best.push(b);
            path.push(tour.drive.path_m());
            rough.push(tour.wheels_prior.yaw_noise_rad.to_degrees());
            let refuted: Vec<_> = tour.hypotheses[1..]
                .iter()
                .filter_map(|h| tour.refuted_s(h).map(|s| s - h.pieces[0].from_s))
                .collect();
            if let Some(d) = tour.decisive_s {
                margin.push(refuted.iter().copied().fold(d, f64::min));
            } else {
                early += refuted.len();
            }
        }
        let between = best.iter().filter(|b| (0.3..0.8).contains(*b)).count();
        truth.sort_by(f64::total_cmp);
        path.sort_by(f64::total_cmp);
        rough.sort_by(f64::total_cmp);
        margin.sort_by(f64::total_cmp);
        eprintln!(
            "{name}: truth median {:.2} best in .3-.8 {between}/10; refuted early {early}; path {:.0}..{:.0}..{:.0}; rough median {:.2} min {:.2}; decided {} first refutation after {:?} s",
            truth[15],
            path[0],
            path[15],
            path[29],
            rough[15],
            rough[0],
            margin.len(),
            margin.first()
        );
    }
}
