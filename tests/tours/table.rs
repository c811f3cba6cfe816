//! Figures as people read them.

use crate::score::{Calibration, Masses, NegLog, Rate, Spread, Summary};
use std::fmt::Write as _;

/// A block of lines for a tour in a language.
pub fn text(s: &Summary) -> String {
    let setting = &s.setting;
    let particles = setting.particles.map_or(String::new(), |n| format!(", {n} particles"));
    let mut out =
        format!("{}, {}, {}{particles}, {} seeds\n", setting.tour, setting.language, setting.preset, s.seeds);
    let mut line = |what: &str, figure: String| {
        // Writing to a string cannot fail.
        let _ = writeln!(out, "  {what:<32} {figure}");
    };
    line("true graphs' mass", masses(&s.masses));
    if let Some(reference) = &s.reference {
        line("  by the reference", masses(reference));
    }
    line("-ln mass", neg_log(s.masses.neg_log_mass.as_ref()));
    for (name, group) in &s.mass_by_hypothesis {
        line(&format!("  mass of {name:?}"), format!("{:.3} over {} seeds", group.median, group.seeds));
    }
    line("  mass of none of these", spread(s.mass_of_none));
    for (name, group) in &s.by_truth {
        line(&format!("  where {name:?} is true"), format!("{:.3} over {} seeds", group.median, group.seeds));
    }
    line(
        "distance from reference",
        s.total_variation.values().map(|v| number(*v)).collect::<Vec<_>>().join(", "),
    );
    line("undecidable", s.undecidable.as_ref().map_or("-".into(), |u| format!("{} {:?}", u.count, u.seeds)));
    line("loop precision, recall", format!("{}, {}", number(s.loop_precision), number(s.loop_recall)));
    line("top graphs all true", number(s.top_particles_all_true));
    line("trajectory error (m)", spread(s.ate_rmse_m));
    line("names, answers right", format!("{}, {}", rate(&s.label_accuracy), rate(&s.answers_right)));
    for (way, by) in &s.answers.by_telling {
        let of = format!("{}, mass {}, p_none {}", rate(&by.right), number(by.mass), rate(&by.found));
        line(&format!("  told {way}"), of);
    }
    let (nll, brier) = (spread(s.answers.nll), spread(s.answers.brier));
    line("  -ln of the right, Brier", format!("{nll}, {brier}"));
    for (kind, error) in &s.answers.ece_of {
        line(&format!("  calibration of {kind}"), calibration(Some(error)));
    }
    let from: Vec<String> =
        s.answers.right_from.iter().map(|(p, r)| format!("{} from {p}", rate(r))).collect();
    line("  best ones right", from.join(", "));
    line("calibration error", calibration(s.calibration.as_ref()));
    line("  of weights below .95", calibration(s.calibration_below_95.as_ref()));
    let wrong = &s.assured_wrong;
    line(
        "assured and wrong",
        format!("{} of checkpoints, {} of places", number(wrong.checkpoints), number(wrong.places)),
    );
    let told = if s.unresolved_told { "" } else { " (not told by this mapper)" };
    line("unresolved", format!("{}{told}", s.unresolved));
    let alive = s.graphs_alive.map_or("-".into(), |a| format!("{}, at most {}", a.median, a.max));
    line("graphs alive", alive);
    line("processor (ms per s)", number(s.cpu_ms_per_s));
    out
}

/// At the end, then at the quarters before.
fn masses(m: &Masses) -> String {
    let before = [m.mass_at_25, m.mass_at_50, m.mass_at_75].map(|s| number(s.map(|s| s.median)));
    format!("{} at the end; {} at 25, 50, 75 %", spread(m.mass_true_topology), before.join(", "))
}

/// Median, worst decile, mean.
pub fn neg_log(n: Option<&NegLog>) -> String {
    n.map_or("-".into(), |n| format!("{}, mean {:.3}", spread(Some(n.spread)), n.mean))
}

/// Median and worst decile.
pub fn spread(s: Option<Spread>) -> String {
    s.map_or("-".into(), |s| format!("{:.3} ({:.3})", s.median, s.worst_decile))
}

/// A figure, or a dash where there is none.
pub fn number(n: Option<f64>) -> String {
    n.map_or("-".into(), |n| if n.abs() >= 100.0 { format!("{n:.0}") } else { format!("{n:.3}") })
}

/// So many of so many.
pub fn rate(r: &Rate) -> String {
    format!("{}/{}", r.right, r.of)
}

/// Expected calibration error with its interval.
pub fn calibration(c: Option<&Calibration>) -> String {
    c.map_or("-".into(), |c| format!("{:.3} [{:.3}, {:.3}] of {}", c.ece, c.ece_95[0], c.ece_95[1], c.count))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::score::{Mapped, Outcome, Setting};
    use crate::truth::{Hypothesis, Truth};

    #[test]
    fn what_is_not_known_is_a_dash_and_every_hypothesis_has_its_line() {
        let hypotheses = ["by the gym", "by the cafe"].map(Hypothesis::truth).to_vec();
        let truth = Truth { hypotheses, ..Truth::default() };
        let mapped = Mapped { checkpoints: vec![Some(crate::graph::Graphs::default())], ..Mapped::default() };
        let outcome = Outcome::new(7, &truth, &mapped, None);
        let setting = Setting { tour: "small".into(), particles: Some(30), ..Setting::default() };
        let text = text(&Summary::new(setting, &[outcome]));
        assert!(text.starts_with("small, , , 30 particles, 1 seeds\n"), "{text}");
        assert!(text.contains("where \"by the gym\" is true"));
        assert!(text.contains("not told by this mapper"));
        let line = |what: &str| text.lines().find(|l| l.trim().starts_with(what)).unwrap();
        assert!(line("trajectory error (m)").ends_with(" -") && line("processor").ends_with(" -"));
        assert_eq!(number(Some(123.4)), "123");
    }
}
