//! Answers in words.

use std::fmt::Write as _;
use toponym_proto::answer::{Candidate, WhereReply};

/// Less likely alternatives are left out.
const SHOWN_MIN: f64 = 0.005;

/// Where something is, likeliest first, a line each.
pub fn where_text(reply: &WhereReply) -> String {
    let Some((best, others)) = reply.candidates.split_first() else {
        let suggestions = &reply.resolved.suggestions;
        let offer = if suggestions.is_empty() {
            "`toponym labels` lists what is".to_owned()
        } else {
            format!("did you mean {}?", suggestions.join(" or "))
        };
        return format!("{}: not known here; {offer}\n", reply.name);
    };
    let mut text = format!("{}: {}\n", shown(best), candidate_text(best));
    for other in others.iter().filter(|c| c.probability >= SHOWN_MIN) {
        let _ = writeln!(text, "  or {}: {}", shown(other), candidate_text(other));
    }
    if reply.p_none >= SHOWN_MIN {
        let _ = writeln!(text, "  or nowhere in the map: probability {:.2}", reply.p_none);
    }
    text
}

/// Its name as a guide spells it.
fn shown(c: &Candidate) -> &str {
    if c.shown.is_empty() { &c.label } else { &c.shown }
}

fn candidate_text(c: &Candidate) -> String {
    let from_robot = c.from_robot.as_ref().map_or(String::new(), |from| {
        format!("{:.1} m away, {}, ", from.distance_m, bearing_text(from.bearing_rad))
    });
    let walk = c.walk_m.map_or(String::new(), |m| format!("{m:.1} m to go, "));
    format!("{from_robot}{walk}probability {:.2} (x {:.2} m, y {:.2} m)", c.probability, c.x_m, c.y_m)
}

fn bearing_text(bearing_rad: f64) -> String {
    match bearing_rad.to_degrees().round() as i64 {
        0 => "straight ahead".into(),
        180 | -180 => "right behind".into(),
        left @ 1.. => format!("{left}° to the left"),
        right => format!("{}° to the right", -right),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use toponym_proto::answer::{FromRobot, MapIdentity, Resolved};

    fn candidate(probability: f64, bearing_rad: Option<f64>) -> Candidate {
        Candidate {
            region: 1,
            label: "gym".into(),
            shown: "gym".into(),
            probability,
            p_is: 0.9,
            x_m: 1.0,
            y_m: -2.0,
            yaw_rad: 0.0,
            cov: [0.0; 9],
            polygon_m: Vec::new(),
            goal: None,
            from_robot: bearing_rad.map(|bearing_rad| FromRobot {
                robot: "r".into(),
                distance_m: 8.25,
                bearing_rad,
            }),
            walk_m: None,
            because: Vec::new(),
        }
    }

    fn reply(candidates: Vec<Candidate>) -> WhereReply {
        WhereReply {
            v: 1,
            query: "where".into(),
            name: "gym".into(),
            resolved: Resolved::default(),
            map: MapIdentity::default(),
            stamp: toponym_proto::Stamp::default(),
            p_none: 0.1,
            unresolved: 0.0,
            candidates,
        }
    }

    #[test]
    fn where_tells_distance_bearing_probability_and_alternatives() {
        let text = where_text(&reply(vec![
            candidate(0.7, Some(0.5)),
            candidate(0.2, Some(-0.5)),
            candidate(0.0, None),
        ]));
        assert_eq!(
            text,
            "gym: 8.2 m away, 29° to the left, probability 0.70 (x 1.00 m, y -2.00 m)\n  \
             or gym: 8.2 m away, 29° to the right, probability 0.20 (x 1.00 m, y -2.00 m)\n  \
             or nowhere in the map: probability 0.10\n"
        );
    }

    #[test]
    fn bearings_are_told_from_the_nose() {
        for (degrees, text) in [
            (0.2, "straight ahead"),
            (90.0, "90° to the left"),
            (-45.0, "45° to the right"),
            (-179.9, "right behind"),
            (180.0, "right behind"),
        ] {
            assert_eq!(bearing_text(f64::to_radians(degrees)), text);
        }
    }

    #[test]
    fn an_unknown_name_is_told_as_such() {
        assert!(where_text(&reply(Vec::new())).starts_with("gym: not known here"));
    }
}
