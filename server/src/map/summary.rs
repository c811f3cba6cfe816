//! What `map` tells people when it is done.

use super::{Finished, MapArgs, trajectory};
use std::collections::BTreeMap;
use std::fmt::Write as _;
use toponym_core::answers::differences::sentence;
use toponym_core::answers::query::{GraphAnswer, WhereAnswer};
use toponym_core::edge::EdgeKind;
use toponym_core::effects::{HeardStatus, TrackState};

/// A handful of lines.
pub fn text(args: &MapArgs, done: &Finished) -> String {
    let mut text = String::new();
    let mut line = |what: &str, content: String| {
        // Writing to a string cannot fail.
        let _ = writeln!(text, "{what:<10} {content}");
    };
    let (played, timing, notes) = (&done.played, &done.timing, &done.notes);
    line(
        "log",
        format!(
            "{}: {:.0} s, {} scans, {} odometry rows",
            args.log.display(),
            timing.log_s,
            notes.scans,
            played.row_stamps.len()
        ),
    );
    for (reason, count) in &played.scans_dropped {
        line("dropped", format!("{count} scans: {reason}"));
    }
    line("map", map(done));
    if let Some(ways) = sentence(&done.graph.differences) {
        line("open", ways);
    }
    for (_, _, why) in &played.suspicions {
        line("senses", why.clone());
    }
    if let Some(state) = state(&played.states) {
        line("robot", state);
    }
    if !played.heard.is_empty() {
        let understood = played.heard.iter().filter(|h| h.status == HeardStatus::Understood).count();
        line("sentences", format!("{understood} of {} understood", played.heard.len()));
    }
    let memory = timing.peak_mb.map_or(String::new(), |mb| format!(", {mb:.0} MB"));
    line(
        "time",
        format!(
            "{:.1} s on {} threads, {:.1}× the log's own{memory}",
            timing.wall_s, timing.threads, timing.speed
        ),
    );
    for answer in &done.answers {
        let _ = write!(text, "{}", told(answer));
    }
    for (option, file) in args.outputs() {
        if let Some(file) = file {
            let _ = writeln!(text, "{:<10} {}", option.trim_start_matches("--"), file.display());
        }
    }
    text
}

fn map(done: &Finished) -> String {
    format!(
        "{} places on {:.0} m; loop edges: {}; best of {} graphs, weight {:.2}{}",
        done.graph.places.len(),
        trajectory::path_m(&done.trajectory),
        edges(&done.graph),
        done.graph.particles.len(),
        done.graph.particles.first().map_or(0.0, |p| p.weight),
        dropped(done.graph.unresolved),
    )
}

/// How many loop edges of each kind the best graph has.
pub fn edges(graph: &GraphAnswer) -> String {
    let mut kinds: BTreeMap<EdgeKind, usize> = BTreeMap::new();
    for edge in graph.particles.first().iter().flat_map(|p| &p.edges) {
        *kinds.entry(edge.kind).or_default() += 1;
    }
    let count = |kind| kinds.get(&kind).copied().unwrap_or(0);
    let [distance, semantic] = [EdgeKind::Distance, EdgeKind::Semantic].map(count);
    format!("{distance} distance, {semantic} semantic, {} relocalisation", count(EdgeKind::Relocalisation))
}

/// What to add of graphs that were dropped.
pub fn dropped(unresolved: f64) -> String {
    if unresolved < 0.005 { String::new() } else { format!(", {unresolved:.2} in graphs that were dropped") }
}

/// How well the robot knows where it is in the end, and how often it did not; none if it always did.
fn state(states: &[(i64, TrackState, String)]) -> Option<String> {
    let name = |state| match state {
        TrackState::Mapping => "mapping",
        TrackState::Localised => "localised",
        TrackState::Doubtful => "doubtful",
        TrackState::Lost => "lost",
    };
    let times = |state| states.iter().filter(|s| s.1 == state).count();
    let (doubtful, lost) = (times(TrackState::Doubtful), times(TrackState::Lost));
    let (_, last, why) = states.last().filter(|_| doubtful + lost > 0)?;
    Some(format!("{}: {why}; {doubtful} times doubtful, {lost} times lost", name(*last)))
}

/// A question and its answer, a line per candidate.
pub fn told(answer: &WhereAnswer) -> String {
    const SHOWN: usize = 3;
    let mut text = format!("{}\n", answer.text);
    for c in answer.candidates.iter().take(SHOWN) {
        let _ = writeln!(
            text,
            "  {:>3.0} %  {} at ({:.1} m, {:.1} m)",
            100.0 * c.probability,
            c.label,
            c.pose.x_m,
            c.pose.y_m
        );
    }
    let more = answer.candidates.len().saturating_sub(SHOWN);
    if more > 0 {
        let _ = writeln!(text, "         and {more} more");
    }
    if answer.label.is_none() {
        return text + "         not understood: name a place, or ask where it is\n";
    }
    if !answer.suggestions.is_empty() {
        let _ = writeln!(text, "         unknown; did you mean {}?", answer.suggestions.join(" or "));
    }
    if answer.p_none >= 0.005 || answer.candidates.is_empty() {
        let _ = writeln!(text, "  {:>3.0} %  nowhere in this map", 100.0 * answer.p_none);
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn not_known_is_told_too() {
        let answer = WhereAnswer {
            text: "where is the pool".into(),
            label: Some("pool".into()),
            via: "unknown".into(),
            p_none: 1.0,
            unresolved: 0.0,
            candidates: vec![],
            suggestions: vec![],
            robot: None,
        };
        assert_eq!(told(&answer), "where is the pool\n  100 %  nowhere in this map\n");
    }

    #[test]
    fn doubt_is_told_where_there_was_any() {
        let entry = |state, why: &str| (0, state, why.to_owned());
        let mut states = vec![entry(TrackState::Mapping, "a")];
        assert_eq!(state(&states), None);
        states.extend([entry(TrackState::Lost, "in the dark for 34 m"), entry(TrackState::Mapping, "found")]);
        assert_eq!(state(&states).unwrap(), "mapping: found; 0 times doubtful, 1 times lost");
        assert_eq!(
            (dropped(0.0), dropped(0.25)),
            (String::new(), ", 0.25 in graphs that were dropped".into())
        );
    }
}
