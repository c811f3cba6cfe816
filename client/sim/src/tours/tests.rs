//! Tours as a whole.

use super::*;
use crate::geom::between;

#[test]
fn report() {
    for name in TOURS {
        for seed in 0..4 {
            let began = std::time::Instant::now();
            let tour = tour(name, seed).unwrap();
            let designed = began.elapsed();
            let played = tour.play().unwrap();
            let truth: Vec<_> = tour.hypotheses.iter().map(|h| h.name.as_str()).collect();
            let first = tour.hypotheses.iter().skip(1).map(|h| tour.refuted_s(h)).collect::<Vec<_>>();
            eprintln!(
                "{name} {seed}: {:.0} m {:.0} s, {:?} blind {:?} returns {:?} decisive {:?} {first:?} noise {:.4} words {:?} in {:?}+{:?}",
                played.truth.path_m,
                tour.drive.duration_s(),
                truth,
                tour.blind_s.iter().map(|(a, b)| (b - a).round()).filter(|s| *s > 2.0).collect::<Vec<_>>(),
                tour.returns_s,
                tour.decisive_s,
                tour.wheels_prior.yaw_noise_rad.to_degrees(),
                Language::ALL.map(|l| played.narration[&l].len()),
                designed,
                began.elapsed() - designed
            );
            if seed == 0 {
                for said in &played.narration[&Language::False20] {
                    eprintln!(
                        "   {:.1} {} {}",
                        said.sentence.began_s,
                        said.sentence.text,
                        said.claim.as_ref().unwrap().held
                    );
                }
            }
            let _ = between(&Pose::default(), &Pose::default());
        }
    }
}
