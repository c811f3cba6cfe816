//! A recording as files: a record file, a CARMEN log where its laser fits in one, a narration, and
//! the truth to score against.

use super::Recording;
use super::tours::{Hypothesis, Piece};
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::f64::consts::FRAC_PI_2;
use std::fmt::Write as _;
use std::io;
use std::path::Path;
use toponym_proto::record::{Origin, RecordWriter};
use toponym_proto::{Message, Pose, Scan};

/// What CARMEN logs write where nothing was seen.
const NOTHING_SEEN_M: f32 = 81.83;

/// The robot's streams in a record file.
pub const RECORD: &str = "sim.rec";
/// The robot's streams as CARMEN text.
pub const CARMEN: &str = "sim.clf";

/// Writes `sim.rec`, `sim.clf` (only for a laser that CARMEN logs can tell of), `narration.jsonl`,
/// `truth.json` and `questions.json` into a folder, which it makes if need be. The answer is the
/// log to map: the CARMEN one if there is one.
pub fn write_folder(recording: &Recording, folder: &Path) -> io::Result<&'static str> {
    write_hypotheses(recording, &[], folder)
}

/// The same, with what else might have happened in `truth.json`: the robot is at `world_from_true ∘
/// true pose` from each piece's time on.
pub fn write_hypotheses(
    recording: &Recording,
    hypotheses: &[Hypothesis],
    folder: &Path,
) -> io::Result<&'static str> {
    std::fs::create_dir_all(folder)?;
    record(&recording.messages, std::fs::File::create(folder.join(RECORD))?)?;
    let log = if fits_carmen(recording) { CARMEN } else { RECORD };
    if log == CARMEN {
        std::fs::write(folder.join(CARMEN), carmen(recording))?;
    } else if folder.join(CARMEN).exists() {
        // A run before this one left it: it would pass for this one's.
        std::fs::remove_file(folder.join(CARMEN))?;
    }
    std::fs::write(folder.join("narration.jsonl"), narration(&recording.messages))?;
    let (mut truth, questions) = truth(recording);
    if !hypotheses.is_empty() {
        truth["hypotheses"] = hypotheses.iter().map(told).collect();
    }
    std::fs::write(folder.join("truth.json"), format!("{truth}\n"))?;
    std::fs::write(folder.join("questions.json"), format!("{questions:#}\n"))?;
    Ok(log)
}

fn told(hypothesis: &Hypothesis) -> Value {
    let piece = |p: &Piece| {
        let Pose { x_m, y_m, yaw_rad } = p.world_from_true;
        json!({"from_s": p.from_s, "world_from_true": [x_m, y_m, yaw_rad]})
    };
    json!({"name": hypothesis.name, "pieces": hypothesis.pieces.iter().map(piece).collect::<Vec<_>>()})
}

/// Writes the robot's streams as a record file, as `serve --record` does, but without sentences:
/// these are in the narration, as for any other log.
pub fn record(messages: &[Message], out: impl io::Write) -> io::Result<()> {
    let mut writer =
        RecordWriter::new(io::BufWriter::new(out), &Origin::default()).map_err(io::Error::other)?;
    for message in messages.iter().filter(|m| !matches!(m, Message::Say(_))) {
        writer.write(message).map_err(io::Error::other)?;
    }
    writer.flush().map_err(io::Error::other)
}

/// Whether a CARMEN log can say all there is: one laser, half a circle flat ahead on the body's x
/// axis, all rays at once, and no second boot.
pub fn fits_carmen(recording: &Recording) -> bool {
    let first_boot = |m: &Message| m.header().is_none_or(|h| h.boot == 0);
    recording.messages.iter().all(first_boot)
        && recording.messages.iter().all(|message| match message {
            Message::Setup(setup) => match setup.lasers.as_slice() {
                [l] => l.y_m == 0.0 && l.yaw_rad == 0.0 && !l.upside_down && l.ignored_rad.is_empty(),
                _ => false,
            },
            Message::Scan(scan) => {
                let last_rad =
                    scan.angle_min_rad + scan.angle_increment_rad * (scan.ranges_m.len() as f64 - 1.0);
                let half_circle = (scan.angle_min_rad + FRAC_PI_2).abs().max((last_rad - FRAC_PI_2).abs());
                scan.time_increment_s == 0.0 && half_circle < 1e-6
            }
            Message::Odom(_) | Message::Say(_) | Message::End(_) | Message::Mend(_) => true,
        })
}

/// The robot's streams as a CARMEN log (ODOM and FLASER lines). The format knows one laser, flat
/// ahead on the body's x axis, seeing at once: of others, only what it can say is written.
pub fn carmen(recording: &Recording) -> String {
    let mut text = String::from("# simulated by toponym\n");
    let (mut offset_m, mut front) = (0.0, None);
    let mut odom = Pose::default();
    for message in &recording.messages {
        match message {
            Message::Setup(setup) => {
                if let Some(laser) = setup.lasers.first() {
                    offset_m = laser.x_m;
                    front = Some(laser.id.clone());
                    // Writing to a string cannot fail.
                    let _ = writeln!(text, "PARAM robot_frontlaser_offset {offset_m}");
                }
            }
            Message::Odom(m) => {
                odom = m.odom_from_body;
                let t = m.header.stamp.seconds();
                let (x, y, yaw) = (odom.x_m, odom.y_m, odom.yaw_rad);
                let _ = writeln!(text, "ODOM {x} {y} {yaw} 0 0 0 {t:.6} sim {t:.6}");
            }
            Message::Scan(scan) if front.as_ref() == Some(&scan.laser) => {
                flaser(&mut text, scan, &odom, offset_m);
            }
            Message::Scan(_) | Message::Say(_) | Message::End(_) | Message::Mend(_) => {}
        }
    }
    text
}

fn flaser(text: &mut String, scan: &Scan, odom: &Pose, offset_m: f64) {
    let _ = write!(text, "FLASER {}", scan.ranges_m.len());
    for &range_m in &scan.ranges_m {
        let range_m = match range_m {
            r if r.is_nan() => 0.0,
            r if r.is_infinite() => NOTHING_SEEN_M,
            r => r,
        };
        let _ = write!(text, " {range_m}");
    }
    let [laser_x, laser_y] = crate::geom::apply(odom, [offset_m, 0.0]);
    let (x, y, yaw) = (odom.x_m, odom.y_m, odom.yaw_rad);
    let t = scan.header.stamp.seconds();
    let _ = writeln!(text, " {laser_x} {laser_y} {yaw} {x} {y} {yaw} {t:.6} sim {t:.6}");
}

/// The sentences, one JSON object a line; `t` is the log's own stamp.
pub fn narration(messages: &[Message]) -> String {
    let mut text = String::new();
    for message in messages {
        if let Message::Say(say) = message {
            let t = say.began.map(toponym_proto::Stamp::seconds);
            let _ = writeln!(text, "{}", json!({"t": t, "id": say.id, "text": say.text}));
        }
    }
    text
}

/// The truth (`trajectory` rows `[t, x, y, yaw]`, `regions` by id with their corners) and the
/// questions that have an answer, each with the regions that are right.
pub fn truth(recording: &Recording) -> (Value, Value) {
    let trajectory: Vec<[f64; 4]> =
        recording.truth.scans.iter().map(|(stamp, p)| [stamp.seconds(), p.x_m, p.y_m, p.yaw_rad]).collect();
    let mut regions = BTreeMap::new();
    let mut questions: BTreeMap<String, Vec<String>> = BTreeMap::new();
    for (k, (name, corners)) in recording.truth.names.iter().enumerate() {
        let id = format!("R{}", k + 1);
        questions.entry(format!("where is the {name}")).or_default().push(id.clone());
        regions.insert(id, corners);
    }
    let faults: Vec<Value> = recording
        .truth
        .faults
        .iter()
        .map(|i| json!({"fault": i.fault.to_string(), "from_s": i.from_s, "to_s": i.to_s}))
        .collect();
    let mut truth = json!({"trajectory": trajectory, "regions": regions, "path_m": recording.truth.path_m});
    if !faults.is_empty() {
        truth["faults"] = json!(faults);
    }
    (truth, json!(questions))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{LaserModel, Scenario};
    use toponym_proto::record::RecordReader;

    fn recording() -> Recording {
        let mut scenario = Scenario::demo(1);
        scenario.tour.truncate(2);
        scenario.run().unwrap()
    }

    #[test]
    fn the_log_has_a_line_per_message_and_the_stamp_before_the_host() {
        let recording = recording();
        let text = carmen(&recording);
        let count = |word: &str| text.lines().filter(|l| l.starts_with(word)).count();
        let scans = recording.messages.iter().filter(|m| matches!(m, Message::Scan(_))).count();
        let odoms = recording.messages.iter().filter(|m| matches!(m, Message::Odom(_))).count();
        assert_eq!((count("FLASER 181 "), count("ODOM ")), (scans, odoms));
        for line in text.lines().filter(|l| l.starts_with("FLASER")) {
            let fields: Vec<&str> = line.split_whitespace().collect();
            assert_eq!(fields.len(), 2 + 181 + 6 + 3);
            assert_eq!(fields[190], "sim");
            assert!(fields[189].parse::<f64>().is_ok());
        }
    }

    #[test]
    fn every_question_has_a_region_that_exists() {
        let (truth, questions) = truth(&recording());
        let questions = questions.as_object().unwrap();
        assert!(questions.contains_key("where is the gym"), "{questions:?}");
        for ids in questions.values() {
            for id in ids.as_array().unwrap() {
                assert!(truth["regions"][id.as_str().unwrap()].is_array());
            }
        }
    }

    #[test]
    fn each_sentence_is_a_line() {
        let recording = recording();
        let lines: Vec<Value> =
            narration(&recording.messages).lines().map(|l| serde_json::from_str(l).unwrap()).collect();
        assert!(!lines.is_empty());
        assert!(lines.iter().all(|l| l["t"].is_f64() && l["text"].is_string()));
    }

    #[test]
    fn a_laser_that_carmen_logs_cannot_tell_of_gets_none() {
        let folder = std::env::temp_dir().join(format!("toponym-sim-write-{}", std::process::id()));
        assert_eq!(write_folder(&recording(), &folder).unwrap(), "sim.clf");
        assert!(folder.join("sim.clf").exists() && folder.join("sim.rec").exists());
        let mut scenario = Scenario::demo(1);
        scenario.tour.truncate(2);
        scenario.lasers = vec![LaserModel::rplidar()];
        assert_eq!(write_folder(&scenario.run().unwrap(), &folder).unwrap(), "sim.rec");
        assert!(!folder.join("sim.clf").exists(), "the one of the last run would mislead");
        std::fs::remove_dir_all(&folder).unwrap();
    }

    #[test]
    fn the_record_has_all_messages_but_the_sentences() {
        let recording = recording();
        let mut bytes = Vec::new();
        record(&recording.messages, &mut bytes).unwrap();
        let read = RecordReader::new(bytes.as_slice()).unwrap().map(|m| m.unwrap().1);
        let want = recording.messages.into_iter().filter(|m| !matches!(m, Message::Say(_)));
        // NaN is no information, and no number equals it.
        assert!(read.map(|m| format!("{m:?}")).eq(want.map(|m| format!("{m:?}"))));
    }
}
