//! The paper's own grounding, as its notes have it: the baseline of every comparison.

use crate::language::grounding::place::GroundPlace;
use crate::language::relation::Relation;

/// Scale of σ(−d / 30 m), which "near" was.
const SCALE_M: f64 = 30.0;

/// Δα of the figure at every place, eqs. (13–16) over one landmark vertex: σ(−d / 30 m), and for "away
/// from" σ(d / 30 m), normalised over all places seen but the landmark. None for an unknown landmark.
pub fn ground_by_paper(relation: Relation, places: &[GroundPlace], landmark: Option<usize>) -> Vec<f64> {
    let Some(landmark) = landmark else { return vec![0.0; places.len()] };
    let at = places[landmark];
    let sign = if relation == Relation::AwayFrom { 1.0 } else { -1.0 };
    let mut p: Vec<f64> = places
        .iter()
        .map(|q| (q.x_m - at.x_m).hypot(q.y_m - at.y_m))
        .map(|d_m| 1.0 / (1.0 + (-sign * d_m / SCALE_M).exp()))
        .collect();
    p[landmark] = 0.0;
    let z = p.iter().sum::<f64>().max(f64::MIN_POSITIVE);
    p.into_iter().map(|p| p / z).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn near_smears_as_the_paper_says() {
        let places: Vec<GroundPlace> =
            [0.0, 10.0, 30.0].map(|x_m| GroundPlace { x_m, y_m: 0.0, yaw_rad: 0.0, path_m: x_m }).to_vec();
        let p = ground_by_paper(Relation::Near, &places, Some(0));
        assert!((p[1] / p[2] - 0.4174 / 0.2689).abs() < 1e-3, "{p:?}");
        assert!((p.iter().sum::<f64>() - 1.0).abs() < 1e-12);
        let p = ground_by_paper(Relation::AwayFrom, &places, Some(0));
        assert!(p[2] > p[1]);
    }
}
