//! Commands: what queries below `do/` change.

use std::sync::Arc;
use std::sync::mpsc::sync_channel;
use std::time::Duration;
use toponym_proto::answer::{
    ANSWER_VERSION, Candidate, Done, ErrorCode, Goal, Mended, Problem, Reachable, Sent, WhereReply,
};
use toponym_proto::selector::Arguments;
use toponym_proto::stream::{TOLD_SIGMA_M, TOLD_SIGMA_RAD};
use toponym_proto::{Limits, Mend, Message, Pose};
use ulid::Ulid;

use super::arguments::{asked, check_localised, check_robot, known, take, understood};
use super::board::{Board, MapView};
use super::door::Arrival;
use super::queries::{Reply, json, map};
use super::scribe::Work;
use crate::convert;
use crate::web::Published;

/// How long a command waits for a map that is busy.
const COMMAND_WAIT: Duration = Duration::from_secs(60);

/// Does it, and tells that it is done.
pub fn done(board: &Board, command: &str, arguments: Arguments) -> Result<Reply, Problem> {
    match command {
        "save" => save(board, &arguments),
        "delete" => delete(board, arguments),
        "undo" | "rename" | "forget" | "initial_pose" | "area" => mend(board, command, arguments),
        "go" => go(board, arguments),
        _ => Err(Problem::new(ErrorCode::Unsupported, format!("there is no command {command:?}"))
            .field("key")
            .hint(
                "this server knows do/save, do/delete, do/undo, do/rename, do/forget, do/initial_pose, do/area, do/go",
            )),
    }
}

fn stops() -> Problem {
    Problem::new(ErrorCode::Internal, "the server stops")
}

fn hand_in(board: &Board, arrival: Arrival) -> Result<(), Problem> {
    board.control.get().ok_or_else(stops)?.send(arrival).map_err(|_| stops())
}

/// `do/save?map=…`, or all maps.
fn save(board: &Board, arguments: &Arguments) -> Result<Reply, Problem> {
    let [id] = take(arguments.clone(), ["map"])?;
    let maps = match id {
        Some(id) => save_maps(vec![map(board, &id)?])?,
        None => save_all(board)?,
    };
    json(&Done { v: ANSWER_VERSION, query: "save".into(), maps })
}

/// `do/delete?map=…`.
fn delete(board: &Board, arguments: Arguments) -> Result<Reply, Problem> {
    let [id] = take(arguments, ["map"])?;
    let missing = || Problem::new(ErrorCode::BadArgument, "map is missing").field("map");
    let (map, (reply, done)) = (id.ok_or_else(missing)?, sync_channel(1));
    hand_in(board, Arrival::Delete { map: map.clone(), reply })?;
    done.recv_timeout(COMMAND_WAIT).map_err(|_| stops())??;
    json(&Done { v: ANSWER_VERSION, query: "delete".into(), maps: vec![map] })
}

/// Saves all maps and tells their ids.
pub fn save_all(board: &Board) -> Result<Vec<String>, Problem> {
    save_maps(board.maps.load().values().cloned().collect())
}

fn save_maps(maps: Vec<Arc<MapView>>) -> Result<Vec<String>, Problem> {
    let mut saved = Vec::new();
    for map in maps {
        let (reply, done) = sync_channel(1);
        let stopped = || Problem::new(ErrorCode::Internal, format!("map {:?} has stopped", map.id));
        map.work.send(Work::Save(reply)).map_err(|_| stopped())?;
        match done.recv_timeout(COMMAND_WAIT) {
            Ok(Ok(())) => saved.push(map.id.clone()),
            Ok(Err(e)) => return Err(Problem::new(ErrorCode::Internal, e)),
            Err(_) => return Err(Problem::new(ErrorCode::Busy, format!("map {:?} is busy", map.id))),
        }
    }
    Ok(saved)
}

/// `do/initial_pose?x_m=…;y_m=…;yaw_rad=…`.
fn told(arguments: Arguments) -> Result<(Option<String>, Mend), Problem> {
    let [map, id, x_m, y_m, yaw_rad, sigma_m, sigma_rad] =
        take(arguments, ["map", "id", "x_m", "y_m", "yaw_rad", "sigma_m", "sigma_rad"])?;
    let number = |field: &str, text: Option<String>, default: Option<f64>| match text {
        Some(text) => text.parse().map_err(|_| {
            Problem::new(ErrorCode::BadArgument, format!("{field} is {text:?}, must be a number"))
                .field(field)
        }),
        None => default.ok_or_else(|| {
            Problem::new(ErrorCode::BadArgument, format!("{field} is missing"))
                .field(field)
                .hint("?x_m=3.2&y_m=-1&yaw_rad=1.57, and how sure that is: sigma_m=0.5&sigma_rad=0.26")
        }),
    };
    let map_from_body = Pose {
        x_m: number("x_m", x_m, None)?,
        y_m: number("y_m", y_m, None)?,
        yaw_rad: number("yaw_rad", yaw_rad, None)?,
    };
    let sigma_m = number("sigma_m", sigma_m, Some(TOLD_SIGMA_M))?;
    let sigma_rad = number("sigma_rad", sigma_rad, Some(TOLD_SIGMA_RAD))?;
    let id = id.unwrap_or_else(|| Ulid::generate().to_string());
    Ok((map, Mend::Pose { id, map_from_body, sigma_m, sigma_rad }))
}

/// `do/area?polygon_m=0,0,4,0,4,3;name=…`, with `forbidden=true` or `instead=true`.
fn area(arguments: Arguments) -> Result<(Option<String>, Mend), Problem> {
    let [map, id, polygon_m, name, instead, forbidden] =
        take(arguments, ["map", "id", "polygon_m", "name", "instead", "forbidden"])?;
    let wrong = |field: &str, must: &str| {
        Problem::new(ErrorCode::BadArgument, format!("{field} must be {must}")).field(field)
    };
    let corners =
        || wrong("polygon_m", "x and y of each corner in the map, with commas between: 0,0,4,0,4,3");
    let numbers: Vec<f64> = polygon_m
        .ok_or_else(corners)?
        .split(',')
        .map(|number| number.trim().parse().map_err(|_| corners()))
        .collect::<Result<_, _>>()?;
    let (polygon_m, []) = numbers.as_chunks::<2>() else { return Err(corners()) };
    let flag = |field: &str, text: Option<String>| match text.as_deref() {
        None | Some("false") => Ok(false),
        Some("true") => Ok(true),
        Some(_) => Err(wrong(field, "true or false")),
    };
    let (instead, forbidden) = (flag("instead", instead)?, flag("forbidden", forbidden)?);
    let id = id.unwrap_or_else(|| Ulid::generate().to_string());
    Ok((map, Mend::Area { id, polygon_m: polygon_m.to_vec(), name, instead, forbidden }))
}

/// `do/undo?id=…`, `do/rename?from=…;to=…`, `do/forget?name=…`, each with `map=…` where there are several.
fn mend(board: &Board, command: &str, arguments: Arguments) -> Result<Reply, Problem> {
    let given = |field: &str, value: Option<String>| {
        value.ok_or_else(|| Problem::new(ErrorCode::BadArgument, format!("{field} is missing")).field(field))
    };
    let (id, mend) = match command {
        "undo" => {
            let [map, id] = take(arguments, ["map", "id"])?;
            (map, Mend::Undo { id })
        }
        "rename" => {
            let [map, from, to] = take(arguments, ["map", "from", "to"])?;
            (map, Mend::Rename { from: given("from", from)?, to: given("to", to)? })
        }
        "forget" => {
            let [map, name] = take(arguments, ["map", "name"])?;
            (map, Mend::Forget { name: given("name", name)? })
        }
        "area" => area(arguments)?,
        _ => told(arguments)?,
    };
    Message::Mend(mend.clone()).validate(&Limits::default()).map_err(Problem::from)?;
    let map = match id {
        Some(id) => map(board, &id)?,
        None => only_map(board)?,
    };
    let (reply, done) = sync_channel(1);
    let stopped = || Problem::new(ErrorCode::Internal, format!("map {:?} has stopped", map.id));
    map.work.send(Work::Mend(mend, reply)).map_err(|_| stopped())?;
    match done.recv_timeout(COMMAND_WAIT) {
        Ok(Ok(words)) => {
            let (query, of) = (command.to_owned(), map.id.clone());
            let reply = json(&Mended { v: ANSWER_VERSION, query, map: of.clone(), words, durable: true })?;
            // Nobody looking is no error.
            let _ =
                board.events.send(Arc::new(Published { name: "mended", json: reply.payload.clone(), of }));
            Ok(reply)
        }
        Ok(Err(why)) => Err(Problem::new(ErrorCode::NothingToMend, why)),
        // Not `busy`, which is asked again: it may be done yet.
        Err(_) => Err(Problem::new(ErrorCode::Internal, format!("map {:?} did not answer in time", map.id))),
    }
}

fn only_map(board: &Board) -> Result<Arc<MapView>, Problem> {
    let maps = board.maps.load();
    let mut all = maps.values();
    match (all.next(), all.next()) {
        (Some(only), None) => Ok(only.clone()),
        (None, _) => map(board, ""),
        _ => {
            let known: Vec<&str> = maps.keys().map(String::as_str).collect();
            let hint = format!("say which: {}", known.join(", "));
            Err(Problem::new(ErrorCode::BadArgument, "there are several maps").field("map").hint(hint))
        }
    }
}

/// `do/go?name=…`, with `map=…` or `robot=…` where there are several.
fn go(board: &Board, arguments: Arguments) -> Result<Reply, Problem> {
    let [id, robot, name, text, lang] = take(arguments, ["map", "robot", "name", "text", "lang"])?;
    let (text, lang) = (asked(name, text)?, known(lang)?);
    let map = match (id, &robot) {
        (Some(id), _) => map(board, &id)?,
        (None, Some(robot)) => map_of(board, robot)?,
        (None, None) => only_map(board)?,
    };
    check_robot(&map, robot.as_deref())?;
    // A robot that is lost can't find its way in the map.
    check_localised(&map.snapshot.load(), (&text, lang.as_deref()), true)?;
    let (from, answer) = map.answered.where_is(&map.snapshot.load_full(), &text, lang.as_deref());
    let answer = understood(answer)?;
    let sent = sent(convert::where_reply(answer, map.identity(&from), map.stamp(), &map.robot), &map.robot);
    if sent.goal.is_some() {
        hand_in(board, Arrival::Goal(Box::new(sent.clone())))?;
    }
    json(&sent)
}

/// To the likeliest, if there is a way.
fn sent(reply: WhereReply, robot: &str) -> Sent {
    let is_found = reply.is_found();
    let best: Option<&Candidate> = reply.candidates.first();
    let name = best.map_or(&reply.name, |best| &best.shown).clone();
    let goal = best.and_then(|best| best.goal.clone()).filter(|_| is_found);
    let is_shut = goal.as_ref().is_some_and(|goal: &Goal| goal.reachable == Reachable::No);
    let words = match (&goal, is_shut) {
        (None, _) => format!("{name}: rather nowhere in this map"),
        (Some(_), true) => format!("{name}: there is no way to it over floor that is known"),
        (Some(goal), false) => {
            format!("{robot} is sent to {name} (x {:.2} m, y {:.2} m)", goal.x_m, goal.y_m)
        }
    };
    Sent {
        v: ANSWER_VERSION,
        query: "go".into(),
        robot: robot.into(),
        stamp: reply.stamp,
        name,
        goal: goal.filter(|_| !is_shut),
        probability: best.map_or(0.0, |best| best.probability),
        words,
        map: reply.map,
    }
}

fn map_of(board: &Board, robot: &str) -> Result<Arc<MapView>, Problem> {
    board.maps.load().values().find(|map| map.robot == robot).cloned().ok_or_else(|| {
        Problem::new(ErrorCode::NoSuchRobot, format!("no map is of robot {robot:?}")).field("robot")
    })
}
