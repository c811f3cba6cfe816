//! How often the truth lies in the 95 % region of the front end's increments.

use crate::drive::Drive;
use nalgebra::{Matrix3, Vector3};
use toponym_core::Pose2;

/// Places from one end of an increment to the other.
const SPANS: [usize; 3] = [1, 5, 10];
/// Of χ² with three degrees of freedom.
const CHI2_95: f64 = 7.815;
const CHI2_MEDIAN: f64 = 2.366;

/// One line per drive.
pub fn report(drive: &Drive) {
    let spans: Vec<String> = SPANS.iter().filter_map(|&span| covered(drive, span)).collect();
    println!("{}: {}", drive.name, spans.join("; "));
}

/// The share covered, the median distance² over what it should be, and the errors of x, y, yaw, root mean
/// square, as multiples of their standard deviations.
fn covered(drive: &Drive, span: usize) -> Option<String> {
    let (mut squares, mut distances2) = (Vector3::zeros(), Vec::new());
    for (from, chain) in drive.graph.places().windows(span + 1).enumerate() {
        let (mut made, mut covariance) = (Pose2::default(), Matrix3::zeros());
        for place in &chain[1..] {
            let step = &place.chain.previous_from_this;
            let f = step.inverse().adjoint();
            covariance = f * covariance * f.transpose() + place.chain.information.try_inverse()?;
            made = made.compose(step);
        }
        if chain[1..].iter().any(|p| p.chain.broken) {
            continue;
        }
        let truth = drive.truth[from].between(&drive.truth[from + span]);
        let off = truth.between(&made).log();
        distances2.push(off.dot(&(covariance.try_inverse()? * off)));
        squares += off.component_mul(&off).component_div(&covariance.diagonal());
    }
    distances2.sort_by(f64::total_cmp);
    let n = distances2.len() as f64;
    let share = distances2.iter().filter(|d| **d < CHI2_95).count() as f64 / n;
    let median = distances2.get(distances2.len() / 2)? / CHI2_MEDIAN;
    let of_sigma = (squares / n).map(f64::sqrt);
    Some(format!(
        "{span} places {share:.3} covered, median {median:.2}, errors {:.2} {:.2} {:.2} σ",
        of_sigma.x, of_sigma.y, of_sigma.z
    ))
}
