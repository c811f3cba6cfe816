//! The measurements z of a step: each proposed pair matched once, for all particles.
//!
//! A pair that nobody has followed yet is matched without any prior. A fit that is found is
//! *followed*: the front end says where the next place should lie on the old part of the path, and
//! registration there agrees or not. Only fits with the agreement of at least [`SUPPORT_MIN`]
//! places over [`SUPPORT_PATH_M`] count as evidence: look-alikes rarely continue alike.

use crate::edge::{EdgeKind, Proposal, Vertex};
use crate::geometry::Pose2;
use crate::graph::{Graph, Matched};
use crate::scan::correlate::Source;
use crate::scan::matching::{Mode, index, modes, plausible, refine};
use crate::track::front::LOCAL_PATH_M;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Fits below are no fits.
pub const SCORE_MIN: f64 = 0.75;
/// Share of the points that both places must see.
const OVERLAP_MIN: f64 = 0.25;
/// Fits less certain than this in some direction are free along it, as in a bare corridor, and lie
/// anywhere there.
const FIT_SIGMA_MAX_M: f64 = 0.12;
/// Places that must agree before a loop counts …
pub const SUPPORT_MIN: u32 = 3;
/// … over so much path.
const SUPPORT_PATH_M: f64 = 5.0;
/// Path between the places asked for agreement.
const SUPPORT_STEP_M: f64 = 2.5;
/// How far along the old path the match for the next place is looked for.
pub const FOLLOW_REACH_M: f64 = 6.0;
/// A followed place must lie so near to a place of the old path.
const FOLLOW_NEAR_M: f64 = 3.0;
/// Fits so near to what the front end predicts agree with it.
pub const AGREE_M: f64 = 0.3;
/// The same for headings.
pub const AGREE_RAD: f64 = 0.06;
/// A map has a place where a fit has it within so much.
const COVERED_M: f64 = 1.0;
const COVERED_RAD: f64 = 0.17;
/// Fits followed at a time.
const FOLLOWED_MAX: usize = 12;
/// Fits without enough support that are looked into at a time, the best first.
const UNSUPPORTED_AT_ONCE: usize = 4;
/// Pairs matched at a time …
const MATCHED_AT_ONCE: usize = 2;
/// … and for one place: particles that differ may propose many.
const MATCHED_MAX: usize = 8;
/// A fit that finds no support over so many places is dropped.
const UNSUPPORTED_MAX: u32 = 8;

/// A fit between the newest place and an older one.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Fit {
    /// The older place.
    pub i: Vertex,
    /// The measurement.
    pub mode: Mode,
    /// How this edge was proposed.
    pub kind: EdgeKind,
    /// The pair (older, newer) whose names led to the revisit, if any did.
    pub named: Option<(Vertex, Vertex)>,
    /// Places that agree with it, itself included.
    pub support: u32,
    /// Path over which they agree, metres.
    pub support_path_m: f64,
    /// Places since it was first found.
    age: u32,
}

impl Fit {
    /// A fit that `support` places agree with, a metre apart, and that no names led to.
    pub fn supported_by(i: Vertex, mode: Mode, kind: EdgeKind, support: u32) -> Self {
        Self { i, mode, kind, named: None, support, support_path_m: f64::from(support), age: 0 }
    }

    /// Whether enough places agree for it to count.
    pub fn supported(&self) -> bool {
        self.support >= SUPPORT_MIN && self.support_path_m >= SUPPORT_PATH_M
    }

    /// Kind of the next edge of the same revisit. Of one that words proposed the first edge is a semantic
    /// one, at the pair that was named or where enough places agree; what follows is near by then.
    fn kind_of_next(&self) -> EdgeKind {
        match self.named {
            Some(_) if self.supported() => EdgeKind::Distance,
            Some(_) => EdgeKind::Semantic,
            None => self.kind,
        }
    }

    fn quality(&self) -> f64 {
        self.mode.score * self.mode.overlap
    }
}

/// A pair that was looked at and did not fit, and why.
#[derive(Clone, Debug, PartialEq)]
pub struct Refusal {
    /// The older place.
    pub i: Vertex,
    /// How it was proposed.
    pub kind: EdgeKind,
    /// Why.
    pub reason: String,
}

/// All measurements of a step.
#[derive(Clone, Debug, Default)]
pub struct Measured {
    /// Supported fits, one per revisit.
    pub fits: Vec<Fit>,
    /// Older places that were looked at, each with the ways in which it looks like this one.
    pub looked: Vec<(Vertex, Vec<Pose2>)>,
    /// What did not fit.
    pub refused: Vec<Refusal>,
}

/// Fits being followed from place to place.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct Loops {
    followed: Vec<Fit>,
}

/// A pair to register from a guess.
struct Lead {
    i: Vertex,
    guess: Pose2,
    from: Fit,
}

impl Loops {
    /// Whether an older place lies on a stretch that is being followed to place `t`, in a map that has both as
    /// the fit does: where a map does not, the next identical door may be the one.
    pub fn covers(&self, graph: &Graph, i: Vertex, t: Vertex, pose: impl Fn(Vertex) -> Pose2) -> bool {
        let Some(before) = t.checked_sub(1) else { return false };
        let moved = graph.chained(before, t);
        let is_there = |f: &Fit| {
            let off = pose(f.i).compose(&f.mode.i_from_j).compose(&moved).between(&pose(t));
            off.x_m.hypot(off.y_m) < COVERED_M && off.yaw_rad.abs() < COVERED_RAD
        };
        self.followed.iter().any(|f| !graph.apart(f.i, i, FOLLOW_REACH_M) && is_there(f))
    }

    /// Matches place `t` with the proposed places and along what is being followed.
    pub fn measure(&mut self, graph: &mut Graph, t: Vertex, proposals: &[Proposal]) -> Measured {
        let mut measured = Measured::default();
        let leads: Vec<Lead> = self.followed.iter().filter_map(|f| lead(graph, f, t)).collect();
        let found: Vec<Option<Fit>> = leads.par_iter().map(|l| follow(graph, t, l)).collect();
        let seen = |(l, f): (&Lead, &Option<Fit>)| (l.i, f.iter().map(|f| f.mode.i_from_j).collect());
        measured.looked.extend(leads.iter().zip(&found).map(seen));
        let mut fits: Vec<Fit> = found.into_iter().flatten().collect();
        fits.extend(matched(graph, t, proposals, &mut measured));
        let mut fits = supported(graph, t, fits, &mut measured);
        fits.retain(|f| f.supported() || f.age < UNSUPPORTED_MAX);
        // Looking back has changed who is supported.
        fits.sort_by_key(|f| std::cmp::Reverse((f.supported(), f.support)));
        fits.truncate(FOLLOWED_MAX);
        measured.fits = fits.iter().filter(|f| f.supported()).cloned().collect();
        self.followed = fits;
        measured
    }
}

/// Matches a place left long ago with older ones; the places around it have been seen by now.
pub fn measure_again(graph: &mut Graph, t: Vertex, proposals: &[Proposal]) -> Measured {
    let mut measured = Measured::default();
    let fits = matched(graph, t, proposals, &mut measured);
    let mut fits = supported(graph, t, fits, &mut measured);
    fits.retain(Fit::supported);
    measured.fits = fits;
    measured
}

/// Good fits of place `t` with those proposed.
fn matched(graph: &mut Graph, t: Vertex, proposals: &[Proposal], measured: &mut Measured) -> Vec<Fit> {
    match_new(graph, t, proposals);
    let mut fits = Vec::new();
    for p in proposals {
        // What is not matched now is proposed again from the next place, a metre on.
        let Some(Matched { modes: found }) = graph.memo.get(&(p.i, t)) else { continue };
        let alike = found.iter().filter(|m| looks_alike(m)).map(|m| m.i_from_j).collect();
        measured.looked.push((p.i, alike));
        measured.refused.extend(refusal(p, t, found));
        let named = (p.kind == EdgeKind::Semantic).then_some((p.i, t));
        let fit =
            |m: &Mode| Fit { i: p.i, mode: *m, kind: p.kind, named, support: 1, support_path_m: 0.0, age: 0 };
        fits.extend(found.iter().filter(|m| good(m)).map(fit));
    }
    fits
}

/// One fit per revisit, the best supported first, once the places around `t` were asked. Few of those
/// without support are kept.
fn supported(graph: &Graph, t: Vertex, fits: Vec<Fit>, measured: &mut Measured) -> Vec<Fit> {
    let mut fits = distinct(graph, fits);
    let mut unsupported = 0;
    fits.retain(|f| {
        unsupported += usize::from(!f.supported());
        f.supported() || unsupported <= UNSUPPORTED_AT_ONCE
    });
    fits.par_iter_mut().filter(|f| !f.supported()).for_each(|f| look_around(graph, t, f));
    measured.refused.extend(fits.iter().filter(|f| !f.supported()).map(|f| Refusal {
        i: f.i,
        kind: f.kind,
        reason: format!(
            "edge {t}–{} refused: {} places over {:.1} m agree, {SUPPORT_MIN} over {SUPPORT_PATH_M} needed",
            f.i, f.support, f.support_path_m
        ),
    }));
    fits
}

fn good(mode: &Mode) -> bool {
    looks_alike(mode) && sigma_max_m(mode) <= FIT_SIGMA_MAX_M
}

fn looks_alike(mode: &Mode) -> bool {
    mode.score >= SCORE_MIN && mode.overlap >= OVERLAP_MIN
}

/// Standard deviation of the translation in its least certain direction.
fn sigma_max_m(mode: &Mode) -> f64 {
    mode.covariance.fixed_view::<2, 2>(0, 0).into_owned().symmetric_eigenvalues().max().sqrt()
}

fn refusal(p: &Proposal, t: Vertex, found: &[Mode]) -> Option<Refusal> {
    if found.iter().any(good) {
        return None;
    }
    let reason = match found.first() {
        None => format!("edge {t}–{} refused: no transform lays one on the other", p.i),
        Some(m) if m.score < SCORE_MIN => {
            format!("edge {t}–{} refused: score {:.2} < {SCORE_MIN}", p.i, m.score)
        }
        Some(m) if m.overlap < OVERLAP_MIN => {
            format!("edge {t}–{} refused: overlap {:.2} < {OVERLAP_MIN}", p.i, m.overlap)
        }
        Some(m) => {
            format!("edge {t}–{} refused: free along {:.2} m > {FIT_SIGMA_MAX_M} m", p.i, sigma_max_m(m))
        }
    };
    Some(Refusal { i: p.i, kind: p.kind, reason })
}

/// Matches the pairs that the memo does not know, some at a time, the likeliest first, until one looks alike:
/// the others mostly show the same revisit. Words are said once: their pairs come first, and no fit ends
/// them.
fn match_new(graph: &mut Graph, t: Vertex, proposals: &[Proposal]) {
    let mut new: Vec<&Proposal> = proposals.iter().filter(|p| !graph.memo.contains_key(&(p.i, t))).collect();
    if new.is_empty() {
        return;
    }
    let said = |p: &Proposal| p.kind == EdgeKind::Semantic;
    new.sort_by(|a, b| said(b).cmp(&said(a)).then(b.probability.total_cmp(&a.probability)));
    new.truncate(MATCHED_MAX);
    let source = Source::new(&graph.place(t).content.sample);
    let mut fitted = false;
    for some in new.chunks(MATCHED_AT_ONCE) {
        if fitted && !some.iter().any(|p| said(p)) {
            break;
        }
        let here = &graph.place(t).content;
        let found: Vec<(Vertex, Matched)> = some
            .par_iter()
            .map(|p| (p.i, Matched { modes: modes(&graph.place(p.i).content, here, &source) }))
            .collect();
        fitted |= found.iter().any(|(_, m)| m.modes.iter().any(looks_alike));
        graph.memo.extend(found.into_iter().map(|(i, m)| ((i, t), m)));
    }
}

/// Where a place `b`, `guess` in the frame of `i`, lies on the old path around `i`: the nearest
/// place there and the guess in its frame.
fn nearest_on_path(graph: &Graph, i: Vertex, guess: &Pose2, b: Vertex) -> Option<(Vertex, Pose2)> {
    graph
        .along(i, FOLLOW_REACH_M)
        .filter(|&k| graph.apart(k, b, LOCAL_PATH_M))
        .map(|k| (k, graph.chained(k, i).compose(guess)))
        .min_by(|a, b| a.1.x_m.hypot(a.1.y_m).total_cmp(&b.1.x_m.hypot(b.1.y_m)))
        .filter(|(_, g)| g.x_m.hypot(g.y_m) < FOLLOW_NEAR_M)
}

/// Where a fit of the place before leads place `t`.
fn lead(graph: &Graph, fit: &Fit, t: Vertex) -> Option<Lead> {
    if graph.place(t).chain.broken {
        return None;
    }
    let guess = fit.mode.i_from_j.compose(&graph.chained(t - 1, t));
    let (i, guess) = nearest_on_path(graph, fit.i, &guess, t)?;
    Some(Lead { i, guess, from: fit.clone() })
}

fn follow(graph: &Graph, t: Vertex, lead: &Lead) -> Option<Fit> {
    let mode = agreeing(graph, lead.i, t, &lead.guess)?;
    let step_m = (graph.place(t).path_m - graph.place(t - 1).path_m).abs();
    Some(Fit {
        i: lead.i,
        mode,
        kind: lead.from.kind_of_next(),
        named: lead.from.named,
        support: lead.from.support + 1,
        support_path_m: lead.from.support_path_m + step_m,
        age: lead.from.age + 1,
    })
}

/// The mode near a guess, if there is a good one that agrees with it.
fn agreeing(graph: &Graph, i: Vertex, j: Vertex, guess: &Pose2) -> Option<Mode> {
    let (older, newer) = (&graph.place(i).content, &graph.place(j).content);
    if !plausible(older, newer, guess) {
        return None;
    }
    let mode = refine(older, &index(older), newer, guess)?;
    (good(&mode) && agree(guess, &mode.i_from_j, 1.0)).then_some(mode)
}

/// Whether two transforms are one within `times` what registration may err by.
pub fn agree(a: &Pose2, b: &Pose2, times: f64) -> bool {
    let off = a.between(b);
    off.x_m.hypot(off.y_m) < times * AGREE_M && off.yaw_rad.abs() < times * AGREE_RAD
}

/// Asks the places before `t`, and if it was left long ago those after it, whether they agree with a fit
/// of `t`.
fn look_around(graph: &Graph, t: Vertex, fit: &mut Fit) {
    let path_m = |v| graph.place(v).path_m;
    let (mut support, mut support_path_m) = (1, 0.0);
    for side in [-1.0, 1.0] {
        let mut agreed_m = 0.0;
        for step in 1..SUPPORT_MIN {
            let away_m = f64::from(step) * SUPPORT_STEP_M;
            let on_side_m = |b: Vertex| side * (path_m(b) - path_m(t));
            let on_side = graph.along(t, away_m + 2.0 * SUPPORT_STEP_M).filter(|&b| on_side_m(b) >= away_m);
            let Some(b) = on_side.min_by(|&a, &b| on_side_m(a).total_cmp(&on_side_m(b))) else { break };
            let guess = fit.mode.i_from_j.compose(&graph.chained(t, b));
            let Some((i, guess)) = nearest_on_path(graph, fit.i, &guess, b) else { break };
            if agreeing(graph, i, b, &guess).is_none() {
                break;
            }
            support += 1;
            agreed_m = on_side_m(b);
        }
        support_path_m += agreed_m;
    }
    fit.support = fit.support.max(support);
    fit.support_path_m = fit.support_path_m.max(support_path_m);
}

/// One fit per revisit: of those that say the same the best supported, then the best. Where words
/// tie a pair of the revisit, that pair becomes the edge.
fn distinct(graph: &Graph, mut fits: Vec<Fit>) -> Vec<Fit> {
    fits.sort_by(|a, b| {
        let rank = |f: &Fit| (f.supported(), f.support);
        rank(b).cmp(&rank(a)).then(b.quality().total_cmp(&a.quality())).then(a.i.cmp(&b.i))
    });
    let mut kept: BTreeMap<usize, Fit> = BTreeMap::new();
    for f in fits {
        let same = |k: &&mut Fit| {
            !graph.apart(k.i, f.i, 2.0 * FOLLOW_REACH_M) && {
                let seen_from_k = graph.chained(k.i, f.i).compose(&f.mode.i_from_j);
                agree(&k.mode.i_from_j, &seen_from_k, 2.0)
            }
        };
        match kept.values_mut().find(same) {
            Some(k) if f.kind == EdgeKind::Semantic && k.kind != EdgeKind::Semantic => {
                (k.i, k.mode, k.kind, k.named) = (f.i, f.mode, f.kind, f.named);
            }
            Some(_) => {}
            None => {
                kept.insert(kept.len(), f);
            }
        }
    }
    kept.into_values().collect()
}

#[cfg(test)]
pub(crate) mod tests;
