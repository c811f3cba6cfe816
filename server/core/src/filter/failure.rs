//! Stretches of the chain that failed: the front end lost its way there and says otherwise.
//!
//! A fit z between places i and t that no held chain explains may be one across a stretch s, i < s ≤ t, that
//! failed. Then the two ends of s lie to each other, in closed form,
//!
//! ```text
//! T* = (x_{s−1}⁻¹ x_i) · z · (x_t⁻¹ x_s),    δ = z_s⁻¹ T*
//! w_failed / w_elsewhere = φ_s f_s(δ) · p_D / λ_c(z)
//! ```
//!
//! with z_s what the chain says, φ_s the probability that it fails, and f_s where the robot is then: wheels
//! slipped along the way, it turned unseen, or it is anywhere near. A wide Gaussian would not do: half a turn
//! is not linear. Which stretch it was hardly matters to the map: their weights are summed, and the likeliest
//! one is let go. A start after a break is the same with φ = 1, see [`crate::filter::weigh`].

use crate::edge::Vertex;
use crate::filter::chance::log_add;
use crate::filter::particle::{Edge, LetGo, Particle};
use crate::geometry::Pose2;
use crate::graph::Graph;
use std::f64::consts::TAU;

/// Fits across longer stretches of places are not explained by failures.
const PLACES_MAX: u32 = 400;
/// Shares of failures by kind, and their spreads: along the way, by a turn, and anywhere.
const SLIPPED: (f64, [f64; 3]) = (0.4, [1.5, 0.2, 0.15]);
const TURNED: (f64, [f64; 2]) = (0.4, [0.4, 0.4]);
const ANYWHERE: f64 = 0.2;
const ANYWHERE_M2: f64 = 400.0;

/// log Σ_s φ_s f_s(δ_s) of an edge that the particle's chain does not explain, in m⁻² rad⁻¹, and the
/// likeliest stretch.
pub fn log_failed(graph: &Graph, particle: &Particle, edge: &Edge) -> Option<(f64, LetGo)> {
    let pose = |v: Vertex| particle.belief.pose(v);
    let first = edge.i.max(edge.j.saturating_sub(PLACES_MAX)) + 1;
    let tied = tied(particle, first, edge.j);
    let there = pose(edge.i).compose(&edge.i_from_j).compose(&pose(edge.j).inverse());
    let (mut sum, mut best): (f64, Option<(f64, Vertex)>) = (f64::NEG_INFINITY, None);
    for s in (first..=edge.j).filter(|s| !tied[(s - first) as usize]) {
        let chain = &graph.place(s).chain;
        let needed = pose(s - 1).between(&there.compose(&pose(s)));
        let log =
            chain.failed.max(f64::MIN_POSITIVE).ln() + log_f(&chain.previous_from_this.between(&needed));
        sum = log_add(sum, log);
        if best.is_none_or(|(most, _)| log > most) {
            best = Some((log, s));
        }
    }
    best.map(|(_, from)| (sum, LetGo { from, moved: there }))
}

/// Which stretches from `first` to `last` an edge spans, that says as the chain does how its ends lie: those are
/// in order.
fn tied(particle: &Particle, first: Vertex, last: Vertex) -> Vec<bool> {
    let mut spans = vec![0i32; (last + 1 - first) as usize];
    for e in particle.edges.iter().filter(|e| (first..last).contains(&e.j)) {
        spans[(e.i + 1).saturating_sub(first) as usize] += 1;
        spans[(e.j + 1 - first) as usize] -= 1;
    }
    let mut sum = 0;
    let running = spans.iter().map(|change| {
        sum += change;
        sum > 0
    });
    running.collect()
}

/// log f(δ), m⁻² rad⁻¹.
fn log_f(off: &Pose2) -> f64 {
    let normal = |x: f64, sigma: f64| -0.5 * (x / sigma).powi(2) - (sigma * TAU.sqrt()).ln();
    let (share, [along, across, turn]) = SLIPPED;
    let slipped = share.ln() + normal(off.x_m, along) + normal(off.y_m, across) + normal(off.yaw_rad, turn);
    let (share, [x, y]) = TURNED;
    let turned = share.ln() + normal(off.x_m, x) + normal(off.y_m, y) - TAU.ln();
    let near = off.x_m.abs().max(off.y_m.abs()) < 0.5 * ANYWHERE_M2.sqrt();
    let anywhere = if near { (ANYWHERE / (ANYWHERE_M2 * TAU)).ln() } else { f64::NEG_INFINITY };
    log_add(log_add(slipped, turned), anywhere)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::edge::{EdgeKind, QuestionId};
    use nalgebra::Matrix3;

    #[test]
    fn what_an_edge_spans_is_in_order() {
        let mut particle = Particle::empty();
        let edge = |i, j| Edge {
            i,
            j,
            kind: EdgeKind::Distance,
            i_from_j: Pose2::default(),
            covariance: Matrix3::identity(),
            question: QuestionId::default(),
            log_looks: 0.0,
            factor: 0,
        };
        particle.add(edge(3, 8));
        particle.add(edge(6, 10));
        particle.add(edge(1, 20));
        let tied = tied(&particle, 2, 12);
        let expected: Vec<bool> = (2..=12).map(|s| (4..=10).contains(&s)).collect();
        assert_eq!(tied, expected, "an edge of later says nothing yet");
    }

    #[test]
    fn where_a_robot_is_that_lost_its_way_is_a_density() {
        let mut mass = 0.0;
        let (cell_m, cell_rad) = (0.2, TAU / 64.0);
        for a in -120..=120 {
            for b in -120..=120 {
                for c in 0..64 {
                    let off = Pose2::new(
                        f64::from(a) * cell_m,
                        f64::from(b) * cell_m,
                        crate::geometry::wrap(f64::from(c) * cell_rad),
                    );
                    mass += log_f(&off).exp() * cell_m * cell_m * cell_rad;
                }
            }
        }
        assert!((mass - 1.0).abs() < 0.03, "{mass}");
    }
}
