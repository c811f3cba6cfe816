//! What sentences tell: `p(name | h) = (1 − ε) [the place bears that name] + ε / vocabulary`.

use super::{Claim, Hypothesis, Seen, truth};
use toponym_proto::Pose;

/// For each sentence, when it was said and `log p(name | h) − log p(name | truth)`.
pub(super) fn ratios(seen: &Seen<'_>, hypothesis: &Hypothesis) -> Vec<(f64, f64)> {
    let truth = truth();
    let claims = seen.said.iter().filter_map(|s| Some((s.sentence.began_s, s.claim.as_ref()?)));
    let ratio = |(said_s, claim): (f64, &Claim)| {
        (said_s, log_p(seen, said_s, claim, hypothesis) - log_p(seen, said_s, claim, &truth))
    };
    claims.map(ratio).collect()
}

fn log_p(seen: &Seen<'_>, said_s: f64, claim: &Claim, hypothesis: &Hypothesis) -> f64 {
    // Who holds the robot to be elsewhere holds the room that it was told of to be so, too.
    let meant = Pose { x_m: claim.at[0], y_m: claim.at[1], yaw_rad: 0.0 };
    let meant = hypothesis.at(said_s, &meant);
    let bears = |name: &str| {
        let rooms = seen.world.rooms.iter().filter(|r| r.name == name);
        rooms.into_iter().any(|r| r.area.contains([meant.x_m, meant.y_m], 0.0))
    };
    let by_chance = seen.epsilon / seen.vocabulary.max(1) as f64;
    let p = if bears(&claim.name) { 1.0 - seen.epsilon } else { 0.0 } + by_chance;
    // Without false sentences, one that does not match is as good as impossible.
    p.max(f64::MIN_POSITIVE).ln()
}
