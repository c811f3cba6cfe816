//! What sentences tell: `p(name | h) = (1 − ε) [the place bears that name] + ε / vocabulary`.

use super::super::geom::apply;
use super::{Claim, Hypothesis, Seen};

/// For each sentence, when it was said and `log p(name | h) − log p(name | truth)`.
pub(super) fn ratios(seen: &Seen<'_>, hypothesis: &Hypothesis) -> Vec<(f64, f64)> {
    let truth = Hypothesis::default();
    let ratio = |c: &Claim| (c.said_s, log_p(seen, c, hypothesis) - log_p(seen, c, &truth));
    seen.said.iter().map(ratio).collect()
}

fn log_p(seen: &Seen<'_>, claim: &Claim, hypothesis: &Hypothesis) -> f64 {
    let at = apply(&hypothesis.world_from_true(claim.said_s), claim.at);
    let matches = seen.world.rooms.iter().any(|r| r.name == claim.name && r.area.contains(at, 0.0));
    let by_chance = seen.epsilon / seen.vocabulary.max(1) as f64;
    let p = if matches { 1.0 - seen.epsilon } else { 0.0 } + by_chance;
    // Without false sentences, one that does not match is as good as impossible.
    p.max(f64::MIN_POSITIVE).ln()
}
