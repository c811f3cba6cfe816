//! Answers in words, for a guide who asks: where it is from here, and how sure that is.

use crate::answers::query::{Candidate, WhereAnswer};
use crate::answers::snapshot::Snapshot;
use crate::effects::TrackState;
use crate::geometry::{Pose2, side};
use crate::language::act::{About, Content, Head, Phrase, Question};
use crate::language::{Name, asked_name};

/// What is likelier is told as it is, …
const SURE: f64 = 0.8;
/// … as what one thinks, …
const THOUGHT: f64 = 0.5;
/// … or as what may be; less is not told.
const MAY_BE: f64 = 0.25;
/// So near is "here".
const HERE_M: f64 = 4.0;

/// Answers to all that was asked, after what was understood beside it.
pub(crate) fn answers(map: &Snapshot, asked: &[Content], heard: &str) -> String {
    let all: Vec<String> = asked.iter().map(|question| answer(map, question)).collect();
    if all.iter().all(String::is_empty) {
        return format!("{heard} I can't answer that.");
    }
    all.into_iter().filter(|a| !a.is_empty()).collect::<Vec<_>>().join(" ")
}

/// Empty if it is none that can be answered.
fn answer(map: &Snapshot, question: &Content) -> String {
    let Content::Ask { kind, about } = question else { return String::new() };
    match (kind, about) {
        (Question::Where | Question::What, About::Phrase(Phrase { head: Head::Here, .. })) => here(map),
        (Question::Whether, About::Content(content)) => match &**content {
            Content::Label { at, what, .. } if at.head == Head::Here => {
                what.label().map_or_else(String::new, |name| is_it_here(map, &name))
            }
            Content::Locate(l) if is_anywhere(&l.landmarks) => {
                l.figure.label().map_or_else(String::new, |name| is_there(map, &name))
            }
            _ => String::new(),
        },
        (Question::Where | Question::Route | Question::HowFar, _) => {
            let Some(name) = asked_name(question) else { return String::new() };
            let told = whereabouts(map, &name);
            match kind {
                Question::Route => format!("{told} I can't tell the way yet, only where it is."),
                _ => told,
            }
        }
        _ => String::new(),
    }
}

fn is_anywhere(landmarks: &[Phrase]) -> bool {
    landmarks.iter().all(|p| matches!(p.head, Head::Here | Head::There))
}

/// "Where am I?", "what is this?"
fn here(map: &Snapshot) -> String {
    if let Some(lost) = lost(map) {
        return lost;
    }
    let Some(robot) = map.robot() else { return "I have seen nothing yet.".to_owned() };
    let names = map.what(robot.x_m, robot.y_m).names;
    let likeliest = names.first().map(|(_, name, p)| (name, p));
    // Where the room has no name, something near may have one.
    let near = map.called_around(&robot, HERE_M, None);
    match likeliest.or(near.first().map(|(name, p)| (name, p))) {
        Some((name, p)) if *p >= SURE => format!("This is {}.", map.spoken(name)),
        Some((name, p)) if *p >= THOUGHT => format!("I think this is {}.", map.spoken(name)),
        Some((name, _)) => format!("This may be {}.", map.spoken(name)),
        None => "Nobody told me what this place is called.".to_owned(),
    }
}

fn lost(map: &Snapshot) -> Option<String> {
    (map.state() == TrackState::Lost).then(|| "I don't know where I am: I am lost.".to_owned())
}

/// "Is this the gym?"
fn is_it_here(map: &Snapshot, name: &Name) -> String {
    if let Some(lost) = lost(map) {
        return lost;
    }
    let Some(robot) = map.robot() else { return "I have seen nothing yet.".to_owned() };
    let found = map.where_named(name);
    let here = found.candidates.iter().filter(|c| c.pose.distance_m(&robot) < HERE_M);
    let p = here.map(|c| c.p_is).fold(0.0, f64::max);
    let spoken = map.spoken(found.label.as_deref().unwrap_or(name.as_str()));
    match p {
        p if p >= SURE => format!("Yes, this is {spoken}."),
        p if p >= THOUGHT => format!("I think so: this is {spoken}."),
        p if p >= MAY_BE => format!("Maybe: this may be {spoken}."),
        _ => {
            let other = here_called(map, &robot, name);
            let no =
                other.map_or("Not that I know.".to_owned(), |other| format!("No, I think this is {other}."));
            format!("{no} {}", whereabouts(map, name))
        }
    }
}

fn here_called(map: &Snapshot, robot: &Pose2, but: &Name) -> Option<String> {
    let named = map.called_around(robot, HERE_M, Some(but.as_str())).into_iter().next()?;
    (named.1 >= THOUGHT).then(|| map.spoken(&named.0))
}

/// "Is there a gym?"
fn is_there(map: &Snapshot, name: &Name) -> String {
    let found = map.where_named(name);
    let yes = if 1.0 - found.p_none >= SURE { "Yes: " } else { "" };
    format!("{yes}{}", whereabouts(map, name))
}

/// "Where is the gym?"
fn whereabouts(map: &Snapshot, name: &Name) -> String {
    let found = map.where_named(name);
    let asked = map.spoken(name.as_str());
    let likely: Vec<&Candidate> = found.candidates.iter().filter(|c| c.probability >= MAY_BE).collect();
    let Some((best, others)) = likely.split_first() else {
        return unknown(map, &found, &asked);
    };
    let called = map.spoken(&best.label);
    let by_another_name = match found.via.as_str() {
        "synonym" | "sound" => format!("I know of no {}. If you mean {called}: ", name.as_str()),
        _ => String::new(),
    };
    let sum: f64 = likely.iter().map(|c| c.probability).sum();
    let is = match if by_another_name.is_empty() { sum } else { 1.0 } {
        p if p >= SURE => format!("{called} {}", is_or_are(best)),
        p if p >= THOUGHT => format!("I think {called} {}", is_or_are(best)),
        _ => format!("{called} may be"),
    };
    let mut text =
        format!("{by_another_name}{} {}", capital(&is, by_another_name.is_empty()), put(map, best));
    for other in others {
        text.extend([", or ", &put(map, other)]);
    }
    text + "."
}

fn is_or_are(c: &Candidate) -> &'static str {
    let many = |name: &str| name.ends_with('s');
    if many(&c.shown) && !many(&c.label) || c.label == "stairs" { "are" } else { "is" }
}

fn capital(text: &str, is_first: bool) -> String {
    let mut chars = text.chars();
    match chars.next() {
        Some(first) if is_first => first.to_uppercase().chain(chars).collect(),
        _ => text.to_owned(),
    }
}

fn unknown(map: &Snapshot, found: &WhereAnswer, asked: &str) -> String {
    if found.via == "exact" {
        return format!("I heard of {asked}, but I don't know where it is.");
    }
    let offered: Vec<String> = found.suggestions.iter().map(|name| map.spoken(name)).collect();
    let offer =
        if offered.is_empty() { String::new() } else { format!(" Do you mean {}?", offered.join(" or ")) };
    format!("Nobody told me of {asked}.{offer}")
}

/// "Some 12 m from here, behind on the left, near the lobby".
fn put(map: &Snapshot, c: &Candidate) -> String {
    let near = map.called_around(&c.pose, HERE_M, Some(&c.label)).into_iter().find(|(_, p)| *p >= THOUGHT);
    let near = near.map(|(name, _)| format!("near {}", map.spoken(&name)));
    let Some(robot) = map.robot().filter(|_| map.state() != TrackState::Lost) else {
        let near = near.unwrap_or_else(|| "somewhere in the map".to_owned());
        return format!("{near}, but I am lost and can't tell the way");
    };
    let distance_m = robot.distance_m(&c.pose);
    if distance_m < HERE_M / 2.0 {
        return "right here".to_owned();
    }
    let off = robot.between(&c.pose);
    let near = near.map_or_else(String::new, |near| format!(", {near}"));
    format!("some {distance_m:.0} m from here, {}{near}", side(off.y_m.atan2(off.x_m)))
}
