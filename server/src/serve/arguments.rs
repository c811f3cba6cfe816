//! What is asked, and whether it can be answered: every error says which argument and what to do.

use toponym_core::Snapshot;
use toponym_core::answers::query::WhereAnswer;
use toponym_core::effects::TrackState;
use toponym_core::language::Speech;
use toponym_proto::answer::{ErrorCode, Problem};
use toponym_proto::limits::COORDINATE_MAX_M;
use toponym_proto::selector::Arguments;

use super::board::MapView;

/// Cells of a grid, metres.
const RESOLUTION_M: std::ops::RangeInclusive<f64> = 0.01..=1.0;

/// Takes the arguments that a query knows; any other is an error, for it would be ignored.
pub fn take<const N: usize>(
    mut arguments: Arguments,
    known: [&str; N],
) -> Result<[Option<String>; N], Problem> {
    let taken = known.map(|name| arguments.remove(name));
    match arguments.into_keys().next() {
        None => Ok(taken),
        Some(name) => Err(Problem::new(ErrorCode::BadArgument, format!("{name}: no such argument"))
            .field(name)
            .hint(if known.is_empty() {
                "it takes none".into()
            } else {
                format!("it takes: {}", known.join(", "))
            })),
    }
}

/// The name or the question.
pub fn asked(name: Option<String>, text: Option<String>) -> Result<String, Problem> {
    let ((Some(text), None) | (None, Some(text))) = (name, text) else {
        return Err(Problem::new(ErrorCode::BadArgument, "give either name or text")
            .field("name")
            .hint("?name=lecture%20hall or ?text=where%20is%20the%20lecture%20hall"));
    };
    if text.trim().is_empty() {
        return Err(Problem::new(ErrorCode::BadArgument, "name is empty").field("name"));
    }
    Ok(text)
}

/// An answer to what was understood.
pub fn understood(answer: WhereAnswer) -> Result<WhereAnswer, Problem> {
    if answer.label.is_some() {
        return Ok(answer);
    }
    let message = format!("{:?} asks for nothing that this server understands", answer.text);
    let hint = "ask by a name, \"kitchen\", or a whole question, \"where is the kitchen?\"";
    Err(Problem::new(ErrorCode::BadArgument, message).field("name").hint(hint))
}

/// A point of the map, or where the robot is.
pub fn point(snapshot: &Snapshot, x_m: Option<String>, y_m: Option<String>) -> Result<(f64, f64), Problem> {
    let number =
        |field: &str, text: &str| match text.parse::<f64>() {
            Ok(m) if m.abs() <= COORDINATE_MAX_M => Ok(m),
            _ => Err(Problem::new(ErrorCode::BadArgument, format!("{field} is {text}, must be metres"))
                .field(field)),
        };
    match (x_m, y_m) {
        (Some(x), Some(y)) => Ok((number("x_m", &x)?, number("y_m", &y)?)),
        (None, None) => {
            check_localised(snapshot, ("", None), true)?;
            let nowhere =
                || Problem::new(ErrorCode::NotLocalised, "the robot has seen nothing yet").field("robot");
            let robot = snapshot.robot().ok_or_else(nowhere)?;
            Ok((robot.x_m, robot.y_m))
        }
        _ => {
            let message = "give both x_m and y_m, or neither for where the robot is";
            Err(Problem::new(ErrorCode::BadArgument, message).field("x_m").hint("?x_m=1.5;y_m=-2"))
        }
    }
}

/// A language, if this server reads it.
pub fn known(lang: Option<String>) -> Result<Option<String>, Problem> {
    if Speech::knows(lang.as_deref()) {
        return Ok(lang);
    }
    let message = format!("lang is {:?}; this server reads {}", lang.unwrap_or_default(), Speech::known());
    Err(Problem::new(ErrorCode::BadArgument, message).field("lang").hint("?name=K%C3%BCche;lang=de"))
}

pub fn check_robot(map: &MapView, robot: Option<&str>) -> Result<(), Problem> {
    match robot {
        Some(robot) if robot != map.robot => {
            let message = format!("robot {robot:?} is not on map {:?}", map.id);
            let hint = format!("its robot is {}", map.robot);
            Err(Problem::new(ErrorCode::NoSuchRobot, message).field("robot").hint(hint))
        }
        _ => Ok(()),
    }
}

/// What counts from the robot can't be told of one that is lost; all else stands in the map's frame.
pub fn check_localised(
    snapshot: &Snapshot,
    (text, lang): (&str, Option<&str>),
    of_robot: bool,
) -> Result<(), Problem> {
    // To read a question takes longer than to answer it: only where it matters.
    if snapshot.state() != TrackState::Lost {
        return Ok(());
    }
    if of_robot || snapshot.is_of_robot(text, lang) {
        let message = "the robot doesn't know where it is";
        let hint = "ask without robot= for where things are in the map";
        return Err(Problem::new(ErrorCode::NotLocalised, message).field("robot").hint(hint));
    }
    Ok(())
}

pub fn resolution_m(text: &str) -> Result<f64, Problem> {
    match text.parse() {
        Ok(value) if RESOLUTION_M.contains(&value) => Ok(value),
        _ => {
            let range = format!("{} to {}", RESOLUTION_M.start(), RESOLUTION_M.end());
            let message = format!("resolution_m is {text}, must be a number from {range}");
            Err(Problem::new(ErrorCode::BadArgument, message).field("resolution_m"))
        }
    }
}
