//! The table of all tours, as this repository keeps it.

use crate::score::{Calibration, Summary};
use crate::suite::Row;
use crate::table::{number, rate, spread};
use std::fmt::Write as _;
use std::time::SystemTime;
use toponym_server::map::Preset;

/// What stands above the tables.
const HEAD: &str = "\
What the filter makes of tours on which one hypothesis is not enough. Definitions and how to run: \
[README.md](README.md). Medians over the seeds, worst decile in brackets.
";

/// The whole file.
pub fn text(rows: &[Row], seeds: usize, preset: Preset) -> String {
    let summaries: Vec<Summary> = rows.iter().map(|r| Summary::new(r.setting.clone(), &r.outcomes)).collect();
    let commit = std::env::var("TOPONYM_COMMIT").map_or(String::new(), |c| format!(", commit {c}"));
    let mut out = String::from("# Results\n\n");
    // Writing to a string cannot fail.
    let _ = writeln!(
        out,
        "Written by `tours --results` on {}: build {}{commit}, {seeds} seeds, preset {}. {HEAD}",
        date(SystemTime::now()),
        toponym_server::map::build(),
        preset,
    );
    out += &section("Which graph", &GRAPHS, &summaries);
    out += &section("The best graph's map, and what is asked of it", &MAPS, &summaries);
    out += &section("How sure, and at what cost", &SURENESS, &summaries);
    out += &by_truth(&summaries);
    out += &together(rows);
    out
}

/// A column's head and what stands in it.
type Column = (&'static str, fn(&Summary) -> String);

const GRAPHS: [Column; 9] = [
    ("true mass at the end", |s| spread(s.masses.mass_true_topology)),
    ("at 25 %", |s| spread(s.masses.mass_at_25)),
    ("at 50 %", |s| spread(s.masses.mass_at_50)),
    ("at 75 %", |s| spread(s.masses.mass_at_75)),
    ("reference at the end", |s| spread(s.reference.and_then(|r| r.mass_true_topology))),
    ("open by it at 75 %", |s| number(s.reference_open.get("at_75").copied().flatten())),
    ("−ln mass, mean", |s| number(s.masses.neg_log_mass.map(|n| n.mean))),
    ("of none", |s| spread(s.mass_of_none)),
    ("undecidable", |s| s.undecidable.as_ref().map_or("-".into(), |u| u.count.to_string())),
];

const MAPS: [Column; 6] = [
    ("loop precision", |s| number(s.loop_precision)),
    ("recall", |s| number(s.loop_recall)),
    ("top graphs all true", |s| number(s.top_particles_all_true)),
    ("ATE (m)", |s| spread(s.ate_rmse_m)),
    ("names right", |s| rate(&s.label_accuracy)),
    ("answers right", |s| rate(&s.answers_right)),
];

const SURENESS: [Column; 7] = [
    ("calibration error", |s| error(s.calibration.as_ref())),
    ("below .95", |s| error(s.calibration_below_95.as_ref())),
    ("assured wrong, checkpoints", |s| number(s.assured_wrong.checkpoints)),
    ("places", |s| number(s.assured_wrong.places)),
    ("total variation at the end", |s| number(s.total_variation.get("at_end").copied().flatten())),
    ("graphs alive", |s| s.graphs_alive.map_or("-".into(), |a| format!("{} (max {})", a.median, a.max))),
    ("CPU (ms per s)", |s| number(s.cpu_ms_per_s)),
];

/// A table with a row per tour, language and number of particles.
fn section(title: &str, columns: &[Column], summaries: &[Summary]) -> String {
    let mut heads = vec!["tour", "language", "particles"];
    heads.extend(columns.iter().map(|c| c.0));
    let row = |s: &Summary| {
        let mut cells = vec![s.setting.tour.clone(), s.setting.language.clone()];
        cells.push(s.setting.particles.map_or("-".into(), |n| n.to_string()));
        cells.extend(columns.iter().map(|c| c.1(s)));
        cells
    };
    table(title, &heads, summaries.iter().map(row))
}

fn table(title: &str, heads: &[&str], rows: impl Iterator<Item = Vec<String>>) -> String {
    let mut out = format!("## {title}\n| {} |\n|{}\n", heads.join(" | "), "---|".repeat(heads.len()));
    for cells in rows {
        let _ = writeln!(out, "| {} |", cells.join(" | "));
    }
    out + "\n"
}

fn error(c: Option<&Calibration>) -> String {
    c.map_or("-".into(), |c| format!("{:.3} [{:.3}, {:.3}]", c.ece, c.ece_95[0], c.ece_95[1]))
}

fn by_truth(summaries: &[Summary]) -> String {
    let rows = summaries.iter().filter(|s| s.by_truth.len() > 1).flat_map(|s| {
        s.by_truth.iter().map(|(name, group)| {
            let particles = s.setting.particles.map_or("-".into(), |n| n.to_string());
            let figures = [name.clone(), group.seeds.to_string(), format!("{:.3}", group.median)];
            [vec![s.setting.tour.clone(), s.setting.language.clone(), particles], figures.to_vec()].concat()
        })
    });
    table(
        "By what was true, where that differs by seed",
        &["tour", "language", "particles", "true", "seeds", "true mass at the end"],
        rows,
    )
}

/// Calibration over all tours: a tour's few seeds fill no bin.
fn together(rows: &[Row]) -> String {
    let mut kinds: Vec<(&str, Option<u32>)> = Vec::new();
    for row in rows {
        let kind = (row.setting.language.as_str(), row.setting.particles);
        if !kinds.contains(&kind) {
            kinds.push(kind);
        }
    }
    let line = |(language, particles): (&str, Option<u32>)| {
        let of_kind = |r: &&Row| r.setting.language == language && r.setting.particles == particles;
        let outcomes: Vec<_> = rows.iter().filter(of_kind).flat_map(|r| r.outcomes.clone()).collect();
        let s = Summary::new(crate::score::Setting::default(), &outcomes);
        let figures = [
            error(s.calibration.as_ref()),
            error(s.calibration_below_95.as_ref()),
            number(s.assured_wrong.checkpoints),
            number(s.assured_wrong.places),
            number(s.masses.neg_log_mass.map(|n| n.mean)),
        ];
        let kind = [language.to_owned(), particles.map_or("-".into(), |n| n.to_string())];
        [kind.to_vec(), figures.to_vec()].concat()
    };
    let heads = [
        "language",
        "particles",
        "calibration error",
        "below .95",
        "assured wrong, checkpoints",
        "places",
        "−ln mass, mean",
    ];
    table("All tours together", &heads, kinds.into_iter().map(line))
}

/// Year-month-day.
fn date(now: SystemTime) -> String {
    humantime::format_rfc3339_seconds(now).to_string().chars().take_while(|c| *c != 'T').collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::score::{Mapped, Outcome, Setting};
    use crate::truth::{Hypothesis, Truth};

    #[test]
    fn the_day_is_told_without_the_hour() {
        let leap_day = SystemTime::UNIX_EPOCH + std::time::Duration::from_secs(11_016 * 86_400 + 3_600);
        assert_eq!(date(leap_day), "2000-02-29");
    }

    #[test]
    fn each_table_has_a_row_per_tour_language_and_number_of_particles() {
        let truth = Truth { hypotheses: vec![Hypothesis::truth("t")], ..Truth::default() };
        let row = |language: &str, particles| Row {
            setting: Setting {
                tour: "walk".into(),
                language: language.into(),
                preset: "toponym".into(),
                particles: Some(particles),
            },
            outcomes: vec![Outcome::new(1, &truth, &Mapped::default(), None)],
        };
        let text = text(&[row("none", 30), row("none", 1), row("simple", 30)], 1, Preset::Toponym);
        assert_eq!(text.matches("| walk | none | 30 |").count(), 3);
        assert_eq!(text.matches("| walk |").count(), 9);
        assert!(text.contains("\n| none | 1 |") && text.contains("1 seeds, preset toponym"));
        let widths = |l: &str| l.matches('|').count();
        for table in text.split("## ").skip(1) {
            let lines: Vec<&str> = table.lines().filter(|l| l.starts_with('|')).collect();
            assert!(lines.iter().all(|l| widths(l) == widths(lines[0])), "{table}");
        }
    }
}
