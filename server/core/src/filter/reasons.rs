//! What a step tells of its edges, with the figures behind it.

use crate::edge::Vertex;
use crate::effects::{Effect, Effects};
use crate::filter::loops::{Fit, Measured};
use crate::filter::weigh::Judgement;

/// What became of a fit of place `t`: `weight` of the posterior is there.
pub(super) fn report(t: Vertex, fit: &Fit, weight: f64, best: Option<&Judgement>) -> Effect {
    let (log_there, distance) = best.map_or((f64::NAN, f64::NAN), |j| (j.log_there, j.distance2.sqrt()));
    let figures = format!(
        "score {:.2}, overlap {:.2}, {} places over {:.0} m agree, {distance:.1} σ from prediction, \
         log odds {log_there:.1}",
        fit.mode.score, fit.mode.overlap, fit.support, fit.support_path_m
    );
    let (i, j, kind) = (fit.i.into(), t.into(), fit.kind);
    if weight > 0.0 {
        Effect::EdgeAccepted { i, j, kind, weight, reason: format!("edge {t}–{i} taken: {figures}") }
    } else {
        Effect::EdgeRefused { i, j, kind, reason: format!("edge {t}–{i} refused by all: {figures}") }
    }
}

/// What was looked at and did not fit.
pub(super) fn refusals(t: Vertex, measured: &Measured) -> Effects {
    measured
        .refused
        .iter()
        .map(|r| Effect::EdgeRefused { i: r.i.into(), j: t.into(), kind: r.kind, reason: r.reason.clone() })
        .collect()
}
